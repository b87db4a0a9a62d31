//! Why a study ends without an outcome, and the flag that ends it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::remedy::Remedy;
use sindyscope_values::format::number::significant;

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
    /// Too little of a stream is kept to tell what is usual in it.
    #[error(
        "the last {} s hold {kept} blocks of {} s, each a period of the motion at least, where {blocks} are needed to tell what \
         is usual",
        significant(*last, 3),
        significant(*seconds, 3)
    )]
    StreamTooShort {
        /// What is kept, s.
        last: f64,
        /// Blocks that it holds.
        kept: usize,
        /// Length of a block, s.
        seconds: f64,
        /// Blocks that are needed.
        blocks: usize,
        /// Length of so many, s.
        needed: f64,
    },
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
            Self::StreamTooShort { needed, .. } => {
                vec![Remedy::to_do(format!("keep at least {} s of the stream", significant(*needed, 3)))]
            }
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
