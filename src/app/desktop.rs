//! The window on a desktop.

use std::path::PathBuf;

use egui::{Context, ViewportCommand};

use super::{App, State, session};

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

/// The title of the window.
pub(super) fn set_title(ctx: &Context, title: &str) {
    ctx.send_viewport_cmd(ViewportCommand::Title(title.to_owned()));
}

/// What went wrong beside the window, in sentences: nothing can.
pub(super) fn complaints() -> Vec<String> {
    Vec::new()
}
