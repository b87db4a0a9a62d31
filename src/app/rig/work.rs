//! The rig's background work: recorded and fitted, the newest settings only.

use std::sync::Arc;

use crate::app::worker::Worker;
use sindyscope_core::study::{Cancel, Outcome, Study, StudyError, suggest};
use sindyscope_rig::{RigRun, RigSettings, record_rig};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::Kind;

pub(super) struct Question {
    pub(super) ticket: u64,
    pub(super) settings: RigSettings,
    pub(super) usual_library: bool,
}

/// The rig's records and the study of them; either may have failed, with a sentence.
pub(super) type Made = Result<(Arc<RigRun>, Result<Arc<Outcome>, String>), String>;

/// What came of it; it carries what it was asked with.
pub(super) struct Answer {
    pub(super) ticket: u64,
    pub(super) settings: RigSettings,
    pub(super) result: Made,
}

pub(super) fn worker(wake: impl Fn() + Send + 'static) -> std::io::Result<Worker<Question, Option<Answer>>> {
    let mut last: Option<(RigSettings, Arc<RigRun>)> = None;
    Worker::spawn(
        "rig",
        wake,
        move |question: Question, cancel, _| {
            let Question { ticket, settings, usual_library } = question;
            let known = last.as_ref().filter(|(of, _)| *of == settings).map(|(_, run)| Arc::clone(run));
            let run = known.map_or_else(|| record_rig(&settings).map(Arc::new), Ok);
            let result = match run {
                Ok(run) => {
                    last = Some((settings.clone(), Arc::clone(&run)));
                    let outcome = fit(&run, usual_library, cancel).map(Arc::new).map_err(|e| e.to_string());
                    Ok((run, outcome))
                }
                Err(error) => Err(error.to_string()),
            };
            // A newer question is waiting: half a study is none.
            (!cancel.is_cancelled()).then_some(Some(Answer { ticket, settings, result }))
        },
        || None,
    )
}

/// The records of a run: one fitted, one held out.
pub(crate) fn records(run: &RigRun) -> RecordSet {
    let [fitted, held_out] = &run.records;
    let mut set = RecordSet::new([fitted.clone()], Usage::Fit);
    set.add([held_out.clone()], Usage::HeldOut);
    set
}

/// Fits with the settings that the program suggests, and the plant's own terms unless the library is to lack them.
fn fit(run: &RigRun, usual_library: bool, cancel: &Cancel) -> Result<Outcome, StudyError> {
    let records = records(run);
    let mut settings = suggest(&records, Kind::SecondOrder)?;
    if !usual_library {
        for term in run.truth.library() {
            if !settings.terms.contains(term) {
                settings.terms.push(term.clone());
            }
        }
    }
    Study::default().run(&records, &settings, cancel)
}
