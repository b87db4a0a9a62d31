use super::front::Front;
use super::orthogonal::Remainder;
use super::{Constraint, Reduced};

/// Forward regression by orthogonal least squares (Chen, Billings & Luo 1989; Billings 2013): each time the free column
/// joins whose part orthogonal to those before explains most of the target.
pub(super) fn frols(reduced: &Reduced, constraints: &[Constraint]) -> Front {
    let Remainder { mut columns, mut target, free, locked } = Remainder::new(reduced, constraints);
    let mut left: Vec<usize> = (0..free.len()).collect();
    let mut set = locked;
    let mut sets = vec![set.clone()];
    while !left.is_empty() {
        let explained = |k: usize| {
            let power = columns[k].norm_squared();
            // What is left of a column that depends on those before is rounding.
            if power > 1e-20 * reduced.rows() as f64 { columns[k].dot(&target).powi(2) / power } else { 0.0 }
        };
        let Some(place) = (0..left.len()).max_by(|a, b| explained(left[*a]).total_cmp(&explained(left[*b]))) else {
            break;
        };
        let chosen = left.remove(place);
        let direction = columns[chosen].clone();
        let power = direction.norm_squared();
        if power > 1e-20 * reduced.rows() as f64 {
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
    Front::new(reduced, constraints, sets.into_iter())
}
