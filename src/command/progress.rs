use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sindyscope_analysis::AnalysisProgress;

/// A line on the terminal that says what is done, how far it is, and how long it will take; nothing where no person is watching,
/// as behind a pipe. It is gone with the value.
pub(super) struct ProgressLine(ProgressBar);

/// Steps of a whole.
const STEPS: u64 = 1000;
/// How often the line is drawn anew, so that the time goes on.
const TICK: Duration = Duration::from_millis(200);

impl ProgressLine {
    /// Where something is `quiet`, nothing is shown.
    pub(super) fn new(quiet: bool) -> Self {
        // Of standard error that is no terminal nothing is made by the library itself.
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        Self(ProgressBar::with_draw_target(Some(STEPS), target))
    }

    /// What an analysis tells.
    pub(super) fn show(&self, progress: AnalysisProgress) {
        match progress {
            AnalysisProgress::Stage(what) => self.stage(what),
            AnalysisProgress::Share(what, share) => self.share(what, share),
        }
    }

    /// Something is done of which it is not known how far it is.
    pub(super) fn stage(&self, what: &'static str) {
        self.tell("{spinner} {msg}, {elapsed}", what);
    }

    /// Something is done, and this share of the whole, 0 to 1.
    pub(super) fn share(&self, what: &'static str, share: f64) {
        self.tell("{bar:24} {percent:>3} %, {eta} left: {msg}", what);
        self.0.set_position((STEPS as f64 * share.clamp(0.0, 1.0)) as u64);
    }

    /// Nothing more is shown.
    pub(super) fn hide(&self) {
        if !self.0.is_finished() {
            self.0.finish_and_clear();
        }
    }

    fn tell(&self, template: &str, what: &'static str) {
        // Both templates are right; without one the library's own would be used.
        if self.0.message() != what
            && let Ok(style) = ProgressStyle::with_template(template)
        {
            self.0.set_style(style);
            self.0.set_message(what);
            self.0.enable_steady_tick(TICK);
        }
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
