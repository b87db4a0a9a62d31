use std::cell::RefCell;

use differential_equations::ode::ODE;

use super::excitation::Excitation;
use super::plant::{ContactState, Dynamics, Plant, SwitchingState};
use super::wave::Derivatives;

/// A plant in one smooth phase, as the integrator wants it.
pub(super) struct SmoothPhase<'a> {
    pub dynamics: RefCell<Dynamics<'a>>,
    pub inputs: &'a [Excitation],
    pub mode: SwitchingState,
    pub foreseen: RefCell<ForeseenInputs>,
}

/// The inputs at instants that are about to be asked for.
#[derive(Default)]
pub(super) struct ForeseenInputs {
    times: Vec<f64>,
    /// `values[input * times.len() + instant]`.
    values: Vec<Derivatives>,
}

impl ODE<f64, Vec<f64>> for SmoothPhase<'_> {
    fn diff(&self, t: f64, state: &Vec<f64>, rates: &mut Vec<f64>) {
        self.evaluate(t, state);
        self.dynamics.borrow().rates(&self.mode.grips, rates);
    }
}

impl SmoothPhase<'_> {
    pub(super) fn evaluate(&self, t: f64, state: &[f64]) {
        let foreseen = self.foreseen.borrow();
        let mut dynamics = self.dynamics.borrow_mut();
        if let Some(k) = foreseen.times.iter().position(|known| *known == t) {
            let inputs = foreseen.values.iter().skip(k).step_by(foreseen.times.len()).copied();
            dynamics.evaluate(t, state, inputs, &self.mode.signs);
        } else {
            dynamics.evaluate(t, state, self.inputs.iter().map(|u| u.at(t)), &self.mode.signs);
        }
    }

    /// Finds the inputs at instants that will be asked for, all together; those foreseen before are forgotten. Any other instant may be
    /// asked for all the same: this saves time and changes no value.
    pub(super) fn foresee(&self, times: impl IntoIterator<Item = f64>) {
        if !self.inputs.iter().any(Excitation::is_cheaper_together) {
            return;
        }
        let mut foreseen = self.foreseen.borrow_mut();
        let ForeseenInputs { times: known, values } = &mut *foreseen;
        known.clear();
        known.extend(times);
        values.clear();
        for input in self.inputs {
            input.append_at(known, values);
        }
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
