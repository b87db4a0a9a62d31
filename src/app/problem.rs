//! Why something cannot be opened, in words for a person.

use std::path::{Path, PathBuf};

use super::remedy;

/// Why something cannot be opened, and what to try.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OpeningProblem {
    pub(crate) what: String,
    pub(crate) advice: String,
    /// Whether saying which column is which may help.
    pub(crate) about_columns: bool,
    /// The file that is not where it was.
    pub(crate) missing: Option<PathBuf>,
    /// The table of a batch that was given as a measurement.
    pub(crate) series: Option<PathBuf>,
}

impl OpeningProblem {
    /// What is wrong, and what to try.
    pub(crate) fn new(what: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { what: what.into(), advice: advice.into(), about_columns: false, missing: None, series: None }
    }

    /// Why a file cannot be read.
    pub(crate) fn reading(error: &sindyscope_files::ReadError) -> Self {
        let about_columns = error.is_about_columns();
        Self { about_columns, ..Self::new(error.to_string(), remedy::worded(&error.remedies())) }
    }
}

/// A path's last part.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
