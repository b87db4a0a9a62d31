//! Identified or known equations of motion: terms with coefficients for each state.

mod explicit;
mod modes;
mod physical;
mod units;

pub use explicit::{ImplicitError, check_accelerations, has_acceleration};
pub use modes::{Mode, modes};
pub use physical::{Mass, Physical, physical};
pub use units::Units;

use serde::{Deserialize, Serialize};

use crate::term::{Expression, Kind, Layout, Symbol, Term};

/// A term with its coefficient.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeightedTerm {
    /// The term.
    pub term: Term,
    /// Its coefficient, in the records' units.
    pub coefficient: f64,
    /// Standard error of the coefficient; none where it was given and not fitted.
    pub std_error: Option<f64>,
    /// RMS of `coefficient × term` over the fitted samples, as a share of the sum over all terms of the equation.
    pub share: f64,
}

/// The rate of one state as a sum of weighted terms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Equation {
    /// The terms; none means that the state keeps its value.
    pub terms: Vec<WeightedTerm>,
}

impl Equation {
    /// An equation from terms and coefficients that are known.
    pub fn known(terms: impl IntoIterator<Item = (Term, f64)>) -> Self {
        let terms = terms
            .into_iter()
            .map(|(term, coefficient)| WeightedTerm { term, coefficient, std_error: None, share: 0.0 })
            .collect();
        Self { terms }
    }

    /// The coefficient of a term, if the equation has it.
    pub fn coefficient(&self, term: &Term) -> Option<f64> {
        self.terms.iter().find(|t| t.term == *term).map(|t| t.coefficient)
    }
}

/// Equations of motion, one for each entry of the state vector (displacements, then velocities).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Numbers of states and inputs.
    pub layout: Layout,
    /// One equation a state, in the order of [`Layout::state_symbols`].
    pub equations: Vec<Equation>,
    /// How many times its sliding level a sticking `sgn` holds before it lets go: static over sliding friction, at least 1.
    #[serde(default = "even")]
    pub static_ratio: f64,
}

fn even() -> f64 {
    1.0
}

impl Model {
    /// A second-order model: `dx/dt = v` is added to the given equations of the velocities.
    pub fn second_order(inputs: usize, accelerations: Vec<Equation>) -> Self {
        let layout = Layout { kind: Kind::SecondOrder, freedoms: accelerations.len(), inputs, internals: 0 };
        let mut equations: Vec<Equation> = (0..layout.freedoms).map(kinematic).collect();
        equations.extend(accelerations);
        Self { layout, equations, static_ratio: 1.0 }
    }

    /// A first-order model.
    pub fn first_order(inputs: usize, equations: Vec<Equation>) -> Self {
        let layout = Layout { kind: Kind::FirstOrder, freedoms: equations.len(), inputs, internals: 0 };
        Self { layout, equations, static_ratio: 1.0 }
    }

    /// This model with internal states `z1, z2, …`, one equation each.
    #[must_use]
    pub fn with_internals(mut self, equations: Vec<Equation>) -> Self {
        self.layout.internals += equations.len();
        self.equations.extend(equations);
        self
    }

    /// Each state's symbol with its equation.
    pub fn iter(&self) -> impl Iterator<Item = (Symbol, &Equation)> {
        self.layout.state_symbols().zip(&self.equations)
    }

    /// The equation of the first velocity (second order) or of the first state.
    pub fn leading(&self) -> Option<&Equation> {
        match self.layout.kind {
            Kind::SecondOrder => self.equations.get(self.layout.freedoms),
            Kind::FirstOrder => self.equations.first(),
        }
    }
}

/// `dx/dt = v` of one degree of freedom.
pub fn kinematic(freedom: usize) -> Equation {
    Equation::known([(Term::new(Expression::Symbol(Symbol::Rate(freedom))), 1.0)])
}
