//! A structure with all that figures show of it: where its modes come from, and what the model makes of each record.

use super::error::ModesError;
use super::measurement::{Measurement, SensorSeries};
use super::outcome::Structure;
use super::position::of_sensors;
use super::settings::Base;
use super::stabilization::{ModeQuality, Stabilization};
use super::study::{of_base, structure};
use sindyscope_core::study::Cancel;
use sindyscope_values::record::{RecordSet, Usage};

/// A structure, the poles it was chosen from, and its response along each record.
#[derive(Clone, Debug)]
pub struct ModalAnalysis {
    /// The modes and what they leave.
    pub structure: Structure,
    /// The stabilization diagram of the fitted records.
    pub stabilization: Stabilization,
    /// What the diagram says of each mode, in the structure's order.
    pub quality: Vec<ModeQuality>,
    /// `positions[sensor]`: one or two coordinates; empty where not every sensor has a position.
    pub positions: Vec<Vec<f64>>,
    /// The series of every record, in the order of [`Structure::records`].
    pub records: Vec<ModalRecord>,
}

/// One record as it was measured, and what the model leaves of it.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalRecord {
    /// Its name.
    pub name: String,
    /// Fitted or held out.
    pub usage: Usage,
    /// Sampling interval, s.
    pub interval: f64,
    /// `inputs[input][sample]`, in the inputs' units.
    pub inputs: Vec<Vec<f64>>,
    /// `measured[sensor][sample]`, in the sensors' units.
    pub measured: Vec<Vec<f64>>,
    /// `left[sensor][sample]`: measured minus modelled.
    pub left: Vec<Vec<f64>>,
}

impl ModalRecord {
    /// The model's response of one sensor, in its unit.
    pub fn modelled(&self, sensor: usize) -> Vec<f64> {
        self.measured[sensor].iter().zip(&self.left[sensor]).map(|(y, e)| y - e).collect()
    }
}

/// Identifies the modes of a structure, and keeps what tells how sure they are.
///
/// As [`super::identify`]; with poles in `base` the modes are fitted from these, and none is chosen.
///
/// # Errors
/// A position of a sensor that there is not; records that do not go together or show no oscillation; cancelled.
pub fn analyse(
    records: &RecordSet,
    base: &Base,
    tell: &(dyn Fn(&'static str, f64) + Sync),
    cancel: &Cancel,
) -> Result<ModalAnalysis, ModesError> {
    let measurement = Measurement::new(records, cancel)?;
    let positions = of_sensors(&base.positions, &measurement.sensors)?;
    tell("Looking for modes", 0.0);
    let found = of_base(&measurement, base, cancel)?;
    tell("Drawing up the stabilization diagram", 0.7);
    let stabilization = Stabilization::new(&measurement, cancel);
    if cancel.is_cancelled() {
        return Err(ModesError::Cancelled);
    }
    let structure = structure(&measurement, &found);
    let quality = structure.modes.iter().map(|m| stabilization.quality(m, &structure.sensors)).collect();
    let of = |usage: Usage, series: &SensorSeries, left: &Vec<Vec<f64>>| {
        let scaled = |all: &[Vec<f64>], scale: &dyn Fn(usize) -> f64| -> Vec<Vec<f64>> {
            all.iter().enumerate().map(|(k, s)| s.iter().map(|v| v * scale(k)).collect()).collect()
        };
        let by_sensor = |k: usize| measurement.sensors[k].scale;
        ModalRecord {
            name: series.name.clone(),
            usage,
            interval: series.interval,
            inputs: scaled(&series.inputs, &|k| measurement.inputs[k].scale),
            measured: scaled(&series.outputs, &by_sensor),
            left: scaled(left, &by_sensor),
        }
    };
    let fitted = measurement.fitted.iter().zip(&found.residuals.fitted).map(|(s, left)| of(Usage::Fit, s, left));
    let unseen = measurement.held_out.iter().zip(&found.residuals.unseen).map(|(s, left)| of(Usage::HeldOut, s, left));
    let records = fitted.chain(unseen).collect();
    Ok(ModalAnalysis { structure, stabilization, quality, positions, records })
}
