//! From a message to the state after it: the one place where what a person decided changes.
//!
//! [`update`] touches no file, no thread and no screen; what it wants done in the background it hands back.

mod change;
mod demands;
mod lessons;
mod opening;
mod results;
mod series;
mod stream;
mod walk;

use super::commands::WindowCommand;
use super::derived::Derived;
use super::jobs::{Job, Key};
use super::message::{Message, Sought};
use super::open::Opening;
use super::state::{Room, Source, State};
use super::views::View;
pub(crate) use change::Want;
use change::{Update, run};
pub(crate) use demands::demand;
pub(crate) use results::{FrameTime, failed, finished, part};
use sindyscope_core::study::Calibration;

/// Takes a message over; what is wanted in the background comes back.
pub(crate) fn update(state: &mut State, derived: &mut Derived, message: Message) -> Vec<Want> {
    run(state, derived, |update| update.take(message))
}

/// Opens the document of a state that was read or made.
pub(crate) fn begin(state: &mut State, derived: &mut Derived) -> Vec<Want> {
    run(state, derived, |update| update.begin_with_document())
}

impl Update<'_> {
    fn take(&mut self, message: Message) {
        match message {
            Message::Do(command) => self.run(command),
            Message::OpenSource(source) => self.open_source(source),
            Message::Open(paths) => self.open(&paths),
            Message::Add(paths) => self.add_records(&paths),
            Message::Locate(path) => self.located(&path),
            Message::Columns(act) => self.columns_act(act),
            Message::Kind(kind) => self.read_as(kind),
            Message::Prepare(steps) => self.prepare(steps),
            Message::Edit(edit) => self.state.document.edit = *edit,
            Message::Step => self.note_step(),
            Message::ShowRecord(index) => self.state.shown.record = index,
            Message::Cut if self.state.shown.room == Room::Identify => self.state.shown.cutting ^= true,
            // The strip stands above the plots of Identify: from the other room it leads there.
            Message::Cut => (self.state.shown.room, self.state.shown.cutting) = (Room::Identify, true),
            Message::Calibrate { step, sought, role } => self.calibrate(step, sought.of(role)),
            Message::StopOpening => self.cancel(Key::Open),
            Message::StopChoosing => {
                self.cancel(Key::Choose);
                self.cancel(Key::Calibrate);
            }
            Message::Set { window, threshold } => self.set(window, threshold),
            Message::Pin => self.pin(),
            Message::Unpin(index) => {
                self.unpin(index);
                // The places of those that are being made again have changed.
                if self.derived.running.contains_key(&Key::Pins) {
                    self.bring_back_pins();
                }
            }
            Message::Return(index) => {
                if let Some(pin) = self.state.document.pins.get(index) {
                    let settings = pin.settings.clone();
                    self.change_settings(|old| *old = settings);
                }
            }
            Message::Views(views) => self.state.shown.views = *views,
            Message::Modal(shown) => self.state.shown.modal = *shown,
            Message::Component(view) => self.state.shown.component = view,
            Message::ComponentSearch(begins) => self.component_search(begins),
            Message::ModalSearch(begins) => self.modal_search(begins),
            Message::Walk(act) => self.walk(act),
            Message::WalkView(view) => self.state.shown.walk = *view,
            Message::Stream(act) => self.stream(act),
            Message::Series(act) => self.series_act(act),
            Message::Rig(rig) => self.state.rig = *rig,
            Message::RigStep => self.derived.rig.note(&self.state.rig),
            Message::RigAct(act) => self.rig_act(act),
            Message::Lesson(ask) => self.lesson(ask),
            Message::PageWidth(width) => self.derived.report.widen(width),
            Message::Theme(theme) => self.state.theme = theme,
            Message::Zoom(zoom) => self.state.zoom = zoom,
            Message::Figure(look) => self.state.figure = look,
            Message::ProjectSaved(path) => {
                self.state.remember(&path);
                self.state.project = Some(path);
            }
        }
    }

    /// Does a command; those of the window alone do nothing here.
    fn run(&mut self, command: WindowCommand) {
        match command {
            WindowCommand::Sample(sample) => self.open_source(Source::Sample(sample)),
            WindowCommand::Lessons => self.show_lessons(),
            WindowCommand::Columns => self.show_columns(),
            WindowCommand::Stream => {
                self.hide_series();
                (self.state.stream.shown, self.state.shown.room) = (true, Room::Identify);
            }
            WindowCommand::Close => self.close(),
            WindowCommand::Undo | WindowCommand::Redo if self.state.shown.room == Room::Rig => {
                self.derived.rig.step(&mut self.state.rig, command == WindowCommand::Undo);
            }
            WindowCommand::Undo => {
                if let Some(edit) = self.derived.history.undo(&self.state.document.edit) {
                    self.take_back(edit);
                }
            }
            WindowCommand::Redo => {
                if let Some(edit) = self.derived.history.redo(&self.state.document.edit) {
                    self.take_back(edit);
                }
            }
            WindowCommand::Choose if !self.derived.records.records.is_empty() => {
                let (records, settings) = self.study();
                self.want_instead(Key::Choose, Job::Choose { records, settings });
            }
            WindowCommand::Reset => {
                if let Some(suggestion) = &self.state.document.suggestion {
                    self.state.document.edit.settings = suggestion.clone();
                }
            }
            WindowCommand::View(view) => self.show_view(view),
            WindowCommand::Room(room) => self.state.shown.room = room,
            WindowCommand::FitView => self.derived.fitted += 1,
            _ => {}
        }
    }

    /// Shows a view; the one that was shown is come back to with its group.
    pub(super) fn show_view(&mut self, view: View) {
        let shown = &mut self.state.shown;
        shown.views.remember(shown.view);
        shown.view = view;
    }

    fn set(&mut self, window: Option<usize>, threshold: f64) {
        self.change_settings(|settings| {
            if let Some(window) = window {
                settings.smoothing = settings.smoothing.with_window(window);
            }
            settings.threshold = threshold;
        });
    }

    fn calibrate(&mut self, step: usize, sought: Calibration) {
        self.derived.calibrating = Some(step);
        let (records, settings) = self.study();
        self.want_instead(Key::Calibrate, Job::Calibrate { records, settings, step, sought });
    }

    fn begin_with_document(&mut self) {
        self.derived.teacher.begin();
        if self.state.document.source == Source::Nothing {
            return;
        }
        let document = self.state.document.clone();
        self.bring_back_findings(&document);
        let folder = self.state.folder(&document.source, &document.reading).cloned();
        self.open_with(Opening { document, folder, ..Opening::default() });
    }
}

impl Sought {
    fn of(self, role: sindyscope_values::record::Role) -> Calibration {
        match self {
            Self::Delay => Calibration::Delay(role),
            Self::Gain => Calibration::Gain(role),
        }
    }
}
