//! How a plant with a hidden effect is excited: the records of one test.

use rand::RngExt;
use rand_pcg::Pcg64;
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::DriveKind;
use super::random::sign;
use crate::response::SampleTimes;
use crate::words::typed_names;
use crate::{Excitation, Harmonic};

/// How a plant with a hidden effect is excited. The band is 0.3 to 2.2 times the natural frequency.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExcitationKind {
    /// Random-phase multisines: two fitted at a level ratio of 2.5, another held out between them.
    Multisine,
    /// A sweep up and one down at 2.5 times its level, from a displaced start; a multisine held out.
    SweepPair,
    /// Four tones around resonance at one level, from rest or displaced, transients kept; a fifth held out.
    Tones,
    /// Free decays from two or three displacements; another held out. No input.
    Decay,
    /// One steady tone, its transient cut; the next stretch of the same motion held out.
    SingleTone,
}

typed_names!(ExcitationKind, "excitation", {
    Multisine => "multisine",
    SweepPair => "sweep-pair",
    Tones => "tones",
    Decay => "decay",
    SingleTone => "single-tone",
});

/// Natural periods in all fitted records together.
const PERIODS: f64 = 75.0;
/// Natural periods of a decay that dry friction ends.
const RUBBING: f64 = 11.0;
/// The level of the louder of two records over that of the other.
const LEVELS: f64 = 2.5;
/// The band, in natural frequencies.
const BAND: (f64, f64) = (0.3, 2.2);
const NATURAL: f64 = 1.0 / TAU;

/// One record in the making.
#[derive(Clone, Debug)]
pub(super) struct PlannedRecord {
    pub name: String,
    pub excitation: Option<Excitation>,
    /// The displacement sensor's noise where a control hears it.
    pub noise: Option<Excitation>,
    /// Displacement and velocity at t = 0.
    pub initial: [f64; 2],
    pub sampling: SampleTimes,
    pub held_out: bool,
}

/// A test: its runs, and when and for how long the fitted ones are recorded.
#[derive(Clone, Debug)]
pub(super) struct DrawnRecords {
    pub runs: Vec<PlannedRecord>,
    pub origin: f64,
    pub length: f64,
}

/// What a test is drawn for.
#[derive(Clone, Copy, Debug)]
pub(super) struct TestedPlant {
    pub drive: DriveKind,
    /// Viscous damping over mass.
    pub damping: f64,
    /// True if dry friction brings it to rest.
    pub rubs: bool,
}

/// Draws the runs of a test on a plant without units; `samples` are those of all fitted records together.
pub(super) fn draw(
    excitation_kind: ExcitationKind,
    subject: TestedPlant,
    samples: usize,
    random: &mut Pcg64,
) -> DrawnRecords {
    let TestedPlant { drive, damping, rubs } = subject;
    let records = match excitation_kind {
        ExcitationKind::Multisine | ExcitationKind::SweepPair => 2,
        ExcitationKind::Tones => 4,
        ExcitationKind::Decay => random.random_range(2..=3),
        ExcitationKind::SingleTone => 1,
    };
    let count = samples.div_ceil(records);
    let whole = TAU * PERIODS / records as f64;
    let length = match excitation_kind {
        // Until a twentieth is left of it.
        ExcitationKind::Decay => {
            whole.min((6.0 / damping).max(TAU * 8.0)).min(if rubs { TAU * RUBBING } else { whole })
        }
        _ => whole,
    };
    let held_out = samples.div_ceil(2);
    let interval = length / count as f64;
    // A steady tone is recorded once e⁻⁶ of a transient is left.
    let origin = if excitation_kind == ExcitationKind::SingleTone { (12.0 / damping).ceil() } else { 0.0 };
    let run = |excitation: Option<Excitation>, initial: [f64; 2], held: bool| PlannedRecord {
        name: String::new(),
        excitation,
        noise: None,
        initial,
        sampling: SampleTimes { start: origin, interval, count: if held { held_out } else { count } },
        held_out: held,
    };
    let lines = random.random_range(12..=20);
    let multisine = |level: f64, random: &mut Pcg64| {
        let band = (BAND.0 * NATURAL, BAND.1 * NATURAL);
        Excitation::multisine(level, band, lines, random.random()).fading_in(TAU)
    };
    let mut runs = match excitation_kind {
        ExcitationKind::Multisine => [(1.0, false), (LEVELS, false), (random.random_range(1.2..2.2), true)]
            .map(|(level, held)| run(Some(multisine(level, random)), [0.0; 2], held))
            .to_vec(),
        ExcitationKind::SweepPair => {
            let (low, high) = (BAND.0 * NATURAL, BAND.1 * NATURAL);
            let displaced = |random: &mut Pcg64| [sign(random) * random.random_range(0.4..0.9), 0.0];
            vec![
                run(Some(Excitation::sweep(1.0, low, high, length)), displaced(random), false),
                run(Some(Excitation::sweep(LEVELS, high, low, length)), displaced(random), false),
                run(Some(multisine(random.random_range(1.2..2.2), random)), [0.0; 2], true),
            ]
        }
        ExcitationKind::Tones => {
            let from_rest = random.random::<bool>();
            let fifth = if random.random::<bool>() { 1.42 } else { 1.82 };
            [(0.6, false), (0.8, false), (1.25, false), (1.6, false), (fifth, true)]
                .map(|(ratio, held)| {
                    let frequency = ratio * random.random_range(0.95..1.05) * NATURAL;
                    let displaced = if from_rest { 0.0 } else { sign(random) * random.random_range(0.4..0.9) };
                    let tone = Harmonic { amplitude: 1.0, frequency, phase: random.random_range(-3.0..3.0) };
                    run(Some(Excitation::tones([tone])), [displaced, 0.0], held)
                })
                .to_vec()
        }
        ExcitationKind::Decay => {
            let side = sign(random);
            let levels: &[f64] = if records == 3 { &[1.0, 0.6, 0.3] } else { &[1.0, 0.4] };
            let mut runs: Vec<PlannedRecord> =
                levels.iter().map(|level| run(None, [side * level, 0.0], false)).collect();
            runs.push(run(None, [-side * random.random_range(0.7..0.9), 0.0], true));
            runs
        }
        ExcitationKind::SingleTone => {
            let below = random.random::<bool>();
            let ratio = if below { random.random_range(0.55..0.92) } else { random.random_range(1.08..1.6) };
            let tone = Harmonic { amplitude: 1.0, frequency: ratio * NATURAL, phase: random.random_range(-3.0..3.0) };
            let excitation = Excitation::tones([tone]);
            let initial = steady(drive, damping, &tone);
            let mut next = run(Some(excitation.clone()), initial, true);
            next.sampling.start = origin + length;
            vec![run(Some(excitation), initial, false), next]
        }
    };
    for (index, run) in runs.iter_mut().enumerate() {
        run.name = if run.held_out { "held out".to_owned() } else { (index + 1).to_string() };
    }
    DrawnRecords { runs, origin, length }
}

/// Displacement and velocity at t = 0 of the linear plant's steady motion.
fn steady(drive: DriveKind, damping: f64, tone: &Harmonic) -> [f64; 2] {
    let omega = TAU * tone.frequency;
    let (real, imaginary) = (1.0 - omega * omega, damping * omega);
    let size = real * real + imaginary * imaginary;
    // Response over input, as a complex number: (1 + icω)/(1 − ω² + icω) or 1/(1 − ω² + icω).
    let top = if drive == DriveKind::Base { imaginary } else { 0.0 };
    let (a, b) = ((real + top * imaginary) / size, (top * real - imaginary) / size);
    let (sine, cosine) = tone.phase.sin_cos();
    [tone.amplitude * (a * cosine - b * sine), -tone.amplitude * omega * (a * sine + b * cosine)]
}

impl PlannedRecord {
    /// The same with another level of input and initial state.
    pub(super) fn scaled(&self, input: f64, state: f64) -> Self {
        let excitation = self.excitation.clone().map(|e| e.scaled(input));
        Self { excitation, initial: self.initial.map(|x| x * state), ..self.clone() }
    }

    /// The same, sampled `step` times more coarsely.
    pub(super) fn coarse(&self, step: usize) -> Self {
        let SampleTimes { start, interval, count } = self.sampling;
        let sampling = SampleTimes { start, interval: interval * step as f64, count: count.div_ceil(step) };
        Self { sampling, ..self.clone() }
    }
}
