//! The tree of a term, its normal form and its value.

use std::cmp::Ordering;

/// A quantity that a term may depend on; indices count from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Symbol {
    /// Time, s.
    Time,
    /// Displacement of a degree of freedom, or a state of a first-order system: `x`.
    State(usize),
    /// Velocity of a degree of freedom: `v`.
    Rate(usize),
    /// Acceleration of a degree of freedom: `a`.
    Acceleration(usize),
    /// A state that is not measured: `z`.
    Internal(usize),
    /// Force or base displacement: `u`.
    Input(usize),
    /// First time derivative of an input: `du`.
    InputRate(usize),
    /// Second time derivative of an input: `ddu`.
    InputAcceleration(usize),
}

/// A named function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Function {
    /// Sign: −1, 0 or 1.
    Sgn,
    /// Absolute value, printed with bars.
    Abs,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Exponential.
    Exp,
    /// Natural logarithm.
    Log,
    /// Square root.
    Sqrt,
    /// Hyperbolic tangent.
    Tanh,
    /// Arc tangent.
    Atan,
    /// Unit step: 0 below zero, 1 above.
    Step,
    /// `max(a,b)`.
    Max,
    /// `min(a,b)`.
    Min,
    /// `clip(a,d)`: `a` held within ±`d`.
    Clip,
    /// `dz(a,d)`: dead zone, what of `a` lies outside ±`d` (a gap to side springs).
    DeadZone,
}

impl Function {
    /// Every function.
    pub const ALL: [Self; 15] = [
        Self::Sgn,
        Self::Abs,
        Self::Sin,
        Self::Cos,
        Self::Tan,
        Self::Exp,
        Self::Log,
        Self::Sqrt,
        Self::Tanh,
        Self::Atan,
        Self::Step,
        Self::Max,
        Self::Min,
        Self::Clip,
        Self::DeadZone,
    ];

    /// The name it is typed and printed with.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sgn => "sgn",
            Self::Abs => "abs",
            Self::Sin => "sin",
            Self::Cos => "cos",
            Self::Tan => "tan",
            Self::Exp => "exp",
            Self::Log => "log",
            Self::Sqrt => "sqrt",
            Self::Tanh => "tanh",
            Self::Atan => "atan",
            Self::Step => "step",
            Self::Max => "max",
            Self::Min => "min",
            Self::Clip => "clip",
            Self::DeadZone => "dz",
        }
    }

    /// Number of arguments.
    pub fn arity(self) -> usize {
        match self {
            Self::Max | Self::Min | Self::Clip | Self::DeadZone => 2,
            _ => 1,
        }
    }

    /// Its value; `arguments` holds as many as [`Self::arity`] says.
    #[inline]
    pub fn value(self, arguments: &[f64]) -> f64 {
        let a = arguments[0];
        match self {
            Self::Sgn => sign(a),
            Self::Abs => a.abs(),
            Self::Sin => a.sin(),
            Self::Cos => a.cos(),
            Self::Tan => a.tan(),
            Self::Exp => a.exp(),
            Self::Log => a.ln(),
            Self::Sqrt => a.sqrt(),
            Self::Tanh => a.tanh(),
            Self::Atan => a.atan(),
            Self::Step => 0.5 * (1.0 + sign(a)),
            Self::Max => a.max(arguments[1]),
            Self::Min => a.min(arguments[1]),
            Self::Clip => clip(a, arguments[1]),
            Self::DeadZone => a - clip(a, arguments[1]),
        }
    }
}

/// `a` held within ±`d`; `clamp` would panic on a bound that is no number.
fn clip(a: f64, d: f64) -> f64 {
    a.max(-d.abs()).min(d.abs())
}

/// The sign of a number: −1, 0 or 1; 0 of a NaN.
#[inline]
pub fn sign(a: f64) -> f64 {
    if a > 0.0 {
        1.0
    } else if a < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// A term's tree. [`Expression::normal`] brings equal ones to one form.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    /// A number.
    Number(f64),
    /// A measured or derived quantity.
    Symbol(Symbol),
    /// Sum of all parts.
    Sum(Vec<Self>),
    /// Product of all parts.
    Product(Vec<Self>),
    /// A part raised to a fixed power.
    Power(Box<Self>, f64),
    /// A function of its arguments.
    Call(Function, Vec<Self>),
}

impl Expression {
    /// A function of one argument.
    pub fn call(function: Function, argument: Self) -> Self {
        Self::Call(function, vec![argument])
    }

    /// The number in front of an expression, and the rest of it; of a number, one.
    pub fn apart(&self) -> (f64, Self) {
        let Self::Product(factors) = self else {
            return match self {
                Self::Number(n) => (*n, Self::Number(1.0)),
                other => (1.0, other.clone()),
            };
        };
        let number = |e: &Self| if let Self::Number(n) = e { Some(*n) } else { None };
        let rest: Vec<Self> = factors.iter().filter(|e| number(e).is_none()).cloned().collect();
        (factors.iter().filter_map(number).product(), Self::Product(rest))
    }

    /// This expression times −1.
    pub fn negated(self) -> Self {
        Self::Product(vec![Self::Number(-1.0), self])
    }

    /// Calls `see` on this expression and every one below it.
    pub fn visit(&self, see: &mut impl FnMut(&Self)) {
        see(self);
        match self {
            Self::Number(_) | Self::Symbol(_) => {}
            Self::Sum(parts) | Self::Product(parts) | Self::Call(_, parts) => parts.iter().for_each(|p| p.visit(see)),
            Self::Power(base, _) => base.visit(see),
        }
    }

    /// This expression with some symbols replaced: `by` gives what stands for one, none where it stays.
    pub fn replaced(&self, by: &dyn Fn(Symbol) -> Option<Self>) -> Self {
        let all = |parts: &[Self]| parts.iter().map(|p| p.replaced(by)).collect();
        match self {
            Self::Number(n) => Self::Number(*n),
            Self::Symbol(s) => by(*s).unwrap_or_else(|| self.clone()),
            Self::Sum(parts) => Self::Sum(all(parts)),
            Self::Product(parts) => Self::Product(all(parts)),
            Self::Power(base, n) => Self::Power(Box::new(base.replaced(by)), *n),
            Self::Call(f, parts) => Self::Call(*f, all(parts)),
        }
    }

    /// The value, given that of each symbol.
    pub fn value(&self, symbol: &impl Fn(Symbol) -> f64) -> f64 {
        match self {
            Self::Number(n) => *n,
            Self::Symbol(s) => symbol(*s),
            Self::Sum(parts) => parts.iter().map(|p| p.value(symbol)).sum(),
            Self::Product(parts) => parts.iter().map(|p| p.value(symbol)).product(),
            Self::Power(base, exponent) => power(base.value(symbol), *exponent),
            Self::Call(function, parts) => {
                let mut arguments = [0.0; 2];
                for (slot, part) in arguments.iter_mut().zip(parts) {
                    *slot = part.value(symbol);
                }
                function.value(&arguments[..function.arity()])
            }
        }
    }

    /// The normal form: sums and products flat, numbers folded, equal factors as powers, factors in order.
    #[must_use]
    pub fn normal(&self) -> Self {
        match self {
            Self::Number(_) | Self::Symbol(_) => self.clone(),
            Self::Sum(parts) => sum(parts.iter().map(Self::normal)),
            Self::Product(parts) => product(parts.iter().map(Self::normal)),
            Self::Power(base, exponent) => raise(base.normal(), *exponent),
            Self::Call(function, parts) => call(*function, parts.iter().map(Self::normal).collect()),
        }
    }

    /// The number in front and what it multiplies.
    fn split_coefficient(self) -> (f64, Self) {
        match self {
            Self::Number(n) => (n, Self::Number(1.0)),
            Self::Product(mut parts) => match parts.first() {
                Some(Self::Number(n)) => {
                    let n = *n;
                    parts.remove(0);
                    let rest = match parts.len() {
                        1 => parts.remove(0),
                        _ => Self::Product(parts),
                    };
                    (n, rest)
                }
                _ => (1.0, Self::Product(parts)),
            },
            other => (1.0, other),
        }
    }
}

/// A power; whole exponents by repeated multiplication.
pub(super) fn power(base: f64, exponent: f64) -> f64 {
    match whole(exponent) {
        Some(whole) => base.powi(whole),
        None => base.powf(exponent),
    }
}

/// An exponent as a whole number, where it is one that is multiplied out.
pub(super) fn whole(exponent: f64) -> Option<i32> {
    #[expect(clippy::cast_possible_truncation, reason = "a whole number up to 64")]
    (exponent.fract() == 0.0 && exponent.abs() <= 64.0).then_some(exponent as i32)
}

fn sum(parts: impl Iterator<Item = Expression>) -> Expression {
    let mut constant = 0.0;
    let mut addends: Vec<(f64, Expression)> = Vec::new();
    let mut add = |part: Expression| {
        let (factor, rest) = part.split_coefficient();
        if rest == Expression::Number(1.0) {
            constant += factor;
        } else if let Some(known) = addends.iter_mut().find(|(_, r)| *r == rest) {
            known.0 += factor;
        } else {
            addends.push((factor, rest));
        }
    };
    for part in parts {
        match part {
            Expression::Sum(inner) => inner.into_iter().for_each(&mut add),
            other => add(other),
        }
    }
    let mut parts: Vec<Expression> = addends
        .into_iter()
        .filter(|(factor, _)| *factor != 0.0)
        .map(|(factor, rest)| product([Expression::Number(factor), rest].into_iter()))
        .collect();
    if constant != 0.0 || parts.is_empty() {
        parts.push(Expression::Number(constant));
    }
    if parts.len() == 1 { parts.remove(0) } else { Expression::Sum(parts) }
}

fn product(parts: impl Iterator<Item = Expression>) -> Expression {
    let mut number = 1.0;
    let mut factors: Vec<(Expression, f64)> = Vec::new();
    let mut pending: Vec<Expression> = parts.collect();
    pending.reverse();
    while let Some(part) = pending.pop() {
        let (base, exponent) = match part {
            Expression::Number(n) => {
                number *= n;
                continue;
            }
            Expression::Product(inner) => {
                pending.extend(inner.into_iter().rev());
                continue;
            }
            Expression::Power(base, exponent) => (*base, exponent),
            other => (other, 1.0),
        };
        match factors.iter_mut().find(|(known, _)| *known == base) {
            Some((_, e)) => *e += exponent,
            None => factors.push((base, exponent)),
        }
    }
    if number == 0.0 {
        return Expression::Number(0.0);
    }
    let mut parts: Vec<Expression> = factors
        .into_iter()
        .filter(|(_, exponent)| *exponent != 0.0)
        .map(|(base, exponent)| raise(base, exponent))
        .collect();
    parts.sort_by(order);
    if number != 1.0 || parts.is_empty() {
        parts.insert(0, Expression::Number(number));
    }
    if parts.len() == 1 { parts.remove(0) } else { Expression::Product(parts) }
}

/// A power of a normal base, in normal form.
fn raise(base: Expression, exponent: f64) -> Expression {
    let whole = exponent.fract() == 0.0;
    match base {
        _ if exponent == 0.0 => Expression::Number(1.0),
        base if exponent == 1.0 => base,
        Expression::Number(n) if power(n, exponent).is_finite() => Expression::Number(power(n, exponent)),
        Expression::Power(inner, e) if whole && e.fract() == 0.0 || exponent == -1.0 => raise(*inner, e * exponent),
        Expression::Product(parts) if whole => product(parts.into_iter().map(|p| raise(p, exponent))),
        base => Expression::Power(Box::new(base), exponent),
    }
}

fn call(function: Function, arguments: Vec<Expression>) -> Expression {
    let numbers: Option<Vec<f64>> =
        arguments.iter().map(|a| if let Expression::Number(n) = a { Some(*n) } else { None }).collect();
    match numbers {
        Some(numbers) if function.value(&numbers).is_finite() => Expression::Number(function.value(&numbers)),
        _ => Expression::Call(function, arguments),
    }
}

/// The order of factors: numbers, symbols and their powers, sums, functions.
fn order(a: &Expression, b: &Expression) -> Ordering {
    fn class(e: &Expression) -> (u8, Option<Symbol>) {
        match e {
            Expression::Number(_) => (0, None),
            Expression::Symbol(s) => (1, Some(*s)),
            Expression::Power(base, exponent) => match class(base) {
                (1, s) if *exponent > 0.0 => (1, s),
                (1, s) => (5, s),
                (n, s) => (n, s),
            },
            Expression::Sum(_) | Expression::Product(_) => (2, None),
            Expression::Call(Function::Sgn, _) => (4, None),
            Expression::Call(..) => (3, None),
        }
    }
    class(a).cmp(&class(b)).then_with(|| super::print::text(a, None).cmp(&super::print::text(b, None)))
}
