use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::{Expression, Symbol, Term};

use super::plant::{Contact, Plant};

/// A number of a plant that may be changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantParameter {
    /// Its name.
    pub name: &'static str,
    /// Its value, unless something else is asked for.
    pub value: f64,
    /// The least value that makes sense.
    pub least: f64,
    /// Its unit.
    pub unit: &'static str,
    /// What it is.
    pub meaning: &'static str,
}

/// A kind of plant: its parameters and how it is built of their values.
#[derive(Debug)]
pub(super) struct PlantKind {
    pub parameters: &'static [PlantParameter],
    /// Takes the parameters' values in their order.
    pub build: fn(&[f64]) -> Plant,
    /// Units of the displacements (or states) and of the input.
    pub units: (&'static str, &'static str),
}

pub(super) const fn parameter(
    name: &'static str,
    value: f64,
    unit: &'static str,
    meaning: &'static str,
) -> PlantParameter {
    PlantParameter { name, value, least: f64::NEG_INFINITY, unit, meaning }
}

pub(super) const fn at_least(least: f64, parameter: PlantParameter) -> PlantParameter {
    PlantParameter { least, ..parameter }
}

/// A forced oscillator with a cubic spring: ẍ + 2ζẋ + x + βx³ = u.
pub(super) static DUFFING: PlantKind = PlantKind {
    parameters: &[
        parameter("zeta", 0.1, "1/s", "viscous damping: c/m = 2 zeta"),
        parameter("k", 1.0, "1/s^2", "linear stiffness over mass"),
        parameter("beta", 0.6, "1/(m^2 s^2)", "cubic stiffness over mass"),
    ],
    build: |p| {
        let cube = Expression::Power(Box::new(Expression::Symbol(X)), 3.0);
        let acceleration = [(symbol(X), -p[1]), (Term::new(cube), -p[2]), (symbol(V), -2.0 * p[0]), (symbol(U), 1.0)];
        Plant::smooth(Model::second_order(1, vec![Equation::known(acceleration)]))
    },
    units: ("m", "m/s^2"),
};

/// A mass on a spring and a damper whose other ends move with the base, rubbing on the ground:
/// ẍ = −(k/m)(x − u) − (c/m)(ẋ − u̇) − (F/m) sgn ẋ, stuck while the rest cannot overcome `F_s`.
pub(super) static FRICTION: PlantKind = PlantKind {
    parameters: &[
        parameter("k", 358.706, "1/s^2", "stiffness over mass"),
        parameter("c", 0.0658, "1/s", "viscous damping over mass"),
        at_least(0.0, parameter("F", 0.0856, "m/s^2", "sliding friction force over mass")),
        at_least(1.0, parameter("static", 1.0, "", "static over sliding friction")),
    ],
    build: |p| {
        let acceleration = [(symbol(X), -p[0]), (symbol(V), -p[1]), (symbol(U), p[0]), (symbol(DU), p[1])];
        let ground = Contact { holding_ratio: p[3], ..Contact::coulomb(symbol(V), 1, p[2]) };
        Plant { smooth: Model::second_order(1, vec![Equation::known(acceleration)]), contacts: vec![ground] }
    },
    units: ("m", "m"),
};

/// Lorenz's convection cell, the schematic's example.
pub(super) static LORENZ: PlantKind = PlantKind {
    parameters: &[
        parameter("sigma", 10.0, "1/s", "Prandtl number"),
        parameter("rho", 28.0, "1/s", "Rayleigh number over its critical value"),
        parameter("beta", 8.0 / 3.0, "1/s", "shape of the cell"),
    ],
    build: |p| {
        let [x, y, z] = [0, 1, 2].map(Symbol::State);
        let product = |a, b| Term::new(Expression::Product(vec![Expression::Symbol(a), Expression::Symbol(b)]));
        Plant::smooth(Model::first_order(
            0,
            vec![
                Equation::known([(symbol(x), -p[0]), (symbol(y), p[0])]),
                Equation::known([(symbol(x), p[1]), (symbol(y), -1.0), (product(x, z), -1.0)]),
                Equation::known([(product(x, y), 1.0), (symbol(z), -p[2])]),
            ],
        ))
    },
    units: ("", ""),
};

/// Two masses in a chain, a force on the first: ground – 1 – 2 (– ground).
pub(super) static TWO_MASSES: PlantKind = PlantKind {
    parameters: &[
        mass("m1", 2.0),
        mass("m2", 1.0),
        spring("k1", 800.0, "stiffness between ground and mass 1"),
        spring("k12", 600.0, "stiffness between masses 1 and 2"),
        spring("k2", 0.0, "stiffness between mass 2 and ground"),
        damper("c1", 2.0, "damping between ground and mass 1"),
        damper("c12", 1.2, "damping between masses 1 and 2"),
        damper("c2", 0.0, "damping between mass 2 and ground"),
        rubbing("F1", "friction between ground and mass 1"),
        rubbing("F12", "friction between masses 1 and 2"),
        rubbing("F2", "friction between mass 2 and ground"),
        hardening("h1", "cubic stiffness between ground and mass 1"),
        hardening("h12", "cubic stiffness between masses 1 and 2"),
        hardening("h2", "cubic stiffness between mass 2 and ground"),
        FORCED,
    ],
    build: |p| chain(&p[..2], &p[2..14], p[14]),
    units: ("m", "N"),
};

/// Three masses in a chain, a force on the first: ground – 1 – 2 – 3 (– ground).
pub(super) static THREE_MASSES: PlantKind = PlantKind {
    parameters: &[
        mass("m1", 2.0),
        mass("m2", 1.5),
        mass("m3", 1.0),
        spring("k1", 1000.0, "stiffness between ground and mass 1"),
        spring("k12", 900.0, "stiffness between masses 1 and 2"),
        spring("k23", 700.0, "stiffness between masses 2 and 3"),
        spring("k3", 0.0, "stiffness between mass 3 and ground"),
        damper("c1", 2.0, "damping between ground and mass 1"),
        damper("c12", 1.2, "damping between masses 1 and 2"),
        damper("c23", 0.9, "damping between masses 2 and 3"),
        damper("c3", 0.0, "damping between mass 3 and ground"),
        rubbing("F1", "friction between ground and mass 1"),
        rubbing("F12", "friction between masses 1 and 2"),
        rubbing("F23", "friction between masses 2 and 3"),
        rubbing("F3", "friction between mass 3 and ground"),
        hardening("h1", "cubic stiffness between ground and mass 1"),
        hardening("h12", "cubic stiffness between masses 1 and 2"),
        hardening("h23", "cubic stiffness between masses 2 and 3"),
        hardening("h3", "cubic stiffness between mass 3 and ground"),
        FORCED,
    ],
    build: |p| chain(&p[..3], &p[3..19], p[19]),
    units: ("m", "N"),
};

const fn mass(name: &'static str, value: f64) -> PlantParameter {
    at_least(1e-9, parameter(name, value, "kg", "a mass"))
}

const fn spring(name: &'static str, value: f64, meaning: &'static str) -> PlantParameter {
    parameter(name, value, "N/m", meaning)
}

const fn damper(name: &'static str, value: f64, meaning: &'static str) -> PlantParameter {
    parameter(name, value, "N s/m", meaning)
}

const fn rubbing(name: &'static str, meaning: &'static str) -> PlantParameter {
    at_least(0.0, parameter(name, 0.0, "N", meaning))
}

const fn hardening(name: &'static str, meaning: &'static str) -> PlantParameter {
    parameter(name, 0.0, "N/m^3", meaning)
}

/// The mass that the force acts on, by its number.
const FORCED: PlantParameter =
    at_least(1.0, parameter("at", 1.0, "", "the mass that the force acts on, by its number"));

/// Masses in a row between two grounds; in each place from the first ground on, one more than there are masses, a spring, a
/// damper, dry friction (Coulomb's) and a cubic spring: all springs first, and so on. The force acts on the mass of that number.
fn chain(masses: &[f64], parts: &[f64], forced: f64) -> Plant {
    let n = masses.len();
    let mut kinds = parts.chunks_exact(n + 1);
    let mut next = || kinds.next().unwrap_or_default();
    let (springs, dampers, frictions, hardenings) = (next(), next(), next(), next());
    let mut forces: Vec<Vec<(Term, f64)>> = vec![Vec::new(); n];
    let mut contacts = Vec::new();
    for place in 0..=n {
        let partners = [place.checked_sub(1), Some(place).filter(|i| *i < n)];
        // What is further along the chain less what is before it; a ground does not move.
        let across = |symbol: fn(usize) -> Symbol| {
            let [before, after] = partners.map(|i| i.map(|i| Expression::Symbol(symbol(i))));
            Term::new(match (before, after) {
                (Some(before), Some(after)) => Expression::Sum(vec![after, before.negated()]),
                (Some(only), None) | (None, Some(only)) => only,
                (None, None) => Expression::Number(0.0),
            })
        };
        let (stretch, speed) = (across(Symbol::State), across(Symbol::Rate));
        let cube = Term::new(Expression::Power(Box::new(stretch.expression().clone()), 3.0));
        // The mass beyond the place is held back by it, the one before it is pulled on; at the last ground only that one
        // is there, and it is held back.
        let pulls = |i: usize| if place < n && i + 1 == place { 1.0 } else { -1.0 };
        let mut acts_on = Vec::new();
        for i in partners.into_iter().flatten() {
            let acting = [(&stretch, springs[place]), (&speed, dampers[place]), (&cube, hardenings[place])];
            for (term, strength) in acting {
                if strength != 0.0 {
                    forces[i].push((term.clone(), pulls(i) * strength / masses[i]));
                }
            }
            acts_on.push((n + i, -pulls(i) / masses[i]));
        }
        if frictions[place] > 0.0 {
            let one = Term::new(Expression::Number(1.0));
            let sliding = vec![(one, frictions[place])];
            contacts.push(Contact { velocity: speed, acts_on, sliding, holding_ratio: 1.0 });
        }
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number, clamped")]
    let forced = (forced as usize).clamp(1, n) - 1;
    forces[forced].push((symbol(U), 1.0 / masses[forced]));
    Plant { smooth: Model::second_order(1, forces.into_iter().map(Equation::known).collect()), contacts }
}

const X: Symbol = Symbol::State(0);
const V: Symbol = Symbol::Rate(0);
const U: Symbol = Symbol::Input(0);
const DU: Symbol = Symbol::InputRate(0);

fn symbol(symbol: Symbol) -> Term {
    Term::new(Expression::Symbol(symbol))
}
