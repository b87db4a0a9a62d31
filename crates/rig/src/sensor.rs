use std::fmt;
use std::str::FromStr;

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::motion::rms;
use super::words::{short, typed_names};

/// Digits that a sample keeps of the largest magnitude of its channel, or of a thousandth of its noise if that is more.
const DIGITS: i32 = 10;

/// Correlation of coloured noise from one sample to the next.
const CORRELATION: f64 = 0.8;

/// How large a sensor's noise is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Standard deviation, in the channel's unit.
    Deviation(f64),
    /// Standard deviation as a share of the clean channel's largest magnitude in its record.
    ShareOfPeak(f64),
    /// Standard deviation as a share of the clean channel's RMS over the records that are not held out.
    ShareOfRms(f64),
}

impl Noise {
    /// No noise.
    pub const NONE: Self = Self::Deviation(0.0);

    /// The report's rule: a hundredth of the largest magnitude.
    pub const REPORT: Self = Self::ShareOfPeak(0.01);

    /// The standard deviation for a clean channel, in its unit.
    pub fn deviation(self, clean: &[f64]) -> f64 {
        match self {
            Self::Deviation(deviation) => deviation,
            Self::ShareOfPeak(share) => share * clean.iter().fold(0.0, |peak, x| x.abs().max(peak)),
            Self::ShareOfRms(share) => share * rms(clean),
        }
    }

    /// True if it is a finite number, zero or more.
    pub(super) fn is_valid(self) -> bool {
        let (Self::Deviation(size) | Self::ShareOfPeak(size) | Self::ShareOfRms(size)) = self;
        size.is_finite() && size >= 0.0
    }
}

impl From<f64> for Noise {
    fn from(deviation: f64) -> Self {
        Self::Deviation(deviation)
    }
}

impl fmt::Display for Noise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Deviation(deviation) => f.write_str(&short(*deviation)),
            Self::ShareOfPeak(share) | Self::ShareOfRms(share) => write!(f, "{}%", short(100.0 * share)),
        }
    }
}

impl FromStr for Noise {
    type Err = String;

    /// Reads a standard deviation (`1e-5`) or a share of the largest magnitude (`1%`).
    fn from_str(text: &str) -> Result<Self, String> {
        let (number, share) = match text.trim().strip_suffix('%') {
            Some(number) => (number, true),
            None => (text.trim(), false),
        };
        let noise =
            number.trim().parse().ok().map(|n: f64| if share { Self::ShareOfPeak(n / 100.0) } else { n.into() });
        noise.filter(|n| n.is_valid()).ok_or_else(|| {
            format!("{text:?} is no noise level: give a standard deviation (1e-5) or a share of the peak (1%)")
        })
    }
}

/// What a sensor's noise is like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum NoiseKind {
    /// White Gaussian.
    #[default]
    White,
    /// Gaussian, each sample correlated with the one before by 0.8.
    Coloured,
    /// None: the samples are rounded to steps of the size that the noise would have.
    Quantised,
}

typed_names!(NoiseKind, "kind of noise", {
    White => "white",
    Coloured => "coloured",
    Quantised => "quantised",
});

/// What lies between a quantity and its recorded samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// The size of its noise.
    pub noise: Noise,
    /// What its noise is like.
    pub kind: NoiseKind,
    /// Quantisation step, in the channel's unit; zero is none.
    pub resolution: f64,
    /// What it shows of nothing at the first sample, in the channel's unit.
    pub offset: f64,
    /// The same as a multiple of the clean channel's RMS over the records that are not held out; it adds to `offset`.
    pub offset_over_rms: f64,
    /// How fast that grows, in the channel's unit per second.
    pub drift: f64,
    /// Corner frequency of the first-order high-pass that it is read through, Hz; zero is none.
    pub high_pass: f64,
}

impl Sensor {
    /// A sensor that records what is there.
    pub const PERFECT: Self = Self {
        noise: Noise::NONE,
        kind: NoiseKind::White,
        resolution: 0.0,
        offset: 0.0,
        offset_over_rms: 0.0,
        drift: 0.0,
        high_pass: 0.0,
    };

    /// A sensor with white Gaussian noise.
    pub fn noisy(noise: impl Into<Noise>) -> Self {
        Self { noise: noise.into(), ..Self::PERFECT }
    }

    /// The same sensor for a channel of this RMS: what is a share of it is given in the channel's unit.
    pub(super) fn settled(&self, rms: f64) -> Self {
        let noise = match self.noise {
            Noise::ShareOfRms(share) => Noise::Deviation(share * rms),
            Noise::Deviation(_) | Noise::ShareOfPeak(_) => self.noise,
        };
        Self { noise, offset: self.offset + self.offset_over_rms * rms, offset_over_rms: 0.0, ..*self }
    }

    /// Records a clean series sampled at an interval in seconds: what [`Self::measure`] makes of it with the sensor's offset,
    /// drift and high-pass. The high-pass has seen rest before the first sample, and has long settled on offset and drift.
    pub fn record(&self, clean: &[f64], interval: f64, seed: u64, stream: u64) -> Vec<f64> {
        let mut shown = clean.to_vec();
        if self.high_pass > 0.0 {
            high_pass(&mut shown, self.high_pass, interval);
            let ramp = self.drift / (std::f64::consts::TAU * self.high_pass);
            shown.iter_mut().for_each(|x| *x += ramp);
        } else if self.offset != 0.0 || self.drift != 0.0 {
            shown.iter_mut().enumerate().for_each(|(k, x)| *x += self.offset + self.drift * interval * k as f64);
        }
        self.measure(&shown, seed, stream)
    }

    /// Records a clean series, to ten digits of its largest magnitude (fewer where noise drowns them), so that a file of it
    /// is short and the same on every machine. The noise is drawn from `seed` in a stream of the sensor's own, so that it does not
    /// depend on what other sensors do.
    pub fn measure(&self, clean: &[f64], seed: u64, stream: u64) -> Vec<f64> {
        let mut samples = clean.to_vec();
        let size = self.noise.deviation(clean);
        let normal = Normal::new(0.0, size).ok().filter(|_| size > 0.0);
        // A seed and a stream, each spread over the generator's state: neighbouring ones share nothing.
        let random = &mut Pcg64::seed_from_u64(seed ^ stream.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let (mut deviation, mut step) = (0.0, self.resolution);
        match (self.kind, normal) {
            (_, None) => {}
            (NoiseKind::White, Some(normal)) => {
                deviation = size;
                samples.iter_mut().for_each(|x| *x += normal.sample(random));
            }
            (NoiseKind::Coloured, Some(normal)) => {
                let fresh = (1.0 - CORRELATION * CORRELATION).sqrt();
                let mut noise = normal.sample(random);
                for x in &mut samples {
                    *x += noise;
                    noise = CORRELATION * noise + fresh * normal.sample(random);
                }
            }
            (NoiseKind::Quantised, Some(_)) => step = size,
        }
        if step > 0.0 {
            samples.iter_mut().for_each(|x| *x = (*x / step).round() * step);
        }
        to_digits(&mut samples, deviation);
        samples
    }
}

/// A first-order high-pass, the input taken as linear between samples; it begins at rest, and the input may jump to its first
/// value.
fn high_pass(samples: &mut [f64], corner: f64, interval: f64) {
    let turn = std::f64::consts::TAU * corner * interval;
    let kept = (-turn).exp();
    let passed = (1.0 - kept) / turn;
    let first = samples.first().copied().unwrap_or(0.0);
    let (mut before, mut shown) = (first, first);
    for x in samples.iter_mut().skip(1) {
        shown = kept * shown + passed * (*x - before);
        before = std::mem::replace(x, shown);
    }
}

/// Rounds to a power of ten that is lost in the noise, or in the tenth digit of the largest magnitude.
fn to_digits(samples: &mut [f64], deviation: f64) {
    let peak = samples.iter().fold(0.0_f64, |peak, x| x.abs().max(peak));
    let least = f64::max(1e-3 * deviation, peak * 0.1_f64.powi(DIGITS));
    // Beyond these a power of ten is no exact divisor, and nobody counts digits.
    if !(1e-20..1e10).contains(&least) {
        return;
    }
    #[expect(clippy::cast_possible_truncation, reason = "an exponent between -20 and 10")]
    let decimals = -least.log10().ceil() as i32;
    let scale = 10_f64.powi(decimals.abs());
    for x in samples {
        let rounded = if decimals >= 0 { (*x * scale).round() / scale } else { (*x / scale).round() * scale };
        // No negative zero.
        *x = rounded + 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_the_deviation_asked_for_and_no_memory() {
        let clean = vec![1.0; 40_000];
        let sensor = Sensor::noisy(0.01);
        let noise: Vec<f64> = sensor.measure(&clean, 5, 0).iter().map(|x| x - 1.0).collect();
        let n = noise.len() as f64;
        let mean = noise.iter().sum::<f64>() / n;
        let deviation = (noise.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
        let lagged = noise.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n / deviation.powi(2);
        // Four standard errors: sd/√n, sd/√2n and 1/√n.
        assert!(mean.abs() < 4.0 * 0.01 / n.sqrt(), "{mean}");
        assert!((deviation / 0.01 - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "{deviation}");
        assert!(lagged.abs() < 4.0 / n.sqrt(), "{lagged}");
        // Kurtosis 3 of a Gaussian, its standard error √(24/n).
        let kurtosis = noise.iter().map(|e| e.powi(4)).sum::<f64>() / n / deviation.powi(4);
        assert!((kurtosis - 3.0).abs() < 4.0 * (24.0 / n).sqrt(), "{kurtosis}");
    }

    #[test]
    fn noise_is_the_same_for_a_seed_and_apart_for_each_stream() {
        let sensor = Sensor::noisy(Noise::REPORT);
        let clean: Vec<f64> = (0..500).map(|k| (0.1 * f64::from(k)).sin()).collect();
        assert_eq!(sensor.measure(&clean, 1, 0), sensor.measure(&clean, 1, 0));
        assert_ne!(sensor.measure(&clean, 1, 0), sensor.measure(&clean, 1, 1));
        assert_ne!(sensor.measure(&clean, 1, 0), sensor.measure(&clean, 2, 0));
    }

    #[test]
    fn quantised_samples_are_whole_steps() {
        let sensor = Sensor { resolution: 0.25, ..Sensor::PERFECT };
        assert_eq!(sensor.measure(&[0.1, 0.2, -0.6, 1.0], 0, 0), [0.0, 0.25, -0.5, 1.0]);
    }

    #[test]
    fn samples_keep_the_digits_that_matter() {
        let clean = [0.004_123_456_789_012_3, -1e-17, 0.001];
        assert_eq!(Sensor::PERFECT.measure(&clean, 0, 0), [0.004_123_456_789, 0.0, 0.001]);
        let noisy = Sensor::noisy(1e-5).measure(&clean, 0, 0);
        assert!(noisy.iter().all(|x| x.to_string().len() <= "-0.00412345".len()), "{noisy:?}");
        let noisy = Sensor::noisy(1e-25).measure(&[0.0, 0.0], 0, 0);
        assert!(noisy.iter().all(|x| *x != 0.0));
    }

    #[test]
    fn an_offset_and_a_drift_go_through_the_high_pass() {
        let wandering = Sensor { offset: 2.0, drift: 0.5, ..Sensor::PERFECT };
        assert_eq!(wandering.record(&[1.0; 3], 0.2, 0, 0), [3.0, 3.1, 3.2]);
        let coupled = Sensor { high_pass: 1.0, ..wandering };
        let shown = coupled.record(&vec![1.0; 5000], 1e-3, 0, 0);
        // Of a jump nothing is left after thirty time constants, and of a ramp its slope times the time constant.
        let time_constant = 1.0 / std::f64::consts::TAU;
        assert!((shown[0] - 1.0 - 0.5 * time_constant).abs() < 1e-9, "{}", shown[0]);
        assert!((shown[4999] - 0.5 * time_constant).abs() < 1e-9, "{}", shown[4999]);
        // Of a tone ten times as fast as the corner it leaves 1/√(1 + 0.01).
        let tone: Vec<f64> = (0..5000).map(|k| (std::f64::consts::TAU * 10.0 * f64::from(k) * 1e-3).sin()).collect();
        let shown = Sensor { high_pass: 1.0, ..Sensor::PERFECT }.record(&tone, 1e-3, 0, 0);
        let peak = shown[4000..].iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
        // Linear between samples, a hundred a period, is true to (2π/100)²/12.
        assert!((peak - 1.01_f64.powf(-0.5)).abs() < 1e-3, "{peak}");
    }

    #[test]
    fn noise_levels_read_back_as_they_print() {
        for noise in [Noise::Deviation(1e-5), Noise::REPORT, Noise::NONE] {
            assert_eq!(noise.to_string().parse(), Ok(noise));
        }
        for text in ["", "-1", "nan", "inf", "1e-5m", "%"] {
            assert!(text.parse::<Noise>().is_err(), "{text}");
        }
    }
}
