//! From proposals to fits to a ruling: what a look at a model tries beside it.

use std::sync::Arc;

use super::colour::ColouredNoise;
use super::effects::{DESCRIPTION, Form, follow_any_curve};
use super::error::GapError;
use super::fit::{Fitted, WHOLE};
use super::judge::{Hypothesis, contains, parts};
use super::outcome::{Choice, ProposedSet, Stage};
use super::parameters::{InnerValues, Parameters};
use super::progress::Progress;
use super::propose::{PresentModel, Proposal};
use super::ruling::Tried;
use super::screen::{Hit, Screened};
use super::search::{Listener, Search};
use super::structure::{Composition, choice};
use super::words::titles;
use sindyscope_core::parallel::join;
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::refine::{Bar, Landed};
use sindyscope_core::study::Cancel;

/// Proposals that are fitted at a time: so many for one core each.
const SIDE_BY_SIDE: usize = 2;

/// What the proposals that were fitted so far have come to.
#[derive(Default)]
struct Explained {
    /// The gain in the regression of a set that explains the data: others are fitted only near it, or to be shown.
    gain: Option<f64>,
    /// The effects of that set, if nothing that matters can be left beside it.
    enough: Option<Vec<usize>>,
    /// True if something that matters may be left beside it: rivals that are not common are fitted too.
    doubted: bool,
    /// Single effects that were fitted beside it: how many of them are common, and how many are not.
    shown: [usize; 2],
    /// What the sets tell of the noise.
    coloured: ColouredNoise,
}

impl Search {
    /// The model with exactly these effects, fitted.
    pub(super) fn fit_exactly(&self, choices: &[Choice], cancel: &Cancel) -> Result<Fitted, GapError> {
        let impossible = || GapError::Stage(titles(choices));
        let base = self.fitted(&[], cancel)?;
        let motion = self.motion(&base, choices, cancel)?;
        let all = self.forms(&base, &motion);
        let described = choices.iter().any(|c| c.effect == DESCRIPTION);
        let words = if described { self.words_of_formulas(&base, &motion) } else { Vec::new() };
        let of_choice = |c: &Choice| all.iter().chain(&words).find(|f| choice(f) == *c).cloned();
        let forms: Vec<Form> = choices.iter().filter_map(of_choice).collect();
        if forms.len() < choices.len() {
            return Err(impossible());
        }
        let set = PresentModel::new(&self.data, &base.composition, &base.parameters.inner, cancel)
            .exactly(&forms)
            .and_then(|start| self.fitted_set(start, Vec::new(), None, &|_| false, cancel))
            .ok_or_else(impossible)?;
        Ok(Fitted::clone(&set.fitted))
    }

    /// The number of effects that a set beside this model may hold.
    pub(super) fn room(&self, composition: &Composition) -> usize {
        self.ask.max_effects.saturating_sub(composition.forms.len()).max(1)
    }

    /// Sets of effects beside a fitted model in the order in which they are tried: what the regression says, what it cannot say, and
    /// what has no force of its own to be regressed on, which is tried where it explains some of what is left along the motion.
    fn proposals(&self, before: &Fitted, forms: &[Form], screened: &Screened, cancel: &Cancel) -> Vec<Proposal> {
        let (composition, inner) = (&before.composition, &before.parameters.inner);
        let room = self.room(composition);
        let model = PresentModel::new(&self.data, composition, inner, cancel);
        let mut proposals = model.propose(forms, self.data.constants.crumb);
        proposals.retain(|p| p.forms.len() <= room);
        proposals.extend(self.seen_along(&model, (forms, &screened.hits), &proposals));
        proposals.splice(0..0, self.holding(before, &model, forms));
        for hit in screened.hits.iter().filter(|hit| forms[hit.form].is_outside()) {
            let with = Self::with(composition, &forms[hit.form]);
            let all = with.inner_after(composition, inner, &hit.inner);
            let coefficients = before.parameters.coefficients.clone();
            let mut composition = with;
            composition.scales = self.data.scales(&composition, &all, &self.smoothed_paths());
            let shared = Parameters { coefficients, inner: all }.row();
            proposals.push(Proposal { forms: vec![hit.form], composition, shared, gain: f64::NEG_INFINITY });
        }
        proposals
    }

    /// The sets of effects that a look at a stage may try beside its model, in that order. The order says what is likely; only what they
    /// leave on data never fitted decides.
    ///
    /// # Errors
    /// A stage that cannot be simulated; cancelled.
    pub fn proposed(&self, stage: &Stage, cancel: &Cancel) -> Result<Vec<ProposedSet>, GapError> {
        let before = self.fit_of(stage, cancel)?;
        let motion = self.motion(&before, &stage.choices(), cancel)?;
        let forms = self.forms(&before, &motion);
        let screened = self.data.screen(&before, &motion, &forms, cancel);
        let proposals = self.proposals(&before, &forms, &screened, cancel);
        if cancel.is_cancelled() {
            return Err(GapError::Cancelled);
        }
        let set = |p: &Proposal| ProposedSet {
            effects: p.composition.forms.iter().map(|form| (choice(form), form.site)).collect(),
            always: p.gain.is_infinite(),
        };
        Ok(proposals.iter().map(set).collect())
    }

    /// Tries sets of effects beside a fitted model, each fitted to its end, and adds them to those tried before. False if
    /// cancelled.
    pub(super) fn try_beside(
        &self,
        before: &Arc<Fitted>,
        (forms, screened): (&[Form], &Screened),
        tried: &mut Tried,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> bool {
        let data = &self.data;
        let constants = &data.constants;
        let composition = &before.composition;
        let proposals = self.proposals(before, forms, screened, cancel);
        let likeliest = proposals.iter().map(|p| p.gain).filter(|g| g.is_finite()).fold(f64::NEG_INFINITY, f64::max);
        let single = |proposal: &Proposal| proposal.composition.forms.len() == composition.forms.len() + 1;
        let common = |proposal: &Proposal| proposal.forms.iter().all(|k| forms[*k].is_common());
        let kind = |proposal: &Proposal| usize::from(!common(proposal));
        tried.know(composition.forms.iter().chain(forms));
        if tried.place(&tried.indices(composition)).is_none() {
            tried.sets.push(self.hypothesis(tried.indices(composition), Fitted::clone(before), cancel));
        }
        let little = self.explaining_little(before, screened, cancel);
        let wanted = |state: &Explained, proposal: &Proposal, set: &[usize]| {
            // What would be left for a further effect is given no name.
            let more = |part: &Vec<usize>| part.len() < set.len() && part.iter().all(|k| set.contains(k));
            if state.enough.as_ref().is_some_and(more) {
                return false;
            }
            // Along the motion of a model that is far off the screen may miss what the regression sees well.
            let near = |gain: f64| proposal.gain >= (1.0 - constants.little_gain) * gain - constants.lead;
            let promising = match state.gain {
                Some(gain) if proposal.gain.is_finite() => near(gain),
                _ => proposal.gain.is_finite() && near(likeliest) || !little(proposal),
            };
            let asked = common(proposal) || state.doubted;
            let few = state.shown[kind(proposal)] < constants.shown;
            promising || single(proposal) && asked && few && proposal.gain > 0.0
        };
        let taken = |state: &mut Explained, proposal: &Proposal, set: Option<&Hypothesis>| {
            // What was tried because a mass rests is no rival that a person would think of.
            let rival = state.gain.is_some() || little(proposal);
            state.shown[kind(proposal)] += usize::from(single(proposal) && rival && proposal.gain.is_finite());
            let mut explains = |set: &Hypothesis| {
                if set.unborne.is_some() {
                    return false;
                }
                if data.is_within(&set.fitted, constants.explaining(), cancel) {
                    return true;
                }
                let error = set.fitted.error();
                state.coloured.ask(error, || self.noise_left(&set.fitted, forms, cancel));
                error <= state.coloured.rms
            };
            let explained = state.gain.is_none() && set.is_some_and(&mut explains);
            // What was not regressed on stands with what the regression has first.
            state.gain = state.gain.or(explained.then_some(proposal.gain.min(likeliest)));
            state.doubted |= explained && set.is_some_and(|set| !self.suffices(&set.fitted, || data.noise));
            // Some of what it leaves, no more than explains the data, may be no noise.
            let noise = |set: &Hypothesis| set.fitted.error() / constants.explaining().0;
            let enough = |set: &&Hypothesis| explained && self.suffices(&set.fitted, || noise(set));
            state.enough = set.filter(enough).map(|set| set.forms.clone()).or(state.enough.take());
        };
        let told = |share: f64| tell(Progress::Step("Fitting the likeliest sets of effects", 0.3 + 0.5 * share));
        let mut state = Explained { coloured: tried.coloured, ..Explained::default() };
        if !self.fit_in_turn(proposals, tried, &mut state, (wanted, taken, told), cancel) {
            return false;
        }
        tried.coloured = state.coloured;
        tell(Progress::Step("Fitting what the best sets contain", 0.8));
        self.close(tried, &[], cancel);
        self.ask_again(before, forms, tried, cancel);
        if self.exchange(tried, cancel) {
            self.close(tried, &[], cancel);
        }
        tell(Progress::Step("Fitting rivals from where the best set landed", 0.9));
        self.settle(tried, cancel);
        self.ask_for_noise(tried, cancel);
        // What was cancelled on its way was not held against all data.
        if cancel.is_cancelled() {
            return false;
        }
        tried.sets.iter().for_each(|set| self.keep(Arc::clone(&set.fitted)));
        true
    }

    /// True of a proposal that closes no gap: along the measured motion its effects explain next to nothing of what is left.
    pub(super) fn explaining_little<'s>(
        &self,
        before: &Fitted,
        screened: &'s Screened,
        cancel: &Cancel,
    ) -> impl Fn(&Proposal) -> bool + use<'s> {
        // Where masses rest, the response to a small force is none that others beside it could add to.
        let tells = !self.data.rests();
        let noise = before.refined.samples as f64 * self.data.noise_of(before, cancel).powi(2);
        let share = self.data.constants.little_gain;
        move |proposal| tells && screened.explains_little(&proposal.forms, share, noise)
    }

    /// Fits proposals in their order and adds them to those tried: those that are `wanted` still when their turn comes, after
    /// what was `taken` before them. False if cancelled.
    ///
    /// The first stands alone, as it often explains the data, and so do those that are tried before all else. Of the others so
    /// many are fitted side by side, each held against those before all of them, that what is found does not hang on the number of
    /// cores.
    pub(super) fn fit_in_turn<S>(
        &self,
        proposals: Vec<Proposal>,
        tried: &mut Tried,
        state: &mut S,
        (wanted, mut taken, told): (
            impl Fn(&S, &Proposal, &[usize]) -> bool,
            impl FnMut(&mut S, &Proposal, Option<&Hypothesis>),
            impl Fn(f64),
        ),
        cancel: &Cancel,
    ) -> bool {
        let bar = Bar::default();
        let count = proposals.len();
        let mut waiting = proposals.into_iter().enumerate().peekable();
        while let Some((first, proposal)) = waiting.peek() {
            if cancel.is_cancelled() {
                return false;
            }
            let together = if *first == 0 || proposal.gain == f64::INFINITY { 1 } else { SIDE_BY_SIDE };
            told(*first as f64 / count as f64);
            let mut next: Vec<(Vec<usize>, Proposal)> = Vec::new();
            while next.len() < together
                && let Some((_, proposal)) = waiting.next()
            {
                let set = tried.indices(&proposal.composition);
                if !wanted(state, &proposal, &set) || next.iter().any(|(other, _)| *other == set) {
                    continue;
                }
                match tried.place(&set) {
                    Some(_) => taken(state, &proposal, None),
                    None => next.push((set, proposal)),
                }
            }
            let fit = |(set, proposal): (Vec<usize>, Proposal)| {
                let own = Bar::of(bar.least());
                let lost = |landed: &Landed| self.has_lost(landed, tried);
                let fitted = self.fitted_set(proposal.clone(), set.clone(), Some(&own), &lost, cancel);
                (set, proposal, fitted, own.least())
            };
            for (set, proposal, fitted, least) in next.into_par_iter().map(fit).collect::<Vec<_>>() {
                if wanted(state, &proposal, &set) {
                    bar.reached(least);
                    taken(state, &proposal, fitted.as_ref());
                    tried.sets.extend(fitted);
                }
            }
        }
        true
    }

    /// Fits sets that do not hang on one another, each from where another one with which it shares effects landed. Each has a bar of
    /// its own: its effort is bounded as a rival's is, and it is not given up.
    fn fit_each(
        &self,
        base: &Fitted,
        sets: Vec<(Vec<usize>, Arc<Fitted>)>,
        tried: &Tried,
        cancel: &Cancel,
    ) -> Vec<Hypothesis> {
        if sets.is_empty() {
            return Vec::new();
        }
        let model = PresentModel::new(&self.data, &base.composition, &base.parameters.inner, cancel);
        let start = |(set, other): (Vec<usize>, Arc<Fitted>)| {
            let start = self.sharing(base, &model, &other, &set, tried)?;
            Some((set, start))
        };
        self.fit_from(sets.into_par_iter().filter_map(start).collect(), tried, cancel)
    }

    /// The same from starts that are known.
    pub(super) fn fit_from(
        &self,
        starts: Vec<(Vec<usize>, Proposal)>,
        tried: &Tried,
        cancel: &Cancel,
    ) -> Vec<Hypothesis> {
        let lost = |landed: &Landed| self.has_lost(landed, tried);
        let fit = |(set, start): (Vec<usize>, Proposal)| {
            let fit = || self.fitted_set(start, set, Some(&Bar::default()), &lost, cancel);
            (!cancel.is_cancelled()).then(fit).flatten()
        };
        starts.into_par_iter().filter_map(fit).collect()
    }

    /// True if a fit leaves so much more on the data fitted than one that was tried, and than noise, that it has lost whatever it
    /// predicts. One that follows them less far may leave less for that.
    fn has_lost(&self, landed: &Landed, tried: &Tried) -> bool {
        let level = if landed.whole { WHOLE } else { landed.level };
        let as_far = |set: &&Hypothesis| set.fitted.level >= level && set.unborne.is_none();
        let least = tried.sets.iter().filter(as_far).map(|set| set.fitted.error()).fold(f64::INFINITY, f64::min);
        landed.error().powi(2) > self.data.constants.far_behind * least.max(self.data.noise).powi(2)
    }

    /// What a fit that was not asked leaves on data never fitted, asked now.
    pub(super) fn asked(&self, fitted: &Arc<Fitted>, cancel: &Cancel) -> Arc<Fitted> {
        if fitted.asked {
            return Arc::clone(fitted);
        }
        let asked = Arc::new(self.data.asked_now(fitted, cancel));
        if !cancel.is_cancelled() {
            self.keep(Arc::clone(&asked));
        }
        asked
    }

    /// Asks those sets what they leave on data never fitted that were not asked yet; false if there were none.
    pub(super) fn ask(&self, tried: &mut Tried, sets: impl Iterator<Item = usize>, cancel: &Cancel) -> bool {
        let unasked: Vec<usize> = sets.filter(|k| !tried.sets[*k].fitted.asked).collect();
        let ask = |k: &usize| {
            let fitted = self.asked(&tried.sets[*k].fitted, cancel);
            let blocks = (!self.data.can_be_asked_later()).then(|| self.data.densities(&fitted, cancel));
            (*k, fitted, blocks)
        };
        let asked: Vec<_> = unasked.par_iter().map(ask).collect();
        for (k, fitted, blocks) in asked {
            let set = &mut tried.sets[k];
            set.fitted = fitted;
            set.blocks = blocks.unwrap_or_else(|| std::mem::take(&mut set.blocks));
        }
        !unasked.is_empty()
    }

    /// What rests while the force on it changes is held by dry friction, each kind of which is tried before all else. The
    /// regression hears nothing of rests, and does not order these.
    fn holding(&self, before: &Fitted, model: &PresentModel<'_>, forms: &[Form]) -> Vec<Proposal> {
        if !self.data.rests() {
            return Vec::new();
        }
        let alone = |k: usize| {
            let form = std::slice::from_ref(&forms[k]);
            let start = model.exactly(form).unwrap_or_else(|| self.unfitted(before, form));
            Proposal { forms: vec![k], gain: f64::INFINITY, ..start }
        };
        (0..forms.len()).filter(|k| forms[*k].is_dry_friction()).map(alone).collect()
    }

    /// A displacement that is estimated misleads the regression by a small shift of phase: there what would explain most along the
    /// base model's motion is proposed too, as likely as what the regression has first.
    fn seen_along(
        &self,
        model: &PresentModel<'_>,
        (forms, screened): (&[Form], &[Hit]),
        proposals: &[Proposal],
    ) -> Vec<Proposal> {
        if !self.data.estimates_displacements() {
            return Vec::new();
        }
        let gain = proposals.iter().map(|p| p.gain).fold(0.0, f64::max);
        let alone = |k: usize| {
            let start = model.exactly(std::slice::from_ref(&forms[k]))?;
            Some(Proposal { forms: vec![k], gain, ..start })
        };
        let first = screened.iter().map(|hit| hit.form).filter(|k| !forms[*k].is_outside());
        first.take(SIDE_BY_SIDE).filter_map(alone).collect()
    }

    /// Fits what the best sets contain, whenever their effects were found: a set is named only against each part of it, fitted
    /// as carefully. What is `kept` is not asked for: a set that has it is held against those that have it too.
    pub(super) fn close(&self, tried: &mut Tried, kept: &[usize], cancel: &Cancel) {
        let Some(base) = self.known(&[]) else { return };
        let has = |set: &[usize]| kept.iter().all(|k| set.contains(k));
        let mut asked: Vec<Vec<usize>> = Vec::new();
        // What was a part of the best may lead now, and has parts itself.
        loop {
            let mut parts: Vec<(Vec<usize>, Arc<Fitted>)> = Vec::new();
            for whole in tried.best().into_iter().take(self.data.constants.sets_with_parts) {
                let of_kept = has(&tried.sets[whole].forms);
                for part in tried.parts_of(&tried.sets[whole].forms) {
                    let known = tried.place(&part).is_some() || asked.contains(&part);
                    if known || of_kept && !has(&part) {
                        continue;
                    }
                    asked.push(part.clone());
                    parts.push((part, Arc::clone(&tried.sets[whole].fitted)));
                }
            }
            if parts.is_empty() || cancel.is_cancelled() {
                return;
            }
            let parts = self.fit_each(&base, parts, tried, cancel);
            tried.sets.extend(parts);
        }
    }

    /// Fits the best set with one effect exchanged: for one over the same quantity that did as well alone or takes the place of a term,
    /// for a richer kind of one that is a richer kind itself, and where the set leaves more than noise, for a richer or another kind of
    /// any. The regression, which orders sets, may not have seen what they do together. False if nothing was new.
    fn exchange(&self, tried: &mut Tried, cancel: &Cancel) -> bool {
        let Some(base) = self.known(&[]) else { return false };
        let sound = |k: &usize| tried.sets[*k].unborne.is_none() && !tried.sets[*k].forms.is_empty();
        let Some(best) = tried.best().into_iter().find(sound) else { return false };
        let Hypothesis { forms: set, fitted, .. } = tried.sets[best].clone();
        let noise = self.data.noise_of(&fitted, cancel).max(tried.coloured.rms);
        let explains =
            self.explains(&fitted, tried.coloured.rms, cancel) && !self.matters_beyond(noise, &base, &fitted);
        let alone = |form: usize| {
            let single = tried.place(&[form]).map(|k| &tried.sets[k]).filter(|single| single.unborne.is_none());
            single.map(Hypothesis::sum)
        };
        let other_kind = |new: usize, old: usize| {
            let (new, old) = (&tried.forms[new], &tried.forms[old]);
            // What is richer than the simplest of its kind may stand for one that is richer than it.
            let simplest = || !tried.forms.iter().any(|simpler| old.is_richer_kind_of(simpler));
            let richer = new.is_richer_kind_of(old) && !(explains && simplest());
            richer || !explains && new.effect == old.effect && new.acts_like(old)
        };
        let as_good = |new: usize, old: usize| {
            let alike = tried.forms[new].acts_like(&tried.forms[old]);
            // Alone, what takes the place of a term may leave more than it.
            let did = || tried.forms[new].replaces_a_term() || alone(new).is_some_and(|sum| Some(sum) >= alone(old));
            set.len() > 1 && alike && did()
        };
        let mut exchanged: Vec<Vec<usize>> = Vec::new();
        for (place, old) in set.iter().enumerate() {
            for new in (0..tried.forms.len()).filter(|new| !set.contains(new)) {
                if other_kind(new, *old) || as_good(new, *old) {
                    let mut other = set.clone();
                    other[place] = new;
                    other.sort_unstable();
                    exchanged.push(other);
                }
            }
        }
        // What follows any curve is never named.
        let follows_any = |set: &[usize]| follow_any_curve(set.iter().map(|k| &tried.forms[*k]));
        exchanged.retain(|other| tried.place(other).is_none() && !follows_any(other));
        exchanged.sort();
        exchanged.dedup();
        let kinked = if explains { self.kinked_instead(&base, &set, &fitted, tried, cancel) } else { Vec::new() };
        exchanged.retain(|other| !kinked.iter().any(|(set, _)| set == other));
        let exchanged = exchanged.into_iter().map(|other| (other, Arc::clone(&fitted))).collect();
        let before = tried.sets.len();
        let exchanged = self.fit_each(&base, exchanged, tried, cancel);
        let kinked = self.fit_from(kinked, tried, cancel);
        tried.sets.extend(exchanged.into_iter().chain(kinked));
        tried.sets.len() > before
    }

    /// Sets that have a curve with a kink in the place of smooth ones of a set over the same quantity, be it one of free shape or several
    /// effects, and along the motion that this set simulates explain next to as much. The measured motion is smoothed, and with it
    /// every kink: there the regression prefers the smoother of two curves.
    fn kinked_instead(
        &self,
        base: &Fitted,
        set: &[usize],
        fitted: &Fitted,
        tried: &Tried,
        cancel: &Cancel,
    ) -> Vec<(Vec<usize>, Proposal)> {
        let forms = &tried.forms;
        let mut others: Vec<Vec<usize>> = Vec::new();
        let is_kinked = |k: &usize| forms[*k].is_curve_of_free_shape() && forms[*k].has_a_kink();
        for new in (0..forms.len()).filter(is_kinked) {
            let (alike, mut other): (Vec<usize>, Vec<usize>) =
                set.iter().partition(|old| forms[new].acts_like(&forms[**old]));
            let free = alike.len() > 1 || alike.iter().any(|old| forms[*old].is_curve_of_free_shape());
            if free && !alike.iter().any(|old| forms[*old].has_a_kink()) {
                other.push(new);
                other.sort_unstable();
                others.push(other);
            }
        }
        others.retain(|other| tried.place(other).is_none());
        if others.is_empty() {
            return Vec::new();
        }
        let Some(paths) = self.data.simulated_paths(fitted) else { return Vec::new() };
        let model =
            PresentModel::along(&paths, &self.data, &base.composition, &base.parameters.inner, cancel).whitened();
        let start = |set: &[usize]| model.exactly(&set.iter().map(|k| forms[*k].clone()).collect::<Vec<_>>());
        let Some(own) = start(set) else { return Vec::new() };
        let all_but_little = 1.0 - self.data.constants.little_gain;
        let near = |other: Vec<usize>| {
            let explains = |start: &Proposal| model.explained(start.gain) >= all_but_little * model.explained(own.gain);
            Some((other.clone(), start(&other).filter(explains)?))
        };
        others.into_par_iter().filter_map(near).collect()
    }

    /// Where the fit of a set starts: all that it shares with another one as that has it, the rest from the regression.
    fn sharing(
        &self,
        base: &Fitted,
        model: &PresentModel<'_>,
        other: &Fitted,
        set: &[usize],
        tried: &Tried,
    ) -> Option<Proposal> {
        let chosen: Vec<Form> = set.iter().map(|k| tried.forms[*k].clone()).collect();
        let regressed = model.exactly(&chosen);
        if other.level != WHOLE {
            return regressed;
        }
        let start = regressed.unwrap_or_else(|| self.unfitted(base, &chosen));
        let own = start.composition.named(&start.shared);
        let shared = start.composition.transferred(&own, &other.composition, &other.parameters).row();
        Some(Proposal { shared: start.composition.begun().clamped(&shared), ..start })
    }

    /// Effects beside the base model as it is, each without a force of its own yet.
    fn unfitted(&self, base: &Fitted, forms: &[Form]) -> Proposal {
        let mut composition = forms.iter().fold(base.composition.clone(), |composition, form| composition.with(form));
        let inner = InnerValues { equilibrium: base.parameters.inner.equilibrium, ..composition.middle() };
        composition.scales = self.data.scales(&composition, &inner, &self.smoothed_paths());
        let own = Parameters { coefficients: vec![0.0; composition.terms()], inner };
        let shared = composition.transferred(&own, &base.composition, &base.parameters).row();
        Proposal { forms: Vec::new(), composition, shared, gain: f64::NEG_INFINITY }
    }

    /// Fits the best sets and their rivals once more: from where the best of them landed, all that they share with it as it has
    /// it, and where a set leaves more along whole records than along short stretches, by way of those. Along whole records one
    /// stop of a mass that rubs, missed, leads astray.
    pub(super) fn settle(&self, tried: &mut Tried, cancel: &Cancel) {
        let constants = &self.data.constants;
        let order = tried.best();
        let left = |set: &Hypothesis| set.fitted.refined.rss;
        let whole = |k: &usize| tried.sets[*k].fitted.level == WHOLE;
        let Some(best) = order.iter().copied().find(|k| tried.sets[*k].unborne.is_none() && whole(k)) else { return };
        let first = Arc::clone(&tried.sets[best].fitted);
        let size = parts(&tried.sets[best].forms, &tried.forms);
        let least = left(&tried.sets[best]);
        let forms = |k: usize| &tried.sets[k].forms;
        let part = |k: usize| contains(forms(best), forms(k), &tried.forms);
        let lost = |k: usize| contains(forms(k), forms(best), &tried.forms) && left(&tried.sets[k]) > least;
        let mut near: Vec<usize> = order
            .into_iter()
            .filter(|k| {
                let set = &tried.sets[*k];
                let short = || left(set) < least && set.unborne.is_none() && self.landed_lower(set, tried).is_some();
                !set.forms.is_empty()
                    && (lost(*k)
                        || parts(&set.forms, &tried.forms) <= size && left(set) < constants.far_behind * least
                        || short())
            })
            .collect();
        // A name too many comes of a part that was not fitted to its end.
        near.sort_by_key(|k| !part(*k));
        near.truncate(constants.fitted_again);
        // Once is enough from each place.
        let from = |k: usize| &self.landed_lower(&tried.sets[k], tried).unwrap_or(&first).refined;
        let was_tried = |k: usize| {
            tried.settled.iter().any(|(forms, there)| *forms == tried.sets[k].forms && Arc::ptr_eq(there, from(k)))
        };
        near.retain(|k| !was_tried(*k));
        let now: Vec<_> = near.iter().map(|k| (tried.sets[*k].forms.clone(), Arc::clone(from(*k)))).collect();
        let again = |k: usize| -> Option<(usize, Hypothesis)> {
            let Hypothesis { forms, fitted, .. } = &tried.sets[k];
            if self.explains(fitted, tried.coloured.rms, cancel) || cancel.is_cancelled() {
                return None;
            }
            let composition = &fitted.composition;
            let shared = |from: &Fitted| {
                let start = composition.transferred(&fitted.parameters, &from.composition, &from.parameters).row();
                composition.clamped(&start)
            };
            let again = || match self.landed_lower(&tried.sets[k], tried) {
                Some(from) => self.landed_on(composition, shared(from), from, cancel),
                None => (k != best)
                    .then(|| self.landed(composition, &shared(&first), Some(&Bar::default()), cancel))
                    .flatten(),
            };
            // What holds the best set and leaves more begins as that set, with nothing of what it has beside it.
            let holds_best = || {
                let nothing = Parameters { coefficients: vec![0.0; composition.terms()], inner: composition.middle() };
                let start = composition.transferred(&nothing, &first.composition, &first.parameters).row();
                self.landed(composition, &composition.clamped(&start), Some(&Bar::default()), cancel)
            };
            let begun = || join(again, || lost(k).then(holds_best).flatten());
            let ((again, as_best), by_stretches) = join(begun, || self.by_stretches(fitted, cancel));
            let landed = [again, as_best, by_stretches].into_iter().flatten().filter(|l| l.whole);
            let landed = landed.min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss));
            let landed = landed.filter(|l| l.refined.rss < left(&tried.sets[k]))?;
            Some((k, self.hypothesis(forms.clone(), self.data.judged(composition.clone(), landed, cancel), cancel)))
        };
        for (k, set) in near.into_par_iter().filter_map(again).collect::<Vec<_>>() {
            tried.sets[k] = set;
        }
        tried.settled.extend(now);
    }

    /// The fit of a set with more in it, of which the data do not bear all, that leaves less all the same than chance would have
    /// it: the set itself has not landed where it could.
    fn landed_lower<'t>(&self, set: &Hypothesis, tried: &'t Tried) -> Option<&'t Arc<Fitted>> {
        let more = tried.sets.iter().filter(|other| {
            other.unborne.is_some() && other.fitted.level == WHOLE && contains(&other.forms, &set.forms, &tried.forms)
        });
        let least = more.min_by(|a, b| a.fitted.refined.rss.total_cmp(&b.fitted.refined.rss))?;
        (least.fitted.likelier(&set.fitted) > self.data.constants.lead).then_some(&least.fitted)
    }

    /// A model with a form added; the effects of which it is a richer kind are replaced by it.
    fn with(before: &Composition, form: &Form) -> Composition {
        let simpler = before.forms.iter().position(|f| form.is_richer_kind_of(f));
        simpler.map_or_else(|| before.with(form), |index| before.without(index).with(form))
    }

    pub(super) fn smoothed_paths(&self) -> Vec<super::columns::MotionPath> {
        self.data.fit().iter().map(super::data::RecordSeries::path).collect()
    }
}
