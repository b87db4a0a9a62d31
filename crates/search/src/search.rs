use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex};

use super::audit::Audit;
use super::columns::MotionPath;
use super::constants::Constants;
use super::data::{Data, RecordSeries};
use super::effects::OwnEffect;
use super::effort::SearchEffort;
use super::error::GapError;
use super::evidence::Examined;
use super::fit::Fitted;
use super::judge::{Hypothesis, judge};
use super::outcome::{Blind, Choice, Evidence, Finding, Round, Stage};
use super::parameters::Parameters;
use super::progress::Progress;
use super::propose::PresentModel;
use super::ruling::{Decision, Tried};
use super::screen::Motion;
use super::site::Placed;
use super::structure::Composition;
use super::words::titles;
use sindyscope_core::parallel::lock;
use sindyscope_core::refine::{Output, inflation};
use sindyscope_core::study::Cancel;
use sindyscope_values::model::has_acceleration;
use sindyscope_values::record::RecordSet;
use sindyscope_values::term::{Expression, Layout, Symbol, Term, derivative};

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
    /// Samples of every held-out record that its initial state is estimated from, and that its score leaves out; none where
    /// the initial state is fitted to the whole record.
    pub initial: Option<usize>,
    /// Effects of the user's own, looked for as those of the catalogue are.
    pub effects: Vec<OwnEffect>,
    /// What the search decides and budgets by: others than the default are for studies.
    pub constants: Constants,
}

impl Default for Ask {
    fn default() -> Self {
        Self {
            base: None,
            own: BTreeMap::new(),
            known: Vec::new(),
            max_effects: 3,
            initial: None,
            effects: Vec::new(),
            constants: Constants::DEFAULT,
        }
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

/// Which sets of effects a look may lead to.
pub(super) enum Keep<'a> {
    /// Those with the effects that are there.
    Present,
    /// Any, those that were tried before among them.
    Any(&'a mut Tried),
}

/// How far a look goes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Depth {
    /// Whether there is a gap and where, and what the screen says.
    Screened,
    /// The likeliest effects are refitted too.
    Refitted,
}

const NOTHING_HOLDS: &str = "Nothing holds this motion: a spring would push, and predicts the data that are not fitted no better than a constant force. The base model goes without a spring.";

/// Weights of the oscillator that a base model's start leans towards, beside those of the data: next to none, and as much.
const PRIORS: [f64; 2] = [1e-3, 1.0];

impl Search {
    /// Prepares records of one mass or several.
    ///
    /// # Errors
    /// Records that do not go together or are too short; a base term of something that they lack.
    pub fn new(records: &RecordSet, ask: &Ask) -> Result<Self, GapError> {
        Self::prepare(records, ask, &Cancel::default())
    }

    /// As [`Search::new`], for whoever may not wait: many or long records take a second.
    ///
    /// # Errors
    /// As there; cancelled.
    pub fn prepare(records: &RecordSet, ask: &Ask, cancel: &Cancel) -> Result<Self, GapError> {
        let mut data = Data::new(records, ask, cancel)?;
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
        for effect in &ask.effects {
            let wrong = |problem: String| GapError::Effect { effect: effect.name.clone(), problem };
            effect.check().map_err(|e| wrong(e.problem))?;
            if effect.mass >= masses {
                return Err(wrong(format!("it acts on mass {}, which the records do not have", effect.mass + 1)));
            }
            let layout = Layout { internals: effect.states.len(), ..data.layout };
            for term in effect.sample() {
                if let Some(symbol) = term.foreign_symbol(&layout) {
                    return Err(wrong(format!("the records have no {}", data.layout.name(symbol))));
                }
            }
        }
        if cancel.is_cancelled() {
            return Err(GapError::Cancelled);
        }
        let audit = data.audit();
        let mut base = Composition::new(data.layout, terms);
        base.passive = !data.self_sustained;
        base.zero = data.shows_rates();
        base.noise = data.noise;
        base.reciprocity = data.constants.reciprocity;
        let plain = Self { data, audit, ask: ask.clone(), base, known: Mutex::default() };
        let counted = plain.about_its_equilibrium(cancel).unwrap_or(plain);
        let prepared = counted.without_its_spring(cancel).unwrap_or(counted);
        let prepared = prepared.otherwise_estimated(cancel).unwrap_or(prepared);
        if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Ok(prepared) }
    }

    /// The same search of other data, or with another base model; nothing is fitted yet.
    pub(super) fn anew(&self, data: Data, base: Composition) -> Self {
        Self { data, audit: self.audit.clone(), ask: self.ask.clone(), base, known: Mutex::default() }
    }

    /// The same search without the base model's spring, where that has no part in the motion's frequency and would push: a spring
    /// may push where data never fitted say so. None if they do, beside a constant force in its place; what nothing holds drifts
    /// under any constant force as if pushed away.
    fn without_its_spring(&self, cancel: &Cancel) -> Option<Self> {
        let (data, base) = (&self.data, &self.base);
        let spring = base.spring()?;
        if base.datum || data.outputs != [Output::Displacement(0)] {
            return None;
        }
        let regressed = PresentModel::new(data, base, &base.middle(), cancel).exactly(&[])?;
        if !data.is_slow(base.named(&regressed.shared).coefficients[spring]) {
            return None;
        }
        let pushed = Fitted::clone(&*self.fitted(&[], cancel).ok()?);
        if pushed.parameters.coefficients[spring] <= 0.0 {
            return None;
        }
        let constant = Placed { mass: 0, term: Term::parse("1").ok()? };
        let mut free = base.clone();
        free.base.remove(spring);
        free.base.retain(|t| *t != constant);
        let steady = Composition { base: free.base.iter().cloned().chain([constant]).collect(), ..free.clone() };
        let start = PresentModel::new(data, &steady, &steady.middle(), cancel).exactly(&[])?;
        let drifting = self.fitted_set(start, Vec::new(), None, &|_| false, cancel)?;
        let pushed = self.hypothesis(Vec::new(), pushed, cancel);
        if data.constants.beats(&pushed, &drifting, data.constants.lead) {
            return None;
        }
        let mut data = data.clone();
        data.notices.push(NOTHING_HOLDS.to_owned());
        Some(self.anew(data, free))
    }

    /// The same search with displacements counted from the point that a spring holds the motion about; none where that is the
    /// file's zero, or the fitted spring holds the motion about no point: what is constant is a force then.
    fn about_its_equilibrium(&self, cancel: &Cancel) -> Option<Self> {
        let datum = self.data.equilibrium(&self.base, cancel)?;
        let (mut data, mut base) = (self.data.clone(), self.base.clone());
        data.count_from(datum);
        base.base.retain(|t| t.term.as_str() != "1");
        base.datum = true;
        base.origin = -datum;
        let counted = self.anew(data, base);
        let fitted = counted.fitted(&[], cancel).ok()?;
        let point = fitted.parameters.inner.equilibrium.unwrap_or(0.0);
        counted.data.is_held_about(point).then_some(counted)
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

    /// What it has cost so far.
    pub fn effort(&self) -> SearchEffort {
        self.data.counters.so_far()
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

    /// Variance inflation of a fit whose residuals are correlated.
    pub(super) fn inflation(&self, fitted: &Fitted) -> f64 {
        // The series of each sensor in each run by itself.
        let runs = fitted.refined.residuals.iter().zip(fitted.runs.iter());
        let series: Vec<&[f64]> = runs.flat_map(|(e, run)| e.chunks(run.range.len().max(1))).collect();
        inflation(&series, self.data.frequency * self.data.fit()[0].interval)
    }

    pub(super) fn known(&self, choices: &[Choice]) -> Option<Arc<Fitted>> {
        let mut choices = choices.to_vec();
        choices.sort();
        lock(&self.known).get(&choices).cloned()
    }

    pub(super) fn keep(&self, fitted: Arc<Fitted>) {
        let mut choices = fitted.composition.choices();
        choices.sort();
        lock(&self.known).insert(choices, fitted);
    }

    /// Every model that was fitted, the smaller sets of effects first.
    pub(super) fn every_fit(&self) -> Vec<Arc<Fitted>> {
        let known = lock(&self.known);
        let mut all: Vec<_> = known.iter().collect();
        all.sort_by(|a, b| a.0.len().cmp(&b.0.len()).then_with(|| a.0.cmp(b.0)));
        all.into_iter().map(|(_, fitted)| Arc::clone(fitted)).collect()
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
            return Ok(self.asked(&fitted, cancel));
        }
        let fitted = if choices.is_empty() { self.fit_base(cancel)? } else { self.fit_exactly(choices, cancel)? };
        if cancel.is_cancelled() {
            return Err(GapError::Cancelled);
        }
        let fitted = Arc::new(fitted);
        self.keep(Arc::clone(&fitted));
        Ok(fitted)
    }

    /// The motion under the fitted model of these effects.
    pub(super) fn motion(&self, fitted: &Fitted, choices: &[Choice], cancel: &Cancel) -> Result<Motion, GapError> {
        let motion = self.data.motion(fitted, cancel);
        if cancel.is_cancelled() {
            return Err(GapError::Cancelled);
        }
        motion.ok_or_else(|| GapError::Stage(titles(choices)))
    }

    fn fit_base(&self, cancel: &Cancel) -> Result<Fitted, GapError> {
        let data = &self.data;
        let mut composition = self.base.clone();
        let rough: Vec<MotionPath> = data.fit().iter().map(|s| s.path()).collect();
        let inner = composition.middle();
        composition.scales = data.scales(&composition, &inner, &rough);
        // Where the data alone lead to a start that does not last (one tone leaves directions open), the start leans
        // towards an oscillator of the motion's frequency.
        let leaning = |prior: f64| {
            let coefficients = data.start(&composition.base, &[], &rough, prior)?;
            Some(Parameters { coefficients, inner: inner.clone() }.row())
        };
        let regressed = || PresentModel::new(data, &composition, &inner, cancel).exactly(&[]).map(|start| start.shared);
        for start in std::iter::once(regressed()).chain(PRIORS.map(leaning)).flatten() {
            if let Some(landed) = self.landed(&composition, &start, None, cancel) {
                return Ok(data.judged(composition, landed, cancel));
            }
            if cancel.is_cancelled() {
                break;
            }
        }
        if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Err(GapError::Base) }
    }

    /// Decides between all sets that were tried; each must contain those present. What decides, and what is told of it, was asked.
    pub(super) fn rule(&self, tried: &mut Tried, present: &[usize], cancel: &Cancel) {
        let data = &self.data;
        // Where nothing explains the data every set is wrong in some way still, and densities say too much.
        let constants = &data.constants;
        let matters = constants.mattering() * data.noise.max(tried.coloured.rms);
        let explains = |s: &Hypothesis| s.unborne.is_none() && s.fitted.error() < matters;
        // Where noise is coloured, what chance gives one sample it gives those beside it too.
        let coloured =
            tried.sets.iter().filter(|s| explains(s) && s.fitted.error() >= constants.mattering() * data.noise);
        let inflation = coloured.map(|s| self.inflation(&s.fitted)).fold(1.0, f64::max);
        let least = inflation * constants.least_lead(self.audit.single_tone);
        let explained = tried.sets.iter().any(explains);
        let far = if explained { least } else { least.max(constants.unseen_ratio.ln() * data.unseen() as f64) };
        let coloured_noise = tried.coloured.rms;
        // The noise is no more than what the larger set leaves, however it was estimated.
        let suffices = |part: &Hypothesis, set: &Hypothesis| {
            let noise = || data.noise_of(&part.fitted, cancel).max(coloured_noise).min(set.fitted.error());
            self.suffices(&part.fitted, noise)
        };
        // What a richer kind explains may be what an input that is rough from sample to sample does between them.
        let unknown = |simple: &Hypothesis, richer: &Hypothesis| {
            let (left, less) = (simple.fitted.error(), richer.fitted.error());
            data.hides_between_samples(&simple.fitted, (left * left - less * less).max(0.0).sqrt(), cancel)
        };
        loop {
            tried.ruling = judge(constants, &tried.sets, &tried.forms, present, (least, far), &suffices, &unknown);
            let told = tried.told();
            if !self.ask(tried, told.into_iter(), cancel) || cancel.is_cancelled() {
                break;
            }
        }
    }

    /// Looks at a stage: is there a gap, where, and which effects might it be.
    ///
    /// # Errors
    /// Cancelled, or a stage that cannot be simulated.
    pub fn look(&self, stage: &Stage, tell: Listener<'_>, cancel: &Cancel) -> Result<Round, GapError> {
        self.look_into(stage, Depth::Refitted, Keep::Present, tell, cancel)
    }

    /// Looks at a stage; effects are refitted only where the depth asks for it.
    pub(super) fn look_into(
        &self,
        stage: &Stage,
        depth: Depth,
        keep: Keep<'_>,
        tell: Listener<'_>,
        cancel: &Cancel,
    ) -> Result<Round, GapError> {
        let before = self.fit_of(stage, cancel)?;
        let data = &self.data;
        tell(Progress::Step("Estimating the missing force", 0.0));
        let motion = self.motion(&before, &stage.choices(), cancel)?;
        let check = || if cancel.is_cancelled() { Err(GapError::Cancelled) } else { Ok(()) };
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
        let round = |candidates, evidence: Evidence, decision: Decision| Round {
            before: Arc::clone(&shown),
            compared: Arc::clone(&shown),
            evidence,
            place,
            candidates,
            finding: decision.finding,
            next_experiment: decision.next_experiment,
            hidden_up_to: data.detectable(&seen, cancel),
            lead: decision.lead,
        };
        // Correlated residuals may hide a gap from the tests, not one of several noises.
        let loud = before.error() > data.constants.loud * data.noise_of(&before, cancel);
        if !(evidence.significant || loud) || depth == Depth::Screened {
            let finding = if evidence.significant { Finding::Unexplained } else { Finding::Nothing };
            let round = round(candidates, evidence, Decision::without_effect(finding));
            check()?;
            return Ok(round);
        }
        let mut alone = Tried::default();
        let (tried, keeps_present) = match keep {
            Keep::Present => (&mut alone, true),
            Keep::Any(tried) => (tried, false),
        };
        if !self.try_beside(&before, (&forms, &screened), tried, tell, cancel) {
            return Err(GapError::Cancelled);
        }
        let present = if keeps_present { tried.indices(&before.composition) } else { Vec::new() };
        self.rule(tried, &present, cancel);
        let shown = tried.beside(&tried.indices(&before.composition));
        self.ask(tried, shown.into_iter(), cancel);
        let decision = self.ruled(&before, &motion, tried, &mut candidates, cancel);
        tell(Progress::Ranking(candidates.clone()));
        let round = round(candidates, evidence, decision);
        check()?;
        Ok(round)
    }
}

/// What was asked for of each mass; else a linear spring and damper: across the joint where the base moves, with the force where
/// one acts. Of several masses, how they are coupled is not known: every displacement, velocity and input in every equation.
fn base_terms(data: &Data, ask: &Ask) -> Vec<Placed> {
    let still = data.fit().iter().all(RecordSeries::is_undriven);
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
