//! A study is a value: settings and records in, [`Outcome`] out; the same in the window, on the command line and in tests.
//!
//! Two files need each other: a `regression` whose masses are `opposed` solves for fewer parameters.

mod bias;
mod calibrate;
mod calibration;
mod candidates;
mod choose;
mod covariance;
mod degree;
mod eliminate;
mod ensemble;
mod error;
mod grow;
mod known;
mod noise;
mod opposite;
mod outcome;
mod refined;
mod regression;
mod response;
mod score;
pub(crate) mod settings;
mod settings_grid;
mod stream;
mod suggest;
mod table;
mod validation;
mod warnings;
mod weak;

pub use crate::refine::Horizon;
use crate::refine::{Bar, Effort};
pub use calibrate::calibrate;
pub use calibration::{Calibrated, Calibration, calibration_list};
pub use choose::{ChosenSettings, FreeSettings, choose};
pub use covariance::Covariance;
pub use ensemble::{Ensemble, Inclusion};
pub use error::{Cancel, StudyError};
pub use known::{Known, Pair, Sign, known_list};
pub use outcome::{
    DroppedTerm, Elapsed, EquationFit, Outcome, PathTerm, RecordOutcome, SensorResponse, SensorScore, Severity,
    Warning, force_over_mass,
};
pub use refined::Refinement;
pub use score::Score;
pub use settings::{Formulation, Kinematics, Lock, Own, Scaling, Settings};
pub use settings_grid::{GridCell, Judge, SettingsGrid, SettingsGridPoint, settings_grid};
pub use stream::{Alarm, AlarmCause, AlarmChange, Blocking, Cleared, Judged, Stream, StreamSettings, StreamUpdate};
pub use suggest::suggest;
pub use table::{FORMS, KINEMATICS, METHODS, REGRESSORS, SCALINGS, SETTINGS, asks_for_unit_mass, setting, term_lists};
pub use weak::suggested_half_width;

pub use crate::signal::{Differentiation, Smoothing};
pub use crate::sparse::Regressor;

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use crate::clock::Stopwatch;
pub use crate::dataset::base_excited;
use crate::dataset::{Dataset, Prepared};
use crate::signal::Signals;
use crate::simulate::{Response, Simulator};
use candidates::candidate_terms;
use regression::{Regression, fitted_states, sliding, standing};
use response::Responses;
use sindyscope_values::model::{Model, Units, check_accelerations};
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Expression, Layout, Term};

/// Shortest stick of a response that is told of, in sampling intervals: no measurement shows shorter ones.
const MIN_STICK_SAMPLES: f64 = 5.0;

/// Runs studies and keeps what the next one can use again: a moved threshold smooths nothing anew.
#[derive(Debug, Default)]
pub struct Study {
    dataset: Dataset,
    /// The velocities whose sign the library takes.
    sliding: Vec<Expression>,
    /// For each record, its signals and the samples at which something stands whose velocity's sign the library takes.
    standing: Vec<(SameSignals, Arc<[Range<usize>]>)>,
    regression: Option<(RegressionKey, Arc<Regression>)>,
    responses: Responses,
    /// What the best of several rivals leaves that are refined along the same records, each in a study of its own: one that
    /// stays far behind is given up.
    rivals: Option<Arc<Bar>>,
    /// A model of the same terms whose coefficients refinement begins with; without it the regression's.
    start: Option<Model>,
    /// Counts the integration steps of refinement.
    effort: Arc<Effort>,
}

/// What a regression's columns depend on; signals by identity, which their `Arc`s keep alive.
#[derive(Debug, PartialEq)]
struct RegressionKey {
    terms: Vec<Term>,
    fitted: Vec<usize>,
    smoothing: Smoothing,
    form: Formulation,
    known: Vec<Known>,
    own: BTreeMap<usize, Own>,
    signals: Vec<SameSignals>,
}

#[derive(Debug)]
struct SameSignals(Arc<Signals>);

impl PartialEq for SameSignals {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Study {
    /// Runs one study.
    ///
    /// # Errors
    /// Settings that do not fit the records, or nothing to fit; cancelled.
    pub fn run(&mut self, records: &RecordSet, settings: &Settings, cancel: &Cancel) -> Result<Outcome, StudyError> {
        let started = Stopwatch::start();
        crate::parallel::within(|| self.run_since(started, records, settings, cancel))
    }

    fn run_since(
        &mut self,
        started: Stopwatch,
        records: &RecordSet,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Outcome, StudyError> {
        let regression = self.made_ready(records, settings, cancel)?;
        let identified = regression.identify(settings);
        let mut model = identified.model.clone();
        let mut covariance = Covariance::default();
        let mut refinement = None;
        let mut refused = None;
        if settings.refine {
            covariance = regression.errors(&identified);
            covariance.tell(&mut model, regression.fitted());
            match self.refine(records, settings, &mut model, &mut covariance, &[], cancel)? {
                Ok(done) => refinement = Some(done),
                Err(reason) => refused = Some(reason),
            }
        }
        let fit = started.milliseconds();
        let mut respond = || {
            let simulating = Stopwatch::start();
            let responses = self.simulate(records, &model, settings.initial, cancel);
            (responses, simulating.milliseconds())
        };
        // Nothing that is drawn first waits for the errors of a regression.
        let (responses, simulate) = if settings.refine {
            respond()
        } else {
            let (responded, errors) = crate::parallel::join(respond, || regression.errors(&identified));
            covariance = errors;
            covariance.tell(&mut model, regression.fitted());
            responded
        };
        let (outcomes, train, test) = responses?;
        let elapsed = Elapsed { fit, simulate };
        let noise_floor =
            noise_floor(self.dataset.records.iter().zip(&records.entries).map(|(p, (_, usage))| (p, *usage)));
        let mut outcome = Outcome {
            settings: settings.clone(),
            model,
            fits: identified.fits,
            covariance,
            refinement,
            records: outcomes,
            train,
            test,
            noise_floor,
            warnings: Vec::new(),
            elapsed,
        };
        if outcome.refinement.is_none()
            && let Some(shifts) = self.shifts(&regression, settings, &outcome.model, &outcome.records)
        {
            outcome.allow_for(shifts, regression.fitted());
        }
        outcome.warnings = warnings::warnings(&outcome, records, refused);
        Ok(outcome)
    }

    /// How far free runs of an outcome's model predict the records of one usage, all together; none where there are none,
    /// or the model follows them nowhere.
    ///
    /// # Errors
    /// Cancelled.
    pub fn horizon(&self, outcome: &Outcome, usage: Usage, cancel: &Cancel) -> Result<Option<Horizon>, StudyError> {
        let prepared = |o: &RecordOutcome| self.dataset.records.iter().find(|p| Arc::ptr_eq(&p.record, &o.record));
        let outcomes: Vec<&RecordOutcome> = outcome.records.iter().filter(|o| o.usage == usage).collect();
        let records: Vec<&Prepared> = outcomes.iter().filter_map(|o| prepared(o)).collect();
        let lasts = |(o, prepared): (&&RecordOutcome, &&Prepared)| {
            let holds = |(i, c): (usize, &SensorResponse)| {
                c.score.is_some_and(|s| crate::refine::holds(s.rmse, prepared.sensor_noise(i)))
            };
            o.diverged_at.is_none() && o.channels.iter().enumerate().all(holds)
        };
        let score = if usage == Usage::Fit { outcome.train } else { outcome.test };
        if let Some(score) = score.filter(|_| outcomes.iter().zip(&records).all(lasts)) {
            // As the response itself tells: no stretch needs to be begun anew.
            let longest = records.iter().map(|p| p.record.len() as f64 * p.record.interval).fold(0.0, f64::max);
            return Ok(Some(Horizon { seconds: longest, rmse: score.rmse }));
        }
        let found = refined::horizon_of(&outcome.model, &records, cancel);
        cancel.check()?;
        Ok(found)
    }

    /// Checks, smooths and reduces: what a regression of these records needs.
    fn made_ready(
        &mut self,
        records: &RecordSet,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Arc<Regression>, StudyError> {
        let layout = check(records, settings)?;
        self.prepare(records, &layout, &settings.smoothing, cancel)?;
        self.find_standstills(settings);
        let regression = self.regression(records, settings)?;
        cancel.check()?;
        Ok(regression)
    }

    /// What is sought of the channels, found with the coefficients of one refinement.
    fn calibrated(
        &mut self,
        records: &RecordSet,
        settings: &Settings,
        sought: &[Calibration],
        cancel: &Cancel,
    ) -> Result<Vec<Calibrated>, StudyError> {
        let mut model = self.made_ready(records, settings, cancel)?.identify(settings).model;
        let mut covariance = Covariance::default();
        let found = self.refine(records, settings, &mut model, &mut covariance, sought, cancel)?;
        found.map(|refinement| refinement.calibrated).map_err(|reason| StudyError::Setting(reason.to_owned()))
    }

    /// Fits the coefficients to the response; the inner error says why not.
    fn refine(
        &self,
        records: &RecordSet,
        settings: &Settings,
        model: &mut Model,
        covariance: &mut Covariance,
        sought: &[Calibration],
        cancel: &Cancel,
    ) -> Result<Result<Refinement, &'static str>, StudyError> {
        let prepared: Vec<(&Prepared, Usage)> =
            self.dataset.records.iter().zip(&records.entries).map(|(p, (_, usage))| (p, *usage)).collect();
        let pairs = opposite::pairs(settings);
        let decided = |freedom: usize, term: &Term| {
            let settings = settings.of_equation(freedom);
            (candidates::lock_of(&settings, term), candidates::sign_of(&settings, term, freedom))
        };
        let hints = refined::Hints { start: self.start.as_ref(), rivals: self.rivals.as_deref(), effort: &self.effort };
        let asked = refined::RefinementTask { decided: &decided, pairs: &pairs, sought };
        refined::refined(model, covariance, &prepared, asked, hints, cancel)
    }

    /// Signals of every record that is not off, keeping those that are still right.
    fn prepare(
        &mut self,
        records: &RecordSet,
        layout: &Layout,
        smoothing: &Smoothing,
        cancel: &Cancel,
    ) -> Result<(), StudyError> {
        if self.dataset.layout != *layout {
            let (rivals, start, effort) = (self.rivals.take(), self.start.take(), Arc::clone(&self.effort));
            *self = Self { rivals, start, effort, ..Self::default() };
        }
        self.dataset.update(records, layout, smoothing, || cancel.check())?;
        self.responses.keep(&self.dataset.records);
        Ok(())
    }

    /// Where each record stands, found anew only for other velocities or other records.
    fn find_standstills(&mut self, settings: &Settings) {
        let layout = self.dataset.layout;
        let sliding = sliding(&candidate_terms(settings, &layout));
        let before = if sliding == self.sliding { std::mem::take(&mut self.standing) } else { Vec::new() };
        let found = |prepared: &Prepared| {
            let signals = SameSignals(Arc::clone(&prepared.signals));
            let known = before.iter().find(|(s, _)| *s == signals).map(|(_, standing)| Arc::clone(standing));
            let standing = known.unwrap_or_else(|| standing(&sliding, &layout, &prepared.signals).into());
            (signals, standing)
        };
        self.standing = self.dataset.records.iter().map(found).collect();
        self.sliding = sliding;
    }

    fn regression(&mut self, records: &RecordSet, settings: &Settings) -> Result<Arc<Regression>, StudyError> {
        let signals = self
            .dataset
            .records
            .iter()
            .zip(&records.entries)
            .filter(|(_, (_, usage))| *usage == Usage::Fit)
            .map(|(prepared, _)| SameSignals(Arc::clone(&prepared.signals)))
            .collect();
        let key = RegressionKey {
            terms: candidate_terms(settings, &self.dataset.layout),
            fitted: fitted_states(&self.dataset.layout, settings.kinematics),
            smoothing: settings.smoothing,
            form: settings.form,
            known: settings.known.clone(),
            own: settings.own.clone(),
            signals,
        };
        if let Some((known, regression)) = &self.regression
            && *known == key
        {
            return Ok(Arc::clone(regression));
        }
        let signals: Vec<Arc<Signals>> = key.signals.iter().map(|s| Arc::clone(&s.0)).collect();
        let basis = regression::basis(&self.dataset.layout, &key.terms, &signals, key.form, &key.fitted)?;
        let regression =
            Regression::new(&self.dataset.layout, &key.terms, &signals, &key.smoothing, &basis, &key.fitted)?;
        let regression = Arc::new(regression.bounded(settings));
        self.regression = Some((key, Arc::clone(&regression)));
        Ok(regression)
    }

    /// What smoothing and noise shift a model's coefficients by.
    fn shifts(
        &self,
        regression: &Regression,
        settings: &Settings,
        model: &Model,
        records: &[RecordOutcome],
    ) -> Option<Vec<Vec<f64>>> {
        let prepared = |o: &RecordOutcome| self.dataset.records.iter().find(|p| Arc::ptr_eq(&p.record, &o.record));
        let fitted = records.iter().filter(|o| o.usage == Usage::Fit);
        let fitted: Option<Vec<bias::Responded>> = fitted.map(|o| Some((prepared(o)?, &o.states[..]))).collect();
        bias::shifts(regression, settings, model, &fitted?)
    }

    /// The model's response along every record that is not off, with the pooled scores of fitted and held-out ones.
    #[expect(clippy::type_complexity, reason = "three results of one pass")]
    fn simulate(
        &mut self,
        records: &RecordSet,
        model: &Model,
        initial: Option<usize>,
        cancel: &Cancel,
    ) -> Result<(Vec<RecordOutcome>, Option<Score>, Option<Score>), StudyError> {
        let simulator = Simulator::new(model).map_err(|e| StudyError::Setting(e.to_string()))?;
        let mut pooled = [Some(score::ErrorSums::default()); 2];
        let mut outcomes = Vec::with_capacity(records.entries.len());
        let prepared = self.dataset.records.iter().zip(&self.standing);
        for ((prepared, (_, standing)), (record, usage)) in prepared.zip(&records.entries) {
            if *usage == Usage::Off {
                continue;
            }
            let initial = initial.filter(|_| *usage == Usage::HeldOut);
            let scored_from = initial.unwrap_or(0);
            let response = self.responses.get((model, &simulator), prepared, initial, cancel)?;
            let mut channels = Vec::with_capacity(self.dataset.layout.freedoms);
            let pool = &mut pooled[usize::from(*usage == Usage::HeldOut)];
            if response.diverged_at.is_some() {
                *pool = None;
            }
            for (i, symbol) in self.dataset.layout.state_symbols().take(self.dataset.layout.freedoms).enumerate() {
                let (Some(channel), Some(shown)) = (record.sensor(i), prepared.drive().outputs.get(i)) else {
                    continue;
                };
                let zero = prepared.drive().zeros[i];
                let series: Vec<f64> =
                    shown.series(&response, self.dataset.layout.freedoms).iter().map(|s| s + zero).collect();
                let mut error = Vec::with_capacity(series.len());
                let tally = score::ErrorSums::compare(&channel.values, &series, scored_from, &mut error);
                if i == 0 {
                    *pool = pool.map(|p| p.plus(tally));
                }
                channels.push(SensorResponse {
                    symbol,
                    role: channel.role,
                    response: series,
                    error,
                    score: tally.score(),
                });
            }
            outcomes.push(RecordOutcome {
                record: Arc::clone(record),
                usage: *usage,
                signals: Arc::clone(&prepared.signals),
                driven_as_measured: prepared.drive().as_measured,
                scored_from,
                states: response.states.clone(),
                standing: Arc::clone(standing),
                sticks: sticks(&response, prepared.record.interval),
                channels,
                diverged_at: response.diverged_at,
            });
        }
        let [train, test] = pooled.map(|p| p.and_then(|p| p.score()));
        Ok((outcomes, train, test))
    }
}

/// When a response sticks for longer than sampling would hide, s; what sticks at once and on is one.
fn sticks(response: &Response, interval: f64) -> Vec<Range<f64>> {
    let mut all: Vec<Range<f64>> = response.sticks.iter().map(|s| s.from..s.to).collect();
    all.sort_by(|a, b| a.start.total_cmp(&b.start));
    let mut joined: Vec<Range<f64>> = Vec::new();
    for stick in all {
        match joined.last_mut() {
            Some(last) if stick.start <= last.end => last.end = last.end.max(stick.end),
            _ => joined.push(stick),
        }
    }
    joined.retain(|s| s.end - s.start > MIN_STICK_SAMPLES * interval);
    joined
}

/// The records' common layout, after holding the settings against it.
fn check(records: &RecordSet, settings: &Settings) -> Result<Layout, StudyError> {
    let used: Vec<&Arc<Record>> = records.entries.iter().filter(|(_, u)| *u != Usage::Off).map(|(r, _)| r).collect();
    if records.with(Usage::Fit).next().is_none() {
        return Err(StudyError::NothingToFit);
    }
    if let Some(initial) = settings.initial
        && let Some(record) = records.with(Usage::HeldOut).find(|r| r.len() <= initial)
    {
        return Err(StudyError::Setting(format!(
            "record {:?} has {} samples: none is left to score after {initial} for the initial state",
            record.name,
            record.len()
        )));
    }
    let layout = used.first().map_or_else(Layout::default, |r| r.layout(settings.kind));
    if let Some(other) = used.iter().find(|r| r.layout(settings.kind) != layout) {
        return Err(StudyError::RecordsDiffer(format!(
            "record {:?} measures other channels than {:?}: use only records with the same ones",
            other.name, used[0].name
        )));
    }
    if layout.freedoms == 0 {
        return Err(StudyError::RecordsDiffer("the records hold no displacement: say which column it is".into()));
    }
    candidates::check(settings, &layout)?;
    let terms = candidate_terms(settings, &layout);
    if terms.is_empty() {
        return Err(StudyError::Setting("the library is empty: add at least one term".into()));
    }
    if let Some((term, symbol)) = terms.iter().find_map(|t| t.foreign_symbol(&layout).map(|s| (t, s))) {
        return Err(StudyError::Setting(format!(
            "the term {term} needs {}, which the records do not have",
            layout.name(symbol)
        )));
    }
    terms
        .iter()
        .try_for_each(|term| check_accelerations(term, &layout))
        .map_err(|e| StudyError::Setting(e.to_string()))?;
    if let Some(record) = used.first() {
        let units = Units::from_record(record, &layout);
        terms.iter().try_for_each(|t| units.check(t, &layout)).map_err(StudyError::Setting)?;
    }
    let Smoothing { method, order, .. } = settings.smoothing;
    if let Some(window) = settings.smoothing.given() {
        if window % 2 == 0 || window < 3 {
            return Err(StudyError::Setting(format!("the segment length must be odd and at least 3, not {window}")));
        }
        if method.is_local() && (order == 0 || order >= window) {
            return Err(StudyError::Setting(format!(
                "a polynomial of order {order} needs a segment longer than {order} samples, not {window}"
            )));
        }
        if let Some(short) = records.with(Usage::Fit).find(|r| r.len() < window) {
            return Err(StudyError::Setting(format!(
                "record {:?} has {} samples, fewer than the segment length {window}: shorten the segment",
                short.name,
                short.len()
            )));
        }
    }
    if method == Differentiation::TotalVariation
        && let Some((long, _)) =
            records.entries.iter().find(|(r, u)| *u != Usage::Off && r.len() > Smoothing::MOST_VARIATION)
    {
        return Err(StudyError::Setting(format!(
            "total variation is for records of up to {} samples, {:?} has {}: cut it, or take another way of differentiating",
            Smoothing::MOST_VARIATION,
            long.name,
            long.len()
        )));
    }
    if !(settings.threshold >= 0.0 && settings.ridge >= 0.0) {
        return Err(StudyError::Setting("threshold and ridge must be zero or more".into()));
    }
    Ok(layout)
}

/// RMS over the fitted records of the first sensor's noise.
fn noise_floor<'a>(records: impl Iterator<Item = (&'a Prepared, Usage)>) -> Option<f64> {
    let (mut squares, mut samples) = (0.0, 0.0);
    for (prepared, _) in records.filter(|(_, usage)| *usage == Usage::Fit) {
        let n = prepared.record.len() as f64;
        squares += n * prepared.sensor_noise(0).powi(2);
        samples += n;
    }
    (samples > 0.0).then(|| f64::sqrt(squares / samples))
}
