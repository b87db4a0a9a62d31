//! The state in which a record begins, in modal coordinates.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::closed::{ClosedModel, Course};
use super::linear::{LinearTask, ModalFit};
use super::measurement::{Measurement, Sensor};
use super::pole::Pole;

/// How a record begins: what a simulation of it starts from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordStart {
    /// Displacement `qᵢ` of each mode at the first sample, in the units of [`super::Structure::modes`].
    pub displacement: Vec<f64>,
    /// Velocity `qᵢ′` of each mode.
    pub velocity: Vec<f64>,
    /// Inner state of a force that has a memory, in the displacement's unit; else zero.
    pub memory: f64,
    /// What each sensor shows beside the motion, in its unit.
    pub offsets: Vec<f64>,
}

impl RecordStart {
    fn push(&mut self, pole: Pole, state: Complex<f64>) {
        let lambda = pole.eigenvalue();
        // At rest a positive zero, which reads better where it is printed.
        self.displacement.push(state.im / lambda.im + 0.0);
        self.velocity.push((lambda * state).im / lambda.im + 0.0);
    }

    /// The starts of all fitted records of a linear model; `order[mode]` is the pole of each mode, `shapes[mode][sensor]` its shape.
    ///
    /// Each sensor's free oscillation is fitted with amplitudes of its own; the state is what comes nearest to all of them, sensors
    /// weighed by their scales.
    pub(crate) fn linear(
        measurement: &Measurement,
        task: &LinearTask<'_>,
        fit: &ModalFit,
        (order, shapes): (&[usize], &[Vec<Complex<f64>>]),
    ) -> Vec<Self> {
        let sensors = &measurement.sensors;
        let of = |record: usize| {
            let mut start = Self::default();
            for (mode, shape) in order.iter().zip(shapes) {
                let pole = fit.poles[*mode];
                start.push(pole, free_state(task, fit, (*mode, record), sensors, shape));
            }
            let offset = |(s, sensor): (usize, &Sensor)| task.offset(fit, s, record) * sensor.scale;
            start.offsets = sensors.iter().enumerate().map(offset).collect();
            start
        };
        (0..measurement.fitted.len()).map(of).collect()
    }

    /// The starts of the records along which a model with a force was fitted; `order[mode]` is the place of each mode in the model, and
    /// `largest[mode]` the shape's largest entry in the sensors' units.
    pub(crate) fn closed(
        sensors: &[Sensor],
        model: &ClosedModel,
        course: &Course,
        (order, largest): (&[usize], &[f64]),
    ) -> Vec<Self> {
        let of = |(record, offsets): (usize, &Vec<f64>)| {
            let mut start = Self::default();
            let first = course.segments.iter().position(|s| (s.record, s.start) == (record, 0));
            let states = first.and_then(|k| model.initial.get(k));
            for (mode, largest) in order.iter().zip(largest) {
                let state = states.map_or(Complex::new(0.0, 0.0), |all| all.modes[*mode]);
                start.push(model.poles[*mode], state * *largest);
            }
            start.memory = states.map_or(0.0, |s| s.memory);
            start.offsets = offsets.iter().zip(sensors).map(|(o, s)| o * s.scale).collect();
            start
        };
        course.offsets.iter().enumerate().map(of).collect()
    }
}

/// The state `Z` of a mode of which a sensor shows `Im(λᵈ φ Z)/Im λ`, nearest to what the free oscillations of one record are.
fn free_state(
    task: &LinearTask<'_>,
    fit: &ModalFit,
    (mode, record): (usize, usize),
    sensors: &[Sensor],
    shape: &[Complex<f64>],
) -> Complex<f64> {
    let lambda = fit.poles[mode].eigenvalue();
    let (mut sum, mut power) = (Complex::new(0.0, 0.0), 0.0);
    for (s, sensor) in sensors.iter().enumerate() {
        let [re, im] = task.free(fit, s, mode, record);
        let own = lambda.powi(sensor.quantity.derivatives()) * shape[s] / (lambda.im * sensor.scale);
        sum += Complex::new(im, re) * own.conj();
        power += own.norm_sqr();
    }
    if power > 0.0 { sum / power } else { sum }
}
