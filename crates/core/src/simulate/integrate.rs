//! Integration of a model in steps of a sampling interval or a part of one.

use std::ops::Range;

use super::equations::Equations;
use super::grid::{InputGrid, Node, fill_lanes};
use super::switching::{MAX_CHANGES, Side};
use super::{Limits, Response, Workspace};
use sindyscope_values::term::LANES;

/// A Runge–Kutta method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RungeKutta {
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

    /// The state after a step of a length, s, from `x` with its rates `k1`; `lane` is that of the step's first place, `end` that of its
    /// end.
    #[inline(always)] // into each width of registers
    pub(super) fn advance<S: StateVector>(
        self,
        x: &S,
        k1: &S,
        (h, lane, end): (f64, usize, usize),
        mut rates: impl FnMut(&S, usize) -> S,
    ) -> S {
        match self {
            Self::Four => {
                let k2 = rates(&x.plus(0.5 * h, [(1.0, k1)]), lane + 1);
                let k3 = rates(&x.plus(0.5 * h, [(1.0, &k2)]), lane + 1);
                let k4 = rates(&x.plus(h, [(1.0, &k3)]), end);
                x.plus(h / 6.0, [(1.0, k1), (2.0, &k2), (2.0, &k3), (1.0, &k4)])
            }
            Self::Six => {
                let k2 = rates(&x.plus(h / 3.0, [(1.0, k1)]), lane + 1);
                let k3 = rates(&x.plus(h / 3.0, [(2.0, &k2)]), lane + 3);
                let k4 = rates(&x.plus(h / 12.0, [(1.0, k1), (4.0, &k2), (-1.0, &k3)]), lane + 1);
                let k5 = rates(&x.plus(h / 16.0, [(-1.0, k1), (18.0, &k2), (-3.0, &k3), (-6.0, &k4)]), lane + 2);
                let k6 = rates(&x.plus(h / 8.0, [(9.0, &k2), (-3.0, &k3), (-6.0, &k4), (4.0, &k5)]), lane + 2);
                let k7 =
                    rates(&x.plus(h / 44.0, [(9.0, k1), (-36.0, &k2), (63.0, &k3), (72.0, &k4), (-64.0, &k6)]), end);
                x.plus(h / 120.0, [(11.0, k1), (81.0, &k3), (81.0, &k4), (-32.0, &k5), (-32.0, &k6), (11.0, &k7)])
            }
        }
    }
}

/// What a step moves: one state vector, or several side by side.
pub(super) trait StateVector: Copy {
    /// `x + h Σ c k`.
    fn plus<const S: usize>(&self, h: f64, parts: [(f64, &Self); S]) -> Self;
}

impl<const N: usize> StateVector for [f64; N] {
    #[inline(always)] // into each width of registers
    fn plus<const S: usize>(&self, h: f64, parts: [(f64, &Self); S]) -> Self {
        let mut out = [0.0; N];
        for (i, o) in out.iter_mut().enumerate() {
            let mut total = 0.0;
            for (c, k) in parts {
                total += c * k[i];
            }
            *o = self[i] + h * total;
        }
        out
    }
}

impl<const N: usize, const W: usize> StateVector for [[f64; W]; N] {
    #[inline(always)] // into each width of registers
    fn plus<const S: usize>(&self, h: f64, parts: [(f64, &Self); S]) -> Self {
        let mut out = [[0.0; W]; N];
        for (i, o) in out.iter_mut().enumerate() {
            let mut total = [0.0; W];
            for (c, k) in parts {
                total.iter_mut().zip(&k[i]).for_each(|(total, k)| *total += c * k);
            }
            o.iter_mut().zip(&self[i]).zip(total).for_each(|((o, x), total)| *o = x + h * total);
        }
        out
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

/// Intervals that are prepared at once after the level has changed, twice as many each time.
pub(super) const FIRST_INTERVALS: usize = 8;

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

/// How far a run is.
pub(super) struct RunProgress<const N: usize> {
    pub(super) sample: usize,
    last: usize,
    /// Magnitude of each state beyond which the run ends.
    bounds: [f64; N],
    /// Intervals that are prepared at once, at most.
    pub(super) length: usize,
    /// Changes of sides that are followed within one interval.
    allowance: usize,
    /// State and allowance before the last interval.
    before: [f64; N],
    followed: usize,
}

impl<const N: usize> RunProgress<N> {
    pub(super) fn is_on_its_way(&self) -> bool {
        self.sample < self.last
    }
}

/// The level that did with some signs.
#[derive(Clone, Copy, Debug)]
struct KnownLevel {
    signs: u64,
    level: usize,
    /// The sample at which it was found to do.
    found: usize,
    /// The sample from which a coarser one is asked for.
    until: usize,
}

/// The levels that runs side by side were found to need, for the signs that stand in products: these make equations stiffer or less
/// stiff again and again, for each run at an instant of its own.
#[derive(Debug, Default)]
pub(super) struct KnownLevels {
    /// The newest first.
    entries: [Option<KnownLevel>; 8],
}

impl KnownLevels {
    fn entry(&self, signs: u64) -> Option<KnownLevel> {
        self.entries.iter().flatten().copied().find(|entry| entry.signs == signs)
    }

    fn keep(&mut self, entry: KnownLevel) {
        let place = self.entries.iter().position(|e| e.is_none_or(|e| e.signs == entry.signs));
        let last = place.unwrap_or(self.entries.len() - 1);
        self.entries[..=last].rotate_right(1);
        self.entries[0] = Some(entry);
    }
}

/// The state of an integration; `N` is the state vector's length, padded.
pub(super) struct Machine<'a, const N: usize> {
    pub(super) equations: &'a Equations,
    pub(super) grid: &'a InputGrid,
    pub(super) work: &'a mut Workspace,
    pub(super) matrix: [[f64; N]; N],
    /// What the held signs that stand alone add to the rates.
    pub(super) held: [f64; N],
    pub(super) x: [f64; N],
    /// The rates at `x`.
    pub(super) rate: [f64; N],
    /// The end of the last trial step.
    pub(super) ahead: [f64; N],
    pub(super) level: usize,
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
    /// The signs with which the level was last asked for.
    checked: Option<u64>,
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
            checked: None,
        }
    }

    pub(super) fn run(&mut self, initial: &[f64], samples: Range<usize>, limits: &Limits<'_>, response: &mut Response) {
        let Some(mut progress) = self.set_out(initial, samples, limits, response) else { return };
        let mut next_check = progress.sample;
        while progress.is_on_its_way() {
            if (limits.cancelled)() {
                response.cancelled = true;
                break;
            }
            // By itself a run chooses anew at every change of a sign: near a contact that it just grazes, no digit may hang on the past.
            if progress.sample >= next_check {
                self.choose_level(progress.sample, limits.tolerance, true);
                next_check = progress.sample + SAMPLES_PER_CHECK;
            }
            let count = self.most(&progress);
            self.prepare(&mut progress, count, None);
            for k in 0..count {
                self.depart(&mut progress);
                for part in 0..LEVELS[self.level].1 {
                    self.step(&self.substep(progress.sample, k, part), response);
                }
                self.arrive(&mut progress, response);
                if !progress.is_on_its_way() {
                    break;
                }
                if self.is_stiffness_new() {
                    (next_check, progress.length) = (progress.sample, FIRST_INTERVALS);
                    break;
                }
            }
        }
        self.end(&progress, limits, response);
    }

    /// Begins a run; none where it ends at once.
    pub(super) fn set_out(
        &mut self,
        initial: &[f64],
        samples: Range<usize>,
        limits: &Limits<'_>,
        response: &mut Response,
    ) -> Option<RunProgress<N>> {
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
        let (sample, last) = (samples.start, samples.end - 1);
        if !self.within(&bounds) {
            response.diverged_at = Some(self.grid.time(sample));
            return None;
        }
        self.store(response);
        if sample == last && !limits.rates {
            return None;
        }
        self.instants(sample, &[0.0]);
        self.begin(SINGLE_LANE, self.grid.time(sample), response);
        self.store_rates(response);
        let (length, allowance) = (usize::MAX, MAX_CHANGES);
        Some(RunProgress { sample, last, bounds, length, allowance, before: self.x, followed: allowance })
    }

    /// Sampling intervals that can be prepared at once from where a run is.
    pub(super) fn most(&self, progress: &RunProgress<N>) -> usize {
        let (method, parts) = LEVELS[self.level];
        let stride = parts * method.places().len();
        (BLOCK_LANES / stride).min(progress.last - progress.sample).min(progress.length).max(1)
    }

    /// Computes the forcing of so many intervals, and the rates where they begin; what comes from outside is taken over from another run
    /// along the same samples, if there is one.
    pub(super) fn prepare(&mut self, progress: &mut RunProgress<N>, count: usize, beside: Option<&Self>) {
        match beside {
            Some(other) => self.take_over(other, progress.sample, count),
            None => self.fill(self.level, progress.sample, count),
        }
        let x = self.x;
        self.rate = self.rates(&x, 0);
        progress.length = progress.length.saturating_mul(2);
    }

    /// Method and number of steps by which an interval is covered.
    pub(super) fn division(&self) -> (RungeKutta, usize) {
        LEVELS[self.level]
    }

    /// A part of the interval that is the `k`-th of those prepared.
    pub(super) fn substep(&self, sample: usize, k: usize, part: usize) -> Substep {
        let (method, parts) = LEVELS[self.level];
        let places = method.places().len();
        let lane = (k * parts + part) * places;
        let (parts, place) = (parts as f64, part as f64);
        let (from, to) = (place / parts, (place + 1.0) / parts);
        Substep { lane, end: lane + places, length: self.grid.interval() / parts, sample, from, to }
    }

    /// Before the steps of an interval.
    pub(super) fn depart(&mut self, progress: &mut RunProgress<N>) {
        (progress.before, progress.followed) = (self.x, progress.allowance);
        self.changes = progress.allowance;
    }

    /// After the steps of an interval.
    pub(super) fn arrive(&mut self, progress: &mut RunProgress<N>, response: &mut Response) {
        progress.sample += 1;
        // A motion that switches without end is followed less and less closely.
        let calm = self.changes == 0;
        progress.allowance =
            if calm { (progress.allowance / 2).max(2) } else { (progress.allowance + 1).min(MAX_CHANGES) };
        if !self.within(&progress.bounds) {
            response.diverged_at = Some(self.grid.time(progress.sample));
            progress.last = progress.sample;
            return;
        }
        self.store(response);
        self.store_rates(response);
        response.steps += LEVELS[self.level].1;
        if self.changes == progress.followed && self.rests(&progress.before) {
            for _ in progress.sample..progress.last {
                self.store(response);
                self.store_rates(response);
            }
            progress.sample = progress.last;
        }
    }

    /// True if a sign that stands in products has changed in the last interval, which may have made the equations stiffer.
    pub(super) fn is_stiffness_new(&mut self) -> bool {
        std::mem::take(&mut self.stiffness_changed)
    }

    /// The level that a run's next intervals need. Where signs change it is at least what did with the same signs before; whether a
    /// coarser one does is asked now and then.
    pub(super) fn level_at(&mut self, sample: usize, tolerance: f64, levels: &mut KnownLevels) -> usize {
        self.stiffness_changed = false;
        let pattern = self.pattern();
        let entered = self.checked != Some(pattern);
        self.checked = Some(pattern);
        let known = levels.entry(pattern);
        let Some(entry) = known.filter(|entry| sample < entry.until) else {
            self.level = known.map_or(self.level, |entry| entry.level);
            self.choose_level(sample, tolerance, true);
            levels.keep(KnownLevel {
                signs: pattern,
                level: self.level,
                found: sample,
                until: sample + SAMPLES_PER_CHECK,
            });
            return self.level;
        };
        self.level = entry.level;
        // A run abreast may have asked a moment ago.
        if entered && sample > entry.found + FIRST_INTERVALS {
            self.choose_level(sample, tolerance, false);
            levels.keep(KnownLevel { level: self.level, found: sample, ..entry });
        }
        self.level
    }

    /// The signs that stand in products, as one number.
    fn pattern(&self) -> u64 {
        let mixed = self.equations.surfaces.iter().zip(&self.work.sides).filter(|(surface, _)| surface.mixed);
        mixed.fold(0, |all, (_, side)| (all << 2) | side.code())
    }

    /// Ends a run.
    pub(super) fn end(&mut self, progress: &RunProgress<N>, limits: &Limits<'_>, response: &mut Response) {
        self.end_sticks(self.grid.time(progress.sample), response);
        let missed = |(error, scale): (&f64, &f64)| *error > limits.tolerance * scale;
        response.coarse = response.diverged_at.is_none() && self.shortfall.iter().zip(&self.scale).any(missed);
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
    pub(super) fn step(&mut self, span: &Substep, response: &mut Response) {
        let (x, rate) = (self.x, self.rate);
        let next = self.advance(&x, &rate, span);
        let rate = self.rates(&next, span.end);
        self.finish(next, rate, span, response);
    }

    /// Ends a step whose end and rates there are known with every sign as it was held: switching where the equations do.
    #[inline]
    pub(super) fn finish(&mut self, next: [f64; N], rate: [f64; N], span: &Substep, response: &mut Response) {
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
        let method = LEVELS[self.level].0;
        method.advance(x, k1, (span.length, span.lane, span.end), |x, lane| self.rates(x, lane))
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

    /// Takes the forcing of `count` intervals over from another run along the same samples, prepared at the same level.
    fn take_over(&mut self, other: &Self, sample: usize, count: usize) {
        let (method, parts) = LEVELS[self.level];
        let lanes = 0..count * parts * method.places().len() + 1;
        if self.equations.externals != other.equations.externals {
            return self.fill(self.level, sample, count);
        }
        let mut copy = |slot: usize| {
            let lanes = slot * LANES..slot * LANES + lanes.end;
            self.work.forcing[lanes.clone()].copy_from_slice(&other.work.forcing[lanes]);
        };
        self.equations.externals.iter().for_each(|(address, _)| copy(*address));
        if self.equations.forcing != other.equations.forcing {
            self.evaluate_forcing(lanes);
            return;
        }
        let of_surfaces = self.equations.surfaces.iter().filter_map(|surface| surface.offset);
        of_surfaces.flat_map(|(value, drift)| [value, drift]).for_each(copy);
        self.work.drive[..lanes.end * N].copy_from_slice(&other.work.drive[..lanes.end * N]);
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
    fn choose_level(&mut self, sample: usize, tolerance: f64, coarser: bool) {
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
        while coarser && self.level > self.floor {
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
