//! One way of smoothing, ready for signals of one length.

use super::kalman::{self, Track, least_variation};
use super::noise::standard_deviation;
use super::spectral::{Spectral, noise_edge};
use super::spline::Spline;
use super::{Differentiation, SavitzkyGolay, Smoothing, central};

/// A signal smoothed, with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothedSignal {
    /// The smoothed samples, in their unit.
    pub position: Vec<f64>,
    /// Their first derivative, per second.
    pub velocity: Vec<f64>,
    /// Where it comes with the rest and is not the velocity's derivative: the way is not linear.
    pub acceleration: Option<Vec<f64>>,
}

/// A way of smoothing with its strength settled, for signals of one length.
#[derive(Clone, Debug)]
pub struct Smoother(SmoothingMethod);

#[derive(Clone, Debug)]
enum SmoothingMethod {
    /// Savitzky–Golay; whether the derivative is the filter's own, else a difference of what is smoothed.
    Polynomial {
        filter: SavitzkyGolay,
        derived: bool,
    },
    Spline(Spline),
    Spectral(Spectral),
    Kalman(Track),
    /// Least total variation, by its length in samples.
    Variation {
        length: f64,
    },
    Difference,
}

/// Samples, from the middle of a record, that the strength of smoothing is chosen from, at most.
const MAX_JUDGED_SAMPLES: usize = 1 << 14;
/// Shortest period of which half may be asked to pass, samples: shorter ones are not sampled.
const MIN_PERIOD: f64 = 3.0;

impl Smoother {
    /// The strength of a smoothing for a record whose leading signal this is: the segment length, or the period in samples
    /// of which half the amplitude passes; zero where nothing is smoothed.
    pub fn length(smoothing: &Smoothing, samples: &[f64]) -> f64 {
        let given = smoothing.window as f64;
        let n = samples.len();
        match smoothing.method {
            Differentiation::Filter | Differentiation::SmoothThenDifference => given,
            Differentiation::Difference => 0.0,
            _ if !smoothing.from_data => given.max(MIN_PERIOD),
            _ if n < 4 * kalman::MIN_SAMPLES => MIN_PERIOD,
            method => from_data(method, samples),
        }
    }

    /// The way of `smoothing` at a strength, for signals of `count` samples.
    pub fn new(smoothing: &Smoothing, length: f64, count: usize) -> Self {
        let length = length.max(MIN_PERIOD);
        Self(match smoothing.method {
            Differentiation::Filter | Differentiation::SmoothThenDifference => SmoothingMethod::Polynomial {
                filter: SavitzkyGolay::new(smoothing.window, smoothing.order),
                derived: smoothing.method == Differentiation::Filter,
            },
            Differentiation::Difference => SmoothingMethod::Difference,
            _ if count < kalman::MIN_SAMPLES => SmoothingMethod::Difference,
            Differentiation::Spline => SmoothingMethod::Spline(Spline::new(count, length)),
            Differentiation::Spectral => SmoothingMethod::Spectral(Spectral::new(count, length)),
            Differentiation::Kalman => SmoothingMethod::Kalman(Track::new(length, count)),
            Differentiation::TotalVariation => SmoothingMethod::Variation { length },
        })
    }

    /// Whether sums of signals are smoothed to the sum of what is smoothed of each: only then can library columns pass
    /// through the filter that the displacement went through.
    pub fn is_linear(&self) -> bool {
        !matches!(self.0, SmoothingMethod::Variation { .. })
    }

    /// Smooths samples.
    pub fn smooth(&self, samples: &[f64], interval: f64) -> Vec<f64> {
        match &self.0 {
            SmoothingMethod::Polynomial { filter, .. } => filter.apply(samples, interval, 0),
            SmoothingMethod::Spline(spline) => spline.smooth(samples),
            SmoothingMethod::Spectral(spectral) => spectral.smooth(samples),
            SmoothingMethod::Difference => samples.to_vec(),
            SmoothingMethod::Kalman(_) | SmoothingMethod::Variation { .. } => self.motion(samples, interval).position,
        }
    }

    /// The first derivative of samples as measured.
    pub fn differentiate(&self, samples: &[f64], interval: f64) -> Vec<f64> {
        let scaled = |mut slope: Vec<f64>| {
            slope.iter_mut().for_each(|v| *v /= interval);
            slope
        };
        match &self.0 {
            SmoothingMethod::Polynomial { filter, derived: true } => filter.apply(samples, interval, 1),
            SmoothingMethod::Polynomial { filter, derived: false } => {
                central(&filter.apply(samples, interval, 0), interval)
            }
            SmoothingMethod::Spectral(spectral) => scaled(spectral.slope(samples)),
            SmoothingMethod::Difference => central(samples, interval),
            SmoothingMethod::Spline(spline) => scaled(spline.slope(samples).1),
            SmoothingMethod::Kalman(_) | SmoothingMethod::Variation { .. } => self.motion(samples, interval).velocity,
        }
    }

    /// Samples smoothed, with their derivative.
    pub fn motion(&self, samples: &[f64], interval: f64) -> SmoothedSignal {
        let unpack = |[position, mut velocity, mut acceleration]: [Vec<f64>; 3], with: bool| {
            velocity.iter_mut().for_each(|v| *v /= interval);
            acceleration.iter_mut().for_each(|a| *a /= interval * interval);
            SmoothedSignal { position, velocity, acceleration: with.then_some(acceleration) }
        };
        match &self.0 {
            SmoothingMethod::Kalman(track) => unpack(track.motion(samples), false),
            SmoothingMethod::Variation { length } => unpack(least_variation(samples, *length), true),
            SmoothingMethod::Spline(spline) => {
                let (position, mut velocity) = spline.slope(samples);
                velocity.iter_mut().for_each(|v| *v /= interval);
                SmoothedSignal { position, velocity, acceleration: None }
            }
            SmoothingMethod::Polynomial { .. } | SmoothingMethod::Spectral(_) | SmoothingMethod::Difference => {
                SmoothedSignal {
                    position: self.smooth(samples, interval),
                    velocity: self.differentiate(samples, interval),
                    acceleration: None,
                }
            }
        }
    }
}

/// The strength that a signal itself asks for: cross-validation of a spline, the likelihood of a random acceleration, the
/// noise's edge in a spectrum.
fn from_data(method: Differentiation, samples: &[f64]) -> f64 {
    let n = samples.len();
    let from = (n - n.min(MAX_JUDGED_SAMPLES)) / 2;
    let part = &samples[from..from + n.min(MAX_JUDGED_SAMPLES)];
    let size = part.iter().fold(0.0_f64, |m, y| m.max((y - part[0]).abs()));
    if !(size > 0.0 && size.is_finite()) {
        return MIN_PERIOD;
    }
    let scaled: Vec<f64> = part.iter().map(|y| (y - part[0]) / size).collect();
    let count = scaled.len();
    let longest = (0.25 * count as f64).max(MIN_PERIOD + 1.0);
    let found = match method {
        Differentiation::Spline => {
            lowest(MIN_PERIOD, longest, &|length| Spline::new(count, length).cross_validation(&scaled))
        }
        Differentiation::Kalman | Differentiation::TotalVariation => {
            lowest(MIN_PERIOD, longest, &|length| Track::new(length, count).surprise(&scaled))
        }
        _ => noise_edge(&scaled, standard_deviation(&scaled).unwrap_or(0.0)),
    };
    found.clamp(MIN_PERIOD, longest)
}

/// Where a function is lowest between two positive numbers, to 1 %: tried on a grid of their logarithms, then around the
/// best of it by golden section.
fn lowest(low: f64, high: f64, value: &dyn Fn(f64) -> f64) -> f64 {
    const GRID: usize = 16;
    let ratio = (high / low).powf(((GRID - 1) as f64).recip());
    let at = |k: usize| low * ratio.powi(k as i32);
    let best = (0..GRID).map(|k| (k, value(at(k)))).filter(|(_, v)| !v.is_nan()).min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((best, _)) = best else { return low };
    let (mut below, mut above) = (at(best.saturating_sub(1)).ln(), at((best + 1).min(GRID - 1)).ln());
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    while above - below > 0.01 {
        let (left, right) = (above - golden * (above - below), below + golden * (above - below));
        if value(left.exp()) <= value(right.exp()) { above = right } else { below = left }
    }
    (0.5 * (below + above)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    fn global() -> impl Iterator<Item = Smoothing> {
        let ways = Differentiation::ALL.into_iter().filter(|m| m.is_global());
        ways.map(|method| Smoothing { method, ..Smoothing::default() })
    }

    fn motion(smoothing: &Smoothing, samples: &[f64], interval: f64) -> SmoothedSignal {
        Smoother::new(smoothing, Smoother::length(smoothing, samples), samples.len()).motion(samples, interval)
    }

    fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
        (values.clone().map(|v| v * v).sum::<f64>() / values.count() as f64).sqrt()
    }

    #[test]
    fn left_to_the_data_every_way_takes_the_noise_out_and_leaves_the_motion() {
        let (n, interval, rate) = (3000, 0.01, 6.0);
        let mut random = rand_pcg::Pcg64::seed_from_u64(4);
        for share in [0.0, 1e-3, 0.03] {
            let y: Vec<f64> = (0..n)
                .map(|k| {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    2.0 + (rate * interval * k as f64).sin() + share * noise
                })
                .collect();
            let raw = rms(central(&y, interval)
                .iter()
                .enumerate()
                .map(|(k, v)| v - rate * (rate * interval * k as f64).cos()));
            for smoothing in global() {
                let SmoothedSignal { position, velocity, .. } = motion(&smoothing, &y, interval);
                let inside = 200..n - 200;
                let x_error = rms(inside.clone().map(|k| position[k] - 2.0 - (rate * interval * k as f64).sin()));
                let v_error = rms(inside.map(|k| velocity[k] - rate * (rate * interval * k as f64).cos()));
                let method = smoothing.method;
                // Total variation lays parabolas through a smooth motion: their joints keep more of the noise.
                let slope = if method == Differentiation::TotalVariation { 0.5 } else { 0.25 };
                if share == 0.0 {
                    assert!(x_error < 1e-4 && v_error < 1e-3 * rate, "{method:?} {x_error:e} {v_error:e}");
                } else {
                    assert!(
                        x_error < 0.6 * share && v_error < slope * raw,
                        "{method:?} {share} {x_error:e} {v_error:e} {raw:e}"
                    );
                }
            }
        }
    }

    #[test]
    fn no_signal_is_too_short_too_still_or_too_large() {
        for smoothing in global().flat_map(|s| [s, s.with_window(3), s.with_window(1001)]) {
            for n in [0, 1, 2, 3, 4, 5, 6, 7, 9, 16, 40] {
                for signal in 0..6 {
                    let y: Vec<f64> = (0..n)
                        .map(|k| match signal {
                            0 => 0.0,
                            1 => -1e30,
                            2 => k as f64 * 1e200,
                            3 => {
                                if k == n / 2 {
                                    1e-200
                                } else {
                                    0.0
                                }
                            }
                            4 => {
                                if k % 2 == 0 {
                                    1e150
                                } else {
                                    -1e150
                                }
                            }
                            _ => {
                                if k < n / 2 {
                                    5.0
                                } else {
                                    6.0
                                }
                            }
                        })
                        .collect();
                    let SmoothedSignal { position, velocity, acceleration } = motion(&smoothing, &y, 0.1);
                    assert_eq!((position.len(), velocity.len()), (n, n), "{smoothing:?} {n} {signal}");
                    assert!(acceleration.is_none_or(|a| a.len() == n));
                    if signal < 2 || signal == 5 {
                        let finite = position.iter().chain(&velocity).all(|v| v.is_finite());
                        assert!(finite, "{smoothing:?} {n} {signal}: {position:?} {velocity:?}");
                    }
                    if signal < 2 {
                        assert!(
                            position.iter().zip(&y).all(|(a, b)| (a - b).abs() <= 1e-9 * b.abs()),
                            "{smoothing:?} {n}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn total_variation_keeps_an_acceleration_that_jumps() {
        let (n, interval) = (1000, 0.01);
        let (mut x, mut v) = (0.0, 0.0);
        let mut random = rand_pcg::Pcg64::seed_from_u64(9);
        let mut truth = Vec::with_capacity(n);
        let y: Vec<f64> = (0..n)
            .map(|k| {
                let a: f64 = if (k / 125) % 2 == 0 { 2.0 } else { -2.0 };
                truth.push(a);
                x += v * interval + 0.5 * a * interval * interval;
                v += a * interval;
                let noise: f64 = StandardNormal.sample(&mut random);
                x + 1e-3 * noise
            })
            .collect();
        let error = |a: &[f64]| rms((60..n - 60).map(|k| a[k] - truth[k]));
        let way = |method| Smoothing { method, ..Smoothing::default() }.with_window(101);
        let variation = motion(&way(Differentiation::TotalVariation), &y, interval).acceleration.unwrap();
        let kalman = way(Differentiation::Kalman);
        let smoother = Smoother::new(&kalman, 101.0, n);
        let linear = smoother.differentiate(&smoother.motion(&y, interval).velocity, interval);
        assert!(error(&variation) < 0.6 * error(&linear), "{} {}", error(&variation), error(&linear));
    }
}
