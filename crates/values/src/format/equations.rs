//! Equations of motion as text for a terminal, LaTeX for a paper and Python for another program.

use std::fmt::Write;

use super::number::{align_at_point, format_measured};
use crate::model::{Equation, Model, Units, WeightedTerm, kinematic};
use crate::term::{Expression, Kind, Layout, Symbol, Term, integral, latex_number};

/// True if this is the known `dx/dt = v` of a second-order model, and so says nothing that was identified.
pub fn is_kinematic(model: &Model, state: Symbol, equation: &Equation) -> bool {
    matches!((model.layout.kind, state), (Kind::SecondOrder, Symbol::State(i)) if *equation == kinematic(i))
}

/// The terms of an equation, largest share of the rate first.
pub fn by_share(equation: &Equation) -> Vec<&WeightedTerm> {
    let mut terms: Vec<_> = equation.terms.iter().collect();
    terms.sort_by(|a, b| b.share.total_cmp(&a.share));
    terms
}

/// One line a term: coefficient ± standard error, decimal points below each other, then the term as it is typed, its share
/// of the rate, and the coefficient's unit where it is known and the coefficient no plain number.
pub fn text(model: &Model, units: Option<&Units>) -> String {
    let mut out = String::new();
    for (state, equation) in model.iter() {
        let name = model.layout.name(state);
        if is_kinematic(model, state, equation) {
            let _ = writeln!(out, "d{name}/dt = {}", equation.terms[0].term.summary(&model.layout));
        } else {
            let units = |term: &Term| units.and_then(|u| u.coefficient(state, term));
            out.push_str(&lines(&format!("d{name}/dt"), "", equation, |t| t.summary(&model.layout), units));
        }
    }
    out
}

/// The equations integrated once over time, each with the constant that a record begins with: of second order `dx/dt = …` with `x` and `int(x)` for what stands with `v` and `x` in `dv/dt = …`.
pub fn integral_text(model: &Model, units: Option<&Units>) -> String {
    let mut out = String::new();
    for (state, equation) in model.iter().filter(|(state, equation)| !is_kinematic(model, *state, equation)) {
        let left = integrated_state(model, state);
        let units = |term: &Term| units.and_then(|u| u.coefficient(state, term));
        out.push_str(&lines(&left, "constant", equation, |t| integral(t, &model.layout), units));
    }
    out
}

/// What stands on the left of an equation that is integrated once over time: of second order `dx/dt`.
pub fn integrated_state(model: &Model, state: Symbol) -> String {
    match (model.layout.kind, state) {
        (Kind::SecondOrder, Symbol::Rate(i)) => format!("d{}/dt", model.layout.name(Symbol::State(i))),
        _ => model.layout.name(state),
    }
}

/// A sum of terms that is no rate of a state, a line a term: `F = …`.
pub fn sum(left: &str, equation: &Equation, layout: &Layout, unit: impl Fn(&Term) -> Option<String>) -> String {
    lines(left, "", equation, |t| t.summary(layout), unit)
}

/// One equation, a line a term, after its left side and what the right side begins with.
fn lines(
    left: &str,
    first: &str,
    equation: &Equation,
    text: impl Fn(&Term) -> String,
    unit: impl Fn(&Term) -> Option<String>,
) -> String {
    if equation.terms.is_empty() {
        return format!("{left} = {}\n", if first.is_empty() { "0" } else { first });
    }
    let mut out = if first.is_empty() { format!("{left} =\n") } else { format!("{left} = {first} +\n") };
    let terms = by_share(equation);
    let numbers: Vec<String> = terms.iter().map(|t| format_measured(t.coefficient, t.std_error)).collect();
    let texts: Vec<String> = terms.iter().map(|t| text(&t.term)).collect();
    let width = texts.iter().map(|t| t.chars().count()).max().unwrap_or(0);
    for ((number, text), term) in align_at_point(&numbers).iter().zip(&texts).zip(&terms) {
        let number = number.replace('−', "-");
        let _ = write!(out, "  {number}  {text:<width$}");
        if term.share > 0.0 {
            let _ = write!(out, "  {:5.1} %", 100.0 * term.share);
        }
        if let Some(unit) = unit(&term.term).filter(|u| u != "1") {
            let _ = write!(out, "  {unit}");
        }
        let end = out.trim_end_matches(' ').len();
        out.truncate(end);
        out.push('\n');
    }
    out
}

/// The `aligned` equations of motion, to be put into a display; coefficients as long as their standard error allows.
pub fn latex(model: &Model) -> String {
    let layout = &model.layout;
    let lines: Vec<String> = model
        .iter()
        .filter(|(state, equation)| !is_kinematic(model, *state, equation))
        .map(|(state, equation)| format!("{} &={}", latex_rate(model, state), latex_sum(equation, layout)))
        .collect();
    format!("\\begin{{aligned}}\n{}\n\\end{{aligned}}\n", lines.join(" \\\\\n"))
}

/// The right side of an equation in LaTeX, the largest part first, coefficients as long as their standard error allows.
pub fn latex_sum(equation: &Equation, layout: &Layout) -> String {
    let mut line = String::new();
    for (k, term) in by_share(equation).into_iter().enumerate() {
        let sign = match (term.coefficient < 0.0, k) {
            (true, _) => " -",
            (false, 0) => " ",
            (false, _) => " +",
        };
        let digits = digits(term.coefficient.abs(), term.std_error);
        let number = latex_number(&short_number(term.coefficient.abs(), digits));
        let text = term.term.latex(layout);
        let text = if needs_brackets(term, &text) { format!("\\left({text}\\right)") } else { text };
        let _ = match text.as_str() {
            "1" => write!(line, "{sign}{number}"),
            t => write!(line, "{sign}{number} \\, {t}"),
        };
    }
    if line.is_empty() { " 0".into() } else { line }
}

fn latex_rate(model: &Model, state: Symbol) -> String {
    let layout = &model.layout;
    let index = |i: usize| if layout.freedoms > 1 || i > 0 { format!("_{{{}}}", i + 1) } else { String::new() };
    match (layout.kind, state) {
        (Kind::SecondOrder, Symbol::Rate(i)) => format!("\\ddot{{x}}{}", index(i)),
        // Velocities are written as dotted displacements, so a fitted dx/dt needs another left side.
        (Kind::SecondOrder, Symbol::State(i)) => format!("\\frac{{\\mathrm{{d}}}}{{\\mathrm{{d}}t}} x{}", index(i)),
        (_, Symbol::State(i)) => format!("\\dot{{x}}{}", index(i)),
        (_, Symbol::Internal(i)) if layout.internals > 1 => format!("\\dot{{z}}_{{{}}}", i + 1),
        (_, Symbol::Internal(_)) => "\\dot{z}".into(),
        _ => layout.name(state),
    }
}

/// The right side of an equation in Python, coefficients in full.
pub fn python_sum(equation: &Equation, layout: &Layout) -> String {
    let mut line = String::new();
    for (k, term) in equation.terms.iter().enumerate() {
        let sign = match (term.coefficient < 0.0, k) {
            (true, 0) => "-",
            (true, _) => " - ",
            (false, 0) => "",
            (false, _) => " + ",
        };
        let number = term.coefficient.abs();
        let text = term.term.python(layout);
        let text = if needs_brackets(term, &text) { format!("({text})") } else { text };
        let _ = match text.as_str() {
            "1" => write!(line, "{sign}{number:?}"),
            text if number == 1.0 => write!(line, "{sign}{text}"),
            text => write!(line, "{sign}{number:?}*{text}"),
        };
    }
    if line.is_empty() { "0.0".into() } else { line }
}

/// A Python function of time, state and inputs, as `scipy.integrate.solve_ivp` takes it; coefficients in full.
pub fn python(model: &Model) -> String {
    let layout = &model.layout;
    let states: Vec<String> = layout.state_symbols().map(|s| layout.name(s)).collect();
    let comma = if states.len() == 1 { "," } else { "" };
    let mut used: Vec<Symbol> = model.equations.iter().flat_map(|e| &e.terms).flat_map(|t| t.term.symbols()).collect();
    used.sort_unstable();
    used.dedup();
    let inputs: Vec<String> = used
        .iter()
        .filter(|s| matches!(s, Symbol::Input(_) | Symbol::InputRate(_) | Symbol::InputAcceleration(_)))
        .map(|s| layout.name(*s))
        .collect();
    let mut out = String::from("import numpy as np\n\n\n");
    if inputs.is_empty() {
        let _ = writeln!(out, "def rate(t, state):");
        let _ = writeln!(out, "    \"\"\"Time derivative of the state ({}).\"\"\"", states.join(", "));
    } else {
        let _ = writeln!(out, "def rate(t, state, inputs):");
        let _ = writeln!(
            out,
            "    \"\"\"Time derivative of the state ({}); inputs(t) returns ({}).\"\"\"",
            states.join(", "),
            inputs.join(", ")
        );
    }
    let _ = writeln!(out, "    {}{comma} = state", states.join(", "));
    if !inputs.is_empty() {
        let comma = if inputs.len() == 1 { "," } else { "" };
        let _ = writeln!(out, "    {}{comma} = inputs(t)", inputs.join(", "));
    }
    let _ = writeln!(out, "    return np.array([");
    for equation in &model.equations {
        let _ = writeln!(out, "        {},", python_sum(equation, layout));
    }
    out.push_str("    ])\n");
    out
}

/// True if the term, written as `text`, needs brackets behind its coefficient.
fn needs_brackets(term: &WeightedTerm, text: &str) -> bool {
    matches!(term.term.expression(), Expression::Sum(_)) || text.starts_with('-')
}

/// Significant digits that a standard error leaves a value: two uncertain ones; five where no error is known.
pub fn digits(value: f64, std_error: Option<f64>) -> usize {
    match std_error.filter(|e| e.is_finite() && *e > 0.0) {
        Some(error) if value != 0.0 => {
            (value.abs().log10().floor() - error.log10().floor() + 2.0).clamp(1.0, 15.0) as usize
        }
        Some(_) => 1,
        None => 5,
    }
}

/// A number with at most `digits` significant digits, in the notation that takes less room and reads back: `358.71`, `1.2e-7`.
fn short_number(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{:.*e}", digits.saturating_sub(1), value).parse().unwrap_or(value);
    let magnitude = rounded.abs();
    if magnitude != 0.0 && !(1e-4..1e7).contains(&magnitude) { format!("{rounded:e}") } else { format!("{rounded}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::term::Term;

    fn friction() -> Model {
        let term = |text: &str, coefficient, std_error, share| WeightedTerm {
            term: Term::parse(text).expect("a term"),
            coefficient,
            std_error: Some(std_error),
            share,
        };
        let acceleration = Equation {
            terms: vec![
                term("v", -0.0704, 0.0113, 0.004),
                term("x", -358.612, 0.21, 0.5),
                term("sgn(v)", -0.0851, 0.0009, 0.1),
                term("u", 358.5, 0.3, 0.396),
            ],
        };
        Model::second_order(1, vec![acceleration])
    }

    #[test]
    fn text_is_aligned_and_sorted_by_share() {
        let expected = "\
dx/dt = v
dv/dt =
  -358.6    ± 0.2     x        50.0 %
   358.5    ± 0.3     u        39.6 %
    -0.0851 ± 0.0009  sgn(v)   10.0 %
    -0.07   ± 0.01    v         0.4 %
";
        assert_eq!(text(&friction(), None), expected);
    }

    #[test]
    fn latex_leaves_the_known_kinematics_out() {
        let expected = "\\begin{aligned}\n\\ddot{x} &= -358.61 \\, x +358.5 \\, u -0.0851 \\, \
            \\operatorname{sgn}\\left(\\dot{x}\\right) -0.07 \\, \\dot{x}\n\\end{aligned}\n";
        assert_eq!(latex(&friction()), expected);
    }

    #[test]
    fn python_is_a_function_for_an_integrator() {
        let expected = "\
import numpy as np


def rate(t, state, inputs):
    \"\"\"Time derivative of the state (x, v); inputs(t) returns (u).\"\"\"
    x, v = state
    u, = inputs(t)
    return np.array([
        v,
        -0.0704*v - 358.612*x - 0.0851*np.sign(v) + 358.5*u,
    ])
";
        assert_eq!(python(&friction()), expected);
    }

    #[test]
    fn a_relative_displacement_stands_in_brackets() {
        let model = Model::second_order(1, vec![Equation::known([(Term::parse("x-u").expect("a term"), -4.0)])]);
        assert!(latex(&model).contains("-4 \\, \\left(x-u\\right)"), "{}", latex(&model));
        assert!(python(&model).contains("-4.0*(x-u)"), "{}", python(&model));
        let model = Model::second_order(1, vec![Equation::known([(Term::parse("-x").expect("a term"), -4.0)])]);
        assert!(latex(&model).contains("-4 \\, \\left(-x\\right)"), "{}", latex(&model));
    }

    #[test]
    fn digits_stop_at_the_error() {
        assert_eq!(digits(358.6, Some(0.2)), 5);
        assert_eq!(digits(0.3, Some(0.8)), 2);
        assert_eq!(digits(1e-9, Some(1.0)), 1);
        assert_eq!(digits(358.6, None), 5);
        assert_eq!(digits(358.6, Some(f64::NAN)), 5);
        assert_eq!(short_number(1.2345e-7, 3), "1.23e-7");
        assert_eq!(short_number(123_456.0, 2), "120000");
    }
}
