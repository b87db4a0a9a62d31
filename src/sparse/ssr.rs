use super::front::Front;
use super::stlsq::{fitted, fixed};
use super::{Constraint, Options, Reduced};

/// Stepwise sparse regression (Boninsegna, Nüske & Clementi 2018): the free column with the smallest coefficient leaves,
/// one after the other, each time refitted (with the options' ridge).
pub(super) fn ssr(reduced: &Reduced, constraints: &[Constraint], options: &Options) -> Front {
    let mut sets = Vec::new();
    let mut keep = fitted(reduced, constraints);
    let fixed = fixed(constraints);
    loop {
        sets.push(keep.clone());
        let (b, _) = reduced.solve(&keep, &fixed, |k| options.ridge_weight(reduced, k));
        let size = |b: f64, k: usize| if options.scaled { b.abs() } else { (b / reduced.scale()[k]).abs() };
        let free = keep.iter().enumerate().filter(|(_, k)| constraints[**k] == Constraint::Free);
        let smallest = free.min_by(|(i, k), (j, l)| size(b[*i], **k).total_cmp(&size(b[*j], **l)));
        let Some((place, _)) = smallest else { break };
        keep.remove(place);
    }
    sets.reverse();
    Front::new(reduced, constraints, sets.into_iter())
}
