use super::settings::{EffectValue, ExcitationChoice, RigSettings};
use crate::hidden::{Drive, Given, TrueParameter, Truth, title};
use crate::plant::Plant;
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::model::Model;
use sindyscope_values::term::{Expression, Function, Kind, Layout, Symbol, Term};

/// A term of the equation that moved the rig.
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

/// The equations that moved a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigTruth {
    /// The terms of every acceleration.
    pub terms: Vec<TrueTerm>,
    /// Numbers of masses and inputs of the records.
    pub layout: Layout,
    /// The plant and its effect as a hidden one is told.
    pub told: Truth,
}

impl RigTruth {
    /// The terms of the truth that a library may hold.
    pub fn library(&self) -> impl Iterator<Item = &Term> {
        self.terms.iter().filter_map(|t| t.term.as_ref())
    }

    /// The coefficient of a term in the equation of a velocity.
    pub fn coefficient(&self, state: Symbol, term: &Term) -> Option<f64> {
        self.terms.iter().find(|t| t.state == state && t.term.as_ref() == Some(term)).map(|t| t.coefficient)
    }

    pub(super) fn of_one(given: &Given, settings: &RigSettings, values: &[EffectValue], ratio: f64) -> Self {
        let linear = settings.linear();
        let inputs = usize::from(linear.drive != Drive::None);
        let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs, internals: 0 };
        let mut list = List { layout, terms: Vec::new(), late: given.delay() > 0.0 };
        let (state, symbol) = (Symbol::Rate(0), Expression::Symbol);
        list.add(state, -linear.stiffness, symbol(Symbol::State(0)));
        list.add(state, -linear.damping, symbol(Symbol::Rate(0)));
        match linear.drive {
            Drive::Base => {
                list.add(state, linear.stiffness, symbol(Symbol::Input(0)));
                list.add(state, linear.damping, symbol(Symbol::InputRate(0)));
            }
            Drive::Force => list.add(state, linear.mobility, symbol(Symbol::Input(0))),
            Drive::None => {}
        }
        if !list.late {
            for force in given.forces() {
                list.add_all(state, &of_records(force));
            }
        }
        for contact in &given.plant().contacts {
            let sign = Expression::call(Function::Sgn, of_records(contact.velocity.expression()));
            for (term, weight) in &contact.sliding {
                let product = vec![Expression::Number(-*weight), of_records(term.expression()), sign.clone()];
                list.add_all(state, &Expression::Product(product));
            }
        }
        let own = |name: &str, value: f64, unit: &str| TrueParameter {
            effect: None,
            name: name.to_owned(),
            value,
            unit: unit.to_owned(),
        };
        let mut parameters = vec![own("k", linear.stiffness, "1/s^2"), own("c", linear.damping, "1/s")];
        if linear.drive == Drive::Force {
            parameters.push(own("b", linear.mobility, "1/kg"));
        }
        let effects: Vec<String> = settings.effect.iter().cloned().collect();
        let name = settings.effect.as_deref().and_then(crate::hidden::known_name);
        parameters.extend(values.iter().map(|v| TrueParameter {
            effect: name,
            name: v.name.clone(),
            value: v.value,
            unit: v.unit.clone(),
        }));
        let told = Truth {
            description: description(settings, values, given.place(), ratio),
            effects,
            parameters,
            ratio,
            ratios: settings.effect.iter().map(|_| ratio).collect(),
            natural_frequency: linear.natural_frequency(),
            damping_ratio: settings.damping_ratio,
            noise: 0.0,
            beyond_simpler: None,
            beyond_base: None,
        };
        Self { terms: list.terms, layout, told }
    }

    pub(super) fn of_chain(plant: &Plant, settings: &RigSettings) -> Self {
        let driven = settings.excitation != ExcitationChoice::Decay;
        let truth: Model = plant.truth();
        let layout = Layout { inputs: usize::from(driven), ..truth.layout };
        let mut list = List { layout, terms: Vec::new(), late: false };
        for (state, equation) in truth.iter().filter(|(state, _)| matches!(state, Symbol::Rate(_))) {
            for part in &equation.terms {
                if driven || !part.term.symbols().contains(&Symbol::Input(0)) {
                    list.add(state, part.coefficient, part.term.expression().clone());
                }
            }
        }
        let found = settings.natural_frequencies();
        let words: Vec<String> = found.iter().map(|f| significant_trimmed(*f, 4)).collect();
        let parameters = settings.plant.parameters().iter().map(|p| TrueParameter {
            effect: None,
            name: p.name.to_owned(),
            value: settings.chain_value(p),
            unit: p.unit.to_owned(),
        });
        let rubs = !plant.contacts.is_empty();
        let effects: Vec<String> = rubs.then(|| "coulomb_friction".to_owned()).into_iter().collect();
        let friction = if rubs { ", with dry friction" } else { "" };
        let told = Truth {
            effects,
            parameters: parameters.collect(),
            ratio: 0.0,
            ratios: Vec::new(),
            natural_frequency: found.first().copied().unwrap_or_default(),
            damping_ratio: 0.0,
            noise: 0.0,
            beyond_simpler: None,
            beyond_base: None,
            description: format!(
                "A chain of {} masses with natural frequencies of {} Hz{friction}.",
                settings.plant.masses(),
                words.join(", ")
            ),
        };
        Self { terms: list.terms, layout, told }
    }
}

/// Terms being gathered.
struct List {
    layout: Layout,
    terms: Vec<TrueTerm>,
    /// The input arrives late, which no term of the records says.
    late: bool,
}

impl List {
    /// Every addend of an expression in the states of the records.
    fn add_all(&mut self, state: Symbol, expression: &Expression) {
        match expression.normal() {
            Expression::Sum(parts) => parts.into_iter().for_each(|part| self.add(state, 1.0, part)),
            other => self.add(state, 1.0, other),
        }
    }

    fn add(&mut self, state: Symbol, factor: f64, expression: Expression) {
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

/// An expression of the first-order plant (displacement, velocity, inner states) in the records' symbols.
fn of_records(expression: &Expression) -> Expression {
    let all = |parts: &[Expression]| parts.iter().map(of_records).collect();
    match expression {
        Expression::Number(n) => Expression::Number(*n),
        Expression::Symbol(Symbol::State(0)) => Expression::Symbol(Symbol::State(0)),
        Expression::Symbol(Symbol::State(1)) => Expression::Symbol(Symbol::Rate(0)),
        Expression::Symbol(Symbol::State(k)) => Expression::Symbol(Symbol::Internal(k - 2)),
        Expression::Symbol(other) => Expression::Symbol(*other),
        Expression::Sum(parts) => Expression::Sum(all(parts)),
        Expression::Product(parts) => Expression::Product(all(parts)),
        Expression::Power(base, exponent) => Expression::Power(Box::new(of_records(base)), *exponent),
        Expression::Call(function, parts) => Expression::Call(*function, all(parts)),
    }
}

fn description(settings: &RigSettings, values: &[EffectValue], place: &str, ratio: f64) -> String {
    let rest = format!(
        "a linear oscillator of {} Hz and {} % of critical damping",
        significant_trimmed(settings.frequency, 4),
        significant_trimmed(100.0 * settings.damping_ratio, 3)
    );
    let Some(name) = &settings.effect else { return format!("Nothing but {rest}.") };
    let numbers: Vec<String> =
        values.iter().map(|v| format!("{} = {} {}", v.name, significant_trimmed(v.value, 4), v.unit)).collect();
    let place = if place.is_empty() { String::new() } else { format!(" {place}") };
    format!(
        "In it: {}{place} ({}); its force is {} % of the spring's. The rest is {rest}.",
        title(name).unwrap_or(name),
        numbers.join(", "),
        significant_trimmed(100.0 * ratio, 3),
    )
}
