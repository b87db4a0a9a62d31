//! Effects of one's own, from a file: TOML with one table an effect.
//!
//! ```
//! let file = r#"
//! [[effect]]
//! name = "magnetic_pull"
//! words = "A magnet pulls the harder the nearer the mass comes."
//! terms = ["1/(d-x)^2"]
//! signs = ["positive"]
//!
//! [effect.inner.d]
//! bounds = [2.0, 10.0]
//! unit = "mm"
//! "#;
//! let effects = sindyscope_analysis::effects::of_text("magnet.toml", file)?;
//! assert_eq!(effects[0].title, "Magnetic pull");
//! let wrong = sindyscope_analysis::effects::of_text("magnet.toml", &file.replace("(d-x)", "(d-q)")).unwrap_err();
//! assert!(wrong.to_string().starts_with("magnet.toml, line 5, column 16: "));
//! # Ok::<(), sindyscope_analysis::AnalysisError>(())
//! ```

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use crate::error::AnalysisError;
use sindyscope_search::{ForceAxis, OwnEffect, OwnPart, OwnQuantity, OwnSign, OwnState, OwnTerm};
use sindyscope_values::format::words::capitalised;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EffectFile {
    effect: Vec<Spanned<EffectEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EffectEntry {
    name: Spanned<String>,
    title: Option<String>,
    words: Spanned<String>,
    separates: Option<String>,
    over: Option<Spanned<String>>,
    mass: Option<Spanned<usize>>,
    terms: Spanned<Vec<Spanned<String>>>,
    coefficients: Option<Spanned<Vec<Spanned<String>>>>,
    units: Option<Spanned<Vec<String>>>,
    signs: Option<Spanned<Vec<OwnSign>>>,
    contains: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    states: BTreeMap<String, Spanned<String>>,
    #[serde(default)]
    inner: BTreeMap<String, Spanned<EntryQuantity>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EntryQuantity {
    bounds: (f64, f64),
    #[serde(default)]
    unit: String,
}

/// The effects of a file.
///
/// # Errors
/// The file cannot be read, or an entry is wrong: the error names line and column.
pub fn of_file(path: &Path) -> Result<Vec<OwnEffect>, AnalysisError> {
    of_text(&path.display().to_string(), &text_of_file(path)?)
}

/// The text of a file of effects.
///
/// # Errors
/// The file cannot be read.
pub fn text_of_file(path: &Path) -> Result<String, AnalysisError> {
    sindyscope_system::fs::read_to_string(path).map_err(|e| {
        let problem = match e.kind() {
            std::io::ErrorKind::InvalidData => "it is no text".to_owned(),
            std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
            _ => e.to_string(),
        };
        AnalysisError::EffectsUnread { file: path.display().to_string(), problem }
    })
}

/// The effects of a file's text; `file` is its name.
///
/// # Errors
/// An entry is wrong: the error names line and column.
pub fn of_text(file: &str, text: &str) -> Result<Vec<OwnEffect>, AnalysisError> {
    let wrong = |at: usize, problem: String| {
        let before = text.get(..at.min(text.len())).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
        AnalysisError::Effects { file: file.to_owned(), line, column, problem }
    };
    let read: EffectFile = toml::from_str(text).map_err(|e| {
        let problem = e.message().lines().next().unwrap_or_default().to_owned();
        wrong(e.span().map_or(0, |span| span.start), problem)
    })?;
    let mut effects: Vec<OwnEffect> = Vec::new();
    for entry in read.effect {
        let span = entry.span();
        let entry = entry.into_inner();
        let effect = effect(&entry).map_err(|(at, problem)| wrong(at, problem))?;
        if effects.iter().any(|known| known.name == effect.name) {
            return Err(wrong(entry.name.span().start, format!("there are two effects `{}`", effect.name)));
        }
        effect.check().map_err(|e| {
            let at = match e.part {
                OwnPart::Name => entry.name.span().start,
                OwnPart::Words => entry.words.span().start,
                OwnPart::Terms => entry.terms.span().start,
                OwnPart::Term(k, column) => {
                    entry.terms.get_ref().get(k).map_or(span.start, |term| in_text(text, term, column))
                }
                OwnPart::Coefficient(k) => {
                    let of_list = entry.coefficients.as_ref().and_then(|list| list.get_ref().get(k));
                    of_list.map_or(entry.terms.span().start, |name| name.span().start)
                }
                OwnPart::State(k) | OwnPart::Rate(k, _) => {
                    let state = effect.states.get(k).and_then(|s| entry.states.get(&s.name));
                    state.map_or(span.start, |rate| match e.part {
                        OwnPart::Rate(_, column) => in_text(text, rate, column),
                        _ => rate.span().start,
                    })
                }
                OwnPart::Quantity(k) => {
                    let name = effect.inner.get(k).map(|q| &q.name);
                    let of_table = name.and_then(|name| entry.inner.get(name));
                    of_table.map_or(span.start, |quantity| quantity.span().start)
                }
                OwnPart::Contains(k) => {
                    entry.contains.as_ref().and_then(|list| list.get(k)).map_or(span.start, |name| name.span().start)
                }
            };
            wrong(at, e.problem)
        })?;
        effects.push(effect);
    }
    Ok(effects)
}

/// Where a column of a text lies in the file, if the text is written there as it is.
fn in_text(file: &str, text: &Spanned<String>, column: usize) -> usize {
    let Range { start, end } = text.span();
    let quoted = file.get(start..end).unwrap_or_default();
    match quoted.find(text.get_ref().as_str()) {
        Some(inside) => {
            let own = text.get_ref();
            start + inside + own.char_indices().nth(column).map_or(own.len(), |(byte, _)| byte)
        }
        None => start,
    }
}

/// An entry as an effect; where it is wrong, and why.
fn effect(entry: &EffectEntry) -> Result<OwnEffect, (usize, String)> {
    let terms = entry.terms.get_ref();
    let as_many = |what: &str, count: usize, at: usize| {
        // A list without terms is wrong in itself.
        if count == terms.len() || terms.is_empty() {
            return Ok(());
        }
        Err((at, format!("there are {} terms and {count} {what}: give one for each", terms.len())))
    };
    if let Some(list) = &entry.coefficients {
        as_many("coefficients", list.get_ref().len(), list.span().start)?;
    }
    if let Some(list) = &entry.units {
        as_many("units", list.get_ref().len(), list.span().start)?;
    }
    if let Some(list) = &entry.signs {
        as_many("signs", list.get_ref().len(), list.span().start)?;
    }
    let over = entry.over.as_ref().map(|over| {
        let problem =
            |problem: String| (over.span().start, format!("{problem}: write displacement, velocity, input or time"));
        ForceAxis::try_from(over.get_ref().clone()).map_err(problem)
    });
    let mass = match &entry.mass {
        Some(mass) if *mass.get_ref() == 0 => {
            return Err((mass.span().start, "masses are counted from 1".to_owned()));
        }
        Some(mass) => mass.get_ref() - 1,
        None => 0,
    };
    let one = terms.len() == 1;
    let term = |(k, text): (usize, &Spanned<String>)| OwnTerm {
        text: text.get_ref().clone(),
        coefficient: match &entry.coefficients {
            Some(list) => list.get_ref()[k].get_ref().clone(),
            None if one => "c".to_owned(),
            None => format!("c_{}", k + 1),
        },
        unit: entry.units.as_ref().map(|list| list.get_ref()[k].clone()).unwrap_or_default(),
        sign: entry.signs.as_ref().map(|list| list.get_ref()[k]).unwrap_or_default(),
    };
    let quantity = |(name, quantity): (&String, &Spanned<EntryQuantity>)| {
        let EntryQuantity { bounds, unit } = quantity.get_ref();
        OwnQuantity { name: name.clone(), bounds: *bounds, unit: unit.clone() }
    };
    let state =
        |(name, rate): (&String, &Spanned<String>)| OwnState { name: name.clone(), rate: rate.get_ref().clone() };
    let name = entry.name.get_ref().clone();
    let title = match &entry.title {
        Some(title) => title.clone(),
        None => capitalised(&name.replace('_', " ")),
    };
    Ok(OwnEffect {
        name,
        title,
        words: entry.words.get_ref().clone(),
        separates: entry.separates.clone().unwrap_or_default(),
        over: over.transpose()?,
        terms: terms.iter().enumerate().map(term).collect(),
        states: entry.states.iter().map(state).collect(),
        inner: entry.inner.iter().map(quantity).collect(),
        contains: entry.contains.iter().flatten().map(|name| name.get_ref().clone()).collect(),
        mass,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAGNET: &str = r#"
[[effect]]
name = "magnet"
words = "It pulls."
terms = ["1/(d-x)^2", "x*w"]
coefficients = ["k_m", "c_m"]

[effect.inner.d]
bounds = [2, 10]
unit = "mm"
"#;

    #[test]
    fn a_bad_entry_is_refused_with_line_and_column() {
        assert_eq!(of_text("m", MAGNET).expect("entries")[0].inner[0].bounds, (2.0, 10.0));
        let cases = [
            (r#"name = "magnet""#, r#"name = "Magnet 1""#, (3, 8), "no name"),
            (r#"name = "magnet""#, r#"name = "clearance""#, (3, 8), "already"),
            (r#""It pulls.""#, r#""""#, (4, 9), "words"),
            ("words = ", "worte = ", (4, 1), "unknown field"),
            (r#"["1/(d-x)^2", "x*w"]"#, "[]", (5, 9), "a term at least"),
            ("(d-x)^2", "(d-q)^2", (5, 16), "no quantity"),
            ("x*w", "x*z", (5, 26), "[effect.states]"),
            ("x*w", "x*+", (5, 27), "too early"),
            (r#", "c_m""#, "", (6, 16), "one for each"),
            (r#""c_m""#, r#""k_m""#, (6, 24), "name of its own"),
            ("inner.d]", "inner.q]", (5, 14), "no quantity"),
            ("inner.d]", "inner.x]", (8, 1), "meaning"),
            ("[2, 10]", "[10, 2]", (8, 1), "lower one first"),
            ("[2, 10]", "2", (9, 10), "invalid type"),
            ("[2, 10]", "[2, 10", (10, 1), ""),
        ];
        let mut missed = Vec::new();
        for (good, bad, at, said) in cases {
            match of_text("m.toml", &MAGNET.replace(good, bad)) {
                Err(AnalysisError::Effects { line, column, problem, .. }) => {
                    if !problem.contains(said) || (line, column) != at {
                        missed.push(format!("{bad}: line {line}, column {column}: {problem}"));
                    }
                }
                other => panic!("{bad}: {other:?}"),
            }
        }
        assert!(missed.is_empty(), "{missed:#?}");
        let remembers =
            MAGNET.replace("x*w", "z").replace("[effect.inner", "[effect.states]\nz = \"w-z*d\"\n\n[effect.inner");
        assert_eq!(of_text("m", &remembers).expect("entries")[0].states[0].rate, "w-z*d");
        for (good, bad, at, said) in [
            ("w-z*d", "w-z*q", (9, 10), "no quantity"),
            ("w-z*d", "w-z*", (9, 10), ""),
            ("z = ", "v = ", (9, 5), "meaning"),
            ("\"z\"", "\"x\"", (9, 5), "no term has `z`"),
            ("w-z*d", "w-z2*d", (9, 8), "`z2` is a state"),
        ] {
            let told = of_text("m.toml", &remembers.replace(good, bad)).expect_err(bad);
            let AnalysisError::Effects { line, column, ref problem, .. } = told else { panic!("{bad}: {told}") };
            assert!(problem.contains(said) && (line, column) == at, "{bad}: line {line}, column {column}: {problem}");
        }
        let twice = format!("{MAGNET}{MAGNET}");
        assert!(of_text("m", &twice).unwrap_err().to_string().contains("two effects `magnet`"));
    }
    #[test]
    fn the_entries_of_the_book_are_effects() {
        let page = include_str!("../../../docs/howto/own-effect.md");
        let blocks: Vec<&str> = page.split("```toml\n").skip(1).filter_map(|part| part.split("```").next()).collect();
        let names: Vec<String> = blocks
            .iter()
            .flat_map(|block| of_text("own-effect.md", block).unwrap_or_else(|e| panic!("{e}")))
            .map(|effect| effect.name)
            .collect();
        assert_eq!(names, ["magnetic_pull", "maxwell_branch"]);
    }
}
