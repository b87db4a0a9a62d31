//! Derivatives of terms, and terms with fewer functions.

use super::Layout;
use super::expression::{Expression, Function, Symbol};

/// The partial derivative of an expression; jumps have derivative zero, kinks that of the side they are on.
pub fn derivative(e: &Expression, by: Symbol) -> Expression {
    raw(e, by).normal()
}

fn raw(e: &Expression, by: Symbol) -> Expression {
    let zero = || Expression::Number(0.0);
    match e {
        Expression::Number(_) => zero(),
        Expression::Symbol(s) => Expression::Number(if *s == by { 1.0 } else { 0.0 }),
        Expression::Sum(parts) => Expression::Sum(parts.iter().map(|p| raw(p, by)).collect()),
        Expression::Product(parts) => Expression::Sum(
            (0..parts.len())
                .map(|k| {
                    let mut factors = parts.clone();
                    factors[k] = raw(&parts[k], by);
                    Expression::Product(factors)
                })
                .collect(),
        ),
        Expression::Power(base, n) => {
            Expression::Product(vec![Expression::Number(*n), Expression::Power(base.clone(), n - 1.0), raw(base, by)])
        }
        Expression::Call(function, arguments) => {
            if let Some(plain) = without_bounds(*function, arguments) {
                return raw(&plain, by);
            }
            let a = arguments[0].clone();
            let call = |f: Function| Expression::call(f, a.clone());
            let outer = match function {
                Function::Abs => call(Function::Sgn),
                Function::Sin => call(Function::Cos),
                Function::Cos => call(Function::Sin).negated(),
                Function::Tan => Expression::Power(Box::new(call(Function::Cos)), -2.0),
                Function::Exp => call(Function::Exp),
                Function::Log => Expression::Power(Box::new(a.clone()), -1.0),
                Function::Sqrt => {
                    Expression::Product(vec![Expression::Number(0.5), Expression::Power(Box::new(a.clone()), -0.5)])
                }
                Function::Tanh => Expression::Sum(vec![
                    Expression::Number(1.0),
                    Expression::Power(Box::new(call(Function::Tanh)), 2.0).negated(),
                ]),
                Function::Atan => Expression::Power(
                    Box::new(Expression::Sum(vec![
                        Expression::Number(1.0),
                        Expression::Power(Box::new(a.clone()), 2.0),
                    ])),
                    -1.0,
                ),
                _ => return zero(),
            };
            Expression::Product(vec![outer, raw(&a, by)])
        }
    }
}

/// Time derivative at fixed states; the third derivative of an input counts as zero.
pub fn drift(e: &Expression, layout: &Layout) -> Expression {
    let mut parts = vec![derivative(e, Symbol::Time)];
    for j in 0..layout.inputs {
        let pairs = [(Symbol::Input(j), Symbol::InputRate(j)), (Symbol::InputRate(j), Symbol::InputAcceleration(j))];
        for (by, rate) in pairs {
            parts.push(Expression::Product(vec![derivative(e, by), Expression::Symbol(rate)]));
        }
    }
    Expression::Sum(parts).normal()
}

/// An expression of the same value in which `max`, `min`, `clip`, `dz` and `step` are written with `|·|` and `sgn` alone, at
/// every depth.
pub fn in_signs(e: &Expression) -> Expression {
    fn rewritten(e: &Expression) -> Expression {
        let each = |parts: &[Expression]| parts.iter().map(rewritten).collect();
        match e {
            Expression::Number(_) | Expression::Symbol(_) => e.clone(),
            Expression::Sum(parts) => Expression::Sum(each(parts)),
            Expression::Product(parts) => Expression::Product(each(parts)),
            Expression::Power(base, exponent) => Expression::Power(Box::new(rewritten(base)), *exponent),
            Expression::Call(function, arguments) => match without_bounds(*function, arguments) {
                Some(plain) => rewritten(&plain),
                None => Expression::Call(*function, each(arguments)),
            },
        }
    }
    rewritten(&e.normal()).normal()
}

/// `max`, `min`, `clip`, `dz` and `step` written with `|·|` and `sgn` alone, so that one mechanism switches them all.
pub(super) fn without_bounds(function: Function, arguments: &[Expression]) -> Option<Expression> {
    let half = |parts: Vec<Expression>| Expression::Product(vec![Expression::Number(0.5), Expression::Sum(parts)]);
    let abs = |e: Expression| Expression::call(Function::Abs, e);
    let plus = |a: &Expression, b: &Expression| Expression::Sum(vec![a.clone(), b.clone()]);
    let less = |a: &Expression, b: &Expression| Expression::Sum(vec![a.clone(), b.clone().negated()]);
    match (function, arguments) {
        (Function::Step, [a]) => Some(half(vec![Expression::Number(1.0), Expression::call(Function::Sgn, a.clone())])),
        (Function::Max, [a, b]) => Some(half(vec![a.clone(), b.clone(), abs(less(a, b))])),
        (Function::Min, [a, b]) => Some(half(vec![a.clone(), b.clone(), abs(less(a, b)).negated()])),
        (Function::Clip | Function::DeadZone, [a, d]) => {
            let d = abs(d.clone()).normal();
            let clip = half(vec![abs(plus(a, &d)), abs(less(a, &d)).negated()]);
            Some(if function == Function::Clip { clip } else { less(a, &clip) })
        }
        _ => None,
    }
}
