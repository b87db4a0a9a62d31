use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::known::Known;
use crate::signal::Smoothing;
use crate::sparse::Regressor;
use sindyscope_values::term::{Kind, Term};

/// What a coefficient's size is compared with the threshold as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scaling {
    /// Columns and target divided by their RMS: the threshold is a share of the RMS acceleration, and units do not matter.
    #[default]
    Scaled,
    /// Coefficients as they stand, as the Python package does: units decide.
    Raw,
}

/// Whether `dx/dt = v` is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kinematics {
    /// Known, not fitted.
    #[default]
    Known,
    /// Fitted from the library, as in the report.
    Fitted,
}

/// How an equation is held against the data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Formulation {
    /// At samples: rates are derivatives of smoothed states.
    #[default]
    Derivative,
    /// In averages over test functions, which take the derivatives off the measurement.
    Weak {
        /// Half width of the test functions, samples; none: chosen from the data.
        half_width: Option<usize>,
    },
    /// Integrated once over time: a state against the integrals of the terms, and a constant of each stretch.
    Integral,
}

/// What a person has decided about a term.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lock {
    /// Kept whatever the threshold.
    In,
    /// Never used.
    Out,
    /// Kept at this coefficient.
    Fixed(f64),
}

/// What one equation has of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Own {
    /// Its candidate library; none: that of all equations.
    pub terms: Option<Vec<Term>>,
    /// Decisions about single terms, beside those for all equations; where both say something these count.
    pub locks: BTreeMap<Term, Lock>,
    /// Physics known of it, beside what is known of all.
    pub known: Vec<Known>,
}

/// Everything that decides an outcome, beside the records.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Order of the equations.
    pub kind: Kind,
    /// Smoothing and differentiation.
    pub smoothing: Smoothing,
    /// How the equation is held against the data.
    pub form: Formulation,
    /// The candidate library of each acceleration (second order) or state (first order).
    pub terms: Vec<Term>,
    /// Decisions about single terms; a term not in `terms` counts only if it is `In` or `Fixed`.
    pub locks: BTreeMap<Term, Lock>,
    /// What single equations have of their own, by degree of freedom (first order: by state), counted from zero.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub own: BTreeMap<usize, Own>,
    /// The way to a sparse equation.
    pub regressor: Regressor,
    /// Coefficients smaller than this are dropped; see [`Scaling`].
    pub threshold: f64,
    /// Weight α of the ridge penalty α‖c‖².
    pub ridge: f64,
    /// What the threshold compares.
    pub scaling: Scaling,
    /// Whether `dx/dt = v` is known.
    pub kinematics: Kinematics,
    /// Physics known beforehand.
    pub known: Vec<Known>,
    /// The moving mass, kg, if it is known: turns coefficients into forces.
    pub mass: Option<f64>,
    /// Fit the coefficients of the terms that are kept to the response itself.
    pub refine: bool,
    /// Samples of a held-out record that its initial state is estimated from, and that its score leaves out; none where the
    /// initial state is fitted to the opening and the whole record is scored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial: Option<usize>,
}

impl Settings {
    /// The settings as they stand for one equation: what it has of its own put over what counts for all.
    pub fn of_equation(&self, freedom: usize) -> Cow<'_, Self> {
        if self.own.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut settings = Self { own: BTreeMap::new(), ..self.clone() };
        if let Some(own) = self.own.get(&freedom) {
            if let Some(terms) = &own.terms {
                settings.terms.clone_from(terms);
            }
            settings.locks.extend(own.locks.iter().map(|(term, lock)| (term.clone(), *lock)));
            settings.known.extend(own.known.iter().cloned());
        }
        Cow::Owned(settings)
    }

    /// The decisions about single terms in one equation, or, of none, in all.
    pub fn own_locks(&mut self, freedom: Option<usize>) -> &mut BTreeMap<Term, Lock> {
        match freedom {
            Some(freedom) => &mut self.own.entry(freedom).or_default().locks,
            None => &mut self.locks,
        }
    }

    /// Decides about a term in all equations, whatever was decided in single ones; of none, the threshold decides.
    pub fn decide_for_all(&mut self, term: &Term, lock: Option<Lock>) {
        for own in self.own.values_mut() {
            own.locks.remove(term);
        }
        match lock {
            Some(lock) => drop(self.locks.insert(term.clone(), lock)),
            None => drop(self.locks.remove(term)),
        }
    }

    /// Decides about a term in one of several equations; in the only one there is, it is a decision for all.
    pub fn decide(&mut self, freedom: usize, freedoms: usize, term: Term, lock: Lock) {
        self.own_locks((freedoms > 1).then_some(freedom)).insert(term, lock);
    }
}
