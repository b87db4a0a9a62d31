//! Many records with the same settings: one row each, resumed wherever it ended, shared among processes.

mod journal;
mod list;
mod missing;
mod row;
mod settings;
mod table;
#[cfg(test)]
mod tests;

use std::fmt;
use std::fs::File;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use crate::analyse::{AnalysisListener, AnalysisProgress, analyse};
use crate::error::AnalysisError;
use crate::json::diagnosed;
use crate::missing::{MissingRequest, search};
use crate::request::AnalysisRequest;
pub use journal::{DoneRecords, Journal, key};
pub use list::{BatchItem, batch_items};
pub use missing::missing_of_settings;
pub use row::{Row, diagnosis_row, failed, row};
pub use settings::settings_of_file;
use sindyscope_core::study::Cancel;
use sindyscope_report::document::{Arrangement, Report};
use sindyscope_search::Diagnosis;
use sindyscope_values::record::RecordSet;
pub use table::write_table;

/// Why a batch ends without its table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BatchError {
    /// A list, folder, journal or file of settings that cannot be read.
    #[error("cannot read {file}: {problem}")]
    Read {
        /// The file or folder.
        file: String,
        /// What the system said.
        problem: String,
    },
    /// A table, journal or report that cannot be written.
    #[error("cannot write {file}: {problem}")]
    Write {
        /// The file.
        file: String,
        /// What the system said.
        problem: String,
    },
    /// A list that is no table.
    #[error("{file} is no list of records: {problem}")]
    List {
        /// The list.
        file: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A list or folder without records.
    #[error("{0} names no record")]
    Empty(String),
    /// Settings that are none.
    #[error("the settings in {file} cannot be used: {problem}")]
    Settings {
        /// The file.
        file: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A journal that another batch has begun.
    #[error(
        "{0} was begun with other settings or by another version; give the table another name, or remove that file"
    )]
    OtherSettings(String),
    /// A journal whose lines are damaged.
    #[error("line {line} of {file} is damaged; remove that line, and its record is done again")]
    Journal {
        /// The journal.
        file: String,
        /// Counted from 1.
        line: usize,
    },
    /// Another process works on the same.
    #[error("another batch is at work on {0}")]
    AtWork(String),
    /// Stopped from outside; what is done is kept.
    #[error("cancelled")]
    Cancelled,
}

impl BatchError {
    fn reading(path: &Path, error: &std::io::Error) -> Self {
        Self::Read { file: path.display().to_string(), problem: error.to_string() }
    }

    fn writing(path: &Path, error: &std::io::Error) -> Self {
        Self::Write { file: path.display().to_string(), problem: error.to_string() }
    }
}

/// One of several parts of a batch, as of a job array: every `count`-th record from `index` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchPart {
    /// From 1 to `count`.
    pub index: usize,
    /// How many parts there are.
    pub count: usize,
}

impl FromStr for BatchPart {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let part = text.split_once('/').and_then(|(k, n)| Some((k.trim().parse().ok()?, n.trim().parse().ok()?)));
        match part {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err(format!("`{text}` is no part: write 1/10 to 10/10")),
        }
    }
}

impl fmt::Display for BatchPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

/// What is to be done.
#[derive(Clone, Debug)]
pub struct BatchRequest {
    /// The records.
    pub items: Vec<BatchItem>,
    /// The study of each; its files are those of the record.
    pub study: AnalysisRequest,
    /// What is searched for, which is what the row tells; none: an equation is identified.
    pub missing: Option<MissingRequest>,
    /// The table to write; what is done is kept in journals beside it.
    pub out: PathBuf,
    /// A folder for a report of each record: its equation and, with a search, what that found.
    pub reports: Option<PathBuf>,
    /// The part to do; none: all, and what other parts have done counts.
    pub part: Option<BatchPart>,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchSummary {
    /// Records of the whole batch.
    pub records: usize,
    /// Those that were done now.
    pub now: usize,
    /// Those that had been done before.
    pub before: usize,
    /// Those that failed, now or before.
    pub failed: usize,
    /// Those that nobody has done yet.
    pub left: usize,
    /// Whether the table was written: not by one of several parts.
    pub written: bool,
}

/// Works through the records on all cores and writes the table.
///
/// A record that cannot be used is a row with its sentence. Whenever the process ends, what is done is not done again; a file that has
/// changed since is. The table does not depend on what ran when: its order is the list's.
///
/// # Errors
/// A journal of another batch; something that cannot be written; cancelled.
pub fn batch(request: &BatchRequest, cancel: &Cancel, tell: AnalysisListener<'_>) -> Result<BatchSummary, BatchError> {
    if let Some(folder) = &request.reports {
        std::fs::create_dir_all(folder).map_err(|e| BatchError::writing(folder, &e))?;
    }
    let keys: Vec<String> = request.items.iter().map(key).collect();
    let (journal, mut done) = Journal::open(&request.out, request.part, &request.settings())?;
    let mine = |k: &usize| request.part.is_none_or(|part| k % part.count == part.index - 1);
    let pending: Vec<usize> = (0..keys.len()).filter(mine).filter(|k| !done.contains_key(&keys[*k])).collect();
    let before = keys.iter().filter(|key| done.contains_key(*key)).count();

    let (next, finished) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let journal = Mutex::new((journal, Vec::new()));
    let worker = || -> Result<(), BatchError> {
        while let Some(k) = pending.get(next.fetch_add(1, Ordering::Relaxed)) {
            let row = one(request, &request.items[*k], cancel)?;
            let mut kept = journal.lock().unwrap_or_else(PoisonError::into_inner);
            kept.0.keep(&keys[*k], &row)?;
            kept.1.push((keys[*k].clone(), row));
            let share = (finished.fetch_add(1, Ordering::Relaxed) + 1) as f64 / pending.len() as f64;
            tell(AnalysisProgress::Share("identifying records", share));
        }
        Ok(())
    };
    tell(AnalysisProgress::Share("identifying records", 0.0));
    // Threads of their own, not tasks of a pool: one that waits for a part of its record would begin another record meanwhile.
    let workers = thread::available_parallelism().map_or(1, usize::from).min(pending.len());
    let results: Vec<Result<(), BatchError>> = thread::scope(|scope| {
        let running: Vec<_> = (0..workers).map(|_| scope.spawn(worker)).collect();
        let broke_off = || Err(BatchError::Cancelled);
        running.into_iter().map(|thread| thread.join().unwrap_or_else(|_| broke_off())).collect()
    });
    results.into_iter().collect::<Result<(), _>>()?;

    let (_, new) = journal.into_inner().unwrap_or_else(PoisonError::into_inner);
    let now = new.len();
    done.extend(new);
    let rows: Vec<(&BatchItem, &Row)> =
        request.items.iter().zip(&keys).filter_map(|(item, key)| Some((item, done.get(key)?))).collect();
    let failed = rows.iter().filter(|(_, row)| row.get("status").is_some_and(|s| s == "failed")).count();
    let written = request.part.is_none();
    if written {
        write_table(&request.out, &rows)?;
    }
    let records = keys.len();
    Ok(BatchSummary { records, now, before, failed, left: records - rows.len(), written })
}

/// What came of one record.
struct Studied {
    row: Row,
    /// Its report as HTML, where one is wanted.
    report: Option<String>,
}

impl BatchRequest {
    /// What a journal is kept by: what is done with other settings is not what is asked for.
    pub fn settings(&self) -> String {
        let Self { study, missing, reports, .. } = self;
        let version = env!("CARGO_PKG_VERSION");
        let missing = missing.as_ref().map_or_else(String::new, |missing| format!(" {missing:?}"));
        format!("{version} {study:?} reports {reports:?}{missing}")
    }
}

/// The row of one record, and its report if one is wanted.
fn one(request: &BatchRequest, item: &BatchItem, cancel: &Cancel) -> Result<Row, BatchError> {
    if cancel.is_cancelled() {
        return Err(BatchError::Cancelled);
    }
    let mut study = request.study.clone();
    study.source.data = vec![item.data.clone()];
    study.source.test = item.test.iter().cloned().collect();
    // One record that breaks off must not cost the others.
    match catch_unwind(AssertUnwindSafe(|| studied(request, item, &study, cancel))) {
        Ok(Ok(Studied { row, report })) => {
            if let (Some(folder), Some(html)) = (&request.reports, report) {
                let name = item.name.replace(['/', '\\', ':'], "_");
                write_whole(&folder.join(format!("{name}.html")), html.as_bytes())?;
            }
            Ok(row)
        }
        Ok(Err(error)) if AnalysisError::is_cancelled(&error) => Err(BatchError::Cancelled),
        Ok(Err(error)) => Ok(failed(&error.to_string())),
        Err(_) => Ok(failed("the analysis broke off: please report it with the record")),
    }
}

/// Identifies the record's equation, searches for what it lacks, or does both where a report is to tell both.
fn studied(
    request: &BatchRequest,
    item: &BatchItem,
    study: &AnalysisRequest,
    cancel: &Cancel,
) -> Result<Studied, AnalysisError> {
    let records = study.source.read()?;
    let walk = |missing: &MissingRequest, records: &RecordSet| -> Result<(Diagnosis, Row), AnalysisError> {
        let diagnosis = search(missing, records, cancel, &|_| ())?;
        let row = diagnosis_row(&diagnosed(&diagnosis, records));
        Ok((diagnosis, row))
    };
    if let (Some(missing), None) = (&request.missing, &request.reports) {
        return Ok(Studied { row: walk(missing, &records)?.1, report: None });
    }
    let analysis = analyse(study, records, cancel, &|_| ())?;
    let walked = request.missing.as_ref().map(|missing| walk(missing, &analysis.records)).transpose()?;
    let (diagnosis, row) = match walked {
        Some((diagnosis, row)) => (Some(diagnosis), row),
        None => (None, row(&analysis)),
    };
    let document = || {
        let report = Report {
            title: &item.name,
            records: &analysis.records,
            outcome: &analysis.outcome,
            choice: analysis.choice.as_deref(),
            command: None,
            diagnosis: diagnosis.as_ref(),
            arrangement: &Arrangement::default(),
        };
        report.html()
    };
    Ok(Studied { row, report: request.reports.is_some().then(document) })
}

/// Writes a file so that it is there in whole or as it was before, whenever the program ends.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), BatchError> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    // The same each time: what is left of a process that was killed is written over by the next.
    name.push(".tmp");
    let temporary = path.with_file_name(name);
    let written = File::create(&temporary).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| std::fs::rename(&temporary, path));
    renamed.map_err(|e| {
        // What is left of a failed attempt is of no use.
        let _ = std::fs::remove_file(&temporary);
        BatchError::writing(path, &e)
    })
}
