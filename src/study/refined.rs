//! Refinement by output error: the coefficients of the terms that the regression kept, fitted to the response itself.

use super::known::Sign;
use super::{Cancel, EquationFit, Lock, Prepared, StudyError};
use crate::model::Model;
use crate::record::Usage;
use crate::refine::{Goal, Instance, Landed, Options, Point, Run, Structure, land};
use crate::signal::{motion_period, rms};
use crate::term::{Kind, Layout, Term};

/// What refining a model's coefficients came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// The coefficients of the leading equation as the regression left them, in the order of its terms.
    pub before: Vec<f64>,
    /// RMSE of the fitted records' first displacement, each from the initial state that fits it best.
    pub rmse: f64,
    /// True if no further step would change the fit noticeably.
    pub converged: bool,
}

/// Steps of the iteration, at most.
const STEPS: usize = 30;
/// Integration steps after which no further iteration is begun: some seconds.
const EFFORT: usize = 40_000_000;
/// Noise, as a share of the motion, that a fit to clean data reaches at best: the simulation's own arithmetic.
const LEAST_NOISE: f64 = 1e-6;

/// The free coefficients of the leading equation.
struct Coefficients<'a> {
    model: &'a Model,
    /// Index of the equation.
    equation: usize,
    /// Each free coefficient's place among the equation's terms, and the sign that it may have.
    free: Vec<(usize, Option<Sign>)>,
    scales: Vec<f64>,
}

impl Structure for Coefficients<'_> {
    fn instance(&self, parameters: &[f64]) -> Option<Instance> {
        let mut model = self.model.clone();
        let terms = &mut model.equations[self.equation].terms;
        for (value, (place, _)) in parameters.iter().zip(&self.free) {
            terms[*place].coefficient = *value;
        }
        Some(Instance { model, delay: 0.0, ceiling: None })
    }

    fn scales(&self) -> Vec<f64> {
        self.scales.clone()
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().map(|(_, sign)| sign.map_or((f64::NEG_INFINITY, f64::INFINITY), Sign::range)).collect()
    }

    fn offset(&self) -> bool {
        false
    }

    fn internals(&self) -> usize {
        0
    }
}

/// Why a model cannot be refined; said beside the unrefined one.
pub(super) const ONE_FREEDOM: &str =
    "Not refined: the response is fitted only for one degree of freedom of second order";
pub(super) const NO_START: &str =
    "Not refined: the response of the regression's equation leaves the data's range, so there is nothing to start from";

/// What is decided about a term: its lock, and the sign that its coefficient may have.
type Decided<'a> = &'a dyn Fn(&Term) -> (Option<Lock>, Option<Sign>);

/// Fits the leading equation's coefficients to the fitted records' response; those that were fixed stay.
///
/// The inner error says why nothing was refined.
pub(super) fn refined(
    model: &mut Model,
    fit: &mut EquationFit,
    records: &[(&Prepared, Usage)],
    decided: Decided<'_>,
    cancel: &Cancel,
) -> Result<Result<Refinement, &'static str>, StudyError> {
    let layout = model.layout;
    let one = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: layout.inputs, internals: 0 };
    if layout != one {
        return Ok(Err(ONE_FREEDOM));
    }
    let runs: Vec<Run> = records
        .iter()
        .filter(|(_, u)| *u == Usage::Fit)
        .enumerate()
        .filter_map(|(k, (p, _))| p.drive.run(k, &p.signals))
        .collect();
    let terms = &model.equations[1].terms;
    let free: Vec<(usize, Option<Sign>)> = terms
        .iter()
        .enumerate()
        .map(|(k, t)| (k, decided(&t.term)))
        .filter(|(_, (lock, _))| !matches!(lock, Some(Lock::Fixed(_))))
        .map(|(k, (_, sign))| (k, sign))
        .collect();
    // One hundredth of all forces together.
    let scales = free.iter().map(|(k, _)| 0.01 * terms[*k].coefficient.abs() / terms[*k].share.max(1e-9)).collect();
    let before: Vec<f64> = terms.iter().map(|t| t.coefficient).collect();
    let shared: Vec<f64> = free.iter().map(|(k, _)| before[*k]).collect();
    let coefficients = Coefficients { model, equation: 1, free, scales };
    let Some(Landed { refined: found, .. }) = search(&coefficients, &runs, records, shared, cancel) else {
        cancel.check()?;
        return Ok(Err(NO_START));
    };
    cancel.check()?;
    let values = found.point.shared.clone();
    let places: Vec<usize> = coefficients.free.iter().map(|(k, _)| *k).collect();
    let equation = &mut model.equations[1];
    let force: Vec<f64> = equation.terms.iter().map(|t| t.share / t.coefficient.abs().max(f64::MIN_POSITIVE)).collect();
    fit.covariance = Vec::new();
    for (index, (place, value)) in places.iter().zip(values).enumerate() {
        equation.terms[*place].coefficient = value;
        equation.terms[*place].std_error = found.std_error(index);
    }
    if found.covariance.nrows() == places.len() {
        let n = equation.terms.len();
        fit.covariance = vec![vec![0.0; n]; n];
        for (i, a) in places.iter().enumerate() {
            for (j, b) in places.iter().enumerate() {
                fit.covariance[*a][*b] = found.covariance[(i, j)];
            }
        }
    }
    let total: f64 = equation.terms.iter().zip(&force).map(|(t, f)| t.coefficient.abs() * f).sum();
    for (term, force) in equation.terms.iter_mut().zip(&force) {
        term.share = if total > 0.0 { term.coefficient.abs() * force / total } else { 0.0 };
    }
    Ok(Ok(Refinement { before, rmse: found.rmse(), converged: found.converged }))
}

/// Refines along whole records; where that is lost, by way of segments that grow.
fn search(
    coefficients: &Coefficients<'_>,
    runs: &[Run],
    records: &[(&Prepared, Usage)],
    shared: Vec<f64>,
    cancel: &Cancel,
) -> Option<Landed> {
    let cancelled = || cancel.is_cancelled();
    let options =
        Options { frozen: false, driven: false, steps: STEPS, effort: EFFORT, bar: None, cancelled: &cancelled };
    let fitted = || records.iter().filter(|(_, u)| *u == Usage::Fit).map(|(p, _)| p);
    let first = fitted().next()?;
    let noise = fitted().filter_map(|p| p.signals.noise.first().copied()).fold(0.0, f64::max);
    let series: Vec<&[f64]> = runs.iter().map(|r| &*r.measured[0]).collect();
    let period = motion_period(&series, first.record.interval, noise).or(first.facts.main_period);
    let motion = series.iter().map(|s| rms(s)).fold(0.0, f64::max);
    let goal = Goal {
        period: period.unwrap_or_else(|| 0.1 * first.record.duration()),
        noise: noise.max(LEAST_NOISE * motion),
        top: usize::MAX,
        options,
    };
    let start = Point::new(coefficients, runs, shared, false);
    land(coefficients, runs, &start, goal)
}

#[cfg(test)]
mod tests {
    use crate::record::{RecordSet, Usage};
    use crate::rig::{Noise, ScenarioOptions, generate};
    use crate::study::{Cancel, Lock, Outcome, Settings, Study, suggest};
    use crate::term::{Kind, Term, list};

    fn duffing(seed: u64) -> (RecordSet, Settings) {
        let options = ScenarioOptions { seed, duration: Some(50.0), rate: Some(40.0), ..ScenarioOptions::default() };
        let mut records = RecordSet::new(generate("duffing-noisy", &options).unwrap().records, Usage::Fit);
        let other = ScenarioOptions {
            frequencies: Some(vec![0.13, 0.31]),
            amplitude: Some(0.6),
            together: true,
            noise: Some(Noise::Deviation(0.0)),
            ..options
        };
        let held_out = RecordSet::new(generate("duffing-noisy", &other).unwrap().records, Usage::HeldOut);
        records.entries.extend(held_out.entries);
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        settings.terms = list("x, x^3, v, u").unwrap();
        settings.threshold = 0.0;
        (records, settings)
    }

    fn run(records: &RecordSet, settings: &Settings) -> Outcome {
        Study::default().run(records, settings, &Cancel::default()).unwrap()
    }

    const TRUTH: [(&str, f64); 4] = [("x", -1.0), ("x^3", -0.6), ("v", -0.2), ("u", 1.0)];

    #[test]
    fn the_refined_fit_is_nearer_to_the_truth_and_its_errors_say_how_near() {
        let (mut held, mut better) = (0, 0);
        const SEEDS: u64 = 30;
        for seed in 0..SEEDS {
            let (records, mut settings) = duffing(seed);
            let sparse = run(&records, &settings);
            settings.refine = true;
            let refined = run(&records, &settings);
            let refinement = refined.refinement.as_ref().unwrap();
            assert!(refinement.converged && refinement.before.len() == 4);
            // Noise of 0.01, and four coefficients and two initial values of 2000 samples fitted to it.
            assert!((refinement.rmse / 0.01 - 1.0).abs() < 0.06, "{}", refinement.rmse);
            better += usize::from(refined.test.unwrap().rmse < sparse.test.unwrap().rmse);
            for (term, value) in TRUTH {
                let term = Term::parse(term).unwrap();
                let found = refined.model.leading().unwrap().terms.iter().find(|t| t.term == term).unwrap();
                held += usize::from((found.coefficient - value).abs() < 1.645 * found.std_error.unwrap());
            }
        }
        let share = held as f64 / (4.0 * SEEDS as f64);
        // 120 intervals of 90 %: two standard deviations are 5.5 %.
        assert!((0.84..=0.955).contains(&share), "{share}");
        assert!(better as f64 > 0.8 * SEEDS as f64, "{better}");
    }

    #[test]
    fn fixed_coefficients_stay_and_the_covariance_is_that_of_the_terms() {
        let (records, mut settings) = duffing(1);
        settings.refine = true;
        settings.locks.insert(Term::parse("u").unwrap(), Lock::Fixed(1.0));
        let outcome = run(&records, &settings);
        let terms = &outcome.model.leading().unwrap().terms;
        let fixed = terms.iter().position(|t| t.term.as_str() == "u").unwrap();
        assert_eq!((terms[fixed].coefficient, terms[fixed].std_error), (1.0, None));
        let covariance = &outcome.fits[0].covariance;
        for (i, term) in terms.iter().enumerate() {
            let error = covariance[i][i].sqrt();
            assert!((error - term.std_error.unwrap_or(0.0)).abs() <= 1e-12 * error, "{}", term.term);
        }
        let shares: f64 = terms.iter().map(|t| t.share).sum();
        assert!((shares - 1.0).abs() < 1e-9);
        let physical = outcome.physical();
        let frequency = physical.iter().find(|p| p.name == "f_n").unwrap();
        let error = (frequency.value - 1.0 / std::f64::consts::TAU).abs();
        assert!(error < 4.0 * frequency.std_error.unwrap(), "{frequency:?}");
    }

    #[test]
    fn where_it_cannot_be_done_it_says_so_and_the_fit_stands() {
        let options = ScenarioOptions { duration: Some(4.0), ..ScenarioOptions::default() };
        let records = RecordSet::new(generate("lorenz", &options).unwrap().records, Usage::Fit);
        let mut settings = suggest(&records, Kind::FirstOrder).unwrap();
        settings.refine = true;
        let outcome = run(&records, &settings);
        assert!(outcome.refinement.is_none() && outcome.warnings.iter().any(|w| w.text.starts_with("Not refined")));
        let (records, mut settings) = duffing(0);
        settings.refine = true;
        let cancel = Cancel::default();
        cancel.cancel();
        assert!(Study::default().run(&records, &settings, &cancel).is_err());
    }
}
