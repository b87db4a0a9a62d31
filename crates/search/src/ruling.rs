//! A walk by the one comparison: what is tried beside a model, what stands, and the steps to it.

use std::sync::Arc;

use super::effects::Form;
use super::error::GapError;
use super::fit::Fitted;
use super::judge::{Hypothesis, Ruling, lead};
use super::outcome::{Candidate, Choice, Diagnosis, Finding, Lead, Round, Stage, Standing, Verdict};
use super::ranking::Decision;
use super::rule::{MATTERS_NOISES, MATTERS_SHARE};
use super::screen::Motion;
use super::search::{Depth, Listener, Search};
use super::structure::choice;
use super::words::{led, remaining, sentence, why};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::study::Cancel;

/// What a look tried.
#[derive(Clone)]
pub(super) struct Tried {
    pub(super) forms: Vec<Form>,
    pub(super) sets: Vec<Hypothesis>,
    pub(super) ruling: Ruling,
}

impl Tried {
    fn choices(&self, set: &Hypothesis) -> Vec<Choice> {
        set.forms.iter().map(|k| choice(&self.forms[*k])).collect()
    }

    fn winner(&self) -> Option<&Hypothesis> {
        self.ruling.winner.map(|k| &self.sets[k])
    }

    /// The winner against the best set that lacks an effect.
    fn lead_of(&self, effect: &Choice) -> Option<Lead> {
        let winner = self.winner()?;
        let without = self.sets.iter().filter(|s| s.unborne.is_none() && !self.choices(s).contains(effect));
        let nearest = without.max_by(|a, b| a.sum().total_cmp(&b.sum()))?;
        let names: Vec<String> = self.choices(nearest).into_iter().map(|c| c.effect).collect();
        let against = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        Some(lead(&winner.blocks, &nearest.blocks, &against))
    }
}

impl Search {
    /// Orders a round's candidates by what was tried and says what it comes to.
    pub(super) fn ruled(
        &self,
        before: &Arc<Fitted>,
        motion: &Motion,
        tried: &Tried,
        candidates: &mut [Candidate],
        cancel: &Cancel,
    ) -> Decision {
        let none = &tried.sets[0];
        for set in tried.sets.iter().filter(|s| s.forms.len() == 1) {
            self.tell(candidates, &tried.forms[set.forms[0]], set, (before, none), motion);
        }
        let Some(winner) = tried.winner() else {
            candidates.sort_by_key(|c| std::cmp::Reverse(c.stage.is_some()));
            return Decision { finding: Finding::Unexplained, next_experiment: None, company: None };
        };
        let rivals: Vec<&Hypothesis> = tried.ruling.rivals.iter().map(|k| &tried.sets[*k]).collect();
        let mut own = tried.choices(winner);
        let share = |c: &Choice| {
            let form = tried.forms.iter().find(|f| choice(f) == *c);
            form.map_or(0.0, |form| self.share(form, &winner.fitted))
        };
        own.sort_by(|a, b| share(b).total_cmp(&share(a)));
        let alone = |c: &Choice| tried.sets.iter().find(|s| tried.choices(s) == [c.clone()]);
        let stands_alone =
            alone(&own[0]).is_some_and(|s| s.unborne.is_none() && lead(&s.blocks, &none.blocks, "").difference > 0.0);
        let company = own.get(1).cloned().filter(|_| !stands_alone);
        let sum = |c: &Candidate| {
            let of = tried.sets.iter().filter(|s| tried.choices(s).contains(&c.choice));
            of.map(Hypothesis::sum).fold(f64::NEG_INFINITY, f64::max)
        };
        let place = |c: &Candidate| own.iter().position(|o| *o == c.choice).unwrap_or(usize::MAX);
        candidates.sort_by(|a, b| {
            place(a)
                .cmp(&place(b))
                .then_with(|| b.stage.is_some().cmp(&a.stage.is_some()))
                .then_with(|| sum(b).total_cmp(&sum(a)))
                .then_with(|| b.explained.total_cmp(&a.explained))
        });
        let places = self.rival_places(tried, &rivals, &own, candidates);
        let mut next_experiment = None;
        if let Some(rival) = rivals.first().filter(|_| !places.is_empty()) {
            next_experiment = self.data.next_experiment(&winner.fitted, &rival.fitted, cancel);
            let separates = rival.forms.iter().find(|k| !winner.forms.contains(k)).map(|k| tried.forms[*k].separates);
            next_experiment = next_experiment.or(separates.map(|s| format!("What tells them apart: {s}.")));
        }
        let finding = if places.is_empty() { Finding::Named } else { Finding::Ambiguous(places) };
        Decision { finding, next_experiment, company }
    }

    /// Where the effects of rivals that the winner lacks stand among candidates.
    fn rival_places(
        &self,
        tried: &Tried,
        rivals: &[&Hypothesis],
        own: &[Choice],
        candidates: &[Candidate],
    ) -> Vec<usize> {
        let mut places: Vec<usize> = Vec::new();
        for effect in rivals.iter().flat_map(|r| tried.choices(r)).filter(|c| !own.contains(c)) {
            if let Some(place) = candidates.iter().position(|c| c.choice == effect)
                && !places.contains(&place)
            {
                places.push(place);
            }
        }
        places
    }

    /// Tells a candidate what its fit came to.
    fn tell(
        &self,
        candidates: &mut [Candidate],
        form: &Form,
        set: &Hypothesis,
        (before, none): (&Arc<Fitted>, &Hypothesis),
        motion: &Motion,
    ) {
        let Some(candidate) = candidates.iter_mut().find(|c| c.choice == choice(form)) else { return };
        let beside = lead(&set.blocks, &none.blocks, "none");
        let refused = set.unborne.clone().or_else(|| {
            (beside.difference <= 0.0).then(|| "data never fitted are predicted no better with it".to_owned())
        });
        candidate.delta_bic = -2.0 * beside.difference;
        candidate.why = why(form, before, &set.fitted, refused.as_deref(), &self.data.shown_unit);
        candidate.curve = self.curve(form, (before, &set.fitted), motion);
        candidate.stage = Some(Arc::new(self.show(&set.fitted)));
        candidate.standing = refused.map_or(Standing::Refitted, Standing::Refused);
    }

    /// The walk to the set that stands, an effect a step.
    pub(super) fn walked(&self, tell: Listener<'_>, cancel: &Cancel) -> Result<Diagnosis, GapError> {
        let started = Stopwatch::start();
        let base = self.base(cancel)?;
        let mut stage = Arc::clone(&base);
        let mut passes: Vec<(Round, Tried)> = Vec::new();
        let mut last = loop {
            // What does not matter any more is not named.
            let goes_on = passes.is_empty() || self.matters(&base, &*self.fit_of(&stage, cancel)?, cancel);
            let full = stage.effects.len() >= self.ask.max_effects;
            let depth = if goes_on && !full { Depth::Refitted } else { Depth::Screened };
            let (round, tried) = self.looked(&stage, depth, tell, cancel)?;
            let Some(tried) = tried.filter(|t| t.ruling.winner.is_some()) else { break round };
            if let Some(winner) = tried.winner() {
                stage = Arc::new(self.show(&winner.fitted));
            }
            passes.push((round, tried));
        };
        let reached = |stage: &Stage, last: &Round| -> Result<bool, GapError> {
            let fitted = self.fit_of(stage, cancel)?;
            let told_from_noise = last.evidence.significant && self.matters(&base, &fitted, cancel);
            Ok(self.contradictions(&fitted).is_empty() && !told_from_noise)
        };
        let mut explained = reached(&stage, &last)?;
        // Beside an effect that does not close the gap, another one that does not either is a guess.
        let first = passes.first().filter(|_| !explained && passes.len() > 1).and_then(|(_, tried)| tried.winner());
        if let Some(stage) = first.map(|winner| self.show(&winner.fitted)) {
            passes.truncate(1);
            last = self.look_into(&stage, Depth::Screened, tell, cancel)?;
            explained = reached(&stage, &last)?;
        }
        let ambiguous = passes.iter().any(|(_, t)| !t.ruling.rivals.is_empty());
        let (mut rounds, stages) = self.steps(&base, &passes, tell, cancel)?;
        let verdict = match (passes.is_empty(), ambiguous, explained) {
            (true, _, true) => Verdict::NothingMissing,
            (false, true, _) => Verdict::Ambiguous,
            (false, false, true) => Verdict::Named,
            _ => Verdict::Unexplained,
        };
        rounds.push(last);
        let left = rounds.last().map(|round| remaining(&round.evidence, &round.hidden_up_to)).unwrap_or_default();
        let sentence = sentence((verdict, left.significant), &stages, &rounds, &self.data.shown_unit);
        let mut diagnosis = self.diagnosis((verdict, sentence), rounds, stages, left, (started, cancel));
        diagnosis.explained = explained;
        Ok(diagnosis)
    }

    /// True if what a model leaves matters: more noises than may be, or a share of what was found.
    fn matters(&self, base: &Stage, fitted: &Fitted, cancel: &Cancel) -> bool {
        let noise = self.data.noise.hypot(self.data.between_samples(fitted, cancel));
        let square = |e: f64| (e * e - noise * noise).max(0.0);
        let left = fitted.error();
        let found = (square(base.fit.0.as_ref().map_or(left, |f| f.error())) - square(left)).max(0.0);
        left > MATTERS_NOISES * noise || square(left) > MATTERS_SHARE * MATTERS_SHARE * found && found > 0.0
    }

    /// The stages from the base to the last model, and the look that leads from each to the next: the effect without which the
    /// model is worst comes first, what rivals dispute last.
    fn steps(
        &self,
        base: &Arc<Stage>,
        passes: &[(Round, Tried)],
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<(Vec<Round>, Vec<Arc<Stage>>), GapError> {
        let (mut rounds, mut stages) = (Vec::new(), vec![Arc::clone(base)]);
        let mut before: Vec<Choice> = Vec::new();
        for (round, tried) in passes {
            let Some(winner) = tried.winner() else { continue };
            let rivals: Vec<&Hypothesis> = tried.ruling.rivals.iter().map(|k| &tried.sets[*k]).collect();
            let mut left = tried.choices(winner);
            let disputed = |c: &Choice| rivals.iter().any(|r| !tried.choices(r).contains(c));
            let mut order = Vec::new();
            while !left.is_empty() {
                // The last step is the one that is missed least, of those that rivals dispute if there are any.
                let open: Vec<&Choice> = left.iter().filter(|c| disputed(c)).collect();
                let among: Vec<Choice> =
                    if open.is_empty() { left.clone() } else { open.into_iter().cloned().collect() };
                let without = |c: &Choice| -> f64 {
                    let rest: Vec<Choice> = left.iter().filter(|l| *l != c).cloned().collect();
                    let known = self.known(&[&before[..], &rest].concat());
                    known.map_or(f64::INFINITY, |f| f.held_out_error())
                };
                let last = if among.len() == 1 {
                    among[0].clone()
                } else {
                    among
                        .iter()
                        .min_by(|a, b| without(a).total_cmp(&without(b)))
                        .cloned()
                        .unwrap_or_else(|| left[0].clone())
                };
                left.retain(|c| *c != last);
                order.insert(0, last);
            }
            for (k, effect) in order.iter().enumerate() {
                let mut own = before.clone();
                own.push(effect.clone());
                let fitted = if k + 1 == order.len() { Arc::clone(&winner.fitted) } else { self.fitted(&own, cancel)? };
                let stage = Arc::new(self.show(&Arc::new(fitted.reordered(&own))));
                let previous = stages.last().map_or_else(|| Arc::clone(base), Arc::clone);
                let mut step =
                    if k == 0 { round.clone() } else { self.look_into(&previous, Depth::Screened, tell, cancel)? };
                self.lead_to(&mut step, effect, &stage, tried, k + 1 == order.len());
                rounds.push(step);
                stages.push(stage);
                before = own;
            }
        }
        Ok((rounds, stages))
    }

    /// Makes a look lead to an effect: the first of its candidates, with what stands against it behind.
    fn lead_to(&self, round: &mut Round, effect: &Choice, stage: &Arc<Stage>, tried: &Tried, is_last: bool) {
        let winner = tried.winner().map(|w| tried.choices(w)).unwrap_or_default();
        // Sets with another effect in this one's place.
        for set in &tried.sets {
            let own = tried.choices(set);
            let others: Vec<&Choice> = own.iter().filter(|c| !winner.contains(c)).collect();
            if let [other] = others.as_slice()
                && !own.contains(effect)
                && own.len() <= winner.len()
                && let Some(candidate) = round.candidates.iter_mut().find(|c| c.choice == **other && c.stage.is_none())
            {
                candidate.stage = Some(Arc::new(self.show(&set.fitted)));
                candidate.standing = set.unborne.clone().map_or(Standing::Refitted, Standing::Refused);
            }
        }
        let best = |c: &Candidate| {
            let of = tried.sets.iter().filter(|s| {
                let own = tried.choices(s);
                own.contains(&c.choice) && !own.contains(effect) && s.unborne.is_none()
            });
            of.map(Hypothesis::sum).fold(f64::NEG_INFINITY, f64::max)
        };
        round.candidates.sort_by(|a, b| {
            let first = |c: &Candidate| c.choice != *effect;
            first(a)
                .cmp(&first(b))
                .then_with(|| b.stage.is_some().cmp(&a.stage.is_some()))
                .then_with(|| best(b).total_cmp(&best(a)))
        });
        round.lead = tried.lead_of(effect);
        if let Some(candidate) = round.candidates.first_mut() {
            candidate.standing = Standing::Refitted;
            candidate.stage = Some(Arc::clone(stage));
            if let (Some(before), Some(after)) = (&round.before.fit.0, &stage.fit.0)
                && let Some(form) = after.composition.forms.iter().find(|f| choice(f) == *effect)
            {
                candidate.why = why(form, before, after, None, &self.data.shown_unit);
                candidate.why.extend(round.lead.as_ref().map(led));
            }
        }
        let rivals: Vec<&Hypothesis> = tried.ruling.rivals.iter().map(|k| &tried.sets[*k]).collect();
        let places = if is_last { self.rival_places(tried, &rivals, &winner, &round.candidates) } else { Vec::new() };
        if !is_last {
            round.next_experiment = None;
        }
        round.company = None;
        round.finding = if places.is_empty() { Finding::Named } else { Finding::Ambiguous(places) };
    }
}
