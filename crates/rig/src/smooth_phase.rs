use std::cell::RefCell;

use differential_equations::ode::ODE;

use super::excitation::Excitation;
use super::plant::{ContactState, Dynamics, Plant, SwitchingState};

/// A plant in one smooth phase, as the integrator wants it.
pub(super) struct SmoothPhase<'a> {
    pub dynamics: RefCell<Dynamics<'a>>,
    pub inputs: &'a [Excitation],
    pub mode: SwitchingState,
}

impl ODE<f64, Vec<f64>> for SmoothPhase<'_> {
    fn diff(&self, t: f64, state: &Vec<f64>, rates: &mut Vec<f64>) {
        self.evaluate(t, state);
        self.dynamics.borrow().rates(&self.mode.grips, rates);
    }
}

impl SmoothPhase<'_> {
    pub(super) fn evaluate(&self, t: f64, state: &[f64]) {
        let inputs = self.inputs.iter().map(|u| u.at(t));
        self.dynamics.borrow_mut().evaluate(t, state, inputs, &self.mode.signs);
    }

    /// How hard each contact holds, from what was last evaluated; `scratch` is as long as the state.
    pub(super) fn holding(&self, scratch: &mut [f64]) -> [f64; Plant::MOST_CONTACTS] {
        self.dynamics.borrow().rates(&self.mode.grips, scratch)
    }

    /// Computes values that are positive as long as the phase lasts: one a kink, then one a contact.
    pub(super) fn guard(&self, t: f64, state: &[f64], scratch: &mut [f64], guards: &mut [f64]) {
        self.evaluate(t, state);
        let holding = self.holding(scratch);
        let dynamics = self.dynamics.borrow();
        let (kinks, contacts) = guards.split_at_mut(self.mode.signs.len());
        for (k, (guard, sign)) in kinks.iter_mut().zip(&self.mode.signs).enumerate() {
            *guard = sign * dynamics.surface(k);
        }
        for (j, (guard, grip)) in contacts.iter_mut().zip(&self.mode.grips).enumerate() {
            *guard = match grip {
                ContactState::Slip(sign) => sign * dynamics.velocity(j),
                ContactState::Stick => dynamics.holding_strength(j) - holding[j].abs(),
            };
        }
    }
}
