//! Kalman smoothing: a motion whose acceleration wanders.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

/// Fewest samples that are smoothed: three start the filter.
pub(super) const MIN_SAMPLES: usize = 4;

/// The fixed-interval smoother (Rauch, Tung & Striebel 1965) of samples with white noise, of a motion of which position,
/// velocity and acceleration follow each other; what the acceleration gains from sample to sample is random. Nothing is
/// supposed about the first state.
///
/// Time runs in units of `length / 2π` samples and noise in units of the sensor's: numbers are of order one whatever the
/// sampling.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// Time between samples.
    step: f64,
    /// The state at the third sample from the first three.
    start: Matrix3<f64>,
    /// Gains of the samples from the fourth on, the variance of what each brings anew, and the smoother's gains of the
    /// samples from the third on; the last of each holds for the rest.
    gains: Vec<Vector3<f64>>,
    spreads: Vec<f64>,
    back: Vec<Matrix3<f64>>,
}

/// How a state goes on after `time`.
fn forward(time: f64) -> Matrix3<f64> {
    Matrix3::new(1.0, time, 0.5 * time * time, 0.0, 1.0, time, 0.0, 0.0, 1.0)
}

/// Scatter that a white jerk leaves after `time`, of the density that lets half the amplitude of period 2π through.
fn jerk(time: f64) -> Matrix3<f64> {
    let [_, t1, t2, t3, t4, t5] = [0, 1, 2, 3, 4, 5].map(|k| time.powi(k));
    time * Matrix3::new(t5 / 20.0, t4 / 8.0, t3 / 6.0, t4 / 8.0, t3 / 3.0, t2 / 2.0, t3 / 6.0, t2 / 2.0, t1)
}

impl Track {
    /// The smoother of up to `count` samples whose jerk is white noise, as strong as lets half the amplitude of `length`
    /// samples a period through: the quintic smoothing spline's prior.
    pub(super) fn new(length: f64, count: usize) -> Self {
        let step = TAU / length;
        let scatter = jerk(step);
        Self::build(step, count, &|_| scatter, true)
    }

    /// The smoother of samples whose acceleration jumps from one to the next; `variances[k]` is that of the jump after sample
    /// `k`, in units of the noise's.
    fn jumping(length: f64, variances: &[f64]) -> Self {
        let scatter = |k: usize| {
            let mut scatter = Matrix3::zeros();
            scatter[(2, 2)] = variances[k.min(variances.len() - 1)];
            scatter
        };
        Self::build(TAU / length, variances.len() + 1, &scatter, false)
    }

    fn build(step: f64, count: usize, scatter: &dyn Fn(usize) -> Matrix3<f64>, settles: bool) -> Self {
        const SETTLED: f64 = 1e-15;
        let (on, off) = (forward(step), forward(-step));
        // The first three samples determine the third state: y = B s + noise, where earlier samples lack what came after.
        let row = |k: i32| forward(f64::from(k) * step).row(0).into_owned();
        let seen = Matrix3::from_rows(&[row(-2), row(-1), row(0)]);
        let start = seen.try_inverse().unwrap_or_else(Matrix3::zeros);
        let (last, earlier) = (scatter(1), scatter(0));
        let mut noise = Matrix3::identity();
        noise[(1, 1)] += (row(-1) * last * row(-1).transpose())[0];
        noise[(0, 0)] += (row(-2) * (last + on * earlier * on.transpose()) * row(-2).transpose())[0];
        let both = (row(-2) * last * row(-1).transpose())[0];
        noise[(0, 1)] += both;
        noise[(1, 0)] += both;
        let mut covariance = start * noise * start.transpose();
        let rest = count.saturating_sub(3);
        let mut track = Self { step, start, gains: Vec::new(), spreads: Vec::new(), back: Vec::new() };
        if !settles {
            track.gains.reserve(rest);
            track.spreads.reserve(rest);
            track.back.reserve(rest);
        }
        for k in 0..rest {
            let scatter = scatter(k + 2);
            let predicted = on * covariance * on.transpose() + scatter;
            // Written so because the scatter is small beside the rest where samples are dense.
            let share = predicted.cholesky().map_or_else(Matrix3::zeros, |c| c.solve(&scatter));
            track.back.push(off * (Matrix3::identity() - share.transpose()));
            let spread = predicted[(0, 0)] + 1.0;
            let gain = predicted.column(0) / spread;
            let mut keep = Matrix3::identity();
            keep.set_column(0, &(keep.column(0) - gain));
            covariance = keep * predicted * keep.transpose() + gain * gain.transpose();
            covariance = 0.5 * (covariance + covariance.transpose());
            let settled = settles && track.gains.last().is_some_and(|g| (g - gain).norm() <= SETTLED * gain.norm());
            track.gains.push(gain);
            track.spreads.push(spread);
            if settled {
                break;
            }
        }
        track
    }

    /// The state at the third sample.
    fn first(&self, samples: &[f64], offset: f64) -> Vector3<f64> {
        self.start * Vector3::new(samples[0] - offset, samples[1] - offset, samples[2] - offset)
    }

    /// Smoothed states, at least [`MIN_SAMPLES`] samples; positions are relative to the first sample.
    fn states(&self, samples: &[f64]) -> Vec<Vector3<f64>> {
        let offset = samples[0];
        let (on, off) = (forward(self.step), forward(-self.step));
        let mut states = Vec::with_capacity(samples.len());
        let mut state = self.first(samples, offset);
        states.extend([Vector3::zeros(), Vector3::zeros(), state]);
        let last = self.gains.len() - 1;
        for (k, sample) in samples[3..].iter().enumerate() {
            let predicted = on * state;
            state = predicted + self.gains[k.min(last)] * (sample - offset - predicted[0]);
            states.push(state);
        }
        for k in (2..samples.len() - 1).rev() {
            let filtered = states[k];
            states[k] = filtered + self.back[(k - 2).min(last)] * (states[k + 1] - on * filtered);
        }
        states[1] = off * states[2];
        states[0] = off * states[1];
        states
    }

    /// Position, velocity per sample and acceleration per sample².
    pub(super) fn motion(&self, samples: &[f64]) -> [Vec<f64>; 3] {
        unpack(&self.states(samples), samples[0], self.step)
    }

    /// Twice the negative logarithm of the likelihood of samples, up to a constant, the noise's variance chosen for them.
    pub(super) fn surprise(&self, samples: &[f64]) -> f64 {
        let offset = samples[0];
        let on = forward(self.step);
        let mut state = self.first(samples, offset);
        let last = self.gains.len() - 1;
        let (mut squares, mut logs) = (0.0, 0.0);
        for (k, sample) in samples[3..].iter().enumerate() {
            let predicted = on * state;
            let innovation = sample - offset - predicted[0];
            let k = k.min(last);
            squares += innovation * innovation / self.spreads[k];
            logs += self.spreads[k].ln();
            state = predicted + self.gains[k] * innovation;
        }
        let count = (samples.len() - 3) as f64;
        count * (squares / count).ln() + logs
    }
}

fn unpack(states: &[Vector3<f64>], offset: f64, step: f64) -> [Vec<f64>; 3] {
    [
        states.iter().map(|s| s[0] + offset).collect(),
        states.iter().map(|s| s[1] * step).collect(),
        states.iter().map(|s| s[2] * step * step).collect(),
    ]
}

/// Total variation: of the motions whose acceleration is piecewise constant the one that minimises
/// `½Σ(y − x)² + α Σ|Δa|` (Rudin, Osher & Fatemi 1992; Chartrand 2011, there of the velocity), by smoothing in turns with
/// the jumps' variances taken from their own size (lagged diffusivity).
///
/// α is such that where the acceleration changes as usual as much passes as with [`Track::new`]. Position, velocity per
/// sample and acceleration per sample².
pub(super) fn least_variation(samples: &[f64], length: f64) -> [Vec<f64>; 3] {
    let (states, _) = jumps(samples, length);
    unpack(&states, samples[0], TAU / length)
}

/// Most reweighted fits of least total variation; the last one stands, converged or not.
const MAX_ROUNDS: usize = 25;
/// Change of the jumps, as a share of them, at which the reweighting ends.
const CONVERGED_CHANGE: f64 = 3e-3;
/// Jumps smaller than this share of the usual one weigh as if they were as large: a weight of 1/0 would freeze them.
const MIN_JUMP: f64 = 1e-3;

/// The states and α.
fn jumps(samples: &[f64], length: f64) -> (Vec<Vector3<f64>>, f64) {
    let step = TAU / length;
    let mut states = Track::new(length, samples.len()).states(samples);
    let jumps_of = |states: &[Vector3<f64>]| -> Vec<f64> { states.windows(2).map(|w| w[1][2] - w[0][2]).collect() };
    let mut jumps = jumps_of(&states);
    let usual = jumps.iter().map(|j| j.abs()).sum::<f64>() / jumps.len() as f64;
    let alpha = usual / (step * step);
    if !(usual > 0.0 && alpha.is_finite()) {
        return (states, alpha);
    }
    let smallest = MIN_JUMP * usual;
    let mut variances = vec![0.0; jumps.len()];
    for _ in 0..MAX_ROUNDS {
        for (variance, jump) in variances.iter_mut().zip(&jumps) {
            *variance = jump.hypot(smallest) / alpha;
        }
        states = Track::jumping(length, &variances).states(samples);
        let next = jumps_of(&states);
        let change: f64 = next.iter().zip(&jumps).map(|(a, b)| (a - b).abs()).sum();
        let size: f64 = next.iter().map(|j| j.abs()).sum();
        jumps = next;
        if change <= CONVERGED_CHANGE * size {
            break;
        }
    }
    (states, alpha)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn noisy(n: usize) -> Vec<f64> {
        let mut seed = 7_u32;
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed) / f64::from(u32::MAX) - 0.5
        };
        (0..n).map(|k| 3.0 + (0.25 * k as f64).sin() + 0.2 * noise()).collect()
    }

    /// The mean of the Gaussian process by its definition: all states at once, the prior's precision beside the samples'.
    fn dense(y: &[f64], length: f64) -> Vec<f64> {
        let n = y.len();
        let step = TAU / length;
        let (on, weight) = (forward(step), jerk(step).try_inverse().unwrap());
        let mut a = DMatrix::<f64>::zeros(3 * n, 3 * n);
        let mut b = DVector::zeros(3 * n);
        for k in 0..n {
            a[(3 * k, 3 * k)] += 1.0;
            b[3 * k] = y[k];
            if k + 1 < n {
                let mut difference = DMatrix::zeros(3, 6);
                difference.view_mut((0, 0), (3, 3)).copy_from(&(-on));
                difference.view_mut((0, 3), (3, 3)).copy_from(&Matrix3::identity());
                let part = difference.transpose() * weight * &difference;
                let mut place = a.view_mut((3 * k, 3 * k), (6, 6));
                place += part;
            }
        }
        a.lu().solve(&b).unwrap().iter().copied().collect()
    }

    #[test]
    fn it_is_the_mean_of_the_gaussian_process() {
        let y = noisy(60);
        for length in [8.0, 20.0] {
            let states = Track::new(length, 60).states(&y);
            let wanted = dense(&y, length);
            for k in 2..60 {
                for i in 0..3 {
                    let found = states[k][i] + if i == 0 { y[0] } else { 0.0 };
                    assert!(
                        (found - wanted[3 * k + i]).abs() < 1e-8,
                        "{length} {k} {i}: {found} {}",
                        wanted[3 * k + i]
                    );
                }
            }
        }
    }

    #[test]
    fn half_of_its_length_passes_whatever_the_sampling() {
        for period in [20.0, 200.0, 5000.0] {
            let n = 20 * period as usize;
            let y: Vec<f64> = (0..n).map(|k| (TAU * k as f64 / period).sin()).collect();
            let [x, v, _] = Track::new(period, n).motion(&y);
            let at = 10 * period as usize + (0.2 * period) as usize;
            let phase = TAU * at as f64 / period;
            // Samples are not a continuum: short periods pass a little differently.
            assert!((x[at] - 0.5 * phase.sin()).abs() < 2e-3, "{period}: {} {}", x[at], phase.sin());
            assert!((v[at] * period / TAU - 0.5 * phase.cos()).abs() < 2e-3, "{period}");
        }
    }

    #[test]
    fn the_likelihood_finds_more_smoothing_for_more_noise() {
        let y = noisy(400);
        let quiet: Vec<f64> =
            (0..400).map(|k| 3.0 + (0.25 * f64::from(k)).sin() + 1e-4 * (y[k as usize] - 3.0)).collect();
        let best = |y: &[f64]| {
            (3..40)
                .map(f64::from)
                .min_by(|a, b| Track::new(*a, 400).surprise(y).total_cmp(&Track::new(*b, 400).surprise(y)))
        };
        assert!(best(&y).unwrap() > best(&quiet).unwrap() + 2.0, "{:?} {:?}", best(&y), best(&quiet));
    }

    #[test]
    fn the_least_variation_is_a_minimum() {
        let n = 120;
        // A spring whose force jumps: the acceleration is ±1 by turns.
        let mut y = vec![0.0; n];
        let (mut x, mut v) = (0.0, 0.0);
        for (k, (y, noise)) in y.iter_mut().zip(noisy(n)).enumerate() {
            let a = if (k / 20) % 2 == 0 { 0.02 } else { -0.02 };
            x += v + 0.5 * a;
            v += a;
            *y = x + 0.05 * (noise - 3.0 - (0.25 * k as f64).sin());
        }
        let length = 16.0;
        let (states, alpha) = jumps(&y, length);
        let step = TAU / length;
        let residual: Vec<f64> = states.iter().zip(&y).map(|(s, v)| v - y[0] - s[0]).collect();
        let jumped: Vec<f64> = states.windows(2).map(|w| w[1][2] - w[0][2]).collect();
        let usual = jumped.iter().map(|j| j.abs()).sum::<f64>() / jumped.len() as f64;
        let mut bound = 0;
        // A jump after sample k moves sample j by (j − k − 1)(j − k − 1) step²/2. Its slope cannot exceed α, and is ±α
        // where there is a jump. The first two states are taken from the third.
        for (k, jump) in jumped.iter().enumerate().skip(3) {
            let moved = |j: usize| 0.5 * ((j - k - 1) as f64 * step).powi(2);
            let slope: f64 = (k + 1..n).map(|j| residual[j] * moved(j)).sum();
            assert!(slope.abs() < 1.03 * alpha, "{k}: {slope} {alpha}");
            if jump.abs() > usual {
                assert!((slope / (alpha * jump.signum()) - 1.0).abs() < 0.03, "{k}: {slope} {alpha} {jump}");
                bound += 1;
            }
        }
        assert!((3..30).contains(&bound), "{bound} jumps: few, and some");
    }
}
