//! The system's dialogs.

use super::{DialogAnswer, Purpose};
use crate::app::purpose::{PROJECT_ENDING, ReportForm};
use sindyscope_report::document::FigureFormat;
use sindyscope_report::export::ExportFormat;

/// Some systems have no dialog, which shows when it is to be opened.
pub(super) const MAY_BE_ABSENT: bool = true;

/// Asks for a file; `name` is the one offered for saving.
pub(super) fn answer(purpose: Purpose, name: &str, frame: &eframe::Frame) -> Option<DialogAnswer> {
    let mut dialog = rfd::AsyncFileDialog::new().set_title(purpose.title());
    dialog = match purpose {
        Purpose::Open | Purpose::Add | Purpose::Locate => {
            let mut endings: Vec<&str> = sindyscope_files::FORMATS.iter().flat_map(|f| f.extensions).copied().collect();
            if purpose == Purpose::Open {
                // A table that a batch wrote is shown as a series.
                endings.extend([PROJECT_ENDING, "parquet"]);
            }
            dialog.add_filter("Measurements and projects", &endings).add_filter("All files", &["*"])
        }
        Purpose::Effects => dialog.add_filter("TOML", &["toml"]).add_filter("All files", &["*"]),
        Purpose::Series => dialog.add_filter("Table", &["csv", "parquet"]).add_filter("All files", &["*"]),
        Purpose::SaveEffects => dialog.add_filter("TOML", &["toml"]).set_file_name(name),
        Purpose::Log => dialog.add_filter("Log", &[PROJECT_ENDING]).set_file_name(name),
        Purpose::Project => dialog.add_filter("Project", &[PROJECT_ENDING]).set_file_name(name),
        Purpose::Model => {
            let all = ExportFormat::ALL.map(ExportFormat::ending);
            let each = |d: rfd::AsyncFileDialog, f: ExportFormat| d.add_filter(f.name(), &[f.ending()]);
            ExportFormat::ALL.into_iter().fold(dialog.add_filter("Every form", &all), each).set_file_name(name)
        }
        Purpose::Plot => {
            let endings = FigureFormat::ALL.map(FigureFormat::ending);
            let each = |d: rfd::AsyncFileDialog, e: &str| d.add_filter(e.to_uppercase(), &[e]);
            endings.into_iter().fold(dialog.add_filter("Figure", &endings), each).set_file_name(name)
        }
        Purpose::Window => dialog.add_filter("PNG picture", &["png"]).set_file_name(name),
        Purpose::Report(saved) => {
            let (pdf, html) = (("PDF", ["pdf"]), ("Web page", ["html"]));
            let kinds = if saved == ReportForm::Pdf { [pdf, html] } else { [html, pdf] };
            kinds.into_iter().fold(dialog, |d, (kind, endings)| d.add_filter(kind, &endings)).set_file_name(name)
        }
        Purpose::Table | Purpose::RigRecords | Purpose::RoundRecords | Purpose::Rounds | Purpose::StreamRecord => {
            dialog.add_filter("Table", &["csv"]).set_file_name(name)
        }
    };
    // In tests there is no window to belong to.
    if frame.winit_window().is_some() {
        dialog = dialog.set_parent(frame);
    }
    let one = |file: rfd::FileHandle| vec![file.path().to_owned()];
    // The dialog is made here, on the window's thread, as some systems ask; the answer is awaited from frame to frame.
    Some(match purpose {
        Purpose::Open | Purpose::Add => {
            let files = dialog.pick_files();
            Box::pin(async move { files.await.map(|files| files.into_iter().flat_map(one).collect()) })
        }
        Purpose::Locate | Purpose::Effects | Purpose::Series => {
            let file = dialog.pick_file();
            Box::pin(async move { file.await.map(one) })
        }
        _ => {
            let file = dialog.save_file();
            Box::pin(async move { file.await.map(one) })
        }
    })
}
