//! From proposals to fits to a ruling: what a look at a model tries beside it.

use std::sync::Arc;

use super::decide::variance_inflation;
use super::effects::{Direction, Form, logarithmic};
use super::error::GapError;
use super::fit::{Fitted, Pace, STEPS, WHOLE};
use super::judge::{Hypothesis, Ruling, beats, judge, least_lead};
use super::outcome::Choice;
use super::parameters::Parameters;
use super::progress::Progress;
use super::propose::Proposal;
use super::rule::{BORNE, CLOSE_GAIN, EXPLAINS, FAR, HOPELESS, LEAD, MATTERS_NOISES, SHOWN};
use super::search::{Listener, Search};
use super::structure::{Composition, choice};
use super::words::titles;
use nalgebra::{DMatrix, DVector};
use sindyscope_core::refine::{Bar, FitOptions, Landed, Point, Refined, Structure as _, land, misfit, refine};
use sindyscope_core::study::Cancel;

/// Sets that lack a part of the best one are fitted for so many of the best.
const CLOSED: usize = 2;
/// Factors of a range in which a quantity is looked for, and places in it.
const LOOKED_THROUGH: [f64; 3] = [10.0, 1.3, 1.05];
const PLACES: usize = 12;

impl Search {
    /// The model with exactly these effects, fitted.
    pub(super) fn fit_exactly(&self, choices: &[Choice], cancel: &Cancel) -> Result<Fitted, GapError> {
        let impossible = || GapError::Stage(titles(choices));
        let base = self.fitted(&[], cancel)?;
        let motion = self.data.motion(&base).ok_or_else(impossible)?;
        let all = self.forms(&base, &motion);
        let forms: Vec<Form> = choices.iter().filter_map(|c| all.iter().find(|f| choice(f) == *c).cloned()).collect();
        if forms.len() < choices.len() {
            return Err(impossible());
        }
        let start = self.data.propose_exactly(&base.composition, &base.parameters.inner, &forms, cancel);
        let set = start.and_then(|start| self.fitted_set(start, None, cancel)).ok_or_else(impossible)?;
        Ok(Fitted::clone(&set.fitted))
    }

    /// Sets of effects beside a fitted model, each fitted to its end, the model without them among them; and what the
    /// comparison says. None if cancelled.
    pub(super) fn tried(
        &self,
        before: &Arc<Fitted>,
        forms: &[Form],
        room: usize,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Option<(Vec<Hypothesis>, Ruling)> {
        let data = &self.data;
        let (composition, inner) = (&before.composition, &before.parameters.inner);
        let mut proposals = data.propose(composition, inner, forms, cancel);
        proposals.retain(|p| p.forms.len() <= room);
        // What has no force of its own to be regressed on is always tried.
        for (k, form) in forms.iter().enumerate().filter(|(_, form)| form.is_outside()) {
            let with = self.with(composition, form);
            let all = with.inner_after(composition, inner, &[]);
            let coefficients = before.parameters.coefficients.clone();
            let mut composition = with;
            composition.scales = data.scales(&composition, &all, &self.smoothed_paths());
            proposals.push(Proposal {
                forms: vec![k],
                composition,
                shared: Parameters { coefficients, inner: all }.row(),
                gain: f64::NEG_INFINITY,
            });
        }
        let bar = Bar::default();
        let mut sets = vec![self.hypothesis(Vec::new(), Fitted::clone(before), cancel)];
        let count = proposals.len();
        // The gain in the regression of a set that explains the data: others are fitted only near it, or to be shown.
        let mut explained: Option<f64> = None;
        let mut shown = 0;
        for (k, proposal) in proposals.into_iter().enumerate() {
            if cancel.is_cancelled() {
                return None;
            }
            let single = proposal.forms.len() == 1;
            if let Some(gain) = explained {
                let near = proposal.gain > (1.0 - CLOSE_GAIN) * gain - LEAD;
                let common = proposal.forms.iter().all(|k| forms[*k].is_common());
                let is_shown = single && common && shown < SHOWN && proposal.gain > 0.0;
                if !near && !is_shown {
                    continue;
                }
            }
            shown += usize::from(single && explained.is_some());
            tell(Progress::Step("Fitting the likeliest sets of effects", 0.3 + 0.6 * k as f64 / count as f64));
            let gain = proposal.gain;
            let set = self.fitted_set(proposal, Some(&bar), cancel);
            if let Some(set) = set {
                let explains = set.unborne.is_none() && data.is_within(&set.fitted, data.noise, EXPLAINS, cancel);
                explained = explained.or(explains.then_some(gain));
                sets.push(set);
            }
        }
        self.close(&mut sets, before, forms, cancel);
        if let Some(again) = self.again(before, cancel).map(|again| self.hypothesis(Vec::new(), again, cancel))
            && again.sum() > sets[0].sum()
        {
            sets[0] = again;
        }
        if cancel.is_cancelled() {
            return None;
        }
        sets.iter().for_each(|set| self.keep(Arc::clone(&set.fitted)));
        // Where nothing explains the data every set is wrong in some way still, and densities say too much.
        let explained = sets.iter().any(|s| s.unborne.is_none() && s.fitted.error() < MATTERS_NOISES * data.noise);
        let least = least_lead(self.audit.single_tone);
        let far = if explained { least } else { least.max(FAR.ln() * data.unseen() as f64) };
        let ruling = judge(&sets, forms, least, far);
        Some((sets, ruling))
    }

    /// Fits what the best sets contain: a set is named only against each part of it, fitted as carefully.
    fn close(&self, sets: &mut Vec<Hypothesis>, before: &Arc<Fitted>, forms: &[Form], cancel: &Cancel) {
        let mut best: Vec<usize> = (1..sets.len()).collect();
        best.sort_by(|a, b| sets[*b].sum().total_cmp(&sets[*a].sum()));
        let wanted: Vec<Vec<usize>> = best.into_iter().take(CLOSED).map(|k| sets[k].forms.clone()).collect();
        for set in wanted {
            for (place, form) in set.iter().enumerate() {
                let mut rest = set.clone();
                rest.remove(place);
                let simpler = (0..forms.len()).filter(|k| forms[*form].includes(&forms[*k]));
                let parts = simpler.map(|k| [&rest[..], &[k]].concat()).chain([rest.clone()]);
                for part in parts.filter(|p| !p.is_empty()).collect::<Vec<_>>() {
                    if cancel.is_cancelled() || sets.iter().any(|s| same(&s.forms, &part)) {
                        continue;
                    }
                    let chosen: Vec<Form> = part.iter().map(|k| forms[*k].clone()).collect();
                    let (composition, inner) = (&before.composition, &before.parameters.inner);
                    let start = self.data.propose_exactly(composition, inner, &chosen, cancel);
                    if let Some(start) = start {
                        let start = Proposal { forms: part, ..start };
                        sets.extend(self.fitted_set(start, None, cancel));
                    }
                }
            }
        }
    }

    /// The present model fitted as its rivals are: one that sits in a worse basin makes everything seem to help. None where
    /// that comes to nothing better.
    fn again(&self, before: &Fitted, cancel: &Cancel) -> Option<Fitted> {
        let composition = &before.composition;
        let start = self.data.propose_exactly(composition, &before.parameters.inner, &[], cancel)?;
        let landed = self.landed(composition, &start.shared, None, cancel)?;
        (landed.refined.rss < 0.99 * before.refined.rss || landed.whole != (before.level == WHOLE))
            .then(|| self.data.judged(composition.clone(), landed, cancel))
    }

    /// Fits a proposal; a damper of the base may push where data never fitted say so.
    fn fitted_set(&self, proposal: Proposal, bar: Option<&Bar>, cancel: &Cancel) -> Option<Hypothesis> {
        let Proposal { forms, composition, shared, .. } = proposal;
        let free = Composition { passive: false, ..composition.clone() };
        let lifted = self.landed(&free, &shared, bar, cancel).map(|landed| {
            let fitted = self.data.judged(free.clone(), landed, cancel);
            self.hypothesis(forms.clone(), fitted, cancel)
        });
        let pushes = lifted.as_ref().is_some_and(|set| {
            let parameters = &set.fitted.parameters;
            let dampers = free.dampers(&parameters.inner);
            dampers.into_iter().any(|(k, _)| parameters.coefficients[k] > 0.0)
        });
        let hopeless = lifted.as_ref().zip(bar).is_some_and(|(l, b)| l.fitted.refined.rss > HOPELESS * b.least());
        if !composition.passive || !pushes || hopeless {
            return lifted;
        }
        let lifted = lifted?;
        let start = Composition::clamped(&composition, &lifted.fitted.refined.point.shared);
        let bounded = self.landed(&composition, &start, bar, cancel).map(|landed| {
            let fitted = self.data.judged(composition.clone(), landed, cancel);
            self.hypothesis(forms, fitted, cancel)
        });
        match bounded {
            Some(bounded) if !beats(&lifted, &bounded, least_lead(false)) => Some(bounded),
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
        let pace = bar.map_or(Pace::Thorough, Pace::Rival);
        let goal = data.goal(WHOLE, super::data::Data::options(&cancelled, STEPS, pace));
        let point = Point::new(composition, &whole, shared.to_vec(), false);
        let landed = land(composition, &whole, &point, goal).map(|l| self.looked_through(composition, l, cancel));
        if let (Some(landed), Some(bar)) = (&landed, bar) {
            bar.reached(landed.refined.rss);
        }
        landed
    }

    /// No slope leads across a jump of the response: an inner quantity in which it jumps is looked for in its whole range, then
    /// nearer by.
    fn looked_through(&self, composition: &Composition, landed: Landed, cancel: &Cancel) -> Landed {
        let inner = composition.positions().inner.forms;
        let jumping = composition.forms.iter().zip(inner).flat_map(|(form, places)| form.inner.iter().zip(places));
        let mut best = landed;
        let cancelled = || cancel.is_cancelled();
        let options = super::data::Data::options(&cancelled, STEPS, Pace::Thorough);
        for (quantity, place) in jumping.filter(|(quantity, _)| quantity.jumps && best.whole) {
            for width in LOOKED_THROUGH {
                let present = best.refined.point.shared[place];
                let (low, high) = quantity.bounds;
                let range = logarithmic((present / width).max(low), (present * width).min(high), PLACES);
                let at = |value: f64| {
                    let mut point = best.refined.point.clone();
                    point.shared[place] = value;
                    Some((misfit(composition, &best.runs, &point, options)?, point))
                };
                let nearest = range.into_iter().filter_map(at).min_by(|a, b| a.0.total_cmp(&b.0));
                if let Some((_, point)) = nearest.filter(|(left, _)| *left < best.refined.rss)
                    && let Some(refined) = refine(composition, &best.runs, &point, options)
                    && refined.rss < best.refined.rss
                {
                    best.refined = refined;
                }
            }
        }
        best
    }

    fn hypothesis(&self, forms: Vec<usize>, fitted: Fitted, cancel: &Cancel) -> Hypothesis {
        let blocks = self.data.densities(&fitted, cancel);
        let unborne = self.unborne(&fitted);
        Hypothesis { forms, fitted: Arc::new(fitted), blocks, unborne }
    }

    /// Why the fitted data do not bear every part of a model's effects: an amplitude less than three standard errors from zero,
    /// or an inner quantity at a bound.
    pub(super) fn unborne(&self, fitted: &Fitted) -> Option<String> {
        let refined = &*fitted.refined;
        let inflation = variance_inflation(fitted, self.data.frequency, self.data.fit()[0].interval);
        let Parameters { coefficients: values, inner } = &fitted.parameters;
        let positions = fitted.composition.positions();
        let places = fitted.composition.places(inner);
        for (index, form) in fitted.composition.forms.iter().enumerate() {
            let own: Vec<usize> = places[index].clone().map(|k| positions.coefficients[k]).collect();
            let mut open = Vec::new();
            for ((coefficient, k), position) in form.coefficients.iter().zip(places[index].clone()).zip(own) {
                let error = refined.std_error(position).map(|e| e * inflation.sqrt());
                if coefficient.sign == Direction::Any {
                    open.push(position);
                } else if refined.at_bound[position] {
                    return Some(format!(
                        "its {} comes out zero: to help it would have to act the wrong way round",
                        coefficient.name
                    ));
                } else if values[k].abs() < BORNE * error.unwrap_or(0.0) {
                    return Some(format!("its {} cannot be told from zero", coefficient.name));
                }
            }
            if !open.is_empty() && size(refined, &open) < BORNE * BORNE * inflation * open.len() as f64 {
                return Some("its size cannot be told from zero".to_owned());
            }
            for ((quantity, value), position) in
                form.inner.iter().zip(&inner.forms[index]).zip(&positions.inner.forms[index])
            {
                let (low, high) = quantity.bounds;
                let near = 0.01 * (high - low).abs();
                let error = refined.std_error(*position).map_or(0.0, |e| e * inflation.sqrt());
                if low < 0.0 && high > 0.0 && form.coefficients.is_empty() && value.abs() < BORNE * error {
                    return Some(format!("its {} cannot be told from zero", quantity.name));
                }
                if quantity.jumps && !self.feels(fitted, *position, low, inflation) {
                    return Some(format!("its {} cannot be told from {low}", quantity.name));
                }
                if value - low < near.min(0.01 * value.abs()) || high - value < near.min(0.01 * high.abs()) {
                    return Some(format!(
                        "{} runs to the end of what is sensible: these data do not exercise it",
                        quantity.name
                    ));
                }
            }
        }
        None
    }

    /// True if the fitted data tell a parameter in which the response jumps from another value: no slope gives its error.
    fn feels(&self, fitted: &Fitted, position: usize, other: f64, inflation: f64) -> bool {
        let refined = &*fitted.refined;
        let mut point = refined.point.clone();
        point.shared[position] = other;
        let never = || false;
        let driven = fitted.level != WHOLE;
        let options = FitOptions { driven, ..super::data::Data::options(&never, 0, Pace::Thorough) };
        let there = misfit(&fitted.composition, &fitted.runs, &point, options);
        let variance = refined.rss / refined.samples.max(1) as f64;
        there.is_none_or(|rss| rss - refined.rss > BORNE * BORNE * inflation * variance)
    }

    pub(super) fn smoothed_paths(&self) -> Vec<super::columns::Path> {
        self.data.fit().iter().map(super::data::Series::path).collect()
    }
}

impl Composition {
    /// A row of shared parameters moved into this composition's bounds.
    fn clamped(&self, row: &[f64]) -> Vec<f64> {
        row.iter().zip(self.bounds()).map(|(v, (low, high))| v.clamp(low, high)).collect()
    }
}

/// True if two sets hold the same forms.
pub(super) fn same(a: &[usize], b: &[usize]) -> bool {
    a.len() == b.len() && a.iter().all(|k| b.contains(k))
}

/// Wald's statistic of parameters that are zero without an effect; infinite where the fit gives no covariance.
fn size(refined: &Refined, places: &[usize]) -> f64 {
    let n = places.len();
    if places.iter().any(|k| *k >= refined.covariance.nrows()) {
        return f64::INFINITY;
    }
    let covariance = DMatrix::from_fn(n, n, |i, j| refined.covariance[(places[i], places[j])]);
    let values = DVector::from_iterator(n, places.iter().map(|k| refined.point.shared[*k]));
    covariance.cholesky().map_or(f64::INFINITY, |c| values.dot(&c.solve(&values)))
}
