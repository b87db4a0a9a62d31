//! A table of many records as a series: identified parameters over a quantity of the list (amplitude, temperature, time), their
//! trend, and the records that do not fit their siblings.

mod figure;
mod report;
mod table;
mod trend;
mod words;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use table::SeriesRow;
pub use table::{SeriesTable, is_series_table};
pub use trend::Trend;
use trend::{TrendPoint, fitted};
pub use words::TrendWords;

/// Fewest records that a trend is sought in: a line through fewer leaves next to nothing to judge it by.
pub const LEAST_RECORDS: usize = 5;

/// Why a table is no series.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SeriesError {
    /// The table cannot be read.
    #[error("cannot read {file}: {problem}")]
    Read {
        /// The file.
        file: String,
        /// Why.
        problem: String,
    },
    /// No column has the name.
    #[error("{file} has no column `{name}`; it has {known}")]
    NoColumn {
        /// The file.
        file: String,
        /// What was asked for.
        name: String,
        /// The columns that a series can go over.
        known: String,
    },
    /// A cell of the abscissa is no number.
    #[error("{file}, line {line}, column `{column}`: `{text}` is no number")]
    NoNumber {
        /// The file.
        file: String,
        /// Counted from 1.
        line: usize,
        /// The column's name.
        column: String,
        /// What stands there.
        text: String,
    },
    /// The table holds no parameter with a standard error.
    #[error("{0} holds no parameter: a column `NAME` with a column `NAME std_error` beside it, as `batch` writes them")]
    NoParameter(String),
}

/// A parameter of one record.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesPoint {
    /// The record's name.
    pub record: String,
    /// Where it stands in the series.
    pub at: f64,
    /// The parameter.
    pub value: f64,
    /// Its standard error; none where it is not known.
    pub std_error: Option<f64>,
    /// True if it does not fit its siblings.
    pub outlies: bool,
}

/// A parameter along the series.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterSeries {
    /// Its column's name, as `v: x^3`.
    pub name: String,
    /// The records that have it, in the order of the series.
    pub points: Vec<SeriesPoint>,
    /// How it goes along; none for fewer than [`LEAST_RECORDS`] records.
    pub trend: Option<Trend>,
}

/// A record that does not fit its siblings, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OddRecord {
    /// The record's name.
    pub record: String,
    /// Why, a sentence each.
    pub reasons: Vec<String>,
}

/// Parameters over a quantity of the list.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The column that it goes over; none: the order of the table.
    pub over: Option<String>,
    /// Number of records in the table.
    pub records: usize,
    /// Every parameter that at least two records have.
    pub parameters: Vec<ParameterSeries>,
    /// The records that do not fit, in the order of the table.
    pub odd: Vec<OddRecord>,
    /// The records' files, by the records' names, where they are still to be found.
    pub files: BTreeMap<String, PathBuf>,
}

/// Reads a table that a batch wrote as a series over one of its columns, or in its own order.
///
/// # Errors
/// A table that cannot be read, has no such column or no parameter; an abscissa that is no number.
pub fn series(path: &Path, over: Option<&str>) -> Result<Series, SeriesError> {
    SeriesTable::read(path)?.series(over)
}

impl SeriesTable {
    /// The table as a series over one of its columns, or in its own order.
    ///
    /// # Errors
    /// There is no such column, or one of its cells is no number.
    pub fn series(&self, over: Option<&str>) -> Result<Series, SeriesError> {
        let rows = self.rows(over)?;
        let mut reasons: Vec<Vec<String>> = rows.iter().map(|row| row.failure.iter().cloned().collect()).collect();
        let names: Vec<&str> = self.parameters().map(|(name, _)| name).collect();
        let mut parameters: Vec<ParameterSeries> =
            names.iter().enumerate().filter_map(|(k, name)| parameter(&rows, k, name, &mut reasons)).collect();
        parameters.retain(|p| p.points.len() > 1);
        of_other_terms(&rows, &names, &mut reasons);
        let odd = rows.iter().zip(reasons).filter(|(_, reasons)| !reasons.is_empty());
        let odd = odd.map(|(row, reasons)| OddRecord { record: row.record.clone(), reasons }).collect();
        let (over, records) = (over.map(str::to_owned), rows.len());
        Ok(Series { over, records, parameters, odd, files: self.files() })
    }
}

fn parameter(rows: &[SeriesRow], k: usize, name: &str, reasons: &mut [Vec<String>]) -> Option<ParameterSeries> {
    let mut places: Vec<usize> = (0..rows.len()).filter(|r| rows[*r].values[k].is_some()).collect();
    places.sort_by(|a, b| rows[*a].at.total_cmp(&rows[*b].at));
    let reading = |r: &usize| {
        let row = &rows[*r];
        let (value, std_error) = row.values[k]?;
        Some(TrendPoint { at: row.at, value, std_error })
    };
    let readings: Vec<TrendPoint> = places.iter().filter_map(reading).collect();
    if readings.is_empty() {
        return None;
    }
    let trend = (readings.len() >= LEAST_RECORDS).then(|| fitted(&readings));
    let point = |(r, reading): (&usize, &TrendPoint)| {
        let distance = trend.as_ref().map_or(0.0, |t| t.distance(reading));
        let outlies = trend.as_ref().is_some_and(|t| distance > t.bound());
        if outlies {
            reasons[*r].push(format!(
                "{name} lies {distance:.1} standard deviations from the {} of the others",
                if trend.as_ref().is_some_and(Trend::told) { "trend" } else { "mean" }
            ));
        }
        let record = rows[*r].record.clone();
        SeriesPoint { record, at: reading.at, value: reading.value, std_error: reading.std_error, outlies }
    };
    let points = places.iter().zip(&readings).map(point).collect();
    Some(ParameterSeries { name: name.to_owned(), points, trend })
}

/// Names the records whose equation has other terms than that of more than half of them.
fn of_other_terms(rows: &[SeriesRow], names: &[&str], reasons: &mut [Vec<String>]) {
    let used: Vec<&SeriesRow> = rows.iter().filter(|r| r.failure.is_none()).collect();
    for (k, name) in names.iter().enumerate() {
        let with = used.iter().filter(|r| r.values[k].is_some()).count();
        let usual = 2 * with > used.len();
        // Where it is a matter of taste nobody is odd.
        let others = if usual { used.len() - with } else { with };
        if used.len() < LEAST_RECORDS || others == 0 || 5 * others > used.len() {
            continue;
        }
        for (row, reasons) in rows.iter().zip(&mut *reasons) {
            if row.failure.is_none() && row.values[k].is_some() != usual {
                reasons.push(if usual {
                    format!("its equation lacks {name}, which {with} of {} have", used.len())
                } else {
                    format!("its equation has {name}, which {with} of {} have", used.len())
                });
            }
        }
    }
}

impl Series {
    /// What it goes over, in words.
    pub fn abscissa(&self) -> &str {
        self.over.as_deref().unwrap_or("place in the table")
    }

    /// Why a record does not fit; empty where it does.
    pub fn reasons(&self, record: &str) -> &[String] {
        self.odd.iter().find(|odd| odd.record == record).map_or(&[], |odd| &odd.reasons)
    }

    /// The series as JSON: `parameters` with `points` and `trend`, and the records that do not fit.
    pub fn json(&self) -> Value {
        let of = |p: &ParameterSeries| {
            let points: Vec<Value> = p
                .points
                .iter()
                .map(|p| {
                    json!({ "record": p.record, "at": p.at, "value": p.value, "std_error": p.std_error, "outlies": p.outlies })
                })
                .collect();
            json!({ "name": p.name, "points": points, "trend": p.trend.as_ref().map(Trend::json) })
        };
        json!({
            "version": crate::json::VERSION,
            "over": self.over,
            "records": self.records,
            "parameters": self.parameters.iter().map(of).collect::<Vec<_>>(),
            "odd_records": self.odd.iter().map(|o| json!({ "record": o.record, "reasons": o.reasons })).collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
mod tests;
