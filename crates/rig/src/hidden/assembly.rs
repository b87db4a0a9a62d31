//! A linear plant with effects in it: put together, set in motion, and its missing forces measured.

use super::catalogue::Effect;
use super::contribution::{Contribution, InnerStart, SensorFault};
use super::excitation_kind::PlannedRecord;
use super::host_plant::{Draws, DriveKind, HostPlant, Magnitude, MotionSize};
use super::quantities::v;
use crate::Excitation;
use crate::RigError;
use crate::interpolant::Accuracy;
use crate::motion::PlantMotion;
use crate::plant::{Contact, Plant};
use crate::setup::MeasuredQuantity;
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::{Expression, Term};

/// A linear plant with effects in it.
#[derive(Clone, Debug)]
pub(super) struct Assembly {
    pub parts: Vec<Contribution>,
    pub plant: Plant,
    host_plant: HostPlant,
}

impl Assembly {
    /// Effects with their strengths, in a plant.
    pub(super) fn new(effects: &[(&Effect, Draws)], strengths: &[f64], host_plant: &HostPlant) -> Self {
        let mut first_state = host_plant.own_states();
        let mut parts = Vec::with_capacity(effects.len());
        // Friction in the joint rubs on the base that moves late, as the spring pulls at it.
        let arriving = usize::from(effects.iter().any(|(effect, _)| effect.name == "input_delay"));
        for ((effect, draws), strength) in effects.iter().zip(strengths) {
            let part = (effect.build)(*strength, draws, &HostPlant { first_state, arriving, ..host_plant.clone() });
            first_state += part.inner.len();
            parts.push(part);
        }
        let inputs = match host_plant.drive {
            DriveKind::None => 0,
            _ if host_plant.control.is_some() => 2,
            _ if parts.iter().any(|p| p.delay > 0.0) => 2,
            _ => 1,
        };
        let forces = std::iter::once(host_plant.base()).chain(parts.iter().map(|p| p.force.clone()));
        let known = |terms: Vec<Expression>| Equation::known(terms.into_iter().map(|e| (Term::new(e), 1.0)));
        let mut equations = vec![known(vec![v()]), known(forces.collect())];
        equations.extend(host_plant.control.map(|control| known(vec![control.filtered_rate()])));
        equations.extend(parts.iter().flat_map(|p| &p.inner).map(|inner| known(vec![inner.rate.clone()])));
        let contacts = parts.iter().filter_map(|p| p.contact.clone()).collect();
        let plant = Plant { smooth: Model::first_order(inputs, equations), contacts };
        Self { parts, plant, host_plant: host_plant.clone() }
    }

    /// Factor on all levels.
    pub(super) fn level(&self) -> f64 {
        self.parts.iter().map(|p| p.level).product()
    }

    /// What the displacement sensor does.
    pub(super) fn seen(&self) -> SensorFault {
        self.parts.iter().map(|p| p.seen).find(|s| *s != SensorFault::True).unwrap_or_default()
    }

    /// The same with friction that holds no harder than it slides, if it does.
    pub(super) fn without_static_level(&self) -> Option<Self> {
        let mut simpler = self.clone();
        let holding = simpler.plant.contacts.iter_mut().filter(|c| c.holding_ratio > 1.0);
        let changed = holding.map(|c| c.holding_ratio = 1.0).count();
        (changed > 0).then_some(simpler)
    }

    /// Moves along a run.
    pub(super) fn follow(&self, run: &PlannedRecord, accuracy: Accuracy) -> Result<PlantMotion, RigError> {
        self.follow_at(run, (0..run.sampling.count).map(|k| run.sampling.time(k)).collect(), accuracy)
    }

    /// The same, seen at any instants in order.
    pub(super) fn follow_at(
        &self,
        run: &PlannedRecord,
        times: Vec<f64>,
        accuracy: Accuracy,
    ) -> Result<PlantMotion, RigError> {
        let (inputs, initial) = self.driven(run);
        PlantMotion::along(&self.plant, &inputs, &initial, times, accuracy)
    }

    /// The plant's inputs along a run, and its states at t = 0.
    pub(super) fn driven(&self, run: &PlannedRecord) -> (Vec<Excitation>, Vec<f64>) {
        let run = run.scaled(self.level(), self.level());
        let inputs: Vec<Excitation> = match (&run.excitation, self.plant.smooth.layout.inputs) {
            (Some(reference), 2) if self.host_plant.control.is_some() => {
                vec![reference.clone(), run.noise.clone().unwrap_or_else(Excitation::rest)]
            }
            (Some(excitation), 2) => vec![excitation.clone(), excitation.clone().delayed(self.delay())],
            (Some(excitation), _) => vec![excitation.clone()],
            (None, _) => Vec::new(),
        };
        let mut initial = run.initial.to_vec();
        initial.resize(self.host_plant.own_states(), 0.0);
        initial.extend(self.parts.iter().flat_map(|p| &p.inner).map(|inner| match inner.begins {
            InnerStart::Zero => 0.0,
            InnerStart::Displacement => run.initial[0],
            InnerStart::Velocity => run.initial[1],
        }));
        (inputs, initial)
    }

    /// Time by which the input arrives late.
    pub(super) fn delay(&self) -> f64 {
        self.parts.iter().map(|p| p.delay).sum()
    }

    /// What is measured as the input: the plant's first, or the force of a control; none without any.
    pub(super) fn measured_input(&self) -> Option<MeasuredQuantity> {
        match self.host_plant.control {
            Some(control) => Some(MeasuredQuantity::Expression(control.force())),
            None => (self.plant.smooth.layout.inputs > 0).then_some(MeasuredQuantity::Input(0)),
        }
    }

    /// The same along a motion; empty without any.
    pub(super) fn applied(&self, motion: &PlantMotion) -> Vec<f64> {
        match (self.host_plant.control, motion.inputs.first()) {
            (Some(control), _) => self.along(motion, &[control.force()]).swap_remove(0),
            (None, Some([u, ..])) => u.clone(),
            (None, None) => Vec::new(),
        }
    }

    /// Values of expressions along a motion, one series each.
    pub(super) fn along(&self, motion: &PlantMotion, expressions: &[Expression]) -> Vec<Vec<f64>> {
        motion.values(&self.plant, expressions)
    }

    /// The missing acceleration of each effect over a motion, one series an effect. What changes the sensor counts as the
    /// spring force of what it changes, `shift` being the record's own share of a shifted zero.
    pub(super) fn missing(&self, motions: &PlantMotion, shift: f64) -> Vec<Vec<f64>> {
        let none = || Expression::from(0.0);
        let contacts: Vec<Expression> =
            self.parts.iter().map(|p| p.contact.as_ref().map_or_else(none, sliding_force)).collect();
        let mut expressions: Vec<Expression> = self.parts.iter().map(|p| p.force.clone()).collect();
        expressions.extend(contacts);
        expressions.push(self.host_plant.base());
        let values = self.along(motions, &expressions);
        let count = self.parts.len();
        let mut missing = vec![Vec::with_capacity(motions.times.len()); count];
        for (k, t) in motions.times.iter().enumerate() {
            let output = |index: usize| values[index][k];
            let smooth: f64 = (0..count).map(output).sum::<f64>() + output(2 * count);
            let mut contact = 0;
            for (j, part) in self.parts.iter().enumerate() {
                let mut force = output(j);
                if part.contact.is_some() {
                    let stuck = motions.stops.iter().any(|s| s.contact == contact && s.from <= *t && *t < s.to);
                    // While it sticks, the contact gives whatever keeps the mass on what it sticks to.
                    force +=
                        if stuck { self.held_acceleration(contact, motions, k) - smooth } else { output(count + j) };
                    contact += 1;
                }
                force += self.host_plant.stiffness
                    * match part.seen {
                        SensorFault::True => 0.0,
                        SensorFault::Shifted(size) => size * shift,
                        SensorFault::Clipped(limit) => motions.states[0][k].clamp(-limit, limit) - motions.states[0][k],
                    };
                missing[j].push(force);
            }
        }
        missing
    }

    /// Acceleration of what a contact sticks to: the base's, as it arrives, where it is in the joint.
    fn held_acceleration(&self, contact: usize, motions: &PlantMotion, sample: usize) -> f64 {
        let in_joint = self.plant.contacts[contact].velocity != Term::new(v());
        if in_joint { motions.inputs.last().map_or(0.0, |jet| jet[2][sample]) } else { 0.0 }
    }

    /// Displacement and velocity of the mass, deflection and velocity of the joint's spring, and the input, over a motion.
    pub(super) fn series(&self, motions: &PlantMotion) -> [Vec<f64>; 5] {
        let (x, v) = (motions.states[0].clone(), motions.states[1].clone());
        let (u, du) = motions.inputs.first().map_or((&[][..], &[][..]), |jet| (&jet[0][..], &jet[1][..]));
        let less = |a: &[f64], b: &[f64]| match self.host_plant.drive {
            DriveKind::Base => a.iter().zip(b).map(|(a, b)| a - b).collect(),
            DriveKind::Force | DriveKind::None => a.to_vec(),
        };
        let (r, w) = (less(&x, u), less(&v, du));
        [x, v, r, w, self.applied(motions)]
    }
}

/// −strength × sgn velocity.
fn sliding_force(contact: &Contact) -> Expression {
    let sign = contact.velocity.expression().clone().sgn();
    let sum = contact.sliding.iter().map(|(term, weight)| term.expression().clone() * *weight);
    -(sum.fold(Expression::from(0.0), |a, b| a + b) * sign)
}

/// The size of motions over all of them.
pub(super) fn extents(assembly: &Assembly, motions: &[PlantMotion]) -> MotionSize {
    let mut all: [Vec<f64>; 5] = Default::default();
    for motion in motions {
        for (all, own) in all.iter_mut().zip(assembly.series(motion)) {
            all.extend(own);
        }
    }
    let [x, v, r, w, u] = all.map(|series| Magnitude::over(series.into_iter()));
    MotionSize { x, v, r, w, u }
}

/// What forces are compared with: the spring's, or the input where there is no spring.
pub(super) fn reference(assembly: &Assembly, motion: &PlantMotion) -> Vec<f64> {
    let [_, _, deflection, _, input] = assembly.series(motion);
    let stiffness = assembly.host_plant.stiffness;
    if assembly.host_plant.sprung { deflection.into_iter().map(|r| stiffness * r).collect() } else { input }
}

/// Share of the sampled time in which a contact sticks.
pub(super) fn stuck_share(motions: &[PlantMotion]) -> f64 {
    let (mut whole, mut stuck) = (0.0, 0.0);
    for motion in motions {
        let (length, held) = motion.stuck();
        whole += length;
        stuck += held;
    }
    if whole > 0.0 { stuck / whole } else { 0.0 }
}
