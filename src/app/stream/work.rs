//! Following a stream beside the window.

use std::time::{Duration, Instant};

use crate::app::remedy;
use crate::app::state::StreamForm;
use sindyscope_analysis::watch::source::{Arrival, Arriving, StreamSource};
use sindyscope_analysis::watch::{ArrivalCounts, Watch, WatchEvent, Watching};
use sindyscope_analysis::{AnalysisError, AnalysisRequest};
use sindyscope_core::study::Cancel;
use sindyscope_values::record::Record;

/// How often the window is told at most: a picture ten times a second is as good as live.
const TELL_EVERY: Duration = Duration::from_millis(100);
/// How long nothing may come before it is looked at whether the stream is still wanted.
const PATIENCE: Duration = Duration::from_millis(50);

/// What has come of a stream since it was told last.
#[derive(Debug, Default)]
pub(crate) struct StreamPart {
    pub(crate) events: Vec<WatchEvent>,
    pub(crate) counts: ArrivalCounts,
    /// Share of the first seconds that has come; none once the settings are chosen.
    pub(crate) filled: Option<f64>,
    /// The last seconds.
    pub(crate) record: Option<Record>,
    /// What the source waits for.
    pub(crate) waiting: Option<String>,
}

/// Follows the stream that a form asks for until it ends or is cancelled; `tell` gets what comes of it.
///
/// # Errors
/// The source or its rows cannot be used, in a sentence with what to try.
pub(crate) fn follow(form: &StreamForm, cancel: &Cancel, tell: &dyn Fn(StreamPart)) -> Result<(), String> {
    let source: StreamSource = form.source.trim().parse()?;
    let given = [("terms", form.terms.trim())].into_iter().filter(|(_, text)| !text.is_empty());
    let request = AnalysisRequest::named(given).map_err(worded)?;
    let watching = Watching { last: form.last, false_alarms: form.false_alarms, ..Watching::default() };
    let mut watch = Watch::new(&source.to_string(), request, watching).map_err(worded)?;
    let arriving = Arriving::open(&source, cancel)?;
    let (mut part, mut told, mut fresh) = (StreamPart::default(), Instant::now(), true);
    while !cancel.is_cancelled() {
        let ended = match arriving.next(PATIENCE) {
            Some(Arrival::Bytes(bytes)) => {
                (part.waiting, fresh) = (None, true);
                take(&mut watch, &bytes, cancel, &mut part.events)?;
                false
            }
            Some(Arrival::Anew) => {
                watch.begin_anew();
                false
            }
            Some(Arrival::Waiting(what)) => {
                (part.waiting, fresh) = (Some(what), true);
                false
            }
            Some(Arrival::Failed(why)) => return Err(why),
            Some(Arrival::Ended) => {
                match watch.end(cancel, &|_| (), &mut part.events) {
                    Err(error) if error.is_cancelled() => return Ok(()),
                    ended => ended.map_err(worded)?,
                }
                true
            }
            None => false,
        };
        if ended || fresh && told.elapsed() >= TELL_EVERY {
            (part.counts, part.filled, part.record) = (watch.counts(), watch.filled(), watch.record());
            let waiting = part.waiting.clone();
            tell(std::mem::take(&mut part));
            (part.waiting, told, fresh) = (waiting, Instant::now(), false);
        }
        if ended {
            return Ok(());
        }
    }
    Ok(())
}

fn take(watch: &mut Watch, bytes: &[u8], cancel: &Cancel, events: &mut Vec<WatchEvent>) -> Result<(), String> {
    match watch.take(bytes, cancel, &|_| (), events) {
        Err(error) if error.is_cancelled() => Ok(()),
        taken => taken.map_err(worded),
    }
}

/// What is wrong, with what would help.
fn worded(error: AnalysisError) -> String {
    let remedies = error.remedies();
    if remedies.is_empty() { error.to_string() } else { format!("{error}: {}", remedy::worded(&remedies)) }
}
