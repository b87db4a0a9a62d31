//! One mode of a structure as a record of one mass.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, SymmetricEigen};

use super::filter::passed;
use super::{PrepareError, Treatment, lost_noise, within_half_rate};
use crate::sampling::{LEAST_SAMPLES, significant};
use crate::signal::{dot, mean_and_variance};
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};

/// A record with what its sensors show within the band.
struct InBand<'a> {
    record: &'a Record,
    sensors: Vec<&'a Channel>,
    /// Without what the filter's ends cannot know: `[sensor][sample]`.
    values: Vec<Vec<f64>>,
    /// The samples that are kept.
    range: Range<usize>,
    band: (f64, f64),
}

impl<'a> InBand<'a> {
    fn new(record: &'a Record, band: (f64, f64)) -> Self {
        let sensors: Vec<&Channel> = record.measured().filter(|c| !matches!(c.role, Role::Input(_))).collect();
        // At either end as much is cut off as the filter rings.
        let rings = (1.0 / ((band.1 - band.0) * record.interval)).ceil() as usize;
        let range = rings.min(record.len())..record.len().saturating_sub(rings).max(rings.min(record.len()));
        let mut own = Self { record, sensors, values: Vec::new(), range, band };
        own.values = own.sensors.iter().map(|c| own.through(c)).collect();
        own
    }

    /// A channel through the band.
    fn through(&self, channel: &Channel) -> Vec<f64> {
        passed(&channel.values, self.record.interval, self.band)[self.range.clone()].to_vec()
    }

    /// Refuses sensors that do not show one quantity in one unit.
    fn check(&self) -> Result<(), PrepareError> {
        let name = &self.record.name;
        let Some(first) = self.sensors.first() else {
            return Err(PrepareError::Impossible(format!("record `{name}` has no sensor to isolate a mode in")));
        };
        let unlike = |c: &&&Channel| c.role.noun() != first.role.noun() || c.unit != first.unit;
        match self.sensors.iter().find(unlike) {
            Some(other) => Err(PrepareError::Impossible(format!(
                "record `{name}`: a mode is isolated over sensors of one kind and unit, and `{}` is none like `{}`: leave one of them out",
                other.name, first.name
            ))),
            None => Ok(()),
        }
    }
}

/// Records with one mode of those that are chosen, as records of one mass. The mode's shape is that of the fitted records, of all where
/// none is.
///
/// # Errors
/// The sensors do not show one quantity in one unit, differ from record to record, or do not move; too little is left of a record.
pub(super) fn isolated(
    set: &RecordSet,
    chosen: &dyn Fn(&Record) -> bool,
    band: (f64, f64),
) -> Result<RecordSet, PrepareError> {
    let treatment = Treatment::IsolateMode { from: band.0, to: band.1 };
    let mut all: Vec<(Option<InBand<'_>>, Usage)> = Vec::with_capacity(set.entries.len());
    for (record, usage) in &set.entries {
        if chosen(record) {
            within_half_rate(record, [Some(band.0), Some(band.1)])?;
            let own = InBand::new(record, band);
            own.check()?;
            if own.range.len() < LEAST_SAMPLES {
                return Err(treatment.too_short(record, own.range.len()));
            }
            all.push((Some(own), *usage));
        } else {
            all.push((None, *usage));
        }
    }
    let of = |usage: Option<Usage>| -> Vec<&InBand<'_>> {
        all.iter().filter(|(_, u)| usage.is_none_or(|usage| usage == *u)).filter_map(|(own, _)| own.as_ref()).collect()
    };
    let fitted = of(Some(Usage::Fit));
    let shape = ModeShape::new(if fitted.is_empty() { of(None) } else { fitted }, &of(None), band)?;
    let entries = all.iter().zip(&set.entries).map(|((own, usage), (record, _))| {
        let record = own.as_ref().map_or_else(|| Arc::clone(record), |own| Arc::new(shape.coordinate(own, treatment)));
        (record, *usage)
    });
    Ok(RecordSet { entries: entries.collect() })
}

/// A mode's shape over a record's sensors, in their order, 1 at the sensor that it moves most.
struct ModeShape {
    weights: Vec<f64>,
    /// The sensor that it moves most.
    at: usize,
}

impl ModeShape {
    /// The shape that carries most of the motion within a band, over some records together: the first principal component of
    /// the filtered sensors (proper orthogonal mode; B. F. Feeny, R. Kappagantu, J. Sound Vib. 211 (1998) 607), which is the
    /// mode's shape where one mode alone answers in the band. `all` are those that it is used for.
    ///
    /// # Errors
    /// Sensors differ from record to record, or do not move.
    fn new(records: Vec<&InBand<'_>>, all: &[&InBand<'_>], band: (f64, f64)) -> Result<Self, PrepareError> {
        let impossible = |text: String| Err(PrepareError::Impossible(text));
        let Some(first) = records.first() else { return impossible("there is no record to isolate a mode in".into()) };
        let roles = |own: &InBand<'_>| own.sensors.iter().map(|c| c.role).collect::<Vec<_>>();
        if let Some(other) = all.iter().find(|own| roles(own) != roles(first)) {
            let (name, first) = (&other.record.name, &first.record.name);
            return impossible(format!("record `{name}` has other sensors than `{first}`"));
        }
        let count = first.sensors.len();
        let squares = records.iter().fold(DMatrix::zeros(count, count), |sum, own| {
            sum + DMatrix::from_fn(count, count, |i, j| dot(&own.values[i], &own.values[j]))
        });
        let eigen = SymmetricEigen::new(squares);
        let largest = eigen.eigenvalues.imax();
        if eigen.eigenvalues[largest].is_nan() || eigen.eigenvalues[largest] <= 0.0 {
            return impossible(format!("nothing moves between {} and {} Hz", band.0, band.1));
        }
        let shape = eigen.eigenvectors.column(largest);
        let at = shape.iamax();
        Ok(Self { weights: shape.iter().map(|w| w / shape[at]).collect(), at })
    }

    /// The mode's motion in what sensors show.
    fn weighed(&self, values: &[Vec<f64>]) -> Vec<f64> {
        let square = dot(&self.weights, &self.weights);
        let count = values.first().map_or(0, Vec::len);
        (0..count).map(|k| self.weights.iter().zip(values).map(|(w, v)| w * v[k]).sum::<f64>() / square).collect()
    }

    /// The record of one mass whose motion is the mode's at the sensor that it moves most; inputs are filtered alike, so that
    /// motion and force still belong together. Its notices say what is lost.
    fn coordinate(&self, own: &InBand<'_>, treatment: Treatment) -> Record {
        let InBand { record, sensors, values, range, band } = own;
        let shown = sensors[self.at];
        let motion = self.weighed(values);
        let notices = self.lost(own, &motion, treatment);
        let inputs = record.channels.iter().filter(|c| matches!(c.role, Role::Input(_)));
        let mut channels: Vec<Channel> =
            inputs.map(|c| Channel { values: own.through(c).into(), ..c.clone() }).collect();
        // What was estimated of each sensor's motion is that of the mode with the same weights.
        for kind in [Role::Displacement, Role::Velocity, Role::Acceleration] {
            let of_kind = |c: &&Channel| record.channel(kind(c.role.index()));
            let Some(all) = sensors.iter().map(of_kind).collect::<Option<Vec<&Channel>>>() else { continue };
            let values = if kind(shown.role.index()) == shown.role {
                motion.clone()
            } else {
                self.weighed(&all.iter().map(|c| own.through(c)).collect::<Vec<_>>())
            };
            channels.push(Channel { role: kind(0), values: values.into(), ..all[self.at].clone() });
        }
        channels.sort_by_key(|c| c.role);
        let mut of_one = Record { start: record.time(range.start), channels, ..(*record).clone() };
        of_one.notices.extend(notices);
        of_one.notices.push(lost_noise(record, band.1));
        of_one
    }

    /// What was done, and how much of the motion the mode is.
    fn lost(&self, own: &InBand<'_>, motion: &[f64], treatment: Treatment) -> [String; 2] {
        let variance = |values: &[f64]| mean_and_variance(values).1;
        let carried = dot(&self.weights, &self.weights) * variance(motion);
        let within: f64 = own.values.iter().map(|v| variance(v)).sum();
        let whole: f64 = own.sensors.iter().map(|c| variance(&c.values)).sum();
        let percent = |part: f64, all: f64| significant(100.0 * part / all.max(f64::MIN_POSITIVE), 3);
        let name = &own.record.name;
        let shape: Vec<String> = self.weights.iter().map(|w| significant(*w, 3).to_string()).collect();
        let names: Vec<&str> = own.sensors.iter().map(|c| c.name.as_str()).collect();
        let over = match names.len() {
            1 => String::new(),
            _ => format!(", its shape {} over {}", shape.join(", "), names.join(", ")),
        };
        [
            format!("{name}: {treatment}, the motion as at `{}`{over}", names[self.at]),
            format!(
                "{name}: the mode carries {} % of the motion within the band; {} % of the whole motion lies outside the band and is lost, \
                 and with it the harmonics that a force which is not linear makes",
                percent(carried, within),
                percent((whole - within).max(0.0), whole),
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::prepare::prepare;

    /// Three sensors that show two modes, 10 and 37 Hz, with these shapes.
    const SHAPES: [[f64; 3]; 2] = [[0.4, 0.8, 1.0], [1.0, 0.5, -0.8]];

    fn modes(k: usize) -> [f64; 2] {
        let t = k as f64 * 1e-3;
        [(TAU * 10.0 * t).sin(), 0.7 * (TAU * 37.0 * t + 0.3).sin()]
    }

    fn structure(name: &str) -> Record {
        let channel = |role: Role, name: &str, unit: &str, value: &dyn Fn(usize) -> f64| Channel {
            name: name.into(),
            role,
            unit: unit.into(),
            values: (0..4000).map(value).collect(),
            estimated: false,
        };
        let shown = |s: usize| move |k: usize| SHAPES.iter().zip(modes(k)).map(|(shape, q)| shape[s] * q).sum::<f64>();
        let mut channels: Vec<Channel> =
            (0..3).map(|s| channel(Role::Displacement(s), &format!("y{s}"), "mm", &shown(s))).collect();
        channels.push(channel(Role::Input(0), "F", "N", &|k| (TAU * 37.0 * k as f64 * 1e-3).cos()));
        channels.sort_by_key(|c| c.role);
        Record { name: name.into(), source: None, start: 0.0, interval: 1e-3, channels, notices: Vec::new() }
    }

    #[test]
    fn one_mode_is_handed_on_as_one_mass() {
        let set = RecordSet::new([structure("run")], Usage::Fit);
        let step = Treatment::IsolateMode { from: 28.0, to: 48.0 };
        let done = prepare(&set, &[step.into()]).unwrap();
        let record = &done.entries[0].0;
        assert_eq!(record.sensors().count(), 1);
        assert!(record.channel(Role::Input(0)).is_some());
        let motion = &record.channel(Role::Displacement(0)).unwrap();
        assert_eq!(motion.name, "y0", "the mode moves it most");
        let cut = ((record.start / record.interval).round()) as usize;
        for (k, value) in motion.values.iter().enumerate().skip(200).step_by(37).take(80) {
            assert!((value - modes(k + cut)[1]).abs() < 0.01, "{k}: {value} {}", modes(k + cut)[1]);
        }
        let told = record.notices.join("\n");
        assert!(told.contains("0.5, -0.8") || told.contains("0.5, −0.8"), "{told}");
        assert!(told.contains("is lost"), "{told}");
    }

    #[test]
    fn what_cannot_be_isolated_is_said() {
        let mut other = structure("run");
        other.channels.iter_mut().find(|c| c.name == "y1").unwrap().unit = "m".into();
        let step = Treatment::IsolateMode { from: 28.0, to: 48.0 };
        let told = prepare(&RecordSet::new([other], Usage::Fit), &[step.into()]).unwrap_err().to_string();
        assert!(told.contains("`y1` is none like `y0`"), "{told}");
        let beyond = Treatment::IsolateMode { from: 28.0, to: 700.0 };
        let told = prepare(&RecordSet::new([structure("run")], Usage::Fit), &[beyond.into()]).unwrap_err().to_string();
        assert!(told.contains("half the sampling rate"), "{told}");
    }
}
