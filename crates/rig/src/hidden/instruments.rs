//! The sensors of a test with a hidden effect.

use std::str::FromStr;

use crate::motion::PlantMotion;
use crate::sensor::{Noise, NoiseKind, Sensor};
use crate::setup::MeasuredQuantity;

/// What the motion's sensor shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SensedMotion {
    /// Displacement.
    #[default]
    Displacement,
    /// Velocity, as a laser vibrometer does.
    Velocity,
    /// Acceleration.
    Acceleration,
}

impl SensedMotion {
    /// Every kind of sensor.
    pub const ALL: [Self; 3] = [Self::Displacement, Self::Velocity, Self::Acceleration];

    /// The channel's name, which is what it is typed with.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "x",
            Self::Velocity => "v",
            Self::Acceleration => "a",
        }
    }

    /// What it is of the plant's states: displacement, velocity.
    pub(super) fn quantity(self) -> MeasuredQuantity {
        match self {
            Self::Displacement => MeasuredQuantity::State(0),
            Self::Velocity => MeasuredQuantity::State(1),
            Self::Acceleration => MeasuredQuantity::Rate(1),
        }
    }

    /// The same along a motion.
    pub(super) fn series(self, motion: &PlantMotion) -> &[f64] {
        match self {
            Self::Displacement => &motion.states[0],
            Self::Velocity => &motion.states[1],
            Self::Acceleration => &motion.rates[1],
        }
    }

    /// How often the displacement is differentiated.
    pub(super) fn derivatives(self) -> u8 {
        self as u8
    }
}

impl FromStr for SensedMotion {
    type Err = String;

    /// Reads the name it is typed with.
    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|shown| shown.name() == text);
        known.ok_or_else(|| format!("{text:?} is no channel of a motion: write x, v or a"))
    }
}

/// The sensors of a test: one for the motion and one for the input, the same in every record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instruments {
    /// What is shown of the motion.
    pub shown: SensedMotion,
    /// What the noise on it is like.
    pub kind: NoiseKind,
    /// Its standard deviation, or the quantisation step, as a share of the RMS of what is shown over the fitted records.
    pub share: f64,
    /// Standard deviation of the input's white noise as a share of its RMS.
    pub input_share: f64,
    /// Standard deviation of the instants at which samples are taken, in sampling intervals; the records count them as even.
    pub jitter: f64,
}

impl Instruments {
    /// White noise on a displacement, and a thousandth on the input where there is any.
    pub fn white(share: f64) -> Self {
        let input_share = if share > 0.0 { 1e-3 } else { 0.0 };
        Self { shown: SensedMotion::Displacement, kind: NoiseKind::White, share, input_share, jitter: 0.0 }
    }

    /// The standard deviation of the noise on a motion of this RMS.
    pub(super) fn deviation(&self, rms: f64) -> f64 {
        match self.kind {
            NoiseKind::White | NoiseKind::Coloured => self.share * rms,
            NoiseKind::Quantised => self.share * rms / 12.0_f64.sqrt(),
        }
    }

    /// The sensor of the motion.
    pub(crate) fn sensor(&self) -> Sensor {
        Sensor { noise: Noise::ShareOfRms(self.share), kind: self.kind, ..Sensor::PERFECT }
    }

    /// The sensor of the input.
    pub(crate) fn input_sensor(&self) -> Sensor {
        Sensor { noise: Noise::ShareOfRms(self.input_share), ..Sensor::PERFECT }
    }
}
