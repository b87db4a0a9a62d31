//! Which column is which, as a person says it.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::heading::{ColumnKey, ColumnQuantity};

/// Which column is which, as the user says it: `t=Time,x=Laser 2,u1=3`.
///
/// The left side of each pair is one of `t`, `x`, `v`, `a`, `u` (with a number where there are several), `F` (the force of a
/// component) and `record`, or one of the header names that stand for them; the right side is a column's name, with or without its unit, or its number
/// from 1. A name may hold commas.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ColumnMap {
    pub(super) pairs: Vec<(ColumnKey, String)>,
    /// The column that is the force of a component (`F=NAME`): an input after all others.
    pub(super) force: Option<String>,
}

/// Why a text is no [`ColumnMap`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ColumnMapError {
    /// No equals sign.
    #[error("`{0}` has no `=`: write `x=NAME`, several with commas between them")]
    NoEquals(String),
    /// The left side is none of the known names.
    #[error("`{0}` is none of t, x, v, a, u (or x1, x2, …) and record")]
    UnknownKey(String),
    /// Numbers count from 1.
    #[error("`{0}`: numbers count from 1")]
    Zero(String),
    /// Nothing on the right side.
    #[error("`{0}=` names no column")]
    NoName(String),
    /// The same left side twice.
    #[error("`{0}` is given twice")]
    Twice(String),
}

impl ColumnMap {
    /// True if nothing is said.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty() && self.force.is_none()
    }

    /// True if every column is called by a name, none by its number.
    pub fn names_all(&self) -> bool {
        self.pairs.iter().map(|(_, column)| column).chain(&self.force).all(|column| column.parse::<usize>().is_err())
    }

    /// The column that is the force of a component, as it was named.
    pub fn force(&self) -> Option<&str> {
        self.force.as_deref()
    }

    /// The same with this column as the force of a component.
    #[must_use]
    pub fn with_force(self, column: impl Into<String>) -> Self {
        Self { force: Some(column.into()), ..self }
    }

    /// What each named column is. Beside a force of a component, inputs count from 1 and the force is the one after them.
    pub(super) fn assigned(&self) -> Vec<(ColumnKey, &str)> {
        let numbered = |key: ColumnKey| match (key.quantity, key.number, &self.force) {
            (ColumnQuantity::Input, None, Some(_)) => ColumnKey { number: Some(1), ..key },
            _ => key,
        };
        let mut all: Vec<(ColumnKey, &str)> =
            self.pairs.iter().map(|(key, column)| (numbered(*key), column.as_str())).collect();
        if let Some(force) = &self.force {
            let inputs = all.iter().filter(|(key, _)| key.quantity == ColumnQuantity::Input);
            let number = inputs.filter_map(|(key, _)| key.number).max().map(|last| last + 1);
            all.push((ColumnKey { quantity: ColumnQuantity::Input, number }, force));
        }
        all
    }

    /// Adds or replaces one pair, as in `x2` and the column's name.
    ///
    /// # Errors
    /// A left side that is none of the known names, or an empty column name.
    pub fn set(&mut self, key: &str, column: &str) -> Result<(), ColumnMapError> {
        let (key, column) = pair(key, column)?;
        self.pairs.retain(|(k, _)| *k != key);
        self.pairs.push((key, column));
        Ok(())
    }
}

fn pair(key: &str, column: &str) -> Result<(ColumnKey, String), ColumnMapError> {
    let bare = |c: char| c.is_whitespace() || c == '"' || c == ',';
    let (key, column) = (key.trim(), column.trim_matches(bare));
    let known = ColumnKey::of_word(key).ok_or_else(|| ColumnMapError::UnknownKey(key.to_owned()))?;
    if known.number == Some(0) {
        return Err(ColumnMapError::Zero(key.to_owned()));
    }
    if column.is_empty() {
        return Err(ColumnMapError::NoName(key.to_owned()));
    }
    Ok((known, column.to_owned()))
}

impl FromStr for ColumnMap {
    type Err = ColumnMapError;

    fn from_str(text: &str) -> Result<Self, ColumnMapError> {
        let mut pieces: Vec<String> = Vec::new();
        for piece in text.split(',') {
            // A piece that starts no pair of its own belongs to a name with a comma in it.
            match pieces.last_mut() {
                Some(last) if !piece.contains('=') && !piece.trim().is_empty() => {
                    last.push(',');
                    last.push_str(piece);
                }
                _ => pieces.push(piece.to_owned()),
            }
        }
        let mut map = Self::default();
        for piece in pieces.iter().filter(|p| !p.trim().is_empty()) {
            let (key, column) =
                piece.split_once('=').ok_or_else(|| ColumnMapError::NoEquals(piece.trim().to_owned()))?;
            if key.trim() == "F" {
                let (_, column) = pair("u", column).map_err(|_| ColumnMapError::NoName("F".into()))?;
                if map.force.replace(column).is_some() {
                    return Err(ColumnMapError::Twice("F".into()));
                }
                continue;
            }
            let (key, column) = pair(key, column)?;
            if map.pairs.iter().any(|(k, _)| *k == key) {
                return Err(ColumnMapError::Twice(key.to_string()));
            }
            map.pairs.push((key, column));
        }
        Ok(map)
    }
}

impl fmt::Display for ColumnMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, (key, name)) in self.pairs.iter().enumerate() {
            write!(f, "{}{key}={name}", if i > 0 { "," } else { "" })?;
        }
        if let Some(name) = &self.force {
            write!(f, "{}F={name}", if self.pairs.is_empty() { "" } else { "," })?;
        }
        Ok(())
    }
}

impl TryFrom<String> for ColumnMap {
    type Error = ColumnMapError;

    fn try_from(text: String) -> Result<Self, ColumnMapError> {
        text.parse()
    }
}

impl From<ColumnMap> for String {
    fn from(map: ColumnMap) -> Self {
        map.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_read_and_print_back() {
        for text in ["", "F=load cell", "x=a,u=b,F=c", "t=Time", "x1=a,x2=b,u=c=d", "record=run no, left,t=1"] {
            assert_eq!(text.parse::<ColumnMap>().unwrap().to_string(), text);
        }
        let spoken: ColumnMap = "time=A, displacement=\"B\" ,force2=C,trial=D".parse().unwrap();
        assert_eq!(spoken.to_string(), "t=A,x=B,u2=C,record=D");
        for (text, message) in [
            ("x", "`x` has no `=`: write `x=NAME`, several with commas between them"),
            ("y=a", "`y` is none of t, x, v, a, u (or x1, x2, …) and record"),
            ("t1=a", "`t1` is none of t, x, v, a, u (or x1, x2, …) and record"),
            ("x0=a", "`x0`: numbers count from 1"),
            ("x=", "`x=` names no column"),
            ("x=a,x=b", "`x` is given twice"),
        ] {
            assert_eq!(text.parse::<ColumnMap>().unwrap_err().to_string(), message);
        }
    }
}
