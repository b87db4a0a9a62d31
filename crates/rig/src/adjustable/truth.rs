//! What is true of an adjustable rig.

use super::settings::{EffectValue, PlantChoice, RigSettings};
use crate::hidden::{ChosenPlant, DriveKind, title};
use crate::plant::Plant;
use crate::truth::{TermList, TrueParameter, Truth};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::term::{Expression, Function, Kind, Layout, Symbol};

/// The equation of one mass with an effect, whose force over that of the spring is `ratio`.
pub(super) fn of_one(given: &ChosenPlant, settings: &RigSettings, values: &[EffectValue], ratio: f64) -> Truth {
    let linear = settings.linear();
    let inputs = usize::from(linear.drive != DriveKind::None);
    let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs, internals: 0 };
    let mut list = TermList { late: given.delay() > 0.0, ..TermList::new(layout) };
    let (state, symbol) = (Symbol::Rate(0), Expression::Symbol);
    list.add(state, -linear.stiffness, symbol(Symbol::State(0)));
    list.add(state, -linear.damping, symbol(Symbol::Rate(0)));
    match linear.drive {
        DriveKind::Base => {
            list.add(state, linear.stiffness, symbol(Symbol::Input(0)));
            list.add(state, linear.damping, symbol(Symbol::InputRate(0)));
        }
        DriveKind::Force => list.add(state, linear.mobility, symbol(Symbol::Input(0))),
        DriveKind::None => {}
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
    if linear.drive == DriveKind::Force {
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
    Truth {
        terms: list.terms,
        layout,
        description: description(settings, values, given.place(), ratio),
        effects,
        parameters,
        ratio,
        ratios: settings.effect.iter().map(|_| ratio).collect(),
        natural_frequency: linear.natural_frequency(),
        damping_ratio: settings.damping_ratio,
        ..Truth::unknown()
    }
}

/// The equations of a chain, which are `truth`'s, with what else is known of it.
pub(super) fn of_chain(plant: &Plant, settings: &RigSettings, truth: Truth) -> Truth {
    let found = settings.natural_frequencies();
    let words: Vec<String> = found.iter().map(|f| significant_trimmed(*f, 4)).collect();
    let parameters = settings.plant.parameters().iter().map(|p| TrueParameter {
        effect: None,
        name: p.name.to_owned(),
        value: settings.chain_value(p),
        unit: p.unit.to_owned(),
    });
    let rubs = !plant.contacts.is_empty();
    let own = settings.plant.parameters();
    let given = |name: &str| own.iter().find(|p| p.name == name).is_some_and(|p| settings.chain_value(p) != 0.0);
    let beside = [
        (rubs, "coulomb_friction", "dry friction"),
        (given("cubic"), "cubic_stiffness", "a cubic spring"),
        (given("stop"), "clearance", "stops behind a clearance"),
        (given("joint") && given("slip"), "bouc_wen_hysteresis", "a joint that slips"),
    ];
    let there = || beside.iter().filter(|(is, ..)| *is);
    let effects: Vec<String> = there().map(|(_, name, _)| (*name).to_owned()).collect();
    let named: Vec<&str> = there().map(|(.., words)| *words).collect();
    let with = if named.is_empty() { String::new() } else { format!(", with {}", named.join(", ")) };
    let what = if settings.plant == PlantChoice::Beam { "A cantilever beam" } else { "A chain" };
    let nodes = if settings.plant == PlantChoice::Beam { "nodes" } else { "masses" };
    Truth {
        effects,
        parameters: parameters.collect(),
        natural_frequency: found.first().copied().unwrap_or_default(),
        description: format!(
            "{what} of {} {nodes} with natural frequencies of {} Hz{with}.",
            settings.plant.masses(),
            words.join(", ")
        ),
        ..truth
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
