//! Backward elimination: terms that the chosen settings keep and the response does without.

use rayon::prelude::*;

use super::choose::{EQUAL, Plan, ratio, refined_fit, shortened};
use super::{Cancel, Lock, Outcome, Score, Settings, StudyError};
use crate::record::{RecordSet, Usage};
use crate::term::{Kind, Term};

/// Terms that are taken out at most, for each equation.
const MOST: usize = 6;

/// A fit of settings to the response.
struct Fit {
    settings: Settings,
    /// The terms of every acceleration (state), each with the number of its equation.
    terms: Vec<(usize, Term)>,
    /// Of each displacement (state) the mean squared error as a share of its variance, with what no measurement supports
    /// added.
    left: Vec<f64>,
    samples: usize,
}

impl Fit {
    fn new(settings: Settings, outcome: &Outcome) -> Self {
        let layout = outcome.model.layout;
        let first = if layout.kind == Kind::SecondOrder { layout.freedoms } else { 0 };
        let equations = outcome.model.equations[first..].iter().take(layout.freedoms).enumerate();
        let terms = equations.flat_map(|(i, e)| e.terms.iter().map(move |t| (i, t.term.clone()))).collect();
        let scores = |channel: usize| outcome.records.iter().filter_map(move |r| r.channels.get(channel)?.score);
        let left = |channel: usize| {
            let sum = |of: fn(&Score) -> f64| -> f64 { scores(channel).map(|s| s.samples as f64 * of(&s)).sum() };
            sum(|s| s.rmse * s.rmse) / sum(|s| (s.rmse / s.nrmse).powi(2)) + EQUAL * EQUAL
        };
        Self {
            settings,
            terms,
            left: (0..layout.freedoms).map(left).collect(),
            samples: scores(0).map(|s| s.samples).sum(),
        }
    }

    /// Logarithms of what is left, summed: twice the log-likelihood lost, for each sample.
    fn loss(&self) -> f64 {
        self.left.iter().map(|left| left.ln()).sum()
    }
}

impl Plan {
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
        let fit = |settings: Settings| -> Result<Option<Fit>, StudyError> {
            let settings = Settings { refine: true, ..settings };
            let Some(outcome) = refined_fit(&whole, &all, &settings, cancel)? else { return Ok(None) };
            Ok(Some(Fit::new(settings, &outcome)).filter(|fit| fit.left.iter().all(|l| l.is_finite())))
        };
        let Some(mut present) = fit(settings.clone())? else { return Ok((settings, None)) };
        let pieces = self.shortened();
        let judged = |fit: &Fit| self.judge_refined(&pieces, &fit.settings, cancel);
        let mut errors: Option<Vec<f64>> = None;
        let equations = self.layout.freedoms;
        for _ in 0..MOST * equations {
            let open = |(i, t): &&(usize, Term)| !present.settings.of_equation(*i).locks.contains_key(t);
            let open = present.terms.iter().filter(open);
            let tried: Result<Vec<Option<Fit>>, StudyError> = open
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(|(equation, term)| {
                    let mut settings = present.settings.clone();
                    settings.decide(*equation, equations, term.clone(), Lock::Out);
                    fit(settings)
                })
                .collect();
            let fewer = tried?.into_iter().flatten().filter(|f| f.terms.len() < present.terms.len());
            let Some(next) = fewer.min_by(|a, b| a.loss().total_cmp(&b.loss())) else { break };
            let n = present.samples as f64;
            let gone = (present.terms.len() - next.terms.len()) as f64;
            if n * (next.loss() - present.loss()) > gone * n.ln() {
                break;
            }
            let known = match errors.take() {
                Some(errors) => Some(errors),
                None => judged(&present)?,
            };
            let (Some(with), Some(without)) = (known, judged(&next)?) else { break };
            // What was not fitted may get no worse, beyond a standard error.
            let (worse, error) = ratio(&without, &with);
            if worse > error.max(0.02) {
                errors = Some(with);
                break;
            }
            (present, errors) = (next, Some(without));
        }
        let error = errors.filter(|_| refined).map(|e| e.iter().sum::<f64>() / e.len().max(1) as f64);
        Ok((Settings { refine: refined, ..present.settings }, error))
    }
}
