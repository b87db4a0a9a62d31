//! The one vocabulary: candidate terms of an equation of motion.
//!
//! A [`Term`] is a function of time, states, rates and inputs, written as it is printed: `x^2*v`, `sgn(v-du)`, `v*|v|`.
//! The candidate library, the identified model and the virtual rig all speak it.

mod build;
mod calculus;
mod expression;
mod integral;
mod library;
mod lists;
mod parse;
mod print;
mod program;

use std::fmt;
use std::hash::{Hash, Hasher};
use std::str::FromStr;
use std::sync::Arc;

pub use calculus::derivative;
pub use calculus::{drift, in_signs};
pub use expression::sign;
pub use expression::{Expression, Function, Symbol};
pub use integral::{integral, is_integral, rate};
pub use library::{TermFamily, polynomials};
pub use lists::{EquationEntries, by_equation, list, pieces};
pub use parse::TermError;
pub use print::{Notation, Style, latex_number, written, written_factor};
pub use program::LANES;
pub use program::{Program, SampleBlock, SampleStretch, Slots};

use serde::{Deserialize, Serialize};

/// Order of the equations of motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Displacements are measured; their velocities are derived and `dx/dt = v` is known.
    #[default]
    SecondOrder,
    /// Every state is measured and has an equation of its own.
    FirstOrder,
}

/// How many states and inputs an equation of motion has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Layout {
    /// Order of the equations.
    pub kind: Kind,
    /// Number of degrees of freedom (second order) or of states (first order).
    pub freedoms: usize,
    /// Number of inputs: forces or base displacements.
    pub inputs: usize,
    /// Number of states that are not measured, each with a first-order equation of its own: a hysteretic deflection, a
    /// Maxwell element's, an attached mass's displacement and velocity.
    #[serde(default)]
    pub internals: usize,
}

impl Layout {
    /// Length of the state vector: displacements, velocities where the kind has them, then internal states.
    pub fn states(&self) -> usize {
        self.internals
            + match self.kind {
                Kind::SecondOrder => 2 * self.freedoms,
                Kind::FirstOrder => self.freedoms,
            }
    }

    /// The symbol of each entry of the state vector.
    pub fn state_symbols(&self) -> impl Iterator<Item = Symbol> + use<> {
        let rates = match self.kind {
            Kind::SecondOrder => self.freedoms,
            Kind::FirstOrder => 0,
        };
        let measured = (0..self.freedoms).map(Symbol::State).chain((0..rates).map(Symbol::Rate));
        measured.chain((0..self.internals).map(Symbol::Internal))
    }

    /// True if the layout has this symbol.
    pub fn has(&self, symbol: Symbol) -> bool {
        match symbol {
            Symbol::Time => true,
            Symbol::State(i) => i < self.freedoms,
            Symbol::Rate(i) | Symbol::Acceleration(i) => self.kind == Kind::SecondOrder && i < self.freedoms,
            Symbol::Internal(i) => i < self.internals,
            Symbol::Input(j) | Symbol::InputRate(j) | Symbol::InputAcceleration(j) => j < self.inputs,
        }
    }

    /// A symbol's name here: `x` where there is one degree of freedom, `x1` where there are several.
    pub fn name(&self, symbol: Symbol) -> String {
        let (stem, index, several) = match symbol {
            Symbol::Time => return "t".into(),
            Symbol::State(i) => ("x", i, self.freedoms > 1),
            Symbol::Rate(i) => ("v", i, self.freedoms > 1),
            Symbol::Acceleration(i) => ("a", i, self.freedoms > 1),
            Symbol::Internal(i) => ("z", i, self.internals > 1),
            Symbol::Input(j) => ("u", j, self.inputs > 1),
            Symbol::InputRate(j) => ("du", j, self.inputs > 1),
            Symbol::InputAcceleration(j) => ("ddu", j, self.inputs > 1),
        };
        if several || index > 0 { format!("{stem}{}", index + 1) } else { stem.to_owned() }
    }
}

/// A candidate term in normal form; two terms are equal if they print alike.
#[derive(Clone)]
pub struct Term {
    expression: Expression,
    text: Arc<str>,
}

impl Term {
    /// The term of an expression, brought into normal form.
    pub fn new(expression: Expression) -> Self {
        let expression = expression.normal();
        let text = print::text(&expression, None).into();
        Self { expression, text }
    }

    /// Reads a term as it is printed.
    ///
    /// # Errors
    /// A text that is no term; the error names the column and what was expected there.
    pub fn parse(text: &str) -> Result<Self, TermError> {
        parse::expression(text).map(Self::new)
    }

    /// The term's expression, in normal form.
    pub fn expression(&self) -> &Expression {
        &self.expression
    }

    /// The term's canonical text, in which the first of several keeps its plain name (`x`, `x2`).
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// The term's text with the layout's names (`x1`, `x2` where there are several).
    pub fn text(&self, layout: &Layout) -> String {
        print::text(&self.expression, Some(layout))
    }

    /// The term's text with the layout's names and its numbers to five digits: for reading, not for going on with.
    pub fn summary(&self, layout: &Layout) -> String {
        print::summary(&self.expression, layout)
    }

    /// The term as a person writes it in one line, its numbers to five digits: `x³`, `x²·v`, `sgn v`.
    pub fn pretty(&self, layout: &Layout) -> String {
        print::pretty(&self.expression, layout)
    }

    /// The term as LaTeX mathematics, velocities as dotted displacements.
    pub fn latex(&self, layout: &Layout) -> String {
        print::latex(&self.expression, layout)
    }

    /// The term as a Python expression over `numpy` imported as `np`.
    pub fn python(&self, layout: &Layout) -> String {
        print::python(&self.expression, layout)
    }

    /// Every symbol that the term depends on, without repeats.
    pub fn symbols(&self) -> Vec<Symbol> {
        let mut symbols = Vec::new();
        self.expression.visit(&mut |e| {
            if let Expression::Symbol(s) = e
                && !symbols.contains(s)
            {
                symbols.push(*s);
            }
        });
        symbols
    }

    /// The first symbol that the layout lacks, if any.
    pub fn foreign_symbol(&self, layout: &Layout) -> Option<Symbol> {
        self.symbols().into_iter().find(|s| !layout.has(*s))
    }

    /// True if the term jumps somewhere (contains a sign or step function).
    pub fn switches(&self) -> bool {
        let mut found = false;
        self.expression.visit(&mut |e| {
            found |= matches!(e, Expression::Call(Function::Sgn | Function::Step, _));
        });
        found
    }
}

impl PartialEq for Term {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

impl Eq for Term {}

impl Hash for Term {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.text.hash(state);
    }
}

impl PartialOrd for Term {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Term {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.text.cmp(&other.text)
    }
}

impl fmt::Debug for Term {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Term({})", self.text)
    }
}

impl fmt::Display for Term {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Term {
    type Err = TermError;

    fn from_str(text: &str) -> Result<Self, TermError> {
        Self::parse(text)
    }
}

impl Serialize for Term {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text)
    }
}

impl<'de> Deserialize<'de> for Term {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round(text: &str) -> String {
        Term::parse(text).unwrap().to_string()
    }

    #[test]
    fn terms_print_as_the_interface_writes_them() {
        for text in [
            "1",
            "x",
            "v",
            "u",
            "du",
            "x^3",
            "x*v",
            "x^2*v",
            "v*|v|",
            "sgn(v)",
            "sin(x)",
            "exp(x)",
            "sgn(v-du)",
            "x-u",
            "v1-v2",
            "|x|*sgn(v)",
            "1/x",
            "x/(v*u)",
            "x^0.5",
            "-x",
            "2*x",
            "dz(x,0.001)",
            "clip(x-u,0.5)",
            "(x-u)^3",
            "1e-5*x",
            "(x+1)*sgn(v)",
            "exp(-x)",
            "x-u-1",
        ] {
            assert_eq!(round(text), text.replace("v1-", "v-"), "{text}");
        }
    }

    #[test]
    fn other_ways_of_writing_come_to_the_same_term() {
        for (text, same) in [
            ("v * x * x", "x^2*v"),
            ("x²·v", "x^2*v"),
            ("abs(v)*v", "v*|v|"),
            ("sign(v)", "sgn(v)"),
            ("x**3", "x^3"),
            ("x1", "x"),
            ("|x*|v||", "|x*|v||"),
        ] {
            assert_eq!(Term::parse(text).unwrap(), Term::parse(same).unwrap(), "{text}");
        }
    }

    #[test]
    fn errors_name_the_column() {
        for (text, column) in
            [("x+", 3), ("x+y", 3), ("sgn(v,u)", 1), ("x^v", 3), ("foo(x)", 1), ("", 1), ("x)", 2), ("x/0", 3)]
        {
            let error = Term::parse(text).unwrap_err();
            assert_eq!(error.column, column, "{error}");
        }
    }

    #[test]
    fn lists_split_outside_brackets() {
        let terms = list("x, v; clip(x,0.1), sgn(v)").unwrap();
        let texts: Vec<&str> = terms.iter().map(Term::as_str).collect();
        assert_eq!(texts, ["x", "v", "clip(x,0.1)", "sgn(v)"]);
    }

    #[test]
    fn forms_for_reading() {
        let one = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };
        let two = Layout { kind: Kind::SecondOrder, freedoms: 2, inputs: 1, internals: 0 };
        let term = Term::parse("x^2*|v|").unwrap();
        assert_eq!(term.pretty(&one), "x²·|v|");
        assert_eq!(term.latex(&two), "x_{1}^{2} \\, \\left|\\dot{x}_{1}\\right|");
        assert_eq!(term.python(&one), "x**2*np.abs(v)");
        assert_eq!(term.text(&two), "x1^2*|v1|");
    }

    #[test]
    fn a_program_computes_what_the_tree_computes() {
        let layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };
        let terms = list("1, x^3, x^2*v, v*|v|, dz(x,0.2), clip(v,0.1), max(x,v), min(u,du), sgn(v-du), tanh(x)/u, x^2.5, step(x), x^7, atan(t), a*cos(x), x*ddu").unwrap();
        let expressions: Vec<Expression> = terms.iter().map(|t| t.expression().clone()).collect();
        let program = Program::new(&expressions, &layout);
        let n = 600;
        let wave = |a: f64| (0..n).map(|k| (a * k as f64).sin()).collect::<Vec<f64>>();
        let (x, v, u, du, ddx) = (wave(0.1), wave(0.17), wave(0.31), wave(0.05), wave(0.23));
        let block = SampleBlock {
            start: 2.0,
            interval: 0.1,
            states: &[&x, &v],
            inputs: &[&u],
            input_rates: &[&du],
            accelerations: &[&ddx],
        };
        let neighbours = |k: usize| (k.saturating_sub(1), (k + 1).min(n - 1));
        let ddu: Vec<f64> = (0..n)
            .map(neighbours)
            .map(|(before, after)| (du[after] - du[before]) / (0.1 * (after - before) as f64))
            .collect();
        let mut columns = vec![Vec::new(); terms.len()];
        program.columns(&block, &mut columns);
        for (e, column) in expressions.iter().zip(&columns) {
            for k in 0..n {
                let want = e.value(&|s| match s {
                    Symbol::Time => 2.0 + 0.1 * k as f64,
                    Symbol::State(_) => x[k],
                    Symbol::Rate(_) => v[k],
                    Symbol::Acceleration(_) => ddx[k],
                    Symbol::Input(_) => u[k],
                    Symbol::InputAcceleration(_) => ddu[k],
                    _ => du[k],
                });
                assert!(
                    (want - column[k]).abs() <= 1e-12 * (1.0 + want.abs()) || (want.is_nan() && column[k].is_nan()),
                    "{e:?} {k}: {want} {}",
                    column[k]
                );
            }
        }
    }
}
