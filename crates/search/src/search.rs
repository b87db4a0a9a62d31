use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

use super::audit::Audit;
use super::columns::Path;
use super::data::{Data, Series};
use super::decide::{refusal, score, variance_inflation};
use super::effects::{Form, Frame, Setting, catalogue};
use super::error::GapError;
use super::evidence::Examined;
use super::fit::{Care, Fitted, Pace, WHOLE};
use super::outcome::{Blind, Choice, Evidence, Finding, Round, Stage};
use super::parameters::Parameters;
use super::progress::Progress;
use super::propose::usual_speed;
use super::ranking::{Decision, merged};
use super::ruling::Tried;
use super::screen::{Motion, Screened};
use super::site::Placed;
use super::structure::{Composition, choice};
use super::weak::Weak;
use super::words::titles;
use sindyscope_core::refine::{Bar, Output, Point, Structure as _};
use sindyscope_core::study::Cancel;
use sindyscope_values::model::has_acceleration;
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{Expression, Symbol, Term, derivative};

/// What is asked of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Ask {
    /// Terms of every acceleration of the base model; none for a linear spring and damper that suit the data, of several
    /// masses for every displacement, velocity and input.
    pub base: Option<Vec<Term>>,
    /// Terms of single accelerations, by mass counted from zero, in place of those for all.
    pub own: BTreeMap<usize, Vec<Term>>,
    /// Known physics: terms that every acceleration has besides.
    pub known: Vec<Term>,
    /// Most effects that are added.
    pub max_effects: usize,
}

impl Default for Ask {
    fn default() -> Self {
        Self { base: None, own: BTreeMap::new(), known: Vec::new(), max_effects: 3 }
    }
}

impl Ask {
    /// Whether a spring or a damper of the base model acts between a mass and the input: then the input is the motion of the
    /// base, whatever the header says.
    fn is_relative_to_input(&self) -> bool {
        let terms = self.base.iter().flatten().chain(self.own.values().flatten()).chain(&self.known);
        let factor = |term: &Term, symbol: Symbol| match derivative(term.expression(), symbol) {
            Expression::Number(factor) => factor,
            _ => 0.0,
        };
        let pulls = |term: &Term| {
            let symbols = term.symbols();
            let of = |wanted: fn(&Symbol) -> bool| symbols.iter().find(|s| wanted(s)).copied();
            let moves = of(|s| matches!(s, Symbol::State(_) | Symbol::Rate(_)));
            let drives = of(|s| matches!(s, Symbol::Input(_) | Symbol::InputRate(_)));
            moves.zip(drives).is_some_and(|(mass, base)| factor(term, mass) * factor(term, base) < 0.0)
        };
        terms.into_iter().any(pulls)
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
    pub(super) base: Composition,
    known: Mutex<HashMap<Vec<Choice>, Arc<Fitted>>>,
}

/// How far a look goes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Depth {
    /// Whether there is a gap and where, and what the screen says.
    Screened,
    /// The likeliest effects are refitted too.
    Refitted,
}

/// A set of effects refitted with the rest of the model.
pub(super) struct Refit {
    /// Indices of the forms, one or two.
    pub(super) forms: Vec<usize>,
    pub(super) fitted: Arc<Fitted>,
}

/// Times the noise that a fit which explains the data leaves at most: on the data fitted, and on those never fitted.
const EXPLAINED: (f64, f64) = (1.3, 1.5);
/// Weights of the oscillator that a base model's start leans towards, beside those of the data.
const PRIORS: [f64; 3] = [1e-10, 1e-3, 1.0];
/// Share of the sum of squares that a form must leave at most along the motion for a far better fit to be expected of it.
pub(super) const PROMISING: f64 = 0.5;
/// Candidates that are refined.
const REFINED: usize = 12;
/// Candidates that are refined before it is asked whether one of them explains the data.
const LEADERS: usize = 2;
/// Samples times candidates from which fewer are refined, and the fewest.
const EFFORT: usize = 36_000;
const FEWEST: usize = 9;
/// Share of a frequency within which another is the same in a motion whose frequency changes with its amplitude.
const LOCKED: f64 = 0.2;
/// Effects that only the comparison of whole sets tells from their kin: they are not offered where effects are added one at a
/// time.
pub(super) const OF_SETS: [&str; 9] = [
    "belt_friction",
    "bilinear_damping",
    "damping_drift",
    "input_squared",
    "negative_damping",
    "oblique_springs",
    "power_law_damping",
    "power_law_stiffness",
    "state_dependent_input",
];

impl Search {
    /// Prepares records of one mass or several.
    ///
    /// # Errors
    /// Records that do not go together or are too short; a base term of something that they lack.
    pub fn new(records: &RecordSet, ask: &Ask) -> Result<Self, GapError> {
        let mut data = Data::new(records)?;
        if data.input_open && ask.is_relative_to_input() {
            (data.base_excited, data.input_open) = (true, false);
        }
        let masses = data.masses();
        if let Some(mass) = ask.own.keys().find(|mass| **mass >= masses) {
            let (number, there) =
                (mass + 1, if masses == 1 { "one mass".to_owned() } else { format!("{masses} masses") });
            return Err(GapError::Records(format!("there is no equation of v{number}: the records have {there}")));
        }
        let terms = base_terms(&data, ask);
        for Placed { term, .. } in &terms {
            if let Some(symbol) = term.foreign_symbol(&data.layout) {
                return Err(GapError::Symbol { term: term.to_string(), symbol: data.layout.name(symbol) });
            }
            if has_acceleration(term) {
                return Err(GapError::Acceleration(term.text(&data.layout)));
            }
        }
        let audit = data.audit();
        let mut base = Composition::new(data.layout, terms);
        base.passive = !data.self_sustained;
        base.zero = data.shows_rates();
        base.noise = data.noise;
        if let Some(datum) = data.equilibrium(&base) {
            data.count_from(datum);
            base.base.retain(|t| t.term.as_str() != "1");
            base.datum = true;
            base.origin = -datum;
        }
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

    /// Terms of the base model's accelerations.
    pub fn base_terms(&self) -> impl Iterator<Item = &Term> {
        self.base.base.iter().map(|placed| &placed.term)
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

    /// True if the sets of effects are proposed, fitted and judged by one rule: so far on request
    /// (`SINDYSCOPE_SETS`), of one mass whose displacement is measured. Else effects are added one at a time.
    pub(super) fn is_piped(&self) -> bool {
        std::env::var_os("SINDYSCOPE_SETS").is_some() && self.data.outputs == [Output::Displacement(0)]
    }

    /// Variance inflation of a fit whose residuals are correlated.
    pub(super) fn inflation(&self, fitted: &Fitted) -> f64 {
        variance_inflation(fitted, self.data.frequency, self.data.fit()[0].interval)
    }

    pub(super) fn known(&self, choices: &[Choice]) -> Option<Arc<Fitted>> {
        let mut choices = choices.to_vec();
        if self.is_piped() {
            choices.sort();
        }
        self.known.lock().unwrap_or_else(PoisonError::into_inner).get(&choices).cloned()
    }

    pub(super) fn keep(&self, fitted: Arc<Fitted>) {
        let mut choices = fitted.composition.choices();
        if self.is_piped() {
            choices.sort();
        }
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(choices, fitted);
    }

    /// The fit that a stage shows; fitted anew where it was kept from an earlier search.
    pub(super) fn fit_of(&self, stage: &Stage, cancel: &Cancel) -> Result<Arc<Fitted>, GapError> {
        match &stage.fit.0 {
            Some(fitted) => Ok(Arc::clone(fitted)),
            None => self.fitted(&stage.choices(), cancel),
        }
    }

    pub(super) fn fitted(&self, choices: &[Choice], cancel: &Cancel) -> Result<Arc<Fitted>, GapError> {
        if let Some(fitted) = self.known(choices) {
            return Ok(fitted);
        }
        let fitted = match choices.split_last() {
            None => self.fit_base(cancel)?,
            Some(_) if self.is_piped() => self.fit_exactly(choices, cancel)?,
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
        let rough: Vec<Path> = data.fit().iter().map(|s| s.path()).collect();
        let inner = composition.middle();
        composition.scales = data.scales(&composition, &inner, &rough);
        let runs = data.whole();
        let begin = |coefficients| {
            let shared = Parameters { coefficients, inner: inner.clone() }.row();
            Point::new(&composition, &runs, shared, false)
        };
        // Where the data alone lead to a start that does not last (one tone leaves directions open), the start leans
        // towards an oscillator of the motion's frequency.
        for prior in PRIORS {
            let coefficients = data.start(&composition.base, &[], &rough, prior).ok_or(GapError::Base)?;
            let start = begin(coefficients);
            if let Some(refined) = data.refine(&composition, &start, data.lost(), Pace::Thorough, cancel) {
                return Ok(data.judge(composition, refined, Care::Full, cancel));
            }
            if cancel.is_cancelled() {
                return Err(GapError::Cancelled);
            }
        }
        // A model that no whole record can be simulated with may follow short segments.
        let starts = Weak::new(data)
            .estimate(&composition, &inner)
            .map(|e| e.coefficients)
            .into_iter()
            .chain(data.start(&composition.base, &[], &rough, PRIORS[1]));
        for coefficients in starts {
            if let Some(landed) = data.refine_at(&composition, &begin(coefficients), 0, cancel) {
                return Ok(data.judged(composition, landed, cancel));
            }
        }
        if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Err(GapError::Base) }
    }

    pub(super) fn forms(&self, fitted: &Fitted, motion: &Motion) -> Vec<Form> {
        let data = &self.data;
        let over = |pick: &dyn Fn(usize, usize) -> f64| {
            let largest = |(r, s): (usize, &Series)| (0..s.len()).map(|k| pick(r, k).abs()).fold(0.0, f64::max);
            data.fit().iter().enumerate().map(largest).fold(0.0, f64::max)
        };
        let u = |r: usize, k: usize| data.fit()[r].inputs.first().map_or(0.0, |u| u[k]);
        let du = |r: usize, k: usize| data.fit()[r].input_rates.first().map_or(0.0, |u| u[k]);
        let mut frames = Frame::all(data.masses(), data.base_excited);
        for frame in &mut frames {
            let site = frame.site;
            frame.reach = over(&|r, k| site.across(|i| motion.measured[r].x[i][k], u(r, k)));
            frame.speed = over(&|r, k| site.across(|i| motion.measured[r].v[i][k], du(r, k)));
            let velocities: Vec<f64> = (0..data.fit().len())
                .flat_map(|r| (0..data.fit()[r].len()).map(move |k| (r, k)))
                .map(|(r, k)| site.across(|i| motion.measured[r].v[i][k], du(r, k)))
                .collect();
            frame.usual_speed = usual_speed(&velocities);
            let (first, second) = site.masses();
            frame.speed_noise = second.map_or(motion.speed_noise[first], |second| {
                motion.speed_noise[first].hypot(motion.speed_noise[second])
            });
        }
        let lead = data.lead(motion);
        let missing = motion.missing_of(lead);
        // In a motion that dies away a line at its own frequency, or at twice that, is damping or stiffness that depends on the
        // amplitude.
        let dies_away = self.is_piped() && data.fit().iter().all(Series::is_undriven) && !data.self_sustained;
        let locked = |f: &f64, times: &[f64]| times.iter().any(|n| (f / (n * data.frequency) - 1.0).abs() < LOCKED);
        let free = |mut lines: Vec<f64>, times: &[f64]| {
            lines.retain(|f| !(dies_away && locked(f, times)));
            lines
        };
        let setting = Setting {
            base_excited: data.base_excited,
            passive: fitted.composition.passive,
            input_open: data.input_open,
            frames,
            terms: fitted.composition.plain_terms(&fitted.parameters.inner),
            unit: data.unit.clone(),
            derivatives: data.outputs[0].derivatives(),
            inputs: (0..data.layout.inputs).map(|j| over(&|r, k| data.fit()[r].inputs[j][k])).collect(),
            frequency: data.frequency,
            lines: free(data.lines(&missing), &[1.0]),
            pulsations: {
                let spring = |r: usize| if data.base_excited { data.fit()[r].inputs.first() } else { None };
                let product = |r: usize, k: usize| {
                    missing[r][k] * (motion.measured[r].x[lead][k] - spring(r).map_or(0.0, |u| u[k]))
                };
                let products: Vec<Vec<f64>> =
                    (0..data.fit().len()).map(|r| (0..data.fit()[r].len()).map(|k| product(r, k)).collect()).collect();
                free(data.lines(&products.iter().map(Vec::as_slice).collect::<Vec<_>>()), &[1.0, 2.0])
            },
            interval: data.fit()[0].interval,
            measured: over(&|r, k| data.fit()[r].measured[0][k]),
        };
        let present = fitted.composition.choices();
        let offset = fitted.composition.offset();
        catalogue(&setting)
            .into_iter()
            .filter(|f| !present.contains(&choice(f)))
            .filter(|f| self.is_piped() || !OF_SETS.contains(&f.effect))
            // A richer kind of what is there was tried in its place.
            .filter(|f| {
                let of_one_kind = |there: &Form| self.is_piped() && (f.includes(there) || there.includes(f));
                !fitted.composition.forms.iter().any(of_one_kind)
            })
            .filter(|f| !self.audit.blind.iter().any(|b| b.effect == f.effect))
            .filter(|f| {
                // The zero of a velocity or an acceleration is not that of the spring.
                let moved = data.outputs.iter().all(|o| o.derivatives() == 0);
                let tied = moved && (offset || fitted.composition.datum);
                !(tied && f.moves_the_zero(offset) || fitted.composition.zero && f.is_offset())
            })
            .collect()
    }

    /// Looks at a stage: is there a gap, where, and which effects might it be.
    ///
    /// # Errors
    /// Cancelled, or a stage that cannot be simulated.
    pub fn look(&self, stage: &Stage, tell: Listener<'_>, cancel: &Cancel) -> Result<Round, GapError> {
        self.look_into(stage, Depth::Refitted, tell, cancel)
    }

    /// Looks at a stage; effects are refitted only where the depth asks for it.
    pub(super) fn look_into(
        &self,
        stage: &Stage,
        depth: Depth,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<Round, GapError> {
        self.looked(stage, depth, tell, cancel).map(|(round, _)| round)
    }

    /// The same, with what was tried.
    pub(super) fn looked(
        &self,
        stage: &Stage,
        depth: Depth,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<(Round, Option<Tried>), GapError> {
        let before = self.fit_of(stage, cancel)?;
        let data = &self.data;
        tell(Progress::Step("Estimating the missing force", 0.0));
        let motion = data.motion(&before).ok_or_else(|| GapError::Stage(titles(&stage.choices())))?;
        let check = || if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Ok(()) };
        check()?;
        let place = data.place(&before.by_record(&before.refined.residuals), &motion);
        tell(Progress::Place(Box::new(place.clone())));
        let forms = self.forms(&before, &motion);
        let screened = data.screen(&before, &motion, &forms, cancel);
        check()?;
        let mut candidates = self.screened(&before, &motion, &forms, &screened);
        tell(Progress::Ranking(candidates.clone()));
        tell(Progress::Step("Asking whether the gap is more than noise", 0.2));
        let seen = Examined { fitted: &before, motion: &motion, forms: &forms, screened: &screened };
        let evidence = data.evidence(&seen, cancel).ok_or(GapError::Cancelled)?;
        let shown = Arc::new(self.show(&before));
        let round = |compared: Option<&Arc<Fitted>>, candidates, evidence: Evidence, decision: Decision| Round {
            before: Arc::clone(&shown),
            compared: compared.map_or_else(|| Arc::clone(&shown), |compared| Arc::new(self.show(compared))),
            evidence,
            place,
            candidates,
            finding: decision.finding,
            next_experiment: decision.next_experiment,
            company: decision.company,
            hidden_up_to: data.detectable(&seen, cancel),
            lead: None,
        };
        // Correlated residuals may hide a gap from the tests, not one of several noises.
        let loud = self.is_piped() && before.error() > 2.0 * data.noise.hypot(data.between_samples(&before, cancel));
        if !(evidence.significant || loud) || depth == Depth::Screened {
            let finding = if evidence.significant { Finding::Unexplained } else { Finding::Nothing };
            let round = round(None, candidates, evidence, Decision { finding, ..Decision::nothing() });
            check()?;
            return Ok((round, None));
        }
        if self.is_piped() {
            let room = self.ask.max_effects.saturating_sub(before.composition.forms.len()).max(1);
            let (sets, ruling) = self.tried(&before, &forms, room, tell, cancel).ok_or(GapError::Cancelled)?;
            let tried = Tried { forms: forms.clone(), sets, ruling };
            let decision = self.ruled(&before, &motion, &tried, &mut candidates, cancel);
            tell(Progress::Ranking(candidates.clone()));
            let round = round(Some(&tried.sets[0].fitted), candidates, evidence, decision);
            check()?;
            return Ok((round, Some(tried)));
        }
        // A model that follows stretches only has its rivals along those.
        let mut refits = if before.level == WHOLE || self.audit.single_tone {
            self.refitted(&before, &motion, (&forms, &screened), tell, cancel)
        } else {
            Vec::new()
        };
        check()?;
        if let Some(again) = self.rebased(&before, &refits, cancel) {
            let again = Arc::new(again);
            self.keep(Arc::clone(&again));
            check()?;
            return self.looked(&self.show(&again), depth, tell, cancel);
        }
        let mut compared = Arc::clone(&before);
        // One steady tone tells sets apart as little as single effects.
        if !self.audit.single_tone && !refits.iter().any(|r| self.explains(&before, &forms, r, cancel)) {
            tell(Progress::Step("Trying effects and pairs along short segments", 0.6));
            if let Some(sets) = self.sets(&before, &forms, &refits, cancel) {
                (compared, refits) = merged(compared, refits, sets);
            }
            check()?;
        }
        let decision = self.decide(&compared, &motion, &forms, &refits, &mut candidates, cancel);
        check()?;
        tell(Progress::Ranking(candidates.clone()));
        let another = Some(&compared).filter(|_| !Arc::ptr_eq(&compared, &before));
        let round = round(another, candidates, evidence, decision);
        check()?;
        Ok((round, None))
    }

    /// The likeliest effects, each refitted along whole records with the rest of the model.
    fn refitted(
        &self,
        before: &Fitted,
        motion: &Motion,
        (forms, screened): (&[Form], &Screened),
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Vec<Refit> {
        let step = |done: f64| {
            tell(Progress::Step("Refitting the likeliest effects on the simulated response", 0.3 + 0.7 * done));
        };
        step(0.0);
        let tried = screened.likeliest(forms, (EFFORT / before.refined.samples).clamp(FEWEST, REFINED));
        let bar = Bar::default();
        let mut done = 0;
        // The likeliest first: those behind them are held against what these reach.
        let mut fit = |k: &usize| {
            let fitted = self.refit(before, motion, screened, (*k, &forms[*k]), Some(&bar), cancel);
            done += 1;
            step(done as f64 / tried.len() as f64);
            (*k, fitted)
        };
        let (first, rest) = tried.split_at(tried.len().min(LEADERS));
        let mut refits: Vec<(usize, Option<Fitted>)> = first.iter().map(&mut fit).collect();
        // Where one explains the data, those that the screen leaves far behind are not refitted; one tone tells too little.
        let explains = |(k, fitted): &(usize, Option<Fitted>)| {
            let fitted = Arc::new(fitted.clone()?);
            let samples = before.refined.samples as f64 / self.inflation(&fitted);
            self.explains(before, forms, &Refit { forms: vec![*k], fitted }, cancel).then_some((*k, samples))
        };
        let lead = refits.iter().find_map(explains).filter(|_| !self.audit.single_tone);
        let near = |k: &&usize| lead.is_none_or(|(lead, samples)| !screened.outdone(**k, lead, samples));
        refits.extend(rest.iter().filter(near).map(fit));
        let mut refits: Vec<Refit> = self
            .polished(refits, cancel)
            .into_iter()
            .filter_map(|(k, fitted)| Some(Refit { forms: vec![k], fitted: Arc::new(fitted?) }))
            .collect();
        self.try_simpler(before, forms, &mut refits, cancel);
        refits
    }

    /// True if a fit stands and leaves next to nothing but noise, on the data fitted and on those never fitted.
    fn explains(&self, before: &Fitted, forms: &[Form], refit: &Refit, cancel: &Cancel) -> bool {
        let data = &self.data;
        let fitted = &refit.fitted;
        let set: Vec<&Form> = refit.forms.iter().map(|k| &forms[*k]).collect();
        let inflation = self.inflation(fitted);
        data.is_within(fitted, data.noise, EXPLAINED, cancel)
            && refusal(
                &set,
                before,
                (fitted, &score(before, fitted, inflation, 0.0)),
                inflation,
                (data.noise, &data.shown_unit),
            )
            .is_none()
    }
}

/// What was asked for of each mass; else a linear spring and damper: across the joint where the base moves, with the force where
/// one acts. Of several masses, how they are coupled is not known: every displacement, velocity and input in every equation.
fn base_terms(data: &Data, ask: &Ask) -> Vec<Placed> {
    let still = data.fit().iter().all(Series::is_undriven);
    let masses = data.masses();
    let of_all: Vec<Term> = match (&ask.base, data.layout.inputs) {
        (Some(base), _) => base.clone(),
        (None, inputs) if masses > 1 => {
            let states = (0..masses).map(Symbol::State).chain((0..masses).map(Symbol::Rate));
            let driven = (0..inputs).filter(|_| !still).flat_map(|j| {
                let rate = Some(Symbol::InputRate(j)).filter(|_| data.base_excited && j == 0);
                std::iter::once(Symbol::Input(j)).chain(rate)
            });
            states.chain(driven).map(|symbol| Term::new(Expression::Symbol(symbol))).collect()
        }
        (None, inputs) => {
            let (x, v) = (Expression::from(Symbol::State(0)), Expression::from(Symbol::Rate(0)));
            let (across, forces) = match data.base_excited {
                true => ([x - Symbol::Input(0), v - Symbol::InputRate(0)], 1..inputs),
                false => ([x, v], 0..if still { 0 } else { inputs }),
            };
            across.into_iter().chain(forces.map(|j| Symbol::Input(j).into())).map(Term::new).collect()
        }
    };
    let mut placed = Vec::new();
    for mass in 0..masses {
        let of_mass = ask.own.get(&mass).unwrap_or(&of_all);
        for term in of_mass.iter().chain(&ask.known) {
            let next = Placed { mass, term: term.clone() };
            if !placed.contains(&next) {
                placed.push(next);
            }
        }
    }
    placed
}
