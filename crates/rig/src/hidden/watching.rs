//! The sensors of a test with a hidden effect.

use std::fmt;
use std::str::FromStr;

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use crate::response::Sampling;
use crate::sensor::Sensor;

/// Correlation of coloured noise from one sample to the next.
const CORRELATION: f64 = 0.8;

/// What a displacement sensor's noise is like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NoiseKind {
    /// White Gaussian.
    #[default]
    White,
    /// Gaussian, each sample correlated with the one before by 0.8.
    Coloured,
    /// Rounded to whole steps, nothing else.
    Quantised,
}

impl NoiseKind {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::White, Self::Coloured, Self::Quantised];

    /// The name it is typed with.
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Coloured => "coloured",
            Self::Quantised => "quantised",
        }
    }
}

impl fmt::Display for NoiseKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for NoiseKind {
    type Err = String;

    /// Reads the name it is typed with.
    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|k| k.name() == text).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("{text:?} is no kind of noise; choose one of: {known}")
        })
    }
}

/// What the motion's sensor shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Shown {
    /// Displacement.
    #[default]
    Displacement,
    /// Velocity, as a laser vibrometer does.
    Velocity,
    /// Acceleration.
    Acceleration,
}

impl Shown {
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

    /// How often the displacement is differentiated.
    pub(super) fn derivatives(self) -> u8 {
        self as u8
    }
}

impl FromStr for Shown {
    type Err = String;

    /// Reads the name it is typed with.
    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|shown| shown.name() == text);
        known.ok_or_else(|| format!("{text:?} is no channel of a motion: write x, v or a"))
    }
}

/// What watches a test: one sensor each for motion and input, the same in every record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watching {
    /// What is shown of the motion.
    pub shown: Shown,
    /// What the noise on it is like.
    pub kind: NoiseKind,
    /// Its standard deviation, or the quantisation step, as a share of the RMS of what is shown over the fitted records.
    pub share: f64,
    /// Standard deviation of the input's white noise as a share of its RMS.
    pub input_share: f64,
    /// Standard deviation of the instants at which samples are taken, in sampling intervals; the records count them as even.
    pub jitter: f64,
}

impl Watching {
    /// White noise on a displacement, and a thousandth on the input where there is any.
    pub fn white(share: f64) -> Self {
        let input_share = if share > 0.0 { 1e-3 } else { 0.0 };
        Self { shown: Shown::Displacement, kind: NoiseKind::White, share, input_share, jitter: 0.0 }
    }

    /// The standard deviation of the noise on a motion of this RMS.
    pub(super) fn deviation(&self, rms: f64) -> f64 {
        match self.kind {
            NoiseKind::White | NoiseKind::Coloured => self.share * rms,
            NoiseKind::Quantised => self.share * rms / 12.0_f64.sqrt(),
        }
    }

    /// The instants at which a record's samples are taken: never before 0, and never one after the next.
    pub(crate) fn instants(&self, sampling: &Sampling, seed: u64) -> Vec<f64> {
        let even = (0..sampling.count).map(|k| sampling.time(k));
        let Some(normal) = Normal::new(0.0, self.jitter).ok().filter(|_| self.jitter > 0.0) else {
            return even.collect();
        };
        let mut random = Pcg64::seed_from_u64(seed);
        even.map(|t| (t + sampling.interval * normal.sample(&mut random).clamp(-0.4, 0.4)).max(0.0)).collect()
    }

    /// Records a clean motion, whose RMS over the fitted records is given.
    pub(crate) fn motion(&self, clean: &[f64], rms: f64, seed: u64, stream: u64) -> Vec<f64> {
        let size = self.share * rms;
        match self.kind {
            NoiseKind::White => Sensor::noisy(size).measure(clean, seed, stream),
            NoiseKind::Quantised => Sensor { resolution: size, ..Sensor::PERFECT }.measure(clean, seed, stream),
            NoiseKind::Coloured => {
                let mut samples = clean.to_vec();
                if let Ok(normal) = Normal::new(0.0, size) {
                    let mut random = Pcg64::seed_from_u64(seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15));
                    let fresh = (1.0 - CORRELATION * CORRELATION).sqrt();
                    let mut noise = normal.sample(&mut random);
                    for x in &mut samples {
                        *x += noise;
                        noise = CORRELATION * noise + fresh * normal.sample(&mut random);
                    }
                }
                Sensor::PERFECT.measure(&samples, seed, stream)
            }
        }
    }

    /// Records a clean input likewise.
    pub(crate) fn input(&self, clean: &[f64], rms: f64, seed: u64, stream: u64) -> Vec<f64> {
        Sensor::noisy(self.input_share * rms).measure(clean, seed, stream)
    }
}
