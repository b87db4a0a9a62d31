//! The runs of a case in a regime: other records than those of [`super::excitation_kind`], of any length and sampling.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_pcg::Pcg64;

use super::excitation_kind::PlannedRecord;
use super::random::{log_uniform, one_of, sign};
use crate::response::SampleTimes;
use crate::{Burst, Excitation, Harmonic, Transition};

/// How the runs of a case are excited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CaseExcitation {
    /// One or two random-phase multisines; another held out.
    Multisine,
    /// A sweep up, down, or both; a multisine or another sweep held out.
    Sweep,
    /// Noise or tones in bursts, with rests between; others held out.
    Bursts,
    /// One excitation at two or three levels; another held out between them.
    Levels,
    /// Three tones below the natural frequency, and a fourth held out.
    Tones,
    /// This many releases from rest; another held out.
    Releases(usize),
    /// Moves from place to place; other moves held out. For a reference to be followed.
    Moves,
    /// This many different excitations; a multisine held out.
    Mixed(usize),
}

/// How long and how densely a case is recorded.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordLength {
    /// Sampling interval in 1/ω₀.
    pub interval: f64,
    /// Samples in all fitted records together.
    pub samples: usize,
    /// The fewest fitted records.
    pub least_records: usize,
}

const NATURAL: f64 = 1.0 / TAU;

/// Draws the runs: fitted ones, then the one held out.
pub(super) fn runs(excitation: CaseExcitation, recording: RecordLength, random: &mut Pcg64) -> Vec<PlannedRecord> {
    let least = recording.least_records;
    let (fewest, most) = match excitation {
        CaseExcitation::Multisine | CaseExcitation::Sweep | CaseExcitation::Bursts | CaseExcitation::Moves => {
            (least.min(2), 2)
        }
        CaseExcitation::Levels => (2, 3),
        CaseExcitation::Tones => (3, 3),
        CaseExcitation::Releases(count) | CaseExcitation::Mixed(count) => (count, count),
    };
    let records = random.random_range(fewest.max(1)..=most);
    let count = recording.samples.div_ceil(records);
    let held_out = count.max(recording.samples / 3).min(recording.samples / 2 + 1);
    let excite = ExcitationDraws {
        length: recording.interval * count as f64,
        low: random.random_range(0.2..0.45),
        high: random.random_range(1.7..2.6),
    };
    let excitations = excitations(excitation, records, &excite, random);
    let run = |(index, (excitation, initial)): (usize, (Option<Excitation>, [f64; 2]))| {
        let held = index == records;
        PlannedRecord {
            name: if held { "held out".to_owned() } else { (index + 1).to_string() },
            excitation,
            noise: None,
            initial,
            sampling: SampleTimes {
                start: 0.0,
                interval: recording.interval,
                count: if held { held_out } else { count },
            },
            held_out: held,
        }
    };
    excitations.into_iter().enumerate().map(run).collect()
}

/// What drives each record, if anything does, and the displacement and velocity that it begins with: `records` fitted ones,
/// then the one held out.
fn excitations(
    excitation: CaseExcitation,
    records: usize,
    excite: &ExcitationDraws,
    random: &mut Pcg64,
) -> Vec<(Option<Excitation>, [f64; 2])> {
    let level = |random: &mut Pcg64| random.random_range(1.2..2.2);
    let mut excitations: Vec<(Option<Excitation>, [f64; 2])> = Vec::new();
    match excitation {
        CaseExcitation::Multisine => {
            let louder = random.random_range(1.5..3.0);
            for k in 0..records {
                let size = if k == 0 { 1.0 } else { louder };
                excitations.push((Some(excite.multisine(size, random)), displaced(random)));
            }
            let size = if records == 1 { random.random_range(0.8..1.1) } else { random.random_range(1.0..louder) };
            excitations.push((Some(excite.multisine(size, random)), [0.0; 2]));
        }
        CaseExcitation::Sweep => {
            let mut up = random.random::<bool>();
            for _ in 0..records {
                excitations.push((Some(excite.sweep(random.random_range(0.7..1.6), up)), displaced(random)));
                up = !up;
            }
            let other = if random.random_bool(0.6) {
                excite.multisine(level(random), random)
            } else {
                excite.sweep(random.random_range(0.7..1.2), up)
            };
            excitations.push((Some(other), [0.0; 2]));
        }
        CaseExcitation::Bursts => {
            let noise = random.random::<bool>();
            excitations.extend((0..=records).map(|_| (Some(excite.bursts(noise, random)), [0.0; 2])));
        }
        CaseExcitation::Levels => {
            let sweeps = random.random_bool(0.3);
            let whole = if sweeps { excite.sweep(1.0, random.random()) } else { excite.multisine(1.0, random) };
            let step = random.random_range(1.5..2.5);
            for k in 0..records {
                excitations.push((Some(whole.clone().scaled(f64::powi(step, k as i32))), [0.0; 2]));
            }
            let between = random.random_range(1.0..f64::powi(step, records as i32 - 1));
            excitations.push((Some(excite.multisine(between, random)), [0.0; 2]));
        }
        CaseExcitation::Tones => {
            for ratio in [0.25..0.45, 0.4..0.65, 0.55..0.9, 0.3..0.85] {
                excitations.push((Some(excite.tone(random.random_range(ratio), random)), [0.0; 2]));
            }
        }
        CaseExcitation::Releases(_) => {
            for k in 0..=records {
                let size = if k == 0 { 1.0 } else { random.random_range(0.35..0.95) };
                excitations.push((None, [sign(random) * size, 0.0]));
            }
        }
        CaseExcitation::Moves => excitations.extend((0..=records).map(|_| (Some(excite.moves(random)), [0.0; 2]))),
        CaseExcitation::Mixed(_) => {
            for _ in 0..records {
                let one = match one_of(
                    &[CaseExcitation::Multisine, CaseExcitation::Sweep, CaseExcitation::Bursts, CaseExcitation::Tones],
                    random,
                ) {
                    CaseExcitation::Sweep => excite.sweep(1.0, random.random()),
                    CaseExcitation::Bursts => excite.bursts(random.random(), random),
                    CaseExcitation::Tones => excite.tone(random.random_range(0.5..1.6), random),
                    _ => excite.multisine(1.0, random),
                };
                excitations.push((Some(one.scaled(random.random_range(0.6..1.6))), displaced(random)));
            }
            excitations.push((Some(excite.multisine(level(random), random)), [0.0; 2]));
        }
    }
    excitations
}

/// From rest, or in three of ten cases displaced.
fn displaced(random: &mut Pcg64) -> [f64; 2] {
    if random.random_bool(0.3) { [sign(random) * random.random_range(0.3..0.8), 0.0] } else { [0.0; 2] }
}

/// What excites the records of one length in one band, in natural frequencies.
struct ExcitationDraws {
    length: f64,
    low: f64,
    high: f64,
}

impl ExcitationDraws {
    fn multisine(&self, level: f64, random: &mut Pcg64) -> Excitation {
        let lines = random.random_range(12..=50);
        Excitation::multisine(level, (self.low * NATURAL, self.high * NATURAL), lines, random.random()).fading_in(TAU)
    }

    fn sweep(&self, level: f64, up: bool) -> Excitation {
        let (from, to) = if up { (self.low, self.high) } else { (self.high, self.low) };
        Excitation::sweep(level, from * NATURAL, to * NATURAL, self.length)
    }

    fn tone(&self, ratio: f64, random: &mut Pcg64) -> Excitation {
        let phase = random.random_range(-3.0..3.0);
        Excitation::tones([Harmonic { amplitude: 1.0, frequency: ratio * NATURAL, phase }])
    }

    fn bursts(&self, noise: bool, random: &mut Pcg64) -> Excitation {
        // Eight to sixteen natural periods each, a half of them at rest, and two bursts at least.
        let slots = (self.length / (TAU * random.random_range(8.0..16.0))).floor().clamp(2.0, 8.0);
        let slot = self.length / slots;
        let mut bursts = Vec::new();
        let mut from = 0.02 * slot;
        while from + 0.5 * slot < self.length {
            let on = slot * random.random_range(0.35..0.65);
            bursts.push(Burst { from, to: from + on, edge: (0.25 * on).min(TAU) });
            from += slot;
        }
        let wave = if noise { self.multisine(1.0, random) } else { self.tone(random.random_range(0.7..1.4), random) };
        Excitation { rise: 0.0, ..wave }.in_bursts(bursts)
    }

    fn moves(&self, random: &mut Pcg64) -> Excitation {
        let mut moves = Vec::new();
        let (mut place, mut from) = (0.0, 0.5);
        while from < self.length {
            let next = random.random_range(-1.0..1.0);
            let duration = TAU * log_uniform(random, 0.6, 2.0);
            moves.push(Transition { from, duration, distance: next - place });
            place = next;
            from += duration + TAU * random.random_range(0.1..0.8);
        }
        Excitation::transitions(moves)
    }
}
