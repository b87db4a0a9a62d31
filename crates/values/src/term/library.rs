//! Families of candidate terms.

use super::expression::{Expression, Function, Symbol};
use super::{Kind, Layout, Term};

/// A family of candidate terms that a library can include at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TermFamily {
    /// The constant 1.
    Constant,
    /// Each state and rate: `x`, `v`.
    States,
    /// Each input: `u`.
    Inputs,
    /// Each input's derivative: `du`.
    InputRates,
    /// Relative motion across the joint: `x-u`, `v-du`.
    Relative,
    /// A function of each symbol of states, rates, inputs and their derivatives: `sgn(x)`, `sgn(v)`, `sgn(u)`, `sgn(du)`.
    Of(Function),
    /// Quadratic damping: `v*|v|`.
    QuadraticDamping,
}

impl TermFamily {
    /// The family's terms in a layout.
    pub fn terms(self, layout: &Layout) -> Vec<Term> {
        let states: Vec<Symbol> = layout.state_symbols().collect();
        let inputs: Vec<Symbol> = (0..layout.inputs).map(Symbol::Input).collect();
        let rates: Vec<Symbol> = (0..layout.inputs).map(Symbol::InputRate).collect();
        let plain = |symbols: &[Symbol]| symbols.iter().map(|s| Term::new(Expression::Symbol(*s))).collect();
        match self {
            Self::Constant => vec![Term::new(Expression::Number(1.0))],
            Self::States => plain(&states),
            Self::Inputs => plain(&inputs),
            Self::InputRates => plain(&rates),
            Self::Relative => states
                .iter()
                .flat_map(|s| {
                    let across = match s {
                        Symbol::Rate(_) => &rates,
                        _ => &inputs,
                    };
                    across.iter().map(|u| {
                        Term::new(Expression::Sum(vec![Expression::Symbol(*s), Expression::Symbol(*u).negated()]))
                    })
                })
                .collect(),
            Self::Of(function) => states
                .iter()
                .chain(&inputs)
                .chain(&rates)
                .map(|s| Term::new(Expression::call(function, Expression::Symbol(*s))))
                .collect(),
            Self::QuadraticDamping => states
                .iter()
                .filter(|s| layout.kind == Kind::FirstOrder || matches!(s, Symbol::Rate(_)))
                .map(|s| {
                    let v = Expression::Symbol(*s);
                    Term::new(Expression::Product(vec![v.clone(), Expression::call(Function::Abs, v)]))
                })
                .collect(),
        }
    }
}

/// Monomials of the symbols up to a degree, lowest degree first; without `cross` only powers of one symbol.
pub fn polynomials(symbols: &[Symbol], degree: usize, cross: bool) -> Vec<Term> {
    let mut terms = Vec::new();
    for total in 1..=degree {
        if cross {
            let mut exponents = vec![0; symbols.len()];
            monomials(symbols, 0, total, &mut exponents, &mut terms);
        } else {
            for s in symbols {
                terms.push(Term::new(Expression::Power(Box::new(Expression::Symbol(*s)), total as f64)));
            }
        }
    }
    terms
}

fn monomials(symbols: &[Symbol], from: usize, left: usize, exponents: &mut [usize], terms: &mut Vec<Term>) {
    if from + 1 >= symbols.len() {
        if let Some(last) = exponents.last_mut() {
            *last = left;
            terms.push(Term::new(Expression::Product(
                symbols
                    .iter()
                    .zip(exponents.iter())
                    .map(|(s, e)| Expression::Power(Box::new(Expression::Symbol(*s)), *e as f64))
                    .collect(),
            )));
        }
        return;
    }
    for e in (0..=left).rev() {
        exponents[from] = e;
        monomials(symbols, from + 1, left - e, exponents, terms);
    }
    exponents[from] = 0;
}
