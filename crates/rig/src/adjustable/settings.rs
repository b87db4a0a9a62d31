//! Everything that decides what an adjustable rig records.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::hidden::{DriveKind, LinearPlant, suits};
use crate::plant::Plant;
use crate::plants::{PlantKind, PlantParameter, THREE_MASSES, TWO_MASSES};
use crate::structures::{ADJUSTABLE_MASSES, ADJUSTABLE_NODES, FIVE_MASSES, SIX_NODES};
use crate::{Burst, Excitation, RigError};
use sindyscope_values::model::modes;

/// Samples of a record, at least and at most: more would make the rig slow to follow a slider.
const SAMPLES: (f64, f64) = (50.0, 60_000.0);
/// Largest number that a quantity may be given, in its SI unit.
const LARGEST: f64 = 1e9;
/// Harmonics of the multisine and of the random bursts.
const LINES: usize = 20;
const BURST_LINES: usize = 60;
/// Samples in a period of the highest natural frequency, and in one of the highest that a structure's test drives.
const SAMPLES_OF_PERIOD: f64 = 50.0;
const SAMPLES_OF_STRUCTURE: f64 = 12.0;
/// Harmonics of a structure's multisine: more modes than one or three lie in its band.
const LINES_OF_STRUCTURE: usize = 300;
/// Modes of a beam that its band reaches.
const DRIVEN_OF_BEAM: usize = 4;
/// Bursts in a record.
const BURSTS: usize = 4;

/// How many masses the plant has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlantChoice {
    /// One mass on a spring and a damper, with any effect of the catalogue.
    #[default]
    OneMass,
    /// Two masses in a chain, a force on the first.
    TwoMasses,
    /// Three masses in a chain, a force on the first.
    ThreeMasses,
    /// Five masses in a chain, a force on one, and a force beside the linear structure.
    FiveMasses,
    /// A cantilever beam of six elements, likewise.
    Beam,
}

impl PlantChoice {
    /// Every choice.
    pub const ALL: [Self; 5] = [Self::OneMass, Self::TwoMasses, Self::ThreeMasses, Self::FiveMasses, Self::Beam];

    /// The chain, if it is one.
    fn chain(self) -> Option<&'static PlantKind> {
        match self {
            Self::OneMass => None,
            Self::TwoMasses => Some(&TWO_MASSES),
            Self::ThreeMasses => Some(&THREE_MASSES),
            Self::FiveMasses => Some(&FIVE_MASSES),
            Self::Beam => Some(&SIX_NODES),
        }
    }

    /// Number of masses, or of nodes.
    pub fn masses(self) -> usize {
        match self {
            Self::OneMass => 1,
            Self::TwoMasses => 2,
            Self::ThreeMasses => 3,
            Self::FiveMasses => ADJUSTABLE_MASSES,
            Self::Beam => ADJUSTABLE_NODES,
        }
    }

    /// True if it has more modes than a chain of masses is identified with.
    pub fn is_structure(self) -> bool {
        matches!(self, Self::FiveMasses | Self::Beam)
    }

    /// The parameters of a chain; none of one mass, which has mass, natural frequency and damping ratio.
    pub fn parameters(self) -> &'static [PlantParameter] {
        self.chain().map_or(&[], |kind| kind.parameters)
    }
}

/// What drives one mass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RigDrive {
    /// A force on the mass, N.
    #[default]
    Force,
    /// The base moves, m; spring and damper stand on it.
    Base,
}

/// The time course of what drives the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExcitationChoice {
    /// Released from a displacement, nothing drives it.
    Decay,
    /// One harmonic.
    Harmonic,
    /// Harmonics spread over a band, their phases drawn by the seed.
    #[default]
    Multisine,
    /// A linear chirp through a band.
    Sweep,
    /// Random bursts in a band, with rests between.
    Bursts,
}

impl ExcitationChoice {
    /// Every choice.
    pub const ALL: [Self; 5] = [Self::Decay, Self::Harmonic, Self::Multisine, Self::Sweep, Self::Bursts];
}

/// A parameter of an effect, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectValue {
    /// Its name, as in the effect's equation.
    pub name: String,
    /// Its value; forces and stiffnesses are over mass.
    pub value: f64,
    /// The value that suited the motion when the effect was chosen.
    pub suggested: f64,
    /// Its unit.
    pub unit: String,
}

/// Everything that decides what an adjustable rig records. Two records are made: one to be fitted, and one to be held out,
/// at another level and with other phases.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RigSettings {
    /// The plant.
    pub plant: PlantChoice,
    /// One mass: its mass, kg.
    pub mass: f64,
    /// One mass: natural frequency of the linear plant, Hz.
    pub frequency: f64,
    /// One mass: damping ratio of the linear plant.
    pub damping_ratio: f64,
    /// One mass: what drives it.
    pub drive: RigDrive,
    /// One mass: name of the effect beside spring and damper, if there is one.
    pub effect: Option<String>,
    /// One mass on a moving base: the effect acts to the ground, else across the joint.
    pub to_ground: bool,
    /// The effect's parameters; those that are missing take values that suit the motion.
    pub effect_values: Vec<EffectValue>,
    /// A chain's parameters that differ from its own, by name.
    pub chain: BTreeMap<String, f64>,
    /// The time course of the input.
    pub excitation: ExcitationChoice,
    /// Amplitude of the input (its RMS is that of one harmonic of this amplitude), N or m; of a decay the displacement at the
    /// start, m.
    pub level: f64,
    /// Frequency of the harmonic, Hz.
    pub tone: f64,
    /// The band of multisine, sweep and bursts, Hz.
    pub band: (f64, f64),
    /// Time before the record in which the motion settles, s.
    pub settle: f64,
    /// Level of the record that is held out over that of the one that is fitted.
    pub held_out_level: f64,
    /// Standard deviation of the displacement sensors' noise over the RMS displacement.
    pub noise: f64,
    /// What the displacement sensors show at rest, over the RMS displacement.
    pub offset: f64,
    /// Standard deviation of the sampling instants, in sampling intervals; the record counts them as even.
    pub jitter: f64,
    /// Sampling rate, Hz.
    pub rate: f64,
    /// Duration of each record, s.
    pub duration: f64,
    /// Seed of noise and phases.
    pub seed: u64,
}

impl Default for RigSettings {
    fn default() -> Self {
        Self {
            plant: PlantChoice::OneMass,
            mass: 1.0,
            frequency: 2.0,
            damping_ratio: 0.02,
            drive: RigDrive::Force,
            effect: Some("coulomb_friction".to_owned()),
            to_ground: true,
            effect_values: Vec::new(),
            chain: BTreeMap::new(),
            excitation: ExcitationChoice::Multisine,
            level: 1.0,
            tone: 1.6,
            band: (0.6, 4.4),
            settle: 0.0,
            held_out_level: 0.7,
            noise: 0.005,
            offset: 0.0,
            jitter: 0.0,
            rate: 100.0,
            duration: 20.0,
            seed: 1,
        }
    }
}

fn within(what: &'static str, value: f64, (least, most): (f64, f64)) -> Result<f64, RigError> {
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    let problem = format!("{value} is out of bounds: give a number from {least} to {most}");
    Err(RigError::BadOption { option: what, problem })
}

impl RigSettings {
    /// Checks every number.
    ///
    /// # Errors
    /// One is out of bounds; the sentence says which, and what would do.
    pub fn check(&self) -> Result<(), RigError> {
        within("mass", self.mass, (1e-9, LARGEST))?;
        within("natural frequency", self.frequency, (1e-4, 1e6))?;
        within("damping ratio", self.damping_ratio, (0.0, 2.0))?;
        within("level", self.level, (-LARGEST, LARGEST))?;
        within("level held out", self.held_out_level, (-100.0, 100.0))?;
        within("settling time", self.settle, (0.0, 1e5))?;
        within("noise", self.noise, (0.0, 10.0))?;
        within("offset", self.offset, (-100.0, 100.0))?;
        within("jitter", self.jitter, (0.0, 0.4))?;
        let rate = within("sampling rate", self.rate, (1e-3, 1e7))?;
        within("length", self.duration, (1e-6, 1e5))?;
        let samples = (rate * self.duration).round();
        let (fewest, most) = SAMPLES;
        if !(fewest..=most).contains(&samples) {
            let problem = format!(
                "{} s at {rate} Hz are {samples} samples; the rig follows its sliders with {fewest} to {most}",
                self.duration
            );
            return Err(RigError::BadOption { option: "length", problem });
        }
        let highest = match self.excitation {
            ExcitationChoice::Decay => 0.0,
            ExcitationChoice::Harmonic => within("frequency", self.tone, (1e-6, 1e6))?,
            ExcitationChoice::Multisine | ExcitationChoice::Sweep | ExcitationChoice::Bursts => {
                within("band from", self.band.0, (1e-6, 1e6))?;
                within("band to", self.band.1, (1e-6, 1e6))?
            }
        };
        if highest >= 0.5 * rate {
            let problem = format!("{highest} Hz is not below half the sampling rate, {} Hz", 0.5 * rate);
            return Err(RigError::BadOption { option: "frequency", problem });
        }
        let values = self.effect_values.iter().map(|v| v.value).chain(self.chain.values().copied());
        for value in values {
            within("parameter", value, (-1e15, 1e15))?;
        }
        for parameter in self.plant.parameters() {
            within(parameter.name, self.chain_value(parameter), (parameter.least.max(-LARGEST), LARGEST))?;
        }
        Ok(())
    }

    /// Number of samples of each record.
    pub fn samples(&self) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a cast to an integer saturates")]
        let count = (self.rate * self.duration).round() as usize;
        count
    }

    /// A chain's parameter.
    pub fn chain_value(&self, parameter: &PlantParameter) -> f64 {
        self.chain.get(parameter.name).copied().unwrap_or(parameter.value)
    }

    /// The chain as a plant; none of one mass.
    pub(super) fn chain_plant(&self) -> Option<Plant> {
        let kind = self.plant.chain()?;
        // What [`Self::check`] would refuse, as in a file edited by hand, is no plant: it stays at the bound.
        let bounded = |p: &PlantParameter| self.chain_value(p).clamp(p.least.max(-LARGEST), LARGEST);
        let values: Vec<f64> = kind.parameters.iter().map(bounded).collect();
        Some((kind.build)(&values))
    }

    /// What drives the plant, as its equation counts it.
    pub(super) fn drive(&self) -> DriveKind {
        match (self.excitation, self.drive) {
            (ExcitationChoice::Decay, _) => DriveKind::None,
            (_, RigDrive::Force) => DriveKind::Force,
            (_, RigDrive::Base) => DriveKind::Base,
        }
    }

    pub(super) fn linear(&self) -> LinearPlant {
        let rate = TAU * self.frequency;
        LinearPlant {
            stiffness: rate * rate,
            damping: 2.0 * self.damping_ratio * rate,
            mobility: 1.0 / self.mass,
            drive: self.drive(),
        }
    }

    /// Natural frequencies of the linear plant, Hz, the lowest first.
    pub fn natural_frequencies(&self) -> Vec<f64> {
        match self.chain_plant() {
            None => vec![self.linear().natural_frequency()],
            Some(plant) => {
                let mut found: Vec<f64> = modes(&plant.smooth, &[]).iter().map(|m| m.frequency).collect();
                found.retain(|f| *f > 0.0 && f.is_finite());
                found.sort_by(f64::total_cmp);
                found
            }
        }
    }

    /// Excitation, sampling rate, length and settling time that suit the plant's natural frequencies: 50 samples a period of
    /// the highest (12 of a structure's, of a beam's first four), 40 periods of the lowest.
    #[must_use]
    pub fn suited(mut self) -> Self {
        let found = self.natural_frequencies();
        // A beam's highest modes are above what its tests drive.
        let last = if self.plant == PlantChoice::Beam { found.get(DRIVEN_OF_BEAM - 1) } else { found.last() };
        let (Some(lowest), Some(highest)) = (found.first().copied(), last.copied()) else { return self };
        let digits = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
        self.band = (digits(0.3 * lowest), digits(2.2 * highest));
        self.tone = digits(0.8 * lowest);
        self.duration = digits(40.0 / lowest);
        // A record of many sensors is to be studied at once, too.
        let samples = if self.plant.is_structure() { SAMPLES_OF_STRUCTURE } else { SAMPLES_OF_PERIOD };
        self.rate = digits(samples * highest).min(SAMPLES.1 / self.duration);
        self.settle = 0.0;
        self
    }

    /// Force over displacement of the plant's first spring, N/m (N m/rad).
    fn spring(&self) -> f64 {
        let value = |name: &str| {
            let parameter = self.plant.parameters().iter().find(|p| p.name == name)?;
            Some(self.chain_value(parameter).abs().max(f64::MIN_POSITIVE))
        };
        // A cantilever is bent at its tip.
        let bent = value("EI").zip(value("length")).map(|(bending, length)| 3.0 * bending / length.powi(3));
        let stretched = value("k1").or_else(|| value("k"));
        stretched.or(bent).unwrap_or_else(|| self.mass * self.linear().stiffness)
    }

    /// True if the level is a displacement, not a force.
    fn level_is_displacement(&self) -> bool {
        let base = self.plant == PlantChoice::OneMass && self.drive == RigDrive::Base;
        self.excitation == ExcitationChoice::Decay || base
    }

    /// A change after which the level is what moves the spring as far as before.
    #[must_use]
    fn levelled(self, change: impl FnOnce(&mut Self)) -> Self {
        let displacement = if self.level_is_displacement() { self.level } else { self.level / self.spring() };
        let mut new = self;
        change(&mut new);
        let level = if new.level_is_displacement() { displacement } else { displacement * new.spring() };
        new.level = format!("{level:.2e}").parse().unwrap_or(level);
        new
    }

    /// These settings with another plant, and an excitation that suits it.
    #[must_use]
    pub fn with_plant(self, plant: PlantChoice) -> Self {
        self.levelled(|s| s.plant = plant).suited()
    }

    /// These settings with another drive, as strong.
    #[must_use]
    pub fn with_drive(self, drive: RigDrive) -> Self {
        self.levelled(|s| s.drive = drive)
    }

    /// These settings with another time course of the input, as strong.
    #[must_use]
    pub fn with_excitation(self, excitation: ExcitationChoice) -> Self {
        self.levelled(|s| s.excitation = excitation)
    }

    /// These settings with another effect, its parameters to be suggested; the drive changes if the effect has no place in it.
    #[must_use]
    pub fn with_effect(mut self, effect: Option<String>) -> Self {
        self.effect_values.clear();
        self.effect = effect;
        let Some(name) = self.effect.clone() else { return self };
        if suits(&name, self.drive()) {
            return self;
        }
        if self.excitation == ExcitationChoice::Decay {
            self = self.with_excitation(ExcitationChoice::Multisine);
        }
        let other = if self.drive == RigDrive::Base { RigDrive::Force } else { RigDrive::Base };
        if suits(&name, self.drive()) { self } else { self.with_drive(other) }
    }

    /// The unit of displacements: an angle where the effect makes it one.
    pub fn unit(&self) -> &'static str {
        if self.turns() { "rad" } else { "m" }
    }

    /// The unit of the input.
    pub fn input_unit(&self) -> &'static str {
        match (self.plant, self.drive, self.turns()) {
            (PlantChoice::OneMass, RigDrive::Base, _) => self.unit(),
            (.., true) => "N m",
            (.., false) => "N",
        }
    }

    fn turns(&self) -> bool {
        self.plant == PlantChoice::OneMass && self.effect.as_deref() == Some("pendulum_restoring")
    }

    /// The excitation of the record that is fitted, or of the one that is held out; none of a decay.
    pub(super) fn waveform(&self, held_out: bool) -> Option<Excitation> {
        let level = self.level * if held_out { self.held_out_level } else { 1.0 };
        let seed = self.seed.wrapping_mul(2).wrapping_add(u64::from(held_out));
        let end = self.settle + self.duration;
        let (low, high) = self.band;
        Some(match self.excitation {
            ExcitationChoice::Decay => return None,
            // Another frequency tells more than the same once more.
            ExcitationChoice::Harmonic => Excitation::harmonic(level, self.tone * if held_out { 1.2 } else { 1.0 }),
            ExcitationChoice::Multisine => {
                let lines = if self.plant.is_structure() { LINES_OF_STRUCTURE } else { LINES };
                Excitation::multisine(level, self.band, lines, seed).fading_in((1.0 / low).min(0.1 * end))
            }
            ExcitationChoice::Sweep if held_out => Excitation::sweep(level, high, low, end),
            ExcitationChoice::Sweep => Excitation::sweep(level, low, high, end),
            ExcitationChoice::Bursts => {
                let slot = end / BURSTS as f64;
                let burst = |k: usize| {
                    let from = slot * (k as f64 + 0.02);
                    Burst { from, to: from + 0.5 * slot, edge: 0.1 * slot }
                };
                Excitation::multisine(level, self.band, BURST_LINES, seed).in_bursts((0..BURSTS).map(burst).collect())
            }
        })
    }

    /// Displacement at the start, m or rad.
    pub(super) fn displaced(&self, held_out: bool) -> f64 {
        match self.excitation {
            ExcitationChoice::Decay => self.level * if held_out { self.held_out_level } else { 1.0 },
            _ => 0.0,
        }
    }
}
