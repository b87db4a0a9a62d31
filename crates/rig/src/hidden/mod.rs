//! Rigs that hide an effect: records of a linear oscillator with something else in it, and the truth beside them.
//!
//! [`draw`] makes a plant of random frequency, damping and size, hides the effects asked for in it, and excites
//! and measures it.
//! The plant is `ẍ = −k(x − u) − c(ẋ − u̇) + Δ` (the base moves), `ẍ = −k x − c ẋ + b u + Δ` (a force acts) or
//! `ẍ = −k x − c ẋ + Δ` (free decay); each effect is its own Δ, its size given relative to the spring's force.
//! Nothing of the [`Truth`] stands in the records.

mod assembly;
mod calibrate;
mod case_excitation;
mod cases;
mod catalogue;
mod chosen;
mod contribution;
mod driving;
mod excitation_kind;
mod follow_up;
mod friction;
mod host_plant;
mod instruments;
mod memory;
mod quantities;
mod random;
mod regime;
mod scenario;
mod stiffness;
mod time;
mod truth;
mod unexplained;

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use sindyscope_values::record::{Record, Role};

use super::RigError;
use super::interpolant::Accuracy;
use super::motion::PlantMotion;
use super::sensor::Sensor;
use super::setup::{MeasuredChannel, MeasuredQuantity, RecordDrive, Sensors, Setup};
use super::truth::Truth;
use super::words::per_second;
use assembly::Assembly;
use calibrate::{calibrate, hold, linear_motion, measure, shift};
use catalogue::Effect;
use contribution::SensorFault;
use excitation_kind::{DrawnRecords, PlannedRecord, TestedPlant};
use host_plant::{Draws, HostPlant, Magnitude};
use quantities::{u, x};
use random::log_uniform;
use sindyscope_values::term::Term;
use truth::UnitScales;

pub(crate) use catalogue::{known_name, suits};
pub(crate) use chosen::{ChosenEffect, ChosenPlant, LinearPlant, suggestions};
pub(crate) use host_plant::DriveKind;

pub use catalogue::{exercised, names, outside_names, pairs, possible, title};
pub use excitation_kind::ExcitationKind;
pub use follow_up::{FollowUp, FollowUpDrive, follow_up};
pub use instruments::{Instruments, SensedMotion};
pub use regime::Regime;
pub use scenario::{HIDDEN_SCENARIO, HiddenOptions, NOTHING, hidden_records};

/// Draws of a plant after which no motion was found to be bounded.
const MOST_ATTEMPTS: u64 = 8;
/// The least of the ratio asked for that is accepted at the first try.
const LEAST_REACHED: f64 = 0.3;
/// The largest share of the time in which friction may hold the mass.
const MOST_STUCK: f64 = 0.4;
/// Ratios of missing force to spring force that are drawn.
const RATIOS: (f64, f64) = (0.02, 0.15);
/// The largest ratio that may be asked for.
const LARGEST_RATIO: f64 = 0.5;
/// Numbers of fitted samples that may be asked for.
const SAMPLES: (usize, usize) = (300, 1_000_000);

/// What is to be hidden and how it is tested.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenRequest {
    /// Names of the effects ([`names`], [`outside_names`]); none hides nothing.
    pub effects: Vec<String>,
    /// How the plant is excited.
    pub excitation_kind: ExcitationKind,
    /// The sensors.
    pub instruments: Instruments,
    /// Seed of everything drawn. The plant does not depend on the sensors.
    pub seed: u64,
    /// RMS missing force over RMS spring force, of each effect; drawn from 2 to 15 % if not given. An effect that cannot
    /// be as large (a delay beyond a twentieth of the natural period) stays below.
    pub ratio: Option<f64>,
    /// Samples in all fitted records together, which last 75 natural periods (a decay: until it has died down).
    pub samples: usize,
}

impl HiddenRequest {
    /// Effects under an excitation, measured with 1 % of white noise.
    pub fn new<S: Into<String>>(
        effects: impl IntoIterator<Item = S>,
        excitation_kind: ExcitationKind,
        seed: u64,
    ) -> Self {
        Self {
            effects: effects.into_iter().map(Into::into).collect(),
            excitation_kind,
            instruments: Instruments::white(0.01),
            seed,
            ratio: None,
            samples: 3000,
        }
    }

    /// One of [`names`] that the excitation can show, drawn too.
    pub fn blind(excitation_kind: ExcitationKind, seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(spread(seed, "blind"));
        let shown: Vec<&str> = names().filter(|name| exercised(name, excitation_kind)).collect();
        Self::new([shown[random.random_range(0..shown.len())]], excitation_kind, seed)
    }
}

/// The records of a test, and what they hide.
#[derive(Clone, Debug, PartialEq)]
pub struct Hidden {
    /// Records to fit.
    pub fit: Vec<Record>,
    /// Records held out.
    pub held_out: Vec<Record>,
    /// True if the input is the base's displacement; a force or nothing otherwise.
    pub base_excited: bool,
    /// Terms of the base model that the search is told; none for its own choice.
    pub base: Option<Vec<Term>>,
    /// What is hidden.
    pub truth: Truth,
}

/// Draws a plant that hides what is asked for, and makes its records.
///
/// # Errors
/// An unknown effect, or one that cannot be under the excitation; a ratio or number of samples out of bounds; a plant whose
/// motion stays unbounded however it is drawn.
pub fn draw(request: &HiddenRequest) -> Result<Hidden, RigError> {
    performed(request).map(|(plan, performed)| plan.hidden(&performed))
}

/// Draws plants until one hides what is asked for.
fn performed(request: &HiddenRequest) -> Result<(HiddenPlan<'static>, PerformedPlan), RigError> {
    let effects =
        request.effects.iter().map(|name| known(name, request.excitation_kind)).collect::<Result<Vec<_>, _>>()?;
    let bad = |option, problem: String| Err(RigError::BadOption { option, problem });
    if let Some(ratio) = request.ratio
        && !(ratio > 0.0 && ratio <= LARGEST_RATIO)
    {
        return bad("ratio", format!("{ratio} is out of bounds: give a share above 0, at most {LARGEST_RATIO}"));
    }
    if !(SAMPLES.0..=SAMPLES.1).contains(&request.samples) {
        let (least, most) = SAMPLES;
        return bad("samples", format!("{} is out of bounds: give a number from {least} to {most}", request.samples));
    }
    let Instruments { share, input_share, .. } = request.instruments;
    if !(0.0..=1.0).contains(&share) || !(0.0..=1.0).contains(&input_share) {
        return bad("noise", "give a share of the RMS from 0 to 100%".to_owned());
    }
    let mut failure = RigError::Unbounded { time: 0.0 };
    let mut weak = None;
    for attempt in 0..MOST_ATTEMPTS {
        let plan = HiddenPlan::draw(request, &effects, attempt)?;
        if let Some(fault) = plan.sensor_fault().filter(|_| request.instruments.shown != SensedMotion::Displacement) {
            return bad("measure", format!("{} is a fault of a displacement's sensor: measure x", fault.name));
        }
        let targets = match &plan.sizes {
            EffectSizes::Ratios(targets, _) => targets.clone(),
            EffectSizes::Still(..) | EffectSizes::Strengths(_) => Vec::new(),
        };
        match plan.perform() {
            Ok((plan, performed)) => {
                let ratios = performed.ratios.iter().zip(&targets);
                let weakest = ratios.map(|(ratio, target)| ratio / target).fold(1.0, f64::min);
                if weakest >= LEAST_REACHED {
                    return Ok((plan, performed));
                }
                if weak.is_some() {
                    break;
                }
                weak = Some((plan, performed));
            }
            Err(error) => failure = error,
        }
    }
    weak.ok_or(failure)
}

/// Draws the effect and the excitation too: one of [`names`], richly excited and measured with 1 % of white noise.
///
/// # Errors
/// As [`draw`].
pub fn blind(seed: u64) -> Result<Hidden, RigError> {
    let rich = [ExcitationKind::Multisine, ExcitationKind::SweepPair];
    let excitation_kind = rich[Pcg64::seed_from_u64(spread(seed, "shaking")).random_range(0..rich.len())];
    draw(&HiddenRequest::blind(excitation_kind, seed))
}

/// Draws a case of a regime: effect, plant, excitation and sensors.
///
/// # Errors
/// No plant was found that hides the effect drawn so that it can be told; another seed will do.
pub fn draw_in(regime: Regime, seed: u64) -> Result<Hidden, RigError> {
    if regime == Regime::Usual { blind(seed) } else { cases::draw(regime, seed) }
}

fn known(name: &str, excitation_kind: ExcitationKind) -> Result<&'static Effect, RigError> {
    let bad = |problem: String| RigError::BadOption { option: "effect", problem };
    let effect = catalogue::find(name).ok_or_else(|| {
        let known: Vec<&str> = names().chain(outside_names()).collect();
        bad(format!("there is no effect {name:?}; choose of: {}", known.join(", ")))
    })?;
    if effect.can_be_hidden(excitation_kind) {
        Ok(effect)
    } else {
        Err(bad(format!("{name} needs an input, and a free decay has none; choose another excitation")))
    }
}

/// A seed of its own for every use of one.
fn spread(seed: u64, text: &str) -> u64 {
    // FNV-1a, which is the same for ever.
    let hash = |h: u64, byte: u8| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    seed.to_le_bytes().into_iter().chain(text.bytes()).fold(0xcbf2_9ce4_8422_2325, hash)
}

/// How large effects are to be.
#[derive(Clone, Debug, PartialEq)]
enum EffectSizes {
    /// RMS missing force over RMS spring force (input, where there is no spring), of each, and the largest share of the
    /// time in which friction may hold the mass.
    Ratios(Vec<f64>, f64),
    /// Share of the time in which friction holds the mass still, and the bounds of it in each record.
    Still(f64, (f64, f64)),
    /// Their strengths.
    Strengths(Vec<f64>),
}

/// A drawn plant and test, before the effects have their strengths.
struct HiddenPlan<'a> {
    effects: Vec<(&'a Effect, Draws)>,
    sizes: EffectSizes,
    host_plant: HostPlant,
    runs: Vec<PlannedRecord>,
    scales: UnitScales,
    instruments: Instruments,
    seed: u64,
    /// Standard deviation of the noise that a control hears, without unit.
    feedback_noise: Option<f64>,
}

/// A plan carried out, without units.
struct PerformedPlan {
    assembly: Assembly,
    /// One a run, in their order.
    motions: Vec<PlantMotion>,
    ratios: Vec<f64>,
    ratio: f64,
    /// RMS of what an effect changes beyond the simpler one that it contains.
    beyond_simpler: Option<f64>,
    /// RMS of what the base model cannot follow.
    beyond_base: Option<f64>,
}

impl<'a> HiddenPlan<'a> {
    fn draw(request: &HiddenRequest, effects: &[&'a Effect], attempt: u64) -> Result<Self, RigError> {
        let key = format!("{} {} {attempt}", request.effects.join(" "), request.excitation_kind);
        let random = &mut Pcg64::seed_from_u64(spread(request.seed, &key));
        let drive = drive(effects, request.excitation_kind, random)?;
        let frequency = log_uniform(random, 0.2, 50.0);
        // Who waits for a tone to be steady has a plant in which it becomes so.
        let least_damping = if request.excitation_kind == ExcitationKind::SingleTone { 0.01 } else { 0.003 };
        let damping_ratio = log_uniform(random, least_damping, 0.05);
        let (small, large) = (log_uniform(random, 1e-6, 1.0), log_uniform(random, 0.05, 1.5));
        let pendulum = effects.iter().any(|e| e.name == "pendulum_restoring");
        let turns = drive != DriveKind::Base && (pendulum | (random.random::<f64>() < 0.25));
        let length = match (pendulum, turns) {
            (true, _) => 1.0,
            (false, true) => large,
            (false, false) => small,
        };
        let mass = log_uniform(random, 0.01, 100.0);
        let draws = effects.iter().map(|e| (*e, Draws::new(std::array::from_fn(|_| random.random())))).collect();
        let targets = effects
            .iter()
            .map(|_| {
                let drawn = log_uniform(random, RATIOS.0, RATIOS.1);
                request.ratio.unwrap_or(drawn)
            })
            .collect();
        let damping = 2.0 * damping_ratio;
        let subject = TestedPlant { drive, damping, rubs: effects.iter().any(|e| e.rubs) };
        let DrawnRecords { runs, origin, length: duration } =
            excitation_kind::draw(request.excitation_kind, subject, request.samples, random);
        let mut host_plant = HostPlant::linear(damping, drive, origin, duration);
        // A steady tone's initial state belongs to its input; a displaced start is relative to the forced motion.
        let runs = brought_to_one(&mut host_plant, runs, request.excitation_kind == ExcitationKind::SingleTone)?;
        let interval = runs.first().map_or(1.0, |r| r.sampling.interval);
        let scales = UnitScales::new(length, frequency * TAU, interval, mass, turns, drive);
        let sizes = EffectSizes::Ratios(targets, MOST_STUCK);
        let HiddenRequest { instruments, seed, .. } = *request;
        Ok(Self { effects: draws, sizes, host_plant, runs, scales, instruments, seed, feedback_noise: None })
    }

    /// An effect that is in the sensor, not in the motion.
    fn sensor_fault(&self) -> Option<&'a Effect> {
        let at_fault =
            |(e, draws): &&(&Effect, Draws)| (e.build)(e.first, draws, &self.host_plant).seen != SensorFault::True;
        self.effects.iter().find(at_fault).map(|(effect, _)| *effect)
    }

    /// Gives the effects their sizes and sets the plant in motion.
    fn perform(mut self) -> Result<(Self, PerformedPlan), RigError> {
        let assembly = match &self.sizes {
            EffectSizes::Ratios(targets, stuck) => {
                calibrate(&self.effects, targets, *stuck, &mut self.host_plant, &self.runs)?
            }
            EffectSizes::Still(share, bounds) => {
                hold(&self.effects, *share, *bounds, &mut self.host_plant, &self.runs)?
            }
            EffectSizes::Strengths(strengths) => Assembly::new(&self.effects, strengths, &self.host_plant),
        };
        let motions = self.setup(&assembly).motions()?;
        let fitted: Vec<PlantMotion> =
            self.runs.iter().zip(&motions).filter(|(run, _)| !run.held_out).map(|(_, m)| m.clone()).collect();
        let (ratios, ratio) = measure(&assembly, &fitted);
        let simpler = match assembly.without_static_level() {
            Some(simpler) => {
                let fit = self.runs.iter().filter(|run| !run.held_out);
                Some(fit.map(|run| simpler.follow(run, Accuracy::FINE)).collect::<Result<Vec<_>, _>>()?)
            }
            None => None,
        };
        let beyond_simpler = simpler.map(|simpler| {
            let shown = self.instruments.shown;
            let change = fitted.iter().zip(&simpler).flat_map(|(a, b)| shown.series(a).iter().zip(shown.series(b)));
            Magnitude::over(change.map(|(a, b)| a - b)).rms
        });
        // The linear plant of what excites itself has no response.
        let beyond_base = (self.host_plant.damping > 0.0 && !self.effects.is_empty())
            .then(|| unexplained::beyond_base(&assembly, &self.host_plant, &fitted));
        Ok((self, PerformedPlan { assembly, motions, ratios, ratio, beyond_simpler, beyond_base }))
    }

    /// Standard deviation of the noise of the motion's sensor, without unit.
    fn deviation(&self, motions: &[PlantMotion]) -> f64 {
        self.feedback_noise.unwrap_or_else(|| self.instruments.deviation(self.shown_rms(motions)))
    }

    /// RMS of what is shown of the motion over the fitted records, without unit.
    fn shown_rms(&self, motions: &[PlantMotion]) -> f64 {
        let fitted = self.runs.iter().zip(motions).filter(|(run, _)| !run.held_out);
        Magnitude::over(fitted.flat_map(|(_, m)| self.instruments.shown.series(m).iter().copied())).rms
    }

    /// The test that makes the records: one drive a run, a sensor of the motion and one of the input.
    fn setup(&self, assembly: &Assembly) -> Setup {
        let Self { runs, scales, instruments, host_plant, .. } = self;
        let drive = |(index, run): (usize, &PlannedRecord)| {
            let (inputs, initial) = assembly.driven(run);
            let start = ((run.sampling.start - host_plant.origin) / run.sampling.interval).round() * scales.interval;
            RecordDrive {
                name: run.name.clone(),
                inputs,
                initial,
                sampling: run.sampling,
                clock: (start, scales.interval),
                clock_seed: spread(self.seed, &format!("clock {index}")),
                held_out: run.held_out,
            }
        };
        let mut channels = vec![self.motion_channel(assembly)];
        channels.extend(assembly.measured_input().map(|quantity| MeasuredChannel {
            scale: scales.input,
            stream: 1,
            ..MeasuredChannel::new("u", Role::Input(0), scales.input_unit, quantity, instruments.input_sensor())
        }));
        Setup {
            plant: assembly.plant.clone(),
            drives: runs.iter().enumerate().map(drive).collect(),
            sensors: Sensors { channels, jitter: instruments.jitter, streams_a_record: 2 },
            seed: spread(self.seed, "sensors"),
        }
    }

    /// The sensor of the motion.
    fn motion_channel(&self, assembly: &Assembly) -> MeasuredChannel {
        let Self { scales, instruments, .. } = self;
        let shown = instruments.shown;
        let (role, unit) = match shown {
            SensedMotion::Displacement => (Role::Displacement(0), scales.unit.to_owned()),
            SensedMotion::Velocity => (Role::Velocity(0), per_second(scales.unit, 1)),
            SensedMotion::Acceleration => (Role::Acceleration(0), per_second(scales.unit, 2)),
        };
        // What a control hears is what is recorded: the noise is an input of the plant.
        let (quantity, sensor) = match self.feedback_noise {
            Some(_) => (MeasuredQuantity::Expression(x() + u(1)), Sensor::PERFECT),
            None => (shown.quantity(), instruments.sensor()),
        };
        let mut channel = MeasuredChannel {
            scale: scales.shown(shown),
            ..MeasuredChannel::new(shown.name(), role, unit, quantity, sensor)
        };
        match assembly.seen() {
            SensorFault::True => {}
            SensorFault::Shifted(size) => channel.zeros = (0..self.runs.len()).map(|run| size * shift(run)).collect(),
            SensorFault::Clipped(limit) => channel.limit = limit,
        }
        if let Some(datum) = self.host_plant.datum.filter(|_| shown == SensedMotion::Displacement) {
            channel.zeros.resize(self.runs.len(), 0.0);
            channel.zeros.iter_mut().for_each(|zero| *zero -= datum);
        }
        channel
    }

    /// The records, and what they hide.
    fn hidden(&self, performed: &PerformedPlan) -> Hidden {
        let PerformedPlan { assembly, motions, ratios, ratio, .. } = performed;
        let (mut fit, mut held_out) = (Vec::new(), Vec::new());
        for (run, record) in self.runs.iter().zip(self.setup(assembly).records(motions)) {
            if run.held_out { held_out.push(record) } else { fit.push(record) }
        }
        let offset = |(index, run): (usize, &PlannedRecord)| match assembly.seen() {
            SensorFault::Shifted(size) => Some((run.name.clone(), size * shift(index) * self.scales.length)),
            SensorFault::True | SensorFault::Clipped(_) => None,
        };
        let measured = truth::MeasuredSizes {
            ratios: ratios.clone(),
            ratio: *ratio,
            noise: self.deviation(motions) * self.scales.shown(self.instruments.shown),
            beyond_simpler: performed.beyond_simpler.map(|size| size * self.scales.shown(self.instruments.shown)),
            beyond_base: performed.beyond_base.map(|size| size * self.scales.length),
            offsets: self.runs.iter().enumerate().filter_map(offset).collect(),
        };
        let effects: Vec<_> = self
            .effects
            .iter()
            .zip(&assembly.parts)
            .map(|((effect, _), part)| (effect.name, effect.title, part))
            .collect();
        let truth = truth::told(&effects, &self.host_plant, &self.scales, &measured);
        let base_excited = self.host_plant.drive == DriveKind::Base;
        Hidden { fit, held_out, base_excited, base: self.host_plant.base_terms(), truth }
    }
}

/// The drive that all effects suit.
fn drive(effects: &[&Effect], excitation_kind: ExcitationKind, random: &mut Pcg64) -> Result<DriveKind, RigError> {
    let base_first = random.random::<bool>();
    let order = match (excitation_kind, base_first) {
        (ExcitationKind::Decay, _) => [DriveKind::None; 2],
        (_, true) => [DriveKind::Base, DriveKind::Force],
        (_, false) => [DriveKind::Force, DriveKind::Base],
    };
    order.into_iter().find(|drive| effects.iter().all(|e| e.suits(*drive))).ok_or_else(|| RigError::BadOption {
        option: "effect",
        problem: "these effects need different plants: one with a moving base and one without".to_owned(),
    })
}

/// Brings the runs to the level at which the linear plant's largest displacement is 1, and notes its motion; initial states
/// that belong to a steady motion keep to it, others are relative to the forced motion.
fn brought_to_one(
    host_plant: &mut HostPlant,
    runs: Vec<PlannedRecord>,
    steady: bool,
) -> Result<Vec<PlannedRecord>, RigError> {
    let state = |kept: f64| if steady { kept } else { 1.0 };
    let mut level = 1.0;
    if host_plant.drive != DriveKind::None {
        let forced: Vec<PlannedRecord> = runs.iter().map(|r| r.scaled(1.0, if steady { 1.0 } else { 0.0 })).collect();
        level = 1.0 / linear_motion(host_plant, &forced)?.x.peak;
    }
    let runs: Vec<PlannedRecord> = runs.iter().map(|r| r.scaled(level, state(level))).collect();
    let whole = 1.0 / linear_motion(host_plant, &runs)?.x.peak;
    let runs: Vec<PlannedRecord> = runs.iter().map(|r| r.scaled(whole, whole)).collect();
    host_plant.motion = linear_motion(host_plant, &runs)?;
    Ok(runs)
}

#[cfg(test)]
mod tests;
