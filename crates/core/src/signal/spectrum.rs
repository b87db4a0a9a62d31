//! Amplitude spectra of evenly sampled signals.

use std::f64::consts::TAU;

use super::mean_and_variance;

/// Fewest samples that have a spectrum.
const MIN_SAMPLES: usize = 8;

/// Lines on either side of zero frequency into which the Hann window spreads a constant.
const MAIN_LOBE: usize = 2;

/// One-sided amplitude spectrum: a sine of amplitude A that fits the record peaks at A.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    /// Distance between lines, Hz.
    pub step: f64,
    /// Amplitude of each line in the signal's unit; the first is the mean's magnitude.
    pub amplitudes: Vec<f64>,
}

/// The main line of a spectrum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Frequency, Hz.
    pub frequency: f64,
    /// Amplitude, in the signal's unit.
    pub amplitude: f64,
}

impl Spectrum {
    /// The spectrum of `values` sampled every `interval` seconds: mean removed, Hann window, scaled so that amplitudes
    /// are right (2 / Σw; Harris, Proc. IEEE 66 (1978) 51–83). The signal is padded to a length whose transform is fast.
    ///
    /// None if there are fewer than eight samples, a sample is not finite, or the interval is no positive number.
    pub fn new(values: &[f64], interval: f64) -> Option<Self> {
        let n = values.len();
        if n < MIN_SAMPLES || !(interval > 0.0 && interval.is_finite()) {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n as f64;
        if !mean.is_finite() {
            return None;
        }
        let length = fast_length(n);
        let transform = sindyscope_fourier::forward(length);
        let mut windowed = transform.make_input_vec();
        let mut weight_sum = 0.0;
        for (k, (slot, value)) in windowed.iter_mut().zip(values).enumerate() {
            let weight = 0.5 - 0.5 * (TAU * k as f64 / n as f64).cos();
            weight_sum += weight;
            *slot = weight * (value - mean);
        }
        let mut lines = transform.make_output_vec();
        transform.process(&mut windowed, &mut lines).ok()?;
        let scale = 2.0 / weight_sum;
        let mut amplitudes: Vec<f64> = lines.iter().map(|line| scale * line.norm()).collect();
        amplitudes[0] = mean.abs();
        Some(Self { step: 1.0 / (length as f64 * interval), amplitudes })
    }

    /// The spectrum of the part of a record in which something moves: a window over the whole of one in which a motion dies
    /// away early would show what is at rest.
    ///
    /// None as in [`Spectrum::new`].
    pub fn of_motion(values: &[f64], interval: f64) -> Option<Self> {
        Self::new(moving(values), interval)
    }

    /// Frequency of line `index`, Hz.
    pub fn frequency(&self, index: usize) -> f64 {
        self.step * index as f64
    }

    /// The highest line but the mean.
    fn highest(&self) -> usize {
        let lines = self.amplitudes.iter().enumerate().skip(1);
        lines.max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(line, _)| line)
    }

    /// The highest line between zero and the highest frequency, placed between lines by the parabola through the
    /// logarithms of its neighbours; none if the signal is constant or its highest line is the slowest one (a drift).
    pub fn peak(&self) -> Option<Peak> {
        let a = &self.amplitudes;
        let (index, _) = (MAIN_LOBE..a.len().saturating_sub(1))
            .filter(|&k| a[k] > 0.0 && a[k] >= a[k - 1] && a[k] >= a[k + 1])
            .map(|k| (k, a[k]))
            .max_by(|p, q| p.1.total_cmp(&q.1))?;
        let (before, at, after) = (a[index - 1].ln(), a[index].ln(), a[index + 1].ln());
        let bend = before - 2.0 * at + after;
        let shift = if bend < 0.0 && bend.is_finite() { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        let height = if shift == 0.0 { at } else { at - 0.25 * (before - after) * shift };
        Some(Peak { frequency: self.step * (index as f64 + shift), amplitude: height.exp() })
    }
}

/// A line is the motion's if its power is this many times the noise's mean power.
const MOTION_OVER_NOISE: f64 = 20.0;

/// Parts that a record is cut into, at most, to find where it moves.
const MAX_PARTS: usize = 64;
/// Fewest samples of such a part.
const MIN_PART_SAMPLES: usize = 4;
/// A part whose variance is below this share of the largest one is still.
const STILL_VARIANCE: f64 = 0.01;
/// Where the moving part is a larger share of the record than this, the whole record is used.
const MAX_MOVING_SHARE: f64 = 0.5;

/// From the first to the last part of a record in which it moves, where that is less than half of it.
fn moving(mut values: &[f64]) -> &[f64] {
    loop {
        let length = values.len().div_ceil(MAX_PARTS).max(MIN_PART_SAMPLES);
        let variances: Vec<f64> = values.chunks(length).map(|part| mean_and_variance(part).1).collect();
        let bound = STILL_VARIANCE * variances.iter().copied().fold(0.0, f64::max);
        let moves = |v: &f64| *v > bound;
        let (Some(first), Some(last)) = (variances.iter().position(moves), variances.iter().rposition(moves)) else {
            return values;
        };
        let span = first * length..((last + 1) * length).min(values.len());
        if span.len() as f64 >= MAX_MOVING_SHARE * values.len() as f64 || span.len() < MIN_SAMPLES {
            return values;
        }
        values = &values[span];
    }
}

/// Ratio of the frequencies of neighbouring lines from which on the faster one begins a band of its own.
const BAND_GAP: f64 = 2.0;
/// A faster band is the motion's if its power is at least this share of that of the slower lines; below, it is left out.
const MIN_BAND_POWER: f64 = 1e-4;

/// The period of a motion, s: 2π times the RMS of its velocity over that of its acceleration, by the lines of its spectrum
/// that stand out of noise of this standard deviation.
///
/// Where a displacement wanders slowly under a faster motion, this is the period of the motion that forces make, not of the
/// wandering. A faint band far above the others is a sensor's hum, not motion. None if nothing stands out.
pub fn motion_period(series: &[&[f64]], interval: f64, noise: f64) -> Option<f64> {
    let [velocity, acceleration, _] = squares_of_rates(series, interval, noise);
    period_of(velocity, acceleration)
}

/// The period of an angle that turns over and over, s: its velocity wanders as its displacement does, so this is 2π times the RMS
/// of its acceleration over that of the acceleration's own rate. None where its spectrum's slowest line, a drift, is not the highest,
/// or it does not go through a turn.
pub fn turning_period(series: &[&[f64]], interval: f64, noise: f64) -> Option<f64> {
    let turns_over = |values: &&[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low >= TAU
            && Spectrum::of_motion(values, interval).is_some_and(|spectrum| spectrum.highest() < MAIN_LOBE)
    };
    if !series.iter().any(turns_over) {
        return None;
    }
    let [_, acceleration, rate] = squares_of_rates(series, interval, noise);
    period_of(acceleration, rate)
}

/// The period of a motion from the squares of a quantity and of its rate, s.
fn period_of(square: f64, of_rate: f64) -> Option<f64> {
    Some((square / of_rate).sqrt()).filter(|period| period.is_finite() && *period > 0.0)
}

/// Squares of a motion's velocity, acceleration and the acceleration's rate, each over its power of 2π, by the lines of its spectrum
/// that stand out of noise of this standard deviation.
fn squares_of_rates(series: &[&[f64]], interval: f64, noise: f64) -> [f64; 3] {
    let mut squares_of_rates = [0.0; 3];
    for values in series {
        let values = moving(values);
        let Some(spectrum) = Spectrum::new(values, interval) else { continue };
        // White noise of variance s² has lines of mean square 6 s²/n under a Hann window.
        let floor = MOTION_OVER_NOISE * 6.0 * noise * noise / values.len() as f64;
        let lines: Vec<(usize, f64)> = spectrum
            .amplitudes
            .iter()
            .map(|a| a * a)
            .enumerate()
            .skip(1)
            .filter(|(_, square)| *square > floor)
            .collect();
        let apart = |pair: &[(usize, f64)]| pair[1].0 as f64 > BAND_GAP * pair[0].0.max(MAIN_LOBE) as f64;
        let starts: Vec<usize> = (1..lines.len()).filter(|k| apart(&lines[k - 1..=*k])).collect();
        let mut below = 0.0;
        for (from, to) in
            std::iter::once(0).chain(starts.iter().copied()).zip(starts.iter().copied().chain([lines.len()]))
        {
            let band = &lines[from..to];
            let squares: f64 = band.iter().map(|(_, square)| square).sum();
            if squares < MIN_BAND_POWER * below {
                continue;
            }
            below += squares;
            for (k, square) in band {
                let f2 = spectrum.frequency(*k).powi(2);
                let mut rate = values.len() as f64 * square;
                for sum in &mut squares_of_rates {
                    rate *= f2;
                    *sum += rate;
                }
            }
        }
    }
    squares_of_rates
}

/// Where the period of the motion that forces make is below this share of the displacement's strongest period, the
/// displacement wanders, and the shorter period is the main one.
const MIN_FORCED_PERIOD: f64 = 0.25;

/// Factor on the power that the strongest of as many noise lines is expected to have: noise exceeds it once in ten thousand
/// records.
const CHANCE_FACTOR: f64 = 2.0;

/// The main period of a displacement whose noise has this standard deviation, s: that of its strongest line, but where a free
/// mass wanders slowly under a much faster motion that of the motion. None if it does not oscillate, or no more than its noise
/// does.
pub fn main_period(values: &[f64], interval: f64, noise: f64) -> Option<f64> {
    let peak = Spectrum::of_motion(values, interval)?.peak()?;
    // The largest of n lines of white noise under the window has a square of some 6 ln(n)/n times its variance.
    let n = values.len() as f64;
    if peak.amplitude.powi(2) < CHANCE_FACTOR * 6.0 * n.ln() / n * noise * noise {
        return None;
    }
    let strongest = peak.frequency.recip();
    let motion = motion_period(&[values], interval, noise).filter(|p| *p < MIN_FORCED_PERIOD * strongest);
    Some(motion.unwrap_or(strongest))
}

/// The smallest number from `n` up with no prime factor but 2, 3 and 5.
pub(super) fn fast_length(n: usize) -> usize {
    let mut best = n.next_power_of_two();
    let mut fives = 1;
    while fives < best {
        let mut odd = fives;
        while odd < best {
            let twos = n.div_ceil(odd).next_power_of_two();
            best = best.min(odd * twos);
            odd *= 3;
        }
        fives *= 5;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    fn tone(n: usize, interval: f64, frequency: f64, amplitude: f64) -> Vec<f64> {
        (0..n).map(|k| amplitude * (TAU * frequency * interval * k as f64 + 0.3).sin()).collect()
    }

    #[test]
    fn a_decay_that_is_over_early_has_its_period() {
        let decay = |t: f64| if t < 1.0 { 0.02 * (1.0 - t) * (TAU * 6.0 * t).cos() } else { 1e-4 };
        let noise = |k: usize| 1e-5 * ((k * 7919 % 1009) as f64 / 504.5 - 1.0);
        let values: Vec<f64> = (0..4000).map(|k| decay(5e-3 * k as f64) + noise(k)).collect();
        for period in [main_period(&values, 5e-3, 1e-5), motion_period(&[&values], 5e-3, 1e-5)] {
            assert!((period.unwrap() - 1.0 / 6.0).abs() < 0.1 / 6.0, "{period:?}");
        }
    }

    #[test]
    fn noise_alone_has_no_period_and_a_tone_beneath_it_has() {
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        let mut deviate = || -> f64 { StandardNormal.sample(&mut random) };
        for _ in 0..100 {
            let values: Vec<f64> = (0..1500).map(|_| 1e-3 * deviate()).collect();
            assert_eq!(main_period(&values, 1e-2, 1e-3), None);
        }
        let values: Vec<f64> = (0..1500).map(|_| 1e-3 * deviate()).collect();
        let beneath: Vec<f64> = tone(1500, 1e-2, 5.0, 5e-4).iter().zip(&values).map(|(x, e)| x + e).collect();
        assert!((main_period(&beneath, 1e-2, 1e-3).unwrap() * 5.0 - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_tone_peaks_at_its_amplitude_and_frequency() {
        for (n, frequency) in [(1000, 5.0), (1013, 5.37), (4096, 12.0421), (20_000, 2.013)] {
            let peak = Spectrum::new(&tone(n, 1e-2, frequency, 0.25), 1e-2).unwrap().peak().unwrap();
            // The parabola errs by up to 1.6 % of a line in frequency and 2.6 % in amplitude for the Hann window.
            assert!((peak.frequency - frequency).abs() < 0.02 / (n as f64 * 1e-2), "{n}: {peak:?}");
            assert!((peak.amplitude - 0.25).abs() < 0.03 * 0.25, "{n}: {peak:?}");
        }
    }

    #[test]
    fn the_period_of_a_motion_is_that_of_its_accelerations_not_of_its_wandering() {
        let slow = tone(4000, 1e-2, 0.1, 1.0);
        let fast = tone(4000, 1e-2, 1.5, 0.3);
        let sum: Vec<f64> = slow.iter().zip(&fast).map(|(a, b)| a + b).collect();
        let period = motion_period(&[&sum], 1e-2, 1e-4).unwrap();
        // (0.1² + 0.3² 15²) / (0.1⁴ + ...) is that of the fast tone to a part in a thousand.
        assert!((period * 1.5 - 1.0).abs() < 0.03, "{period}");
        assert_eq!(motion_period(&[&[0.0; 100]], 1e-2, 1.0), None);
    }

    #[test]
    fn a_constant_is_the_line_at_zero_and_no_peak() {
        let spectrum = Spectrum::new(&[-2.0; 64], 0.1).unwrap();
        assert_eq!(spectrum.amplitudes[0], 2.0);
        assert!(spectrum.amplitudes[1..].iter().all(|a| *a < 1e-12));
        assert_eq!(Spectrum::new(&[0.0; 64], 0.1).unwrap().peak(), None);
    }

    #[test]
    fn an_offset_does_not_hide_the_tone() {
        let values: Vec<f64> = tone(2000, 1e-3, 20.0, 1e-3).iter().map(|v| v + 5.0).collect();
        let peak = Spectrum::new(&values, 1e-3).unwrap().peak().unwrap();
        assert!((peak.frequency - 20.0).abs() < 0.01, "{peak:?}");
    }

    #[test]
    fn the_stronger_of_two_tones_is_the_peak() {
        let sum: Vec<f64> =
            tone(4000, 1e-2, 3.0, 1.0).iter().zip(tone(4000, 1e-2, 9.0, 0.4)).map(|(a, b)| a + b).collect();
        let spectrum = Spectrum::new(&sum, 1e-2).unwrap();
        assert!((spectrum.peak().unwrap().frequency - 3.0).abs() < 1e-3);
        let second = (9.0 / spectrum.step).round() as usize;
        assert!((spectrum.amplitudes[second] - 0.4).abs() < 0.01);
    }

    #[test]
    fn an_angle_that_turns_over_has_the_period_of_its_turns() {
        // It rests, then makes a turn a second.
        let angle: Vec<f64> = (0..6000)
            .map(|k| {
                let turning = TAU * (1e-2 * k as f64 - 5.0).max(0.0);
                turning + 0.2 * turning.sin()
            })
            .collect();
        assert!((turning_period(&[&angle], 1e-2, 1e-4).unwrap() - 1.0).abs() < 0.05);
        assert!(motion_period(&[&angle], 1e-2, 1e-4).unwrap() > 3.0);
        // One that swings back and forth does not turn over, however far.
        assert_eq!(turning_period(&[&tone(4000, 1e-2, 0.2, 5.0)], 1e-2, 1e-4), None);
        assert_eq!(turning_period(&[&tone(4000, 1e-2, 0.01, 3.0)], 1e-2, 1e-4), None);
    }

    #[test]
    fn nothing_to_say_of_too_little_or_broken_signals() {
        assert_eq!(Spectrum::new(&[1.0; 7], 0.1), None);
        assert_eq!(Spectrum::new(&[1.0; 70], 0.0), None);
        let mut values = vec![0.0; 70];
        values[3] = f64::NAN;
        assert_eq!(Spectrum::new(&values, 0.1), None);
    }

    #[test]
    fn lengths_are_fast_and_close() {
        for n in [8, 9, 11, 1013, 20_001, 999_983] {
            let length = fast_length(n);
            let mut rest = length;
            for prime in [2, 3, 5] {
                while rest.is_multiple_of(prime) {
                    rest /= prime;
                }
            }
            assert_eq!(rest, 1, "{length}");
            assert!(length >= n && length as f64 <= 1.15 * n as f64, "{n}: {length}");
        }
    }
}
