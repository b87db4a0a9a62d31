//! What of a batch is done, kept so that nothing is done twice and nothing is half written, whenever the program ends.
//!
//! A journal is lines of JSON, each written in one piece and brought to the disk before the next record counts as done. A line that was
//! cut off by the end of the program is dropped and its record done again.

use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::row::Row;
use super::{BatchError, BatchItem, BatchPart};

/// The version of the lines below.
const VERSION: u32 = 1;

/// The journal that one process writes: what is done, by the records' keys.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
}

/// What is known of the records by their keys.
pub type DoneRecords = HashMap<String, Row>;

impl Journal {
    /// Opens the journal beside a table, of a part of it where there are parts, and reads what it and those of the other parts know.
    ///
    /// # Errors
    /// It cannot be read or written, is damaged or of other settings, or another process works on it.
    pub fn open(table: &Path, part: Option<BatchPart>, settings: &str) -> Result<(Self, DoneRecords), BatchError> {
        let mut done = DoneRecords::new();
        let path = beside(table, &part.map_or_else(String::new, |p| format!(".part-{}-of-{}", p.index, p.count)));
        for other in others(table)?.into_iter().filter(|other| *other != path) {
            let text = std::fs::read(&other).map_err(|e| BatchError::reading(&other, &e))?;
            take(&other, whole_lines(&text), settings, &mut done)?;
        }
        let writing = |e: std::io::Error| BatchError::writing(&path, &e);
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path).map_err(writing)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(BatchError::AtWork(path.display().to_string())),
            // Not every file system has locks; then nothing tells of a second process.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(writing)?;
        let whole = whole_lines(&text);
        take(&path, whole, settings, &mut done)?;
        // A line that was cut off must not run into the next one.
        file.set_len(whole.len() as u64).map_err(writing)?;
        file.seek(SeekFrom::End(0)).map_err(writing)?;
        let mut journal = Self { file, path };
        if whole.is_empty() {
            journal.line(&json!({ "sindyscope_batch": VERSION, "settings": settings }))?;
        }
        Ok((journal, done))
    }

    /// Keeps the row of a record, on the disk once this returns.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep(&mut self, key: &str, row: &Row) -> Result<(), BatchError> {
        self.line(&json!({ "key": key, "row": row }))
    }

    fn line(&mut self, value: &Value) -> Result<(), BatchError> {
        let line = format!("{value}\n");
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|e| BatchError::writing(&self.path, &e))
    }
}

/// What tells a record, as it lies on the disk, from another one or from what it was before.
pub fn key(item: &BatchItem) -> String {
    let stamp = |path: &Path| {
        let of = std::fs::metadata(path).ok();
        let time = of.as_ref().and_then(|m| m.modified().ok()?.duration_since(std::time::UNIX_EPOCH).ok());
        format!("{} {}", of.map_or(0, |m| m.len()), time.map_or(0, |t| t.as_nanos()))
    };
    let files = std::iter::once(&item.data).chain(&item.test);
    let stamps: Vec<String> = files.map(|file| format!("{} {}", file.display(), stamp(file))).collect();
    format!("{}: {}", item.name, stamps.join(", "))
}

fn beside(table: &Path, part: &str) -> PathBuf {
    let mut name = table.file_name().unwrap_or_default().to_os_string();
    name.push(format!("{part}.journal"));
    table.with_file_name(name)
}

/// Every journal beside a table.
fn others(table: &Path) -> Result<Vec<PathBuf>, BatchError> {
    let folder = table.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let begin = format!("{}.", table.file_name().unwrap_or_default().to_string_lossy());
    let reading = |e: std::io::Error| BatchError::reading(folder, &e);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(reading)? {
        let name = entry.map_err(reading)?.file_name();
        let text = name.to_string_lossy();
        if text.starts_with(&begin) && text.ends_with(".journal") {
            found.push(table.with_file_name(name));
        }
    }
    found.sort();
    Ok(found)
}

/// The text up to the end of its last whole line.
fn whole_lines(text: &[u8]) -> &[u8] {
    let end = text.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
    &text[..end]
}

/// Takes over what a journal says, if it was of the same settings.
fn take(path: &Path, text: &[u8], settings: &str, done: &mut DoneRecords) -> Result<(), BatchError> {
    for (number, line) in text.split(|b| *b == b'\n').enumerate().filter(|(_, line)| !line.is_empty()) {
        let damaged = || BatchError::Journal { file: path.display().to_string(), line: number + 1 };
        let mut value: Value = serde_json::from_slice(line).map_err(|_| damaged())?;
        if number == 0 {
            if value["sindyscope_batch"] != json!(VERSION) {
                return Err(damaged());
            }
            if value["settings"] != json!(settings) {
                return Err(BatchError::OtherSettings(path.display().to_string()));
            }
            continue;
        }
        match (value["key"].take(), value["row"].take()) {
            (Value::String(key), Value::Object(row)) => drop(done.insert(key, row)),
            _ => return Err(damaged()),
        }
    }
    Ok(())
}
