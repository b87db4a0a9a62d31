//! Output-error refinement: the simulated response itself is fitted to the measured one.
//!
//! Nonlinear least squares by Levenberg and Marquardt over the parameters that the records share (coefficients of terms, and
//! what stands inside them) and, for each run, its initial state and sensor offset. Sensitivities are differences of
//! simulations: the simulator locates every switching instant, so the response is as smooth in a parameter as the motion
//! is, and a difference of a ten-thousandth of the motion keeps four digits of it. A run may be a stretch of a record with
//! an initial state of its own: multiple shooting, for a start that one long simulation would not lead home.
//!
//! Source: L. Ljung, *System Identification*, 2nd ed., Prentice Hall 1999, ch. 7 and 9.

mod statistics;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::{DMatrix, DVector};

use crate::model::Model;
use crate::simulate::{InputGrid, Limits, Response, Simulator, Workspace};

pub use statistics::{autoregression, inflation};

/// What one set of parameters makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The equations.
    pub model: Model,
    /// The inputs act this much later than they were measured, s.
    pub delay: f64,
    /// The sensor shows no displacement beyond ± this.
    pub ceiling: Option<f64>,
}

/// A model whose shared parameters are to be found.
pub trait Structure: Sync {
    /// The model at these parameters; none where they are out of bounds.
    fn instance(&self, parameters: &[f64]) -> Option<Instance>;

    /// A change of each parameter that matters, in its unit; only its order of magnitude counts.
    fn scales(&self) -> Vec<f64>;

    /// True if each run's sensor has an offset of its own.
    fn offset(&self) -> bool;

    /// Number of internal states, whose initial values are free like those of displacement and velocity.
    fn internals(&self) -> usize;
}

/// A stretch of a record of one degree of freedom.
#[derive(Clone, Debug)]
pub struct Run {
    /// The record's inputs.
    pub grid: Arc<InputGrid>,
    /// The record's measured displacement.
    pub measured: Arc<[f64]>,
    /// The samples of the stretch.
    pub range: Range<usize>,
    /// Displacement and velocity beyond which a simulation is given up.
    pub limits: [f64; 2],
    /// Displacement and velocity at the first sample, to start from.
    pub initial: [f64; 2],
}

/// Values to start from, or that were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Shared parameters.
    pub shared: Vec<f64>,
    /// For each run: displacement, velocity and internal states at the first sample, then the offset if there is one.
    pub own: Vec<Vec<f64>>,
}

/// How a fit is to be done.
#[derive(Clone, Copy)]
pub struct Options<'a> {
    /// Keep the shared parameters and fit what each run has of its own.
    pub frozen: bool,
    /// Most steps.
    pub steps: usize,
    /// Integration steps after which no further one is begun.
    pub effort: usize,
    /// The least sum of squares that a rival has reached: a fit that is far above it and no longer falls fast ends early.
    pub bar: Option<&'a Bar>,
    /// Asked now and then; the fit ends early once it is true.
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// The least sum of squares that any of several fits has reached, shared among threads.
#[derive(Debug)]
pub struct Bar(AtomicU64);

impl Default for Bar {
    fn default() -> Self {
        Self(AtomicU64::new(f64::INFINITY.to_bits()))
    }
}

impl Bar {
    /// The least so far; infinite before the first.
    pub fn least(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }

    /// A fit has reached this.
    pub fn reached(&self, rss: f64) {
        // Positive floats are ordered as their bits are.
        self.0.fetch_min(rss.max(0.0).to_bits(), Ordering::Relaxed);
    }
}

/// Steps after which a fit is held against the bar.
const PATIENCE: usize = 4;
/// A fit whose sum of squares is so many times the bar's, and fell in the last step by less than this share, is hopeless.
const HOPELESS: (f64, f64) = (1.5, 0.4);

/// A fit.
#[derive(Clone, Debug, Default)]
pub struct Refined {
    /// The parameters.
    pub point: Point,
    /// Sum of squared residuals over all runs.
    pub rss: f64,
    /// Number of samples over all runs.
    pub samples: usize,
    /// For each run, measured minus simulated.
    pub residuals: Vec<Vec<f64>>,
    /// For each run, simulated as the sensor shows it.
    pub simulated: Vec<Vec<f64>>,
    /// For each run, the derivative of the simulated response by each shared parameter, then by each of its own.
    pub sensitivities: Vec<Vec<Vec<f64>>>,
    /// Covariance of the shared parameters, for residuals of one colour; empty if frozen or singular.
    pub covariance: DMatrix<f64>,
    /// True if no step would change the fit noticeably.
    pub converged: bool,
}

impl Refined {
    /// Root of the mean squared residual.
    pub fn rmse(&self) -> f64 {
        (self.rss / self.samples.max(1) as f64).sqrt()
    }

    /// Number of fitted values.
    pub fn unknowns(&self) -> usize {
        self.point.shared.len() + self.point.own.iter().map(Vec::len).sum::<usize>()
    }

    /// Standard error of a shared parameter.
    pub fn std_error(&self, index: usize) -> Option<f64> {
        (index < self.covariance.nrows()).then(|| self.covariance[(index, index)].sqrt()).filter(|e| e.is_finite())
    }
}

/// Share of the motion's RMS that a parameter is moved by for a difference.
const NUDGE: f64 = 1e-4;

/// By how much a difference is widened where no step leads down, and the widest one.
const WIDER: f64 = 8.0;
const WIDEST: f64 = 64.0;

/// A step that lowers the sum of squares by less than this many noise variances ends the iteration: a small part of
/// what chance moves it by.
const NOTICEABLE: f64 = 0.05;

/// Largest error of a sampling interval of the simulation, as a share of the motion: far below [`NUDGE`].
const TOLERANCE: f64 = 1e-7;

struct Fitter<'a> {
    structure: &'a dyn Structure,
    runs: &'a [Run],
    options: Options<'a>,
    offset: bool,
    internals: usize,
    workspace: Workspace,
    response: Response,
    /// The last delayed inputs of each run.
    delayed: Vec<Option<(f64, InputGrid)>>,
    rms: f64,
    /// Integration steps so far, a change of side counted as [`CHANGE`].
    spent: usize,
    /// Share of the motion's RMS that a parameter is moved by for a difference, with its sign.
    nudge: f64,
}

/// Integration steps that locating a change of side is worth.
const CHANGE: usize = 20;

/// Fits a structure to runs from a point.
///
/// None if the model at the start cannot be simulated along every run, or the fit was cancelled.
pub fn refine(structure: &dyn Structure, runs: &[Run], start: &Point, options: Options<'_>) -> Option<Refined> {
    Fitter::new(structure, runs, options).fit(start)
}

/// The sum of squared residuals at a point, nothing fitted; none if the model cannot be simulated there.
pub fn misfit(structure: &dyn Structure, runs: &[Run], point: &Point, options: Options<'_>) -> Option<f64> {
    Fitter::new(structure, runs, options).all(point, &mut Vec::new())
}

/// What each run has of its own, to start from: the runs' initial states, internal states and offsets zero.
pub fn own_start(structure: &dyn Structure, runs: &[Run]) -> Vec<Vec<f64>> {
    let length = 2 + structure.internals() + usize::from(structure.offset());
    runs.iter()
        .map(|run| {
            let mut own = vec![0.0; length];
            own[..2].copy_from_slice(&run.initial);
            own
        })
        .collect()
}

impl<'a> Fitter<'a> {
    fn new(structure: &'a dyn Structure, runs: &'a [Run], options: Options<'a>) -> Self {
        let (mut square, mut count) = (0.0, 0);
        for run in runs {
            square += run.measured[run.range.clone()].iter().map(|y| y * y).sum::<f64>();
            count += run.range.len();
        }
        Self {
            structure,
            runs,
            options,
            offset: structure.offset(),
            internals: structure.internals(),
            workspace: Workspace::default(),
            response: Response::default(),
            delayed: vec![None; runs.len()],
            rms: (square / count.max(1) as f64).sqrt().max(f64::MIN_POSITIVE),
            spent: 0,
            nudge: NUDGE,
        }
    }

    /// Simulates one run into `out`; false if the response does not last.
    fn simulate(
        &mut self,
        simulator: &Simulator,
        instance: &Instance,
        index: usize,
        own: &[f64],
        out: &mut Vec<f64>,
    ) -> bool {
        let run = &self.runs[index];
        let limits = Limits { states: &run.limits, tolerance: TOLERANCE, cancelled: self.options.cancelled };
        let grid = if instance.delay == 0.0 {
            &*run.grid
        } else {
            let slot = &mut self.delayed[index];
            if slot.as_ref().is_none_or(|(delay, _)| *delay != instance.delay) {
                *slot = Some((instance.delay, run.grid.delayed(instance.delay)));
            }
            match slot {
                Some((_, grid)) => grid,
                None => return false,
            }
        };
        let states = 2 + self.internals;
        simulator.run_into(grid, &own[..states], run.range.clone(), &limits, &mut self.workspace, &mut self.response);
        self.spent += self.response.steps + CHANGE * self.response.switches;
        out.clear();
        if self.response.len() < run.range.len() {
            return false;
        }
        let offset = if self.offset { own[states] } else { 0.0 };
        out.extend(self.response.states[0].iter().map(|x| x + offset));
        if let Some(ceiling) = instance.ceiling {
            out.iter_mut().for_each(|y| *y = y.clamp(-ceiling.abs(), ceiling.abs()));
        }
        out.iter().all(|y| y.is_finite())
    }

    fn all(&mut self, point: &Point, out: &mut Vec<Vec<f64>>) -> Option<f64> {
        let instance = self.structure.instance(&point.shared)?;
        let simulator = Simulator::new(&instance.model).ok()?;
        out.resize_with(self.runs.len(), Vec::new);
        let mut rss = 0.0;
        for (index, own) in point.own.iter().enumerate() {
            let mut simulated = std::mem::take(&mut out[index]);
            let lasts = self.simulate(&simulator, &instance, index, own, &mut simulated);
            out[index] = simulated;
            if !lasts {
                return None;
            }
            let run = &self.runs[index];
            rss += run.measured[run.range.clone()].iter().zip(&out[index]).map(|(y, s)| (y - s).powi(2)).sum::<f64>();
        }
        rss.is_finite().then_some(rss)
    }

    fn sensitivities(
        &mut self,
        point: &Point,
        simulated: &[Vec<f64>],
        scales: &mut [f64],
        own_scales: &[Vec<f64>],
        out: &mut [Vec<Vec<f64>>],
    ) -> Option<()> {
        let shared = if self.options.frozen { 0 } else { point.shared.len() };
        let mut moved = point.shared.clone();
        for j in 0..shared {
            let mut done = false;
            // Forward, else backward where the forward point is out of bounds or its simulation does not last.
            for step in [self.nudge * scales[j], -self.nudge * scales[j]] {
                moved[j] = point.shared[j] + step;
                let step = moved[j] - point.shared[j];
                let Some(instance) = self.structure.instance(&moved) else { continue };
                let Ok(simulator) = Simulator::new(&instance.model) else { continue };
                let mut square = 0.0;
                done = (0..self.runs.len()).all(|r| {
                    let mut column = std::mem::take(&mut out[r][j]);
                    let lasts = self.simulate(&simulator, &instance, r, &point.own[r], &mut column);
                    if lasts {
                        for (c, s) in column.iter_mut().zip(&simulated[r]) {
                            *c = (*c - s) / step;
                            square += *c * *c;
                        }
                    }
                    out[r][j] = column;
                    lasts
                });
                if done {
                    let n: usize = simulated.iter().map(Vec::len).sum();
                    let size = (square / n as f64).sqrt();
                    if size > 0.0 {
                        // The next difference moves the response by a NUDGE of its size.
                        scales[j] = (self.rms / size).clamp(1e-3 * scales[j], 1e3 * scales[j]);
                    }
                    break;
                }
            }
            moved[j] = point.shared[j];
            if !done {
                return None;
            }
        }
        let instance = self.structure.instance(&point.shared)?;
        let simulator = Simulator::new(&instance.model).ok()?;
        for r in 0..self.runs.len() {
            let mut own = point.own[r].clone();
            for i in 0..own.len() {
                let mut column = std::mem::take(&mut out[r][shared + i]);
                if self.offset && i + 1 == own.len() {
                    column.clear();
                    column.resize(simulated[r].len(), 1.0);
                } else {
                    own[i] = point.own[r][i] + self.nudge * own_scales[r][i];
                    let step = own[i] - point.own[r][i];
                    let lasts = self.simulate(&simulator, &instance, r, &own, &mut column);
                    own[i] = point.own[r][i];
                    if !lasts {
                        return None;
                    }
                    for (c, s) in column.iter_mut().zip(&simulated[r]) {
                        *c = (*c - s) / step;
                    }
                }
                out[r][shared + i] = column;
            }
        }
        Some(())
    }

    fn fit(&mut self, start: &Point) -> Option<Refined> {
        let mut point = start.clone();
        let mut simulated = Vec::new();
        let mut rss = self.all(&point, &mut simulated)?;
        let samples: usize = self.runs.iter().map(|r| r.range.len()).sum();
        let shared = if self.options.frozen { 0 } else { point.shared.len() };
        let own = point.own.first().map_or(0, Vec::len);
        let size = shared + own * self.runs.len();
        let mut scales = self.structure.scales();
        let own_scales: Vec<Vec<f64>> = self
            .runs
            .iter()
            .map(|run| {
                let reach = |k: usize| if run.limits[k] > 0.0 { 0.1 * run.limits[k] } else { 1.0 };
                let mut scales = vec![reach(0); own];
                scales[1] = reach(1);
                scales
            })
            .collect();
        let mut columns: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); shared + own]; self.runs.len()];
        let mut trial = Vec::new();
        let mut damping = 1e-6;
        let mut converged = false;
        let mut normal = DMatrix::zeros(size, size);
        for step in 0..=self.options.steps {
            if (self.options.cancelled)() {
                return None;
            }
            self.sensitivities(&point, &simulated, &mut scales, &own_scales, &mut columns)?;
            let gradient = self.normal(&columns, &simulated, shared, &mut normal);
            if converged || step == self.options.steps || self.spent > self.options.effort {
                break;
            }
            let began = rss;
            let mut taken = false;
            for _ in 0..6 {
                let Some(move_by) = damped_step(&normal, &gradient, damping) else {
                    damping = (damping * 10.0).max(1e-6);
                    continue;
                };
                let candidate = moved(&point, &move_by, shared, own);
                match self.all(&candidate, &mut trial) {
                    Some(found) if found < rss => {
                        let variance = found / samples.saturating_sub(size).max(1) as f64;
                        converged = rss - found < NOTICEABLE * variance;
                        (point, rss) = (candidate, found);
                        std::mem::swap(&mut simulated, &mut trial);
                        damping = (damping * 0.1).max(1e-12);
                        taken = true;
                        break;
                    }
                    // Nothing left to gain beyond the arithmetic's own noise.
                    Some(found) if found - rss < 1e-9 * rss && damping < 1e-3 => {
                        converged = true;
                        break;
                    }
                    _ => damping = (damping * 10.0).max(1e-6),
                }
                if (self.options.cancelled)() {
                    return None;
                }
            }
            if converged && !taken {
                break;
            }
            if let Some(bar) = self.options.bar {
                bar.reached(rss);
                if step >= PATIENCE && rss > HOPELESS.0 * bar.least() && rss > (1.0 - HOPELESS.1) * began {
                    break;
                }
            }
            if !taken {
                // No descent along any damped step. A difference may have straddled a stop of the motion, on whose two sides
                // the response moves differently: a wider one, from the other side, sees past it. One of many rivals is not
                // worth that.
                if self.options.frozen || self.options.bar.is_some() || self.nudge.abs() >= WIDEST * NUDGE {
                    break;
                }
                self.nudge *= -WIDER;
                damping = 1e-4;
            }
        }
        let residuals = self
            .runs
            .iter()
            .zip(&simulated)
            .map(|(run, s)| run.measured[run.range.clone()].iter().zip(s).map(|(y, s)| y - s).collect())
            .collect();
        let mut refined = Refined {
            point,
            rss,
            samples,
            residuals,
            simulated,
            sensitivities: columns,
            covariance: DMatrix::zeros(0, 0),
            converged,
        };
        if shared > 0
            && let Some(covariance) = scaled_inverse(&normal)
        {
            let variance = rss / samples.saturating_sub(size).max(1) as f64;
            refined.covariance = covariance.view((0, 0), (shared, shared)) * variance;
        }
        Some(refined)
    }

    /// `JᵀJ` into `normal`; returns `Jᵀ (measured − simulated)`.
    fn normal(
        &self,
        columns: &[Vec<Vec<f64>>],
        simulated: &[Vec<f64>],
        shared: usize,
        normal: &mut DMatrix<f64>,
    ) -> DVector<f64> {
        normal.fill(0.0);
        let mut gradient = DVector::zeros(normal.nrows());
        for (r, (run, columns)) in self.runs.iter().zip(columns).enumerate() {
            let own = columns.len() - shared;
            let place = |i: usize| if i < shared { i } else { shared + r * own + i - shared };
            let residual: Vec<f64> =
                run.measured[run.range.clone()].iter().zip(&simulated[r]).map(|(y, s)| y - s).collect();
            for (i, a) in columns.iter().enumerate() {
                gradient[place(i)] += crate::signal::dot(a, &residual);
                for (j, b) in columns[..=i].iter().enumerate() {
                    let sum = crate::signal::dot(a, b);
                    let (i, j) = (place(i), place(j));
                    normal[(i, j)] += sum;
                    if i != j {
                        normal[(j, i)] += sum;
                    }
                }
            }
        }
        gradient
    }
}

fn moved(point: &Point, by: &DVector<f64>, shared: usize, own: usize) -> Point {
    let mut next = point.clone();
    for j in 0..shared {
        next.shared[j] += by[j];
    }
    for (r, values) in next.own.iter_mut().enumerate() {
        for (i, v) in values.iter_mut().enumerate() {
            *v += by[shared + r * own + i];
        }
    }
    next
}

/// The step of Levenberg and Marquardt, in variables scaled to unit columns; columns without effect do not move.
fn damped_step(normal: &DMatrix<f64>, gradient: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let n = normal.nrows();
    let scale: Vec<f64> = (0..n).map(|i| unit(normal[(i, i)])).collect();
    let mut scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    for i in 0..n {
        scaled[(i, i)] += damping + 1e-13;
        if scale[i] == 0.0 {
            scaled[(i, i)] = 1.0;
        }
    }
    let right = DVector::from_fn(n, |i, _| gradient[i] * scale[i]);
    let step = scaled.cholesky()?.solve(&right);
    Some(DVector::from_fn(n, |i, _| step[i] * scale[i]))
}

fn unit(square: f64) -> f64 {
    if square > 0.0 { square.sqrt().recip() } else { 0.0 }
}

/// The inverse of a normal matrix, by way of unit columns; none where it is singular.
fn scaled_inverse(normal: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = normal.nrows();
    let scale: Vec<f64> = (0..n).map(|i| unit(normal[(i, i)])).collect();
    let mut scaled = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] * scale[i] * scale[j]);
    for i in 0..n {
        if scale[i] == 0.0 {
            scaled[(i, i)] = 1.0;
        }
        scaled[(i, i)] += 1e-13;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
