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

/// What a seed makes of a component: its force, and how it is measured.
struct DrawnComponent {
    hidden: HiddenForce,
    /// Frequency of the slowest tone, Hz.
    slowest: f64,
    /// Size of the motion, m.
    reach: f64,
    /// That of its velocity, m/s.
    speed: f64,
    stiffness: f64,
    damping: f64,
    /// Size of what hides, N.
    share: f64,
    /// Of the load cell, N.
    offset: f64,
    /// Displacement of a contact, or until a hysteresis slips, m.
    gap: f64,
    /// Of a relaxing force, s.
    time_constant: f64,
    /// Of the force.
    noise: Noise,
    samples: usize,
    interval: f64,
}

impl DrawnComponent {
    /// Steps of the inner state in a sample.
    const FINE: u32 = 20;

    fn drawn(rng: &mut Pcg64, hidden: HiddenForce, noise: Option<Noise>) -> Self {
        let slowest = 10f64.powf(rng.random_range(-1.0..1.0));
        let reach = 10f64.powf(rng.random_range(-3.0..-1.0));
        let speed = TAU * slowest * reach;
        let size = 10f64.powf(rng.random_range(0.0..3.0));
        let (stiffness, damping) =
            (size / reach * rng.random_range(0.2..1.5), size / speed * rng.random_range(0.1..1.0));
        let share = size * rng.random_range(0.3..0.8);
        let offset = size * rng.random_range(-0.2..0.2);
        let gap = reach * rng.random_range(0.2..0.5);
        let time_constant = rng.random_range(0.2..1.0) / (TAU * slowest);
        let drawn = rng.random_range(0.002..0.02);
        let noise = noise.unwrap_or(Noise::ShareOfRms(drawn));
        let samples = rng.random_range(2500..5000);
        let interval = 1.0 / (slowest * rng.random_range(60.0..150.0));
        Self {
            hidden,
            slowest,
            reach,
            speed,
            stiffness,
            damping,
            share,
            offset,
            gap,
            time_constant,
            noise,
            samples,
            interval,
        }
    }

    /// True if a voltage sets the size of what hides.
    fn is_controlled(&self) -> bool {
        matches!(self.hidden, HiddenForce::VoltageFriction | HiddenForce::VoltageDamping)
    }

    /// The force of displacement, velocity, voltage and the inner state, N.
    fn force(&self, [x, v]: [f64; 2], voltage: f64, z: f64) -> f64 {
        let Self { reach, speed, share, gap, .. } = *self;
        let hidden = match self.hidden {
            HiddenForce::Nothing => 0.0,
            HiddenForce::Coulomb => share * v.signum(),
            HiddenForce::Cubic => share * (x / reach).powi(3),
            HiddenForce::Quadratic => share * (x / reach).powi(2),
            HiddenForce::QuadraticDamping => share * v * v.abs() / (speed * speed),
            HiddenForce::Clearance => 3.0 * share / reach * (x - x.clamp(-gap, gap)),
            HiddenForce::Stop => 3.0 * share / reach * (x - gap).max(0.0),
            HiddenForce::BoucWen => share / gap * z,
            HiddenForce::Maxwell => 2.0 * share / reach * z,
            HiddenForce::VoltageFriction => share * (0.3 + voltage) * v.signum(),
            HiddenForce::VoltageDamping => share / speed * voltage * v,
        };
        self.stiffness * x + self.damping * v + self.offset + hidden
    }

    /// The rate of the inner state.
    fn rate(&self, v: f64, z: f64) -> f64 {
        match self.hidden {
            HiddenForce::BoucWen => v - (v.abs() * z + 0.3 * v * f64::abs(z)) / self.gap,
            HiddenForce::Maxwell => v - z / self.time_constant,
            _ => 0.0,
        }
    }

    /// The force along a motion; the inner state takes Heun's steps.
    fn forces(&self, motion: &DrawnMotion, voltage: impl Fn(f64) -> f64) -> Vec<f64> {
        let h = self.interval / f64::from(Self::FINE);
        let rate = |t: f64, z: f64| self.rate(motion.at(t)[1], z);
        let mut z = 0.0;
        let mut forces = Vec::with_capacity(self.samples);
        for k in 0..self.samples {
            let t = k as f64 * self.interval;
            forces.push(self.force(motion.at(t), voltage(t), z));
            for i in 0..Self::FINE {
                let t = t + f64::from(i) * h;
                let (a, b) = (rate(t, z), rate(t + h, z + h * rate(t, z)));
                z += 0.5 * h * (a + b);
            }
        }
        forces
    }

    fn record(&self, rng: &mut Pcg64, name: &str, louder: f64) -> Record {
        let motion = DrawnMotion::drawn(rng, self.slowest, louder * self.reach);
        let voltage = DrawnMotion::drawn(rng, 0.4 * self.slowest, 1.0);
        let u = |t: f64| 1.0 + voltage.at(t)[0];
        let force = self.forces(&motion, u);
        let mut noisy = |values: Vec<f64>, noise: Noise| -> Vec<f64> {
            let deviation = noise.deviation(&values);
            let mut moved = |v: f64| {
                let deviate: f64 = StandardNormal.sample(rng);
                v + deviation * deviate
            };
            values.into_iter().map(&mut moved).collect()
        };
        let times = || (0..self.samples).map(|k| k as f64 * self.interval);
        let channel = |name: &str, unit: &str, role: Role, values: Vec<f64>| {
            let (name, unit, values) = (name.into(), unit.into(), values.into());
            Channel { name, unit, role, values, estimated: false }
        };
        let displacement = noisy(times().map(|t| motion.at(t)[0]).collect(), Noise::ShareOfRms(1e-4));
        let velocity = noisy(times().map(|t| motion.at(t)[1]).collect(), Noise::ShareOfRms(1e-3));
        let mut channels = vec![
            channel("x", "m", Role::Displacement(0), displacement),
            channel("v", "m/s", Role::Velocity(0), velocity),
        ];
        let controlled = self.is_controlled();
        if controlled {
            channels.push(channel("voltage", "V", Role::Input(0), times().map(u).collect()));
        }
        channels.push(channel("force", "N", Role::Input(usize::from(controlled)), noisy(force, self.noise)));
        let (start, interval) = (0.0, self.interval);
        Record { name: name.into(), source: None, start, interval, channels, notices: Vec::new() }
    }
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
    let component = DrawnComponent::drawn(&mut rng, hidden, *noise);
    let fitted = component.record(&mut rng, "first", 1.0);
    let louder = rng.random_range(0.8..1.2);
    let held_out = component.record(&mut rng, "second", louder);
    let DrawnComponent { stiffness, damping, offset, share, noise, .. } = component;
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
