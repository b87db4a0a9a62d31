use differential_equations::error::Error;
use differential_equations::methods::{DormandPrince, ExplicitRungeKutta, Ordinary};
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use differential_equations::tableau::ButcherTableau;

use super::smooth_phase::SmoothPhase;

/// The eighth-order method of Dormand and Prince.
pub(super) type Solver = ExplicitRungeKutta<Ordinary, DormandPrince, f64, Vec<f64>, 8, 12, 16>;

/// How exactly a motion is integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Accuracy {
    /// Relative tolerance of a step.
    relative: f64,
    /// Absolute tolerance of a step, in the unit of each state.
    absolute: f64,
    /// Steps in a period of the highest excitation frequency, at least.
    pub steps_a_period: f64,
}

impl Accuracy {
    /// For records.
    pub(super) const FINE: Self = Self { relative: 1e-11, absolute: 1e-13, steps_a_period: 8.0 };
    /// For the size of a motion.
    pub(super) const DRAFT: Self = Self { relative: 1e-6, absolute: 1e-7, steps_a_period: 3.0 };
}

/// Where in a step the interpolating polynomial takes value and slope.
const NODES: [f64; 4] = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
/// Attempts after which a part of a step is given up.
const MOST_PARTS: usize = 200;

pub(super) fn solver(accuracy: Accuracy, longest_step: f64) -> Solver {
    ExplicitRungeKutta::dop853()
        .rtol(accuracy.relative)
        .atol(accuracy.absolute)
        .h_max(longest_step)
        .max_steps(usize::MAX)
}

/// Where in a step the method asks for rates, as shares of the step.
pub(super) struct Stages([f64; 16]);

impl Default for Stages {
    fn default() -> Self {
        Self(ButcherTableau::<f64, 12, 16>::dop853().c)
    }
}

impl Stages {
    /// Foresees what the next step of a solver asks for: its stages, beginning and end.
    pub(super) fn foresee(&self, solver: &Solver, phase: &SmoothPhase<'_>) {
        let (t, h) = (solver.t(), solver.h());
        phase.foresee(self.0.iter().map(|share| t + share * h));
    }
}

/// The motion within one step: the polynomial of degree seven that has the state and its rate at four instants.
///
/// The integrator's own dense output of this method (differential-equations 0.7.0) exchanges s and 1 − s in its higher
/// terms, which leaves it four digits worse than the steps; hence the two inner states are integrated for.
pub(super) struct Interpolant {
    from: f64,
    to: f64,
    /// Newton's divided differences of each state over the doubled [`NODES`].
    differences: Vec<[f64; 8]>,
    end: Vec<f64>,
    inner: Solver,
    stages: Stages,
    rates: Vec<f64>,
}

impl Interpolant {
    pub(super) fn new(states: usize, accuracy: Accuracy) -> Self {
        Self {
            from: 0.0,
            to: 0.0,
            differences: vec![[0.0; 8]; states],
            end: vec![0.0; states],
            inner: solver(accuracy, f64::INFINITY),
            stages: Stages::default(),
            rates: vec![0.0; states],
        }
    }

    pub(super) fn from(&self) -> f64 {
        self.from
    }

    pub(super) fn to(&self) -> f64 {
        self.to
    }

    /// Covers the last step of `outer`.
    pub(super) fn cover(&mut self, outer: &Solver, phase: &SmoothPhase<'_>) -> Result<(), Error<f64, Vec<f64>>> {
        (self.from, self.to) = (outer.t_prev(), outer.t());
        let length = self.to - self.from;
        self.note(0, self.from, outer.y_prev(), phase);
        self.note(3, self.to, outer.y(), phase);
        self.inner.h0 = NODES[1] * length;
        self.inner.init(phase, self.from, f64::INFINITY, outer.y_prev())?;
        for (node, share) in NODES.iter().enumerate().take(3).skip(1) {
            let target = self.from + share * length;
            self.reach(target, phase)?;
            let state = self.inner.y().clone();
            self.note(node, target, &state, phase);
        }
        self.end.copy_from_slice(outer.y());
        for row in &mut self.differences {
            divide(row);
        }
        Ok(())
    }

    /// Integrates to an instant within the step: a part of an accepted step, so one step should do.
    fn reach(&mut self, target: f64, phase: &SmoothPhase<'_>) -> Result<(), Error<f64, Vec<f64>>> {
        let rounding = 4.0 * f64::EPSILON * self.to;
        for _ in 0..MOST_PARTS {
            if self.inner.t() >= target - rounding {
                return Ok(());
            }
            self.inner.set_h(self.inner.h().min(target - self.inner.t()));
            self.stages.foresee(&self.inner, phase);
            self.inner.step(phase)?;
        }
        Err(Error::StepSize { t: self.inner.t(), y: self.inner.y().clone() })
    }

    /// Puts value and slope (over the whole step) at a node in their places.
    fn note(&mut self, node: usize, t: f64, state: &Vec<f64>, phase: &SmoothPhase<'_>) {
        phase.diff(t, state, &mut self.rates);
        for ((row, y), rate) in self.differences.iter_mut().zip(state).zip(&self.rates) {
            row[2 * node] = *y;
            row[2 * node + 1] = rate * (self.to - self.from);
        }
    }

    /// The state at an instant of the step.
    pub(super) fn state(&self, t: f64, state: &mut [f64]) {
        if t >= self.to {
            state.copy_from_slice(&self.end);
            return;
        }
        let s = (t - self.from) / (self.to - self.from);
        for (y, row) in state.iter_mut().zip(&self.differences) {
            *y = (0..7).rev().fold(row[7], |sum, k| sum * (s - NODES[k / 2]) + row[k]);
        }
    }
}

/// Divided differences over the doubled nodes, in place, of alternating values and slopes.
fn divide(row: &mut [f64; 8]) {
    let given = *row;
    let at = |k: usize| NODES[k / 2];
    let mut column: [f64; 8] = std::array::from_fn(|k| given[k / 2 * 2]);
    for order in 1..8 {
        for k in (order..8).rev() {
            column[k] =
                if at(k) == at(k - order) { given[k] } else { (column[k] - column[k - 1]) / (at(k) - at(k - order)) };
        }
    }
    *row = column;
}
