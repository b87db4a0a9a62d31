//! A table of many records, read for its parameters.

use std::path::Path;

use super::SeriesError;

/// What follows a parameter's name in the head of its standard errors.
const ERROR: &str = " std_error";

/// The rows of a table with the parameters that they hold.
pub(super) struct SeriesTable {
    /// Names of columns that have standard errors beside them.
    pub(super) parameters: Vec<String>,
    pub(super) rows: Vec<SeriesRow>,
}

/// One record.
pub(super) struct SeriesRow {
    pub(super) record: String,
    /// Where it stands in the series.
    pub(super) at: f64,
    /// Why it holds nothing, if it does not.
    pub(super) failure: Option<String>,
    /// Each parameter with its standard error.
    pub(super) values: Vec<Option<(f64, Option<f64>)>>,
}

impl SeriesTable {
    pub(super) fn read(path: &Path, over: Option<&str>) -> Result<Self, SeriesError> {
        let file = path.display().to_string();
        let unread = |problem: String| SeriesError::Read { file: file.clone(), problem };
        let mut reader = csv::Reader::from_path(path).map_err(|e| unread(e.to_string()))?;
        let heads: Vec<String> =
            reader.headers().map_err(|e| unread(e.to_string()))?.iter().map(|h| h.trim().to_owned()).collect();
        let place = |name: &str| heads.iter().position(|h| h == name);
        let parameters: Vec<(usize, usize)> =
            heads.iter().enumerate().filter_map(|(k, h)| Some((k, place(&format!("{h}{ERROR}"))?))).collect();
        if parameters.is_empty() {
            return Err(SeriesError::NoParameter(file));
        }
        let abscissa = match over {
            None => None,
            Some(name) => Some(place(name).ok_or_else(|| {
                let known = heads
                    .iter()
                    .filter(|h| !h.ends_with(ERROR) && !["record", "status", "error"].contains(&h.as_str()));
                let known = known.map(String::as_str).collect::<Vec<_>>().join(", ");
                SeriesError::NoColumn { file: file.clone(), name: name.to_owned(), known }
            })?),
        };
        let [name, status, error] = ["record", "status", "error"].map(place);
        let mut rows = Vec::new();
        for (k, line) in reader.records().enumerate() {
            let line = line.map_err(|e| unread(e.to_string()))?;
            let cell = |at: usize| line.get(at).unwrap_or_default().trim();
            let number = |at: usize| cell(at).parse::<f64>().ok().filter(|v| v.is_finite());
            let at = match abscissa {
                None => (k + 1) as f64,
                Some(at) => number(at).ok_or_else(|| SeriesError::NoNumber {
                    file: file.clone(),
                    line: line.position().map_or(k + 2, |p| p.line() as usize),
                    column: heads[at].clone(),
                    text: cell(at).to_owned(),
                })?,
            };
            let failed = status.is_some_and(|at| cell(at) == "failed");
            let why = || error.map_or("it could not be used".to_owned(), |at| format!("it failed: {}", cell(at)));
            rows.push(SeriesRow {
                record: name.map_or_else(|| (k + 1).to_string(), |at| cell(at).to_owned()),
                at,
                failure: failed.then(why),
                values: parameters.iter().map(|(at, error)| number(*at).map(|v| (v, number(*error)))).collect(),
            });
        }
        Ok(Self { parameters: parameters.iter().map(|(at, _)| heads[*at].clone()).collect(), rows })
    }
}
