//! A band of frequencies kept, without a phase.

use std::f64::consts::PI;

/// Continuation of a record beyond its ends, in periods of the lowest corner frequency.
const CONTINUATION_PERIODS: f64 = 6.0;

/// What a Butterworth filter of order four leaves of a tone's amplitude after passing forward and back.
fn gain(frequency: f64, from: Option<f64>, to: Option<f64>) -> f64 {
    let low = to.map_or(1.0, |corner| 1.0 / (1.0 + (frequency / corner).powi(8)));
    let high =
        from.map_or(1.0, |corner| if frequency > 0.0 { 1.0 / (1.0 + (corner / frequency).powi(8)) } else { 0.0 });
    low * high
}

/// Values without what lies outside a band, Hz: half the amplitude is left at its corners. The gain is that of a fourth-order
/// Butterworth filter passed forward and back (Oppenheim and Schafer, Discrete-Time Signal Processing, 7.1 and 5.7), laid on
/// the spectrum, so no phase is turned. A band that begins above zero takes mean and trend away.
pub(super) fn filter(values: &[f64], interval: f64, band: (Option<f64>, Option<f64>)) -> Vec<f64> {
    let lowest = [band.0, band.1].into_iter().flatten().fold(f64::INFINITY, f64::min);
    weighed(values, interval, lowest, &|frequency| gain(frequency, band.0, band.1))
}

/// Factor beyond a band's ends at which [`passed`] lets nothing through.
const STOP: f64 = 1.5;

/// What lies between two frequencies, Hz, as it is, and less and less of what lies beyond them: nothing from [`STOP`] times
/// away, with a cosine over the logarithm of the frequency between. No phase is turned.
pub(super) fn passed(values: &[f64], interval: f64, (from, to): (f64, f64)) -> Vec<f64> {
    let gain = |frequency: f64| {
        let beyond = (from / frequency).max(frequency / to).ln() / STOP.ln();
        0.5 + 0.5 * (PI * beyond.clamp(0.0, 1.0)).cos()
    };
    weighed(values, interval, from, &gain)
}

/// Values whose spectrum was multiplied by a gain over the frequency, Hz; `lowest` is the lowest frequency at which it changes.
fn weighed(values: &[f64], interval: f64, lowest: f64, gain: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let n = values.len();
    if n < 2 || !lowest.is_finite() {
        return values.to_vec();
    }
    // Beyond its ends a record goes on turned about its end point: level and slope stay what they are.
    let reach = ((CONTINUATION_PERIODS / (lowest * interval)).ceil() as usize).min(n - 1);
    let (first, last) = (values[0], values[n - 1]);
    let before = (1..=reach).rev().map(|k| 2.0 * first - values[k]);
    let after = (1..=reach).map(|k| 2.0 * last - values[n - 1 - k]);
    let mut whole: Vec<f64> = before.chain(values.iter().copied()).chain(after).collect();
    // A transform joins the last sample to the first: without the line between them there is no jump.
    let count = whole.len();
    let (left, right) = (whole[0], whole[count - 1]);
    let line = |k: usize| left + (right - left) * k as f64 / (count - 1) as f64;
    whole.iter_mut().enumerate().for_each(|(k, v)| *v -= line(k));
    let (forward, back) = (sindyscope_fourier::forward(count), sindyscope_fourier::inverse(count));
    let mut lines = forward.make_output_vec();
    if forward.process(&mut whole, &mut lines).is_err() {
        return values.to_vec();
    }
    for (k, spectral) in lines.iter_mut().enumerate() {
        *spectral *= gain(k as f64 / (count as f64 * interval)) / count as f64;
    }
    if back.process(&mut lines, &mut whole).is_err() {
        return values.to_vec();
    }
    // A low-pass lets the line through as it is, anything else nothing of it.
    let kept = gain(0.0);
    (reach..reach + n).map(|k| whole[k] + kept * line(k)).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const STEP: f64 = 1e-3;

    fn tone(frequency: f64) -> Vec<f64> {
        (0..4000).map(|i| (TAU * frequency * f64::from(i) * STEP + 0.4).sin()).collect()
    }

    /// The largest difference within, away from the ends.
    fn apart(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).skip(1500).take(1000).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn what_is_in_the_band_stays_as_it_is_and_in_phase() {
        let kept = tone(10.0);
        let both: Vec<f64> = kept.iter().zip(tone(100.0)).map(|(a, b)| a + b).collect();
        assert!(apart(&filter(&both, STEP, (None, Some(32.0))), &kept) < 2e-3, "low-pass");
        assert!(apart(&filter(&both, STEP, (Some(32.0), None)), &tone(100.0)) < 2e-3, "high-pass");
        assert!(apart(&filter(&both, STEP, (Some(3.0), Some(32.0))), &kept) < 2e-3, "band-pass");
        let half: Vec<f64> = kept.iter().map(|v| 0.5 * v).collect();
        assert!(apart(&filter(&kept, STEP, (None, Some(10.0))), &half) < 2e-3, "half at the corner");
    }

    #[test]
    fn level_and_slope_pass_a_low_pass_up_to_the_ends_and_nothing_of_them_a_high_pass() {
        let ramp: Vec<f64> = (0..1000).map(|i| 3.0 + 0.01 * f64::from(i)).collect();
        let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far(&filter(&ramp, STEP, (None, Some(20.0))), &ramp) < 1e-9);
        assert!(far(&filter(&ramp, STEP, (Some(20.0), None)), &[0.0; 1000]) < 1e-9);
    }
}
