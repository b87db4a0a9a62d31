//! Sets of effects, where adding one at a time to a fit of the whole record leads nowhere.
//!
//! Single effects and pairs are estimated together with the base model in the weak form, fitted along segments of two
//! periods, held against data never fitted, and the best are followed over longer and longer segments. All that are compared
//! are compared on the same segments, the model without them among them.

use rayon::prelude::*;

use super::effects::Form;
use super::fit::{FEW_STEPS, Fitted, Pace, WHOLE};
use super::search::Search;
use super::structure::Composition;
use super::weak::Weak;
use crate::refine::{Bar, Goal, Landed, Structure as _, climb, levels, shoot};
use crate::study::Cancel;

/// Grid points of a form that are shot from.
const STARTS: usize = 2;
/// Pairs that are shot.
const PAIRS: usize = 6;
/// Points of a form's grid that stand for it among the pairs.
const THINNED: usize = 12;
/// Sets that are held against data never fitted.
const JUDGED: usize = 12;
/// Sets that are followed over longer segments.
const KEPT: usize = 5;
/// Share of what the base model leaves in the weak form that a form must explain to be tried.
const FAINT: f64 = 0.005;
/// How many times the noise the best leaves where longer segments tell nothing.
const FAR: f64 = 3.0;
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

/// Sets of effects fitted on the same segments.
pub(super) struct Sets {
    /// The model without any.
    pub(super) before: Fitted,
    /// Indices of the forms, and the fit with them.
    pub(super) tried: Vec<(Vec<usize>, Fitted)>,
}

impl Search {
    /// Tries single effects and pairs; none if cancelled, or if nothing can be followed.
    pub(super) fn sets(&self, before: &Fitted, forms: &[Form], cancel: &Cancel) -> Option<Sets> {
        let data = &self.data;
        let weak = Weak::new(data);
        let mut trials = self.singles(&weak, before, forms, cancel);
        trials.extend(self.pairs(&weak, before, forms, &trials, cancel));
        if std::env::var("DBG").is_ok() {
            eprintln!("DBG trials {} {:?}", trials.len(), self.trial(&weak, before, forms, &[]).map(|t| (t.left, t.shared)));
        }
        if cancel.is_cancelled() {
            return None;
        }
        let whole = data.whole();
        let cancelled = || cancel.is_cancelled();
        let bar = Bar::default();
        let goal = data.goal(WHOLE, super::data::Data::options(&cancelled, FEW_STEPS, Pace::Thorough));
        let rival = Goal { options: super::data::Data::options(&cancelled, FEW_STEPS, Pace::Rival(&bar)), ..goal };
        trials.sort_by(|a, b| a.left.total_cmp(&b.left));
        if std::env::var("DBG").is_ok() {
            for t in &trials {
                let names: Vec<String> = t.forms.iter().map(|k| format!("{:?}", forms[*k])).collect();
                eprintln!("DBG weak {names:?} left {:.5} {:?}", t.left.sqrt(), t.shared);
            }
        }
        let mut shot: Vec<(Vec<usize>, Composition, Landed)> = trials
            .into_par_iter()
            .filter_map(|t| {
                let landed = shoot(&t.composition, &whole, (&t.shared, None), 0, rival, FEW_STEPS)?;
                Some((t.forms, t.composition, landed))
            })
            .collect();
        shot.sort_by(|a, b| a.2.refined.rss.total_cmp(&b.2.refined.rss));
        // Of several starts of one set the best.
        let mut seen: Vec<Vec<usize>> = Vec::new();
        shot.retain(|(forms, ..)| {
            let new = !seen.contains(forms);
            if new {
                seen.push(forms.clone());
            }
            new
        });
        shot.truncate(JUDGED);
        let mut judged: Vec<(Vec<usize>, Fitted, Landed)> = shot
            .into_par_iter()
            .map(|(forms, composition, landed)| {
                (forms, data.judged(composition, landed.clone(), cancel), landed)
            })
            .collect();
        if cancel.is_cancelled() || judged.is_empty() {
            return None;
        }
        judged.sort_by(|a, b| a.1.held_out_error().total_cmp(&b.1.held_out_error()));
        if std::env::var("DBG").is_ok() {
            eprintln!("period {} noise {} levels {}", data.period, data.noise, levels(&whole, data.period));
            for (f, t, _) in &judged {
                let names: Vec<String> = f.iter().map(|k| format!("{:?}", forms[*k])).collect();
                eprintln!("DBG H0 {names:?} train {:.3} held {:.3} {:?}", t.error() / data.noise, t.held_out_error() / data.noise, t.refined.point.shared);
            }
        }
        let near = judged[0].1.held_out_error() < FAR * goal.noise && levels(&whole, data.period) > 0;
        let mut tried: Vec<(Vec<usize>, Fitted)>;
        let level;
        if near {
            let mut kept: Vec<usize> = (0..judged.len().min(KEPT)).collect();
            for size in [1, 2] {
                let first = (0..judged.len()).find(|k| judged[*k].0.len() == size);
                kept.extend(first.filter(|k| !kept.contains(k)));
            }
            let climbed: Vec<(usize, Vec<Landed>)> = kept
                .into_par_iter()
                .map(|k| (k, climb(&judged[k].1.composition, &whole, judged[k].2.clone(), goal)))
                .collect();
            let longest = climbed.iter().filter_map(|(_, held)| held.last()).map(|l| if l.whole { WHOLE } else { l.level });
            level = longest.max()?;
            tried = climbed
                .into_par_iter()
                .filter_map(|(k, held)| {
                    let last = held.into_iter().next_back()?;
                    let composition = judged[k].1.composition.clone();
                    let there = if last.whole || last.level == level {
                        last
                    } else {
                        let shared = &last.refined.point.shared;
                        shoot(&composition, &whole, (shared, Some(&last)), level, goal, FEW_STEPS)?
                    };
                    Some((judged[k].0.clone(), data.judged(composition, there, cancel)))
                })
                .collect();
        } else {
            level = 0;
            tried = judged.into_iter().map(|(forms, fitted, _)| (forms, fitted)).collect();
        }
        tried.sort_by(|a, b| a.1.held_out_error().total_cmp(&b.1.held_out_error()));
        if std::env::var("DBG").is_ok() {
            for (f, t) in &tried {
                let names: Vec<String> = f.iter().map(|k| format!("{:?}", forms[*k])).collect();
                eprintln!("DBG level {level} {names:?} train {:.3} held {:.3}", t.error() / data.noise, t.held_out_error() / data.noise);
            }
        }
        let before = self.without_them(before, &weak, tried.first().map(|t| &t.1), level, goal, cancel)?;
        (!cancel.is_cancelled()).then_some(Sets { before, tried })
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
        let own = before.refined.point.shared.clone();
        let inner = &own[own.len() - composition.inner_count()..];
        let mut starts = vec![own.clone()];
        if let Some(estimate) = weak.estimate(composition, inner) {
            starts.push(estimate.coefficients.iter().chain(inner).copied().collect());
        }
        let motion = best.map(|b| Landed {
            refined: (*b.refined).clone(),
            runs: b.runs.to_vec(),
            level: b.level,
            whole: b.level == WHOLE,
        });
        let mut fits: Vec<Landed> = Vec::new();
        for shared in &starts {
            let mut alike = motion.clone();
            if composition.offset() != best.is_some_and(|b| !b.refined.point.offsets.is_empty()) {
                alike = None;
            }
            for states in [None, alike.as_ref()] {
                fits.extend(shoot(composition, &whole, (shared, states), level, goal, 2 * FEW_STEPS));
            }
        }
        if level == WHOLE && before.level == WHOLE {
            fits.push(Landed {
                refined: (*before.refined).clone(),
                runs: before.runs.to_vec(),
                level: WHOLE,
                whole: true,
            });
        }
        let least = fits.into_iter().min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss))?;
        Some(data.judged(composition.clone(), least, cancel))
    }

    /// A composition with forms added, ready to be fitted from these inner values.
    fn with_all(&self, before: &Fitted, added: &[(&Form, &[f64])]) -> (Composition, Vec<f64>) {
        let mut composition = before.composition.clone();
        let old = &before.refined.point.shared;
        let mut inner = old[old.len() - composition.inner_count()..].to_vec();
        for (form, values) in added {
            let next = self.with(&composition, form);
            inner = next.inner_after(&composition, &inner);
            inner.extend_from_slice(values);
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
        let shared = estimate.coefficients.into_iter().chain(inner).collect();
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
                let second = trials.iter().skip(2).next().map(|_| 2);
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
        singles: &[Trial],
        cancel: &Cancel,
    ) -> Vec<Trial> {
        let (composition, inner) = self.with_all(before, &[]);
        let projector = weak.projector(&composition, &inner);
        // A form that explains nothing alone may do so in company: all take part.
        let mut points: Vec<(usize, Vec<f64>, Vec<Vec<f64>>)> = (0..forms.len())
            .into_par_iter()
            .flat_map_iter(|k| {
                let grid = forms[k].grid();
                let stride = grid.len().div_ceil(THINNED).max(1);
                let usable = !forms[k].is_outside();
                let points: Vec<_> = grid
                    .into_iter()
                    .step_by(stride)
                    .filter(|_| usable && !cancel.is_cancelled())
                    .filter_map(|inner| {
                        let (with, all) = self.with_all(before, &[(&forms[k], &inner)]);
                        let columns = projector.added(weak, &with, &all)?;
                        Some((k, inner, columns))
                    })
                    .collect();
                points
            })
            .collect();
        points.sort_by_key(|p| p.0);
        let gains: Vec<(f64, usize, usize)> = (0..points.len())
            .into_par_iter()
            .flat_map_iter(|a| {
                let points = &points;
                let projector = &projector;
                let rest = projector.rest(&points[a].2);
                (a + 1..points.len())
                    .filter(move |b| points[*b].0 != points[a].0)
                    .filter_map(move |b| Some((projector.gain(&points[a].2, &rest, &points[b].2, SAME)?, a, b)))
            })
            .collect();
        let mut best: std::collections::HashMap<(usize, usize), (f64, usize, usize)> = std::collections::HashMap::new();
        for (gain, a, b) in gains {
            let entry = best.entry((points[a].0, points[b].0)).or_insert((gain, a, b));
            if gain > entry.0 {
                *entry = (gain, a, b);
            }
        }
        let mut ranked: Vec<(f64, usize, usize)> = best.into_values().collect();
        ranked.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        let least = singles.iter().map(|t| t.left).fold(f64::INFINITY, f64::min);
        let mut trials: Vec<Trial> = Vec::new();
        for (_, a, b) in ranked {
            if trials.len() == PAIRS || cancel.is_cancelled() {
                break;
            }
            let same = forms[points[a].0].is_kin(&forms[points[b].0]);
            let trial = self.trial(weak, before, forms, &[(points[a].0, &points[a].1), (points[b].0, &points[b].1)]);
            trials.extend(trial.filter(|t| !same && t.left < least));
        }
        trials
    }
}
