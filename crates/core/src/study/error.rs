//! Why a study ends without an outcome, and the flag that ends it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::remedy::Remedy;

/// Why a study has no outcome.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// No record is marked fit.
    #[error("there is nothing to fit: mark at least one record as fit")]
    NothingToFit,
    /// Two records measure different things.
    #[error("{0}")]
    RecordsDiffer(String),
    /// A setting does not fit the records.
    #[error("{0}")]
    Setting(String),
    /// Stopped from outside.
    #[error("cancelled")]
    Cancelled,
}

impl StudyError {
    /// What to try, each by itself.
    pub fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::RecordsDiffer(_) => vec![
                Remedy::to_do("give records with the same channels and units"),
                Remedy::columns::<String, String>([]),
            ],
            Self::Setting(_) => vec![Remedy::LeaveToData],
            Self::NothingToFit | Self::Cancelled => Vec::new(),
        }
    }
}

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

    /// The flag itself, for loops that only read it.
    pub fn flag(&self) -> &AtomicBool {
        &self.0
    }

    pub(super) fn check(&self) -> Result<(), StudyError> {
        if self.is_cancelled() { Err(StudyError::Cancelled) } else { Ok(()) }
    }
}
