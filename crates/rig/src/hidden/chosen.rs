//! One mass with an effect in it, every number of it given and with its unit.

use std::f64::consts::TAU;

use super::assembly::{Assembly, extents};
use super::calibrate::measure;
use super::catalogue;
use super::contribution::{EffectConstant, SensorFault};
use super::excitation_kind::PlannedRecord;
use super::host_plant::{Draws, DriveKind, HostPlant, Magnitude, MotionSize};
use super::truth::UnitScales;
use crate::interpolant::Accuracy;
use crate::motion::PlantMotion;
use crate::response::SampleTimes;
use crate::{Excitation, RigError};
use sindyscope_values::term::Expression;

/// Missing force over spring force that the parameters offered first lead to, about.
const OFFERED: f64 = 0.05;
/// Significant digits of what is offered.
const DIGITS: usize = 2;
/// Samples that are enough to know the size of a motion.
const ENOUGH: usize = 1500;

/// The linear plant: `ẍ = −stiffness (x − u) − damping (ẋ − u̇)`, or with `mobility × u` of a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LinearPlant {
    /// Stiffness over mass, 1/s².
    pub stiffness: f64,
    /// Damping over mass, 1/s.
    pub damping: f64,
    /// One over the mass, 1/kg.
    pub mobility: f64,
    pub drive: DriveKind,
}

/// An effect with its numbers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ChosenEffect {
    pub name: String,
    /// To the ground, or across the joint where the base moves.
    pub to_ground: bool,
    /// Parameters by name, in SI units.
    pub values: Vec<(String, f64)>,
}

/// A plant with an effect, ready to be moved.
pub(crate) struct ChosenPlant {
    assembly: Assembly,
}

fn host_plant(linear: &LinearPlant, origin: f64, length: f64) -> HostPlant {
    let LinearPlant { stiffness, damping, mobility, drive } = *linear;
    HostPlant { stiffness, mobility, ..HostPlant::linear(damping, drive, origin, length) }
}

fn run(excitation: Option<&Excitation>, initial: [f64; 2], sampling: SampleTimes) -> PlannedRecord {
    PlannedRecord {
        name: String::new(),
        excitation: excitation.cloned(),
        noise: None,
        initial,
        sampling,
        held_out: false,
    }
}

fn effect(name: &str) -> Result<&'static catalogue::Effect, RigError> {
    catalogue::find(name).ok_or_else(|| RigError::BadOption {
        option: "effect",
        problem: format!("there is no effect {name:?}; choose one of the list"),
    })
}

/// An effect's parameters with values that suit the linear plant's motion, and their units.
///
/// # Errors
/// An unknown effect, or one that the drive has no place for; a motion that grows without bound.
pub(crate) fn suggestions(
    name: &str,
    to_ground: bool,
    linear: &LinearPlant,
    excitation: Option<&Excitation>,
    initial: [f64; 2],
    sampling: SampleTimes,
) -> Result<Vec<(&'static str, f64, String)>, RigError> {
    let effect = suited(name, linear.drive)?;
    let end = sampling.time(sampling.count.saturating_sub(1));
    let step = sampling.count.div_ceil(ENOUGH).max(1);
    let coarse =
        SampleTimes { interval: sampling.interval * step as f64, count: sampling.count.div_ceil(step), ..sampling };
    let whole = host_plant(linear, sampling.start, end - sampling.start);
    let plain = Assembly::new(&[], &[], &whole);
    let motion = plain.follow(&run(excitation, initial, coarse), Accuracy::DRAFT)?;
    let motion = extents(&plain, &[motion]);
    // Without units an effect's first strength is known.
    let (rate, length) = (linear.stiffness.sqrt(), motion.x.peak.max(f64::MIN_POSITIVE));
    let scales =
        UnitScales::new(length, rate, rate * sampling.interval, 1.0 / linear.mobility, turns(name), linear.drive);
    let over = |e: Magnitude, unit: f64| Magnitude { peak: e.peak / unit, rms: e.rms / unit };
    let bare = HostPlant {
        motion: MotionSize {
            x: over(motion.x, length),
            v: over(motion.v, length * rate),
            r: over(motion.r, length),
            w: over(motion.w, length * rate),
            u: over(motion.u, scales.input),
        },
        ..HostPlant::linear(linear.damping / rate, linear.drive, rate * sampling.start, rate * whole.length)
    };
    let offered = (effect.first * OFFERED).min(effect.most);
    let parts = Assembly::new(&[(effect, draws(to_ground))], &[offered], &bare).parts;
    let constants = parts.into_iter().flat_map(|part| part.constants);
    let fixed = |c: &EffectConstant| c.name != "k_sin";
    Ok(constants
        .filter(fixed)
        .map(|c| (c.name, rounded(scales.value(c.value, c.dimension)), scales.unit(c.dimension)))
        .collect())
}

/// Middling shapes, every sign positive.
fn draws(to_ground: bool) -> Draws {
    Draws::new([if to_ground { 0.0 } else { 1.0 }, 0.5, 0.5, 0.5, 0.5, 0.5])
}

fn rounded(value: f64) -> f64 {
    format!("{value:.digits$e}", digits = DIGITS - 1).parse().unwrap_or(value)
}

/// True if the plant is one that turns: its displacement is an angle.
fn turns(name: &str) -> bool {
    name == "pendulum_restoring"
}

fn suited(name: &str, drive: DriveKind) -> Result<&'static catalogue::Effect, RigError> {
    let effect = effect(name)?;
    if effect.suits(drive) {
        return Ok(effect);
    }
    let problem = match drive {
        DriveKind::Base => "this effect has no place where the base moves: drive the mass by a force",
        DriveKind::Force => "this effect needs a base that moves: choose it under Drive",
        DriveKind::None => "this effect needs an input: choose another excitation than free decay",
    };
    Err(RigError::BadOption { option: "effect", problem: problem.to_owned() })
}

impl ChosenPlant {
    /// A plant with an effect whose records begin at `origin` and last for `length`, s.
    ///
    /// # Errors
    /// An unknown effect, or one that the drive has no place for.
    pub(crate) fn new(
        linear: &LinearPlant,
        given: Option<&ChosenEffect>,
        origin: f64,
        length: f64,
    ) -> Result<Self, RigError> {
        let host_plant = host_plant(linear, origin, length);
        let Some(given) = given else { return Ok(Self { assembly: Assembly::new(&[], &[], &host_plant) }) };
        let effect = suited(&given.name, linear.drive)?;
        let draws = draws(given.to_ground).giving(given.values.clone());
        let mut assembly = Assembly::new(&[(effect, draws)], &[OFFERED], &host_plant);
        // The level is given, too.
        assembly.parts.iter_mut().for_each(|part| part.level = 1.0);
        Ok(Self { assembly })
    }

    /// The plant's inputs and its states at t = 0, given an excitation and a displacement and velocity.
    pub(crate) fn driven(&self, excitation: Option<&Excitation>, initial: [f64; 2]) -> (Vec<Excitation>, Vec<f64>) {
        // Nothing is sampled here.
        let unused = SampleTimes { start: 0.0, interval: 1.0, count: 0 };
        self.assembly.driven(&run(excitation, initial, unused))
    }

    /// RMS missing force over RMS spring force during a motion.
    pub(crate) fn ratio(&self, motion: &PlantMotion) -> f64 {
        measure(&self.assembly, std::slice::from_ref(motion)).1
    }

    /// What the displacement sensor adds to the displacement, and the magnitude at which it is cut off.
    pub(crate) fn sensor_zero_and_limit(&self) -> (f64, f64) {
        match self.assembly.seen() {
            SensorFault::True => (0.0, f64::INFINITY),
            SensorFault::Shifted(size) => (size, f64::INFINITY),
            SensorFault::Clipped(limit) => (0.0, limit),
        }
    }

    /// Time by which the input arrives late, s.
    pub(crate) fn delay(&self) -> f64 {
        self.assembly.delay()
    }

    /// The missing acceleration but for what contacts give, in states of first order: displacement, velocity, inner states.
    pub(crate) fn forces(&self) -> impl Iterator<Item = &Expression> {
        self.assembly.parts.iter().map(|part| &part.force)
    }

    /// The plant itself, of first order.
    pub(crate) fn plant(&self) -> &crate::Plant {
        &self.assembly.plant
    }

    /// Where the effect acts, in words; empty where there is only one place.
    pub(crate) fn place(&self) -> &'static str {
        self.assembly.parts.first().map_or("", |part| part.place)
    }
}

impl LinearPlant {
    /// Natural frequency, Hz.
    pub(crate) fn natural_frequency(&self) -> f64 {
        self.stiffness.sqrt() / TAU
    }
}
