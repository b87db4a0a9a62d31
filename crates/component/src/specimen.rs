//! What was measured of a component: a motion, inputs beside it, and the force along the motion.

use super::error::ComponentError;
use sindyscope_core::signal::{SignalFacts, Signals, mean_and_variance, median, motion_period, standard_deviation};
use sindyscope_core::study::{Cancel, suggest};
use sindyscope_values::model::Units;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
use sindyscope_values::term::{Kind, Layout, Symbol};

/// Fewest samples of a record.
pub(crate) const LEAST_SAMPLES: usize = 100;
/// Share at the end of each fitted record that is not fitted where no record is held out.
pub(crate) const UNSEEN_SHARE: f64 = 0.3;

/// One record along which the motion is given.
#[derive(Clone, Debug)]
pub(crate) struct RecordPath {
    pub(crate) name: String,
    pub(crate) usage: Usage,
    pub(crate) start: f64,
    pub(crate) interval: f64,
    /// Displacement and velocity at every sample.
    pub(crate) motion: [Vec<f64>; 2],
    /// `inputs[input][sample]` and their rates, the force left out.
    pub(crate) inputs: Vec<Vec<f64>>,
    pub(crate) input_rates: Vec<Vec<f64>>,
    /// The measured force.
    pub(crate) force: Vec<f64>,
    /// The samples from here on are never fitted; all of them of a record that is held out.
    pub(crate) unseen_from: usize,
}

impl RecordPath {
    pub(crate) fn len(&self) -> usize {
        self.force.len()
    }
}

/// What moved a component in one record, and its force.
#[derive(Clone, Copy, Debug)]
pub struct GivenMotion<'a> {
    /// The displacement at every sample.
    pub displacement: &'a [f64],
    /// The velocity at every sample.
    pub velocity: &'a [f64],
    /// The measured force.
    pub force: &'a [f64],
}

/// A component with its records.
#[derive(Clone, Debug)]
pub struct Specimen {
    pub(crate) paths: Vec<RecordPath>,
    /// One displacement and the inputs; internal states are added by effects.
    pub(crate) layout: Layout,
    pub(crate) units: Units,
    pub(crate) force_name: String,
    pub(crate) force_unit: String,
    pub(crate) input_names: Vec<String>,
    /// Standard deviation of the force's noise, estimated.
    pub(crate) noise: f64,
    /// Main period of the motion, s.
    pub(crate) period: f64,
    /// RMS of the force about its mean over what is fitted.
    pub(crate) scale: f64,
    /// 1 where a force that takes energy out has the sign of the velocity, −1 where a load cell is mounted the other way.
    pub(crate) polarity: f64,
}

/// Words that say that a channel is a force.
const FORCE_WORDS: [&str; 7] = ["f", "force", "load", "kraft", "torque", "moment", "thrust"];
/// Units that are a force's.
const FORCE_UNITS: [&str; 10] = ["n", "kn", "mn", "kip", "kips", "lbf", "lb", "kgf", "nm", "n m"];

impl Specimen {
    /// The component of a set's records; `force` is the name of the force's channel, where a person says it.
    ///
    /// # Errors
    /// No record to fit, no force, no motion, records with other channels, too few samples, or cancelled.
    pub fn new(records: &RecordSet, force: Option<&str>, cancel: &Cancel) -> Result<Self, ComponentError> {
        let first = records.with(Usage::Fit).next().ok_or(ComponentError::NothingToFit)?;
        let force = force_channel(first, force)?.role;
        let used = || records.entries.iter().filter(|(_, usage)| *usage != Usage::Off);
        let inputs: Vec<Role> =
            first.measured().map(|c| c.role).filter(|r| matches!(r, Role::Input(_)) && *r != force).collect();
        for (record, _) in used() {
            if record.len() < LEAST_SAMPLES {
                return Err(ComponentError::TooShort { record: record.name.clone(), samples: record.len() });
            }
            for role in inputs.iter().chain([&force]) {
                channel(record, *role)?;
            }
        }
        let all = RecordSet { entries: used().cloned().collect() };
        // The motion alone is smoothed: the force is what is explained.
        let smoothing = suggest(&all, Kind::SecondOrder).map_err(|e| ComponentError::Motion(e.to_string()))?.smoothing;
        let whole = all.layout(Kind::SecondOrder).map_err(ComponentError::Motion)?;
        if whole.freedoms != 1 {
            return Err(ComponentError::SeveralMotions { record: first.name.clone() });
        }
        let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: inputs.len(), internals: 0 };
        let held_out = all.with(Usage::HeldOut).next().is_some();
        let mut paths = Vec::new();
        for (record, usage) in &all.entries {
            if cancel.is_cancelled() {
                return Err(ComponentError::Cancelled);
            }
            let facts = SignalFacts::cached(record, &whole);
            let signals = Signals::new(record, &whole, &smoothing, &facts);
            let measured = |role: Role| record.channel(role).filter(|c| !c.estimated).map(|c| c.values.to_vec());
            let [displacement, velocity] = [0, 1].map(|k| signals.states.get(k).cloned());
            let displacement = measured(Role::Displacement(0)).or(displacement);
            let velocity = measured(Role::Velocity(0)).or(velocity);
            let (Some(x), Some(v)) = (displacement, velocity) else {
                return Err(ComponentError::NoMotion { record: record.name.clone() });
            };
            let force = channel(record, force)?.values.to_vec();
            let series = |role: &Role| channel(record, *role).map(|c| c.values.to_vec());
            let rate = |role: &Role| signals.input_rate(role.index()).map_or_else(Vec::new, <[f64]>::to_vec);
            let seen = match (*usage, held_out) {
                (Usage::HeldOut, _) => 0,
                (_, true) => force.len(),
                (_, false) => ((1.0 - UNSEEN_SHARE) * force.len() as f64) as usize,
            };
            paths.push(RecordPath {
                name: record.name.clone(),
                usage: *usage,
                start: record.start,
                interval: record.interval,
                motion: [x, v],
                inputs: inputs.iter().map(series).collect::<Result<_, _>>()?,
                input_rates: inputs.iter().map(rate).collect(),
                force,
                unseen_from: seen,
            });
        }
        let seen: Vec<f64> = paths.iter().flat_map(|p| p.force[..p.unseen_from].iter().copied()).collect();
        let scale = mean_and_variance(&seen).1.sqrt();
        let named = channel(first, force)?;
        if !(scale.is_finite() && scale > 0.0) {
            return Err(ComponentError::Still { channel: named.name.clone() });
        }
        let fitted = || paths.iter().filter(|p| p.usage == Usage::Fit);
        let motions: Vec<&[f64]> = fitted().map(|p| p.motion[0].as_slice()).collect();
        let interval = first.interval;
        let period = motion_period(&motions, interval, 0.0).unwrap_or(0.1 * first.len() as f64 * interval);
        let noises: Vec<f64> = fitted().filter_map(|p| noise_between_jumps(&p.force)).collect();
        let noise = (noises.iter().map(|n| n * n).sum::<f64>() / noises.len().max(1) as f64).sqrt();
        let mean = mean_and_variance(&seen).0;
        let work: f64 =
            fitted().map(|p| p.force.iter().zip(&p.motion[1]).map(|(f, v)| (f - mean) * v).sum::<f64>()).sum();
        let without_force = Record {
            channels: first
                .channels
                .iter()
                .filter(|c| c.role != force)
                .cloned()
                .enumerate()
                .map(renumbered())
                .collect(),
            ..Record::clone(first)
        };
        Ok(Self {
            layout,
            units: Units::from_record(&without_force, &layout).with_force(&named.unit),
            force_name: named.name.clone(),
            force_unit: named.unit.clone(),
            input_names: inputs.iter().filter_map(|r| first.channel(*r)).map(|c| c.name.clone()).collect(),
            noise,
            period,
            scale,
            polarity: if work < 0.0 { -1.0 } else { 1.0 },
            paths,
        })
    }

    /// Name and unit of the force.
    pub fn force(&self) -> (&str, &str) {
        (&self.force_name, &self.force_unit)
    }

    /// The motion and the force of each record that is used.
    pub fn motions(&self) -> impl Iterator<Item = GivenMotion<'_>> {
        self.paths.iter().map(|path| GivenMotion {
            displacement: &path.motion[0],
            velocity: &path.motion[1],
            force: &path.force,
        })
    }

    /// The unit of a symbol; empty where the records do not give it.
    pub fn unit(&self, symbol: Symbol) -> String {
        self.units.of_symbol(symbol).unwrap_or_default()
    }

    /// The main period of the motion, s.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Names of the inputs beside the motion, in the order of `u`, `u2`, ….
    pub fn inputs(&self) -> &[String] {
        &self.input_names
    }

    /// Largest magnitude over all records.
    pub(crate) fn reach(&self, series: impl Fn(&RecordPath) -> &[f64]) -> f64 {
        self.paths.iter().flat_map(|p| series(p).iter()).fold(0.0, |most: f64, v| most.max(v.abs()))
    }
}

/// The channels of a record that may be the force of a component: its inputs.
pub fn force_candidates(record: &Record) -> impl Iterator<Item = &Channel> {
    record.measured().filter(|c| matches!(c.role, Role::Input(_)))
}

/// The channel that is the force of a component: the one that is named, the only input, the one whose name or unit says so.
///
/// # Errors
/// The record has no input, or several of which none is named and none or more than one looks like a force.
pub fn force_channel<'a>(record: &'a Record, force: Option<&str>) -> Result<&'a Channel, ComponentError> {
    let inputs: Vec<&Channel> = force_candidates(record).collect();
    let bare = |text: &str| text.split(['[', '(']).next().unwrap_or_default().trim().to_lowercase();
    if let Some(name) = force
        && let Some(found) = inputs.iter().find(|c| bare(&c.name) == bare(name))
    {
        return Ok(found);
    }
    let word = |c: &Channel| c.name.to_lowercase().split([' ', '_', '-', '.']).next().map(str::to_owned);
    let by_name = |c: &Channel| word(c).is_some_and(|w| FORCE_WORDS.contains(&w.trim_end_matches(char::is_numeric)));
    let by_unit = |c: &Channel| FORCE_UNITS.contains(&c.unit.trim().to_lowercase().as_str());
    let only = |is_one: &dyn Fn(&Channel) -> bool| {
        let mut all = inputs.iter().copied().filter(|c| is_one(c));
        all.next().filter(|_| all.next().is_none())
    };
    // Named by its number in the table: what is named last.
    let told = force.and_then(|_| inputs.last().copied());
    let found = told.or_else(|| only(&|_| true)).or_else(|| only(&by_name)).or_else(|| only(&by_unit));
    found.ok_or_else(|| match inputs.is_empty() {
        true => ComponentError::NoForce { record: record.name.clone() },
        false => ComponentError::WhichForce {
            record: record.name.clone(),
            names: inputs.iter().map(|c| format!("`{}`", c.name)).collect::<Vec<_>>().join(", "),
        },
    })
}

/// Standard deviation of a force's noise, estimated: the smaller one of what its spectrum and what the median of its third
/// differences say, for the jumps of dry friction are noise to the first, and a fast motion is noise to the second.
fn noise_between_jumps(force: &[f64]) -> Option<f64> {
    let thirds = force.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    // Third differences of white noise have twenty times its variance; the median of |N(0, 1)| is 0.6745.
    let between = median(thirds).map(|m| m / (0.6745 * 20f64.sqrt()));
    [standard_deviation(force), between].into_iter().flatten().reduce(f64::min)
}

/// Numbers the inputs that are left anew, from zero.
fn renumbered() -> impl FnMut((usize, Channel)) -> Channel {
    let mut next = 0;
    move |(_, channel)| match channel.role {
        Role::Input(_) => {
            next += 1;
            Channel { role: Role::Input(next - 1), ..channel }
        }
        _ => channel,
    }
}

fn channel(record: &Record, role: Role) -> Result<&Channel, ComponentError> {
    let found = record.channel(role).filter(|c| !c.estimated);
    found.ok_or_else(|| ComponentError::RecordsDiffer { record: record.name.clone(), channel: role.short_name() })
}
