//! The window: draws the program frame by frame, and makes messages of what a person does.

mod commands;
mod drawing;
mod series;
mod stream;
mod tabs;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use egui::{ColorImage, Context, ThemePreference, Ui};

use super::command_palette::{Palette, PaletteOutcome};
use super::commands::WindowCommand;
use super::cutter::Cutter;
use super::dialogs::Dialogs;
use super::jobs::{Job, Key};
use super::message::Message;
use super::missing::{self, WalkFigure};
use super::notices::Toasted;
use super::panel::Typing;
use super::plot::display;
use super::plot::figures::Figures;
use super::plot::painter::Plots;
use super::problem::file_name;
use super::program::WindowProgram;
use super::purpose::Purpose;
use super::saving::{SaveResult, SavedContent, Saving};
use super::session::{self, Keeper};
use super::state::{Room, Source, State, Walk};
use super::update::FrameTime;
use super::{around, help, modal, overlay, report, theme};
use sindyscope_analysis::component::{ComponentAnalysis, DiagnosedComponent};
use sindyscope_analysis::series::Series;
use sindyscope_core::study::{Outcome, Settings};
use sindyscope_modes::{BaseModel, ModalAnalysis};
use sindyscope_search::{Diagnosis, Stage};
use sindyscope_system::thread;
use sindyscope_values::record::RecordSet;

/// A picture of the window, where it goes, and whether it may replace a file.
type Shot = (PathBuf, bool, Arc<ColorImage>);

/// The window.
pub struct App {
    program: WindowProgram,
    /// Writes the state down whenever it has changed; none in tests that need none.
    keeper: Option<Keeper>,
    /// Where the log of this session is kept as it goes, if it is.
    log_file: Option<PathBuf>,
    dialogs: Dialogs,
    shots: (Sender<Shot>, Receiver<Shot>),
    canvas: Canvas,
    palette: Option<Palette>,
    figure_open: bool,
    /// The figure of "What's missing" that is to be saved.
    figure: WalkFigure,
    /// The numbers of a plot that are to be saved.
    table: String,
    help_open: bool,
    notices_open: bool,
    title: String,
}

/// What the drawing remembers from frame to frame: none of it was decided.
#[derive(Default)]
struct Canvas {
    /// What is being typed.
    typing: Typing,
    cutter: Cutter,
    views: Plots,
    modal: modal::ModalCanvas,
    structure: Figures,
    walk: missing::WalkCanvas,
    report: report::ReportCanvas,
    rig: Figures,
    stream: Figures,
    series: Figures,
    columns: Plots,
    toasted: Toasted,
}

impl App {
    /// The window as a person left it; what it shows is read and fitted in the background.
    pub fn with_state(ctx: &Context, state: State) -> Self {
        theme::install(ctx);
        let wake = ctx.clone();
        let app = Self {
            program: WindowProgram::new(state, thread::waker(move || wake.request_repaint())),
            keeper: None,
            log_file: None,
            dialogs: Dialogs::new(true),
            shots: channel(),
            canvas: Canvas::default(),
            palette: None,
            figure_open: false,
            figure: WalkFigure::Profile,
            table: String::new(),
            help_open: false,
            notices_open: false,
            title: String::new(),
        };
        app.dress(ctx);
        app
    }

    /// Draws in the colours and at the size that the state says.
    fn dress(&self, ctx: &Context) {
        let State { theme, zoom, .. } = self.program.state;
        ctx.set_theme(theme);
        if (0.5..=4.0).contains(&zoom) {
            ctx.set_zoom_factor(zoom);
        }
    }

    /// The window as the session's file says it was left, or with files in it; all that a person decides is written there
    /// within a second, so that not even a crash loses it.
    pub fn revived(ctx: &Context, session: PathBuf, files: &[PathBuf]) -> Self {
        let mut app = Self::with_state(ctx, State::with_source(Source::Nothing, ThemePreference::System));
        app.program.restore(session.clone(), files.to_owned());
        // The first frame shows it, unless the disk is slow.
        app.program.jobs.finish(&Key::Restore, session::AT_ONCE);
        app.advance(ctx, FrameTime::default());
        app.keeper = Some(Keeper::new(session));
        app
    }

    /// Takes in what the background work brought; a session that came back among it decides how all is drawn.
    fn advance(&mut self, ctx: &Context, clock: FrameTime) -> Vec<SaveResult> {
        let taken = self.program.advance(clock);
        if std::mem::take(&mut self.program.restored) {
            self.dress(ctx);
        }
        taken
    }

    /// Keeps the log of this session in a file as it goes.
    #[must_use]
    pub fn with_log(mut self, file: Option<PathBuf>) -> Self {
        self.log_file = file;
        self
    }

    /// Without the system's file dialogs: paths are typed. For tests, and where a dialog would be in the way.
    #[must_use]
    pub fn without_dialogs(mut self) -> Self {
        self.dialogs = Dialogs::new(false);
        self
    }

    /// True while something is read, computed or drawn in the background.
    pub fn busy(&self) -> bool {
        let derived = &self.program.derived;
        self.program.busy() || derived.figures.busy() || derived.modal.figures.busy()
    }

    /// What survives a restart.
    pub fn state(&self) -> &State {
        &self.program.state
    }

    /// The log of this session, as it would be saved: [`super::replay`] does it again.
    pub fn log(&self) -> String {
        self.program.log.text(&self.program.state)
    }

    /// Opens files: measurements, or a project.
    pub fn open(&mut self, files: Vec<PathBuf>) {
        self.program.send(Message::Open(files));
    }

    /// The settings as they stand.
    pub fn settings(&self) -> &Settings {
        &self.program.state.document.edit.settings
    }

    /// The records, with what each is used for.
    pub fn records(&self) -> RecordSet {
        self.program.derived.records.set(&self.program.state.document.edit.usage)
    }

    /// What the last study found.
    pub fn outcome(&self) -> Option<&Arc<Outcome>> {
        self.program.derived.records.outcome.as_ref()
    }

    /// The modes that were found, where these are the base.
    pub fn modes(&self) -> Option<&Arc<ModalAnalysis>> {
        let modal = &self.program.derived.modal;
        modal.analysis().filter(|_| self.by_modes() && !modal.is_stale())
    }

    /// The force of the component that is measured, once it was identified.
    pub fn component(&self) -> Option<&Arc<ComponentAnalysis>> {
        self.program.derived.component.fit.found().filter(|_| self.of_component())
    }

    /// What the force of the component lacks, once that was looked for.
    pub fn component_diagnosis(&self) -> Option<&Arc<DiagnosedComponent>> {
        self.program.derived.component.search.found().filter(|_| self.of_component())
    }

    /// What has come of the stream that is followed: blocks identified, alarms raised, and the alarm that stands.
    pub fn streamed(&self) -> (usize, usize, Option<String>) {
        let stream = &self.program.derived.stream;
        (stream.updates.len(), stream.alarms, stream.alarm())
    }

    /// The series that is shown, once its table was read.
    pub fn shown_series(&self) -> Option<&Series> {
        self.open_series().map(|open| &open.series)
    }

    /// True if the base are modes.
    fn by_modes(&self) -> bool {
        !self.of_component() && self.program.state.document.edit.base.model == BaseModel::Modes
    }

    /// True if the force of a component is looked for.
    fn of_component(&self) -> bool {
        self.program.state.document.edit.component
    }

    /// True if there is a model that *Export model…* can write.
    fn exports_model(&self) -> bool {
        let derived = &self.program.derived;
        if self.by_modes() {
            return derived.modal.analysis().is_some();
        }
        derived.records.outcome.is_some() && !self.of_component()
    }

    /// True if there is something that a picture can show.
    fn has_figure(&self) -> bool {
        let derived = &self.program.derived;
        if self.shows_series() {
            return derived.series.found().is_some();
        }
        match (self.of_component(), self.by_modes()) {
            (true, _) => derived.component.fit.found().is_some(),
            (_, true) => derived.modal.analysis().is_some(),
            _ => self.outcome().is_some(),
        }
    }

    /// What was added in "What's missing".
    pub fn walk(&self) -> &Walk {
        &self.program.state.document.edit.walk
    }

    /// The model with what was added, once it was fitted.
    pub fn stage(&self) -> Option<&Arc<Stage>> {
        self.program.derived.missing.stage(self.walk())
    }

    /// What the walk in "What's missing" has come to, once it was asked: for a report.
    pub fn diagnosis(&self) -> Option<&Arc<Diagnosis>> {
        self.program.derived.missing.diagnosis(self.walk())
    }

    /// Opens what was dropped on the window.
    fn dropped(&mut self, ctx: &Context) {
        let files = ctx.input(|i| i.raw.dropped_files.clone());
        if files.is_empty() {
            return;
        }
        #[cfg(target_arch = "wasm32")]
        self.dialogs.expect(Purpose::Open, "", Box::pin(around::received(files)));
        #[cfg(not(target_arch = "wasm32"))]
        self.open(files.iter().map(|file| file.path().to_owned()).collect());
    }

    fn set_title(&mut self, ctx: &Context) {
        let records = &self.program.derived.records;
        let title = match (&self.program.state.project, records.records.is_empty()) {
            (_, true) => "Sindyscope".to_owned(),
            (Some(project), false) => format!("{} – Sindyscope", file_name(project)),
            (None, false) => format!("{} – Sindyscope", records.title),
        };
        if title != self.title {
            around::set_title(ctx, &title);
            self.title = title;
        }
    }

    /// Notes what has come to rest as a step that undo takes back.
    fn watch(&mut self, clock: FrameTime) {
        let WindowProgram { state, derived, .. } = &mut self.program;
        let rests = !derived.opening() && derived.history.watch(&state.document.edit, clock.held, clock.now);
        let rig_rests = derived.rig.watch(&state.rig, clock.held, clock.now);
        if rests {
            self.program.send(Message::Step);
        }
        if rig_rests {
            self.program.send(Message::RigStep);
        }
    }

    /// Has the state written once it has changed and nothing is being dragged.
    fn keep(&mut self, ctx: &Context, clock: FrameTime) {
        let restoring = self.program.derived.restoring();
        let Some(keeper) = self.keeper.as_mut().filter(|_| !clock.held && !restoring) else { return };
        if let Some(wait) = keeper.wait(clock.now) {
            return ctx.request_repaint_after_secs(wait as f32);
        }
        if let Some(text) = keeper.text(&self.program.state, clock.now) {
            let path = keeper.path().to_owned();
            self.program.want(Key::Session, Job::Session { path, text });
            if let Some(path) = self.log_file.clone() {
                let text = self.log();
                self.program.want(Key::Log, Job::Session { path, text });
            }
        }
    }

    fn clock(ctx: &Context) -> FrameTime {
        ctx.input(|i| FrameTime { now: i.time, held: i.pointer.any_down() })
    }
}

impl eframe::App for App {
    fn logic(&mut self, ctx: &Context, _frame: &mut eframe::Frame) {
        let clock = Self::clock(ctx);
        for taken in self.advance(ctx, clock) {
            if let SaveResult::Taken { purpose, path } = taken {
                self.dialogs.ask_to_replace(purpose, path);
            }
        }
        while let Ok((path, replaces, image)) = self.shots.1.try_recv() {
            self.save(Saving { path, purpose: Purpose::Window, replaces, content: SavedContent::Window(image) });
        }
        self.dropped(ctx);
        if let Some(chosen) = self.dialogs.chosen(ctx) {
            self.chosen(ctx, chosen);
        }
        around::complaints().into_iter().for_each(|told| self.program.derived.notices.error(told));
        self.set_title(ctx);
        if let Some(wait) = self.program.derived.records.fade(clock.held, clock.now) {
            ctx.request_repaint_after_secs(wait as f32);
        }
    }

    fn ui(&mut self, ui: &mut Ui, frame: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let clock = Self::clock(&ctx);
        if ctx.zoom_factor() != self.program.state.zoom {
            self.program.send(Message::Zoom(ctx.zoom_factor()));
        }
        display::install(&ctx, &self.program.state.shown.views.units);
        for command in WindowCommand::pressed(&ctx) {
            self.run(command, &ctx, frame);
        }
        // What is drawn is of the state as it is now.
        self.program.demand(clock.held);
        self.bars(ui, frame);
        if self.program.state.shown.room == Room::Rig {
            self.rig(ui, frame);
        } else if self.shows_series() {
            self.series(ui, frame);
        } else if self.shows_stream() {
            self.stream(ui, frame);
        } else {
            self.work(ui, frame);
        }
        self.watch(clock);
        if let Some(palette) = &mut self.palette {
            match palette.show(&ctx) {
                PaletteOutcome::Open => {}
                PaletteOutcome::Closed => self.palette = None,
                PaletteOutcome::Chosen(command) => {
                    self.palette = None;
                    self.run(command, &ctx, frame);
                }
            }
        }
        self.figure_panel(&ctx, frame);
        if let Some(act) = self.program.derived.columns.show(&ctx, &mut self.canvas.columns) {
            self.program.send(Message::Columns(act));
        }
        if let Some(command) = help::show(&ctx, &mut self.help_open) {
            self.run(command, &ctx, frame);
        }
        if let Some(chosen) = overlay::path_field(&ctx, &mut self.dialogs) {
            self.chosen(&ctx, chosen);
        }
        overlay::drop_zone(&ctx);
        self.program.derived.notices.show_toasts(&ctx, &mut self.canvas.toasted);
        let units = display::chosen(&ctx);
        if units != self.program.state.shown.views.units {
            let mut views = Box::new(self.program.state.shown.views.clone());
            views.units = units;
            self.program.send(Message::Views(views));
        }
        // What was just changed is asked for at once, not with the next event.
        self.program.demand(clock.held);
        self.keep(&ctx, clock);
    }

    /// The session's file holds the state; the system's storage only the window's place.
    fn save(&mut self, _storage: &mut dyn eframe::Storage) {}

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        let restoring = self.program.derived.restoring();
        let Some(keeper) = self.keeper.as_mut().filter(|_| !restoring) else { return };
        if let Some(text) = keeper.text(&self.program.state, f64::INFINITY) {
            let path = keeper.path().to_owned();
            self.program.want(Key::Session, Job::Session { path, text });
        }
        self.program.jobs.finish(&Key::Session, session::PATIENCE);
    }
}

/// The path with an ending, if it has none.
fn with_extension(path: &Path, extension: &str) -> PathBuf {
    if path.extension().is_some() { path.to_owned() } else { path.with_extension(extension) }
}
