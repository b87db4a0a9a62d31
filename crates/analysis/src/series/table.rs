//! A table of many records, read for its parameters.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use csv::StringRecord;

use super::SeriesError;

/// What follows a parameter's name in the head of its standard errors.
const ERROR: &str = " std_error";
/// What a Parquet file begins with.
const PARQUET: &[u8] = b"PAR1";
/// Columns that a batch writes of every record before what was found.
const RECORD: &str = "record";
const STATUS: &str = "status";
const FAILURE: &str = "error";

/// A table that a batch wrote.
#[derive(Clone, Debug)]
pub struct SeriesTable {
    path: PathBuf,
    heads: Vec<String>,
    /// The line of the file, counted from 1, and its cells.
    lines: Vec<(usize, StringRecord)>,
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

/// True if a file is a table as a batch writes them: with the columns `record`, `status` and `error`, and with a parameter beside its
/// standard error. A measurement is not. `head` is what the file begins with, its first line whole.
pub fn is_series_table(path: &Path, head: &[u8]) -> bool {
    if head.starts_with(PARQUET) {
        return heads_of_parquet(path).is_some_and(|heads| are_heads(&heads));
    }
    let end = head.iter().position(|b| *b == b'\n').unwrap_or(head.len());
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(&head[..end]);
    reader.records().next().is_some_and(|heads| heads.is_ok_and(|heads| are_heads(&heads)))
}

/// True for the heads of a table that a batch wrote.
fn are_heads(heads: &StringRecord) -> bool {
    let has = |name: &str| heads.iter().any(|head| head.trim() == name);
    let parameter = heads.iter().any(|head| head.trim().strip_suffix(ERROR).is_some_and(has));
    heads.get(0).is_some_and(|head| head.trim() == RECORD) && has(STATUS) && has(FAILURE) && parameter
}

impl SeriesTable {
    /// Reads a table.
    ///
    /// # Errors
    /// It cannot be read, or holds no parameter.
    pub fn read(path: &Path) -> Result<Self, SeriesError> {
        let unread = |problem: String| SeriesError::Read { file: path.display().to_string(), problem };
        let bytes = sindyscope_system::fs::read(path).map_err(|e| unread(e.to_string()))?;
        let (heads, lines) = if bytes.starts_with(PARQUET) { parquet(path) } else { lines(&bytes) }.map_err(unread)?;
        let table = Self { path: path.to_owned(), heads: heads.iter().map(str::to_owned).collect(), lines };
        if table.parameters().next().is_none() {
            return Err(SeriesError::NoParameter(table.file()));
        }
        Ok(table)
    }

    /// The columns that a series can go over, for each of their cells is a number: those of the list that the batch worked through, which
    /// say what was varied, then those of what was found.
    pub fn columns(&self) -> Vec<&str> {
        let numbers = |k: usize| !self.lines.is_empty() && self.lines.iter().all(|(_, line)| number(line, k).is_some());
        self.named().into_iter().filter(|name| self.place(name).is_some_and(numbers)).collect()
    }

    /// The columns of which one may be meant, whatever stands in them.
    fn named(&self) -> Vec<&str> {
        let heads = self.heads.iter().map(String::as_str);
        heads.filter(|h| !h.ends_with(ERROR) && ![RECORD, STATUS, FAILURE].contains(h)).collect()
    }

    /// The first column that says what was varied: none where the list had no such column.
    pub fn varied(&self) -> Option<&str> {
        let status = self.place(STATUS)?;
        self.columns().into_iter().find(|name| self.place(name).is_some_and(|k| k < status))
    }

    /// The parameters with the columns of their values and of their standard errors.
    pub(super) fn parameters(&self) -> impl Iterator<Item = (&str, [usize; 2])> {
        let with_error = |(k, head): (usize, &String)| Some([k, self.place(&format!("{head}{ERROR}"))?]);
        self.heads.iter().enumerate().filter_map(with_error).map(|at| (self.heads[at[0]].as_str(), at))
    }

    /// The records over a column, or in the order of the table.
    pub(super) fn rows(&self, over: Option<&str>) -> Result<Vec<SeriesRow>, SeriesError> {
        let abscissa = match over {
            None => None,
            Some(name) => Some(self.place(name).ok_or_else(|| SeriesError::NoColumn {
                file: self.file(),
                name: name.to_owned(),
                known: self.named().join(", "),
            })?),
        };
        let places: Vec<[usize; 2]> = self.parameters().map(|(_, at)| at).collect();
        let [name, status, failure] = [RECORD, STATUS, FAILURE].map(|name| self.place(name));
        let row = |(k, (line, cells)): (usize, &(usize, StringRecord))| {
            let at = match abscissa {
                None => (k + 1) as f64,
                Some(at) => number(cells, at).ok_or_else(|| SeriesError::NoNumber {
                    file: self.file(),
                    line: *line,
                    column: self.heads[at].clone(),
                    text: cell(cells, at).to_owned(),
                })?,
            };
            let failed = status.is_some_and(|at| cell(cells, at) == "failed");
            let why =
                || failure.map_or("it could not be used".to_owned(), |at| format!("it failed: {}", cell(cells, at)));
            let value = |[value, error]: &[usize; 2]| number(cells, *value).map(|v| (v, number(cells, *error)));
            Ok(SeriesRow {
                record: name.map_or_else(|| (k + 1).to_string(), |at| cell(cells, at).to_owned()),
                at,
                failure: failed.then(why),
                values: places.iter().map(value).collect(),
            })
        };
        self.lines.iter().enumerate().map(row).collect()
    }

    /// The files of the records, by the records' names, where they are still to be found: a batch names them as its list or folder does, so
    /// they are sought beside the table and in the folders beside it.
    pub(super) fn files(&self) -> BTreeMap<String, PathBuf> {
        let Some(name) = self.place(RECORD) else { return BTreeMap::new() };
        let folder = self.path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let mut folders = vec![folder.to_owned()];
        let beside = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        folders.extend(beside.filter(|path| path.is_dir()));
        // The same each time, whatever order the system lists them in.
        folders[1..].sort();
        let found = |(_, cells): &(usize, StringRecord)| {
            let record = cell(cells, name);
            let file =
                folders.iter().map(|folder| folder.join(record)).find(|file| !record.is_empty() && file.is_file());
            file.map(|file| (record.to_owned(), file))
        };
        self.lines.iter().filter_map(found).collect()
    }

    fn file(&self) -> String {
        self.path.display().to_string()
    }

    fn place(&self, name: &str) -> Option<usize> {
        self.heads.iter().position(|head| head == name)
    }
}

/// The heads of a table, and each line of it with its number, counted from 1.
type TableLines = (StringRecord, Vec<(usize, StringRecord)>);

fn lines(bytes: &[u8]) -> Result<TableLines, String> {
    // Numbers of lines and cells in a person's words; what else can be wrong is the library's to say.
    let said = |e: csv::Error| match (e.kind(), e.position()) {
        (csv::ErrorKind::UnequalLengths { expected_len, len, .. }, Some(place)) => format!(
            "line {} has {len} cells, the first line {expected_len}: complete the line or take it out",
            place.line()
        ),
        (csv::ErrorKind::Utf8 { .. }, Some(place)) => {
            format!("line {} is no UTF-8: save the table as UTF-8", place.line())
        }
        _ => e.to_string(),
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
    let heads = reader.headers().map_err(said)?.clone();
    let mut lines = Vec::new();
    for (k, line) in reader.records().enumerate() {
        let line = line.map_err(said)?;
        lines.push((line.position().map_or(k + 2, |p| p.line() as usize), line));
    }
    Ok((heads, lines))
}

/// The same of a Parquet table, whose rows are counted as the lines of a CSV file are.
#[cfg(not(target_arch = "wasm32"))]
fn parquet(path: &Path) -> Result<TableLines, String> {
    use sindyscope_files::TableColumn;

    let columns = sindyscope_files::read_parquet(path)
        .map_err(|e| format!("{e}: save it as CSV, or as Parquet without compression"))?;
    let rows = columns.first().map_or(0, TableColumn::len);
    let text = |column: &TableColumn, k: usize| match column {
        // As many digits as bring the number back.
        TableColumn::Numbers(_, cells) => cells[k].map_or_else(String::new, |v| v.to_string()),
        TableColumn::Texts(_, cells) => cells[k].clone().unwrap_or_default(),
    };
    let line = |k: usize| (k + 2, columns.iter().map(|column| text(column, k)).collect());
    Ok((columns.iter().map(TableColumn::name).collect(), (0..rows).map(line).collect()))
}

#[cfg(not(target_arch = "wasm32"))]
fn heads_of_parquet(path: &Path) -> Option<StringRecord> {
    Some(StringRecord::from(sindyscope_files::parquet_heads(path).ok()?))
}

#[cfg(target_arch = "wasm32")]
fn heads_of_parquet(_: &Path) -> Option<StringRecord> {
    None
}

#[cfg(target_arch = "wasm32")]
fn parquet(_: &Path) -> Result<TableLines, String> {
    Err("it is a Parquet table, and a web page reads CSV only".to_owned())
}

fn cell(line: &StringRecord, at: usize) -> &str {
    line.get(at).unwrap_or_default()
}

fn number(line: &StringRecord, at: usize) -> Option<f64> {
    cell(line, at).parse::<f64>().ok().filter(|v| v.is_finite())
}
