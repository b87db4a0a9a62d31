//! A study is a value: settings and records in, [`Outcome`] out; the same in the window, on the command line and in tests.

mod outcome;
mod settings;

pub use outcome::{
    Channel, DroppedTerm, Elapsed, EquationFit, Outcome, RecordOutcome, Remedy, Score, Severity, StudyError, Warning,
};
pub use settings::{Differentiation, Kinematics, Lock, Scaling, Settings, Smoothing};

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::record::RecordSet;

/// A flag that stops a computation from outside; clones share it.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks the computation to stop at its next check.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// True once cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Runs studies and keeps what the next one can use again: a moved threshold smooths nothing anew.
#[derive(Debug, Default)]
pub struct Study {}

impl Study {
    /// Runs one study.
    ///
    /// # Errors
    /// Settings that do not fit the records, or nothing to fit; cancelled.
    pub fn run(&mut self, records: &RecordSet, settings: &Settings, cancel: &Cancel) -> Result<Outcome, StudyError> {
        let _ = (records, settings);
        if cancel.is_cancelled() { Err(StudyError::Cancelled) } else { Err(StudyError::NothingToFit) }
    }
}

/// Which settings [`choose`] may change.
#[derive(Clone, Copy, Debug)]
pub struct Free {
    /// The smoothing segment length.
    pub window: bool,
    /// The smoothing polynomial's order.
    pub order: bool,
    /// The threshold.
    pub threshold: bool,
}

/// What [`choose`] chose, and why.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The settings chosen.
    pub settings: Settings,
    /// One sentence: what was tried and what decided.
    pub reason: String,
}

/// Settings to start from: a library by the kind of data, smoothing from the signals' noise and period; nothing is simulated.
///
/// # Errors
/// No record, or records whose channels differ.
pub fn suggest(records: &RecordSet, kind: crate::term::Kind) -> Result<Settings, StudyError> {
    let _ = (records, kind);
    Err(StudyError::NothingToFit)
}

/// Chooses the free settings by simulation error on stretches that were not fitted.
///
/// `progress` is told the share done, 0 to 1.
///
/// # Errors
/// As [`Study::run`].
pub fn choose(
    records: &RecordSet,
    start: &Settings,
    free: Free,
    cancel: &Cancel,
    progress: &dyn Fn(f64),
) -> Result<Choice, StudyError> {
    let _ = (records, start, free, cancel, progress);
    Err(StudyError::NothingToFit)
}
