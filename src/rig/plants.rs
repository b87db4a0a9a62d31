use crate::model::{Equation, Model};
use crate::term::{Expression, Symbol, Term};

use super::plant::{Contact, Plant};

/// A number of a plant that may be changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
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
    pub parameters: &'static [Parameter],
    /// Takes the parameters' values in their order.
    pub build: fn(&[f64]) -> Plant,
    /// Units of the displacements (or states) and of the input.
    pub units: (&'static str, &'static str),
}

const fn parameter(name: &'static str, value: f64, unit: &'static str, meaning: &'static str) -> Parameter {
    Parameter { name, value, least: f64::NEG_INFINITY, unit, meaning }
}

const fn at_least(least: f64, parameter: Parameter) -> Parameter {
    Parameter { least, ..parameter }
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

const X: Symbol = Symbol::State(0);
const V: Symbol = Symbol::Rate(0);
const U: Symbol = Symbol::Input(0);
const DU: Symbol = Symbol::InputRate(0);

fn symbol(symbol: Symbol) -> Term {
    Term::new(Expression::Symbol(symbol))
}
