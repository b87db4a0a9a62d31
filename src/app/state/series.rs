//! What a person has decided of a series: which table it is of, and how it is shown.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// A table of many records as it is shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SeriesForm {
    /// Whether the series is shown in place of the records.
    pub shown: bool,
    /// The table that a batch wrote.
    pub table: Option<PathBuf>,
    /// What the series goes over; none: the first column that says what was varied.
    pub over: Option<SeriesOver>,
    /// The parameter that is shown alone, by its column's name; none: all.
    pub parameter: Option<String>,
}

/// What a series goes over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SeriesOver {
    /// The order of the table.
    Order,
    /// The column of this name.
    Column(String),
}

impl SeriesForm {
    /// What is to be read: the table and what it goes over; none while no series is shown.
    pub(crate) fn wanted(&self) -> Option<(PathBuf, Option<SeriesOver>)> {
        let table = self.table.clone().filter(|_| self.shown)?;
        Some((table, self.over.clone()))
    }
}
