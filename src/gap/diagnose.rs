//! The walk that a search makes on its own, and what a walk has come to.

use std::sync::Arc;
use std::time::Instant;

use super::decide::{APART, FAR, clearly_better, score, unborne};
use super::error::GapError;
use super::evidence::Seen;
use super::fit::{Fitted, Pace, carried};
use super::outcome::{Choice, Diagnosis, Finding, Remaining, Round, Stage, Standing, Verdict};
use super::search::{Listener, Search};
use super::structure::Part;
use super::words::{in_company, remaining, sentence, titles};
use crate::refine::Point;
use crate::study::Cancel;

/// The effect that moves the zero of what is measured, and the share of the gap from which it may hide another.
const OFFSET: &str = "sensor_offset";
const MUCH: f64 = 0.3;
/// Promising effects that are tried in company.
const COMPANIONS: usize = 2;

impl Search {
    /// Walks until nothing is missing, nothing more can be named, or the most effects are added.
    ///
    /// # Errors
    /// The base cannot be fitted; cancelled.
    pub fn diagnose(&self, tell: Listener<'_>, cancel: &Cancel) -> Result<Diagnosis, GapError> {
        let started = Instant::now();
        let mut stage = self.base(cancel)?;
        let mut steps: Vec<Step> = Vec::new();
        let mut last = loop {
            let round = self.look(&stage, tell, cancel)?;
            match Step::of(round) {
                Ok(step) if steps.len() < self.ask.max_effects => {
                    if let Some((pair, both)) = self.behind_an_offset(&stage, &step, steps.len(), tell, cancel)? {
                        steps.extend(pair);
                        stage = self.lighter(&mut steps, both, cancel)?;
                        continue;
                    }
                    steps.push(step);
                    // A richer kind takes the simpler one's place, and what a later effect made superfluous goes.
                    let fitted = self.added(&stage, &choices(&steps), cancel)?;
                    stage = self.lighter(&mut steps, fitted, cancel)?;
                }
                Ok(step) => break Round { finding: Finding::Unexplained, ..step.round },
                Err(round) => match self.pair(&stage, &round, steps.len(), tell, cancel)? {
                    Some((pair, both)) => {
                        steps.extend(pair);
                        stage = self.lighter(&mut steps, both, cancel)?;
                    }
                    None => break *round,
                },
            }
        };
        if steps.len() > 1 {
            let mut again = steps.clone();
            if !self.reconsider(&mut again, tell, cancel)? {
                steps = again;
            } else if let Some(exchanged) = GapError::if_possible(self.stage(&choices(&again), cancel))? {
                steps = again;
                stage = self.lighter(&mut steps, exchanged, cancel)?;
                last = self.look(&stage, tell, cancel)?;
            }
        }
        // Those that stand alone first; the interface lists rivals under the last.
        let mut sorted = steps.clone();
        sorted.sort_by_key(|s| !s.alone());
        let stages = match GapError::if_possible(self.stages(&sorted, cancel))? {
            Some(stages) => {
                steps = sorted;
                stages
            }
            None => self.stages(&steps, cancel)?,
        };
        let ambiguous = steps.iter().any(|s| !s.alone());
        let verdict = match last.finding {
            Finding::Nothing if steps.is_empty() => Verdict::NothingMissing,
            Finding::Nothing if !ambiguous => Verdict::Named,
            _ if ambiguous => Verdict::Ambiguous,
            _ => Verdict::Unexplained,
        };
        let mut rounds: Vec<Round> = steps.into_iter().map(|s| s.round).collect();
        rounds.push(last);
        let remaining =
            rounds.last().map_or_else(Remaining::default, |round| remaining(&round.evidence, &round.hidden_up_to));
        let sentence = sentence(verdict, &stages, &rounds, &self.data.unit);
        Ok(self.diagnosis((verdict, sentence), rounds, stages, remaining, started))
    }

    /// The base model, and one stage a step. A stage that cannot be fitted from the one before it is fitted from the one
    /// after it.
    fn stages(&self, steps: &[Step], cancel: &Cancel) -> Result<Vec<Arc<Stage>>, GapError> {
        let list = choices(steps);
        let mut fitted = self.fitted(&list, cancel)?;
        let mut stages = vec![Arc::new(self.show(&fitted))];
        for n in (0..list.len()).rev() {
            fitted = match GapError::if_possible(self.fitted(&list[..n], cancel))? {
                Some(fitted) => fitted,
                None => {
                    let leaner = self.without(&fitted, &Part::Effect(n), cancel).map(Arc::new);
                    leaner.ok_or_else(|| GapError::Stage(titles(&list[..n])))?
                }
            };
            stages.push(Arc::new(self.show(&fitted)));
        }
        stages.reverse();
        Ok(stages)
    }

    /// A model without one of its parts, fitted anew.
    fn without(&self, whole: &Fitted, part: &Part, cancel: &Cancel) -> Option<Fitted> {
        let point = &whole.refined.point;
        let (composition, stays) = whole.composition.lean(part, &point.shared)?;
        let kept = point.shared.iter().zip(&stays).filter(|(_, stays)| **stays).map(|(s, _)| *s);
        let start = Point { shared: kept.collect(), ..carried(&whole.composition, &composition, point) };
        let refined = self.data.refine(&composition, &start, self.data.lost(), Pace::Thorough, cancel)?;
        Some(self.data.judge(composition, refined, cancel))
    }

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
        let started = Instant::now();
        let added = stages.last().is_some_and(|s| !s.effects.is_empty());
        let looked = rounds.len() >= stages.len();
        let finding = rounds.last().map(|r| &r.finding);
        let remaining = match (rounds.last(), stages.last()) {
            (Some(round), _) if looked => remaining(&round.evidence, &round.hidden_up_to),
            (_, Some(stage)) => self.left(stage, cancel)?,
            _ => return Err(GapError::Base),
        };
        let verdict = match finding {
            Some(Finding::Ambiguous(_)) if added && !looked => Verdict::Ambiguous,
            _ if remaining.significant => Verdict::Unexplained,
            _ if added => Verdict::Named,
            _ => Verdict::NothingMissing,
        };
        let open = !looked || matches!(finding, Some(Finding::Named | Finding::Ambiguous(_)));
        let sentence = match verdict {
            // What was not looked for cannot be said to have no name.
            Verdict::Unexplained if open && added => {
                sentence(Verdict::Named, &stages, &rounds, &self.data.unit) + " What is left is more than noise."
            }
            Verdict::Unexplained if open => "Something is missing: the gap is more than noise.".to_owned(),
            verdict => sentence(verdict, &stages, &rounds, &self.data.unit),
        };
        Ok(self.diagnosis((verdict, sentence), rounds, stages, remaining, started))
    }

    fn diagnosis(
        &self,
        (verdict, sentence): (Verdict, String),
        rounds: Vec<Round>,
        stages: Vec<Arc<Stage>>,
        remaining: Remaining,
        started: Instant,
    ) -> Diagnosis {
        let left_out = stages.last().map(|stage| self.left_out(stage)).unwrap_or_default();
        Diagnosis {
            verdict,
            sentence,
            noise_floor: self.data.noise,
            notices: self.notices().map(str::to_owned).chain(left_out).collect(),
            blind: self.audit.blind.clone(),
            rounds,
            stages,
            remaining,
            elapsed_ms: 1e3 * started.elapsed().as_secs_f64(),
        }
    }

    /// Two effects that data never fitted bear out together where they bear out neither alone: large effects hide each
    /// other.
    fn pair(
        &self,
        stage: &Arc<Stage>,
        round: &Round,
        added: usize,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<Option<Pair>, GapError> {
        if round.finding != Finding::Unexplained || added + 2 > self.ask.max_effects {
            return Ok(None);
        }
        let before: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        for first in round.promising.iter().take(COMPANIONS) {
            let Some(place) = round.candidates.iter().position(|c| c.choice == *first) else { continue };
            let Some(with) = round.candidates[place].stage.clone() else { continue };
            let Some(looked) = GapError::if_possible(self.look(&with, tell, cancel))? else { continue };
            let Ok(second) = Step::of(looked) else { continue };
            let both = GapError::if_possible(self.added(&with, &[first.clone(), second.choice.clone()], cancel))?;
            let Some(both) = both else { continue };
            let choices: Vec<Choice> = both.effects.iter().map(|e| e.choice.clone()).collect();
            // A richer kind of the first is no pair.
            if choices.len() != before.len() + 2 {
                continue;
            }
            let (alone, together) = (self.fitted(&before, cancel)?, self.fitted(&choices, cancel)?);
            let tint = self.tint(&together);
            let gained = score(&alone, &together, tint, 0.0);
            if unborne(&alone, (&together, &gained), self.data.noise, &self.data.unit).is_some() {
                continue;
            }
            let first = self.led(round, place, &second, (&alone, &together));
            return Ok(Some(([first, second], both)));
        }
        Ok(None)
    }

    /// Where a shift of the sensor's zero explains much of the gap, and far more than noise would be left without it: the
    /// effect that is named once the zero is free, if with it the data are explained better than with the one named before.
    fn behind_an_offset(
        &self,
        stage: &Arc<Stage>,
        step: &Step,
        added: usize,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<Option<Pair>, GapError> {
        let round = &step.round;
        let offset = round.candidates.iter().position(|c| c.choice.effect == OFFSET && c.explained > MUCH);
        let left = round.candidates.first().and_then(|c| c.stage.as_ref()).map_or(0.0, |s| s.gap.train_rmse);
        let (Some(place), true) = (offset, left > FAR * self.data.noise) else { return Ok(None) };
        if added + 2 > self.ask.max_effects || step.choice.effect == OFFSET {
            return Ok(None);
        }
        let before: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        let zero = round.candidates[place].choice.clone();
        let path = |list: &[&Choice]| -> Vec<Choice> { before.iter().chain(list.iter().copied()).cloned().collect() };
        let Ok(free) = self.stage(&path(&[&zero]), cancel) else { return Ok(None) };
        let Some(looked) = GapError::if_possible(self.look(&free, tell, cancel))? else { return Ok(None) };
        let Ok(second) = Step::of(looked) else { return Ok(None) };
        if second.choice == step.choice {
            return Ok(None);
        }
        let both = GapError::if_possible(self.added(&free, &[zero.clone(), second.choice.clone()], cancel))?;
        let Some(both) = both else { return Ok(None) };
        let choices: Vec<Choice> = both.effects.iter().map(|e| e.choice.clone()).collect();
        let Ok(rival) = self.fitted(&path(&[&step.choice, &zero]), cancel) else { return Ok(None) };
        let (alone, together) = (self.fitted(&before, cancel)?, self.fitted(&choices, cancel)?);
        let tint = self.tint(&together);
        let total = |f: &Fitted| score(&alone, f, tint, 0.0).total;
        if choices.len() != before.len() + 2 || total(&together) > total(&rival) - APART {
            return Ok(None);
        }
        let first = self.led(round, place, &second, (&alone, &together));
        Ok(Some(([first, second], both)))
    }

    /// The step to a round's candidate that is named in another's company.
    fn led(&self, round: &Round, place: usize, other: &Step, gain: (&Fitted, &Fitted)) -> Step {
        let mut round = round.clone();
        let mut candidate = round.candidates.remove(place);
        let choice = candidate.choice.clone();
        candidate.standing = Standing::Refitted;
        candidate.why = in_company(&candidate.title, &other.title(), gain, &self.data.unit);
        round.candidates.insert(0, candidate);
        round.finding = Finding::Named;
        Step { choice, round }
    }

    /// A stage without what its last effect has made superfluous, and the steps that stay.
    fn lighter(&self, steps: &mut Vec<Step>, stage: Arc<Stage>, cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let kept = self.dropped(stage, cancel)?;
        steps.retain(|s| kept.effects.iter().any(|e| e.choice == s.choice));
        Ok(kept)
    }

    /// A stage without what the last effect has made superfluous: an earlier one, or a damper of the base model with
    /// which data never fitted are explained clearly worse than without.
    fn dropped(&self, stage: Arc<Stage>, cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let choices: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        let whole = self.fitted(&choices, cancel)?;
        let shared = &whole.refined.point.shared;
        let tint = self.tint(&whole);
        let inner = &shared[shared.len() - whole.composition.inner_count()..];
        // A model that explains the data to the noise has the dampers that they need.
        let wrong = !choices.is_empty() && whole.gap.test_rmse.is_some_and(|rmse| rmse > FAR * self.data.noise);
        let dampers = whole.composition.dampers(inner).into_iter().filter(|_| wrong);
        let parts = (0..choices.len().saturating_sub(1))
            .map(Part::Effect)
            .chain(dampers.map(|(k, term)| Part::Damper(k, term.clone())));
        for part in parts {
            let Some(without) = self.without(&whole, &part, cancel) else { continue };
            let gone = match part {
                Part::Effect(_) => score(&whole, &without, tint, 0.0).total <= 0.0,
                Part::Damper(..) => clearly_better(&without, &whole),
            };
            if gone {
                let without = Arc::new(without);
                self.keep(Arc::clone(&without));
                return Ok(Arc::new(self.show(&without)));
            }
        }
        Ok(stage)
    }

    /// Dampers of the base model that a stage does without, one sentence each.
    fn left_out(&self, stage: &Stage) -> Vec<String> {
        let choices: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        let Some(fitted) = self.known(&choices) else { return Vec::new() };
        let gone = self.base_terms().iter().filter(|t| !fitted.composition.base.contains(t));
        gone.map(|term| {
            format!(
                "With what was added, data never fitted are explained clearly better without the linear damper {term}: \
                 it was left out."
            )
        })
        .collect()
    }

    /// What a stage leaves, no effect being tried.
    fn left(&self, stage: &Stage, cancel: &Cancel) -> Result<Remaining, GapError> {
        let choices: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        let fitted = self.fitted(&choices, cancel)?;
        let motion = self.data.motion(&fitted).ok_or_else(|| GapError::Stage(titles(&choices)))?;
        let forms = self.forms(&fitted, &motion);
        let screened = self.data.screen(&fitted, &motion, &forms, cancel);
        let seen = Seen { fitted: &fitted, motion: &motion, forms: &forms, screened: &screened };
        let evidence = self.data.evidence(&seen, cancel).ok_or(GapError::Cancelled)?;
        Ok(remaining(&evidence, &self.data.detectable(&seen, cancel)))
    }

    /// The stage after the last of these effects was added to another.
    fn added(&self, before: &Stage, choices: &[Choice], cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let last = choices.last().ok_or(GapError::Base)?;
        let known: Vec<Choice> = before.effects.iter().map(|e| e.choice.clone()).collect();
        let with: Vec<Choice> = known.iter().chain([last]).cloned().collect();
        // Where it took a simpler one's place, the fit is known without that one.
        let place = (0..known.len()).map(|gone| {
            let mut list = with.clone();
            list.remove(gone);
            list
        });
        let found = std::iter::once(with.clone()).chain(place).find(|list| self.known(list).is_some());
        self.stage(&found.unwrap_or(with), cancel)
    }

    /// Looks again at each effect in the company of the others: with the others in place another may do better, or rivals
    /// may have fallen away. True if an effect was exchanged.
    fn reconsider(&self, steps: &mut [Step], tell: Listener<'_>, cancel: &Cancel) -> Result<bool, GapError> {
        let mut exchanged = false;
        for index in 0..steps.len() {
            // The last was judged in the company of all others, unless one of them was exchanged since.
            if index + 1 == steps.len() && !exchanged {
                break;
            }
            let others: Vec<Choice> =
                steps.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, s)| s.choice.clone()).collect();
            let Ok(stage) = self.stage(&others, cancel) else { continue };
            if let Some(looked) = GapError::if_possible(self.look(&stage, tell, cancel))?
                && let Ok(step) = Step::of(looked)
            {
                exchanged |= step.choice != steps[index].choice;
                steps[index] = step;
            }
        }
        Ok(exchanged)
    }
}

/// Two effects that were added together, and the stage with both.
type Pair = ([Step; 2], Arc<Stage>);

/// The effects of steps.
fn choices(steps: &[Step]) -> Vec<Choice> {
    steps.iter().map(|s| s.choice.clone()).collect()
}

/// An effect that was added, and the look that led to it.
#[derive(Clone)]
struct Step {
    choice: Choice,
    round: Round,
}

impl Step {
    /// The step that a round leads to; the round itself if it leads to none.
    fn of(round: Round) -> Result<Self, Box<Round>> {
        match (&round.finding, round.candidates.first()) {
            (Finding::Named | Finding::Ambiguous(_), Some(first)) => Ok(Self { choice: first.choice.clone(), round }),
            _ => Err(Box::new(round)),
        }
    }

    fn title(&self) -> String {
        self.round.candidates.first().map_or_else(String::new, |c| c.title.clone())
    }

    fn alone(&self) -> bool {
        self.round.finding == Finding::Named
    }
}
