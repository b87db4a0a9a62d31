//! What a small change of each parameter changes of a segment's motion, and the sums of the normal equations.

use nalgebra::{Complex, DMatrix, DVector};

use super::super::driven::imaginary;
use super::super::normal::{Local, NormalBlock};
use super::super::{ClosedModel, Free};
use super::{Course, MODES, SegmentMotion};
use crate::force::Pass;
use crate::limits::CHUNK;

/// Which parameters are free, and where they stand among those that the motion depends on: of each mode frequency, damping,
/// drives and coupling; what is inside the force; the initial state.
#[derive(Clone, Copy)]
struct TangentLayout {
    shared: bool,
    initial: bool,
    of_mode: usize,
    inner_at: usize,
    initial_at: usize,
    count: usize,
}

/// What a small change of each parameter changes of the motion.
pub(super) struct Tangent {
    layout: TangentLayout,
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
    normal: NormalBlock,
    rows: DMatrix<f64>,
    errors: DVector<f64>,
    filled: usize,
    /// Parameters of the rows that segments share.
    own_at: usize,
}

impl Tangent {
    pub(super) fn new(course: &Course<'_>, free: Free) -> Self {
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
            layout: TangentLayout { shared, initial, of_mode, inner_at, initial_at, count },
            re: vec![0.0; m * count],
            im: vec![0.0; m * count],
            motion: vec![0.0; count],
            next: vec![0.0; count],
            force: vec![0.0; count],
            end: vec![0.0; count],
            memory,
            shown: vec![0.0; m * count],
            sum: vec![0.0; count],
            normal: NormalBlock::zeros(all),
            rows: DMatrix::zeros(all, chunk),
            errors: DVector::zeros(chunk),
            filled: 0,
            own_at,
        }
    }

    /// Goes on to the instant that the motion has come to.
    pub(super) fn step(&mut self, course: &Course<'_>, motion: &SegmentMotion, t: usize) {
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
    pub(super) fn show(&mut self, course: &Course<'_>, motion: &SegmentMotion, (t, n): (usize, usize), order: usize) {
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
    pub(super) fn row(&mut self, course: &Course<'_>, sensor: usize, error: f64, shown: &[f64; MODES]) {
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
    pub(super) fn sums(mut self) -> (NormalBlock, Local) {
        if self.filled > 0 {
            self.add();
        }
        let NormalBlock { matrix, gradient } = self.normal;
        let (k, l) = (self.own_at, gradient.len() - self.own_at);
        let block = |at: usize, size: usize| NormalBlock {
            matrix: matrix.view((at, at), (size, size)).into_owned(),
            gradient: gradient.rows(at, size).into_owned(),
        };
        let cross = matrix.view((0, k), (k, l)).into_owned();
        (block(0, k), Local { own: block(k, l), cross, next: None })
    }

    /// What is changed of the state at the end: real and imaginary part of each mode, then the inner state.
    pub(super) fn end(&self, course: &Course<'_>, motion: &SegmentMotion) -> DMatrix<f64> {
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
