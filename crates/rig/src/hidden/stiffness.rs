//! Hidden springs and stops: forces against a displacement.

use super::contribution::{Contribution, Dimension, LENGTH, PLAIN, RATE, STIFFNESS, TIME};
use super::host_plant::{Deflection, Draws, HostPlant};
use super::quantities::{v, x};
use sindyscope_values::term::Expression;

/// The largest share of the linear spring that a softening term may take away at the largest displacement.
const SOFTEST: f64 = 0.45;

/// −k x: a spring to the ground beside the one to the base.
pub(super) fn linear(s: f64, draws: &Draws, _: &HostPlant) -> Contribution {
    let k = draws.value("k_g", s);
    Contribution::new("").force(x() * -k).with("k_g", k, STIFFNESS)
}

/// −k x^power, of either sign.
fn polynomial(s: f64, draws: &Draws, host_plant: &HostPlant, name: &'static str, power: i32) -> Contribution {
    let Deflection { q, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let sign = draws.sign(1);
    let held = if sign < 0.0 || power % 2 == 0 { s.min(SOFTEST) } else { s };
    let k = draws.value(name, sign * held / displacement.peak.powi(power - 1));
    Contribution::new(place).force(q.power(f64::from(power)) * -k).with(
        name,
        k,
        Dimension::Of { length: 1 - power, time: -2 },
    )
}

/// −k x².
pub(super) fn quadratic(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    polynomial(s, draws, host_plant, "k_2", 2)
}

/// −k x³.
pub(super) fn cubic(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    polynomial(s, draws, host_plant, "k_3", 3)
}

/// −k x⁵.
pub(super) fn quintic(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    polynomial(s, draws, host_plant, "k_5", 5)
}

/// −k dz(r, d): springs on both sides beyond a gap.
pub(super) fn clearance(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let gap = draws.value("d", displacement.peak * draws.between(1, 0.25, 0.6));
    let k = draws.value("k_c", s);
    Contribution::new(place).force(q.dead_zone(gap) * -k).with("k_c", k, STIFFNESS).with("d", gap, LENGTH)
}

/// −k max(r − d, 0).
pub(super) fn one_sided_stop(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let gap = draws.value("d", displacement.peak * draws.between(1, 0.2, 0.6));
    let k = draws.value("k_s", s);
    Contribution::new(place).force((q + -gap).max(0.0) * -k).with("k_s", k, STIFFNESS).with("d", gap, LENGTH)
}

/// −k max(r, 0), of either sign.
pub(super) fn bilinear(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, place, .. } = host_plant.coordinate(draws.coin(0));
    let k = draws.value("k_b", if draws.coin(1) { -s.min(SOFTEST) } else { s });
    Contribution::new(place).force(q.max(0.0) * -k).with("k_b", k, STIFFNESS)
}

/// −k sin x instead of −k x; the strength is the angle that the motion reaches.
pub(super) fn pendulum(s: f64, _: &Draws, host_plant: &HostPlant) -> Contribution {
    let force = (x() - x().sin()) * host_plant.stiffness;
    let parts = Contribution::new("").force(force).with("k_sin", host_plant.stiffness, STIFFNESS);
    Contribution { level: s, ..parts }
}

/// q/(d − r)² − q/d²: pulled towards a magnet, its pull at r = 0 balanced.
pub(super) fn magnet(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, displacement, place, .. } = host_plant.coordinate(true);
    let distance = draws.value("d", displacement.peak * draws.between(1, 1.4, 2.2));
    // Beyond this the magnet's gradient nears the spring's, and the mass would snap to it.
    let strongest = 0.3 * (distance - displacement.peak).powi(3);
    let strength = draws.value("q", (s * displacement.peak.powi(3)).min(strongest));
    let pull = (Expression::from(distance) - q).power(-2.0) + -distance.powi(-2);
    Contribution::new(place)
        .force(pull * strength)
        .with("q", strength, Dimension::Of { length: 3, time: -2 })
        .with("d", distance, LENGTH)
}

/// −k δ (1 + a w), δ = max(r − d, 0): a stiff stop that takes energy (Hunt and Crossley, J. Appl. Mech. 42, 1975).
pub(super) fn impact(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, p, displacement, velocity, place } = host_plant.coordinate(draws.coin(0));
    let gap = draws.value("d", displacement.peak * draws.between(1, 0.35, 0.65));
    let loss = draws.value("a", draws.between(2, 0.8, 1.6) / velocity.peak);
    let k = draws.value("k_s", s);
    // A stop pushes and never pulls.
    let push = (p * loss + 1.0).max(0.0);
    Contribution::new(place)
        .force((q + -gap).max(0.0) * push * -k)
        .with("k_s", k, STIFFNESS)
        .with("d", gap, LENGTH)
        .with("a", loss, Dimension::Of { length: -1, time: 1 })
}

/// −κ (x² ẍ + x ẋ²): a mass that moves across as it moves along.
pub(super) fn inertia(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let kappa = draws.value("kappa", s / host_plant.motion.x.peak.powi(2));
    let square = || x().power(2.0);
    // Solved for the acceleration, which stands on both sides.
    let force = (square() * host_plant.base() + x() * v().power(2.0)) * (square() * kappa + 1.0).power(-1.0) * -kappa;
    Contribution::new("").force(force).with("kappa", kappa, Dimension::Of { length: -2, time: 0 })
}

/// −k r cos(Ωt + φ).
pub(super) fn parametric(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, place, .. } = host_plant.coordinate(false);
    // Below twice the natural frequency, where a parametric spring makes the motion grow by itself.
    let rate = draws.value("Omega", draws.between(1, 0.2, 1.4));
    let phase = draws.value("phi", draws.between(2, -3.0, 3.0));
    let k = draws.value("k_p", s);
    Contribution::new(place)
        .force(q * super::time::wave(rate, phase, host_plant) * -k)
        .with("k_p", k, STIFFNESS)
        .with("Omega", rate, RATE)
        .with("phi", phase, PLAIN)
}

/// −k r (t/T − ½), T the duration of a fitted record.
pub(super) fn drift(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, place, .. } = host_plant.coordinate(false);
    let k = draws.value("k_d", s * draws.sign(1));
    let length = draws.value("T", host_plant.length);
    let progress = super::time::elapsed(host_plant) * (1.0 / length) + -0.5;
    Contribution::new(place).force(q * progress * -k).with("k_d", k, STIFFNESS).with("T", length, TIME)
}
