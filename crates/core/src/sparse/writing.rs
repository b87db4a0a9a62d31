//! Which of several ways to write one force is the sparse one.

use std::sync::Arc;

use super::redundancy::{MIN_REDUCTION, Redundancy};
use super::stlsq::{fitted, fixed};
use super::{Constraint, Reduced, Solution, SparseOptions};

/// Rounds of choosing a way to write the forces and thresholding in it, at most.
const MAX_ROUNDS: usize = 3;
/// Constraints under which one writing is left, as plain least squares on everything decides; none where there is one only.
fn first_writing(
    redundancy: &Redundancy,
    reduced: &Reduced,
    constraints: &[Constraint],
    options: &SparseOptions,
) -> Option<Vec<Constraint>> {
    let open = open(redundancy, reduced, constraints);
    let basis = redundancy.independent(&open);
    if basis.len() == open.len() {
        return None;
    }
    let keep = fitted(reduced, &only(constraints, &open, &basis));
    let (b, _) = reduced.solve(&keep, &fixed(constraints), |k| options.ridge_weight(reduced, k));
    let coefficient = |k: &usize| {
        let place = keep.iter().position(|j| j == k).unwrap_or(0);
        b[place] * reduced.target_scale() / reduced.scale()[*k]
    };
    let mut writing: Vec<(usize, f64)> = basis.iter().map(|k| (*k, coefficient(k))).collect();
    redundancy.shorten(&mut writing, &open, reduced.scale(), &|k| constraints[k] == Constraint::In);
    Some(only(constraints, &open, &writing.iter().map(|(k, _)| *k).collect::<Vec<_>>()))
}

/// The columns with relations whose coefficients are to be found, those that are kept whatever happens first.
fn open(redundancy: &Redundancy, reduced: &Reduced, constraints: &[Constraint]) -> Vec<usize> {
    let mut open: Vec<usize> =
        fitted(reduced, constraints).into_iter().filter(|k| redundancy.place(*k).is_some()).collect();
    open.sort_by_key(|k| constraints[*k] != Constraint::In);
    open
}

/// The constraints with all of the open columns but those of a writing left out.
fn only(constraints: &[Constraint], open: &[usize], writing: &[usize]) -> Vec<Constraint> {
    let mut constraints = constraints.to_vec();
    for k in open.iter().filter(|k| !writing.contains(k)) {
        constraints[*k] = Constraint::Out;
    }
    constraints
}

/// Constraints with a sparser writing of what a solution keeps; none where there is none.
fn better_writing(
    redundancy: &Redundancy,
    reduced: &Reduced,
    constraints: &[Constraint],
    written: &[Constraint],
    solution: &Solution,
) -> Option<Vec<Constraint>> {
    let open = open(redundancy, reduced, constraints);
    let mut writing: Vec<(usize, f64)> = open
        .iter()
        .filter(|k| written[**k] != Constraint::Out)
        .map(|k| (*k, if solution.support.contains(k) { solution.coefficients[*k] } else { 0.0 }))
        .collect();
    let shorter = redundancy.shorten(&mut writing, &open, reduced.scale(), &|k| constraints[k] == Constraint::In);
    shorter.then(|| only(constraints, &open, &writing.iter().map(|(k, _)| *k).collect::<Vec<_>>()))
}

/// The constraints with one writing left of what can be written in several ways.
pub(super) fn one_writing(reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Vec<Constraint> {
    let redundancy = reduced.redundancy();
    redundancy.and_then(|r| first_writing(r, reduced, constraints, options)).unwrap_or_else(|| constraints.to_vec())
}

/// Solves with one writing of what can be written in several ways: that of everything first, then, as long as there is a
/// sparser one, that of what was kept.
pub(super) fn solve(
    reduced: &Reduced,
    constraints: &[Constraint],
    options: &SparseOptions,
    solve: &dyn Fn(&[Constraint]) -> Solution,
) -> Solution {
    let Some(redundancy) = reduced.redundancy() else { return solve(constraints) };
    let Some(mut written) = first_writing(redundancy, reduced, constraints, options) else { return solve(constraints) };
    let mut solution = solve(&written);
    for _ in 0..MAX_ROUNDS {
        let Some(next) = better_writing(redundancy, reduced, constraints, &written, &solution) else { break };
        let other = solve(&next);
        // Of fewer terms, or as many that leave less; so no round undoes the one before.
        let order = |s: &Solution| (s.support.len(), s.residual_rms);
        let (a, b) = (order(&other), order(&solution));
        if a.0 > b.0 || a.0 == b.0 && a.1 > b.1 * (1.0 + MIN_REDUCTION) {
            break;
        }
        (written, solution) = (next, other);
    }
    solution
}

impl Reduced {
    /// This problem, told which of its columns are sums of others.
    #[must_use]
    pub(crate) fn redundant(mut self, redundancy: Option<Arc<Redundancy>>) -> Self {
        self.redundancy = redundancy;
        self
    }

    fn redundancy(&self) -> Option<&Redundancy> {
        self.redundancy.as_deref()
    }

    /// Of some columns those that are, as their relations tell, no sum of ones before them.
    pub fn independent(&self, columns: &[usize]) -> Vec<usize> {
        self.redundancy().map_or_else(|| columns.to_vec(), |r| r.independent(columns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Regressor;
    use nalgebra::DMatrix;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    /// Columns x1, x2, x2-x1, x3, x3-x2 and a target made of some of them, with noise.
    fn chain(weights: [f64; 5], noise: f64) -> Reduced {
        let n = 400;
        let mut random = rand_pcg::Pcg64::seed_from_u64(4);
        let wave =
            |a: f64, b: f64| -> Vec<f64> { (0..n).map(|k| (a * k as f64).sin() + (b * k as f64).cos()).collect() };
        let (x1, x2, x3) = (wave(0.11, 0.23), wave(0.113, 0.31), wave(0.07, 0.29));
        let less = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
        let (d21, d32) = (less(&x2, &x1), less(&x3, &x2));
        let columns = [x1, x2, d21, x3, d32];
        let y: Vec<f64> = (0..n)
            .map(|k| {
                let deviate: f64 = StandardNormal.sample(&mut random);
                noise * deviate + columns.iter().zip(weights).map(|(c, w)| w * c[k]).sum::<f64>()
            })
            .collect();
        let parts = DMatrix::from_column_slice(
            3,
            5,
            &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 1.0],
        );
        Reduced::new(&columns, &y).redundant(Redundancy::new(&parts).map(Arc::new))
    }

    #[test]
    fn of_one_force_written_in_several_ways_the_sparse_one_is_kept() {
        let free = [Constraint::Free; 5];
        let options = SparseOptions { threshold: 0.05, ridge: 0.0, scaled: true };
        for (weights, support) in [
            ([0.0, 0.0, -3.0, 0.0, 0.0], vec![2]),
            ([-2.0, 0.0, 3.0, 0.0, 0.0], vec![0, 2]),
            ([0.0, 0.0, -3.0, 0.0, 2.0], vec![2, 4]),
            ([0.0, -1.0, 0.0, 0.0, 2.5], vec![1, 4]),
            ([0.0, 0.0, 0.0, 4.0, 0.0], vec![3]),
        ] {
            for regressor in Regressor::ALL {
                let reduced = chain(weights, 0.01);
                let solution = regressor.solve(&reduced, &free, &options);
                assert_eq!(solution.support, support, "{regressor:?} {weights:?}");
                for (found, truth) in solution.coefficients.iter().zip(weights) {
                    assert!((found - truth).abs() < 0.01, "{regressor:?} {weights:?} {:?}", solution.coefficients);
                }
            }
        }
    }

    #[test]
    fn locked_columns_stay_in_the_writing() {
        let mut constraints = [Constraint::Free; 5];
        constraints[1] = Constraint::In;
        let options = SparseOptions { threshold: 0.05, ridge: 0.0, scaled: true };
        let solution = Regressor::Stlsq.solve(&chain([0.0, 0.0, -3.0, 0.0, 0.0], 0.0), &constraints, &options);
        assert!(solution.support.contains(&1), "{solution:?}");
        assert!(solution.residual_rms < 1e-9);
    }

    #[test]
    fn columns_without_relations_are_none() {
        assert!(Redundancy::new(&DMatrix::identity(3, 3)).is_none());
        let parts = DMatrix::from_column_slice(3, 4, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(Redundancy::new(&parts).unwrap().columns, [0, 1, 2]);
    }
}
