//! Asking for a file: the system's dialog where there is one, a path to type where there is none.

#[cfg(not(target_arch = "wasm32"))]
#[path = "dialogs/desktop.rs"]
mod asking;
#[cfg(target_arch = "wasm32")]
#[path = "dialogs/page.rs"]
mod asking;

use std::future::Future;
use std::path::PathBuf;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context as TaskContext, Poll, Wake, Waker};
use std::time::Duration;

use super::purpose::Purpose;
use sindyscope_system::time::Instant;

/// A dialog that vanishes faster than this was never seen by a person: the system has none.
const UNSEEN: Duration = Duration::from_millis(400);

/// The files that will have been chosen; none if none was.
type DialogAnswer = Pin<Box<dyn Future<Output = Option<Vec<PathBuf>>>>>;

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
    answer: DialogAnswer,
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
        match asking::answer(purpose, name, frame) {
            Some(answer) => self.expect(purpose, name, answer),
            None => self.type_path(purpose, name, ""),
        }
    }

    /// Waits for files that are being chosen or handed in.
    pub(crate) fn expect(&mut self, purpose: Purpose, name: &str, answer: DialogAnswer) {
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
            None if asking::MAY_BE_ABSENT && since.elapsed() < UNSEEN => {
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
