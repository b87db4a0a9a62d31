//! Measured samples: trajectories with their channels, units and roles, read from files and written to them.
//!
//! A file passes through four hands. A format's reader ([`FORMATS`]; `delimited` for CSV, one file in `formats` for each
//! other) finds the header and turns the wanted columns into numbers; `heading` and `columns` decide which these are; `sampling` finds the even grid behind the
//! time stamps; `assemble` makes records of it all. What was found and done on the way stands in each record's notices.

mod assemble;
mod columns;
mod common;
mod contents;
mod delimited;
mod error;
mod formats;
mod guess;
mod heading;
mod overview;
mod table;
mod write;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use columns::{ColumnMap, ColumnMapError};
pub use error::{ReadError, Row};
pub use formats::FORMATS;
pub use overview::{ColumnOverview, ColumnUse, Overview, TableOverview, look};
pub use table::Format;
pub use write::write_csv;

use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::Kind;

/// What a file's header does not say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReadOptions {
    /// Which column is which; what is not said here is decided from the header.
    pub columns: ColumnMap,
    /// Columns that `columns` does not name are ignored, whatever the header says of them.
    pub only_named: bool,
    /// Sampling rate, Hz, instead of a time column.
    pub rate: Option<f64>,
    /// Order of the equations: for first order every velocity is a state, and so are `y` and `z`.
    pub kind: Kind,
    /// So many samples that are missing together are filled in; more split the record. None by itself.
    pub bridge: usize,
    /// Keeps inputs that are constant throughout, for records that join others in which they are not.
    pub keep_constant_inputs: bool,
}

/// The records of a set, by themselves.
fn out_of(set: RecordSet) -> Vec<Record> {
    set.entries.into_iter().map(|(record, _)| Arc::unwrap_or_clone(record)).collect()
}

/// Reads files, each as one or several records, whose names are unique.
///
/// An input that is constant in all of them is left out, with a notice.
///
/// # Errors
/// The first file that cannot be read, or whose samples cannot be used, with the place and the reason.
pub fn read_files<P: AsRef<Path> + Sync>(paths: &[P], options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
    read_set(paths, &[] as &[P], options).map(out_of)
}

/// Reads files to fit and files to hold out as one set, whose names are unique and each of whose quantities has one unit.
///
/// An input that is constant in all of them is left out; one that is at rest in some records only stays in all.
///
/// # Errors
/// As [`read_files`].
pub fn read_set<P: AsRef<Path> + Sync>(
    fit: &[P],
    held_out: &[P],
    options: &ReadOptions,
) -> Result<RecordSet, ReadError> {
    let paths: Vec<&Path> = fit.iter().chain(held_out).map(AsRef::as_ref).collect();
    let files: Vec<Result<Vec<Record>, ReadError>> = paths.par_iter().map(|path| read_file(path, options)).collect();
    let mut records = Vec::new();
    let mut usages = Vec::new();
    for (index, file) in files.into_iter().enumerate() {
        let usage = if index < fit.len() { Usage::Fit } else { Usage::HeldOut };
        for record in file? {
            records.push(record);
            usages.push(usage);
        }
    }
    let file = |r: &Record| r.source.as_deref().map_or(String::new(), file_name);
    common::unify(&mut records, &file)?;
    if !options.keep_constant_inputs {
        assemble::drop_constant_inputs(&mut records, &file);
    }
    let mut set = RecordSet::default();
    set.add(records, Usage::Fit);
    for ((_, entry), usage) in set.entries.iter_mut().zip(usages) {
        *entry = usage;
    }
    Ok(set)
}

/// Reads the bytes of one file, named as messages and records shall name it.
///
/// # Errors
/// As [`read_files`].
pub fn read_text(name: &str, text: impl AsRef<[u8]>, options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
    let mut records = read_bytes(Path::new(name), text.as_ref(), options)?;
    if !options.keep_constant_inputs {
        assemble::drop_constant_inputs(&mut records, &|_| file_name(Path::new(name)));
    }
    let mut set = RecordSet::default();
    set.add(records, Usage::Fit);
    Ok(out_of(set))
}

fn bytes_of(path: &Path) -> Result<Vec<u8>, ReadError> {
    std::fs::read(path).map_err(|error| ReadError::Open { path: path.display().to_string(), reason: error.to_string() })
}

fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn read_file(path: &Path, options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
    let bytes = bytes_of(path)?;
    let mut records = read_bytes(path, &bytes, options)?;
    for record in &mut records {
        record.source = Some(PathBuf::from(path));
    }
    Ok(records)
}

/// True if a file's first bytes are those of a saved project of the window.
pub fn is_project(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    text.trim_start_matches('\u{feff}').trim_start().starts_with('{') && text.contains("\"sindyscope_project\"")
}

fn read_bytes(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
    if is_project(&bytes[..bytes.len().min(1 << 16)]) {
        return Err(ReadError::IsProject { file: file_name(path) });
    }
    if let Some(rate) = options.rate.filter(|r| !(r.is_normal() && *r > 0.0)) {
        return Err(ReadError::BadRate { rate });
    }
    let file = file_name(path);
    let format = formats::of(&ending(path), bytes);
    let table = format.read(&file, bytes, &|headings| columns::assign(&file, headings, options))?;
    let stem = path.file_stem().map_or_else(|| file.clone(), |s| s.to_string_lossy().into_owned());
    assemble::records(&file, &stem, table, options)
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// True if values differ by no more than the rounding of their arithmetic.
fn is_constant(values: &[f64]) -> bool {
    let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
    most - least <= 8.0 * f64::EPSILON * most.abs().max(least.abs())
}

#[cfg(test)]
mod tests;
