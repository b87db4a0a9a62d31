//! Time as the records count it.

use super::host_plant::HostPlant;
use super::quantities::t;
use sindyscope_values::term::Expression;

/// Time since the records begin.
pub(super) fn elapsed(host_plant: &HostPlant) -> Expression {
    t() + -host_plant.origin
}

/// cos(rate × elapsed time + phase).
pub(super) fn wave(rate: f64, phase: f64, host_plant: &HostPlant) -> Expression {
    (elapsed(host_plant) * rate + phase).cos()
}
