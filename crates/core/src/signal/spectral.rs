//! Smoothing and differentiation of the whole record by its Fourier transform.

use std::f64::consts::TAU;
use std::fmt;

use sindyscope_fourier::{Complex, Forward, Inverse};
use statrs::function::erf::erfc;

use super::SavitzkyGolay;
use super::spectrum::fast_length;

/// Width over which the pass band ends, as a share of the frequency at which half the amplitude passes.
const ROLL_OFF: f64 = 1.0 / 6.0;
/// Longest continuation of a record beyond its ends, in lengths of the smoothing: the low-pass hardly reaches as far.
const MAX_CONTINUATION: f64 = 20.0;

/// The record's spectrum times a soft low-pass, and times `iω` for the derivative, for records of one length.
///
/// A record is no period: it is carried on beyond its ends turned about them (about the smoothed value there), without
/// the line between them, so that value and slope are continuous; half way round the two continuations fade into each
/// other.
#[derive(Clone)]
pub(super) struct Spectral {
    samples: usize,
    length: f64,
    /// What passes of each line, over the number of lines.
    gains: Vec<f64>,
    there: Forward,
    back: Inverse,
}

impl fmt::Debug for Spectral {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Spectral").field("samples", &self.samples).field("length", &self.length).finish_non_exhaustive()
    }
}

impl Spectral {
    /// The low-pass of records of `samples` (at least 3) that lets half the amplitude of `length` samples a period through.
    pub(super) fn new(samples: usize, length: f64) -> Self {
        let count = round(samples, length);
        let half = length.recip();
        let gain = |k: usize| {
            let frequency = k as f64 / count as f64;
            0.5 * erfc((frequency - half) / (ROLL_OFF * half)) / count as f64
        };
        Self {
            samples,
            length,
            gains: (0..=count / 2).map(gain).collect(),
            there: sindyscope_fourier::forward(count),
            back: sindyscope_fourier::inverse(count),
        }
    }

    /// Samples smoothed.
    pub(super) fn smooth(&self, samples: &[f64]) -> Vec<f64> {
        self.apply(samples, false)
    }

    /// The derivative of the smoothed samples, per sample.
    pub(super) fn slope(&self, samples: &[f64]) -> Vec<f64> {
        self.apply(samples, true)
    }

    fn apply(&self, samples: &[f64], derived: bool) -> Vec<f64> {
        let count = self.there.len();
        let Around { mut values, first, slope } = Around::new(samples, self.length, count);
        let mut lines = self.there.make_output_vec();
        if self.there.process(&mut values, &mut lines).is_err() {
            return samples.to_vec();
        }
        for (k, (line, gain)) in lines.iter_mut().zip(&self.gains).enumerate() {
            *line *= if derived {
                Complex::new(0.0, gain * TAU * k as f64 / count as f64)
            } else {
                Complex::new(*gain, 0.0)
            };
        }
        // A real signal's slope at half the sampling rate cannot be told.
        let last = lines.len() - 1;
        for end in [0, last] {
            lines[end].im = 0.0;
        }
        if self.back.process(&mut lines, &mut values).is_err() {
            return samples.to_vec();
        }
        values.truncate(samples.len());
        for (k, value) in values.iter_mut().enumerate() {
            *value += if derived { slope } else { first + slope * k as f64 };
        }
        values
    }
}

/// Samples of a record with its continuation: an even number whose transform is fast.
fn round(samples: usize, length: f64) -> usize {
    2 * fast_length((samples + ((MAX_CONTINUATION * length) as usize).clamp(8, samples.max(8))).div_ceil(2))
}

/// A record closed to a period.
struct Around {
    values: Vec<f64>,
    /// The line through the ends.
    first: f64,
    slope: f64,
}

impl Around {
    fn new(samples: &[f64], length: f64, count: usize) -> Self {
        let n = samples.len();
        let reach = ((length as usize) | 1).clamp(5, n.max(5));
        let end = |segment: &[f64], place: usize| SavitzkyGolay::new(reach, 2).apply(segment, 1.0, 0)[place];
        let head = &samples[..reach.min(n)];
        let tail = &samples[n - reach.min(n)..];
        let (first, last) = (end(head, 0), end(tail, tail.len() - 1));
        let slope = (last - first) / (n - 1) as f64;
        let mut values: Vec<f64> = samples.iter().enumerate().map(|(k, y)| y - first - slope * k as f64).collect();
        let gap = count - n;
        for j in 1..=gap {
            let share = j as f64 / (gap + 1) as f64;
            let fade = 0.5 + 0.5 * (0.5 * TAU * share).cos();
            let after = -values[(n - 1).saturating_sub(j)];
            let before = -values[(gap + 1 - j).min(n - 1)];
            values.push(fade * after + (1.0 - fade) * before);
        }
        Self { values, first, slope }
    }
}

/// The length in samples below which the spectrum of a record with noise of this standard deviation holds nothing but
/// noise: the low-pass of least expected error of the velocity (Mallows 1973).
pub(super) fn noise_edge(samples: &[f64], noise: f64) -> f64 {
    let count = round(samples.len(), 5.0);
    let mut values = Around::new(samples, 5.0, count).values;
    let transform = sindyscope_fourier::forward(count);
    let mut lines = transform.make_output_vec();
    if transform.process(&mut values, &mut lines).is_err() {
        return 3.0;
    }
    let floor = 2.0 * noise * noise * count as f64;
    let (mut risk, mut least, mut edge) = (0.0, 0.0, 1);
    for (k, line) in lines.iter().enumerate().skip(1) {
        risk += (k * k) as f64 * (floor - line.norm_sqr());
        if risk < least {
            (least, edge) = (risk, k);
        }
    }
    // The last line that counts lies where the low-pass has not begun to fall.
    0.6 * count as f64 / edge as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_passes_to_ten_digits_away_from_the_ends() {
        let n = 4001;
        // Whole periods and not, an offset and a drift.
        for period in [80.0, 91.3] {
            let y: Vec<f64> = (0..n).map(|k| 2.0 + 1e-3 * k as f64 + (TAU * k as f64 / period).sin()).collect();
            let (x, v) = (Spectral::new(n, 10.0).smooth(&y), Spectral::new(n, 10.0).slope(&y));
            for k in 200..n - 200 {
                let slope = 1e-3 + TAU / period * (TAU * k as f64 / period).cos();
                assert!((x[k] - y[k]).abs() < 1e-10, "{period} {k}: {}", x[k] - y[k]);
                assert!((v[k] - slope).abs() < 1e-10, "{period} {k}: {}", v[k] - slope);
            }
        }
    }

    #[test]
    fn what_is_faster_does_not_pass_and_half_of_its_length_does() {
        let n = 3000;
        let tone = |period: f64| -> Vec<f64> { (0..n).map(|k| (TAU * f64::from(k) / period).sin()).collect() };
        assert!(Spectral::new(3000, 20.0).smooth(&tone(9.0))[300..2700].iter().all(|x| x.abs() < 1e-9));
        let (half, y) = (Spectral::new(3000, 20.0).smooth(&tone(20.0)), tone(20.0));
        assert!((1000..2000).all(|k| (half[k] - 0.5 * y[k]).abs() < 1e-3));
    }
}
