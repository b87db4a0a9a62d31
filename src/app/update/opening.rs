//! Opening, adding and closing records, and reading or preparing them in another way.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::change::Update;
use crate::app::columns::{ColumnsAct, WantedColumns};
use crate::app::commands::WindowCommand;
use crate::app::jobs::{Job, Key};
use crate::app::notices::Level;
use crate::app::open::{Opened, OpenedProject, Opening, Refused};
use crate::app::records::Read;
use crate::app::state::{Document, Edit, Room, Source, WalkView, absolute};
use sindyscope_core::prepare::{Preparation, Treatment, bridged};
use sindyscope_core::study::{Calibrated, Settings};
use sindyscope_files::ReadOptions;
use sindyscope_values::format::number::format_measured;
use sindyscope_values::record::Usage;
use sindyscope_values::term::Kind;

/// Jobs on the records that are open: with others they are in vain.
const OF_THE_RECORDS: [Key; 10] = [
    Key::Choose,
    Key::Calibrate,
    Key::Fit,
    Key::Modes,
    Key::ModalSearch,
    Key::Component,
    Key::ComponentSearch,
    Key::Resample,
    Key::Pins,
    Key::Answers,
];

impl Update<'_> {
    pub(super) fn open_with(&mut self, opening: Opening) {
        self.derived.refused = None;
        self.want_instead(Key::Open, Job::Open(Box::new(opening)));
    }

    /// Opens a source of which nothing is known.
    pub(super) fn open_source(&mut self, source: Source) {
        self.hide_series();
        self.open_with(Opening::of(source));
    }

    /// Opens files: measurements, or a project. What was left with the same files the last time comes back.
    pub(super) fn open(&mut self, paths: &[PathBuf]) {
        self.hide_series();
        let source = Source::Files(paths.iter().map(|path| absolute(path)).collect());
        // Otherwise, whatever was open before says nothing of these files.
        let kept = self.state.kept(&source).filter(|_| source != self.state.document.source).cloned();
        let document = kept.unwrap_or_else(|| Document::of(source));
        let folder = self.state.folder(&document.source, &document.reading).cloned();
        self.open_with(Opening { document, folder, ..Opening::default() });
    }

    /// Shows the columns of the files that were refused, or else of those that are open.
    pub(super) fn show_columns(&mut self) {
        let document = self.derived.refused.as_ref().map_or(&self.state.document, |refused| &refused.opening.document);
        if let Source::Files(files) = &document.source {
            let wanted = self.derived.columns.open(files.clone(), &document.reading);
            self.read_columns(wanted);
        }
    }

    /// Asks for what the window of columns wants to read.
    pub(super) fn read_columns(&mut self, wanted: Option<WantedColumns>) {
        match wanted {
            Some(WantedColumns::Overview { path, reading }) => {
                self.cancel(Key::Preview);
                self.want_instead(Key::Columns, Job::Columns { path, reading });
            }
            Some(WantedColumns::Preview { path, reading }) => {
                self.want_instead(Key::Preview, Job::Preview { path, reading });
            }
            None => {}
        }
    }

    /// Does what the window of columns asks for.
    pub(super) fn columns_act(&mut self, act: ColumnsAct) {
        match act {
            ColumnsAct::Choose(draft) => self.derived.columns.choose(draft),
            ColumnsAct::Close => self.derived.columns.close(),
            ColumnsAct::Read(reading) => {
                self.derived.columns.close();
                self.read_with(reading);
            }
        }
    }

    /// Reads the files with the columns that a person chose.
    fn read_with(&mut self, reading: ReadOptions) {
        match self.derived.refused.take() {
            Some(refused) => {
                let document = Document { reading, ..refused.opening.document };
                self.open_with(Opening { document, folder: None, ..refused.opening });
            }
            None => self.read_anew(reading),
        }
    }

    /// Reads the same source for equations of another order: which columns are states depends on it.
    pub(super) fn read_as(&mut self, kind: Kind) {
        self.note_step();
        self.read_anew(ReadOptions { kind, ..self.state.document.reading.clone() });
    }

    /// Reads the same source in another way, with settings that suit it.
    fn read_anew(&mut self, reading: ReadOptions) {
        let document = &self.state.document;
        let edit = Edit {
            settings: Settings::default(),
            usage: Vec::new(),
            walk: document.edit.walk.afresh(),
            ..document.edit.clone()
        };
        let document = Document { reading, edit, suggestion: None, ..document.clone() };
        self.open_with(Opening { document, usage: self.usage_by_name(), ..Opening::default() });
    }

    /// Adds the records of files to those that are open.
    pub(super) fn add_records(&mut self, paths: &[PathBuf]) {
        let Source::Files(open) = &self.state.document.source else {
            let told = "Records are added to files; a sample stands alone, so the files were opened instead";
            self.derived.notices.note(told);
            return self.open(paths);
        };
        let new = paths.iter().map(|path| absolute(path)).filter(|path| !open.contains(path));
        let source = Source::Files(open.iter().cloned().chain(new).collect());
        let document = Document { source, suggestion: None, ..self.state.document.clone() };
        self.open_with(Opening { document, usage: self.usage_by_name(), goes_on: true, ..Opening::default() });
    }

    /// Opens what was refused with the file that was missing, where a person found it.
    pub(super) fn located(&mut self, path: &Path) {
        let Some(refused) = self.derived.refused.take() else { return };
        let mut opening = refused.opening;
        opening.moved.extend(refused.problem.missing.map(|missing| (missing, absolute(path))));
        self.open_with(opening);
    }

    /// What each record is used for, by its name.
    fn usage_by_name(&self) -> BTreeMap<String, Usage> {
        let names = self.derived.records.records.iter().map(|record| record.name.clone());
        names.zip(self.state.document.edit.usage.iter().copied()).collect()
    }

    /// Puts what was opened in place of what is open.
    pub(super) fn opened(&mut self, opened: Opened) {
        let Opened { mut document, records, read, undone, project, notes, goes_on, asked, remembered } = opened;
        self.remember_files(&document, project.as_ref());
        let was_open = !self.derived.records.records.is_empty();
        let unchanged = [&document.source, &asked].contains(&&self.state.document.source);
        let same = unchanged || goes_on;
        if !same {
            self.leave(&document, remembered);
        }
        for note in notes {
            self.derived.notices.note(note);
        }
        for key in OF_THE_RECORDS {
            self.cancel(key);
        }
        let channels = |r: &ReadOptions| (r.kind, r.columns.clone(), r.only_named, r.rate);
        let alike = channels(&document.reading) == channels(&self.state.document.reading);
        let old = self.derived.records.open(records, read, undone);
        if unchanged && was_open {
            // Another order or preparation of the same records is a step that can be taken back.
            self.derived.history.note(&document.edit);
        } else {
            self.forget_steps(&document.edit);
        }
        if project.is_some() || !same {
            self.bring_back_findings(&document);
        }
        let count = self.derived.records.records.len();
        for pin in &mut document.pins {
            // A record that was not there had no part in it.
            pin.usage.resize(pin.usage.len().max(count), Usage::Off);
        }
        self.state.shown.record = if same { self.state.shown.record.min(count.saturating_sub(1)) } else { 0 };
        let of_a_project = project.is_some();
        let pins = std::mem::replace(&mut self.state.document, document).pins;
        match project {
            Some(project) => self.show_project(project),
            None => self.state.project = self.state.project.take().filter(|_| same),
        }
        if unchanged && was_open && alike && !of_a_project {
            // Outcomes of the records as they were prepared before can be compared all the same, and the last one stays in
            // view until the new one comes.
            self.state.document.pins = pins;
            (self.derived.records.pins, self.derived.records.outcome) = (old.pins, old.outcome);
        } else {
            self.bring_back_pins();
        }
        self.derived.fitted += 1;
        self.derived.asked = None;
    }

    /// Puts the files at the head of the recent ones, and notes how those of their folder are read.
    fn remember_files(&mut self, document: &Document, project: Option<&OpenedProject>) {
        let Source::Files(paths) = &document.source else { return };
        let remembered = project.map_or(&paths[..], |project| std::slice::from_ref(&project.path));
        for path in remembered.iter().rev() {
            self.state.remember(path);
        }
        if let Some(file) = paths.first() {
            self.state.keep_folder(file, &document.reading);
        }
    }

    /// Leaves what is open for another source.
    fn leave(&mut self, next: &Document, remembered: bool) {
        self.state.keep();
        self.derived.notices.settle();
        if remembered {
            let reset = WindowCommand::Reset.spec().label;
            let told = format!("The settings of the last time are back; {reset} takes the program's own");
            self.derived.notices.note(told);
        }
        let of_the_rig = matches!(next.source, Source::Rig(_) | Source::Round(_));
        if self.state.shown.room == Room::Rig && !of_the_rig {
            self.state.shown.room = Room::Identify;
        }
        self.state.shown.walk = WalkView::default();
        if matches!(next.source, Source::Hidden(_)) {
            self.state.shown.room = Room::Missing;
            self.derived.missing.look_by_itself();
        }
    }

    /// Shows what the project showed.
    fn show_project(&mut self, project: OpenedProject) {
        if let Some(shown) = project.shown {
            self.state.shown = shown;
            let names = &self.derived.records.records;
            self.state.shown.record = names.iter().position(|r| r.name == project.record).unwrap_or(0);
        }
        if let Some(rig) = project.rig {
            self.state.rig = rig;
        }
        self.state.project = Some(project.path);
    }

    /// Notes what could not be opened: it stays the source to come back to, with all that belongs to it.
    pub(super) fn not_opened(&mut self, refused: Refused) {
        if let (Some(table), false) = (&refused.problem.series, refused.opening.goes_on) {
            return self.open_series(table.clone());
        }
        // The card in the left column says it for all to see.
        self.derived.notices.log(Level::Error, refused.problem.what.clone());
        self.state.recent.retain(|path| !refused.gone.contains(path));
        let document = &refused.opening.document;
        if let (true, Source::Files(paths)) = (refused.problem.about_columns, &document.source) {
            let wanted = self.derived.columns.open(paths.clone(), &document.reading);
            self.read_columns(wanted);
        }
        self.derived.refused = Some(refused);
    }

    /// Closes what is open.
    pub(super) fn close(&mut self) {
        self.cancel(Key::Open);
        for key in OF_THE_RECORDS {
            self.cancel(key);
        }
        self.derived.columns.close();
        self.state.keep();
        self.bring_back_findings(&Document::default());
        self.derived.records.close();
        self.state.document = Document::default();
        self.state.project = None;
        self.state.shown.walk = WalkView::default();
        self.derived.refused = None;
        self.forget_steps(&Edit::default());
    }

    /// Takes over a step of the history; one of another order or preparation needs the records made for it.
    pub(super) fn take_back(&mut self, edit: Edit) {
        let document = &self.state.document;
        let kind = edit.settings.kind;
        if kind == document.reading.kind && edit.steps == document.edit.steps {
            self.state.document.edit = edit;
            return;
        }
        let reading = ReadOptions { kind, ..document.reading.clone() };
        let read = self.read_already(&reading, &edit.steps);
        let document = Document { reading, edit, suggestion: None, ..document.clone() };
        self.open_with(Opening { document, read, usage: self.usage_by_name(), ..Opening::default() });
    }

    /// Prepares the records in another way: a step that can be taken back.
    pub(super) fn prepare(&mut self, steps: Vec<Preparation>) {
        if self.derived.opening() || steps == self.state.document.edit.steps {
            return;
        }
        self.note_step();
        let document = &self.state.document;
        // What each record is used for goes by its name: there may be others now.
        let mut edit = Edit { steps, usage: Vec::new(), ..document.edit.clone() };
        if Some(&edit.settings) == document.suggestion.as_ref() {
            edit.settings = Settings::default();
        }
        let read = self.read_already(&document.reading, &edit.steps);
        let document = Document { edit, suggestion: None, ..document.clone() };
        let interval = self.derived.records.records.first().map(|r| r.interval);
        self.open_with(Opening { document, read, usage: self.usage_by_name(), interval, ..Opening::default() });
    }

    /// Puts what was found of a channel, beyond what a step takes out already, into the step.
    pub(super) fn take_out(&mut self, step: usize, found: &Calibrated) {
        let mut steps = self.state.document.edit.steps.clone();
        let Some(preparation) = steps.get_mut(step) else { return };
        let text = match &mut preparation.treatment {
            Treatment::Align { delay, .. } => {
                let whole = delay.unwrap_or(0.0) + found.value;
                *delay = Some(whole);
                format!("late by {} ms", format_measured(1e3 * whole, found.std_error.map(|e| 1e3 * e)))
            }
            Treatment::Gain { gain, .. } => {
                let before = *gain;
                *gain *= found.value;
                format!("gain {}", format_measured(*gain, found.std_error.map(|e| e * before)))
            }
            _ => return,
        };
        self.derived.notices.done(format!("Found with the equation: {text}"));
        self.prepare(steps);
    }

    /// The records as they were read, if they would be read alike again.
    fn read_already(&self, reading: &ReadOptions, steps: &[Preparation]) -> Option<Read> {
        let now = &self.state.document.reading;
        let alike = reading.kind == now.kind && bridged(steps) == now.bridge;
        alike.then(|| self.derived.records.read())
    }
}
