//! The rows of a batch as a file: CSV, or Parquet by the file's ending.

use std::collections::HashSet;
use std::path::Path;

use serde_json::Value;
use sindyscope_files::{TableColumn, write_parquet};

use super::row::Row;
use super::{BatchError, BatchItem, write_whole};

/// The ending of a Parquet file.
const PARQUET: &str = "parquet";

/// Writes a table in one piece: the records in the order of the list, the columns in the order in which rows have them first.
///
/// As CSV unless the file's name ends in `.parquet`: there numbers are doubles, texts strings, and what does not exist is null. A column
/// that the list has beside the files is one of numbers if each of its cells is.
///
/// # Errors
/// The file cannot be written.
pub fn write_table(path: &Path, rows: &[(&BatchItem, &Row)]) -> Result<(), BatchError> {
    let columns = columns(rows);
    let parquet = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(PARQUET));
    let bytes = if parquet {
        let typed: Vec<TableColumn> = columns.into_iter().map(ResultColumn::typed).collect();
        let mut bytes = Vec::new();
        write_parquet(&typed, &mut bytes).map_err(|e| BatchError::writing(path, &e))?;
        bytes
    } else {
        csv(&columns, rows.len()).map_err(|e| BatchError::writing(path, &std::io::Error::other(e)))?
    };
    write_whole(path, &bytes)
}

/// A column with a cell for each row.
struct ResultColumn {
    name: String,
    cells: Vec<Value>,
    /// Whether its cells are texts of a list that may be numbers.
    said: bool,
}

fn columns(rows: &[(&BatchItem, &Row)]) -> Vec<ResultColumn> {
    let names = rows.iter().map(|(item, _)| Value::String(item.name.clone())).collect();
    let mut columns = vec![ResultColumn { name: "record".into(), cells: names, said: false }];
    let mut known = HashSet::new();
    for (name, _) in rows.iter().flat_map(|(item, _)| &item.said) {
        if known.insert(name) {
            let of = |item: &BatchItem| item.said.iter().find(|(n, _)| n == name).map(|(_, text)| text.clone());
            let cells = rows.iter().map(|(item, _)| of(item).map_or(Value::Null, Value::String)).collect();
            columns.push(ResultColumn { name: name.clone(), cells, said: true });
        }
    }
    let mut known = HashSet::new();
    for name in rows.iter().flat_map(|(_, row)| row.keys()) {
        if known.insert(name) {
            let cells = rows.iter().map(|(_, row)| row.get(name).cloned().unwrap_or(Value::Null)).collect();
            columns.push(ResultColumn { name: name.clone(), cells, said: false });
        }
    }
    columns
}

impl ResultColumn {
    fn typed(self) -> TableColumn {
        let Self { name, cells, said } = self;
        let number = |cell: &Value| match cell {
            Value::Number(number) => number.as_f64(),
            Value::String(text) if said => plain_number(text),
            _ => None,
        };
        let empty = |cell: &Value| cell.is_null() || said && cell == "";
        // A column without any number or text is one of numbers that do not exist, but for those that hold sentences.
        let numbers = name != "error" && cells.iter().all(|cell| empty(cell) || number(cell).is_some());
        if numbers {
            return TableColumn::Numbers(name, cells.iter().map(number).collect());
        }
        TableColumn::Texts(name, cells.iter().map(|cell| (!empty(cell)).then(|| text(cell))).collect())
    }
}

/// A text as a number, unless it is a name that looks like one: `007`.
fn plain_number(text: &str) -> Option<f64> {
    let digits = text.trim_start_matches('-');
    let name = digits.len() > 1 && digits.starts_with('0') && !digits.starts_with("0.");
    text.parse::<f64>().ok().filter(|value| value.is_finite() && !name)
}

fn csv(columns: &[ResultColumn], rows: usize) -> Result<Vec<u8>, String> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(columns.iter().map(|column| &column.name)).map_err(|e| e.to_string())?;
    for k in 0..rows {
        table.write_record(columns.iter().map(|column| text(&column.cells[k]))).map_err(|e| e.to_string())?;
    }
    table.into_inner().map_err(|e| e.to_string())
}

/// A cell; a number that does not exist is empty.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
