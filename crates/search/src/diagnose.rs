//! The walk that a search makes on its own, and what a walk has come to.

use std::sync::Arc;

use super::decide::{FAR, is_undetermined, score};
use super::effects::Form;
use super::error::GapError;
use super::evidence::Examined;
use super::fit::{Fitted, WHOLE, carried};
use super::outcome::{Choice, Diagnosis, Finding, Remaining, Round, Stage, Standing, Verdict};
use super::search::{Depth, Listener, Search};
use super::structure::choice;
use super::words::{in_company, remaining, sentence, titles};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::refine::Point;
use sindyscope_core::study::Cancel;
use sindyscope_values::format::number::significant;

/// Far from the noise, an effect is needless without which data never fitted are explained so nearly as well.
const NEEDLESS: f64 = 1.1;
/// Standard deviations by which a joint's two forces contradict its springs.
const CONTRADICTED: f64 = 4.0;

impl Search {
    /// Walks until nothing is missing, nothing more can be named, or the most effects are added.
    ///
    /// # Errors
    /// The base cannot be fitted; cancelled.
    pub fn diagnose(&self, tell: Listener<'_>, cancel: &Cancel) -> Result<Diagnosis, GapError> {
        if self.is_piped() {
            return self.walked(tell, cancel);
        }
        let started = Stopwatch::start();
        let mut stage = self.base(cancel)?;
        let mut steps: Vec<Advance> = Vec::new();
        let mut last = loop {
            let depth = if steps.len() < self.ask.max_effects { Depth::Refitted } else { Depth::Screened };
            // What cannot be simulated or fitted on cannot be gone on with: the walk ends before it.
            let Some(round) = GapError::if_possible(self.look_into(&stage, depth, tell, cancel))? else {
                break ended(steps.pop())?;
            };
            let step = match Advance::of(round) {
                Ok(step) => step,
                Err(round) => break *round,
            };
            let company = step.round.company.clone().filter(|_| steps.len() + 2 <= self.ask.max_effects);
            if company.is_none() && step.round.company.is_some() {
                break Round { finding: Finding::Unexplained, ..step.round };
            }
            steps.push(step);
            // A richer kind takes the simpler one's place, and what a later effect made superfluous goes.
            let Some(mut fitted) = GapError::if_possible(self.after(&stage, &steps, cancel))? else {
                break ended(steps.pop())?;
            };
            if let Some(second) = company {
                let both: Vec<Choice> = stage
                    .choices()
                    .into_iter()
                    .chain(choices(&steps[steps.len() - 1..]))
                    .chain([second.clone()])
                    .collect();
                let joined = self
                    .fitted(&both, cancel)
                    .and_then(|together| self.joined(&fitted, second, &together, tell, cancel));
                let Some(step) = GapError::if_possible(joined)? else {
                    break ended(steps.pop())?;
                };
                steps.push(step);
                fitted = self.stage(&both, cancel)?;
            }
            stage = self.lighter(&mut steps, fitted, cancel)?;
        };
        // An effect that does not stand alone, or another in its place, may with the others there. Where forces between masses
        // contradict the springs, or the fit no longer tells a size from zero, something has taken another's place.
        let reached = self.fit_of(&stage, cancel)?;
        let doubtful = !self.contradictions(&reached).is_empty() || self.undetermined(&reached).next().is_some();
        if steps.len() > 1 && (doubtful || !steps.iter().all(Advance::alone)) {
            let mut again = steps.clone();
            if !self.reconsider(&mut again, tell, cancel)? {
                steps = again;
            } else if let Some(exchanged) = GapError::if_possible(self.stage(&choices(&again), cancel))? {
                steps = again;
                stage = self.lighter(&mut steps, exchanged, cancel)?;
                last = self.look(&stage, tell, cancel)?;
            }
        }
        let lighter = self.without_needless(&mut steps, cancel)?;
        if let Some(stage) = self.without_undetermined(&mut steps, cancel)?.or(lighter) {
            last = self.look_into(&stage, Depth::Screened, tell, cancel)?;
        }
        let (steps, stages) = self.in_order(steps, cancel)?;
        let ambiguous = steps.iter().any(|s| !s.alone());
        // A joint that contradicts the springs explains the data, but not by what it is called.
        let contradicted = !self.contradictions(&*self.fitted(&choices(&steps), cancel)?).is_empty();
        let verdict = match last.finding {
            Finding::Nothing if steps.is_empty() => Verdict::NothingMissing,
            Finding::Nothing if !ambiguous && !contradicted => Verdict::Named,
            _ if ambiguous => Verdict::Ambiguous,
            _ => Verdict::Unexplained,
        };
        let mut rounds: Vec<Round> = steps.into_iter().map(|s| s.round).collect();
        rounds.push(last);
        let remaining =
            rounds.last().map_or_else(Remaining::default, |round| remaining(&round.evidence, &round.hidden_up_to));
        let sentence = sentence((verdict, remaining.significant), &stages, &rounds, &self.data.shown_unit);
        Ok(self.diagnosis((verdict, sentence), rounds, stages, remaining, (started, cancel)))
    }

    /// Steps in the order in which a person follows them, with the base model and one stage a step: the largest first, and
    /// last those that do not stand alone, for the interface lists rivals under the last.
    ///
    /// All stages follow stretches as long as the last one's: errors of unlike stretches do not compare.
    fn in_order(&self, mut steps: Vec<Advance>, cancel: &Cancel) -> Result<(Vec<Advance>, Vec<Arc<Stage>>), GapError> {
        let mut fitted = self.fitted(&choices(&steps), cancel)?;
        let mut stages = vec![Arc::new(self.show(&fitted))];
        let mut ordered = Vec::new();
        while !steps.is_empty() {
            let open = steps.iter().any(|s| !s.alone());
            let mut least: Option<(usize, Arc<Fitted>)> = None;
            for index in (0..steps.len()).filter(|k| steps[*k].alone() != open) {
                let Some(leaner) = self.leaner(&fitted, index, cancel)? else { continue };
                if least.as_ref().is_none_or(|(_, l)| leaner.held_out_error() < l.held_out_error()) {
                    least = Some((index, leaner));
                }
            }
            let (index, leaner) = least.ok_or_else(|| GapError::Stage(titles(&choices(&steps))))?;
            ordered.push(steps.remove(index));
            stages.push(Arc::new(self.show(&leaner)));
            fitted = leaner;
        }
        ordered.reverse();
        stages.reverse();
        Ok((ordered, stages))
    }

    /// A model without one of its effects along stretches as long; where that cannot be followed, however it was fitted.
    fn leaner(&self, whole: &Fitted, index: usize, cancel: &Cancel) -> Result<Option<Arc<Fitted>>, GapError> {
        let mut list = whole.composition.choices();
        list.remove(index);
        if let Some(known) = self.known(&list).filter(|k| k.level == whole.level) {
            return Ok(Some(known));
        }
        match self.without(whole, index, cancel) {
            Some(leaner) => Ok(Some(Arc::new(leaner))),
            None => GapError::if_possible(self.fitted(&list, cancel)),
        }
    }

    /// A model without one of its effects, fitted anew over segments as long.
    fn without(&self, whole: &Fitted, index: usize, cancel: &Cancel) -> Option<Fitted> {
        let (composition, kept) = whole.composition.reduced(index, &whole.parameters)?;
        let start = Point { shared: kept.row(), ..carried(&whole.composition, &composition, &whole.refined.point) };
        let refined = self.data.refine_at(&composition, &start, whole.level, cancel)?;
        Some(self.data.judged(composition, refined, cancel))
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
        let contradicted = fitted.is_some_and(|f| !self.contradictions(f).is_empty());
        let verdict = match finding {
            Some(Finding::Ambiguous(_)) if added && !looked => Verdict::Ambiguous,
            _ if remaining.significant || contradicted => Verdict::Unexplained,
            _ if added => Verdict::Named,
            _ => Verdict::NothingMissing,
        };
        let open = !looked || matches!(finding, Some(Finding::Named | Finding::Ambiguous(_)));
        let sentence = match verdict {
            // What was not looked for cannot be said to have no name.
            Verdict::Unexplained if open && added && remaining.significant => {
                sentence((Verdict::Named, true), &stages, &rounds, &self.data.shown_unit)
                    + " What is left is more than noise."
            }
            Verdict::Unexplained if open && !added => "Something is missing: the gap is more than noise.".to_owned(),
            verdict => sentence((verdict, remaining.significant), &stages, &rounds, &self.data.shown_unit),
        };
        Ok(self.diagnosis((verdict, sentence), rounds, stages, remaining, (started, cancel)))
    }

    pub(super) fn diagnosis(
        &self,
        (verdict, sentence): (Verdict, String),
        rounds: Vec<Round>,
        stages: Vec<Arc<Stage>>,
        remaining: Remaining,
        (started, cancel): (Stopwatch, &Cancel),
    ) -> Diagnosis {
        let held = stages.last().map(|stage| self.said_of(stage)).unwrap_or_default();
        let last = stages.last().and_then(|stage| stage.fit.0.as_ref());
        let records = last.map(|fitted| self.record_scores(fitted, cancel)).unwrap_or_default();
        Diagnosis {
            verdict,
            explained: !remaining.significant,
            sentence,
            noise_floor: self.data.noise,
            notices: self.notices().map(str::to_owned).chain(held).collect(),
            blind: self.audit.blind.clone(),
            rounds,
            stages,
            records,
            remaining,
            elapsed_ms: started.milliseconds(),
        }
    }

    /// The step to an effect that was found in company of the stage's last: the look at that stage, with the effect first.
    fn joined(
        &self,
        stage: &Arc<Stage>,
        choice: Choice,
        together: &Arc<Fitted>,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<Advance, GapError> {
        let mut round = self.look_into(stage, Depth::Screened, tell, cancel)?;
        if let Some(place) = round.candidates.iter().position(|c| c.choice == choice) {
            let mut candidate = round.candidates.remove(place);
            let alone = self.fit_of(stage, cancel)?;
            candidate.standing = Standing::Refitted;
            if let Some(with) = stage.effects.last() {
                candidate.why = in_company(&candidate.title, &with.title, (&alone, together), &self.data.shown_unit);
            }
            candidate.stage = Some(Arc::new(self.show(together)));
            round.candidates.insert(0, candidate);
        }
        round.finding = Finding::Named;
        round.company = None;
        Ok(Advance { choice, round })
    }

    /// The end of a walk without the effects whose size these data do not tell from zero beside the others, or with a simpler
    /// kind in their place, where data never fitted are explained nearly as well: along stretches of another length, or with
    /// fewer effects in place, they spoke for it. So does a simpler kind with which they are explained better. None if all
    /// stay.
    fn without_needless(&self, steps: &mut Vec<Advance>, cancel: &Cancel) -> Result<Option<Arc<Stage>>, GapError> {
        let mut left = None;
        'again: loop {
            let list = choices(steps);
            let whole = self.fitted(&list, cancel)?;
            let inflation = self.inflation(&whole);
            for (index, form) in whole.composition.forms.iter().enumerate().rev() {
                let undetermined = is_undetermined(form, &whole, inflation);
                if !undetermined && form.contains.is_empty() {
                    continue;
                }
                let gone = choice(form);
                let share = if undetermined { NEEDLESS } else { 1.0 };
                let needless = |f: &Fitted| f.held_out_error() < share * whole.held_out_error();
                let Some(without) = self.without(&whole, index, cancel) else { continue };
                let lighter = if undetermined && needless(&without) {
                    steps.retain(|s| s.choice != gone);
                    Some(without)
                } else {
                    let simpler = self.with_simpler(&whole, index, &without, cancel).filter(|(_, f)| needless(f));
                    simpler.and_then(|(simpler, fitted)| {
                        let place = steps.iter().position(|s| s.choice == gone)?;
                        let step = steps[place].clone().with_first(simpler)?;
                        // What a composition adds last it has last.
                        steps.remove(place);
                        steps.push(step);
                        Some(fitted)
                    })
                };
                if let Some(lighter) = lighter {
                    let lighter = Arc::new(lighter);
                    left = Some(Arc::new(self.show(&lighter)));
                    self.keep(lighter);
                    continue 'again;
                }
            }
            return Ok(left);
        }
    }

    /// The end of a walk without the effects whose size the data do not tell from zero beside the others, though data never
    /// fitted are explained worse without them: what they stand for is left unexplained. None if all stay.
    fn without_undetermined(&self, steps: &mut Vec<Advance>, cancel: &Cancel) -> Result<Option<Arc<Stage>>, GapError> {
        let mut left = None;
        loop {
            let whole = self.fitted(&choices(steps), cancel)?;
            // Rivals that the data cannot tell from an effect are told of with it.
            let alone = |k: &usize| {
                let choice = choice(&whole.composition.forms[*k]);
                steps.iter().any(|s| s.choice == choice && s.alone())
            };
            let Some(index) = self.undetermined(&whole).rfind(alone) else { break };
            let gone = choice(&whole.composition.forms[index]);
            let Some(leaner) = self.leaner(&whole, index, cancel)? else { break };
            steps.retain(|s| s.choice != gone);
            left = Some(Arc::new(self.show(&leaner)));
            self.keep(leaner);
        }
        Ok(left)
    }

    /// Which effects of a fit have a size that it does not tell from zero.
    fn undetermined<'f>(&self, fitted: &'f Fitted) -> impl DoubleEndedIterator<Item = usize> + use<'f> {
        let inflation = self.inflation(fitted);
        let forms = fitted.composition.forms.iter().enumerate();
        forms.filter(move |(_, form)| is_undetermined(form, fitted, inflation)).map(|(k, _)| k)
    }

    /// A model with the best simpler kind in the place of one of its effects, and that kind; `without` is it without either.
    /// None if there is none whose size the data tell.
    fn with_simpler(
        &self,
        whole: &Fitted,
        index: usize,
        without: &Fitted,
        cancel: &Cancel,
    ) -> Option<(Choice, Fitted)> {
        let rich = &whole.composition.forms[index];
        let motion = self.data.motion(without)?;
        let inflation = self.inflation(whole);
        let kinds = self.forms(without, &motion).into_iter();
        let kinds = kinds.filter(|kind| rich.is_richer_kind_of(kind) && kind.can_be_looked_for());
        let fits = kinds.filter_map(|kind| {
            let composition = self.with(&without.composition, &kind);
            let fitted = self.simplified(composition, whole, &kind, cancel)?;
            (!is_undetermined(&kind, &fitted, inflation)).then(|| (choice(&kind), fitted))
        });
        fits.min_by(|a, b| a.1.held_out_error().total_cmp(&b.1.held_out_error()))
    }

    /// A stage without what its last effect has made superfluous, and the steps that stay.
    fn lighter(&self, steps: &mut Vec<Advance>, stage: Arc<Stage>, cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let kept = self.dropped(stage, cancel)?;
        steps.retain(|s| kept.effects.iter().any(|e| e.choice == s.choice));
        Ok(kept)
    }

    /// A stage without what the last effect has made superfluous: an earlier one, or a damper of the base model with
    /// which data never fitted are explained clearly worse than without.
    fn dropped(&self, stage: Arc<Stage>, cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let whole = self.fit_of(&stage, cancel)?;
        let inflation = self.inflation(&whole);
        for index in 0..stage.effects.len().saturating_sub(1) {
            let Some(without) = self.without(&whole, index, cancel) else { continue };
            let gone = if whole.held_out_error() > FAR * self.data.noise {
                without.held_out_error() < NEEDLESS * whole.held_out_error()
            } else {
                score(&whole, &without, inflation, 0.0).total <= 0.0
            };
            if gone {
                let without = Arc::new(without);
                self.keep(Arc::clone(&without));
                return Ok(Arc::new(self.show(&without)));
            }
        }
        Ok(stage)
    }

    /// How far a model predicts that does not follow whole records, in a sentence.
    fn horizon(&self, fitted: &Fitted) -> Option<String> {
        let longest = fitted.runs.iter().map(|r| r.range.len() as f64 * r.grid.interval()).fold(0.0, f64::max);
        (fitted.level != WHOLE).then(|| {
            format!(
                "Errors are those of stretches of {} s, each begun anew: over longer ones noise and the model's own sensitivity \
                 part the simulation from the measurement.",
                significant(longest, 3)
            )
        })
    }

    /// The effects in joints whose two forces stand in another ratio than the springs of those joints.
    pub(super) fn contradictions<'f>(&self, fitted: &'f Fitted) -> Vec<&'f Form> {
        let pairs = fitted.composition.reciprocity(&fitted.parameters).into_iter();
        let mut contradicted: Vec<usize> =
            pairs.filter(|(_, deviations)| deviations.abs() > CONTRADICTED).map(|(k, _)| k).collect();
        contradicted.dedup();
        contradicted.into_iter().map(|k| &fitted.composition.forms[k]).collect()
    }

    /// What is to be said of a stage: dampers of the base model held at zero, forces between masses that contradict the springs,
    /// and how far it predicts.
    fn said_of(&self, stage: &Stage) -> Vec<String> {
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
        .chain(self.horizon(fitted))
        .collect()
    }

    /// What a stage leaves, no effect being tried.
    fn left(&self, stage: &Stage, cancel: &Cancel) -> Result<Remaining, GapError> {
        let fitted = self.fit_of(stage, cancel)?;
        let motion = self.data.motion(&fitted).ok_or_else(|| GapError::Stage(titles(&stage.choices())))?;
        let forms = self.forms(&fitted, &motion);
        let screened = self.data.screen(&fitted, &motion, &forms, cancel);
        let seen = Examined { fitted: &fitted, motion: &motion, forms: &forms, screened: &screened };
        let evidence = self.data.evidence(&seen, cancel).ok_or(GapError::Cancelled)?;
        Ok(remaining(&evidence, &self.data.detectable(&seen, cancel)))
    }

    /// The stage after the last of these steps was taken from another; one whose effect was only found in company is fitted by
    /// itself first.
    fn after(&self, before: &Stage, steps: &[Advance], cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let last = steps.last().ok_or(GapError::Base)?;
        match last.stage() {
            Some(stage) => Ok(stage),
            None => self.stage(&[before.choices(), vec![last.choice.clone()]].concat(), cancel),
        }
    }

    /// Looks again at each effect in the company of the others: with the others in place another may do better, or rivals
    /// may have fallen away. True if an effect was exchanged.
    fn reconsider(&self, steps: &mut [Advance], tell: Listener<'_>, cancel: &Cancel) -> Result<bool, GapError> {
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
                && let Ok(step) = Advance::of(looked)
            {
                exchanged |= step.choice != steps[index].choice;
                steps[index] = step;
            }
        }
        Ok(exchanged)
    }
}

/// The round at which a walk ends because its last step cannot be gone on with.
fn ended(last: Option<Advance>) -> Result<Round, GapError> {
    last.map(|step| Round { finding: Finding::Unexplained, ..step.round }).ok_or(GapError::Base)
}

/// The effects of steps.
fn choices(steps: &[Advance]) -> Vec<Choice> {
    steps.iter().map(|s| s.choice.clone()).collect()
}

/// An effect that was added, and the look that led to it.
#[derive(Clone)]
struct Advance {
    choice: Choice,
    round: Round,
}

impl Advance {
    /// The model with the effect added.
    fn stage(&self) -> Option<Arc<Stage>> {
        self.round.candidates.iter().find(|c| c.choice == self.choice)?.stage.clone()
    }

    /// The step that a round leads to; the round itself if it leads to none.
    fn of(round: Round) -> Result<Self, Box<Round>> {
        match (&round.finding, round.candidates.first()) {
            (Finding::Named | Finding::Ambiguous(_), Some(first)) => Ok(Self { choice: first.choice.clone(), round }),
            _ => Err(Box::new(round)),
        }
    }

    /// The step with another of its round's candidates; none if that was not among them.
    fn with_first(mut self, choice: Choice) -> Option<Self> {
        let place = self.round.candidates.iter().position(|c| c.choice == choice)?;
        let after = |k: usize| if k < place { k + 1 } else { k };
        if let Finding::Ambiguous(places) = &mut self.round.finding {
            places.retain(|k| *k != place);
            places.iter_mut().for_each(|k| *k = after(*k));
            if places.is_empty() {
                self.round.finding = Finding::Named;
            }
        }
        let candidate = self.round.candidates.remove(place);
        self.round.candidates.insert(0, candidate);
        self.choice = choice;
        Some(self)
    }

    fn alone(&self) -> bool {
        self.round.finding == Finding::Named
    }
}
