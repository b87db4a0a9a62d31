//! How records are run through: in segments, and how these are held together.

use super::super::measurement::{Sensor, SensorSeries};
use super::Simulated;

/// A stretch of a record that is simulated from a state of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Segment {
    pub(crate) record: usize,
    pub(crate) start: usize,
    pub(crate) length: usize,
}

impl Segment {
    /// Every record as one, or its first share.
    pub(crate) fn whole(series: &[SensorSeries], share: f64) -> Vec<Self> {
        let of = |(record, s): (usize, &SensorSeries)| {
            let length = ((s.len() as f64 * share) as usize).clamp(2, s.len());
            Self { record, start: 0, length }
        };
        series.iter().enumerate().map(of).collect()
    }
}

/// How a model is simulated.
#[derive(Clone, Copy)]
pub(crate) struct Loop<'a> {
    pub(crate) sensors: &'a [Sensor],
    pub(crate) series: &'a [SensorSeries],
    pub(crate) segments: &'a [Segment],
    /// `offsets[record][sensor]`
    pub(crate) offsets: &'a [Vec<f64>],
    /// Instants a sampling interval.
    pub(crate) parts: usize,
    /// How stretches that follow each other are held together.
    pub(crate) joint: Option<Joint<'a>>,
}

/// How records are run through: in which segments, and how these are held together.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) segments: Vec<Segment>,
    /// What a jump of each mode's state counts for, and of the force's inner state where it has one; empty where nothing is held.
    pub(crate) weights: Vec<f64>,
    pub(crate) rest: bool,
    /// `offsets[record][sensor]`
    pub(crate) offsets: Vec<Vec<f64>>,
}

impl Course {
    pub(crate) fn along<'a>(&'a self, sensors: &'a [Sensor], series: &'a [SensorSeries], parts: usize) -> Loop<'a> {
        let joint = (!self.weights.is_empty()).then_some(Joint { weights: &self.weights, rest: self.rest });
        Loop { sensors, series, segments: &self.segments, offsets: &self.offsets, parts, joint }
    }

    /// Series of segments put together to series of records; of neighbours that share `overlap` values the second one's count.
    pub(crate) fn records(&self, of: Loop<'_>, series: Vec<Vec<f64>>, overlap: usize) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = vec![Vec::new(); of.series.len()];
        for (k, (segment, mut values)) in self.segments.iter().zip(series).enumerate() {
            if of.is_joined(k) {
                values.truncate(values.len().saturating_sub(overlap));
            }
            all[segment.record].append(&mut values);
        }
        all
    }

    /// What is left of every record: `residuals[record][sensor][sample]`.
    pub(crate) fn residuals(&self, of: Loop<'_>, simulated: &Simulated) -> Vec<Vec<Vec<f64>>> {
        let sensors = of.sensors.len();
        let of_sensor = |s: usize| {
            let own = simulated.residuals.iter().map(|r| r[s].clone()).collect();
            self.records(of, own, 0)
        };
        let by_sensor: Vec<Vec<Vec<f64>>> = (0..sensors).map(of_sensor).collect();
        (0..of.series.len()).map(|r| by_sensor.iter().map(|s| s[r].clone()).collect()).collect()
    }
}

/// A segment whose last sample is the next one's first is followed by it: the jump of the states counts as an error.
#[derive(Clone, Copy)]
pub(crate) struct Joint<'a> {
    /// What a jump of each mode's state, and of the force's inner state where it has one, is multiplied by.
    pub(crate) weights: &'a [f64],
    /// True if records begin at rest.
    pub(crate) rest: bool,
}

impl Loop<'_> {
    /// True if a segment is held to the next one.
    pub(super) fn is_joined(&self, which: usize) -> bool {
        let next = self.segments.get(which + 1);
        let own = self.segments[which];
        self.joint.is_some() && next.is_some_and(|n| n.record == own.record && n.start + 1 == own.start + own.length)
    }
}
