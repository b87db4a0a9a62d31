use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};

use super::failure::Failure;
use super::options::StudyOptions;
use crate::record::{RecordSet, read_set};
use crate::study::{Cancel, Free, Outcome, Study, choose, suggest};

/// A study with how its settings came about.
pub(super) struct Analysis {
    pub(super) records: RecordSet,
    pub(super) outcome: Outcome,
    /// How the settings that were not given were chosen.
    pub(super) choice: Option<String>,
}

/// Reads the records, chooses what was left open, and runs the study.
pub(super) fn analyse(options: &StudyOptions) -> Result<Analysis, Failure> {
    let records = read_set(&options.data, &options.test, &options.reading())?;
    let cancel = Cancel::default();
    let mut settings = suggest(&records, options.kind.into())?;
    options.apply(&mut settings);
    let free = Free {
        window: options.window_is_free(),
        order: options.order_is_free(),
        threshold: options.threshold.is_none(),
        form: options.form_is_free(),
    };
    let mut choice = None;
    if free.window || free.order || free.threshold {
        let progress = Progress::new();
        let chosen = choose(&records, &settings, free, &cancel, &|share| progress.show(share));
        progress.clear();
        let chosen = chosen?;
        settings = chosen.settings;
        choice = Some(chosen.reason);
    }
    let outcome = Study::default().run(&records, &settings, &cancel)?;
    Ok(Analysis { records, outcome, choice })
}

/// A line on the terminal that says how far the work is; nothing where no person is watching.
struct Progress {
    watched: bool,
    shown: AtomicU64,
}

impl Progress {
    const NOTHING: u64 = u64::MAX;

    fn new() -> Self {
        Self { watched: std::io::stderr().is_terminal(), shown: AtomicU64::new(Self::NOTHING) }
    }

    fn show(&self, share: f64) {
        let percent = (100.0 * share.clamp(0.0, 1.0)) as u64;
        if self.watched && self.shown.swap(percent, Ordering::Relaxed) != percent {
            let _ = write!(std::io::stderr(), "\rchoosing settings: {percent:3} %");
        }
    }

    fn clear(&self) {
        if self.shown.load(Ordering::Relaxed) != Self::NOTHING {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}
