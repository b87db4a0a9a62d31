//! How noisy a channel is, without a model.

use std::f64::consts::{LN_2, PI};

use super::rms;
use super::spectrum::fast_length;

/// Fewest samples of which a spectrum is cut into bands: shorter records have too few lines in each.
const MIN_SAMPLES: usize = 128;
/// Bands of the spectrum, at most.
const MAX_BANDS: usize = 32;
/// Samples of the record for each band, at least.
const MIN_SAMPLES_A_BAND: usize = 16;
/// A band with this many times the power of the quiet ones holds motion.
const MOTION_OVER_QUIET: f64 = 10.0;
/// Where differences find less than this share of the noise that the spectrum shows, the noise is not white, and the spectrum's answer counts.
const MIN_WHITE_SHARE: f64 = 0.8;
/// Where the median of the differences finds less than this share of what their RMS finds, they are no noise's.
const JUMPS_SHARE: f64 = 0.5;
/// Median of the absolute value of a standard normal variable.
const NORMAL_MEDIAN: f64 = 0.674_489_750_196_081_7;
/// Distinct levels from which on steps are taken for a converter's; fewer are a signal that is made in steps.
const MIN_LEVELS: usize = 16;
/// Samples at each of a converter's levels on average, at least.
const MIN_SAMPLES_A_LEVEL: usize = 4;

/// Standard deviation of the noise in evenly sampled data, white or not; none below 20 samples.
///
/// The spectrum is cut into bands, and each band's floor is the median of its lines, so that the sharp lines of a periodic
/// motion do not count. The quarter of the bands that is quietest shows the level of the noise; bands ten times as strong
/// hold motion, and are taken to be as noisy as the nearest that hold none. The variance is the floor's mean: noise that a
/// filter has taken out of part of the spectrum is not counted there, nor is it taken for the whole. Values in whole steps
/// have at least the error of rounding.
pub fn standard_deviation(samples: &[f64]) -> Option<f64> {
    let differences = by_differences(samples, rms)?;
    Some(told(samples, differences).max(rounding(samples)))
}

/// The same of a velocity or an acceleration, which jumps or has corners where dry friction turns or a contact closes: that is
/// felt at every frequency, but in few differences. Where most of them say less than half of what all do, noise is what most say.
pub fn standard_deviation_beside_jumps(samples: &[f64]) -> Option<f64> {
    let differences = by_differences(samples, rms)?;
    let share = by_differences(samples, of_most)? / differences;
    // Where most samples repeat, as those of a coarse sensor at rest, they say nothing of noise.
    let noise = if share > 0.0 && share < JUMPS_SHARE { share } else { 1.0 };
    Some((noise * told(samples, differences)).max(rounding(samples)))
}

/// What the spectrum says, but of white noise what the differences do: they agree on it alone, and there have the least motion left in
/// them.
fn told(samples: &[f64], differences: f64) -> f64 {
    let floor = if samples.len() < MIN_SAMPLES { None } else { by_floor(samples) };
    match floor {
        Some(floor) if differences > floor || differences < MIN_WHITE_SHARE * floor => floor,
        _ => differences,
    }
}

/// An error that is uniform between two of a converter's steps; zero where there are none.
fn rounding(samples: &[f64]) -> f64 {
    quantisation_step(samples, MIN_LEVELS, MIN_SAMPLES_A_LEVEL).map_or(0.0, |step| step / 12f64.sqrt())
}

/// The mean of the spectrum's floor, by bands.
fn by_floor(samples: &[f64]) -> Option<f64> {
    let n = samples.len();
    let mean = samples.iter().sum::<f64>() / n as f64;
    let length = fast_length(n);
    let transform = sindyscope_fourier::forward(length);
    let mut windowed = transform.make_input_vec();
    let mut weights = 0.0;
    for (k, (slot, value)) in windowed.iter_mut().zip(samples).enumerate() {
        // Its leakage falls with the seventh power of the distance: a motion a million times the noise stays in its place.
        let weight = (PI * k as f64 / n as f64).sin().powi(6);
        weights += weight * weight;
        *slot = weight * (value - mean);
    }
    let mut lines = transform.make_output_vec();
    transform.process(&mut windowed, &mut lines).ok()?;
    let lines: Vec<f64> = lines[1..].iter().map(|line| line.norm_sqr() / weights).collect();
    let count = (n / MIN_SAMPLES_A_BAND).min(MAX_BANDS);
    let floor = |band: usize| {
        let mut of_band = lines[band * lines.len() / count..(band + 1) * lines.len() / count].to_vec();
        let middle = of_band.len() / 2;
        // Lines of noise are exponentially distributed: their median is ln 2 of their mean.
        *of_band.select_nth_unstable_by(middle, f64::total_cmp).1 / LN_2
    };
    let floors: Vec<f64> = (0..count).map(floor).collect();
    let mut sorted = floors.clone();
    let quiet = *sorted.select_nth_unstable_by(count / 4, f64::total_cmp).1;
    let clean: Vec<usize> = (0..count).filter(|&b| floors[b] <= MOTION_OVER_QUIET * quiet).collect();
    let beside = |band: usize| {
        let mut nearest = clean.clone();
        nearest.sort_by_key(|b| b.abs_diff(band));
        let mut three: Vec<f64> = nearest.iter().take(3).map(|b| floors[*b]).collect();
        three.sort_unstable_by(f64::total_cmp);
        three[three.len() / 2]
    };
    let level = |band: usize| if floors[band] <= MOTION_OVER_QUIET * quiet { floors[band] } else { beside(band) };
    let variance = (0..count).map(level).sum::<f64>() / count as f64;
    variance.is_finite().then(|| variance.sqrt())
}

/// The step that samples are whole multiples of, if they take so many values at least, and each is met so often on average: few
/// enough to tell.
pub fn quantisation_step(samples: &[f64], values: usize, often: usize) -> Option<f64> {
    let mut levels = samples.to_vec();
    levels.sort_unstable_by(f64::total_cmp);
    let reach = levels.last()? - levels.first()?;
    levels.dedup_by(|a, b| (*a - *b).abs() < 1e-9 * reach);
    if levels.len() < values || often * levels.len() > samples.len() {
        return None;
    }
    let step = levels.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let whole = |v: &f64| {
        let steps = (v - levels[0]) / step;
        (steps - steps.round()).abs() < 1e-3 * steps.max(1.0)
    };
    levels.iter().all(whole).then_some(step)
}

/// Of white noise, and for records too short for a spectrum: differences of rising order take the smooth motion away and keep white noise,
/// whose variance order `d` multiplies by the binomial coefficient `C(2d, d)` (von Neumann 1941; Gasser, Sroka &
/// Jennen-Steinmetz 1986); the smallest estimate is the one with the least motion left in it. None below 20 samples.
fn by_differences(samples: &[f64], size: impl Fn(&[f64]) -> f64) -> Option<f64> {
    const ORDERS: std::ops::RangeInclusive<usize> = 2..=10;
    if samples.len() < 2 * ORDERS.end() {
        return None;
    }
    let mut differences = samples.to_vec();
    let mut gain = 1.0;
    let mut best = f64::INFINITY;
    for order in 1..=*ORDERS.end() {
        let left = differences.len() - 1;
        for k in 0..left {
            differences[k] = differences[k + 1] - differences[k];
        }
        differences.truncate(left);
        let d = order as f64;
        gain *= 2.0 * (2.0 * d - 1.0) / d;
        if ORDERS.contains(&order) {
            best = best.min(size(&differences) / gain.sqrt());
        }
    }
    best.is_finite().then_some(best)
}

/// The standard deviation of normal values of which a few may be others.
fn of_most(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|v| v.abs()).collect();
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / NORMAL_MEDIAN
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    /// A motion of amplitude 1 with the third and fifth harmonic of a nonlinear one.
    fn motion(samples: usize, a_period: f64) -> Vec<f64> {
        let wave = |phase: f64| phase.sin() + 0.1 * (3.0 * phase + 0.4).sin() + 0.03 * (5.0 * phase + 1.0).sin();
        (0..samples).map(|k| wave(2.0 * PI * k as f64 / a_period)).collect()
    }

    fn white(samples: usize, seed: u64) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        (0..samples).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    fn scaled(mut noise: Vec<f64>, deviation: f64) -> Vec<f64> {
        let size = rms(&noise);
        noise.iter_mut().for_each(|v| *v *= deviation / size);
        noise
    }

    #[test]
    fn noise_is_told_from_jumps_that_few_samples_see() {
        for (a_period, level) in [(25.0, 0.01), (45.0, 0.01), (45.0, 0.003)] {
            // A sweep: the lines of a periodic motion would be told from noise in the spectrum.
            let phase = |k: usize| 2.0 * PI * k as f64 / a_period * (0.7 + 0.3 * k as f64 / 1900.0);
            let seen = |jump: f64| -> Vec<f64> {
                let of = |(k, e): (usize, f64)| phase(k).sin() - jump * phase(k).cos().signum() + level * e;
                white(1900, 3).into_iter().enumerate().map(of).collect()
            };
            let told = standard_deviation(&seen(0.3)).unwrap() / level;
            let found = standard_deviation_beside_jumps(&seen(0.3)).unwrap() / level;
            assert!(told > 3.0 && (0.5..2.0).contains(&found), "{a_period} samples: {told}, {found} times the noise");
            assert_eq!(standard_deviation_beside_jumps(&seen(0.0)), standard_deviation(&seen(0.0)));
        }
        // A coarse sensor that mostly stands still shows no less than it did.
        let coarse: Vec<f64> = (0..2000).map(|k| if k % 40 == 0 { f64::from(k % 17) } else { 0.0 }).collect();
        assert_eq!(standard_deviation_beside_jumps(&coarse), standard_deviation(&coarse));
    }

    fn found(motion: &[f64], noise: &[f64]) -> f64 {
        standard_deviation(&motion.iter().zip(noise).map(|(m, e)| m + e).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn white_noise_is_found_at_any_sampling() {
        for a_period in [12.0, 17.3, 40.0, 150.0] {
            for samples in [600, 5000, 40_000] {
                for deviation in [1e-6, 1e-3, 0.05] {
                    let noise = scaled(white(samples, 3), deviation);
                    let share = found(&motion(samples, a_period), &noise) / deviation;
                    // Medians of some twenty lines a band, averaged over all bands, and what motion adds to one.
                    let allowed = if samples < 1000 { 0.3 } else { 0.1 };
                    assert!((share - 1.0).abs() < allowed, "{a_period} {samples} {deviation}: {share}");
                }
            }
        }
    }

    #[test]
    fn coloured_noise_counts_as_a_whole() {
        let samples = 20_000;
        let mut red = white(samples, 5);
        for k in 1..samples {
            red[k] += 0.5 * red[k - 1];
        }
        // As a sensor's filter, or thinning, leaves it: nothing in the upper fifth of the spectrum.
        let source = white(samples + 80, 7);
        let tap = |j: usize| {
            let s = j as f64 - 40.0;
            let sinc = if s == 0.0 { 1.0 } else { (0.8 * PI * s).sin() / (0.8 * PI * s) };
            sinc * (PI * (s + 41.0) / 82.0).sin().powi(2)
        };
        let limited: Vec<f64> = (0..samples).map(|k| (0..=80).map(|j| tap(j) * source[k + j]).sum()).collect();
        for (name, noise) in [("red", red), ("limited", limited)] {
            let noise = scaled(noise, 1e-3);
            for a_period in [12.0, 40.0, 150.0] {
                let share = found(&motion(samples, a_period), &noise) / 1e-3;
                assert!((share - 1.0).abs() < 0.15, "{name} {a_period}: {share}");
            }
        }
    }

    #[test]
    fn a_converter_s_steps_count_as_their_rounding() {
        for (step, a_period) in [(0.01, 150.0), (0.02, 40.0), (0.05, 63.7)] {
            let y: Vec<f64> = motion(8000, a_period).iter().map(|m| (m / step).round() * step).collect();
            let share = standard_deviation(&y).unwrap() / (step / 12f64.sqrt());
            assert!((0.999..1.3).contains(&share), "{step} {a_period}: {share}");
        }
    }

    #[test]
    fn a_signal_made_in_steps_is_clean() {
        let square: Vec<f64> = (0..4000).map(|k| if (k / 50) % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!(standard_deviation(&square).unwrap() < 0.05);
    }

    #[test]
    fn a_decaying_motion_is_not_noise() {
        let noise = scaled(white(6000, 11), 1e-4);
        let decay: Vec<f64> =
            motion(6000, 25.0).iter().enumerate().map(|(k, m)| m * (-0.002 * k as f64).exp()).collect();
        let share = found(&decay, &noise) / 1e-4;
        assert!((share - 1.0).abs() < 0.15, "{share}");
    }

    #[test]
    fn clean_motion_has_next_to_none() {
        let y: Vec<f64> = (0..5000).map(|k| (0.05 * f64::from(k)).sin()).collect();
        assert!(standard_deviation(&y).unwrap() < 1e-9);
        assert_eq!(standard_deviation(&[1.0; 10]), None);
        assert_eq!(standard_deviation(&[1.0; 200]), Some(0.0));
    }

    #[test]
    fn short_records_have_an_estimate_too() {
        let noise = scaled(white(100, 2), 0.01);
        let share = found(&motion(100, 50.0), &noise) / 0.01;
        assert!((0.6..1.4).contains(&share), "{share}");
    }
}
