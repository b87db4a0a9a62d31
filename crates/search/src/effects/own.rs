//! Effects that the user adds to the catalogue: terms as one writes them, with quantities inside that have bounds.

use std::collections::BTreeSet;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::{
    Addition, Coefficient, DESCRIPTION, Direction, EffectSetting, ForceAxis, Form, Frame, Inner, even, logarithmic,
    shared,
};
use crate::guide::guide;
use crate::site::Site;
use sindyscope_core::parallel::lock;
use sindyscope_values::format::words::capitalised;
use sindyscope_values::model::Equation;
use sindyscope_values::record::{parse_unit, unit_factors};
use sindyscope_values::term::{Expression, Function, Symbol, Term};

/// Displacement and velocity across the place that the effect acts at.
const ACROSS: [&str; 2] = ["r", "w"];
/// Inner quantities at most: each multiplies the values that are tried.
const MOST_INNER: usize = 3;
/// States of its own at most.
const MOST_STATES: usize = 3;
/// Values of a quantity that are tried, where there is one, where there are two, and where there are three.
const TRIED: [usize; MOST_INNER] = [16, 7, 5];
/// Range of a quantity from which on it is tried by its logarithm.
const WIDE: f64 = 3.0;

/// An effect of the user's own, as an entry says it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnEffect {
    /// Its name in commands and results: `magnetic_pull`.
    pub name: String,
    /// Its name for people; empty for the same in words.
    pub title: String,
    /// What it is, in plain words.
    pub words: String,
    /// What an experiment needs to show it apart from others; may be empty.
    pub separates: String,
    /// What its force is drawn over; none for what its terms are made of.
    pub over: Option<ForceAxis>,
    /// What it adds to the acceleration.
    pub terms: Vec<OwnTerm>,
    /// States of its own, which no sensor shows and which begin at zero: what makes a force remember.
    #[serde(default)]
    pub states: Vec<OwnState>,
    /// The quantities inside its terms and rates.
    pub inner: Vec<OwnQuantity>,
    /// Effects that it contains as special cases: where they do as well, they are preferred.
    pub contains: Vec<String>,
    /// The mass in whose equation terms of `x` and `v` stand, from zero.
    pub mass: usize,
}

/// A term of an effect, with the coefficient that is fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnTerm {
    /// The term: quantities inside by their names, `r` and `w` the displacement and velocity across its place.
    pub text: String,
    /// The coefficient's name.
    pub coefficient: String,
    /// The coefficient's unit; may be empty.
    pub unit: String,
    /// Which signs the coefficient may have.
    pub sign: OwnSign,
}

/// Which signs a coefficient may have in `x″ = …`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OwnSign {
    /// Either.
    #[default]
    Either,
    /// Above zero.
    Positive,
    /// Below zero; its quantity is told as the magnitude, as that of a damper is.
    Negative,
}

/// A state of an effect's own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnState {
    /// Its symbol: `z`.
    pub name: String,
    /// Its time derivative, written as a term is: `w-z/tau`.
    pub rate: String,
}

/// A quantity inside a term.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OwnQuantity {
    /// Its symbol.
    pub name: String,
    /// Values beyond these are not this effect.
    pub bounds: (f64, f64),
    /// Its unit; may be empty.
    pub unit: String,
}

/// What of an entry is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OwnPart {
    /// Its name.
    Name,
    /// Its words.
    Words,
    /// The list of its terms.
    Terms,
    /// One of its terms, and the column in it, from 0.
    Term(usize, usize),
    /// The name of a term's coefficient.
    Coefficient(usize),
    /// The name of one of its states.
    State(usize),
    /// The rate of one of its states, and the column in it, from 0.
    Rate(usize, usize),
    /// One of its inner quantities.
    Quantity(usize),
    /// An effect that it contains.
    Contains(usize),
}

/// Why an entry is no effect.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
pub struct OwnError {
    /// Where it is wrong.
    pub part: OwnPart,
    /// What is wrong, and what would be right.
    pub problem: String,
}

impl OwnEffect {
    /// Whether the entry says an effect.
    ///
    /// # Errors
    /// The first thing that is wrong with it.
    pub fn check(&self) -> Result<(), OwnError> {
        let wrong = |part: OwnPart, problem: String| Err(OwnError { part, problem });
        let name = &self.name;
        if !is_name(name) || name.chars().any(|c| c.is_ascii_uppercase()) {
            let problem = format!("`{name}` is no name: small letters, digits and _ are, as in magnetic_pull");
            return wrong(OwnPart::Name, problem);
        }
        let catalogue: Vec<&str> = guide().iter().map(|e| e.effect).collect();
        if name == DESCRIPTION || catalogue.contains(&name.as_str()) {
            return wrong(OwnPart::Name, format!("the catalogue has an effect `{name}` already: give it another name"));
        }
        if self.words.trim().is_empty() {
            return wrong(OwnPart::Words, "words that say what it is are missing".to_owned());
        }
        if let Some(k) = self.contains.iter().position(|c| !catalogue.contains(&c.as_str())) {
            let problem = format!("the catalogue has no effect `{}`", self.contains[k]);
            return wrong(OwnPart::Contains(k), problem);
        }
        self.check_quantities()?;
        self.check_states()?;
        if self.terms.is_empty() {
            return wrong(OwnPart::Terms, "an effect needs a term at least".to_owned());
        }
        for (k, OwnTerm { text, coefficient, .. }) in self.terms.iter().enumerate() {
            if coefficient.trim().is_empty() || self.terms[..k].iter().any(|t| t.coefficient == *coefficient) {
                let problem = format!("each coefficient needs a name of its own, `{coefficient}` is none");
                return wrong(OwnPart::Coefficient(k), problem);
            }
            self.check_text(text, &|column| OwnPart::Term(k, column))?;
        }
        for (k, state) in self.states.iter().enumerate() {
            self.check_text(&state.rate, &|column| OwnPart::Rate(k, column))?;
        }
        for (k, state) in self.states.iter().enumerate() {
            if !self.terms.iter().any(|t| self.pieces(&t.text).contains(&Piece::State(k)))
                && !self.states.iter().any(|s| s != state && self.pieces(&s.rate).contains(&Piece::State(k)))
            {
                return wrong(OwnPart::State(k), format!("no term has `{}` in it", state.name));
            }
        }
        for (k, quantity) in self.inner.iter().enumerate() {
            if !self.texts().any(|text| self.pieces(text).contains(&Piece::Inner(k))) {
                return wrong(OwnPart::Quantity(k), format!("no term has `{}` in it", quantity.name));
            }
        }
        Ok(())
    }

    /// Its terms and the rates of its states, as they are written.
    fn texts(&self) -> impl Iterator<Item = &str> {
        self.terms.iter().map(|t| t.text.as_str()).chain(self.states.iter().map(|s| s.rate.as_str()))
    }

    /// Whether a text is a term, `part` being the place of a column in it.
    fn check_text(&self, text: &str, part: &dyn Fn(usize) -> OwnPart) -> Result<(), OwnError> {
        let middle: Vec<f64> = self.inner.iter().map(OwnQuantity::middle).collect();
        let across = ACROSS.map(|_| "x".to_owned());
        let pieces = self.pieces(text);
        let mut column = 0;
        for piece in &pieces {
            if let Piece::Text(token) = piece
                && is_state(token)
            {
                let problem = format!("`{token}` is a state whose rate is not said: write it under [effect.states]");
                return Err(OwnError { part: part(column), problem });
            }
            column += self.length(piece);
        }
        let term = Term::parse(&written(&pieces, &middle, &across)).map_err(|error| OwnError {
            part: part(self.column(&pieces, (&middle, &across), error.column.saturating_sub(1))),
            problem: self.with_own_names(error.problem),
        })?;
        if term.symbols().iter().any(|s| matches!(s, Symbol::Acceleration(_))) {
            let problem = "an acceleration stands on the other side of the equation: write the force over displacement, \
                           velocity, input and time";
            return Err(OwnError { part: part(0), problem: problem.to_owned() });
        }
        Ok(())
    }

    fn check_states(&self) -> Result<(), OwnError> {
        for (k, OwnState { name, .. }) in self.states.iter().enumerate() {
            let wrong = |problem: String| Err(OwnError { part: OwnPart::State(k), problem });
            let taken = ACROSS.contains(&name.as_str())
                || Function::ALL.iter().any(|f| f.name() == name)
                || ["sign", "ln"].contains(&name.as_str())
                || self.inner.iter().any(|q| q.name == *name)
                || (Term::parse(name).is_ok() && !is_state(name));
            if !is_name(name) {
                return wrong(format!("`{name}` is no name: letters, digits and _ are"));
            }
            if taken || self.states[..k].iter().any(|s| s.name == *name) {
                return wrong(format!("`{name}` has a meaning in terms already: give the state another name, as z"));
            }
            if k >= MOST_STATES {
                return wrong(format!("an effect may have {MOST_STATES} states of its own, `{name}` is one more"));
            }
        }
        Ok(())
    }

    fn check_quantities(&self) -> Result<(), OwnError> {
        for (k, quantity) in self.inner.iter().enumerate() {
            let wrong = |problem: String| Err(OwnError { part: OwnPart::Quantity(k), problem });
            let name = &quantity.name;
            let taken = ACROSS.contains(&name.as_str())
                || Function::ALL.iter().any(|f| f.name() == name)
                || ["sign", "ln"].contains(&name.as_str())
                || Term::parse(name).is_ok();
            if !is_name(name) {
                return wrong(format!("`{name}` is no name: letters, digits and _ are"));
            }
            if taken || self.inner[..k].iter().any(|q| q.name == *name) {
                return wrong(format!("`{name}` has a meaning in terms already: give the quantity another name"));
            }
            let (low, high) = quantity.bounds;
            if !(low.is_finite() && high.is_finite() && low < high) {
                return wrong(format!("the bounds of `{name}` must be two numbers, the lower one first"));
            }
            if k >= MOST_INNER {
                return wrong(format!(
                    "an effect may have {MOST_INNER} quantities inside its terms, `{name}` is one more"
                ));
            }
        }
        Ok(())
    }

    /// A term cut at the names that are replaced in it.
    fn pieces(&self, text: &str) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let length = if first.is_ascii_digit() {
                number_length(rest)
            } else if word(first) {
                rest.find(|c| !word(c)).unwrap_or(rest.len())
            } else {
                first.len_utf8()
            };
            let (token, behind) = rest.split_at(length);
            rest = behind;
            let across = ACROSS.iter().position(|a| *a == token).map(Piece::Across);
            let inner = self.inner.iter().position(|q| q.name == token).map(Piece::Inner);
            let state = self.states.iter().position(|s| s.name == token).map(Piece::State);
            pieces.push(across.or(inner).or(state).unwrap_or_else(|| Piece::Text(token.to_owned())));
        }
        pieces
    }

    /// What is wrong with a term, with the names that only an entry's terms have.
    fn with_own_names(&self, problem: String) -> String {
        if !problem.starts_with("there is no quantity") {
            return problem;
        }
        let inner = self.inner.iter().map(|q| q.name.as_str());
        let states = self.states.iter().map(|s| s.name.as_str());
        let names: Vec<&str> = ACROSS.into_iter().chain(inner).chain(states).collect();
        let (last, first) = names.split_last().unwrap_or((&"", &[]));
        format!("{problem}; here also {} and {last}", first.join(", "))
    }

    /// The column in an entry's text of one in the term that it was read as, both from 0.
    fn column(&self, pieces: &[Piece], (inner, across): (&[f64], &[String; 2]), read: usize) -> usize {
        let (mut own, mut seen) = (0, 0);
        for piece in pieces {
            let length = piece.written(inner, across).chars().count();
            if read < seen + length {
                return own + if matches!(piece, Piece::Text(_)) { read - seen } else { 0 };
            }
            seen += length;
            own += self.length(piece);
        }
        own
    }

    /// Characters of a piece in the entry's text.
    fn length(&self, piece: &Piece) -> usize {
        match piece {
            Piece::Text(text) => text.chars().count(),
            Piece::Across(k) => ACROSS[*k].len(),
            Piece::Inner(k) => self.inner[*k].name.len(),
            Piece::State(k) => self.states[*k].name.len(),
        }
    }

    /// True if it acts across a place, whichever.
    fn is_across(&self) -> bool {
        self.texts().any(|text| self.pieces(text).iter().any(|p| matches!(p, Piece::Across(_))))
    }

    /// The terms and rates without the quantities' values, to be looked at.
    pub(crate) fn sample(&self) -> Vec<Term> {
        let middle: Vec<f64> = self.inner.iter().map(OwnQuantity::middle).collect();
        let across = ["x", "v"].map(str::to_owned);
        self.texts().filter_map(|text| Term::parse(&written(&self.pieces(text), &middle, &across)).ok()).collect()
    }

    /// Its forms for a setting; `units` are those of the records' channels.
    fn forms(&self, setting: &EffectSetting, units: &[&str]) -> Vec<Form> {
        let places: Vec<Frame> = match self.is_across() {
            true => setting.frames().to_vec(),
            false => setting.each_mass().into_iter().filter(|f| f.site == Site::Ground(self.mass)).collect(),
        };
        places.iter().map(|frame| self.form(frame, units)).collect()
    }

    fn form(&self, frame: &Frame, units: &[&str]) -> Form {
        let across = [frame.r(), frame.w()].map(|e| format!("({})", Term::new(e).as_str()));
        let pieces: Vec<Vec<Piece>> = self.terms.iter().map(|t| self.pieces(&t.text)).collect();
        let rates: Vec<Vec<Piece>> = self.states.iter().map(|s| self.pieces(&s.rate)).collect();
        let tried = TRIED[self.inner.len().clamp(1, MOST_INNER) - 1];
        let coefficient = |t: &OwnTerm| Coefficient {
            name: t.coefficient.clone(),
            dimension: (0, 0),
            unit: Some(kept(&t.unit)),
            sign: match t.sign {
                OwnSign::Either => Direction::Any,
                OwnSign::Positive => Direction::Along,
                OwnSign::Negative => Direction::Against,
            },
            restoring: false,
            mirrored: false,
        };
        let inner = |q: &OwnQuantity| {
            let (unit, size) = in_units(&q.unit, units);
            let (low, high) = (q.bounds.0 * size, q.bounds.1 * size);
            let grid = if low > 0.0 && high > WIDE * low {
                logarithmic(low, high, tried + 2)
            } else {
                even(low, high, tried + 2)
            };
            // At its bounds a quantity is not told.
            let grid = grid[1..=tried].to_vec();
            Inner { unit: Some(kept(&unit)), ..Inner::new(kept(&q.name), (0, 0), grid, (low, high)) }
        };
        let title = match self.title.trim() {
            "" => capitalised(&self.name.replace('_', " ")),
            title => title.to_owned(),
        };
        Form {
            effect: kept(&self.name),
            title: kept(&title),
            explanation: kept(&self.words),
            separates: kept(&self.separates),
            formula: "",
            form: frame.form.clone(),
            site: Some(frame.site),
            coefficients: self.terms.iter().map(coefficient).collect(),
            inner: self.inner.iter().map(inner).collect(),
            contains: kept_list(&self.contains),
            axis: self.over.unwrap_or_else(|| axis(&self.sample())),
            build: shared(move |inner| {
                let term = |pieces: &Vec<Piece>| {
                    let parsed = Term::parse(&written(pieces, inner, &across));
                    // Where a value leaves no term, as by a division by zero, there is no force.
                    parsed.unwrap_or_else(|_| Term::new(Expression::Number(0.0)))
                };
                let internals = rates.iter().map(|pieces| equation(term(pieces).expression())).collect();
                Addition { terms: pieces.iter().map(term).collect(), internals, ..Addition::default() }
            }),
        }
    }
}

impl OwnQuantity {
    fn middle(&self) -> f64 {
        let (low, high) = self.bounds;
        // Round numbers are where terms end: a division by zero, an exponent of one.
        low + 0.4731 * (high - low)
    }
}

/// The forms of all entries.
pub(crate) fn own(effects: &[OwnEffect], setting: &EffectSetting, units: &[&str]) -> Vec<Form> {
    let mut forms: Vec<Form> = effects.iter().flat_map(|effect| effect.forms(setting, units)).collect();
    super::joined(&mut forms);
    forms
}

/// A piece of a term.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    /// One of [`ACROSS`].
    Across(usize),
    Inner(usize),
    State(usize),
}

impl Piece {
    fn written(&self, inner: &[f64], across: &[String; 2]) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Across(k) => across[*k].clone(),
            Self::Inner(k) => format!("({})", inner.get(*k).copied().unwrap_or(1.0)),
            Self::State(k) => format!("z{}", k + 1),
        }
    }
}

/// True if a name is one of an internal state in terms: `z`, `z1`, …
fn is_state(name: &str) -> bool {
    let digits = name.strip_prefix('z');
    digits.is_some_and(|digits| digits.chars().all(|c| c.is_ascii_digit()))
}

/// A rate as an equation, one term an addend: so one that is linear in the states is seen to be.
fn equation(rate: &Expression) -> Equation {
    let parts = match rate.normal() {
        Expression::Sum(parts) => parts,
        other => vec![other],
    };
    Equation::known(parts.into_iter().map(|part| {
        let (coefficient, rest) = part.apart();
        (Term::new(rest.normal()), coefficient)
    }))
}

fn written(pieces: &[Piece], inner: &[f64], across: &[String; 2]) -> String {
    pieces.iter().map(|piece| piece.written(inner, across)).collect()
}

/// Whether a text is a name: a letter, then letters, digits and `_`.
fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// How long the number is that a text begins with: `1.5e-3`.
fn number_length(text: &str) -> usize {
    let digits = |from: usize| text[from..].find(|c: char| !c.is_ascii_digit()).map_or(text.len(), |n| from + n);
    let mut end = digits(0);
    if text[end..].starts_with('.') {
        end = digits(end + 1);
    }
    if text[end..].starts_with(['e', 'E']) {
        let from = end + 1 + usize::from(text[end + 1..].starts_with(['+', '-']));
        if text[from..].starts_with(|c: char| c.is_ascii_digit()) {
            end = digits(from);
        }
    }
    end
}

/// What a force of these terms is drawn over.
fn axis(terms: &[Term]) -> ForceAxis {
    let symbols: Vec<Symbol> = terms.iter().flat_map(Term::symbols).collect();
    let has = |wanted: fn(&Symbol) -> bool| symbols.iter().any(wanted);
    let input = symbols.iter().find_map(|s| if let Symbol::Input(j) = s { Some(*j) } else { None });
    let over_displacement = has(|s| matches!(s, Symbol::State(_) | Symbol::Internal(_)));
    match (over_displacement, has(|s| matches!(s, Symbol::Rate(_))), input) {
        (true, ..) => ForceAxis::Displacement,
        (_, true, _) => ForceAxis::Velocity,
        (_, _, Some(j)) => ForceAxis::Input(j),
        _ => ForceAxis::Time,
    }
}

/// A unit told in those of the records, and how many of it one is: `mm` where they have `m`.
fn in_units(unit: &str, records: &[&str]) -> (String, f64) {
    let factors = unit_factors(unit).unwrap_or_else(|| vec![(unit.trim().to_owned(), 1)]);
    let (mut size, mut told, mut parts) = (1.0, false, Vec::new());
    for (name, power) in factors {
        let own = parse_unit(&name);
        let same = records.iter().chain(&["s"]).find_map(|of| {
            let (own, of_records) = (own.as_ref()?, parse_unit(of)?);
            (own.powers() == of_records.powers()).then_some((*of, own.factor / of_records.factor))
        });
        let (shown, ratio) = same.map_or((name.clone(), 1.0), |(of, ratio)| (of.to_owned(), ratio));
        told |= shown != name;
        size *= ratio.powi(power);
        parts.push(if power == 1 { shown } else { format!("{shown}^{power}") });
    }
    if told { (parts.join(" "), size) } else { (unit.to_owned(), 1.0) }
}

/// A text that lasts as long as the program, as those of the catalogue do. The same text is kept once, however often a file is
/// read again.
fn kept(text: &str) -> &'static str {
    static KEPT: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut all = lock(&KEPT);
    if let Some(known) = all.get(text) {
        return known;
    }
    let new: &'static str = Box::leak(text.into());
    all.insert(new);
    new
}

/// The same of a list.
fn kept_list(texts: &[String]) -> &'static [&'static str] {
    static KEPT: Mutex<BTreeSet<&'static [&'static str]>> = Mutex::new(BTreeSet::new());
    let list: Vec<&'static str> = texts.iter().map(|text| kept(text)).collect();
    let mut all = lock(&KEPT);
    if let Some(known) = all.get(list.as_slice()) {
        return known;
    }
    let new: &'static [&'static str] = Box::leak(list.into());
    all.insert(new);
    new
}
