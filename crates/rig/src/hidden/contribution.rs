//! What an effect adds to a plant.

use crate::plant::Contact;
use sindyscope_values::term::{Expression, Term};

/// A number of an effect, without unit, and what its unit is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EffectConstant {
    pub name: &'static str,
    pub value: f64,
    pub dimension: Dimension,
}

/// What a number is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dimension {
    /// Powers of a length (or angle) and of a time.
    Of { length: i32, time: i32 },
    /// The input's own unit.
    Input,
}

/// An acceleration (force over mass).
pub(super) const ACCELERATION: Dimension = Dimension::Of { length: 1, time: -2 };
pub(super) const LENGTH: Dimension = Dimension::Of { length: 1, time: 0 };
pub(super) const VELOCITY: Dimension = Dimension::Of { length: 1, time: -1 };
pub(super) const STIFFNESS: Dimension = Dimension::Of { length: 0, time: -2 };
pub(super) const RATE: Dimension = Dimension::Of { length: 0, time: -1 };
pub(super) const TIME: Dimension = Dimension::Of { length: 0, time: 1 };
pub(super) const PLAIN: Dimension = Dimension::Of { length: 0, time: 0 };

/// A state of an effect's own.
#[derive(Clone, Debug)]
pub(super) struct InnerState {
    pub rate: Expression,
    pub begins: InnerStart,
}

/// What an effect's own state is at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum InnerStart {
    Zero,
    /// As the mass's displacement.
    Displacement,
    /// As the mass's velocity.
    Velocity,
}

/// What happens between the motion and its displacement sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum SensorFault {
    #[default]
    True,
    /// Shifted, in each record by its own share of this.
    Shifted(f64),
    /// Held within this.
    Clipped(f64),
}

/// What an effect adds to a plant.
#[derive(Clone, Debug)]
pub(super) struct Contribution {
    /// The missing acceleration, but for what the contact gives.
    pub force: Expression,
    pub inner: Vec<InnerState>,
    pub contact: Option<Contact>,
    /// How late the input arrives.
    pub delay: f64,
    /// Factor on all excitations and initial displacements.
    pub level: f64,
    pub seen: SensorFault,
    pub constants: Vec<EffectConstant>,
    /// Where it acts, in words; empty where there is only one place.
    pub place: &'static str,
}

impl Contribution {
    pub(super) fn new(place: &'static str) -> Self {
        Self {
            force: Expression::from(0.0),
            inner: Vec::new(),
            contact: None,
            delay: 0.0,
            level: 1.0,
            seen: SensorFault::True,
            constants: Vec::new(),
            place,
        }
    }

    pub(super) fn with(mut self, name: &'static str, value: f64, dimension: Dimension) -> Self {
        self.constants.push(EffectConstant { name, value, dimension });
        self
    }

    pub(super) fn force(self, force: Expression) -> Self {
        Self { force, ..self }
    }

    pub(super) fn inner(mut self, begins: InnerStart, rate: Expression) -> Self {
        self.inner.push(InnerState { rate, begins });
        self
    }

    pub(super) fn contact(self, velocity: Expression, sliding: Vec<(Expression, f64)>, holding_ratio: f64) -> Self {
        let sliding = sliding.into_iter().map(|(e, weight)| (Term::new(e), weight)).collect();
        let contact = Contact { velocity: Term::new(velocity), acts_on: vec![(1, 1.0)], sliding, holding_ratio };
        Self { contact: Some(contact), ..self }
    }
}
