//! The search for the effect that a component's force lacks beside a spring and a damper.
//!
//! Effects are added one at a time; what is named is decided by the comparison of the search for missing effects, on data that
//! no fit saw: records held out, else the end of each fitted record.

use sindyscope_core::signal::{rms, standard_deviation};
use sindyscope_core::study::Cancel;
use sindyscope_search::{CONSTANTS, Lead};
use sindyscope_values::model::{Equation, WeightedTerm};
use sindyscope_values::record::Usage;
use sindyscope_values::term::{Expression, Layout, Symbol, Term, TermFamily};

use super::columns::ComponentRows;
use super::effect::{ForceAddition, ForceForm, InnerUnit, Titles, catalogue};
use super::error::ComponentError;
use super::fit::{ComponentFitter, FittedComponent};
use super::identify::check;
use super::outcome::{ComponentModel, fits};
use super::specimen::{RecordPath, Specimen};

/// The scale of Student's law with five degrees of freedom that normal errors of unit deviation are most likely under.
const SCALE_OF_NORMAL: f64 = 0.8566;
/// Error on data not fitted, over that with an effect, from which the effect matters where the noise is not reached.
const MATTERS_RATIO: f64 = 1.1;

/// A value of an effect.
#[derive(Clone, Debug)]
pub struct EffectParameter {
    /// Its usual symbol.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard error; none where it is held at a bound.
    pub std_error: Option<f64>,
    /// Its unit; empty where it is not known.
    pub unit: String,
    /// It is held at a bound of its range.
    pub at_bound: bool,
}

/// An effect that was tried.
#[derive(Clone, Debug)]
pub struct TriedEffect {
    /// Its name in the interface.
    pub effect: &'static str,
    /// Its name for people, with its form.
    pub title: String,
    /// RMS of what it leaves of data not fitted over the force's RMS.
    pub unseen: f64,
    /// How far the effect that was taken leads it in log predictive density.
    pub behind: f64,
}

/// An effect that was added.
#[derive(Clone, Debug)]
pub struct AddedEffect {
    /// Its name in the interface.
    pub effect: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// Which form of it; empty for the plain one.
    pub form: &'static str,
    /// Its terms.
    pub terms: Vec<Term>,
    /// Its values.
    pub parameters: Vec<EffectParameter>,
    /// The comparison with the nearest rival, or with the model without it.
    pub lead: Lead,
    /// Effects that these data do not tell it from.
    pub rivals: Vec<TriedEffect>,
    /// All others that were tried, the nearest first.
    pub others: Vec<TriedEffect>,
    /// The model with it.
    pub model: ComponentModel,
}

/// What the search found.
#[derive(Clone, Debug)]
pub struct ComponentDiagnosis {
    /// The model before.
    pub base: ComponentModel,
    /// The effects, in the order in which they were added.
    pub steps: Vec<AddedEffect>,
    /// Noise of the force, that of the motion that passes through the model included.
    pub noise_floor: f64,
    /// RMS of what is left of data not fitted, over the standard deviation of the force.
    pub left: f64,
    /// Standard deviation of what is left of data not fitted, but for a few samples that err most, over the noise.
    pub noises: f64,
}

impl ComponentDiagnosis {
    /// The model at the end.
    pub fn last(&self) -> &ComponentModel {
        self.steps.last().map_or(&self.base, |s| &s.model)
    }

    /// True if what is left is no more than the noise.
    pub fn explained(&self) -> bool {
        self.noises <= CONSTANTS.mattering()
    }

    /// The verdict by its name in the interface.
    pub fn verdict(&self) -> &'static str {
        match (self.steps.last(), self.explained()) {
            (None, true) => "nothing_missing",
            (_, false) => "unexplained",
            (Some(step), true) if step.rivals.is_empty() => "named",
            (Some(_), true) => "ambiguous",
        }
    }
}

/// A set with its predictions.
struct ComponentHypothesis {
    fitted: FittedComponent,
    blocks: Vec<f64>,
    unseen: f64,
}

/// The terms of a component before anything is missing: an offset, a spring, a damper, and its inputs.
pub fn base_terms(specimen: &Specimen) -> Vec<Term> {
    let layout = &specimen.layout;
    let mut terms = TermFamily::Constant.terms(layout);
    terms.extend(TermFamily::States.terms(layout));
    terms.extend(TermFamily::Inputs.terms(layout));
    terms
}

/// Searches for what the force of a component lacks; `terms` are those of the base, `most` the largest number of effects.
/// `tell` is told what is being done and the share that is done.
///
/// # Errors
/// Terms of quantities that the records do not give, or cancelled.
pub fn diagnose(
    specimen: &Specimen,
    terms: Option<&[Term]>,
    most: usize,
    tell: &dyn Fn(&'static str, f64),
    cancel: &Cancel,
) -> Result<ComponentDiagnosis, ComponentError> {
    let terms = terms.map_or_else(|| base_terms(specimen), <[Term]>::to_vec);
    check(specimen, &terms)?;
    let forms = catalogue(specimen);
    let fitter = ComponentFitter::new(specimen, &terms, &forms, ComponentRows::new(specimen), cancel);
    // Where the end of the fitted records judges, what is shown in the end is fitted to all of them.
    let held_out = specimen.paths.iter().any(|p| p.usage == Usage::HeldOut);
    let all = ComponentRows::split(specimen, RecordPath::len);
    let whole = (!held_out).then(|| ComponentFitter::new(specimen, &terms, &forms, all, cancel));
    let search = ComponentSearch { fitter, whole, terms: &terms, forms: &forms, titles: Titles::new() };
    let base = search.hypothesis(&[], None).ok_or(ComponentError::Cancelled)?;
    let base_model = search.model(&search.shown(&base.fitted));
    let noise_of_base = search.noise(&base.fitted);
    let mut present = base;
    let mut steps = Vec::new();
    for step in 0..most {
        if search.fitter.deviation_unseen(&present.fitted)
            <= CONSTANTS.mattering() * noise_of_base.min(search.noise(&present.fitted))
            && step > 0
        {
            break;
        }
        let share = |k: usize| (step as f64 + k as f64 / forms.len() as f64) / most as f64;
        let mut tried: Vec<(usize, ComponentHypothesis)> = Vec::new();
        for k in 0..forms.len() {
            if cancel.is_cancelled() {
                return Err(ComponentError::Cancelled);
            }
            tell("trying effects", share(k));
            if present.fitted.set.iter().any(|p| forms[*p].effect == forms[k].effect) {
                continue;
            }
            let kept = present.fitted.set.iter().copied().filter(|p| !forms[k].contains.contains(&forms[*p].effect));
            let set: Vec<usize> = kept.chain([k]).collect();
            if let Some(found) = search.hypothesis(&set, Some(&present.fitted)) {
                tried.push((k, found));
            }
        }
        if cancel.is_cancelled() {
            return Err(ComponentError::Cancelled);
        }
        let Some((taken, ruling)) = search.ruling(&present, tried) else { break };
        steps.push(search.added(&search.shown(&taken.fitted), ruling));
        present = taken;
    }
    let noise = search.noise(&present.fitted);
    let noises = search.fitter.deviation_unseen(&present.fitted) / noise.max(f64::MIN_POSITIVE);
    Ok(ComponentDiagnosis { base: base_model, steps, noise_floor: noise, left: present.unseen, noises })
}

/// Which of the sets that were tried is taken, and what it was held against.
struct ComponentRuling {
    form: usize,
    lead: Lead,
    rivals: Vec<TriedEffect>,
    others: Vec<TriedEffect>,
}

struct ComponentSearch<'a> {
    fitter: ComponentFitter<'a>,
    /// The same on all rows, where some of the fitted records judge.
    whole: Option<ComponentFitter<'a>>,
    terms: &'a [Term],
    forms: &'a [ForceForm],
    titles: Titles,
}

impl ComponentSearch<'_> {
    fn hypothesis(&self, set: &[usize], from: Option<&FittedComponent>) -> Option<ComponentHypothesis> {
        let fitted = self.fitter.fit(set, from)?;
        let blocks = self.fitter.densities(&fitted);
        let unseen = self.fitter.rms_unseen(&fitted) / self.fitter.specimen.scale;
        Some(ComponentHypothesis { fitted, blocks, unseen })
    }

    /// True if the data bear the last effect of a set: each amplitude three standard errors from zero, none that takes energy
    /// out the wrong way round, no inner quantity at a bound.
    fn bears(&self, fitted: &FittedComponent) -> bool {
        let Some(place) = fitted.set.len().checked_sub(1) else { return true };
        let form = &self.forms[fitted.set[place]];
        let range = fitted.of_effect(place, self.forms, self.fitter.base());
        let amplitudes = range.clone().zip(&form.coefficients).all(|(k, c)| {
            let value = fitted.coefficients[k];
            let wrong = c.dissipates && value * self.fitter.specimen.polarity < 0.0;
            // Of an effect with a simpler one inside, the simpler one's part may be next to nothing.
            let small = value.abs() < CONSTANTS.amplitude_errors * fitted.errors[k]
                && (c.dissipates || form.coefficients.len() == 1);
            !(wrong || small)
        });
        amplitudes && fitted.inner[place].iter().zip(&form.inner).all(|(value, inner)| !at_bound(*value, inner.bounds))
    }

    /// The set that is taken: of those that beat the present one and that the one of the largest density does not beat, the
    /// one with the fewest values.
    fn ruling(
        &self,
        present: &ComponentHypothesis,
        tried: Vec<(usize, ComponentHypothesis)>,
    ) -> Option<(ComponentHypothesis, ComponentRuling)> {
        let beats = |a: &ComponentHypothesis, b: &ComponentHypothesis| {
            CONSTANTS.is_enough(&CONSTANTS.compared(&a.blocks, &b.blocks, ""))
        };
        let sum = |h: &ComponentHypothesis| h.blocks.iter().sum::<f64>();
        let matters = |h: &ComponentHypothesis| {
            let noise = self.noise(&h.fitted) / self.fitter.specimen.scale;
            self.fitter.deviation_unseen(&h.fitted) / self.fitter.specimen.scale <= CONSTANTS.mattering() * noise
                || MATTERS_RATIO * h.unseen <= present.unseen
        };
        let stands = |h: &ComponentHypothesis| self.bears(&h.fitted) && matters(h) && beats(h, present);
        let standing: Vec<usize> = (0..tried.len()).filter(|k| stands(&tried[*k].1)).collect();
        let best = *standing.iter().max_by(|a, b| sum(&tried[**a].1).total_cmp(&sum(&tried[**b].1)))?;
        let near: Vec<usize> =
            standing.iter().copied().filter(|k| *k == best || !beats(&tried[best].1, &tried[*k].1)).collect();
        let unknowns = |k: usize| self.forms[tried[k].0].unknowns();
        let taken = *near.iter().min_by(|a, b| {
            unknowns(**a).cmp(&unknowns(**b)).then_with(|| sum(&tried[**b].1).total_cmp(&sum(&tried[**a].1)))
        })?;
        let effect = self.forms[tried[taken].0].effect;
        let of = |k: usize| {
            let (form, hypothesis) = &tried[k];
            let form = &self.forms[*form];
            let behind = sum(&tried[taken].1) - sum(hypothesis);
            TriedEffect { effect: form.effect, title: self.titles.of_form(form), unseen: hypothesis.unseen, behind }
        };
        // Forms of one effect are one; a richer effect that does no better is no rival.
        let richer = |k: usize| self.forms[tried[k].0].contains.contains(&effect);
        let is_rival = |k: usize| near.contains(&k) && self.forms[tried[k].0].effect != effect && !richer(k);
        let mut all: Vec<usize> = (0..tried.len()).filter(|k| *k != taken).collect();
        all.sort_by(|a, b| sum(&tried[*b].1).total_cmp(&sum(&tried[*a].1)));
        let mut rivals: Vec<TriedEffect> = Vec::new();
        for k in all.iter().copied().filter(|k| is_rival(*k)) {
            if rivals.iter().all(|r| r.effect != self.forms[tried[k].0].effect) {
                rivals.push(of(k));
            }
        }
        let mut others: Vec<TriedEffect> = Vec::new();
        for k in all.iter().copied().filter(|k| !is_rival(*k) && self.forms[tried[*k].0].effect != effect) {
            let known = |list: &[TriedEffect]| list.iter().any(|o| o.effect == self.forms[tried[k].0].effect);
            if !known(&others) && !known(&rivals) {
                others.push(of(k));
            }
        }
        let nearest = all.iter().find(|k| self.forms[tried[**k].0].effect != effect && !richer(**k) && !is_rival(**k));
        let over = |h: &ComponentHypothesis, name: &str| CONSTANTS.compared(&tried[taken].1.blocks, &h.blocks, name);
        let lead = match nearest.filter(|k| sum(&tried[**k].1) > sum(present)) {
            Some(k) => over(&tried[*k].1, self.forms[tried[*k].0].effect),
            None => over(present, "nothing"),
        };
        let form = tried[taken].0;
        let taken = tried.into_iter().nth(taken)?.1;
        Some((taken, ComponentRuling { form, lead, rivals, others }))
    }

    /// A fit as it is shown: to all of the fitted records.
    fn shown(&self, fitted: &FittedComponent) -> FittedComponent {
        let again = self.whole.as_ref().and_then(|whole| whole.fit(&fitted.set, Some(fitted)));
        again.unwrap_or_else(|| fitted.clone())
    }

    fn added(&self, fitted: &FittedComponent, ruling: ComponentRuling) -> AddedEffect {
        let form = &self.forms[ruling.form];
        let model = self.model(fitted);
        let place = fitted.set.len() - 1;
        let specimen = self.fitter.specimen;
        let before: usize =
            fitted.set[..place].iter().zip(&fitted.inner).map(|(k, v)| self.forms[*k].at(v).internals.len()).sum();
        let terms = numbered(&form.at(&fitted.inner[place]), before).terms;
        let mut parameters: Vec<EffectParameter> = Vec::new();
        for ((k, c), term) in
            fitted.of_effect(place, self.forms, self.fitter.base()).zip(&form.coefficients).zip(&terms)
        {
            parameters.push(EffectParameter {
                name: c.name.into(),
                value: fitted.coefficients[k],
                std_error: Some(fitted.errors[k]).filter(|e| e.is_finite()),
                unit: model.unit(term).unwrap_or_default(),
                at_bound: false,
            });
        }
        for (i, inner) in form.inner.iter().enumerate() {
            let held = at_bound(fitted.inner[place][i], inner.bounds);
            let symbol = |s: Symbol| specimen.units.of_symbol(s).unwrap_or_default();
            parameters.push(EffectParameter {
                name: inner.name.into(),
                value: fitted.inner[place][i],
                std_error: Some(fitted.inner_errors[place][i]).filter(|e| e.is_finite() && !held),
                unit: match inner.unit {
                    InnerUnit::Length => symbol(Symbol::State(0)),
                    InnerUnit::Speed => symbol(Symbol::Rate(0)),
                    InnerUnit::Time => "s".into(),
                    InnerUnit::Plain => "1".into(),
                },
                at_bound: held,
            });
        }
        AddedEffect {
            effect: form.effect,
            title: self.titles.of(form.effect),
            form: form.form,
            terms,
            parameters,
            lead: ruling.lead,
            rivals: ruling.rivals,
            others: ruling.others,
            model,
        }
    }

    /// A fit as a model.
    fn model(&self, fitted: &FittedComponent) -> ComponentModel {
        let specimen = self.fitter.specimen;
        let mut terms: Vec<Term> = self.terms.to_vec();
        let (mut internals, mut like) = (Vec::new(), Vec::new());
        for (k, inner) in fitted.set.iter().zip(&fitted.inner) {
            let addition = numbered(&self.forms[*k].at(inner), internals.len());
            terms.extend(addition.terms);
            internals.extend(addition.internals);
            like.extend(addition.like);
        }
        let total: f64 = fitted.parts.iter().sum();
        let weighted = terms.into_iter().enumerate().map(|(i, term)| WeightedTerm {
            term,
            coefficient: fitted.coefficients[i],
            std_error: Some(fitted.errors[i]).filter(|e| e.is_finite()),
            share: fitted.parts[i] / total.max(f64::MIN_POSITIVE),
        });
        ComponentModel {
            layout: Layout { internals: internals.len(), ..specimen.layout },
            force: Equation { terms: weighted.collect() },
            internals,
            like,
            units: specimen.units.clone(),
            records: fits(specimen, &fitted.residual),
        }
    }

    /// Noise of the force and that of the measured motion which a model makes a force of.
    fn noise(&self, fitted: &FittedComponent) -> f64 {
        let specimen = self.fitter.specimen;
        let of = |k: usize| {
            let all: Vec<f64> = specimen.paths.iter().filter_map(|p| standard_deviation(&p.motion[k])).collect();
            rms(&all)
        };
        let slope = |name: &str| {
            let place = self.terms.iter().position(|t| t.as_str() == name);
            place.map_or(0.0, |k| fitted.coefficients[k])
        };
        let passed = [("x", 0), ("v", 1)].map(|(name, k)| slope(name) * of(k));
        passed.iter().fold(specimen.noise, |sum, p| sum.hypot(*p))
    }
}

fn at_bound(value: f64, (low, high): (f64, f64)) -> bool {
    let near = 1e-6 * (high - low);
    value <= low + near || value >= high - near
}

/// An addition whose internal states count from another number on.
fn numbered(addition: &ForceAddition, from: usize) -> ForceAddition {
    let moved = |e: &Expression| {
        e.replaced(&|symbol| match symbol {
            Symbol::Internal(i) => Some(Expression::from(Symbol::Internal(i + from))),
            _ => None,
        })
    };
    let term = |t: &Term| Term::new(moved(t.expression()));
    let equation = |e: &Equation| Equation {
        terms: e.terms.iter().map(|t| WeightedTerm { term: term(&t.term), ..t.clone() }).collect(),
    };
    ForceAddition {
        terms: addition.terms.iter().map(term).collect(),
        internals: addition.internals.iter().map(equation).collect(),
        like: addition.like.clone(),
    }
}

impl ComponentFitter<'_> {
    /// RMS of what a fit leaves of data not fitted.
    pub(crate) fn rms_unseen(&self, fitted: &FittedComponent) -> f64 {
        let all: Vec<f64> = self.rows.unseen.iter().flat_map(|r| fitted.residual[r.clone()].iter().copied()).collect();
        rms(&all)
    }

    /// Standard deviation of the same, but for a few samples that err most: where a velocity passes zero, its noise decides
    /// which way dry friction points.
    pub(crate) fn deviation_unseen(&self, fitted: &FittedComponent) -> f64 {
        let all: Vec<f64> = self.rows.unseen.iter().flat_map(|r| fitted.residual[r.clone()].iter().copied()).collect();
        CONSTANTS.student_scale(&all, 0) / SCALE_OF_NORMAL
    }

    /// Log predictive density of each block of the rows not fitted.
    pub(crate) fn densities(&self, fitted: &FittedComponent) -> Vec<f64> {
        let own: Vec<f64> = self.rows.seen.iter().flat_map(|r| fitted.residual[r.clone()].iter().copied()).collect();
        let scale = CONSTANTS.student_scale(&own, fitted.unknowns()).max(1e-9 * self.specimen.scale);
        let intervals = self.specimen.paths.iter().map(|p| p.interval);
        let seconds: f64 = self.rows.unseen.iter().zip(intervals.clone()).map(|(r, dt)| r.len() as f64 * dt).sum();
        let block = CONSTANTS.block_length(self.specimen.period, seconds);
        let mut all = Vec::new();
        for (rows, interval) in self.rows.unseen.iter().zip(intervals).filter(|(r, _)| !r.is_empty()) {
            let n = rows.len();
            let count = ((n as f64 * interval / block).round() as usize).max(1);
            for k in 0..count {
                let part = rows.start + k * n / count..rows.start + (k + 1) * n / count;
                all.push(CONSTANTS.density(&fitted.residual[part], scale));
            }
        }
        all
    }
}
