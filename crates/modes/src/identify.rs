//! The linear base: how many modes the data bear, and each with its uncertainty.

use std::f64::consts::{PI, TAU};

use nalgebra::{Complex, DMatrix};

use super::error::ModesError;
use super::judge::{Residuals, beats};
use super::limits::{
    CHOICE_ROWS, HELD_OUT, LAST_POLE_STEPS, LEAST_ERROR, MODE_GAIN, MOST_MODES, PATIENCE, POLE_RATES, POLE_STEPS,
    POOL_DISTANCE, SAME_POLE,
};
use super::linear::{ForceSeries, LinearTask, ModalFit, PolePool};
use super::measurement::{Measurement, Sensor, SensorSeries};
use super::pole::Pole;
use super::start::RecordStart;
use super::subspace::{self, Channels};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;
use sindyscope_values::model::Mode;

/// Records to fit and records to judge by.
pub(crate) struct Split {
    pub(crate) fitted: Vec<SensorSeries>,
    pub(crate) unseen: Vec<SensorSeries>,
}

impl Split {
    /// Records held out judge; without them the last record, or the end of the only one.
    pub(crate) fn new(measurement: &Measurement) -> Self {
        let fitted = &measurement.fitted;
        if !measurement.held_out.is_empty() {
            return Self { fitted: fitted.clone(), unseen: measurement.held_out.clone() };
        }
        if let [most @ .., last] = fitted.as_slice()
            && !most.is_empty()
        {
            return Self { fitted: most.to_vec(), unseen: vec![last.clone()] };
        }
        let cut = |s: &SensorSeries| ((1.0 - HELD_OUT) * s.len() as f64) as usize;
        Self {
            fitted: fitted.iter().map(|s| s.part(0..cut(s))).collect(),
            unseen: fitted.iter().map(|s| s.part(cut(s)..s.len())).collect(),
        }
    }

    /// All that is fitted and all that is held out.
    pub(crate) fn whole(measurement: &Measurement) -> Self {
        Self { fitted: measurement.fitted.clone(), unseen: measurement.held_out.clone() }
    }

    pub(crate) fn intervals(&self) -> Vec<f64> {
        self.unseen.iter().map(|s| s.interval).collect()
    }
}

/// Sets of poles of growing number, each with what it leaves.
pub(crate) struct Path {
    pub(crate) steps: Vec<ModePathStep>,
    /// The chosen one.
    pub(crate) chosen: usize,
    /// All poles that were proposed.
    pub(crate) pool: Vec<Pole>,
}

/// One number of modes.
pub(crate) struct ModePathStep {
    pub(crate) poles: Vec<Pole>,
    pub(crate) residuals: Residuals,
    pub(crate) densities: Vec<f64>,
}

/// What is asked of a path.
pub(crate) struct PathRequest<'a> {
    /// Number of modes; else chosen by data never fitted.
    pub(crate) modes: Option<usize>,
    pub(crate) most: usize,
    pub(crate) steps: usize,
    /// Poles known before, which are tried first.
    pub(crate) known: &'a [Pole],
    pub(crate) rates: &'a [(usize, usize)],
}

impl Default for PathRequest<'_> {
    fn default() -> Self {
        Self { modes: None, most: MOST_MODES, steps: POLE_STEPS, known: &[], rates: &POLE_RATES }
    }
}

/// Poles that subspace identification proposes, at several rates.
pub(crate) fn pool(series: &[SensorSeries], force: Option<&ForceSeries>, rates: &[(usize, usize)]) -> Vec<Pole> {
    let channels = |(k, s): (usize, &SensorSeries)| Channels {
        interval: s.interval,
        drives: s
            .inputs
            .iter()
            .cloned()
            .chain(force.map(|f| f.values[k].iter().copied().step_by(f.parts).take(s.len()).collect()))
            .collect(),
        outputs: s.outputs.clone(),
    };
    let records: Vec<Channels> = series.iter().enumerate().map(channels).collect();
    let longest = series.iter().map(|s| s.len() as f64 * s.interval).fold(0.0, f64::max);
    let found: Vec<Vec<Pole>> = rates.par_iter().map(|(by, rows)| subspace::poles(&records, *by, *rows)).collect();
    let slow = |p: &Pole| p.omega * longest > 1.5 * TAU;
    subspace::distinct(found.into_iter().flatten().filter(slow), POOL_DISTANCE.0, POOL_DISTANCE.1)
}

/// Chooses and refines poles one after the other.
pub(crate) fn path(
    measurement: &Measurement,
    split: &Split,
    request: &PathRequest<'_>,
    cancel: &Cancel,
) -> Result<Path, ModesError> {
    let mut pool = request.known.to_vec();
    pool.extend(self::pool(&split.fitted, None, request.rates));
    let rows: usize = split.fitted.iter().map(SensorSeries::len).sum();
    let task = LinearTask::new(&split.fitted, &measurement.sensors, None, 1);
    let coarse = LinearTask::new(&split.fitted, &measurement.sensors, None, rows / CHOICE_ROWS);
    let pool = coarse.pool(&pool);
    let unseen = LinearTask::new(&split.unseen, &measurement.sensors, None, 1);
    let most = request.modes.unwrap_or(request.most);
    let mut steps: Vec<ModePathStep> = Vec::new();
    let mut poles: Vec<Pole> = Vec::new();
    let (mut chosen, mut idle) = (0, 0);
    while poles.len() < most {
        if cancel.is_cancelled() {
            return Err(ModesError::Cancelled);
        }
        let Some(next) = further(&coarse, &poles, &pool, &|p| is_new(&poles, p, SAME_POLE)) else { break };
        poles.push(next);
        let Some(fit) = task.refine(&poles, request.steps, cancel) else { break };
        poles.clone_from(&fit.poles);
        let Some(step) = judged(measurement, split, (&task, &unseen), &fit) else { break };
        let better = steps.get(chosen).is_none_or(|best: &ModePathStep| {
            step.residuals.unseen_rms() < (1.0 - MODE_GAIN) * best.residuals.unseen_rms()
                && beats(&step.densities, &best.densities)
        });
        steps.push(step);
        if better {
            (chosen, idle) = (steps.len() - 1, 0);
        } else {
            idle += 1;
        }
        let exact = steps[chosen].residuals.unseen_rms() < LEAST_ERROR;
        if request.modes.is_none() && (exact || idle > PATIENCE) {
            break;
        }
    }
    if steps.is_empty() {
        return Err(if cancel.is_cancelled() { ModesError::Cancelled } else { ModesError::NoMode });
    }
    if request.modes.is_some() {
        chosen = steps.len() - 1;
    } else if let Some(step) = pruned(measurement, split, (&task, &unseen), &steps[chosen], request.steps, cancel) {
        steps.push(step);
        chosen = steps.len() - 1;
    }
    Ok(Path { steps, chosen, pool: pool.poles })
}

/// The only step of a path whose poles are known: refined by so many steps, and judged as any other.
pub(crate) fn chosen_path(
    measurement: &Measurement,
    split: &Split,
    poles: &[Pole],
    refinement: usize,
    cancel: &Cancel,
) -> Result<Path, ModesError> {
    let task = LinearTask::new(&split.fitted, &measurement.sensors, None, 1);
    let unseen = LinearTask::new(&split.unseen, &measurement.sensors, None, 1);
    let fit = task.refine(poles, refinement, cancel);
    let step = fit.and_then(|fit| judged(measurement, split, (&task, &unseen), &fit));
    let failed = || if cancel.is_cancelled() { ModesError::Cancelled } else { ModesError::NoMode };
    Ok(Path { steps: vec![step.ok_or_else(failed)?], chosen: 0, pool: poles.to_vec() })
}

/// A fit of the fitted records with what it leaves of them and of those never fitted.
fn judged(
    measurement: &Measurement,
    split: &Split,
    (task, unseen): (&LinearTask<'_>, &LinearTask<'_>),
    fit: &ModalFit,
) -> Option<ModePathStep> {
    let residuals = Residuals {
        fitted: residuals(task, fit, &split.fitted),
        unseen: unseen.unseen(fit)?,
        unknowns: unknowns(measurement, &fit.poles),
    };
    let densities = residuals.densities(&split.intervals(), main_period(&split.fitted));
    Some(ModePathStep { poles: fit.poles.clone(), residuals, densities })
}

/// Without the modes that data never fitted do not ask for once all are there; none where they ask for all.
fn pruned(
    measurement: &Measurement,
    split: &Split,
    (task, unseen): (&LinearTask<'_>, &LinearTask<'_>),
    whole: &ModePathStep,
    steps: usize,
    cancel: &Cancel,
) -> Option<ModePathStep> {
    let mut best: Option<ModePathStep> = None;
    loop {
        let now = best.as_ref().unwrap_or(whole);
        if now.poles.len() < 2 || cancel.is_cancelled() {
            return best;
        }
        let fits = (0..now.poles.len()).filter_map(|k| {
            let mut poles = now.poles.clone();
            poles.remove(k);
            task.fit(&poles)
        });
        let least = fits.min_by(|a, b| a.squares.total_cmp(&b.squares))?;
        let step = judged(measurement, split, (task, unseen), &task.refine(&least.poles, steps, cancel)?)?;
        let worse = step.residuals.unseen_rms() * (1.0 - MODE_GAIN) > whole.residuals.unseen_rms()
            && beats(&whole.densities, &step.densities);
        if worse {
            return best;
        }
        best = Some(step);
    }
}

/// Values that are fitted with these poles: each one's frequency, damping and amplitudes.
fn unknowns(measurement: &Measurement, poles: &[Pole]) -> usize {
    poles.len() * (2 + measurement.inputs.len().max(1) * measurement.sensors.len())
}

pub(crate) fn residuals(task: &LinearTask<'_>, fit: &ModalFit, series: &[SensorSeries]) -> Vec<Vec<Vec<f64>>> {
    (0..series.len()).map(|r| (0..task.sensors).map(|s| task.residual(fit, s, r)).collect()).collect()
}

/// True if a pole is none of those that are there: `apart` is the least distance from these, as a logarithm of the frequency.
pub(crate) fn is_new(poles: &[Pole], pole: &Pole, apart: f64) -> bool {
    poles.iter().all(|q| (pole.omega / q.omega).ln().abs() >= apart)
}

/// The pole of a pool that takes most off what the present ones leave, of those that `open` lets in.
pub(crate) fn further(
    task: &LinearTask<'_>,
    poles: &[Pole],
    pool: &PolePool,
    open: &dyn Fn(&Pole) -> bool,
) -> Option<Pole> {
    let fit = task.fit(poles)?;
    let gains = task.gains(&fit, pool);
    let free = pool.poles.iter().zip(&gains).filter(|(p, g)| open(p) && g.is_finite());
    free.max_by(|a, b| a.1.total_cmp(b.1)).map(|(p, _)| *p)
}

/// The period of the strongest line of the records' slowest moving sensor, s.
pub(crate) fn main_period(series: &[SensorSeries]) -> f64 {
    let of = |s: &SensorSeries| {
        let peaks = s.outputs.iter().filter_map(|y| {
            let spectrum = sindyscope_core::signal::Spectrum::new(y, s.interval)?;
            spectrum.peak().map(|p| p.frequency.recip())
        });
        peaks.fold(0.0, f64::max)
    };
    let longest = series.iter().map(of).fold(0.0, f64::max);
    let whole = series.iter().map(|s| s.len() as f64 * s.interval).fold(0.0, f64::max);
    if longest > 0.0 { longest } else { whole / 20.0 }
}

/// The linear model of all fitted records.
pub(crate) struct Linear {
    pub(crate) residuals: Residuals,
    pub(crate) modes: Vec<Mode>,
    /// `participation[mode][input]`: what a unit of the input drives the mode with, whose shape's largest entry is one.
    pub(crate) participation: Vec<Vec<f64>>,
    /// How each fitted record begins.
    pub(crate) starts: Vec<RecordStart>,
}

/// Refines poles on all fitted records.
pub(crate) fn linear(measurement: &Measurement, poles: &[Pole], cancel: &Cancel) -> Result<Linear, ModesError> {
    let task = LinearTask::new(&measurement.fitted, &measurement.sensors, None, 1);
    let failed = || if cancel.is_cancelled() { ModesError::Cancelled } else { ModesError::NoMode };
    let mut poles = poles.to_vec();
    poles.sort_by(|a, b| a.omega.total_cmp(&b.omega));
    let fit = task.refine(&poles, LAST_POLE_STEPS, cancel).ok_or_else(failed)?;
    let unseen = LinearTask::new(&measurement.held_out, &measurement.sensors, None, 1);
    let residuals = Residuals {
        fitted: residuals(&task, &fit, &measurement.fitted),
        unseen: if measurement.held_out.is_empty() { Vec::new() } else { unseen.unseen(&fit).ok_or_else(failed)? },
        unknowns: unknowns(measurement, &fit.poles),
    };
    let FittedModes { modes, participation, starts } = modes(measurement, &task, &fit, &residuals);
    Ok(Linear { residuals, modes, participation, starts })
}

/// Times that a residual's correlation makes an estimate's variance larger than that of as many independent samples.
pub(crate) fn inflation(residual: &[f64]) -> f64 {
    let n = residual.len();
    let power: f64 = residual.iter().map(|r| r * r).sum();
    let mut sum = 1.0;
    for lag in (1..n.min(400)).step_by(2) {
        let at = |lag: usize| sindyscope_core::signal::dot(&residual[..n - lag], &residual[lag..]) / power;
        let pair = at(lag) + at(lag + 1);
        if !pair.is_finite() || pair <= 0.0 {
            break;
        }
        sum += 2.0 * pair;
    }
    sum
}

/// Modes with standard errors, the slowest first, what each input drives them with, and how each record begins.
struct FittedModes {
    modes: Vec<Mode>,
    participation: Vec<Vec<f64>>,
    starts: Vec<RecordStart>,
}

fn modes(measurement: &Measurement, task: &LinearTask<'_>, fit: &ModalFit, residuals: &Residuals) -> FittedModes {
    let sensors = &measurement.sensors;
    let inflated: f64 = residuals.fitted.iter().flatten().map(|r| inflation(r)).sum::<f64>()
        / residuals.fitted.iter().flatten().count().max(1) as f64;
    let variance = fit.squares / (fit.samples.saturating_sub(residuals.unknowns)).max(1) as f64 * inflated;
    let covariance = task.pole_covariance(fit);
    let mut all = Vec::new();
    for (i, pole) in fit.poles.iter().enumerate() {
        let error = |k: usize| {
            let value = covariance.as_ref().map(|c| (c[(k, k)] * variance).sqrt());
            value.filter(|v| v.is_finite() && *v > 0.0)
        };
        let (shape, errors, participation) = if measurement.inputs.is_empty() {
            let (shape, errors) = free_shape(task, fit, i, sensors, measurement.fitted.len(), variance);
            (shape, errors, Vec::new())
        } else {
            driven_shape(measurement, task, fit, i, variance)
        };
        let phase = shape.iter().map(|s| folded(s.arg())).collect();
        let signed = |s: &Complex<f64>| s.norm() * if s.arg().abs() > PI / 2.0 { -1.0 } else { 1.0 };
        let mode = Mode {
            frequency: pole.frequency(),
            frequency_error: error(2 * i).map(|e| e * pole.frequency()),
            damping: pole.damping,
            damping_error: error(2 * i + 1).map(|e| e * pole.damping),
            shape: shape.iter().map(signed).collect(),
            shape_error: errors,
            phase,
        };
        all.push((mode, participation, i, shape));
    }
    all.sort_by(|a, b| a.0.frequency.total_cmp(&b.0.frequency));
    let order: Vec<usize> = all.iter().map(|(.., i, _)| *i).collect();
    let shapes: Vec<Vec<Complex<f64>>> = all.iter().map(|(.., shape)| shape.clone()).collect();
    let starts = RecordStart::linear(measurement, task, fit, (&order, &shapes));
    let (modes, participation) = all.into_iter().map(|(mode, participation, ..)| (mode, participation)).unzip();
    FittedModes { modes, participation, starts }
}

/// An angle and the one turned by half a turn are the same line: from −π/2 to π/2.
fn folded(angle: f64) -> f64 {
    if angle > PI / 2.0 {
        angle - PI
    } else if angle < -PI / 2.0 {
        angle + PI
    } else {
        angle
    }
}

/// The real shape that the responses to the inputs have in common, related to its largest entry.
fn driven_shape(
    measurement: &Measurement,
    task: &LinearTask<'_>,
    fit: &ModalFit,
    mode: usize,
    variance: f64,
) -> (Vec<Complex<f64>>, Vec<Option<f64>>, Vec<f64>) {
    let (sensors, inputs) = (&measurement.sensors, &measurement.inputs);
    let omega = fit.poles[mode].omega;
    let unit =
        |s: usize, j: usize| omega.powi(2 - sensors[s].quantity.derivatives()) * sensors[s].scale / inputs[j].scale;
    let residues = DMatrix::from_fn(sensors.len(), inputs.len(), |s, j| task.amplitude(fit, s, mode, j) * unit(s, j));
    let deviations = DMatrix::from_fn(sensors.len(), inputs.len(), |s, j| {
        (task.amplitude_variance(fit, s, mode, j) * variance).sqrt() * unit(s, j)
    });
    // Columns weighed by their inputs' size, as the response has them.
    let weighed = DMatrix::from_fn(sensors.len(), inputs.len(), |s, j| residues[(s, j)] * inputs[j].scale);
    let shape =
        weighed.clone().svd(true, false).u.map_or_else(|| weighed.column(0).into_owned(), |u| u.column(0).into_owned());
    let reference = shape.iamax();
    let shape = &shape / shape[reference];
    let power = shape.norm_squared();
    let participation: Vec<f64> = (0..inputs.len()).map(|j| shape.dot(&residues.column(j)) / power).collect();
    let strongest = (0..inputs.len()).max_by(|a, b| {
        let size = |j: usize| (participation[j] * inputs[j].scale).abs();
        size(*a).total_cmp(&size(*b))
    });
    let j = strongest.unwrap_or(0);
    let relative = |s: usize| deviations[(s, j)] / participation[j].abs();
    let errors = (0..sensors.len()).map(|s| {
        let error = relative(s).hypot(shape[s] * relative(reference));
        (s != reference && error.is_finite()).then_some(error)
    });
    (shape.iter().map(|s| Complex::new(*s, 0.0)).collect(), errors.collect(), participation)
}

/// The complex shape that the free oscillations of all records have in common.
fn free_shape(
    task: &LinearTask<'_>,
    fit: &ModalFit,
    mode: usize,
    sensors: &[Sensor],
    records: usize,
    variance: f64,
) -> (Vec<Complex<f64>>, Vec<Option<f64>>) {
    let lambda = fit.poles[mode].eigenvalue();
    let amplitudes = DMatrix::from_fn(sensors.len(), records, |s, r| {
        let [re, im] = task.free(fit, s, mode, r);
        Complex::new(re, -im) / lambda.powi(sensors[s].quantity.derivatives()) * sensors[s].scale
    });
    let shape = amplitudes
        .clone()
        .svd(true, false)
        .u
        .map_or_else(|| amplitudes.column(0).into_owned(), |u| u.column(0).into_owned());
    let reference = (0..sensors.len()).max_by(|a, b| shape[*a].norm().total_cmp(&shape[*b].norm())).unwrap_or(0);
    let shape: Vec<Complex<f64>> = shape.iter().map(|s| s / shape[reference]).collect();
    // Against the projection of the largest record: its noise is that of all its samples.
    let largest = (0..records).map(|r| amplitudes[(reference, r)].norm()).fold(0.0, f64::max);
    let errors = (0..sensors.len()).map(|s| {
        let of = |s: usize| {
            task.free_deviation(fit, s, mode, variance) * sensors[s].scale
                / lambda.norm().powi(sensors[s].quantity.derivatives())
        };
        let error = (of(s) / largest).hypot(shape[s].norm() * of(reference) / largest);
        (s != reference && error.is_finite()).then_some(error)
    });
    (shape.clone(), errors.collect())
}
