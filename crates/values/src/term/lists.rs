//! Lists as an option or a text field gives them: for all equations, or for each its own.

use super::{Kind, Symbol, Term, TermError};

/// The pieces of a list, separated by commas, semicolons or line ends outside brackets, none of them blank; each with the
/// byte that it begins at.
pub fn pieces(text: &str) -> Vec<(usize, &str)> {
    split(text, &[',', ';', '\n'])
}

/// Parts of a text between separators outside brackets, without blanks around them, empty ones left out.
fn split<'a>(text: &'a str, separators: &[char]) -> Vec<(usize, &'a str)> {
    let mut depth = 0_usize;
    let mut start = 0;
    let mut pieces = Vec::new();
    let ends = text.char_indices().chain([(text.len(), separators[0])]);
    for (at, c) in ends {
        match c {
            _ if at == text.len() => depth = 0,
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 && separators.contains(&c) {
            let piece = &text[start..at];
            let blank = piece.len() - piece.trim_start().len();
            if !piece.trim().is_empty() {
                pieces.push((start + blank, piece.trim()));
            }
            start = at + c.len_utf8();
        }
    }
    pieces
}

/// Reads a list of terms: `x, v, sgn(v)`.
///
/// # Errors
/// The first entry that is no term.
pub fn list(text: &str) -> Result<Vec<Term>, TermError> {
    let mut terms: Vec<Term> = Vec::new();
    for (_, piece) in pieces(text) {
        let term = Term::parse(piece)?;
        if !terms.contains(&term) {
            terms.push(term);
        }
    }
    Ok(terms)
}

/// What a list says of one equation, or of all.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationEntries<T> {
    /// The state whose rate the equation gives: `v1`, of first order `x1`; none for all equations.
    pub equation: Option<Symbol>,
    /// The entries, in their order.
    pub entries: Vec<T>,
}

impl<T> EquationEntries<T> {
    /// The degree of freedom (first order: the state) of the equation; none for all equations.
    ///
    /// # Errors
    /// A sentence, if equations of this kind are not called so.
    pub fn freedom(&self, kind: Kind) -> Result<Option<usize>, String> {
        match (self.equation, kind) {
            (None, _) => Ok(None),
            (Some(Symbol::Rate(i)), Kind::SecondOrder) | (Some(Symbol::State(i)), Kind::FirstOrder) => Ok(Some(i)),
            (Some(_), Kind::SecondOrder) => {
                Err("the equations are those of the velocities: write `v1: …; v2: …`".into())
            }
            (Some(_), Kind::FirstOrder) => Err("the equations are those of the states: write `x1: …; x2: …`".into()),
        }
    }
}

/// Reads a list for all equations, `x, v`, or one for each, `v1: x1, x2-x1; v2: x2-x1`; `entry` reads one entry and says
/// at which of its characters, from 0, it is wrong.
///
/// # Errors
/// The first mistake in a sentence, with its equation and its column in characters from 1.
pub fn by_equation<T: PartialEq>(
    text: &str,
    entry: impl Fn(&str) -> Result<T, (usize, String)>,
) -> Result<Vec<EquationEntries<T>>, String> {
    let column = |byte: usize| text[..byte].chars().count() + 1;
    let entries = |from: usize, list: &str, of: &str| -> Result<Vec<T>, String> {
        let mut found: Vec<T> = Vec::new();
        for (at, piece) in pieces(list) {
            let read = entry(piece)
                .map_err(|(inside, problem)| format!("{of}column {}: {problem}", column(from + at) + inside))?;
            if !found.contains(&read) {
                found.push(read);
            }
        }
        Ok(found)
    };
    if !text.contains(':') {
        return Ok(vec![EquationEntries { equation: None, entries: entries(0, text, "")? }]);
    }
    let mut parts: Vec<EquationEntries<T>> = Vec::new();
    for (at, piece) in split(text, &[';', '\n']) {
        let Some((name, list)) = piece.split_once(':') else {
            return Err(format!(
                "column {}: which equation is this list of? Write `v2: {piece}`, or one list for all without names",
                column(at)
            ));
        };
        let name = name.trim();
        let equation = equation(name).ok_or_else(|| {
            format!("column {}: {name:?} names no equation: write v1, v2, … (of first order x1, x2, …)", column(at))
        })?;
        if parts.iter().any(|p| p.equation == Some(equation)) {
            return Err(format!("column {}: the equation of {name} is there twice", column(at)));
        }
        let place = format!("equation of {name}, ");
        let entries = entries(at + piece.len() - list.len(), list, &place)?;
        parts.push(EquationEntries { equation: Some(equation), entries });
    }
    Ok(parts)
}

/// The state that an equation is called by: `v`, `v2`, `x3`.
fn equation(name: &str) -> Option<Symbol> {
    let symbol = match name.get(..1)? {
        "v" => Symbol::Rate,
        "x" => Symbol::State,
        _ => return None,
    };
    match name.get(1..)? {
        "" => Some(symbol(0)),
        number => number.parse::<usize>().ok().filter(|n| (1..=99).contains(n)).map(|n| symbol(n - 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn terms(text: &str) -> Result<Vec<EquationEntries<Term>>, String> {
        by_equation(text, |piece| Term::parse(piece).map_err(|e| (e.column - 1, e.problem)))
    }

    #[test]
    fn a_list_is_of_all_equations_or_of_each() {
        let all = terms("x, v; clip(x,0.1)").unwrap();
        assert_eq!((all.len(), all[0].equation, all[0].entries.len()), (1, None, 3));
        let each = terms(" v1: x1, x2-x1; v2: x2-x1 ").unwrap();
        assert_eq!(each[0], EquationEntries { equation: Some(Symbol::Rate(0)), entries: list("x1, x2-x1").unwrap() });
        assert_eq!(each[1], EquationEntries { equation: Some(Symbol::Rate(1)), entries: list("x2-x1").unwrap() });
        assert_eq!(each[1].freedom(Kind::SecondOrder), Ok(Some(1)));
        assert!(each[1].freedom(Kind::FirstOrder).unwrap_err().contains("x1"));
        assert_eq!(terms("v: x").unwrap()[0].equation, Some(Symbol::Rate(0)));
    }

    #[test]
    fn a_mistake_is_told_with_equation_and_column() {
        for (text, said) in [
            ("v1: x1; v2: x2-", "equation of v2, column 16:"),
            ("v1: x1, foo(x2); v2: x2", "equation of v1, column 9:"),
            ("v1: x1; x2-x1", "column 9: which equation"),
            ("q: x1", "column 1: \"q\" names no equation"),
            ("v1: x1; v1: x2", "column 9: the equation of v1 is there twice"),
            ("v0: x1", "names no equation"),
            ("x, y", "column 4:"),
        ] {
            let error = terms(text).unwrap_err();
            assert!(error.starts_with(said) || error.contains(said), "{text}: {error}");
        }
    }
}
