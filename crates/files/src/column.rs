//! What the reader of a format hands on: named columns of numbers, or what is wrong with the bytes.

use std::sync::Arc;

use super::error::{ReadError, ReadProblem};
use super::heading::{ColumnKey, ColumnQuantity, Heading, Meaning};
use super::words::printable;
use sindyscope_values::record::units;

/// What is wrong with a file's bytes, told by the reader of its format.
#[derive(Clone, Debug, PartialEq)]
pub struct Flaw {
    /// A clause: `the header of variable x is cut short`.
    pub(super) what: String,
    /// The byte where it was found, from 0.
    pub(super) at: Option<usize>,
    /// What to try; the general advice if empty.
    pub(super) advice: &'static str,
}

impl Flaw {
    /// A flaw of the file as a whole; `what` is a clause, as in `its header gives no channels`.
    pub fn new(what: impl Into<String>) -> Self {
        Self { what: printable(&what.into()), at: None, advice: "" }
    }

    /// A flaw found at a byte, counted from 0.
    pub fn at(what: impl Into<String>, byte: usize) -> Self {
        Self { at: Some(byte), ..Self::new(what) }
    }

    /// The same with advice of its own: what a person can try, as in `export it as PCM of 16 bits`.
    #[must_use]
    pub fn try_this(self, advice: &'static str) -> Self {
        Self { advice, ..self }
    }

    /// The flaw as an error of a file.
    pub(super) fn in_file(self, file: &str, format: &'static str) -> ReadError {
        let Self { what, at, advice } = self;
        ReadError::new(file, ReadProblem::Malformed { format, what, at, advice })
    }
}

/// When a column's samples were taken.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TimeBase {
    /// Not said, or said by another column.
    Unknown,
    /// Evenly; both in seconds.
    Even { start: f64, interval: f64 },
    /// At these instants, in the unit given.
    Stamps(Arc<[f64]>, String),
}

/// Decodes a column.
pub(super) type Decode<'a> = Box<dyn Fn() -> Result<Vec<f64>, Flaw> + 'a>;

/// One column of numbers. They are decoded only where the column is wanted.
pub struct FileColumn<'a> {
    pub(super) heading: Heading,
    /// What the file calls the columns that belong together; may be empty.
    pub(super) group: String,
    pub(super) base: TimeBase,
    /// Number of samples.
    pub(super) len: usize,
    pub(super) decode: Decode<'a>,
}

impl<'a> FileColumn<'a> {
    /// A column of `len` samples, and the unit that the file gives apart from the name (empty where it gives none).
    ///
    /// `decode` gives the samples; NaN stands for one that is missing.
    pub fn new(name: &str, unit: &str, len: usize, decode: impl Fn() -> Result<Vec<f64>, Flaw> + 'a) -> Self {
        let mut heading = if name.trim().is_empty() { Heading::unnamed() } else { named(name, unit) };
        // A field of a structure is what its own name says: `run.x` is a displacement, not a number of a run.
        if let Some((_, field)) = name.rsplit_once('.') {
            let field = named(field, unit);
            if field.meaning != Meaning::Unknown {
                heading.meaning = field.meaning;
            }
        }
        Self { heading, group: String::new(), base: TimeBase::Unknown, len, decode: Box::new(decode) }
    }

    /// The same column, sampled evenly from `start` on; both in seconds.
    #[must_use]
    pub fn sampled_evenly(self, start: f64, interval: f64) -> Self {
        Self { base: TimeBase::Even { start, interval }, ..self }
    }

    /// The same column among those that the file calls by one name, such as a sheet or a channel group. Columns of
    /// different groups do not stand in one record.
    #[must_use]
    pub fn in_group(self, group: impl Into<String>) -> Self {
        Self { group: group.into(), ..self }
    }

    /// The same column, known by the file to be the time.
    #[must_use]
    pub fn into_time(mut self) -> Self {
        self.heading.meaning = Meaning::Known(ColumnKey { quantity: ColumnQuantity::Time, number: None });
        // What a format calls the time is in seconds where the unit is none of time.
        if units::parse(&self.heading.unit).is_none_or(|unit| !unit.is_time()) {
            self.heading.unit = "s".into();
        }
        self
    }

    pub(super) fn is_time(&self) -> bool {
        matches!(self.heading.meaning, Meaning::Known(ColumnKey { quantity: ColumnQuantity::Time, .. }))
    }
}

/// A heading whose unit stands apart from its name; `Newtons` is known as `newtons`.
fn named(name: &str, unit: &str) -> Heading {
    let unit = unit.trim();
    let lower = unit.to_lowercase();
    let known = units::parse(unit).is_none() && units::parse(&lower).is_some();
    let unit = if known { lower.as_str() } else { unit };
    let silent = unit.is_empty() || unit.eq_ignore_ascii_case("none") || unit.eq_ignore_ascii_case("unitless");
    let heading = Heading::new(name, (!silent).then_some(unit));
    if silent || heading.unit == unit {
        return heading;
    }
    // What the file says apart counts more than the end of a name, such as `sine 5 Hz`.
    Heading { name: heading.name, ..Heading::new(&format!("{name} [{unit}]"), None) }
}

/// All columns of a file.
#[derive(Default)]
pub struct FileContents<'a> {
    /// The columns, in the order of the file.
    pub columns: Vec<FileColumn<'a>>,
    /// What the reader found and did, one sentence each: a person reads them beside the records.
    pub notices: Vec<String>,
}
