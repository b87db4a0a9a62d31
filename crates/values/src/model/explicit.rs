//! Equations with accelerations on both sides, solved for them: `M(x, v, t) a = f(x, v, u, t)`.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::{Equation, Model};
use crate::term::{Expression, Layout, Symbol, Term, derivative};

/// Accelerations that are solved for together, at most.
const MOST: usize = 4;

/// Why equations cannot be solved for the accelerations.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImplicitError {
    /// An acceleration stands in a power, a sign or another function.
    #[error(
        "the term {0} is not proportional to the acceleration in it: only products such as cos(x2)*a2 can be solved for"
    )]
    Curved(String),
    /// A system too large to be solved term by term.
    #[error("accelerations of {0} masses stand on both sides; at most {MOST} can be solved for together")]
    TooMany(usize),
    /// The equations do not determine the accelerations.
    #[error("the equations do not determine the accelerations: they stand on both sides and cancel")]
    Undetermined,
}

impl Model {
    /// True if an acceleration stands in some term.
    pub fn is_implicit(&self) -> bool {
        self.equations.iter().flat_map(|e| &e.terms).any(|t| has_acceleration(&t.term))
    }

    /// This model with its accelerations solved for: none stands on a right side. Borrowed where none did.
    ///
    /// # Errors
    /// Terms that are not proportional to the acceleration in them; more than four masses that depend on each other's
    /// accelerations; accelerations that cancel.
    pub fn explicit(&self) -> Result<Cow<'_, Self>, ImplicitError> {
        if !self.is_implicit() {
            return Ok(Cow::Borrowed(self));
        }
        let freedoms = self.layout.freedoms;
        let mut forces = Vec::with_capacity(freedoms);
        let mut inertia = DMatrix::from_element(freedoms, freedoms, Expression::Number(0.0));
        for mass in 0..freedoms {
            let terms = self.equations.get(freedoms + mass).map_or(&[][..], |e| &e.terms);
            let (mut force, mut row) = (Vec::new(), vec![Vec::new(); freedoms]);
            for t in terms.iter().filter(|t| t.coefficient != 0.0) {
                let weighted = |e: Expression| Expression::Product(vec![Expression::Number(t.coefficient), e]);
                let (at_rest, slopes) = parts(&t.term, &self.layout)?;
                row.iter_mut().zip(slopes).for_each(|(row, slope)| row.extend(slope.map(weighted)));
                force.extend(at_rest.map(weighted));
            }
            forces.push(Expression::Sum(force).normal());
            for (other, own) in row.into_iter().enumerate() {
                let unit = Expression::Number(if other == mass { 1.0 } else { 0.0 });
                inertia[(mass, other)] = (unit - Expression::Sum(own)).normal();
            }
        }
        // A mass whose equation has no acceleration keeps its terms.
        let plain = |mass: usize| (0..freedoms).all(|j| is_unit(&inertia, mass, j));
        let coupled: Vec<usize> = (0..freedoms).filter(|mass| !plain(*mass)).collect();
        if coupled.len() > MOST {
            return Err(ImplicitError::TooMany(coupled.len()));
        }
        for mass in &coupled {
            for other in (0..freedoms).filter(|j| plain(*j)) {
                let known = inertia[(*mass, other)].clone() * forces[other].clone();
                forces[*mass] = (forces[*mass].clone() - known).normal();
            }
        }
        let matrix = |row: usize, column: usize| inertia[(coupled[row], coupled[column])].clone();
        let all: Vec<usize> = (0..coupled.len()).collect();
        let whole = determinant(&all, &all, &matrix);
        if whole == Expression::Number(0.0) {
            return Err(ImplicitError::Undetermined);
        }
        let mut explicit = self.clone();
        for (column, mass) in coupled.iter().enumerate() {
            // Cramer's rule.
            let replaced =
                |row: usize, j: usize| if j == column { forces[coupled[row]].clone() } else { matrix(row, j) };
            let solved = determinant(&all, &all, &replaced) * Expression::Power(Box::new(whole.clone()), -1.0);
            explicit.equations[freedoms + mass] = Equation::known([(Term::new(solved), 1.0)]);
        }
        Ok(Cow::Owned(explicit))
    }
}

/// True if some acceleration stands in a term.
pub fn has_acceleration(term: &Term) -> bool {
    term.symbols().iter().any(|s| matches!(s, Symbol::Acceleration(_)))
}

/// Whether the accelerations in a term can be solved for.
///
/// # Errors
/// They stand in a power, a sign or another function.
pub fn check_accelerations(term: &Term, layout: &Layout) -> Result<(), ImplicitError> {
    parts(term, layout).map(|_| ())
}

/// What a term is where nothing accelerates, and its slope by each acceleration; none where these are zero.
fn parts(term: &Term, layout: &Layout) -> Result<(Option<Expression>, Vec<Option<Expression>>), ImplicitError> {
    if !has_acceleration(term) {
        return Ok((Some(term.expression().clone()), vec![None; layout.freedoms]));
    }
    let curved = || ImplicitError::Curved(term.text(layout));
    let mut linear = Vec::new();
    let mut slopes = Vec::with_capacity(layout.freedoms);
    for mass in 0..layout.freedoms {
        let symbol = Symbol::Acceleration(mass);
        let slope = derivative(term.expression(), symbol);
        let zero = slope == Expression::Number(0.0);
        if has_acceleration(&Term::new(slope.clone())) {
            return Err(curved());
        }
        linear.push(slope.clone() * symbol);
        slopes.push((!zero).then_some(slope));
    }
    let still = |s: Symbol| matches!(s, Symbol::Acceleration(_)).then_some(Expression::Number(0.0));
    let rest = term.expression().replaced(&still).normal();
    // The slope of a sign or of a bound is no acceleration either.
    if !is_linear(term, &rest, &linear) {
        return Err(curved());
    }
    Ok(((rest != Expression::Number(0.0)).then_some(rest), slopes))
}

/// Values of the symbols at which a term is tried.
const TRIED: [f64; 3] = [0.37, -1.21, 2.43];

/// True if a term is what it is without accelerations plus what is proportional to them.
fn is_linear(term: &Term, rest: &Expression, linear: &[Expression]) -> bool {
    TRIED.iter().all(|at| {
        let value = |s: Symbol| match s {
            Symbol::Acceleration(i) => at * (1.3 + i as f64),
            Symbol::State(i) | Symbol::Rate(i) | Symbol::Internal(i) => 0.7 * at + 0.11 * i as f64,
            _ => 0.5 * at,
        };
        let whole = term.expression().value(&value);
        let sum: f64 = rest.value(&value) + linear.iter().map(|e| e.value(&value)).sum::<f64>();
        // A logarithm or a root has no value at some of these points.
        whole.is_nan() || (whole - sum).abs() <= 1e-9 * (whole.abs() + sum.abs()).max(f64::MIN_POSITIVE)
    })
}

fn is_unit(inertia: &DMatrix<Expression>, row: usize, column: usize) -> bool {
    inertia[(row, column)] == Expression::Number(if row == column { 1.0 } else { 0.0 })
}

/// The determinant of a part of a matrix, expanded along its first row.
fn determinant(rows: &[usize], columns: &[usize], matrix: &dyn Fn(usize, usize) -> Expression) -> Expression {
    let Some((first, rest)) = rows.split_first() else { return Expression::Number(1.0) };
    let mut sum = Vec::new();
    for (k, column) in columns.iter().enumerate() {
        let entry = matrix(*first, *column);
        if entry == Expression::Number(0.0) {
            continue;
        }
        let others: Vec<usize> = columns.iter().copied().filter(|c| c != column).collect();
        let part = entry * determinant(rest, &others, matrix);
        sum.push(if k % 2 == 0 { part } else { part.negated() });
    }
    Expression::Sum(sum).normal()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::term::list;

    fn model(equations: [&[(&str, f64)]; 2]) -> Model {
        let terms = |own: &[(&str, f64)]| Equation::known(own.iter().map(|(t, c)| (Term::parse(t).unwrap(), *c)));
        Model::second_order(0, equations.map(terms).to_vec())
    }

    #[test]
    fn accelerations_on_both_sides_are_solved_for() {
        let implicit = model([
            &[("sin(x)", -3.0), ("cos(x-x2)*a2", -0.4), ("sgn(v)", -0.2)],
            &[("x2", -2.0), ("cos(x-x2)*a", -0.7), ("x^2*a2", -0.3)],
        ]);
        let explicit = implicit.explicit().unwrap();
        assert!(!explicit.is_implicit());
        let (x, y, v) = (0.4_f64, -0.7_f64, 0.3_f64);
        let value = |s: Symbol| match s {
            Symbol::State(0) => x,
            Symbol::State(1) => y,
            Symbol::Rate(0) => v,
            _ => 0.0,
        };
        let solved = |mass: usize| explicit.equations[2 + mass].terms[0].term.expression().value(&value);
        let (a, b) = (solved(0), solved(1));
        let cos = (x - y).cos();
        assert!((a - (-3.0 * x.sin() - 0.4 * cos * b - 0.2)).abs() < 1e-12, "{a} {b}");
        assert!((b - (-2.0 * y - 0.7 * cos * a - 0.3 * x * x * b)).abs() < 1e-12, "{a} {b}");
    }

    #[test]
    fn a_mass_without_accelerations_in_its_equation_keeps_its_terms() {
        let implicit = model([&[("x", -4.0), ("v", -0.1)], &[("x2", -2.0), ("a", -0.5)]]);
        let explicit = implicit.explicit().unwrap();
        assert_eq!(explicit.equations[2], implicit.equations[2]);
        let value = |s: Symbol| if matches!(s, Symbol::State(_)) { 1.0 } else { 0.0 };
        assert!((explicit.equations[3].terms[0].term.expression().value(&value) - (-2.0 + 0.5 * 4.0)).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_solved_for_is_refused() {
        let layout = Layout { freedoms: 2, ..Layout::default() };
        for text in ["a^2", "sgn(a2)", "|a|", "a*a2", "sin(a)", "clip(a,1)"] {
            let [term] = list(text).unwrap().try_into().unwrap();
            assert!(check_accelerations(&term, &layout).is_err(), "{text}");
        }
        for text in ["a", "cos(x)*a2", "x2-a", "(1+x^2)*a", "|x|*a", "sqrt(x)*a"] {
            let [term] = list(text).unwrap().try_into().unwrap();
            assert_eq!(check_accelerations(&term, &layout), Ok(()), "{text}");
        }
        let cancelled = model([&[("a", 1.0), ("x", -1.0)], &[("x2", -1.0)]]);
        assert_eq!(cancelled.explicit().unwrap_err(), ImplicitError::Undetermined);
    }
}
