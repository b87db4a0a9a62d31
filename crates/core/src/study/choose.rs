//! Chooses settings by simulation error on stretches that were not fitted.

use super::eliminate::left;
use super::refined::same_terms;
use super::regression::Regression;
use super::validation::{EQUAL_ERRORS, Judgement, ValidationPlan, mean, ratio};
use super::{Cancel, Formulation, Outcome, Regressor, Settings, Smoothing, StudyError, check};
use crate::parallel::prelude::*;
use crate::refine::Bar;
use crate::signal::{Differentiation, mean_and_variance, median, odd};
use crate::simulate::Workspace;
use crate::sparse::between;
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::model::Model;
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Kind, Layout, Symbol};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which settings [`choose`] may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FreeSettings {
    /// The smoothing segment length.
    pub window: bool,
    /// The smoothing polynomial's order.
    pub order: bool,
    /// The threshold.
    pub threshold: bool,
    /// Whether the equation is held against the data at samples or in the weak form.
    pub form: bool,
    /// Whether the coefficients are fitted to the response itself at the end.
    pub refine: bool,
    /// Whether the library may become another where that halves what it leaves of the acceleration; of records with one
    /// displacement.
    pub terms: bool,
}

/// What [`choose`] chose, and why.
#[derive(Clone, Debug)]
pub struct ChosenSettings {
    /// The settings chosen.
    pub settings: Settings,
    /// One sentence: what was tried and what decided.
    pub reason: String,
    /// RMS error of the simulated response on what was not fitted, as a share of the motion's standard deviation.
    pub error: f64,
}

impl ChosenSettings {
    /// Takes over what was chosen, where `asked` is what it was chosen from: a setting that is no longer as it was then stays,
    /// for a person changed it meanwhile.
    pub fn take_over(&self, asked: &Settings, settings: &mut Settings) {
        fn take<T: Clone + PartialEq>(chosen: &T, asked: &T, present: &mut T) {
            if present == asked {
                present.clone_from(chosen);
            }
        }
        let chosen = &self.settings;
        take(&chosen.smoothing, &asked.smoothing, &mut settings.smoothing);
        take(&chosen.form, &asked.form, &mut settings.form);
        take(&chosen.threshold, &asked.threshold, &mut settings.threshold);
        take(&chosen.scaling, &asked.scaling, &mut settings.scaling);
        take(&chosen.refine, &asked.refine, &mut settings.refine);
        take(&chosen.terms, &asked.terms, &mut settings.terms);
        take(&chosen.locks, &asked.locks, &mut settings.locks);
        take(&chosen.own, &asked.own, &mut settings.own);
    }
}

/// Samples of all fitted records together that settings are chosen by, at most.
const MAX_CHOOSING_SAMPLES: usize = 200_000;
/// Samples of each of them that stay, however many records there are.
const MIN_CHOOSING_SAMPLES: usize = 10_000;
/// Rounds of smoothings around the best so far, at most.
const MAX_ROUNDS: usize = 4;
/// Thresholds tried for one smoothing, at most, for each degree of freedom.
const MAX_THRESHOLDS: usize = 10;

/// Share of the whole work that is done when smoothings and thresholds have been tried: rough, for a person who waits.
const SHARE_AFTER_TRIALS: f64 = 0.4;
/// Share that is done when the response of the candidates alike has been held against a refined one.
const SHARE_AFTER_RESPONSE: f64 = 0.5;
/// Share that is done when refined fits have been compared.
const SHARE_AFTER_REFINED: f64 = 0.75;

/// How columns and rates are made.
type FormAndSmoothing = (Formulation, Smoothing);

/// One setting with its errors.
#[derive(Clone)]
pub(super) struct SettingsTrial {
    pub(super) form: Formulation,
    pub(super) smoothing: Smoothing,
    pub(super) threshold: f64,
    pub(super) terms: usize,
    /// Squared error of each stretch over the record's variance, in the plan's order.
    pub(super) errors: Vec<f64>,
}

impl SettingsTrial {
    /// Mean squared error as a share of the motion's variance.
    pub(super) fn mean(&self) -> f64 {
        mean(&self.errors)
    }

    /// The median squared error: a single diverging stretch must not decide, for refinement may recover it.
    fn median(&self) -> f64 {
        median(self.errors.clone()).unwrap_or(0.0)
    }
}

/// Chooses the free settings by simulation error on stretches that were not fitted: of several records each is left out
/// in turn, of a single one the last part. Of the settings within one standard error of the best the one with the fewest
/// terms is taken (Breiman et al. 1984); of those with as many terms the one whose response is nearest to the refined one.
/// Where refined fits do much better on the stretches that were not fitted, they are compared in the same way and
/// refinement is chosen too. At last the terms are dropped that the response does without. Records held out by the user
/// are not looked at.
///
/// `progress` is told what is being done, and the share of the whole that is done, 0 to 1.
///
/// # Errors
/// As [`Study::run`](super::Study::run).
pub fn choose(
    records: &RecordSet,
    start: &Settings,
    free: FreeSettings,
    cancel: &Cancel,
    progress: &(dyn Fn(&'static str, f64) + Sync),
) -> Result<ChosenSettings, StudyError> {
    let layout = check(records, start)?;
    let whole = records.with(Usage::Fit).map(|r| r.len()).sum::<usize>();
    let records = &beginnings(records);
    let growth = super::grow::grown(records, &layout, start, cancel)?;
    let library = growth.as_ref().filter(|_| free.terms).and_then(|g| g.terms.clone());
    let start = &Settings { terms: library.unwrap_or_else(|| start.terms.clone()), ..start.clone() };
    let plan = ValidationPlan::new(records, layout);
    let tried = plan.trials(start, free, cancel, progress)?;
    progress("fitting the response", SHARE_AFTER_TRIALS);
    let Some(sparse) = parsimonious(&tried) else {
        return Err(StudyError::Setting("no setting gave a response that could be compared".into()));
    };
    if free.form
        && free.threshold
        && let Some(growth) = growth.as_ref().filter(|g| free.terms || g.lacking.is_empty())
        && let Some(settings) = plan.equation_in_averages(start, growth, sparse, &tried, cancel)?
    {
        let reason = format!(
            "{}: the equation holds in averages over what was not fitted, while the one whose response errs least there does \
             not; {} settings tried; {}",
            described(&settings, start),
            tried.len(),
            growth.tried,
        );
        return Ok(ChosenSettings { settings, reason, error: sparse.mean().sqrt() });
    }
    let settled = plan.settle(records, start, free, &tried, sparse, cancel)?;
    let (chosen, mut settings) = match &settled {
        Some(SettledChoice { candidate, settings }) => (*candidate, settings.clone()),
        None => (sparse, plan.settings(start, free, sparse)?),
    };
    let mut error = chosen.mean();
    progress("comparing refined fits", SHARE_AFTER_RESPONSE);
    if free.refine
        && let Some((better, refined)) = plan.refined_choice(start, free, &tried, chosen, cancel)?
    {
        (settings, error) = (better, refined);
    }
    if free.refine
        && free.threshold
        && error > UNFOLLOWED_ERROR * UNFOLLOWED_ERROR
        && !plan.is_spent()
        && let Some((better, refined)) = plan.whole_library(start, &settings, error, cancel)?
    {
        (settings, error) = (better, refined);
    }
    progress("leaving out what is needless", SHARE_AFTER_REFINED);
    if free.threshold {
        let (lean, found) = plan.without_needless(records, settings, cancel)?;
        (settings, error) = (lean, found.unwrap_or(error));
    }
    let judged = match plan.pieces.len() {
        1 => "the last part of the record, which was not fitted".to_owned(),
        n => format!("{n} records, each left out in turn"),
    };
    let judged = match records.with(Usage::Fit).map(|r| r.len()).sum::<usize>() {
        used if used < whole => format!("{judged}, by the first {used} samples"),
        _ => judged,
    };
    let reason = format!(
        "{}: simulation error {} % of the motion's standard deviation on {judged}; {} settings tried{}{}{}",
        described(&settings, start),
        significant_trimmed(100.0 * error.sqrt(), 2),
        tried.len(),
        dropped(&settings, start, &layout),
        if plan.is_spent() { "; some fits to the response were left out, for they take long here" } else { "" },
        match growth {
            Some(growth) if free.terms => format!("; {}", growth.tried),
            growth => growth.and_then(|g| g.advice()).map_or_else(String::new, |advice| format!("; {advice}")),
        },
    );
    Ok(ChosenSettings { settings, reason, error: error.sqrt() })
}

/// The terms that were dropped from `start` on, as the end of a sentence; empty if there are none.
fn dropped(settings: &Settings, start: &Settings, layout: &Layout) -> String {
    let mut dropped: Vec<String> =
        settings.locks.keys().filter(|t| !start.locks.contains_key(*t)).map(ToString::to_string).collect();
    for (freedom, own) in &settings.own {
        let before = start.own.get(freedom);
        let new = own.locks.keys().filter(|t| !before.is_some_and(|b| b.locks.contains_key(*t)));
        let equation = match layout.kind {
            Kind::SecondOrder => layout.name(Symbol::Rate(*freedom)),
            Kind::FirstOrder => layout.name(Symbol::State(*freedom)),
        };
        dropped.extend(new.map(|t| format!("{} of d{equation}/dt", t.text(layout))));
    }
    if dropped.is_empty() { String::new() } else { format!("; dropped as needless: {}", dropped.join(", ")) }
}

/// What was chosen, in words.
fn described(settings: &Settings, start: &Settings) -> String {
    let form = match settings.form {
        Formulation::Derivative => "",
        Formulation::Weak { .. } => "weak form, ",
        Formulation::Integral => "integral form, ",
    };
    let refined = if settings.refine && !start.refine { ", coefficients fitted to the response itself" } else { "" };
    let regressor = match settings.regressor {
        Regressor::Stlsq => String::new(),
        other => format!("{}, ", other.title()),
    };
    let smoothing = match settings.smoothing {
        s if s.method.is_local() => format!("segment {} of order {}", s.window, s.order),
        s if s.given().is_some() => format!("{} of {} samples", s.method.title(), s.window),
        s => s.method.title().to_owned(),
    };
    format!("{regressor}{form}{smoothing} and threshold {:.2e}{refined}", settings.threshold)
}

impl ValidationPlan {
    /// Judges forms and smoothings with their thresholds, round by round nearer to the best.
    fn trials(
        &self,
        start: &Settings,
        free: FreeSettings,
        cancel: &Cancel,
        progress: &(dyn Fn(&'static str, f64) + Sync),
    ) -> Result<Vec<SettingsTrial>, StudyError> {
        let mut tried: Vec<SettingsTrial> = Vec::new();
        let forms = if free.form {
            vec![Formulation::Derivative, Formulation::Weak { half_width: None }]
        } else {
            vec![start.form]
        };
        let smoothings = first_smoothings(self, start, free);
        let mut next: Vec<FormAndSmoothing> =
            forms.into_iter().flat_map(|form| smoothings.iter().map(move |s| (form, *s))).collect();
        let mut seen: Vec<FormAndSmoothing> = Vec::new();
        for round in 0..MAX_ROUNDS {
            let report = |share: f64| {
                progress(
                    "trying smoothings and thresholds",
                    SHARE_AFTER_TRIALS * (round as f64 + share) / MAX_ROUNDS as f64,
                );
            };
            tried.extend(self.judge_all(start, &next, free, cancel, &report)?);
            seen.append(&mut next);
            let Some(best) = best(&tried) else { break };
            next = nearby_smoothings(self, best.smoothing, free).into_iter().map(|s| (best.form, s)).collect();
            next.retain(|s| !seen.contains(s));
            if next.is_empty() {
                break;
            }
        }
        Ok(tried)
    }
}

pub(super) fn best(tried: &[SettingsTrial]) -> Option<&SettingsTrial> {
    tried.iter().filter(|c| c.mean().is_finite()).min_by(|a, b| a.mean().total_cmp(&b.mean()))
}

/// Error of what is chosen over that of the best, at most.
const MAX_ERROR_RATIO: f64 = 1.25;

/// How far the displacements of two outcomes lie apart, mean square over the motion's variance; none if their terms
/// differ or a response does not last.
fn distance(outcome: &Outcome, other: &Outcome) -> Option<f64> {
    if !same_terms(&outcome.model, &other.model) || outcome.diverged() {
        return None;
    }
    let freedoms = outcome.model.layout.freedoms;
    let apart = |i: usize| {
        let (mut squares, mut spread) = (0.0, 0.0);
        for (a, b) in outcome.records.iter().zip(&other.records) {
            let (a, b) = (a.states.get(i)?, b.states.get(i)?);
            squares += a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            spread += b.len() as f64 * mean_and_variance(b).1;
        }
        Some(squares / spread)
    };
    let sum: f64 = (0..freedoms).map(apart).sum::<Option<f64>>()?;
    Some(sum / freedoms.max(1) as f64).filter(|d| d.is_finite())
}

/// The candidate with the fewest terms whose error is within one standard error (of the difference) of the best.
pub(super) fn parsimonious(tried: &[SettingsTrial]) -> Option<&SettingsTrial> {
    let fewest = close(tried).map(|c| c.terms).min()?;
    close(tried).filter(|c| c.terms == fewest).min_by(|a, b| a.mean().total_cmp(&b.mean()))
}

/// The fitted records, of very long ones the beginning: more says next to nothing new about settings and takes its time.
fn beginnings(records: &RecordSet) -> RecordSet {
    let count = records.with(Usage::Fit).count().max(1);
    let cut = |(record, usage): &(Arc<Record>, Usage)| {
        let most = (MAX_CHOOSING_SAMPLES / count).max(MIN_CHOOSING_SAMPLES);
        let part = *usage == Usage::Fit && record.len() > most;
        (if part { Arc::new(record.slice(0..most)) } else { Arc::clone(record) }, *usage)
    };
    RecordSet { entries: records.entries.iter().map(cut).collect() }
}

/// The candidates within one standard error of the best.
fn close(tried: &[SettingsTrial]) -> impl Iterator<Item = &SettingsTrial> {
    let best = best(tried);
    let within = move |c: &&SettingsTrial| {
        let Some(best) = best else { return false };
        let differences: Vec<f64> = c.errors.iter().zip(&best.errors).map(|(a, b)| a - b).collect();
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / (n - 1.0).max(1.0);
        // Of a few stretches the standard error is itself uncertain.
        let slack = (variance / n).sqrt().min((MAX_ERROR_RATIO * MAX_ERROR_RATIO - 1.0) * best.mean());
        mean <= slack + 0.02 * best.mean() + EQUAL_ERRORS * EQUAL_ERRORS
    };
    tried.iter().filter(within)
}

/// As [`parsimonious`], by the ratios of errors.
fn parsimonious_by_ratio(tried: &[SettingsTrial]) -> Option<&SettingsTrial> {
    let first = tried.first()?;
    let lowest = |a: &&SettingsTrial, b: &&SettingsTrial| {
        ratio(&a.errors, &first.errors).0.total_cmp(&ratio(&b.errors, &first.errors).0)
    };
    let best = tried.iter().min_by(lowest)?;
    let close = |c: &&SettingsTrial| {
        let (mean, error) = ratio(&c.errors, &best.errors);
        mean <= error.min(2.0 * MAX_ERROR_RATIO.ln()) + 0.02
    };
    let fewest = tried.iter().filter(close).map(|c| c.terms).min()?;
    tried.iter().filter(close).filter(|c| c.terms == fewest).min_by(lowest)
}

/// Refinement is chosen where it lowers the error to this share, or below.
const REFINE_ERROR_RATIO: f64 = 0.6;
/// Error, as a share of the motion, from which on no regression has led to a response that follows it.
const UNFOLLOWED_ERROR: f64 = 0.3;
/// Threshold that drops only coefficients which are next to nothing.
const LEAST_THRESHOLD: f64 = 1e-3;
/// Candidates of different numbers of terms whose refined fits are compared, at most.
const MAX_REFINED_CANDIDATES: usize = 6;
/// Candidates whose error on the median stretch exceeds the best by this factor are not refined.
const MAX_ERROR_RATIO_TO_REFINE: f64 = 5.0;

/// For each number of terms the candidate of the smallest error, the best first.
fn levels(tried: &[SettingsTrial]) -> Vec<&SettingsTrial> {
    let least = best(tried).map_or(0.0, SettingsTrial::median);
    let mut levels: Vec<&SettingsTrial> = Vec::new();
    for candidate in
        tried.iter().filter(|c| c.median() <= MAX_ERROR_RATIO_TO_REFINE * MAX_ERROR_RATIO_TO_REFINE * least)
    {
        match levels.iter_mut().find(|c| c.terms == candidate.terms) {
            Some(known) if candidate.mean() < known.mean() => *known = candidate,
            Some(_) => {}
            None => levels.push(candidate),
        }
    }
    levels.sort_by(|a, b| a.mean().total_cmp(&b.mean()));
    levels.truncate(MAX_REFINED_CANDIDATES);
    levels
}

/// A candidate held against the refined response.
struct SettledChoice<'a> {
    candidate: &'a SettingsTrial,
    settings: Settings,
}

/// Settings of equal terms and equal errors that are compared with the refined response, at most.
const MAX_ALIKE: usize = 12;

impl ValidationPlan {
    /// The settings of a candidate.
    fn settings(&self, start: &Settings, free: FreeSettings, chosen: &SettingsTrial) -> Result<Settings, StudyError> {
        let threshold = if free.threshold { self.centred_threshold(start, chosen)? } else { start.threshold };
        Ok(Settings { smoothing: chosen.smoothing, form: chosen.form, threshold, ..start.clone() })
    }

    /// Among candidates that leave the same number of terms and do as well, the noise of the data decides which errs
    /// least. Where the response itself can be fitted, the one is taken whose response is nearest to the fitted one: that
    /// comparison has no noise in it, and what is left is the smoothing's bias. None if nothing can be refined.
    fn settle<'a>(
        &self,
        records: &RecordSet,
        start: &Settings,
        free: FreeSettings,
        tried: &'a [SettingsTrial],
        sparse: &'a SettingsTrial,
        cancel: &Cancel,
    ) -> Result<Option<SettledChoice<'a>>, StudyError> {
        let mut alike: Vec<&SettingsTrial> = Vec::new();
        for candidate in close(tried).filter(|c| c.terms == sparse.terms) {
            match alike.iter_mut().find(|c| (c.form, c.smoothing) == (candidate.form, candidate.smoothing)) {
                Some(known) if candidate.mean() < known.mean() => *known = candidate,
                Some(_) => {}
                None => alike.push(candidate),
            }
        }
        alike.sort_by(|a, b| a.mean().total_cmp(&b.mean()));
        alike.truncate(MAX_ALIKE);
        let fitted = records.entries.iter().filter(|(_, usage)| *usage == Usage::Fit).cloned().collect();
        let fitted = RecordSet { entries: fitted };
        let mut study = self.counted_study();
        let settings = self.settings(start, free, sparse)?;
        let refined = study.run(&fitted, &Settings { refine: true, ..settings }, cancel)?;
        if refined.refinement.is_none() || refined.diverged() {
            return Ok(None);
        }
        let mut nearest: Option<(f64, SettledChoice<'a>)> = None;
        for candidate in alike {
            let settings = Settings { refine: false, ..self.settings(start, free, candidate)? };
            // A smoothing that whole records do not bear is none.
            let outcome = match study.run(&fitted, &settings, cancel) {
                Ok(outcome) => outcome,
                Err(StudyError::Cancelled) => return Err(StudyError::Cancelled),
                Err(_) => continue,
            };
            let Some(distance) = distance(&outcome, &refined) else { continue };
            if nearest.as_ref().is_none_or(|(least, _)| distance < *least) {
                let settings = Settings { refine: start.refine, ..settings };
                nearest = Some((distance, SettledChoice { candidate, settings }));
            }
        }
        Ok(nearest.map(|(_, settled)| settled))
    }

    /// Settings whose refined fits do much better on what was not fitted than the settings chosen so far, with their mean
    /// squared error: without the smoothing's bias in the coefficients, the stretches that judge also tell better which
    /// terms are right. Errors are compared by their ratio on each stretch: where the record of a resonance is left out its
    /// damping is not known, and that one error would hide what all others tell.
    fn refined_choice(
        &self,
        start: &Settings,
        free: FreeSettings,
        tried: &[SettingsTrial],
        present: &SettingsTrial,
        cancel: &Cancel,
    ) -> Result<Option<(Settings, f64)>, StudyError> {
        let pieces = self.shortened();
        let all: Vec<usize> = (0..pieces.len()).collect();
        /// A candidate, its settings refined, the model that all pieces gave, and what it leaves of them.
        struct RefinedCandidate<'c> {
            candidate: &'c SettingsTrial,
            settings: Settings,
            model: Model,
            left: f64,
        }
        let rivals = Arc::new(Bar::default());
        // One after another, for which are given up must not hang on the threads' luck.
        let levels: Result<Vec<Option<RefinedCandidate<'_>>>, StudyError> = levels(tried)
            .into_iter()
            .map(|candidate| {
                let settings = Settings { refine: true, ..self.settings(start, free, candidate)? };
                if self.is_spent() {
                    return Ok(None);
                }
                let outcome = self.refined_fit(&pieces, &all, &settings, (None, Some(&rivals)), cancel)?;
                let level = |outcome: Outcome| {
                    let left = left(&outcome)?;
                    let left = left.iter().sum::<f64>() / left.len() as f64;
                    Some(RefinedCandidate { candidate, settings, model: outcome.model, left })
                };
                Ok(outcome.and_then(level))
            })
            .collect();
        let mut levels: Vec<RefinedCandidate<'_>> = levels?.into_iter().flatten().collect();
        let least = levels.iter().map(|l| l.left).fold(f64::INFINITY, f64::min);
        if least >= REFINE_ERROR_RATIO * REFINE_ERROR_RATIO * present.mean() {
            return Ok(None);
        }
        // More terms that leave as much by the Bayesian information criterion (Schwarz 1978) would not be chosen either.
        let samples = pieces.iter().map(|p| p.len()).sum::<usize>().max(2) as f64;
        let criterion =
            |terms: usize, left: f64| samples * (left + EQUAL_ERRORS * EQUAL_ERRORS).ln() + terms as f64 * samples.ln();
        let known: Vec<(usize, f64)> = levels.iter().map(|l| (l.candidate.terms, l.left)).collect();
        levels.retain(|l| {
            let own = criterion(l.candidate.terms, l.left);
            !known.iter().any(|(terms, left)| *terms < l.candidate.terms && criterion(*terms, *left) <= own)
        });
        levels.retain(|l| {
            l.left + EQUAL_ERRORS * EQUAL_ERRORS
                <= MAX_ERROR_RATIO_TO_REFINE * MAX_ERROR_RATIO_TO_REFINE * (least + EQUAL_ERRORS * EQUAL_ERRORS)
        });
        let judged: Result<Vec<Option<SettingsTrial>>, StudyError> = levels
            .par_iter()
            .map(|level| {
                let errors = self.judge_refined(&pieces, &level.settings, Some(&level.model), None, cancel)?;
                Ok(errors.map(|errors| SettingsTrial { errors, ..level.candidate.clone() }))
            })
            .collect();
        let judged: Vec<SettingsTrial> = judged?.into_iter().flatten().collect();
        let better = |c: &&SettingsTrial| ratio(&c.errors, &present.errors).0 < 2.0 * REFINE_ERROR_RATIO.ln();
        let Some(chosen) = parsimonious_by_ratio(&judged).filter(better) else { return Ok(None) };
        let settings = levels.into_iter().find(|l| l.candidate.terms == chosen.terms).map(|l| l.settings);
        Ok(settings.map(|settings| (settings, chosen.mean())))
    }

    /// Settings that keep next to the whole library, refined, with their mean squared error, if that is much less than
    /// `present`: where the motion is an estimate, as of accelerometers, no regression may rank the terms well enough for its
    /// response to follow, and what is needless is told by the response alone.
    fn whole_library(
        &self,
        start: &Settings,
        chosen: &Settings,
        present: f64,
        cancel: &Cancel,
    ) -> Result<Option<(Settings, f64)>, StudyError> {
        let pieces = self.shortened();
        let all: Vec<usize> = (0..pieces.len()).collect();
        let ways = [(start.form, start.smoothing), (chosen.form, chosen.smoothing)];
        let judged = |(form, smoothing): &FormAndSmoothing| -> Result<Option<(Settings, f64)>, StudyError> {
            let threshold = LEAST_THRESHOLD;
            let settings = Settings { form: *form, smoothing: *smoothing, threshold, refine: true, ..start.clone() };
            let Some(outcome) = self.refined_fit(&pieces, &all, &settings, (None, None), cancel)? else {
                return Ok(None);
            };
            let errors = self.judge_refined(&pieces, &settings, Some(&outcome.model), None, cancel)?;
            Ok(errors.map(|errors| (settings, mean(&errors))))
        };
        let judged: Result<Vec<Option<(Settings, f64)>>, StudyError> = ways.par_iter().map(judged).collect();
        let least = judged?.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(least.filter(|(_, error)| *error < REFINE_ERROR_RATIO * REFINE_ERROR_RATIO * present))
    }

    /// Judges every threshold of every way, on the cores there are.
    fn judge_all(
        &self,
        start: &Settings,
        ways: &[FormAndSmoothing],
        free: FreeSettings,
        cancel: &Cancel,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Vec<SettingsTrial>, StudyError> {
        let done = AtomicUsize::new(0);
        let judged: Result<Vec<Vec<SettingsTrial>>, StudyError> = ways
            .par_iter()
            .map(|(form, smoothing)| {
                let start = Settings { form: *form, ..start.clone() };
                let candidates = self.judge(&start, smoothing, free, cancel)?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress(done as f64 / ways.len() as f64);
                Ok(candidates)
            })
            .collect();
        Ok(judged?.into_iter().flatten().collect())
    }

    fn judge(
        &self,
        start: &Settings,
        smoothing: &Smoothing,
        free: FreeSettings,
        cancel: &Cancel,
    ) -> Result<Vec<SettingsTrial>, StudyError> {
        let Some(smoothed) = self.smoothed(start, smoothing, cancel)? else { return Ok(Vec::new()) };
        let settings = Settings { smoothing: *smoothing, ..start.clone() };
        let thresholds = if free.threshold {
            smoothed.all.thresholds(&settings, MAX_THRESHOLDS * self.layout.freedoms)
        } else {
            vec![start.threshold]
        };
        let mut workspace = Workspace::default();
        let mut candidates: Vec<SettingsTrial> = Vec::with_capacity(thresholds.len());
        for threshold in thresholds {
            let settings = Settings { threshold, ..settings.clone() };
            let models = smoothed.models(&settings);
            let Judgement { errors, .. } = smoothed.judge(self, &models, &mut workspace, cancel)?;
            let terms = smoothed.all.model(&settings).equations.iter().map(|e| e.terms.len()).sum();
            candidates.push(SettingsTrial { form: settings.form, smoothing: *smoothing, threshold, terms, errors });
        }
        Ok(candidates)
    }

    /// Settings that lead to the equation which holds in averages over blocks not fitted, where the one that was chosen by its
    /// response does not.
    fn equation_in_averages(
        &self,
        start: &Settings,
        growth: &super::grow::Growth,
        chosen: &SettingsTrial,
        tried: &[SettingsTrial],
        cancel: &Cancel,
    ) -> Result<Option<Settings>, StudyError> {
        let settings = Settings { smoothing: chosen.smoothing, form: chosen.form, ..start.clone() };
        let Some(pieces) = self.regressions(&settings, cancel)? else { return Ok(None) };
        let model = Regression::joined(&pieces.iter().collect::<Vec<_>>())
            .model(&Settings { threshold: chosen.threshold, ..settings });
        let Some(terms) = growth.instead_of(&model) else { return Ok(None) };
        let weak = |trial: &&SettingsTrial| matches!(trial.form, Formulation::Weak { .. });
        let smoothing = tried.iter().filter(weak).min_by(|a, b| a.mean().total_cmp(&b.mean())).map(|t| t.smoothing);
        Ok(smoothing.map(|smoothing| Settings {
            smoothing,
            form: Formulation::Weak { half_width: None },
            terms: terms.to_vec(),
            threshold: 0.0,
            ..start.clone()
        }))
    }

    /// The threshold in the middle of those that leave the chosen terms, fitted on everything.
    fn centred_threshold(&self, start: &Settings, chosen: &SettingsTrial) -> Result<f64, StudyError> {
        let settings = Settings { smoothing: chosen.smoothing, form: chosen.form, ..start.clone() };
        let Some(pieces) = self.regressions(&settings, &Cancel::default())? else { return Ok(chosen.threshold) };
        let all = Regression::joined(&pieces.iter().collect::<Vec<_>>());
        let marks = all.marks(&settings);
        let below = marks.iter().copied().filter(|m| *m < chosen.threshold).fold(0.0, f64::max);
        let above = marks.iter().copied().filter(|m| *m >= chosen.threshold).fold(f64::INFINITY, f64::min);
        let middle = between(below, above);
        let rounded: f64 = format!("{middle:.1e}").parse().unwrap_or(middle);
        Ok(if rounded > below && rounded < above { rounded } else { middle })
    }
}

pub(super) fn period_samples(plan: &ValidationPlan) -> f64 {
    let periods = plan.records.iter().filter_map(|(r, f)| Some(f.main_period? / r.interval));
    let shortest = periods.fold(f64::INFINITY, f64::min);
    if shortest.is_finite() {
        shortest
    } else {
        0.1 * plan.pieces.iter().map(|(r, _)| r.len()).min().unwrap_or(0) as f64
    }
}

/// Segment lengths that a piece can bear.
pub(super) fn bearable(plan: &ValidationPlan, order: usize) -> Range<usize> {
    let shortest = plan.pieces.iter().map(|(r, _)| r.len()).min().unwrap_or(0);
    order + 2..(shortest / 4).max(order + 3)
}

fn first_smoothings(plan: &ValidationPlan, start: &Settings, free: FreeSettings) -> Vec<Smoothing> {
    const STEPS: usize = 9;
    let base = start.smoothing;
    if !free.window || base.method == Differentiation::Difference {
        return vec![base];
    }
    let order = if free.order || base.method.is_global() { 5 } else { base.order };
    let (shortest, longest) = (0.02, 0.25 * (order as f64 + 1.0) / 2.0);
    let period = period_samples(plan);
    let mut smoothings: Vec<Smoothing> = (0..STEPS)
        .map(|k| {
            let share = shortest * f64::powf(longest / shortest, k as f64 / (STEPS - 1) as f64);
            Smoothing { order, ..base }.with_window(fit_window(plan, order, share * period))
        })
        .collect();
    if base.method.is_global() {
        smoothings.push(Smoothing { from_data: true, ..base });
    }
    smoothings.dedup();
    smoothings
}

fn fit_window(plan: &ValidationPlan, order: usize, samples: f64) -> usize {
    let range = bearable(plan, order);
    odd((samples as usize).clamp(range.start, range.end)).min(odd(range.end) | 1)
}

fn nearby_smoothings(plan: &ValidationPlan, best: Smoothing, free: FreeSettings) -> Vec<Smoothing> {
    if best.method == Differentiation::Difference || best.method.is_global() && best.from_data {
        return vec![best];
    }
    let orders: Vec<usize> = match (free.order, best.order) {
        (_, order) if best.method.is_global() => vec![order],
        (false, order) => vec![order],
        // Data with few samples a period need the highest orders: their pass band is the widest.
        (true, order) => {
            [order.saturating_sub(2), order, order + 2].into_iter().filter(|o| (3..=11).contains(o)).collect()
        }
    };
    let mut smoothings = Vec::new();
    for order in &orders {
        // A higher order passes higher frequencies: segments of equal pass band grow with it.
        let equal = best.window as f64 * (*order as f64 + 1.0) / (best.order as f64 + 1.0);
        let factors: &[f64] = if free.window { &[0.6, 0.8, 1.0, 1.25] } else { &[1.0] };
        for factor in factors {
            let window = if free.window { fit_window(plan, *order, factor * equal) } else { best.window };
            let smoothing = Smoothing { order: *order, ..best }.with_window(window);
            if *order < window && !smoothings.contains(&smoothing) {
                smoothings.push(smoothing);
            }
        }
    }
    smoothings
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_rig::{ScenarioOptions, generate};

    #[test]
    fn of_very_long_records_the_beginnings_choose() {
        let options = ScenarioOptions { duration: Some(25.0), rate: Some(10_000.0), ..ScenarioOptions::default() };
        let long = generate("duffing", &options).unwrap().records;
        let mut records = RecordSet::new(long.clone(), Usage::Fit);
        records.add(long, Usage::HeldOut);
        let lengths = |set: &RecordSet| set.entries.iter().map(|(r, _)| r.len()).collect::<Vec<usize>>();
        assert_eq!(lengths(&beginnings(&records)), [MAX_CHOOSING_SAMPLES, 250_000]);
        let short = RecordSet { entries: vec![(Arc::new(records.entries[0].0.slice(0..5000)), Usage::Fit)] };
        assert!(Arc::ptr_eq(&beginnings(&short).entries[0].0, &short.entries[0].0));
    }
}
