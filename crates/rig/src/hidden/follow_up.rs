//! A further test of a plant that was drawn.

use super::excitation_kind::PlannedRecord;
use super::{HiddenRequest, performed};
use crate::response::SampleTimes;
use crate::{Excitation, Harmonic, RigError};
use sindyscope_values::record::Record;

/// A further test, in the units of the records.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowUp {
    /// What moves the mass.
    pub drive: FollowUpDrive,
    /// How long it is recorded, s.
    pub seconds: f64,
}

/// What moves the mass in a further test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FollowUpDrive {
    /// It is let go from rest at this displacement; the input rests.
    Release(f64),
    /// From rest, `amplitude × sin(2π × frequency × t)`.
    Tone {
        /// In the input's unit.
        amplitude: f64,
        /// Hz.
        frequency: f64,
    },
    /// From rest, a sine whose frequency grows evenly from the first of the band to the second, Hz.
    Sweep {
        /// In the input's unit.
        amplitude: f64,
        /// Frequency at the beginning and at the end, Hz.
        band: (f64, f64),
    },
}

/// The plant that [`super::draw`] draws for a request, tested further with the same sensors and sampling: two records of the same test, with noise of their own.
///
/// # Errors
/// As [`super::draw`].
pub fn follow_up(request: &HiddenRequest, test: &FollowUp) -> Result<[Record; 2], RigError> {
    let (mut plan, before) = performed(request)?;
    let scales = &plan.scales;
    // Sizes of a drive are told at the level that the effects were brought to.
    let level = before.assembly.level();
    let (input, length) = (1.0 / (scales.input * level), 1.0 / (scales.length * level));
    let time = scales.rate;
    let duration = test.seconds * time;
    let (excitation, released) = match test.drive {
        FollowUpDrive::Release(displacement) => (None, displacement * length),
        FollowUpDrive::Tone { amplitude, frequency } => {
            let phase = -std::f64::consts::FRAC_PI_2;
            let tone = Harmonic { amplitude: amplitude * input, frequency: frequency / time, phase };
            (Some(Excitation::tones([tone])), 0.0)
        }
        FollowUpDrive::Sweep { amplitude, band: (low, high) } => {
            (Some(Excitation::sweep(amplitude * input, low / time, high / time, duration)), 0.0)
        }
    };
    let driven = plan.runs.iter().any(|run| run.excitation.is_some());
    let interval = plan.runs.first().map_or(1.0, |run| run.sampling.interval);
    let count = (duration / interval).ceil() as usize;
    let run = |name: &str| PlannedRecord {
        name: name.to_owned(),
        excitation: excitation.clone().or_else(|| driven.then(Excitation::rest)),
        noise: None,
        initial: [released, 0.0],
        sampling: SampleTimes { start: 0.0, interval, count },
        // The sensors are those of the test before: their noise is not measured anew.
        held_out: true,
    };
    plan.runs.extend([run("further test"), run("further test, repeated")]);
    let setup = plan.setup(&before.assembly);
    let mut records = setup.records(&setup.motions()?);
    match (records.pop(), records.pop()) {
        (Some(second), Some(first)) => Ok([first, second]),
        _ => Err(RigError::Unbounded { time: 0.0 }),
    }
}
