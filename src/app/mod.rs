//! The window. What a person does becomes a [`message`]; [`update`] makes of it the next state ([`state`]: what was decided) and
//! asks for background work ([`jobs`], on one [`queue`]); what that finds ([`derived`]) is drawn beside the state, one file a
//! panel, one file a view. The window holds no numerics.

mod answer;
mod columns;
mod command_palette;
mod commands;
mod component;
mod cutter;
mod derived;
mod dialogs;
mod disk;
mod figure_panel;
mod help;
mod history;
mod jobs;
mod lessons;
mod log;
mod message;
pub(crate) mod missing;
mod modal;
mod moved;
mod notices;
mod open;
mod overlay;
mod panel;
pub mod plot;
mod problem;
mod program;
mod project;
mod purpose;
mod questions;
mod queue;
mod records;
mod remedy;
mod replay;
mod report;
mod rig;
mod samples;
mod saving;
mod session;
mod settings_map;
mod state;
mod status;
mod stream;
mod theme;
mod toolbar;
mod update;
pub(crate) mod views;
mod welcome;
mod widgets;
mod window;

use std::path::PathBuf;

pub(crate) use project::is_project_file as is_project;
pub use replay::{Replayed, replay};
pub(crate) use report::headless::project as report_of_project;
pub use state::{
    Base, ClassCase, ClassRound, ClassState, Document, Edit, FolderReading, Guess, LessonPosition, LessonProgress,
    OwnEffects, Pin, RigState, Sample, Shown, Source, State, StreamForm, Walk, WalkView,
};
pub use window::App;

/// Why the window cannot be opened, in one sentence.
#[derive(Debug, thiserror::Error)]
pub enum AppError {
    /// No display, or one that cannot draw.
    #[error("{0}")]
    Display(String),
}

/// Opens the window, with files in it or else as it was left; returns once it is closed. What is done is kept in the log as it
/// goes, if one is named.
///
/// # Errors
/// The window cannot be opened: there is no display, or none that can draw.
pub fn run(files: Vec<PathBuf>, log: Option<PathBuf>) -> Result<(), AppError> {
    let mut viewport = egui::ViewportBuilder::default()
        .with_title("Sindyscope")
        .with_app_id(session::APP_ID)
        .with_inner_size([1280.0, 800.0])
        .with_min_inner_size([960.0, 600.0])
        .with_drag_and_drop(true);
    if let Ok(icon) = eframe::icon_data::from_png_bytes(include_bytes!("../../assets/icon.png")) {
        viewport = viewport.with_icon(icon);
    }
    let options = eframe::NativeOptions { viewport, ..Default::default() };
    let create = move |cc: &eframe::CreationContext<'_>| -> Result<Box<dyn eframe::App>, _> {
        let app = match session::file() {
            Some(session) => App::revived(&cc.egui_ctx, session, &files),
            // A system without a folder for the app: nothing outlasts the window but saved projects.
            None => App::with_state(&cc.egui_ctx, State::default().with_files(&files)),
        };
        Ok(Box::new(app.with_log(log)))
    };
    eframe::run_native("Sindyscope", options, Box::new(create)).map_err(|e| {
        // What the system says begins with places in other programs' sources; its last words name the reason.
        let text = e.to_string();
        let reason = text.lines().next().and_then(|line| line.rsplit(": ").next()).unwrap_or("no reason given");
        AppError::Display(format!("the display does not answer ({reason})"))
    })
}
