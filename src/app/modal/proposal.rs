//! When the program proposes modes instead of a chain of masses.
//!
//! A chain has one mode for each sensor, and every sensor a mass of its own. Two things speak against it:
//! - [`MANY`] or more places of which the same quantity is measured: an instrumented structure, whose sensors are seldom its masses;
//! - accelerations alone, along which the chain fits poorly: a structure has more modes than sensors, and what is integrated
//!   twice does not tell.

use crate::app::records::OpenRecords;
use crate::app::state::Edit;
use sindyscope_modes::BaseModel;
use sindyscope_values::record::{Channel, Role};
use sindyscope_values::term::Kind;

/// Places of one measured quantity from which on modes are proposed.
const MANY: usize = 3;

/// NRMSE of the chain, on held-out data or else on the fitted, from which on it fits poorly.
const POOR: f64 = 0.1;

/// Why modes would suit these records better, in a sentence; none where they would not, or a person has said which.
pub(crate) fn reason_for_modes(data: &OpenRecords, edit: &Edit) -> Option<String> {
    if edit.component
        || edit.base_settled
        || edit.base.model == BaseModel::Modes
        || edit.settings.kind != Kind::SecondOrder
    {
        return None;
    }
    let record = data.records.first()?;
    let measured: Vec<&Channel> = record.measured().filter(|c| !c.estimated).collect();
    let count = |of: fn(Role) -> bool| measured.iter().filter(|c| of(c.role)).count();
    let displacements = count(|r| matches!(r, Role::Displacement(_)));
    let velocities = count(|r| matches!(r, Role::Velocity(_)));
    let accelerations = count(|r| matches!(r, Role::Acceleration(_)));
    let kinds = [(displacements, "displacements"), (velocities, "velocities"), (accelerations, "accelerations")];
    if let Some((many, what)) = kinds.into_iter().max_by_key(|k| k.0).filter(|k| k.0 >= MANY) {
        return Some(format!(
            "{many} {what} are measured. A chain of masses takes each for a mass of its own, and has as many modes as sensors; \
             modes ask for neither."
        ));
    }
    if accelerations == 0 || displacements + velocities > 0 {
        return None;
    }
    let error = match (&data.failure, &data.outcome) {
        (Some(_), _) => return Some(alone("cannot be fitted to them")),
        (None, Some(outcome)) => outcome.test.or(outcome.train).map_or(f64::INFINITY, |s| s.nrmse),
        (None, None) => return None,
    };
    let poor = if error.is_finite() {
        format!("errs by {:.0} % of their deviation", 100.0 * error)
    } else {
        "diverges along them".to_owned()
    };
    (error > POOR).then(|| alone(&poor))
}

fn alone(poor: &str) -> String {
    format!(
        "Accelerations alone are measured, and a chain of as many masses as sensors {poor}. A structure may have more modes \
         than sensors."
    )
}
