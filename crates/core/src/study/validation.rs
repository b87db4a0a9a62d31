//! What settings are judged by: records fitted in folds, and stretches of what was not fitted, simulated.

use std::ops::Range;
use std::sync::Arc;

use super::candidates::candidate_terms;
use super::regression::{self, Regression, fitted_states};
use super::{Cancel, Outcome, Settings, Smoothing, Study, StudyError};
use crate::dataset::SimulationDrive;
use crate::refine::{Bar, Effort};
use crate::signal::{SignalFacts, Signals, dot, mean_and_variance};
use crate::simulate::{Output, Response, Simulator, Workspace};
use sindyscope_values::model::Model;
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::Layout;

/// Share of a single record that is fitted; the rest judges.
pub(super) const FITTED_SHARE: f64 = 0.6;
/// Groups of records that are left out in turn, at most.
const MAX_FOLDS: usize = 4;
/// Length of a simulated stretch, in main periods; then it starts anew, so that a chaotic motion is judged too.
const STRETCH_PERIODS: f64 = 10.0;
/// Samples simulated for one candidate, at most.
const MAX_SIMULATED_SAMPLES: usize = 40_000;
/// Squared error, over the motion's variance, of a stretch whose response left the data's range, and the largest of any:
/// ten times the motion. Finite, so that of settings that all fail somewhere the one that fails least is taken.
const DIVERGED_ERROR: f64 = 100.0;
/// Largest error of a sampling interval of a judging response, as a share of the motion: a whole stretch adds up to far
/// less than [`EQUAL_ERRORS`].
const JUDGING_TOLERANCE: f64 = 1e-7;

/// A stretch of a record that judges.
pub(super) struct JudgingStretch {
    pub(super) record: usize,
    pub(super) range: Range<usize>,
    /// Samples that are judged together: one error each.
    pub(super) block: usize,
}

/// Data fitted together and the stretches that judge them.
pub(super) struct ValidationFold {
    /// Indices into the pieces.
    pub(super) fitted: Vec<usize>,
    pub(super) judges: Vec<JudgingStretch>,
}

/// What is fitted and what judges it.
pub(super) struct ValidationPlan {
    pub(super) layout: Layout,
    /// What is fitted, by itself or together: whole records, or the first part of a single one.
    pub(super) pieces: Vec<(Arc<Record>, Arc<SignalFacts>)>,
    /// What is simulated.
    pub(super) records: Vec<(Arc<Record>, Arc<SignalFacts>)>,
    pub(super) folds: Vec<ValidationFold>,
    /// Variance of what each of a record's sensors shows.
    pub(super) variance: Vec<Vec<f64>>,
    /// Integration steps that refined fits have taken so far.
    effort: Arc<Effort>,
}

impl ValidationPlan {
    /// Cross-validation among the fitted records; those held out are not looked at.
    pub(super) fn new(records: &RecordSet, layout: Layout) -> Self {
        let records = with_facts(records, Usage::Fit, &layout);
        let (pieces, ranges): (Vec<_>, Vec<(usize, Range<usize>)>) = match records.as_slice() {
            [(only, _)] => {
                let cut = (FITTED_SHARE * only.len() as f64) as usize;
                let first = Arc::new(only.slice(0..cut));
                let facts = SignalFacts::cached(&first, &layout);
                (vec![(first, facts)], vec![(0, cut..only.len())])
            }
            several => (several.to_vec(), several.iter().enumerate().map(|(k, (r, _))| (k, 0..r.len())).collect()),
        };
        let stretches = stretches(&records, &ranges);
        let folds = if pieces.len() == 1 {
            vec![ValidationFold { fitted: vec![0], judges: stretches }]
        } else {
            let groups = pieces.len().min(MAX_FOLDS);
            let mut folds: Vec<ValidationFold> = (0..groups)
                .map(|g| ValidationFold {
                    fitted: (0..pieces.len()).filter(|k| k % groups != g).collect(),
                    judges: Vec::new(),
                })
                .collect();
            for s in stretches {
                folds[s.record % groups].judges.push(s);
            }
            folds
        };
        Self { layout, variance: variances(&records), pieces, records, folds, effort: Arc::default() }
    }

    /// Everything marked fit is fitted, and what is held out judges: in one go as the window shows it, or in stretches
    /// of it where there is much.
    pub(super) fn held_out(records: &RecordSet, layout: Layout) -> Self {
        let pieces = with_facts(records, Usage::Fit, &layout);
        let records = with_facts(records, Usage::HeldOut, &layout);
        let ranges: Vec<(usize, Range<usize>)> =
            records.iter().enumerate().map(|(k, (r, _))| (k, 0..r.len())).collect();
        let mut judges = stretches(&records, &ranges);
        if ranges.iter().map(|(_, range)| range.len()).sum::<usize>() <= MAX_SIMULATED_SAMPLES {
            let block = |record: usize| judges.iter().find(|j| j.record == record).map_or(1, |j| j.range.len());
            judges = ranges
                .into_iter()
                .map(|(record, range)| JudgingStretch { record, range, block: block(record) })
                .collect();
        }
        let folds = vec![ValidationFold { fitted: (0..pieces.len()).collect(), judges }];
        Self { layout, variance: variances(&records), pieces, records, folds, effort: Arc::default() }
    }

    /// Number of samples that judge.
    pub(super) fn judging(&self) -> usize {
        self.folds.iter().flat_map(|fold| &fold.judges).map(|judge| judge.range.len()).sum()
    }

    /// The pieces, cut so that refining them takes no longer than it must.
    pub(super) fn shortened(&self) -> Vec<Arc<Record>> {
        shortened(self.pieces.iter().map(|(record, _)| record))
    }

    /// What a smoothing makes of the records; none if it leaves too few rows.
    pub(super) fn smoothed(
        &self,
        start: &Settings,
        smoothing: &Smoothing,
        cancel: &Cancel,
    ) -> Result<Option<SmoothedFolds>, StudyError> {
        let settings = Settings { smoothing: *smoothing, ..start.clone() };
        let Some(pieces) = self.regressions(&settings, cancel)? else { return Ok(None) };
        let signals: Vec<Signals> =
            self.records.iter().map(|(record, facts)| Signals::new(record, &self.layout, smoothing, facts)).collect();
        let drive = |judge: &JudgingStretch| {
            let (record, facts) = &self.records[judge.record];
            SimulationDrive::new(record, &self.layout, facts, &signals[judge.record], judge.range.clone())
        };
        let drives = self.folds.iter().map(|fold| fold.judges.iter().map(drive).collect()).collect();
        let joined =
            |k: &mut dyn Iterator<Item = usize>| Regression::joined(&k.map(|k| &pieces[k]).collect::<Vec<_>>());
        let folds = self.folds.iter().map(|fold| joined(&mut fold.fitted.iter().copied())).collect();
        Ok(Some(SmoothedFolds { all: joined(&mut (0..pieces.len())), folds, drives }))
    }

    /// The pieces' regressions; none if the smoothing leaves too few rows.
    pub(super) fn regressions(
        &self,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Option<Vec<Regression>>, StudyError> {
        let terms = candidate_terms(settings, &self.layout);
        let fitted = fitted_states(&self.layout, settings.kinematics);
        let mut signals = Vec::with_capacity(self.pieces.len());
        for (piece, facts) in &self.pieces {
            cancel.check()?;
            if settings.smoothing.given().is_some_and(|window| piece.len() < window) {
                return Ok(None);
            }
            signals.push(Arc::new(Signals::new(piece, &self.layout, &settings.smoothing, facts)));
        }
        let Ok(basis) = regression::basis(&self.layout, &terms, &signals, settings.form, &fitted) else {
            return Ok(None);
        };
        let mut regressions = Vec::with_capacity(self.pieces.len());
        for signals in signals {
            cancel.check()?;
            match Regression::new(&self.layout, &terms, &[signals], &settings.smoothing, &basis, &fitted) {
                Ok(regression) => regressions.push(regression.bounded(settings)),
                Err(_) => return Ok(None),
            }
        }
        Ok(Some(regressions))
    }

    /// Squared errors of refined fits on the stretches that were not fitted; none if some fold cannot be refined. `known` is
    /// what all pieces together gave; `start` is where the fits begin without it.
    pub(super) fn judge_refined(
        &self,
        pieces: &[Arc<Record>],
        settings: &Settings,
        known: Option<&Model>,
        start: Option<&Model>,
        cancel: &Cancel,
    ) -> Result<Option<Vec<f64>>, StudyError> {
        let Some(smoothed) = self.smoothed(settings, &settings.smoothing, cancel)? else { return Ok(None) };
        let mut models = Vec::with_capacity(self.folds.len());
        for fold in &self.folds {
            let of_all = known.filter(|_| fold.fitted.len() == pieces.len());
            let model = match of_all {
                Some(model) => Some(model.clone()),
                None => {
                    let start = known.or(start);
                    let outcome = self.refined_fit(pieces, &fold.fitted, settings, (start, None), cancel)?;
                    outcome.map(|outcome| outcome.model)
                }
            };
            match model {
                Some(model) => models.push(model),
                None => return Ok(None),
            }
        }
        Ok(Some(smoothed.judge(self, &models, &mut Workspace::default(), cancel)?.errors))
    }

    /// The refined fit of some records; none if they cannot be fitted. Among rivals it need not be the best that there is where
    /// it stays far behind them.
    pub(super) fn refined_fit(
        &self,
        pieces: &[Arc<Record>],
        fitted: &[usize],
        settings: &Settings,
        (start, rivals): (Option<&Model>, Option<&Arc<Bar>>),
        cancel: &Cancel,
    ) -> Result<Option<Outcome>, StudyError> {
        let mut study = Study { start: start.cloned(), rivals: rivals.cloned(), ..self.counted_study() };
        let entries = fitted.iter().map(|k| (Arc::clone(&pieces[*k]), Usage::Fit)).collect();
        match study.run(&RecordSet { entries }, settings, cancel) {
            Ok(outcome) if outcome.refinement.is_some() && !outcome.diverged() => Ok(Some(outcome)),
            Err(StudyError::Cancelled) => Err(StudyError::Cancelled),
            _ => Ok(None),
        }
    }

    /// A study whose refinement counts as this plan's effort.
    pub(super) fn counted_study(&self) -> Study {
        Study { effort: Arc::clone(&self.effort), ..Study::default() }
    }

    /// True once so much was simulated to refine fits that no further one is begun.
    pub(super) fn is_spent(&self) -> bool {
        self.effort.spent() > MAX_EFFORT
    }
}

/// Mean of squared errors; zero of none.
pub(super) fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
}

/// Errors that differ by less than this share of the motion count as equal: no measurement supports a term that gains less.
pub(super) const EQUAL_ERRORS: f64 = 3e-4;

/// Mean logarithm of the ratios of two settings' squared errors, stretch for stretch, and its standard error.
pub(super) fn ratio(errors: &[f64], others: &[f64]) -> (f64, f64) {
    let level = |e: &f64| (e + EQUAL_ERRORS * EQUAL_ERRORS).ln();
    let ratios: Vec<f64> = errors.iter().zip(others).map(|(a, b)| level(a) - level(b)).collect();
    let (mean, variance) = mean_and_variance(&ratios);
    (mean, (variance / (ratios.len() as f64 - 1.0).max(1.0)).sqrt())
}

/// Integration steps of refined fits after which a choice begins no further one: some ten seconds of a core. The classics and
/// the samples take a hundredth to two thirds of it.
const MAX_EFFORT: usize = 60_000_000;
/// Samples that are refined while settings are chosen, at most.
const MAX_REFINED_SAMPLES: usize = 24_000;

/// Records cut so that refining them takes no longer than it must.
pub(super) fn shortened<'a>(records: impl IntoIterator<Item = &'a Arc<Record>>) -> Vec<Arc<Record>> {
    let records: Vec<&Arc<Record>> = records.into_iter().collect();
    let most = MAX_REFINED_SAMPLES / records.len().max(1);
    let cut = |r: &Arc<Record>| if r.len() > most { Arc::new(r.slice(0..most)) } else { Arc::clone(r) };
    records.into_iter().map(cut).collect()
}

fn with_facts(records: &RecordSet, usage: Usage, layout: &Layout) -> Vec<(Arc<Record>, Arc<SignalFacts>)> {
    records.with(usage).map(|r| (Arc::clone(r), SignalFacts::cached(r, layout))).collect()
}

/// Variance of what each of a record's sensors shows: `[record][sensor]`.
fn variances(records: &[(Arc<Record>, Arc<SignalFacts>)]) -> Vec<Vec<f64>> {
    let variances = |record: &Record| record.sensors().map(|c| mean_and_variance(&c.values).1).collect();
    records.iter().map(|(record, _)| variances(record)).collect()
}

/// Stretches of some periods within ranges of records; too many are thinned evenly.
fn stretches(records: &[(Arc<Record>, Arc<SignalFacts>)], ranges: &[(usize, Range<usize>)]) -> Vec<JudgingStretch> {
    let mut stretches: Vec<JudgingStretch> = Vec::new();
    for (record, range) in ranges {
        let (data, facts) = &records[*record];
        let period = facts.main_period.map_or(0.1 * range.len() as f64, |p| p / data.interval);
        let length = ((STRETCH_PERIODS * period) as usize).clamp(100, range.len().max(100));
        let count = (range.len() / length).max(1);
        let length = range.len() / count;
        stretches.extend((0..count).map(|k| {
            let from = range.start + k * length;
            JudgingStretch { record: *record, range: from..from + length, block: length }
        }));
    }
    let total: usize = stretches.iter().map(|s| s.range.len()).sum();
    let every = total.div_ceil(MAX_SIMULATED_SAMPLES);
    let mut index = 0;
    stretches.retain(|_| {
        index += 1;
        (index - 1) % every == 0
    });
    stretches
}

/// Records smoothed in one way: what is fitted is reduced, and what judges can be simulated.
pub(super) struct SmoothedFolds {
    /// Everything that may be fitted.
    pub(super) all: Regression,
    /// What is fitted in each fold.
    pub(super) folds: Vec<Regression>,
    /// What drives each fold's judges.
    drives: Vec<Vec<SimulationDrive>>,
}

/// How models do on the stretches that judge them.
#[derive(Clone)]
pub(super) struct Judgement {
    /// Squared error of each block over the record's variance.
    pub(super) errors: Vec<f64>,
    /// Blocks whose response left the data's range, or missed it by far.
    pub(super) failed: usize,
    /// See [`ErrorCorrelation::whiteness`].
    pub(super) whiteness: f64,
}

impl SmoothedFolds {
    /// The model that each fold gives.
    pub(super) fn models(&self, settings: &Settings) -> Vec<Model> {
        self.folds.iter().map(|regression| regression.model(settings)).collect()
    }

    /// Simulates each fold's model along the stretches that judge it.
    pub(super) fn judge(
        &self,
        plan: &ValidationPlan,
        models: &[Model],
        workspace: &mut Workspace,
        cancel: &Cancel,
    ) -> Result<Judgement, StudyError> {
        let mut judgement = Judgement { errors: Vec::new(), failed: 0, whiteness: f64::NAN };
        let mut correlation = ErrorCorrelation::default();
        for ((fold, model), drives) in plan.folds.iter().zip(models).zip(&self.drives) {
            let simulator = Simulator::new(model).map_err(|e| StudyError::Setting(e.to_string()))?;
            for (judge, drive) in fold.judges.iter().zip(drives) {
                cancel.check()?;
                let response = drive.respond(&simulator, JUDGING_TOLERANCE, None, workspace, &|| cancel.is_cancelled());
                cancel.check()?;
                let lasted = response.states.first().map_or(0, Vec::len);
                let blocks = (judge.range.len() / judge.block).max(1);
                for block in 0..blocks {
                    // The last one takes what does not fill another.
                    let to = if block + 1 == blocks { judge.range.len() } else { (block + 1) * judge.block };
                    let from = block * judge.block;
                    let error = squared_error(drive, &response, &plan.variance[judge.record], from..to);
                    let failed = lasted < to || !error.is_finite() || error > DIVERGED_ERROR;
                    judgement.failed += usize::from(failed);
                    judgement.errors.push(if failed { DIVERGED_ERROR } else { error });
                }
                if let (Some(y), Some(shown)) = (drive.measured.first(), drive.outputs.first()) {
                    correlation.add(y, shown.series(&response, plan.layout.freedoms));
                }
            }
        }
        judgement.whiteness = correlation.whiteness();
        Ok(judgement)
    }
}

/// Sums of an error's products with itself some samples later.
#[derive(Default)]
struct ErrorCorrelation {
    square: f64,
    products: [f64; LAGS],
    error: Vec<f64>,
}

/// Lags of 1, 2, 4, … samples at which errors are correlated.
const LAGS: usize = 8;

impl ErrorCorrelation {
    fn add(&mut self, measured: &[f64], response: &[f64]) {
        self.error.clear();
        self.error.extend(measured.iter().zip(response).map(|(y, x)| y - x));
        self.square += dot(&self.error, &self.error);
        for (k, product) in self.products.iter_mut().enumerate() {
            if let Some(later) = self.error.get(1 << k..) {
                *product += dot(&self.error[..later.len()], later);
            }
        }
    }

    /// One less the largest autocorrelation at lags of 1, 2, 4, … 128 samples: near one where the error is noise alone,
    /// near zero where it is a motion that the model misses.
    fn whiteness(&self) -> f64 {
        if self.square == 0.0 {
            return f64::NAN;
        }
        1.0 - self.products.iter().map(|p| (p / self.square).abs()).fold(0.0, f64::max)
    }
}

/// Mean squared error over a block of samples as a share of the variance, mean over sensors.
fn squared_error(drive: &SimulationDrive, response: &Response, variance: &[f64], block: Range<usize>) -> f64 {
    let freedoms = drive.outputs.len();
    let channel = |((y, shown), variance): ((&Arc<[f64]>, &Output), &f64)| {
        let x = shown.series(response, freedoms);
        let (Some(y), Some(x)) = (y.get(block.clone()), x.get(block.clone())) else { return f64::INFINITY };
        y.iter().zip(x).map(|(y, x)| (y - x) * (y - x)).sum::<f64>() / y.len().max(1) as f64 / variance
    };
    drive.measured.iter().zip(&drive.outputs).zip(variance).map(channel).sum::<f64>()
        / drive.measured.len().max(1) as f64
}
