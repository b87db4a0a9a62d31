//! What a report is made of, and why it may not be written.

use super::arrangement::Arrangement;
use sindyscope_core::study::Outcome;
use sindyscope_search::Diagnosis;
use sindyscope_values::model::{Model, Units};
use sindyscope_values::record::RecordSet;

/// What a report is made of.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The document's title.
    pub title: &'a str,
    /// The records, those that are left out too.
    pub records: &'a RecordSet,
    /// What the study found.
    pub outcome: &'a Outcome,
    /// How the settings were chosen, if the program chose them.
    pub choice: Option<&'a str>,
    /// The command that makes this report again.
    pub command: Option<&'a str>,
    /// What the search for missing effects found, if one was made.
    pub diagnosis: Option<&'a Diagnosis>,
    /// Which sections it has, in which order, with which texts between.
    pub arrangement: &'a Arrangement,
}

/// The units of a model's terms on these records.
pub(super) fn units(records: &RecordSet, model: &Model) -> Units {
    records.entries.first().map_or_else(Units::default, |(r, _)| Units::from_record(r, &model.layout))
}

/// The unit of the first displacement; gaps are in it.
pub(super) fn displacement_unit(records: &RecordSet) -> &str {
    records.entries.iter().find_map(|(r, _)| r.sensor(0)).map_or("", |c| c.unit.as_str())
}

/// Why a report was not written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file's ending that stands for no kind of document.
    #[error("a report can be written to .html, .pdf or .png, not to {0}")]
    Ending(String),
    /// A file's ending that stands for no kind of figure.
    #[error("a figure can be written to .svg, .pdf or .png, not to {0}")]
    FigureEnding(String),
    /// The file could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The picture could not be drawn.
    #[error("cannot draw the report: {0}")]
    Picture(String),
}
