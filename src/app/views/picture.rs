//! What a view shows, and what a person may ask for in it.

use std::sync::Arc;

use sindyscope_core::study::{Outcome, SettingsGrid};
use sindyscope_report::view::{Subject, ViewOptions};

/// What a view shows.
#[derive(Clone, Copy)]
pub(crate) struct Picture<'a> {
    /// The outcome.
    pub(crate) outcome: &'a Arc<Outcome>,
    /// The outcome before the last change of settings, drawn as a faint ghost.
    pub(crate) previous: Option<&'a Arc<Outcome>>,
    /// Which of the outcome's records.
    pub(crate) record: usize,
    /// True while a newer outcome is being computed: what is shown is dimmed, not removed.
    pub(crate) stale: bool,
    /// The map of settings.
    pub(crate) search: MapProgress<'a>,
    /// Outcomes kept to be compared, as A, B, C, …
    pub(crate) pins: &'a [Arc<Outcome>],
    /// How many times all of the data was to be shown again.
    pub(crate) fitted: u64,
}

/// How far the search through the settings has come.
#[derive(Clone, Copy, Default)]
pub(crate) struct MapProgress<'a> {
    /// The map, as far as it is known.
    pub(crate) map: Option<&'a Arc<SettingsGrid>>,
    /// True if it is that of older settings.
    pub(crate) stale: bool,
    /// Why there is none.
    pub(crate) failure: Option<&'a str>,
}

impl<'a> Picture<'a> {
    /// An outcome's first record and nothing beside it.
    pub(crate) fn of(outcome: &'a Arc<Outcome>) -> Self {
        let (previous, record, stale, search) = (None, 0, false, MapProgress::default());
        Self { outcome, previous, record, stale, search, pins: &[], fitted: 0 }
    }

    pub(super) fn subject(&self, options: &'a ViewOptions) -> Subject<'a> {
        Subject {
            outcome: self.outcome,
            previous: self.previous.map(AsRef::as_ref),
            record: self.record,
            landscape: self.search.map.map(AsRef::as_ref),
            pins: self.pins,
            options,
        }
    }
}

/// What a person asked for in a view and the window has to do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ViewAct {
    /// Show another of the outcome's records.
    ShowRecord(usize),
    /// Save a picture of this view: ask for a file.
    SavePicture,
    /// Save this text, the numbers of a plot as CSV: ask for a file.
    SaveTable(String),
    /// Take this threshold over, and this segment length if there is one.
    Set {
        /// Samples.
        window: Option<usize>,
        /// As the settings compare it.
        threshold: f64,
    },
    /// Keep the outcome shown, to be compared.
    Pin,
    /// Let go of a pinned outcome.
    Unpin(usize),
    /// Take a pinned outcome's settings over.
    Return(usize),
}
