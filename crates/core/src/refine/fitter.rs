//! The iteration of Levenberg and Marquardt on simulated responses.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use crate::parallel::lock;
use crate::parallel::prelude::*;
use nalgebra::DMatrix;

use super::arrow::{Arrow, Correction};
use super::{FitOptions, Instance, Point, Refined, Run, SensorReading, Structure};
use crate::signal::dot;
use crate::simulate::{
    Delays, InputGrid, Limits, Output, Response, RunTask, SIDE_BY_SIDE, Simulator, Workspaces, later, run_beside,
};

/// Steps before a fit is held against the best of its rivals.
const STEPS_BEFORE_BAR: usize = 4;
/// A fit is given up if its sum of squares exceeds the best rival's by the first factor and fell in the last step by less
/// than the second share.
pub(super) const HOPELESS: (f64, f64) = (1.5, 0.4);

/// Step of a parameter for a finite difference: it moves the response by this share of the motion's RMS.
const DIFFERENCE_STEP: f64 = 1e-4;

/// Factor by which the difference is widened where no step leads down.
const WIDEN_DIFFERENCE: f64 = 8.0;
/// Widest difference, in units of [`DIFFERENCE_STEP`]; beyond, the fit ends.
const WIDEST_DIFFERENCE: f64 = 64.0;

/// A step that lowers the sum of squares by less than this many noise variances is the last: a small part of what chance
/// moves it by.
const MIN_GAIN: f64 = 0.05;

/// Factor by which a quantity that is positive by its nature changes in one step, at most.
const MAX_FACTOR: f64 = 1.6;

/// Dampings tried for one step, each ten times the one before: from a full step to next to none.
const MAX_DAMPINGS: usize = 9;

/// Steps in a row, at most, whose sensitivities are the last ones corrected by what the response did (a secant).
const MAX_SECANTS: usize = 3;
/// Dampings tried for a step with such sensitivities.
const SECANT_DAMPINGS: usize = 2;

/// A residual next to a jump of an acceleration that is this many times the usual one is the jump's own.
const STRAY_RESIDUAL: f64 = 3.0;

/// Largest error of a sampling interval of the simulation, as a share of the motion: far below [`DIFFERENCE_STEP`].
const TOLERANCE: f64 = 1e-7;

/// Delayed inputs that are kept: those of a few records at the point where a fit is, and at a step of a delay.
const MOST_DELAYED: usize = 16;

/// Integration steps that the location of one change of sign counts as.
const STEPS_PER_SWITCH: usize = 20;

/// Fits a structure to runs from a point.
///
/// None if the model at the start cannot be simulated along every run, or the fit was cancelled.
pub fn refine(structure: &dyn Structure, runs: &[Run], start: &Point, options: FitOptions<'_>) -> Option<Refined> {
    let fitter = Fitter::new(structure, runs, options);
    let fitted = fitter.fit(start);
    fitter.read_meter();
    fitted
}

/// The sum of squared residuals at a point, nothing fitted; none if the model cannot be simulated there.
pub fn misfit(structure: &dyn Structure, runs: &[Run], point: &Point, options: FitOptions<'_>) -> Option<f64> {
    let fitter = Fitter::new(structure, runs, options);
    let left = fitter.all(point, &mut Vec::new());
    fitter.read_meter();
    left
}

/// As [`misfit`], without what jumps of accelerations leave: see [`Refined::rss_beside_jumps`].
pub fn misfit_beside_jumps(
    structure: &dyn Structure,
    runs: &[Run],
    point: &Point,
    options: FitOptions<'_>,
) -> Option<f64> {
    let mut simulated = Vec::new();
    let fitter = Fitter::new(structure, runs, options);
    let left = fitter.all(point, &mut simulated);
    let left = left.map(|left| (left - fitter.at_jumps(point, &residuals(runs, &simulated))).max(0.0));
    fitter.read_meter();
    left
}

fn residuals(runs: &[Run], simulated: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let of_run = |(run, shown): (&Run, &Vec<f64>)| run.target().zip(shown).map(|(y, s)| y - s).collect();
    runs.iter().zip(simulated).map(of_run).collect()
}

/// What the sensors of each run would show at a point, weighted, output after output, nothing fitted; none if the model cannot
/// be simulated there.
pub fn respond(
    structure: &dyn Structure,
    runs: &[Run],
    point: &Point,
    options: FitOptions<'_>,
) -> Option<Vec<Vec<f64>>> {
    let mut simulated = Vec::new();
    let fitter = Fitter::new(structure, runs, options);
    let left = fitter.all(point, &mut simulated);
    fitter.read_meter();
    left.map(|_| simulated)
}

/// What a point leaves of each run, weighted, on which models can be compared: a sample of an acceleration next to a jump of the
/// simulated one that strays leaves no more than is usual. Nothing where the model cannot be simulated.
pub fn residuals_beside_jumps(
    structure: &dyn Structure,
    runs: &[Run],
    point: &Point,
    options: FitOptions<'_>,
) -> Option<Vec<Vec<f64>>> {
    let mut residuals = residuals(runs, &respond(structure, runs, point, options)?);
    let strays = Fitter::new(structure, runs, options).strays(point, &residuals);
    for (residuals, strays) in residuals.iter_mut().zip(strays) {
        strays.into_iter().for_each(|(k, usual)| residuals[k] = usual.sqrt().copysign(residuals[k]));
    }
    Some(residuals)
}

struct Fitter<'a> {
    structure: &'a dyn Structure,
    runs: &'a [Run],
    options: FitOptions<'a>,
    offset: bool,
    bounds: Vec<(f64, f64)>,
    /// Some output is an acceleration.
    rates: bool,
    /// RMS of the weighted motion.
    rms: f64,
    /// Integration steps so far, a change of side counted as [`STEPS_PER_SWITCH`].
    spent: AtomicUsize,
    /// The inputs of a record that act later than they were measured, as they were last asked for.
    delayed: Mutex<Vec<(usize, Delays, Arc<InputGrid>)>>,
}

/// Memory of one thread's simulations.
#[derive(Default)]
struct Scratch {
    workspaces: Workspaces,
    responses: [Response; SIDE_BY_SIDE],
    /// What a sensor shows late.
    moved: Vec<f64>,
}

/// A run of a model to be simulated.
#[derive(Clone, Copy)]
struct PreparedRun<'a> {
    ready: &'a PreparedStructure,
    run: usize,
    own: &'a [f64],
}

/// The motion of a run before a parameter is moved.
#[derive(Clone, Copy)]
struct ResponseBefore<'a> {
    /// What the sensors show.
    simulated: &'a [f64],
    /// Sides of the model's surfaces at each sample; empty where they do not matter.
    sides: &'a [u64],
}

/// A structure at certain parameters, ready to be simulated.
struct PreparedStructure {
    instance: Instance,
    simulator: Simulator,
    /// Internal states along each record, as the measured motion drives them: `[record][state][sample]`.
    driven: Vec<Vec<Vec<f64>>>,
    /// The inputs of each record where they act later than they were measured: `[record]`.
    delayed: Vec<Option<Arc<InputGrid>>>,
}

impl<'a> Fitter<'a> {
    fn new(structure: &'a dyn Structure, runs: &'a [Run], options: FitOptions<'a>) -> Self {
        let (mut square, mut count) = (0.0, 0);
        for run in runs {
            square += run.target().map(|y| y * y).sum::<f64>();
            count += run.rows();
        }
        Self {
            structure,
            runs,
            options,
            offset: structure.offset(),
            bounds: structure.bounds(),
            rates: runs.iter().any(Run::shows_rates),
            rms: (square / count.max(1) as f64).sqrt().max(f64::MIN_POSITIVE),
            spent: AtomicUsize::new(0),
            delayed: Mutex::default(),
        }
    }

    /// The model at these shared parameters; none out of bounds.
    fn ready(&self, shared: &[f64]) -> Option<PreparedStructure> {
        let instance = self.structure.instance(shared)?;
        let simulator = Simulator::new(&instance.model).ok()?;
        let drives = self.options.driven && self.structure.internals() > 0;
        let delays = &instance.delays;
        let (mut driven, mut delayed) = (Vec::new(), Vec::new());
        let mut before = usize::MAX;
        for run in self.runs.iter().filter(|_| drives || !delays.is_none()) {
            if run.record == before {
                continue;
            }
            before = run.record;
            if drives {
                driven.resize(run.record + 1, Vec::new());
                driven[run.record] = self.structure.driven(shared, run);
            }
            if !delays.is_none() {
                delayed.resize(run.record + 1, None);
                delayed[run.record] = Some(self.delayed(run, delays));
            }
        }
        Some(PreparedStructure { instance, simulator, driven, delayed })
    }

    /// The inputs of a run's record, later by delays.
    fn delayed(&self, run: &Run, delays: &Delays) -> Arc<InputGrid> {
        let known =
            lock(&self.delayed).iter().find(|(r, d, _)| *r == run.record && d == delays).map(|k| Arc::clone(&k.2));
        known.unwrap_or_else(|| {
            let grid = Arc::new(run.grid.delayed(delays));
            let mut all = lock(&self.delayed);
            all.truncate(MOST_DELAYED - 1);
            all.insert(0, (run.record, delays.clone(), Arc::clone(&grid)));
            grid
        })
    }

    /// Simulates some runs, [`SIDE_BY_SIDE`] at most, what the sensors show of each into `out`; those whose response does not last are
    /// left empty.
    fn simulate(&self, wanted: &[PreparedRun<'_>], offsets: &[f64], scratch: &mut Scratch, out: &mut [Vec<f64>]) {
        let Scratch { workspaces, responses, moved } = scratch;
        let initial = |PreparedRun { ready, run, own }: &PreparedRun<'_>| -> Vec<f64> {
            let run = &self.runs[*run];
            let driven = ready.driven.get(run.record).into_iter().flatten().map(|z| z[run.range.start]);
            own.iter().copied().chain(driven).collect()
        };
        let initial: Vec<Vec<f64>> = wanted.iter().map(initial).collect();
        let tasks: Vec<RunTask<'_>> = wanted
            .iter()
            .zip(&initial)
            .map(|(PreparedRun { ready, run, .. }, initial)| {
                let run = &self.runs[*run];
                RunTask {
                    simulator: &ready.simulator,
                    grid: ready.delayed.get(run.record).and_then(Option::as_deref).unwrap_or(&run.grid),
                    initial,
                    samples: run.range.clone(),
                    limits: Limits {
                        states: &run.limits,
                        tolerance: TOLERANCE,
                        cancelled: self.options.cancelled,
                        rates: self.rates,
                    },
                }
            })
            .collect();
        let abreast = wanted.iter().all(|other| other.run == wanted[0].run);
        run_beside(&tasks, abreast, workspaces, responses);
        for ((PreparedRun { ready, run, .. }, response), out) in wanted.iter().zip(responses).zip(out) {
            self.spent.fetch_add(response.steps + STEPS_PER_SWITCH * response.switches, Ordering::Relaxed);
            self.show(&ready.instance, &self.runs[*run], offsets, response, moved, out);
        }
    }

    /// What the sensors of a run show of a response; nothing where it does not last.
    fn show(
        &self,
        instance: &Instance,
        run: &Run,
        offsets: &[f64],
        response: &Response,
        moved: &mut Vec<f64>,
        out: &mut Vec<f64>,
    ) {
        out.clear();
        if response.len() < run.range.len() {
            return;
        }
        let freedoms = run.states() / 2;
        for (i, (output, weight)) in run.outputs.iter().zip(&run.weights).enumerate() {
            let offset = offsets.get(run.record * run.weights.len() + i).copied().unwrap_or(0.0);
            let ceiling = instance.ceiling.map_or(f64::INFINITY, f64::abs);
            let SensorReading { delay, gain } = instance.readings.get(i).copied().unwrap_or_default();
            let mut series = output.series(response, freedoms);
            if delay != 0.0 {
                later(series, delay / run.grid.interval(), moved);
                series = moved;
            }
            out.extend(series.iter().map(|x| weight * (gain * x + offset).clamp(-ceiling, ceiling)));
        }
        if !out.iter().all(|y| y.is_finite()) {
            out.clear();
        }
    }

    /// Simulates every run into `out`, `[run][row]`, and gives the sum of squares with that of the expectations; none if a response
    /// does not last.
    fn all(&self, point: &Point, out: &mut Vec<Vec<f64>>) -> Option<f64> {
        let ready = self.ready(&point.shared)?;
        out.resize_with(self.runs.len(), Vec::new);
        let together = ready.simulator.side_by_side();
        let left = |run: &Run, shown: &[f64]| {
            let square = || run.target().zip(shown).map(|(y, s)| (y - s).powi(2)).sum::<f64>();
            (shown.len() == run.rows()).then(square)
        };
        let lasts = out
            .par_chunks_mut(together)
            .enumerate()
            .with_min_len(2)
            .map_init(Scratch::default, |scratch, (chunk, out)| {
                let first = chunk * together;
                let wanted: Vec<PreparedRun<'_>> = (first..first + out.len())
                    .map(|run| PreparedRun { ready: &ready, run, own: &point.own[run] })
                    .collect();
                self.simulate(&wanted, &point.offsets, scratch, out);
                self.runs[first..].iter().zip(&*out).map(|(run, shown)| left(run, shown)).sum::<Option<f64>>()
            })
            .collect::<Vec<Option<f64>>>();
        let rss = lasts.into_iter().sum::<Option<f64>>()?
            + self.expectations(&point.shared).iter().map(|e| e * e).sum::<f64>();
        rss.is_finite().then_some(rss)
    }

    /// What is expected of the shared parameters, where they are fitted.
    fn expectations(&self, shared: &[f64]) -> Vec<f64> {
        if self.options.frozen { Vec::new() } else { self.structure.expectations(shared) }
    }

    /// On which sides of its surfaces each run's motion is, where that matters: `[run][sample]`.
    fn sides(&self, ready: &PreparedStructure, point: &Point) -> Vec<Vec<u64>> {
        if !self.rates || ready.simulator.surfaces().len() == 0 {
            return Vec::new();
        }
        (0..self.runs.len())
            .into_par_iter()
            .map_init(Scratch::default, |scratch, r| {
                self.simulate(
                    &[PreparedRun { ready, run: r, own: &point.own[r] }],
                    &point.offsets,
                    scratch,
                    &mut [Vec::new()],
                );
                std::mem::take(&mut scratch.responses[0].sides)
            })
            .collect()
    }

    /// What samples of accelerations next to a jump leave beyond what the others do.
    fn at_jumps(&self, point: &Point, residuals: &[Vec<f64>]) -> f64 {
        let of_run = |(strays, e): (Vec<(usize, f64)>, &Vec<f64>)| -> f64 {
            strays.into_iter().map(|(k, usual)| e[k] * e[k] - usual).sum()
        };
        self.strays(point, residuals).into_iter().zip(residuals).map(of_run).sum()
    }

    /// For each run the residuals that are a jump's own: samples of accelerations next to one, far from the usual. Their places in
    /// the run's residuals, and the mean square of those of their sensor. No runs where no acceleration is measured.
    fn strays(&self, point: &Point, residuals: &[Vec<f64>]) -> Vec<Vec<(usize, f64)>> {
        let Some(ready) = self.rates.then(|| self.ready(&point.shared)).flatten() else { return Vec::new() };
        let sides = self.sides(&ready, point);
        let of_run = |((run, sides), residuals): ((&Run, &Vec<u64>), &Vec<f64>)| -> Vec<(usize, f64)> {
            let changes = |k: usize| sides.get(k).zip(sides.get(k + 1)).is_some_and(|(a, b)| a != b);
            let next_to_jump = |k: usize| changes(k) || k > 0 && changes(k - 1);
            let rows = run.range.len().max(1);
            let of_output = |(place, (output, e)): (usize, (&Output, &[f64]))| -> Vec<(usize, f64)> {
                let usual = dot(e, e) / e.len().max(1) as f64;
                let strays = |k: usize| e[k] * e[k] > STRAY_RESIDUAL * STRAY_RESIDUAL * usual && next_to_jump(k);
                let strays = (0..e.len()).filter(|k| output.is_rate() && strays(*k));
                strays.map(|k| (place * rows + k, usual)).collect()
            };
            run.outputs.iter().zip(residuals.chunks(rows)).enumerate().flat_map(of_output).collect()
        };
        self.runs.iter().zip(&sides).zip(residuals).map(of_run).collect()
    }

    /// Makes a response after a step of a parameter a slope: the difference from the response before, over the step. At a
    /// sample of an acceleration that a jump has passed over, it is zero.
    fn slope(&self, run: usize, column: &mut [f64], step: f64, before: ResponseBefore<'_>, sides: &[u64]) {
        column.iter_mut().zip(before.simulated).for_each(|(c, s)| *c = (*c - s) / step);
        let length = self.runs[run].range.len();
        for (output, column) in self.runs[run].outputs.iter().zip(column.chunks_mut(length.max(1))) {
            if output.is_rate() {
                let passed = before.sides.iter().zip(sides).map(|(a, b)| a != b);
                column.iter_mut().zip(passed).filter(|(_, passed)| *passed).for_each(|(c, _)| *c = 0.0);
            }
        }
    }

    /// The model with a shared parameter moved by about a step, and the step; none out of bounds.
    fn moved(&self, point: &Point, index: usize, step: f64) -> Option<(PreparedStructure, f64)> {
        let mut moved = point.shared.clone();
        moved[index] += step;
        let step = moved[index] - point.shared[index];
        Some((self.ready(&moved)?, step))
    }

    /// A run's initial values, each of them moved by about a step in turn, and the steps.
    fn moved_own(&self, run: usize, own: &[f64], nudge: f64) -> Vec<(Vec<f64>, f64)> {
        let run = &self.runs[run];
        let moved = |i: usize| {
            let reach = run.limits.get(i).filter(|l| i < run.states() && **l > 0.0).map_or(1.0, |l| 0.1 * l);
            let mut moved = own.to_vec();
            moved[i] += nudge * reach;
            let step = moved[i] - own[i];
            (moved, step)
        };
        (0..own.len()).map(moved).collect()
    }

    /// The slopes of responses by what was moved by a step, one column each; none where a response does not last. All that is moved
    /// of a run goes side by side with the run as it is, in the same steps: what those miss is no part of a difference.
    fn slopes(
        &self,
        wanted: &[(PreparedRun<'_>, f64)],
        present: (&PreparedStructure, &Point),
    ) -> Vec<Option<Vec<f64>>> {
        let (ready, point) = present;
        let count = ready.simulator.side_by_side() - 1;
        let together: Vec<&[(PreparedRun<'_>, f64)]> =
            wanted.chunk_by(|(a, _), (b, _)| a.run == b.run).flat_map(|run| run.chunks(count)).collect();
        let slopes = together.par_iter().map_init(Scratch::default, |scratch, together| {
            let run = together[0].0.run;
            let as_it_is = PreparedRun { ready, run, own: &point.own[run] };
            let runs: Vec<PreparedRun<'_>> =
                std::iter::once(as_it_is).chain(together.iter().map(|(wanted, _)| *wanted)).collect();
            let mut shown = vec![Vec::new(); runs.len()];
            self.simulate(&runs, &point.offsets, scratch, &mut shown);
            let mut columns = shown.into_iter().zip(&scratch.responses);
            let Some((before, response)) = columns.next() else { return Vec::new() };
            let before = ResponseBefore { simulated: &before, sides: &response.sides };
            let slope = |((mut column, response), (_, step)): ((Vec<f64>, &Response), &(PreparedRun<'_>, f64))| {
                if column.is_empty() || before.simulated.is_empty() {
                    return None;
                }
                self.slope(run, &mut column, *step, before, &response.sides);
                Some(column)
            };
            columns.zip(*together).map(slope).collect::<Vec<_>>()
        });
        slopes.collect::<Vec<_>>().into_iter().flatten().collect()
    }

    /// What the response of every run does as each unknown moves: `[run][unknown][row]`.
    fn sensitivities(
        &self,
        point: &Point,
        simulated: &[Vec<f64>],
        nudge: f64,
        scales: &mut [f64],
    ) -> Option<Vec<Vec<Vec<f64>>>> {
        let shared = self.shared(point);
        let ready = self.ready(&point.shared)?;
        let runs = 0..self.runs.len();
        let forward: Vec<Option<(PreparedStructure, f64)>> =
            (0..shared).into_par_iter().map(|j| self.moved(point, j, nudge * scales[j])).collect();
        let own: Vec<Vec<(Vec<f64>, f64)>> =
            runs.clone().map(|run| self.moved_own(run, &point.own[run], nudge)).collect();
        let mut wanted: Vec<(PreparedRun<'_>, f64)> = Vec::new();
        for run in runs.clone() {
            let shared = forward.iter().flatten();
            wanted.extend(shared.map(|(ready, step)| (PreparedRun { ready, run, own: &point.own[run] }, *step)));
            wanted.extend(own[run].iter().map(|(own, step)| (PreparedRun { ready: &ready, run, own }, *step)));
        }
        let mut slopes = self.slopes(&wanted, (&ready, point)).into_iter();
        let mut by_shared = vec![Vec::new(); shared];
        let mut by_own = Vec::new();
        for own in &own {
            for (columns, moved) in by_shared.iter_mut().zip(&forward) {
                columns.push(moved.as_ref().and_then(|_| slopes.next().flatten()));
            }
            by_own.push(slopes.by_ref().take(own.len()).collect::<Option<Vec<_>>>()?);
        }
        // Forward, else backward where the forward point is out of bounds or its simulation does not last.
        let backward = |j: usize, step: f64| -> Option<Vec<Vec<f64>>> {
            let (moved, step) = self.moved(point, j, step)?;
            let of_run = |run: usize| (PreparedRun { ready: &moved, run, own: &point.own[run] }, step);
            let wanted: Vec<(PreparedRun<'_>, f64)> = runs.clone().map(of_run).collect();
            self.slopes(&wanted, (&ready, point)).into_iter().collect()
        };
        let rows: usize = simulated.iter().map(Vec::len).sum();
        let mut columns = vec![Vec::new(); self.runs.len()];
        for (j, (forward, scale)) in by_shared.into_iter().zip(scales.iter_mut()).enumerate() {
            let forward: Option<Vec<Vec<f64>>> = forward.into_iter().collect();
            let found = forward.or_else(|| backward(j, -nudge * *scale))?;
            let size = (found.iter().flatten().map(|c| c * c).sum::<f64>() / rows as f64).sqrt();
            if size > 0.0 {
                // The next difference moves the response by a nudge of its size.
                *scale = (self.rms / size).clamp(1e-3 * *scale, 1e3 * *scale);
            }
            for (run, column) in columns.iter_mut().zip(found) {
                run.push(column);
            }
        }
        for ((r, columns), own) in columns.iter_mut().enumerate().zip(by_own) {
            let run = &self.runs[r];
            for (i, weight) in run.weights.iter().enumerate().filter(|_| self.offset) {
                let length = run.range.len();
                let mut column = vec![0.0; simulated[r].len()];
                column[i * length..(i + 1) * length].fill(*weight);
                columns.push(column);
            }
            columns.extend(own);
        }
        Some(columns)
    }

    /// The normal equations; `columns[run][unknown][row]` are the sensitivities, `simulated[run][row]` the responses.
    fn arrow(&self, columns: &[Vec<Vec<f64>>], simulated: &[Vec<f64>], point: &Point, scales: &[f64]) -> Arrow {
        let (shared, offsets) = (self.shared(point), point.offsets.len());
        let mut arrow = Arrow::new(shared + offsets);
        let mut residual = Vec::new();
        for ((run, columns), simulated) in self.runs.iter().zip(columns).zip(simulated) {
            residual.clear();
            residual.extend(run.target().zip(simulated).map(|(y, s)| y - s));
            let channels = if offsets > 0 { run.weights.len() } else { 0 };
            let first = shared + run.record * channels;
            let places: Vec<usize> = (0..shared).chain(first..first + channels).collect();
            arrow.push(columns, &places, &residual);
        }
        self.expect(&mut arrow, point, scales);
        arrow
    }

    /// Takes the expectations of the shared parameters into the normal equations.
    fn expect(&self, arrow: &mut Arrow, point: &Point, scales: &[f64]) {
        let here = self.expectations(&point.shared);
        if here.is_empty() {
            return;
        }
        let mut moved = point.shared.clone();
        let slope = |k: usize| -> Vec<f64> {
            let step = DIFFERENCE_STEP * scales[k];
            moved[k] += step;
            let there = self.expectations(&moved);
            moved[k] = point.shared[k];
            there.iter().zip(&here).map(|(there, here)| (there - here) / step).collect()
        };
        let columns: Vec<Vec<f64>> = (0..point.shared.len()).map(slope).collect();
        let missed: Vec<f64> = here.iter().map(|e| -e).collect();
        arrow.add(&columns, &missed);
    }

    /// Corrects sensitivities by what a step did to the responses, `before` and `after`, by the smallest change that makes
    /// them agree with it (C. G. Broyden, Math. Comp. 19 (1965) 577–593), each unknown measured by what it does to the response.
    fn secant(
        &self,
        columns: &mut [Vec<Vec<f64>>],
        before: &[Vec<f64>],
        after: &[Vec<f64>],
        by: &Correction,
        shared: usize,
        offsets: usize,
    ) {
        let mut missed = Vec::new();
        for (r, (run, columns)) in self.runs.iter().zip(columns).enumerate() {
            let channels = if offsets > 0 { run.weights.len() } else { 0 };
            let first = shared + run.record * channels;
            let moved: Vec<f64> = by.shared[..shared]
                .iter()
                .chain(&by.shared[first..first + channels])
                .chain(by.own[r].iter())
                .copied()
                .collect();
            let sizes: Vec<f64> = columns.iter().map(|c| c.iter().map(|v| v * v).sum()).collect();
            let length: f64 = moved.iter().zip(&sizes).map(|(m, s)| m * m * s).sum();
            if length <= 0.0 || !length.is_finite() {
                continue;
            }
            missed.clear();
            missed.extend(after[r].iter().zip(&before[r]).map(|(a, b)| a - b));
            for (column, m) in columns.iter().zip(&moved) {
                missed.iter_mut().zip(column).for_each(|(e, c)| *e -= m * c);
            }
            for ((column, m), size) in columns.iter_mut().zip(&moved).zip(&sizes) {
                let share = m * size / length;
                column.iter_mut().zip(&missed).for_each(|(c, e)| *c += share * e);
            }
        }
    }

    /// What the values of the shared block may be after a step from where they are.
    fn reach(&self, shared: &[f64]) -> Vec<(f64, f64)> {
        let positive = |(value, (low, high)): (&f64, &(f64, f64))| {
            if *low > 0.0 { (low.max(value / MAX_FACTOR), high.min(value * MAX_FACTOR)) } else { (*low, *high) }
        };
        shared.iter().zip(&self.bounds).map(positive).collect()
    }

    fn fit(&self, start: &Point) -> Option<Refined> {
        let mut descent = Descent::new(self, start)?;
        let arrow = descent.run()?;
        Some(descent.refined(&arrow))
    }

    /// Number of shared parameters that are fitted.
    fn shared(&self, point: &Point) -> usize {
        if self.options.frozen { 0 } else { point.shared.len() }
    }

    fn is_cancelled(&self) -> bool {
        (self.options.cancelled)()
    }

    /// Counts the steps taken, where somebody counts.
    fn read_meter(&self) {
        if let Some(meter) = self.options.meter {
            meter.add(self.spent.load(Ordering::Relaxed));
        }
    }
}

/// A fit on its way down.
struct Descent<'f, 'a> {
    fitter: &'f Fitter<'a>,
    point: Point,
    /// The response there: `[run][row]`.
    simulated: Vec<Vec<f64>>,
    /// The sum of squares there.
    rss: f64,
    /// Number of residuals.
    samples: usize,
    /// Number of expectations.
    expectations: usize,
    /// Residuals and expectations less what is fitted.
    freedom: f64,
    /// A change of each shared parameter that moves the response by its size.
    scales: Vec<f64>,
    /// Share of that by which parameters are moved for a difference; negative for backwards.
    nudge: f64,
    /// Of Levenberg and Marquardt.
    damping: f64,
    /// Sensitivities there: `[run][unknown][row]`.
    columns: Vec<Vec<Vec<f64>>>,
    /// Secant updates of the sensitivities since they were computed.
    updates: usize,
    /// No step would change the fit noticeably.
    converged: bool,
    /// Memory for the responses of steps that are tried.
    trial: Vec<Vec<f64>>,
}

/// What the dampings tried for a step came to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum StepResult {
    /// None leads down.
    None,
    /// The first one does.
    AtOnce,
    /// A later one does.
    Damped,
}

impl<'f, 'a> Descent<'f, 'a> {
    /// At the start, moved within its bounds; none if the model cannot be simulated there.
    fn new(fitter: &'f Fitter<'a>, start: &Point) -> Option<Self> {
        let mut point = start.clone();
        for (value, (low, high)) in point.shared.iter_mut().zip(&fitter.bounds) {
            *value = value.clamp(*low, *high);
        }
        let mut simulated = Vec::new();
        let rss = fitter.all(&point, &mut simulated)?;
        let samples: usize = fitter.runs.iter().map(Run::rows).sum();
        let own: usize = point.own.iter().map(Vec::len).sum();
        let expectations = fitter.expectations(&point.shared).len();
        let unknowns = fitter.shared(&point) + point.offsets.len() + own;
        Some(Self {
            fitter,
            simulated,
            rss,
            samples,
            expectations,
            freedom: (samples + expectations).saturating_sub(unknowns).max(1) as f64,
            scales: fitter.structure.scales(),
            nudge: DIFFERENCE_STEP,
            damping: 1e-5,
            columns: Vec::new(),
            updates: 0,
            converged: false,
            trial: Vec::new(),
            point,
        })
    }

    /// Steps down until nothing is gained, or no more steps may be taken. Gives the normal equations of the last sensitivities;
    /// none if cancelled, or if the model cannot be simulated around a point.
    fn run(&mut self) -> Option<Arrow> {
        let Fitter { options, rates, .. } = self.fitter;
        let common = self.fitter.shared(&self.point) + self.point.offsets.len();
        let mut fresh = true;
        let mut steps = 0;
        loop {
            if self.fitter.is_cancelled() {
                return None;
            }
            if fresh {
                self.differentiate()?;
            }
            let arrow = self.arrow();
            let ended = steps >= options.steps || self.fitter.spent.load(Ordering::Relaxed) > options.effort;
            if self.converged || ended {
                if self.updates == 0 {
                    return Some(arrow);
                }
                self.differentiate()?;
                return Some(self.arrow());
            }
            steps += 1;
            let began = self.rss;
            let step = self.step(&arrow)?;
            if self.updates > 0 && (self.converged || step == StepResult::None) {
                // A secant is no proof: the sensitivities themselves are asked.
                self.converged = false;
                fresh = true;
                continue;
            }
            if self.converged {
                // The last step was next to none: the sensitivities are still those of the point.
                return Some(arrow);
            }
            // A secant across jumps of an acceleration is none.
            fresh = step != StepResult::AtOnce || self.updates >= MAX_SECANTS || common <= 1 || *rates;
            self.updates += 1;
            if let Some(bar) = options.bar {
                bar.reached(self.rss);
                if steps > STEPS_BEFORE_BAR
                    && self.rss > HOPELESS.0 * bar.least()
                    && self.rss > (1.0 - HOPELESS.1) * began
                {
                    return Some(arrow);
                }
            }
            if step == StepResult::None {
                // No descent along any damped step. A difference may have straddled a stop of the motion, on whose two sides
                // the response moves differently: a wider one, from the other side, sees past it. One of many rivals is not
                // worth that.
                if options.frozen || options.bar.is_some() || self.nudge.abs() >= WIDEST_DIFFERENCE * DIFFERENCE_STEP {
                    return Some(arrow);
                }
                self.nudge *= -WIDEN_DIFFERENCE;
                self.damping = 1e-4;
            }
        }
    }

    /// Computes the sensitivities at the point.
    fn differentiate(&mut self) -> Option<()> {
        self.columns = self.fitter.sensitivities(&self.point, &self.simulated, self.nudge, &mut self.scales)?;
        self.updates = 0;
        Some(())
    }

    /// The normal equations at the point.
    fn arrow(&self) -> Arrow {
        self.fitter.arrow(&self.columns, &self.simulated, &self.point, &self.scales)
    }

    /// Goes to the first point that leads down, of steps damped more and more; none if cancelled.
    fn step(&mut self, arrow: &Arrow) -> Option<StepResult> {
        let (shared, offsets) = (self.fitter.shared(&self.point), self.point.offsets.len());
        let at: Vec<f64> = self.point.shared[..shared].iter().chain(&self.point.offsets).copied().collect();
        let reach = if shared > 0 { self.fitter.reach(&self.point.shared) } else { Vec::new() };
        for attempt in 0..if self.updates > 0 { SECANT_DAMPINGS } else { MAX_DAMPINGS } {
            let Some(by) = arrow.step(self.damping, &at, &reach) else {
                self.damping = (self.damping * 10.0).max(1e-6);
                continue;
            };
            let candidate = moved(&self.point, &by, shared);
            match self.fitter.all(&candidate, &mut self.trial) {
                Some(found) if found < self.rss => {
                    self.converged = self.rss - found < MIN_GAIN * found / self.freedom;
                    (self.point, self.rss) = (candidate, found);
                    std::mem::swap(&mut self.simulated, &mut self.trial);
                    self.damping = (self.damping * 0.1).max(1e-12);
                    let at_once = attempt == 0;
                    if at_once && self.updates < MAX_SECANTS && shared + offsets > 1 && !self.fitter.rates {
                        self.fitter.secant(&mut self.columns, &self.trial, &self.simulated, &by, shared, offsets);
                    }
                    return Some(if at_once { StepResult::AtOnce } else { StepResult::Damped });
                }
                // Nothing left to gain beyond the arithmetic's own noise.
                Some(found) if found - self.rss < 1e-9 * self.rss && self.damping < 1e-3 => {
                    self.converged = true;
                    return Some(StepResult::None);
                }
                _ => self.damping = (self.damping * 10.0).max(1e-6),
            }
            if self.fitter.is_cancelled() {
                return None;
            }
        }
        Some(StepResult::None)
    }

    /// The fit as it stands, with the covariance that the normal equations give.
    fn refined(self, arrow: &Arrow) -> Refined {
        let Fitter { runs, bounds, .. } = self.fitter;
        let shared = self.fitter.shared(&self.point);
        let residual = |(run, s): (&Run, &Vec<f64>)| run.target().zip(s).map(|(y, s)| y - s).collect();
        let residuals: Vec<Vec<f64>> = runs.iter().zip(&self.simulated).map(residual).collect();
        let held = |(value, (low, high)): (&f64, &(f64, f64))| value <= low || value >= high;
        let mut at_bound: Vec<bool> = self.point.shared.iter().zip(bounds).map(held).collect();
        at_bound.resize(self.point.shared.len(), false);
        let covariance = if shared > 0 { arrow.inverse(shared, &at_bound) } else { None };
        Refined {
            rss_at_jumps: self.fitter.at_jumps(&self.point, &residuals),
            point: self.point,
            rss: self.rss,
            expectations: self.expectations,
            samples: self.samples,
            residuals,
            simulated: self.simulated,
            sensitivities: self.columns,
            covariance: covariance.map_or_else(|| DMatrix::zeros(0, 0), |c| c * (self.rss / self.freedom)),
            at_bound,
            converged: self.converged,
        }
    }
}

fn moved(point: &Point, by: &Correction, shared: usize) -> Point {
    let mut next = point.clone();
    let (of_shared, of_offsets) = by.shared.split_at(shared);
    next.shared.iter_mut().zip(of_shared).for_each(|(v, by)| *v += by);
    next.offsets.iter_mut().zip(of_offsets).for_each(|(v, by)| *v += by);
    for (values, by) in next.own.iter_mut().zip(&by.own) {
        values.iter_mut().zip(by.iter()).for_each(|(v, by)| *v += by);
    }
    next
}
