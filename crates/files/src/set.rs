//! Several files as one set of records.

use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;

use super::assemble;
use super::error::ReadError;
use super::file::MeasuredFile;
use super::options::ReadOptions;
use super::shared_units;
use sindyscope_values::record::{Record, RecordSet, Usage};

/// Reads files, each as one or several records, whose names are unique.
///
/// An input that is constant in all of them is left out, with a notice.
///
/// # Errors
/// The first file that cannot be read, or whose samples cannot be used, with the place and the reason.
pub fn read_files<P: AsRef<Path> + Sync>(paths: &[P], options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
    read_set(paths, &[] as &[P], options).map(records)
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
    let read = |path: &&Path| MeasuredFile::open(path)?.read(options);
    joined(paths.par_iter().map(read).collect(), fit.len(), options)
}

/// The records of opened files as one set, those of `fit` to be fitted; otherwise as [`read_set`].
///
/// # Errors
/// As [`read_files`].
pub fn read_opened(
    fit: &[MeasuredFile],
    held_out: &[MeasuredFile],
    options: &ReadOptions,
) -> Result<RecordSet, ReadError> {
    let files: Vec<&MeasuredFile> = fit.iter().chain(held_out).collect();
    joined(files.par_iter().map(|file| file.read(options)).collect(), fit.len(), options)
}

/// Records that were read one by one, each file's by itself, as one set; those of `fit` to be fitted. They were read with
/// [`ReadOptions::keep_constant_inputs`], so that it is decided here what is constant in all; otherwise as [`read_set`].
///
/// # Errors
/// Records whose units do not go together.
pub fn join(fit: Vec<Vec<Record>>, held_out: Vec<Vec<Record>>, options: &ReadOptions) -> Result<RecordSet, ReadError> {
    let fitted = fit.len();
    joined(fit.into_iter().chain(held_out).map(Ok).collect(), fitted, options)
}

/// The records of files as one set; those of the first `fitted` files are fitted.
fn joined(
    files: Vec<Result<Vec<Record>, ReadError>>,
    fitted: usize,
    options: &ReadOptions,
) -> Result<RecordSet, ReadError> {
    let mut records = Vec::new();
    let mut usages = Vec::new();
    for (index, file) in files.into_iter().enumerate() {
        let usage = if index < fitted { Usage::Fit } else { Usage::HeldOut };
        for record in file? {
            records.push(record);
            usages.push(usage);
        }
    }
    let file = |r: &Record| {
        let name = r.source.as_deref().and_then(Path::file_name);
        name.map_or(String::new(), |name| name.to_string_lossy().into_owned())
    };
    shared_units::unify(&mut records, &file)?;
    if !options.keep_constant_inputs {
        assemble::drop_constant_inputs(&mut records, &file);
    }
    let mut set = RecordSet::default();
    set.add(records, Usage::Fit);
    for ((_, entry), usage) in set.entries.iter_mut().zip(usages) {
        *entry = usage;
    }
    tell_of_copies(&mut set);
    Ok(set)
}

/// Notes of each record that is held out and fitted as well, as when a file is given as both: its error is no honest one.
fn tell_of_copies(set: &mut RecordSet) {
    let fitted: Vec<Arc<Record>> = set.with(Usage::Fit).cloned().collect();
    for (record, usage) in &mut set.entries {
        let copy = |other: &&Arc<Record>| {
            let channels = record.channels.iter().zip(&other.channels);
            record.start == other.start
                && record.channels.len() == other.channels.len()
                && channels.into_iter().all(|(a, b)| a.role == b.role && a.values == b.values)
        };
        if *usage == Usage::HeldOut
            && let Some(other) = fitted.iter().find(copy)
        {
            let notice = format!(
                "{}: this record is held out and, as {}, fitted too: its held-out error says nothing of other data",
                record.name, other.name
            );
            Arc::make_mut(record).notices.push(notice);
        }
    }
}

/// Reads the bytes of one file, named as messages and records shall name it.
///
/// # Errors
/// As [`read_files`].
pub fn read_text(name: &str, text: impl AsRef<[u8]>, options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
    let file = MeasuredFile::from_bytes(name, text.as_ref());
    let mut read = file.read(options)?;
    if !options.keep_constant_inputs {
        assemble::drop_constant_inputs(&mut read, &|_| file.name().to_owned());
    }
    let mut set = RecordSet::default();
    set.add(read, Usage::Fit);
    Ok(records(set))
}

/// The records of a set, by themselves.
fn records(set: RecordSet) -> Vec<Record> {
    set.entries.into_iter().map(|(record, _)| Arc::unwrap_or_clone(record)).collect()
}
