//! Samples that stand out from those around them, found and mended.

use super::bridge;
use crate::signal;

/// Samples on either side that a sample is compared with.
const NEIGHBOURS: usize = 5;

/// Longest spike, samples; a longer one is an event of the motion and stays.
const MAX_SPIKE_SAMPLES: usize = 3;

/// Standard deviation of a normal distribution over its median absolute deviation.
const DEVIATION_OVER_MAD: f64 = 1.4826;

/// A second difference beyond this many usual ones is looked at closely.
const SUSPICIOUS_DIFFERENCE: f64 = 3.0;

/// Values without spikes, and how many samples were mended.
///
/// A sample stands out where it is further from the median of the eleven around it than `threshold` times their median
/// absolute deviation as a standard deviation (Hampel, J. Am. Stat. Assoc. 69 (1974) 383–393), all measured from a line whose
/// slope is the median of the slopes between them (Theil and Sen), since a motion rises and falls between its samples; and
/// further than as many times the series' usual step, so that neither a turning point nor a change of level counts. It is
/// filled in from what lies beside it.
pub(super) fn mend(values: &[f64], threshold: f64) -> (Vec<f64>, usize) {
    let mut mended = values.to_vec();
    let steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    // Of a series that mostly rests the median step is nothing; of one that jumps all the time the mean step is all.
    let least = 0.5 * median(steps).max(mean);
    let bends: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    let usual = SUSPICIOUS_DIFFERENCE * median(bends.clone());
    // The bend at a sample stands one place before it.
    let suspicious = |i: usize| {
        let near = i.saturating_sub(2).min(bends.len())..(i + 1).min(bends.len());
        bends[near].iter().any(|bend| *bend > usual)
    };
    let stands_out = |i: usize| {
        if !suspicious(i) {
            return false;
        }
        let first = i.saturating_sub(NEIGHBOURS);
        let around = &values[first..(i + NEIGHBOURS + 1).min(values.len())];
        let pairs = (0..around.len()).flat_map(|k| (0..k).map(move |j| (j, k)));
        let slope = median(pairs.map(|(j, k)| (around[k] - around[j]) / (k - j) as f64).collect());
        let level: Vec<f64> = around.iter().enumerate().map(|(k, v)| v - slope * (first + k) as f64).collect();
        let own = level[i - first];
        let centre = median(level.clone());
        let spread = DEVIATION_OVER_MAD * median(level.iter().map(|v| (v - centre).abs()).collect());
        (own - centre).abs() > threshold * spread.max(least)
    };
    let mut count = 0;
    let mut i = 0;
    while i < values.len() {
        let run = (i..values.len()).take_while(|k| stands_out(*k)).count();
        if (1..=MAX_SPIKE_SAMPLES).contains(&run) {
            let filled = bridge::fill(&mended[..i], &values[i + run..], run);
            mended[i..i + run].copy_from_slice(&filled);
            count += run;
        }
        i += run.max(1);
    }
    (mended, count)
}

fn median(values: Vec<f64>) -> f64 {
    signal::median(values).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn motion() -> Vec<f64> {
        let noise = |i: u32| 0.01 * ((f64::from(i) * 78.233).sin() * 12543.123).fract();
        (0..2000).map(|i| (TAU * f64::from(i) / 60.0).sin() + noise(i)).collect()
    }

    #[test]
    fn spikes_go_and_the_motion_stays_to_the_bit() {
        let clean = motion();
        let mut spiked = clean.clone();
        for (at, by) in [(7, 3.0), (500, -2.0), (501, -2.5), (1234, 0.9), (1999, 4.0)] {
            spiked[at] += by;
        }
        let (mended, count) = mend(&spiked, 6.0);
        assert_eq!(count, 5);
        for (i, (mended, clean)) in mended.iter().zip(&clean).enumerate() {
            let allowed = if spiked[i] == *clean { 0.0 } else { 0.1 };
            assert!((mended - clean).abs() <= allowed, "{i}: {mended} for {clean}");
        }
    }

    #[test]
    fn a_motion_a_square_wave_and_noise_have_no_spikes() {
        assert_eq!(mend(&motion(), 6.0).1, 0);
        let square: Vec<f64> = (0..600).map(|i| f64::from((i / 40) % 2)).collect();
        assert_eq!(mend(&square, 6.0).1, 0);
        let noise: Vec<f64> = (0..5000).map(|i| ((f64::from(i) * 12.9898).sin() * 43758.5453).fract()).collect();
        assert_eq!(mend(&noise, 6.0).1, 0);
        let blow: Vec<f64> = (0..200).map(|i| if (80..86).contains(&i) { 1.0 } else { 0.0 }).collect();
        assert_eq!(mend(&blow, 6.0).1, 0, "a blow of six samples is an event");
    }

    #[test]
    fn what_is_short_or_constant_stays() {
        for values in [vec![], vec![1.0], vec![2.0; 50]] {
            assert_eq!(mend(&values, 6.0), (values, 0));
        }
    }
}
