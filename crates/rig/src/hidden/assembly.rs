//! A linear plant with effects in it: put together, set in motion, and its missing forces measured.

use super::catalogue::Effect;
use super::parts::{Begins, Parts, SensorFault};
use super::quantities::v;
use super::scene::{Dice, Drive, Extent, MotionSize, Scene};
use super::shaking::Run;
use crate::Excitation;
use crate::RigError;
use crate::motion::Motion;
use crate::plant::{Contact, Plant};
use crate::setup::Quantity;
use crate::span::Accuracy;
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::{Expression, Term};

/// A linear plant with effects in it.
#[derive(Clone, Debug)]
pub(super) struct Assembly {
    pub parts: Vec<Parts>,
    pub plant: Plant,
    scene: Scene,
}

impl Assembly {
    /// Effects with their strengths, in a scene.
    pub(super) fn new(effects: &[(&Effect, Dice)], strengths: &[f64], scene: &Scene) -> Self {
        let mut first_state = scene.own_states();
        let mut parts = Vec::with_capacity(effects.len());
        // Friction in the joint rubs on the base that moves late, as the spring pulls at it.
        let arriving = usize::from(effects.iter().any(|(effect, _)| effect.name == "input_delay"));
        for ((effect, dice), strength) in effects.iter().zip(strengths) {
            let part = (effect.build)(*strength, dice, &Scene { first_state, arriving, ..scene.clone() });
            first_state += part.inner.len();
            parts.push(part);
        }
        let inputs = match scene.drive {
            Drive::None => 0,
            _ if scene.control.is_some() => 2,
            _ if parts.iter().any(|p| p.delay > 0.0) => 2,
            _ => 1,
        };
        let forces = std::iter::once(scene.base()).chain(parts.iter().map(|p| p.force.clone()));
        let known = |terms: Vec<Expression>| Equation::known(terms.into_iter().map(|e| (Term::new(e), 1.0)));
        let mut equations = vec![known(vec![v()]), known(forces.collect())];
        equations.extend(scene.control.map(|control| known(vec![control.filtered_rate()])));
        equations.extend(parts.iter().flat_map(|p| &p.inner).map(|inner| known(vec![inner.rate.clone()])));
        let contacts = parts.iter().filter_map(|p| p.contact.clone()).collect();
        let plant = Plant { smooth: Model::first_order(inputs, equations), contacts };
        Self { parts, plant, scene: scene.clone() }
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
    pub(super) fn follow(&self, run: &Run, accuracy: Accuracy) -> Result<Motion, RigError> {
        self.follow_at(run, (0..run.sampling.count).map(|k| run.sampling.time(k)).collect(), accuracy)
    }

    /// The same, seen at any instants in order.
    pub(super) fn follow_at(&self, run: &Run, times: Vec<f64>, accuracy: Accuracy) -> Result<Motion, RigError> {
        let (inputs, initial) = self.driven(run);
        Motion::along(&self.plant, &inputs, &initial, times, accuracy)
    }

    /// The plant's inputs along a run, and its states at t = 0.
    pub(super) fn driven(&self, run: &Run) -> (Vec<Excitation>, Vec<f64>) {
        let run = run.scaled(self.level(), self.level());
        let inputs: Vec<Excitation> = match (&run.excitation, self.plant.smooth.layout.inputs) {
            (Some(reference), 2) if self.scene.control.is_some() => {
                vec![reference.clone(), run.noise.clone().unwrap_or_else(Excitation::rest)]
            }
            (Some(excitation), 2) => vec![excitation.clone(), excitation.clone().delayed(self.delay())],
            (Some(excitation), _) => vec![excitation.clone()],
            (None, _) => Vec::new(),
        };
        let mut initial = run.initial.to_vec();
        initial.resize(self.scene.own_states(), 0.0);
        initial.extend(self.parts.iter().flat_map(|p| &p.inner).map(|inner| match inner.begins {
            Begins::Zero => 0.0,
            Begins::Displacement => run.initial[0],
            Begins::Velocity => run.initial[1],
        }));
        (inputs, initial)
    }

    /// Time by which the input arrives late.
    pub(super) fn delay(&self) -> f64 {
        self.parts.iter().map(|p| p.delay).sum()
    }

    /// What is measured as the input: the plant's first, or the force of a control; none without any.
    pub(super) fn measured_input(&self) -> Option<Quantity> {
        match self.scene.control {
            Some(control) => Some(Quantity::Expression(control.force())),
            None => (self.plant.smooth.layout.inputs > 0).then_some(Quantity::Input(0)),
        }
    }

    /// The same along a motion; empty without any.
    pub(super) fn applied(&self, motion: &Motion) -> Vec<f64> {
        match (self.scene.control, motion.inputs.first()) {
            (Some(control), _) => self.along(motion, &[control.force()]).swap_remove(0),
            (None, Some([u, ..])) => u.clone(),
            (None, None) => Vec::new(),
        }
    }

    /// Values of expressions along a motion, one series each.
    pub(super) fn along(&self, motion: &Motion, expressions: &[Expression]) -> Vec<Vec<f64>> {
        motion.values(&self.plant, expressions)
    }

    /// The missing acceleration of each effect over a motion, one series an effect. What changes the sensor counts as the
    /// spring force of what it changes, `shift` being the record's own share of a shifted zero.
    pub(super) fn missing(&self, motions: &Motion, shift: f64) -> Vec<Vec<f64>> {
        let none = || Expression::from(0.0);
        let contacts: Vec<Expression> =
            self.parts.iter().map(|p| p.contact.as_ref().map_or_else(none, sliding_force)).collect();
        let mut expressions: Vec<Expression> = self.parts.iter().map(|p| p.force.clone()).collect();
        expressions.extend(contacts);
        expressions.push(self.scene.base());
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
                force += self.scene.stiffness
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
    fn held_acceleration(&self, contact: usize, motions: &Motion, sample: usize) -> f64 {
        let in_joint = self.plant.contacts[contact].velocity != Term::new(v());
        if in_joint { motions.inputs.last().map_or(0.0, |jet| jet[2][sample]) } else { 0.0 }
    }

    /// Displacement and velocity of the mass, deflection and velocity of the joint's spring, and the input, over a motion.
    pub(super) fn series(&self, motions: &Motion) -> [Vec<f64>; 5] {
        let (x, v) = (motions.states[0].clone(), motions.states[1].clone());
        let (u, du) = motions.inputs.first().map_or((&[][..], &[][..]), |jet| (&jet[0][..], &jet[1][..]));
        let less = |a: &[f64], b: &[f64]| match self.scene.drive {
            Drive::Base => a.iter().zip(b).map(|(a, b)| a - b).collect(),
            Drive::Force | Drive::None => a.to_vec(),
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
pub(super) fn extents(assembly: &Assembly, motions: &[Motion]) -> MotionSize {
    let mut all: [Vec<f64>; 5] = Default::default();
    for motion in motions {
        for (all, own) in all.iter_mut().zip(assembly.series(motion)) {
            all.extend(own);
        }
    }
    let [x, v, r, w, u] = all.map(|series| Extent::of(series.into_iter()));
    MotionSize { x, v, r, w, u }
}

/// What forces are compared with: the spring's, or the input where there is no spring.
pub(super) fn reference(assembly: &Assembly, motion: &Motion) -> Vec<f64> {
    let [_, _, deflection, _, input] = assembly.series(motion);
    let stiffness = assembly.scene.stiffness;
    if assembly.scene.sprung { deflection.into_iter().map(|r| stiffness * r).collect() } else { input }
}

/// Share of the sampled time in which a contact sticks.
pub(super) fn stuck_share(motions: &[Motion]) -> f64 {
    let (mut whole, mut stuck) = (0.0, 0.0);
    for motion in motions {
        let (length, held) = motion.stuck();
        whole += length;
        stuck += held;
    }
    if whole > 0.0 { stuck / whole } else { 0.0 }
}
