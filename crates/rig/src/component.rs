//! Components tested without a mass: a motion that a machine prescribes, and the force along it.
//!
//! Motion and force are computed in closed form; a state that remembers is integrated by Heun's steps of a twentieth of a sample
//! along the exact motion, which no identifier sees.

use std::f64::consts::TAU;

use rand::{RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::{Noise, RigError};
use sindyscope_values::record::{Channel, Record, Role};

/// The scenario's name.
pub const COMPONENT_SCENARIO: &str = "component";

/// What a drawn component is to be.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ComponentOptions {
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// What hides beside a spring and a damper; drawn where none is given.
    pub effect: Option<String>,
    /// Noise of the force; drawn where none is given.
    pub noise: Option<Noise>,
    /// The comments say what hides.
    pub reveal: bool,
}

/// What a drawn component has beside spring, damper and offset.
#[derive(Clone, Copy, Debug, PartialEq)]
enum HiddenForce {
    Nothing,
    Coulomb,
    Cubic,
    Quadratic,
    QuadraticDamping,
    Clearance,
    Stop,
    BoucWen,
    Maxwell,
    VoltageFriction,
    VoltageDamping,
}

/// What can hide, by the names of the interface.
const HIDDEN: [(HiddenForce, &str); 11] = [
    (HiddenForce::Nothing, "nothing"),
    (HiddenForce::Coulomb, "coulomb_friction"),
    (HiddenForce::Cubic, "cubic_stiffness"),
    (HiddenForce::Quadratic, "quadratic_stiffness"),
    (HiddenForce::QuadraticDamping, "quadratic_damping"),
    (HiddenForce::Clearance, "clearance"),
    (HiddenForce::Stop, "one_sided_stop"),
    (HiddenForce::BoucWen, "bouc_wen_hysteresis"),
    (HiddenForce::Maxwell, "viscoelastic_relaxation"),
    (HiddenForce::VoltageFriction, "input_dependent_friction"),
    (HiddenForce::VoltageDamping, "input_dependent_damping"),
];

/// A motion of several tones; a held-out record has others.
struct DrawnMotion(Vec<(f64, f64, f64)>);

impl DrawnMotion {
    fn drawn(rng: &mut Pcg64, slowest: f64, reach: f64) -> Self {
        let count = rng.random_range(1..6);
        let tone = |_| {
            let (frequency, phase) = (slowest * rng.random_range(1.0..4.0), rng.random_range(0.0..TAU));
            (reach / f64::from(count) * rng.random_range(0.5..1.5), TAU * frequency, phase)
        };
        Self((0..count).map(tone).collect())
    }

    fn at(&self, t: f64) -> [f64; 2] {
        let displacement = self.0.iter().map(|(a, w, p)| a * (w * t + p).sin()).sum();
        [displacement, self.0.iter().map(|(a, w, p)| a * w * (w * t + p).cos()).sum()]
    }
}

/// The effects that can hide, `nothing` first.
pub fn component_effects() -> impl Iterator<Item = &'static str> {
    HIDDEN.iter().map(|(_, name)| *name)
}

/// Two records of a drawn component, the second to be held out, and comments for the head of a file.
///
/// # Errors
/// An effect that cannot hide here; a noise below zero.
pub fn component_records(options: &ComponentOptions) -> Result<(Vec<Record>, Vec<String>), RigError> {
    let ComponentOptions { seed, effect, noise, reveal } = options;
    let mut rng = Pcg64::seed_from_u64(*seed);
    let drawn = rng.random_range(1..HIDDEN.len());
    let known = |name: &str| HIDDEN.iter().find(|(_, known)| *known == name).copied();
    let (hidden, name) = match effect {
        None => HIDDEN[drawn],
        Some(name) => known(name).ok_or_else(|| RigError::BadOption {
            option: "effect",
            problem: format!("`{name}` is none of {}", component_effects().collect::<Vec<_>>().join(", ")),
        })?,
    };
    if noise.is_some_and(|n| !n.is_valid()) {
        return Err(RigError::BadOption { option: "noise", problem: "it is a finite number, zero or more".into() });
    }
    let slowest = 10f64.powf(rng.random_range(-1.0..1.0));
    let reach = 10f64.powf(rng.random_range(-3.0..-1.0));
    let speed = TAU * slowest * reach;
    let size = 10f64.powf(rng.random_range(0.0..3.0));
    let (stiffness, damping) = (size / reach * rng.random_range(0.2..1.5), size / speed * rng.random_range(0.1..1.0));
    let share = size * rng.random_range(0.3..0.8);
    let offset = size * rng.random_range(-0.2..0.2);
    let gap = reach * rng.random_range(0.2..0.5);
    let time_constant = rng.random_range(0.2..1.0) / (TAU * slowest);
    let drawn = rng.random_range(0.002..0.02);
    let noise = noise.unwrap_or(Noise::ShareOfRms(drawn));
    let samples = rng.random_range(2500..5000);
    let interval = 1.0 / (slowest * rng.random_range(60.0..150.0));
    let record = |rng: &mut Pcg64, name: &str, louder: f64| {
        let motion = DrawnMotion::drawn(rng, slowest, louder * reach);
        let voltage = DrawnMotion::drawn(rng, 0.4 * slowest, 1.0);
        let u = |t: f64| 1.0 + voltage.at(t)[0];
        let mut z = 0.0;
        let fine = 20;
        let rate = |t: f64, z: f64| {
            let v = motion.at(t)[1];
            match hidden {
                HiddenForce::BoucWen => v - (v.abs() * z + 0.3 * v * f64::abs(z)) / gap,
                HiddenForce::Maxwell => v - z / time_constant,
                _ => 0.0,
            }
        };
        let mut force = Vec::new();
        for k in 0..samples {
            let t = k as f64 * interval;
            let [x, v] = motion.at(t);
            force.push(
                stiffness * x
                    + damping * v
                    + offset
                    + match hidden {
                        HiddenForce::Nothing => 0.0,
                        HiddenForce::Coulomb => share * v.signum(),
                        HiddenForce::Cubic => share * (x / reach).powi(3),
                        HiddenForce::Quadratic => share * (x / reach).powi(2),
                        HiddenForce::QuadraticDamping => share * v * v.abs() / (speed * speed),
                        HiddenForce::Clearance => 3.0 * share / reach * (x - x.clamp(-gap, gap)),
                        HiddenForce::Stop => 3.0 * share / reach * (x - gap).max(0.0),
                        HiddenForce::BoucWen => share / gap * z,
                        HiddenForce::Maxwell => 2.0 * share / reach * z,
                        HiddenForce::VoltageFriction => share * (0.3 + u(t)) * v.signum(),
                        HiddenForce::VoltageDamping => share / speed * u(t) * v,
                    },
            );
            // Heun's steps of a twentieth of a sample.
            let h = interval / f64::from(fine);
            for i in 0..fine {
                let t = t + f64::from(i) * h;
                let (a, b) = (rate(t, z), rate(t + h, z + h * rate(t, z)));
                z += 0.5 * h * (a + b);
            }
        }
        let mut noisy = |values: Vec<f64>, noise: Noise| -> Vec<f64> {
            let deviation = noise.deviation(&values);
            let mut moved = |v: f64| {
                let deviate: f64 = StandardNormal.sample(rng);
                v + deviation * deviate
            };
            values.into_iter().map(&mut moved).collect()
        };
        let times = || (0..samples).map(|k| k as f64 * interval);
        let channel = |name: &str, unit: &str, role: Role, values: Vec<f64>| {
            let (name, unit, values) = (name.into(), unit.into(), values.into());
            Channel { name, unit, role, values, estimated: false }
        };
        let mut channels = vec![
            channel(
                "x",
                "m",
                Role::Displacement(0),
                noisy(times().map(|t| motion.at(t)[0]).collect(), Noise::ShareOfRms(1e-4)),
            ),
            channel(
                "v",
                "m/s",
                Role::Velocity(0),
                noisy(times().map(|t| motion.at(t)[1]).collect(), Noise::ShareOfRms(1e-3)),
            ),
        ];
        let controlled = matches!(hidden, HiddenForce::VoltageFriction | HiddenForce::VoltageDamping);
        if controlled {
            channels.push(channel("voltage", "V", Role::Input(0), times().map(u).collect()));
        }
        channels.push(channel("force", "N", Role::Input(usize::from(controlled)), noisy(force, noise)));
        Record { name: name.into(), source: None, start: 0.0, interval, channels, notices: Vec::new() }
    };
    let fitted = record(&mut rng, "first", 1.0);
    let louder = rng.random_range(0.8..1.2);
    let held_out = record(&mut rng, "second", louder);
    let mut comments = vec![
        "Sindyscope's virtual rig, scenario component: force of a spring and a damper, and what hides beside them, along a given motion".to_owned(),
        format!("spring {stiffness:.6} N/m, damper {damping:.6} N s/m, offset of the load cell {offset:.6} N"),
        format!("noise of the force {noise}"),
        "the second record is to be held out".to_owned(),
    ];
    if *reveal {
        comments.push(format!("hidden: {name}, of the size {share:.6} N"));
    }
    Ok((vec![fitted, held_out], comments))
}
