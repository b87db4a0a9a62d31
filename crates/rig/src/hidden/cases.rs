//! Cases drawn in a regime: effect, plant, excitation and sensors together.

use std::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::calibrate::linear_motion;
use super::case_excitation::{self, CaseExcitation, RecordLength};
use super::catalogue::{self, Effect};
use super::excitation_kind::{ExcitationKind, PlannedRecord};
use super::host_plant::{Control, Draws, DriveKind, HostPlant, Magnitude, MotionSize};
use super::instruments::Instruments;
use super::random::{log_uniform, one_of, sign};
use super::regime::Regime;
use super::truth::UnitScales;
use super::{EffectSizes, Hidden, HiddenPlan, MOST_STUCK, PerformedPlan, brought_to_one, drive, spread};
use crate::interpolant::Accuracy;
use crate::motion::PlantMotion;
use crate::{Excitation, NoiseKind, RigError};

/// Draws of a plant after which none was found that hides the effect well.
const MOST_ATTEMPTS: u64 = 30;
/// The least RMS of what the base model cannot follow, over the noise.
const LEAST_TOLD: f64 = 2.0;
/// The same of what a static level changes beyond Coulomb's friction.
const LEAST_TRAIT: f64 = 0.5;
/// Bounds of the share of each record in which friction holds the mass still, in the regime [`Regime::Sticking`].
pub(super) const STILL: (f64, f64) = (0.1, 0.7);
/// The largest difference, over the RMS displacement, of two integrations of different accuracy: what grows from less is
/// chaos, which no simulation follows.
const LEAST_PREDICTABLE: f64 = 0.02;
/// Samples from which natural periods count, the fewest of them, and the most samples.
const FEWEST_PERIODS: f64 = 20.0;
const SAMPLES: (f64, f64) = (1500.0, 7000.0);

/// What a seed stands for in a regime, whatever plant turns out to suit it.
#[derive(Clone, Debug)]
struct CaseOutline {
    effects: Vec<&'static str>,
    excitation: CaseExcitation,
    /// A cubic spring is known.
    known_cubic: bool,
}

impl CaseOutline {
    fn draw(regime: Regime, seed: u64) -> Self {
        let random = &mut Pcg64::seed_from_u64(spread(seed, &format!("{regime} theme")));
        let rich = [CaseExcitation::Multisine, CaseExcitation::Sweep, CaseExcitation::Bursts, CaseExcitation::Levels];
        let with =
            |effects: Vec<&'static str>, excitation: CaseExcitation| Self { effects, excitation, known_cubic: false };
        match regime {
            Regime::Usual | Regime::Wide | Regime::Sensors => {
                with(any(ExcitationKind::Multisine, random), one_of(&rich, random))
            }
            Regime::SeveralRecords => {
                let count = random.random_range(2..=4);
                if random.random() {
                    with(any(ExcitationKind::Decay, random), CaseExcitation::Releases(count))
                } else {
                    with(any(ExcitationKind::Multisine, random), CaseExcitation::Mixed(count))
                }
            }
            Regime::LightDamping => {
                let known_cubic = random.random_bool(1.0 / 3.0);
                let list: &[&str] = if known_cubic {
                    &[
                        "coulomb_friction",
                        "quadratic_damping",
                        "cubic_damping",
                        "displacement_dependent_damping",
                        "quadratic_stiffness",
                        "constant_force",
                    ]
                } else {
                    &[
                        "cubic_stiffness",
                        "cubic_stiffness",
                        "quintic_stiffness",
                        "quadratic_stiffness",
                        "clearance",
                        "one_sided_stop",
                        "bilinear_stiffness",
                        "pendulum_restoring",
                    ]
                };
                Self { known_cubic, ..with(vec![one_of(list, random)], one_of(&rich, random)) }
            }
            Regime::Sticking => {
                let effect = one_of(&["coulomb_friction", "stribeck_friction", "static_friction"], random);
                with(
                    vec![effect],
                    one_of(&[CaseExcitation::Tones, CaseExcitation::Tones, CaseExcitation::Multisine], random),
                )
            }
            Regime::NoSpring => {
                with(rubbed(random), one_of(&[CaseExcitation::Multisine, CaseExcitation::Bursts], random))
            }
            Regime::ClosedLoop => {
                with(rubbed(random), one_of(&[CaseExcitation::Moves, CaseExcitation::Multisine], random))
            }
            Regime::Datum => {
                let list = [
                    "pendulum_restoring",
                    "pendulum_restoring",
                    "pendulum_restoring",
                    "cubic_stiffness",
                    "cubic_stiffness",
                    "clearance",
                    "one_sided_stop",
                    "displacement_dependent_damping",
                    "position_dependent_friction",
                ];
                let effect = one_of(&list, random);
                let free = effect == "pendulum_restoring" || random.random();
                let excitation =
                    if free { CaseExcitation::Releases(random.random_range(2..=4)) } else { CaseExcitation::Multisine };
                with(vec![effect], excitation)
            }
            Regime::SelfExcited => {
                let effect = if random.random_bool(0.8) { "displacement_dependent_damping" } else { "cubic_damping" };
                with(vec![effect], CaseExcitation::Releases(random.random_range(1..=3)))
            }
        }
    }
}

/// One of the named effects that the excitation can show; in one of fifteen cases none.
fn any(excitation_kind: ExcitationKind, random: &mut Pcg64) -> Vec<&'static str> {
    if random.random_bool(1.0 / 15.0) {
        return Vec::new();
    }
    let shown: Vec<&str> = catalogue::names().filter(|name| catalogue::exercised(name, excitation_kind)).collect();
    vec![one_of(&shown, random)]
}

/// What hides in the motion of a mass without a spring.
fn rubbed(random: &mut Pcg64) -> Vec<&'static str> {
    let [friction, constant] = ["coulomb_friction", "constant_force"];
    match random.random_range(0..5) {
        0 => vec![constant],
        1 => vec![friction, constant],
        _ => vec![friction],
    }
}

/// Draws a case.
///
/// # Errors
/// No plant was found that hides the effect so that it can be told.
pub(super) fn draw(regime: Regime, seed: u64) -> Result<Hidden, RigError> {
    search(regime, seed).map(|(plan, performed)| plan.hidden(&performed))
}

/// The first plan whose motion is of the regime.
pub(super) fn search(regime: Regime, seed: u64) -> Result<(HiddenPlan<'static>, PerformedPlan), RigError> {
    let outline = CaseOutline::draw(regime, seed);
    let mut problem = String::new();
    for attempt in 0..MOST_ATTEMPTS {
        match plan(regime, &outline, seed, attempt).and_then(HiddenPlan::perform) {
            Ok((plan, performed)) => match unfit(regime, &plan, &performed) {
                None => return Ok((plan, performed)),
                Some(unfit) => problem = unfit,
            },
            Err(error) => problem = error.to_string(),
        }
    }
    let effects = outline.effects.join(" and ");
    Err(RigError::NotDrawn { regime: regime.name(), effects, attempts: MOST_ATTEMPTS, problem })
}

/// Why a case is none of its regime, if it is not.
fn unfit(regime: Regime, plan: &HiddenPlan<'_>, performed: &PerformedPlan) -> Option<String> {
    let PerformedPlan { assembly, motions, beyond_base, beyond_simpler, .. } = performed;
    if regime == Regime::Sticking {
        let still: Vec<f64> = motions.iter().map(|m| super::assembly::stuck_share(std::slice::from_ref(m))).collect();
        if !still.iter().all(|share| (STILL.0..=STILL.1).contains(share)) {
            return Some(format!("the mass stands still in {still:.2?} of the records"));
        }
    }
    let noise = plan.deviation(&performed.motions);
    if regime != Regime::SelfExcited
        && !plan.effects.is_empty()
        && beyond_base.is_some_and(|left| left < LEAST_TOLD * noise)
    {
        return Some("what is hidden drowns in the noise".to_owned());
    }
    if beyond_simpler.is_some_and(|left| left < LEAST_TRAIT * noise) {
        return Some("the static level changes next to nothing".to_owned());
    }
    let rms = |motion: &PlantMotion| Magnitude::over(motion.states[0].iter().copied()).rms;
    let unpredictable = || {
        plan.runs.iter().zip(motions).any(|(run, motion)| {
            let Ok(rough) = assembly.follow_at(run, motion.times.clone(), Accuracy::DRAFT) else { return true };
            let change = Magnitude::over(rough.states[0].iter().zip(&motion.states[0]).map(|(a, b)| a - b)).rms;
            change > LEAST_PREDICTABLE * rms(motion)
        })
    };
    (plan.host_plant.sprung && unpredictable()).then(|| "the motion is chaotic".to_owned())
}

/// Everything of a case that numbers are drawn for, in 1/ω₀ and samples.
struct CaseNumbers {
    /// Hz.
    frequency: f64,
    damping: f64,
    samples_a_period: f64,
    instruments: Instruments,
}

impl CaseNumbers {
    fn draw(regime: Regime, random: &mut Pcg64) -> Self {
        let frequency = match regime {
            Regime::NoSpring | Regime::ClosedLoop => log_uniform(random, 0.3, 20.0),
            _ => log_uniform(random, 0.3, 80.0),
        };
        let (low, high) = match regime {
            Regime::LightDamping => (0.006, 0.016),
            Regime::Sticking | Regime::Datum => (0.002, 0.04),
            Regime::NoSpring | Regime::ClosedLoop => (0.02, 0.3),
            Regime::SelfExcited => (0.05, 1.0),
            _ => (0.002, 0.08),
        };
        let damping = 2.0 * log_uniform(random, low, high);
        let (sparse, dense) = match regime {
            Regime::Sticking | Regime::SelfExcited => (30.0, 150.0),
            Regime::NoSpring | Regime::Datum => (20.0, 150.0),
            Regime::ClosedLoop => (60.0, 150.0),
            _ => (12.0, 150.0),
        };
        let samples_a_period = log_uniform(random, sparse, dense);
        let noise = match regime {
            Regime::NoSpring => log_uniform(random, 1e-3, 0.03),
            Regime::ClosedLoop => log_uniform(random, 5e-4, 0.01),
            Regime::Sticking => log_uniform(random, 3e-3, 0.03),
            _ => log_uniform(random, 3e-3, 0.05),
        };
        let mut instruments = Instruments::white(noise);
        if regime == Regime::Sensors {
            match random.random_range(0..3) {
                0 => instruments.kind = NoiseKind::Coloured,
                1 => instruments.kind = NoiseKind::Quantised,
                _ => instruments.jitter = random.random_range(0.01..0.05),
            }
        }
        let damping = if regime == Regime::SelfExcited { -damping } else { damping };
        Self { frequency, damping, samples_a_period, instruments }
    }
}

fn plan(regime: Regime, outline: &CaseOutline, seed: u64, attempt: u64) -> Result<HiddenPlan<'static>, RigError> {
    let random = &mut Pcg64::seed_from_u64(spread(seed, &format!("{regime} {attempt}")));
    let effects: Vec<&'static Effect> = outline.effects.iter().filter_map(|name| catalogue::find(name)).collect();
    let CaseNumbers { frequency, damping, samples_a_period, instruments } = CaseNumbers::draw(regime, random);
    let drive = match (regime, outline.excitation) {
        (Regime::Sticking, CaseExcitation::Tones) if random.random_bool(0.8) => DriveKind::Base,
        (_, CaseExcitation::Releases(_)) => DriveKind::None,
        // A spring to the moving base is never at rest: it has no zero of its own.
        (Regime::NoSpring | Regime::ClosedLoop | Regime::Sticking | Regime::Datum, _) => DriveKind::Force,
        _ => drive(&effects, ExcitationKind::Multisine, random)?,
    };
    let samples = log_uniform(random, SAMPLES.0, SAMPLES.1).max(FEWEST_PERIODS * samples_a_period).min(SAMPLES.1);
    // A shifted zero is told from a constant force by another record's.
    let apart = effects.iter().any(|e| e.name == "sensor_offset");
    let recording = RecordLength {
        interval: TAU / samples_a_period,
        samples: samples as usize,
        least_records: if apart { 2 } else { 1 },
    };
    let mut runs = case_excitation::runs(outline.excitation, recording, random);
    let mut draws: Vec<(&Effect, Draws)> =
        effects.iter().map(|e| (*e, Draws::new(std::array::from_fn(|_| random.random())))).collect();
    let length = runs.first().map_or(1.0, |run| run.sampling.interval * run.sampling.count as f64);
    let mut host_plant = HostPlant::linear(damping, drive, 0.0, length);
    host_plant.sprung = !matches!(regime, Regime::NoSpring | Regime::ClosedLoop);
    host_plant.grounded_damper = regime == Regime::Sticking && drive == DriveKind::Base && random.random();
    if regime == Regime::ClosedLoop {
        host_plant.control = Some(control(random));
    }
    let pendulum = effects.iter().any(|e| e.name == "pendulum_restoring");
    let turns = drive != DriveKind::Base && (pendulum || random.random_bool(0.25));
    let unit = match (pendulum, turns) {
        (true, _) => 1.0,
        (false, true) => log_uniform(random, 0.05, 1.5),
        (false, false) => log_uniform(random, 1e-5, 0.3),
    };
    let sizes = sizes(regime, outline, damping, &mut draws, random);
    if regime == Regime::SelfExcited {
        let one = Magnitude { peak: 1.0, rms: 1.0 };
        host_plant.motion = MotionSize { x: one, v: one, r: one, w: one, u: one };
        let begin = |random: &mut Pcg64| sign(random) * log_uniform(random, 0.1, 3.5);
        runs.iter_mut().for_each(|run| run.initial = [begin(random), 0.0]);
    } else {
        runs = brought_to_one(&mut host_plant, runs, false)?;
    }
    if outline.known_cubic {
        know_a_cubic(&mut host_plant, &runs, log_uniform(random, 0.3, 1.2))?;
    }
    if regime == Regime::Datum {
        let reach = match &sizes {
            EffectSizes::Strengths(angles) => angles.iter().copied().fold(0.0, f64::max),
            EffectSizes::Ratios(..) | EffectSizes::Still(..) => 1.0,
        };
        // A pendulum is often counted from the upper rest.
        let turned = pendulum && random.random_bool(0.7);
        host_plant.datum = Some(sign(random) * if turned { PI } else { reach * log_uniform(random, 0.8, 5.0) });
    }
    let mut feedback_noise = None;
    if host_plant.control.is_some() {
        let deviation = instruments.share * host_plant.motion.x.rms;
        runs.iter_mut().for_each(|run| run.noise = Some(noise(run, deviation, random)));
        feedback_noise = Some(deviation);
    }
    let mass = log_uniform(random, 0.01, 100.0);
    let scales = UnitScales::new(unit, frequency * TAU, recording.interval, mass, turns, drive);
    Ok(HiddenPlan { effects: draws, sizes, host_plant, runs, scales, instruments, seed, feedback_noise })
}

/// A force that follows its reference one and a half to three times as fast as this moves.
fn control(random: &mut Pcg64) -> Control {
    let rate = log_uniform(random, 1.5, 3.0);
    Control {
        proportional: rate * rate,
        derivative: 2.0 * random.random_range(0.6..1.0) * rate,
        filter: random.random_range(0.2..0.4) / rate,
    }
}

fn sizes(
    regime: Regime,
    outline: &CaseOutline,
    damping: f64,
    draws: &mut [(&Effect, Draws)],
    random: &mut Pcg64,
) -> EffectSizes {
    let (low, high) = match regime {
        Regime::LightDamping if outline.known_cubic => (0.02, 0.2),
        Regime::LightDamping => (0.15, 0.6),
        Regime::NoSpring | Regime::ClosedLoop => (0.05, 0.6),
        _ => (0.02, 0.4),
    };
    match regime {
        Regime::Sticking => {
            // Friction to the ground: in the joint, the mass would stick to the moving base.
            draws.iter_mut().for_each(|(_, draws)| draws.uniforms[0] = 0.0);
            EffectSizes::Still(random.random_range(STILL.0 + 0.05..STILL.1 - 0.05), STILL)
        }
        // The unit of displacement is that at which the damping changes sign.
        Regime::SelfExcited => EffectSizes::Strengths(vec![-damping]),
        Regime::Datum if outline.effects.contains(&"pendulum_restoring") => {
            EffectSizes::Strengths(vec![random.random_range(50.0_f64..120.0).to_radians()])
        }
        _ => {
            // Where an excitation rests, friction holds the mass.
            let rests = matches!(
                outline.excitation,
                CaseExcitation::Bursts | CaseExcitation::Moves | CaseExcitation::Mixed(_) | CaseExcitation::Releases(_)
            );
            let stuck = if rests { 0.8 } else { MOST_STUCK };
            EffectSizes::Ratios(draws.iter().map(|_| log_uniform(random, low, high)).collect(), stuck)
        }
    }
}

/// Gives the plant a cubic spring whose force at the largest deflection is a share of the linear one's.
fn know_a_cubic(host_plant: &mut HostPlant, runs: &[PlannedRecord], share: f64) -> Result<(), RigError> {
    for _ in 0..4 {
        host_plant.cubic = share / host_plant.motion.r.peak.powi(2);
        host_plant.motion = linear_motion(host_plant, runs)?;
    }
    Ok(())
}

/// White noise at the samples, straight lines between them.
fn noise(run: &PlannedRecord, deviation: f64, random: &mut Pcg64) -> Excitation {
    let values = match Normal::new(0.0, deviation) {
        Ok(normal) => (0..run.sampling.count).map(|_| normal.sample(random)).collect(),
        Err(_) => Vec::new(),
    };
    Excitation::piecewise_linear(run.sampling.interval, values)
}
