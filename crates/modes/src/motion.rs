//! Displacement and velocity of a place from what its sensor shows, on a finer grid than it was sampled.

use std::f64::consts::{PI, TAU};

use sindyscope_fourier::Complex;

use super::measurement::Quantity;

/// Instants a sampling interval.
pub(crate) const PARTS: usize = 4;
/// Least share of the record that is added at either end, and periods of the slowest motion.
const PAD_SHARE: f64 = 0.1;
const PAD_PERIODS: f64 = 4.0;
/// Lines to either side over which the spectrum is averaged to tell motion from noise.
const SMOOTHED_LINES: usize = 4;

/// The band of a motion, Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Band {
    /// Where slower parts are cut off; zero for a measured displacement.
    pub(crate) low: f64,
    /// Where faster parts are cut off.
    pub(crate) high: f64,
}

/// The motion across a place, `PARTS` instants a sampling interval, the last sample the last instant.
#[derive(Clone, Debug)]
pub(crate) struct PlaceMotion {
    pub(crate) displacement: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
}

/// The motion that a series shows: by its spectrum, which is cut to the band without a phase, integrated or differentiated,
/// and drawn on the finer grid. The record is turned about its ends and faded out beyond them.
/// Lines in which the noise (its standard deviation `noise`) outweighs the motion are taken out (Wiener's filter).
pub(crate) fn reconstructed(
    series: &[f64],
    interval: f64,
    quantity: Quantity,
    band: Band,
    (slowest, noise): (f64, f64),
) -> PlaceMotion {
    let n = series.len();
    let wanted = (PAD_SHARE * n as f64).max(PAD_PERIODS / (slowest * interval));
    let pad = (wanted as usize).clamp(8, n - 1);
    let length = (n + 2 * pad).next_multiple_of(2);
    // A length of small factors only.
    let length = (length..).find(|l| smooth(*l)).unwrap_or(length);
    let mut time = vec![0.0; length];
    let mut weights = 0.0;
    for (k, slot) in time.iter_mut().enumerate() {
        let at = k as isize - pad as isize;
        let last = n as isize - 1;
        // What is integrated must bring no constant of its own.
        let turned = |end: f64, value: f64| if quantity == Quantity::Displacement { 2.0 * end - value } else { value };
        let (value, beyond) = if at < 0 {
            (turned(series[0], series[(-at) as usize]), -at)
        } else if at > last {
            let back = 2 * last - at;
            if back < 0 { (0.0, pad as isize) } else { (turned(series[n - 1], series[back as usize]), at - last) }
        } else {
            (series[at as usize], 0)
        };
        let fade = (PI * (beyond as f64 / pad as f64).min(1.0)).cos() * 0.5 + 0.5;
        *slot = value * fade;
        weights += if at < -(pad as isize) || beyond >= pad as isize { 0.0 } else { fade * fade };
    }
    let forward = sindyscope_fourier::forward(length);
    let inverse = sindyscope_fourier::inverse(length * PARTS);
    let mut lines = forward.make_output_vec();
    if forward.process(&mut time, &mut lines).is_err() {
        return PlaceMotion { displacement: vec![0.0; n * PARTS], velocity: vec![0.0; n * PARTS] };
    }
    let powers: Vec<f64> = lines.iter().map(|l| l.norm_sqr()).collect();
    let shares: Vec<f64> = (0..powers.len())
        .map(|k| {
            let near = &powers[k.saturating_sub(SMOOTHED_LINES)..(k + SMOOTHED_LINES + 1).min(powers.len())];
            let power = near.iter().sum::<f64>() / near.len() as f64;
            (1.0 - noise * noise * weights / power.max(f64::MIN_POSITIVE)).max(0.0)
        })
        .collect();
    let draw = |derivative: i32| -> Vec<f64> {
        let power = derivative - quantity.derivatives();
        let mut fine = inverse.make_input_vec();
        for (k, (slot, (line, share))) in fine.iter_mut().zip(lines.iter().zip(&shares)).enumerate() {
            let frequency = k as f64 / (length as f64 * interval);
            let low = if band.low > 0.0 { 1.0 / (1.0 + (band.low / frequency.max(1e-300)).powi(4)) } else { 1.0 };
            // Integrated twice, twice as steep.
            let low = low.powi(if power < -1 { 2 } else { 1 });
            let high = 1.0 / (1.0 + (frequency / band.high).powi(12));
            let turned = if k == 0 && power != 0 {
                Complex::new(0.0, 0.0)
            } else {
                Complex::new(0.0, TAU * frequency).powi(power)
            };
            *slot = line * turned * (low * high * share / length as f64);
        }
        if let Some(first) = fine.first_mut() {
            first.im = 0.0;
        }
        let mut out = inverse.make_output_vec();
        // A line that must be real is made so above; nothing else can be refused.
        let _ = inverse.process(&mut fine, &mut out);
        out[pad * PARTS..=(pad + n - 1) * PARTS].to_vec()
    };
    PlaceMotion { displacement: draw(0), velocity: draw(1) }
}

fn smooth(mut n: usize) -> bool {
    for factor in [2, 3, 5, 7] {
        while n.is_multiple_of(factor) {
            n /= factor;
        }
    }
    n == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From each quantity of a known motion the same displacement and velocity come back.
    #[test]
    fn motions_come_back_from_any_quantity() {
        let (interval, n) = (0.02, 2000);
        let tones = [(1.3, 1.0, 0.4), (4.1, 0.3, 1.9)];
        let at = |t: f64, derivative: usize| -> f64 {
            let turn = 0.5 * PI * derivative as f64;
            tones.iter().map(|(f, a, p)| a * (TAU * f).powi(derivative as i32) * (TAU * f * t + p + turn).sin()).sum()
        };
        for (k, quantity) in
            [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration].into_iter().enumerate()
        {
            let series: Vec<f64> = (0..n).map(|i| at(i as f64 * interval, k)).collect();
            let low = if k == 0 { 0.0 } else { 0.2 };
            let motion = reconstructed(&series, interval, quantity, Band { low, high: 9.0 }, (1.3, 0.0));
            assert_eq!(motion.displacement.len(), (n - 1) * PARTS + 1);
            for i in (n / 4) * PARTS..(3 * n / 4) * PARTS {
                let t = i as f64 * interval / PARTS as f64;
                let error = (motion.displacement[i] - at(t, 0)).abs();
                assert!(error < 0.02, "{quantity:?} {i}: {error}");
                assert!((motion.velocity[i] - at(t, 1)).abs() < 0.02 * 16.0, "{quantity:?} {i}");
            }
        }
    }
}
