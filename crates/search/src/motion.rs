//! The motion along a record and the forces that the model lacks, estimated together.
//!
//! What the model's response leaves, `e = measured − simulated`, obeys `e″ = −K e − C e′ + f` with the missing forces `f`, one
//! a mass. With `f` random walks of unknown intensity this is a linear Gaussian state-space model: the Kalman filter gives the
//! likelihood, by which the intensity is chosen, and the Rauch–Tung–Striebel smoother gives displacements, velocities and
//! missing forces with their variances, from all samples before and after.
//!
//! Source: T. Rogers, T. Friis, "A latent restoring force approach to nonlinear system identification", MSSP 180 (2022)
//! 109426, with the Matérn process replaced by its limit, a random walk.

use fearless_simd::{Level, dispatch};
use nalgebra::{DMatrix, DVector};

use super::columns::COLUMNS_AT_ONCE;
use sindyscope_core::refine::Output;
use sindyscope_core::study::Cancel;

/// Displacements and velocities of a linear system `p″ = −K p − C p′ + φ` from one sample to the next: one oscillator, or
/// several that are coupled.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Oscillator {
    /// K and C, per unit of mass: `[mass, mass]`.
    pub(super) stiffness: DMatrix<f64>,
    pub(super) damping: DMatrix<f64>,
    interval: f64,
    /// For each displacement, then each velocity: its share of each of them, row by row.
    step: Vec<f64>,
    /// For each, the effect of each mass's force at the interval's beginning and at its end, between which it changes evenly.
    before: Vec<f64>,
    after: Vec<f64>,
}

impl Oscillator {
    /// A single mass.
    pub(super) fn single(stiffness: f64, damping: f64, interval: f64) -> Self {
        Self::new(DMatrix::from_element(1, 1, stiffness), DMatrix::from_element(1, 1, damping), interval)
    }

    pub(super) fn new(stiffness: DMatrix<f64>, damping: DMatrix<f64>, interval: f64) -> Self {
        let n = stiffness.nrows();
        let mut a = DMatrix::zeros(4 * n, 4 * n);
        for i in 0..n {
            a[(i, n + i)] = 1.0;
            a[(n + i, 2 * n + i)] = 1.0;
            a[(2 * n + i, 3 * n + i)] = interval.recip();
            for j in 0..n {
                a[(n + i, j)] = -stiffness[(i, j)];
                a[(n + i, n + j)] = -damping[(i, j)];
            }
        }
        let e = (a * interval).exp();
        let rows = |columns: std::ops::Range<usize>| -> Vec<f64> {
            (0..2 * n).flat_map(|i| columns.clone().map(move |j| (i, j))).map(|place| e[place]).collect()
        };
        let after = rows(3 * n..4 * n);
        let before = rows(2 * n..3 * n).iter().zip(&after).map(|(both, after)| both - after).collect();
        Self { stiffness, damping, interval, step: rows(0..2 * n), before, after }
    }

    pub(super) fn masses(&self) -> usize {
        self.stiffness.nrows()
    }

    /// The system's matrix: the rates of displacements and velocities.
    pub(super) fn matrix(stiffness: &DMatrix<f64>, damping: &DMatrix<f64>) -> DMatrix<f64> {
        let n = stiffness.nrows();
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        a.view_mut((0, n), (n, n)).fill_with_identity();
        a.view_mut((n, 0), (n, n)).copy_from(&-stiffness);
        a.view_mut((n, n), (n, n)).copy_from(&-damping);
        a
    }

    /// The state after an interval in which the forces on some masses go from one value to another.
    fn advance(&self, state: &[f64], forces: &[(usize, &[f64])], k: usize, next: &mut [f64]) {
        let Self { step, before, after, .. } = self;
        let m = state.len();
        for (i, next) in next.iter_mut().enumerate() {
            let mut value = 0.0;
            for (j, state) in state.iter().enumerate() {
                value += step[i * m + j] * state;
            }
            for (mass, force) in forces {
                let place = i * m / 2 + mass;
                value += before[place] * force[k] + after[place] * force[k + 1];
            }
            *next = value;
        }
    }

    /// The displacement of a single mass under a force from rest, written into `out`.
    pub(super) fn respond(&self, force: &[f64], out: &mut Vec<f64>) {
        Variation::new(self.clone(), &[]).respond(&[(0, force)], &[(Output::Displacement(0), 1.0)], out);
    }
}

/// What small forces do along a motion: `p″ = −K(t) p − C(t) p′ + φ`, with the slopes of the model's forces there.
///
/// Each step is that of a system of constant stiffness and damping between two half kicks by which the slopes differ
/// from it (Strang's splitting). Slopes are secants over the sample: across a jump, as friction has at a reversal, their
/// kick is what the jump does to a neighbouring motion.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variation {
    pub(super) oscillator: Oscillator,
    /// For each interval, one matrix row by row behind the other: what half its excess damping leaves of the velocities, and
    /// the velocities that half its excess stiffness takes by the displacements. Empty where there is none.
    left: Vec<f64>,
    pull: Vec<f64>,
    /// Stiffness and damping over each interval, likewise.
    slopes: Slopes,
}

/// Stiffness and damping over each interval, matrices row by row one behind the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Slopes {
    pub(super) stiffness: Vec<f64>,
    pub(super) damping: Vec<f64>,
}

/// Most that one interval's negative damping may multiply a velocity by, as a logarithm.
const SPUR: f64 = 1.0;

impl Variation {
    /// `slopes`: stiffness and damping over each interval of a single mass; none of a linear model.
    pub(super) fn new(oscillator: Oscillator, slopes: &[(f64, f64)]) -> Self {
        let (stiffness, damping) = slopes.iter().copied().unzip();
        Self::along(oscillator, Slopes { stiffness, damping })
    }

    /// The system of these slopes over each interval.
    pub(super) fn along(oscillator: Oscillator, slopes: Slopes) -> Self {
        let n = oscillator.masses();
        let half = 0.5 * oscillator.interval;
        let mut left = Vec::with_capacity(slopes.damping.len());
        for damping in slopes.damping.chunks_exact(n * n) {
            left.extend(kick(&DMatrix::from_fn(n, n, |i, j| {
                -half * (damping[i * n + j] - oscillator.damping[(i, j)])
            })));
        }
        let place = |k: usize| (k / n % n, k % n);
        let excess = |(k, slope): (usize, &f64)| half * (slope - oscillator.stiffness[place(k)]);
        let pull = slopes.stiffness.iter().enumerate().map(excess).collect();
        Self { oscillator, left, pull, slopes }
    }

    /// What sensors show, each by its weight, of the response to forces on some masses from rest: one series behind the other,
    /// written into `out`.
    pub(super) fn respond(&self, forces: &[(usize, &[f64])], outputs: &[(Output, f64)], out: &mut Vec<f64>) {
        out.clear();
        // One mass, written out: the search spends much of its time here.
        if let ([(0, force)], [(Output::Displacement(0), weight)], [_]) =
            (forces, outputs, self.oscillator.stiffness.as_slice())
        {
            return self.displace(force, *weight, out);
        }
        let n = self.oscillator.masses();
        let samples = forces.first().map_or(0, |f| f.1.len());
        out.resize(outputs.len() * samples, 0.0);
        let (mut state, mut next) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
        for k in 0..samples {
            for (i, (output, weight)) in outputs.iter().enumerate() {
                out[i * samples + k] = weight
                    * match output {
                        Output::Displacement(mass) => state[*mass],
                        Output::Velocity(mass) => state[n + mass],
                        Output::Acceleration(mass) => {
                            let own: f64 = forces.iter().filter(|f| f.0 == *mass).map(|f| f.1[k]).sum();
                            own - self.pulled(k, *mass, &state)
                        }
                    };
            }
            if k + 1 < samples {
                self.kick(k, &mut state, &mut next);
                self.oscillator.advance(&state, forces, k, &mut next);
                std::mem::swap(&mut state, &mut next);
                self.kick(k, &mut state, &mut next);
            }
        }
    }

    /// As [`Self::respond`] to each of several forces alone, appended to a series of its own.
    pub(super) fn respond_each(&self, forces: &[(usize, &[f64])], outputs: &[(Output, f64)], out: &mut [Vec<f64>]) {
        if let ([(Output::Displacement(0), weight)], [_]) = (outputs, self.oscillator.stiffness.as_slice()) {
            let together = forces.chunks(COLUMNS_AT_ONCE).zip(out.chunks_mut(COLUMNS_AT_ONCE));
            together.for_each(|(forces, out)| self.displace_each(forces, *weight, out));
            return;
        }
        let mut response = Vec::new();
        for (force, out) in forces.iter().zip(out) {
            self.respond(std::slice::from_ref(force), outputs, &mut response);
            out.extend_from_slice(&response);
        }
    }

    /// The displacement of a single mass, times a weight, appended to `out`.
    fn displace(&self, force: &[f64], weight: f64, out: &mut Vec<f64>) {
        let Oscillator { step, before, after, .. } = &self.oscillator;
        let (mut p, mut v) = (0.0, 0.0);
        let mut go_on = |now: f64, then: f64, (left, pull): (f64, f64)| {
            v = left * v - pull * p;
            (p, v) = (
                step[0] * p + step[1] * v + before[0] * now + after[0] * then,
                step[2] * p + step[3] * v + before[1] * now + after[1] * then,
            );
            v = left * v - pull * p;
            weight * p
        };
        out.reserve(force.len());
        out.extend(force.first().map(|_| 0.0));
        let kicks = self.left.iter().copied().zip(self.pull.iter().copied()).chain(std::iter::repeat((1.0, 0.0)));
        out.extend(force.windows(2).zip(kicks).map(|(pair, kick)| go_on(pair[0], pair[1], kick)));
    }

    /// As [`Self::displace`], for forces side by side, each displacement appended to its own.
    fn displace_each(&self, forces: &[(usize, &[f64])], weight: f64, out: &mut [Vec<f64>]) {
        let Some((_, first)) = forces.first() else { return };
        if let ([_], [out]) = (forces, &mut *out) {
            return self.displace(first, weight, out);
        }
        let samples = first.len();
        let begins: [usize; COLUMNS_AT_ONCE] = std::array::from_fn(|w| out.get(w).map_or(0, Vec::len));
        // A place that nobody has goes with the first.
        let forces: [&[f64]; COLUMNS_AT_ONCE] =
            std::array::from_fn(|w| forces.get(w).map_or(*first, |(_, force)| *force));
        let mut places: [&mut [f64]; COLUMNS_AT_ONCE] = std::array::from_fn(|_| <&mut [f64]>::default());
        for ((place, out), begin) in places.iter_mut().zip(out).zip(begins) {
            out.resize(begin + samples, 0.0);
            *place = &mut out[begin..];
        }
        dispatch!(Level::new(), _simd => self.displace_here(forces.map(|force| &force[..samples]), weight, &mut places));
    }

    #[inline(always)] // into each width of registers
    fn displace_here(&self, forces: [&[f64]; COLUMNS_AT_ONCE], weight: f64, out: &mut [&mut [f64]; COLUMNS_AT_ONCE]) {
        let Oscillator { step, before, after, .. } = &self.oscillator;
        let samples = forces[0].len();
        let (mut p, mut v) = ([0.0; COLUMNS_AT_ONCE], [0.0; COLUMNS_AT_ONCE]);
        for k in 1..samples {
            let left = self.left.get(k - 1).copied().unwrap_or(1.0);
            let pull = self.pull.get(k - 1).copied().unwrap_or(0.0);
            for w in 0..COLUMNS_AT_ONCE {
                let (now, then) = (forces[w][k - 1], forces[w][k]);
                let kicked = left * v[w] - pull * p[w];
                (p[w], v[w]) = (
                    step[0] * p[w] + step[1] * kicked + before[0] * now + after[0] * then,
                    step[2] * p[w] + step[3] * kicked + before[1] * now + after[1] * then,
                );
                v[w] = left * v[w] - pull * p[w];
            }
            for (out, p) in out.iter_mut().zip(p).filter(|(out, _)| !out.is_empty()) {
                out[k] = weight * p;
            }
        }
    }

    /// The half kick of an interval; `scratch` is as long as the state.
    fn kick(&self, k: usize, state: &mut [f64], scratch: &mut [f64]) {
        let n = state.len() / 2;
        let place = k * n * n..(k + 1) * n * n;
        let (Some(left), Some(pull)) = (self.left.get(place.clone()), self.pull.get(place)) else { return };
        let (p, v) = state.split_at_mut(n);
        for (i, kicked) in scratch[..n].iter_mut().enumerate() {
            *kicked = 0.0;
            for (j, v) in v.iter().enumerate() {
                *kicked += left[i * n + j] * v - pull[i * n + j] * p[j];
            }
        }
        v.copy_from_slice(&scratch[..n]);
    }

    /// The deceleration of a mass by the slopes at a sample; across a jump, whose slope is none, by those of the constant
    /// system.
    fn pulled(&self, k: usize, mass: usize, state: &[f64]) -> f64 {
        let Oscillator { stiffness, damping, interval, .. } = &self.oscillator;
        let n = state.len() / 2;
        let place = (k * n + mass) * n..(k * n + mass + 1) * n;
        let own = self.slopes.stiffness.get(place.clone()).zip(self.slopes.damping.get(place));
        let steep = |slopes: &[f64]| (0..n).any(|j| (slopes[j] - damping[(mass, j)]).abs() * interval > STEEP);
        match own.filter(|(_, slopes)| !steep(slopes)) {
            Some((k, c)) => (0..n).map(|j| k[j] * state[j] + c[j] * state[n + j]).sum(),
            None => (0..n).map(|j| stiffness[(mass, j)] * state[j] + damping[(mass, j)] * state[n + j]).sum(),
        }
    }
}

/// What a half kick leaves of the velocities, by the exponential of its matrix; negative damping is held within bounds.
fn kick(exponent: &DMatrix<f64>) -> Vec<f64> {
    let n = exponent.nrows();
    if n == 1 {
        return vec![exponent[0].min(SPUR).exp()];
    }
    if exponent.iter().all(|e| *e == 0.0) {
        return DMatrix::<f64>::identity(n, n).iter().copied().collect();
    }
    // No eigenvalue exceeds the largest sum of a row (Gershgorin).
    let row = |i: usize| exponent[(i, i)] + (0..n).filter(|j| *j != i).map(|j| exponent[(i, j)].abs()).sum::<f64>();
    let growth = (0..n).map(row).fold(0.0, f64::max);
    let kicked = (exponent * (SPUR / growth.max(SPUR))).exp();
    let sound = kicked.iter().all(|v| v.is_finite());
    (0..n * n).map(|k| if sound { kicked[(k / n, k % n)] } else { f64::from(u8::from(k / n == k % n)) }).collect()
}

/// Damping that takes more than this share of the velocity within a sample is a jump's.
const STEEP: f64 = 0.5;

/// What the smoother says of `e` and of the missing forces: `[mass][sample]`.
#[derive(Clone, Debug, Default)]
pub(super) struct Smoothed {
    pub(super) displacement: Vec<Vec<f64>>,
    pub(super) velocity: Vec<Vec<f64>>,
    pub(super) force: Vec<Vec<f64>>,
    /// Standard deviations of velocity and force.
    pub(super) velocity_deviation: Vec<Vec<f64>>,
    pub(super) force_deviation: Vec<Vec<f64>>,
}

/// What the sensors see of a system, and how its forces wander.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensing<'a> {
    /// Period of the motion, s.
    pub(super) period: f64,
    /// What each mass's sensor shows, and what it counts.
    pub(super) outputs: &'a [(Output, f64)],
    /// How far each mass moves beside the first: forces wander likewise.
    pub(super) reach: &'a [f64],
}

struct StateWalk {
    masses: usize,
    f: DMatrix<f64>,
    q: DMatrix<f64>,
    /// What each sensor shows of (e, e′, f), and the inverse of what it counts.
    shown: DMatrix<f64>,
    unit: Vec<f64>,
    outputs: Vec<Output>,
}

/// Periods within which a force that no sensor of velocity or acceleration sees, a constant one, is forgotten.
const FORGOTTEN: f64 = 5.0;

/// Transition and process noise of (e, e′, f) for random walks of unit intensity.
fn walk(oscillator: &Oscillator, seen: Sensing<'_>) -> StateWalk {
    let n = oscillator.masses();
    let h = oscillator.interval;
    let system = Oscillator::matrix(&oscillator.stiffness, &oscillator.damping);
    let mut a = DMatrix::zeros(3 * n, 3 * n);
    a.view_mut((0, 0), (2 * n, 2 * n)).copy_from(&system);
    a.view_mut((n, 2 * n), (n, n)).fill_with_identity();
    let mut shown = DMatrix::zeros(seen.outputs.len(), 3 * n);
    for (i, (output, weight)) in seen.outputs.iter().enumerate() {
        match output {
            Output::Displacement(mass) => shown[(i, *mass)] = *weight,
            Output::Velocity(mass) => shown[(i, n + mass)] = *weight,
            Output::Acceleration(mass) => {
                let row = a.row(n + mass) * *weight;
                shown.row_mut(i).copy_from(&row);
            }
        }
    }
    for (output, _) in seen.outputs {
        if let Output::Velocity(mass) | Output::Acceleration(mass) = output {
            a[(2 * n + mass, 2 * n + mass)] = -(FORGOTTEN * seen.period).recip();
        }
    }
    let pushes = DMatrix::from_fn(3 * n, n, |i, j| if i == 2 * n + j { seen.reach[j] } else { 0.0 });
    let mut q = DMatrix::zeros(3 * n, 3 * n);
    // Gauss–Legendre, five points: exact to order nine, and the step is short beside the period.
    for (x, w) in [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ] {
        let g = (&a * (0.5 * h * (1.0 + x))).exp() * &pushes;
        q += &g * g.transpose() * (0.5 * h * w);
    }
    StateWalk {
        masses: n,
        f: (a * h).exp(),
        q,
        shown,
        unit: seen.outputs.iter().map(|(_, weight)| weight.recip()).collect(),
        outputs: seen.outputs.iter().map(|(output, _)| *output).collect(),
    }
}

/// A Kalman filter's covariance and gain, which settle: from then on they are not computed again.
struct Filter<'a> {
    walk: &'a StateWalk,
    q: DMatrix<f64>,
    /// Covariance before and after the sample was seen.
    predicted: DMatrix<f64>,
    filtered: DMatrix<f64>,
    gain: DMatrix<f64>,
    /// Inverse of the innovation's covariance, and the logarithm of its determinant.
    inverse: DMatrix<f64>,
    log: f64,
    settled: bool,
}

/// Relative change of a covariance from one sample to the next at which it has settled.
const SETTLED: f64 = 1e-13;

impl<'a> Filter<'a> {
    fn new(walk: &'a StateWalk, predicted: DMatrix<f64>, ratio: f64) -> Self {
        let none = DMatrix::zeros(0, 0);
        let mut filter = Self {
            walk,
            q: &walk.q * ratio,
            filtered: predicted.clone(),
            predicted,
            gain: none.clone(),
            inverse: none,
            log: 0.0,
            settled: false,
        };
        filter.see();
        filter
    }

    fn see(&mut self) {
        let p = &self.predicted;
        let seen = p * self.walk.shown.transpose();
        let m = seen.ncols();
        let s = &self.walk.shown * &seen + DMatrix::identity(m, m);
        let Some(factor) = s.cholesky() else { return };
        self.log = factor.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
        self.inverse = factor.inverse();
        self.gain = &seen * &self.inverse;
        self.filtered = p - &self.gain * seen.transpose();
    }

    fn next(&mut self) {
        if self.settled {
            return;
        }
        let next = &self.walk.f * &self.filtered * self.walk.f.transpose() + &self.q;
        let still = |i: usize| (next[(i, i)] - self.predicted[(i, i)]).abs() <= SETTLED * next[(i, i)];
        self.settled = (0..next.nrows()).all(still);
        self.predicted = next;
        self.see();
    }
}

/// The mean of a state as samples are seen, without memory asked for at each.
struct Mean {
    value: DVector<f64>,
    next: DVector<f64>,
    innovation: DVector<f64>,
}

impl Mean {
    fn new(value: DVector<f64>, sensors: usize) -> Self {
        Self { next: value.clone(), value, innovation: DVector::zeros(sensors) }
    }

    /// Corrects it by sample `k` of series that stand one behind the other.
    fn see(&mut self, filter: &Filter<'_>, e: &[f64], k: usize) {
        let samples = e.len() / self.innovation.len().max(1);
        for (i, innovation) in self.innovation.iter_mut().enumerate() {
            let expected: f64 = (0..self.value.len()).map(|j| filter.walk.shown[(i, j)] * self.value[j]).sum();
            *innovation = e[i * samples + k] - expected;
        }
        for (j, value) in self.value.iter_mut().enumerate() {
            *value += (0..self.innovation.len()).map(|i| filter.gain[(j, i)] * self.innovation[i]).sum::<f64>();
        }
    }

    fn advance(&mut self, f: &DMatrix<f64>) {
        for (i, next) in self.next.iter_mut().enumerate() {
            *next = (0..self.value.len()).map(|j| f[(i, j)] * self.value[j]).sum();
        }
        std::mem::swap(&mut self.value, &mut self.next);
    }

    /// The squared innovation over its variance.
    fn surprise(&self, filter: &Filter<'_>) -> f64 {
        let m = self.innovation.len();
        let term = |i: usize, j: usize| self.innovation[i] * filter.inverse[(i, j)] * self.innovation[j];
        (0..m).flat_map(|i| (0..m).map(move |j| (i, j))).map(|(i, j)| term(i, j)).sum()
    }
}

/// Log-likelihood of the series under random walks of `ratio` times the noise's variance, that variance being whatever
/// suits best, and the variance.
fn likelihood(walk: &StateWalk, series: &[&[f64]], ratio: f64) -> (f64, f64) {
    let (mut squares, mut logs, mut count) = (0.0, 0.0, 0usize);
    for e in series {
        let (m, p) = start(e, ratio, walk);
        let mut filter = Filter::new(walk, p, ratio);
        let mut mean = Mean::new(m, walk.outputs.len());
        for k in 0..e.len() / walk.outputs.len().max(1) {
            mean.see(&filter, e, k);
            squares += mean.surprise(&filter);
            logs += filter.log;
            mean.advance(&walk.f);
            filter.next();
        }
        count += e.len();
    }
    let variance = squares / count.max(1) as f64;
    (-0.5 * (count as f64 * variance.max(f64::MIN_POSITIVE).ln() + logs), variance)
}

/// A wide start: the first samples decide.
fn start(e: &[f64], ratio: f64, walk: &StateWalk) -> (DVector<f64>, DMatrix<f64>) {
    const WIDE: f64 = 1e4;
    let n = walk.masses;
    let samples = e.len() / walk.outputs.len().max(1);
    let mut mean = DVector::zeros(3 * n);
    let mut covariance = DMatrix::zeros(3 * n, 3 * n);
    for (i, output) in walk.outputs.iter().enumerate() {
        let mass = output.mass();
        let unit = walk.unit[i] * walk.unit[i];
        let step = walk.f[(mass, n + mass)].powi(2).max(f64::MIN_POSITIVE);
        let pushed = (ratio * walk.q[(2 * n + mass, 2 * n + mass)] * WIDE).max(1e-300);
        // A hundred deviations of what is shown, or the motion that shows as much.
        let (moved, fast) = match output {
            Output::Displacement(_) => {
                mean[mass] = e.get(i * samples).copied().unwrap_or(0.0) * walk.unit[i];
                (WIDE, WIDE / (WIDE * step))
            }
            Output::Velocity(_) => (WIDE * step * WIDE, WIDE),
            Output::Acceleration(_) => {
                let rate = (walk.shown[(i, mass)] * walk.unit[i]).abs().max(f64::MIN_POSITIVE);
                (WIDE / (rate * rate), WIDE / rate)
            }
        };
        for (place, value) in [(mass, moved * unit), (n + mass, fast * unit), (2 * n + mass, pushed)] {
            covariance[(place, place)] = value;
        }
    }
    (mean, covariance)
}

/// Smooths what a response leaves of several records of one interval, weighted, one sensor's series behind the other's; none if
/// cancelled.
pub(super) fn smooth(
    oscillator: &Oscillator,
    series: &[&[f64]],
    seen: Sensing<'_>,
    cancel: &Cancel,
) -> Option<Vec<Smoothed>> {
    let walk = walk(oscillator, seen);
    let omega = std::f64::consts::TAU / seen.period;
    // The force's change over a period, in units of ω² (of a velocity ω) times the noise's deviation.
    let unit = omega.powi(2 - walk.outputs.first().map_or(0, |o| o.derivatives()) as i32);
    let ratio = |exponent: f64| (10f64.powf(exponent) * unit).powi(2) / seen.period;
    let value = |exponent: f64| (!cancel.is_cancelled()).then(|| likelihood(&walk, series, ratio(exponent)).0);
    let mut best = (f64::NEG_INFINITY, 0.0);
    for k in 0..8 {
        let exponent = -2.5 + f64::from(k);
        let found = value(exponent)?;
        if found > best.0 {
            best = (found, exponent);
        }
    }
    let middle = best.1;
    for offset in [-0.5, 0.5, -0.25, 0.25] {
        let exponent = if f64::abs(offset) > 0.3 { middle } else { best.1 } + offset;
        let found = value(exponent)?;
        if found > best.0 {
            best = (found, exponent);
        }
    }
    let ratio = ratio(best.1);
    let variance = likelihood(&walk, series, ratio).1;
    let smoothed = |e: &&[f64]| (!cancel.is_cancelled()).then(|| smoother(&walk, e, ratio, variance));
    series.iter().map(smoothed).collect()
}

fn smoother(walk: &StateWalk, e: &[f64], ratio: f64, variance: f64) -> Smoothed {
    let n = walk.masses;
    let samples = e.len() / walk.outputs.len().max(1);
    let (m, p) = start(e, ratio, walk);
    let mut filter = Filter::new(walk, p, ratio);
    let mut mean = Mean::new(m, walk.outputs.len());
    let mut filtered = Vec::with_capacity(samples);
    let mut predicted = Vec::with_capacity(samples);
    // Covariances up to where they settle, the last standing for all after it.
    let mut covariances = Vec::new();
    for k in 0..samples {
        predicted.push(mean.value.clone());
        if !filter.settled {
            covariances.push((filter.predicted.clone(), filter.filtered.clone()));
        }
        mean.see(&filter, e, k);
        filtered.push(mean.value.clone());
        mean.advance(&walk.f);
        filter.next();
    }
    let none = vec![vec![0.0; samples]; n];
    let mut out = Smoothed {
        displacement: none.clone(),
        velocity: none.clone(),
        force: none.clone(),
        velocity_deviation: none.clone(),
        force_deviation: none,
    };
    let (Some(mut mean), Some(last)) = (filtered.last().cloned(), covariances.len().checked_sub(1)) else { return out };
    let mut covariance = covariances[last].1.clone();
    let back = |pp: &DMatrix<f64>, fp: &DMatrix<f64>| {
        pp.clone().cholesky().map_or_else(|| DMatrix::zeros(3 * n, 3 * n), |c| c.solve(&(&walk.f * fp)).transpose())
    };
    let mut gain = back(&covariances[last].0, &covariances[last].1);
    let mut settled = false;
    for k in (0..samples).rev() {
        if k + 1 < samples {
            let fp = &covariances[k.min(last)].1;
            let pp = &covariances[(k + 1).min(last)].0;
            if k < last {
                gain = back(pp, fp);
                settled = false;
            }
            mean = &filtered[k] + &gain * (mean - &predicted[k + 1]);
            if !settled {
                let next = fp + &gain * (&covariance - pp) * gain.transpose();
                settled =
                    k > last && (0..3 * n).all(|i| (next[(i, i)] - covariance[(i, i)]).abs() <= SETTLED * next[(i, i)]);
                covariance = next;
            }
        }
        for i in 0..n {
            out.displacement[i][k] = mean[i];
            out.velocity[i][k] = mean[n + i];
            out.force[i][k] = mean[2 * n + i];
            out.velocity_deviation[i][k] = (covariance[(n + i, n + i)].max(0.0) * variance).sqrt();
            out.force_deviation[i][k] = (covariance[(2 * n + i, 2 * n + i)].max(0.0) * variance).sqrt();
        }
    }
    out
}

impl Oscillator {
    /// The free vibrations of a single mass: let go from a unit displacement, and from a unit velocity.
    pub(super) fn free(&self, samples: usize) -> [Vec<f64>; 2] {
        [[1.0, 0.0], [0.0, 1.0]].map(|start| {
            let (mut state, mut next) = (start, [0.0; 2]);
            (0..samples)
                .map(|k| {
                    let now = state[0];
                    self.advance(&state, &[], k, &mut next);
                    std::mem::swap(&mut state, &mut next);
                    now
                })
                .collect()
        })
    }
}
