//! Refinement by output error: the coefficients of the terms that the regression kept, fitted to the response itself.

use super::calibration::{Calibrated, Calibration};
use super::known::{Pair, Sign};
use super::opposite::SharedParameters;
use super::{Cancel, Covariance, Lock, StudyError};
use crate::dataset::Prepared;
use crate::refine::{
    Bar, Effort, FitOptions, Goal, Horizon, Instance, Landed, Point, Refined, Run, SensorReading, Structure, horizon,
    land, refine,
};
use crate::signal::{motion_period, rms};
use crate::simulate::Delays;
use crate::sparse::Bounds;
use sindyscope_values::model::Model;
use sindyscope_values::record::{Role, Usage};
use sindyscope_values::term::Term;

/// What refining a model's coefficients came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// The coefficients as the regression left them: equation after equation, terms in their order.
    pub before: Vec<f64>,
    /// RMSE of every displacement (first order: state) of the fitted records, each run from the initial state that fits it
    /// best.
    pub rmse: Vec<f64>,
    /// Longest run that was fitted, s: a record, or as much of it as a free run predicts.
    pub horizon: f64,
    /// True if no further step would change the fit noticeably.
    pub converged: bool,
    /// What was sought of the channels.
    pub calibrated: Vec<Calibrated>,
}

/// Steps of the iteration, at most.
const MAX_STEPS: usize = 30;
/// Integration steps after which no further iteration is begun: some seconds of one core.
const MAX_EFFORT: usize = 40_000_000;
/// Noise that a fit to clean data is held against, as a share of the motion: the simulation's own arithmetic.
const MIN_NOISE: f64 = 1e-6;
/// Fits with weights from what the one before left, at most.
const MAX_REWEIGHTED_FITS: usize = 2;
/// Weighted residuals of two displacements within this factor of each other need no other weights.
const BALANCED_RESIDUALS: f64 = 1.25;

/// A coefficient that is sought.
struct FreeCoefficient {
    /// Index of its equation.
    equation: usize,
    /// Its place among the equation's terms.
    place: usize,
    /// The sign that it may have.
    sign: Option<Sign>,
}

/// The free coefficients of every acceleration, and the parameters that they follow from.
struct Coefficients<'a> {
    model: &'a Model,
    free: Vec<FreeCoefficient>,
    shared: SharedParameters,
    scales: Vec<f64>,
    /// What is sought of the channels; after the coefficients' parameters.
    sought: &'a [Calibration],
    /// The channel that each output shows.
    shown: Vec<Role>,
    /// Sampling interval, s.
    interval: f64,
}

/// Change of a ratio of masses that matters, as a share of it.
const RATIO_SCALE: f64 = 0.01;
/// Change of a delay that matters, as a share of the sampling interval.
const DELAY_SCALE: f64 = 0.05;
/// Change of a gain that matters, as a share of it.
const GAIN_SCALE: f64 = 0.01;
/// Largest delay that one fit seeks, in sampling intervals.
const MAX_DELAY: f64 = 3.0;
/// Least and largest gain that a fit admits.
const GAIN_RANGE: (f64, f64) = (0.2, 5.0);

impl Structure for Coefficients<'_> {
    fn instance(&self, parameters: &[f64]) -> Option<Instance> {
        let mut model = self.model.clone();
        for (k, FreeCoefficient { equation, place, .. }) in self.free.iter().enumerate() {
            model.equations[*equation].terms[*place].coefficient = self.shared.coefficient(k, parameters);
        }
        let mut late = Vec::new();
        let mut readings =
            if self.sought.is_empty() { Vec::new() } else { vec![SensorReading::default(); self.shown.len()] };
        for (what, value) in self.sought.iter().zip(&parameters[self.shared.owners().len()..]) {
            let reading = self.shown.iter().position(|role| *role == what.role()).and_then(|k| readings.get_mut(k));
            match (what, reading) {
                (Calibration::Delay(_), Some(reading)) => reading.delay = *value,
                // An input that was recorded late acted earlier.
                (Calibration::Delay(Role::Input(j)), None) => late.push((*j, -value)),
                (Calibration::Gain(_), Some(reading)) => reading.gain = *value,
                (Calibration::Delay(_) | Calibration::Gain(_), None) => return None,
            }
        }
        let delays = late.into_iter().collect();
        Some(Instance { model, delays, ceiling: None, readings })
    }

    fn scales(&self) -> Vec<f64> {
        let scale = |what: &Calibration| match what {
            Calibration::Delay(_) => DELAY_SCALE * self.interval,
            Calibration::Gain(_) => GAIN_SCALE,
        };
        self.scales.iter().copied().chain(self.sought.iter().map(scale)).collect()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        let of_coefficient = |k: usize| {
            let bounds = self.free[k].sign.map_or(Bounds::OPEN, Sign::bounds);
            (bounds.low, bounds.high)
        };
        let range = |what: &Calibration| match what {
            Calibration::Delay(_) => (-MAX_DELAY * self.interval, MAX_DELAY * self.interval),
            Calibration::Gain(_) => (GAIN_RANGE.0, GAIN_RANGE.1),
        };
        let coefficients =
            self.shared.owners().iter().map(|owner| owner.map_or(SharedParameters::RATIOS, of_coefficient));
        coefficients.chain(self.sought.iter().map(range)).collect()
    }

    fn offset(&self) -> bool {
        false
    }

    fn internals(&self) -> usize {
        0
    }
}

/// Why a model cannot be refined; said beside the unrefined one.
pub(super) const NOT_MEASURED: &str =
    "Not refined: the response is fitted only where every displacement (first order: every state) is measured";
pub(super) const NO_START: &str =
    "Not refined: the response of the regression's equation leaves the data's range, so there is nothing to start from";

/// What is decided about a term of a degree of freedom's equation: its lock, and the sign that its coefficient may have.
pub(super) type Decided<'a> = &'a dyn Fn(usize, &Term) -> (Option<Lock>, Option<Sign>);

/// What a refinement keeps to, and what it seeks beside the coefficients.
#[derive(Clone, Copy)]
pub(super) struct RefinementTask<'a> {
    pub(super) decided: Decided<'a>,
    pub(super) pairs: &'a [Pair],
    pub(super) sought: &'a [Calibration],
}

/// Where a refinement begins, and what it is held against.
#[derive(Clone, Copy)]
pub(super) struct Hints<'a> {
    /// A model to begin with; a term that it lacks begins with the regression's coefficient.
    pub(super) start: Option<&'a Model>,
    /// What the best of its rivals leaves.
    pub(super) rivals: Option<&'a Bar>,
    /// Counts the integration steps.
    pub(super) effort: &'a Effort,
}

/// True if two models have the same terms.
pub(super) fn same_terms(model: &Model, other: &Model) -> bool {
    let terms = |m: &Model| -> Vec<Vec<Term>> {
        m.equations.iter().map(|e| e.terms.iter().map(|t| t.term.clone()).collect()).collect()
    };
    terms(model) == terms(other)
}

/// Fits the coefficients of all accelerations to the fitted records' response, every displacement's residual weighed by its
/// noise; those that were fixed stay, and the forces between a pair of masses are equal and opposite.
///
/// The inner error says why nothing was refined.
pub(super) fn refined(
    model: &mut Model,
    covariance: &mut Covariance,
    records: &[(&Prepared, Usage)],
    asked: RefinementTask<'_>,
    hints: Hints<'_>,
    cancel: &Cancel,
) -> Result<Result<Refinement, &'static str>, StudyError> {
    let layout = model.layout;
    // Those after dx/dt = v; of a first-order system all.
    let accelerations = layout.states() - layout.freedoms..layout.states();
    let first = accelerations.start;
    let fitted: Vec<&Prepared> = records.iter().filter(|(_, u)| *u == Usage::Fit).map(|(p, _)| *p).collect();
    let (runs, noise) = runs(&fitted);
    if runs.is_empty() {
        return Ok(Err(NOT_MEASURED));
    }
    let terms =
        || accelerations.clone().flat_map(|e| model.equations[e].terms.iter().enumerate().map(move |(k, t)| (e, k, t)));
    let mut free = Vec::new();
    let mut scales = Vec::new();
    for (equation, place, term) in terms() {
        let (lock, sign) = (asked.decided)(equation - first, &term.term);
        if !matches!(lock, Some(Lock::Fixed(_))) {
            free.push(FreeCoefficient { equation, place, sign });
            // One hundredth of all forces together.
            scales.push(0.01 * term.coefficient.abs() / term.share.max(1e-9));
        }
    }
    let before: Vec<f64> = terms().map(|(.., t)| t.coefficient).collect();
    let hinted = |equation: usize, term: &Term| {
        let begun = hints.start?.equations.get(equation)?.terms.iter().find(|t| t.term == *term)?;
        Some(begun.coefficient)
    };
    let begin = |f: &FreeCoefficient| {
        let own = &model.equations[f.equation].terms[f.place];
        hinted(f.equation, &own.term).unwrap_or(own.coefficient)
    };
    let from: Vec<f64> = free.iter().map(begin).collect();
    let places: Vec<(usize, &Term)> =
        free.iter().map(|f| (f.equation - first, &model.equations[f.equation].terms[f.place].term)).collect();
    let shared = SharedParameters::new(&places, asked.pairs);
    let mut from = shared.parameters(&from);
    let scale = |(owner, value): (&Option<usize>, &f64)| owner.map_or(RATIO_SCALE * value, |k| scales[k]);
    let scales = shared.owners().iter().zip(&from).map(scale).collect();
    from.extend(asked.sought.iter().map(|what| what.neutral()));
    let prepared = fitted[0];
    let shown = (0..layout.freedoms).filter_map(|i| prepared.record.sensor(i)).map(|c| c.role).collect();
    let interval = prepared.record.interval;
    let coefficients = Coefficients { model, free, shared, scales, sought: asked.sought, shown, interval };
    let cancelled = || cancel.is_cancelled();
    let goal = goal(&fitted, &runs, noise, &cancelled);
    let landed = goal.and_then(|mut goal| {
        (goal.options.bar, goal.options.meter) = (hints.rivals, Some(hints.effort));
        // Along whole records; where that is lost, by way of segments that grow.
        land(&coefficients, &runs, &Point::new(&coefficients, &runs, from, false), goal)
    });
    let landed = landed.and_then(|landed| reweighed(&coefficients, landed, hints.effort, cancel));
    let Some(landed) = landed else {
        cancel.check()?;
        return Ok(Err(NO_START));
    };
    let horizon = landed.horizon();
    let Landed { refined: found, runs, .. } = landed;
    cancel.check()?;
    let Coefficients { free, shared, .. } = coefficients;
    take_over(&found, &free, &shared, model, covariance);
    let parameters = found.point.shared.len() - asked.sought.len();
    let calibrated = |(k, what): (usize, &Calibration)| Calibrated {
        what: *what,
        value: found.point.shared[parameters + k],
        std_error: found.std_error(parameters + k),
    };
    let calibrated = asked.sought.iter().enumerate().map(calibrated).collect();
    let weights = runs.first().map_or(&[][..], |r| &r.weights);
    let rmse = weights.iter().enumerate().map(|(i, weight)| residual_rms(&found, &runs, i) / weight).collect();
    Ok(Ok(Refinement { before, rmse, horizon, converged: found.converged, calibrated }))
}

/// Puts what was found into the model of which `free` coefficients were sought, with the covariance of all accelerations.
fn take_over(
    found: &Refined,
    free: &[FreeCoefficient],
    shared: &SharedParameters,
    model: &mut Model,
    covariance: &mut Covariance,
) {
    let accelerations = model.layout.states() - model.layout.freedoms..model.layout.states();
    let first = accelerations.start;
    let terms: Vec<(usize, usize)> = accelerations
        .clone()
        .flat_map(|equation| (0..model.equations[equation].terms.len()).map(move |place| (equation, place)))
        .collect();
    *covariance = Covariance::unknown(model.equations[accelerations.clone()].iter().map(|e| e.terms.len()));
    let place_of = |term: &(usize, usize)| free.iter().position(|f| (f.equation, f.place) == *term);
    let places: Vec<Option<usize>> = terms.iter().map(place_of).collect();
    let slopes = shared.slopes(&found.point.shared);
    let parameters = slopes.ncols();
    let known = found.covariance.nrows() == found.point.shared.len();
    let errors = if known {
        &slopes * found.covariance.view((0, 0), (parameters, parameters)) * slopes.transpose()
    } else {
        found.covariance.clone()
    };
    let at: Vec<(usize, usize)> = terms.iter().map(|(equation, place)| (equation - first, *place)).collect();
    for (i, a) in places.iter().enumerate() {
        for (j, b) in places.iter().enumerate().skip(i) {
            let entry = match a.zip(*b) {
                Some(places) if known => errors[places],
                Some(_) => f64::NAN,
                None => 0.0,
            };
            covariance.set(at[i], at[j], entry);
        }
    }
    for (k, f) in free.iter().enumerate() {
        let value = shared.coefficient(k, &found.point.shared);
        let term = &mut model.equations[f.equation].terms[f.place];
        term.share *= (value / term.coefficient).abs();
        term.coefficient = value;
    }
    covariance.tell(model, accelerations.clone());
    for equation in &mut model.equations[accelerations] {
        let total: f64 = equation.terms.iter().map(|t| t.share).sum();
        equation.terms.iter_mut().for_each(|t| t.share = if total > 0.0 { t.share / total } else { 0.0 });
    }
}

/// The runs of some records, every displacement (or state) weighed by its noise so that the first counts one; and the noise of
/// the first.
fn runs(records: &[&Prepared]) -> (Vec<Run>, f64) {
    let mut runs: Vec<Run> = records.iter().enumerate().filter_map(|(k, p)| p.drive().run(k, &p.signals)).collect();
    let of_channel = |i: usize| {
        let noise = records.iter().map(|p| p.sensor_noise(i)).fold(0.0, f64::max);
        let motion = runs.iter().map(|r| rms(&r.measured[i])).fold(0.0, f64::max);
        noise.max(MIN_NOISE * motion).max(f64::MIN_POSITIVE)
    };
    let noise: Vec<f64> = (0..runs.first().map_or(0, |r| r.measured.len())).map(of_channel).collect();
    let weights: Vec<f64> = noise.iter().map(|n| noise[0] / n).collect();
    runs.iter_mut().for_each(|run| run.weights.clone_from(&weights));
    (runs, noise.first().copied().unwrap_or(0.0))
}

/// Fits anew with every displacement weighed by what is left of it, where that is more than its noise would leave: a model
/// that misses one displacement by more than its noise is not to follow it at the others' cost.
fn reweighed(coefficients: &Coefficients<'_>, mut landed: Landed, effort: &Effort, cancel: &Cancel) -> Option<Landed> {
    let cancelled = || cancel.is_cancelled();
    let options = FitOptions {
        frozen: false,
        driven: false,
        steps: MAX_STEPS,
        effort: MAX_EFFORT,
        meter: Some(effort),
        bar: None,
        cancelled: &cancelled,
    };
    for _ in 0..MAX_REWEIGHTED_FITS {
        let Some(weights) = landed.runs.first().map(|r| r.weights.clone()) else { break };
        let left: Vec<f64> = (0..weights.len()).map(|i| residual_rms(&landed.refined, &landed.runs, i)).collect();
        let alike = |l: &f64| (BALANCED_RESIDUALS.recip()..BALANCED_RESIDUALS).contains(&(l / left[0]));
        if left.iter().all(alike) || !left.iter().all(|l| *l > 0.0) {
            break;
        }
        let weights: Vec<f64> = weights.iter().zip(&left).map(|(w, l)| w * left[0] / l).collect();
        landed.runs.iter_mut().for_each(|run| run.weights.clone_from(&weights));
        landed.refined = refine(coefficients, &landed.runs, &landed.refined.point, options)?;
    }
    Some(landed)
}

/// RMS of the weighed residuals of a displacement (or state).
fn residual_rms(found: &Refined, runs: &[Run], channel: usize) -> f64 {
    let part = |(r, run): (&'_ Vec<f64>, &Run)| -> (f64, usize) {
        let length = run.range.len();
        let own = &r[channel * length..(channel + 1) * length];
        (own.iter().map(|e| e * e).sum(), length)
    };
    let parts: Vec<(f64, usize)> = found.residuals.iter().zip(runs).map(part).collect();
    let count: usize = parts.iter().map(|p| p.1).sum();
    (parts.iter().map(|p| p.0).sum::<f64>() / count.max(1) as f64).sqrt()
}

/// What a fit of some records is to reach; none of nothing.
fn goal<'a>(
    records: &[&Prepared],
    runs: &[Run],
    noise: f64,
    cancelled: &'a (dyn Fn() -> bool + Sync),
) -> Option<Goal<'a>> {
    let first = records.first()?;
    let series: Vec<&[f64]> = runs.iter().map(|r| &*r.measured[0]).collect();
    let period = motion_period(&series, first.record.interval, noise).or(first.facts.main_period);
    let options = FitOptions {
        frozen: false,
        driven: false,
        steps: MAX_STEPS,
        effort: MAX_EFFORT,
        meter: None,
        bar: None,
        cancelled,
    };
    let period = period.unwrap_or_else(|| 0.1 * first.record.duration());
    Some(Goal { period, noise, top: usize::MAX, short_if_wrong: false, options })
}

/// A model as it is.
struct Fixed<'a>(&'a Model);

impl Structure for Fixed<'_> {
    fn instance(&self, _: &[f64]) -> Option<Instance> {
        Some(Instance { model: self.0.clone(), delays: Delays::default(), ceiling: None, readings: Vec::new() })
    }

    fn scales(&self) -> Vec<f64> {
        Vec::new()
    }

    fn offset(&self) -> bool {
        false
    }

    fn internals(&self) -> usize {
        0
    }
}

/// How far free runs of a model predict some records.
pub(super) fn horizon_of(model: &Model, records: &[&Prepared], cancel: &Cancel) -> Option<Horizon> {
    let (runs, noise) = runs(records);
    let cancelled = || cancel.is_cancelled();
    horizon(&Fixed(model), &runs, &[], goal(records, &runs, noise, &cancelled)?)
}
