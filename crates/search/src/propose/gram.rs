//! Scores of sets of columns: regressions on Gram matrices, each block of rows left out in turn.

use nalgebra::DMatrix;
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::signal::dots;
use sindyscope_core::study::Cancel;

/// Most columns that one regression takes.
pub(super) const MOST: usize = 40;
/// Ridge on the diagonal of scaled normal equations, so that nearly dependent columns can be solved for.
const RIDGE: f64 = 1e-9;
/// Least variance of a whitened residual that counts: correlated rows leave less than one.
const LEAST_VARIANCE: f64 = 0.2;

/// Products of columns, over all rows and over each block. Column 0 is the target.
#[derive(Clone, Debug, Default)]
pub(super) struct Gram {
    total: DMatrix<f64>,
    blocks: Vec<(f64, DMatrix<f64>)>,
}

/// What a regression on all rows comes to.
#[derive(Clone, Debug)]
pub(super) struct GramSolution {
    pub(super) coefficients: Vec<f64>,
    pub(super) left: f64,
}

impl Gram {
    /// Of a cancelled search the products are not all there.
    pub(super) fn new(columns: &[Vec<f64>], blocks: &[std::ops::Range<usize>], cancel: &Cancel) -> Self {
        let mut gram = Self::default();
        gram.extend(columns, blocks, cancel);
        gram
    }

    /// Takes in the columns behind those that it knows; the rows and blocks are those of before.
    pub(super) fn extend(&mut self, columns: &[Vec<f64>], blocks: &[std::ops::Range<usize>], cancel: &Cancel) {
        let (before, count) = (self.total.ncols(), columns.len());
        if before == count {
            return;
        }
        self.blocks.resize_with(blocks.len(), || (0.0, DMatrix::zeros(0, 0)));
        self.blocks.par_iter_mut().zip(blocks.par_iter()).for_each(|((length, products), rows)| {
            *length = rows.len() as f64;
            *products = std::mem::take(products).resize(count, count, 0.0);
            // Not in tiles, which each processor adds up otherwise: where a fit lands may hang on the last digit of its start.
            let part = |k: usize| &columns[k][rows.clone()];
            let mut of_column = Vec::new();
            for j in before..count {
                if cancel.is_cancelled() {
                    break;
                }
                of_column.clear();
                dots(part(j), (0..=j).map(part), &mut of_column);
                for (i, product) in of_column.iter().enumerate() {
                    (products[(i, j)], products[(j, i)]) = (*product, *product);
                }
            }
        });
        let zero = DMatrix::zeros(count, count);
        self.total = self.blocks.iter().fold(zero, |sum, (_, block)| sum + block);
    }

    /// The same with further columns behind, over all rows alone; `columns` are those of before.
    pub(super) fn beside(&self, columns: &[&[f64]], further: &[Vec<f64>]) -> Self {
        let before = columns.len();
        let count = before + further.len();
        let all = |k: usize| columns.get(k).copied().unwrap_or_else(|| &further[k - before]);
        let mut total = self.total.clone().resize(count, count, 0.0);
        let mut of_column = Vec::new();
        for j in before..count {
            of_column.clear();
            dots(all(j), (0..=j).map(all), &mut of_column);
            for (i, product) in of_column.iter().enumerate() {
                (total[(i, j)], total[(j, i)]) = (*product, *product);
            }
        }
        Self { total, blocks: Vec::new() }
    }

    /// Least squares of the target on some columns; none where they cannot be told apart.
    pub(super) fn solve(&self, columns: &[usize]) -> Option<GramSolution> {
        let mut coefficients = vec![0.0; columns.len()];
        solve(|i, j| self.total[(i, j)], columns, &mut coefficients).then(|| {
            let gained: f64 = columns.iter().zip(&coefficients).map(|(c, x)| x * self.total[(*c, 0)]).sum();
            GramSolution { left: self.total[(0, 0)] - gained, coefficients }
        })
    }

    /// Log density of the blocks, each predicted from the others, in whitened rows; −∞ where that cannot be solved.
    pub(super) fn predictive(&self, columns: &[usize], worth: f64) -> f64 {
        let rows: f64 = self.blocks.iter().map(|b| b.0).sum();
        let mut x = [0.0; MOST];
        let x = &mut x[..columns.len()];
        let mut sum = 0.0;
        for (count, block) in &self.blocks {
            if !solve(|i, j| self.total[(i, j)] - block[(i, j)], columns, x) {
                return f64::NEG_INFINITY;
            }
            let mut left = self.total[(0, 0)] - block[(0, 0)];
            let mut missed = block[(0, 0)];
            for (i, c) in columns.iter().enumerate() {
                left -= x[i] * (self.total[(*c, 0)] - block[(*c, 0)]);
                missed -= 2.0 * x[i] * block[(*c, 0)];
                missed += columns.iter().zip(&*x).map(|(d, y)| x[i] * y * block[(*c, *d)]).sum::<f64>();
            }
            let freedom = (rows - count - columns.len() as f64 / worth).max(1.0);
            let variance = (left / freedom).max(LEAST_VARIANCE);
            sum -= 0.5 * (count * variance.ln() + missed.max(0.0) / variance);
        }
        worth * sum
    }
}

/// Solves the normal equations of the target (column 0) on some columns by Cholesky factorisation; false where they are
/// dependent.
fn solve(of: impl Fn(usize, usize) -> f64, columns: &[usize], x: &mut [f64]) -> bool {
    let n = columns.len();
    let mut a = [0.0; MOST * MOST];
    for i in 0..n {
        for j in 0..=i {
            let mut value = of(columns[i], columns[j]) * if i == j { 1.0 + RIDGE } else { 1.0 };
            let diagonal = value;
            for k in 0..j {
                value -= a[i * MOST + k] * a[j * MOST + k];
            }
            a[i * MOST + j] = if i == j {
                if value <= 1e-12 * diagonal {
                    return false;
                }
                value.sqrt()
            } else {
                value / a[j * MOST + j]
            };
        }
    }
    for i in 0..n {
        let mut value = of(columns[i], 0);
        for k in 0..i {
            value -= a[i * MOST + k] * x[k];
        }
        x[i] = value / a[i * MOST + i];
    }
    for i in (0..n).rev() {
        let mut value = x[i];
        for k in i + 1..n {
            value -= a[k * MOST + i] * x[k];
        }
        x[i] = value / a[i * MOST + i];
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_made_of_columns_is_solved_for_and_predicted() {
        let a: Vec<f64> = (0..40).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let b: Vec<f64> = (0..40).map(|k| (0.7 * f64::from(k)).cos()).collect();
        let y: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 2.0 * a - 3.0 * b).collect();
        let gram = Gram::new(&[y, a, b], &[0..20, 20..40], &Cancel::default());
        let solution = gram.solve(&[1, 2]).expect("independent columns");
        assert!((solution.coefficients[0] - 2.0).abs() < 1e-6 && solution.left.abs() < 1e-6);
        assert!(gram.predictive(&[1, 2], 1.0) > gram.predictive(&[1], 1.0));
    }

    #[test]
    fn columns_that_come_later_have_the_same_products() {
        let column = |k: usize| (0..50).map(|i| (0.1 * (i * k) as f64).sin()).collect::<Vec<f64>>();
        let all: Vec<Vec<f64>> = (1..12).map(column).collect();
        let (blocks, cancel) = ([0..20, 20..50], Cancel::default());
        let at_once = Gram::new(&all, &blocks, &cancel);
        let mut later = Gram::new(&all[..5], &blocks, &cancel);
        later.extend(&all, &blocks, &cancel);
        assert_eq!((later.total, later.blocks), (at_once.total, at_once.blocks));
    }
}
