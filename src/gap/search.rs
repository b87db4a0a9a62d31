use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use super::audit::Audit;
use super::columns::{Path, forces};
use super::data::Data;
use super::decide::{APART, APART_ON_A_TONE, Score, colour, confused, order, refusal, score};
use super::effects::{Axis, Form, Setting, Sign, catalogue, unit};
use super::error::GapError;
use super::fit::{Fitted, carried};
use super::outcome::{
    Added, Blind, Candidate, Choice, Curve, Diagnosis, Evidence, Finding, Parameter, Remaining, Round, Stage, Standing,
    Trace, Verdict,
};
use super::progress::Progress;
use super::screen::{Motion, Screened};
use super::structure::{Composition, choice, with_errors};
use crate::format::number::significant;
use crate::format::units::format_si;
use crate::model::Equation;
use crate::record::RecordSet;
use crate::refine::{Bar, Options, Point, Refined, Structure as _, misfit, own_start};
use crate::signal::{dot, rms};
use crate::study::Cancel;
use crate::term::Term;

/// What is asked of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Ask {
    /// Terms of the base model's acceleration; none for a linear spring and damper that suit the data.
    pub base: Option<Vec<Term>>,
    /// Most effects that are added.
    pub max_effects: usize,
}

impl Default for Ask {
    fn default() -> Self {
        Self { base: None, max_effects: 3 }
    }
}

/// Hears of a running search; called from several threads.
pub type Listener<'a> = &'a (dyn Fn(Progress) + Sync);

/// Records, and every model that has been fitted to them.
#[derive(Debug)]
pub struct Search {
    data: Data,
    audit: Audit,
    ask: Ask,
    base: Composition,
    known: Mutex<HashMap<Vec<Choice>, Arc<Fitted>>>,
}

/// Candidates that are refined.
const REFINED: usize = 12;
/// Samples times candidates from which fewer are refined, and the fewest.
const EFFORT: usize = 36_000;
const FEWEST: usize = 9;
/// Inner values that a form is refined from; one where there are many samples.
const STARTS: usize = 2;
const MANY: usize = 6_000;
/// A start whose misfit is so many times that of another is not refined.
const DISTANT: f64 = 2.0;
/// Refinements that are gone on with at most, and how many times the least sum of squares theirs may be.
const POLISHED: usize = 4;
const CLOSE: f64 = 9.0;
/// Points of a curve on a card.
const POINTS: usize = 400;

impl Search {
    /// Prepares records of one displacement and at most one input.
    ///
    /// # Errors
    /// Records that do not go together or are too short; a base term of something that they lack.
    pub fn new(records: &RecordSet, ask: &Ask) -> Result<Self, GapError> {
        let data = Data::new(records)?;
        let terms = ask.base.clone().unwrap_or_else(|| base_terms(&data));
        for term in &terms {
            if let Some(symbol) = term.foreign_symbol(&data.layout) {
                return Err(GapError::Symbol { term: term.to_string(), symbol: data.layout.name(symbol) });
            }
        }
        let audit = data.audit();
        let base = Composition::new(data.layout, terms);
        Ok(Self { data, audit, ask: ask.clone(), base, known: Mutex::default() })
    }

    /// What was done to the data and what they cannot show, one sentence each.
    pub fn notices(&self) -> impl Iterator<Item = &str> {
        self.data.notices.iter().chain(&self.audit.notices).map(String::as_str)
    }

    /// Effects that these data cannot show.
    pub fn blind(&self) -> &[Blind] {
        &self.audit.blind
    }

    /// The measurement noise's standard deviation, estimated without a model.
    pub fn noise_floor(&self) -> f64 {
        self.data.noise
    }

    /// Terms of the base model's acceleration.
    pub fn base_terms(&self) -> &[Term] {
        &self.base.base
    }

    /// The base model, fitted.
    ///
    /// # Errors
    /// The base cannot be fitted; cancelled.
    pub fn base(&self, cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        self.stage(&[], cancel)
    }

    /// The stage of these effects in this order; fitted where it is not known yet.
    ///
    /// # Errors
    /// An effect that the catalogue does not have for these data, or a model that cannot be fitted; cancelled.
    pub fn stage(&self, choices: &[Choice], cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let fitted = self.fitted(choices, cancel)?;
        Ok(Arc::new(self.show(&fitted)))
    }

    fn known(&self, choices: &[Choice]) -> Option<Arc<Fitted>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(choices).cloned()
    }

    fn keep(&self, fitted: Arc<Fitted>) {
        let choices = fitted.composition.choices();
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(choices, fitted);
    }

    fn fitted(&self, choices: &[Choice], cancel: &Cancel) -> Result<Arc<Fitted>, GapError> {
        if let Some(fitted) = self.known(choices) {
            return Ok(fitted);
        }
        let fitted = match choices.split_last() {
            None => self.fit_base(cancel)?,
            Some((last, before)) => {
                let before = self.fitted(before, cancel)?;
                let motion = self.data.motion(&before).ok_or(GapError::Base)?;
                let forms: Vec<Form> =
                    self.forms(&before, &motion).into_iter().filter(|f| choice(f) == *last).collect();
                let screened = self.data.screen(&before, &motion, &forms, cancel);
                let form = forms.first().ok_or(GapError::Base)?;
                self.refit(&before, &motion, &screened, (0, form), None, cancel).ok_or(GapError::Base)?
            }
        };
        if cancel.is_cancelled() {
            return Err(GapError::Cancelled);
        }
        let fitted = Arc::new(fitted);
        self.keep(Arc::clone(&fitted));
        Ok(fitted)
    }

    fn fit_base(&self, cancel: &Cancel) -> Result<Fitted, GapError> {
        let data = &self.data;
        let mut composition = self.base.clone();
        let shared = data.start(&composition.base).ok_or(GapError::Base)?;
        let rough: Vec<Path> =
            data.fit().iter().map(|s| Path { x: s.rough[0].clone(), v: s.rough[1].clone() }).collect();
        composition.scales = data.scales(&composition, &[], &rough);
        let runs: Vec<_> = data.fit().iter().map(super::data::Series::run).collect();
        let start = Point { shared, own: own_start(&composition, &runs) };
        let refined = data.refine(&composition, &start, data.lost(), None, cancel);
        match refined {
            Some(refined) => Ok(data.judge(composition, refined, cancel)),
            None if cancel.is_cancelled() => Err(GapError::Cancelled),
            None => Err(GapError::Base),
        }
    }

    fn forms(&self, fitted: &Fitted, motion: &Motion) -> Vec<Form> {
        let data = &self.data;
        let shared = &fitted.refined.point.shared;
        let (_, composed) = fitted.composition.model(shared);
        let largest = |values: &dyn Fn(usize) -> f64, n: usize| (0..n).map(values).map(f64::abs).fold(0.0, f64::max);
        let over = |pick: &dyn Fn(usize, usize) -> f64| {
            data.fit().iter().enumerate().map(|(r, s)| largest(&|k| pick(r, k), s.len())).fold(0.0, f64::max)
        };
        let u = |r: usize, k: usize| data.fit()[r].inputs.first().map_or(0.0, |u| u[k]);
        let du = |r: usize, k: usize| data.fit()[r].input_rates.first().map_or(0.0, |u| u[k]);
        let (x, v) = (|r: usize, k: usize| motion.measured[r].x[k], |r: usize, k: usize| motion.measured[r].v[k]);
        let setting = Setting {
            base_excited: data.base_excited,
            has_input: data.layout.inputs > 0 && !self.audit.free,
            terms: composed.terms,
            unit: data.unit.clone(),
            reach: [over(&x), over(&|r, k| x(r, k) - u(r, k))],
            speed: [over(&v), over(&|r, k| v(r, k) - du(r, k))],
            input: over(&u),
            speed_noise: motion.speed_noise,
            frequency: data.frequency,
            lines: data.lines(&motion.missing),
            pulsations: {
                let spring = |r: usize| if data.base_excited { data.fit()[r].inputs.first() } else { None };
                let product = |r: usize, k: usize| {
                    motion.missing[r][k] * (motion.measured[r].x[k] - spring(r).map_or(0.0, |u| u[k]))
                };
                let products: Vec<Vec<f64>> =
                    (0..data.fit().len()).map(|r| (0..data.fit()[r].len()).map(|k| product(r, k)).collect()).collect();
                data.lines(&products)
            },
            interval: data.fit()[0].interval,
            measured: over(&|r, k| data.fit()[r].measured[k]),
        };
        let present = fitted.composition.choices();
        let offset = fitted.composition.offset();
        catalogue(&setting)
            .into_iter()
            .filter(|f| !present.contains(&choice(f)))
            .filter(|f| !self.audit.blind.iter().any(|b| b.effect == f.effect))
            .filter(|f| !(offset && f.effect == "constant_force"))
            .collect()
    }

    /// The effects of which a form is a richer kind are replaced by it.
    fn with(&self, before: &Composition, form: &Form) -> Composition {
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
    fn refit(
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
        let runs: Vec<_> = data.fit().iter().map(super::data::Series::run).collect();
        let cancelled = || cancel.is_cancelled();
        let options = Options { frozen: false, steps: 0, effort: usize::MAX, bar: None, cancelled: &cancelled };
        let mut starts: Vec<(f64, Composition, Point)> = inner
            .iter()
            .filter_map(|inner| self.start(before, &composition, motion, screened, form, inner))
            .map(|(c, p)| (misfit(&c, &runs, &p, options).unwrap_or(f64::INFINITY), c, p))
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = starts.first().map_or(0.0, |s| s.0);
        let expected = screened.expected(index);
        let mut best: Option<(Composition, Refined)> = None;
        for (misfit, composition, start) in starts {
            // A start far behind another leads nowhere else.
            if misfit > DISTANT * nearest && best.is_some() {
                continue;
            }
            if let Some(refined) = data.refine(&composition, &start, expected, bar, cancel)
                && best.as_ref().is_none_or(|(_, b)| refined.rss < b.rss)
            {
                best = Some((composition, refined));
            }
        }
        let (composition, refined) = best?;
        Some(data.judge(composition, refined, cancel))
    }

    /// Where a refinement starts: the present model's coefficients as the screen would move them, the effect's own from the
    /// screen, its inner values from the grid.
    fn start(
        &self,
        before: &Fitted,
        after: &Composition,
        motion: &Motion,
        screened: &Screened,
        form: &Form,
        inner: &[f64],
    ) -> Option<(Composition, Point)> {
        let data = &self.data;
        let old = &before.refined.point.shared;
        let old_inner = &old[old.len() - before.composition.inner_count()..];
        let old_composed = before.composition.compose(old_inner);
        let coefficients = &old[..old_composed.terms.len()];
        let addition = form.addition(inner);
        let columns = data.columns(
            &addition,
            &motion.measured,
            &motion.variations,
            (&old_composed.terms, coefficients),
            &before.refined.simulated,
        );
        let (moved, own) = screened.together(&columns)?;
        // The inner values in the order of the forms that stay, then the new one's.
        let mut all_inner = Vec::new();
        let mut rest = old_inner;
        for old_form in &before.composition.forms {
            let (values, others) = rest.split_at(old_form.inner.len());
            rest = others;
            if after.forms.iter().any(|f| choice(f) == choice(old_form)) {
                all_inner.extend_from_slice(values);
            }
        }
        all_inner.extend_from_slice(inner);
        let composed = after.compose(&all_inner);
        let now = |k: usize| coefficients[k] + moved.get(k).copied().unwrap_or(0.0);
        let replaced: f64 = addition
            .replaces
            .iter()
            .filter_map(|term| old_composed.terms.iter().position(|t| t == term))
            .map(now)
            .sum();
        // Terms may be rewritten by an effect on the input: what they were is told by their place.
        let sources = after.sources(&before.composition, &all_inner, old_inner);
        let mut fresh = own.iter();
        let mut shared: Vec<f64> = sources
            .iter()
            .zip(&composed.terms)
            .map(|(source, term)| match source {
                Some(k) => now(*k),
                None => {
                    // A term that a replaced, simpler effect had already keeps what it had.
                    let had = old_composed.terms.iter().position(|t| t == term).map_or(replaced, now);
                    had + fresh.next().copied().unwrap_or(0.0)
                }
            })
            .collect();
        // A start on the wrong side of zero is moved to the right one, small.
        let place = after.places(&all_inner).pop()?;
        let physical = form.coefficients.iter().map(|c| c.sign);
        for (value, sign) in shared[place].iter_mut().zip(physical) {
            if sign == Sign::Against && *value >= 0.0 {
                *value = -1e-3 * value.abs().max(f64::MIN_POSITIVE);
            }
        }
        shared.extend_from_slice(&all_inner);
        let mut composition = after.clone();
        composition.scales = data.scales(&composition, &all_inner, &motion.measured);
        let own = carried(&before.composition, &composition, &before.refined.point.own);
        Some((composition, Point { shared, own }))
    }

    /// Looks at a stage: is there a gap, where, and which effects might it be.
    ///
    /// # Errors
    /// Cancelled, or a stage that cannot be simulated.
    pub fn look(&self, stage: &Stage, tell: Listener<'_>, cancel: &Cancel) -> Result<Round, GapError> {
        let choices: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        let before = self.fitted(&choices, cancel)?;
        let data = &self.data;
        tell(Progress::Step("Estimating the missing force", 0.0));
        let motion = data.motion(&before).ok_or(GapError::Base)?;
        let check = || if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Ok(()) };
        check()?;
        let place = data.place(&before.refined.residuals, &motion);
        tell(Progress::Place(Box::new(place.clone())));
        let forms = self.forms(&before, &motion);
        let screened = data.screen(&before, &motion, &forms, cancel);
        check()?;
        let mut candidates = self.screened(&before, &motion, &forms, &screened);
        tell(Progress::Ranking(candidates.clone()));
        tell(Progress::Step("Asking whether the gap is more than noise", 0.2));
        let evidence = data.evidence(&before, &motion, &forms, &screened);
        check()?;
        let round = |candidates, evidence: Evidence, finding, next_experiment| Round {
            before: Arc::new(self.show(&before)),
            evidence,
            place,
            candidates,
            finding,
            next_experiment,
            hidden_up_to: data.detectable(&before, &motion, &forms, &screened),
        };
        if !evidence.significant {
            return Ok(round(candidates, evidence, Finding::Nothing, None));
        }
        tell(Progress::Step("Refitting the likeliest effects on the simulated response", 0.3));
        let tried = screened.likeliest(&forms, (EFFORT / before.refined.samples).clamp(FEWEST, REFINED));
        let bar = Bar::default();
        let done = std::sync::atomic::AtomicUsize::new(0);
        let refits: Vec<(usize, Option<Fitted>)> = tried
            .par_iter()
            .map(|k| {
                let fitted = self.refit(&before, &motion, &screened, (*k, &forms[*k]), Some(&bar), cancel);
                let n = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                tell(Progress::Step(
                    "Refitting the likeliest effects on the simulated response",
                    0.3 + 0.7 * n as f64 / tried.len() as f64,
                ));
                (*k, fitted)
            })
            .collect();
        check()?;
        let refits = self.polished(refits, cancel);
        check()?;
        let (finding, next_experiment) = self.decide(&before, &motion, &forms, refits, &mut candidates, cancel);
        tell(Progress::Ranking(candidates.clone()));
        Ok(round(candidates, evidence, finding, next_experiment))
    }

    /// Goes on with the refinements that ended for want of effort, if they are near the best: rivals are compared at
    /// their best.
    fn polished(&self, mut refits: Vec<(usize, Option<Fitted>)>, cancel: &Cancel) -> Vec<(usize, Option<Fitted>)> {
        let least = refits.iter().filter_map(|(_, f)| f.as_ref()).map(|f| f.refined.rss).fold(f64::INFINITY, f64::min);
        refits.sort_by(|a, b| {
            let rss = |f: &Option<Fitted>| f.as_ref().map_or(f64::INFINITY, |f| f.refined.rss);
            rss(&a.1).total_cmp(&rss(&b.1))
        });
        refits.par_iter_mut().take(POLISHED).filter_map(|(_, f)| f.as_mut()).for_each(|fitted| {
            if fitted.refined.converged || fitted.refined.rss > CLOSE * least {
                return;
            }
            let better = self.data.refine(&fitted.composition, &fitted.refined.point, f64::INFINITY, None, cancel);
            if let Some(better) = better.filter(|b| b.rss < fitted.refined.rss) {
                *fitted = self.data.judge(fitted.composition.clone(), better, cancel);
            }
        });
        refits
    }

    /// Puts the refitted candidates in order and says what they come to.
    fn decide(
        &self,
        before: &Arc<Fitted>,
        motion: &Motion,
        forms: &[Form],
        refits: Vec<(usize, Option<Fitted>)>,
        candidates: &mut [Candidate],
        cancel: &Cancel,
    ) -> (Finding, Option<String>) {
        let data = &self.data;
        let interval = data.fit()[0].interval;
        let floor = 1e-6 * data.fit().iter().map(|s| rms(&s.measured)).fold(0.0, f64::max);
        let refits: Vec<(usize, Arc<Fitted>)> =
            refits.into_iter().filter_map(|(k, f)| f.map(|f| (k, Arc::new(f)))).collect();
        // One colour for all, that of the best fit: its residual is nearest to the noise.
        let nearest = refits.iter().map(|(_, f)| f).min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss));
        let colour = nearest.map_or(1.0, |f| colour(f, data.frequency, interval));
        let scored: Vec<(usize, &Form, Score, &Arc<Fitted>)> =
            refits.iter().map(|(k, f)| (*k, &forms[*k], score(before, f, colour, floor), f)).collect();
        let mut standing: Vec<(usize, &Form, Score)> = Vec::new();
        for (k, form, score, fitted) in &scored {
            let refused = refusal(form, before, (fitted, score), colour, &data.unit);
            if refused.is_none() {
                standing.push((*k, form, *score));
            }
            self.keep(Arc::clone(fitted));
            if let Some(candidate) = candidates.iter_mut().find(|c| c.choice == choice(form)) {
                candidate.delta_bic = score.bic;
                candidate.why = why(form, before, fitted, refused.as_deref(), &data.unit);
                candidate.curve = self.curve(form, (before, fitted), motion);
                candidate.stage = Some(Arc::new(self.show(fitted)));
                candidate.standing = refused.map_or(Standing::Refitted, Standing::Refused);
            }
        }
        let apart = if self.audit.single_tone { APART_ON_A_TONE } else { APART };
        let ranked = order(&standing, data.noise);
        let title = |k: usize| forms[k].full_title();
        let mut finding = Finding::Unexplained;
        let mut rivals: Vec<usize> = Vec::new();
        if let Some(first) = ranked.first() {
            let entry = |k: usize| standing.iter().find(|s| s.0 == k);
            let others: Vec<(usize, &Form, Score)> = standing.iter().filter(|s| s.0 != *first).copied().collect();
            for k in &ranked {
                let Some((_, form, score)) = entry(*k) else { continue };
                let rest: Vec<(usize, &Form, Score)> = standing.iter().filter(|s| s.0 != *k).copied().collect();
                let names = confused((form, *score), &rest, apart, data.noise).into_iter().map(title).collect();
                if let Some(c) = candidates.iter_mut().find(|c| c.choice == choice(form)) {
                    c.confused_with = names;
                }
            }
            if let Some((_, form, score)) = entry(*first) {
                rivals = confused((form, *score), &others, apart, data.noise);
            }
            finding = Finding::Named;
        }
        // Best first: those that stand, the refused by score, then the screened.
        let rank = |c: &Candidate| -> (usize, f64) {
            let k = forms.iter().position(|f| choice(f) == c.choice);
            match k.and_then(|k| ranked.iter().position(|r| *r == k)) {
                Some(place) => (0, place as f64),
                None => match (k.and_then(|k| scored.iter().find(|s| s.0 == k)), &c.standing) {
                    (Some(s), _) => (1, s.2.total),
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
            let fitted = |k: usize| refits.iter().find(|(r, _)| *r == k).map(|(_, f)| f);
            if let (Some(best), Some(rival)) = (ranked.first().and_then(|k| fitted(*k)), fitted(rivals[0])) {
                next = data.next_experiment(best, rival, cancel);
                if next.is_none() {
                    next = Some(format!("What tells them apart: {}.", forms[rivals[0]].separates));
                }
            }
        }
        (finding, next)
    }

    /// What the screen alone says of every form, and which effects the data cannot show.
    fn screened(&self, before: &Fitted, motion: &Motion, forms: &[Form], screened: &Screened) -> Vec<Candidate> {
        let whole = screened.rss.max(f64::MIN_POSITIVE);
        // Chance alone "explains" this much; what is left beyond noise is the gap.
        let noise = (self.data.noise.powi(2) * before.refined.samples as f64).min(0.999 * whole);
        let mut list: Vec<Candidate> = screened
            .hits
            .iter()
            .map(|hit| {
                let form = &forms[hit.form];
                Candidate {
                    choice: choice(form),
                    title: form.full_title(),
                    explanation: form.explanation,
                    standing: Standing::Screened,
                    explained: (hit.gain / (whole - noise)).clamp(0.0, 1.0),
                    delta_bic: -hit.gain / (whole / before.refined.samples as f64),
                    why: format!(
                        "Along the measured motion it would explain {:.0} % of the gap.",
                        100.0 * (hit.gain / (whole - noise)).clamp(0.0, 1.0)
                    ),
                    stage: None,
                    confused_with: Vec::new(),
                    curve: self.measured_curve(form, motion),
                }
            })
            .collect();
        for form in forms {
            if !list.iter().any(|c| c.choice == choice(form)) {
                list.push(Candidate {
                    choice: choice(form),
                    title: form.full_title(),
                    explanation: form.explanation,
                    standing: Standing::Refused("it would have to act the wrong way round".to_owned()),
                    explained: 0.0,
                    delta_bic: 0.0,
                    why: "Along the measured motion it explains nothing with a physical sign.".to_owned(),
                    stage: None,
                    confused_with: Vec::new(),
                    curve: Curve::default(),
                });
            }
        }
        for blind in &self.audit.blind {
            if !list.iter().any(|c| c.choice.effect == blind.effect) {
                list.push(Candidate {
                    choice: Choice { effect: blind.effect.to_owned(), form: String::new() },
                    title: sentence_case(&blind.effect.replace('_', " ")),
                    explanation: "",
                    standing: Standing::NotShown(blind.reason.clone()),
                    explained: 0.0,
                    delta_bic: 0.0,
                    why: format!("These data cannot show it: {}.", blind.reason),
                    stage: None,
                    confused_with: Vec::new(),
                    curve: Curve::default(),
                });
            }
        }
        list
    }

    fn axis(&self, form: &Form, motion: &Motion) -> (String, String, Vec<Vec<f64>>) {
        let fit = self.data.fit();
        let length = &self.data.unit;
        let u = |r: usize, k: usize| fit[r].inputs.first().map_or(0.0, |u| u[k]);
        let du = |r: usize, k: usize| fit[r].input_rates.first().map_or(0.0, |u| u[k]);
        let each = |f: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            fit.iter().enumerate().map(|(r, s)| (0..s.len()).map(|k| f(r, k)).collect()).collect()
        };
        let (x, v) = (|r: usize, k: usize| motion.measured[r].x[k], |r: usize, k: usize| motion.measured[r].v[k]);
        match form.axis {
            Axis::Displacement { joint: false } => ("x".into(), length.clone(), each(&x)),
            Axis::Displacement { joint: true } => ("x − u".into(), length.clone(), each(&|r, k| x(r, k) - u(r, k))),
            Axis::Velocity { joint: false } => ("v".into(), unit(length, (1, -1)), each(&v)),
            Axis::Velocity { joint: true } => {
                ("v − du".into(), unit(length, (1, -1)), each(&|r, k| v(r, k) - du(r, k)))
            }
            Axis::Input => ("u".into(), self.data.input_unit.clone(), each(&u)),
            Axis::Time => ("t".into(), "s".into(), each(&|r, k| fit[r].start + fit[r].interval * k as f64)),
        }
    }

    fn measured_curve(&self, form: &Form, motion: &Motion) -> Curve {
        let (axis, unit, values) = self.axis(form, motion);
        let total: usize = values.iter().map(Vec::len).sum();
        let stride = (total / POINTS).max(1);
        let pairs = values.iter().flatten().zip(motion.missing.iter().flatten());
        let measured = pairs.step_by(stride).map(|(a, f)| [*a, *f]).collect();
        Curve { axis, unit, measured, effect: Vec::new() }
    }

    /// The measured missing force and the effect's own through it: its partial residuals, as of a regression.
    fn curve(&self, form: &Form, (before, fitted): (&Fitted, &Fitted), motion: &Motion) -> Curve {
        let mut curve = self.measured_curve(form, motion);
        let data = &self.data;
        let shared = &fitted.refined.point.shared;
        let inner_count = fitted.composition.inner_count();
        let inner = &shared[shared.len() - inner_count..];
        let own_inner = &inner[inner.len() - form.inner.len()..];
        let addition = form.addition(own_inner);
        if addition.terms.is_empty() {
            return curve;
        }
        let place = fitted.composition.places(inner).pop().unwrap_or(0..0);
        let (_, _, values) = self.axis(form, motion);
        let old = &before.refined.point.shared;
        let old_composed = before.composition.compose(&old[old.len() - before.composition.inner_count()..]);
        let composed = fitted.composition.compose(inner);
        let sum = |columns: &[Vec<f64>], coefficients: &[f64], k: usize| -> f64 {
            columns.iter().zip(coefficients).map(|(f, c)| c * f[k]).sum()
        };
        let mut force = Vec::new();
        // What the effect has to make up for: the missing force, and what the other terms gave back or took over since.
        let mut wanted = Vec::new();
        for ((s, path), missing) in data.fit().iter().zip(&motion.measured).zip(&motion.missing) {
            let columns =
                |terms: &[Term], internals: &[Equation]| forces(terms, internals, &data.layout, s, &s.inputs(), path);
            let then = columns(&old_composed.terms, &old_composed.internals);
            let now = columns(&composed.terms, &composed.internals);
            for (k, missing) in missing.iter().enumerate() {
                let own = sum(&now[place.clone()], &shared[place.clone()], k);
                force.push(own);
                wanted.push(missing + sum(&then, old, k) - (sum(&now, shared, k) - own));
            }
        }
        let total = force.len();
        let stride = (total / POINTS).max(1);
        let over = |force: &[f64]| -> Vec<[f64; 2]> {
            values.iter().flatten().zip(force).step_by(stride).map(|(a, f)| [*a, *f]).collect()
        };
        curve.measured = over(&wanted);
        let mut effect = over(&force);
        if addition.internals.is_empty() {
            effect.sort_by(|a, b| a[0].total_cmp(&b[0]));
        }
        curve.effect = effect;
        curve
    }

    /// A fitted model for showing.
    fn show(&self, fitted: &Fitted) -> Stage {
        let data = &self.data;
        let refined = &fitted.refined;
        let shared = &refined.point.shared;
        let (model, composed) = fitted.composition.model(shared);
        let inflated = colour(fitted, data.frequency, data.fit()[0].interval).sqrt();
        let errors: Vec<Option<f64>> = (0..shared.len()).map(|k| refined.std_error(k).map(|e| e * inflated)).collect();
        let model = with_errors(model, &errors, &self.shares(&model_terms(&composed.terms, shared), fitted));
        let inner = &shared[shared.len() - fitted.composition.inner_count()..];
        let inner_errors = &errors[errors.len() - inner.len()..];
        let mut rest = 0;
        let effects = fitted
            .composition
            .forms
            .iter()
            .zip(fitted.composition.places(inner))
            .map(|(form, place)| {
                let own = rest..rest + form.inner.len();
                rest = own.end;
                let mut parameters: Vec<Parameter> = form
                    .coefficients
                    .iter()
                    .zip(place.clone())
                    .map(|(c, k)| Parameter {
                        name: c.name.to_owned(),
                        value: if c.sign == Sign::Against { -shared[k] } else { shared[k] },
                        std_error: errors[k],
                        unit: unit(&data.unit, c.dimension),
                    })
                    .collect();
                parameters.extend(form.inner.iter().zip(own).map(|(q, k)| Parameter {
                    name: q.name.to_owned(),
                    value: inner[k],
                    std_error: inner_errors[k],
                    unit: if q.name == "u_max" { data.input_unit.clone() } else { unit(&data.unit, q.dimension) },
                }));
                if fitted.composition.offset() && form.effect == "sensor_offset" {
                    parameters.extend(data.fit().iter().zip(&refined.point.own).filter_map(|(s, own)| {
                        Some(Parameter {
                            name: format!("offset of {}", s.name),
                            value: *own.last()?,
                            std_error: None,
                            unit: data.unit.clone(),
                        })
                    }));
                }
                Added {
                    choice: choice(form),
                    title: form.full_title(),
                    terms: composed.terms[place].iter().map(|t| t.text(&model.layout)).collect(),
                    parameters,
                }
            })
            .collect();
        Stage { model, effects, gap: fitted.gap, traces: self.traces(fitted) }
    }

    /// RMS of each term's force over the fitted records, as a share of their sum.
    fn shares(&self, terms: &[(Term, f64)], fitted: &Fitted) -> Vec<f64> {
        let data = &self.data;
        let inner =
            &fitted.refined.point.shared[fitted.refined.point.shared.len() - fitted.composition.inner_count()..];
        let composed = fitted.composition.compose(inner);
        let mut squares = vec![0.0; terms.len()];
        for s in data.fit() {
            let path = Path { x: s.rough[0].clone(), v: s.rough[1].clone() };
            let columns = forces(&composed.terms, &composed.internals, &data.layout, s, &s.inputs(), &path);
            for ((square, column), (_, c)) in squares.iter_mut().zip(&columns).zip(terms) {
                *square += c * c * dot(column, column);
            }
        }
        let sum: f64 = squares.iter().map(|s| f64::sqrt(*s)).sum();
        squares.iter().map(|s| if sum > 0.0 { f64::sqrt(*s) / sum } else { 0.0 }).collect()
    }

    fn traces(&self, fitted: &Fitted) -> Vec<Trace> {
        let trace = |s: &super::data::Series, simulated: &[f64]| Trace {
            record: s.name.clone(),
            usage: s.usage,
            start: s.start,
            interval: s.interval,
            measured: Arc::clone(&s.measured),
            simulated: simulated.into(),
        };
        let fit = self.data.fit().iter().zip(&fitted.refined.simulated);
        let held = self.data.held_out().iter().zip(&fitted.held_out);
        fit.chain(held).map(|(s, y)| trace(s, y)).collect()
    }

    /// Walks until nothing is missing, nothing more can be named, or the most effects are added.
    ///
    /// # Errors
    /// The base cannot be fitted; cancelled.
    pub fn diagnose(&self, tell: Listener<'_>, cancel: &Cancel) -> Result<Diagnosis, GapError> {
        let started = Instant::now();
        let mut stage = self.base(cancel)?;
        let mut steps: Vec<Step> = Vec::new();
        let mut last = loop {
            let round = self.look(&stage, tell, cancel)?;
            match Step::of(round) {
                Ok(step) if steps.len() < self.ask.max_effects => {
                    steps.push(step);
                    let choices: Vec<Choice> = steps.iter().map(|s| s.choice.clone()).collect();
                    // A richer kind takes the simpler one's place, and what a later effect made superfluous goes.
                    let fitted = self.added(&stage, &choices, cancel)?;
                    let kept = self.dropped(fitted, cancel)?;
                    steps.retain(|s| kept.effects.iter().any(|e| e.choice == s.choice));
                    stage = kept;
                }
                Ok(step) => break Round { finding: Finding::Unexplained, ..step.round },
                Err(round) => break *round,
            }
        };
        if steps.len() > 1 && self.reconsider(&mut steps, tell, cancel)? {
            let choices: Vec<Choice> = steps.iter().map(|s| s.choice.clone()).collect();
            stage = self.stage(&choices, cancel)?;
            last = self.look(&stage, tell, cancel)?;
        }
        // Those that stand alone first; the interface lists rivals under the last.
        steps.sort_by_key(|s| !s.alone());
        let mut stages = vec![self.base(cancel)?];
        for n in 1..=steps.len() {
            let choices: Vec<Choice> = steps[..n].iter().map(|s| s.choice.clone()).collect();
            stages.push(self.stage(&choices, cancel)?);
        }
        let ambiguous = steps.iter().any(|s| !s.alone());
        let verdict = match last.finding {
            Finding::Nothing if steps.is_empty() => Verdict::NothingMissing,
            Finding::Nothing if !ambiguous => Verdict::Named,
            _ if ambiguous => Verdict::Ambiguous,
            _ => Verdict::Unexplained,
        };
        let mut rounds: Vec<Round> = steps.into_iter().map(|s| s.round).collect();
        rounds.push(last);
        let remaining =
            rounds.last().map_or_else(Remaining::default, |round| remaining(&round.evidence, &round.hidden_up_to));
        let sentence = sentence(verdict, &stages, &rounds, &self.data.unit);
        Ok(Diagnosis {
            verdict,
            sentence,
            noise_floor: self.data.noise,
            notices: self.notices().map(str::to_owned).collect(),
            blind: self.audit.blind.clone(),
            rounds,
            stages,
            remaining,
            elapsed_ms: 1e3 * started.elapsed().as_secs_f64(),
        })
    }

    /// What a walk made by hand has come to: `rounds[k]` looked at `stages[k]`, and the last stage may not have been
    /// looked at yet.
    ///
    /// # Errors
    /// No stage, or one that cannot be simulated; cancelled.
    pub fn conclude(
        &self,
        rounds: Vec<Round>,
        stages: Vec<Arc<Stage>>,
        cancel: &Cancel,
    ) -> Result<Diagnosis, GapError> {
        let started = Instant::now();
        let added = stages.last().is_some_and(|s| !s.effects.is_empty());
        let looked = rounds.len() >= stages.len();
        let finding = rounds.last().map(|r| &r.finding);
        let remaining = match (rounds.last(), stages.last()) {
            (Some(round), _) if looked => remaining(&round.evidence, &round.hidden_up_to),
            (_, Some(stage)) => self.left(stage, cancel)?,
            _ => return Err(GapError::Base),
        };
        let verdict = match finding {
            Some(Finding::Ambiguous(_)) if added && !looked => Verdict::Ambiguous,
            _ if remaining.significant => Verdict::Unexplained,
            _ if added => Verdict::Named,
            _ => Verdict::NothingMissing,
        };
        let open = !looked || matches!(finding, Some(Finding::Named | Finding::Ambiguous(_)));
        let sentence = match verdict {
            // What was not looked for cannot be said to have no name.
            Verdict::Unexplained if open && added => {
                sentence(Verdict::Named, &stages, &rounds, &self.data.unit) + " What is left is more than noise."
            }
            Verdict::Unexplained if open => "Something is missing: the gap is more than noise.".to_owned(),
            verdict => sentence(verdict, &stages, &rounds, &self.data.unit),
        };
        Ok(Diagnosis {
            verdict,
            sentence,
            noise_floor: self.data.noise,
            notices: self.notices().map(str::to_owned).collect(),
            blind: self.audit.blind.clone(),
            rounds,
            stages,
            remaining,
            elapsed_ms: 1e3 * started.elapsed().as_secs_f64(),
        })
    }

    /// A stage without those of its effects that a later one has made superfluous.
    fn dropped(&self, stage: Arc<Stage>, cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let choices: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        if choices.len() < 2 {
            return Ok(stage);
        }
        let whole = self.fitted(&choices, cancel)?;
        let interval = self.data.fit()[0].interval;
        let tint = colour(&whole, self.data.frequency, interval);
        for index in 0..choices.len() - 1 {
            let mut composition = whole.composition.without(index);
            let shared = &whole.refined.point.shared;
            let inner = &shared[shared.len() - whole.composition.inner_count()..];
            let gone = whole.composition.places(inner)[index].clone();
            let before: usize = whole.composition.forms[..index].iter().map(|f| f.inner.len()).sum();
            let gone_inner = before..before + whole.composition.forms[index].inner.len();
            let coefficients = shared.len() - inner.len();
            let kept = |k: usize| !(gone.contains(&k) || k >= coefficients && gone_inner.contains(&(k - coefficients)));
            if !whole.composition.forms[index].addition(&inner[gone_inner.clone()]).replaces.is_empty() {
                continue;
            }
            let shared: Vec<f64> = (0..shared.len()).filter(|k| kept(*k)).map(|k| shared[k]).collect();
            composition.scales =
                (0..whole.composition.scales.len()).filter(|k| kept(*k)).map(|k| whole.composition.scales[k]).collect();
            let own = carried(&whole.composition, &composition, &whole.refined.point.own);
            let Some(refined) = self.data.refine(&composition, &Point { shared, own }, self.data.lost(), None, cancel)
            else {
                continue;
            };
            let without = self.data.judge(composition, refined, cancel);
            if score(&whole, &without, tint, 0.0).total <= 0.0 {
                let without = Arc::new(without);
                self.keep(Arc::clone(&without));
                return Ok(Arc::new(self.show(&without)));
            }
        }
        Ok(stage)
    }

    /// What a stage leaves, no effect being tried.
    fn left(&self, stage: &Stage, cancel: &Cancel) -> Result<Remaining, GapError> {
        let choices: Vec<Choice> = stage.effects.iter().map(|e| e.choice.clone()).collect();
        let fitted = self.fitted(&choices, cancel)?;
        let motion = self.data.motion(&fitted).ok_or(GapError::Base)?;
        let forms = self.forms(&fitted, &motion);
        let screened = self.data.screen(&fitted, &motion, &forms, cancel);
        let evidence = self.data.evidence(&fitted, &motion, &forms, &screened);
        Ok(remaining(&evidence, &self.data.detectable(&fitted, &motion, &forms, &screened)))
    }

    /// The stage after the last of these effects was added to another.
    fn added(&self, before: &Stage, choices: &[Choice], cancel: &Cancel) -> Result<Arc<Stage>, GapError> {
        let last = choices.last().ok_or(GapError::Base)?;
        let known: Vec<Choice> = before.effects.iter().map(|e| e.choice.clone()).collect();
        let with: Vec<Choice> = known.iter().chain([last]).cloned().collect();
        // Where it took a simpler one's place, the fit is known without that one.
        let place = (0..known.len()).map(|gone| {
            let mut list = with.clone();
            list.remove(gone);
            list
        });
        let found = std::iter::once(with.clone()).chain(place).find(|list| self.known(list).is_some());
        self.stage(&found.unwrap_or(with), cancel)
    }

    /// Looks again at each effect in the company of the others: with the others in place another may do better, or rivals
    /// may have fallen away. True if an effect was exchanged.
    fn reconsider(&self, steps: &mut [Step], tell: Listener<'_>, cancel: &Cancel) -> Result<bool, GapError> {
        let mut exchanged = false;
        for index in 0..steps.len() {
            // The last was judged in the company of all others, unless one of them was exchanged since.
            if index + 1 == steps.len() && !exchanged {
                break;
            }
            let others: Vec<Choice> =
                steps.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, s)| s.choice.clone()).collect();
            let Ok(stage) = self.stage(&others, cancel) else { continue };
            if let Ok(step) = Step::of(self.look(&stage, tell, cancel)?) {
                exchanged |= step.choice != steps[index].choice;
                steps[index] = step;
            }
        }
        Ok(exchanged)
    }
}

/// An effect that was added, and the look that led to it.
struct Step {
    choice: Choice,
    round: Round,
}

impl Step {
    /// The step that a round leads to; the round itself if it leads to none.
    fn of(round: Round) -> Result<Self, Box<Round>> {
        match (&round.finding, round.candidates.first()) {
            (Finding::Named | Finding::Ambiguous(_), Some(first)) => Ok(Self { choice: first.choice.clone(), round }),
            _ => Err(Box::new(round)),
        }
    }

    fn alone(&self) -> bool {
        self.round.finding == Finding::Named
    }
}

/// What is left, in words.
fn remaining(evidence: &Evidence, hidden_up_to: &[(String, f64)]) -> Remaining {
    let mut note = String::new();
    if evidence.significant {
        note.push_str("What is left is more than noise. ");
    }
    let mut sizes: Vec<&(String, f64)> = hidden_up_to.iter().filter(|(_, s)| s.is_finite()).collect();
    sizes.sort_by(|a, b| a.1.total_cmp(&b.1));
    let list: Vec<String> =
        sizes.iter().map(|(title, s)| format!("{} {} %", within(title), significant(100.0 * s, 2))).collect();
    if !list.is_empty() {
        note.push_str("The smallest that could not have hidden, as a share of the spring force: ");
        note.push_str(&list.join("; "));
        note.push('.');
    }
    Remaining { significant: evidence.significant, p_value: evidence.p_value, note }
}

fn model_terms(terms: &[Term], shared: &[f64]) -> Vec<(Term, f64)> {
    terms.iter().cloned().zip(shared.iter().copied()).collect()
}

/// A linear spring and damper: across the joint where the base moves, with the force where one acts.
fn base_terms(data: &Data) -> Vec<Term> {
    let known = |text: &str| Term::parse(text).ok();
    let still = data.fit().iter().all(|s| s.inputs.iter().all(|u| rms(u) == 0.0));
    let list: &[&str] = match (data.layout.inputs, data.base_excited) {
        (0, _) => &["x", "v"],
        (_, true) => &["x-u", "v-du"],
        (_, false) if still => &["x", "v"],
        _ => &["x", "v", "u"],
    };
    list.iter().filter_map(|t| known(t)).collect()
}

/// Why a refitted candidate is where it is.
fn why(form: &Form, before: &Fitted, after: &Fitted, refused: Option<&str>, length: &str) -> String {
    let number = |v: f64| format_si(v, length, 3);
    let rms = |f: &Fitted| f.gap.test_rmse.unwrap_or(f.gap.train_rmse);
    let (b, a) = (rms(before), rms(after));
    match refused {
        Some(reason) => format!("Refused: {reason}."),
        None => format!(
            "With {} the error on data never fitted falls from {} to {}, {} times.",
            within(form.title),
            number(b),
            number(a),
            significant(b / a, 2)
        ),
    }
}

fn sentence_case(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A title within a sentence: names keep their capitals.
fn within(title: &str) -> String {
    let name = ["Coulomb", "Stribeck", "Bouc"].iter().any(|n| title.starts_with(n));
    let mut letters = title.chars();
    match letters.next() {
        Some(first) if !name => first.to_lowercase().chain(letters).collect(),
        _ => title.to_owned(),
    }
}

/// The verdict in one sentence.
fn sentence(verdict: Verdict, stages: &[Arc<Stage>], rounds: &[Round], length: &str) -> String {
    let (Some(first), Some(last)) = (stages.first(), stages.last()) else { return String::new() };
    let names: Vec<String> = last.effects.iter().map(|e| within(&e.title)).collect();
    let rms = |s: &Stage| s.gap.test_rmse.unwrap_or(s.gap.train_rmse);
    let gap = format!(
        "the error on data never fitted falls from {} to {}",
        format_si(rms(first), length, 3),
        format_si(rms(last), length, 3)
    );
    match verdict {
        Verdict::NothingMissing => "Nothing is missing that these data can show.".to_owned(),
        Verdict::Named => format!("Missing: {}; {gap}.", names.join(" and ")),
        Verdict::Ambiguous => {
            let others = rounds
                .iter()
                .rev()
                .find_map(|r| match &r.finding {
                    Finding::Ambiguous(places) => Some(
                        places
                            .iter()
                            .filter_map(|k| r.candidates.get(*k))
                            .map(|c| within(&c.title))
                            .collect::<Vec<_>>()
                            .join(", "),
                    ),
                    _ => None,
                })
                .unwrap_or_default();
            format!("{}, or just as well {others}: these data cannot tell; {gap}.", sentence_case(&names.join(" and ")))
        }
        Verdict::Unexplained if names.is_empty() => {
            "Something is missing, and no effect of the catalogue closes the gap on data never fitted.".to_owned()
        }
        Verdict::Unexplained => {
            format!("Missing: {}; {gap}. Something more is left that these data cannot name.", names.join(" and "))
        }
    }
}
