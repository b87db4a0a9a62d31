//! The simulation stage: a model's response along a record, from the record's initial state.

use std::ops::Range;
use std::sync::Arc;

use super::{Cancel, Prepared, StudyError};
use crate::model::Model;
use crate::record::{Record, Role};
use crate::signal::{Facts, Signals};
use crate::simulate::{InputGrid, Limits, Response, Simulator, fit_initial_state};
use crate::sparse::rms;
use crate::term::Layout;

/// What drives a record's simulation: its inputs, the measured motion that the initial state is fitted to, its limits.
#[derive(Debug)]
pub(super) struct Drive {
    grid: InputGrid,
    signals: Arc<Signals>,
    measured: Vec<Arc<[f64]>>,
    limits: Vec<f64>,
    /// Samples that an initial state is fitted to, at most.
    opening: usize,
}

/// A response has left the data's range where a state exceeds its largest measured magnitude so many times.
const RANGE: f64 = 10.0;
/// Main periods that an initial state is fitted to.
const OPENING_PERIODS: f64 = 4.0;

impl Drive {
    /// Inputs with little noise drive the simulation as measured, noisy ones as smoothed: a derivative of raw noise
    /// would shake the model.
    pub(super) fn new(record: &Record, layout: &Layout, facts: &Facts, signals: &Arc<Signals>) -> Self {
        let raw: Vec<&[f64]> =
            (0..layout.inputs).filter_map(|j| record.channel(Role::Input(j))).map(|c| &*c.values).collect();
        let quiet = (0..raw.len()).all(|j| {
            let slope = rms(&signals.input_rates[j]);
            facts.input_noise[j] <= 1e-3 * slope * record.interval
        });
        let (start, interval, samples) = (record.start, record.interval, record.len());
        let grid = if quiet {
            InputGrid::new(start, interval, samples, &raw, None)
        } else {
            let inputs: Vec<&[f64]> = signals.inputs.iter().map(|s| &**s).collect();
            let rates: Vec<&[f64]> = signals.input_rates.iter().map(|s| &**s).collect();
            InputGrid::new(start, interval, samples, &inputs, Some(&rates))
        };
        let measured =
            (0..layout.freedoms).filter_map(|i| record.channel(Role::Displacement(i))).map(|c| Arc::clone(&c.values));
        let limits = signals.states.iter().map(|s| RANGE * s.iter().fold(0.0_f64, |m, v| m.max(v.abs()))).collect();
        let period = signals.main_period.map_or(0.1 * samples as f64, |p| p / interval);
        let opening = ((OPENING_PERIODS * period) as usize).clamp(20, samples.max(20));
        Self { grid, signals: Arc::clone(signals), measured: measured.collect(), limits, opening }
    }
}

/// The response over a stretch of a record, from the initial state that fits the stretch's opening best.
pub(super) fn stretch(simulator: &Simulator, drive: &Drive, samples: Range<usize>) -> Response {
    respond(simulator, drive, samples, &|| false)
}

fn respond(simulator: &Simulator, drive: &Drive, samples: Range<usize>, cancelled: &dyn Fn() -> bool) -> Response {
    let limits = Limits { states: &drive.limits, cancelled, ..Limits::default() };
    let guess: Vec<f64> = drive.signals.states.iter().map(|s| s[samples.start]).collect();
    let measured: Vec<&[f64]> = drive.measured.iter().map(|m| &**m).collect();
    let opening = samples.start..samples.end.min(samples.start + drive.opening);
    let initial = fit_initial_state(simulator, &drive.grid, &measured, &guess, opening, &limits);
    simulator.run(&drive.grid, &initial.state, samples, &limits)
}

/// Responses of the last run, kept for records whose model and drive have not changed.
#[derive(Debug, Default)]
pub(super) struct Responses {
    known: Vec<(Model, Arc<Drive>, Arc<Response>)>,
}

impl Responses {
    /// The model's response along the whole record.
    pub(super) fn get(
        &mut self,
        model: &Model,
        simulator: &Simulator,
        prepared: &Prepared,
        cancel: &Cancel,
    ) -> Result<Arc<Response>, StudyError> {
        if let Some((_, _, response)) = self.known.iter().find(|(m, d, _)| Arc::ptr_eq(d, &prepared.drive) && m == model) {
            return Ok(Arc::clone(response));
        }
        let samples = 0..prepared.record.len();
        let response = respond(simulator, &prepared.drive, samples, &|| cancel.is_cancelled());
        cancel.check()?;
        let response = Arc::new(response);
        self.known.retain(|(_, d, _)| !Arc::ptr_eq(d, &prepared.drive));
        self.known.push((model.clone(), Arc::clone(&prepared.drive), Arc::clone(&response)));
        Ok(response)
    }

    /// Forgets responses whose drives are in use nowhere else.
    pub(super) fn forget_unused(&mut self) {
        self.known.retain(|(_, drive, _)| Arc::strong_count(drive) > 1);
    }
}
