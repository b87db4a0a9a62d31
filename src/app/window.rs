//! The app itself: state and background work brought together, frame by frame.

mod keeping;
mod opening;
mod teaching;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use egui::{CentralPanel, ColorImage, Context, Margin, RichText, Stroke, Theme, ThemePreference, Ui};

use super::bench::Bench;
use super::columns::Columns;
use super::command_palette::{self, Palette};
use super::commands::Command;
use super::cutter::Cutter;
use super::dialogs::{Chosen, Dialogs, Purpose};
use super::errand::{self, Delivery, Errand, Opening, Refused, file_name};
use super::figure_panel::{self, FigureLook};
use super::history::History;
use super::lessons::Teacher;
use super::missing::figures::Figure;
use super::missing::{Act, Missing, Walk};
use super::notices::{Level, Notices};
use super::panel::{self, Ask, Desk, Typing};
use super::plot::display;
use super::plot::export::save_png;
use super::plot::palette;
use super::questions::{Questions, replies};
use super::report::{self, ReportRoom, Saved};
use super::rig::RigRoom;
use super::session::Keeper;
use super::state::{Edit, Pin, Room, Source, State};
use super::survey::Survey;
use super::views::{self, Group, Picture, Request, Search, View, ViewState};
use super::worker::Worker;
use super::{AppError, help, overlay, status, theme, toolbar, welcome};
use sindyscope_core::study::{Ensemble, Landscape, Outcome, Settings, Study, StudyError};
use sindyscope_report::document::FigureFormat;
use sindyscope_report::export::{self, Format};
use sindyscope_search::{Diagnosis, Stage};
use sindyscope_values::format::equations;
use sindyscope_values::record::{Record, RecordSet};

/// A study to be run.
struct Question {
    ticket: u64,
    generation: u64,
    records: RecordSet,
    settings: Settings,
}

/// What came of it; it carries what it was asked with, so that a late one is recognised.
struct Answer {
    ticket: u64,
    generation: u64,
    result: Result<Arc<Outcome>, StudyError>,
}

/// What resampling said, with the number of the outcome's question.
type Repeated = Option<(u64, Result<Ensemble, StudyError>)>;

/// Pins whose outcomes are to be made again.
struct Pinned {
    generation: u64,
    pins: Vec<(RecordSet, Pin)>,
}

/// The records' generation, and each pin's outcome if it could be made.
type Made = (u64, Vec<Option<Arc<Outcome>>>);

/// A picture to be drawn and saved.
enum PictureJob {
    Plot(Box<PlotJob>),
    /// A figure that is drawn already, with its title.
    Drawing {
        path: PathBuf,
        svg: String,
        title: &'static str,
    },
    Table {
        path: PathBuf,
        text: String,
    },
    Window {
        path: PathBuf,
        image: Arc<ColorImage>,
    },
    Report {
        path: PathBuf,
        content: Box<report::Content>,
    },
}

/// A picture of a view.
struct PlotJob {
    path: PathBuf,
    like: Context,
    view: View,
    outcome: Arc<Outcome>,
    map: Option<Arc<Landscape>>,
    pins: Vec<Arc<Outcome>>,
    record: usize,
    state: ViewState,
    look: FigureLook,
}

/// A picture of the window and where it goes.
type Shot = (PathBuf, Arc<ColorImage>);

/// The window.
pub struct App {
    state: State,
    edit: Edit,
    suggestion: Settings,
    bench: Bench,
    history: History<Edit>,
    notices: Notices,
    dialogs: Dialogs,
    /// An answer that is missing tells of a crash.
    fitting: Worker<Question, Option<Answer>>,
    errands: Worker<Errand, Delivery>,
    pictures: Worker<PictureJob, Result<PathBuf, String>>,
    missing: Missing,
    report: ReportRoom,
    rig: RigRoom,
    teacher: Teacher,
    survey: Survey,
    questions: Questions,
    columns: Columns,
    /// Repeats the regression on resampled data once the settings rest.
    repeats: Worker<Question, Repeated>,
    /// The question that was repeated last.
    repeated: u64,
    /// Makes pinned outcomes again.
    pinning: Worker<Pinned, Option<Made>>,
    /// Pins whose outcomes are not there: yet, or as long as the records are read for another order.
    waiting_pins: Vec<Pin>,
    shots: (Sender<Shot>, Receiver<Shot>),
    /// The last question asked, its number, and the number of the last one answered.
    asked: Option<(u64, Edit)>,
    ticket: u64,
    answered: u64,
    under_way: Option<UnderWay>,
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

/// Which errand runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum UnderWay {
    Opening,
    Choosing,
    /// What this step of the preparation takes out is being found.
    Calibrating(usize),
}

impl App {
    /// The window as a person left it; what it shows is read and fitted in the background.
    ///
    /// # Errors
    /// The system gives no thread for the background work.
    pub fn with_state(ctx: &Context, state: State) -> Result<Self, AppError> {
        theme::install(ctx);
        ctx.set_theme(state.theme);
        if (0.5..=4.0).contains(&state.zoom) {
            ctx.set_zoom_factor(state.zoom);
        }
        let wake = || {
            let ctx = ctx.clone();
            move || ctx.request_repaint()
        };
        let mut app = Self {
            edit: Edit::default(),
            suggestion: Settings::default(),
            bench: Bench::default(),
            history: History::new(Edit::default()),
            notices: Notices::default(),
            dialogs: Dialogs::new(true),
            fitting: fitting_worker(wake())?,
            errands: Worker::spawn("errands", wake(), errand::run, || Delivery::Crashed)?,
            pictures: Worker::spawn(
                "pictures",
                wake(),
                |job, _, _| Some(draw(job)),
                || Err("the picture was not drawn: an error of the program; please report it".into()),
            )?,
            missing: Missing::new(wake())?,
            report: ReportRoom::new(wake())?,
            rig: RigRoom::new(wake())?,
            teacher: Teacher::default(),
            survey: Survey::new(wake())?,
            questions: Questions::new(wake())?,
            columns: Columns::new(wake())?,
            repeats: repeats_worker(wake())?,
            repeated: 0,
            pinning: pinning_worker(wake())?,
            waiting_pins: Vec::new(),
            shots: channel(),
            asked: None,
            ticket: 0,
            answered: 0,
            under_way: None,
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
            app.missing.bring_back(app.state.found.take());
            app.missing.begin_at(app.state.step);
            let State { source, reading, edit, checksums, .. } = app.state.clone();
            let folder = app.folder_of(&source, &reading);
            app.begin(Opening { reading, folder, edit, checksums, ..Opening::of(source) });
        }
        Ok(app)
    }

    /// Without the system's file dialogs: paths are typed. For tests, and where a dialog would be in the way.
    pub fn without_dialogs(mut self) -> Self {
        self.dialogs = Dialogs::new(false);
        self
    }

    /// True while something is read, computed or drawn in the background.
    pub fn busy(&self) -> bool {
        let workers =
            [self.fitting.busy(), self.errands.busy(), self.pictures.busy(), self.survey.busy(), self.questions.busy()];
        let busy =
            workers.iter().any(Option::is_some) || self.repeats.busy().is_some() || self.pinning.busy().is_some();
        let busy = busy || self.keeper.as_ref().is_some_and(Keeper::busy) || self.rig.waiting();
        let rooms = self.missing.waiting() || self.report.waiting() || self.columns.busy();
        busy || self.answered != self.ticket || rooms || self.state.views.busy()
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

    /// Takes in what the background work brought.
    fn collect(&mut self, ctx: &Context) {
        let (now, held) = ctx.input(|i| (i.time, i.pointer.any_down()));
        let idle = self.errands.busy().is_none();
        while let Some(delivery) = self.errands.answer() {
            self.under_way = None;
            self.delivered(delivery);
        }
        if idle && self.errands.busy().is_none() {
            self.under_way = None;
        }
        while let Some(answer) = self.fitting.answer() {
            let Some(answer) = answer else {
                self.answered = self.ticket;
                self.bench.failure = Some("the computation failed by an error of the program itself".into());
                continue;
            };
            self.answered = self.answered.max(answer.ticket);
            if answer.generation != self.bench.generation {
                continue;
            }
            match answer.result {
                Ok(outcome) => self.bench.take(outcome, held, now),
                Err(StudyError::Cancelled) => {}
                Err(error) => self.bench.failure = Some(error.to_string()),
            }
        }
        while let Some(answer) = self.pinning.answer() {
            if let Some((generation, made)) = answer {
                self.brought_back(generation, made);
            }
        }
        if let Some(problem) = self.keeper.as_ref().and_then(Keeper::failure) {
            self.notices.error(format!("The session was not saved: {problem}; save a project instead"));
        }
        self.missing.collect();
        if let Some(note) = self.missing.note() {
            self.notices.note(note);
        }
        self.report.collect();
        self.collect_rig();
        self.survey.collect();
        self.questions.collect();
        self.columns.collect();
        while let Some(answer) = self.repeats.answer() {
            if let Some((ticket, Ok(ensemble))) = answer
                && ticket == self.answered
            {
                self.bench.ensemble = Some(Arc::new(ensemble));
            }
        }
        while let Ok((path, image)) = self.shots.1.try_recv() {
            self.pictures.ask(PictureJob::Window { path, image });
        }
        while let Some(saved) = self.pictures.answer() {
            match saved {
                Ok(path) => self.notices.done(format!("Saved {}", path.display())),
                Err(problem) => self.notices.error(problem),
            }
        }
    }

    fn delivered(&mut self, delivery: Delivery) {
        match delivery {
            Delivery::Opened(opened) => self.opened(*opened),
            Delivery::NotOpened(refused) => {
                // The card in the left column says it for all to see.
                self.notices.log(Level::Error, refused.problem.what.clone());
                if let Source::Files(paths) = &refused.opening.source {
                    self.state.recent.retain(|p| !paths.contains(p) || p.exists());
                }
                if refused.problem.about_columns
                    && let Source::Files(paths) = &refused.opening.source
                {
                    self.columns.open(paths.clone(), &refused.opening.reading);
                }
                // A source that cannot be read just now stays the one to come back to, with all that belongs to it.
                self.refused = Some(*refused);
            }
            Delivery::Chosen { generation, .. } if generation != self.bench.generation => {}
            Delivery::Chosen { choice: Ok(choice), .. } => {
                // What was changed meanwhile stays; only what was chosen is taken over.
                for settings in [&mut self.edit.settings, &mut self.suggestion] {
                    settings.smoothing = choice.settings.smoothing;
                    settings.threshold = choice.settings.threshold;
                    settings.scaling = choice.settings.scaling;
                }
                self.notices.done(format!("Chosen: {}", choice.reason));
            }
            Delivery::Chosen { choice: Err(StudyError::Cancelled), .. } => {}
            Delivery::Chosen { choice: Err(error), .. } => self.notices.error(format!("Nothing was chosen: {error}")),
            Delivery::Calibrated { generation, .. } if generation != self.bench.generation => {}
            Delivery::Calibrated { step, found: Ok(found), .. } => self.take_out(step, &found),
            Delivery::Calibrated { found: Err(StudyError::Cancelled), .. } => {}
            Delivery::Calibrated { found: Err(error), .. } => self.notices.error(format!("Nothing was found: {error}")),
            Delivery::Crashed => {
                self.notices.error("That failed by an error of the program itself; please report what you did");
            }
        }
    }

    /// Repeats the regression on resampled data once the outcome is there and nothing is being dragged.
    fn repeat(&mut self, ctx: &Context) {
        let held = ctx.input(|i| i.pointer.any_down());
        let rests = self.answered == self.ticket && self.bench.outcome.is_some() && self.bench.failure.is_none();
        if held || !rests || self.repeated == self.answered {
            return;
        }
        self.repeated = self.answered;
        let (records, settings) = (self.records(), self.edit.settings.clone());
        let question = Question { ticket: self.answered, generation: self.bench.generation, records, settings };
        self.repeats.ask_instead(question);
    }

    /// Asks what the answers to the open questions would buy, once the outcome is there and nothing is being dragged.
    fn question(&mut self, ctx: &Context) {
        let kind = self.edit.settings.kind;
        let open = self.state.room == Room::Identify && self.edit.settings.known.is_empty();
        let replies = if open { replies(&self.bench.layout(kind), &self.bench.units(kind)) } else { Vec::new() };
        if replies.is_empty() {
            return self.questions.forget();
        }
        let held = ctx.input(|i| i.pointer.any_down());
        if self.answered != self.ticket {
            self.questions.give_way();
        } else if !held && self.bench.outcome.is_some() {
            let (bench, edit) = (&self.bench, &self.edit);
            self.questions.want(bench.generation, edit, replies, || bench.set(&edit.usage));
        }
    }

    /// Asks for the map of settings while a view shows it.
    fn look_around(&mut self) {
        if self.bench.records.is_empty() {
            self.survey.forget();
        } else if self.state.view.needs_map() && self.bench.outcome.is_some() {
            let (bench, edit) = (&self.bench, &self.edit);
            self.survey.want(bench.generation, edit, || bench.set(&edit.usage));
        }
    }

    /// Asks for a study if what was asked last is no longer what is wanted.
    fn ask(&mut self) {
        match self.state.room {
            Room::Identify => {}
            Room::Missing => self.missing.attend(&self.bench, &self.edit),
            Room::Rig => self.rig.attend(&self.state.rig),
            Room::Report => {
                // A walk that came back with its project is told in the report too.
                if !self.edit.walk.accepted.is_empty() || self.missing.found().is_some() {
                    self.missing.attend(&self.bench, &self.edit);
                }
                let sight = report::Sight {
                    bench: &self.bench,
                    edit: &self.edit,
                    diagnosis: self.missing.diagnosis(&self.edit.walk),
                    project: self.state.project.as_deref(),
                };
                self.report.attend(&sight);
            }
        }
        // A walk decides nothing of the study.
        let same = |(generation, edit): &(u64, Edit)| {
            *generation == self.bench.generation
                && (&edit.settings, &edit.usage) == (&self.edit.settings, &self.edit.usage)
        };
        if self.bench.records.is_empty() || self.asked.as_ref().is_some_and(same) {
            return;
        }
        self.ticket += 1;
        self.asked = Some((self.bench.generation, self.edit.clone()));
        self.fitting.ask(Question {
            ticket: self.ticket,
            generation: self.bench.generation,
            records: self.records(),
            settings: self.edit.settings.clone(),
        });
    }

    fn chosen(&mut self, ctx: &Context, chosen: Chosen) {
        let Chosen { purpose, paths, asked } = chosen;
        let Some(path) = paths.first().cloned() else { return };
        let named = purpose.ending().map_or(path.clone(), |ending| with_extension(path, ending));
        // A picture is never something else than its name says.
        let path = if purpose == Purpose::Window { named.with_extension("png") } else { named };
        if purpose.saves() && path.exists() && asked.as_ref() != Some(&path) {
            return self.dialogs.ask_to_replace(purpose, path);
        }
        match purpose {
            Purpose::Open => self.open(paths),
            Purpose::Add => self.add_records(paths),
            Purpose::Locate => self.located(path),
            Purpose::Project => self.save_project(&path),
            Purpose::Model => self.export_model(&path),
            Purpose::Plot if self.state.room == Room::Missing => self.draw_figure(ctx, path),
            Purpose::Plot => self.draw_plot(ctx, path),
            Purpose::Table => {
                let text = std::mem::take(&mut self.table);
                self.pictures.ask(PictureJob::Table { path, text });
            }
            Purpose::Report(_) => self.save_report(path),
            Purpose::RigRecords | Purpose::RoundRecords | Purpose::Rounds => {
                self.rig.save(purpose, path, &self.state.rig);
            }
            Purpose::Window => {
                let (send, ctx2) = (self.shots.0.clone(), ctx.clone());
                ctx.request_screenshot(move |image| {
                    // The window may be closing.
                    let _ = send.send((path, image));
                    ctx2.request_repaint();
                });
            }
        }
    }

    fn export_model(&mut self, path: &Path) {
        let Some(outcome) = &self.bench.outcome else { return };
        match export::write(outcome, path) {
            Ok(written) => {
                let names: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
                self.notices.done(format!("Saved {}", names.join(" and ")));
            }
            Err(problem) => self.notices.error(problem.to_string()),
        }
    }

    fn save_report(&mut self, path: PathBuf) {
        let sight = report::Sight {
            bench: &self.bench,
            edit: &self.edit,
            diagnosis: self.missing.diagnosis(&self.edit.walk),
            project: self.state.project.as_deref(),
        };
        if let Some(content) = sight.content() {
            self.pictures.ask(PictureJob::Report { path, content: Box::new(content) });
        }
    }

    /// Draws the panel that asks how the figure is to be saved, while it is open.
    fn figure_panel(&mut self, ctx: &Context, frame: &eframe::Frame) {
        let (name, drawn) = match self.state.room {
            _ if !self.figure_open || self.bench.outcome.is_none() => return,
            Room::Identify => (self.state.view.label(), self.state.view.figure(&self.state.views).is_some()),
            Room::Missing => (self.figure.name(), false),
            Room::Rig | Room::Report => return,
        };
        match figure_panel::show(ctx, name, &mut self.state.figure, drawn) {
            figure_panel::Outcome::Open => {}
            figure_panel::Outcome::Closed => self.figure_open = false,
            figure_panel::Outcome::Save => {
                let name = self.file_name(name, self.state.figure.format.figure().ending());
                self.dialogs.ask(Purpose::Plot, &name, frame, ctx);
            }
        }
    }

    /// The name that is offered for a file of a plot.
    fn file_name(&self, what: &str, ending: &str) -> String {
        let stem = Path::new(&self.bench.title).file_stem().map_or("figure".into(), |s| s.to_string_lossy());
        format!("{stem}-{}.{ending}", what.to_lowercase().replace(' ', "-"))
    }

    /// Draws a figure of "What's missing" at once: its thread is busy with the search.
    fn draw_figure(&mut self, ctx: &Context, path: PathBuf) {
        let size = self.state.figure.size;
        match self.missing.svg(ctx, &self.figure, (&self.bench, &self.edit), size) {
            Some(svg) => self.pictures.ask(PictureJob::Drawing { path, svg, title: self.figure.name() }),
            None => {
                self.notices.error("The figure was not saved: there is nothing to draw yet; look for effects first");
            }
        }
    }

    fn draw_plot(&mut self, ctx: &Context, path: PathBuf) {
        let Some(outcome) = self.bench.outcome.clone() else { return };
        let record = self.record_in(&outcome);
        let (view, state) = (self.state.view, self.state.views.clone());
        let map = self.survey.map().map(|(map, _)| Arc::clone(map));
        let pins = self.bench.pins.clone();
        let look = self.state.figure;
        let job = PlotJob { path, like: ctx.clone(), view, outcome, map, pins, record, state, look };
        self.pictures.ask(PictureJob::Plot(Box::new(job)));
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
            Command::Open => self.dialogs.ask(Purpose::Open, "", frame, ctx),
            Command::OpenPath => self.dialogs.type_path(Purpose::Open, "", ""),
            Command::Sample(sample) => self.open_sample(sample),
            Command::Demonstration => {
                let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
                self.begin(Opening::of(Source::Hidden(now.map_or(1, |d| d.as_micros() as u64))));
            }
            Command::Lessons => self.show_lessons(),
            Command::AddRecords => {
                let purpose = if self.bench.records.is_empty() { Purpose::Open } else { Purpose::Add };
                self.dialogs.ask(purpose, "", frame, ctx);
            }
            Command::Columns => self.show_columns(),
            Command::Close => self.close(),
            Command::SaveProject | Command::Choose if self.bench.records.is_empty() => {}
            Command::SaveProject => match self.state.project.clone() {
                Some(path) => self.save_project(&path),
                None => self.dialogs.ask(Purpose::Project, &format!("{stem}.json"), frame, ctx),
            },
            Command::SaveProjectAs => self.dialogs.ask(Purpose::Project, &format!("{stem}.json"), frame, ctx),
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
                self.under_way = Some(UnderWay::Choosing);
                let (generation, records) = (self.bench.generation, self.records());
                self.errands.ask_instead(Errand::Choose { generation, records, settings: self.edit.settings.clone() });
            }
            Command::Reset => self.edit.settings = self.suggestion.clone(),
            Command::PlotPicture if self.state.room == Room::Rig => {
                self.dialogs.ask(Purpose::Window, "virtual-rig.png", frame, ctx);
            }
            Command::PlotPicture | Command::ExportModel | Command::SaveReport if self.bench.outcome.is_none() => {}
            Command::SaveReport => self.dialogs.ask(Purpose::Report(Saved::Pdf), &format!("{stem}.pdf"), frame, ctx),
            Command::ExportModel => {
                let name = format!("{stem}.{}", Format::Python.ending());
                self.dialogs.ask(Purpose::Model, &name, frame, ctx);
            }
            Command::PlotPicture if self.state.room == Room::Report => {
                self.dialogs.ask(Purpose::Window, &format!("{stem}-report.png"), frame, ctx);
            }
            Command::PlotPicture => {
                self.figure_open = !self.figure_open;
                self.figure = self.missing.main_figure();
            }
            Command::WindowPicture => self.dialogs.ask(Purpose::Window, &format!("{stem}-window.png"), frame, ctx),
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
                self.dialogs.ask(Purpose::Table, &self.file_name(what, "csv"), frame, ctx);
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
            act => self.missing.act(act, &self.bench, &mut self.edit),
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
            Ask::Remedy(remedy) => {
                if let Some(settings) = remedy.settings {
                    self.edit.settings = settings;
                }
                if let Some((index, usage)) = remedy.usage
                    && let Some(old) = self.edit.usage.get_mut(index)
                {
                    *old = usage;
                }
            }
            Ask::Prepare(steps) => self.prepare(steps),
            // The strip stands above the plots of Identify: from the other room it leads there.
            Ask::Cut if self.state.room != Room::Identify => {
                (self.state.room, self.state.cutting) = (Room::Identify, true);
            }
            Ask::Cut => self.state.cutting = !self.state.cutting,
            Ask::Locate => self.dialogs.ask(Purpose::Locate, "", frame, ctx),
            Ask::Calibrate { step, sought } => {
                self.under_way = Some(UnderWay::Calibrating(step));
                let (generation, records) = (self.bench.generation, self.records());
                let settings = self.edit.settings.clone();
                self.errands.ask_instead(Errand::Calibrate { generation, records, settings, step, sought });
            }
            Ask::StopErrand => self.errands.cancel(),
        }
    }

    fn centre(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let dark = ui.visuals().dark_mode;
        let opening = self.under_way == Some(UnderWay::Opening);
        let outline = egui::Frame::new().fill(palette::ground(dark)).inner_margin(Margin::symmetric(10, 4));
        CentralPanel::default().frame(outline).show(ui, |ui| {
            if self.state.room == Room::Rig {
                return self.rig_centre(ui, frame);
            }
            if self.state.room == Room::Missing && !self.bench.records.is_empty() {
                for act in self.missing.show(ui, &self.bench, &self.edit, &mut self.state.views.freedom) {
                    self.walk_on(act, ui.ctx(), frame);
                }
                return;
            }
            if self.state.room == Room::Report && self.bench.outcome.is_some() {
                if let Some(report::Act::Save(saved)) = self.report.show(ui, &mut self.edit.report) {
                    let stem =
                        Path::new(&self.bench.title).file_stem().map_or("report".into(), |s| s.to_string_lossy());
                    let name = format!("{stem}.{}", saved.ending());
                    let ctx = ui.ctx().clone();
                    self.dialogs.ask(Purpose::Report(saved), &name, frame, &ctx);
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
                stale: self.answered != self.ticket || self.bench.failure.is_some(),
                search: Search {
                    map: self.survey.map().map(|(map, _)| map),
                    stale: self.survey.map().is_some_and(|(_, stale)| stale),
                    failure: self.survey.failure(),
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
                    let ctx = ui.ctx().clone();
                    self.dialogs.ask(Purpose::Table, &name, frame, &ctx);
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
        if let Some(chosen) = self.dialogs.chosen() {
            self.chosen(ctx, chosen);
        }
        self.ask();
        self.look_around();
        self.repeat(ctx);
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
        let opening = self.under_way == Some(UnderWay::Opening);
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
            fitting: self.fitting.busy(),
            errand: self.errands.busy().or(self.missing.busy()).or(self.report.busy()).or(self.rig.busy()),
            opening,
            notices: &mut self.notices,
            log_open: &mut self.log_open,
        };
        if status::show(ui, &mut line).is_some() {
            self.errands.cancel();
        }
        self.lesson(ui);
        let (now, held) = ctx.input(|i| (i.time, i.pointer.any_down()));
        let mut asks = Vec::new();
        if self.state.room == Room::Rig {
            self.rig_columns(ui, frame);
        } else if !self.bench.records.is_empty() || self.refused.is_some() {
            let choosing = self.errands.busy().filter(|_| self.under_way == Some(UnderWay::Choosing));
            let calibrating = match self.under_way {
                Some(UnderWay::Calibrating(step)) if self.errands.busy().is_some() => Some(step),
                _ => None,
            };
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
        if let Some(keeper) = &mut self.keeper {
            keeper.finish(&state);
        }
    }
}

fn fitting_worker(wake: impl Fn() + Send + 'static) -> std::io::Result<Worker<Question, Option<Answer>>> {
    let mut study = Study::default();
    Worker::spawn(
        "study",
        wake,
        move |question: Question, cancel, _| {
            let Question { ticket, generation, records, settings } = question;
            // Taken out, so that a crash leaves a fresh one behind.
            let mut current = std::mem::take(&mut study);
            let result = current.run(&records, &settings, cancel).map(Arc::new);
            study = current;
            Some(Some(Answer { ticket, generation, result }))
        },
        || None,
    )
}

fn pinning_worker(wake: impl Fn() + Send + 'static) -> std::io::Result<Worker<Pinned, Option<Made>>> {
    Worker::spawn(
        "pins",
        wake,
        move |Pinned { generation, pins }: Pinned, cancel, _| {
            let mut study = Study::default();
            let make = |(records, pin): (RecordSet, Pin)| study.run(&records, &pin.settings, cancel).ok().map(Arc::new);
            let made = pins.into_iter().map(make).collect();
            (!cancel.is_cancelled()).then_some(Some((generation, made)))
        },
        || None,
    )
}

fn repeats_worker(wake: impl Fn() + Send + 'static) -> std::io::Result<Worker<Question, Repeated>> {
    let mut study = Study::default();
    Worker::spawn(
        "repeats",
        wake,
        move |question: Question, cancel, _| {
            // Taken out, so that a crash leaves a fresh one behind.
            let mut current = std::mem::take(&mut study);
            let result = current.ensemble(&question.records, &question.settings, cancel);
            study = current;
            Some(Some((question.ticket, result)))
        },
        || None,
    )
}

fn draw(job: PictureJob) -> Result<PathBuf, String> {
    let (path, image) = match job {
        PictureJob::Plot(job) => {
            let PlotJob { path, like, view, outcome, map, pins, record, state, look } = *job;
            let search = Search { map: map.as_ref(), ..Search::default() };
            let picture = Picture { outcome: &outcome, previous: None, record, stale: false, search, pins: &pins };
            let format = FigureFormat::of(&path).map_err(|e| format!("The figure was not saved: {e}"))?;
            let own = view
                .figure(&state)
                .filter(|_| !look.as_shown && state.units.is_empty())
                .and_then(|kind| kind.svg(&outcome, record, look.size));
            let drawing = own.unwrap_or_else(|| views::vector(&like, view, &picture, &state, look.size));
            return save_figure(path, &drawing, view.label(), format);
        }
        PictureJob::Drawing { path, svg, title } => {
            let format = FigureFormat::of(&path).map_err(|e| format!("The figure was not saved: {e}"))?;
            return save_figure(path, &svg, title, format);
        }
        PictureJob::Table { path, text } => {
            let failed = |e| format!("The numbers were not saved: {e}; choose another folder ({})", path.display());
            std::fs::write(&path, text).map_err(failed)?;
            return Ok(path);
        }
        PictureJob::Window { path, image } => {
            let [width, height] = image.size.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
            let bytes: Vec<u8> = image.pixels.iter().flat_map(|p| p.to_srgba_unmultiplied()).collect();
            let image = image::RgbaImage::from_raw(width, height, bytes);
            (path, image.ok_or("the picture of the window came damaged; try again")?)
        }
        PictureJob::Report { path, content } => {
            content.report().write(&path).map_err(|e| format!("The report was not saved: {e}"))?;
            return Ok(path);
        }
    };
    save_png(&path, &image)?;
    Ok(path)
}

/// Writes a drawing in a form.
fn save_figure(path: PathBuf, drawing: &str, title: &str, format: FigureFormat) -> Result<PathBuf, String> {
    let written = format.bytes(drawing, title).map_err(|e| e.to_string()).and_then(|bytes| {
        std::fs::write(&path, bytes).map_err(|e| format!("{e}; choose another folder ({})", path.display()))
    });
    written.map(|()| path).map_err(|e| format!("The figure was not saved: {e}"))
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
