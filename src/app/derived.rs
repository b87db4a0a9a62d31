//! What was computed from the state, and what is being computed: it can be thrown away at any time.

use std::collections::HashMap;
use std::sync::{Arc, Weak};

use super::columns::Columns;
use super::component::ComponentRoom;
use super::history::History;
use super::jobs::Key;
use super::lessons::Teacher;
use super::missing::Missing;
use super::modal::ModalRoom;
use super::notices::Notices;
use super::open::Refused;
use super::questions::Questions;
use super::queue::JobProgress;
use super::records::OpenRecords;
use super::report::ReportRoom;
use super::rig::RigRoom;
use super::series::SeriesRoom;
use super::settings_map::SettingsMap;
use super::state::{Edit, Shown};
use super::stream::StreamRoom;
use super::views::{MapProgress, Picture, ViewFigures};
use sindyscope_core::study::Outcome;

/// What was computed.
pub(crate) struct Derived {
    /// The records that are open and what the last study says of them.
    pub(crate) records: OpenRecords,
    /// What was to be opened last and could not be.
    pub(crate) refused: Option<Refused>,
    /// What undo takes back.
    pub(crate) history: History<Edit>,
    pub(crate) missing: Missing,
    pub(crate) modal: ModalRoom,
    pub(crate) component: ComponentRoom,
    pub(crate) report: ReportRoom,
    pub(crate) rig: RigRoom,
    pub(crate) teacher: Teacher,
    pub(crate) stream: StreamRoom,
    pub(crate) series: SeriesRoom,
    pub(crate) map: SettingsMap,
    /// The figures of the views.
    pub(crate) figures: ViewFigures,
    /// How many times all of the data was to be shown again in the views.
    pub(crate) fitted: u64,
    pub(crate) questions: Questions,
    pub(crate) columns: Columns,
    pub(crate) notices: Notices,
    /// What was asked to be studied last: the records' generation, and the settings and usages.
    pub(crate) asked: Option<(u64, Edit)>,
    /// The outcome whose regression was repeated on resampled data, or is being.
    pub(crate) resampled: Weak<Outcome>,
    /// The step of the preparation whose value is being found.
    pub(crate) calibrating: Option<usize>,
    /// What runs or waits to, and how far it has come.
    pub(crate) running: HashMap<Key, JobProgress>,
}

impl Derived {
    /// Nothing is known yet of a document with these decisions.
    pub(crate) fn new(edit: &Edit) -> Self {
        Self {
            records: OpenRecords::default(),
            refused: None,
            history: History::new(edit.clone()),
            missing: Missing::default(),
            modal: ModalRoom::default(),
            component: ComponentRoom::default(),
            report: ReportRoom::default(),
            rig: RigRoom::default(),
            teacher: Teacher::default(),
            stream: StreamRoom::default(),
            series: SeriesRoom::default(),
            map: SettingsMap::default(),
            figures: ViewFigures::default(),
            fitted: 0,
            questions: Questions::default(),
            columns: Columns::default(),
            notices: Notices::default(),
            asked: None,
            resampled: Weak::new(),
            calibrating: None,
            running: HashMap::new(),
        }
    }

    /// How far a job has come; none if nothing is wanted of it.
    pub(crate) fn progress(&self, key: &Key) -> Option<JobProgress> {
        self.running.get(key).copied()
    }

    /// What the views show of the last outcome; none while there is none. `pins` are those whose outcomes are known.
    pub(crate) fn picture<'a>(&'a self, shown: &Shown, pins: &'a [Arc<Outcome>]) -> Option<Picture<'a>> {
        let map = self.map.map();
        let search = MapProgress {
            map: map.map(|(map, _)| map),
            stale: map.is_some_and(|(_, stale)| stale),
            failure: self.map.failure(),
        };
        let outcome = self.records.outcome.as_ref()?;
        let record = self.records.place_in(outcome, shown.record);
        let (previous, stale) = (self.records.ghost(), self.is_stale());
        Some(Picture { outcome, previous, record, stale, search, pins, fitted: self.fitted })
    }

    /// True while records are being read.
    pub(crate) fn opening(&self) -> bool {
        self.running.contains_key(&Key::Open) || self.restoring()
    }

    /// True until the session that was left has come back.
    pub(crate) fn restoring(&self) -> bool {
        self.running.contains_key(&Key::Restore)
    }

    /// True if the outcome that is shown is not that of the settings as they stand.
    pub(crate) fn is_stale(&self) -> bool {
        self.running.contains_key(&Key::Fit) || self.records.failure.is_some()
    }
}
