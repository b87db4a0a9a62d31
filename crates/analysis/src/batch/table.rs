//! The rows of a batch as CSV.

use std::path::Path;

use serde_json::Value;

use super::row::Row;
use super::{BatchError, BatchItem, write_whole};

/// Writes a table in one piece: the records in the order of the list, the columns in the order in which rows have them first.
pub(super) fn write(path: &Path, rows: &[(&BatchItem, &Row)]) -> Result<(), BatchError> {
    let mut names: Vec<&str> = Vec::new();
    let mut places = std::collections::HashSet::new();
    let said = rows.iter().flat_map(|(item, _)| item.said.iter().map(|(name, _)| name.as_str()));
    let mut own: Vec<&str> = Vec::new();
    for name in said {
        if !own.contains(&name) {
            own.push(name);
        }
    }
    for name in rows.iter().flat_map(|(_, row)| row.keys()) {
        if places.insert(name) {
            names.push(name);
        }
    }
    let cannot = |e: csv::Error| BatchError::writing(path, &std::io::Error::other(e));
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["record"].iter().chain(&own).chain(&names)).map_err(cannot)?;
    for (item, row) in rows {
        let of_list = |name: &&str| item.said.iter().find(|(n, _)| n == name).map_or("", |(_, v)| v).to_owned();
        let cells = names.iter().map(|name| row.get(*name).map_or_else(String::new, text));
        let line = std::iter::once(item.name.clone()).chain(own.iter().map(of_list)).chain(cells);
        table.write_record(line).map_err(cannot)?;
    }
    let bytes = table.into_inner().map_err(|e| BatchError::writing(path, &std::io::Error::other(e.to_string())))?;
    write_whole(path, &bytes)
}

/// A cell; a number that does not exist is empty.
fn text(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
