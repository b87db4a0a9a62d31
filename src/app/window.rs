//! The app itself: state and background work brought together, frame by frame.

mod jobs;
mod keeping;
mod opening;
mod teaching;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Weak};

use egui::{CentralPanel, ColorImage, Context, Margin, RichText, Stroke, Theme, ThemePreference, Ui};

use super::bench::Bench;
use super::columns::Columns;
use super::command_palette::{self, Palette};
use super::commands::Command;
use super::cutter::Cutter;
use super::dialogs::{Chosen, Dialogs, Purpose};
use super::figure_panel;
use super::history::History;
use super::jobs::{Job, Jobs, Key};
use super::lessons::Teacher;
use super::missing::figures::Figure;
use super::missing::{Act, Missing, Walk};
use super::notices::Notices;
use super::open::{Opening, Refused};
use super::panel::{self, Ask, Desk, Typing};
use super::plot::display;
use super::plot::palette;
use super::problem::file_name;
use super::questions::Questions;
use super::report::{self, ReportRoom, Saved};
use super::rig::{RigRoom, class};
use super::saving::{SavedContent, Saving, ViewPicture};
use super::session::{self, Keeper};
use super::settings_map::SettingsMap;
use super::state::{Edit, Pin, Room, Source, State};
use super::views::{self, Group, Picture, Request, Search, View, ViewState};
use super::{help, overlay, status, theme, toolbar, welcome};
use sindyscope_core::remedy::Remedy;
use sindyscope_core::study::{Outcome, Settings};
use sindyscope_report::export::Format;
use sindyscope_search::{Diagnosis, Stage};
use sindyscope_values::format::equations;
use sindyscope_values::record::{Record, RecordSet};

/// A picture of the window, where it goes, and whether it may replace a file.
type Shot = (PathBuf, bool, Arc<ColorImage>);

/// Jobs that the line at the bottom tells of beside the fit, the first that runs.
const OTHERS: [Key; 7] = [Key::Open, Key::Choose, Key::Calibrate, Key::Search, Key::Pages, Key::Rig, Key::SearchRound];

/// The window.
pub struct App {
    state: State,
    edit: Edit,
    suggestion: Settings,
    bench: Bench,
    history: History<Edit>,
    notices: Notices,
    dialogs: Dialogs,
    jobs: Jobs,
    missing: Missing,
    report: ReportRoom,
    rig: RigRoom,
    teacher: Teacher,
    map: SettingsMap,
    questions: Questions,
    columns: Columns,
    /// The outcome whose regression was repeated on resampled data, or is being.
    resampled: Weak<Outcome>,
    /// Pins whose outcomes are not there: yet, or as long as the records are read for another order.
    waiting_pins: Vec<Pin>,
    shots: (Sender<Shot>, Receiver<Shot>),
    /// What was asked to be studied last: the records' generation, and the settings and usages.
    asked: Option<(u64, Edit)>,
    /// The step of the preparation whose value is being found.
    calibrating: Option<usize>,
    refused: Option<Refused>,
    /// Writes the state down whenever it has changed; none in tests that need none.
    keeper: Option<Keeper>,
    typing: Typing,
    cutter: Cutter,
    palette: Option<Palette>,
    figure_open: bool,
    /// The figure of "What's missing" that is to be saved.
    figure: Figure,
    /// The numbers of a plot that are to be saved.
    table: String,
    help_open: bool,
    log_open: bool,
    title: String,
}

impl App {
    /// The window as a person left it; what it shows is read and fitted in the background.
    pub fn with_state(ctx: &Context, state: State) -> Self {
        theme::install(ctx);
        ctx.set_theme(state.theme);
        if (0.5..=4.0).contains(&state.zoom) {
            ctx.set_zoom_factor(state.zoom);
        }
        let wake = ctx.clone();
        let mut app = Self {
            edit: Edit::default(),
            suggestion: Settings::default(),
            bench: Bench::default(),
            history: History::new(Edit::default()),
            notices: Notices::default(),
            dialogs: Dialogs::new(true),
            jobs: Jobs::new(move || wake.request_repaint()),
            missing: Missing::default(),
            report: ReportRoom::default(),
            rig: RigRoom::default(),
            teacher: Teacher::default(),
            map: SettingsMap::default(),
            questions: Questions::default(),
            columns: Columns::default(),
            resampled: Weak::new(),
            waiting_pins: Vec::new(),
            shots: channel(),
            asked: None,
            calibrating: None,
            refused: None,
            keeper: None,
            typing: Typing::default(),
            cutter: Cutter::default(),
            palette: None,
            figure_open: false,
            figure: Figure::Profile,
            table: String::new(),
            help_open: false,
            log_open: false,
            title: String::new(),
            state,
        };
        app.teacher.begin();
        if app.state.source != Source::Nothing {
            let found = app.state.found.take();
            app.bring_back_walk(found);
            let wanted = app.missing.begin_at(app.state.step);
            app.search(wanted);
            let State { source, reading, edit, checksums, .. } = app.state.clone();
            let folder = app.folder_of(&source, &reading);
            app.begin(Opening { reading, folder, edit, checksums, ..Opening::of(source) });
        }
        app
    }

    /// Without the system's file dialogs: paths are typed. For tests, and where a dialog would be in the way.
    pub fn without_dialogs(mut self) -> Self {
        self.dialogs = Dialogs::new(false);
        self
    }

    /// True while something is read, computed or drawn in the background.
    pub fn busy(&self) -> bool {
        self.jobs.busy() || self.state.views.busy()
    }

    /// The settings as they stand.
    pub fn settings(&self) -> &Settings {
        &self.edit.settings
    }

    /// The records, with what each is used for.
    pub fn records(&self) -> RecordSet {
        self.bench.set(&self.edit.usage)
    }

    /// What the last study found.
    pub fn outcome(&self) -> Option<&Arc<Outcome>> {
        self.bench.outcome.as_ref()
    }

    /// What was added in "What's missing".
    pub fn walk(&self) -> &Walk {
        &self.edit.walk
    }

    /// The model with what was added, once it was fitted.
    pub fn stage(&self) -> Option<&Arc<Stage>> {
        self.missing.stage(&self.edit.walk)
    }

    /// What the walk in "What's missing" has come to, once it was asked: for a report.
    pub fn diagnosis(&self) -> Option<&Arc<Diagnosis>> {
        self.missing.diagnosis(&self.edit.walk)
    }

    fn chosen(&mut self, ctx: &Context, chosen: Chosen) {
        let Chosen { purpose, paths, asked } = chosen;
        let Some(path) = paths.first().cloned() else { return };
        let named = purpose.ending().map_or(path.clone(), |ending| with_extension(path, ending));
        // A picture is never something else than its name says.
        let path = if purpose == Purpose::Window { named.with_extension("png") } else { named };
        let replaces = asked.as_ref() == Some(&path);
        match purpose {
            Purpose::Open => self.open(paths),
            Purpose::Add => self.add_records(paths),
            Purpose::Locate => self.located(path),
            Purpose::Window => {
                let (send, ctx2) = (self.shots.0.clone(), ctx.clone());
                ctx.request_screenshot(move |image| {
                    // The window may be closing.
                    let _ = send.send((path, replaces, image));
                    ctx2.request_repaint();
                });
            }
            _ => match self.content(ctx, purpose) {
                Some(content) => self.save(Saving { path, purpose, replaces, content }),
                None if purpose == Purpose::Plot && self.state.room == Room::Missing => {
                    self.notices
                        .error("The figure was not saved: there is nothing to draw yet; look for effects first");
                }
                None => {}
            },
        }
    }

    /// What a file for this purpose is to hold; none if there is nothing to save.
    fn content(&mut self, ctx: &Context, purpose: Purpose) -> Option<SavedContent> {
        Some(match purpose {
            Purpose::Open | Purpose::Add | Purpose::Locate | Purpose::Window => return None,
            Purpose::Project => SavedContent::Project(Box::new(self.project())),
            Purpose::Model => SavedContent::Model(Arc::clone(self.bench.outcome.as_ref()?)),
            Purpose::Plot if self.state.room == Room::Missing => {
                // Drawn at once: the search may be busy, and what is saved is what is seen.
                let look = self.state.figure;
                let svg = self.missing.svg(ctx, &self.figure, (&self.bench, &self.edit), look)?;
                SavedContent::Figure { svg, title: self.figure.name() }
            }
            Purpose::Plot => SavedContent::View(Box::new(self.view_picture(ctx)?)),
            Purpose::Table => SavedContent::Table(self.table.clone()),
            Purpose::Report(_) => SavedContent::Report(Box::new(self.sight().content()?)),
            Purpose::RigRecords => SavedContent::RigRecords(Box::new(self.rig.made()?.clone())),
            Purpose::RoundRecords => SavedContent::RoundRecords(self.state.rig.class.case.clone()),
            Purpose::Rounds => SavedContent::Table(class::csv(&self.state.rig.class)),
        })
    }

    fn save(&mut self, saving: Saving) {
        self.jobs.want(Key::Save(saving.path.clone()), Job::Save(Box::new(saving)));
    }

    fn sight(&self) -> report::Sight<'_> {
        report::Sight {
            bench: &self.bench,
            edit: &self.edit,
            diagnosis: self.missing.diagnosis(&self.edit.walk),
            project: self.state.project.as_deref(),
        }
    }

    /// Draws the panel that asks how the figure is to be saved, while it is open.
    fn figure_panel(&mut self, ctx: &Context, frame: &eframe::Frame) {
        let name = match self.state.room {
            _ if !self.figure_open || self.bench.outcome.is_none() => return,
            Room::Identify => self.state.view.label(),
            Room::Missing => self.figure.name(),
            Room::Rig | Room::Report => return,
        };
        match figure_panel::show(ctx, name, &mut self.state.figure) {
            figure_panel::Outcome::Open => {}
            figure_panel::Outcome::Closed => self.figure_open = false,
            figure_panel::Outcome::Save => {
                let name = self.file_name(name, self.state.figure.format.figure().ending());
                self.dialogs.ask(Purpose::Plot, &name, frame);
            }
        }
    }

    /// The name that is offered for a file of a plot.
    fn file_name(&self, what: &str, ending: &str) -> String {
        let stem = Path::new(&self.bench.title).file_stem().map_or("figure".into(), |s| s.to_string_lossy());
        format!("{stem}-{}.{ending}", what.to_lowercase().replace(' ', "-"))
    }

    /// The picture of the view that is shown.
    fn view_picture(&self, ctx: &Context) -> Option<ViewPicture> {
        let outcome = self.bench.outcome.clone()?;
        Some(ViewPicture {
            seen: views::Seen::of(ctx, self.state.view, &self.state.views),
            view: self.state.view,
            record: self.record_in(&outcome),
            outcome,
            map: self.map.map().map(|(map, _)| Arc::clone(map)),
            pins: self.bench.pins.clone(),
            state: self.state.views.clone(),
            look: self.state.figure,
        })
    }

    /// Where the record shown stands among the outcome's, which lacks those that are off.
    fn record_in(&self, outcome: &Outcome) -> usize {
        let shown = self.bench.records.get(self.state.record);
        let is_shown = |r: &Arc<Record>| shown.is_some_and(|s| Arc::ptr_eq(s, r));
        outcome.records.iter().position(|r| is_shown(&r.record)).unwrap_or(0)
    }

    fn run(&mut self, command: Command, ctx: &Context, frame: &eframe::Frame) {
        let stem = Path::new(&self.bench.title).file_stem().map_or("sindyscope".into(), |s| s.to_string_lossy());
        let stem = stem.into_owned();
        match command {
            Command::Open => self.dialogs.ask(Purpose::Open, "", frame),
            Command::OpenPath => self.dialogs.type_path(Purpose::Open, "", ""),
            Command::Sample(sample) => self.open_sample(sample),
            Command::Demonstration => {
                let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
                self.begin(Opening::of(Source::Hidden(now.map_or(1, |d| d.as_micros() as u64))));
            }
            Command::Lessons => self.show_lessons(),
            Command::AddRecords => {
                let purpose = if self.bench.records.is_empty() { Purpose::Open } else { Purpose::Add };
                self.dialogs.ask(purpose, "", frame);
            }
            Command::Columns => self.show_columns(),
            Command::Close => self.close(),
            Command::SaveProject | Command::Choose if self.bench.records.is_empty() => {}
            Command::SaveProject => match self.state.project.clone() {
                Some(path) => {
                    let content = SavedContent::Project(Box::new(self.project()));
                    self.save(Saving { path, purpose: Purpose::Project, replaces: true, content });
                }
                None => self.dialogs.ask(Purpose::Project, &format!("{stem}.json"), frame),
            },
            Command::SaveProjectAs => self.dialogs.ask(Purpose::Project, &format!("{stem}.json"), frame),
            Command::Undo | Command::Redo if self.state.room == Room::Rig => {
                self.rig.step(&mut self.state.rig, command == Command::Undo);
            }
            Command::Undo => {
                if let Some(edit) = self.history.undo(&self.edit) {
                    self.take_back(edit);
                }
            }
            Command::Redo => {
                if let Some(edit) = self.history.redo(&self.edit) {
                    self.take_back(edit);
                }
            }
            Command::Choose => {
                let (records, settings) = (self.records(), self.edit.settings.clone());
                self.jobs.want_instead(Key::Choose, Job::Choose { records, settings });
            }
            Command::Reset => self.edit.settings = self.suggestion.clone(),
            Command::PlotPicture if self.state.room == Room::Rig => {
                self.dialogs.ask(Purpose::Window, "virtual-rig.png", frame);
            }
            Command::PlotPicture | Command::ExportModel | Command::SaveReport if self.bench.outcome.is_none() => {}
            Command::SaveReport => self.dialogs.ask(Purpose::Report(Saved::Pdf), &format!("{stem}.pdf"), frame),
            Command::ExportModel => {
                let name = format!("{stem}.{}", Format::Python.ending());
                self.dialogs.ask(Purpose::Model, &name, frame);
            }
            Command::PlotPicture if self.state.room == Room::Report => {
                self.dialogs.ask(Purpose::Window, &format!("{stem}-report.png"), frame);
            }
            Command::PlotPicture => {
                self.figure_open = !self.figure_open;
                self.figure = self.missing.main_figure();
            }
            Command::WindowPicture => self.dialogs.ask(Purpose::Window, &format!("{stem}-window.png"), frame),
            Command::CopyText | Command::CopyLatex | Command::CopyPython | Command::CopyJson => self.copy(command, ctx),
            Command::View(view) => self.state.view = view,
            Command::Room(room) => self.state.room = room,
            Command::FitView => self.state.views.fit(),
            Command::Theme => {
                let dark = ctx.theme() == Theme::Dark;
                self.state.theme = if dark { ThemePreference::Light } else { ThemePreference::Dark };
                ctx.set_theme(self.state.theme);
            }
            Command::LargerText => {
                let next = ZOOMS.iter().find(|z| **z > ctx.zoom_factor() + 0.01).unwrap_or(&ZOOMS[0]);
                ctx.set_zoom_factor(*next);
            }
            Command::Messages => self.log_open = !self.log_open,
            Command::Palette => self.palette = if self.palette.is_some() { None } else { Some(Palette::default()) },
            Command::Help => self.help_open = !self.help_open,
            Command::Quit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
        }
    }

    /// Does what the room "What's missing" asks for.
    fn walk_on(&mut self, act: Act, ctx: &Context, frame: &eframe::Frame) {
        match act {
            Act::SaveFigure(figure) => (self.figure, self.figure_open) = (figure, true),
            Act::SaveTable(what, text) => {
                self.table = text;
                self.dialogs.ask(Purpose::Table, &self.file_name(what, "csv"), frame);
            }
            Act::Use => match self.missing.taken_over(&self.edit) {
                Some(Ok(settings)) => {
                    self.history.note(&self.edit);
                    self.edit.settings = settings;
                    self.history.note(&self.edit);
                    self.state.room = Room::Identify;
                    self.notices.done("The model of the walk is the equation here; undo takes it back");
                }
                Some(Err(problem)) => self.notices.error(problem),
                None => {}
            },
            Act::Copy => {
                if let Some(stage) = self.missing.stage(&self.edit.walk) {
                    let units = self.bench.units(stage.model.layout.kind);
                    ctx.copy_text(equations::text(&stage.model, Some(&units)));
                    self.notices.note("The equations are on the clipboard, as text");
                }
            }
            act => {
                let wanted = self.missing.act(act, &self.bench, &mut self.edit);
                self.search(wanted);
            }
        }
    }

    fn copy(&mut self, command: Command, ctx: &Context) {
        let Some(outcome) = &self.bench.outcome else { return };
        let model = &outcome.model;
        let (text, form) = match command {
            Command::CopyLatex => (equations::latex(model), "LaTeX"),
            Command::CopyPython => (equations::python(model), "Python"),
            Command::CopyJson => (serde_json::to_string_pretty(model).unwrap_or_default(), "JSON"),
            _ => (equations::text(model, Some(&outcome.units())), "text"),
        };
        ctx.copy_text(text);
        self.notices.note(format!("The equations are on the clipboard, as {form}"));
    }

    fn answer(&mut self, ask: Ask, ctx: &Context, frame: &eframe::Frame) {
        match ask {
            Ask::Do(command) => self.run(command, ctx, frame),
            Ask::ShowRecord(index) => self.state.record = index,
            Ask::Kind(kind) => self.read_as(kind),
            Ask::Remedy(Remedy::Settings { settings, .. }) => self.edit.settings = *settings,
            Ask::Remedy(Remedy::Use { record, usage, .. }) => {
                if let Some(old) = self.edit.usage.get_mut(record) {
                    *old = usage;
                }
            }
            // Of the others none has a button.
            Ask::Remedy(_) => {}
            Ask::Prepare(steps) => self.prepare(steps),
            // The strip stands above the plots of Identify: from the other room it leads there.
            Ask::Cut if self.state.room != Room::Identify => {
                (self.state.room, self.state.cutting) = (Room::Identify, true);
            }
            Ask::Cut => self.state.cutting = !self.state.cutting,
            Ask::Locate => self.dialogs.ask(Purpose::Locate, "", frame),
            Ask::Calibrate { step, sought } => {
                self.calibrating = Some(step);
                let (records, settings) = (self.records(), self.edit.settings.clone());
                self.jobs.want_instead(Key::Calibrate, Job::Calibrate { records, settings, step, sought });
            }
            Ask::StopErrand => {
                self.jobs.cancel(&Key::Choose);
                self.jobs.cancel(&Key::Calibrate);
            }
        }
    }

    fn centre(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let dark = ui.visuals().dark_mode;
        let opening = self.opening();
        let outline = egui::Frame::new().fill(palette::ground(dark)).inner_margin(Margin::symmetric(10, 4));
        CentralPanel::default().frame(outline).show(ui, |ui| {
            if self.state.room == Room::Rig {
                return self.rig_centre(ui, frame);
            }
            if self.state.room == Room::Missing && !self.bench.records.is_empty() {
                for act in self.missing.show(ui, &self.bench, &self.edit, &mut self.state.views.options.freedom) {
                    self.walk_on(act, ui.ctx(), frame);
                }
                return;
            }
            if self.state.room == Room::Report && self.bench.outcome.is_some() {
                if let Some(report::Act::Save(saved)) = self.report.show(ui, &mut self.edit.report) {
                    let stem =
                        Path::new(&self.bench.title).file_stem().map_or("report".into(), |s| s.to_string_lossy());
                    let name = format!("{stem}.{}", saved.ending());
                    self.dialogs.ask(Purpose::Report(saved), &name, frame);
                }
                return;
            }
            if self.state.cutting
                && !self.bench.records.is_empty()
                && let Some(steps) = self.cutter.show(ui, &self.bench, &self.edit.steps, self.state.record)
            {
                self.prepare(steps);
            }
            let Some(outcome) = self.bench.outcome.clone() else {
                if self.bench.records.is_empty() {
                    if let Some(command) = welcome::show(ui, opening) {
                        let ctx = ui.ctx().clone();
                        self.run(command, &ctx, frame);
                    }
                } else {
                    let text = self.bench.failure.as_deref().unwrap_or("fitting…");
                    ui.centered_and_justified(|ui| ui.weak(text));
                }
                return;
            };
            tabs(ui, &mut self.state.view, &mut self.state.views);
            let picture = Picture {
                outcome: &outcome,
                previous: self.bench.ghost(),
                record: self.record_in(&outcome),
                stale: self.jobs.progress(&Key::Fit).is_some() || self.bench.failure.is_some(),
                search: Search {
                    map: self.map.map().map(|(map, _)| map),
                    stale: self.map.map().is_some_and(|(_, stale)| stale),
                    failure: self.map.failure(),
                },
                pins: &self.bench.pins,
            };
            match views::show(ui, self.state.view, &picture, &mut self.state.views) {
                Some(Request::ShowRecord(index)) => {
                    let record = outcome.records.get(index).map(|r| &r.record);
                    let found = record.and_then(|r| self.bench.records.iter().position(|b| Arc::ptr_eq(b, r)));
                    self.state.record = found.unwrap_or(self.state.record);
                }
                Some(Request::SavePicture) => {
                    let ctx = ui.ctx().clone();
                    self.run(Command::PlotPicture, &ctx, frame);
                }
                Some(Request::SaveTable(text)) => {
                    self.table = text;
                    let name = self.file_name(self.state.view.label(), "csv");
                    self.dialogs.ask(Purpose::Table, &name, frame);
                }
                Some(Request::Set { window, threshold }) => self.set(window, threshold),
                Some(Request::Pin) => {
                    self.pin(outcome);
                }
                Some(Request::Unpin(index)) => {
                    self.unpin(index);
                }
                Some(Request::Return(index)) => {
                    self.history.note(&self.edit);
                    self.edit.settings = self.bench.pins[index].settings.clone();
                    self.history.note(&self.edit);
                }
                None => {}
            }
        });
    }

    /// Takes a setting over that was clicked in a view: a step of its own for undo.
    fn set(&mut self, window: Option<usize>, threshold: f64) {
        self.history.note(&self.edit);
        let settings = &mut self.edit.settings;
        if let Some(window) = window {
            settings.smoothing = settings.smoothing.with_window(window);
        }
        settings.threshold = threshold;
        self.history.note(&self.edit);
    }

    fn set_title(&mut self, ctx: &Context) {
        let title = match (&self.state.project, self.bench.records.is_empty()) {
            (_, true) => "Sindyscope".to_owned(),
            (Some(project), false) => format!("{} – Sindyscope", file_name(project)),
            (None, false) => format!("{} – Sindyscope", self.bench.title),
        };
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &Context, _frame: &mut eframe::Frame) {
        self.collect(ctx);
        self.dropped(ctx);
        if let Some(chosen) = self.dialogs.chosen(ctx) {
            self.chosen(ctx, chosen);
        }
        self.ask();
        self.look_around();
        self.resample(ctx);
        self.question(ctx);
        self.set_title(ctx);
        self.teach();
        let (now, held) = ctx.input(|i| (i.time, i.pointer.any_down()));
        if let Some(wait) = self.bench.fade(held, now) {
            ctx.request_repaint_after_secs(wait as f32);
        }
    }

    fn ui(&mut self, ui: &mut Ui, frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.state.zoom = ctx.zoom_factor();
        display::install(&ctx, &self.state.views.units);
        for command in Command::pressed(&ctx) {
            self.run(command, &ctx, frame);
        }
        let opening = self.opening();
        let (can_undo, can_redo) = match self.state.room {
            Room::Rig => self.rig.can_step(&self.state.rig),
            _ => (self.history.can_undo(&self.edit), self.history.can_redo(&self.edit)),
        };
        let mut bar = toolbar::Toolbar { can_undo, can_redo, opening, state: &mut self.state, bench: &self.bench };
        for asked in toolbar::show(ui, &mut bar) {
            match asked {
                toolbar::Asked::Do(command) => self.run(command, &ctx, frame),
                toolbar::Asked::Recent(path) => self.open(vec![path]),
            }
        }
        let mut line = status::Status {
            bench: &self.bench,
            fitting: self.jobs.progress(&Key::Fit),
            other: OTHERS.iter().find_map(|key| self.jobs.progress(key)),
            opening,
            notices: &mut self.notices,
            log_open: &mut self.log_open,
        };
        if status::show(ui, &mut line).is_some() {
            self.jobs.cancel(&Key::Open);
        }
        self.lesson(ui);
        let (now, held) = ctx.input(|i| (i.time, i.pointer.any_down()));
        let mut asks = Vec::new();
        if self.state.room == Room::Rig {
            self.rig_columns(ui, frame);
        } else if !self.bench.records.is_empty() || self.refused.is_some() {
            let choosing = self.jobs.progress(&Key::Choose);
            let calibrating = self.calibrating.filter(|_| self.jobs.progress(&Key::Calibrate).is_some());
            let mut desk = Desk {
                bench: &self.bench,
                edit: &mut self.edit,
                suggestion: &self.suggestion,
                of_files: matches!(self.state.source, Source::Files(_)),
                shown: self.state.record,
                cutting: self.state.cutting && self.state.room == Room::Identify,
                choosing,
                calibrating,
                refused: self.refused.as_ref(),
                bought: self.questions.bought(),
                typing: &mut self.typing,
                asks: &mut asks,
            };
            let mut acts = Vec::new();
            let (room, missing, report) = (self.state.room, &mut self.missing, &mut self.report);
            panel::left(ui, &mut desk, room, |ui, desk| match room {
                Room::Report => report.controls(ui, &mut desk.edit.report, &desk.bench.title),
                _ => acts = missing.controls(ui, desk.bench, desk.edit),
            });
            for act in acts {
                self.walk_on(act, &ctx, frame);
            }
            let mut desk = Desk {
                bench: &self.bench,
                edit: &mut self.edit,
                suggestion: &self.suggestion,
                of_files: matches!(self.state.source, Source::Files(_)),
                shown: self.state.record,
                cutting: self.state.cutting && self.state.room == Room::Identify,
                choosing,
                calibrating,
                refused: self.refused.as_ref(),
                bought: self.questions.bought(),
                typing: &mut self.typing,
                asks: &mut asks,
            };
            if self.state.room == Room::Missing && !self.bench.records.is_empty() {
                panel::findings(ui, |ui| self.missing.findings(ui, &self.bench, &self.edit));
            } else if !self.bench.records.is_empty() {
                panel::right(ui, &mut desk, now);
            }
        }
        self.centre(ui, frame);
        for ask in asks {
            self.answer(ask, &ctx, frame);
        }
        if !opening {
            self.history.watch(&self.edit, held, now);
        }
        self.rig.watch(&self.state.rig, held, now);
        if let Some(palette) = &mut self.palette {
            match palette.show(&ctx) {
                command_palette::Outcome::Open => {}
                command_palette::Outcome::Closed => self.palette = None,
                command_palette::Outcome::Chosen(command) => {
                    self.palette = None;
                    self.run(command, &ctx, frame);
                }
            }
        }
        self.figure_panel(&ctx, frame);
        if let Some(reading) = self.columns.show(&ctx) {
            self.read_with(reading);
        }
        let wanted = self.columns.wanted();
        self.read_columns(wanted);
        help::show(&ctx, &mut self.help_open);
        if let Some(chosen) = overlay::path_field(&ctx, &mut self.dialogs) {
            self.chosen(&ctx, chosen);
        }
        overlay::drop_zone(&ctx);
        self.notices.show_toasts(&ctx);
        self.state.views.units = display::chosen(&ctx);
        // What was just changed is asked for at once, not with the next event.
        self.ask();
        self.look_around();
        self.keep(&ctx);
    }

    /// The session's file holds the state; the system's storage only the window's place.
    fn save(&mut self, _storage: &mut dyn eframe::Storage) {}

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        let state = self.state();
        let now = f64::INFINITY;
        if let Some(keeper) = &mut self.keeper
            && let Some(text) = keeper.text(&state, now)
        {
            self.jobs.want(Key::Session, Job::Session { path: keeper.path().to_owned(), text });
        }
        self.jobs.finish(&Key::Session, session::PATIENCE);
    }
}

/// The path with an ending, if it has none.
fn with_extension(path: PathBuf, extension: &str) -> PathBuf {
    if path.extension().is_some() { path } else { path.with_extension(extension) }
}

/// How large everything is drawn, in the steps of *Larger text*.
const ZOOMS: [f32; 3] = [1.0, 1.25, 1.5];

/// Width from which on the groups and the views of one stand in one row, points.
const ONE_ROW: f32 = 600.0;

/// The tabs above the plots: groups on the left, the views of the one that is open behind them, or beneath.
fn tabs(ui: &mut Ui, shown: &mut View, views: &mut ViewState) {
    views.remember(*shown);
    if ui.available_width() >= ONE_ROW {
        ui.horizontal(|ui| {
            groups(ui, shown, views);
            ui.add_space(8.0);
            views_of_group(ui, shown);
        });
    } else {
        ui.horizontal(|ui| groups(ui, shown, views));
        ui.horizontal_wrapped(|ui| views_of_group(ui, shown));
    }
}

fn groups(ui: &mut Ui, shown: &mut View, views: &ViewState) {
    ui.spacing_mut().item_spacing.x = 2.0;
    let colors = theme::accents(ui.visuals().dark_mode);
    let open = shown.group();
    egui::Frame::new().fill(colors.card).corner_radius(4.0).stroke(Stroke::new(1.0, colors.line)).show(ui, |ui| {
        for group in Group::ALL {
            let on = open == group;
            let fill = if on { colors.accent_ground } else { egui::Color32::TRANSPARENT };
            let color = if on { ui.visuals().strong_text_color() } else { ui.visuals().text_color() };
            let button = egui::Button::new(RichText::new(group.label()).color(color)).fill(fill).stroke(Stroke::NONE);
            let response = ui.add(button).on_hover_text(group.tooltip());
            response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Tab, true, on, group.label()));
            if response.clicked() && !on {
                *shown = views.recent(group);
            }
        }
    });
}

fn views_of_group(ui: &mut Ui, shown: &mut View) {
    ui.spacing_mut().item_spacing.x = 2.0;
    let accent = theme::accents(ui.visuals().dark_mode).accent;
    for view in shown.group().views() {
        let on = *shown == view;
        let color = if on { ui.visuals().strong_text_color() } else { ui.visuals().weak_text_color() };
        let text = RichText::new(view.label()).color(color);
        let button = egui::Button::new(text).frame_when_inactive(false).stroke(Stroke::NONE);
        let response = ui.add(button).on_hover_text(Command::View(view).hint(ui.ctx()));
        response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Tab, true, on, view.label()));
        if on {
            let line = response.rect.bottom() + 1.0;
            ui.painter().hline(response.rect.x_range().shrink(6.0), line, Stroke::new(2.0, accent));
        }
        if response.clicked() {
            *shown = view;
        }
    }
}
