//! Integration of a model in steps of a sampling interval or a part of one.

use std::ops::Range;

use super::equations::Equations;
use super::grid::{InputGrid, Node, fill_lanes};
use super::switching::{MAX_CHANGES, Side};
use super::{Limits, Response, Workspace};
use sindyscope_values::term::LANES;

/// A Runge–Kutta method.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RungeKutta {
    /// The classical method: four stages, order four.
    Four,
    /// Seven stages, order six: J. C. Butcher, "On Runge–Kutta processes of high order", J. Austral. Math. Soc. 4 (1964)
    /// 179–194.
    Six,
}

impl RungeKutta {
    /// The stages' distinct places in a step, the end left out.
    fn places(self) -> &'static [f64] {
        match self {
            Self::Four => &[0.0, 0.5],
            Self::Six => &[0.0, 1.0 / 3.0, 0.5, 2.0 / 3.0],
        }
    }
}

/// How an interval is covered: method and number of steps, from coarse to fine.
const LEVELS: [(RungeKutta, usize); 12] = [
    (RungeKutta::Four, 1),
    (RungeKutta::Six, 1),
    (RungeKutta::Six, 2),
    (RungeKutta::Six, 3),
    (RungeKutta::Six, 4),
    (RungeKutta::Six, 6),
    (RungeKutta::Six, 8),
    (RungeKutta::Six, 12),
    (RungeKutta::Six, 16),
    (RungeKutta::Six, 24),
    (RungeKutta::Six, 32),
    (RungeKutta::Six, 48),
];

/// Lanes for blocks of samples; those above serve single steps.
const BLOCK_LANES: usize = LANES - 16;

/// First lane for single steps.
const SINGLE_LANE: usize = BLOCK_LANES + 1;

/// Decay over a step up to which both methods are stable, with some room.
const STABLE_DECAY: f64 = 2.0;

/// Samples from one check of the level to the next.
const SAMPLES_PER_CHECK: usize = 128;

/// Checks in a row that a coarser level must pass before it is taken.
const CHECKS_TO_COARSEN: usize = 3;

/// A coarser level with an error below this share of the tolerance is taken at once.
const COARSEN_AT_ONCE: f64 = 1e-3;

/// Instants at which a step is evaluated: the lanes of its first place and of its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Substep {
    pub(super) lane: usize,
    pub(super) end: usize,
    /// Length, s.
    pub(super) length: f64,
    /// The interval that it lies in, and its beginning and end there as shares of the interval.
    pub(super) sample: usize,
    pub(super) from: f64,
    pub(super) to: f64,
}

/// The state of an integration; `N` is the state vector's length, padded.
pub(super) struct Machine<'a, const N: usize> {
    pub(super) equations: &'a Equations,
    pub(super) grid: &'a InputGrid,
    pub(super) work: &'a mut Workspace,
    matrix: [[f64; N]; N],
    /// What the held signs that stand alone add to the rates.
    pub(super) held: [f64; N],
    pub(super) x: [f64; N],
    /// The rates at `x`.
    pub(super) rate: [f64; N],
    /// The end of the last trial step.
    pub(super) ahead: [f64; N],
    level: usize,
    /// The coarsest level at which a state's own decay is stable; a fast state at rest gives no error to see it by.
    floor: usize,
    /// Checks in a row at which the next coarser level would have done.
    calm: usize,
    /// Range of each state: its largest magnitude so far, or what the forces move it by within an interval.
    pub(super) scale: [f64; N],
    /// Largest error of an interval at the finest level.
    shortfall: [f64; N],
    /// Changes of sides that are still followed within this interval.
    pub(super) changes: usize,
    /// A sign that stands in products has changed: the equations may have become stiffer.
    pub(super) stiffness_changed: bool,
}

impl<'a, const N: usize> Machine<'a, N> {
    pub(super) fn new(equations: &'a Equations, grid: &'a InputGrid, work: &'a mut Workspace) -> Self {
        let mut matrix = [[0.0; N]; N];
        for (row, values) in matrix.iter_mut().zip(equations.matrix.chunks_exact(equations.states)) {
            row[..equations.states].copy_from_slice(values);
        }
        let decay = (0..equations.states).map(|i| -matrix[i][i] * grid.interval()).fold(0.0, f64::max);
        let floor =
            LEVELS.iter().position(|(_, parts)| decay <= STABLE_DECAY * *parts as f64).unwrap_or(LEVELS.len() - 1);
        equations.forcing.prepare_lanes(&mut work.forcing);
        equations.rest.prepare_slots(&mut work.rest);
        equations.curved.prepare_slots(&mut work.curved);
        work.drive.clear();
        work.drive.resize(LANES * N, 0.0);
        work.nodes.resize(LEVELS.len(), Vec::new());
        work.interval.clear();
        work.sliding.clear();
        work.sides.clear();
        work.sides.resize(equations.surfaces.len(), Side::default());
        Self {
            equations,
            grid,
            work,
            matrix,
            held: [0.0; N],
            x: [0.0; N],
            rate: [0.0; N],
            ahead: [0.0; N],
            level: floor,
            floor,
            calm: 0,
            scale: [0.0; N],
            shortfall: [0.0; N],
            changes: MAX_CHANGES,
            stiffness_changed: false,
        }
    }

    pub(super) fn run(&mut self, initial: &[f64], samples: Range<usize>, limits: &Limits<'_>, response: &mut Response) {
        for (x, value) in self.x.iter_mut().zip(&initial[..initial.len().min(self.equations.states)]) {
            *x = *value;
        }
        let mut bounds = [f64::MAX; N];
        for (bound, limit) in bounds.iter_mut().zip(limits.states) {
            *bound = limit.min(f64::MAX);
        }
        for (scale, limit) in self.scale.iter_mut().zip(limits.states) {
            *scale = if limit.is_finite() { 1e-2 * limit } else { 0.0 };
        }
        let mut sample = samples.start;
        let last = samples.end - 1;
        let mut length = usize::MAX;
        let mut next_check = sample;
        let mut allowance = MAX_CHANGES;
        if !self.within(&bounds) {
            response.diverged_at = Some(self.grid.time(sample));
            return;
        }
        self.store(response);
        if sample == last && !limits.rates {
            return;
        }
        self.instants(sample, &[0.0]);
        self.begin(SINGLE_LANE, self.grid.time(sample), response);
        self.store_rates(response);
        while sample < last {
            if (limits.cancelled)() {
                response.cancelled = true;
                break;
            }
            if sample >= next_check {
                self.choose_level(sample, limits.tolerance);
                next_check = sample + SAMPLES_PER_CHECK;
            }
            let (method, parts) = LEVELS[self.level];
            let stride = parts * method.places().len();
            let count = (BLOCK_LANES / stride).min(last - sample).min(length).max(1);
            self.fill(self.level, sample, count);
            let x = self.x;
            self.rate = self.rates(&x, 0);
            length = length.saturating_mul(2);
            for k in 0..count {
                let (before, followed) = (self.x, allowance);
                self.changes = allowance;
                for part in 0..parts {
                    let lane = k * stride + part * method.places().len();
                    let span = Substep {
                        lane,
                        end: lane + method.places().len(),
                        length: self.grid.interval() / parts as f64,
                        sample,
                        from: part as f64 / parts as f64,
                        to: (part + 1) as f64 / parts as f64,
                    };
                    self.step(&span, response);
                }
                sample += 1;
                // A motion that switches without end is followed less and less closely.
                allowance = if self.changes == 0 { (allowance / 2).max(2) } else { (allowance + 1).min(MAX_CHANGES) };
                if !self.within(&bounds) {
                    response.diverged_at = Some(self.grid.time(sample));
                    self.end_sticks(self.grid.time(sample), response);
                    return;
                }
                self.store(response);
                self.store_rates(response);
                response.steps += parts;
                if self.changes == followed && self.rests(&before) {
                    for _ in sample..last {
                        self.store(response);
                        self.store_rates(response);
                    }
                    sample = last;
                    break;
                }
                if self.stiffness_changed {
                    self.stiffness_changed = false;
                    (next_check, length) = (sample, 8);
                    break;
                }
            }
        }
        self.end_sticks(self.grid.time(sample), response);
        response.coarse =
            self.shortfall.iter().zip(&self.scale).any(|(error, scale)| *error > limits.tolerance * scale);
    }

    /// True if something sticks, nothing drives, and no state has moved by more than rounding since `before`: then nothing
    /// will.
    fn rests(&self, before: &[f64; N]) -> bool {
        !self.work.sliding.is_empty()
            && self.equations.externals.is_empty()
            && (0..N).all(|i| (self.x[i] - before[i]).abs() <= f64::EPSILON * self.scale[i])
    }

    fn within(&self, bounds: &[f64; N]) -> bool {
        (0..N).all(|i| self.x[i].abs() <= bounds[i])
    }

    fn store(&mut self, response: &mut Response) {
        for (i, series) in response.states.iter_mut().enumerate().take(N) {
            series.push(self.x[i]);
            self.scale[i] = self.scale[i].max(self.x[i].abs());
        }
    }

    /// The rates at the present state, and on which sides of the surfaces it is, where they are asked for.
    fn store_rates(&self, response: &mut Response) {
        if response.rates.is_empty() {
            return;
        }
        for (series, rate) in response.rates.iter_mut().zip(self.rate) {
            series.push(rate);
        }
        response.sides.push(self.work.sides.iter().fold(0, |all, side| (all << 2) | side.code()));
    }

    /// One step from the present state, switching where the equations do.
    #[inline]
    fn step(&mut self, span: &Substep, response: &mut Response) {
        let (x, rate) = (self.x, self.rate);
        let next = self.advance(&x, &rate, span);
        let rate = self.rates(&next, span.end);
        if !self.equations.surfaces.is_empty() {
            self.observe(&next, &rate, span.end);
            if self.disturbed(span.length) {
                self.step_with_switches(span, response);
                return;
            }
            self.accept_sides();
        }
        (self.x, self.rate) = (next, rate);
        if !self.work.sliding.is_empty() {
            self.project(span.end);
        }
    }

    /// The state at the end of a span, signs held (or sliding).
    #[inline]
    pub(super) fn advance(&mut self, x: &[f64; N], k1: &[f64; N], span: &Substep) -> [f64; N] {
        let (h, lane) = (span.length, span.lane);
        match LEVELS[self.level].0 {
            RungeKutta::Four => {
                let k2 = self.rates(&sum(x, 0.5 * h, [(1.0, k1)]), lane + 1);
                let k3 = self.rates(&sum(x, 0.5 * h, [(1.0, &k2)]), lane + 1);
                let k4 = self.rates(&sum(x, h, [(1.0, &k3)]), span.end);
                sum(x, h / 6.0, [(1.0, k1), (2.0, &k2), (2.0, &k3), (1.0, &k4)])
            }
            RungeKutta::Six => {
                let k2 = self.rates(&sum(x, h / 3.0, [(1.0, k1)]), lane + 1);
                let k3 = self.rates(&sum(x, h / 3.0, [(2.0, &k2)]), lane + 3);
                let k4 = self.rates(&sum(x, h / 12.0, [(1.0, k1), (4.0, &k2), (-1.0, &k3)]), lane + 1);
                let k5 = self.rates(&sum(x, h / 16.0, [(-1.0, k1), (18.0, &k2), (-3.0, &k3), (-6.0, &k4)]), lane + 2);
                let k6 = self.rates(&sum(x, h / 8.0, [(9.0, &k2), (-3.0, &k3), (-6.0, &k4), (4.0, &k5)]), lane + 2);
                let k7 = self.rates(
                    &sum(x, h / 44.0, [(9.0, k1), (-36.0, &k2), (63.0, &k3), (72.0, &k4), (-64.0, &k6)]),
                    span.end,
                );
                sum(x, h / 120.0, [(11.0, k1), (81.0, &k3), (81.0, &k4), (-32.0, &k5), (-32.0, &k6), (11.0, &k7)])
            }
        }
    }

    /// The rates of a state at the instant of a lane.
    #[inline]
    pub(super) fn rates(&mut self, x: &[f64; N], lane: usize) -> [f64; N] {
        let mut rates = self.rates_held(x, lane);
        if !self.work.sliding.is_empty() {
            self.slide(x, lane, &mut rates);
        }
        rates
    }

    /// The rates with every sign as it is held; that of a sliding surface counts as zero.
    #[inline]
    #[expect(clippy::needless_range_loop, reason = "loops of constant length over several arrays become straight code")]
    pub(super) fn rates_held(&mut self, x: &[f64; N], lane: usize) -> [f64; N] {
        let drive = &self.work.drive.as_chunks::<N>().0[lane];
        let mut rates = [0.0; N];
        for i in 0..N {
            let mut rate = self.held[i] + drive[i];
            for j in 0..N {
                rate += self.matrix[i][j] * x[j];
            }
            rates[i] = rate;
        }
        if !self.equations.rest_rows.is_empty() {
            let slots = &mut self.work.rest;
            match slots[1..=self.equations.states].as_mut_array::<N>() {
                Some(states) => *states = *x,
                None => slots[1..=self.equations.states].copy_from_slice(&x[..self.equations.states]),
            }
            for address in &self.equations.copied {
                slots[*address] = self.work.forcing[address * LANES + lane];
            }
            self.equations.rest.run(slots);
            for (row, slot) in &self.equations.rest_rows {
                rates[*row] += slots[*slot];
            }
        }
        rates
    }

    /// Computes the forcing at every instant that `count` intervals need at a level.
    fn fill(&mut self, level: usize, sample: usize, count: usize) {
        let (method, parts) = LEVELS[level];
        if self.work.nodes[level].is_empty() {
            let places = (0..parts).flat_map(|p| method.places().iter().map(move |c| (p as f64 + c) / parts as f64));
            self.work.nodes[level] = places.map(Node::new).collect();
        }
        let nodes = &self.work.nodes[level];
        let lanes = 0..count * nodes.len() + 1;
        fill_lanes(self.grid, &self.equations.externals, &mut self.work.forcing, sample..sample + count, nodes);
        self.evaluate_forcing(lanes);
    }

    /// Computes the forcing at places in one interval, from lane [`SINGLE_LANE`] on.
    fn instants(&mut self, sample: usize, places: &[f64]) {
        let Workspace { interval, forcing, .. } = &mut *self.work;
        interval.fill(self.grid, &self.equations.externals, forcing, SINGLE_LANE, sample, places);
        self.evaluate_forcing(SINGLE_LANE..SINGLE_LANE + places.len());
    }

    fn evaluate_forcing(&mut self, lanes: Range<usize>) {
        self.equations.forcing.run_lanes(&mut self.work.forcing, lanes.clone());
        for (row, slot) in &self.equations.forcing_rows {
            let values = &self.work.forcing[slot * LANES..][lanes.clone()];
            let drive = &mut self.work.drive[lanes.start * N + row..];
            for (d, v) in drive.iter_mut().step_by(N).zip(values) {
                *d = *v;
            }
        }
    }

    /// A part of a span, from and to given as shares of the span, with its forcing computed.
    pub(super) fn part(&mut self, span: &Substep, from: f64, to: f64) -> Substep {
        let place = |share: f64| span.from + share * (span.to - span.from);
        let (from, to) = (place(from), place(to));
        let places = LEVELS[self.level].0.places();
        let mut instants = [0.0; 5];
        for (instant, c) in instants.iter_mut().zip(places.iter().chain(&[1.0])) {
            *instant = from + c * (to - from);
        }
        self.instants(span.sample, &instants[..=places.len()]);
        let length = span.length * (to - from) / (span.to - span.from);
        Substep { lane: SINGLE_LANE, end: SINGLE_LANE + places.len(), length, sample: span.sample, from, to }
    }

    /// Takes into each state's range what the forces at a lane, were they not balanced, move it by within an interval: a
    /// mass that sticks has no other range than rounding.
    pub(super) fn widen_scale(&mut self, lane: usize) {
        let h = self.grid.interval();
        let mut reach = [0.0; N];
        for (i, reach) in reach.iter_mut().enumerate() {
            let linear: f64 = self.matrix[i].iter().zip(&self.x).map(|(a, x)| (a * x).abs()).sum();
            let held: f64 = self.equations.surfaces.iter().map(|s| s.gain.get(i).map_or(0.0, |g| g.abs())).sum();
            *reach = h * (linear + held + self.work.drive[lane * N + i].abs() + self.rate[i].abs());
        }
        for i in 0..N {
            let passed: f64 = self.matrix[i].iter().zip(&reach).map(|(a, r)| (a * r).abs()).sum();
            self.scale[i] = self.scale[i].max(reach[i]).max(h * passed);
        }
    }

    /// Compares one interval at this level, the next finer and the next coarser, signs held, and moves to the level that
    /// keeps the tolerance.
    fn choose_level(&mut self, sample: usize, tolerance: f64) {
        let start = self.x;
        let mut present = self.interval(self.level, sample, &start);
        self.widen_scale(0);
        let risen_from = self.level;
        while self.level + 1 < LEVELS.len() {
            let finer = self.interval(self.level + 1, sample, &start);
            if self.difference(&present, &finer) <= tolerance {
                break;
            }
            (self.level, present, self.calm) = (self.level + 1, finer, 0);
        }
        if self.level > risen_from {
            if self.level + 1 == LEVELS.len() {
                // There is no finer one to compare with: the coarser one tells.
                let coarser = self.interval(self.level - 1, sample, &start);
                for ((shortfall, a), b) in self.shortfall.iter_mut().zip(coarser).zip(present) {
                    *shortfall = shortfall.max((a - b).abs() / 8.0);
                }
            }
            return;
        }
        while self.level > self.floor {
            let coarser = self.interval(self.level - 1, sample, &start);
            let difference = self.difference(&coarser, &present);
            self.calm = if difference <= 0.25 * tolerance { self.calm + 1 } else { 0 };
            if difference > COARSEN_AT_ONCE * tolerance && self.calm <= CHECKS_TO_COARSEN {
                break;
            }
            (self.level, present, self.calm) = (self.level - 1, coarser, 0);
        }
    }

    /// The state one interval later at a level, nothing switching.
    fn interval(&mut self, level: usize, sample: usize, start: &[f64; N]) -> [f64; N] {
        let (method, parts) = LEVELS[level];
        let present = std::mem::replace(&mut self.level, level);
        self.fill(level, sample, 1);
        let mut x = *start;
        for part in 0..parts {
            let lane = part * method.places().len();
            let length = self.grid.interval() / parts as f64;
            let span = Substep { lane, end: lane + method.places().len(), length, sample, from: 0.0, to: 1.0 };
            let rate = self.rates(&x, lane);
            x = self.advance(&x, &rate, &span);
        }
        self.level = present;
        x
    }

    /// The largest difference of two states, as a share of each state's range; a difference that is no number counts as
    /// infinite.
    fn difference(&self, a: &[f64; N], b: &[f64; N]) -> f64 {
        let mut worst = 0.0;
        for ((a, b), scale) in a.iter().zip(b).zip(&self.scale) {
            let difference = (a - b).abs();
            if difference > 0.0 || difference.is_nan() {
                let share = difference / scale.max(b.abs()).max(f64::MIN_POSITIVE);
                worst = if share > worst || share.is_nan() { share } else { worst };
            }
        }
        if worst.is_nan() { f64::INFINITY } else { worst }
    }
}

/// `x + h Σ c k`.
#[inline]
fn sum<const N: usize, const S: usize>(x: &[f64; N], h: f64, parts: [(f64, &[f64; N]); S]) -> [f64; N] {
    let mut out = [0.0; N];
    for (i, o) in out.iter_mut().enumerate() {
        let mut total = 0.0;
        for (c, k) in parts {
            total += c * k[i];
        }
        *o = x[i] + h * total;
    }
    out
}
