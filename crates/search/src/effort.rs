//! What a search costs, counted as it goes: the same on every machine.

use std::sync::atomic::{AtomicUsize, Ordering};

use sindyscope_core::refine::Effort;

/// What a search has done since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SearchEffort {
    /// Integration steps of all fits and of all predictions of data never fitted; a change of side counts as twenty.
    pub steps: usize,
    /// Sets of effects, or formulas, that the regression proposed.
    pub proposed: usize,
    /// Sets that were fitted.
    pub fitted: usize,
}

/// Where it is counted.
#[derive(Debug, Default)]
pub(super) struct Counters {
    /// Integration steps.
    pub(super) steps: Effort,
    proposed: AtomicUsize,
    fitted: AtomicUsize,
}

impl Counters {
    /// The regression proposed so many sets.
    pub(super) fn propose(&self, sets: usize) {
        self.proposed.fetch_add(sets, Ordering::Relaxed);
    }

    /// The fit of a set begins.
    pub(super) fn fit(&self) {
        self.fitted.fetch_add(1, Ordering::Relaxed);
    }

    /// All that was counted so far.
    pub(super) fn so_far(&self) -> SearchEffort {
        SearchEffort {
            steps: self.steps.spent(),
            proposed: self.proposed.load(Ordering::Relaxed),
            fitted: self.fitted.load(Ordering::Relaxed),
        }
    }
}
