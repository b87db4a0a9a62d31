//! A structure with one force that its own motion makes, simulated and fitted.
//!
//! `qᵢ″ + 2ζᵢωᵢ qᵢ′ + ωᵢ² qᵢ = Σⱼ bᵢⱼ uⱼ − σ ρᵢ f(x)`, `x = Σᵢ ρᵢ qᵢ` (or its rate), `ρᵢ = Σₛ eₛ φₛᵢ`: a force between points of the structure drives
//! a mode as much as the mode moves these points (reciprocity), so the force's size is that of the shapes, and only its
//! sign σ is left. Between instants the force counts with its mean along a straight path, which makes switching exact to
//! the second order and differentiable; the force at the step's end follows from one scalar equation.

use nalgebra::{Cholesky, Complex, DMatrix, DVector};

use super::force::Effect;
use super::measurement::{Quantity, Sensor, Series};
use super::pole::{self, Pole};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;

/// Relative steps of frequency and damping for the derivatives of responses to inputs.
const STEPS: [f64; 2] = [1e-5, 1e-3];
/// Largest change of the logarithms of frequency, damping and gap in one step.
const MAX_CHANGE: [f64; 3] = [0.1, 0.4, 0.2];
/// Iterations of the scalar equation.
const ROUNDS: usize = 40;
/// Rows of the Jacobian that are added to the normal equations at once.
const CHUNK: usize = 256;
/// Times its sensor's RMS from which a response has run away.
const RUNAWAY: f64 = 1e3;

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
    /// `initial[record][mode]`; empty where the records start at rest.
    pub(crate) initial: Vec<Vec<Complex<f64>>>,
}

/// Which parameters are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Free {
    /// All that records share.
    Shared,
    /// These and the records' initial states.
    All,
    /// The initial states alone.
    Initial,
}

/// How a model is simulated.
#[derive(Clone, Copy)]
pub(crate) struct Loop<'a> {
    pub(crate) sensors: &'a [Sensor],
    pub(crate) series: &'a [Series],
    /// `offsets[record][sensor]`
    pub(crate) offsets: &'a [Vec<f64>],
    /// The measured motion that the force depends on, `parts` instants a sample; `closed` is the model's share in it.
    pub(crate) measured: &'a [Vec<f64>],
    pub(crate) closed: f64,
    /// Instants a sampling interval.
    pub(crate) parts: usize,
    /// Share of each record that is looked at, from its beginning.
    pub(crate) share: f64,
}

/// A simulation.
pub(crate) struct Simulated {
    pub(crate) squares: f64,
    pub(crate) samples: usize,
    /// `residuals[record][sensor][sample]`
    pub(crate) residuals: Vec<Vec<Vec<f64>>>,
    /// The force (in its unit) at each instant, `forces[record][instant]`.
    pub(crate) forces: Vec<Vec<f64>>,
}

/// Sums of the normal equations.
struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
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

    fn count(&self, records: usize) -> usize {
        self.shared() + records * 2 * self.modes()
    }

    fn moved(&self, change: &DVector<f64>, free: Free) -> Self {
        let mut new = self.clone();
        let (inputs, width) = (self.inputs(), self.of_mode());
        if free != Free::Initial {
            for i in 0..self.modes() {
                let at = i * width;
                let limited = |k: usize| change[at + k].clamp(-MAX_CHANGE[k], MAX_CHANGE[k]).exp();
                new.poles[i] = self.poles[i].scaled(limited(0), limited(1));
                for j in 0..inputs {
                    new.drive[i][j] += change[at + 2 + j];
                }
                for s in 0..self.sensors() {
                    new.shape[i][s] += change[at + 2 + inputs + s];
                }
            }
            if self.has_gap() {
                new.inner *= change[self.shared() - 1].clamp(-MAX_CHANGE[2], MAX_CHANGE[2]).exp();
            }
        }
        let m = self.modes();
        for (r, states) in new.initial.iter_mut().enumerate() {
            for (i, state) in states.iter_mut().enumerate() {
                let at = self.shared() + (r * m + i) * 2;
                *state += Complex::new(change[at], change[at + 1]);
            }
        }
        new
    }

    fn driven(&self, series: &Series, parts: usize, share: f64, derivatives: bool) -> Driven {
        let samples = ((series.len() as f64 * share) as usize).clamp(2, series.len());
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
                        state = decay * state + pole::driven(weights, padded, n);
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
            let step = STEPS[which];
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

    /// Simulates all records; with `free`, sums of the normal equations too. None where a response runs away.
    fn run(&self, of: Loop<'_>, free: Option<Free>) -> Option<(Simulated, Option<Normal>)> {
        let records: Vec<usize> = (0..of.series.len()).collect();
        let each: Vec<Option<(Simulated, Option<Normal>)>> =
            records.par_iter().map(|r| self.run_record(of, *r, free)).collect();
        let mut all = Simulated { squares: 0.0, samples: 0, residuals: Vec::new(), forces: Vec::new() };
        let mut normal = free.map(|_| Normal {
            matrix: DMatrix::zeros(self.count(of.series.len()), self.count(of.series.len())),
            gradient: DVector::zeros(self.count(of.series.len())),
        });
        for one in each {
            let (simulated, own) = one?;
            all.squares += simulated.squares;
            all.samples += simulated.samples;
            all.residuals.extend(simulated.residuals);
            all.forces.extend(simulated.forces);
            if let (Some(sum), Some(own)) = (&mut normal, own) {
                sum.matrix += own.matrix;
                sum.gradient += own.gradient;
            }
        }
        all.squares.is_finite().then_some((all, normal))
    }

    pub(crate) fn simulate(&self, of: Loop<'_>) -> Option<Simulated> {
        self.run(of, None).map(|(s, _)| s)
    }

    fn run_record(&self, of: Loop<'_>, record: usize, free: Option<Free>) -> Option<(Simulated, Option<Normal>)> {
        let series = &of.series[record];
        let (m, inputs, sensors) = (self.modes(), self.inputs(), self.sensors());
        let driven = self.driven(series, of.parts, of.share, free.is_some_and(|f| f != Free::Initial));
        let step = series.interval / of.parts as f64;
        let steps: Vec<Step> = self.poles.iter().map(|p| Step::new(*p, step)).collect();
        let couplings: Vec<f64> = (0..m).map(|i| self.coupling(i)).collect();
        let derivative = i32::from(self.effect.is_of_velocity());
        let kappa =
            self.sign * (0..m).map(|i| couplings[i].powi(2) * steps[i].shown(derivative, steps[i].weight)).sum::<f64>();
        let initial: Vec<Complex<f64>> =
            self.initial.get(record).cloned().unwrap_or_else(|| vec![Complex::new(0.0, 0.0); m]);
        let shared_free = free.is_some_and(|f| f != Free::Initial);
        let initial_free = free.is_some_and(|f| f != Free::Shared) && !self.initial.is_empty();

        // Dynamic parameters: of each mode frequency, damping, drives and coupling; the gap; initial states.
        let of_mode = 3 + inputs;
        let gap_at = m * of_mode;
        let initial_at = gap_at + 1;
        let count = if free.is_none() { 0 } else { initial_at + if initial_free { 2 * m } else { 0 } };
        let all = self.count(of.series.len());
        let own_initial = self.shared() + record * 2 * m;
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
        let mut normal = free.map(|_| Normal { matrix: DMatrix::zeros(all, all), gradient: DVector::zeros(all) });
        let mut rows = DMatrix::<f64>::zeros(all, if free.is_some() { CHUNK } else { 0 });
        let mut errors = DVector::<f64>::zeros(CHUNK);
        let mut filled = 0;

        let mut forced = vec![Complex::new(0.0, 0.0); m];
        let mut free_part = initial;
        let mut states = vec![Complex::new(0.0, 0.0); m];
        let mut bases = vec![Complex::new(0.0, 0.0); m];
        let first = free_part.clone();
        let mut motion;
        let mut effective = 0.0;
        let mut force = 0.0;
        for t in 0..driven.instants {
            let time = t as f64 * step;
            if t > 0 {
                for i in 0..m {
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
            let blended = |model: f64| match of.measured.get(record) {
                Some(measured) if of.closed < 1.0 => of.closed * model + (1.0 - of.closed) * measured[t],
                _ => model,
            };
            let share = if of.measured.is_empty() { 1.0 } else { of.closed };
            let before = effective;
            let mut slopes = [0.0; 3];
            if t > 0 {
                let mean = |f: f64| self.effect.mean(before, blended(pred - kappa * f / self.unit), self.inner);
                force = self.solved(force, &mean, share * kappa / self.unit)?;
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
            effective = blended(motion);
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
                            let mut base = first[i] * (s.by[which].0 * time) * (s.lambda * time).exp();
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
                        let swing = (s.lambda * time).exp();
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
                    let (by_before, by_after) = (share * slopes[0], share * slopes[1]);
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
            let instant = self.effect.at(effective, self.inner) / self.unit;
            out.forces[0].push(instant);
            if t % of.parts != 0 {
                continue;
            }
            let n = t / of.parts;
            let slope = self.effect.slope(effective, self.inner);
            for quantity in [Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration] {
                if of.sensors.iter().all(|s| s.quantity != quantity) {
                    continue;
                }
                let order = quantity.derivatives();
                let own_force = |i: usize| -> f64 {
                    if order < 2 {
                        return 0.0;
                    }
                    let driven: f64 = (0..inputs).map(|j| self.drive[i][j] * series.inputs[j][n]).sum();
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
                        let push =
                            if order == 2 { self.sign * couplings[i] / self.unit * slope.0 * share } else { 0.0 };
                        for (c, ((re, im), dm)) in changes.iter_mut().zip(re.iter().zip(im).zip(&motion_change)) {
                            *c = factor.re * im + factor.im * re - push * dm;
                        }
                        let at = i * of_mode;
                        if shared_free {
                            for which in 0..2 {
                                let mut base = if first[i] == Complex::new(0.0, 0.0) {
                                    first[i]
                                } else {
                                    first[i] * (s.by[which].0 * time) * (s.lambda * time).exp()
                                };
                                for j in 0..inputs {
                                    base += driven.moved[which][i][j][t] * self.drive[i][j];
                                }
                                changes[at + which] += s.shown(order, base) + s.shown_change(order, states[i], which);
                            }
                            for j in 0..inputs {
                                let direct = if order == 2 { series.inputs[j][n] } else { 0.0 };
                                changes[at + 2 + j] += s.shown(order, driven.states[i][j][t]) + direct;
                            }
                            if order == 2 {
                                changes[at + 2 + inputs] -= self.sign * instant;
                                changes[gap_at] -= self.sign * couplings[i] / self.unit * slope.1 * self.inner;
                            }
                        }
                        if initial_free {
                            let swing = (s.lambda * time).exp();
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
                    let error = series.outputs[k][n] - offset - value;
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
        Some((out, normal))
    }

    /// The mean force of a step: the root of `f − mean(f)`, from a guess; `rate` is what a unit of it takes off the motion.
    fn solved(&self, guess: f64, mean: &impl Fn(f64) -> (f64, [f64; 3]), rate: f64) -> Option<f64> {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut force = guess;
        for _ in 0..ROUNDS {
            let (value, slopes) = mean(force);
            let error = force - value;
            if !error.is_finite() {
                return None;
            }
            if error.abs() <= 1e-10 * (1.0 + force.abs()) {
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
            let Normal { matrix, gradient } = normal.take()?;
            let used: Vec<usize> = (0..matrix.nrows()).filter(|k| matrix[(*k, *k)] > 0.0).collect();
            let scale: Vec<f64> = used.iter().map(|k| matrix[(*k, *k)].sqrt()).collect();
            let scaled =
                DMatrix::from_fn(used.len(), used.len(), |i, j| matrix[(used[i], used[j])] / (scale[i] * scale[j]));
            let right = DVector::from_fn(used.len(), |i, _| gradient[used[i]] / scale[i]);
            let mut better = None;
            for _ in 0..7 {
                let mut damped = scaled.clone();
                for k in 0..used.len() {
                    damped[(k, k)] += damping + 1e-12;
                }
                let candidate = Cholesky::new(damped).map(|factor| {
                    let solved = factor.solve(&right);
                    let mut change = DVector::zeros(matrix.nrows());
                    for (i, k) in used.iter().enumerate() {
                        change[*k] = solved[i] / scale[i];
                    }
                    model.moved(&change, free)
                });
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

    /// The covariance of the shared parameters for a residual of unit variance, and the parameters' places as in `shared`.
    pub(crate) fn covariance(&self, of: Loop<'_>) -> Option<DMatrix<f64>> {
        let free = if self.initial.is_empty() { Free::Shared } else { Free::All };
        let normal = self.run(of, Some(free))?.1?;
        let size = if free == Free::Shared { self.shared() } else { normal.matrix.nrows() };
        let matrix = normal.matrix.view((0, 0), (size, size)).into_owned();
        let scale: Vec<f64> = (0..size).map(|k| matrix[(k, k)].sqrt().max(1e-150)).collect();
        let scaled = DMatrix::from_fn(size, size, |i, j| {
            matrix[(i, j)] / (scale[i] * scale[j]) + if i == j { 1e-12 } else { 0.0 }
        });
        let inverse = Cholesky::new(scaled)?.inverse();
        Some(DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] / (scale[i] * scale[j])))
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
            initial: vec![vec![Complex::new(0.1, 0.2), Complex::new(-0.2, 0.1)]],
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
        let of =
            Loop { sensors: &sensors, series: &series, offsets: &[], measured: &[], closed: 1.0, parts: 4, share: 1.0 };
        for effect in Effect::ALL {
            let model = model(effect);
            let (_, normal) = model.run(of, Some(Free::All)).expect("bounded");
            let gradient = normal.expect("asked for").gradient;
            for k in 0..gradient.len() {
                let half = |step: f64| {
                    let mut change = DVector::zeros(gradient.len());
                    change[k] = step;
                    0.5 * model.moved(&change, Free::All).simulate(of).expect("bounded").squares
                };
                // The gradient is that of the descent: the errors are measured less simulated.
                let numeric = -(half(1e-6) - half(-1e-6)) / 2e-6;
                let size = gradient.amax();
                assert!((gradient[k] - numeric).abs() < 2e-3 * size, "{effect:?} {k}: {} {numeric}", gradient[k]);
            }
        }
    }
}
