//! A walk by the one comparison: what is tried beside a model, what stands, and the steps to it.

use std::sync::Arc;

use super::colour::ColouredNoise;
use super::constants::Constants;
use super::effects::Form;
use super::error::GapError;
use super::experiment::NextExperiment;
use super::fit::{Fitted, WHOLE};
use super::judge::{Hypothesis, Ruling};
use super::outcome::{Candidate, Choice, Diagnosis, Finding, Lead, Round, Stage, Standing, Verdict};
use super::screen::Motion;
use super::search::{Depth, Keep, Listener, Search};
use super::structure::{Composition, choice};
use super::words::{Doubt, led, remaining, sentence, why};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::refine::Refined;
use sindyscope_core::study::Cancel;

/// What a look comes to.
pub(super) struct Decision {
    pub(super) finding: Finding,
    pub(super) next_experiment: Option<NextExperiment>,
    pub(super) lead: Option<Lead>,
}

impl Decision {
    /// A look that leads to no effect.
    pub(super) fn without_effect(finding: Finding) -> Self {
        Self { finding, next_experiment: None, lead: None }
    }
}

/// Sets of effects that were tried, and what the comparison says of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Tried {
    pub(super) forms: Vec<Form>,
    pub(super) sets: Vec<Hypothesis>,
    pub(super) ruling: Ruling,
    /// What the sets tell of the noise.
    pub(super) coloured: ColouredNoise,
    /// Sets that were fitted once more, each with the fit that this was begun from.
    pub(super) settled: Vec<(Vec<usize>, Arc<Refined>)>,
}

impl Tried {
    /// Takes forms into the list; one that was there before is as it is now.
    pub(super) fn know<'f>(&mut self, forms: impl Iterator<Item = &'f Form>) {
        for form in forms {
            match self.forms.iter_mut().find(|f| choice(f) == choice(form)) {
                Some(known) => known.clone_from(form),
                None => self.forms.push(form.clone()),
            }
        }
    }

    /// A composition's effects, sorted.
    pub(super) fn indices(&self, composition: &Composition) -> Vec<usize> {
        let place = |form: &Form| self.forms.iter().position(|f| choice(f) == choice(form));
        let mut set: Vec<usize> = composition.forms.iter().filter_map(place).collect();
        set.sort_unstable();
        set
    }

    /// The winner's effects of which some rival has none alike.
    pub(super) fn disputed(&self, alike: impl Fn(&Choice, &Choice) -> bool) -> Vec<Choice> {
        let rivals: Vec<Vec<Choice>> = self.ruling.rivals.iter().map(|k| self.choices(&self.sets[*k])).collect();
        let own = self.winner().map(|winner| self.choices(winner)).unwrap_or_default();
        own.into_iter().filter(|c| rivals.iter().any(|rival| !rival.iter().any(|r| alike(r, c)))).collect()
    }

    /// Where a set stands among those tried.
    pub(super) fn place(&self, set: &[usize]) -> Option<usize> {
        self.sets.iter().position(|s| s.forms == set)
    }

    /// The sets, best first.
    pub(super) fn best(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.sets.len()).collect();
        order.sort_by(|a, b| self.sets[*b].sum().total_cmp(&self.sets[*a].sum()));
        order
    }

    /// Every set that another contains: with fewer effects, or with a simpler kind in the place of one.
    pub(super) fn parts_of(&self, set: &[usize]) -> Vec<Vec<usize>> {
        let mut parts: Vec<Vec<usize>> = (1..(1_u32 << set.len()) - 1)
            .map(|bits| set.iter().enumerate().filter(|(k, _)| bits >> k & 1 == 1).map(|(_, form)| *form).collect())
            .collect();
        for (place, form) in set.iter().enumerate() {
            for simpler in (0..self.forms.len()).filter(|k| self.forms[*form].includes(&self.forms[*k])) {
                let mut part = set.to_vec();
                part[place] = simpler;
                part.sort_unstable();
                part.dedup();
                parts.push(part);
            }
        }
        parts
    }

    pub(super) fn choices(&self, set: &Hypothesis) -> Vec<Choice> {
        set.forms.iter().map(|k| choice(&self.forms[*k])).collect()
    }

    pub(super) fn winner(&self) -> Option<&Hypothesis> {
        self.ruling.winner.map(|k| &self.sets[k])
    }

    /// The best set that the data bear of those picked.
    pub(super) fn nearest(&self, picked: impl Fn(&Hypothesis) -> bool) -> Option<usize> {
        let sound = |k: &usize| self.sets[*k].unborne.is_none() && picked(&self.sets[*k]);
        self.best().into_iter().find(sound)
    }

    /// The best set that lacks an effect.
    fn nearest_without(&self, effect: &Choice) -> Option<usize> {
        self.nearest(|set| !self.choices(set).contains(effect))
    }

    /// The sets that the ruling is told by: the winner, its rivals, and what each of its effects leads.
    pub(super) fn told(&self) -> Vec<usize> {
        let Ruling { winner, rivals, .. } = &self.ruling;
        let own = self.winner().map(|winner| self.choices(winner)).unwrap_or_default();
        let led = own.iter().filter_map(|effect| self.nearest_without(effect));
        winner.iter().chain(rivals).copied().chain(led).collect()
    }

    /// The sets with one effect more than those present.
    pub(super) fn beside(&self, present: &[usize]) -> Vec<usize> {
        let more =
            |set: &Hypothesis| set.forms.len() == present.len() + 1 && present.iter().all(|k| set.forms.contains(k));
        (0..self.sets.len()).filter(|k| more(&self.sets[*k])).collect()
    }

    /// The sets with another effect in the place of one of the winner's.
    fn exchanged(&self) -> Vec<usize> {
        let winner = self.winner().map(|winner| winner.forms.as_slice()).unwrap_or_default();
        let other = |set: &Hypothesis| {
            set.forms.len() <= winner.len() && set.forms.iter().filter(|k| !winner.contains(k)).count() == 1
        };
        (0..self.sets.len()).filter(|k| other(&self.sets[*k])).collect()
    }

    /// The winner against the best set that lacks an effect.
    fn lead_of(&self, effect: &Choice, constants: &Constants) -> Option<Lead> {
        let winner = self.winner()?;
        let nearest = &self.sets[self.nearest_without(effect)?];
        let names: Vec<String> = self.choices(nearest).into_iter().map(|c| c.effect).collect();
        let against = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let titles = nearest.forms.iter().map(|k| self.forms[*k].full_title()).collect();
        let lead = constants.compared(&winner.blocks, &nearest.blocks, &against);
        let open = self.ruling.settles.filter(|least| !lead.is_more_than(*least));
        let fitted = open.and_then(|least| constants.settled(winner, nearest, least));
        Some(Lead { titles, fitted, ..lead })
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
        let present = tried.indices(&before.composition);
        if let Some(none) = tried.place(&present).map(|k| &tried.sets[k]) {
            for set in tried.beside(&present).into_iter().map(|k| &tried.sets[k]) {
                for new in set.forms.iter().filter(|k| !present.contains(k)) {
                    self.tell(candidates, &tried.forms[*new], set, (before, none), motion);
                }
            }
        }
        let Some(winner) = tried.winner() else {
            candidates.sort_by_key(|c| std::cmp::Reverse(c.stage.is_some()));
            return Decision::without_effect(Finding::Unexplained);
        };
        let rivals: Vec<&Hypothesis> = tried.ruling.rivals.iter().map(|k| &tried.sets[*k]).collect();
        let mut own = tried.choices(winner);
        own.retain(|c| !before.composition.choices().contains(c));
        let share = |c: &Choice| {
            let form = tried.forms.iter().find(|f| choice(f) == *c);
            form.map_or(0.0, |form| self.share(form, &winner.fitted))
        };
        own.sort_by(|a, b| share(b).total_cmp(&share(a)));
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
            next_experiment = next_experiment.or_else(|| {
                separates.map(|s| NextExperiment { text: format!("What tells them apart: {s}."), test: None })
            });
        }
        let finding = if places.is_empty() { Finding::Named } else { Finding::Ambiguous(places) };
        Decision {
            finding,
            next_experiment,
            lead: own.first().and_then(|effect| tried.lead_of(effect, &self.data.constants)),
        }
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
        let beside = self.data.constants.compared(&set.blocks, &none.blocks, "none");
        let refused = set.unborne.clone().or_else(|| {
            (beside.difference <= 0.0).then(|| "data never fitted are predicted no better with it".to_owned())
        });
        candidate.delta_bic = -2.0 * beside.difference;
        candidate.why = why(form, before, &set.fitted, refused.as_deref(), &self.data.shown_unit);
        candidate.curve = self.curve(form, (before, &set.fitted), motion);
        candidate.stage = Some(Arc::new(self.show(&set.fitted)));
        candidate.standing = refused.map_or(Standing::Refitted, Standing::Refused);
    }

    /// Walks to the set that stands, an effect a step, until nothing more can be named or the most effects are added.
    ///
    /// # Errors
    /// The base cannot be fitted; cancelled.
    pub fn diagnose(&self, tell: Listener<'_>, cancel: &Cancel) -> Result<Diagnosis, GapError> {
        let started = Stopwatch::start();
        let before = self.effort().steps;
        let base = self.base(cancel)?;
        let bare = self.fit_of(&base, cancel)?;
        let mut stage = Arc::clone(&base);
        let mut tried = Tried::default();
        let mut looks: Vec<(Vec<Choice>, Round)> = Vec::new();
        let mut first: Option<Tried> = None;
        let mut last = loop {
            // What is left and does not matter is given no name.
            let fitted = self.fit_of(&stage, cancel)?;
            let done = !stage.effects.is_empty() && !self.matters(&bare, &fitted, cancel);
            let spent = self.effort().steps - before;
            let room = stage.effects.len() < self.ask.max_effects && spent < self.data.constants.effort_of_looks();
            let depth = if room && !done { Depth::Refitted } else { Depth::Screened };
            let round = self.look_into(&stage, depth, Keep::Any(&mut tried), tell, cancel)?;
            let now = sorted(stage.choices());
            let Some(winner) = tried.winner() else { break round };
            let same = sorted(tried.choices(winner)) == now;
            // Beside others it may have been fitted better than when it was named.
            let better = same && winner.fitted.refined.rss < fitted.refined.rss;
            if !better && (same || looks.iter().any(|(seen, _)| *seen == now)) {
                break round;
            }
            stage = Arc::new(self.show(&winner.fitted));
            if !same {
                looks.push((now, round));
                first.get_or_insert_with(|| tried.clone());
            }
        };
        let doubt_of = |stage: &Stage, last: &Round| -> Result<Option<Doubt>, GapError> {
            let fitted = self.fit_of(stage, cancel)?;
            Ok(self.doubt(&fitted, last.evidence.significant && self.matters(&bare, &fitted, cancel), cancel))
        };
        let mut doubt = doubt_of(&stage, &last)?;
        let looked_at = |tried: &Tried| -> Result<_, GapError> {
            let stage = tried.winner().map_or_else(|| Arc::clone(&base), |winner| Arc::new(self.show(&winner.fitted)));
            let last = self.look_into(&stage, Depth::Screened, Keep::Present, tell, cancel)?;
            let doubt = doubt_of(&stage, &last)?;
            Ok((stage, last, doubt))
        };
        // Beside an effect that does not close the gap, another one that does not either is a guess.
        if let Some(once) = first.filter(|_| doubt.is_some() && looks.len() > 1) {
            tried = once;
            (stage, last, doubt) = looked_at(&tried)?;
        }
        if doubt == Some(Doubt::MoreIsLeft) && self.leave_guesses(&mut tried, cancel) {
            (stage, last, doubt) = looked_at(&tried)?;
        }
        let mut ambiguous = !tried.ruling.rivals.is_empty();
        let told = match self.steps(&base, (&mut tried, &looks), tell, cancel) {
            // Effects of which none can be fitted by itself cannot be told one after the other.
            Err(GapError::Stage(_)) => None,
            told => Some(told?).filter(|(_, stages)| stages.len() == 1 || helps(stages)),
        };
        let (mut rounds, stages) = match told {
            Some(told) => told,
            None => {
                last = self.look_into(&base, Depth::Screened, Keep::Present, tell, cancel)?;
                (doubt, ambiguous) = (Some(Doubt::MoreIsLeft), false);
                (Vec::new(), vec![Arc::clone(&base)])
            }
        };
        let room = self.ask.max_effects > 0;
        let shorter = match doubt.is_none() && !ambiguous && room {
            true => self.shorter_formula((&base, &stage), || Ok(tried.clone()), tell, cancel)?,
            false => None,
        };
        doubt = doubt.or(shorter.as_ref().map(|_| Doubt::ShorterFormula));
        let explained = doubt.is_none();
        let verdict = match (stages.len() == 1, ambiguous, explained) {
            (true, _, true) => Verdict::NothingMissing,
            (false, true, _) => Verdict::Ambiguous,
            (false, false, true) => Verdict::Named,
            _ => Verdict::Unexplained,
        };
        rounds.push(last);
        let left = rounds.last().map(|round| remaining(&round.evidence, &round.hidden_up_to)).unwrap_or_default();
        let sentence = sentence((verdict, doubt), &stages, &rounds, &self.data.shown_unit);
        // Beside curves of free shape, which may stand for the force that has no name, nothing is left to describe.
        let beside = if doubt == Some(Doubt::Curves) { &base } else { &stage };
        let description = match shorter {
            None if !explained && room => self.described(&base, beside, &mut tried, tell, cancel)?,
            shorter => shorter,
        };
        let mut diagnosis = self.diagnosis((verdict, sentence, doubt), rounds, stages, left, (started, cancel));
        diagnosis.explained = explained;
        diagnosis.description = description;
        Ok(diagnosis)
    }

    /// Takes the last effects off a winner that does not close the gap, as long as they are guesses: with them data never fitted are
    /// predicted no better, or rivals have others in their place and they leave more than they close. False if there are none.
    fn leave_guesses(&self, tried: &mut Tried, cancel: &Cancel) -> bool {
        let mut left_some = false;
        while let Some(winner) = tried.winner().filter(|winner| winner.forms.len() > 1) {
            let disputed = tried.disputed(|rival, own| rival == own);
            let Some(last) = self.order_of(tried, winner, cancel).pop() else { break };
            let mut rest = winner.forms.clone();
            rest.retain(|k| choice(&tried.forms[*k]) != last);
            let Some(without) = tried.place(&rest) else { break };
            let fewer = self.asked(&tried.sets[without].fitted, cancel);
            let noise = self.data.unseen_noise();
            let square = |fitted: &Fitted| (fitted.held_out_error().powi(2) - noise * noise).max(0.0);
            let (before, after) = (square(&fewer), square(&winner.fitted));
            let as_far = winner.fitted.level <= fewer.level;
            if !as_far || after < before && (!disputed.contains(&last) || 2.0 * after < before) {
                break;
            }
            tried.sets[without].fitted = fewer;
            let Tried { ruling, sets, .. } = &mut *tried;
            ruling.rivals.retain(|k| *k != without && !rest.iter().all(|form| sets[*k].forms.contains(form)));
            ruling.winner = Some(without);
            left_some = true;
        }
        left_some
    }

    /// True if what a model leaves matters: more noises than may be, or a share of what was found.
    pub(super) fn matters(&self, base: &Fitted, fitted: &Fitted, cancel: &Cancel) -> bool {
        self.matters_beyond(self.data.noise_of(fitted, cancel), base, fitted)
    }

    /// The same where noise is known.
    pub(super) fn matters_beyond(&self, noise: f64, base: &Fitted, fitted: &Fitted) -> bool {
        let square = |e: f64| (e * e - noise * noise).max(0.0);
        let left = fitted.error();
        let found = (square(base.error()) - square(left)).max(0.0);
        let noises = self.data.constants.matters_noises;
        let share = 0.5 * noises;
        left > (1.0 + noises) * noise || square(left) > share * share * found && found > 0.0
    }

    /// True if a model leaves nothing beside noise that matters, along whole records: along short stretches what matters may leave next
    /// to nothing.
    pub(super) fn suffices(&self, fitted: &Fitted, noise: impl FnOnce() -> f64) -> bool {
        fitted.level == WHOLE && self.known(&[]).is_some_and(|base| !self.matters_beyond(noise(), &base, fitted))
    }

    /// The stages from the base to the last model, and the look that leads from each to the next: the effect without which the
    /// model is worst comes first, what rivals dispute last.
    fn steps(
        &self,
        base: &Arc<Stage>,
        (tried, looks): (&mut Tried, &[(Vec<Choice>, Round)]),
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<(Vec<Round>, Vec<Arc<Stage>>), GapError> {
        let (mut rounds, mut stages) = (Vec::new(), vec![Arc::clone(base)]);
        let exchanged = tried.exchanged();
        self.ask(tried, exchanged.into_iter(), cancel);
        let tried = &*tried;
        let Some(winner) = tried.winner() else { return Ok((rounds, stages)) };
        let disputed = tried.disputed(|rival, own| rival == own);
        let order = self.passable(self.order_of(tried, winner, cancel), cancel)?;
        // Rivals are told where the last effect that they dispute is.
        let told = order.iter().rposition(|c| disputed.contains(c)).unwrap_or(order.len().saturating_sub(1));
        for k in 0..order.len() {
            let own = &order[..=k];
            let fitted = if own.len() == order.len() { Arc::clone(&winner.fitted) } else { self.fitted(own, cancel)? };
            let stage = Arc::new(self.show(&Arc::new(fitted.reordered(own))));
            let previous = stages.last().map_or_else(|| Arc::clone(base), Arc::clone);
            let before = sorted(order[..k].to_vec());
            let mut step = match looks.iter().find(|(seen, _)| *seen == before) {
                Some((_, look)) => look.clone(),
                None => self.look_into(&previous, Depth::Screened, Keep::Present, tell, cancel)?,
            };
            if k == told {
                self.know_rivals(&mut step, &rounds, tried);
            }
            self.lead_to(&mut step, &order[k], &stage, tried, k == told);
            rounds.push(step);
            stages.push(stage);
        }
        Ok((rounds, stages))
    }

    /// An order in which the first effects can be fitted without the others, as near to the one given as can be: one alone may
    /// let the response run away that another one bounds.
    fn passable(&self, mut order: Vec<Choice>, cancel: &Cancel) -> Result<Vec<Choice>, GapError> {
        for k in 0..order.len().saturating_sub(1) {
            let mut refused = None;
            let fits = (k..order.len()).find(|next| {
                let first: Vec<Choice> = order[..k].iter().chain([&order[*next]]).cloned().collect();
                self.fitted(&first, cancel).map_err(|error| refused.get_or_insert(error).clone()).is_ok()
            });
            let Some(next) = fits else { return Err(refused.unwrap_or(GapError::Cancelled)) };
            let moved = order.remove(next);
            order.insert(k, moved);
        }
        Ok(order)
    }

    /// The effects of a set, the one that is missed least last: of those that rivals dispute if there are any, but for those that are
    /// in doubt of their place alone. Where nothing explains the data, what is met most often comes first of those that are disputed.
    fn order_of(&self, tried: &Tried, set: &Hypothesis, cancel: &Cancel) -> Vec<Choice> {
        let in_doubt = tried.disputed(|rival, own| rival.effect == own.effect);
        let wrong = !self.explains(&set.fitted, tried.coloured.rms, cancel);
        let uncommon = |c: &Choice| tried.forms.iter().any(|form| choice(form) == *c && !form.is_common());
        let mut left = tried.choices(set);
        let mut order = Vec::new();
        while !left.is_empty() {
            let disputed: Vec<Choice> = left.iter().filter(|c| in_doubt.contains(c)).cloned().collect();
            let guessed: Vec<Choice> = disputed.iter().filter(|c| wrong && uncommon(c)).cloned().collect();
            let among = [guessed, disputed].into_iter().find(|some| !some.is_empty()).unwrap_or_else(|| left.clone());
            let without = |c: &Choice| -> f64 {
                let rest: Vec<Choice> = left.iter().filter(|l| *l != c).cloned().collect();
                self.known(&rest).map_or(f64::INFINITY, |f| self.asked(&f, cancel).held_out_error())
            };
            let Some(last) = among.into_iter().min_by(|a, b| without(a).total_cmp(&without(b))) else { break };
            left.retain(|c| *c != last);
            order.insert(0, last);
        }
        order
    }

    /// Adds what the winner's rivals have and the look does not look for, such as a spring of another shape beside the one that is
    /// there: as an earlier look has it, with the model of the rival.
    fn know_rivals(&self, round: &mut Round, earlier: &[Round], tried: &Tried) {
        let own = tried.winner().map(|winner| tried.choices(winner)).unwrap_or_default();
        for rival in tried.ruling.rivals.iter().map(|k| &tried.sets[*k]) {
            for effect in tried.choices(rival).into_iter().filter(|effect| !own.contains(effect)) {
                if round.candidates.iter().any(|c| c.choice == effect) {
                    continue;
                }
                let known = earlier.iter().flat_map(|look| &look.candidates).find(|c| c.choice == effect);
                let stage = Some(Arc::new(self.show(&rival.fitted)));
                round.candidates.extend(known.map(|c| Candidate { stage, standing: Standing::Refitted, ..c.clone() }));
            }
        }
    }

    /// Makes a look lead to an effect: the first of its candidates, with what stands against it behind.
    fn lead_to(&self, round: &mut Round, effect: &Choice, stage: &Arc<Stage>, tried: &Tried, tells: bool) {
        let winner = tried.winner().map(|w| tried.choices(w)).unwrap_or_default();
        // Sets with another effect in this one's place.
        for set in tried.exchanged().into_iter().map(|k| &tried.sets[k]) {
            let own = tried.choices(set);
            if !own.contains(effect)
                && let Some(other) = own.iter().find(|c| !winner.contains(c))
                && let Some(candidate) = round.candidates.iter_mut().find(|c| c.choice == *other && c.stage.is_none())
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
        round.lead = tried.lead_of(effect, &self.data.constants);
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
        let places = if tells { self.rival_places(tried, &rivals, &winner, &round.candidates) } else { Vec::new() };
        if !tells {
            round.next_experiment = None;
        }
        round.finding = if places.is_empty() { Finding::Named } else { Finding::Ambiguous(places) };
    }
}

/// True if the last model follows the data over longer stretches than the first, or errs less on data never fitted: errors along
/// stretches of other lengths cannot be compared.
fn helps(stages: &[Arc<Stage>]) -> bool {
    let fit = |stage: Option<&Arc<Stage>>| stage.and_then(|s| s.fit.0.clone());
    let (first, last) = (fit(stages.first()), fit(stages.last()));
    first.zip(last).is_some_and(|(a, b)| b.level > a.level || b.held_out_error() < a.held_out_error())
}

/// Effects in an order that does not hang on when they were found.
fn sorted(mut choices: Vec<Choice>) -> Vec<Choice> {
    choices.sort();
    choices
}
