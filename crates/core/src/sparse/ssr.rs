//! Stepwise sparse regression.

use super::candidate_models::CandidateModels;
use super::stlsq::{fitted, fixed};
use super::{Constraint, Reduced, SparseOptions};

/// Stepwise sparse regression (Boninsegna, Nüske & Clementi 2018): the free column with the smallest coefficient leaves,
/// one after the other, each time refitted (with the options' ridge).
pub(super) fn ssr(reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> CandidateModels {
    CandidateModels::new(reduced, constraints, sets(reduced, constraints, options).into_iter())
}

/// The sets that elimination goes through, the smallest first.
pub(super) fn sets(reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Vec<Vec<usize>> {
    let mut sets = Vec::new();
    let mut keep = fitted(reduced, constraints);
    let fixed = fixed(constraints);
    loop {
        sets.push(keep.clone());
        let (b, _) = reduced.solve(&keep, &fixed, |k| options.ridge_weight(reduced, k));
        let size = |b: f64, k: usize| if options.scaled { b.abs() } else { (b / reduced.scale()[k]).abs() };
        let free = b.iter().zip(&keep).enumerate().filter(|(_, (_, k))| constraints[**k] == Constraint::Free);
        let sizes = free.map(|(place, (b, k))| (place, size(*b, *k)));
        let Some((place, _)) = sizes.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        keep.remove(place);
    }
    sets.reverse();
    sets
}
