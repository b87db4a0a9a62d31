//! Hidden effects on what drives the mass, and on what measures it.

use super::parts::{ACCELERATION, Dimension, LENGTH, PLAIN, Parts, RATE, SensorFault, TIME};
use super::quantities::{du, u};
use super::scene::{Dice, Drive, Scene};
use super::time::wave;
use sindyscope_values::term::Expression;

/// What an input gives to the mass.
fn given(scene: &Scene, input: Expression, rate: Expression) -> Expression {
    match scene.drive {
        Drive::Base => input * scene.stiffness + rate * scene.damping,
        Drive::Force | Drive::None => input * scene.mobility,
    }
}

/// A force that never changes.
pub(super) fn constant_force(s: f64, dice: &Dice, scene: &Scene) -> Parts {
    let force = dice.value("g", s * dice.sign(0) * scene.motion.r.rms);
    Parts::new("").force(Expression::from(force)).with("g", force, ACCELERATION)
}

/// +c u̇.
pub(super) fn base_velocity(s: f64, dice: &Dice, _: &Scene) -> Parts {
    let c = dice.value("c_b", s * dice.sign(0));
    Parts::new("").force(du(0) * c).with("c_b", c, RATE)
}

/// u(t − τ) where u(t) is measured.
pub(super) fn delay(s: f64, dice: &Dice, scene: &Scene) -> Parts {
    let delay = dice.value("tau", s);
    let parts = Parts::new("").force(given(scene, u(1) - u(0), du(1) - du(0))).with("tau", delay, TIME);
    Parts { delay, ..parts }
}

/// clip(u, L) where u is measured.
pub(super) fn saturation(s: f64, dice: &Dice, scene: &Scene) -> Parts {
    let limit = dice.value("L", (1.0 - s) * scene.motion.u.peak);
    let outside = (u(0).abs() + -limit).step();
    Parts::new("").force(given(scene, u(0).clip(limit) - u(0), -(du(0) * outside))).with("L", limit, Dimension::Input)
}

/// (1 + γ) u where u is measured, on the spring's side.
pub(super) fn gain(s: f64, dice: &Dice, scene: &Scene) -> Parts {
    let gamma = dice.value("gamma", s * dice.sign(0));
    Parts::new("").force(u(0) * gamma * scene.stiffness).with("gamma", gamma, PLAIN)
}

/// P cos(Ωt + φ), which no one measures.
pub(super) fn harmonic(s: f64, dice: &Dice, scene: &Scene) -> Parts {
    // In the band, and not on the resonance, where it would be all there is.
    let drawn = if dice.heads(0) { dice.between(1, 0.4, 0.9) } else { dice.between(1, 1.1, 2.0) };
    let rate = dice.value("Omega", drawn);
    let phase = dice.value("phi", dice.between(2, -3.0, 3.0));
    let force = dice.value("P", s * scene.motion.r.rms);
    Parts::new("")
        .force(wave(rate, phase, scene) * force)
        .with("P", force, ACCELERATION)
        .with("Omega", rate, RATE)
        .with("phi", phase, PLAIN)
}

/// A displacement sensor with another zero in every record.
pub(super) fn offset(s: f64, _: &Dice, scene: &Scene) -> Parts {
    Parts { seen: SensorFault::Shifted(s * scene.motion.r.rms), ..Parts::new("") }
}

/// A displacement sensor that ends at ±L.
pub(super) fn clipping(s: f64, dice: &Dice, scene: &Scene) -> Parts {
    let limit = dice.value("L", (1.0 - s) * scene.motion.x.peak);
    let parts = Parts::new("").with("L", limit, LENGTH);
    Parts { seen: SensorFault::Clipped(limit), ..parts }
}
