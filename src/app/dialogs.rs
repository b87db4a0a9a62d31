//! Asking for a file: the system's dialog where there is one, a path to type where there is none.

use std::future::Future;
use std::path::PathBuf;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context as TaskContext, Poll, Wake, Waker};
use std::time::{Duration, Instant};

use super::project;
use super::report::Saved;
use sindyscope_report::document::FigureFormat;
use sindyscope_report::export::Format;

/// A dialog that vanishes faster than this was never seen by a person: the system has none.
const UNSEEN: Duration = Duration::from_millis(400);

/// What a file is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// To be read: measurements or a project.
    Open,
    /// To be read beside what is open.
    Add,
    /// To be read in place of a file that is not where it was.
    Locate,
    /// To save the project to.
    Project,
    /// To export the model to, in the form that the name's ending says.
    Model,
    /// To save a picture of the plot to.
    Plot,
    /// To save the numbers of a plot to.
    Table,
    /// To save a picture of the window to.
    Window,
    /// To save the report to, as what the name's ending says.
    Report(Saved),
    /// To save the virtual rig's records to.
    RigRecords,
    /// To save the records of a class's round to.
    RoundRecords,
    /// To export the rounds of a class to.
    Rounds,
}

impl Purpose {
    /// The dialog's title, and the label of the path field.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Open => "Open measurements or a project",
            Self::Add => "Add records",
            Self::Locate => "Choose where the file is now",
            Self::Project => "Save the project",
            Self::Model => "Export the model (.tex .txt .json .py .m .mo .c)",
            Self::Plot => "Save the figure (.svg .pdf .png)",
            Self::Table => "Save the numbers of the plot (.csv)",
            Self::Window => "Save a picture of the window",
            Self::Report(_) => "Save the report (.pdf .html .png)",
            Self::RigRecords => "Save the rig's records",
            Self::RoundRecords => "Save the round's records",
            Self::Rounds => "Export the rounds",
        }
    }

    /// What the path field's button says.
    pub(crate) fn verb(self) -> &'static str {
        match self {
            Self::Open => "Open",
            Self::Add => "Add files",
            Self::Locate => "Choose",
            Self::Project
            | Self::Model
            | Self::Plot
            | Self::Table
            | Self::Window
            | Self::Report(_)
            | Self::RigRecords
            | Self::RoundRecords
            | Self::Rounds => "Save",
        }
    }

    /// True if something is written to the file.
    pub(crate) fn saves(self) -> bool {
        self.ending().is_some()
    }

    /// The ending that a file saved for it gets if its name has none.
    pub(crate) fn ending(self) -> Option<&'static str> {
        match self {
            Self::Open | Self::Add | Self::Locate => None,
            Self::Project => Some(project::EXTENSION),
            Self::Model => Some(Format::Python.ending()),
            Self::Plot | Self::Window => Some("png"),
            Self::Report(saved) => Some(saved.ending()),
            Self::Table | Self::RigRecords | Self::RoundRecords | Self::Rounds => Some("csv"),
        }
    }
}

/// A file that a person chose.
#[derive(Debug)]
pub(crate) struct Chosen {
    pub(crate) purpose: Purpose,
    pub(crate) paths: Vec<PathBuf>,
    /// Whether a person was asked about replacing the file that is there, if one is.
    pub(crate) asked: Option<PathBuf>,
}

/// A dialog of the system that is open.
struct OpenDialog {
    purpose: Purpose,
    /// The name that was offered.
    name: String,
    since: Instant,
    answer: Pin<Box<dyn Future<Output = Option<Vec<PathBuf>>>>>,
}

/// A path being typed.
#[derive(Debug)]
pub(crate) struct PathField {
    pub(crate) purpose: Purpose,
    pub(crate) text: String,
    /// Why the field is here, where a dialog was expected.
    pub(crate) reason: &'static str,
    /// True until it was given the keyboard.
    pub(crate) fresh: bool,
    /// The path of a file that is there and that was asked about: sent again, it is replaced.
    pub(crate) replaces: Option<PathBuf>,
}

/// The dialogs of one window.
pub(crate) struct Dialogs {
    open: Option<OpenDialog>,
    /// False in tests, and where the system turned out to have no dialog.
    native: bool,
    /// The path being typed, if any.
    pub(crate) field: Option<PathField>,
}

impl Dialogs {
    /// With the system's dialogs, or with the path field only.
    pub(crate) fn new(native: bool) -> Self {
        Self { open: None, native, field: None }
    }

    /// Asks for a file; `name` is the one offered for saving.
    pub(crate) fn ask(&mut self, purpose: Purpose, name: &str, frame: &eframe::Frame) {
        if self.open.is_some() {
            return;
        }
        if !self.native {
            return self.type_path(purpose, name, "");
        }
        let mut dialog = rfd::AsyncFileDialog::new().set_title(purpose.title());
        dialog = match purpose {
            Purpose::Open | Purpose::Add | Purpose::Locate => {
                let mut endings: Vec<&str> =
                    sindyscope_files::FORMATS.iter().flat_map(|f| f.extensions).copied().collect();
                if purpose == Purpose::Open {
                    endings.push(project::EXTENSION);
                }
                dialog.add_filter("Measurements and projects", &endings).add_filter("All files", &["*"])
            }
            Purpose::Project => dialog.add_filter("Project", &[project::EXTENSION]).set_file_name(name),
            Purpose::Model => {
                let all = Format::ALL.map(Format::ending);
                let each = |d: rfd::AsyncFileDialog, f: Format| d.add_filter(f.name(), &[f.ending()]);
                Format::ALL.into_iter().fold(dialog.add_filter("Every form", &all), each).set_file_name(name)
            }
            Purpose::Plot => {
                let endings = FigureFormat::ALL.map(FigureFormat::ending);
                let each = |d: rfd::AsyncFileDialog, e: &str| d.add_filter(e.to_uppercase(), &[e]);
                endings.into_iter().fold(dialog.add_filter("Figure", &endings), each).set_file_name(name)
            }
            Purpose::Window => dialog.add_filter("PNG picture", &["png"]).set_file_name(name),
            Purpose::Report(saved) => {
                let (pdf, html) = (("PDF", ["pdf"]), ("Web page", ["html"]));
                let kinds = if saved == Saved::Pdf { [pdf, html] } else { [html, pdf] };
                kinds.into_iter().fold(dialog, |d, (kind, endings)| d.add_filter(kind, &endings)).set_file_name(name)
            }
            Purpose::Table | Purpose::RigRecords | Purpose::RoundRecords | Purpose::Rounds => {
                dialog.add_filter("Table", &["csv"]).set_file_name(name)
            }
        };
        // In tests there is no window to belong to.
        if frame.winit_window().is_some() {
            dialog = dialog.set_parent(frame);
        }
        let one = |file: rfd::FileHandle| vec![file.path().to_owned()];
        // The dialog is made here, on the window's thread, as some systems ask; the answer is awaited from frame to frame.
        let answer: Pin<Box<dyn Future<Output = Option<Vec<PathBuf>>>>> = match purpose {
            Purpose::Open | Purpose::Add => {
                let files = dialog.pick_files();
                Box::pin(async move { files.await.map(|files| files.into_iter().flat_map(one).collect()) })
            }
            Purpose::Locate => {
                let file = dialog.pick_file();
                Box::pin(async move { file.await.map(one) })
            }
            _ => {
                let file = dialog.save_file();
                Box::pin(async move { file.await.map(one) })
            }
        };
        self.open = Some(OpenDialog { purpose, name: name.to_owned(), since: Instant::now(), answer });
    }

    /// Offers a path field.
    pub(crate) fn type_path(&mut self, purpose: Purpose, name: &str, reason: &'static str) {
        let text = match purpose.saves() {
            false => String::new(),
            true => std::env::current_dir().unwrap_or_default().join(name).display().to_string(),
        };
        self.field = Some(PathField { purpose, text, reason, fresh: true, replaces: None });
    }

    /// Asks whether a file that is there is to be replaced.
    pub(crate) fn ask_to_replace(&mut self, purpose: Purpose, path: PathBuf) {
        let text = path.display().to_string();
        self.field = Some(PathField { purpose, text, reason: "", fresh: true, replaces: Some(path) });
    }

    /// The file that was chosen since the last call; another frame is asked for when there may be one.
    pub(crate) fn chosen(&mut self, ctx: &egui::Context) -> Option<Chosen> {
        let waker = Waker::from(Arc::new(Repaint(ctx.clone())));
        let open = self.open.as_mut()?;
        let Poll::Ready(paths) = open.answer.as_mut().poll(&mut TaskContext::from_waker(&waker)) else { return None };
        let OpenDialog { purpose, name, since, .. } = self.open.take()?;
        match paths {
            Some(paths) => {
                // The system's own dialog has asked whether a file may be replaced.
                let asked = paths.first().cloned();
                Some(Chosen { purpose, paths, asked })
            }
            None if since.elapsed() < UNSEEN => {
                self.native = false;
                self.type_path(purpose, &name, "This system has no file dialog");
                None
            }
            None => None,
        }
    }
}

/// Asks for a frame as soon as a dialog may have been answered.
struct Repaint(egui::Context);

impl Wake for Repaint {
    fn wake(self: Arc<Self>) {
        self.0.request_repaint();
    }
}
