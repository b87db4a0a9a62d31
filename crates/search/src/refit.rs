//! Refining a model with one form added: where it may start, and which of its starts leads home.

use std::sync::Arc;

use sindyscope_core::parallel::prelude::*;

use super::data::Data;
use super::effects::{Direction, Form, logarithmic};
use super::fit::{Care, FEW_STEPS, Fitted, Pace, WHOLE, carried};
use super::parameters::Parameters;
use super::screen::{Motion, Screened};
use super::search::{PROMISING, Refit, Search};
use super::site::Placed;
use super::structure::Composition;
use sindyscope_core::refine::{Bar, FitOptions, Point, Refined, Run, climb, levels, misfit};
use sindyscope_core::study::Cancel;

/// Inner values that a form is refined from; one where there are many samples.
const STARTS: usize = 2;
const MANY: usize = 6_000;

/// Where a refinement's coefficients come from.
#[derive(Clone, Copy, Debug)]
enum Way {
    /// The present model's, and none of the effect's, moved by this share of what the screen, to first order, would change.
    Moved(f64),
    /// Those that suit the measured motion, whatever the present model's are.
    Afresh,
}

/// What is tried where the response gets no nearer by the screen's whole change.
const WAYS: [Way; 3] = [Way::Moved(0.2), Way::Moved(0.02), Way::Afresh];
/// An inner quantity in which the response jumps is looked at so many times above and below the present value, one after
/// the other, in so many places.
const LOOKED_AT: [f64; 3] = [10.0, 1.3, 1.05];
const PLACES: usize = 12;
/// Places in its whole range where nothing but another effect's fit tells where it may lie.
const EVERYWHERE: usize = 48;
/// A start whose misfit is so many times that of another is not refined.
pub(super) const DISTANT: f64 = 2.0;
/// A simpler form that leaves less than so many times what a richer one does explains as much.
pub(super) const HARDLY: f64 = 1.1;
/// Refinements that are gone on with at most, and how many times the least sum of squares theirs may be.
const POLISHED: usize = 4;
pub(super) const CLOSE: f64 = 2.25;
/// Twice the log-likelihood that the present model must gain by another start to be taken from there.
const BETTER: f64 = 10.0;

/// So many values of a positive quantity within a range.
fn among(low: f64, high: f64, places: usize) -> Vec<Vec<f64>> {
    logarithmic(low, high, places).into_iter().map(|v| vec![v]).collect()
}

impl Search {
    /// The effects of which a form is a richer kind are replaced by it.
    pub(super) fn with(&self, before: &Composition, form: &Form) -> Composition {
        let simpler = before
            .forms
            .iter()
            .position(|f| form.contains.contains(&f.effect) && f.form == form.form && form.effect != "sensor_offset");
        match simpler {
            Some(index) => before.without(index).with(form),
            None => before.with(form),
        }
    }

    /// Refines the model with a form added, from the best starts of the screen.
    pub(super) fn refit(
        &self,
        before: &Fitted,
        motion: &Motion,
        screened: &Screened,
        (index, form): (usize, &Form),
        bar: Option<&Bar>,
        cancel: &Cancel,
    ) -> Option<Fitted> {
        let data = &self.data;
        let composition = self.with(&before.composition, form);
        let inner = if form.inner.is_empty() {
            vec![Vec::new()]
        } else {
            screened.starts(index, if before.refined.samples > MANY { 1 } else { STARTS })
        };
        let runs: Vec<Run> = data.whole();
        let cancelled = || cancel.is_cancelled();
        let options =
            FitOptions { frozen: false, driven: false, steps: 0, effort: usize::MAX, bar: None, cancelled: &cancelled };
        let attempt = |inner: &[f64], way: Way| {
            let (composition, point) = self.start(before, &composition, motion, screened, (form, inner, way))?;
            let left = misfit(&composition, &runs, &point, options).unwrap_or(f64::INFINITY);
            Some((left, composition, point))
        };
        // Where the whole change leads away from the data, a share of it; the whole may lie in a better basin all the same.
        let begin = |inner: &Vec<f64>| {
            let whole = attempt(inner, Way::Moved(1.0));
            let nearer = |start: &(f64, Composition, Point)| start.0 < before.refined.rss;
            let part = if whole.as_ref().is_some_and(nearer) {
                None
            } else {
                WAYS.iter().filter_map(|way| attempt(inner, *way)).min_by(|a, b| a.0.total_cmp(&b.0))
            };
            whole.into_iter().chain(part)
        };
        let mut starts: Vec<(f64, Composition, Point)> = inner.iter().flat_map(begin).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = starts.first().map_or(0.0, |s| s.0);
        let expected = screened.expected(index);
        let pace = bar.map_or(Pace::Thorough, Pace::Rival);
        let mut best: Option<(Composition, Refined)> = None;
        for (misfit, composition, start) in starts {
            // A start far behind another leads nowhere else, unless the screen promised far more than was found so far.
            let short = |found: &Refined| {
                expected < PROMISING * before.refined.rss && found.rss > DISTANT * expected && !pace.surpassed(expected)
            };
            if misfit > DISTANT * nearest && best.as_ref().is_some_and(|(_, found)| !short(found)) {
                continue;
            }
            if let Some(refined) = data.refine(&composition, &start, expected, pace, cancel)
                && best.as_ref().is_none_or(|(_, b)| refined.rss < b.rss)
            {
                best = Some((composition, refined));
            }
        }
        let (composition, mut refined) = best?;
        let positions = composition.positions().inner.forms.pop()?;
        for (inner, k) in form.inner.iter().zip(positions).filter(|(inner, _)| inner.jumps) {
            // No slope leads across a jump of the response, and the screen does not see one: the whole range is looked
            // through, then what is near.
            for width in LOOKED_AT {
                let present = refined.point.shared[k];
                let (low, high) = inner.bounds;
                let range = logarithmic((present / width).clamp(low, high), (present * width).clamp(low, high), PLACES);
                let at = |value: f64| {
                    let mut point = refined.point.clone();
                    point.shared[k] = value;
                    let left = misfit(&composition, &runs, &point, options)?;
                    Some((left, point))
                };
                let nearest = range.into_iter().filter_map(at).min_by(|a, b| a.0.total_cmp(&b.0));
                if let Some((_, point)) = nearest.filter(|(left, _)| *left < refined.rss)
                    && let Some(better) = data.refine(&composition, &point, f64::INFINITY, pace, cancel)
                    && better.rss < refined.rss
                {
                    refined = better;
                }
            }
        }
        let care = pace.care(refined.rss);
        Some(data.judge(composition, refined, care, cancel))
    }

    /// Where a refinement starts; inner values are those of the grid.
    fn start(
        &self,
        before: &Fitted,
        after: &Composition,
        motion: &Motion,
        screened: &Screened,
        (form, inner, way): (&Form, &[f64], Way),
    ) -> Option<(Composition, Point)> {
        let data = &self.data;
        let Parameters { coefficients, inner: old_inner } = &before.parameters;
        let old_composed = before.composition.compose(old_inner);
        let addition = form.addition(inner);
        let all_inner = after.inner_after(&before.composition, old_inner, inner);
        let composed = after.compose(&all_inner);
        let mut values = match way {
            Way::Afresh => data.start(&composed.terms, &composed.internals, &motion.measured, 0.0)?,
            Way::Moved(share) => {
                let columns = data.columns(
                    &addition,
                    &motion.measured,
                    &motion.variations,
                    (&old_composed.terms, coefficients),
                    &before.by_record(&before.refined.simulated),
                );
                let (moved, own) = screened.together(&columns)?;
                let now = |k: usize| coefficients[k] + share * moved.get(k).copied().unwrap_or(0.0);
                let replaced = |mass: usize| -> f64 {
                    let gone = addition.replaces.iter().filter(|t| t.mass == mass);
                    gone.filter_map(|term| old_composed.terms.iter().position(|t| t == term)).map(now).sum()
                };
                // Terms may be rewritten by an effect on the input: what they were is told by their place.
                let sources = after.sources(&before.composition, &all_inner, old_inner);
                let mut fresh = own.iter();
                let value = |(source, term): (&Option<usize>, &Placed)| match source {
                    Some(k) => now(*k),
                    None => {
                        // A term that a replaced, simpler effect had already keeps what it had.
                        let had = old_composed.terms.iter().position(|t| t == term);
                        let had = had.map_or_else(|| replaced(term.mass), now);
                        had + share * fresh.next().copied().unwrap_or(0.0)
                    }
                };
                sources.iter().zip(&composed.terms).map(value).collect()
            }
        };
        // A start on the wrong side of zero is moved to the right one, small.
        let place = after.places(&all_inner).pop()?;
        let physical = form.coefficients.iter().map(|c| c.sign);
        for (value, sign) in values[place].iter_mut().zip(physical) {
            if sign != Direction::Any && (*value == 0.0 || sign.forbids(*value)) {
                let small = 1e-3 * value.abs().max(f64::MIN_POSITIVE);
                *value = if sign == Direction::Against { -small } else { small };
            }
        }
        let mut composition = after.clone();
        composition.scales = data.scales(&composition, &all_inner, &motion.measured);
        let point = carried(&before.composition, &composition, &before.refined.point);
        let shared = Parameters { coefficients: values, inner: all_inner }.row();
        Some((composition, Point { shared, ..point }))
    }

    /// Tries what the best refits contain as special cases, from where those landed: a simpler form that was lost from its own
    /// start must not lose to a richer one for that.
    pub(super) fn try_simpler(&self, before: &Fitted, forms: &[Form], refits: &mut Vec<Refit>, cancel: &Cancel) {
        let least = refits.iter().map(|r| r.fitted.refined.rss).fold(f64::INFINITY, f64::min);
        let mut tried: Vec<(usize, Fitted)> = Vec::new();
        for rich in refits.iter().filter(|r| r.fitted.refined.rss < CLOSE * least) {
            let form = &forms[rich.forms[0]];
            let simpler = (0..forms.len()).filter(|k| {
                form.contains.contains(&forms[*k].effect)
                    && forms[*k].form == form.form
                    && forms[*k].can_be_looked_for()
            });
            for k in simpler {
                let known = refits.iter().find(|r| r.forms == [k]).map_or(f64::INFINITY, |r| r.fitted.refined.rss);
                if known < HARDLY * rich.fitted.refined.rss || cancel.is_cancelled() {
                    continue;
                }
                let simplified = self.with(&before.composition, &forms[k]);
                if let Some(fitted) = self.simplified(simplified, &rich.fitted, &forms[k], cancel)
                    && fitted.refined.rss < known
                {
                    tried.push((k, fitted));
                }
            }
        }
        for (k, fitted) in tried {
            refits.retain(|r| r.forms != [k]);
            refits.push(Refit { forms: vec![k], fitted: Arc::new(fitted) });
        }
    }

    /// A composition whose last form is a simpler one in a richer one's place, started from that one's values; what stands
    /// inside the simpler one is looked for in its whole range, then nearer by.
    pub(super) fn simplified(
        &self,
        composition: Composition,
        rich: &Fitted,
        form: &Form,
        cancel: &Cancel,
    ) -> Option<Fitted> {
        let direct = self.looked_for(composition.clone(), rich, form, rich.level, cancel);
        let near = |f: &Fitted| f.refined.rss < DISTANT * rich.refined.rss;
        let (data, whole) = (&self.data, self.data.whole());
        if rich.level != WHOLE || direct.as_ref().is_some_and(near) || levels(&whole, data.period) == 0 {
            return direct;
        }
        // Along whole records one stop missed leads astray: from short segments that grow it is not.
        let climbed = || {
            let first = self.looked_for(composition, rich, form, 0, cancel)?;
            let cancelled = || cancel.is_cancelled();
            let goal = data.goal(WHOLE, Data::options(&cancelled, FEW_STEPS, Pace::Again));
            let last = climb(&first.composition, &whole, first.landed(), goal).pop().filter(|l| l.whole)?;
            Some(data.judged(first.composition, last, cancel))
        };
        [climbed(), direct].into_iter().flatten().min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss))
    }

    /// A composition fitted along segments of a level from the values that another one landed at; what stands inside its last
    /// form, where that is one quantity, is looked for in its whole range, then nearer by.
    fn looked_for(
        &self,
        composition: Composition,
        from: &Fitted,
        form: &Form,
        level: usize,
        cancel: &Cancel,
    ) -> Option<Fitted> {
        let [inner] = form.inner.as_slice() else {
            return self.transplanted(composition, from, &[Vec::new()], level, cancel);
        };
        let (low, high) = inner.bounds;
        let mut best = self.transplanted(composition, from, &among(low, high, EVERYWHERE), level, cancel)?;
        for width in &LOOKED_AT[1..] {
            let present = *best.parameters.inner.forms.last()?.first()?;
            let near = among((present / width).max(low), (present * width).min(high), PLACES);
            let again = self.transplanted(best.composition.clone(), &best, &near, level, cancel);
            if let Some(again) = again.filter(|a| a.refined.rss < best.refined.rss) {
                best = again;
            }
        }
        Some(best)
    }

    /// The present model fitted from the best refit's values, if that is better than it was: a model that sits in a worse
    /// basin than its rivals makes everything seem to help.
    pub(super) fn rebased(&self, before: &Fitted, refits: &[Refit], cancel: &Cancel) -> Option<Fitted> {
        let best = refits.iter().min_by(|a, b| a.fitted.refined.rss.total_cmp(&b.fitted.refined.rss))?;
        let inflation = self.inflation(&best.fitted);
        let again =
            self.transplanted(before.composition.clone(), &best.fitted, &[Vec::new()], best.fitted.level, cancel)?;
        let gain = before.refined.samples as f64 / inflation * (before.refined.rss / again.refined.rss).ln();
        (gain > BETTER).then_some(again)
    }

    /// A composition fitted from the values that another one landed at, and from those of its last inner quantities, one of the
    /// given, that leave least.
    fn transplanted(
        &self,
        mut composition: Composition,
        from: &Fitted,
        last: &[Vec<f64>],
        level: usize,
        cancel: &Cancel,
    ) -> Option<Fitted> {
        let data = &self.data;
        let had = &from.parameters;
        let terms = from.terms();
        let paths: Vec<_> = data.fit().iter().map(super::data::Series::path).collect();
        let mut begin = |last: &Vec<f64>| {
            let inner = composition.inner_after(&from.composition, &had.inner, last);
            composition.scales = data.scales(&composition, &inner, &paths);
            let value = |(term, scale): (&Placed, &f64)| {
                terms.iter().position(|t| t == term).map_or(-scale.abs(), |k| had.coefficients[k])
            };
            let composed = composition.compose(&inner);
            let coefficients = composed.terms.iter().zip(&composition.scales.coefficients).map(value).collect();
            let shared = Parameters { coefficients, inner }.row();
            Point { shared, ..carried(&from.composition, &composition, &from.refined.point) }
        };
        let start = match last {
            [only] => begin(only),
            several => {
                let points: Vec<Point> = several.iter().map(begin).collect();
                let left =
                    points.into_iter().filter_map(|p| Some((data.misfit_at(&composition, &p, level, cancel)?, p)));
                left.min_by(|a, b| a.0.total_cmp(&b.0))?.1
            }
        };
        let landed = data.refine_at(&composition, &start, level, cancel)?;
        Some(data.judged(composition, landed, cancel))
    }

    /// Goes on with the refinements that ended for want of effort, if they are near the best: rivals are compared at
    /// their best.
    pub(super) fn polished(
        &self,
        mut refits: Vec<(usize, Option<Fitted>)>,
        cancel: &Cancel,
    ) -> Vec<(usize, Option<Fitted>)> {
        let least = refits.iter().filter_map(|(_, f)| f.as_ref()).map(|f| f.refined.rss).fold(f64::INFINITY, f64::min);
        refits.sort_by(|a, b| {
            let rss = |f: &Option<Fitted>| f.as_ref().map_or(f64::INFINITY, |f| f.refined.rss);
            rss(&a.1).total_cmp(&rss(&b.1))
        });
        refits.par_iter_mut().take(POLISHED).filter_map(|(_, f)| f.as_mut()).for_each(|fitted| {
            if fitted.refined.converged || fitted.refined.rss > CLOSE * least {
                return;
            }
            let better =
                self.data.refine(&fitted.composition, &fitted.refined.point, f64::INFINITY, Pace::Again, cancel);
            if let Some(better) = better.filter(|b| b.rss < fitted.refined.rss) {
                *fitted = self.data.judge(fitted.composition.clone(), better, Care::Full, cancel);
            }
        });
        refits
    }
}
