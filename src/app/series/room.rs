//! What was read of a series.

use std::path::{Path, PathBuf};

use crate::app::answer::Answer;
use crate::app::state::SeriesOver;
use sindyscope_analysis::series::{Series, SeriesError, SeriesTable};

/// A series as it was read.
#[derive(Clone, Debug)]
pub(crate) struct OpenSeries {
    /// The columns that it could go over.
    pub(crate) columns: Vec<String>,
    pub(crate) series: Series,
}

/// What was read for what was asked: the table, and what it goes over.
pub(crate) type SeriesRoom = Answer<(PathBuf, Option<SeriesOver>), OpenSeries>;

impl SeriesRoom {
    /// What the line at the bottom says: what it is of, or what became of the table that was asked for, whose reason stands in the centre.
    pub(crate) fn said(&self) -> String {
        match self.found().filter(|_| self.failure().is_none()) {
            Some(open) => {
                let Series { over, records, .. } = &open.series;
                format!("{records} records over {}", over.as_deref().unwrap_or("the order of the table"))
            }
            None if self.is_running() => "reading the table…".to_owned(),
            None => String::new(),
        }
    }
}

/// Reads a table as a series; where nothing is said it goes over the first column that says what was varied, if there is one.
///
/// # Errors
/// The table cannot be read, or is no series over that column.
pub(crate) fn read(table: &Path, over: Option<&SeriesOver>) -> Result<OpenSeries, SeriesError> {
    let table = SeriesTable::read(table)?;
    let over = match over {
        Some(SeriesOver::Column(name)) => Some(name.as_str()),
        Some(SeriesOver::Order) => None,
        None => table.varied(),
    };
    let columns = table.columns().into_iter().map(str::to_owned).collect();
    Ok(OpenSeries { series: table.series(over)?, columns })
}
