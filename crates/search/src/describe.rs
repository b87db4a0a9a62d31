//! Where the effects of the catalogue leave a gap: the shortest formula that follows what they do not say.
//!
//! Its terms are products of displacement, velocity and input, their signs, magnitudes and sines. What proposes, fits and
//! decides is what does so for effects; only the list is another one.

use std::sync::Arc;

use super::effects::DESCRIPTION;
use super::error::GapError;
use super::judge::{Hypothesis, lead};
use super::outcome::{Description, Diagnosis, Finding, Stage};
use super::progress::Progress;
use super::rule::EXPLAINS;
use super::ruling::Tried;
use super::search::{Depth, Keep, Listener, Search};
use super::words::described;
use sindyscope_core::refine::Bar;
use sindyscope_core::study::Cancel;

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
        let data = &self.data;
        let mut kept = Vec::new();
        // Beside effects that close no gap a formula has to make up for what they do wrong: alone it may be shorter.
        for stage in std::iter::once(base).chain((!last.effects.is_empty()).then_some(last)) {
            tell(Progress::Step("Seeking a formula for what is left", 0.9));
            let before = self.fit_of(stage, cancel)?;
            let Some(motion) = data.motion(&before) else { continue };
            let forms = self.words_of_formulas(&before, &motion);
            let (composition, inner) = (&before.composition, &before.parameters.inner);
            let proposals = data.propose(composition, inner, &forms, cancel);
            tried.know(composition.forms.iter().chain(&forms));
            kept = tried.indices(composition);
            if tried.place(&kept).is_none() {
                tried.sets.push(self.hypothesis(kept.clone(), (*before).clone(), cancel));
            }
            let bar = Bar::default();
            let mut enough = usize::MAX;
            for proposal in proposals {
                if cancel.is_cancelled() {
                    return Err(GapError::Cancelled);
                }
                let set = tried.indices(&proposal.composition);
                // Once a formula explains the data, longer ones are not asked for.
                if set.len() > enough || tried.place(&set).is_some() {
                    continue;
                }
                if let Some(set) = self.fitted_set(proposal, set, Some(&bar), cancel) {
                    if set.unborne.is_none() && data.is_within(&set.fitted, data.noise, EXPLAINS, cancel) {
                        enough = enough.min(set.forms.len());
                    }
                    tried.sets.push(set);
                }
            }
        }
        self.close(tried, &kept, cancel);
        self.settle(tried, cancel);
        self.rule(tried, &[]);
        if cancel.is_cancelled() {
            return Err(GapError::Cancelled);
        }
        let terms_of = |set: &Hypothesis| -> Vec<String> {
            tried.choices(set).into_iter().filter(|c| c.effect == DESCRIPTION).map(|c| c.form).collect()
        };
        let Some(winner) = tried.winner().filter(|w| !terms_of(w).is_empty()) else { return Ok(None) };
        let without = tried.sets.iter().filter(|s| s.unborne.is_none() && terms_of(s).is_empty());
        let Some(nearest) = without.max_by(|a, b| a.sum().total_cmp(&b.sum())) else { return Ok(None) };
        let names: Vec<String> = tried.choices(nearest).into_iter().map(|c| c.effect).collect();
        let against = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let alike = tried.ruling.rivals.iter().map(|k| terms_of(&tried.sets[*k])).filter(|terms| !terms.is_empty());
        let (lead, alternatives) = (lead(&winner.blocks, &nearest.blocks, &against), alike.collect());
        let fitted = Arc::clone(&winner.fitted);
        let stage = Arc::new(self.show(&fitted));
        let closes = !self.matters(base, &fitted, cancel)
            || self.look_into(&stage, Depth::Screened, Keep::Present, tell, cancel)?.finding == Finding::Nothing;
        let (own, beside): (Vec<_>, Vec<_>) = stage.effects.iter().partition(|e| e.choice.effect == DESCRIPTION);
        let mut terms: Vec<String> = Vec::new();
        for term in own.iter().flat_map(|e| &e.terms) {
            if !terms.contains(term) {
                terms.push(term.clone());
            }
        }
        let sentence = described((&terms, closes), (&last.gap, &stage.gap), &lead, &data.shown_unit);
        let beside = beside.into_iter().map(|e| e.choice.effect.clone()).collect();
        let scores = self.record_scores(&fitted, cancel);
        Ok(Some(Description { terms, beside, stage, scores, lead, closes, alternatives, sentence }))
    }
}

impl Diagnosis {
    /// Takes a description in, and says it behind the verdict.
    pub(super) fn take(&mut self, description: Option<Description>) {
        if let Some(description) = &description {
            self.sentence = format!("{} {}", self.sentence, description.sentence);
        }
        self.description = description;
    }
}
