//! What every format's reader hands on: named columns of finite numbers.

use super::error::{ReadError, RowPlace};
use super::heading::Heading;
use super::selection::Selection;

/// Rows of a table that are looked at before any column is chosen.
pub(super) const FIRST_ROWS: usize = 200;

/// A table of a file before its columns are chosen.
#[derive(Clone, Debug)]
pub(super) struct TableHead {
    /// What the file calls it; may be empty.
    pub(super) name: String,
    pub(super) headings: Vec<Heading>,
    /// Number of rows; of text, of lines that may hold one.
    pub(super) rows: usize,
    /// Samples a second, if the file tells the sampling apart from the columns, Hz. The last heading is then the time.
    pub(super) rate: Option<f64>,
    /// `first[column][row]`: the first values; NaN where there is no number. Empty where a column was not looked into.
    pub(super) first: Vec<Vec<f64>>,
}

/// Numbers beyond this are no measurement, and sums of their squares overflow.
pub(super) const LARGEST: f64 = 1e100;

/// Decides from the headings which columns are wanted.
pub(super) type Choose<'a> = dyn Fn(&[Heading]) -> Result<Selection, ReadError> + 'a;

/// The wanted columns of a file.
#[derive(Clone, Debug)]
pub(super) struct ColumnTable {
    /// The names of all columns.
    pub(super) headings: Vec<Heading>,
    /// Which of them are wanted.
    pub(super) selection: Selection,
    /// Time stamps in the file's unit. If no time column is wanted: the number of each row, counting those without values,
    /// where such rows are missing between others; else empty.
    pub(super) stamps: Vec<f64>,
    /// One column for each of the selection's channels, in that order, in the file's unit.
    pub(super) channels: Vec<Vec<f64>>,
    /// The trajectory of each row, as an index into `labels`; empty if no such column is wanted.
    pub(super) trajectories: Vec<u32>,
    /// The labels of the trajectories, in order of appearance.
    pub(super) labels: Vec<String>,
    /// The line in which each row stands, or its number in the file, from 1.
    pub(super) rows: Vec<u32>,
    /// True if `rows` are numbers of samples, false if they are lines of a text.
    pub(super) by_sample: bool,
    /// What the reader found and did.
    pub(super) notices: Vec<String>,
}

impl ColumnTable {
    /// Where a row stands in its file.
    pub(super) fn place(&self, row: usize) -> RowPlace {
        let number = self.rows[row] as usize;
        if self.by_sample { RowPlace::Sample(number) } else { RowPlace::Line(number) }
    }
}
