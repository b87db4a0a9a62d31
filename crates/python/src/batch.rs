//! The journal and the table of many records, which are those of the command `batch`.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use serde_json::Value;

use crate::error::{error, failed};
use crate::request::request;
use sindyscope_analysis::batch::{
    BatchError, BatchItem, BatchRequest, Journal, Row, failed as failed_row, key, missing_of_settings,
};

/// A record's name or key with its row as JSON.
type NamedRow = (String, String);

/// What of a batch is done, kept beside its table: see the command.
#[pyclass(name = "NativeJournal", module = "sindyscope._native", frozen)]
pub(crate) struct NativeJournal(Mutex<Journal>);

#[pymethods]
impl NativeJournal {
    /// Opens the journal beside a table; gives it with the rows of what is done, as JSON, by their keys. `missing` is the most effects
    /// of a search, where effects are searched for.
    #[staticmethod]
    fn open(table: PathBuf, settings: Vec<(String, String)>, missing: Option<u8>) -> PyResult<(Self, Vec<NamedRow>)> {
        let study = request(&settings)?;
        let missing =
            missing.map(|most| missing_of_settings(&study, most, false)).transpose().map_err(|e| failed(&e))?;
        let asked = BatchRequest { items: Vec::new(), study, missing, out: table, reports: None, part: None };
        let (journal, done) = Journal::open(&asked.out, None, &asked.settings()).map_err(|e| batch_failed(&e))?;
        let done = done.into_iter().map(|(key, row)| (key, Value::Object(row).to_string())).collect();
        Ok((Self(Mutex::new(journal)), done))
    }

    /// Refuses settings that a search for at most so many effects does not take.
    #[staticmethod]
    fn check(settings: Vec<(String, String)>, missing: u8) -> PyResult<()> {
        missing_of_settings(&request(&settings)?, missing, false).map(drop).map_err(|e| failed(&e))
    }

    /// Keeps the row of a record, on the disk once this returns.
    fn keep(&self, py: Python<'_>, key: &str, row: &str) -> PyResult<()> {
        let row = parsed(row)?;
        py.detach(|| self.0.lock().unwrap_or_else(PoisonError::into_inner).keep(key, &row))
            .map_err(|e| batch_failed(&e))
    }

    /// What tells a file, as it lies on the disk, from another one or from what it was before.
    #[staticmethod]
    fn key(name: String, file: PathBuf) -> String {
        key(&BatchItem { name, data: file, test: None, said: Vec::new() })
    }

    /// The row of a record that could not be used, as JSON.
    #[staticmethod]
    fn failed(sentence: &str) -> String {
        Value::Object(failed_row(sentence)).to_string()
    }
}

/// Writes the rows of a batch as a table, CSV or Parquet by its ending, in one piece.
#[pyfunction]
pub(crate) fn write_table(py: Python<'_>, table: PathBuf, rows: Vec<NamedRow>) -> PyResult<()> {
    let item = |name: String| BatchItem { name, data: PathBuf::new(), test: None, said: Vec::new() };
    let rows: Vec<(BatchItem, Row)> =
        rows.into_iter().map(|(name, row)| Ok((item(name), parsed(&row)?))).collect::<PyResult<_>>()?;
    let rows: Vec<(&BatchItem, &Row)> = rows.iter().map(|(item, row)| (item, row)).collect();
    py.detach(|| sindyscope_analysis::batch::write_table(&table, &rows)).map_err(|e| batch_failed(&e))
}

fn parsed(row: &str) -> PyResult<Row> {
    serde_json::from_str(row).map_err(|e| error(format!("a row is no JSON: {e}"), String::new()))
}

fn batch_failed(failure: &BatchError) -> PyErr {
    let advice = match failure {
        BatchError::Write { .. } => "check that the folder exists and may be written to",
        BatchError::Read { .. } => "check the path",
        _ => "",
    };
    error(failure.to_string(), advice.to_owned())
}
