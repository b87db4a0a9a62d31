use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;

use super::audit::Audit;
use super::columns::Path;
use super::data::Data;
use super::decide::{APART, APART_ON_A_TONE, Refusal, Score, colour, confused, order, refusal, score, unborne};
use super::effects::{Form, Setting, Sign, catalogue, logarithmic};
use super::error::GapError;
use super::fit::{Fitted, Pace, carried};
use super::outcome::{Blind, Candidate, Choice, Evidence, Finding, Round, Stage, Standing};
use super::progress::Progress;
use super::screen::{Motion, Screened};
use super::structure::{Composition, choice};
use super::words::{titles, why};
use crate::record::RecordSet;
use crate::refine::{Bar, Options, Point, Refined, Structure as _, misfit, own_start};
use crate::signal::rms;
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
    pub(super) data: Data,
    pub(super) audit: Audit,
    pub(super) ask: Ask,
    base: Composition,
    known: Mutex<HashMap<Vec<Choice>, Arc<Fitted>>>,
}

/// What a round's candidates come to.
struct Decision {
    finding: Finding,
    next_experiment: Option<String>,
    promising: Vec<Choice>,
}

impl Decision {
    fn nothing() -> Self {
        Self { finding: Finding::Nothing, next_experiment: None, promising: Vec::new() }
    }
}

/// Share of the first's explanation along the motion from which another is its rival on one steady tone.
const NEARLY: f64 = 0.8;
/// Weights of the oscillator that a base model's start leans towards, beside those of the data.
const PRIORS: [f64; 3] = [1e-10, 1e-3, 1.0];
/// Share of the sum of squares that a form must leave at most to be promising where data left out do not bear it out.
const PROMISING: f64 = 0.5;
/// Candidates that are refined.
const REFINED: usize = 12;
/// Samples times candidates from which fewer are refined, and the fewest.
const EFFORT: usize = 36_000;
const FEWEST: usize = 9;
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
/// A start whose misfit is so many times that of another is not refined.
const DISTANT: f64 = 2.0;
/// Refinements that are gone on with at most, and how many times the least sum of squares theirs may be.
const POLISHED: usize = 4;
const CLOSE: f64 = 9.0;

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

    /// How much a fit's residuals are coloured where the motion is.
    pub(super) fn tint(&self, fitted: &Fitted) -> f64 {
        colour(fitted, self.data.frequency, self.data.fit()[0].interval)
    }

    pub(super) fn known(&self, choices: &[Choice]) -> Option<Arc<Fitted>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(choices).cloned()
    }

    pub(super) fn keep(&self, fitted: Arc<Fitted>) {
        let choices = fitted.composition.choices();
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(choices, fitted);
    }

    pub(super) fn fitted(&self, choices: &[Choice], cancel: &Cancel) -> Result<Arc<Fitted>, GapError> {
        if let Some(fitted) = self.known(choices) {
            return Ok(fitted);
        }
        let fitted = match choices.split_last() {
            None => self.fit_base(cancel)?,
            Some((last, before)) => {
                let impossible = || GapError::Stage(titles(choices));
                let before = self.fitted(before, cancel)?;
                let motion = self.data.motion(&before).ok_or_else(impossible)?;
                let forms: Vec<Form> =
                    self.forms(&before, &motion).into_iter().filter(|f| choice(f) == *last).collect();
                let screened = self.data.screen(&before, &motion, &forms, cancel);
                let form = forms.first().ok_or_else(impossible)?;
                let refit = self.refit(&before, &motion, &screened, (0, form), None, cancel);
                if cancel.is_cancelled() {
                    return Err(GapError::Cancelled);
                }
                refit.ok_or_else(impossible)?
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
        let rough: Vec<Path> =
            data.fit().iter().map(|s| Path { x: s.rough[0].clone(), v: s.rough[1].clone() }).collect();
        composition.scales = data.scales(&composition, &[], &rough);
        let runs: Vec<_> = data.fit().iter().map(super::data::Series::run).collect();
        // Where the data alone lead to a start that does not last (one tone leaves directions open), the start leans
        // towards an oscillator of the motion's frequency.
        for prior in PRIORS {
            let shared = data.start(&composition.base, &[], &rough, prior).ok_or(GapError::Base)?;
            let start = Point { shared, own: own_start(&composition, &runs) };
            if let Some(refined) = data.refine(&composition, &start, data.lost(), Pace::Thorough, cancel) {
                return Ok(data.judge(composition, refined, cancel));
            }
            if cancel.is_cancelled() {
                return Err(GapError::Cancelled);
            }
        }
        Err(GapError::Base)
    }

    pub(super) fn forms(&self, fitted: &Fitted, motion: &Motion) -> Vec<Form> {
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
        let first = refined.point.shared.len() - form.inner.len();
        for (k, inner) in form.inner.iter().enumerate().filter(|(_, inner)| inner.jumps) {
            // No slope leads across a jump of the response, and the screen does not see one: the whole range is looked
            // through, then what is near.
            for width in LOOKED_AT {
                let present = refined.point.shared[first + k];
                let (low, high) = inner.bounds;
                let range = logarithmic((present / width).clamp(low, high), (present * width).clamp(low, high), PLACES);
                let at = |value: f64| {
                    let mut point = refined.point.clone();
                    point.shared[first + k] = value;
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
        Some(data.judge(composition, refined, cancel))
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
        let old = &before.refined.point.shared;
        let old_inner = &old[old.len() - before.composition.inner_count()..];
        let old_composed = before.composition.compose(old_inner);
        let coefficients = &old[..old_composed.terms.len()];
        let addition = form.addition(inner);
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
        let mut shared = match way {
            Way::Afresh => data.start(&composed.terms, &composed.internals, &motion.measured, 0.0)?,
            Way::Moved(share) => {
                let columns = data.columns(
                    &addition,
                    &motion.measured,
                    &motion.variations,
                    (&old_composed.terms, coefficients),
                    &before.refined.simulated,
                );
                let (moved, own) = screened.together(&columns)?;
                let now = |k: usize| coefficients[k] + share * moved.get(k).copied().unwrap_or(0.0);
                let replaced: f64 = addition
                    .replaces
                    .iter()
                    .filter_map(|term| old_composed.terms.iter().position(|t| t == term))
                    .map(now)
                    .sum();
                // Terms may be rewritten by an effect on the input: what they were is told by their place.
                let sources = after.sources(&before.composition, &all_inner, old_inner);
                let mut fresh = own.iter();
                let value = |(source, term): (&Option<usize>, &Term)| match source {
                    Some(k) => now(*k),
                    None => {
                        // A term that a replaced, simpler effect had already keeps what it had.
                        let had = old_composed.terms.iter().position(|t| t == term).map_or(replaced, now);
                        had + share * fresh.next().copied().unwrap_or(0.0)
                    }
                };
                sources.iter().zip(&composed.terms).map(value).collect()
            }
        };
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
        let motion = data.motion(&before).ok_or_else(|| GapError::Stage(titles(&choices)))?;
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
        let round = |candidates, evidence: Evidence, decision: Decision| Round {
            before: Arc::new(self.show(&before)),
            evidence,
            place,
            candidates,
            finding: decision.finding,
            next_experiment: decision.next_experiment,
            promising: decision.promising,
            hidden_up_to: data.detectable(&before, &motion, &forms, &screened),
        };
        if !evidence.significant {
            return Ok(round(candidates, evidence, Decision::nothing()));
        }
        tell(Progress::Step("Refitting the likeliest effects on the simulated response", 0.3));
        let tried = screened.likeliest(&forms, (EFFORT / before.refined.samples).clamp(FEWEST, REFINED));
        let bar = Bar::default();
        let done = std::sync::atomic::AtomicUsize::new(0);
        // The likeliest first: those behind them are held against what these reach.
        let refits: Vec<(usize, Option<Fitted>)> = tried
            .iter()
            .par_bridge()
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
        let refits = self.polished(refits, &bar, cancel);
        check()?;
        let decision = self.decide(&before, &motion, &forms, refits, &mut candidates, cancel);
        check()?;
        tell(Progress::Ranking(candidates.clone()));
        Ok(round(candidates, evidence, decision))
    }

    /// Goes on with the refinements that ended for want of effort, if they are near the best: rivals are compared at
    /// their best.
    fn polished(
        &self,
        mut refits: Vec<(usize, Option<Fitted>)>,
        bar: &Bar,
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
                self.data.refine(&fitted.composition, &fitted.refined.point, f64::INFINITY, Pace::Again(bar), cancel);
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
    ) -> Decision {
        let data = &self.data;
        let floor = 1e-6 * data.fit().iter().map(|s| rms(&s.measured)).fold(0.0, f64::max);
        let refits: Vec<(usize, Arc<Fitted>)> =
            refits.into_iter().filter_map(|(k, f)| f.map(|f| (k, Arc::new(f)))).collect();
        // One colour for all, that of the best fit: its residual is nearest to the noise.
        let nearest = refits.iter().map(|(_, f)| f).min_by(|a, b| a.refined.rss.total_cmp(&b.refined.rss));
        let colour = nearest.map_or(1.0, |f| self.tint(f));
        let scored: Vec<(usize, &Form, Score, &Arc<Fitted>)> =
            refits.iter().map(|(k, f)| (*k, &forms[*k], score(before, f, colour, floor), f)).collect();
        let mut standing: Vec<(usize, &Form, Score)> = Vec::new();
        let mut undetermined: Vec<(usize, &Form, Score)> = Vec::new();
        let mut promising: Vec<(f64, Choice)> = Vec::new();
        for (k, form, score, fitted) in &scored {
            // What a cancelled search decides is not looked at.
            if cancel.is_cancelled() {
                break;
            }
            let refused = refusal(form, before, (fitted, score), colour, (data.noise, &data.unit));
            match refused {
                None => standing.push((*k, form, *score)),
                Some(Refusal::LeftOut(_)) if fitted.refined.rss < PROMISING * before.refined.rss => {
                    promising.push((fitted.refined.rss, choice(form)));
                }
                Some(Refusal::Undetermined(_))
                    if unborne(before, (fitted, score), data.noise, &data.unit).is_none() =>
                {
                    undetermined.push((*k, form, *score));
                }
                Some(_) => {}
            }
            self.keep(Arc::clone(fitted));
            if let Some(candidate) = candidates.iter_mut().find(|c| c.choice == choice(form)) {
                candidate.delta_bic = score.bic;
                candidate.why = why(form, before, fitted, refused.as_ref().map(Refusal::reason), &data.unit);
                candidate.curve = self.curve(form, (before, fitted), motion);
                candidate.stage = Some(Arc::new(self.show(fitted)));
                candidate.standing =
                    refused.as_ref().map_or(Standing::Refitted, |r| Standing::Refused(r.reason().to_owned()));
            }
        }
        let apart = if self.audit.single_tone { APART_ON_A_TONE } else { APART };
        let ranked = order(&standing, data.noise);
        let title = |k: usize| forms[k].full_title();
        let mut finding = Finding::Unexplained;
        let mut rivals: Vec<usize> = Vec::new();
        if let Some(first) = ranked.first() {
            let entry = |k: usize| standing.iter().find(|s| s.0 == k);
            let others = standing.iter().filter(|s| s.0 != *first).chain(&undetermined);
            let others: Vec<(usize, &Form, Score)> = others.copied().collect();
            for k in &ranked {
                let Some((_, form, score)) = entry(*k) else { continue };
                // Those that do clearly better are told from it.
                let near = |s: &&(usize, &Form, Score)| s.0 != *k && s.2.total > score.total - apart;
                let rest = standing.iter().chain(&undetermined).filter(near);
                let rest: Vec<(usize, &Form, Score)> = rest.copied().collect();
                let names = confused((form, *score), &rest, apart, data.noise).into_iter().map(title).collect();
                if let Some(c) = candidates.iter_mut().find(|c| c.choice == choice(form)) {
                    c.confused_with = names;
                }
            }
            if let Some((_, form, score)) = entry(*first) {
                rivals = confused((form, *score), &others, apart, data.noise);
                if self.audit.single_tone {
                    // What explains as much along a motion of one kind may fail in the refit for reasons of its own.
                    let explained = |k: usize| {
                        candidates.iter().find(|c| c.choice == choice(&forms[k])).map_or(0.0, |c| c.explained)
                    };
                    rivals.extend(
                        (0..forms.len())
                            .filter(|k| forms[*k].effect != form.effect && explained(*k) > NEARLY * explained(*first)),
                    );
                    rivals.sort_unstable();
                    rivals.dedup();
                }
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
        promising.sort_by(|a, b| a.0.total_cmp(&b.0));
        Decision { finding, next_experiment: next, promising: promising.into_iter().map(|p| p.1).collect() }
    }
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
