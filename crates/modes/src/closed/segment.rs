//! One segment simulated, and what parameters change of it.

use nalgebra::{Complex, DMatrix, DVector};

use super::super::force::Pass;
use super::super::limits::{CHUNK, FORCE_ITERATIONS, FORCE_TOLERANCE, RUNAWAY};
use super::super::measurement::{Quantity, Series};
use super::driven::{Driven, Propagation, Step, imaginary};
use super::normal::{Block, Local};
use super::{ClosedModel, End, Free, Loop, Segment, SegmentRun, Simulated, State};

/// Most modes of a model; more than the data may choose.
const MODES: usize = 64;

/// A segment with all that stays the same along it.
struct Course<'a> {
    model: &'a ClosedModel,
    of: Loop<'a>,
    series: &'a Series,
    segment: Segment,
    steps: &'a [Step],
    /// ρ of each mode.
    couplings: Vec<f64>,
    /// σ ρ of each mode, over the force's unit.
    pushes: Vec<f64>,
    /// Derivatives by time from the displacement of what the force depends on.
    order: usize,
    /// What a unit of the mean force takes off the motion at the step's end.
    kappa: f64,
    driven: &'a Driven,
    first: &'a State,
}

/// The simulation at one instant.
struct Motion {
    /// The force's part of the states, now and before the last step.
    forced: Vec<Complex<f64>>,
    before: Vec<Complex<f64>>,
    states: Vec<Complex<f64>>,
    /// Free oscillations of unit size.
    swings: Vec<Complex<f64>>,
    /// What the force depends on.
    motion: f64,
    /// Its mean over the last step.
    force: f64,
    /// The joint's inner state, where the force has one.
    memory: f64,
    pass: Pass,
}

impl ClosedModel {
    /// Simulates one segment; with `free`, sums of the normal equations too. None where the response runs away.
    ///
    /// `along` belongs to the segment's record; `driven` is what inputs make of the modes, where that is known already.
    pub(super) fn run_segment(
        &self,
        of: Loop<'_>,
        which: usize,
        free: Option<Free>,
        along: &Propagation,
        driven: Option<&Driven>,
    ) -> Option<SegmentRun> {
        let segment = of.segments[which];
        let shared_free = free.is_some_and(|f| f != Free::Initial);
        let own;
        let driven = match driven {
            Some(driven) => driven,
            None => {
                own = Driven::new(self, along, segment, shared_free);
                &own
            }
        };
        let rest = State::rest(self.modes());
        let first = self.initial.get(which).unwrap_or(&rest);
        let course = Course::new(self, of, segment, (along, driven), first);
        let mut motion = Motion::new(self.modes(), first.memory);
        let mut tangent = free.map(|free| Tangent::new(&course, free));
        let samples = (driven.instants - 1) / of.parts + 1;
        let mut out = Simulated {
            squares: 0.0,
            samples: samples * self.sensors(),
            residuals: vec![vec![Vec::with_capacity(samples); self.sensors()]],
            forces: vec![Vec::with_capacity(driven.instants)],
        };
        let joined = of.is_joined(which);
        for t in 0..driven.instants {
            motion.step(&course, t)?;
            if let Some(tangent) = &mut tangent {
                tangent.step(&course, &motion, t);
            }
            out.forces[0].push(motion.pass.end / self.unit);
            if t % of.parts != 0 || (joined && t + 1 == driven.instants) {
                continue;
            }
            course.read(&motion, t, tangent.as_mut(), &mut out)?;
        }
        let by = tangent.as_ref().filter(|_| joined).map(|t| t.end(&course, &motion));
        let states = State { modes: motion.states, memory: motion.memory };
        Some((out, tangent.map(Tangent::sums), End { states, by }))
    }

    /// The mean force of a step: the root of `f − mean(f)`, from a guess; `mean` gives the mean along the motion that the
    /// force leaves, and its slope by the motion's end, of which a unit of the force takes off `rate`.
    fn solved(&self, guess: f64, mean: impl Fn(f64) -> (f64, f64), rate: f64) -> Option<f64> {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut force = guess;
        for _ in 0..FORCE_ITERATIONS {
            let (value, slope) = mean(force);
            let error = force - value;
            if !error.is_finite() {
                return None;
            }
            if error.abs() <= FORCE_TOLERANCE * (self.unit + force.abs()) {
                return Some(force);
            }
            if error > 0.0 {
                high = high.min(force);
            } else {
                low = low.max(force);
            }
            let whole = 1.0 + slope * rate;
            let next = force - error / whole;
            force = if whole > 0.0 && next > low && next < high {
                next
            } else if low.is_finite() && high.is_finite() {
                0.5 * (low + high)
            } else {
                value
            };
        }
        Some(force)
    }
}

impl<'a> Course<'a> {
    fn new(
        model: &'a ClosedModel,
        of: Loop<'a>,
        segment: Segment,
        (along, driven): (&'a Propagation, &'a Driven),
        first: &'a State,
    ) -> Self {
        let (series, steps) = (&of.series[segment.record], along.steps.as_slice());
        let couplings: Vec<f64> = (0..model.modes()).map(|i| model.coupling(i)).collect();
        let pushes: Vec<f64> = couplings.iter().map(|rho| model.sign * rho / model.unit).collect();
        let order = usize::from(model.effect.is_of_velocity());
        let each = steps.iter().zip(&couplings).zip(&pushes);
        let kappa = each.map(|((s, rho), push)| rho * push * imaginary(s.shows[order], s.weight)).sum::<f64>();
        Self { model, of, series, segment, steps, couplings, pushes, order, kappa, driven, first }
    }

    /// What each sensor shows at a sample beside what it measured; with a tangent, its row of the normal equations.
    fn read(&self, motion: &Motion, t: usize, mut tangent: Option<&mut Tangent>, out: &mut Simulated) -> Option<()> {
        let (model, n) = (self.model, self.segment.start + t / self.of.parts);
        let m = self.steps.len().min(MODES);
        for quantity in [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration] {
            if self.of.sensors.iter().all(|s| s.quantity != quantity) {
                continue;
            }
            let order = quantity.derivatives() as usize;
            let mut shown = [0.0; MODES];
            for (i, shown) in shown.iter_mut().enumerate().take(m) {
                *shown = imaginary(self.steps[i].shows[order], motion.states[i]);
                if order == 2 {
                    let driven = model.drive[i].iter().zip(&self.series.inputs).map(|(b, u)| b * u[n]).sum::<f64>();
                    *shown += driven - self.pushes[i] * motion.pass.end;
                }
            }
            if let Some(tangent) = &mut tangent {
                tangent.show(self, motion, (t, n), order);
            }
            for (k, _) in self.of.sensors.iter().enumerate().filter(|(_, s)| s.quantity == quantity) {
                let value: f64 = (0..m).map(|i| model.shape[i][k] * shown[i]).sum();
                let offset = self.of.offsets.get(self.segment.record).map_or(0.0, |o| o[k]);
                let error = self.series.outputs[k][n] - offset - value;
                if error.is_nan() || error.abs() >= RUNAWAY {
                    return None;
                }
                out.squares += error * error;
                out.residuals[0][k].push(error);
                if let Some(tangent) = &mut tangent {
                    tangent.row(self, k, error, &shown);
                }
            }
        }
        Some(())
    }
}

impl Motion {
    fn new(modes: usize, memory: f64) -> Self {
        let zero = Complex::new(0.0, 0.0);
        Self {
            forced: vec![zero; modes],
            before: vec![zero; modes],
            states: vec![zero; modes],
            swings: vec![Complex::new(1.0, 0.0); modes],
            motion: 0.0,
            force: 0.0,
            memory,
            pass: Pass::default(),
        }
    }

    /// Goes on to an instant. None where the motion is no number.
    fn step(&mut self, course: &Course<'_>, t: usize) -> Option<()> {
        let (model, m) = (course.model, course.steps.len());
        let linear = &course.driven.linear[t * m..(t + 1) * m];
        let mut free = 0.0;
        for (i, step) in course.steps.iter().enumerate() {
            if t > 0 {
                self.before[i] = self.forced[i];
                self.forced[i] *= step.decay;
                self.swings[i] *= step.decay;
            }
            self.states[i] = linear[i] + course.first.modes[i] * self.swings[i] - self.forced[i];
            free += course.couplings[i] * imaginary(step.shows[course.order], self.states[i]);
        }
        if t == 0 {
            self.motion = free;
            self.pass = model.effect.still(free, model.inner, self.memory);
            return free.is_finite().then_some(());
        }
        let (before, memory) = (self.motion, self.memory);
        let mean = |force: f64| model.effect.mean_and_slope(before, free - course.kappa * force, model.inner, memory);
        self.force = model.solved(self.force, mean, course.kappa)?;
        self.motion = free - course.kappa * self.force;
        self.pass = model.effect.pass(before, self.motion, model.inner, memory);
        for (i, step) in course.steps.iter().enumerate() {
            let pushed = step.weight * (course.pushes[i] * self.force);
            self.forced[i] += pushed;
            self.states[i] -= pushed;
        }
        if model.effect.has_memory() {
            self.memory = self.pass.end;
        }
        self.motion.is_finite().then_some(())
    }
}

/// Which parameters are free, and where they stand among those that the motion depends on: of each mode frequency, damping,
/// drives and coupling; what is inside the force; the initial state.
#[derive(Clone, Copy)]
struct Layout {
    shared: bool,
    initial: bool,
    of_mode: usize,
    inner_at: usize,
    initial_at: usize,
    count: usize,
}

/// What a small change of each parameter changes of the motion.
struct Tangent {
    layout: Layout,
    /// Of the force's part of the states but for what the last step's force added, `[mode][parameter]`.
    re: Vec<f64>,
    im: Vec<f64>,
    /// Of what the force depends on, now and (while a step is made) at its end.
    motion: Vec<f64>,
    next: Vec<f64>,
    /// Of the mean force over the last step, of the force at its end, and of the joint's inner state.
    force: Vec<f64>,
    end: Vec<f64>,
    memory: Vec<f64>,
    /// Of what each mode shows at a sample, `[mode][parameter]`, and their sum as one sensor weighs them.
    shown: Vec<f64>,
    sum: Vec<f64>,
    normal: Block,
    rows: DMatrix<f64>,
    errors: DVector<f64>,
    filled: usize,
    /// Parameters of the rows that segments share.
    own_at: usize,
}

impl Tangent {
    fn new(course: &Course<'_>, free: Free) -> Self {
        let model = course.model;
        let m = model.modes();
        let (shared, initial) = (free != Free::Initial, free != Free::Shared && !model.initial.is_empty());
        let of_mode = if shared { 3 + model.inputs() } else { 0 };
        let inner_at = m * of_mode;
        let initial_at = inner_at + if shared { model.effect.free_inner() } else { 0 };
        let count = initial_at + if initial { model.local() } else { 0 };
        let own_at = if shared { model.shared() } else { 0 };
        let all = own_at + count - initial_at;
        let chunk = CHUNK.min(course.segment.length * model.sensors());
        let mut memory = vec![0.0; count];
        if initial && model.effect.has_memory() {
            memory[initial_at + 2 * m] = 1.0;
        }
        Self {
            layout: Layout { shared, initial, of_mode, inner_at, initial_at, count },
            re: vec![0.0; m * count],
            im: vec![0.0; m * count],
            motion: vec![0.0; count],
            next: vec![0.0; count],
            force: vec![0.0; count],
            end: vec![0.0; count],
            memory,
            shown: vec![0.0; m * count],
            sum: vec![0.0; count],
            normal: Block::zeros(all),
            rows: DMatrix::zeros(all, chunk),
            errors: DVector::zeros(chunk),
            filled: 0,
            own_at,
        }
    }

    /// Goes on to the instant that the motion has come to.
    fn step(&mut self, course: &Course<'_>, motion: &Motion, t: usize) {
        let layout = self.layout;
        let count = layout.count;
        self.next.fill(0.0);
        for (i, step) in course.steps.iter().enumerate() {
            let shows = step.shows[course.order] * course.couplings[i];
            let (re, im) = (&mut self.re[i * count..(i + 1) * count], &mut self.im[i * count..(i + 1) * count]);
            if t > 0 {
                let (decay, push) = (step.decay, step.decay * step.weight * course.pushes[i]);
                let (next, force) = (&mut self.next[..count], &self.force[..count]);
                for p in 0..count {
                    let (a, b, f) = (re[p], im[p], force[p]);
                    let (c, d) = (decay.re * a - decay.im * b + push.re * f, decay.re * b + decay.im * a + push.im * f);
                    (re[p], im[p]) = (c, d);
                    next[p] -= shows.re * d + shows.im * c;
                }
            }
            let next = &mut self.next;
            let at = i * layout.of_mode;
            if layout.shared {
                let mut add = |p: usize, own: Complex<f64>| {
                    re[p] += own.re;
                    im[p] += own.im;
                    next[p] -= imaginary(shows, own);
                };
                if t > 0 {
                    let pushed = course.pushes[i] * motion.force;
                    for which in 0..2 {
                        add(at + which, motion.before[i] * step.decay_by[which] + step.weight_by[which] * pushed);
                    }
                    let unit = course.model.sign / course.model.unit;
                    add(at + layout.of_mode - 1, step.weight * (unit * motion.force));
                }
                for which in 0..2 {
                    let through = imaginary(shows, course.by_pole(motion, t, i, which));
                    let own = step.shows_by[which][course.order] * course.couplings[i];
                    next[at + which] += through + imaginary(own, motion.states[i]);
                }
                for j in 0..layout.of_mode - 3 {
                    next[at + 2 + j] += imaginary(shows, course.by_drive(t, i, j));
                }
                next[at + layout.of_mode - 1] += imaginary(step.shows[course.order], motion.states[i]);
            }
            if layout.initial {
                let swing = motion.swings[i];
                next[layout.initial_at + 2 * i] += imaginary(shows, swing);
                next[layout.initial_at + 2 * i + 1] += imaginary(shows, swing * Complex::new(0.0, 1.0));
            }
        }
        self.follow(course, &motion.pass, t);
        std::mem::swap(&mut self.motion, &mut self.next);
    }

    /// What the force changes, from what the motion at the step's end would change without it.
    fn follow(&mut self, course: &Course<'_>, pass: &Pass, t: usize) {
        let count = self.layout.count;
        let inner = |k: usize| course.model.effect.inner_scale(k, course.model.inner);
        let free_inner = self.layout.inner_at..self.layout.inner_at + course.model.effect.free_inner();
        let free_inner = if self.layout.shared { free_inner } else { 0..0 };
        let (motion, next) = (&self.motion[..count], &mut self.next[..count]);
        let (force, end, memory) = (&mut self.force[..count], &mut self.end[..count], &mut self.memory[..count]);
        if t > 0 {
            let by = pass.mean_by;
            let whole = 1.0 / (1.0 + by.after * course.kappa);
            for p in 0..count {
                force[p] = (by.before * motion[p] + by.after * next[p] + by.memory * memory[p]) * whole;
            }
            for (k, p) in free_inner.clone().enumerate() {
                force[p] += by.inner[k] * inner(k) * whole;
            }
            for p in 0..count {
                next[p] -= course.kappa * force[p];
            }
        }
        let by = pass.end_by;
        for p in 0..count {
            end[p] = by.before * motion[p] + by.after * next[p] + by.memory * memory[p];
        }
        for (k, p) in free_inner.enumerate() {
            end[p] += by.inner[k] * inner(k);
        }
        if course.model.effect.has_memory() {
            memory.copy_from_slice(end);
        }
    }

    /// What is changed of what the modes show at a sample, as sensors of one quantity see them.
    fn show(&mut self, course: &Course<'_>, motion: &Motion, (t, n): (usize, usize), order: usize) {
        let layout = self.layout;
        let count = layout.count;
        for (i, step) in course.steps.iter().enumerate() {
            let shows = step.shows[order];
            let pushed = imaginary(shows, step.weight) * course.pushes[i];
            let at_once = if order == 2 { course.pushes[i] } else { 0.0 };
            let out = &mut self.shown[i * count..(i + 1) * count];
            let (re, im) = (&self.re[i * count..(i + 1) * count], &self.im[i * count..(i + 1) * count]);
            let (force, end) = (&self.force[..count], &self.end[..count]);
            for p in 0..count {
                out[p] = -(shows.re * im[p] + shows.im * re[p] + pushed * force[p] + at_once * end[p]);
            }
            let at = i * layout.of_mode;
            if layout.shared {
                for which in 0..2 {
                    out[at + which] += imaginary(shows, course.by_pole(motion, t, i, which))
                        + imaginary(step.shows_by[which][order], motion.states[i]);
                }
                for j in 0..layout.of_mode - 3 {
                    let direct = if order == 2 { course.series.inputs[j][n] } else { 0.0 };
                    out[at + 2 + j] += imaginary(shows, course.by_drive(t, i, j)) + direct;
                }
                if order == 2 {
                    out[at + layout.of_mode - 1] -= course.model.sign / course.model.unit * motion.pass.end;
                }
            }
            if layout.initial {
                let swing = motion.swings[i];
                out[layout.initial_at + 2 * i] += imaginary(shows, swing);
                out[layout.initial_at + 2 * i + 1] += imaginary(shows, swing * Complex::new(0.0, 1.0));
            }
        }
    }

    /// Adds the row of one sensor.
    fn row(&mut self, course: &Course<'_>, sensor: usize, error: f64, shown: &[f64; MODES]) {
        let (layout, model) = (self.layout, course.model);
        let count = layout.count;
        let sum = &mut self.sum[..count];
        sum.fill(0.0);
        for (shape, changes) in model.shape.iter().zip(self.shown.chunks_exact(count)) {
            let weight = shape[sensor];
            for (sum, change) in sum.iter_mut().zip(changes) {
                *sum += weight * change;
            }
        }
        let all = self.normal.gradient.len();
        let row = &mut self.rows.as_mut_slice()[self.filled * all..(self.filled + 1) * all];
        if layout.shared {
            let (width, own) = (model.of_mode(), layout.of_mode - 1);
            for i in 0..model.modes() {
                let (row, sum) = (&mut row[i * width..(i + 1) * width], &sum[i * layout.of_mode..]);
                row[..own].copy_from_slice(&sum[..own]);
                for (s, e) in model.across.iter().enumerate() {
                    row[own + s] = e * sum[own];
                }
                row[own + sensor] += shown[i];
            }
            row[model.modes() * width..self.own_at].copy_from_slice(&sum[layout.inner_at..layout.initial_at]);
        }
        row[self.own_at..].copy_from_slice(&sum[layout.initial_at..]);
        self.errors[self.filled] = error;
        self.filled += 1;
        if self.filled == self.errors.len() {
            self.add();
        }
    }

    /// Adds the rows to the sums.
    fn add(&mut self) {
        let rows = self.rows.columns(0, self.filled);
        self.normal.matrix.gemm(1.0, &rows, &rows.transpose(), 1.0);
        self.normal.gradient.gemv(1.0, &rows, &self.errors.rows(0, self.filled), 1.0);
        self.filled = 0;
    }

    /// The sums, split into what segments share and the initial state.
    fn sums(mut self) -> (Block, Local) {
        if self.filled > 0 {
            self.add();
        }
        let Block { matrix, gradient } = self.normal;
        let (k, l) = (self.own_at, gradient.len() - self.own_at);
        let block = |at: usize, size: usize| Block {
            matrix: matrix.view((at, at), (size, size)).into_owned(),
            gradient: gradient.rows(at, size).into_owned(),
        };
        let cross = matrix.view((0, k), (k, l)).into_owned();
        (block(0, k), Local { own: block(k, l), cross, next: None })
    }

    /// What is changed of the state at the end: real and imaginary part of each mode, then the inner state.
    fn end(&self, course: &Course<'_>, motion: &Motion) -> DMatrix<f64> {
        let (layout, model) = (self.layout, course.model);
        let count = layout.count;
        let mut by = DMatrix::zeros(model.local(), self.own_at + count - layout.initial_at);
        let t = course.driven.instants - 1;
        let mut of_row = vec![0.0; count];
        for i in 0..model.modes() {
            let push = course.steps[i].weight * course.pushes[i];
            let parts = [(&self.re, push.re), (&self.im, push.im)];
            for (k, (forced, push)) in parts.into_iter().enumerate() {
                let part = |z: Complex<f64>| if k == 0 { z.re } else { z.im };
                for p in 0..count {
                    of_row[p] = -(forced[i * count + p] + push * self.force[p]);
                }
                if layout.shared {
                    let at = i * layout.of_mode;
                    for which in 0..2 {
                        of_row[at + which] += part(course.by_pole(motion, t, i, which));
                    }
                    for j in 0..layout.of_mode - 3 {
                        of_row[at + 2 + j] += part(course.by_drive(t, i, j));
                    }
                }
                if layout.initial {
                    of_row[layout.initial_at + 2 * i] += part(motion.swings[i]);
                    of_row[layout.initial_at + 2 * i + 1] += part(motion.swings[i] * Complex::new(0.0, 1.0));
                }
                self.spread(model, &of_row, |p, v| by[(2 * i + k, p)] += v);
            }
        }
        if model.effect.has_memory() {
            self.spread(model, &self.memory, |p, v| by[(2 * model.modes(), p)] += v);
        }
        by
    }

    /// Tells a row over what the motion depends on as one over the model's parameters.
    fn spread(&self, model: &ClosedModel, row: &[f64], mut add: impl FnMut(usize, f64)) {
        let layout = self.layout;
        if layout.shared {
            let (width, own) = (model.of_mode(), layout.of_mode - 1);
            for i in 0..model.modes() {
                (0..own).for_each(|p| add(i * width + p, row[i * layout.of_mode + p]));
                let by_coupling = row[i * layout.of_mode + own];
                model.across.iter().enumerate().for_each(|(s, e)| add(i * width + own + s, e * by_coupling));
            }
            let inner = row[layout.inner_at..layout.initial_at].iter().enumerate();
            inner.for_each(|(k, v)| add(model.modes() * width + k, *v));
        }
        row[layout.initial_at..].iter().enumerate().for_each(|(p, v)| add(self.own_at + p, *v));
    }
}

impl Course<'_> {
    /// What the logarithm of a mode's frequency or damping changes of its state without the force.
    fn by_pole(&self, motion: &Motion, t: usize, mode: usize, which: usize) -> Complex<f64> {
        let step = self.series.interval / self.of.parts as f64;
        let swung = self.first.modes[mode] * motion.swings[mode];
        let driven = self.driven.by_pole[t * self.steps.len() + mode][which];
        driven + swung * self.steps[mode].lambda_by[which] * (t as f64 * step)
    }

    /// What a unit of an input makes of a mode's state.
    fn by_drive(&self, t: usize, mode: usize, input: usize) -> Complex<f64> {
        self.driven.by_drive[(t * self.steps.len() + mode) * self.model.inputs() + input]
    }
}
