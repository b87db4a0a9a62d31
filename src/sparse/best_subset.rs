use nalgebra::DVector;

use super::front::Front;
use super::orthogonal::Remainder;
use super::{Constraint, Options, Reduced, ssr};

/// Most free columns of which all subsets are tried: 65 536.
pub(super) const MOST: usize = 16;

/// For each number of columns the subset that leaves least, found among all of them (Furnival & Wilson 1974 say how; at
/// this size plain enumeration will do).
///
/// Of more than [`MOST`] free columns those that stepwise elimination drops first are left out.
pub(super) fn best_subsets(reduced: &Reduced, constraints: &[Constraint]) -> Front {
    let constraints = &at_most(reduced, constraints);
    let remainder = Remainder::new(reduced, constraints);
    let mut best = vec![(f64::INFINITY, 0_u32); remainder.free.len() + 1];
    subsets(&remainder, &mut |subset, left| {
        let slot = &mut best[subset.count_ones() as usize];
        if left < slot.0 {
            *slot = (left, subset);
        }
    });
    let sets = best.into_iter().map(|(_, subset)| members(&remainder, subset));
    Front::new(reduced, constraints, sets)
}

/// The columns of a subset, those that stay in any case with it.
pub(super) fn members(remainder: &Remainder, subset: u32) -> Vec<usize> {
    let chosen = remainder.free.iter().enumerate().filter(|(i, _)| subset >> i & 1 == 1).map(|(_, k)| *k);
    remainder.locked.iter().copied().chain(chosen).collect()
}

/// The constraints with so many columns locked out that few enough are free.
pub(super) fn at_most(reduced: &Reduced, constraints: &[Constraint]) -> Vec<Constraint> {
    let mut constraints = constraints.to_vec();
    let free = |c: &[Constraint]| (0..c.len()).filter(|k| c[*k] == Constraint::Free && !reduced.unusable(*k)).count();
    if free(&constraints) > MOST {
        let options = Options { threshold: 0.0, ridge: 0.0, scaled: true };
        let locked = constraints.iter().filter(|c| **c == Constraint::In).count();
        let kept = ssr::sets(reduced, &constraints, &options).into_iter().rfind(|set| set.len() <= MOST + locked);
        for (k, constraint) in constraints.iter_mut().enumerate() {
            if *constraint == Constraint::Free && !kept.as_ref().is_some_and(|set| set.contains(&k)) {
                *constraint = Constraint::Out;
            }
        }
    }
    constraints
}

/// Calls `see` with every subset of the free columns, as bits, and the sum of squares that it leaves of the scaled target.
pub(super) fn subsets(remainder: &Remainder, see: &mut dyn FnMut(u32, f64)) {
    let count = remainder.free.len();
    // What is left of each column and of the target once the columns before it are decided, a level for each decision.
    let mut levels: Vec<Vec<DVector<f64>>> = vec![Vec::new(); count + 1];
    levels[0] = remainder.columns.iter().chain([&remainder.target]).cloned().collect();
    for (depth, level) in levels.iter_mut().enumerate().skip(1) {
        *level = vec![DVector::zeros(remainder.target.len()); count + 1 - depth];
    }
    let whole: Vec<f64> = remainder.columns.iter().map(DVector::norm_squared).collect();
    descend(&mut levels, &whole, 0, see);
}

/// Decides on the first column of the first level, and on.
fn descend(levels: &mut [Vec<DVector<f64>>], whole: &[f64], subset: u32, see: &mut dyn FnMut(u32, f64)) {
    let [here, rest @ ..] = levels else { return };
    let Some(next) = rest.first_mut() else {
        see(subset, here.last().map_or(0.0, DVector::norm_squared));
        return;
    };
    for (to, from) in next.iter_mut().zip(&here[1..]) {
        to.copy_from(from);
    }
    let (depth_whole, deeper) = (whole[0], &whole[1..]);
    let bit = subset_bit(deeper.len(), rest.len());
    descend(rest, deeper, subset, see);
    let power = here[0].norm_squared();
    let next = &mut rest[0];
    for (to, from) in next.iter_mut().zip(&here[1..]) {
        to.copy_from(from);
        // What is left of a column that depends on those before is rounding.
        if power > 1e-20 * depth_whole {
            to.axpy(-here[0].dot(from) / power, &here[0], 1.0);
        }
    }
    descend(rest, deeper, subset | bit, see);
}
