//! What a walk has come to, in verdict and words.

use std::sync::Arc;

use super::effects::{Form, follow_any_curve};
use super::error::GapError;
use super::evidence::Examined;
use super::fit::{Fitted, WHOLE};
use super::outcome::{Diagnosis, Finding, Remaining, Round, Stage, Verdict};
use super::ruling::Tried;
use super::search::Search;
use super::words::{Doubt, remaining, sentence};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::refine::{Goal, shoot};
use sindyscope_core::study::Cancel;
use sindyscope_values::format::number::significant;
use sindyscope_values::term::Term;

impl Search {
    /// What a walk made by hand has come to: `rounds[k]` looked at `stages[k]`, and the last stage may not have been
    /// looked at yet.
    ///
    /// # Errors
    /// No stage, or one that cannot be simulated; cancelled.
    pub fn conclude(
        &self,
        rounds: Vec<Round>,
        stages: Vec<Arc<Stage>>,
        cancel: &Cancel,
    ) -> Result<Diagnosis, GapError> {
        let started = Stopwatch::start();
        let added = stages.last().is_some_and(|s| !s.effects.is_empty());
        let looked = rounds.len() >= stages.len();
        let finding = rounds.last().map(|r| &r.finding);
        let remaining = match (rounds.last(), stages.last()) {
            (Some(round), _) if looked => remaining(&round.evidence, &round.hidden_up_to),
            (_, Some(stage)) => self.left(stage, cancel)?,
            _ => return Err(GapError::Base),
        };
        let fitted = stages.last().and_then(|s| s.fit.0.as_ref());
        let doubt = fitted.and_then(|f| self.doubt(f, remaining.significant, cancel));
        let shorter = match (stages.first(), stages.last()) {
            (Some(base), Some(last)) if looked && doubt.is_none() && !remaining.significant => {
                self.shorter_formula((base, last), || self.all_tried(cancel), &|_| {}, cancel)?
            }
            _ => None,
        };
        let doubt = doubt.or(shorter.as_ref().map(|_| Doubt::ShorterFormula));
        let verdict = match finding {
            Some(Finding::Ambiguous(_)) if added && !looked => Verdict::Ambiguous,
            _ if remaining.significant || doubt.is_some() => Verdict::Unexplained,
            _ if added => Verdict::Named,
            _ => Verdict::NothingMissing,
        };
        let open = !looked || matches!(finding, Some(Finding::Named | Finding::Ambiguous(_)));
        let sentence = match verdict {
            // What was not looked for cannot be said to have no name.
            Verdict::Unexplained if open && added && remaining.significant => {
                sentence((Verdict::Named, doubt), &stages, &rounds, &self.data.shown_unit)
                    + " What is left is more than noise."
            }
            Verdict::Unexplained if open && !added && remaining.significant => {
                "Something is missing: the gap is more than noise.".to_owned()
            }
            verdict => sentence((verdict, doubt), &stages, &rounds, &self.data.shown_unit),
        };
        let unnamed = looked && finding == Some(&Finding::Unexplained) && remaining.significant;
        let description = match (stages.first(), stages.last()) {
            (Some(base), Some(last)) if unnamed => {
                self.described(base, last, &mut self.all_tried(cancel)?, &|_| {}, cancel)?
            }
            _ => shorter,
        };
        let mut diagnosis = self.diagnosis((verdict, sentence, doubt), rounds, stages, remaining, (started, cancel));
        diagnosis.description = description;
        Ok(diagnosis)
    }

    /// Every model that was fitted, as a set of the comparison.
    fn all_tried(&self, cancel: &Cancel) -> Result<Tried, GapError> {
        let mut tried = Tried::default();
        for fitted in self.every_fit() {
            if cancel.is_cancelled() {
                return Err(GapError::Cancelled);
            }
            tried.know(fitted.composition.forms.iter());
            let set = tried.indices(&fitted.composition);
            tried.sets.push(self.hypothesis(set, (*fitted).clone(), cancel));
        }
        Ok(tried)
    }

    pub(super) fn diagnosis(
        &self,
        (verdict, sentence, doubt): (Verdict, String, Option<Doubt>),
        rounds: Vec<Round>,
        stages: Vec<Arc<Stage>>,
        remaining: Remaining,
        (started, cancel): (Stopwatch, &Cancel),
    ) -> Diagnosis {
        let held = stages.last().map(|stage| self.said_of(stage, doubt)).unwrap_or_default();
        let score = |stage: &Arc<Stage>| stage.fit.0.as_ref().map(|fitted| self.record_scores(fitted, cancel));
        let scores = stages.iter().map(|stage| score(stage).unwrap_or_default()).collect();
        Diagnosis {
            verdict,
            explained: !remaining.significant && doubt.is_none(),
            sentence,
            noise_floor: self.data.noise,
            notices: self.notices().map(str::to_owned).chain(held).collect(),
            blind: self.audit.blind.clone(),
            rounds,
            stages,
            scores,
            remaining,
            description: None,
            elapsed_ms: started.milliseconds(),
        }
    }

    /// How far a model predicts that does not follow whole records, in a sentence.
    fn horizon(&self, fitted: &Fitted, doubt: Option<Doubt>) -> Option<String> {
        let longest = fitted.runs.iter().map(|r| r.range.len() as f64 * r.grid.interval()).fold(0.0, f64::max);
        let why = match doubt {
            Some(Doubt::Horizon) => "what the model lacks parts",
            _ => "noise and the model's own sensitivity part",
        };
        (fitted.level != WHOLE).then(|| {
            format!(
                "Errors are those of stretches of {} s, each begun anew: over longer ones {why} the simulation from the \
                 measurement, and how small an effect they would show cannot be told.",
                significant(longest, 3)
            )
        })
    }

    /// What speaks against a model, the gravest first; `more` than noise may be left.
    pub(super) fn doubt(&self, fitted: &Fitted, more: bool, cancel: &Cancel) -> Option<Doubt> {
        if more {
            return Some(Doubt::MoreIsLeft);
        }
        if !self.contradictions(fitted).is_empty() {
            return Some(Doubt::Contradiction);
        }
        let forms = &fitted.composition.forms;
        let noise = self.data.noise_of(fitted, cancel);
        // One stop of a mass that rubs, more or less, says nothing against what holds it.
        let stops = match forms.is_empty() {
            true => self.base_terms().any(Term::switches),
            false => forms.iter().any(Form::is_dry_friction),
        };
        let known = fitted.error().max(noise).max(self.data.unseen_noise());
        if !stops && fitted.held_out_error() > self.data.constants.unseen_ratio * known {
            return Some(Doubt::Unseen);
        }
        if forms.is_empty() {
            return None;
        }
        if follow_any_curve(forms) {
            return Some(Doubt::Curves);
        }
        (!self.lasts(fitted, noise, cancel)).then_some(Doubt::Horizon)
    }

    /// False if a model that does not follow whole records ought to follow them further: along longer stretches a fit that begins
    /// from its own leaves more than `noise`, though they are not so sensitive to how they begin that noise would part them.
    fn lasts(&self, fitted: &Fitted, noise: f64, cancel: &Cancel) -> bool {
        if fitted.level == WHOLE {
            return true;
        }
        let cancelled = || cancel.is_cancelled();
        let constants = &self.data.constants;
        let (composition, period) = (&fitted.composition, fitted.period);
        let whole = self.data.whole();
        let goal = Goal { period, ..self.data.goal(WHOLE, self.data.options(&cancelled, constants.steps, None)) };
        let mut reached = fitted.landed();
        while !reached.whole {
            let from = (reached.refined.point.shared.as_slice(), Some(reached.of(composition)));
            let longer = shoot(composition, &whole, from, reached.level + 1, goal, constants.steps);
            let Some(longer) = longer.filter(|l| !l.is_sensitive()) else { return true };
            let much = |noise: f64| longer.error() > constants.mattering() * noise;
            // The longer a stretch, the more comes together of what inputs do between their samples.
            let along = || self.data.unasked(composition.clone(), longer.clone(), cancel);
            if much(noise) && !reached.goes_on_in(&longer) && much(self.data.noise_of(&along(), cancel)) {
                return false;
            }
            reached = longer;
        }
        true
    }

    /// The effects in joints whose two forces stand in another ratio than the springs of those joints.
    pub(super) fn contradictions<'f>(&self, fitted: &'f Fitted) -> Vec<&'f Form> {
        let most = self.data.constants.amplitude_errors;
        let pairs = fitted.composition.reciprocity(&fitted.parameters).into_iter();
        let mut contradicted: Vec<usize> =
            pairs.filter(|(_, deviations)| deviations.abs() > most).map(|(k, _)| k).collect();
        contradicted.dedup();
        contradicted.into_iter().map(|k| &fitted.composition.forms[k]).collect()
    }

    /// What is to be said of a stage: dampers of the base model held at zero, forces between masses that contradict the springs,
    /// and how far it predicts.
    fn said_of(&self, stage: &Stage, doubt: Option<Doubt>) -> Vec<String> {
        let Some(fitted) = &stage.fit.0 else { return Vec::new() };
        let dampers = fitted.composition.dampers(&fitted.parameters.inner);
        let held = dampers.into_iter().filter(|(k, _)| fitted.refined.at_bound.get(*k).copied().unwrap_or(false));
        let contradicted = self.contradictions(fitted).into_iter().map(|form| {
            let title = form.full_title();
            format!(
                "{title}: its forces accelerate the two masses in another ratio than the springs between them do. One of them \
                 may stand for something else."
            )
        });
        held.map(|(_, placed)| {
            let term = &placed.term;
            let whose = match self.data.masses() {
                1 => String::new(),
                _ => format!(" of mass {}", placed.mass + 1),
            };
            format!("The linear damper {term}{whose} is held at zero: free, it would give energy instead of taking it.")
        })
        .chain(contradicted)
        .chain(self.horizon(fitted, doubt))
        .collect()
    }

    /// What a stage leaves, no effect being tried.
    fn left(&self, stage: &Stage, cancel: &Cancel) -> Result<Remaining, GapError> {
        let fitted = self.fit_of(stage, cancel)?;
        let motion = self.motion(&fitted, &stage.choices(), cancel)?;
        let forms = self.forms(&fitted, &motion);
        let screened = self.data.screen(&fitted, &motion, &forms, cancel);
        let seen = Examined { fitted: &fitted, motion: &motion, forms: &forms, screened: &screened };
        let evidence = self.data.evidence(&seen, cancel).ok_or(GapError::Cancelled)?;
        Ok(remaining(&evidence, &self.data.detectable(&seen, cancel)))
    }
}
