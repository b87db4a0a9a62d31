//! The motion along a record and the force that the model lacks, estimated together.
//!
//! What the model's response leaves, `e = measured − simulated`, obeys `e″ = −k e − c e′ + f` with the missing force `f`.
//! With `f` a random walk of unknown intensity this is a linear Gaussian state-space model: the Kalman filter gives the
//! likelihood, by which the intensity is chosen, and the Rauch–Tung–Striebel smoother gives displacement, velocity and
//! missing force with their variances, from all samples before and after.
//!
//! Source: T. Rogers, T. Friis, "A latent restoring force approach to nonlinear system identification", MSSP 180 (2022)
//! 109426, with the Matérn process replaced by its limit, a random walk.

use nalgebra::{Matrix3, RowVector3, Vector3};

use crate::refine::Output;

/// Displacement and velocity of a linear oscillator `p″ = −k p − c p′ + φ` from one sample to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Oscillator {
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    interval: f64,
    step: [[f64; 2]; 2],
    /// Effect of the force at the interval's beginning and at its end, between which it changes evenly.
    before: [f64; 2],
    after: [f64; 2],
}

impl Oscillator {
    pub(super) fn new(stiffness: f64, damping: f64, interval: f64) -> Self {
        let mut a = nalgebra::Matrix4::zeros();
        a[(0, 1)] = 1.0;
        a[(1, 0)] = -stiffness;
        a[(1, 1)] = -damping;
        a[(1, 2)] = 1.0;
        a[(2, 3)] = interval.recip();
        let e = (a * interval).exp();
        let after = [e[(0, 3)], e[(1, 3)]];
        Self {
            stiffness,
            damping,
            interval,
            step: [[e[(0, 0)], e[(0, 1)]], [e[(1, 0)], e[(1, 1)]]],
            before: [e[(0, 2)] - after[0], e[(1, 2)] - after[1]],
            after,
        }
    }

    /// The response to a force from rest, added to nothing: written into `out`.
    pub(super) fn respond(&self, force: &[f64], out: &mut Vec<f64>) {
        out.clear();
        let (mut p, mut v) = (0.0, 0.0);
        let Some(mut now) = force.first().copied() else { return };
        out.push(0.0);
        for &next in &force[1..] {
            let [[a, b], [c, d]] = self.step;
            (p, v) = (
                a * p + b * v + self.before[0] * now + self.after[0] * next,
                c * p + d * v + self.before[1] * now + self.after[1] * next,
            );
            out.push(p);
            now = next;
        }
    }
}

/// What a small force does along a motion: `p″ = −k(t) p − c(t) p′ + φ`, with the slopes of the model's force there.
///
/// Each step is that of an oscillator of constant stiffness and damping between two half kicks by which the slopes differ
/// from it (Strang's splitting). Slopes are secants over the sample: across a jump, as friction has at a reversal, their
/// kick is what the jump does to a neighbouring motion.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variation {
    pub(super) oscillator: Oscillator,
    /// For each interval: the share of velocity that half its excess damping leaves, and the velocity per displacement that
    /// half its excess stiffness takes. Empty where there is none.
    kicks: Vec<(f64, f64)>,
    /// Stiffness and damping over each interval.
    slopes: Vec<(f64, f64)>,
}

/// Most that one interval's negative damping may multiply a velocity by, as a logarithm.
const SPUR: f64 = 1.0;

impl Variation {
    /// `slopes`: stiffness and damping over each interval; none of a linear model.
    pub(super) fn new(oscillator: Oscillator, slopes: &[(f64, f64)]) -> Self {
        let half = 0.5 * oscillator.interval;
        let kick = |(k, c): &(f64, f64)| {
            ((-half * (c - oscillator.damping)).min(SPUR).exp(), half * (k - oscillator.stiffness))
        };
        Self { oscillator, kicks: slopes.iter().map(kick).collect(), slopes: slopes.to_vec() }
    }

    /// What a sensor shows of the response to a force from rest, written into `out`.
    pub(super) fn respond(&self, force: &[f64], output: Output, out: &mut Vec<f64>) {
        let oscillator = &self.oscillator;
        if self.kicks.is_empty() && output == Output::Displacement(0) {
            return oscillator.respond(force, out);
        }
        let still = (1.0, 0.0);
        let kicks = self.kicks.iter().chain(std::iter::repeat(&still));
        let shown = |k: usize, p: f64, v: f64, force: f64| match output {
            Output::Displacement(_) => p,
            Output::Velocity(_) => v,
            Output::Acceleration(_) => {
                let (stiffness, damping) = self.slopes_at(k);
                force - stiffness * p - damping * v
            }
        };
        out.clear();
        let (mut p, mut v) = (0.0, 0.0);
        let Some(mut now) = force.first().copied() else { return };
        out.push(shown(0, p, v, now));
        for ((k, &next), (left, pull)) in force.iter().enumerate().skip(1).zip(kicks) {
            v = left * v - pull * p;
            let [[a, b], [c, d]] = oscillator.step;
            (p, v) = (
                a * p + b * v + oscillator.before[0] * now + oscillator.after[0] * next,
                c * p + d * v + oscillator.before[1] * now + oscillator.after[1] * next,
            );
            v = left * v - pull * p;
            out.push(shown(k, p, v, next));
            now = next;
        }
    }

    /// Stiffness and damping at a sample; across a jump, whose slope is none, those of the oscillator.
    fn slopes_at(&self, k: usize) -> (f64, f64) {
        let own = (self.oscillator.stiffness, self.oscillator.damping);
        let (stiffness, damping) = self.slopes.get(k).copied().unwrap_or(own);
        if (damping - own.1).abs() * self.oscillator.interval > STEEP { own } else { (stiffness, damping) }
    }
}

/// Damping that takes more than this share of the velocity within a sample is a jump's.
const STEEP: f64 = 0.5;

/// What the smoother says of `e` at every sample.
#[derive(Clone, Debug, Default)]
pub(super) struct Smoothed {
    pub(super) displacement: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) force: Vec<f64>,
    /// Standard deviations of velocity and force.
    pub(super) velocity_deviation: Vec<f64>,
    pub(super) force_deviation: Vec<f64>,
}

struct Walk {
    f: Matrix3<f64>,
    q: Matrix3<f64>,
    /// What the sensor shows of (e, e′, f).
    shown: RowVector3<f64>,
}

/// Periods within which a force that no sensor of velocity or acceleration sees, a constant one, is forgotten.
const FORGOTTEN: f64 = 5.0;

/// Transition and process noise of (e, e′, f) for a random walk of unit intensity.
fn walk(oscillator: &Oscillator, period: f64, output: Output) -> Walk {
    let h = oscillator.interval;
    let (stiffness, damping) = (oscillator.stiffness, oscillator.damping);
    let (shown, back) = match output {
        Output::Displacement(_) => (RowVector3::new(1.0, 0.0, 0.0), 0.0),
        Output::Velocity(_) => (RowVector3::new(0.0, 1.0, 0.0), -(FORGOTTEN * period).recip()),
        Output::Acceleration(_) => (RowVector3::new(-stiffness, -damping, 1.0), -(FORGOTTEN * period).recip()),
    };
    let a = Matrix3::new(0.0, 1.0, 0.0, -stiffness, -damping, 1.0, 0.0, 0.0, back);
    let mut q = Matrix3::zeros();
    // Gauss–Legendre, five points: exact to order nine, and the step is short beside the period.
    for (x, w) in [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ] {
        let g = (a * (0.5 * h * (1.0 + x))).exp() * Vector3::z();
        q += g * g.transpose() * (0.5 * h * w);
    }
    Walk { f: (a * h).exp(), q, shown }
}

/// A Kalman filter's covariance and gain, which settle: from then on they are not computed again.
struct Filter<'a> {
    walk: &'a Walk,
    q: Matrix3<f64>,
    /// Covariance before and after the sample was seen.
    predicted: Matrix3<f64>,
    filtered: Matrix3<f64>,
    gain: Vector3<f64>,
    /// Variance of the innovation, and its logarithm.
    innovation: (f64, f64),
    settled: bool,
}

/// Relative change of a covariance from one sample to the next at which it has settled.
const SETTLED: f64 = 1e-13;

impl<'a> Filter<'a> {
    fn new(walk: &'a Walk, predicted: Matrix3<f64>, ratio: f64) -> Self {
        let q = walk.q * ratio;
        let mut filter = Self {
            walk,
            q,
            predicted,
            filtered: predicted,
            gain: Vector3::zeros(),
            innovation: (1.0, 0.0),
            settled: false,
        };
        filter.see();
        filter
    }

    fn see(&mut self) {
        let p = self.predicted;
        let seen = p * self.walk.shown.transpose();
        let s = (self.walk.shown * seen)[0] + 1.0;
        self.innovation = (s, s.ln());
        self.gain = seen / s;
        self.filtered = p - self.gain * seen.transpose();
    }

    fn next(&mut self) {
        if self.settled {
            return;
        }
        let next = self.walk.f * self.filtered * self.walk.f.transpose() + self.q;
        let still = |i: usize| (next[(i, i)] - self.predicted[(i, i)]).abs() <= SETTLED * next[(i, i)];
        self.settled = (0..3).all(still);
        self.predicted = next;
        self.see();
    }
}

/// Log-likelihood of the series under a random walk of `ratio` times the noise's variance, that variance being whatever
/// suits best, and the variance.
fn likelihood(walk: &Walk, series: &[&[f64]], ratio: f64) -> (f64, f64) {
    let (mut squares, mut logs, mut count) = (0.0, 0.0, 0usize);
    for e in series {
        let (mut m, p) = start(e, ratio, walk);
        let mut filter = Filter::new(walk, p, ratio);
        for y in *e {
            let innovation = y - (walk.shown * m)[0];
            squares += innovation * innovation / filter.innovation.0;
            logs += filter.innovation.1;
            m = walk.f * (m + filter.gain * innovation);
            filter.next();
        }
        count += e.len();
    }
    let variance = squares / count.max(1) as f64;
    (-0.5 * (count as f64 * variance.max(f64::MIN_POSITIVE).ln() + logs), variance)
}

/// A wide start: the first samples decide.
fn start(e: &[f64], ratio: f64, walk: &Walk) -> (Vector3<f64>, Matrix3<f64>) {
    if walk.shown[0] != 1.0 {
        // A force of a hundred deviations of what is shown, or the motion that shows as much.
        let rate = walk.shown[0].abs().max(walk.shown[1]).max(f64::MIN_POSITIVE);
        let (moved, pushed) = (1e4 / (rate * rate), 1e4 * ratio * walk.q[(2, 2)]);
        let fast = if walk.shown[0] == 0.0 { 1e4 } else { 1e4 / rate };
        let far = if walk.shown[0] == 0.0 { fast * walk.f[(0, 1)].powi(2) * 1e4 } else { moved };
        return (Vector3::zeros(), Matrix3::from_diagonal(&Vector3::new(far, fast, pushed.max(1e-300))));
    }
    let wide = 1e4;
    let h2 = walk.f[(0, 1)].powi(2).max(f64::MIN_POSITIVE);
    let force = (ratio * walk.q[(2, 2)] * 1e4).max(1e-300);
    (
        Vector3::new(e.first().copied().unwrap_or(0.0), 0.0, 0.0),
        Matrix3::from_diagonal(&Vector3::new(wide, wide / (1e4 * h2), force)),
    )
}

/// Smooths what a response leaves of several records of one interval.
///
/// `period` is the motion's, s; `output` what the sensor shows.
pub(super) fn smooth(oscillator: &Oscillator, series: &[&[f64]], period: f64, output: Output) -> Vec<Smoothed> {
    let walk = walk(oscillator, period, output);
    let omega = std::f64::consts::TAU / period;
    // The force's change over a period, in units of ω² (of a velocity ω) times the noise's deviation.
    let unit = omega.powi(2 - output.derivatives() as i32);
    let ratio = |exponent: f64| (10f64.powf(exponent) * unit).powi(2) / period;
    let value = |exponent: f64| likelihood(&walk, series, ratio(exponent)).0;
    let mut best = (f64::NEG_INFINITY, 0.0);
    for k in 0..8 {
        let exponent = -2.5 + f64::from(k);
        let found = value(exponent);
        if found > best.0 {
            best = (found, exponent);
        }
    }
    let middle = best.1;
    for offset in [-0.5, 0.5, -0.25, 0.25] {
        let exponent = if f64::abs(offset) > 0.3 { middle } else { best.1 } + offset;
        let found = value(exponent);
        if found > best.0 {
            best = (found, exponent);
        }
    }
    let ratio = ratio(best.1);
    let variance = likelihood(&walk, series, ratio).1;
    series.iter().map(|e| smoother(&walk, e, ratio, variance)).collect()
}

fn smoother(walk: &Walk, e: &[f64], ratio: f64, variance: f64) -> Smoothed {
    let n = e.len();
    let (mut m, p) = start(e, ratio, walk);
    let mut filter = Filter::new(walk, p, ratio);
    let mut filtered = Vec::with_capacity(n);
    let mut predicted = Vec::with_capacity(n);
    // Covariances up to where they settle, the last standing for all after it.
    let mut covariances = Vec::new();
    for y in e {
        predicted.push(m);
        if !filter.settled {
            covariances.push((filter.predicted, filter.filtered));
        }
        m += filter.gain * (y - (walk.shown * m)[0]);
        filtered.push(m);
        m = walk.f * m;
        filter.next();
    }
    let mut out = Smoothed {
        displacement: vec![0.0; n],
        velocity: vec![0.0; n],
        force: vec![0.0; n],
        velocity_deviation: vec![0.0; n],
        force_deviation: vec![0.0; n],
    };
    let (Some(mut mean), Some(last)) = (filtered.last().copied(), covariances.len().checked_sub(1)) else { return out };
    let mut covariance = covariances[last].1;
    let back = |pp: Matrix3<f64>, fp: Matrix3<f64>| {
        pp.cholesky().map_or_else(Matrix3::zeros, |c| c.solve(&(walk.f * fp)).transpose())
    };
    let mut gain = back(covariances[last].0, covariances[last].1);
    for k in (0..n).rev() {
        if k + 1 < n {
            let fp = covariances[k.min(last)].1;
            let pp = covariances[(k + 1).min(last)].0;
            if k < last {
                gain = back(pp, fp);
            }
            mean = filtered[k] + gain * (mean - predicted[k + 1]);
            covariance = fp + gain * (covariance - pp) * gain.transpose();
        }
        out.displacement[k] = mean[0];
        out.velocity[k] = mean[1];
        out.force[k] = mean[2];
        out.velocity_deviation[k] = (covariance[(1, 1)].max(0.0) * variance).sqrt();
        out.force_deviation[k] = (covariance[(2, 2)].max(0.0) * variance).sqrt();
    }
    out
}

impl Oscillator {
    /// Its two free vibrations: let go from a unit displacement, and from a unit velocity.
    pub(super) fn free(&self, samples: usize) -> [Vec<f64>; 2] {
        [(1.0, 0.0), (0.0, 1.0)].map(|(mut p, mut v)| {
            (0..samples)
                .map(|_| {
                    let now = p;
                    let [[a, b], [c, d]] = self.step;
                    (p, v) = (a * p + b * v, c * p + d * v);
                    now
                })
                .collect()
        })
    }
}
