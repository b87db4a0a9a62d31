//! Where a measured motion stands still.

use std::collections::VecDeque;
use std::ops::Range;

use super::{mean_and_variance, rms};

/// Width of the band that a motion at rest stays in, in standard deviations of its noise: a thousand samples of white noise
/// span 6.5 of them.
const BAND_IN_DEVIATIONS: f64 = 8.0;
/// Bend of the motion within half of the shortest standstill, in standard deviations of its noise, from which on staying in
/// the band means standing and not turning.
const MIN_BEND: f64 = 5.0 * BAND_IN_DEVIATIONS;
/// Shortest standstill, as a share of the main period: a smooth motion may dwell for less.
const MIN_PERIODS: f64 = 0.05;
/// Shortest standstill, samples.
const MIN_SAMPLES: usize = 5;

/// The stretches in which a motion stands still as far as its noise lets one see, longest as they can be, in order.
///
/// `noise` is the standard deviation of the motion's noise, `period` its main period in samples. None where the noise would
/// hide a turn within a quarter of a period.
pub(crate) fn standstills(motion: &[f64], noise: f64, period: f64) -> Vec<Range<usize>> {
    shortest_standstill(motion, noise, period).map_or_else(Vec::new, |least| standstills_from(motion, noise, least))
}

/// Samples of the shortest standstill that a motion as lively as this one lets one tell from a turn; none where its noise would
/// hide a turn within a quarter of a period.
///
/// `noise` is the standard deviation of the motion's noise, `period` its main period in samples.
pub(crate) fn shortest_standstill(motion: &[f64], noise: f64, period: f64) -> Option<usize> {
    half_length(motion, at_least_rounding(motion, noise), period).map(|half| shortest(half, period))
}

/// The stretches of at least `least` samples in which a motion stands still as far as its noise lets one see, in order: for a piece
/// of a longer motion, which tells what is shortest.
pub(crate) fn standstills_from(motion: &[f64], noise: f64, least: usize) -> Vec<Range<usize>> {
    in_band(motion, at_least_rounding(motion, noise), least)
}

/// The stretches in which a motion rests, in order: in which it stays in the band of its noise for longer than it dwells at a
/// turn, or, where the noise would hide a turn, for a whole period.
///
/// `noise` is the standard deviation of the motion's noise, `period` its main period in samples.
pub fn rests(motion: &[f64], noise: f64, period: f64) -> Vec<Range<usize>> {
    let noise = at_least_rounding(motion, noise);
    let fewest = half_length(motion, noise, period).map_or(period.ceil() as usize, |half| shortest(half, period));
    in_band(motion, noise, fewest.max(MIN_SAMPLES))
}

/// In clean data what is left is the arithmetic's.
fn at_least_rounding(motion: &[f64], noise: f64) -> f64 {
    noise.max(1e-9 * mean_and_variance(motion).1.sqrt())
}

/// Samples of the shortest standstill that can be told.
fn shortest(half: usize, period: f64) -> usize {
    ((MIN_PERIODS * period) as usize).max(MIN_SAMPLES).max(2 * half + 1)
}

/// The stretches of at least `fewest` samples that stay in the noise's band.
fn in_band(motion: &[f64], noise: f64, fewest: usize) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    // Samples of the window that may become its largest and smallest, best first.
    let (mut high, mut low): (VecDeque<usize>, VecDeque<usize>) = (VecDeque::new(), VecDeque::new());
    let mut from = 0;
    for to in 0..motion.len() {
        while high.back().is_some_and(|k| motion[*k] <= motion[to]) {
            high.pop_back();
        }
        while low.back().is_some_and(|k| motion[*k] >= motion[to]) {
            low.pop_back();
        }
        high.push_back(to);
        low.push_back(to);
        while let (Some(h), Some(l)) = (high.front(), low.front())
            && motion[*h] - motion[*l] > BAND_IN_DEVIATIONS * noise
        {
            from += 1;
            high.pop_front_if(|k| *k < from);
            low.pop_front_if(|k| *k < from);
        }
        if to + 1 - from >= fewest {
            match found.last_mut() {
                Some(last) if last.end >= from => last.end = to + 1,
                _ => found.push(from..to + 1),
            }
        }
    }
    found
}

/// Samples in which a motion as lively as the record's bends away far enough; none if it takes a quarter of a period.
fn half_length(motion: &[f64], noise: f64, period: f64) -> Option<usize> {
    let longest = ((period / 4.0) as usize).min(motion.len() / 4);
    let bends = |half: usize| {
        let seconds: Vec<f64> = motion.windows(2 * half + 1).map(|w| w[0] - 2.0 * w[half] + w[2 * half]).collect();
        0.5 * rms(&seconds) > MIN_BEND * noise
    };
    // Lengths grow by a quarter at a time: no finer answer is needed.
    let mut half = 1;
    while half <= longest {
        if bends(half) {
            return Some(half);
        }
        half += 1 + half / 4;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    const PERIOD: f64 = 100.0;

    /// A cosine that stands for 30 samples at each turn.
    fn dwelling(noise: f64, count: usize) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
        let position = |k: usize| {
            let phase = (k % 100) as f64;
            let turn = |s: f64| (std::f64::consts::PI * s / 35.0).cos();
            match phase {
                p if p < 35.0 => turn(p),
                p if p < 50.0 => -1.0,
                p if p < 85.0 => -turn(p - 50.0),
                _ => 1.0,
            }
        };
        (0..count)
            .map(|k| {
                let deviate: f64 = StandardNormal.sample(&mut rng);
                position(k) + noise * deviate
            })
            .collect()
    }

    #[test]
    fn standing_is_found_with_and_without_noise() {
        for noise in [0.0, 1e-6, 1e-3] {
            let found = standstills(&dwelling(noise, 1000), noise, PERIOD);
            assert_eq!(found.len(), 20, "{noise}: {found:?}");
            let total: usize = found.iter().map(Range::len).sum();
            // The motion leaves rest slowly: the more noise, the longer it seems to stand.
            assert!((300..520).contains(&total), "{noise}: {total}");
        }
    }

    #[test]
    fn a_smooth_motion_never_stands() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        for noise in [0.0, 1e-4, 1e-2, 0.1] {
            let motion: Vec<f64> = (0..4000)
                .map(|k| {
                    let deviate: f64 = StandardNormal.sample(&mut rng);
                    let phase = std::f64::consts::TAU * f64::from(k) / PERIOD;
                    phase.sin() + 0.4 * (1.7 * phase).cos() + noise * deviate
                })
                .collect();
            let stood: usize = standstills(&motion, noise, PERIOD).iter().map(Range::len).sum();
            assert!(stood < 40, "{noise}: {stood}");
        }
    }

    #[test]
    fn a_rest_that_lasts_stands_however_noisy() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let noise = 0.03;
        let motion: Vec<f64> = (0..2000)
            .map(|k| {
                let deviate: f64 = StandardNormal.sample(&mut rng);
                let left = (1.0 - f64::from(k) / 300.0).max(0.0);
                left * (std::f64::consts::TAU * f64::from(k) / PERIOD).cos() + noise * deviate
            })
            .collect();
        let found = rests(&motion, noise, PERIOD);
        let last = found.last().unwrap();
        assert!(last.end == motion.len() && (200..400).contains(&last.start), "{found:?}");
        assert!(found.iter().rev().skip(1).all(|r| r.start > 200), "{found:?}");
    }

    #[test]
    fn what_is_no_number_ends_no_search() {
        assert!(standstills(&[], 0.0, PERIOD).is_empty());
        assert!(standstills(&[f64::NAN; 50], f64::NAN, PERIOD).is_empty());
        assert!(standstills(&[1.0; 3], 0.0, f64::INFINITY).is_empty());
    }
}
