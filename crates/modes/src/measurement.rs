//! What was measured of a structure, as plain series in units of their own size.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};
use sindyscope_core::study::Cancel;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage, units};

use super::error::ModesError;
use super::pole;

/// Fewest samples of a record.
pub(crate) const LEAST_SAMPLES: usize = 100;

/// What a sensor shows of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Quantity {
    /// Displacement.
    Displacement,
    /// Velocity.
    Velocity,
    /// Acceleration.
    Acceleration,
}

impl Quantity {
    /// Derivatives by time from the displacement.
    pub(crate) fn derivatives(self) -> i32 {
        match self {
            Self::Displacement => 0,
            Self::Velocity => 1,
            Self::Acceleration => 2,
        }
    }
}

/// One sensor, the same in all records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensor {
    /// The channel's name.
    pub name: String,
    /// What it measures, and of which place of the structure.
    pub role: Role,
    /// What it shows.
    pub quantity: Quantity,
    /// Its unit.
    pub unit: String,
    /// The RMS over the fitted records, which its series are divided by.
    pub scale: f64,
}

impl Sensor {
    /// The number of the place that it shows, from zero.
    pub fn place(&self) -> usize {
        self.role.index()
    }
}

/// One input, the same in all records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// The channel's name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The RMS over the fitted records, which its series are divided by.
    pub scale: f64,
    /// The measured input whose rate of change it is.
    #[serde(default)]
    pub rate_of: Option<Role>,
}

impl Input {
    /// Its values along a record; none where the record has no such channel.
    pub fn along<'a>(&self, record: &'a Record) -> Option<Cow<'a, [f64]>> {
        match self.rate_of {
            Some(role) => Some(Cow::Owned(pole::rate(&record.channel(role)?.values, record.interval))),
            None => record.channels.iter().find(|c| c.name == self.name).map(|c| Cow::Borrowed(&c.values[..])),
        }
    }
}

/// One record's series, divided by the scales.
#[derive(Clone, Debug)]
pub(crate) struct SensorSeries {
    pub(crate) name: String,
    pub(crate) interval: f64,
    /// `inputs[input][sample]`
    pub(crate) inputs: Vec<Vec<f64>>,
    /// `outputs[sensor][sample]`
    pub(crate) outputs: Vec<Vec<f64>>,
}

impl SensorSeries {
    pub(crate) fn len(&self) -> usize {
        self.outputs.first().map_or(0, Vec::len)
    }

    /// The samples of a range.
    pub(crate) fn part(&self, range: std::ops::Range<usize>) -> Self {
        let cut = |all: &Vec<Vec<f64>>| all.iter().map(|s| s[range.clone()].to_vec()).collect();
        Self {
            name: self.name.clone(),
            interval: self.interval,
            inputs: cut(&self.inputs),
            outputs: cut(&self.outputs),
        }
    }
}

/// All that was measured.
#[derive(Clone, Debug)]
pub(crate) struct Measurement {
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) inputs: Vec<Input>,
    pub(crate) fitted: Vec<SensorSeries>,
    pub(crate) held_out: Vec<SensorSeries>,
}

impl Measurement {
    /// The series of a set's records.
    pub(crate) fn new(records: &RecordSet, cancel: &Cancel) -> Result<Self, ModesError> {
        let first = records.with(Usage::Fit).next().ok_or(ModesError::NothingToFit)?;
        let roles = |keep: fn(&Role) -> bool| -> Vec<Role> { first.measured().map(|c| c.role).filter(keep).collect() };
        let mut outputs = roles(|r| !matches!(r, Role::Input(_)));
        outputs.sort_by_key(|r| (r.index(), *r));
        let inputs = roles(|r| matches!(r, Role::Input(_)));
        if outputs.is_empty() {
            return Err(ModesError::NoSensor { record: first.name.clone() });
        }
        let used = || records.entries.iter().filter(|(_, usage)| *usage != Usage::Off);
        for (record, _) in used() {
            if record.len() < LEAST_SAMPLES {
                return Err(ModesError::TooShort { record: record.name.clone(), samples: record.len() });
            }
            for role in outputs.iter().chain(&inputs) {
                measured(record, *role)?;
            }
        }
        if cancel.is_cancelled() {
            return Err(ModesError::Cancelled);
        }
        let scale = |role: Role| -> Result<f64, ModesError> {
            let (mut sum, mut count) = (0.0, 0);
            for record in records.with(Usage::Fit) {
                let values = &measured(record, role)?.values;
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                sum += values.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
                count += values.len();
            }
            Ok((sum / count.max(1) as f64).sqrt())
        };
        let described = |role: Role| -> Result<(String, String, f64), ModesError> {
            let channel = measured(first, role)?;
            Ok((channel.name.clone(), channel.unit.clone(), scale(role)?))
        };
        let mut sensors = Vec::new();
        for role in &outputs {
            let (name, unit, scale) = described(*role)?;
            if !(scale.is_finite() && scale > 0.0) {
                return Err(ModesError::Still { channel: name });
            }
            let quantity = match role {
                Role::Velocity(_) => Quantity::Velocity,
                Role::Acceleration(_) => Quantity::Acceleration,
                Role::Displacement(_) | Role::Input(_) => Quantity::Displacement,
            };
            sensors.push(Sensor { name, role: *role, quantity, unit, scale });
        }
        let mut driving = Vec::new();
        for role in &inputs {
            let (name, unit, scale) = described(*role)?;
            if scale.is_finite() && scale > 0.0 {
                driving.push((*role, Input { name, unit, scale, rate_of: None }));
            }
        }
        let rates: Vec<(Role, Input)> = driving.iter().filter_map(|input| rate(records, input)).collect();
        driving.extend(rates);
        let series = |record: &Record| -> Result<SensorSeries, ModesError> {
            let divided = |role: Role, scale: f64| -> Result<Vec<f64>, ModesError> {
                Ok(measured(record, role)?.values.iter().map(|v| v / scale).collect())
            };
            let along = |(role, input): &(Role, Input)| -> Result<Vec<f64>, ModesError> {
                let values = &measured(record, *role)?.values;
                let rate = input.rate_of.map(|_| pole::rate(values, record.interval));
                Ok(rate.as_deref().unwrap_or(values).iter().map(|v| v / input.scale).collect())
            };
            Ok(SensorSeries {
                name: record.name.clone(),
                interval: record.interval,
                inputs: driving.iter().map(along).collect::<Result<_, _>>()?,
                outputs: sensors.iter().map(|s| divided(s.role, s.scale)).collect::<Result<_, _>>()?,
            })
        };
        let of = |usage: Usage| records.with(usage).map(|r| series(r)).collect::<Result<Vec<_>, _>>();
        let (fitted, held_out) = (of(Usage::Fit)?, of(Usage::HeldOut)?);
        Ok(Self { sensors, inputs: driving.into_iter().map(|(_, i)| i).collect(), fitted, held_out })
    }

    pub(crate) fn sensor_at(&self, place: usize) -> Option<usize> {
        sensor_at(&self.sensors, place)
    }
}

/// The rate of an input that is a motion: where the ground moves, it drives a structure through springs by its displacement and
/// through dampers by its velocity.
fn rate(records: &RecordSet, (role, input): &(Role, Input)) -> Option<(Role, Input)> {
    units::parse(&input.unit).filter(|unit| unit.is_length() || unit.is_angle())?;
    let name = format!("d({})/dt", input.name);
    let rate = Input { name, unit: format!("{}/s", input.unit), scale: 1.0, rate_of: Some(*role) };
    let all: Vec<f64> = records.with(Usage::Fit).filter_map(|r| rate.along(r)).flat_map(Cow::into_owned).collect();
    let scale = (all.iter().map(|v| v * v).sum::<f64>() / all.len().max(1) as f64).sqrt();
    (scale.is_finite() && scale > 0.0).then_some((*role, Input { scale, ..rate }))
}

/// The sensor that shows a place best: its displacement before its velocity before its acceleration.
pub(crate) fn sensor_at(sensors: &[Sensor], place: usize) -> Option<usize> {
    let at_place = sensors.iter().enumerate().filter(|(_, s)| s.place() == place);
    at_place.min_by_key(|(_, s)| s.quantity).map(|(k, _)| k)
}

fn measured(record: &Record, role: Role) -> Result<&Channel, ModesError> {
    let channel = record.channel(role).filter(|c| !c.estimated);
    channel.ok_or_else(|| ModesError::RecordsDiffer { record: record.name.clone(), channel: role.short_name() })
}
