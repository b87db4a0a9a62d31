//! Time as the records count it.

use super::quantities::t;
use super::scene::Scene;
use sindyscope_values::term::Expression;

/// Time since the records begin.
pub(super) fn elapsed(scene: &Scene) -> Expression {
    t() + -scene.origin
}

/// cos(rate × elapsed time + phase).
pub(super) fn wave(rate: f64, phase: f64, scene: &Scene) -> Expression {
    (elapsed(scene) * rate + phase).cos()
}
