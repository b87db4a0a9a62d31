//! What is true of a run.

use super::plant::Plant;
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::{Expression, Kind, Layout, Symbol, Term};

/// A term of an equation that moved a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueTerm {
    /// The velocity whose rate it stands in.
    pub state: Symbol,
    /// As a term of the records' quantities; none where it depends on something that no record has.
    pub term: Option<Term>,
    /// As it is printed.
    pub text: String,
    /// Its coefficient, in SI units.
    pub coefficient: f64,
}

/// A number of the plant or of an effect in it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueParameter {
    /// The effect it belongs to; none for the linear plant's own.
    pub effect: Option<&'static str>,
    /// Its name, as in the effect's equation.
    pub name: String,
    /// Its value, in `unit`; forces and stiffnesses are over mass.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// What is true of a run: the equations that moved the plant, and everything that a study may be compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The terms of every equation of motion, in the records' quantities. Empty of what was drawn to be hidden, which its
    /// parameters tell.
    pub terms: Vec<TrueTerm>,
    /// Numbers of masses and inputs of the records.
    pub layout: Layout,
    /// Names of the effects beside the linear plant.
    pub effects: Vec<String>,
    /// Numbers of the linear plant (`k`, `c`, with a force `b`), then of each effect.
    pub parameters: Vec<TrueParameter>,
    /// RMS of all missing force over RMS of the spring's force, over the fitted records. What is wrong with a sensor counts
    /// as the spring's force of its error.
    pub ratio: f64,
    /// The same for each effect by itself.
    pub ratios: Vec<f64>,
    /// Natural frequency of the linear plant, Hz.
    pub natural_frequency: f64,
    /// Its damping as a share of the critical.
    pub damping_ratio: f64,
    /// Standard deviation of the noise of the motion's sensor, in the unit of what it shows.
    pub noise: f64,
    /// RMS over the fitted records of what an effect changes of what is shown beyond the simpler one that it contains
    /// (friction with a static level: Coulomb's), in its unit; none where there is no simpler one.
    pub beyond_simpler: Option<f64>,
    /// RMS over the fitted records of the displacement that the base model cannot follow, to first order, in the displacement's
    /// unit; none where nothing is hidden or the base model excites itself.
    pub beyond_base: Option<f64>,
    /// All of it in words.
    pub description: String,
}

impl Truth {
    /// The equations of a plant whose records hold its displacements and velocities as they are, and no internal state; without its
    /// input where nothing drives it.
    pub(super) fn of_plant(plant: &Plant, driven: bool) -> Self {
        let truth: Model = plant.truth();
        let layout = Layout { inputs: if driven { truth.layout.inputs } else { 0 }, internals: 0, ..truth.layout };
        let mut terms = TermList::new(layout);
        let moves = |state: &Symbol| layout.kind == Kind::FirstOrder || matches!(state, Symbol::Rate(_));
        for (state, equation) in truth.iter().filter(|(state, _)| moves(state)) {
            for part in &equation.terms {
                if driven || !part.term.symbols().iter().any(is_input) {
                    terms.add(state, part.coefficient, part.term.expression().clone());
                }
            }
        }
        Self { terms: terms.terms, layout, ..Self::unknown() }
    }

    /// A truth of which nothing is said yet.
    pub(super) fn unknown() -> Self {
        Self {
            terms: Vec::new(),
            layout: Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 0, internals: 0 },
            effects: Vec::new(),
            parameters: Vec::new(),
            ratio: 0.0,
            ratios: Vec::new(),
            natural_frequency: 0.0,
            damping_ratio: 0.0,
            noise: 0.0,
            beyond_simpler: None,
            beyond_base: None,
            description: String::new(),
        }
    }

    /// The terms that a library may hold.
    pub fn library(&self) -> impl Iterator<Item = &Term> {
        self.terms.iter().filter_map(|t| t.term.as_ref())
    }

    /// The coefficient of a term in the equation of a state.
    pub fn coefficient(&self, state: Symbol, term: &Term) -> Option<f64> {
        self.terms.iter().find(|t| t.state == state && t.term.as_ref() == Some(term)).map(|t| t.coefficient)
    }

    /// The equations as a model, as far as the records' quantities tell them.
    pub fn model(&self) -> Model {
        let of_second_order = self.layout.kind == Kind::SecondOrder;
        let state = |i| if of_second_order { Symbol::Rate(i) } else { Symbol::State(i) };
        let equation =
            |i| Equation::known(self.equation(state(i)).map(|(term, coefficient)| (term.clone(), coefficient)));
        let equations = (0..self.layout.freedoms).map(equation).collect();
        let model = if of_second_order { Model::second_order } else { Model::first_order };
        model(self.layout.inputs, equations)
    }

    /// The terms of the equation of one state, with their coefficients, as far as the records' quantities tell them.
    pub fn equation(&self, state: Symbol) -> impl Iterator<Item = (&Term, f64)> {
        self.terms.iter().filter(move |t| t.state == state).filter_map(|t| Some((t.term.as_ref()?, t.coefficient)))
    }

    /// The value of a parameter of an effect, or of the linear plant (`None`).
    pub fn parameter(&self, effect: Option<&str>, name: &str) -> Option<f64> {
        self.parameters.iter().find(|p| p.effect == effect && p.name == name).map(|p| p.value)
    }
}

/// Terms being gathered.
pub(super) struct TermList {
    pub(super) layout: Layout,
    pub(super) terms: Vec<TrueTerm>,
    /// The input arrives late, which no term of the records says.
    pub(super) late: bool,
}

/// True for an input and its derivatives.
pub(super) fn is_input(symbol: &Symbol) -> bool {
    matches!(symbol, Symbol::Input(_) | Symbol::InputRate(_) | Symbol::InputAcceleration(_))
}

impl TermList {
    pub(super) fn new(layout: Layout) -> Self {
        Self { layout, terms: Vec::new(), late: false }
    }

    /// Adds every addend of an expression in the states of the records to the equation of a state.
    pub(super) fn add_all(&mut self, state: Symbol, expression: &Expression) {
        match expression.normal() {
            Expression::Sum(parts) => parts.into_iter().for_each(|part| self.add(state, 1.0, part)),
            other => self.add(state, 1.0, other),
        }
    }

    /// Adds a multiple of an expression to the equation of a state; terms that print alike are one.
    pub(super) fn add(&mut self, state: Symbol, factor: f64, expression: Expression) {
        let (number, rest) = expression.normal().apart();
        let coefficient = factor * number;
        if coefficient == 0.0 {
            return;
        }
        let term = Term::new(rest);
        let delayed = |s: &Symbol| self.late && matches!(s, Symbol::Input(_) | Symbol::InputRate(_));
        let known = term.foreign_symbol(&self.layout).is_none() && !term.symbols().iter().any(delayed);
        let inner = term.symbols().iter().filter(|s| matches!(s, Symbol::Internal(_))).count();
        let printed = Layout { internals: inner, ..self.layout };
        let mut text = term.pretty(&printed);
        if term.symbols().iter().any(delayed) {
            text += "(t − τ)";
        }
        let term = known.then_some(term);
        let same = |t: &&mut TrueTerm| t.state == state && t.text == text;
        match self.terms.iter_mut().find(same) {
            Some(before) => before.coefficient += coefficient,
            None => self.terms.push(TrueTerm { state, term, text, coefficient }),
        }
    }
}
