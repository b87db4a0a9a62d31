//! Which sets are scored, and which of them are worth a fit.

use std::collections::HashMap;

use super::gram::{Gram, MOST};
use super::{FoundSets, GridPoint, Score, SetRegression};
use crate::constants::{Constants, LARGEST_SET};
use crate::effects::{Direction, Form};
use sindyscope_core::parallel::prelude::*;

impl SetRegression<'_> {
    /// Singles, pairs, the best pairs with a third, and finer grids about what they hold.
    pub(super) fn search(&mut self, points: &mut Vec<GridPoint>) -> FoundSets {
        let gram = self.gram();
        let mut found = FoundSets::new();
        self.note(&gram, points, vec![Vec::new()], &mut found, Score::LeftOut);
        self.note(&gram, points, (0..points.len()).map(|p| vec![p]).collect(), &mut found, Score::LeftOut);
        let pairs = self.pairs(&gram, points);
        self.note(&gram, points, pairs, &mut found, Score::LeftOut);
        let best = best_of(&found, 2, self.model.data.constants.pairs_extended);
        let mut thirds: Vec<Vec<usize>> = Vec::new();
        for pair in &best {
            for form in 0..self.forms.len() {
                // Points of a form are sorted best first.
                let of_form = (0..points.len()).filter(|p| points[*p].form == form).take(2);
                thirds
                    .extend(of_form.filter(|p| self.go_together(pair, *p, points)).map(|p| [&pair[..], &[p]].concat()));
            }
        }
        self.note(&gram, points, thirds, &mut found, Score::LeftOut);
        // Held on to, it would be copied where columns are added to it.
        drop(gram);
        self.zoom(points, &mut found, self.model.data.constants.zoomed, Score::LeftOut);
        found
    }

    /// For each two forms the pair of points that leaves least.
    fn pairs(&self, gram: &Gram, points: &[GridPoint]) -> Vec<Vec<usize>> {
        let of_first = |a: usize| {
            if self.model.cancel.is_cancelled() {
                return Vec::new();
            }
            let mut best: HashMap<usize, (f64, usize)> = HashMap::new();
            for b in a + 1..points.len() {
                if !self.go_together(&[a], b, points) {
                    continue;
                }
                let set = [a, b];
                let columns = self.columns_of(&set, points);
                let Some(solution) =
                    gram.solve(&columns).filter(|s| self.stands(&set, points, &columns, &s.coefficients))
                else {
                    continue;
                };
                let entry = best.entry(points[b].form).or_insert((f64::INFINITY, b));
                if solution.left < entry.0 {
                    *entry = (solution.left, b);
                }
            }
            best.into_iter()
                .map(move |(form, (left, b))| ((points[a].form, form), left, vec![a, b]))
                .collect::<Vec<_>>()
        };
        let all: Vec<_> = (0..points.len()).into_par_iter().flat_map_iter(of_first).collect();
        let mut best: HashMap<(usize, usize), (f64, Vec<usize>)> = HashMap::new();
        for (key, left, set) in all {
            let entry = best.entry(key).or_insert((f64::INFINITY, Vec::new()));
            if left < entry.0 {
                *entry = (left, set);
            }
        }
        best.into_values().map(|(_, set)| set).collect()
    }

    /// True if a point's effect may stand beside those of a set: another kind, replacing other terms.
    fn go_together(&self, set: &[usize], point: usize, points: &[GridPoint]) -> bool {
        let new = &points[point];
        set.iter().all(|p| {
            let had = &points[*p];
            let apart = !new.replaces.iter().any(|r| had.replaces.contains(r));
            apart && !self.forms[had.form].is_kin(&self.forms[new.form])
        })
    }

    /// Scores sets and keeps the best of each set of forms.
    pub(super) fn note(
        &self,
        gram: &Gram,
        points: &[GridPoint],
        sets: Vec<Vec<usize>>,
        found: &mut FoundSets,
        by: Score,
    ) {
        let scored: Vec<(Vec<usize>, f64, Vec<usize>)> = sets
            .into_par_iter()
            .filter_map(|set| {
                let columns = self.columns_of(&set, points);
                if columns.len() > MOST || self.model.cancel.is_cancelled() {
                    return None;
                }
                let solution = gram.solve(&columns)?;
                if !self.stands(&set, points, &columns, &solution.coefficients) {
                    return None;
                }
                let score = match by {
                    Score::LeftOut => gram.predictive(&columns, self.model.rows.worth),
                    Score::AllRows => -solution.left,
                };
                let mut key: Vec<usize> = set.iter().map(|p| points[*p].form).collect();
                key.sort_unstable();
                Some((key, score, set))
            })
            .collect();
        for (key, score, set) in scored {
            let known = found.get(&key).map_or(f64::NEG_INFINITY, |f| f.0);
            if score > known {
                found.insert(key, (score, set));
            }
        }
    }

    /// What a set gains over all rows; −∞ where its signs are wrong. For a few sets, for it makes the products anew.
    pub(super) fn gain(&self, set: &[usize], points: &[GridPoint]) -> f64 {
        let columns = self.columns_of(set, points);
        let chosen: Vec<Vec<f64>> =
            std::iter::once(0).chain(columns.iter().copied()).map(|c| self.pool[c].clone()).collect();
        let gram = Gram::new(&chosen, std::slice::from_ref(&(0..self.model.rows.len())), self.model.cancel);
        gram.solve(&(1..chosen.len()).collect::<Vec<_>>()).map_or(f64::NEG_INFINITY, |s| -s.left)
    }

    /// True if no coefficient of a form acts the wrong way round.
    pub(super) fn signs_hold(&self, form: usize, values: &[f64]) -> bool {
        let mut coefficients = self.forms[form].coefficients.iter().zip(values);
        self.is_turning(form) || coefficients.all(|(c, v)| c.sign == Direction::Any || !c.sign.forbids(*v))
    }

    /// True if every coefficient of a set has a physical sign, and a force that remembers leaves no damper that pushes.
    fn stands(&self, set: &[usize], points: &[GridPoint], columns: &[usize], coefficients: &[f64]) -> bool {
        // A branch that remembers holds the acceleration itself, and with it its noise: what it takes no damper gives back.
        let pushing = |(column, c): (&usize, &f64)| {
            self.model.dampers.contains(column)
                && c / self.scales[*column] > self.model.data.constants.pushing_rate(self.model.data.period)
        };
        if set.iter().any(|p| points[*p].remembers) && columns.iter().zip(coefficients).any(pushing) {
            return false;
        }
        let mut from = coefficients.len() - set.iter().map(|p| points[*p].columns.len()).sum::<usize>();
        set.iter().all(|p| {
            let own = &coefficients[from..from + points[*p].columns.len()];
            from += own.len();
            self.signs_hold(points[*p].form, &own[points[*p].rewrites..])
        })
    }

    /// Where few blocks can be left out in turn, the effects and pairs that leave least where all rows count at once: each block may
    /// hold what no other does, as the growth of a motion before it settles. Of three effects some always follow few periods.
    pub(super) fn leaving_least(&mut self, found: &FoundSets, points: &mut Vec<GridPoint>) -> Vec<(f64, Vec<usize>)> {
        let constants = &self.model.data.constants;
        if !self.model.rows.few_blocks {
            return Vec::new();
        }
        let mut least = FoundSets::new();
        let sets = found.values().map(|(_, set)| set).filter(|set| set.len() < LARGEST_SET).cloned().collect();
        let gram = self.gram();
        self.note(&gram, points, sets, &mut least, Score::AllRows);
        self.zoom(points, &mut least, constants.pairs_extended, Score::AllRows);
        let gram = self.gram();
        let left = |set: &Vec<usize>| gram.solve(&self.columns_of(set, points)).map_or(f64::INFINITY, |s| s.left);
        let mut near = Vec::new();
        for size in 1..LARGEST_SET {
            let best = best_of(&least, size, constants.proposals_of(LARGEST_SET));
            let first = best.first().map_or(f64::INFINITY, left);
            near.extend(best.into_iter().filter(|set| self.is_near(left(set), first)));
        }
        let predictive = |set: &[usize]| gram.predictive(&self.columns_of(set, points), self.model.rows.worth);
        near.into_iter().map(|set| (predictive(&set), set)).collect()
    }

    /// The single effect that leaves least where all rows count at once, if that is far less than every single one that was found
    /// leaves. The blocks that are left out in turn speak against a stop if one of them holds most of what hits it: the others know
    /// too little of it. It is as likely as what was found first.
    pub(super) fn overlooked(&mut self, found: &FoundSets, points: &mut Vec<GridPoint>) -> Option<(f64, Vec<usize>)> {
        let constants = &self.model.data.constants;
        let gram = self.gram();
        let left = |set: &[usize]| gram.solve(&self.columns_of(set, points)).map_or(f64::INFINITY, |s| s.left);
        let known =
            best_of(found, 1, constants.proposals_of(1)).iter().map(|set| left(set)).fold(f64::INFINITY, f64::min);
        let singles = (0..points.len()).map(|p| vec![p]).collect();
        let mut least = FoundSets::new();
        self.note(&gram, points, singles, &mut least, Score::AllRows);
        let first = best_of(&least, 1, 1).into_iter().find(|set| constants.far_behind * left(set) < known)?;
        least.retain(|_, (_, set)| *set == first);
        self.zoom(points, &mut least, 1, Score::AllRows);
        let score = found.values().map(|(score, _)| *score).fold(f64::NEG_INFINITY, f64::max);
        least.into_values().next().map(|(_, set)| (score, set))
    }

    /// True if what a set leaves is next to as little as the least, where all rows count at once.
    fn is_near(&self, left: f64, least: f64) -> bool {
        let rows = self.model.rows.worth * self.model.rows.len() as f64;
        0.5 * rows * (left / least).ln() < self.model.data.constants.lead
    }

    /// Of effects that are met most often, the sets of each size that leave least, with those that leave next to as little. All
    /// rows count at once: in a decay the rows that are left out in turn are the only ones of their amplitude.
    pub(super) fn common(&mut self, points: &[GridPoint]) -> Vec<(f64, Vec<usize>)> {
        let gram = self.gram();
        let of_common: Vec<usize> = (0..points.len()).filter(|p| self.forms[points[*p].form].is_common()).collect();
        let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
        let mut out: Vec<(f64, Vec<usize>)> = Vec::new();
        for _ in 0..LARGEST_SET {
            let larger = sets.iter().flat_map(|set| of_common.iter().map(move |p| (set, *p)));
            let larger = larger.filter(|(set, p)| set.last().is_none_or(|last| last < p));
            sets = larger
                .filter(|(set, p)| self.go_together(set, *p, points))
                .map(|(set, p)| [&set[..], &[p]].concat())
                .collect();
            let left = |set: &Vec<usize>| {
                let columns = self.columns_of(set, points);
                let solution = gram.solve(&columns)?;
                let stands = self.stands(set, points, &columns, &solution.coefficients);
                stands.then_some((solution.left, columns))
            };
            let mut own: Vec<(f64, Vec<usize>, &Vec<usize>)> =
                sets.par_iter().filter_map(|set| left(set).map(|(left, columns)| (left, columns, set))).collect();
            own.sort_by(|a, b| a.0.total_cmp(&b.0));
            let Some(least) = own.first().map(|o| o.0) else { continue };
            let count = self.model.data.constants.proposals_of(LARGEST_SET);
            let near = own.into_iter().take_while(|(left, ..)| self.is_near(*left, least)).take(count);
            out.extend(near.map(|(_, columns, set)| (gram.predictive(&columns, self.model.rows.worth), set.clone())));
        }
        out
    }
}

/// The sets of a size with the highest scores.
pub(super) fn best_of(found: &FoundSets, size: usize, count: usize) -> Vec<Vec<usize>> {
    let mut all: Vec<_> = found.iter().filter(|(key, _)| key.len() == size).collect();
    all.sort_by(|a, b| b.1.0.total_cmp(&a.1.0).then_with(|| a.0.cmp(b.0)));
    all.into_iter().take(count).map(|(_, (_, set))| set.clone()).collect()
}

/// The sets to be fitted, by score, so many of each size. What a set contains (one effect less, or a poorer kind of one) comes
/// before it, unless the set brings more than a crumb of all that was gained.
pub(super) fn ranked(found: &FoundSets, forms: &[Form], crumb: f64, constants: &Constants) -> Vec<(f64, Vec<usize>)> {
    let none = found.get(&Vec::new()).map_or(f64::NEG_INFINITY, |f| f.0);
    let mut placed: Vec<(f64, bool, &Vec<usize>, &Vec<usize>)> = Vec::new();
    for (key, (score, set)) in found.iter().filter(|(key, _)| !key.is_empty()) {
        let mut held = Vec::new();
        for (k, form) in key.iter().enumerate() {
            let mut rest = key.clone();
            rest.remove(k);
            held.push(rest.clone());
            for simpler in (0..forms.len()).filter(|s| forms[*form].is_richer_kind_of(&forms[*s])) {
                let mut other = [&rest[..], &[simpler]].concat();
                other.sort_unstable();
                held.push(other);
            }
        }
        let best = held.iter().filter_map(|h| found.get(h)).map(|f| f.0).fold(f64::NEG_INFINITY, f64::max);
        let enough = best + crumb * (best - none).max(0.0);
        let stands = *score > enough;
        let place = if stands { *score } else { score.min(best) - 1e-6 * best.abs() };
        placed.push((place, stands || key.len() == 1, key, set));
    }
    placed.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.2.cmp(b.2)));
    let mut counts = [0; LARGEST_SET];
    placed.retain(|(place, stands, key, _)| {
        let count = &mut counts[key.len() - 1];
        let keep = *stands && place.is_finite() && *count < constants.proposals_of(key.len());
        *count += usize::from(keep);
        keep
    });
    placed.into_iter().map(|(.., key, set)| (found[key].0, set.clone())).collect()
}
