//! Expressions written as formulas: `-(x() - u(0)) * 2.0`.

use std::ops::{Add, Mul, Neg, Sub};

use sindyscope_values::term::{Expression, Function, Symbol, Term};

/// An expression that can be added and multiplied.
#[derive(Clone, Debug)]
pub(super) struct E(pub Expression);

/// Displacement of the mass.
pub(super) fn x() -> E {
    state(0)
}

/// Velocity of the mass.
pub(super) fn v() -> E {
    state(1)
}

/// A state of the first-order system.
pub(super) fn state(index: usize) -> E {
    E(Expression::Symbol(Symbol::State(index)))
}

/// An input.
pub(super) fn u(index: usize) -> E {
    E(Expression::Symbol(Symbol::Input(index)))
}

/// An input's first time derivative.
pub(super) fn du(index: usize) -> E {
    E(Expression::Symbol(Symbol::InputRate(index)))
}

/// Time.
pub(super) fn t() -> E {
    E(Expression::Symbol(Symbol::Time))
}

/// A constant.
pub(super) fn number(value: f64) -> E {
    E(Expression::Number(value))
}

/// An expression times a factor; as it stands where that is one.
pub(super) fn times(expression: E, factor: f64) -> E {
    if factor == 1.0 { expression } else { expression * factor }
}

impl E {
    pub(super) fn term(self) -> Term {
        Term::new(self.0)
    }

    pub(super) fn power(self, exponent: f64) -> Self {
        Self(Expression::Power(Box::new(self.0), exponent))
    }

    pub(super) fn call(self, function: Function) -> Self {
        Self(Expression::call(function, self.0))
    }

    pub(super) fn abs(self) -> Self {
        self.call(Function::Abs)
    }

    /// What of it lies above zero.
    pub(super) fn positive(self) -> Self {
        Self(Expression::Call(Function::Max, vec![self.0, Expression::Number(0.0)]))
    }

    /// Held within ± `limit`.
    pub(super) fn clip(self, limit: f64) -> Self {
        Self(Expression::Call(Function::Clip, vec![self.0, Expression::Number(limit)]))
    }

    /// What of it lies outside ± `gap`.
    pub(super) fn dead_zone(self, gap: f64) -> Self {
        Self(Expression::Call(Function::DeadZone, vec![self.0, Expression::Number(gap)]))
    }
}

impl Add for E {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(Expression::Sum(vec![self.0, other.0]))
    }
}

impl Sub for E {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(Expression::Sum(vec![self.0, other.0.negated()]))
    }
}

impl Mul for E {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self(Expression::Product(vec![self.0, other.0]))
    }
}

impl Mul<f64> for E {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        self * number(factor)
    }
}

impl Add<f64> for E {
    type Output = Self;

    fn add(self, value: f64) -> Self {
        self + number(value)
    }
}

impl Neg for E {
    type Output = Self;

    fn neg(self) -> Self {
        Self(self.0.negated())
    }
}
