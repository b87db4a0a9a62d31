//! A structure with one force that its own motion makes, simulated and fitted.
//!
//! `qᵢ″ + 2ζᵢωᵢ qᵢ′ + ωᵢ² qᵢ = Σⱼ bᵢⱼ uⱼ − σ ρᵢ f(x)`, `x = Σᵢ ρᵢ qᵢ` (or its rate), `ρᵢ = Σₛ eₛ φₛᵢ`: a force between points of the structure drives
//! a mode as much as the mode moves these points (reciprocity), so the force's size is that of the shapes, and only its
//! sign σ is left. Between instants the force counts with its mean along a straight path, which makes switching exact to
//! the second order and differentiable; the force at the step's end follows from one scalar equation.

use nalgebra::{Cholesky, Complex, DMatrix, DVector};

use super::force::Effect;
use super::limits::{
    CHUNK, DIFFERENCES, FORCE_ITERATIONS, FORCE_TOLERANCE, LOOP_RIDGE, MAX_CHANGE, RUNAWAY, STRAY_STRETCH,
};
use super::measurement::{Quantity, Sensor, Series};
use super::pole::{self, Pole};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;

/// The parameters.
#[derive(Clone, Debug)]
pub(crate) struct ClosedModel {
    pub(crate) effect: Effect,
    /// Weights eₛ of the sensors in the displacement across the force's place.
    pub(crate) across: Vec<f64>,
    /// σ: 1 or −1.
    pub(crate) sign: f64,
    /// What the force is divided by.
    pub(crate) unit: f64,
    /// The gap, or the velocity within which friction changes its sign.
    pub(crate) inner: f64,
    pub(crate) poles: Vec<Pole>,
    /// `drive[mode][input]`
    pub(crate) drive: Vec<Vec<f64>>,
    /// `shape[mode][sensor]`
    pub(crate) shape: Vec<Vec<f64>>,
    /// `initial[segment][mode]`; empty where the records start at rest.
    pub(crate) initial: Vec<Vec<Complex<f64>>>,
}

/// Which parameters are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Free {
    /// All that records share.
    Shared,
    /// These and the segments' initial states.
    All,
    /// The initial states alone.
    Initial,
}

/// A stretch of a record that is simulated from a state of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Segment {
    pub(crate) record: usize,
    pub(crate) start: usize,
    pub(crate) length: usize,
}

impl Segment {
    /// Every record as one, or its first share.
    pub(crate) fn whole(series: &[Series], share: f64) -> Vec<Self> {
        let of = |(record, s): (usize, &Series)| {
            let length = ((s.len() as f64 * share) as usize).clamp(2, s.len());
            Self { record, start: 0, length }
        };
        series.iter().enumerate().map(of).collect()
    }
}

/// How a model is simulated.
#[derive(Clone, Copy)]
pub(crate) struct Loop<'a> {
    pub(crate) sensors: &'a [Sensor],
    pub(crate) series: &'a [Series],
    pub(crate) segments: &'a [Segment],
    /// `offsets[record][sensor]`
    pub(crate) offsets: &'a [Vec<f64>],
    /// Instants a sampling interval.
    pub(crate) parts: usize,
    /// How stretches that follow each other are held together.
    pub(crate) joint: Option<Joint<'a>>,
}

/// How records are run through: in which segments, and how these are held together.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    pub(crate) segments: Vec<Segment>,
    /// What a jump of each mode's state counts for; empty where nothing is held.
    pub(crate) weights: Vec<f64>,
    pub(crate) rest: bool,
    /// `offsets[record][sensor]`
    pub(crate) offsets: Vec<Vec<f64>>,
}

impl Course {
    pub(crate) fn along<'a>(&'a self, sensors: &'a [Sensor], series: &'a [Series], parts: usize) -> Loop<'a> {
        let joint = (!self.weights.is_empty()).then_some(Joint { weights: &self.weights, rest: self.rest });
        Loop { sensors, series, segments: &self.segments, offsets: &self.offsets, parts, joint }
    }

    /// Series of segments put together to series of records; of neighbours that share `overlap` values the second one's count.
    pub(crate) fn records(&self, of: Loop<'_>, series: Vec<Vec<f64>>, overlap: usize) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = vec![Vec::new(); of.series.len()];
        for (k, (segment, mut values)) in self.segments.iter().zip(series).enumerate() {
            if of.is_joined(k) {
                values.truncate(values.len().saturating_sub(overlap));
            }
            all[segment.record].append(&mut values);
        }
        all
    }

    /// What is left of every record: `residuals[record][sensor][sample]`.
    pub(crate) fn residuals(&self, of: Loop<'_>, simulated: &Simulated) -> Vec<Vec<Vec<f64>>> {
        let sensors = of.sensors.len();
        let of_sensor = |s: usize| {
            let own = simulated.residuals.iter().map(|r| r[s].clone()).collect();
            self.records(of, own, 0)
        };
        let by_sensor: Vec<Vec<Vec<f64>>> = (0..sensors).map(of_sensor).collect();
        (0..of.series.len()).map(|r| by_sensor.iter().map(|s| s[r].clone()).collect()).collect()
    }
}

/// A segment whose last sample is the next one's first is followed by it: the jump of the states counts as an error.
#[derive(Clone, Copy)]
pub(crate) struct Joint<'a> {
    /// What a jump of each mode's state is multiplied by.
    pub(crate) weights: &'a [f64],
    /// True if records begin at rest.
    pub(crate) rest: bool,
}

impl Loop<'_> {
    /// True if a segment is held to the next one.
    fn is_joined(&self, which: usize) -> bool {
        let next = self.segments.get(which + 1);
        let own = self.segments[which];
        self.joint.is_some() && next.is_some_and(|n| n.record == own.record && n.start + 1 == own.start + own.length)
    }
}

/// A simulation.
pub(crate) struct Simulated {
    pub(crate) squares: f64,
    pub(crate) samples: usize,
    /// `residuals[segment][sensor][sample]`
    pub(crate) residuals: Vec<Vec<Vec<f64>>>,
    /// The force (in its unit) at each instant, `forces[segment][instant]`.
    pub(crate) forces: Vec<Vec<f64>>,
}

/// Sums of the normal equations: what segments share, and each one's initial state.
struct Normal {
    shared: Block,
    locals: Vec<Local>,
}

struct Block {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

struct Local {
    own: Block,
    /// Shared parameters by initial states.
    cross: DMatrix<f64>,
    /// Initial states by those of the next segment, where it is held to this one.
    next: Option<DMatrix<f64>>,
}

/// A segment's simulation, its sums of the normal equations where they are asked for, and its end.
type SegmentRun = (Simulated, Option<(Block, Local)>, End);

/// The states at a segment's last sample, and what parameters change of them: shared ones, then the initial states.
struct End {
    states: Vec<Complex<f64>>,
    by: Option<DMatrix<f64>>,
}

impl Block {
    fn zeros(size: usize) -> Self {
        Self { matrix: DMatrix::zeros(size, size), gradient: DVector::zeros(size) }
    }

    /// What the parameters are multiplied by to have sums of squares of one; one for those that do nothing.
    fn scale(&self) -> DVector<f64> {
        self.matrix.diagonal().map(|d| if d > 0.0 { d.sqrt() } else { 1.0 })
    }

    /// The scaled matrix with a damped diagonal.
    fn damped(&self, scale: &DVector<f64>, damping: f64) -> DMatrix<f64> {
        let at = |i: usize, j: usize| {
            let value = self.matrix[(i, j)] / (scale[i] * scale[j]);
            if i == j { value.max(f64::EPSILON) + damping + LOOP_RIDGE } else { value }
        };
        DMatrix::from_fn(scale.len(), scale.len(), at)
    }
}

/// A change of all parameters.
struct Change {
    shared: DVector<f64>,
    /// `local[segment]`
    local: Vec<DVector<f64>>,
}

impl Normal {
    /// Scaled and damped, with the initial states eliminated segment by segment; `size` shared parameters are free.
    fn eliminated(&self, damping: f64, size: usize, scale: &DVector<f64>) -> Option<Eliminated> {
        let mut matrix = self.shared.damped(scale, damping);
        let mut right = self.shared.gradient.component_div(scale);
        let scaled = |local: &Local| {
            let own = local.own.scale();
            let cross = DMatrix::from_fn(size, own.len(), |i, j| local.cross[(i, j)] / (scale[i] * own[j]));
            (local.own.damped(&own, damping), cross, local.own.gradient.component_div(&own), own)
        };
        let mut blocks: Vec<_> = self.locals.iter().map(scaled).collect();
        let mut done = Vec::new();
        for k in 0..blocks.len() {
            let (own, cross, gradient, scale) = blocks[k].clone();
            let factor = Cholesky::new(own)?;
            let (by_cross, by_gradient) = (factor.solve(&cross.transpose()), factor.solve(&gradient));
            if size > 0 {
                matrix -= &cross * &by_cross;
                right -= &cross * &by_gradient;
            }
            let next = self.locals[k].next.as_ref().zip(blocks.get_mut(k + 1)).map(|(next, after)| {
                let next = DMatrix::from_fn(scale.len(), scale.len(), |i, j| next[(i, j)] / (scale[i] * after.3[j]));
                after.0 -= next.tr_mul(&factor.solve(&next));
                if size > 0 {
                    after.1 -= by_cross.tr_mul(&next);
                }
                after.2 -= next.tr_mul(&by_gradient);
                next
            });
            done.push(EliminatedState { factor, gradient, cross, scale, next });
        }
        Some(Eliminated { matrix, right, states: done })
    }

    /// The damped step.
    fn step(&self, damping: f64, free: Free) -> Option<Change> {
        let scale = self.shared.scale();
        let size = if free == Free::Initial { 0 } else { scale.len() };
        let Eliminated { matrix, right, states } = self.eliminated(damping, size, &scale)?;
        let shared = if size > 0 { Cholesky::new(matrix)?.solve(&right) } else { DVector::zeros(0) };
        let mut after: Option<DVector<f64>> = None;
        let mut local = Vec::new();
        for EliminatedState { factor, mut gradient, cross, scale, next } in states.into_iter().rev() {
            if size > 0 {
                gradient -= cross.tr_mul(&shared);
            }
            if let (Some(next), Some(after)) = (next, &after) {
                gradient -= next * after;
            }
            let own = factor.solve(&gradient);
            local.push(own.component_div(&scale));
            after = Some(own);
        }
        local.reverse();
        let shared = if size > 0 { shared.component_div(&scale) } else { DVector::zeros(scale.len()) };
        Some(Change { shared, local })
    }
}

/// Normal equations of the shared parameters, and of each initial state for what they and the next one are.
struct Eliminated {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    states: Vec<EliminatedState>,
}

struct EliminatedState {
    factor: Cholesky<f64, nalgebra::Dyn>,
    gradient: DVector<f64>,
    cross: DMatrix<f64>,
    scale: DVector<f64>,
    next: Option<DMatrix<f64>>,
}

/// Responses of the modes to the inputs of one record on the fine grid, and their derivatives by the poles' logarithms.
struct Driven {
    instants: usize,
    /// `[mode][input][instant]`, `moved[0]` by frequency, `moved[1]` by damping.
    states: Vec<Vec<Vec<Complex<f64>>>>,
    moved: [Vec<Vec<Vec<Complex<f64>>>>; 2],
}

/// What a mode has of constants for a step.
#[derive(Clone, Copy)]
struct Step {
    lambda: Complex<f64>,
    decay: Complex<f64>,
    weight: Complex<f64>,
    /// Imaginary part of the eigenvalue.
    beat: f64,
    /// Derivatives of eigenvalue and imaginary part by the logarithms of frequency and damping.
    by: [(Complex<f64>, f64); 2],
}

impl Step {
    fn new(pole: Pole, step: f64) -> Self {
        let lambda = pole.eigenvalue();
        let decay = (lambda * step).exp();
        let root = lambda.im / pole.omega;
        let by_damping = Complex::new(-pole.damping, -pole.damping * pole.damping / root) * pole.omega;
        Self {
            lambda,
            decay,
            weight: (decay - 1.0) / lambda,
            beat: lambda.im,
            by: [(lambda, lambda.im), (by_damping, by_damping.im)],
        }
    }

    fn shown(&self, derivative: i32, state: Complex<f64>) -> f64 {
        (self.lambda.powi(derivative) * state).im / self.beat
    }

    /// The change of what is shown of a state that stays.
    fn shown_change(&self, derivative: i32, state: Complex<f64>, which: usize) -> f64 {
        let (lambda, beat) = self.by[which];
        let through = if derivative == 0 {
            0.0
        } else {
            (self.lambda.powi(derivative - 1) * lambda * state).im * f64::from(derivative) / self.beat
        };
        through - self.shown(derivative, state) * beat / self.beat
    }
}

impl ClosedModel {
    pub(crate) fn modes(&self) -> usize {
        self.poles.len()
    }

    fn inputs(&self) -> usize {
        self.drive.first().map_or(0, Vec::len)
    }

    fn sensors(&self) -> usize {
        self.across.len()
    }

    /// ρ of a mode.
    pub(crate) fn coupling(&self, mode: usize) -> f64 {
        self.across.iter().zip(&self.shape[mode]).map(|(e, s)| e * s).sum()
    }

    /// Parameters that records share: of each mode frequency, damping, drives, shape; the gap last.
    pub(crate) fn shared(&self) -> usize {
        self.modes() * self.of_mode() + usize::from(self.has_gap())
    }

    fn of_mode(&self) -> usize {
        2 + self.inputs() + self.sensors()
    }

    pub(crate) fn has_gap(&self) -> bool {
        self.effect == Effect::Clearance
    }

    fn moved(&self, change: &Change, free: Free) -> Self {
        let mut new = self.clone();
        let (inputs, width) = (self.inputs(), self.of_mode());
        let shared = &change.shared;
        if free != Free::Initial {
            for i in 0..self.modes() {
                let at = i * width;
                let limited = |k: usize| shared[at + k].clamp(-MAX_CHANGE[k], MAX_CHANGE[k]).exp();
                new.poles[i] = self.poles[i].scaled(limited(0), limited(1));
                for j in 0..inputs {
                    new.drive[i][j] += shared[at + 2 + j];
                }
                for s in 0..self.sensors() {
                    new.shape[i][s] += shared[at + 2 + inputs + s];
                }
            }
            if self.has_gap() {
                new.inner *= shared[self.shared() - 1].clamp(-MAX_CHANGE[2], MAX_CHANGE[2]).exp();
            }
        }
        for (states, local) in new.initial.iter_mut().zip(&change.local) {
            for (i, state) in states.iter_mut().enumerate() {
                *state += Complex::new(local[2 * i], local[2 * i + 1]);
            }
        }
        new
    }

    fn driven(&self, series: &Series, segment: Segment, parts: usize, derivatives: bool) -> Driven {
        let samples = segment.length;
        let instants = (samples - 1) * parts + 1;
        let padded: Vec<Vec<f64>> = series.inputs.iter().map(|u| pole::padded(u)).collect();
        let of = |pole: Pole| -> Vec<Vec<Complex<f64>>> {
            let lambda = pole.eigenvalue();
            let weights = pole::input_weights(lambda, series.interval, parts);
            let decay = (lambda * (series.interval / parts as f64)).exp();
            let along = |padded: &Vec<f64>| {
                let mut state = Complex::new(0.0, 0.0);
                let mut all = Vec::with_capacity(instants);
                all.push(state);
                'all: for n in 0..samples {
                    for weights in &weights {
                        if all.len() == instants {
                            break 'all;
                        }
                        state = decay * state + pole::driven(weights, padded, segment.start + n);
                        all.push(state);
                    }
                }
                all
            };
            padded.iter().map(along).collect()
        };
        let states: Vec<_> = self.poles.iter().map(|p| of(*p)).collect();
        let by = |which: usize| -> Vec<Vec<Vec<Complex<f64>>>> {
            if !derivatives {
                return Vec::new();
            }
            let step = DIFFERENCES[which];
            let moved = |(p, before): (&Pole, &Vec<Vec<Complex<f64>>>)| {
                let p = if which == 0 { p.scaled(1.0 + step, 1.0) } else { p.scaled(1.0, 1.0 + step) };
                let mut new = of(p);
                for (new, old) in new.iter_mut().zip(before) {
                    new.iter_mut().zip(old).for_each(|(n, o)| *n = (*n - o) / step);
                }
                new
            };
            self.poles.iter().zip(&states).map(moved).collect()
        };
        Driven { instants, moved: [by(0), by(1)], states }
    }

    /// Simulates all segments; with `free`, sums of the normal equations too. None where a response runs away.
    fn run(&self, of: Loop<'_>, free: Option<Free>) -> Option<(Simulated, Option<Normal>)> {
        let segments: Vec<usize> = (0..of.segments.len()).collect();
        let each: Vec<Option<SegmentRun>> = segments.par_iter().map(|k| self.run_segment(of, *k, free)).collect();
        let mut all = Simulated { squares: 0.0, samples: 0, residuals: Vec::new(), forces: Vec::new() };
        let mut normal = free.map(|_| Normal { shared: Block::zeros(self.shared()), locals: Vec::new() });
        let mut ends = Vec::new();
        for one in each {
            let (simulated, own, end) = one?;
            ends.push(end);
            all.squares += simulated.squares;
            all.samples += simulated.samples;
            all.residuals.extend(simulated.residuals);
            all.forces.extend(simulated.forces);
            if let (Some(sum), Some((shared, local))) = (&mut normal, own) {
                sum.shared.matrix += shared.matrix;
                sum.shared.gradient += shared.gradient;
                if !self.initial.is_empty() {
                    sum.locals.push(local);
                }
            }
        }
        if let Some(joint) = of.joint {
            self.join(of, joint, &ends, &mut all, normal.as_mut());
        }
        all.squares.is_finite().then_some((all, normal))
    }

    /// Adds what jumps between segments count.
    fn join(&self, of: Loop<'_>, joint: Joint<'_>, ends: &[End], all: &mut Simulated, mut normal: Option<&mut Normal>) {
        let both = |states: &[Complex<f64>]| {
            DVector::from_iterator(2 * states.len(), states.iter().flat_map(|z| [z.re, z.im]))
        };
        let weights = DVector::from_iterator(2 * joint.weights.len(), joint.weights.iter().flat_map(|w| [*w, *w]));
        let square = DMatrix::from_diagonal(&weights.component_mul(&weights));
        for (k, end) in ends.iter().enumerate() {
            if of.segments[k].start == 0 && joint.rest {
                let jump = both(&self.initial[k]).component_mul(&weights);
                all.squares += jump.norm_squared();
                if let Some(normal) = &mut normal {
                    normal.locals[k].own.matrix += &square;
                    normal.locals[k].own.gradient -= jump.component_mul(&weights);
                }
            }
            if !of.is_joined(k) {
                continue;
            }
            let jump = (both(&self.initial[k + 1]) - both(&end.states)).component_mul(&weights);
            all.squares += jump.norm_squared();
            let (Some(normal), Some(by)) = (&mut normal, &end.by) else { continue };
            let mut rows = -by.clone();
            for (mut row, weight) in rows.row_iter_mut().zip(weights.iter()) {
                row *= *weight;
            }
            let shared = self.shared();
            let (first, own) =
                (rows.columns(0, shared).into_owned(), rows.columns(shared, rows.ncols() - shared).into_owned());
            normal.shared.matrix += first.tr_mul(&first);
            normal.shared.gradient -= first.tr_mul(&jump);
            let mut weighed = first.transpose();
            let mut held = own.transpose();
            for (i, weight) in weights.iter().enumerate() {
                weighed.column_mut(i).scale_mut(*weight);
                held.column_mut(i).scale_mut(*weight);
            }
            let local = &mut normal.locals[k];
            local.cross += first.tr_mul(&own);
            local.own.matrix += own.tr_mul(&own);
            local.own.gradient -= own.tr_mul(&jump);
            local.next = Some(held);
            let after = &mut normal.locals[k + 1];
            after.own.matrix += &square;
            after.own.gradient -= jump.component_mul(&weights);
            after.cross += weighed;
        }
    }

    pub(crate) fn simulate(&self, of: Loop<'_>) -> Option<Simulated> {
        self.run(of, None).map(|(s, _)| s)
    }

    fn run_segment(&self, of: Loop<'_>, which: usize, free: Option<Free>) -> Option<SegmentRun> {
        let segment = of.segments[which];
        let (record, series) = (segment.record, &of.series[segment.record]);
        let (m, inputs, sensors) = (self.modes(), self.inputs(), self.sensors());
        let driven = self.driven(series, segment, of.parts, free.is_some_and(|f| f != Free::Initial));
        let step = series.interval / of.parts as f64;
        let steps: Vec<Step> = self.poles.iter().map(|p| Step::new(*p, step)).collect();
        let couplings: Vec<f64> = (0..m).map(|i| self.coupling(i)).collect();
        let derivative = i32::from(self.effect.is_of_velocity());
        let kappa =
            self.sign * (0..m).map(|i| couplings[i].powi(2) * steps[i].shown(derivative, steps[i].weight)).sum::<f64>();
        let initial: Vec<Complex<f64>> =
            self.initial.get(which).cloned().unwrap_or_else(|| vec![Complex::new(0.0, 0.0); m]);
        let shared_free = free.is_some_and(|f| f != Free::Initial);
        let initial_free = free.is_some_and(|f| f != Free::Shared) && !self.initial.is_empty();

        // Dynamic parameters: of each mode frequency, damping, drives and coupling; the gap; initial states.
        let of_mode = 3 + inputs;
        let gap_at = m * of_mode;
        let initial_at = gap_at + 1;
        let count = if free.is_none() { 0 } else { initial_at + if initial_free { 2 * m } else { 0 } };
        let own_initial = self.shared();
        let all = own_initial + if initial_free { 2 * m } else { 0 };
        // Changes of the force's part of the states, [mode][parameter].
        let mut change_re = vec![0.0; m * count];
        let mut change_im = vec![0.0; m * count];
        let mut motion_change = vec![0.0; count];
        let mut new_change = vec![0.0; count];
        let mut force_change = vec![0.0; count];
        let mut shown_change = vec![0.0; m * count];

        let samples = (driven.instants - 1) / of.parts + 1;
        let mut out = Simulated {
            squares: 0.0,
            samples: samples * sensors,
            residuals: vec![vec![Vec::with_capacity(samples); sensors]],
            forces: vec![Vec::with_capacity(driven.instants)],
        };
        let mut normal = free.map(|_| Block::zeros(all));
        let mut rows = DMatrix::<f64>::zeros(all, if free.is_some() { CHUNK } else { 0 });
        let mut errors = DVector::<f64>::zeros(CHUNK);
        let mut filled = 0;

        let mut forced = vec![Complex::new(0.0, 0.0); m];
        let mut free_part = initial;
        let mut states = vec![Complex::new(0.0, 0.0); m];
        let mut bases = vec![Complex::new(0.0, 0.0); m];
        let first = free_part.clone();
        let mut swings = vec![Complex::new(1.0, 0.0); m];
        let mut motion = 0.0;
        let mut force = 0.0;
        for t in 0..driven.instants {
            let time = t as f64 * step;
            if t > 0 {
                for i in 0..m {
                    swings[i] *= steps[i].decay;
                    forced[i] *= steps[i].decay;
                    free_part[i] *= steps[i].decay;
                }
            }
            // The motion that would be without the force of this step.
            let mut pred = 0.0;
            for i in 0..m {
                let mut base = free_part[i];
                for j in 0..inputs {
                    base += driven.states[i][j][t] * self.drive[i][j];
                }
                bases[i] = base;
                states[i] = base - forced[i];
                pred += couplings[i] * steps[i].shown(derivative, states[i]);
            }
            let before = motion;
            let mut slopes = [0.0; 3];
            if t > 0 {
                let mean = |f: f64| self.effect.mean(before, pred - kappa * f / self.unit, self.inner);
                force = self.solved(force, &mean, kappa / self.unit)?;
                let (_, found) = mean(force);
                slopes = found;
                motion = pred - kappa * force / self.unit;
                for i in 0..m {
                    let pushed = steps[i].weight * (self.sign * couplings[i] * force / self.unit);
                    forced[i] += pushed;
                    states[i] -= pushed;
                }
            } else {
                motion = pred;
            }
            if !motion.is_finite() {
                return None;
            }
            if count > 0 {
                let mean_force = force / self.unit;
                new_change.fill(0.0);
                for i in 0..m {
                    let s = &steps[i];
                    let (re, im) =
                        (&mut change_re[i * count..(i + 1) * count], &mut change_im[i * count..(i + 1) * count]);
                    if t > 0 {
                        for (re, im) in re.iter_mut().zip(im.iter_mut()) {
                            let (a, b) = (*re, *im);
                            *re = s.decay.re * a - s.decay.im * b;
                            *im = s.decay.re * b + s.decay.im * a;
                        }
                    }
                    let at = i * of_mode;
                    if shared_free {
                        if t > 0 {
                            let before = (forced[i] - s.weight * (self.sign * couplings[i] * mean_force)) / s.decay;
                            for which in 0..2 {
                                let by = s.by[which].0;
                                let own = before * (s.decay * by * step)
                                    + (s.decay * step - s.weight) / s.lambda
                                        * by
                                        * (self.sign * couplings[i] * mean_force);
                                re[at + which] += own.re;
                                im[at + which] += own.im;
                            }
                            let own = s.weight * (self.sign * mean_force);
                            re[at + 2 + inputs] += own.re;
                            im[at + 2 + inputs] += own.im;
                        }
                        for which in 0..2 {
                            let mut base = first[i] * (s.by[which].0 * time) * swings[i];
                            if first[i] == Complex::new(0.0, 0.0) {
                                base = Complex::new(0.0, 0.0);
                            }
                            for j in 0..inputs {
                                base += driven.moved[which][i][j][t] * self.drive[i][j];
                            }
                            new_change[at + which] += couplings[i]
                                * (s.shown(derivative, base) + s.shown_change(derivative, states[i], which));
                        }
                        for j in 0..inputs {
                            new_change[at + 2 + j] += couplings[i] * s.shown(derivative, driven.states[i][j][t]);
                        }
                        new_change[at + 2 + inputs] += s.shown(derivative, states[i]);
                    }
                    if initial_free {
                        let swing = swings[i];
                        new_change[initial_at + 2 * i] += couplings[i] * s.shown(derivative, swing);
                        new_change[initial_at + 2 * i + 1] +=
                            couplings[i] * s.shown(derivative, swing * Complex::new(0.0, 1.0));
                    }
                    // What the force's part changes: −ρ Im(λᵖ dZ)/β.
                    let factor = s.lambda.powi(derivative) * (-couplings[i] / s.beat);
                    for (new, (re, im)) in new_change.iter_mut().zip(re.iter().zip(im.iter())) {
                        *new += factor.re * im + factor.im * re;
                    }
                }
                if t > 0 {
                    let (by_before, by_after) = (slopes[0], slopes[1]);
                    let whole = 1.0 + by_after * kappa / self.unit;
                    for p in 0..count {
                        let mut change = by_before * motion_change[p] + by_after * new_change[p];
                        if p == gap_at {
                            change += slopes[2] * self.inner;
                        }
                        force_change[p] = change / whole;
                    }
                    for i in 0..m {
                        let push = steps[i].weight * (self.sign * couplings[i] / self.unit);
                        let (re, im) =
                            (&mut change_re[i * count..(i + 1) * count], &mut change_im[i * count..(i + 1) * count]);
                        for (df, (re, im)) in force_change.iter().zip(re.iter_mut().zip(im.iter_mut())) {
                            *re += push.re * df;
                            *im += push.im * df;
                        }
                    }
                    for (new, df) in new_change.iter_mut().zip(&force_change) {
                        *new -= kappa / self.unit * df;
                    }
                }
                std::mem::swap(&mut motion_change, &mut new_change);
            }
            let instant = self.effect.at(motion, self.inner) / self.unit;
            out.forces[0].push(instant);
            if t % of.parts != 0 {
                continue;
            }
            let n = t / of.parts;
            if n + 1 == segment.length && of.is_joined(which) {
                continue;
            }
            let slope = self.effect.slope(motion, self.inner);
            for quantity in [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration] {
                if of.sensors.iter().all(|s| s.quantity != quantity) {
                    continue;
                }
                let order = quantity.derivatives();
                let own_force = |i: usize| -> f64 {
                    if order < 2 {
                        return 0.0;
                    }
                    let driven: f64 = (0..inputs).map(|j| self.drive[i][j] * series.inputs[j][segment.start + n]).sum();
                    driven - self.sign * couplings[i] * instant
                };
                let mut shown = [0.0; 64];
                for i in 0..m.min(64) {
                    shown[i] = steps[i].shown(order, states[i]) + own_force(i);
                }
                if count > 0 {
                    for i in 0..m {
                        let s = &steps[i];
                        let changes = &mut shown_change[i * count..(i + 1) * count];
                        let factor = s.lambda.powi(order) * (-1.0 / s.beat);
                        let (re, im) = (&change_re[i * count..(i + 1) * count], &change_im[i * count..(i + 1) * count]);
                        let push = if order == 2 { self.sign * couplings[i] / self.unit * slope.0 } else { 0.0 };
                        for (c, ((re, im), dm)) in changes.iter_mut().zip(re.iter().zip(im).zip(&motion_change)) {
                            *c = factor.re * im + factor.im * re - push * dm;
                        }
                        let at = i * of_mode;
                        if shared_free {
                            for which in 0..2 {
                                let mut base = if first[i] == Complex::new(0.0, 0.0) {
                                    first[i]
                                } else {
                                    first[i] * (s.by[which].0 * time) * swings[i]
                                };
                                for j in 0..inputs {
                                    base += driven.moved[which][i][j][t] * self.drive[i][j];
                                }
                                changes[at + which] += s.shown(order, base) + s.shown_change(order, states[i], which);
                            }
                            for j in 0..inputs {
                                let direct = if order == 2 { series.inputs[j][segment.start + n] } else { 0.0 };
                                changes[at + 2 + j] += s.shown(order, driven.states[i][j][t]) + direct;
                            }
                            if order == 2 {
                                changes[at + 2 + inputs] -= self.sign * instant;
                                changes[gap_at] -= self.sign * couplings[i] / self.unit * slope.1 * self.inner;
                            }
                        }
                        if initial_free {
                            let swing = swings[i];
                            changes[initial_at + 2 * i] += s.shown(order, swing);
                            changes[initial_at + 2 * i + 1] += s.shown(order, swing * Complex::new(0.0, 1.0));
                        }
                    }
                }
                for (k, sensor) in of.sensors.iter().enumerate() {
                    if sensor.quantity != quantity {
                        continue;
                    }
                    let value: f64 = (0..m).map(|i| self.shape[i][k] * shown[i]).sum();
                    let offset = of.offsets.get(record).map_or(0.0, |o| o[k]);
                    let error = series.outputs[k][segment.start + n] - offset - value;
                    if error.is_nan() || error.abs() >= RUNAWAY {
                        return None;
                    }
                    out.squares += error * error;
                    out.residuals[0][k].push(error);
                    let Some(normal) = &mut normal else { continue };
                    let mut row = rows.column_mut(filled);
                    row.fill(0.0);
                    let width = self.of_mode();
                    for l in 0..m {
                        let weight = self.shape[l][k];
                        let changes = &shown_change[l * count..(l + 1) * count];
                        if shared_free {
                            for i in 0..m {
                                let (from, to) = (i * of_mode, i * width);
                                for p in 0..2 + inputs {
                                    row[to + p] += weight * changes[from + p];
                                }
                                let by_coupling = weight * changes[from + 2 + inputs];
                                for (s, e) in self.across.iter().enumerate() {
                                    if *e != 0.0 {
                                        row[to + 2 + inputs + s] += e * by_coupling;
                                    }
                                }
                            }
                            if self.has_gap() {
                                row[self.shared() - 1] += weight * changes[gap_at];
                            }
                        }
                        if initial_free {
                            for p in 0..2 * m {
                                row[own_initial + p] += weight * changes[initial_at + p];
                            }
                        }
                    }
                    if shared_free {
                        for i in 0..m {
                            row[i * width + 2 + inputs + k] += shown[i];
                        }
                    }
                    errors[filled] = error;
                    filled += 1;
                    if filled == CHUNK {
                        normal.matrix.gemm(1.0, &rows, &rows.transpose(), 1.0);
                        normal.gradient.gemv(1.0, &rows, &errors, 1.0);
                        filled = 0;
                    }
                }
            }
        }
        if let Some(normal) = &mut normal
            && filled > 0
        {
            let part = rows.columns(0, filled);
            normal.matrix.gemm(1.0, &part, &part.transpose(), 1.0);
            normal.gradient.gemv(1.0, &part, &errors.rows(0, filled), 1.0);
        }
        let split = normal.map(|whole| {
            let (k, l) = (own_initial, all - own_initial);
            let block = |at: usize, size: usize| Block {
                matrix: whole.matrix.view((at, at), (size, size)).into_owned(),
                gradient: whole.gradient.rows(at, size).into_owned(),
            };
            let cross = whole.matrix.view((0, k), (k, l)).into_owned();
            (block(0, k), Local { own: block(k, l), cross, next: None })
        });
        let by = (count > 0 && of.is_joined(which)).then(|| {
            let mut by = DMatrix::zeros(2 * m, all);
            let (last, time) = (driven.instants - 1, (driven.instants - 1) as f64 * step);
            let width = self.of_mode();
            for i in 0..m {
                let mut add = |at: usize, change: Complex<f64>| {
                    by[(2 * i, at)] += change.re;
                    by[(2 * i + 1, at)] += change.im;
                };
                let of_force = |p: usize| -Complex::new(change_re[i * count + p], change_im[i * count + p]);
                if shared_free {
                    for l in 0..m {
                        for p in 0..2 + inputs {
                            add(l * width + p, of_force(l * of_mode + p));
                        }
                        for (s, e) in self.across.iter().enumerate() {
                            add(l * width + 2 + inputs + s, of_force(l * of_mode + 2 + inputs) * *e);
                        }
                    }
                    if self.has_gap() {
                        add(own_initial - 1, of_force(gap_at));
                    }
                    for which in 0..2 {
                        let mut own = first[i] * (steps[i].by[which].0 * time) * swings[i];
                        for j in 0..inputs {
                            own += driven.moved[which][i][j][last] * self.drive[i][j];
                        }
                        add(i * width + which, own);
                    }
                    for j in 0..inputs {
                        add(i * width + 2 + j, driven.states[i][j][last]);
                    }
                }
                if initial_free {
                    for p in 0..2 * m {
                        add(own_initial + p, of_force(initial_at + p));
                    }
                    add(own_initial + 2 * i, swings[i]);
                    add(own_initial + 2 * i + 1, swings[i] * Complex::new(0.0, 1.0));
                }
            }
            by
        });
        Some((out, split, End { states, by }))
    }

    /// The mean force of a step: the root of `f − mean(f)`, from a guess; `rate` is what a unit of it takes off the motion.
    fn solved(&self, guess: f64, mean: &impl Fn(f64) -> (f64, [f64; 3]), rate: f64) -> Option<f64> {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut force = guess;
        for _ in 0..FORCE_ITERATIONS {
            let (value, slopes) = mean(force);
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
            let whole = 1.0 + slopes[1] * rate;
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

    /// The model fitted from this one by at most so many steps of Levenberg and Marquardt, with what it leaves.
    pub(crate) fn fitted(
        &self,
        of: Loop<'_>,
        free: Free,
        steps: usize,
        gain: f64,
        cancel: &Cancel,
    ) -> Option<(Self, Simulated)> {
        let mut model = self.clone();
        let (mut simulated, mut normal) = model.run(of, Some(free))?;
        let mut damping = 1e-3;
        for _ in 0..steps {
            if cancel.is_cancelled() {
                return None;
            }
            let sums = normal.take()?;
            let mut better = None;
            for _ in 0..7 {
                let candidate = sums.step(damping, free).map(|change| model.moved(&change, free));
                if let Some(candidate) = candidate
                    && let Some(found) = candidate.simulate(of)
                    && found.squares < simulated.squares
                {
                    better = Some((candidate, found));
                    damping = f64::max(damping / 8.0, 1e-9);
                    break;
                }
                damping = f64::max(damping * 8.0, 1e-6);
            }
            let Some((candidate, found)) = better else { break };
            let enough = simulated.squares - found.squares > gain * simulated.squares;
            model = candidate;
            simulated = found;
            if !enough {
                break;
            }
            normal = model.run(of, Some(free))?.1;
        }
        Some((model, simulated))
    }

    /// The model with initial states fitted segment by segment, each at its own pace; where one stays far behind the others,
    /// it is tried from the end of the one before.
    pub(crate) fn eased(&self, of: Loop<'_>, steps: usize, gain: f64, cancel: &Cancel) -> Self {
        let count = of.segments.len().min(self.initial.len());
        let fitted = |k: usize, state: &[Complex<f64>]| -> Option<(Vec<Complex<f64>>, f64)> {
            let own = Self { initial: vec![state.to_vec()], ..self.clone() };
            let of = Loop { segments: &of.segments[k..=k], joint: None, ..of };
            let (model, left) = own.fitted(of, Free::Initial, steps, gain, cancel)?;
            Some((model.initial.into_iter().next()?, left.squares / left.samples as f64))
        };
        let numbers: Vec<usize> = (0..count).collect();
        let first: Vec<_> = numbers.into_par_iter().map(|k| fitted(k, &self.initial[k])).collect();
        let mut sizes: Vec<f64> = first.iter().flatten().map(|f| f.1).collect();
        sizes.sort_by(f64::total_cmp);
        let bad = sizes.get(sizes.len() / 2).map_or(0.0, |middle| STRAY_STRETCH * middle);
        let mut new = self.clone();
        for (k, found) in first.into_iter().enumerate() {
            let mut best = found;
            let follows = k > 0 && {
                let (before, own) = (of.segments[k - 1], of.segments[k]);
                before.record == own.record && own.start + 1 == before.start + before.length
            };
            if follows && best.as_ref().is_none_or(|b| b.1 > bad) {
                let before = Self { initial: vec![new.initial[k - 1].clone()], ..self.clone() };
                let of = Loop { segments: &of.segments[k - 1..k], joint: None, ..of };
                let end = before.run_segment(of, 0, None).map(|r| r.2.states);
                let other = end.and_then(|end| fitted(k, &end));
                if let Some(other) = other
                    && best.as_ref().is_none_or(|b| other.1 < b.1)
                {
                    best = Some(other);
                }
            }
            if let Some((state, _)) = best {
                new.initial[k] = state;
            }
        }
        new
    }

    /// The model with the initial states of segments fitted one after the other, each from the end of the one before; the first
    /// ones of records from what they are.
    pub(crate) fn swept(&self, of: Loop<'_>, steps: usize, cancel: &Cancel) -> Self {
        let mut new = self.clone();
        for k in 0..of.segments.len() {
            let alone = Loop { segments: &of.segments[k..=k], joint: None, ..of };
            let own = Self { initial: vec![new.initial[k].clone()], ..self.clone() };
            let found = own.fitted(alone, Free::Initial, steps, 1e-2, cancel).map_or(own, |f| f.0);
            let next = of.segments.get(k + 1).is_some_and(|n| n.record == of.segments[k].record);
            if next && let Some((_, _, end)) = found.run_segment(alone, 0, None) {
                new.initial[k + 1] = end.states;
            }
            if let Some(state) = found.initial.into_iter().next() {
                new.initial[k] = state;
            }
        }
        new
    }

    /// The covariance of the shared parameters for a residual of unit variance, their places as in `shared`.
    pub(crate) fn covariance(&self, of: Loop<'_>) -> Option<DMatrix<f64>> {
        let free = if self.initial.is_empty() { Free::Shared } else { Free::All };
        let normal = self.run(of, Some(free))?.1?;
        let scale = normal.shared.scale();
        let inverse = Cholesky::new(normal.eliminated(0.0, scale.len(), &scale)?.matrix)?.inverse();
        Some(DMatrix::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] / (scale[i] * scale[j])))
    }

    /// Where a mode's frequency stands among the shared parameters; damping, drives and shape follow.
    pub(crate) fn place_of(&self, mode: usize) -> usize {
        mode * self.of_mode()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_values::record::Role;

    fn sensors() -> Vec<Sensor> {
        let of = |k: usize, role: Role, quantity| Sensor {
            name: format!("s{k}"),
            role,
            quantity,
            unit: String::new(),
            scale: 1.0,
        };
        vec![of(0, Role::Displacement(0), Quantity::Displacement), of(1, Role::Acceleration(1), Quantity::Acceleration)]
    }

    fn model(effect: Effect) -> ClosedModel {
        ClosedModel {
            effect,
            across: vec![1.0, 0.0],
            sign: 1.0,
            unit: 0.7,
            inner: if effect == Effect::Clearance { 0.3 } else { 0.05 },
            poles: vec![Pole { omega: 3.0, damping: 0.02 }, Pole { omega: 7.0, damping: 0.01 }],
            drive: vec![vec![1.0], vec![-0.7]],
            shape: vec![vec![0.8, 0.5], vec![-0.4, 0.9]],
            initial: [1.0, -0.6].map(|k| vec![Complex::new(0.1 * k, 0.2), Complex::new(-0.2, 0.1 * k)]).to_vec(),
        }
    }

    /// The gradient of the sum of squares against differences, for each kind of force.
    #[test]
    fn derivatives_are_those_of_the_simulation() {
        let n = 300;
        let input: Vec<f64> = (0..n).map(|k| (0.35 * k as f64).sin() + (0.8 * k as f64).cos()).collect();
        let series = [Series {
            name: String::new(),
            interval: 0.1,
            inputs: vec![input],
            outputs: vec![vec![0.0; n], vec![0.0; n]],
        }];
        let sensors = sensors();
        let segments = [(0, 171), (170, 130)].map(|(start, length)| Segment { record: 0, start, length });
        let joint = Some(Joint { weights: &[3.0, 5.0], rest: true });
        let of = Loop { sensors: &sensors, series: &series, segments: &segments, offsets: &[], parts: 4, joint };
        for effect in Effect::ALL {
            let model = model(effect);
            let (_, normal) = model.run(of, Some(Free::All)).expect("bounded");
            let normal = normal.expect("asked for");
            let shared = model.shared();
            let own: Vec<f64> = normal.locals.iter().flat_map(|l| l.own.gradient.iter().copied()).collect();
            let each = own.len() / segments.len();
            let gradient = DVector::from_vec(normal.shared.gradient.iter().copied().chain(own).collect());
            for k in 0..gradient.len() {
                let half = |step: f64| {
                    let unit =
                        |at: usize, size: usize| DVector::from_fn(size, |i, _| if at + i == k { step } else { 0.0 });
                    let local = (0..segments.len()).map(|s| unit(shared + s * each, each));
                    let change = Change { shared: unit(0, shared), local: local.collect() };
                    0.5 * model.moved(&change, Free::All).simulate(of).expect("bounded").squares
                };
                // The gradient is that of the descent: the errors are measured less simulated.
                let numeric = -(half(1e-6) - half(-1e-6)) / 2e-6;
                let size = gradient.amax();
                assert!((gradient[k] - numeric).abs() < 2e-3 * size, "{effect:?} {k}: {} {numeric}", gradient[k]);
            }
        }
    }

    /// The same structure in metres and in units of ten micrometres moves the same: the force's equation is solved to a
    /// tolerance of its own size.
    #[test]
    fn forces_of_any_size_are_solved_for() {
        let n = 200;
        let input: Vec<f64> = (0..n).map(|k| (0.35 * k as f64).sin() + (0.8 * k as f64).cos()).collect();
        let outputs = vec![vec![0.0; n], vec![0.0; n]];
        let series = [Series { name: String::new(), interval: 0.1, inputs: vec![input], outputs }];
        let (sensors, segments) = (sensors(), Segment::whole(&series, 1.0));
        let of = Loop { sensors: &sensors, series: &series, segments: &segments, offsets: &[], parts: 2, joint: None };
        let large = model(Effect::CubicStiffness);
        let mut small = large.clone();
        small.across.iter_mut().for_each(|e| *e *= 1e-5);
        small.unit *= 1e-20; // of x³, and once more because the coupling is as small
        let [large, small] = [large, small].map(|m| m.simulate(of).expect("bounded").residuals);
        for (a, b) in large[0][0].iter().zip(&small[0][0]) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}
