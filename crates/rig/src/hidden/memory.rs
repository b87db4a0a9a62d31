//! Hidden effects that remember: states that no sensor sees.

use super::contribution::{Contribution, InnerStart, LENGTH, PLAIN, RATE, STIFFNESS, TIME};
use super::host_plant::{Deflection, Draws, HostPlant};
use super::quantities::{state, v, x};
use sindyscope_values::term::Expression;

/// −k z, ż = w − β|w||z|ⁿ⁻¹z − γ w|z|ⁿ, with β + γ = `1/x_yⁿ` (Bouc and Wen).
pub(super) fn bouc_wen(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let z = || state(host_plant.first_state);
    let yield_displacement = draws.value("x_y", displacement.peak * draws.between(1, 0.1, 0.4));
    // Whole exponents: a step past z = 0 must not take a root of a negative number.
    let exponent = if draws.value("n", if draws.coin(2) { 1.0 } else { 2.0 }) < 1.5 { 1 } else { 2 };
    let sum = yield_displacement.powi(-exponent);
    let beta = sum * draws.value("beta_share", draws.between(3, 0.5, 1.0));
    let k = draws.value("k_h", s);
    let gamma = sum - beta;
    let (against, along) = if exponent == 1 { (z(), z().abs()) } else { (z().abs() * z(), z().power(2.0)) };
    let rate = p.clone() - p.clone().abs() * against * beta - p * along * gamma;
    Contribution::new(place)
        .force(z() * -k)
        .inner(InnerStart::Zero, rate)
        .with("k_h", k, STIFFNESS)
        .with("x_y", yield_displacement, LENGTH)
        .with("n", f64::from(exponent), PLAIN)
        .with("beta_share", beta / sum, PLAIN)
}

/// −k z, ż = w − z/τ: a spring and a damper in series (Maxwell).
pub(super) fn maxwell(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, place, .. } = host_plant.coordinate(draws.coin(0));
    let tau = draws.value("tau", draws.ratio(1, 0.25, 4.0));
    let k = draws.value("k_v", s);
    Contribution::new(place)
        .force(state(host_plant.first_state) * -k)
        .inner(InnerStart::Zero, p - state(host_plant.first_state) * (1.0 / tau))
        .with("k_v", k, STIFFNESS)
        .with("tau", tau, TIME)
}

/// A small oscillator on the mass: μ[ω₂²(z − x) + 2ζ₂ω₂(ż − v)].
pub(super) fn second_mode(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let (z, z_rate) = (state(host_plant.first_state), state(host_plant.first_state + 1));
    // Inside the band, and not on the first mode, which would then be two that no one calls first.
    let drawn = if draws.coin(1) { draws.between(2, 0.5, 0.88) } else { draws.between(2, 1.12, 1.8) };
    let rate = draws.value("omega_2", drawn);
    let damping = draws.value("zeta_2", draws.ratio(3, 0.01, 0.05));
    let mu = draws.value("mu", s);
    let pull = (z - x()) * rate.powi(2) + (z_rate.clone() - v()) * (2.0 * damping * rate);
    Contribution::new("")
        .force(pull.clone() * mu)
        .inner(InnerStart::Displacement, z_rate)
        .inner(InnerStart::Velocity, -pull)
        .with("mu", mu, PLAIN)
        .with("omega_2", rate, RATE)
        .with("zeta_2", damping, PLAIN)
}

/// Branches of the fractional damper, and the decades of their relaxation times.
const BRANCHES: usize = 9;
const FASTEST: f64 = 0.05;
const DECADES: f64 = 4.0;

/// −c Dᵅr, α about a half: Caputo's derivative as a sum of Maxwell branches, ∑ kᵢzᵢ with kᵢ ∝ τᵢ⁻ᵅ over four decades.
pub(super) fn fractional(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { p, place, .. } = host_plant.coordinate(draws.coin(0));
    let order = draws.value("alpha", draws.between(1, 0.4, 0.6));
    let c = draws.value("c_alpha", s);
    let fastest = FASTEST / host_plant.stiffness.sqrt();
    let mut parts = Contribution::new(place);
    let mut force = Expression::from(0.0);
    // ω^α is ∫ of ω²τ²/(1 + ω²τ²) τ^(−α−1) dτ but for sin(απ)/π; branches are that integral's sum over ln τ.
    let spacing = DECADES * std::f64::consts::LN_10 / (BRANCHES - 1) as f64;
    let weight = c * spacing * (std::f64::consts::PI * order).sin() / std::f64::consts::PI;
    for k in 0..BRANCHES {
        let tau = fastest * (spacing * k as f64).exp();
        let z = || state(host_plant.first_state + k);
        force = force + z() * -(weight * tau.powf(-order));
        parts = parts.inner(InnerStart::Zero, p.clone() - z() * (1.0 / tau));
    }
    parts.force(force).with("c_alpha", c, STIFFNESS).with("alpha", order, PLAIN)
}

/// −k dz(r − z, d), ż = dz(r − z, d)/τ: a damper reached through a loose joint, which lags by the play in it.
pub(super) fn play(s: f64, draws: &Draws, host_plant: &HostPlant) -> Contribution {
    let Deflection { q, displacement, place, .. } = host_plant.coordinate(draws.coin(0));
    let gap = draws.value("d", displacement.peak * draws.between(1, 0.1, 0.35));
    let tau = draws.value("tau", draws.between(2, 0.1, 0.4));
    let k = draws.value("k_j", s);
    let engaged = (q - state(host_plant.first_state)).dead_zone(gap);
    Contribution::new(place)
        .force(engaged.clone() * -k)
        .inner(InnerStart::Zero, engaged * (1.0 / tau))
        .with("k_j", k, STIFFNESS)
        .with("d", gap, LENGTH)
        .with("tau", tau, TIME)
}
