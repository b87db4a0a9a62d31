//! One mode of a structure as a record of one mass.

use nalgebra::{DMatrix, SymmetricEigen};

use super::filter::passed;
use super::{PrepareError, Treatment, lost_noise};
use crate::sampling::significant;
use crate::signal::mean_and_variance;
use sindyscope_values::record::{Channel, Record, Role};

/// A mode's shape over a record's sensors, in their order, 1 at the sensor that it moves most.
pub(super) struct ModeShape {
    weights: Vec<f64>,
    /// The sensor that it moves most.
    at: usize,
}

fn sensors(record: &Record) -> Vec<&Channel> {
    record.measured().filter(|c| !matches!(c.role, Role::Input(_))).collect()
}

/// The filtered values of each sensor, without what the filter's ends cannot know.
fn in_band(record: &Record, band: (f64, f64)) -> Vec<Vec<f64>> {
    let range = kept(record, band);
    let filtered = |c: &Channel| passed(&c.values, record.interval, band);
    sensors(record).into_iter().map(|c| filtered(c)[range.clone()].to_vec()).collect()
}

/// The samples that are kept: at either end as much is cut off as the filter rings.
fn kept(record: &Record, (from, to): (f64, f64)) -> std::ops::Range<usize> {
    let rings = (1.0 / ((to - from) * record.interval)).ceil() as usize;
    rings.min(record.len())..record.len().saturating_sub(rings).max(rings.min(record.len()))
}

impl ModeShape {
    /// The shape that carries most of the motion within a band, over all records together: the first principal component of
    /// the filtered sensors (proper orthogonal mode; B. F. Feeny, R. Kappagantu, J. Sound Vib. 211 (1998) 607), which is the
    /// mode's shape where one mode alone answers in the band.
    ///
    /// # Errors
    /// The sensors do not show one quantity in one unit, differ from record to record, or do not move.
    pub(super) fn new(records: &[&Record], band: (f64, f64)) -> Result<Self, PrepareError> {
        let impossible = |text: String| Err(PrepareError::Impossible(text));
        let Some(first) = records.first() else { return impossible("there is no record to isolate a mode in".into()) };
        let roles: Vec<Role> = sensors(first).iter().map(|c| c.role).collect();
        for record in records {
            let own = sensors(record);
            let name = &record.name;
            if own.is_empty() {
                return impossible(format!("record `{name}` has no sensor to isolate a mode in"));
            }
            let noun = own[0].role.noun();
            if let Some(other) = own.iter().find(|c| c.role.noun() != noun || c.unit != own[0].unit) {
                return impossible(format!(
                    "record `{name}`: a mode is isolated over sensors of one kind and unit, and `{}` is none like `{}`: leave one of \
                     them out",
                    other.name, own[0].name
                ));
            }
            if own.iter().map(|c| c.role).ne(roles.iter().copied()) {
                return impossible(format!("record `{name}` has other sensors than `{}`", first.name));
            }
        }
        let mut squares = DMatrix::<f64>::zeros(roles.len(), roles.len());
        for record in records {
            let values = in_band(record, band);
            for (i, a) in values.iter().enumerate() {
                for (j, b) in values.iter().enumerate() {
                    squares[(i, j)] += a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        let eigen = SymmetricEigen::new(squares);
        let largest = eigen.eigenvalues.imax();
        if eigen.eigenvalues[largest].is_nan() || eigen.eigenvalues[largest] <= 0.0 {
            return impossible(format!("nothing moves between {} and {} Hz", band.0, band.1));
        }
        let shape = eigen.eigenvectors.column(largest);
        let at = shape.iamax();
        Ok(Self { weights: shape.iter().map(|w| w / shape[at]).collect(), at })
    }

    /// The record of one mass whose motion is the mode's at the sensor that it moves most; inputs are filtered alike, so that
    /// motion and force still belong together. Its notices say what is lost.
    pub(super) fn coordinate(&self, record: &Record, band: (f64, f64)) -> Record {
        let values = in_band(record, band);
        let square: f64 = self.weights.iter().map(|w| w * w).sum();
        let weighed = |values: &[Vec<f64>]| -> Vec<f64> {
            let count = values.first().map_or(0, Vec::len);
            let at = |k: usize| self.weights.iter().zip(values).map(|(w, v)| w * v[k]).sum::<f64>() / square;
            (0..count).map(at).collect()
        };
        let motion = weighed(&values);
        let own = sensors(record);
        let variance = |values: &[f64]| mean_and_variance(values).1;
        let carried = square * variance(&motion);
        let [within, whole] =
            [values.iter().map(|v| variance(v)).sum::<f64>(), own.iter().map(|c| variance(&c.values)).sum::<f64>()];
        let percent = |part: f64, all: f64| significant(100.0 * part / all.max(f64::MIN_POSITIVE), 3);
        let range = kept(record, band);
        let mut of_one = record.slice(range.clone());
        let shown = own[self.at];
        let through = |c: &Channel| passed(&c.values, record.interval, band)[range.clone()].to_vec();
        let inputs = record.channels.iter().filter(|c| matches!(c.role, Role::Input(_)));
        let mut channels: Vec<Channel> = inputs.map(|c| Channel { values: through(c).into(), ..c.clone() }).collect();
        // What was estimated of each sensor's motion is that of the mode with the same weights.
        for kind in [Role::Displacement, Role::Velocity, Role::Acceleration] {
            let of_kind = |c: &&Channel| record.channel(kind(c.role.index()));
            let Some(all) = own.iter().map(of_kind).collect::<Option<Vec<&Channel>>>() else { continue };
            let values = if kind(shown.role.index()) == shown.role {
                motion.clone()
            } else {
                weighed(&all.iter().map(|c| through(c)).collect::<Vec<_>>())
            };
            channels.push(Channel { role: kind(0), values: values.into(), ..all[self.at].clone() });
        }
        channels.sort_by_key(|c| c.role);
        of_one.channels = channels;
        let name = &record.name;
        let treatment = Treatment::IsolateMode { from: band.0, to: band.1 };
        let shape: Vec<String> = self.weights.iter().map(|w| significant(*w, 3).to_string()).collect();
        let over = match own.len() {
            1 => String::new(),
            _ => format!(
                ", its shape {} over {}",
                shape.join(", "),
                own.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ")
            ),
        };
        of_one.notices.push(format!("{name}: {treatment}, the motion as at `{}`{over}", shown.name));
        of_one.notices.push(format!(
            "{name}: the mode carries {} % of the motion within the band; {} % of the whole motion lies outside the band and is lost, and \
             with it the harmonics that a force which is not linear makes",
            percent(carried, within),
            percent((whole - within).max(0.0), whole),
        ));
        of_one.notices.push(lost_noise(record, band.1));
        of_one
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::prepare::prepare;
    use sindyscope_values::record::{RecordSet, Usage};

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
