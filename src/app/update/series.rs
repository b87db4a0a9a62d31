//! A series: opening its table, reading it for what it is to go over, opening its records.

use std::path::PathBuf;

use super::change::Update;
use crate::app::jobs::{Job, Key};
use crate::app::series::SeriesAct;
use crate::app::state::{Document, Room, SeriesForm, Source, absolute};

impl Update<'_> {
    pub(super) fn series_act(&mut self, act: SeriesAct) {
        match act {
            SeriesAct::Form(form) => self.state.series = *form,
            SeriesAct::Again => self.derived.series.stop(),
            SeriesAct::Open(table) => self.open_series(table),
            SeriesAct::OpenRecord(file) => self.open(&[file]),
            SeriesAct::Close => self.hide_series(),
        }
    }

    /// Shows a table that a batch wrote in place of the records.
    pub(super) fn open_series(&mut self, table: PathBuf) {
        let table = absolute(&table);
        // What it was opened as is no measurement to come back to.
        if self.state.document.source == Source::Files(vec![table.clone()]) {
            self.state.document = Document::default();
        }
        self.state.remember(&table);
        self.derived.series.stop();
        let before = std::mem::take(&mut self.state.series);
        // How the same table was shown the last time comes back.
        let same = before.table.as_ref() == Some(&table);
        let form = if same { before } else { SeriesForm { table: Some(table), ..SeriesForm::default() } };
        self.state.series = SeriesForm { shown: true, ..form };
        self.state.stream.shown = false;
        self.state.shown.room = Room::Identify;
    }

    /// Goes back to the records.
    pub(super) fn hide_series(&mut self) {
        self.state.series.shown = false;
    }

    /// Asks for the table as it is to be shown, if what was asked last is something else.
    pub(super) fn series(&mut self) {
        let Some(wanted) = self.state.series.wanted() else { return };
        if self.derived.series.is_of(&wanted) {
            return;
        }
        let (table, over) = wanted.clone();
        self.derived.series.begin(wanted);
        self.want_instead(Key::Series, Job::Series { table, over });
    }
}
