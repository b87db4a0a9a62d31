//! Hidden friction and damping: forces against a velocity.

use super::contribution::{ACCELERATION, Contribution, Dimension, PLAIN, RATE, STIFFNESS, VELOCITY};
use super::host_plant::{Deflection, Draws, HostPlant};
use super::quantities::v;
use sindyscope_values::term::Expression;

/// −c v beside the damper of the joint.
pub(super) fn viscous(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let c = draws.value("c", s);
    Contribution::new(host_plant.coordinate(true).place).force(v() * -c).with("c", c, RATE)
}

/// −F sgn v.
pub(super) fn coulomb(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let strength = draws.value("F", s * displacement.rms);
    Contribution::new(place).contact(p, vec![(Expression::from(1.0), strength)], 1.0).with("F", strength, ACCELERATION)
}

/// `−[F + (F_s − F) exp(−(v/v_s)²)] sgn v`.
pub(super) fn stribeck(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, displacement, velocity, place, .. } = host_plant.coordinate(draws.coin(0));
    let sliding = draws.value("F", s * displacement.rms);
    let resting = draws.value("F_s", sliding * draws.between(1, 1.5, 2.5));
    let width = draws.value("v_s", velocity.rms * draws.ratio(2, 0.15, 0.6));
    let weakening = (-(p.clone() * (1.0 / width)).power(2.0)).exp();
    Contribution::new(place)
        .contact(p, vec![(Expression::from(1.0), sliding), (weakening, resting - sliding)], 1.0)
        .with("F", sliding, ACCELERATION)
        .with("F_s", resting, ACCELERATION)
        .with("v_s", width, VELOCITY)
}

/// −F sgn v while it slips; sticks up to a static level above F.
pub(super) fn sticking(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let sliding = draws.value("F", s * displacement.rms);
    // A contact holds at least as hard as it slides.
    let holding = draws.given("F_s").map_or(draws.between(1, 1.3, 3.0), |held| (held / sliding).max(1.0));
    Contribution::new(place)
        .contact(p, vec![(Expression::from(1.0), sliding)], holding)
        .with("F", sliding, ACCELERATION)
        .with("F_s", holding * sliding, ACCELERATION)
}

/// −c v|v|.
pub(super) fn quadratic(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, velocity, place, .. } = host_plant.coordinate(draws.coin(0));
    let c = draws.value("c_2", s / velocity.peak);
    Contribution::new(place).force(p.clone() * p.abs() * -c).with("c_2", c, Dimension::Of { length: -1, time: 0 })
}

/// −c v³.
pub(super) fn cubic(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, velocity, place, .. } = host_plant.coordinate(draws.coin(0));
    let c = draws.value("c_3", s / velocity.peak.powi(2));
    Contribution::new(place).force(p.power(3.0) * -c).with("c_3", c, Dimension::Of { length: -2, time: 1 })
}

/// −μ x² v.
pub(super) fn displacement_dependent(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, p, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let mu = draws.value("mu", s / displacement.peak.powi(2));
    Contribution::new(place).force(q.power(2.0) * p * -mu).with("mu", mu, Dimension::Of { length: -2, time: -1 })
}

/// −f |x| sgn v.
pub(super) fn position_dependent(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, p, place, .. } = host_plant.coordinate(draws.coin(0));
    let slope = draws.value("f", s);
    Contribution::new(place).contact(p, vec![(q.abs(), slope)], 1.0).with("f", slope, STIFFNESS)
}

/// −F [1 + a ½ ln(1 + (v/v₀)²)] sgn v: dry friction that grows with the logarithm of the rate.
pub(super) fn rate_dependent(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, displacement, velocity, place, .. } = host_plant.coordinate(draws.coin(0));
    let strength = draws.value("F", s * displacement.rms);
    let slope = draws.value("a", draws.between(1, 0.5, 1.0));
    let scale = draws.value("v_0", velocity.rms * draws.ratio(2, 0.02, 0.1));
    let grown = log_law(p.clone(), scale);
    Contribution::new(place)
        .contact(p, vec![(Expression::from(1.0), strength), (grown, slope * strength)], 1.0)
        .with("F", strength, ACCELERATION)
        .with("a", slope, PLAIN)
        .with("v_0", scale, VELOCITY)
}

fn log_law(p: Expression, scale: f64) -> Expression {
    ((p * (1.0 / scale)).power(2.0) + 1.0).log() * 0.5
}
