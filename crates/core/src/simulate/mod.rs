//! The response of a [`Model`] along sampled inputs, through the jumps of dry friction.
//!
//! A step of a Runge–Kutta method covers one sampling interval, or a part of one where the motion asks for it. Within a
//! step every `sgn` and `|·|` is held; where one of them changes, the instant is located and the step divided there. At
//! a jump the rates on both sides decide between passing and sticking; while sticking, the sign takes the value between
//! −1 and 1 that keeps the surface at zero (Filippov's equivalent control), until that value leaves the interval.
//!
//! Why not a library's events: DOP853 of the crate `differential-equations`, restarted at each of 112 reversals of the
//! friction sample (20 s at 1 kHz), takes 2.5 ms without sticking or writing samples and ends 2e-5 m off, because its
//! event states come from its dense output (33 ms and 2e-7 m with steps of one sample); this room takes 1.3 ms and is 2e-10 m off.
//!
//! Two files need each other: `integrate` steps, and asks `switching` where a step changes its side; `switching` divides the step.
//!
//! Source: M. di Bernardo, C. Budd, A. Champneys, P. Kowalczyk, *Piecewise-smooth Dynamical Systems*, Springer 2008.

mod beside;
mod delays;
mod equations;
mod grid;
mod initial;
mod integrate;
mod output;
mod switching;
#[cfg(test)]
mod tests;

use std::ops::Range;

pub use beside::{RunTask, SIDE_BY_SIDE, Workspaces, run_beside};
pub use delays::Delays;
pub use grid::InputGrid;
pub(crate) use grid::later;
pub use initial::{InitialState, fit_initial_state};
pub use output::Output;

use equations::Equations;
use grid::{IntervalPolynomials, Node};
use integrate::Machine;
use sindyscope_values::model::{ImplicitError, Model};
use sindyscope_values::term::{Expression, Layout, Slots};

/// Why a model cannot be simulated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SimulateError {
    /// A term uses a quantity that the model does not have.
    #[error("the term {term} uses {symbol}, which the model does not have")]
    Symbol {
        /// The term.
        term: String,
        /// The quantity.
        symbol: String,
    },
    /// Numbers of states and equations differ.
    #[error("the model has {states} states but {equations} equations")]
    Equations {
        /// Number of states.
        states: usize,
        /// Number of equations.
        equations: usize,
    },
    /// Accelerations on both sides that cannot be solved for.
    #[error(transparent)]
    Implicit(#[from] ImplicitError),
    /// More states than the integrator holds.
    #[error("the model has {0} states; at most {MAX_STATES} can be simulated")]
    TooManyStates(usize),
}

/// The largest state vector that can be simulated.
pub const MAX_STATES: usize = 32;

/// What bounds a run.
#[derive(Clone, Copy)]
pub struct Limits<'a> {
    /// Largest magnitude of each state; the run ends where one is exceeded. States without an entry are bounded only by
    /// being finite. Some ten times the measured range: a hundredth of it is also the least range that `tolerance` is a
    /// share of.
    pub states: &'a [f64],
    /// Largest error of one sampling interval, as a share of each state's range. An interval is covered by one step of order
    /// four where that keeps it (some 150 samples a period), else by one or more of order six.
    pub tolerance: f64,
    /// Asked now and then; the run ends early once it is true.
    pub cancelled: &'a dyn Fn() -> bool,
    /// The rates of the states are wanted too.
    pub rates: bool,
}

impl Default for Limits<'_> {
    fn default() -> Self {
        Self { states: &[], tolerance: 1e-9, cancelled: &|| false, rates: false }
    }
}

/// A stretch of time in which a surface was held at zero, as in sticking friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stick {
    /// Index in [`Simulator::surfaces`].
    pub surface: usize,
    /// Its beginning, s.
    pub from: f64,
    /// Its end, s.
    pub to: f64,
}

/// A model's response.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Response {
    /// The states, `[state][sample]` from the first sample of the run, as long as the response lasted.
    pub states: Vec<Vec<f64>>,
    /// The states' rates, `[state][sample]`, where they were asked for; at an instant at which they jump, those after it.
    pub rates: Vec<Vec<f64>>,
    /// At every sample, on which sides of its surfaces the motion was, where rates were asked for: two samples of unlike
    /// sides lie on two sides of a jump.
    pub sides: Vec<u64>,
    /// Time at which a state left its limits, s.
    pub diverged_at: Option<f64>,
    /// Sticking, in the order in which it began.
    pub sticks: Vec<Stick>,
    /// Number of times that a held sign changed.
    pub switches: usize,
    /// Steps taken; one a sample where the sampling is fine enough.
    pub steps: usize,
    /// True if even the finest division missed the tolerance somewhere.
    pub coarse: bool,
    /// True if the run was cancelled.
    pub cancelled: bool,
}

impl Response {
    /// Number of samples that the response lasted.
    pub fn len(&self) -> usize {
        self.states.first().map_or(0, Vec::len)
    }

    /// True if there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn clear(&mut self, states: usize, samples: usize, rates: bool) {
        self.states.resize_with(states, Vec::new);
        self.rates.resize_with(if rates { states } else { 0 }, Vec::new);
        for s in self.states.iter_mut().chain(&mut self.rates) {
            s.clear();
            s.reserve(samples);
        }
        self.sides.clear();
        self.sticks.clear();
        self.diverged_at = None;
        self.switches = 0;
        self.steps = 0;
        self.coarse = false;
        self.cancelled = false;
    }
}

/// A model compiled for simulation.
#[derive(Clone, Debug)]
pub struct Simulator {
    equations: Equations,
}

/// Memory that runs share, so that a repeated run allocates nothing.
#[derive(Clone, Debug, Default)]
pub struct Workspace {
    forcing: Slots,
    rest: Slots,
    curved: Slots,
    /// Forcing of each state, one row a lane.
    drive: Vec<f64>,
    sides: Vec<switching::Side>,
    sliding: Vec<usize>,
    /// Effect of each sliding sign on the rates, one row a sliding surface.
    columns: Vec<f64>,
    /// Nodes of each level of division, made when first used.
    nodes: Vec<Vec<Node>>,
    /// What comes from outside in the interval that was looked into last.
    interval: IntervalPolynomials,
}

impl Simulator {
    /// Compiles a model.
    ///
    /// # Errors
    /// A term with a quantity that the model lacks, a missing equation, or more than [`MAX_STATES`] states.
    pub fn new(model: &Model) -> Result<Self, SimulateError> {
        let states = model.layout.states();
        if states > MAX_STATES {
            return Err(SimulateError::TooManyStates(states));
        }
        Ok(Self { equations: Equations::new(model)? })
    }

    /// Numbers of states and inputs.
    pub fn layout(&self) -> &Layout {
        &self.equations.layout
    }

    /// The functions at whose zeros the equations switch.
    pub fn surfaces(&self) -> impl ExactSizeIterator<Item = &Expression> {
        self.equations.surfaces.iter().map(|s| &s.expression)
    }

    /// The response over `samples` of the grid, from the state at the first of them.
    ///
    /// `initial` is the state vector in the order of [`Layout::state_symbols`]; missing entries count as zero.
    pub fn run(&self, grid: &InputGrid, initial: &[f64], samples: Range<usize>, limits: &Limits<'_>) -> Response {
        let mut response = Response::default();
        self.run_into(grid, initial, samples, limits, &mut Workspace::default(), &mut response);
        response
    }

    /// As [`Self::run`], in memory of the caller's.
    ///
    /// A workspace serves any simulator and grid; with the same simulator again nothing is allocated.
    pub fn run_into(
        &self,
        grid: &InputGrid,
        initial: &[f64],
        samples: Range<usize>,
        limits: &Limits<'_>,
        workspace: &mut Workspace,
        response: &mut Response,
    ) {
        let samples = samples.start.min(grid.len())..samples.end.min(grid.len());
        response.clear(self.equations.states, samples.len(), limits.rates);
        if samples.is_empty() {
            return;
        }
        let equations = &self.equations;
        // The state vector's length is known to the compiler; vectors between are padded with states that stay zero.
        match equations.states {
            0 => {}
            1..=2 => Machine::<2>::new(equations, grid, workspace).run(initial, samples, limits, response),
            3..=4 => Machine::<4>::new(equations, grid, workspace).run(initial, samples, limits, response),
            5..=8 => Machine::<8>::new(equations, grid, workspace).run(initial, samples, limits, response),
            _ => Machine::<MAX_STATES>::new(equations, grid, workspace).run(initial, samples, limits, response),
        }
    }
}
