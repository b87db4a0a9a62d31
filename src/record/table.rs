//! What every format's reader hands on: named columns of finite numbers.

use super::columns::Selection;
use super::error::ReadError;
use super::heading::Heading;

/// A file format that measurements are read from.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// What a file dialog calls it.
    pub name: &'static str,
    /// Endings of its files, without the dot, in lower case.
    pub extensions: &'static [&'static str],
    /// Reads a file's bytes; the function given decides from the headings which columns are wanted.
    pub(super) read: fn(&str, &[u8], &Choose<'_>) -> Result<Table, ReadError>,
}

/// Decides from the headings which columns are wanted.
pub(super) type Choose<'a> = dyn Fn(&[Heading]) -> Result<Selection, ReadError> + 'a;

/// The wanted columns of a file.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// The names of all columns.
    pub(super) headings: Vec<Heading>,
    /// Which of them are wanted.
    pub(super) selection: Selection,
    /// Time stamps in the file's unit; empty if no time column is wanted.
    pub(super) stamps: Vec<f64>,
    /// One column for each of the selection's channels, in that order, in the file's unit.
    pub(super) channels: Vec<Vec<f64>>,
    /// The trajectory of each row, as an index into `labels`; empty if no such column is wanted.
    pub(super) trajectories: Vec<u32>,
    /// The labels of the trajectories, in order of appearance.
    pub(super) labels: Vec<String>,
    /// The line in which each row stands, from 1.
    pub(super) lines: Vec<u32>,
    /// What the reader found and did.
    pub(super) notices: Vec<String>,
}
