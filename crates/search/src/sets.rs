//! Sets of effects, where adding one at a time to a fit of the whole record leads nowhere.
//!
//! Single effects and pairs are estimated together with the base model in the weak form, fitted along segments of two
//! periods, held against data never fitted, and the best are followed over longer and longer segments. All that are compared
//! are compared on the same segments, the model without them among them.

use std::collections::HashMap;

use sindyscope_core::parallel::prelude::*;

use super::data::Data;
use super::effects::Form;
use super::fit::{FEW_STEPS, Fitted, Pace, WHOLE, Wanted};
use super::parameters::{InnerValues, Parameters};
use super::refit::{DISTANT, HARDLY};
use super::search::{Refit, Search};
use super::structure::Composition;
use super::weak::{Projector, Weak};
use sindyscope_core::refine::{
    Bar, FitOptions, Goal, Landed, Run, Structure as _, climb, levels, look, sampled, shoot,
};
use sindyscope_core::study::Cancel;

/// Grid points of a form that are shot from.
const STARTS: usize = 2;
/// Pairs that are shot.
const PAIRS: usize = 6;
/// Pairs with the best single effect in them that are shot at most, beyond those if need be.
const WITH_FIRST: usize = 3;
/// Points of a form's grid that stand for it among the pairs.
const THINNED: usize = 8;
/// Of the segments every so many-th is fitted at a first look, and the fewest that are enough for it.
const EVERY: usize = 3;
const FEWEST: usize = 12;
/// Sets that are held against data never fitted.
const JUDGED: usize = 12;
/// Sets that are fitted on where they have not settled: those whose sum of squares is at most so many times the least.
const HOPEFUL: f64 = 25.0;
/// Times that such a fit goes on at most, and what it leaves then, as a share of what it left before, to go on once more.
const ROUNDS: usize = 8;
const HELPS: f64 = 0.8;
/// Times the noise, on the data fitted and on those never fitted, that one effect leaves at most where two are not looked for.
const ENOUGH: (f64, f64) = (1.15, 1.25);
/// Trials are shot that leave at most so many times the least in the weak form.
const PLAUSIBLE: f64 = 30.0;
/// Sets that are followed over longer segments.
const KEPT: usize = 5;
/// How many times the best's error on data never fitted a set may leave along the shortest segments to be followed further.
const BEHIND: f64 = 1.5;
/// Share of what the base model leaves in the weak form that a form must explain to be tried.
const FAINT: f64 = 0.005;
/// How many times the noise the best leaves where longer segments tell nothing.
const FAR: f64 = 3.0;
/// How many times its error along the shortest segments, or the noise, a set may leave on data never fitted along longer ones.
const HOLDS: f64 = 1.3;
/// Share of the motion below which whole records have not been lost.
const NEAR: f64 = 0.3;
/// How many times the contrast between a set and the model without it must grow for longer segments to judge.
const MORE: f64 = 1.3;
/// A pair's columns that are alike to this share are one effect twice.
const SAME: f64 = 1e-4;

/// A set of effects with values to start from.
struct Trial {
    /// Indices of the forms.
    forms: Vec<usize>,
    composition: Composition,
    shared: Vec<f64>,
    /// What the weak form leaves, as a share of the acceleration.
    left: f64,
}

/// Inner values of two forms, and what they leave of the acceleration together in the weak form.
#[derive(Default)]
struct PairPoint {
    left: f64,
    first: Vec<f64>,
    second: Vec<f64>,
}

/// Sets of effects fitted on the same segments.
pub(super) struct Sets {
    /// The model without any.
    pub(super) before: Fitted,
    /// Indices of the forms, and the fit with them.
    pub(super) tried: Vec<(Vec<usize>, Fitted)>,
}

impl Sets {
    /// How many times the error of the best set the model without it leaves on data never fitted.
    fn contrast(&self) -> f64 {
        self.tried.first().map_or(1.0, |(_, best)| self.before.held_out_error() / best.held_out_error())
    }
}

/// What sets are compared with, and how they are fitted.
#[derive(Clone, Copy)]
struct Comparison<'a> {
    /// The model without them.
    before: &'a Fitted,
    forms: &'a [Form],
    weak: &'a Weak<'a>,
    /// The sets along the shortest segments, best first.
    judged: &'a [Judged],
    /// What was fitted to whole records.
    refits: &'a [Refit],
    goal: Goal<'a>,
}

/// A set of forms by index, fitted along the shortest segments.
type Judged = (Vec<usize>, Fitted, Landed);

/// Of fits sorted best first those that are judged: of several starts of one set the best.
fn keep_best<T>(sorted: &mut Vec<T>, set: impl Fn(&T) -> &Vec<usize>) {
    let mut seen: Vec<Vec<usize>> = Vec::new();
    sorted.retain(|fit| {
        let new = !seen.contains(set(fit));
        if new {
            seen.push(set(fit).clone());
        }
        new
    });
    sorted.truncate(JUDGED);
}

/// True if two sets hold the same forms, in whatever order.
fn same_set(a: &[usize], b: &[usize]) -> bool {
    a.len() == b.len() && a.iter().all(|k| b.contains(k))
}

/// The next shorter segments; whole records are doubled so often.
fn shorter(level: usize, top: usize) -> usize {
    if level == WHOLE { top - 1 } else { level - 1 }
}

/// The sets that are followed over longer segments: the best of all, and of either size the best on data never fitted and on
/// those fitted. What the best leaves far behind along short segments does not overtake it along longer ones.
fn followed_further(judged: &[Judged], noise: f64) -> Vec<usize> {
    let nearest = judged[0].1.held_out_error().max(noise);
    let mut kept: Vec<usize> =
        (0..judged.len().min(KEPT)).filter(|k| judged[*k].1.held_out_error() < BEHIND * nearest).collect();
    for size in [1, 2] {
        let of_size = || (0..judged.len()).filter(|k| judged[*k].0.len() == size);
        let fits_best = of_size().min_by(|a, b| judged[*a].1.error().total_cmp(&judged[*b].1.error()));
        for k in of_size().next().into_iter().chain(fits_best) {
            if !kept.contains(&k) {
                kept.push(k);
            }
        }
    }
    kept
}

impl Search {
    /// Tries single effects and pairs; none if cancelled, or if nothing can be followed.
    pub(super) fn sets(&self, before: &Fitted, forms: &[Form], refits: &[Refit], cancel: &Cancel) -> Option<Sets> {
        let data = &self.data;
        let weak = Weak::new(data);
        let trials = self.singles(&weak, before, forms, cancel);
        let whole = data.whole();
        let cancelled = || cancel.is_cancelled();
        let goal = data.goal(WHOLE, Data::options(&cancelled, FEW_STEPS, Pace::Again));
        let least = trials.iter().map(|t| t.left).fold(f64::INFINITY, f64::min);
        let mut judged = self.shot(trials, goal, cancel);
        // Where one effect explains the data along short segments, two are not looked for.
        let explained = judged.first().is_some_and(|(_, f, _)| data.is_within(f, goal.noise, ENOUGH, cancel));
        if !explained && !cancel.is_cancelled() {
            let first = judged.first().map(|(set, ..)| set[0]);
            let pairs = self.pairs(&weak, before, forms, (least, first), cancel);
            judged.extend(self.shot(pairs, goal, cancel));
        }
        if cancel.is_cancelled() || judged.is_empty() {
            return None;
        }
        judged.sort_by(|a, b| a.1.held_out_error().total_cmp(&b.1.held_out_error()));
        let left = |f: &Fitted| f.held_out_error().max(f.error());
        let comparison = Comparison { before, forms, weak: &weak, judged: &judged, refits, goal };
        if left(&judged[0].1) > FAR * goal.noise || levels(&whole, data.period) == 0 {
            let tried = judged.iter().map(|(forms, fitted, _)| (forms.clone(), fitted.clone())).collect();
            return self.compared(&comparison, tried, 0, cancel);
        }
        let kept = followed_further(&judged, goal.noise);
        let climbed: Vec<(usize, Vec<Landed>)> = kept
            .into_par_iter()
            .map(|k| (k, climb(&judged[k].1.composition, &whole, judged[k].2.clone(), goal)))
            .collect();
        let top = levels(&whole, data.period).max(1);
        let mut level = self.common_level(&climbed, &judged, top, cancel)?;
        let longest: Vec<(usize, Landed)> =
            climbed.into_iter().filter_map(|(k, held)| Some((k, held.into_iter().next_back()?))).collect();
        // A model that lacks what the sets have may run away where they do not: then shorter segments compare them.
        let there = loop {
            let tried = self.along(&comparison, &longest, level, cancel);
            match self.compared(&comparison, tried, level, cancel) {
                Some(there) => break there,
                None if level == 0 || cancel.is_cancelled() => return None,
                None => level = shorter(level, top),
            }
        };
        if level == WHOLE {
            return Some(there);
        }
        // Along short segments an initial state makes up for much of a wrong force: where none of the sets is the whole
        // truth, longer ones may tell them apart all the same.
        let tried = self.along(&comparison, &longest, WHOLE, cancel);
        let further = self.compared(&comparison, tried, WHOLE, cancel);
        let lost = NEAR * data.loudest();
        let tells_more =
            |s: &Sets| s.tried.first().is_some_and(|(_, f)| left(f) < lost) && s.contrast() > MORE * there.contrast();
        Some(further.filter(tells_more).unwrap_or(there))
    }

    /// The sets, fitted along segments of a level from what they were fitted to along others.
    fn along(
        &self,
        comparison: &Comparison<'_>,
        from: &[(usize, Landed)],
        level: usize,
        cancel: &Cancel,
    ) -> Vec<(Vec<usize>, Fitted)> {
        let Comparison { judged, refits, goal, .. } = *comparison;
        let data = &self.data;
        let whole = data.whole();
        let composition = |k: usize| &judged[k].1.composition;
        let mut landed: Vec<(usize, Landed)> = from
            .par_iter()
            .filter_map(|(k, last)| {
                let there = if (last.whole && level == WHOLE) || last.level == level {
                    last.clone()
                } else {
                    let start = (&*last.refined.point.shared, Some(last.of(composition(*k))));
                    shoot(composition(*k), &whole, start, level, goal, FEW_STEPS)?
                };
                // Whole records may have led to a better basin than segments that grew.
                let refit = refits.iter().find(|r| r.forms == judged[*k].0);
                let again = refit.filter(|_| level != WHOLE).and_then(|r| {
                    let landed = r.fitted.landed();
                    let start = (&*landed.refined.point.shared, Some(landed.of(&r.fitted.composition)));
                    shoot(&r.fitted.composition, &whole, start, level, goal, FEW_STEPS)
                });
                Some((*k, again.filter(|a| a.refined.rss < there.refined.rss).unwrap_or(there)))
            })
            .collect();
        // Rivals are compared at their best.
        let least = landed.iter().map(|(_, l)| l.refined.rss).fold(f64::INFINITY, f64::min);
        landed.par_iter_mut().for_each(|(k, landed)| self.settled(composition(*k), landed, (level, least), goal));
        landed
            .into_par_iter()
            .map(|(k, there)| (judged[k].0.clone(), data.judged(composition(k).clone(), there, cancel)))
            .collect()
    }

    /// Sets beside the model without them, along segments as long; none if cancelled.
    fn compared(
        &self,
        comparison: &Comparison<'_>,
        mut tried: Vec<(Vec<usize>, Fitted)>,
        level: usize,
        cancel: &Cancel,
    ) -> Option<Sets> {
        let Comparison { before, weak, goal, .. } = *comparison;
        self.add_simpler(comparison, &mut tried, cancel);
        tried.sort_by(|a, b| a.1.held_out_error().total_cmp(&b.1.held_out_error()));
        let before = self.without_them(before, weak, tried.first().map(|t| &t.1), level, goal, cancel)?;
        (!cancel.is_cancelled()).then_some(Sets { before, tried })
    }

    /// Adds to the best sets those with a simpler form in a richer one's place, from where the richer one landed: a set that was
    /// lost from its own start must not lose to a richer one for that.
    fn add_simpler(&self, comparison: &Comparison<'_>, tried: &mut Vec<(Vec<usize>, Fitted)>, cancel: &Cancel) {
        let Comparison { before, forms, .. } = *comparison;
        let least = tried.iter().map(|(_, f)| f.refined.rss).fold(f64::INFINITY, f64::min);
        let mut wanted: Vec<(Vec<usize>, &Fitted)> = Vec::new();
        for (set, rich) in tried.iter().filter(|(_, f)| f.refined.rss < DISTANT * least) {
            for (place, richer) in set.iter().enumerate() {
                let others: Vec<usize> = [&set[..place], &set[place + 1..]].concat();
                let simpler = |k: &usize| forms[*richer].is_richer_kind_of(&forms[*k]) && forms[*k].can_be_looked_for();
                for k in (0..forms.len()).filter(simpler) {
                    let with: Vec<usize> = others.iter().copied().chain([k]).collect();
                    let known = tried.iter().filter(|(s, _)| same_set(s, &with)).map(|(_, f)| f.refined.rss);
                    let known = known.fold(f64::INFINITY, f64::min);
                    if known > HARDLY * rich.refined.rss && !wanted.iter().any(|(s, _)| same_set(s, &with)) {
                        wanted.push((with, rich));
                    }
                }
            }
        }
        let found: Vec<(Vec<usize>, Fitted)> = wanted
            .into_par_iter()
            .filter_map(|(set, rich)| {
                let forms_of_set = || set.iter().map(|k| &forms[*k]);
                let composition = forms_of_set().fold(before.composition.clone(), |with, form| self.with(&with, form));
                Some((set.clone(), self.simplified(composition, rich, forms_of_set().next_back()?, cancel)?))
            })
            .collect();
        for (set, fitted) in found {
            tried.retain(|(s, f)| !same_set(s, &set) || f.refined.rss <= fitted.refined.rss);
            tried.push((set, fitted));
        }
    }

    /// Fits trials along the shortest segments, and holds the best against data never fitted: the best of each set, best first.
    fn shot(&self, mut trials: Vec<Trial>, goal: Goal<'_>, cancel: &Cancel) -> Vec<Judged> {
        let whole = self.data.whole();
        let least = trials.iter().map(|t| t.left).fold(f64::INFINITY, f64::min);
        trials.retain(|t| t.left < PLAUSIBLE * least);
        // The likeliest first: the others are given up where they stay behind what these reach.
        trials.sort_by(|a, b| a.left.total_cmp(&b.left));
        let bar = Bar::default();
        let among_rivals = Goal { options: FitOptions { bar: Some(&bar), ..goal.options }, ..goal };
        let trials = self.promising(trials, &whole, goal);
        let shots = trials.into_iter().map(|t| {
            let landed = shoot(&t.composition, &whole, (&t.shared, None), 0, among_rivals, FEW_STEPS)?;
            Some((t.forms, t.composition, landed))
        });
        let mut shot: Vec<(Vec<usize>, Composition, Landed)> = shots.flatten().collect();
        shot.sort_by(|a, b| a.2.refined.rss.total_cmp(&b.2.refined.rss).then_with(|| a.0.cmp(&b.0)));
        keep_best(&mut shot, |(forms, ..)| forms);
        let least = shot.first().map_or(0.0, |s| s.2.refined.rss);
        shot.par_iter_mut().for_each(|(_, composition, landed)| self.settled(composition, landed, (0, least), goal));
        let mut judged: Vec<Judged> = shot
            .into_par_iter()
            .map(|(forms, composition, landed)| (forms, self.data.judged(composition, landed.clone(), cancel), landed))
            .collect();
        judged.sort_by(|a, b| a.1.held_out_error().total_cmp(&b.1.held_out_error()));
        judged
    }

    /// Of many trials those that leave least along some of the segments, from where that led them; the likeliest first.
    fn promising(&self, trials: Vec<Trial>, whole: &[Run], goal: Goal<'_>) -> Vec<Trial> {
        let segments = sampled(whole, self.data.period, EVERY);
        if trials.len() <= JUDGED || segments.len() < FEWEST {
            return trials;
        }
        let bar = Bar::default();
        let goal = Goal { options: FitOptions { bar: Some(&bar), ..goal.options }, ..goal };
        let looks = trials.into_iter().map(|t| {
            let (shared, rss) = look(&t.composition, &segments, &t.shared, goal, FEW_STEPS)?;
            Some((rss, Trial { shared, ..t }))
        });
        let mut looked: Vec<(f64, Trial)> = looks.flatten().collect();
        looked.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.forms.cmp(&b.1.forms)));
        keep_best(&mut looked, |(_, t)| &t.forms);
        looked.into_iter().map(|(_, t)| t).collect()
    }

    /// Goes on with a fit that ended for want of steps, if it is near the least sum of squares, while that helps much: at a
    /// switch a step is as often too long as too short, and a fit may be far from where it ends.
    fn settled(&self, composition: &Composition, landed: &mut Landed, (level, least): (usize, f64), goal: Goal<'_>) {
        let whole = self.data.whole();
        for _ in 0..ROUNDS {
            if landed.refined.converged || landed.refined.rss > HOPEFUL * least {
                return;
            }
            let shared = &landed.refined.point.shared;
            let further =
                shoot(composition, &whole, (shared, Some(landed.of(composition))), level, goal, 2 * FEW_STEPS);
            let Some(further) = further.filter(|f| f.refined.rss < landed.refined.rss) else { return };
            let much = further.refined.rss < HELPS * landed.refined.rss;
            *landed = further;
            if !much {
                return;
            }
        }
    }

    /// The longest segments that the best of the sets can follow, on the data fitted and on those never fitted.
    fn common_level(
        &self,
        climbed: &[(usize, Vec<Landed>)],
        judged: &[Judged],
        top: usize,
        cancel: &Cancel,
    ) -> Option<usize> {
        let data = &self.data;
        let longest = |held: &Vec<Landed>| held.last().map_or(0, |l| if l.whole { WHOLE } else { l.level });
        let level = climbed.iter().map(|(_, held)| longest(held)).max()?;
        // Of those that get as far, the one that was best at the beginning.
        let (k, held) = climbed.iter().filter(|(_, held)| longest(held) == level).min_by_key(|(k, _)| *k)?;
        let (_, fitted, _) = &judged[*k];
        let bound = HOLDS * fitted.held_out_error().max(data.noise);
        let shared = &held.last()?.refined.point.shared;
        let expected = held.last()?.error();
        let mut at = level;
        while at > 0 {
            let wanted = Wanted { level: at, period: data.period, error: expected };
            let folds = data.left_of_held_out(&fitted.composition, shared, wanted, cancel);
            if folds.is_none_or(|error| error < bound) {
                break;
            }
            at = shorter(at, top);
        }
        Some(at)
    }

    /// The model without new effects at a level: from its own values, from the weak form's, and from the best set's motion,
    /// whichever fits best. In a worse basin anything would seem to help.
    fn without_them(
        &self,
        before: &Fitted,
        weak: &Weak<'_>,
        best: Option<&Fitted>,
        level: usize,
        goal: Goal<'_>,
        cancel: &Cancel,
    ) -> Option<Fitted> {
        let data = &self.data;
        let composition = &before.composition;
        let whole = data.whole();
        let inner = &before.parameters.inner;
        let mut starts = vec![before.refined.point.shared.clone()];
        if let Some(estimate) = weak.estimate(composition, inner) {
            let coefficients = estimate.coefficients;
            starts.push(Parameters { coefficients, inner: inner.clone() }.row());
        }
        let same_zero = |best: &&Fitted| best.composition.offset() == composition.offset();
        let motion = best.filter(same_zero).map(|best| (best.landed(), &best.composition));
        let motion = motion.as_ref().map(|(landed, composition)| landed.of(*composition));
        let bar = Bar::default();
        let goal = Goal { options: FitOptions { bar: Some(&bar), ..goal.options }, ..goal };
        let starts =
            starts.iter().flat_map(|shared| [Some((shared, None)), motion.map(|motion| (shared, Some(motion)))]);
        let fits = starts
            .flatten()
            .filter_map(|(shared, states)| shoot(composition, &whole, (shared, states), level, goal, 2 * FEW_STEPS));
        let mut fits: Vec<Landed> = fits.collect();
        if level == WHOLE && before.level == WHOLE {
            fits.push(before.landed());
        }
        let least = fits.into_iter().min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss))?;
        Some(data.judged(composition.clone(), least, cancel))
    }

    /// A composition with forms added, ready to be fitted from these inner values.
    fn with_all(&self, before: &Fitted, added: &[(&Form, &[f64])]) -> (Composition, InnerValues) {
        let mut composition = before.composition.clone();
        let mut inner = before.parameters.inner.clone();
        for (form, values) in added {
            let next = self.with(&composition, form);
            inner = next.inner_after(&composition, &inner, values);
            composition = next;
        }
        let paths: Vec<_> = self.data.fit().iter().map(super::data::Series::path).collect();
        composition.scales = self.data.scales(&composition, &inner, &paths);
        (composition, inner)
    }

    fn trial(&self, weak: &Weak<'_>, before: &Fitted, forms: &[Form], added: &[(usize, &[f64])]) -> Option<Trial> {
        let with: Vec<(&Form, &[f64])> = added.iter().map(|(k, inner)| (&forms[*k], *inner)).collect();
        let (composition, inner) = self.with_all(before, &with);
        let estimate = weak.estimate(&composition, &inner)?;
        let shared = Parameters { coefficients: estimate.coefficients, inner }.row();
        Some(Trial { forms: added.iter().map(|(k, _)| *k).collect(), composition, shared, left: estimate.left })
    }

    /// Every form from the best points of its grid.
    fn singles(&self, weak: &Weak<'_>, before: &Fitted, forms: &[Form], cancel: &Cancel) -> Vec<Trial> {
        let alone = self.trial(weak, before, forms, &[]).map_or(1.0, |t| t.left);
        let per_form: Vec<Vec<Trial>> = (0..forms.len())
            .into_par_iter()
            .map(|k| {
                if cancel.is_cancelled() {
                    return Vec::new();
                }
                let mut trials: Vec<Trial> = forms[k]
                    .grid()
                    .iter()
                    .filter_map(|inner| self.trial(weak, before, forms, &[(k, inner)]))
                    .filter(|t| t.left < (1.0 - FAINT) * alone || forms[k].is_outside())
                    .collect();
                trials.sort_by(|a, b| a.left.total_cmp(&b.left));
                // The second start is not the best one's neighbour.
                let second = (trials.len() > 2).then_some(2);
                let chosen: Vec<usize> = std::iter::once(0).chain(second).take(STARTS).collect();
                let mut index = 0;
                trials.retain(|_| {
                    index += 1;
                    chosen.contains(&(index - 1))
                });
                trials
            })
            .collect();
        per_form.into_iter().flatten().collect()
    }

    /// The pairs that leave least in the weak form, the base model projected off.
    fn pairs(
        &self,
        weak: &Weak<'_>,
        before: &Fitted,
        forms: &[Form],
        (least, first): (f64, Option<usize>),
        cancel: &Cancel,
    ) -> Vec<Trial> {
        let point_of = |projector: &Projector, added: &[(usize, &[f64])]| {
            let with: Vec<(&Form, &[f64])> = added.iter().map(|(k, inner)| (&forms[*k], *inner)).collect();
            let (composition, inner) = self.with_all(before, &with);
            projector.added(weak, &composition, &inner)
        };
        let thinned = |k: usize| {
            let grid = forms[k].grid();
            let stride = grid.len().div_ceil(THINNED).max(1);
            grid.into_iter().step_by(stride)
        };
        // What rewrites the input is a model of its own; a form that explains nothing alone may do so in company: all take part.
        let (outside, inside): (Vec<usize>, Vec<usize>) = (0..forms.len()).partition(|k| forms[*k].rewrites_input());
        let inside: Vec<usize> = inside.into_iter().filter(|k| !forms[*k].is_outside()).collect();
        let (composition, inner) = self.with_all(before, &[]);
        let projector = weak.projector(&composition, &inner);
        let mut points: Vec<(usize, Vec<f64>, Vec<Vec<f64>>)> = inside
            .par_iter()
            .flat_map_iter(|k| {
                let point = |inner: Vec<f64>| Some((*k, inner.clone(), point_of(&projector, &[(*k, &inner)])?));
                thinned(*k).filter(|_| !cancel.is_cancelled()).filter_map(point).collect::<Vec<_>>()
            })
            .collect();
        points.sort_by_key(|p| p.0);
        let mut best: HashMap<(usize, usize), PairPoint> = HashMap::new();
        let mut offer = |left: f64, a: (usize, &Vec<f64>), b: (usize, &Vec<f64>)| {
            let entry = best.entry((a.0, b.0)).or_insert(PairPoint { left: f64::INFINITY, ..PairPoint::default() });
            if left < entry.left {
                *entry = PairPoint { left, first: a.1.clone(), second: b.1.clone() };
            }
        };
        let gains: Vec<(f64, usize, usize)> = (0..points.len())
            .into_par_iter()
            .flat_map_iter(|a| {
                let (points, projector) = (&points, &projector);
                let rest = projector.rest(&points[a].2);
                (a + 1..points.len())
                    .filter(move |b| points[*b].0 != points[a].0)
                    .filter_map(move |b| Some((projector.gain(&points[a].2, &rest, &points[b].2, SAME)?, a, b)))
            })
            .collect();
        for (gain, a, b) in gains {
            offer(projector.left() - gain, (points[a].0, &points[a].1), (points[b].0, &points[b].1));
        }
        for o in outside {
            for at in thinned(o) {
                let (composition, inner) = self.with_all(before, &[(&forms[o], &at)]);
                let projector = weak.projector(&composition, &inner);
                let lefts: Vec<Option<f64>> = points
                    .par_iter()
                    .map(|(k, inner, _)| {
                        let columns = point_of(&projector, &[(o, &at), (*k, inner)])?;
                        let rest = projector.rest(&columns);
                        Some(rest.iter().map(|r| r * r).sum())
                    })
                    .collect();
                for ((k, inner, _), left) in points.iter().zip(lefts) {
                    if let Some(left) = left {
                        offer(left, (o, &at), (*k, inner));
                    }
                }
            }
        }
        let mut ranked: Vec<((usize, usize), PairPoint)> = best.into_iter().collect();
        ranked.sort_by(|x, y| x.1.left.total_cmp(&y.1.left).then(x.0.cmp(&y.0)));
        let lefts: HashMap<(usize, usize), f64> = ranked.iter().map(|(pair, point)| (*pair, point.left)).collect();
        let left = |a: usize, b: usize| lefts.get(&(a, b)).or_else(|| lefts.get(&(b, a))).copied();
        let mut trials: Vec<Trial> = Vec::new();
        let mut with_first = 0;
        for ((a, b), point) in ranked {
            if cancel.is_cancelled() {
                break;
            }
            // Some of the best effect alone and another take part, wherever they rank.
            let has_first = first.is_some_and(|k| k == a || k == b);
            let (full, without) = (trials.len() >= PAIRS, first.is_none() || with_first >= WITH_FIRST);
            if full && without {
                break;
            }
            if full && !has_first {
                continue;
            }
            // A richer form that explains next to nothing more leaves its place to the simpler one.
            let as_well = |rich: usize, other: usize| {
                let simpler = (0..forms.len()).filter(|k| forms[rich].is_richer_kind_of(&forms[*k]));
                simpler.filter_map(|k| left(k, other)).any(|l| l < HARDLY * point.left)
            };
            if as_well(a, b) || as_well(b, a) {
                continue;
            }
            with_first += usize::from(has_first);
            let same = forms[a].is_kin(&forms[b]);
            let trial = self.trial(weak, before, forms, &[(a, &point.first), (b, &point.second)]);
            trials.extend(trial.filter(|t| !same && t.left < least));
        }
        trials
    }
}
