//! The bars, the columns and the centre.

use std::sync::Arc;

use egui::{CentralPanel, Context, Margin, Ui};

use super::{App, Canvas, tabs};
use crate::app::commands::WindowCommand;
use crate::app::component::ComponentAct;
use crate::app::figure_panel::FigurePanelOutcome;
use crate::app::jobs::Key;
use crate::app::message::{Message, Sought};
use crate::app::missing::WalkAct;
use crate::app::modal::ModalAct;
use crate::app::panel::{self, PanelAct, PanelContext};
use crate::app::plot::palette;
use crate::app::program::WindowProgram;
use crate::app::purpose::{Purpose, ReportForm};
use crate::app::report::{self, ReportAct};
use crate::app::rig::RigAct;
use crate::app::state::{Edit, ModalShown, Room, Source, ViewState};
use crate::app::views::{self, ViewAct};
use crate::app::{component, figure_panel, lessons, missing, modal, rig, status, toolbar, welcome};
use sindyscope_core::remedy::Remedy;
use sindyscope_core::study::Calibration;
use sindyscope_modes::BaseModel;

/// Jobs that the line at the bottom tells of beside the fit, the first that runs.
const OTHERS: [Key; 11] = [
    Key::Open,
    Key::Choose,
    Key::Calibrate,
    Key::Modes,
    Key::ModalSearch,
    Key::Component,
    Key::ComponentSearch,
    Key::Search,
    Key::Pages,
    Key::Rig,
    Key::SearchRound,
];

/// What a person did in a frame, to be done once it is drawn.
#[derive(Default)]
struct FrameActs {
    asks: Vec<PanelAct>,
    walk: Vec<WalkAct>,
    messages: Vec<Message>,
    commands: Vec<WindowCommand>,
    /// The numbers of a plot to be saved, and what it is called.
    table: Option<(&'static str, String)>,
    /// The report to be saved.
    report: Option<ReportForm>,
}

impl FrameActs {
    /// Notes what was asked for of a structure's modes; `name` is the figure's.
    fn modal(&mut self, act: Option<ModalAct>, name: &'static str, draft: &mut Edit) {
        match act {
            Some(ModalAct::ShowRecord(index)) => self.messages.push(Message::ShowRecord(index)),
            Some(ModalAct::SavePicture) => self.commands.push(WindowCommand::PlotPicture),
            Some(ModalAct::SaveTable(text)) => self.table = Some((name, text)),
            Some(ModalAct::Poles(poles)) => draft.base.poles = poles,
            Some(ModalAct::Search) => self.messages.push(Message::ModalSearch(true)),
            Some(ModalAct::StopSearch) => self.messages.push(Message::ModalSearch(false)),
            None => {}
        }
    }
}

impl FrameActs {
    /// Notes what was asked for of a component; `name` is the figure's.
    fn component(&mut self, act: Option<ComponentAct>, name: &'static str) {
        self.messages.extend(match act {
            Some(ComponentAct::View(view)) => Some(Message::Component(view)),
            Some(ComponentAct::ShowRecord(index)) => Some(Message::ShowRecord(index)),
            Some(ComponentAct::Search) => Some(Message::ComponentSearch(true)),
            Some(ComponentAct::StopSearch) => Some(Message::ComponentSearch(false)),
            Some(ComponentAct::SavePicture) => {
                self.commands.push(WindowCommand::PlotPicture);
                None
            }
            Some(ComponentAct::SaveTable(text)) => {
                self.table = Some((name, text));
                None
            }
            None => None,
        });
    }
}

impl App {
    /// The bars at the top and at the bottom, and the strip of the open lesson.
    pub(super) fn bars(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let ctx = ui.ctx().clone();
        let WindowProgram { state, derived, .. } = &self.program;
        let edit = &state.document.edit;
        let (can_undo, can_redo) = match state.shown.room {
            Room::Rig => derived.rig.can_step(&state.rig),
            _ => (derived.history.can_undo(edit), derived.history.can_redo(edit)),
        };
        let opening = derived.opening();
        let (drawn, exported) = (self.has_figure(), self.exports_model());
        let bar = toolbar::Toolbar { drawn, exported, can_undo, can_redo, opening, state, data: &derived.records };
        let asked = toolbar::show(ui, &bar);
        for asked in asked {
            match asked {
                toolbar::ToolbarAct::Do(command) => self.run(command, &ctx, frame),
                toolbar::ToolbarAct::Recent(path) => self.program.send(Message::Open(vec![path])),
            }
        }
        let derived = &self.program.derived;
        let said = self.said();
        let mut line = status::Status {
            said,
            fitting: derived.progress(&Key::Fit),
            other: OTHERS.iter().find_map(|key| derived.progress(key)),
            opening,
            data: &derived.records,
            notices: &derived.notices,
            seen: &mut self.canvas.toasted,
            log_open: &mut self.notices_open,
        };
        if status::show(ui, &mut line).is_some() {
            self.program.send(Message::StopOpening);
        }
        if let Some((lesson, position)) = lessons::open(&self.program.state.lessons)
            && let Some(ask) = lessons::show(ui, lesson, position)
        {
            self.program.send(Message::Lesson(ask));
        }
    }

    /// What the line at the bottom says of what is in view; none: how long the study of the records took.
    fn said(&self) -> Option<String> {
        let derived = &self.program.derived;
        if self.shows_series() {
            Some(derived.series.said())
        } else if self.shows_stream() {
            Some(derived.stream.said())
        } else if self.of_component() {
            Some(String::new())
        } else {
            self.by_modes().then(|| derived.modal.said())
        }
    }

    /// The virtual rig's room.
    pub(super) fn rig(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let WindowProgram { state, derived, .. } = &self.program;
        let (room, figures) = (&derived.rig, &mut self.canvas.rig);
        let mut draft = state.rig.clone();
        let mut acts = Vec::new();
        panel::controls(ui, |ui| acts.extend(room.controls(ui, &mut draft)));
        panel::findings(ui, |ui| acts.extend(room.findings(ui, &mut draft)));
        centre(ui, |ui| acts.extend(rig::show(ui, room, figures, &mut draft, &state.lessons)));
        if draft != state.rig {
            self.program.send(Message::Rig(Box::new(draft)));
        }
        for act in acts {
            match act {
                RigAct::Save(purpose) => {
                    let name = match purpose {
                        Purpose::Rounds => "rounds.csv".to_owned(),
                        Purpose::RoundRecords => format!("round-{}.csv", self.program.state.rig.class.rounds.len()),
                        _ => "virtual-rig.csv".to_owned(),
                    };
                    self.dialogs.ask(purpose, &name, frame);
                }
                act => self.program.send(Message::RigAct(act)),
            }
        }
    }

    /// The rooms that work on the records that are open.
    pub(super) fn work(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let ctx = ui.ctx().clone();
        let mut done = FrameActs::default();
        // What is drawn changes drafts: a difference is a message.
        let mut draft = self.program.state.document.edit.clone();
        let mut views = self.program.state.shown.views.clone();
        let mut modal = self.program.state.shown.modal.clone();
        self.canvas.walk.view.clone_from(&self.program.state.shown.walk);
        if let Some(text) = self.program.derived.missing.effects_file.take() {
            self.canvas.walk.take_effects(&text);
        }
        let opened = !self.program.derived.records.records.is_empty();
        if opened || self.program.derived.refused.is_some() {
            self.columns(ui, (&mut draft, &mut modal), &mut done);
        }
        centre(ui, |ui| self.centre(ui, (&mut draft, &mut views, &mut modal), &mut done));
        if draft != self.program.state.document.edit {
            self.program.send(Message::Edit(Box::new(draft)));
        }
        if self.canvas.walk.view != self.program.state.shown.walk {
            self.program.send(Message::WalkView(Box::new(self.canvas.walk.view.clone())));
        }
        if modal != self.program.state.shown.modal {
            self.program.send(Message::Modal(Box::new(modal)));
        }
        // Units are chosen in menus that know no draft.
        views.units.clone_from(&self.program.state.shown.views.units);
        if views != self.program.state.shown.views {
            self.program.send(Message::Views(Box::new(views)));
        }
        let FrameActs { asks, walk, messages, commands, table, report } = done;
        for command in commands {
            self.run(command, &ctx, frame);
        }
        for act in walk {
            self.walk_on(act, &ctx, frame);
        }
        for message in messages {
            self.program.send(message);
        }
        for ask in asks {
            self.answer(ask, &ctx, frame);
        }
        if let Some((what, text)) = table {
            self.table = text;
            self.dialogs.ask(Purpose::Table, &self.file_name(what, "csv"), frame);
        }
        if let Some(saved) = report {
            self.dialogs.ask(Purpose::Report(saved), &self.report_name(saved), frame);
        }
    }

    /// The columns beside the plots.
    fn columns(&mut self, ui: &mut Ui, (draft, modal): (&mut Edit, &mut ModalShown), done: &mut FrameActs) {
        let now = ui.input(|i| i.time);
        let WindowProgram { state, derived, .. } = &self.program;
        let Canvas { typing, walk, report, .. } = &mut self.canvas;
        let room = state.shown.room;
        let settings = draft.settings.clone();
        let calibrating = derived.calibrating.filter(|_| derived.running.contains_key(&Key::Calibrate));
        let choosing = derived.progress(&Key::Choose);
        let mut context = PanelContext {
            data: &derived.records,
            edit: draft,
            suggestion: state.document.suggestion.as_ref().unwrap_or(&settings),
            of_files: matches!(state.document.source, Source::Files(_)),
            may_be_structure: match &state.document.source {
                Source::Files(_) => true,
                Source::Sample(sample) => sample.is_structure(),
                Source::Rig(settings) => settings.plant.is_structure(),
                _ => false,
            },
            shown: state.shown.record,
            cutting: state.shown.cutting && room == Room::Identify,
            choosing,
            calibrating,
            refused: derived.refused.as_ref(),
            bought: derived.questions.bought(),
            typing,
            asks: &mut done.asks,
        };
        panel::left(ui, &mut context, room, |ui, context| match room {
            Room::Report if context.edit.component || context.edit.base.model == BaseModel::Modes => {
                report::title_controls(ui, &mut context.edit.report, &context.data.title);
            }
            Room::Report => {
                report::controls(ui, &derived.report, report, &mut context.edit.report, &context.data.title);
            }
            _ if context.edit.component => {}
            _ if context.edit.base.model == BaseModel::Modes => modal::controls(ui, context.edit),
            _ => done.walk = missing::controls(ui, &derived.missing, walk, context.data, context.edit),
        });
        if context.data.records.is_empty() {
            return;
        }
        if context.edit.component {
            let found = &derived.component;
            let (of, noise, failure) = match found.search.found().filter(|_| room == Room::Missing) {
                Some(diagnosis) => (found.diagnosed(), Some(diagnosis.found.noise_floor), None),
                None => {
                    let noise = found.fit.found().map(|analysis| analysis.found.noise_floor);
                    (found.identified(), noise, found.fit.failure())
                }
            };
            return panel::findings(ui, |ui| component::findings(ui, of, noise, failure));
        }
        match room {
            Room::Missing if context.edit.base.model == BaseModel::Modes => {
                panel::findings(ui, |ui| modal::missing_findings(ui, &derived.modal, modal));
            }
            Room::Missing => {
                panel::findings(ui, |ui| {
                    done.walk.extend(missing::findings(ui, &derived.missing, walk, context.data, context.edit));
                });
            }
            _ if context.edit.base.model == BaseModel::Modes => {
                panel::findings(ui, |ui| modal::findings(ui, &derived.modal, modal));
            }
            _ => panel::right(ui, &mut context, now),
        }
    }

    /// Does what a panel asks for.
    fn answer(&mut self, ask: PanelAct, ctx: &Context, frame: &eframe::Frame) {
        let message = match ask {
            PanelAct::Do(command) => return self.run(command, ctx, frame),
            PanelAct::Locate => return self.dialogs.ask(Purpose::Locate, "", frame),
            PanelAct::ShowRecord(index) => Message::ShowRecord(index),
            PanelAct::Kind(kind) => Message::Kind(kind),
            PanelAct::Remedy(remedy) => {
                let mut edit = self.program.state.document.edit.clone();
                match remedy {
                    Remedy::Settings { settings, .. } => edit.settings = *settings,
                    Remedy::Use { record, usage, .. } => {
                        if let Some(old) = edit.usage.get_mut(record) {
                            *old = usage;
                        }
                    }
                    // Of the others none has a button.
                    _ => {}
                }
                Message::Edit(Box::new(edit))
            }
            PanelAct::Prepare(steps) => Message::Prepare(steps),
            PanelAct::Cut => Message::Cut,
            PanelAct::Calibrate { step, sought } => {
                let (sought, role) = match sought {
                    Calibration::Delay(role) => (Sought::Delay, role),
                    Calibration::Gain(role) => (Sought::Gain, role),
                };
                Message::Calibrate { step, sought, role }
            }
            PanelAct::StopChoosing => Message::StopChoosing,
        };
        self.program.send(message);
    }

    fn centre(
        &mut self,
        ui: &mut Ui,
        (draft, views, modal): (&mut Edit, &mut ViewState, &mut ModalShown),
        done: &mut FrameActs,
    ) {
        let WindowProgram { state, derived, .. } = &self.program;
        let (shown, canvas) = (&state.shown, &mut self.canvas);
        match (&derived.records.outcome, shown.room) {
            _ if derived.records.records.is_empty() => done.commands.extend(welcome::show(ui, derived.opening())),
            (_, Room::Identify | Room::Missing) if draft.component => {
                let (room, of) = (&derived.component, (shown.component, shown.record));
                let act = if shown.room == Room::Missing {
                    let progress = derived.progress(&Key::ComponentSearch);
                    component::show_missing(ui, room, progress, of, &mut canvas.structure)
                } else {
                    component::show(ui, room, of, &mut canvas.structure)
                };
                done.component(act, shown.component.label());
            }
            (_, Room::Missing) if draft.base.model == BaseModel::Modes => {
                let progress = derived.progress(&Key::ModalSearch);
                let act = modal::show_missing(ui, &derived.modal, progress, modal, &mut canvas.structure);
                done.modal(act, "before and after", draft);
            }
            (_, Room::Missing) => {
                let of = (&derived.records, &*draft);
                let mass = &mut views.options.freedom;
                done.walk.extend(missing::show(ui, &derived.missing, &mut canvas.walk, of, mass));
            }
            (_, Room::Report)
                if draft.component || draft.base.model == BaseModel::Modes || derived.records.outcome.is_some() =>
            {
                match report::show(ui, &derived.report, &mut canvas.report, &mut draft.report) {
                    Some(ReportAct::Save(saved)) => done.report = Some(saved),
                    Some(ReportAct::Width(width)) => done.messages.push(Message::PageWidth(width)),
                    None => {}
                }
            }
            (_, Room::Identify) if draft.base.model == BaseModel::Modes => self.modal(ui, (draft, modal), done),
            (outcome, _) => {
                if shown.cutting
                    && let Some(steps) = canvas.cutter.show(ui, &derived.records, &draft.steps, shown.record)
                {
                    done.messages.push(Message::Prepare(steps));
                }
                match outcome {
                    Some(_) => self.view(ui, views, done),
                    None => {
                        let text = derived.records.failure.as_deref().unwrap_or("fitting…");
                        ui.centered_and_justified(|ui| ui.weak(text));
                    }
                }
            }
        }
    }

    /// The views of a structure's modes.
    fn modal(&mut self, ui: &mut Ui, (draft, modal): (&mut Edit, &mut ModalShown), done: &mut FrameActs) {
        let WindowProgram { state, derived, .. } = &self.program;
        let (shown, canvas) = (&state.shown, &mut self.canvas);
        if shown.cutting
            && let Some(steps) = canvas.cutter.show(ui, &derived.records, &draft.steps, shown.record)
        {
            done.messages.push(Message::Prepare(steps));
        }
        let of = (&derived.records, shown.record, derived.fitted);
        let act = modal::show(ui, &derived.modal, modal, of, &mut canvas.modal);
        done.modal(act, modal.view.label(), draft);
    }

    /// The tabs and the view that is open.
    fn view(&mut self, ui: &mut Ui, views: &mut ViewState, done: &mut FrameActs) {
        let WindowProgram { state, derived, .. } = &self.program;
        let shown = &state.shown;
        let mut view = shown.view;
        tabs::show(ui, &mut view, views);
        if view != shown.view {
            done.commands.push(WindowCommand::View(view));
        }
        let (places, pins) = derived.records.known_pins();
        let Some(picture) = derived.picture(shown, &pins) else { return };
        let outcome = picture.outcome;
        let place = |index: usize| places.get(index).copied().unwrap_or(index);
        done.messages.extend(
            match views::show(ui, shown.view, (&picture, &derived.figures), views, &mut self.canvas.views) {
                Some(ViewAct::ShowRecord(index)) => {
                    let record = outcome.records.get(index).map(|r| &r.record);
                    let found = record.and_then(|r| derived.records.records.iter().position(|b| Arc::ptr_eq(b, r)));
                    found.map(Message::ShowRecord)
                }
                Some(ViewAct::SavePicture) => {
                    done.commands.push(WindowCommand::PlotPicture);
                    None
                }
                Some(ViewAct::SaveTable(text)) => {
                    done.table = Some((view.label(), text));
                    None
                }
                Some(ViewAct::Set { window, threshold }) => Some(Message::Set { window, threshold }),
                Some(ViewAct::Pin) => Some(Message::Pin),
                Some(ViewAct::Unpin(index)) => Some(Message::Unpin(place(index))),
                Some(ViewAct::Return(index)) => Some(Message::Return(place(index))),
                None => None,
            },
        );
    }

    /// Draws the panel that asks how the figure is to be saved, while it is open.
    pub(super) fn figure_panel(&mut self, ctx: &Context, frame: &eframe::Frame) {
        let state = &self.program.state;
        let name = match state.shown.room {
            _ if !self.figure_open || !self.has_figure() => return,
            _ if self.shows_series() => "Series",
            Room::Identify | Room::Missing if state.document.edit.component => state.shown.component.label(),
            Room::Identify if state.document.edit.base.model == BaseModel::Modes => state.shown.modal.view.label(),
            Room::Identify => state.shown.view.label(),
            Room::Missing if state.document.edit.base.model == BaseModel::Modes => "Before and after",
            Room::Missing => self.figure.name(),
            Room::Rig | Room::Report => return,
        };
        let mut look = state.figure;
        let outcome = figure_panel::show(ctx, name, &mut look);
        if look != self.program.state.figure {
            self.program.send(Message::Figure(look));
        }
        match outcome {
            FigurePanelOutcome::Open => {}
            FigurePanelOutcome::Closed => self.figure_open = false,
            FigurePanelOutcome::Save => {
                let ending = look.format.figure().ending();
                let offered = if self.shows_series() {
                    format!("{}-series.{ending}", self.series_stem())
                } else {
                    self.file_name(name, ending)
                };
                self.dialogs.ask(Purpose::Plot, &offered, frame);
            }
        }
    }
}

/// The centre of the window.
pub(super) fn centre(ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    let ground = palette::ground(ui.visuals().dark_mode);
    let outline = egui::Frame::new().fill(ground).inner_margin(Margin::symmetric(10, 4));
    CentralPanel::default().frame(outline).show(ui, body);
}
