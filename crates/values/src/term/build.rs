//! Expressions written in code as they stand in a book: `sgn(w) * exp(-(w / v_s).power(2.0))`.

use std::ops::{Add, Mul, Neg, Sub};

use super::{Expression, Function, Symbol};

impl From<f64> for Expression {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<Symbol> for Expression {
    fn from(symbol: Symbol) -> Self {
        Self::Symbol(symbol)
    }
}

impl<T: Into<Self>> Add<T> for Expression {
    type Output = Self;

    fn add(self, other: T) -> Self {
        Self::Sum(vec![self, other.into()])
    }
}

impl<T: Into<Self>> Sub<T> for Expression {
    type Output = Self;

    fn sub(self, other: T) -> Self {
        Self::Sum(vec![self, other.into().negated()])
    }
}

impl<T: Into<Self>> Mul<T> for Expression {
    type Output = Self;

    fn mul(self, other: T) -> Self {
        Self::Product(vec![self, other.into()])
    }
}

impl Neg for Expression {
    type Output = Self;

    fn neg(self) -> Self {
        self.negated()
    }
}

impl Expression {
    /// This expression raised to a fixed power.
    #[must_use]
    pub fn power(self, exponent: f64) -> Self {
        Self::Power(Box::new(self), exponent)
    }

    /// Its sign: −1, 0 or 1.
    #[must_use]
    pub fn sgn(self) -> Self {
        Self::call(Function::Sgn, self)
    }

    /// Its absolute value.
    #[must_use]
    pub fn abs(self) -> Self {
        Self::call(Function::Abs, self)
    }

    /// Its sine.
    #[must_use]
    pub fn sin(self) -> Self {
        Self::call(Function::Sin, self)
    }

    /// Its cosine.
    #[must_use]
    pub fn cos(self) -> Self {
        Self::call(Function::Cos, self)
    }

    /// Its exponential.
    #[must_use]
    pub fn exp(self) -> Self {
        Self::call(Function::Exp, self)
    }

    /// Its natural logarithm.
    #[must_use]
    pub fn log(self) -> Self {
        Self::call(Function::Log, self)
    }

    /// 0 where it is negative, 1 where it is positive.
    #[must_use]
    pub fn step(self) -> Self {
        Self::call(Function::Step, self)
    }

    /// The larger of it and a number.
    #[must_use]
    pub fn max(self, least: f64) -> Self {
        Self::Call(Function::Max, vec![self, Self::Number(least)])
    }

    /// The smaller of it and a number.
    #[must_use]
    pub fn min(self, most: f64) -> Self {
        Self::Call(Function::Min, vec![self, Self::Number(most)])
    }

    /// It, held within ± a limit.
    #[must_use]
    pub fn clip(self, limit: f64) -> Self {
        Self::Call(Function::Clip, vec![self, Self::Number(limit)])
    }

    /// What of it lies outside ± a gap.
    #[must_use]
    pub fn dead_zone(self, gap: f64) -> Self {
        Self::Call(Function::DeadZone, vec![self, Self::Number(gap)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::term::Term;

    #[test]
    fn what_is_built_is_what_is_read() {
        let x = || Expression::from(Symbol::State(0));
        let v = || Expression::from(Symbol::Rate(0));
        let w = || v() - Symbol::InputRate(0);
        let built = [
            (x() * v().abs(), "x*|v|"),
            (w().sgn() * (-(w() * (1.0 / 0.3)).power(2.0)).exp(), "sgn(v-du)*exp(-((v-du)/0.3)^2)"),
            ((x() - 0.2).max(0.0), "max(x-0.2,0)"),
            ((x() + 0.2).min(0.0), "min(x+0.2,0)"),
            (x().dead_zone(0.1), "dz(x,0.1)"),
            (x().clip(0.1), "clip(x,0.1)"),
            ((v().power(2.0) + 1.0).log() * x().step(), "log(v^2+1)*step(x)"),
            (x() * (Expression::from(Symbol::Time) * 6.5).cos(), "x*cos(6.5*t)"),
            (x().sin() + 1.0, "sin(x)+1"),
        ];
        for (expression, text) in built {
            let read = Term::parse(text).unwrap();
            assert_eq!(
                (Term::new(expression.clone()).as_str(), &expression.normal()),
                (read.as_str(), read.expression())
            );
        }
    }
}
