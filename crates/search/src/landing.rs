//! Fits one set of effects to its end: along whole records, by way of stretches that grow, and across jumps of the response.

use std::sync::Arc;

use super::effects::{Form, logarithmic};
use super::fit::{Fitted, WHOLE};
use super::judge::Hypothesis;
use super::propose::Proposal;
use super::search::Search;
use super::structure::Composition;
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::refine::{
    Bar, FitOptions, Goal, Landed, Point, Structure as _, climb, land, misfit, refine, shoot,
};
use sindyscope_core::study::Cancel;

/// The grid on which a quantity is looked for in which the response jumps: factors of its ranges, one after the other, and
/// places in each. The last is finer than a fit's steps.
const LOOKED_THROUGH: [f64; 3] = [10.0, 1.3, 1.05];
const PLACES: usize = 12;

impl Search {
    /// Fits a proposal; a damper of the base may push where data never fitted say so. A fit that has `lost` is not asked.
    pub(super) fn fitted_set(
        &self,
        proposal: Proposal,
        forms: Vec<usize>,
        bar: Option<&Bar>,
        lost: &(dyn Fn(&Landed) -> bool + Sync),
        cancel: &Cancel,
    ) -> Option<Hypothesis> {
        let Proposal { composition, shared, .. } = proposal;
        let constants = &self.data.constants;
        self.data.counters.fit();
        let free = composition.free();
        let held_against = |composition: &Composition, landed: Landed| {
            let lost = lost(&landed);
            let fitted = match lost || self.data.can_be_asked_later() {
                true => self.data.unasked(composition.clone(), landed, cancel),
                false => self.data.judged(composition.clone(), landed, cancel),
            };
            let may_explain = !fitted.asked && !lost && !self.leaves_more_than_noise(&fitted, cancel);
            let fitted = if may_explain { self.data.asked_now(&fitted, cancel) } else { fitted };
            (self.hypothesis(forms.clone(), fitted, cancel), lost)
        };
        let (lifted, lost) = self.landed(&free, &shared, bar, cancel).map(|landed| held_against(&free, landed))?;
        let parameters = &lifted.fitted.parameters;
        let pushes = free.dampers(&parameters.inner).into_iter().any(|(k, _)| parameters.coefficients[k] > 0.0);
        let hopeless = bar.is_some_and(|bar| lifted.fitted.refined.rss > constants.far_behind * bar.least());
        if !composition.passive || !pushes || hopeless || lost {
            return Some(lifted);
        }
        let start = Composition::clamped(&composition, &lifted.fitted.refined.point.shared);
        let bounded = self.landed(&composition, &start, bar, cancel).map(|landed| held_against(&composition, landed));
        match bounded {
            Some((bounded, _)) if !constants.beats(&lifted, &bounded, constants.lead) => Some(bounded),
            _ => Some(lifted),
        }
    }

    /// Fits a composition from shared parameters to its end.
    pub(super) fn landed(
        &self,
        composition: &Composition,
        shared: &[f64],
        bar: Option<&Bar>,
        cancel: &Cancel,
    ) -> Option<Landed> {
        let data = &self.data;
        let whole = data.whole();
        let cancelled = || cancel.is_cancelled();
        // The base model is shown along whole records, however wrong it is.
        let short_if_wrong = !composition.forms.is_empty();
        let goal = Goal { short_if_wrong, ..data.goal(WHOLE, data.options(&cancelled, data.constants.steps, bar)) };
        let begun = || Point::new(composition, &whole, shared.to_vec(), false);
        let point = self.between_rests(composition, shared, cancel).unwrap_or_else(begun);
        let landed = land(composition, &whole, &point, goal)
            .map(|l| if l.whole { self.looked_through(composition, l, cancel) } else { l });
        if let (Some(landed), Some(bar)) = (&landed, bar) {
            bar.reached(landed.refined.rss);
        }
        landed
    }

    /// A fit along whole records from shared parameters and the motion of another fit.
    pub(super) fn landed_on(
        &self,
        composition: &Composition,
        shared: Vec<f64>,
        motion: &Fitted,
        cancel: &Cancel,
    ) -> Option<Landed> {
        let mut point = Point::new(composition, &motion.runs, shared, false);
        let there = &motion.refined.point.own;
        if point.own.iter().map(Vec::len).eq(there.iter().map(Vec::len)) {
            point.own.clone_from(there);
        }
        let cancelled = || cancel.is_cancelled();
        let options = self.data.options(&cancelled, self.data.constants.steps, None);
        let refined = refine(composition, &motion.runs, &point, options)?;
        Some(Landed { refined, ..motion.landed() })
    }

    /// A fit begun anew along short stretches that grow to whole records; none where those are left with as much.
    pub(super) fn by_stretches(&self, fitted: &Fitted, cancel: &Cancel) -> Option<Landed> {
        let cancelled = || cancel.is_cancelled();
        let constants = &self.data.constants;
        let goal = self.data.goal(WHOLE, self.data.options(&cancelled, constants.steps, None));
        let (composition, shared) = (&fitted.composition, &fitted.refined.point.shared);
        let whole = self.data.whole();
        let first = shoot(composition, &whole, (shared, None), 0, goal, constants.few_steps())?;
        let first = self.looked_through(composition, first, cancel);
        if constants.explaining().0 * first.error() > fitted.error() {
            return None;
        }
        climb(composition, &whole, first, goal).pop()
    }

    /// No slope leads across a jump of the response: an inner quantity in which it jumps is looked for in its whole range, then
    /// nearer by; so is the force of sliding, the force that holds staying as it is.
    fn looked_through(&self, composition: &Composition, landed: Landed, cancel: &Cancel) -> Landed {
        let positions = composition.positions();
        let terms = composition.places(&composition.middle());
        let cancelled = || cancel.is_cancelled();
        let options =
            FitOptions { driven: !landed.whole, ..self.data.options(&cancelled, self.data.constants.steps, None) };
        let mut best = landed;
        for (k, form) in composition.forms.iter().enumerate() {
            let jumping = form.inner.iter().zip(&positions.inner.forms[k]).find(|(quantity, _)| quantity.jumps);
            let Some((quantity, place)) = jumping else { continue };
            let sliding: Vec<usize> = terms[k].clone().map(|t| positions.coefficients[t]).collect();
            let (low, high) = quantity.bounds;
            for width in LOOKED_THROUGH {
                for holds in [false, true] {
                    let present = best.refined.point.shared[*place];
                    let range = logarithmic((present / width).max(low), (present * width).min(high), PLACES);
                    let at = |value: f64| {
                        let mut point = best.refined.point.clone();
                        point.shared[*place] = value;
                        if holds {
                            sliding.iter().for_each(|k| point.shared[*k] *= present / value);
                        }
                        Some((misfit(composition, &best.runs, &point, options)?, point))
                    };
                    let looked: Vec<_> = range.into_par_iter().filter_map(at).collect();
                    let nearest = looked.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
                    if let Some((_, point)) = nearest.filter(|(left, _)| *left < best.refined.rss)
                        && let Some(refined) = refine(composition, &best.runs, &point, options)
                        && refined.rss < best.refined.rss
                    {
                        best.refined = refined;
                    }
                }
            }
        }
        best
    }

    pub(super) fn hypothesis(&self, forms: Vec<usize>, fitted: Fitted, cancel: &Cancel) -> Hypothesis {
        let blocks = self.data.densities(&fitted, cancel);
        let unborne = self.unborne(&fitted);
        Hypothesis { forms, fitted: Arc::new(fitted), blocks, unborne }
    }
}

impl Composition {
    /// The same model, of which a damper may push.
    pub(super) fn free(&self) -> Self {
        Self { passive: false, ..self.clone() }
    }

    /// The model as a fit of it begins: a damper pushes from the start where something bounds what it does.
    pub(super) fn begun(&self) -> Self {
        if self.forms.iter().any(Form::bounds_a_push) { self.free() } else { self.clone() }
    }

    /// A row of shared parameters moved into this composition's bounds.
    pub(super) fn clamped(&self, row: &[f64]) -> Vec<f64> {
        row.iter().zip(self.bounds()).map(|(v, (low, high))| v.clamp(low, high)).collect()
    }
}
