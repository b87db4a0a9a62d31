//! Terms read from text.

use pest::Parser as _;
use pest::error::{ErrorVariant, InputLocation};
use pest::iterators::Pair;

use super::expression::{Expression, Function, Symbol};

#[derive(pest_derive::Parser)]
#[grammar = "term/term.pest"]
struct Grammar;

/// A text that is no term.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} is no term: {problem} (column {column})")]
pub struct TermError {
    /// The text that was read.
    pub text: String,
    /// Column of the problem, in characters from 1.
    pub column: usize,
    /// What is wrong, and what would be right.
    pub problem: String,
}

/// Deepest nesting of parentheses that is read; more is refused before it can exhaust the stack.
const DEEPEST: usize = 64;

pub(super) fn expression(text: &str) -> Result<Expression, TermError> {
    let fail = |byte: usize, problem: String| TermError {
        text: text.to_owned(),
        column: text.get(..byte).map_or(1, |before| before.chars().count() + 1),
        problem,
    };
    if text.trim().is_empty() {
        return Err(fail(0, "it is empty; write for example x^3 or sgn(v)".into()));
    }
    let opened = text.chars().filter(|c| matches!(c, '(' | '|')).count();
    let signs = text.chars().filter(|c| matches!(c, '-' | '+' | '−')).count();
    if opened > DEEPEST || signs > 4 * DEEPEST {
        return Err(fail(0, "it is too deeply nested".into()));
    }
    let mut pairs = Grammar::parse(Rule::term, text).map_err(|error| {
        let byte = match error.location {
            InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
        };
        let problem = match (&error.variant, text[byte..].chars().next()) {
            (ErrorVariant::ParsingError { .. }, Some(found)) => {
                format!("{found:?} is out of place here")
            }
            _ => "it ends too early: a name, a number or a closing bracket is missing".into(),
        };
        fail(byte, problem)
    })?;
    let sum = pairs.next().and_then(|term| term.into_inner().next());
    match sum {
        Some(pair) => build(pair).map_err(|(byte, problem)| fail(byte, problem)),
        None => Err(fail(0, "nothing was read".into())),
    }
}

type Problem = (usize, String);

fn build(pair: Pair<'_, Rule>) -> Result<Expression, Problem> {
    let at = pair.as_span().start();
    match pair.as_rule() {
        Rule::number => number(&pair).map(Expression::Number),
        Rule::name => symbol(pair.as_str())
            .map(Expression::Symbol)
            .or_else(|| (pair.as_str() == "pi").then_some(Expression::Number(std::f64::consts::PI)))
            .ok_or_else(|| (at, unknown_name(pair.as_str()))),
        Rule::bars => inner(pair).map(|argument| Expression::call(Function::Abs, argument)),
        Rule::call => {
            let mut parts = pair.into_inner();
            let name = parts.next().map_or("", |p| p.as_str());
            let function = Function::ALL
                .into_iter()
                .find(|f| {
                    f.name() == name || (name == "sign" && *f == Function::Sgn) || (name == "ln" && *f == Function::Log)
                })
                .ok_or_else(|| {
                    let known: Vec<&str> = Function::ALL.iter().map(|f| f.name()).collect();
                    (at, format!("there is no function {name:?}; known are {}", known.join(", ")))
                })?;
            let arguments = parts.map(build).collect::<Result<Vec<_>, _>>()?;
            if arguments.len() != function.arity() {
                let (want, have) = (function.arity(), arguments.len());
                return Err((
                    at,
                    format!("{name} takes {want} argument{}, not {have}", if want == 1 { "" } else { "s" }),
                ));
            }
            Ok(Expression::Call(function, arguments))
        }
        Rule::primary => inner(pair),
        Rule::power => {
            let mut parts = pair.into_inner();
            let base = parts.next().map_or_else(|| Err((at, "a factor is missing".into())), build)?;
            match parts.next() {
                None => Ok(base),
                Some(exponent) => Ok(Expression::Power(Box::new(base), exponent_value(&exponent)?)),
            }
        }
        Rule::factor => {
            let mut negative = false;
            let mut result = Err((at, "a factor is missing".to_owned()));
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::minus => negative = true,
                    Rule::plus => {}
                    _ => result = build(part),
                }
            }
            result.map(|e| if negative { e.negated() } else { e })
        }
        Rule::product => {
            let mut factors = Vec::new();
            let mut inverse = false;
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::times => inverse = false,
                    Rule::divide => inverse = true,
                    _ => {
                        let at = part.as_span().start();
                        let factor = build(part)?;
                        if inverse && factor.normal() == Expression::Number(0.0) {
                            return Err((at, "this divides by zero".into()));
                        }
                        factors.push(if inverse { Expression::Power(Box::new(factor), -1.0) } else { factor });
                    }
                }
            }
            Ok(Expression::Product(factors))
        }
        Rule::sum => {
            let mut addends = Vec::new();
            let mut negative = false;
            for part in pair.into_inner() {
                match part.as_rule() {
                    Rule::plus => negative = false,
                    Rule::minus => negative = true,
                    _ => {
                        let addend = build(part)?;
                        addends.push(if negative { addend.negated() } else { addend });
                    }
                }
            }
            Ok(Expression::Sum(addends))
        }
        _ => Err((at, "this cannot stand here".into())),
    }
}

fn inner(pair: Pair<'_, Rule>) -> Result<Expression, Problem> {
    let at = pair.as_span().start();
    pair.into_inner().next().map_or_else(|| Err((at, "something is missing here".into())), build)
}

fn number(pair: &Pair<'_, Rule>) -> Result<f64, Problem> {
    let at = pair.as_span().start();
    match pair.as_str().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err((at, format!("{} is no number that can be computed with", pair.as_str()))),
    }
}

fn exponent_value(pair: &Pair<'_, Rule>) -> Result<f64, Problem> {
    if pair.as_rule() == Rule::superscript {
        let digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
        let plain: String =
            pair.as_str().chars().filter_map(|c| digits.chars().position(|d| d == c)).map(|d| d.to_string()).collect();
        return plain.parse().map_err(|_| (pair.as_span().start(), "the exponent must be a number".into()));
    }
    let mut value = 1.0;
    let mut seen = 0;
    for part in pair.clone().into_inner() {
        match part.as_rule() {
            Rule::sign => value = if part.as_str() == "+" { value } else { -value },
            _ => {
                let n = number(&part)?;
                value = if seen == 0 { value * n } else { value / n };
                seen += 1;
            }
        }
    }
    if f64::is_finite(value) {
        Ok(value)
    } else {
        Err((pair.as_span().start(), "the exponent must be a number".into()))
    }
}

/// The symbol of a name: `x`, `x1`, `v2`, `u`, `du1`, `ddu`, `t`.
pub(super) fn symbol(name: &str) -> Option<Symbol> {
    if name == "t" {
        return Some(Symbol::Time);
    }
    let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let index = match &name[stem.len()..] {
        "" => 0,
        digits => digits.parse::<usize>().ok().filter(|n| (1..=64).contains(n))? - 1,
    };
    match stem {
        "x" => Some(Symbol::State(index)),
        "v" => Some(Symbol::Rate(index)),
        "a" => Some(Symbol::Acceleration(index)),
        "z" => Some(Symbol::Internal(index)),
        "u" => Some(Symbol::Input(index)),
        "du" => Some(Symbol::InputRate(index)),
        "ddu" => Some(Symbol::InputAcceleration(index)),
        _ => None,
    }
}

fn unknown_name(name: &str) -> String {
    if Function::ALL.iter().any(|f| f.name() == name) {
        format!("{name} is a function: write {name}(x)")
    } else {
        format!(
            "there is no quantity {name:?}; known are x, v, a, u, du, ddu (numbered where there are several: x1, x2) and t"
        )
    }
}
