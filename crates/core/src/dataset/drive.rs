//! What drives a simulation of a record, and what its sensors showed.

use std::ops::Range;
use std::sync::Arc;

use super::base_excited;
use crate::refine::{MeasuredMotion, Run};
use crate::signal::{SavitzkyGolay, SignalFacts, Signals, dot, mean_and_variance, rms};
use crate::simulate::{InputGrid, Limits, Output, Response, Simulator, Workspace, fit_initial_state};
use sindyscope_values::record::{Record, Role};
use sindyscope_values::term::Layout;

/// What drives the simulation of a record, or of a stretch of it: its inputs, the measured motion that the initial state
/// is fitted to, its limits.
#[derive(Debug)]
pub struct SimulationDrive {
    /// The inputs between their samples.
    pub grid: Arc<InputGrid>,
    /// State vectors at the first sample that the initial state is sought from.
    guesses: [Vec<f64>; 2],
    /// What the sensors show.
    pub outputs: Vec<Output>,
    /// What each of them shows of no motion: an accelerometer's zero is never right.
    pub zeros: Vec<f64>,
    /// What each of them showed beyond its zero.
    pub measured: Vec<Arc<[f64]>>,
    /// Magnitude of each state beyond which a simulation is given up.
    pub limits: Vec<f64>,
    /// Samples that the initial state is fitted to.
    opening: usize,
    /// Whether the inputs drive as measured; else as smoothed.
    pub as_measured: bool,
}

/// A response has left the data's range where a state exceeds this many times its largest measured magnitude.
pub const RANGE_FACTOR: f64 = 10.0;
/// Length of the opening that an initial state is fitted to, in main periods.
const OPENING_PERIODS: f64 = 4.0;
/// Factor from one opening to the next over which an initial state is sought.
const OPENING_GROWTH: usize = 3;
/// Error on an opening, as a share of what is measured, up to which its initial state counts as found.
const FOLLOWED_ERROR: f64 = 0.5;
/// Length of the polynomial fit that guesses an initial state, in main periods.
const GUESS_PERIODS: f64 = 0.25;
/// Order of that polynomial.
const GUESS_ORDER: usize = 3;

/// Whether the inputs' noise is next to nothing, from one sample to the next.
pub(super) fn is_quiet(layout: &Layout, facts: &SignalFacts, signals: &Signals) -> bool {
    (0..layout.inputs)
        .all(|j| facts.input_noise[j] <= 1e-3 * rms(signals.input_rate(j).unwrap_or(&[])) * signals.interval)
}

/// The inputs that drive a simulation of `samples` of a record, and whether they are those measured.
///
/// A base's motion with much noise drives as smoothed: a contact that holds would be shaken by the derivative of raw noise. A
/// force is integrated twice, which smooths it better than any filter: its fast part moves a free mass too.
fn driving(
    record: &Record,
    layout: &Layout,
    facts: &SignalFacts,
    signals: &Signals,
    samples: Range<usize>,
) -> (InputGrid, bool) {
    let raw = (0..layout.inputs).filter_map(|j| record.channel(Role::Input(j)));
    let raw: Vec<&[f64]> = raw.map(|c| &c.values[samples.clone()]).collect();
    let as_measured = is_quiet(layout, facts, signals) || !base_excited(record, layout.kind);
    let (start, interval) = (record.time(samples.start), record.interval);
    let grid = if as_measured {
        InputGrid::new(start, interval, samples.len(), &raw, None)
    } else {
        let inputs: Vec<&[f64]> = signals.inputs.iter().map(|s| &s[samples.clone()]).collect();
        let rates: Vec<&[f64]> = signals.input_rates().map(|s| &s[samples.clone()]).collect();
        InputGrid::new(start, interval, samples.len(), &inputs, Some(&rates))
    };
    (grid, as_measured)
}

impl SimulationDrive {
    /// The drive of `samples` of a record.
    pub fn new(
        record: &Record,
        layout: &Layout,
        facts: &SignalFacts,
        signals: &Signals,
        samples: Range<usize>,
    ) -> Self {
        let channel = |role: Role| record.channel(role).map(|c| &c.values[samples.clone()]);
        let (grid, as_measured) = driving(record, layout, facts, signals, samples.clone());
        let displacements: Vec<Arc<[f64]>> =
            (0..layout.freedoms).filter_map(|i| channel(Role::Displacement(i))).map(Arc::from).collect();
        let sensors = || record.sensors().take(layout.freedoms);
        let outputs: Vec<Output> = sensors().map(|c| output(c.role)).collect();
        let zeros: Vec<f64> = sensors()
            .map(|c| match c.role {
                Role::Acceleration(i) => zero(&c.values, signals.states.get(layout.freedoms + i), record.interval),
                _ => 0.0,
            })
            .collect();
        let measured =
            sensors().zip(&zeros).map(|(c, zero)| c.values[samples.clone()].iter().map(|v| v - zero).collect());
        let measured = measured.collect();
        let smoothed: Vec<f64> = signals.states.iter().map(|s| s[samples.start]).collect();
        let period = signals.main_period.map_or(0.1 * samples.len() as f64, |p| p / record.interval);
        Self {
            grid: Arc::new(grid),
            guesses: [polynomial_guess(&displacements, smoothed.len(), period, record.interval), smoothed],
            outputs,
            zeros,
            measured,
            limits: signals
                .states
                .iter()
                .map(|s| RANGE_FACTOR * s.iter().fold(0.0_f64, |m, v| m.max(v.abs())))
                .collect(),
            as_measured,
            opening: ((OPENING_PERIODS * period) as usize).max(20).min(samples.len()),
        }
    }

    /// The record for refinement; none if some displacement (or state) is not measured.
    ///
    /// `signals` give the states that segments begin with; `record` counts the records that are refined together.
    pub fn run(&self, record: usize, signals: &Signals) -> Option<Run> {
        let complete = [1, 2].iter().any(|orders| orders * self.measured.len() == signals.states.len());
        if self.measured.is_empty() || !complete {
            return None;
        }
        Some(Run {
            record,
            grid: Arc::clone(&self.grid),
            outputs: self.outputs.clone(),
            measured: self.measured.clone(),
            weights: vec![1.0; self.measured.len()],
            motion: Arc::new(MeasuredMotion {
                states: signals.states.clone(),
                inputs: signals.inputs.clone(),
                input_rates: signals.input_rates().map(<[f64]>::to_vec).collect(),
            }),
            range: 0..self.grid.len(),
            limits: self.limits.clone(),
        })
    }

    /// The model's response from the initial state that fits the opening best, or, if given, the first `initial` samples
    /// alone; `tolerance` as in [`Limits`].
    pub fn respond(
        &self,
        simulator: &Simulator,
        tolerance: f64,
        initial: Option<usize>,
        workspace: &mut Workspace,
        cancelled: &dyn Fn() -> bool,
    ) -> Response {
        let rates = self.outputs.iter().any(|o| o.is_rate());
        let limits = Limits { states: &self.limits, tolerance, cancelled, rates };
        let measured: Vec<(Output, &[f64])> =
            self.outputs.iter().copied().zip(self.measured.iter().map(|m| &**m)).collect();
        let guesses = self.guesses.each_ref().map(Vec::as_slice);
        let mut fit = |guesses: &[&[f64]], opening: usize| {
            fit_initial_state(simulator, &self.grid, &measured, guesses, opening, &limits, workspace)
        };
        let longest = initial.unwrap_or(self.grid.len());
        let mut opening = initial.unwrap_or(self.opening);
        let mut fitted = fit(&guesses, opening);
        // A motion that no sensor showed is guessed at roughly: what lasts a short while is sought over longer ones.
        while self.outputs.iter().any(|o| o.derivatives() > 0) && opening < longest && fitted.after < FOLLOWED_ERROR {
            opening = (OPENING_GROWTH * opening).min(longest);
            fitted = fit(&[&fitted.state], opening);
        }
        let mut response = Response::default();
        simulator.run_into(&self.grid, &fitted.state, 0..self.grid.len(), &limits, workspace, &mut response);
        response
    }
}

/// What a channel shows of the motion.
pub fn output(role: Role) -> Output {
    match role {
        Role::Displacement(i) | Role::Input(i) => Output::Displacement(i),
        Role::Velocity(i) => Output::Velocity(i),
        Role::Acceleration(i) => Output::Acceleration(i),
    }
}

/// An accelerometer's zero: over a record the acceleration's mean is what the velocity has changed by.
fn zero(values: &[f64], velocity: Option<&Vec<f64>>, interval: f64) -> f64 {
    let last = values.len().saturating_sub(1).max(1);
    let changed = velocity.and_then(|v| Some(v.last()? - v.first()?)).unwrap_or(0.0) / (last as f64 * interval);
    mean_and_variance(values).0 - changed
}

/// The state at the first sample by a polynomial over the beginning of the motion: smoothing that suits the regression
/// may follow the noise at the record's end.
fn polynomial_guess(measured: &[Arc<[f64]>], states: usize, period: f64, interval: f64) -> Vec<f64> {
    let window = ((GUESS_PERIODS * period) as usize).max(2 * GUESS_ORDER) | 1;
    let filter = SavitzkyGolay::new(window, GUESS_ORDER);
    let at_first = |derivative: usize| {
        let weights = filter.weights(-((window / 2) as f64), derivative);
        let scale = interval.powi(-(derivative as i32));
        move |m: &Arc<[f64]>| if m.len() < window { f64::NAN } else { scale * dot(&weights, &m[..window]) }
    };
    let guess: Vec<f64> = measured.iter().map(at_first(0)).chain(measured.iter().map(at_first(1))).collect();
    guess.into_iter().take(states).collect()
}
