//! Output-error refinement: the simulated response itself is fitted to the measured one.
//!
//! Nonlinear least squares by Levenberg and Marquardt over the parameters that the records share (coefficients of terms, and
//! what stands inside them), each record's sensor offset, and each run's initial state. Sensitivities are differences of
//! simulations: the simulator locates every switching instant, so the response is as smooth in a parameter as the motion
//! is, and a difference of a ten-thousandth of the motion keeps four digits of it. A run may be a segment of a record with
//! an initial state of its own: multiple shooting ([`climb`]), for a start that one long simulation would not lead home.
//!
//! Source: L. Ljung, *System Identification*, 2nd ed., Prentice Hall 1999, ch. 7 and 9; H. G. Bock, "Recent advances in
//! parameter identification techniques for O.D.E.", *Numerical Treatment of Inverse Problems*, Birkhäuser 1983 (multiple
//! shooting with condensed initial states).

mod arrow;
mod fitter;
mod horizon;
mod statistics;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use nalgebra::DMatrix;

pub use crate::simulate::Output;
use crate::simulate::{Delays, InputGrid};
use sindyscope_values::model::Model;

pub(crate) use arrow::scaled_inverse;
pub use fitter::{misfit, misfit_beside_jumps, refine, residuals_beside_jumps, respond};
pub use horizon::{Before, CHAOTIC_HALVINGS, Goal, Horizon, Landed, climb, cut, land, levels, look, sampled, shoot};
pub(crate) use horizon::{holds, horizon};
pub use statistics::{autoregression, inflation, lagged_products};

/// What one set of parameters makes.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// The equations.
    pub model: Model,
    /// How much later than they were measured the inputs act.
    pub delays: Delays,
    /// The sensor shows no displacement beyond ± this.
    pub ceiling: Option<f64>,
    /// What each output's sensor makes of what it measures; empty where every one shows it as it is.
    pub readings: Vec<SensorReading>,
}

/// What a sensor makes of what it measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorReading {
    /// How late it is, s.
    pub delay: f64,
    /// What it shows over what there is.
    pub gain: f64,
}

impl Default for SensorReading {
    fn default() -> Self {
        Self { delay: 0.0, gain: 1.0 }
    }
}

/// A model whose shared parameters are to be found.
pub trait Structure: Sync {
    /// The model at these parameters; none where they are out of bounds.
    fn instance(&self, parameters: &[f64]) -> Option<Instance>;

    /// A change of each parameter that matters, in its unit; only its order of magnitude counts.
    fn scales(&self) -> Vec<f64>;

    /// Least and largest value of each parameter; empty where none is bounded.
    fn bounds(&self) -> Vec<(f64, f64)> {
        Vec::new()
    }

    /// What is expected of the parameters before any data: each value is zero where it is met, and counts what a residual of
    /// that size does. Their number is the same at all parameters.
    fn expectations(&self, _parameters: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// True if each record's sensor has an offset of its own.
    fn offset(&self) -> bool;

    /// Number of internal states.
    fn internals(&self) -> usize;

    /// The internal states along a record's measured motion at these parameters: `[state][sample]`.
    ///
    /// Where records are cut into segments the internal states begin with these; free ones would explain anything.
    fn driven(&self, _parameters: &[f64], _run: &Run) -> Vec<Vec<f64>> {
        Vec::new()
    }
}

/// A record's motion as smoothed without a model: where a segment may begin, and what drives internal states.
#[derive(Clone, Debug, Default)]
pub struct MeasuredMotion {
    /// Displacements, then velocities: `[state][sample]`.
    pub states: Vec<Vec<f64>>,
    /// Inputs: `[input][sample]`.
    pub inputs: Vec<Vec<f64>>,
    /// Rates of the inputs: `[input][sample]`.
    pub input_rates: Vec<Vec<f64>>,
}

/// A record, or a segment of one.
#[derive(Clone, Debug)]
pub struct Run {
    /// Which record it belongs to; records are counted from zero, the runs of one record stand together.
    pub record: usize,
    /// The record's inputs.
    pub grid: Arc<InputGrid>,
    /// What was measured.
    pub outputs: Vec<Output>,
    /// The measured series, one an output.
    pub measured: Vec<Arc<[f64]>>,
    /// What the residual of each output counts.
    pub weights: Vec<f64>,
    /// The record's motion.
    pub motion: Arc<MeasuredMotion>,
    /// The samples of the segment.
    pub range: Range<usize>,
    /// Magnitude of each state beyond which a simulation is given up.
    pub limits: Vec<f64>,
}

impl Run {
    /// The state that the measured motion begins with.
    pub fn initial(&self) -> Vec<f64> {
        self.motion.states.iter().map(|s| s[self.range.start]).collect()
    }

    /// The segment of the same record over other samples.
    pub fn part(&self, range: Range<usize>) -> Self {
        Self { range, ..self.clone() }
    }

    /// Number of residuals: samples times outputs.
    pub fn rows(&self) -> usize {
        self.range.len() * self.measured.len()
    }

    /// Weighted measured values, output after output.
    pub fn target(&self) -> impl Iterator<Item = f64> + '_ {
        let weighted = self.measured.iter().zip(&self.weights);
        weighted.flat_map(|(m, w)| m[self.range.clone()].iter().map(move |y| w * y))
    }

    /// Number of displacements and velocities.
    fn states(&self) -> usize {
        self.motion.states.len()
    }

    /// True if the rates of states are measured, which jump where friction changes its side.
    fn shows_rates(&self) -> bool {
        self.outputs.iter().any(|o| o.is_rate())
    }
}

/// Values to start from, or that were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Shared parameters.
    pub shared: Vec<f64>,
    /// The sensors' offsets, in their unit, record after record; empty where they have none.
    pub offsets: Vec<f64>,
    /// Displacements, velocities and, unless they are driven, internal states at a run's first sample: `[run][state]`.
    pub own: Vec<Vec<f64>>,
}

impl Point {
    /// Shared parameters, and for each run the state that its measured motion begins with.
    pub fn new(structure: &dyn Structure, runs: &[Run], shared: Vec<f64>, driven: bool) -> Self {
        let records = runs.iter().map(|r| r.record + 1).max().unwrap_or(0);
        let internals = if driven { 0 } else { structure.internals() };
        let own = runs.iter().map(|run| {
            let mut own = run.initial();
            own.resize(own.len() + internals, 0.0);
            own
        });
        let offsets = if structure.offset() { records * runs.first().map_or(0, |r| r.outputs.len()) } else { 0 };
        Self { shared, offsets: vec![0.0; offsets], own: own.collect() }
    }
}

/// How a fit is to be done.
#[derive(Clone, Copy)]
pub struct FitOptions<'a> {
    /// Keep the shared parameters and fit what each record and run has of its own.
    pub frozen: bool,
    /// Internal states begin each run as the measured motion drives them; else their beginning is free.
    pub driven: bool,
    /// Most steps.
    pub steps: usize,
    /// Integration steps after which no further one is begun.
    pub effort: usize,
    /// Counts the integration steps of several fits and simulations.
    pub meter: Option<&'a Effort>,
    /// The least sum of squares that a rival has reached: a fit that is far above it and no longer falls fast ends early.
    pub bar: Option<&'a Bar>,
    /// Asked now and then; the fit ends early once it is true.
    pub cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// The integration steps that several fits and simulations have taken together; a change of side counts as some.
#[derive(Debug, Default)]
pub struct Effort(AtomicUsize);

impl Effort {
    /// The steps so far.
    pub fn spent(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }

    /// So many more were taken.
    fn add(&self, steps: usize) {
        self.0.fetch_add(steps, Ordering::Relaxed);
    }
}

/// The least sum of squares that any of several rival fits has reached.
///
/// Rivals that share one are fitted one after another, the likeliest first, and the cores share the work of each. Side by side,
/// which of them are given up, and with that what is found, would depend on how threads are scheduled.
#[derive(Debug)]
pub struct Bar(AtomicU64);

impl Default for Bar {
    fn default() -> Self {
        Self::of(f64::INFINITY)
    }
}

impl Bar {
    /// As if rivals had reached this.
    pub fn of(least: f64) -> Self {
        Self(AtomicU64::new(least.to_bits()))
    }

    /// The least so far; infinite before the first.
    pub fn least(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }

    /// A fit has reached this.
    pub fn reached(&self, rss: f64) {
        // Positive floats are ordered as their bits are.
        self.0.fetch_min(rss.max(0.0).to_bits(), Ordering::Relaxed);
    }
}

/// A fit.
#[derive(Clone, Debug, Default)]
pub struct Refined {
    /// The parameters.
    pub point: Point,
    /// Sum of squared weighted residuals over all runs, and of the expectations.
    pub rss: f64,
    /// The part of `rss` that samples of accelerations next to a jump of the simulated one leave beyond the usual residual. Tiny
    /// changes decide on which side of a jump such a sample lies, so this part must not compare models.
    pub rss_at_jumps: f64,
    /// Number of expectations of the shared parameters.
    pub expectations: usize,
    /// Number of residuals over all runs.
    pub samples: usize,
    /// Measured minus simulated, weighted: `[run][row]`, rows output after output.
    pub residuals: Vec<Vec<f64>>,
    /// Simulated as the sensors show it, with the same weights: `[run][row]`.
    pub simulated: Vec<Vec<f64>>,
    /// Derivatives of the simulated response: `[run][parameter][row]`, by the shared parameters (none if frozen), then by the
    /// offsets of the run's record if it has any, then by the run's own initial values.
    pub sensitivities: Vec<Vec<Vec<f64>>>,
    /// Covariance of the shared parameters, for white residuals; zero for one held at a bound, empty if frozen or singular.
    pub covariance: DMatrix<f64>,
    /// For each shared parameter, whether it is held at a bound.
    pub at_bound: Vec<bool>,
    /// True if no step would change the fit noticeably.
    pub converged: bool,
}

impl Refined {
    /// Sum of squared residuals without what jumps of accelerations leave.
    pub fn rss_beside_jumps(&self) -> f64 {
        (self.rss - self.rss_at_jumps).max(0.0)
    }

    /// Root of the mean squared residual, without what jumps of accelerations leave.
    pub fn rmse(&self) -> f64 {
        (self.rss_beside_jumps() / self.samples.max(1) as f64).sqrt()
    }

    /// Number of fitted values; each expectation takes one of them away.
    pub fn unknowns(&self) -> usize {
        self.point.shared.len().saturating_sub(self.expectations) + self.passing()
    }

    /// Number of fitted values that belong to single records and runs.
    pub fn passing(&self) -> usize {
        self.point.offsets.len() + self.point.own.iter().map(Vec::len).sum::<usize>()
    }

    /// Standard error of a shared parameter; none where it is held at a bound or not determined.
    pub fn std_error(&self, index: usize) -> Option<f64> {
        let free = index < self.covariance.nrows() && !self.at_bound.get(index).copied().unwrap_or(false);
        free.then(|| self.covariance[(index, index)].sqrt()).filter(|e| e.is_finite())
    }
}
