//! Normal equations of arrow shape: a block that all runs share, and one for what each run has of its own.
//!
//! The blocks of the runs are eliminated one by one (with `M = SᵀS` of a run's own columns and `C = SᵀJ` of its own against
//! the shared ones, the shared block becomes `Σ JᵀJ − CᵀM⁻¹C`), so the cost grows with the number of runs, not with its cube.

use nalgebra::{DMatrix, DVector};

use crate::signal::dot;

/// Sums of products of sensitivities and residuals.
pub(super) struct Arrow {
    /// Shared against shared.
    pub(super) whole: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    runs: Vec<RunBlock>,
}

struct RunBlock {
    square: DMatrix<f64>,
    /// Own rows, shared columns.
    cross: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// The shared block and its right side with the runs' own values eliminated, and the inverse of each run's own block.
struct Condensed {
    whole: DMatrix<f64>,
    gradient: DVector<f64>,
    inverses: Vec<DMatrix<f64>>,
}

/// What a step changes: the shared part, and one a run.
pub(super) struct Correction {
    pub(super) shared: Vec<f64>,
    pub(super) own: Vec<DVector<f64>>,
}

/// Ridge, as a share of the diagonal, that keeps a block with collinear columns invertible.
const RIDGE: f64 = 1e-13;

impl Arrow {
    pub(super) fn new(shared: usize) -> Self {
        Self { whole: DMatrix::zeros(shared, shared), gradient: DVector::zeros(shared), runs: Vec::new() }
    }

    /// Takes rows in that the first shared values alone make up.
    pub(super) fn add(&mut self, columns: &[Vec<f64>], residual: &[f64]) {
        for (i, a) in columns.iter().enumerate() {
            self.gradient[i] += dot(a, residual);
            for (j, b) in columns.iter().enumerate() {
                self.whole[(i, j)] += dot(a, b);
            }
        }
    }

    /// Takes a run in: `columns[k]` belongs to the shared parameter `places[k]`, the columns after those to the run itself.
    pub(super) fn push(&mut self, columns: &[Vec<f64>], places: &[usize], residual: &[f64]) {
        let (shared, own) = columns.split_at(places.len());
        for (i, a) in shared.iter().enumerate() {
            self.gradient[places[i]] += dot(a, residual);
            for (j, b) in shared[..=i].iter().enumerate() {
                let sum = dot(a, b);
                self.whole[(places[i], places[j])] += sum;
                if i != j {
                    self.whole[(places[j], places[i])] += sum;
                }
            }
        }
        let m = own.len();
        let mut cross = DMatrix::zeros(m, self.gradient.len());
        let square = DMatrix::from_fn(m, m, |i, j| if j <= i { dot(&own[i], &own[j]) } else { 0.0 });
        let square = DMatrix::from_fn(m, m, |i, j| if j <= i { square[(i, j)] } else { square[(j, i)] });
        for (i, a) in own.iter().enumerate() {
            for (b, place) in shared.iter().zip(places) {
                cross[(i, *place)] += dot(a, b);
            }
        }
        let gradient = DVector::from_iterator(m, own.iter().map(|a| dot(a, residual)));
        self.runs.push(RunBlock { square, cross, gradient });
    }

    /// Eliminates the runs' own values; `damping` is added to the diagonal of each of their blocks as a share of it.
    fn condensed(&self, damping: f64) -> Option<Condensed> {
        let mut whole = self.whole.clone();
        let mut gradient = self.gradient.clone();
        let mut inverses = Vec::with_capacity(self.runs.len());
        for own in &self.runs {
            let inverse = scaled_inverse(&own.square, damping)?;
            let product = &inverse * &own.cross;
            whole -= own.cross.transpose() * &product;
            gradient -= product.transpose() * &own.gradient;
            inverses.push(inverse);
        }
        Some(Condensed { whole, gradient, inverses })
    }

    /// The step of Levenberg and Marquardt from shared values `at` within `bounds` (`limit`: the largest change of each).
    /// A value that would pass a bound is held there and the others are sought anew.
    pub(super) fn step(&self, damping: f64, at: &[f64], bounds: &[(f64, f64)]) -> Option<Correction> {
        let Condensed { whole, gradient, inverses } = self.condensed(damping)?;
        let n = gradient.len();
        let mut step = vec![0.0; n];
        let mut free: Vec<usize> = (0..n).collect();
        loop {
            let held: Vec<usize> = (0..n).filter(|i| !free.contains(i)).collect();
            let right = DVector::from_iterator(
                free.len(),
                free.iter().map(|i| gradient[*i] - held.iter().map(|j| whole[(*i, *j)] * step[*j]).sum::<f64>()),
            );
            // Damping is measured by the whole diagonal: what the runs' own values take away is no ground to go further.
            let diagonal: Vec<f64> = free.iter().map(|i| self.whole[(*i, *i)]).collect();
            let scale: Vec<f64> = diagonal.iter().map(|d| unit(*d)).collect();
            let m = free.len();
            let mut scaled = DMatrix::from_fn(m, m, |i, j| whole[(free[i], free[j])] * scale[i] * scale[j]);
            for i in 0..m {
                scaled[(i, i)] += damping + RIDGE;
                if scale[i] == 0.0 {
                    scaled[(i, i)] = 1.0;
                }
            }
            let right = DVector::from_fn(m, |i, _| right[i] * scale[i]);
            let solved = scaled.cholesky()?.solve(&right);
            for (k, i) in free.iter().enumerate() {
                step[*i] = solved[k] * scale[k];
            }
            let mut clamped = false;
            free.retain(|i| {
                let Some((low, high)) = bounds.get(*i) else { return true };
                let next = at[*i] + step[*i];
                if (*low..=*high).contains(&next) {
                    return true;
                }
                step[*i] = next.clamp(*low, *high) - at[*i];
                clamped = true;
                false
            });
            if !clamped {
                break;
            }
        }
        let shared = DVector::from_column_slice(&step);
        let own =
            self.runs.iter().zip(&inverses).map(|(own, inverse)| inverse * (&own.gradient - &own.cross * &shared));
        Some(Correction { own: own.collect(), shared: step })
    }

    /// The inverse of the condensed shared block over the first `count` shared values, those in `held` left out (zero).
    pub(super) fn inverse(&self, count: usize, held: &[bool]) -> Option<DMatrix<f64>> {
        let whole = self.condensed(0.0)?.whole;
        let free: Vec<usize> = (0..whole.nrows()).filter(|i| !held.get(*i).copied().unwrap_or(false)).collect();
        let part = DMatrix::from_fn(free.len(), free.len(), |i, j| whole[(free[i], free[j])]);
        let inverse = scaled_inverse(&part, 0.0)?;
        let mut out = DMatrix::zeros(count, count);
        for (i, a) in free.iter().enumerate().filter(|(_, a)| **a < count) {
            for (j, b) in free.iter().enumerate().filter(|(_, b)| **b < count) {
                out[(*a, *b)] = inverse[(i, j)];
            }
        }
        Some(out)
    }
}

fn unit(square: f64) -> f64 {
    if square > 0.0 { square.sqrt().recip() } else { 0.0 }
}

/// The inverse of a normal matrix, by way of unit columns; a column without effect counts as one of its own.
pub(crate) fn scaled_inverse(normal: &DMatrix<f64>, damping: f64) -> Option<DMatrix<f64>> {
    let n = normal.nrows();
    let scale: Vec<f64> = (0..n).map(|i| unit(normal[(i, i)])).collect();
    let mut scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    for i in 0..n {
        scaled[(i, i)] += damping + RIDGE;
        if scale[i] == 0.0 {
            scaled[(i, i)] = 1.0;
        }
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three runs of six rows with two shared columns and two of their own each.
    fn columns(run: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
        let value = |k: usize, row: usize| (((k + 2) * (row + 1)) as f64 * 0.7 + 1.3 * run as f64).sin();
        ((0..4).map(|k| (0..6).map(|row| value(k, row)).collect()).collect(), (0..6).map(|r| value(9, r)).collect())
    }

    fn arrow() -> Arrow {
        let mut arrow = Arrow::new(2);
        for run in 0..3 {
            let (columns, residual) = columns(run);
            arrow.push(&columns, &[0, 1], &residual);
        }
        arrow
    }

    /// The same as one dense least-squares problem.
    fn dense() -> (DMatrix<f64>, DVector<f64>) {
        let mut matrix = DMatrix::zeros(18, 8);
        let mut right = DVector::zeros(18);
        for run in 0..3 {
            let (columns, residual) = columns(run);
            for row in 0..6 {
                right[6 * run + row] = residual[row];
                for (k, column) in columns.iter().enumerate() {
                    let place = if k < 2 { k } else { 2 + 2 * run + k - 2 };
                    matrix[(6 * run + row, place)] = column[row];
                }
            }
        }
        (matrix, right)
    }

    #[test]
    fn elimination_gives_the_step_and_the_covariance_of_the_dense_problem() {
        let (matrix, right) = dense();
        let normal = matrix.transpose() * &matrix;
        let solved = normal.clone().cholesky().unwrap().solve(&(matrix.transpose() * right));
        let step = arrow().step(0.0, &[0.0, 0.0], &[]).unwrap();
        for (k, value) in step.shared.iter().copied().chain(step.own.iter().flatten().copied()).enumerate() {
            assert!((value - solved[k]).abs() < 1e-8, "{k}: {value} {}", solved[k]);
        }
        let inverse = normal.cholesky().unwrap().inverse();
        let found = arrow().inverse(2, &[]).unwrap();
        for i in 0..2 {
            for j in 0..2 {
                assert!((found[(i, j)] - inverse[(i, j)]).abs() < 1e-8 * inverse[(i, i)]);
            }
        }
    }

    #[test]
    fn a_value_at_its_bound_stays_there_and_the_others_are_the_best_beside_it() {
        let free = arrow().step(0.0, &[0.0, 0.0], &[]).unwrap().shared;
        let bound = 0.5 * free[0];
        let bounds = if free[0] > 0.0 { (f64::NEG_INFINITY, bound) } else { (bound, f64::INFINITY) };
        let held = arrow().step(0.0, &[0.0, 0.0], &[bounds, (f64::NEG_INFINITY, f64::INFINITY)]).unwrap();
        assert!((held.shared[0] - bound).abs() < 1e-12);
        // The dense problem with the first unknown known.
        let (matrix, right) = dense();
        let rest = matrix.columns(1, 7).clone_owned();
        let right = right - matrix.column(0) * bound;
        let solved = (rest.transpose() * &rest).cholesky().unwrap().solve(&(rest.transpose() * right));
        assert!((held.shared[1] - solved[0]).abs() < 1e-8);
    }
}
