//! Where the effects of the catalogue leave a gap: the shortest formula that follows what they do not say.
//!
//! Its terms are products of displacement, velocity and input, their signs, magnitudes and sines. What proposes, fits and
//! decides is what does so for effects; only the list is another one.

use std::sync::Arc;

use super::effects::{DESCRIPTION, Form};
use super::error::GapError;
use super::fit::Fitted;
use super::judge::Hypothesis;
use super::outcome::{Description, Finding, Stage};
use super::progress::Progress;
use super::propose::{PresentModel, Proposal};
use super::ruling::Tried;
use super::search::{Depth, Keep, Listener, Search};
use super::words::described;
use sindyscope_core::study::Cancel;

/// What a formula is: so many terms at most.
const MOST_TERMS: usize = 3;

impl Search {
    /// The formula that stands beside the base or beside the last model, held against all that was tried; none where no formula
    /// beats that.
    ///
    /// # Errors
    /// Cancelled, or a stage that cannot be simulated.
    pub(super) fn described(
        &self,
        base: &Stage,
        last: &Stage,
        tried: &mut Tried,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<Option<Description>, GapError> {
        let mut kept = Vec::new();
        // The fewest effects and terms that explain the data: longer formulas are not asked for.
        let mut enough = usize::MAX;
        // Beside effects that close no gap a formula has to make up for what they do wrong: alone it may be shorter.
        for stage in std::iter::once(base).chain((!last.effects.is_empty()).then_some(last)) {
            let before = self.fit_of(stage, cancel)?;
            self.try_formulas(&before, 0, &mut enough, tried, tell, cancel)?;
            kept = tried.indices(&before.composition);
        }
        // The regression passes over what is small beside the first term: the best formula is gone on from.
        for terms in 1..MOST_TERMS {
            let of_terms =
                |k: &usize| words_of(tried, &tried.sets[*k]).len() == terms && tried.sets[*k].unborne.is_none();
            let Some(best) = tried.best().into_iter().find(of_terms).filter(|_| enough == usize::MAX) else { break };
            let spent = self.effort().steps >= self.data.constants.effort_of_looks();
            if spent || !self.is_worth_a_term(tried, best) {
                break;
            }
            let before = Arc::clone(&tried.sets[best].fitted);
            self.try_formulas(&before, terms, &mut enough, tried, tell, cancel)?;
        }
        self.close(tried, &kept, cancel);
        self.settle(tried, cancel);
        self.rule(tried, &[], cancel);
        if cancel.is_cancelled() {
            return Err(GapError::Cancelled);
        }
        let nearest = |tried: &Tried| tried.nearest(|set| words_of(tried, set).is_empty());
        while let Some(k) = nearest(tried)
            && self.ask(tried, std::iter::once(k), cancel)
            && !cancel.is_cancelled()
        {}
        let terms_of = |set: &Hypothesis| words_of(tried, set);
        let Some(winner) = tried.winner().filter(|w| !terms_of(w).is_empty()) else { return Ok(None) };
        let Some(nearest) = nearest(tried).map(|k| &tried.sets[k]) else { return Ok(None) };
        let names: Vec<String> = tried.choices(nearest).into_iter().map(|c| c.effect).collect();
        let against = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let alike = tried.ruling.rivals.iter().map(|k| terms_of(&tried.sets[*k])).filter(|terms| !terms.is_empty());
        let lead = self.data.constants.compared(&winner.blocks, &nearest.blocks, &against);
        let alternatives = alike.collect();
        let fitted = Arc::clone(&winner.fitted);
        let stage = Arc::new(self.show(&fitted));
        let closes = !self.matters(&*self.fit_of(base, cancel)?, &fitted, cancel)
            || self.look_into(&stage, Depth::Screened, Keep::Present, tell, cancel)?.finding == Finding::Nothing;
        let (own, beside): (Vec<_>, Vec<_>) = stage.effects.iter().partition(|e| e.choice.effect == DESCRIPTION);
        let mut terms: Vec<String> = Vec::new();
        for term in own.iter().flat_map(|e| &e.terms) {
            if !terms.contains(term) {
                terms.push(term.clone());
            }
        }
        let sentence = described((&terms, closes), (&last.gap, &stage.gap), &lead, &self.data.shown_unit);
        let beside = beside.into_iter().map(|e| e.choice.effect.clone()).collect();
        let scores = self.record_scores(&fitted, cancel);
        let plain = self.fit_of(base, cancel)?;
        let curve = self.described_curve((&plain, &fitted), &self.motion(&plain, &base.choices(), cancel)?);
        Ok(Some(Description { terms, beside, stage, scores, lead, closes, alternatives, curve, sentence }))
    }

    /// The formula that says in fewer terms, and better, what two effects or more say together: several forces that no datum asks for
    /// may follow one that the catalogue lacks. It is sought only where the regression hears of one.
    ///
    /// # Errors
    /// Cancelled, or a stage that cannot be simulated.
    pub(super) fn shorter_formula(
        &self,
        (base, last): (&Stage, &Stage),
        tried: impl FnOnce() -> Result<Tried, GapError>,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<Option<Description>, GapError> {
        let (before, named) = (self.fit_of(base, cancel)?, self.fit_of(last, cancel)?);
        let effects = &named.composition.forms;
        if effects.len() < 2 || !self.hears_of_shorter(&before, effects, cancel) {
            return Ok(None);
        }
        let description = self.described(base, base, &mut tried()?, tell, cancel)?;
        Ok(description.filter(|found| found.terms.len() + found.beside.len() < effects.len()))
    }

    /// True if the regression has a formula with fewer terms before these effects together.
    fn hears_of_shorter(&self, before: &Fitted, effects: &[Form], cancel: &Cancel) -> bool {
        let model = PresentModel::new(&self.data, &before.composition, &before.parameters.inner, cancel);
        let Some((named, motion)) = model.exactly(effects).zip(self.data.motion(before, cancel)) else { return false };
        let formulas = model.propose(&self.words_of_formulas(before, &motion), 0.0);
        formulas.iter().any(|formula| formula.forms.len() < effects.len() && formula.gain > named.gain)
    }

    /// False if the last term of a formula takes away next to nothing of what is left without it: then none is on the way to what
    /// is missing.
    fn is_worth_a_term(&self, tried: &Tried, set: usize) -> bool {
        let of = &tried.sets[set];
        let without = |k: &usize| of.forms.iter().copied().filter(|form| form != k).collect::<Vec<_>>();
        let terms = of.forms.iter().filter(|k| tried.forms[**k].effect == DESCRIPTION);
        let shorter = terms.filter_map(|k| tried.place(&without(k))).map(|k| &tried.sets[k].fitted);
        // Errors along stretches of other lengths cannot be compared.
        let alike = shorter.filter(|fitted| fitted.level == of.fitted.level);
        let least = alike.map(|fitted| fitted.error()).fold(f64::INFINITY, f64::min);
        of.fitted.error() < (1.0 - 0.5 * self.data.constants.matters_noises) * least
    }

    /// Fits formulas beside a model that has so many terms of one already, and adds them to what was tried.
    fn try_formulas(
        &self,
        before: &Arc<Fitted>,
        terms: usize,
        enough: &mut usize,
        tried: &mut Tried,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<(), GapError> {
        let data = &self.data;
        tell(Progress::Step("Seeking a formula for what is left", 0.9));
        let Some(motion) = data.motion(before, cancel) else { return Ok(()) };
        let forms = self.words_of_formulas(before, &motion);
        let screened = data.screen(before, &motion, &forms, cancel);
        let little = self.explaining_little(before, &screened, cancel);
        let (composition, inner) = (&before.composition, &before.parameters.inner);
        // No term stands for a part of another, as effects do: the shortest is found by the comparison alone.
        let proposals = PresentModel::new(data, composition, inner, cancel).propose(&forms, 0.0);
        tried.know(composition.forms.iter().chain(&forms));
        let present = tried.indices(composition);
        if tried.place(&present).is_none() {
            tried.sets.push(self.hypothesis(present, (**before).clone(), cancel));
        }
        let wanted = |enough: &usize, proposal: &Proposal, set: &[usize]| {
            let short = terms + proposal.forms.len() <= MOST_TERMS && set.len() <= *enough;
            short && !little(proposal)
        };
        let taken = |enough: &mut usize, _: &Proposal, set: Option<&Hypothesis>| {
            let explains = |set: &&Hypothesis| {
                set.unborne.is_none() && data.is_within(&set.fitted, data.constants.explaining(), cancel)
            };
            if let Some(set) = set.filter(explains) {
                *enough = (*enough).min(set.forms.len());
            }
        };
        if !self.fit_in_turn(proposals, tried, enough, (wanted, taken, |_| ()), cancel) {
            return Err(GapError::Cancelled);
        }
        Ok(())
    }
}

/// The terms of a set that are a formula's.
fn words_of(tried: &Tried, set: &Hypothesis) -> Vec<String> {
    tried.choices(set).into_iter().filter(|c| c.effect == DESCRIPTION).map(|c| c.form).collect()
}
