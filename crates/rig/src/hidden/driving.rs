//! Hidden effects on what drives the mass, and on what measures it.

use super::contribution::{ACCELERATION, Contribution, Dimension, LENGTH, PLAIN, RATE, SensorFault, TIME};
use super::host_plant::{Draws, DriveKind, HostPlant};
use super::quantities::{du, u};
use super::time::wave;
use sindyscope_values::term::Expression;

/// What an input gives to the mass.
fn given(host_plant: &HostPlant, input: Expression, rate: Expression) -> Expression {
    match host_plant.drive {
        DriveKind::Base => input * host_plant.stiffness + rate * host_plant.damping,
        DriveKind::Force | DriveKind::None => input * host_plant.mobility,
    }
}

/// A force that never changes.
pub(super) fn constant_force(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let force = draws.value("g", s * draws.sign(0) * host_plant.motion.r.rms);
    Contribution::new("").force(Expression::from(force)).with("g", force, ACCELERATION)
}

/// +c u̇.
pub(super) fn base_velocity(s: f64, draws: &Draws, _: &HostPlant) -> Contribution {
    let c = draws.value("c_b", s * draws.sign(0));
    Contribution::new("").force(du(0) * c).with("c_b", c, RATE)
}

/// u(t − τ) where u(t) is measured.
pub(super) fn delay(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let delay = draws.value("tau", s);
    let parts = Contribution::new("").force(given(host_plant, u(1) - u(0), du(1) - du(0))).with("tau", delay, TIME);
    Contribution { delay, ..parts }
}

/// clip(u, L) where u is measured.
pub(super) fn saturation(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let limit = draws.value("L", (1.0 - s) * host_plant.motion.u.peak);
    let outside = (u(0).abs() + -limit).step();
    Contribution::new("").force(given(host_plant, u(0).clip(limit) - u(0), -(du(0) * outside))).with(
        "L",
        limit,
        Dimension::Input,
    )
}

/// (1 + γ) u where u is measured, on the spring's side.
pub(super) fn gain(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let gamma = draws.value("gamma", s * draws.sign(0));
    Contribution::new("").force(u(0) * gamma * host_plant.stiffness).with("gamma", gamma, PLAIN)
}

/// P cos(Ωt + φ), which no one measures.
pub(super) fn harmonic(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    // In the band, and not on the resonance, where it would be all there is.
    let drawn = if draws.coin(0) { draws.between(1, 0.4, 0.9) } else { draws.between(1, 1.1, 2.0) };
    let rate = draws.value("Omega", drawn);
    let phase = draws.value("phi", draws.between(2, -3.0, 3.0));
    let force = draws.value("P", s * host_plant.motion.r.rms);
    Contribution::new("")
        .force(wave(rate, phase, host_plant) * force)
        .with("P", force, ACCELERATION)
        .with("Omega", rate, RATE)
        .with("phi", phase, PLAIN)
}

/// A displacement sensor with another zero in every record.
pub(super) fn offset(s: f64, _: &Draws, host_plant: &HostPlant) -> Contribution {
    Contribution { seen: SensorFault::Shifted(s * host_plant.motion.r.rms), ..Contribution::new("") }
}

/// A displacement sensor that ends at ±L.
pub(super) fn clipping(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let limit = draws.value("L", (1.0 - s) * host_plant.motion.x.peak);
    let parts = Contribution::new("").with("L", limit, LENGTH);
    Contribution { seen: SensorFault::Clipped(limit), ..parts }
}
