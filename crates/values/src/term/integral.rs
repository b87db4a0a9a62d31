//! Terms of an equation that is integrated once over time: `dv/dt = -k*x - c*v` is `v = -k*int(x) - c*x` and a constant.

use super::{Expression, Layout, Symbol, Term, TermError, derivative};

/// True if a list of terms is one of the integral form: some term of it stands under an integral.
pub fn is_integral(list: &str) -> bool {
    super::pieces(list)
        .into_iter()
        .any(|(_, piece)| under_integral(piece.rsplit(':').next().unwrap_or(piece)).is_some())
}

/// What stands under the integral of `int(…)`.
fn under_integral(text: &str) -> Option<&str> {
    text.trim().strip_prefix("int(")?.strip_suffix(')')
}

/// Reads a term of the integral form and gives its rate, the term of the equation of motion: `int(x)` is the term `x`,
/// `x` the term `v`, `u` the term `du`, `t` the term `1`.
///
/// # Errors
/// A text that is no term, or one beside integrals that is no sum of displacements, inputs and time.
pub fn rate(text: &str) -> Result<Term, TermError> {
    if let Some(inner) = under_integral(text) {
        return Term::parse(inner).map_err(|e| TermError { column: e.column + "int(".len(), ..e });
    }
    let term = Term::parse(text)?;
    let parts = linear(&term, |symbol| match symbol {
        Symbol::State(i) => Some(Expression::Symbol(Symbol::Rate(i))),
        Symbol::Input(j) => Some(Expression::Symbol(Symbol::InputRate(j))),
        Symbol::Time => Some(Expression::Number(1.0)),
        _ => None,
    });
    parts.ok_or_else(|| TermError {
        text: text.to_owned(),
        column: 1,
        problem: "outside an integral only sums of displacements, inputs and t stand; write int(…) around it".into(),
    })
}

/// A term of the equation of motion as it stands in the integral form, with the layout's names: the inverse of [`rate`].
pub fn integral(term: &Term, layout: &Layout) -> String {
    let plain = linear(term, |symbol| match symbol {
        Symbol::Rate(i) => Some(Expression::Symbol(Symbol::State(i))),
        Symbol::InputRate(j) => Some(Expression::Symbol(Symbol::Input(j))),
        _ => None,
    });
    match (plain, term.as_str()) {
        (_, "1") => "t".into(),
        (Some(plain), _) => plain.text(layout),
        (None, _) => format!("int({})", term.summary(layout)),
    }
}

/// A sum in which every symbol is replaced; none of an expression that is no sum of multiples of symbols.
fn linear(term: &Term, replaced: impl Fn(Symbol) -> Option<Expression>) -> Option<Term> {
    let symbols = term.symbols();
    let factor = |symbol: &Symbol| match derivative(term.expression(), *symbol) {
        Expression::Number(factor) => Some(Expression::Number(factor)),
        _ => None,
    };
    let factors: Vec<Expression> = symbols.iter().map(factor).collect::<Option<_>>()?;
    let sum = |each: Vec<Expression>| {
        let products = factors.iter().zip(each).map(|(f, e)| Expression::Product(vec![f.clone(), e])).collect();
        Term::new(Expression::Sum(products))
    };
    // A sign's derivative is a number too.
    if symbols.is_empty() || sum(symbols.iter().map(|s| Expression::Symbol(*s)).collect()) != *term {
        return None;
    }
    Some(sum(symbols.into_iter().map(replaced).collect::<Option<_>>()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::term::Kind;

    #[test]
    fn a_term_comes_back_from_the_integral_form() {
        let layout = Layout { freedoms: 2, inputs: 1, ..Layout::default() };
        assert_eq!(layout.kind, Kind::SecondOrder);
        for (written, in_rates) in [
            ("int(x2-x1)", "x2-x1"),
            ("x2-x1", "v2-v1"),
            ("int(sgn(v2-v1))", "sgn(v2-v1)"),
            ("int( v1*|v1| )", "v1*|v1|"),
            ("u", "du"),
            ("int(u)", "u"),
            ("t", "1"),
        ] {
            let term = rate(written).unwrap();
            assert_eq!(term, Term::parse(in_rates).unwrap(), "{written}");
            assert_eq!(rate(&integral(&term, &layout)).unwrap(), term, "{written}");
        }
    }

    #[test]
    fn only_displacements_stand_outside_an_integral() {
        for wrong in ["x^2", "v", "sgn(v)", "1", "x+1"] {
            let error = rate(wrong).unwrap_err();
            assert!(error.problem.contains("int(…)"), "{wrong}: {}", error.problem);
        }
        let error = rate("int(x+)").unwrap_err();
        assert!(error.column > 4, "{error:?}");
        assert!(is_integral("v1: x1, int(x1); v2: x2") && !is_integral("x, v, sgn(v)"));
    }
}
