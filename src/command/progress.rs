use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};

/// A line on the terminal that says how far the work is; nothing where no person is watching.
pub(super) struct Progress {
    watched: bool,
    shown: Mutex<Option<String>>,
}

impl Progress {
    pub(super) fn new() -> Self {
        Self { watched: std::io::stderr().is_terminal(), shown: Mutex::default() }
    }

    /// What is being done, and the share done so far, 0 to 1.
    pub(super) fn show(&self, what: &str, share: f64) {
        if !self.watched {
            return;
        }
        let line = format!("{what}: {:3} %", (100.0 * share.clamp(0.0, 1.0)) as u64);
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        if shown.as_ref() != Some(&line) {
            // Nobody is left to tell if standard error is gone.
            let _ = write!(std::io::stderr(), "\r{line}\x1b[K");
            *shown = Some(line);
        }
    }

    pub(super) fn clear(&self) {
        if self.shown.lock().unwrap_or_else(PoisonError::into_inner).take().is_some() {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}
