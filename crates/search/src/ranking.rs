//! What a round's refitted candidates come to: their order, which is named, and which cannot be told from it.

use std::sync::Arc;

use super::data::LEAST_NOISE;
use super::decide::{
    APART, APART_ON_A_TONE, CLEARLY, Contender, Refusal, Resolution, Score, WORTH, confused, fewer_do, order, refusal,
    score, unsupported,
};
use super::effects::Form;
use super::fit::{Fitted, WHOLE};
use super::outcome::{Candidate, Choice, Finding, Standing};
use super::refit::CLOSE;
use super::screen::Motion;
use super::search::{Refit, Search};
use super::sets::Sets;
use super::structure::choice;
use super::words::why;
use sindyscope_core::study::Cancel;

/// What a round's candidates come to.
pub(super) struct Decision {
    pub(super) finding: Finding,
    pub(super) next_experiment: Option<String>,
    pub(super) company: Option<Choice>,
}

impl Decision {
    pub(super) fn nothing() -> Self {
        Self { finding: Finding::Nothing, next_experiment: None, company: None }
    }
}

/// Fits of whole records and those along segments, made comparable: where the sets could be followed over whole records the
/// better fit of each stands, else only what was fitted along the same segments.
pub(super) fn merged(before: Arc<Fitted>, refits: Vec<Refit>, sets: Sets) -> (Arc<Fitted>, Vec<Refit>) {
    let Sets { before: again, tried } = sets;
    if again.level != WHOLE {
        let tried = tried.into_iter().map(|(forms, fitted)| Refit { forms, fitted: Arc::new(fitted) });
        return (Arc::new(again), tried.collect());
    }
    let mut all = refits;
    for (forms, fitted) in tried {
        let fitted = Arc::new(fitted);
        match all.iter_mut().find(|r| r.forms == forms) {
            Some(known) if fitted.refined.rss < known.fitted.refined.rss => known.fitted = fitted,
            Some(_) => {}
            None => all.push(Refit { forms, fitted }),
        }
    }
    let better = before.level != WHOLE || again.refined.rss < before.refined.rss;
    (if better { Arc::new(again) } else { before }, all)
}

/// Share of the first's explanation along the motion from which another is its rival on one steady tone.
const NEARLY: f64 = 0.8;
/// A refit that leaves so many times the first's error is refused by the data.
const REFUSED: f64 = 1.2;

/// A candidate with its score and whether anything speaks against it.
struct Entry<'a> {
    form: usize,
    score: Score,
    fitted: &'a Arc<Fitted>,
    refused: Option<Refusal>,
}

impl Search {
    /// Puts the refitted candidates in order and says what they come to.
    pub(super) fn decide(
        &self,
        before: &Arc<Fitted>,
        motion: &Motion,
        forms: &[Form],
        refits: &[Refit],
        candidates: &mut [Candidate],
        cancel: &Cancel,
    ) -> Decision {
        let data = &self.data;
        // One variance inflation for all, that of the best fit: its residual is nearest to the noise.
        let nearest = refits.iter().map(|r| &r.fitted).min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss));
        let inflation = nearest.map_or(1.0, |f| self.inflation(f));
        // What the input may do between its samples tells no effect from another.
        let least = nearest.map_or(0.0, |f| f.refined.rss);
        let near = refits.iter().map(|r| &r.fitted).filter(|f| f.refined.rss < CLOSE * least);
        let course = near.map(|f| data.between_samples(f, cancel)).fold(0.0, f64::max);
        let resolution = Resolution { noise: data.noise, course };
        let (noise, floor) = (resolution.noise(), LEAST_NOISE * data.loudest());
        self.keep(Arc::clone(before));
        let mut singles: Vec<Entry<'_>> = Vec::new();
        for Refit { forms: set, fitted } in refits {
            // What a cancelled search decides is not looked at.
            let (&[k], false) = (set.as_slice(), cancel.is_cancelled()) else { continue };
            let form = &forms[k];
            let score = score(before, fitted, inflation, floor);
            let refused = refusal(&[form], before, (fitted, &score), inflation, (noise, &data.shown_unit));
            self.keep(Arc::clone(fitted));
            if let Some(candidate) = candidates.iter_mut().find(|c| c.choice == choice(form)) {
                candidate.delta_bic = score.bic;
                candidate.why = why(form, before, fitted, refused.as_ref().map(Refusal::reason), &data.shown_unit);
                candidate.curve = self.curve(form, (before, fitted), motion);
                candidate.stage = Some(Arc::new(self.show(fitted)));
                candidate.standing =
                    refused.as_ref().map_or(Standing::Refitted, |r| Standing::Refused(r.reason().to_owned()));
            }
            singles.push(Entry { form: k, score, fitted, refused });
        }
        // Records held out have values of their own; parts of fitted ones have theirs already.
        let beginnings = |f: &Fitted| if data.held_out().is_empty() { 0 } else { f.passing_of_folds() };
        let contender = |e: &Entry<'_>| Contender {
            index: e.form,
            form: &forms[e.form],
            score: e.score,
            determined: e.refused.is_none(),
            unknowns: e.fitted.refined.unknowns() + beginnings(e.fitted),
        };
        let standing: Vec<Contender<'_>> = singles.iter().filter(|e| e.refused.is_none()).map(contender).collect();
        // What the data do not determine, but do not speak against either, is a rival all the same.
        let undetermined: Vec<Contender<'_>> = singles
            .iter()
            .filter(|e| matches!(e.refused, Some(Refusal::Undetermined(_))))
            .filter(|e| unsupported(before, (e.fitted, &e.score), noise, &data.shown_unit).is_none())
            .map(contender)
            .collect();
        let apart = if self.audit.single_tone { APART_ON_A_TONE } else { APART };
        let ranked = order(&standing, resolution);
        let title = |k: usize| forms[k].full_title();
        let mut finding = Finding::Unexplained;
        let mut rivals: Vec<usize> = Vec::new();
        let entry = |k: usize| standing.iter().find(|s| s.index == k);
        if let Some(first) = ranked.first() {
            let beside = |of: usize| standing.iter().chain(&undetermined).filter(move |s| s.index != of);
            for k in &ranked {
                let Some(contender) = entry(*k) else { continue };
                // Those that do clearly better are told from it.
                let near = |s: &&Contender<'_>| s.score.total > contender.score.total - apart;
                let rest: Vec<Contender<'_>> = beside(*k).filter(near).copied().collect();
                let names = confused(contender, &rest, apart, resolution).into_iter().map(title).collect();
                if let Some(c) = candidates.iter_mut().find(|c| c.choice == choice(contender.form)) {
                    c.confused_with = names;
                }
            }
            if let Some(leader) = entry(*first) {
                let others: Vec<Contender<'_>> = beside(*first).copied().collect();
                rivals = confused(leader, &others, apart, resolution);
                if self.audit.single_tone {
                    // What explains as much along a motion of one kind may not have been refitted; what was, and leaves far
                    // more, the data refuse.
                    let explained = |k: usize| {
                        candidates.iter().find(|c| c.choice == choice(&forms[k])).map_or(0.0, |c| c.explained)
                    };
                    let error = |k: usize| singles.iter().find(|e| e.form == k).map(|e| e.fitted.error());
                    let best = error(*first).unwrap_or(f64::INFINITY);
                    rivals.extend((0..forms.len()).filter(|k| {
                        (forms[*k].effect != leader.form.effect || forms[*k].is_elsewhere(leader.form))
                            && explained(*k) > NEARLY * explained(*first)
                            && error(*k).is_none_or(|e| e < REFUSED * best)
                    }));
                    rivals.sort_unstable();
                    rivals.dedup();
                }
            }
            finding = Finding::Named;
        }
        let mut first = ranked.first().copied();
        let mut company = None;
        let alone = first.and_then(entry).map(|s| s.score);
        if let Some((lead, second, pair)) =
            self.better_together(before, forms, refits, (alone, first), (inflation, noise, floor))
        {
            self.keep(Arc::clone(pair));
            company = Some(choice(&forms[second]));
            first = Some(lead);
            rivals.clear();
            finding = Finding::Named;
        }
        // Best first: the one named, those that stand, the refused by score, then the screened.
        let rank = |c: &Candidate| -> (usize, f64) {
            let k = forms.iter().position(|f| choice(f) == c.choice);
            if k.is_some() && k == first {
                return (0, -1.0);
            }
            match k.and_then(|k| ranked.iter().position(|r| *r == k)) {
                Some(place) => (0, place as f64),
                None => match (k.and_then(|k| singles.iter().find(|s| s.form == k)), &c.standing) {
                    (Some(s), _) => (1, s.score.total),
                    (None, Standing::NotShown(_)) => (3, 0.0),
                    (None, _) => (2, -c.explained),
                },
            }
        };
        candidates.sort_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let mut next = None;
        if finding == Finding::Named && !rivals.is_empty() {
            let places =
                rivals.iter().filter_map(|k| candidates.iter().position(|c| c.choice == choice(&forms[*k]))).collect();
            finding = Finding::Ambiguous(places);
            let fitted = |k: usize| singles.iter().find(|e| e.form == k).map(|e| e.fitted);
            if let (Some(best), Some(rival)) = (first.and_then(fitted), fitted(rivals[0])) {
                next = data.next_experiment(best, rival, cancel);
                if next.is_none() {
                    next = Some(format!("What tells them apart: {}.", forms[rivals[0]].separates));
                }
            }
        }
        Decision { finding, next_experiment: next, company }
    }

    /// The pair that data never fitted bear out though neither of its effects stands alone, or that explains them clearly
    /// better than the best that does: the effect that is named first, the other, and the fit with both.
    fn better_together<'a>(
        &self,
        before: &Fitted,
        forms: &[Form],
        refits: &'a [Refit],
        (alone, single): (Option<Score>, Option<usize>),
        (inflation, noise, floor): (f64, f64, f64),
    ) -> Option<(usize, usize, &'a Arc<Fitted>)> {
        let mut pairs: Vec<(&Refit, Score)> = refits
            .iter()
            .filter(|r| r.forms.len() == 2)
            .map(|r| (r, score(before, &r.fitted, inflation, floor)))
            .filter(|(r, score)| {
                let both: Vec<&Form> = r.forms.iter().map(|k| &forms[*k]).collect();
                refusal(&both, before, (&r.fitted, score), inflation, (noise, &self.data.shown_unit)).is_none()
            })
            .collect();
        let far = pairs.iter().all(|(_, s)| s.is_far(noise));
        pairs.sort_by(|a, b| if far { a.1.rmse.total_cmp(&b.1.rmse) } else { a.1.total.total_cmp(&b.1.total) });
        let (pair, together) = pairs.first()?;
        if alone.is_some_and(|alone| fewer_do(&alone, together, noise)) {
            return None;
        }
        // A member that stands alone is named by itself: the next round finds the other. So is one that does in another pair
        // that data never fitted cannot tell from the best.
        let as_good = |s: &Score| if far { s.rmse < CLEARLY * together.rmse } else { s.total < together.total + WORTH };
        if single.is_some_and(|k| pairs.iter().any(|(r, s)| r.forms.contains(&k) && as_good(s))) {
            return None;
        }
        let (a, b) = (pair.forms[0], pair.forms[1]);
        let force = |k: usize| self.share(&forms[k], &pair.fitted);
        let (lead, second) = if force(b) > force(a) { (b, a) } else { (a, b) };
        Some((lead, second, &pair.fitted))
    }
}
