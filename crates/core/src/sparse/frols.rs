//! Forward orthogonal selection.

use super::candidate_models::CandidateModels;
use super::orthogonal::{DEPENDENT_POWER, Remainder};
use super::{Constraint, Reduced};

/// Forward regression by orthogonal least squares (Chen, Billings & Luo 1989; Billings 2013): each time the free column
/// joins whose part orthogonal to those before explains most of the target.
pub(super) fn frols(reduced: &Reduced, constraints: &[Constraint]) -> CandidateModels {
    let Remainder { mut columns, mut target, free, locked } = Remainder::new(reduced, constraints);
    let smallest = DEPENDENT_POWER * reduced.rows() as f64;
    let mut left: Vec<usize> = (0..free.len()).collect();
    let mut set = locked;
    let mut sets = vec![set.clone()];
    loop {
        let explained = |k: usize| {
            let power = columns[k].norm_squared();
            if power > smallest { columns[k].dot(&target).powi(2) / power } else { 0.0 }
        };
        let shares = left.iter().enumerate().map(|(place, k)| (place, explained(*k)));
        let Some((place, _)) = shares.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        let chosen = left.remove(place);
        let direction = columns[chosen].clone();
        let power = direction.norm_squared();
        if power > smallest {
            for k in &left {
                let share = direction.dot(&columns[*k]) / power;
                columns[*k].axpy(-share, &direction, 1.0);
            }
            let share = direction.dot(&target) / power;
            target.axpy(-share, &direction, 1.0);
        }
        set.push(free[chosen]);
        sets.push(set.clone());
    }
    CandidateModels::new(reduced, constraints, sets.into_iter())
}
