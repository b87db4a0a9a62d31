use std::cell::RefCell;

use differential_equations::ode::OrdinaryNumericalMethod;
use differential_equations::status::Status;

use super::RigError;
use super::excitation::Excitation;
use super::interpolant::{Accuracy, Interpolant, Stages, solver};
use super::plant::{ContactState, Dynamics, Plant, SwitchingState};
use super::smooth_phase::SmoothPhase;

/// Instants of a step at which switching is looked for.
const LOOKS_A_STEP: u32 = 16;
/// Steps after which a response is given up.
const MOST_STEPS: usize = 200_000;

/// The instants at which a response is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleTimes {
    /// The first instant, s; the motion begins at 0.
    pub start: f64,
    /// Sampling interval, s.
    pub interval: f64,
    /// Number of samples.
    pub count: usize,
}

impl SampleTimes {
    /// Time of sample `index`, s.
    pub fn time(&self, index: usize) -> f64 {
        self.start + self.interval * index as f64
    }
}

/// A time in which a contact stuck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StickInterval {
    /// The contact, in the plant's order.
    pub contact: usize,
    /// When it began, s.
    pub from: f64,
    /// When it ended, s; infinite if it lasted beyond the last sample.
    pub to: f64,
}

/// What a plant does.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantResponse {
    /// One series a state.
    pub states: Vec<Vec<f64>>,
    /// The states' time derivatives, likewise: of a mass's velocity its acceleration.
    pub rates: Vec<Vec<f64>>,
    /// Each time in which a contact stuck, in the order in which they began.
    pub stops: Vec<StickInterval>,
}

/// Integrates a plant from its state at t = 0 along its inputs, each smooth phase by itself with the eighth-order method
/// of Dormand and Prince. Switching is located to the last bit of time; while a contact sticks, its
/// velocity is exactly zero until the force on it exceeds its strength.
///
/// # Errors
/// A plant, inputs and state that do not belong together; a motion that grows without bound or takes too many steps.
pub fn respond(
    plant: &Plant,
    inputs: &[Excitation],
    initial: &[f64],
    sampling: &SampleTimes,
) -> Result<PlantResponse, RigError> {
    let instants: Vec<f64> = (0..sampling.count).map(|k| sampling.time(k)).collect();
    respond_at(Accuracy::FINE, plant, inputs, initial, &instants)
}

/// The same with the accuracy given, sampled at any instants, in order and none before 0.
pub(super) fn respond_at(
    accuracy: Accuracy,
    plant: &Plant,
    inputs: &[Excitation],
    initial: &[f64],
    instants: &[f64],
) -> Result<PlantResponse, RigError> {
    let layout = plant.smooth.layout;
    if plant.contacts.len() > Plant::MOST_CONTACTS {
        return Err(RigError::Contacts { given: plant.contacts.len() });
    }
    if inputs.len() != layout.inputs || initial.len() != layout.states() {
        return Err(RigError::Mismatch {
            states: layout.states(),
            inputs: layout.inputs,
            given_states: initial.len(),
            given_inputs: inputs.len(),
        });
    }
    let end = instants.last().copied().unwrap_or_default();
    let mut breaks: Vec<f64> = inputs.iter().flat_map(Excitation::breaks).filter(|t| *t > 0.0 && *t < end).collect();
    breaks.push(end);
    breaks.sort_by(f64::total_cmp);
    let mut walk = Integration::new(accuracy, plant, inputs, initial, instants);
    walk.begin();
    for stop in breaks {
        walk.advance(stop)?;
    }
    Ok(walk.response)
}

/// No step is longer than the whole and one interval more.
fn longest(instants: &[f64]) -> f64 {
    match instants {
        [.., before, last] => 2.0 * last - before,
        [.., last] => last.max(1.0),
        [] => 1.0,
    }
}

/// A motion in the making.
struct Integration<'a> {
    phase: SmoothPhase<'a>,
    t: f64,
    state: Vec<f64>,
    instants: &'a [f64],
    emitted: usize,
    response: PlantResponse,
    accuracy: Accuracy,
    longest_step: f64,
    steps_left: usize,
    guards: Vec<f64>,
    /// Which guards have been positive since the phase began; one that begins at zero proves nothing by falling.
    armed: Vec<bool>,
    scratch: Vec<f64>,
    /// Where in a step rates are asked for.
    stages: Stages,
    /// The motion within the last step, and a state of it.
    span: Interpolant,
    looked: Vec<f64>,
    /// When a kink that stood at zero was last given its other sign.
    turned: f64,
}

impl<'a> Integration<'a> {
    fn new(
        accuracy: Accuracy,
        plant: &'a Plant,
        inputs: &'a [Excitation],
        initial: &[f64],
        instants: &'a [f64],
    ) -> Self {
        let dynamics = Dynamics::new(plant);
        let highest = inputs.iter().map(Excitation::highest_frequency).fold(0.0, f64::max);
        let guards = dynamics.surfaces() + dynamics.contacts();
        let mode = SwitchingState {
            signs: vec![1.0; dynamics.surfaces()],
            grips: vec![ContactState::Slip(1.0); dynamics.contacts()],
        };
        let states = vec![Vec::with_capacity(instants.len()); dynamics.states()];
        let rates = states.clone();
        Self {
            phase: SmoothPhase { dynamics: RefCell::new(dynamics), inputs, mode, foreseen: RefCell::default() },
            t: 0.0,
            state: initial.to_vec(),
            instants,
            emitted: 0,
            response: PlantResponse { states, rates, stops: Vec::new() },
            accuracy,
            longest_step: (1.0 / (accuracy.steps_a_period * highest)).min(longest(instants)),
            steps_left: MOST_STEPS,
            guards: vec![0.0; guards],
            armed: vec![false; guards],
            scratch: vec![0.0; initial.len()],
            stages: Stages::default(),
            span: Interpolant::new(initial.len(), accuracy),
            looked: vec![0.0; initial.len()],
            turned: f64::NEG_INFINITY,
        }
    }

    /// Finds the mode that the motion begins in, and takes the sample at t = 0 if there is one.
    fn begin(&mut self) {
        // A surface inside another kink is right only once that kink's sign is.
        for _ in 0..=self.phase.mode.signs.len() {
            self.phase.evaluate(self.t, &self.state);
            let dynamics = self.phase.dynamics.borrow();
            for (k, sign) in self.phase.mode.signs.iter_mut().enumerate() {
                *sign = if dynamics.surface(k) < 0.0 { -1.0 } else { 1.0 };
            }
        }
        self.phase.evaluate(self.t, &self.state);
        let velocities: Vec<f64> =
            (0..self.phase.mode.grips.len()).map(|j| self.phase.dynamics.borrow().velocity(j)).collect();
        for (grip, velocity) in self.phase.mode.grips.iter_mut().zip(&velocities) {
            *grip = ContactState::Slip(velocity.signum());
        }
        let resting: Vec<bool> = velocities.iter().map(|v| *v == 0.0).collect();
        self.settle(&resting);
        if self.instants.first().is_some_and(|t| *t <= 0.0) {
            self.looked.copy_from_slice(&self.state);
            self.emit(self.t);
        }
    }

    /// Takes a sample of the state that was looked at.
    fn emit(&mut self, t: f64) {
        self.phase.evaluate(t, &self.looked);
        self.phase.dynamics.borrow().rates(&self.phase.mode.grips, &mut self.scratch);
        let PlantResponse { states, rates, .. } = &mut self.response;
        for (series, value) in states.iter_mut().zip(&self.looked).chain(rates.iter_mut().zip(&self.scratch)) {
            series.push(*value);
        }
        self.emitted += 1;
    }

    /// Takes the samples of the span up to `limit`.
    fn emit_until(&mut self, limit: f64) {
        while let Some(t) = self.instants.get(self.emitted).filter(|t| **t <= limit) {
            self.span.state(*t, &mut self.looked);
            self.emit(*t);
        }
    }

    /// Brings the given contacts to rest and decides which of them stick and which way the others slip.
    fn settle(&mut self, resting: &[bool]) {
        let contacts: Vec<usize> = (0..resting.len()).filter(|j| resting[*j]).collect();
        // Contacts may share states: what brings the second to rest may stir the first.
        for j in contacts.iter().chain(&contacts) {
            self.phase.evaluate(self.t, &self.state);
            self.phase.dynamics.borrow().bring_to_rest(*j, &mut self.state);
        }
        self.phase.evaluate(self.t, &self.state);
        let before = self.phase.mode.grips.clone();
        for j in &contacts {
            self.phase.mode.grips[*j] = ContactState::Stick;
        }
        for _ in &contacts {
            let holding = self.phase.holding(&mut self.scratch);
            let dynamics = self.phase.dynamics.borrow();
            let excess = |j: usize| holding[j].abs() - dynamics.holding_strength(j);
            let loosest = contacts
                .iter()
                .filter(|j| self.phase.mode.grips[**j] == ContactState::Stick && excess(**j) >= 0.0)
                .max_by(|a, b| excess(**a).total_cmp(&excess(**b)));
            let Some(j) = loosest else { break };
            self.phase.mode.grips[*j] = ContactState::Slip(if holding[*j] < 0.0 { -1.0 } else { 1.0 });
        }
        for (contact, (before, now)) in before.into_iter().zip(&self.phase.mode.grips).enumerate() {
            match (before, now) {
                (ContactState::Slip(_), ContactState::Stick) => {
                    self.response.stops.push(StickInterval { contact, from: self.t, to: f64::INFINITY });
                }
                (ContactState::Stick, ContactState::Slip(_)) => {
                    if let Some(stop) = self.response.stops.iter_mut().rfind(|s| s.contact == contact) {
                        stop.to = self.t;
                    }
                }
                _ => {}
            }
        }
    }

    /// Integrates to `stop`, through whatever switching there is.
    fn advance(&mut self, stop: f64) -> Result<(), RigError> {
        // The inputs' higher derivatives may have jumped, and with them what a contact must hold.
        let resting: Vec<bool> = self.phase.mode.grips.iter().map(|g| *g == ContactState::Stick).collect();
        self.settle(&resting);
        while self.t < stop {
            self.follow(stop)?;
        }
        Ok(())
    }

    /// Integrates one smooth phase: to `stop` or to its own end.
    fn follow(&mut self, stop: f64) -> Result<(), RigError> {
        let mut solver = solver(self.accuracy, self.longest_step);
        self.phase.guard(self.t, &self.state, &mut self.scratch, &mut self.guards);
        for (armed, guard) in self.armed.iter_mut().zip(&self.guards) {
            *armed = *guard > 0.0;
        }
        let began = self.t;
        solver.init(&self.phase, began, f64::INFINITY, &self.state).map_err(|_| RigError::Unbounded { time: began })?;
        let rounding = 4.0 * f64::EPSILON * stop;
        while solver.t() < stop - rounding {
            self.steps_left = self.steps_left.checked_sub(1).ok_or(RigError::TooLong { time: solver.t() })?;
            solver.set_h(solver.h().min(stop - solver.t()));
            let time = solver.t();
            self.stages.foresee(&solver, &self.phase);
            solver.step(&self.phase).map_err(|_| RigError::Unbounded { time })?;
            if matches!(solver.status(), Status::RejectedStep) {
                continue;
            }
            if solver.y().iter().any(|y| !y.is_finite()) {
                return Err(RigError::Unbounded { time });
            }
            self.span.cover(&solver, &self.phase).map_err(|_| RigError::Unbounded { time })?;
            if self.switch() {
                return Ok(());
            }
            self.emit_until(if solver.t() < stop - rounding { solver.t() } else { stop });
        }
        self.t = stop;
        self.state.copy_from_slice(solver.y());
        Ok(())
    }

    /// Computes the guards at an instant of the span.
    fn look(&mut self, t: f64) {
        self.span.state(t, &mut self.looked);
        self.phase.guard(t, &self.looked, &mut self.scratch, &mut self.guards);
    }

    /// Looks for switching in the span; where there is some, goes there and enters the next phase.
    fn switch(&mut self) -> bool {
        if self.guards.is_empty() {
            return false;
        }
        let (from, to) = (self.span.from(), self.span.to());
        let mut before = from;
        let instant = |look: u32| from + (to - from) * f64::from(look) / f64::from(LOOKS_A_STEP);
        self.phase.foresee((1..=LOOKS_A_STEP).map(instant));
        for at in (1..=LOOKS_A_STEP).map(instant) {
            self.look(at);
            if self.guards.iter().any(|g| *g < 0.0) {
                self.enter_next(before, at);
                return true;
            }
            for (armed, guard) in self.armed.iter_mut().zip(&self.guards) {
                *armed |= *guard > 0.0;
            }
            before = at;
        }
        false
    }

    /// Ends the phase between two instants, at the later of which some guard is negative.
    fn enter_next(&mut self, before: f64, after: f64) {
        let kinks = self.phase.mode.signs.len();
        let broken: Vec<usize> = (0..self.guards.len()).filter(|k| self.guards[*k] < 0.0).collect();
        let unsigned = broken.iter().copied().find(|k| *k < kinks && !self.armed[*k]);
        if let Some(k) = unsigned
            && self.turned < self.span.from()
        {
            // The kink stood at zero and its held sign was a guess: take the step again with the other.
            self.phase.mode.signs[k] = -self.phase.mode.signs[k];
            self.t = self.span.from();
            self.turned = self.t;
            self.span.state(self.t, &mut self.state);
            return;
        }
        let mut end = after;
        for k in &broken {
            if self.armed[*k] {
                end = self.locate(*k, before, end);
            }
        }
        self.emit_until(end);
        self.look(end);
        self.t = end;
        self.state.copy_from_slice(&self.looked);
        let mut resting: Vec<bool> = self.phase.mode.grips.iter().map(|g| *g == ContactState::Stick).collect();
        for k in broken.into_iter().filter(|k| self.guards[*k] <= 0.0) {
            if k < kinks {
                self.phase.mode.signs[k] = -self.phase.mode.signs[k];
            } else {
                resting[k - kinks] = true;
            }
        }
        self.settle(&resting);
    }

    /// The first instant, to the last bit, at which guard `k` is no longer positive, or `after` if it still is.
    fn locate(&mut self, k: usize, mut before: f64, mut after: f64) -> f64 {
        let mut broken = |t: f64| {
            self.look(t);
            self.guards[k] <= 0.0
        };
        if !broken(after) {
            return after;
        }
        loop {
            let middle = before + 0.5 * (after - before);
            if middle <= before || middle >= after {
                return after;
            }
            if broken(middle) {
                after = middle;
            } else {
                before = middle;
            }
        }
    }
}

#[cfg(test)]
#[path = "response_tests.rs"]
mod tests;
