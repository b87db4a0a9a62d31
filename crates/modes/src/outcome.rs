//! What was identified, as plain values.

use serde::{Deserialize, Serialize};
use sindyscope_core::study::Score;
use sindyscope_values::model::Mode;
use sindyscope_values::record::Usage;

use super::measurement::{self, Input, Sensor};
use super::start::RecordStart;

/// A structure as a sum of modes: `qᵢ″ + 2ζᵢωᵢ qᵢ′ + ωᵢ² qᵢ = Σⱼ bᵢⱼ uⱼ`; a sensor shows `Σᵢ φᵢ qᵢ`, or its first or second derivative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Structure {
    /// The sensors, place by place.
    pub sensors: Vec<Sensor>,
    /// The inputs.
    pub inputs: Vec<Input>,
    /// Frequency, damping and shape of each mode, the slowest first; the largest entry of a shape is one, and entries are
    /// displacements in the units of the sensors times the square of a second where they show accelerations.
    pub modes: Vec<Mode>,
    /// True for each mode whose frequency lies in the band that the inputs drive, and for all without inputs; the others stand for
    /// what lies beyond the band, and for slow drifts.
    pub in_band: Vec<bool>,
    /// `participation[mode][input]`: b, in the unit of the shape's largest entry over s² and the input's unit.
    pub participation: Vec<Vec<f64>>,
    /// Standard deviation of the noise of the first sensor, in its unit; none where it cannot be told.
    pub noise_floor: Option<f64>,
    /// What the model leaves on each record.
    pub records: Vec<RecordFit>,
}

/// What a model leaves on one record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordFit {
    /// The record's name.
    pub name: String,
    /// Fitted or held out: on a record held out the state at the start alone is fitted.
    pub usage: Usage,
    /// Number of samples.
    pub samples: usize,
    /// Sampling interval, s.
    pub interval: f64,
    /// One score a sensor, in its unit.
    pub scores: Vec<Score>,
    /// How it begins; none of a record held out.
    pub start: Option<RecordStart>,
}

impl Structure {
    /// Number of states: two for each mode.
    pub fn order(&self) -> usize {
        2 * self.modes.len()
    }

    /// The number, from one, by which a mode in the band is known: those outside are not counted.
    pub fn mode_number(&self, index: usize) -> usize {
        self.in_band.iter().take(index + 1).filter(|inside| **inside).count()
    }

    /// The number of the sensor that shows a place best: its displacement before its velocity before its acceleration.
    pub fn sensor_at(&self, place: usize) -> Option<usize> {
        measurement::sensor_at(&self.sensors, place)
    }

    /// The scores of one sensor over all records of a usage together; none where there is none.
    pub fn score(&self, sensor: usize, usage: Usage) -> Option<Score> {
        let scores = self.records.iter().filter(|r| r.usage == usage).map(|r| &r.scores[sensor]);
        Score::pooled(scores)
    }
}
