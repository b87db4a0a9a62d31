//! Exhaustive search among subsets.

use nalgebra::DVector;

use super::candidate_models::CandidateModels;
use super::orthogonal::{DEPENDENT_POWER, Remainder};
use super::{Constraint, Reduced, SparseOptions, ssr};

/// Free columns, at most, of which all subsets are tried (2¹⁶ = 65 536); of more, those that elimination drops first are
/// left out.
pub(super) const MAX_FREE_COLUMNS: usize = 16;

/// For each number of columns the subset that leaves least, found among all of them.
///
/// Of more than [`MAX_FREE_COLUMNS`] free columns those that stepwise elimination drops first are left out.
pub(super) fn best_subsets(reduced: &Reduced, constraints: &[Constraint]) -> CandidateModels {
    let constraints = &at_most(reduced, constraints);
    let remainder = Remainder::new(reduced, constraints);
    let mut best = vec![(f64::INFINITY, 0_u32); remainder.free.len() + 1];
    subsets(&remainder, &mut |subset, left| {
        let slot = &mut best[subset.count_ones() as usize];
        if left < slot.0 {
            *slot = (left, subset);
        }
    });
    let members = |subset: u32| -> Vec<usize> {
        let chosen = remainder.free.iter().enumerate().filter(|(i, _)| subset >> i & 1 == 1).map(|(_, k)| *k);
        remainder.locked.iter().copied().chain(chosen).collect()
    };
    CandidateModels::new(reduced, constraints, best.into_iter().map(|(_, subset)| members(subset)))
}

/// The constraints with columns left out until no more than [`MAX_FREE_COLUMNS`] are free.
fn at_most(reduced: &Reduced, constraints: &[Constraint]) -> Vec<Constraint> {
    let mut constraints = constraints.to_vec();
    let free = (0..constraints.len()).filter(|k| constraints[*k] == Constraint::Free && !reduced.unusable(*k));
    if free.count() > MAX_FREE_COLUMNS {
        let options = SparseOptions { threshold: 0.0, ridge: 0.0, scaled: true };
        let locked = constraints.iter().filter(|c| **c == Constraint::In).count();
        let kept =
            ssr::sets(reduced, &constraints, &options).into_iter().rfind(|set| set.len() <= MAX_FREE_COLUMNS + locked);
        for (k, constraint) in constraints.iter_mut().enumerate() {
            if *constraint == Constraint::Free && !kept.as_ref().is_some_and(|set| set.contains(&k)) {
                *constraint = Constraint::Out;
            }
        }
    }
    constraints
}

/// Calls `see` with every subset of the free columns, as bits, and the sum of squares that it leaves of the scaled target.
fn subsets(remainder: &Remainder, see: &mut dyn FnMut(u32, f64)) {
    let count = remainder.free.len();
    // What is left of each column and of the target once the columns before it are decided, a level for each decision.
    let mut levels: Vec<Vec<DVector<f64>>> =
        (0..=count).map(|depth| vec![DVector::zeros(remainder.target.len()); count + 1 - depth]).collect();
    levels[0] = remainder.columns.iter().chain([&remainder.target]).cloned().collect();
    let whole: Vec<f64> = remainder.columns.iter().map(DVector::norm_squared).collect();
    descend(&mut levels, &whole, 0, 0, see);
}

/// Decides on the first column of the first level, once against and once for it, and so on.
fn descend(levels: &mut [Vec<DVector<f64>>], whole: &[f64], depth: usize, subset: u32, see: &mut dyn FnMut(u32, f64)) {
    let Some((here, deeper)) = levels.split_first_mut() else { return };
    let ([column, others @ ..], Some(power)) = (here.as_slice(), whole.get(depth)) else {
        see(subset, here.last().map_or(0.0, DVector::norm_squared));
        return;
    };
    for with in [false, true] {
        let left = column.norm_squared();
        if let Some(next) = deeper.first_mut() {
            for (to, from) in next.iter_mut().zip(others) {
                to.copy_from(from);
                if with && left > DEPENDENT_POWER * power {
                    to.axpy(-column.dot(from) / left, column, 1.0);
                }
            }
        }
        descend(deeper, whole, depth + 1, subset | u32::from(with) << depth, see);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::Solution;
    use rand::{RngExt as _, SeedableRng as _};

    fn random(rows: usize, columns: usize, seed: u64) -> (Vec<Vec<f64>>, Vec<f64>) {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut column = || (0..rows).map(|_| random.random_range(-1.0..1.0)).collect::<Vec<f64>>();
        let common = column();
        let columns: Vec<Vec<f64>> =
            (0..columns).map(|_| column().iter().zip(&common).map(|(a, b)| a + 0.8 * b).collect()).collect();
        let noise = column();
        let y = (0..rows)
            .map(|r| columns.iter().enumerate().map(|(k, c)| c[r] / (1 + k * k) as f64).sum::<f64>() + 0.3 * noise[r])
            .collect();
        (columns, y)
    }

    #[test]
    fn no_subset_of_its_size_leaves_less() {
        let (columns, y) = random(60, 7, 5);
        let reduced = Reduced::new(&columns, &y);
        let mut constraints = vec![Constraint::Free; 7];
        constraints[3] = Constraint::In;
        constraints[5] = Constraint::Fixed(0.4);
        let front = best_subsets(&reduced, &constraints);
        let left = |set: &[usize]| Solution::on(&reduced, &constraints, set.to_vec()).residual_rms;
        let mut least = [f64::INFINITY; 6];
        for bits in 0..1_u32 << 7 {
            if bits >> 3 & 1 == 1 && bits >> 5 & 1 == 0 {
                let set: Vec<usize> = (0..7).filter(|k| bits >> k & 1 == 1).collect();
                least[set.len() - 1] = least[set.len() - 1].min(left(&set));
            }
        }
        for (set, least) in front.supports().zip(least) {
            assert!(set.contains(&3) && !set.contains(&5));
            assert!(left(set) <= least * (1.0 + 1e-12), "{set:?}");
        }
        assert_eq!(front.supports().count(), 6);
    }

    #[test]
    fn columns_that_repeat_another_and_large_libraries_are_no_catastrophe() {
        let (mut columns, y) = random(80, 18, 6);
        columns.push(columns[0].clone());
        columns.push(vec![0.0; 80]);
        let front = best_subsets(&Reduced::new(&columns, &y), &[Constraint::Free; 20]);
        let sizes: Vec<usize> = front.supports().map(<[usize]>::len).collect();
        assert_eq!(sizes, (0..=MAX_FREE_COLUMNS).collect::<Vec<_>>());
        assert!(front.supports().all(|set| !set.contains(&19)));
    }
}
