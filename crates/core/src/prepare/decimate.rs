//! Fewer samples a second, without aliases.

use std::f64::consts::PI;

/// Taps on either side of the low-pass, in samples of the new rate.
const TAPS: usize = 25;

/// Frequency at which half the amplitude passes, as a share of the new rate: all passes below 0.4, nothing above 0.5.
const CORNER: f64 = 0.45;

/// Shape β of the Kaiser window: 80 dB of attenuation in the stop band.
const KAISER_SHAPE: f64 = 7.86;

/// One value in `factor`, the first one first, behind a low-pass of even symmetry (a sinc under a Kaiser window): it shifts
/// nothing, passes what lies below 0.4 of the new rate to 10⁻⁴ and holds what lies above half of it to as much.
/// Oppenheim and Schafer, Discrete-Time Signal Processing, 7.5.
pub(super) fn decimate(values: &[f64], factor: usize) -> Vec<f64> {
    let taps = taps(factor);
    let n = values.len() as isize;
    // Beyond its ends a record goes on turned about its end point: level and slope stay what they are.
    let at = |i: isize| match i {
        i if i < 0 => 2.0 * values[0] - values[(-i).min(n - 1) as usize],
        i if i >= n => 2.0 * values[(n - 1) as usize] - values[(2 * (n - 1) - i).max(0) as usize],
        i => values[i as usize],
    };
    let reach = taps.len() as isize - 1;
    let smooth = |centre: usize| {
        let centre = centre as isize;
        if centre >= reach && centre + reach < n {
            let (before, after) = (&values[(centre - reach) as usize..], &values[centre as usize..]);
            let pairs = (1..taps.len()).map(|k| taps[k] * (before[taps.len() - 1 - k] + after[k]));
            return taps[0] * values[centre as usize] + pairs.sum::<f64>();
        }
        let pairs = (1..=reach).map(|k| taps[k as usize] * (at(centre - k) + at(centre + k)));
        taps[0] * at(centre) + pairs.sum::<f64>()
    };
    (0..values.len()).step_by(factor).map(smooth).collect()
}

/// The low-pass from its middle tap on; with its mirror image the taps sum to one.
fn taps(factor: usize) -> Vec<f64> {
    let reach = TAPS * factor;
    let cutoff = 2.0 * CORNER / factor as f64;
    let bell = |k: usize| {
        let x = k as f64 / (reach as f64 + 1.0);
        bessel(KAISER_SHAPE * (1.0 - x * x).max(0.0).sqrt()) / bessel(KAISER_SHAPE)
    };
    let sinc = |k: usize| if k == 0 { cutoff } else { (PI * cutoff * k as f64).sin() / (PI * k as f64) };
    let mut taps: Vec<f64> = (0..=reach).map(|k| sinc(k) * bell(k)).collect();
    let sum = taps[0] + 2.0 * taps[1..].iter().sum::<f64>();
    taps.iter_mut().for_each(|t| *t /= sum);
    taps
}

/// The modified Bessel function of the first kind and order zero, by its series.
fn bessel(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..60 {
        term *= quarter / f64::from(k * k);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// A tone, `frequency` in shares of the new rate.
    fn tone(frequency: f64, factor: usize, samples: usize) -> Vec<f64> {
        (0..samples).map(|i| (TAU * frequency * i as f64 / factor as f64 + 0.3).sin()).collect()
    }

    #[test]
    fn what_the_new_rate_can_show_stays_and_what_it_cannot_is_gone() {
        for factor in [2, 5, 16] {
            let inner = |values: &[f64]| values[TAPS..values.len() - TAPS].to_vec();
            for frequency in [0.01, 0.1, 0.4] {
                let kept = decimate(&tone(frequency, factor, 200 * factor), factor);
                let exact = tone(frequency, 1, 200);
                let far = inner(&kept).iter().zip(inner(&exact)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(far < 2e-4, "{factor} {frequency}: {far}");
            }
            for frequency in [0.5, 0.7, 1.0, 0.49 * factor as f64] {
                let kept = decimate(&tone(frequency, factor, 200 * factor), factor);
                let left = inner(&kept).iter().map(|v| v.abs()).fold(0.0, f64::max);
                assert!(left < 2e-4 || frequency < 0.5, "{factor} {frequency}: {left}");
            }
        }
    }

    #[test]
    fn level_and_slope_reach_up_to_the_ends() {
        let ramp: Vec<f64> = (0..400).map(|i| 5.0 + 0.1 * f64::from(i)).collect();
        let kept = decimate(&ramp, 4);
        assert_eq!(kept.len(), 100);
        for (i, value) in kept.iter().enumerate() {
            assert!((value - ramp[4 * i]).abs() < 1e-9, "{i}: {value}");
        }
    }

    #[test]
    fn a_record_shorter_than_the_low_pass_does_no_harm() {
        let kept = decimate(&tone(0.1, 8, 50), 8);
        assert!(kept.len() == 7 && kept.iter().all(|v| v.is_finite()));
    }
}
