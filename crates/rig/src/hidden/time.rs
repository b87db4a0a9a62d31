//! Time as the records count it.

use super::algebra::{E, t};
use super::scene::Scene;
use sindyscope_values::term::Function;

/// Time since the records begin.
pub(super) fn elapsed(scene: &Scene) -> E {
    t() + -scene.origin
}

/// cos(rate × elapsed time + phase).
pub(super) fn wave(rate: f64, phase: f64, scene: &Scene) -> E {
    (elapsed(scene) * rate + phase).call(Function::Cos)
}
