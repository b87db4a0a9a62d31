//! Preparing records before they are studied: what to cut off, what to hold out, what to take away.
//!
//! A preparation is a list of steps. Each is a value that can be stored, shown and taken out again; they apply in order, and
//! the records as they were measured stay as they are.

mod align;
mod bridge;
mod decimate;
mod filter;
mod mode;
mod spikes;
mod spoken;

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::sampling::{LEAST_SAMPLES, significant};
pub use align::Delay;
pub use bridge::fill;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
pub use spoken::{crop_to_span, span};

/// The largest factor that a record is decimated by in one step.
pub const MOST_DECIMATED: usize = 1000;

/// The most records that one is cut into in one step.
pub const MOST_PARTS: usize = 1000;

/// Standard deviations by which a sample stands out that is a spike, unless another number is given.
pub const SPIKE: f64 = 6.0;

/// One step of a preparation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Preparation {
    /// What is done.
    #[serde(flatten)]
    pub treatment: Treatment,
    /// The one record that it is done to, by its name; every record if none is named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub record: Option<String>,
}

/// What is done to a record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "step")]
pub enum Treatment {
    /// The samples from one time to another, both included, are kept.
    Crop {
        /// s; none for the record's beginning.
        from: Option<f64>,
        /// s; none for the record's end.
        to: Option<f64>,
    },
    /// The last part of a record that is fitted becomes a record of its own, which is held out.
    HoldOut {
        /// Of the record's samples, between 0 and 1.
        share: f64,
    },
    /// Each channel's mean is taken away.
    RemoveOffset,
    /// Each channel's straight line of least squares is taken away.
    RemoveTrend,
    /// Every `factor`-th sample is kept, behind a low-pass without phase that lets nothing above half the new rate pass.
    Decimate {
        /// Samples of which one is kept.
        factor: usize,
    },
    /// What lies between two frequencies is kept, in every channel alike and without a phase; half of a tone's amplitude is
    /// left at either of them.
    Filter {
        /// Hz; none for a low-pass.
        from: Option<f64>,
        /// Hz; none for a high-pass.
        to: Option<f64>,
    },
    /// One mode alone is kept, as the record of one mass: what lies between two frequencies, over all sensors with the weights
    /// of its shape.
    IsolateMode {
        /// Hz.
        from: f64,
        /// Hz.
        to: f64,
    },
    /// Single samples that stand out from those around them, three together at most, are filled in.
    MendSpikes {
        /// Standard deviations of the samples around.
        threshold: f64,
    },
    /// A record becomes several of the same length.
    Split {
        /// How many.
        parts: usize,
    },
    /// A record becomes two.
    SplitAt {
        /// Where the second one begins, s.
        time: f64,
    },
    /// A channel is moved in time against the others; samples at an end that one of them lacks then are cut off.
    Align {
        /// The channel.
        role: Role,
        /// By how much it is late, s; none to estimate it from another sensor of the same mass.
        delay: Option<f64>,
    },
    /// A channel is divided by what its sensor shows too much.
    Gain {
        /// The channel.
        role: Role,
        /// What is shown over what there was.
        gain: f64,
    },
    /// Missing samples (lost, empty or NaN) are filled in where no more than `longest` are missing together; a longer gap
    /// splits the record. Done while reading.
    Bridge {
        /// Longest gap that is filled in, samples.
        longest: usize,
    },
}

/// Why a step cannot be done, in one sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PrepareError {
    /// No record has the name.
    #[error("there is no record `{0}`")]
    NoRecord(String),
    /// The step says something impossible.
    #[error("{0}")]
    Impossible(String),
    /// Too little would be left.
    #[error("record `{record}`: {what} leaves {samples} samples of {have}, and {LEAST_SAMPLES} are needed")]
    TooShort {
        /// Its name.
        record: String,
        /// What was to be done.
        what: String,
        /// How many samples would be left.
        samples: usize,
        /// How many there are, and from when to when.
        have: String,
    },
}

/// The records after all steps.
///
/// # Errors
/// The first step that cannot be done.
pub fn prepare(set: &RecordSet, steps: &[Preparation]) -> Result<RecordSet, PrepareError> {
    steps.iter().try_fold(set.clone(), |set, step| step.apply(&set))
}

/// The records after every step that can be done, and for each step the reason if it cannot.
pub fn prepare_leniently(set: &RecordSet, steps: &[Preparation]) -> (RecordSet, Vec<Option<PrepareError>>) {
    let mut set = set.clone();
    let reasons = steps.iter().map(|step| step.apply(&set).map(|done| set = done).err()).collect();
    (set, reasons)
}

/// The steps with every delay that is to be estimated put in: the median of the records'.
///
/// A delay that no record tells stays open, and the step is not done.
pub fn settled(set: &RecordSet, steps: &[Preparation]) -> Vec<Preparation> {
    let mut set = set.clone();
    let settle = |step: &Preparation| {
        let mut step = step.clone();
        if let Treatment::Align { role, delay: delay @ None } = &mut step.treatment {
            let delay_of = |(record, _): &(Arc<Record>, Usage)| {
                let chosen = step.record.as_ref().is_none_or(|name| *name == record.name);
                align::delay(record, *role).filter(|_| chosen)
            };
            let mut found: Vec<f64> = set.entries.iter().filter_map(delay_of).map(|d| d.seconds).collect();
            found.sort_by(f64::total_cmp);
            *delay = found.get(found.len() / 2).map(|d| significant(*d, 4));
        }
        if let Ok(done) = step.apply(&set) {
            set = done;
        }
        step
    };
    steps.iter().map(settle).collect()
}

/// How many samples may be missing together and are filled in while reading.
pub fn bridged(steps: &[Preparation]) -> usize {
    let longest = |step: &Preparation| match step.treatment {
        Treatment::Bridge { longest } => Some(longest),
        _ => None,
    };
    steps.iter().filter_map(longest).max().unwrap_or(0)
}

impl From<Treatment> for Preparation {
    fn from(treatment: Treatment) -> Self {
        Self { treatment, record: None }
    }
}

impl Preparation {
    /// Does the step.
    ///
    /// # Errors
    /// The record that it names is not there, or the step leaves too little of one.
    pub fn apply(&self, set: &RecordSet) -> Result<RecordSet, PrepareError> {
        self.treatment.check()?;
        let chosen = |record: &Record| self.record.as_ref().is_none_or(|name| *name == record.name);
        if let Some(name) = self.record.as_ref().filter(|_| !set.entries.iter().any(|(r, _)| chosen(r))) {
            return Err(PrepareError::NoRecord(name.clone()));
        }
        if let Treatment::IsolateMode { from, to } = self.treatment {
            return mode::isolated(set, &chosen, (from, to));
        }
        let mut done = RecordSet::default();
        for (record, usage) in &set.entries {
            if !chosen(record) {
                done.entries.push((Arc::clone(record), *usage));
                continue;
            }
            match (self.treatment, usage) {
                (Treatment::HoldOut { share }, Usage::Fit) => {
                    let (first, last) = hold_out(record, share)?;
                    done.add([first], Usage::Fit);
                    done.add([last], Usage::HeldOut);
                }
                (Treatment::HoldOut { .. } | Treatment::Bridge { .. }, _) => {
                    done.entries.push((Arc::clone(record), *usage));
                }
                (treatment @ (Treatment::Split { .. } | Treatment::SplitAt { .. }), usage) => {
                    done.add(treatment.parts(record)?, *usage);
                }
                (treatment, _) => done.entries.push((Arc::new(treatment.applied_to(record)?), *usage)),
            }
        }
        Ok(done)
    }
}

/// Refuses frequencies that a record's samples do not show.
fn within_half_rate(record: &Record, corners: [Option<f64>; 2]) -> Result<(), PrepareError> {
    let half = 0.5 / record.interval;
    let Some(corner) = corners.into_iter().flatten().find(|f| *f >= half) else { return Ok(()) };
    let (name, half) = (&record.name, significant(half, 4));
    Err(PrepareError::Impossible(format!("record `{name}`: {corner} Hz is beyond {half} Hz, half the sampling rate")))
}

impl Treatment {
    fn check(self) -> Result<(), PrepareError> {
        let impossible = |text: String| Err(PrepareError::Impossible(text));
        match self {
            Self::Crop { from: Some(from), to: Some(to) } if from >= to => {
                impossible(format!("a record cannot be cropped to begin at {from} s and end at {to} s"))
            }
            Self::HoldOut { share } if !(share > 0.0 && share < 1.0) => {
                impossible(format!("a share of {share} cannot be held out: it lies between 0 and 1"))
            }
            Self::Decimate { factor } if !(2..=MOST_DECIMATED).contains(&factor) => impossible(format!(
                "one sample in {factor} cannot be kept: the factor lies between 2 and {MOST_DECIMATED}"
            )),
            Self::Filter { from: None, to: None } => impossible("a filter needs a frequency, in Hz".into()),
            Self::Filter { from, to } if [from, to].into_iter().flatten().any(|f| !(f > 0.0 && f.is_finite())) => {
                impossible("a filter's frequency is a positive number, in Hz".into())
            }
            Self::Filter { from: Some(from), to: Some(to) } if from >= to => {
                impossible(format!("no band begins at {from} Hz and ends at {to} Hz"))
            }
            Self::IsolateMode { from, to } if !(from > 0.0 && from < to && to.is_finite()) => impossible(format!(
                "no mode lies between {from} and {to} Hz: the first frequency lies above zero and below the second"
            )),
            Self::MendSpikes { threshold } if !(threshold > 0.0 && threshold.is_finite()) => {
                impossible("how far a spike stands out is a positive number of standard deviations".into())
            }
            Self::Gain { gain, .. } if gain == 0.0 || !gain.is_finite() => {
                impossible("a gain is a number that is not zero".into())
            }
            Self::Split { parts } if !(2..=MOST_PARTS).contains(&parts) => {
                impossible(format!("a record cannot be cut into {parts}: the number lies between 2 and {MOST_PARTS}"))
            }
            _ => Ok(()),
        }
    }

    /// A record treated, one for one.
    fn applied_to(self, record: &Record) -> Result<Record, PrepareError> {
        let mut treated = match self {
            Self::Crop { from, to } => crop(record, from, to),
            Self::RemoveOffset => each_channel(record, |values| {
                let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
                values.iter().map(|v| v - mean).collect()
            }),
            Self::RemoveTrend => each_channel(record, without_line),
            Self::Decimate { factor } => {
                let kept = each_channel(record, |values| decimate::decimate(values, factor));
                Record { interval: record.interval * factor as f64, ..kept }
            }
            Self::Filter { from, to } => {
                within_half_rate(record, [from, to])?;
                each_channel(record, |values| filter::filter(values, record.interval, (from, to)))
            }
            Self::MendSpikes { threshold } => return Ok(without_spikes(record, threshold)),
            Self::Align { role, delay } => return self.aligned(record, role, delay),
            Self::Gain { role, gain } => {
                let mut treated = record.clone();
                let Some(channel) = treated.channels.iter_mut().find(|c| c.role == role) else {
                    return Err(no_channel(record, role));
                };
                channel.values = channel.values.iter().map(|v| v / gain).collect();
                treated
            }
            Self::HoldOut { .. }
            | Self::Bridge { .. }
            | Self::Split { .. }
            | Self::SplitAt { .. }
            | Self::IsolateMode { .. } => record.clone(),
        };
        if treated.len() < LEAST_SAMPLES {
            return Err(self.too_short(record, treated.len()));
        }
        treated.notices.push(format!("{}: {self}", record.name));
        if let Self::Filter { to: Some(to), .. } = self {
            treated.notices.push(lost_noise(record, to));
        }
        Ok(treated)
    }

    /// The record cut into several, of which all but the first bear the time at which they begin.
    fn parts(self, record: &Record) -> Result<Vec<Record>, PrepareError> {
        let bounds: Vec<usize> = match self {
            Self::Split { parts } => (0..=parts).map(|k| k * record.len() / parts).collect(),
            Self::SplitAt { time } => vec![0, record.index_at(time), record.len()],
            _ => vec![0, record.len()],
        };
        let cut = |bounds: &[usize]| {
            let mut part = record.slice(bounds[0]..bounds[1]);
            if part.len() < LEAST_SAMPLES {
                return Err(self.too_short(record, part.len()));
            }
            if bounds[0] > 0 {
                part.name = format!("{} from {} s", record.name, significant(part.start, 4));
            }
            part.notices.push(format!("{}: {self}", record.name));
            Ok(part)
        };
        bounds.windows(2).map(cut).collect()
    }

    /// The record with a channel moved in time.
    fn aligned(self, record: &Record, role: Role, delay: Option<f64>) -> Result<Record, PrepareError> {
        let Some(channel) = record.channel(role) else { return Err(no_channel(record, role)) };
        let Some(delay) = delay.or_else(|| align::delay(record, role).map(|d| d.seconds)) else {
            let why = if matches!(role, Role::Input(_)) {
                "an input leads the motion by the system's own lag"
            } else {
                "no other sensor of the same mass was measured"
            };
            let (record, name) = (&record.name, &channel.name);
            return Err(PrepareError::Impossible(format!(
                "record `{record}`: the delay of `{name}` cannot be estimated, for {why}; give it in s"
            )));
        };
        let moved = align::advanced(record, role, delay).filter(|r| r.len() >= LEAST_SAMPLES);
        let Some(mut moved) = moved else { return Err(self.too_short(record, 0)) };
        let by = significant(delay.abs(), 4);
        let which = if delay < 0.0 { "early" } else { "late" };
        let agrees = align::delay(record, role)
            .map_or(String::new(), |d| format!(" (agreement {} once aligned)", significant(d.agreement, 2)));
        moved.notices.push(format!("{}: `{}` was {by} s {which} and was moved{agrees}", record.name, channel.name));
        Ok(moved)
    }

    fn too_short(self, record: &Record, samples: usize) -> PrepareError {
        let [from, to] = [record.start, record.start + record.duration()].map(|t| significant(t, 6));
        let have = format!("{} (from {from} s to {to} s)", record.len());
        PrepareError::TooShort { record: record.name.clone(), what: format!("“{self}”"), samples, have }
    }
}

/// Says that a low-pass took the noise away by which its level is estimated: it is estimated from what is faster than the motion.
fn lost_noise(record: &Record, to: f64) -> String {
    let most = (0.4 / (to * record.interval)).floor();
    let decimate = if most >= 2.0 { format!("; decimated by {most} it is seen again") } else { String::new() };
    let to = significant(to, 4);
    format!("{}: the noise above {to} Hz is gone too, so the noise floor reads too low{decimate}", record.name)
}

fn no_channel(record: &Record, role: Role) -> PrepareError {
    let (name, noun) = (&record.name, role.noun());
    PrepareError::Impossible(format!("record `{name}` has no {noun} {}", role.index() + 1))
}

impl fmt::Display for Treatment {
    /// What was done, as a clause: `cropped to 2 s … 40 s`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = |t: f64| format!("{} s", significant(t, 6));
        match *self {
            Self::Crop { from: Some(from), to: Some(to) } => {
                write!(f, "cropped to {} … {}", seconds(from), seconds(to))
            }
            Self::Crop { from: Some(from), to: None } => write!(f, "cropped to begin at {}", seconds(from)),
            Self::Crop { from: None, to: Some(to) } => write!(f, "cropped to end at {}", seconds(to)),
            Self::Crop { from: None, to: None } => write!(f, "not cropped"),
            Self::HoldOut { share } => write!(f, "the last {} % held out", significant(100.0 * share, 3)),
            Self::RemoveOffset => write!(f, "each channel’s mean removed"),
            Self::RemoveTrend => write!(f, "each channel’s linear trend removed"),
            Self::Decimate { factor } => write!(f, "decimated by {factor}, behind a low-pass"),
            Self::Filter { from: Some(from), to: Some(to) } => {
                write!(f, "filtered to {} … {} Hz", significant(from, 4), significant(to, 4))
            }
            Self::Filter { from: Some(from), to: None } => write!(f, "high-pass of {} Hz", significant(from, 4)),
            Self::Filter { from: None, to } => write!(f, "low-pass of {} Hz", significant(to.unwrap_or(0.0), 4)),
            Self::IsolateMode { from, to } => {
                write!(f, "the mode between {} and {} Hz isolated", significant(from, 4), significant(to, 4))
            }
            Self::MendSpikes { threshold } => {
                write!(f, "spikes beyond {} standard deviations mended", significant(threshold, 3))
            }
            Self::Split { parts } => write!(f, "cut into {parts}"),
            Self::SplitAt { time } => write!(f, "cut at {}", seconds(time)),
            Self::Align { role, delay: Some(delay) } => {
                write!(f, "{} {} moved by {}", role.noun(), role.index() + 1, seconds(-delay))
            }
            Self::Align { role, delay: None } => write!(f, "{} {} aligned", role.noun(), role.index() + 1),
            Self::Gain { role, gain } => {
                write!(f, "{} {} divided by {}", role.noun(), role.index() + 1, significant(gain, 6))
            }
            Self::Bridge { longest } => write!(f, "gaps of up to {longest} samples bridged"),
        }
    }
}

fn each_channel(record: &Record, treat: impl Fn(&[f64]) -> Vec<f64>) -> Record {
    let channel = |c: &Channel| Channel { values: treat(&c.values).into(), ..c.clone() };
    Record { channels: record.channels.iter().map(channel).collect(), ..record.clone() }
}

/// Each channel without its spikes; tells how many there were.
fn without_spikes(record: &Record, threshold: f64) -> Record {
    let mut told = Vec::new();
    let channels = record.channels.iter().map(|channel| {
        let (values, count) = spikes::mend(&channel.values, threshold);
        if count > 0 {
            told.push(format!("{count} of `{}`", channel.name));
        }
        Channel { values: values.into(), ..channel.clone() }
    });
    let mut mended = Record { channels: channels.collect(), ..record.clone() };
    let told = if told.is_empty() { "none found".to_owned() } else { told.join(", ") };
    mended.notices.push(format!("{}: samples of spikes mended: {told}", record.name));
    mended
}

fn crop(record: &Record, from: Option<f64>, to: Option<f64>) -> Record {
    let first = from.map_or(0, |t| record.index_at(t));
    let end = to.map_or(record.len(), |t| {
        let at = record.index_at(t);
        // A sample at the end itself is part of it.
        at + usize::from(at < record.len() && record.time(at) <= t + 1e-6 * record.interval)
    });
    record.slice(first..end)
}

fn hold_out(record: &Record, share: f64) -> Result<(Record, Record), PrepareError> {
    let at = ((1.0 - share) * record.len() as f64).round() as usize;
    let (first, mut last) = (record.slice(0..at), record.slice(at..record.len()));
    let shortest = first.len().min(last.len());
    let treatment = Treatment::HoldOut { share };
    if shortest < LEAST_SAMPLES {
        return Err(treatment.too_short(record, shortest));
    }
    last.name = format!("{} from {} s", record.name, significant(last.start, 4));
    Ok((first, last))
}

/// Values without their straight line of least squares.
fn without_line(values: &[f64]) -> Vec<f64> {
    let middle = 0.5 * values.len().saturating_sub(1) as f64;
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let (mut rise, mut spread) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let run = i as f64 - middle;
        rise += run * (value - mean);
        spread += run * run;
    }
    let slope = if spread > 0.0 { rise / spread } else { 0.0 };
    values.iter().enumerate().map(|(i, v)| v - mean - slope * (i as f64 - middle)).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use sindyscope_values::record::Role;

    /// A record of 1000 samples a second: a tone in the displacement and one in the input.
    fn record(name: &str, samples: usize, tone: impl Fn(f64) -> f64) -> Record {
        let channel = |role, name: &str, shift: f64| Channel {
            name: name.into(),
            role,
            unit: "m".into(),
            values: (0..samples).map(|i| tone(i as f64 * 1e-3 + shift)).collect(),
            estimated: false,
        };
        let channels = vec![channel(Role::Displacement(0), "x", 0.0), channel(Role::Input(0), "u", 0.1)];
        Record { name: name.into(), source: None, start: 2.0, interval: 1e-3, channels, notices: Vec::new() }
    }

    fn sine(frequency: f64) -> impl Fn(f64) -> f64 {
        move |t| (TAU * frequency * t).sin()
    }

    fn values(set: &RecordSet, index: usize) -> &[f64] {
        &set.entries[index].0.channels[0].values
    }

    #[test]
    fn a_crop_keeps_both_ends_and_the_measurement_stays_as_it_was() {
        let set = RecordSet::new([record("run", 1000, sine(5.0))], Usage::Fit);
        let before = set.clone();
        let crop = |from, to| prepare(&set, &[Treatment::Crop { from, to }.into()]).unwrap();
        let cropped = crop(Some(2.1), Some(2.3));
        let (kept, _) = &cropped.entries[0];
        assert_eq!((kept.len(), (kept.start * 1e6).round()), (201, 2.1e6));
        assert_eq!(kept.channels[1].values[0], set.entries[0].0.channels[1].values[100]);
        assert_eq!(crop(None, Some(2.0995)).entries[0].0.len(), 100, "between samples nothing is added");
        assert_eq!(crop(Some(2.9), None).entries[0].0.len(), 100);
        assert_eq!(set, before);
    }

    #[test]
    fn the_last_share_of_what_is_fitted_is_held_out_under_a_name_of_its_own() {
        let mut set = RecordSet::new([record("run", 1000, sine(5.0))], Usage::Fit);
        set.add([record("other", 500, sine(5.0))], Usage::HeldOut);
        let held = prepare(&set, &[Treatment::HoldOut { share: 0.3 }.into()]).unwrap();
        let told: Vec<_> = held.entries.iter().map(|(r, usage)| (r.name.as_str(), r.len(), *usage)).collect();
        let expected =
            [("run", 700, Usage::Fit), ("run from 2.7 s", 300, Usage::HeldOut), ("other", 500, Usage::HeldOut)];
        assert_eq!(told, expected);
        assert!((held.entries[1].0.start - 2.7).abs() < 1e-12, "time goes on");
    }

    #[test]
    fn steps_apply_in_order_to_the_record_that_they_name() {
        let set = RecordSet::new(["a", "b"].map(|n| record(n, 1000, sine(5.0))), Usage::Fit);
        let steps = [
            Preparation { record: Some("b".into()), ..Treatment::Crop { from: None, to: Some(2.499) }.into() },
            Treatment::HoldOut { share: 0.5 }.into(),
        ];
        let lengths = |set: &RecordSet| set.entries.iter().map(|(r, _)| r.len()).collect::<Vec<_>>();
        assert_eq!(lengths(&prepare(&set, &steps).unwrap()), [500, 500, 250, 250]);
        let other_way: Vec<_> = steps.iter().rev().cloned().collect();
        assert_eq!(lengths(&prepare(&set, &other_way).unwrap()), [500, 500, 500, 500], "then `b` ends there already");
    }

    #[test]
    fn offset_and_trend_go_and_the_motion_stays() {
        let motion = sine(5.0);
        let set = RecordSet::new([record("run", 1000, |t| 3.0 + 2.0 * t + motion(t))], Usage::Fit);
        let flat = prepare(&set, &[Treatment::RemoveTrend.into()]).unwrap();
        // The line of least squares sees a little of the tone too.
        let far = values(&flat, 0).iter().enumerate().map(|(i, v)| (v - motion(i as f64 * 1e-3)).abs());
        assert!(far.fold(0.0, f64::max) < 0.25);
        let level = prepare(&set, &[Treatment::RemoveOffset.into()]).unwrap();
        assert!(values(&level, 0).iter().sum::<f64>().abs() < 1e-9);
        assert!((values(&level, 0)[999] - values(&level, 0)[0] - 2.0 * 0.999).abs() < 0.1, "the trend is there");
    }

    #[test]
    fn what_a_step_leaves_too_short_is_told_with_the_record_and_its_times() {
        let set = RecordSet::new([record("run", 1000, sine(5.0))], Usage::Fit);
        let told = |treatment: Treatment| prepare(&set, &[treatment.into()]).unwrap_err().to_string();
        let crop = told(Treatment::Crop { from: Some(7.0), to: None });
        assert_eq!(
            crop,
            "record `run`: “cropped to begin at 7 s” leaves 0 samples of 1000 (from 2 s to 2.999 s), and 20 are needed"
        );
        assert!(told(Treatment::HoldOut { share: 0.001 }).contains("the last 0.1 % held out"));
        assert!(told(Treatment::HoldOut { share: 30.0 }).contains("between 0 and 1"));
        assert!(told(Treatment::Crop { from: Some(3.0), to: Some(2.5) }).contains("begin at 3 s"));
        assert!(told(Treatment::Decimate { factor: 1 }).contains("between 2 and 1000"));
        let named = Preparation { record: Some("gone".into()), ..Treatment::RemoveOffset.into() };
        let (left, reasons) = prepare_leniently(&set, &[named, Treatment::HoldOut { share: 0.5 }.into()]);
        assert_eq!(left.entries.len(), 2, "what can be done is done");
        assert_eq!(reasons[0].as_ref().unwrap().to_string(), "there is no record `gone`");
        assert!(reasons[1].is_none());
    }

    #[test]
    fn a_record_is_cut_into_several_that_are_used_alike() {
        let mut set = RecordSet::new([record("run", 1000, sine(5.0))], Usage::HeldOut);
        set.add([record("other", 1000, sine(5.0))], Usage::Fit);
        let step = Preparation { record: Some("run".into()), ..Treatment::Split { parts: 3 }.into() };
        let cut = prepare(&set, &[step, Treatment::SplitAt { time: 2.9 }.into()]);
        assert!(cut.unwrap_err().to_string().contains("“cut at 2.9 s” leaves 0 samples"), "where a part ends before");
        let step = Preparation { record: Some("run".into()), ..Treatment::Split { parts: 3 }.into() };
        let cut = prepare(&set, &[step]).unwrap();
        let told: Vec<_> = cut.entries.iter().map(|(r, usage)| (r.name.as_str(), r.len(), *usage)).collect();
        let expected = [
            ("run", 333, Usage::HeldOut),
            ("run from 2.333 s", 333, Usage::HeldOut),
            ("run from 2.666 s", 334, Usage::HeldOut),
            ("other", 1000, Usage::Fit),
        ];
        assert_eq!(told, expected);
    }

    #[test]
    fn spikes_are_counted_and_a_filter_beyond_the_rate_is_refused() {
        let mut spiked = record("run", 1000, sine(5.0));
        let mut samples = spiked.channels[0].values.to_vec();
        samples[400] += 3.0;
        spiked.channels[0].values = samples.into();
        let set = RecordSet::new([spiked], Usage::Fit);
        let mended = prepare(&set, &[Treatment::MendSpikes { threshold: SPIKE }.into()]).unwrap();
        assert_eq!(mended.entries[0].0.notices, ["run: samples of spikes mended: 1 of `x`"]);
        assert!((values(&mended, 0)[400] - sine(5.0)(0.4)).abs() < 1e-3);
        let beyond = prepare(&set, &[Treatment::Filter { from: None, to: Some(700.0) }.into()]);
        assert!(beyond.unwrap_err().to_string().contains("700 Hz is beyond 500 Hz, half the sampling rate"));
    }

    #[test]
    fn a_delay_is_put_into_the_step_once_it_is_estimated() {
        let mut late = record("run", 2000, |t| (TAU * 5.0 * t).sin() + 0.3 * (TAU * 12.7 * t).sin());
        let speed = |t: f64| TAU * 5.0 * (TAU * 5.0 * t).cos() + 0.3 * TAU * 12.7 * (TAU * 12.7 * t).cos();
        late.channels[1].role = Role::Velocity(0);
        late.channels[1].values = (0..2000).map(|i| speed(f64::from(i) * 1e-3 - 0.008)).collect();
        let set = RecordSet::new([late], Usage::Fit);
        let open = Treatment::Align { role: Role::Velocity(0), delay: None };
        let [Preparation { treatment: Treatment::Align { delay: Some(delay), .. }, .. }] =
            settled(&set, &[open.into()])[..]
        else {
            panic!("not settled");
        };
        assert!((delay - 0.008).abs() < 1e-4, "{delay}");
        let of_input = Treatment::Align { role: Role::Input(0), delay: None };
        assert!(prepare(&set, &[of_input.into()]).unwrap_err().to_string().contains("has no input 1"));
    }

    #[test]
    fn steps_are_stored_as_text_that_reads_well() {
        let steps = [
            Preparation { record: Some("a".into()), ..Treatment::Crop { from: Some(2.0), to: None }.into() },
            Treatment::RemoveTrend.into(),
        ];
        let text = serde_json::to_string(&steps).unwrap();
        assert_eq!(text, r#"[{"step":"crop","from":2.0,"to":null,"record":"a"},{"step":"remove-trend"}]"#);
        let again: Vec<Preparation> = serde_json::from_str(&text).unwrap();
        assert_eq!(again, steps);
    }
}
