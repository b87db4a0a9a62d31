//! What a person does with a series.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::app::purpose::ReportForm;
use crate::app::state::SeriesForm;

/// One act.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum SeriesAct {
    /// The series is shown like this now.
    Form(Box<SeriesForm>),
    /// Read the table again: a batch may have written it anew.
    Again,
    /// Show this table, whatever it turns out to be: why it is none is told in its place.
    Open(PathBuf),
    /// Open the file of a record.
    OpenRecord(PathBuf),
    /// Go back to the records.
    Close,
}

/// What is asked for in the room of a series: an act, or something for which the window asks for a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SeriesAsk {
    /// Do this.
    Do(SeriesAct),
    /// Choose another table.
    Open,
    /// Save a picture of the figure.
    SavePicture,
    /// Save these numbers.
    SaveTable(String),
    /// Save the report of the series.
    SaveReport(ReportForm),
}
