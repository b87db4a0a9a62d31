//! Backward elimination: terms that the chosen settings keep and the response does without.

use std::sync::Arc;

use super::validation::{EQUAL_ERRORS, ValidationPlan, mean, ratio, shortened};
use super::warnings::MIN_FOLLOWED_SHARE;
use super::{Cancel, Covariance, Lock, Outcome, Settings, Study, StudyError};
use crate::refine::Bar;
use nalgebra::{DMatrix, DVector};
use sindyscope_values::model::{Model, WeightedTerm};
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::Term;

/// Steps that take terms out, at most, for each equation.
const MAX_STEPS: usize = 8;
/// Terms that are fewer than this many standard errors from zero are first tried without all together.
const DROP_TOGETHER_ERRORS: f64 = 1.5;
/// Number of such terms from which on that is tried.
const MIN_DROPPED_TOGETHER: usize = 4;
/// Standard errors by which the held-out error may get worse without a term: that one term of many does so by chance.
const MAX_STANDARD_ERRORS: f64 = 2.0;
/// Change of twice the log-likelihood that the held-out error may cost where there are too few stretches for a standard error.
const MAX_LIKELIHOOD_LOSS: f64 = MAX_STANDARD_ERRORS * MAX_STANDARD_ERRORS;
/// A term is not tried without if its expected loss is this many times ln n, n the samples that judge.
const MAX_EXPECTED_LOSS: f64 = 30.0;
/// Standard errors from zero from which on a coefficient is significant: a 99 % interval, for many are looked at.
const MIN_STANDARD_ERRORS: f64 = 2.6;

/// A fit of settings to the response.
struct EliminationFit {
    settings: Settings,
    model: Model,
    covariance: Covariance,
    /// The terms of every acceleration (state), each with the number of its equation, and its coefficient in standard errors;
    /// none where there is no error.
    terms: Vec<(usize, Term, Option<f64>)>,
    /// Of each displacement (state) the mean squared error as a share of its variance, with what no measurement supports
    /// added.
    left: Vec<f64>,
    samples: usize,
    /// Longest run that was fitted, s.
    horizon: f64,
}

/// What a refined fit leaves of every displacement (state) along the runs that were fitted: mean squared error as a share of
/// its variance. A free run of a chaotic model would tell nothing.
pub(super) fn left(outcome: &Outcome) -> Option<Vec<f64>> {
    let refinement = outcome.refinement.as_ref()?;
    let share = |(channel, rmse): (usize, &f64)| {
        let scores = outcome.records.iter().filter_map(|r| r.channels.get(channel)?.score);
        let (squares, samples) = scores.fold((0.0, 0.0), |(squares, samples), s| {
            let n = s.samples as f64;
            (squares + n * (s.rmse / s.nrmse).powi(2), samples + n)
        });
        rmse * rmse * samples / squares
    };
    Some(refinement.rmse.iter().enumerate().map(share).collect())
}

impl EliminationFit {
    /// None where the response could not be fitted.
    fn new(settings: Settings, outcome: &Outcome) -> Option<Self> {
        let layout = outcome.model.layout;
        let first = layout.states() - layout.freedoms;
        let equations = outcome.model.equations[first..].iter().take(layout.freedoms).enumerate();
        let terms = equations.flat_map(|(i, e)| {
            e.terms.iter().map(move |t| (i, t.term.clone(), t.std_error.map(|error| t.coefficient / error)))
        });
        let terms = terms.collect();
        let left: Vec<f64> = left(outcome)?.into_iter().map(|left| left + EQUAL_ERRORS * EQUAL_ERRORS).collect();
        let samples = outcome.records.iter().filter_map(|r| Some(r.channels.first()?.score?.samples)).sum();
        let horizon = outcome.refinement.as_ref()?.horizon;
        let (model, covariance) = (outcome.model.clone(), outcome.covariance.clone());
        Some(Self { settings, model, covariance, terms, left, samples, horizon })
            .filter(|fit| fit.left.iter().all(|l| l.is_finite()))
    }

    /// The model without some terms, given as in `terms`: of the others what the fit would be if the response were linear in
    /// the coefficients.
    fn without(&self, dropped: &[&(usize, Term, Option<f64>)]) -> Model {
        let gone: Vec<usize> =
            (0..self.terms.len()).filter(|k| dropped.iter().any(|d| **d == self.terms[*k])).collect();
        let entry = |i: usize, j: usize| self.covariance.all()[i][j];
        let mut model = self.model.clone();
        let first = self.model.layout.states() - self.model.layout.freedoms;
        let mut fitted: Vec<&mut WeightedTerm> =
            model.equations[first..].iter_mut().flat_map(|e| &mut e.terms).collect();
        let within = DMatrix::from_fn(gone.len(), gone.len(), |i, j| entry(gone[i], gone[j]));
        let values = DVector::from_iterator(gone.len(), gone.iter().map(|k| fitted[*k].coefficient));
        let shift = within.cholesky().map(|factor| factor.solve(&values));
        if let Some(shift) = shift.filter(|shift| shift.iter().all(|s| s.is_finite())) {
            for (i, term) in fitted.iter_mut().enumerate() {
                term.coefficient -= gone.iter().zip(&shift).map(|(j, s)| entry(i, *j) * s).sum::<f64>();
            }
        }
        for (equation, term, _) in dropped {
            model.equations[first + equation].terms.retain(|t| t.term != *term);
        }
        model
    }

    /// Logarithms of what is left, summed: twice the log-likelihood lost, for each sample.
    fn loss(&self) -> f64 {
        self.left.iter().map(|left| left.ln()).sum()
    }

    /// What dropping a term is expected to lose at least, as the square of its coefficient in standard errors tells (Wald):
    /// all that it leaves where that counts least. Exact where the response is linear in the coefficients.
    fn expected_loss(&self, ratio: f64) -> f64 {
        let n = self.samples as f64;
        let more = |left: &f64| ((left - EQUAL_ERRORS * EQUAL_ERRORS) * ratio * ratio / n / left).ln_1p();
        n * self.left.iter().map(more).fold(f64::INFINITY, f64::min)
    }
}

/// The settings with those terms dropped, the least certain first, that the regression cannot tell from zero.
fn insignificant_dropped(
    records: &[Arc<Record>],
    mut settings: Settings,
    cancel: &Cancel,
) -> Result<Settings, StudyError> {
    let entries = records.iter().map(|r| (Arc::clone(r), Usage::Fit)).collect();
    let (records, mut study) = (RecordSet { entries }, Study::default());
    loop {
        let Ok(outcome) = study.run(&records, &Settings { refine: false, ..settings.clone() }, cancel) else {
            cancel.check()?;
            return Ok(settings);
        };
        let layout = outcome.model.layout;
        let equations = outcome.model.equations.iter().skip(layout.states() - layout.freedoms).enumerate();
        let ratios = equations.flat_map(|(i, equation)| {
            equation.terms.iter().filter_map(move |t| Some((i, &t.term, (t.coefficient / t.std_error?).abs())))
        });
        let least = ratios
            .filter(|(i, term, ratio)| {
                *ratio < MIN_STANDARD_ERRORS && !settings.of_equation(*i).locks.contains_key(*term)
            })
            .min_by(|a, b| a.2.total_cmp(&b.2));
        let Some((equation, term, _)) = least else { return Ok(settings) };
        settings.decide(equation, layout.freedoms, term.clone(), Lock::Out);
    }
}

impl ValidationPlan {
    /// The settings with those terms dropped that the refined fit does as well without, by the Bayesian information
    /// criterion (Schwarz 1978), and that do not help on the stretches that were not fitted either; and, for settings that
    /// refine, the mean squared error on those stretches as a share of the motion's variance, where it was found anew.
    ///
    /// A threshold takes terms out by their share of the force, one regression at a time: of terms that are much alike, as
    /// `v` and `v*|v|`, noise decides which it keeps. The response itself tells them apart better.
    ///
    /// # Errors
    /// Cancelled.
    pub(super) fn without_needless(
        &self,
        records: &RecordSet,
        settings: Settings,
        cancel: &Cancel,
    ) -> Result<(Settings, Option<f64>), StudyError> {
        let fitted = records.entries.iter().filter(|(_, usage)| *usage == Usage::Fit);
        let whole = shortened(fitted.map(|(record, _)| record));
        let all: Vec<usize> = (0..whole.len()).collect();
        let refined = settings.refine;
        let fit = |settings: Settings, start: Option<&Model>, rivals: Option<&Arc<Bar>>| {
            let settings = Settings { refine: true, ..settings };
            let Some(outcome) = self.refined_fit(&whole, &all, &settings, (start, rivals), cancel)? else {
                return Ok::<_, StudyError>(None);
            };
            Ok(EliminationFit::new(settings, &outcome))
        };
        let Some(mut present) = fit(settings.clone(), None, None)? else { return Ok((settings, None)) };
        let longest = whole.iter().map(|r| r.len() as f64 * r.interval).fold(0.0, f64::max);
        if present.horizon < MIN_FOLLOWED_SHARE * longest {
            // Fits to so short runs, and to others after each step, compare nothing.
            return Ok((insignificant_dropped(&whole, settings, cancel)?, None));
        }
        let pieces = self.shortened();
        let judged = |fit: &EliminationFit| self.judge_refined(&pieces, &fit.settings, None, Some(&fit.model), cancel);
        let mut errors: Option<Vec<f64>> = None;
        let judging = self.judging() as f64;
        let equations = self.layout.freedoms;
        let mut together = true;
        for _ in 0..MAX_STEPS * equations {
            let n = present.samples as f64;
            let open = |(i, t, ratio): &&(usize, Term, Option<f64>)| {
                !present.settings.of_equation(*i).locks.contains_key(t)
                    && ratio.is_none_or(|ratio| present.expected_loss(ratio) < MAX_EXPECTED_LOSS * n.ln())
            };
            let mut open: Vec<&(usize, Term, Option<f64>)> = present.terms.iter().filter(open).collect();
            // The least certain first: what comes after it is then given up early.
            open.sort_by(|a, b| a.2.map_or(0.0, f64::abs).total_cmp(&b.2.map_or(0.0, f64::abs)));
            let nothing: Vec<_> =
                open.iter().copied().filter(|t| t.2.is_some_and(|ratio| ratio.abs() < DROP_TOGETHER_ERRORS)).collect();
            together &= nothing.len() >= MIN_DROPPED_TOGETHER;
            let sets: Vec<Vec<&(usize, Term, Option<f64>)>> =
                if together { vec![nothing] } else { open.into_iter().map(|t| vec![t]).collect() };
            let rivals = Arc::new(Bar::default());
            // One after another, for which are given up must not hang on the threads' luck.
            let tried: Result<Vec<Option<EliminationFit>>, StudyError> = sets
                .into_iter()
                .take_while(|_| !self.is_spent())
                .map(|set| {
                    let mut settings = present.settings.clone();
                    for (equation, term, _) in &set {
                        settings.decide(*equation, equations, term.clone(), Lock::Out);
                    }
                    fit(settings, Some(&present.without(&set)), Some(&rivals))
                })
                .collect();
            let fewer = tried?.into_iter().flatten();
            let fewer =
                fewer.filter(|f| f.terms.len() < present.terms.len() && f.horizon >= MIN_FOLLOWED_SHARE * longest);
            let needless = |next: &EliminationFit| {
                let gone = (present.terms.len() - next.terms.len()) as f64;
                n * (next.loss() - present.loss()) <= gone * n.ln()
            };
            let next = fewer.min_by(|a, b| a.loss().total_cmp(&b.loss())).filter(needless);
            let accepted = match next {
                Some(next) => {
                    let known = match errors.take() {
                        Some(errors) => Some(errors),
                        None => judged(&present)?,
                    };
                    let (Some(with), Some(without)) = (known, judged(&next)?) else { break };
                    let (worse, error) = ratio(&without, &with);
                    // What was not fitted may get no worse, but by chance.
                    let stands = worse <= (MAX_STANDARD_ERRORS * error).max(0.02).max(MAX_LIKELIHOOD_LOSS / judging);
                    errors = Some(if stands { without } else { with });
                    stands.then_some(next)
                }
                None => None,
            };
            match accepted {
                Some(next) => present = next,
                None if together => together = false,
                None => break,
            }
        }
        let error = errors.filter(|_| refined).map(|errors| mean(&errors));
        Ok((Settings { refine: refined, ..present.settings }, error))
    }
}
