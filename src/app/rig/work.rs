//! The rig's background work: recorded, and its record studied.

use std::sync::Arc;

use super::sets;
use sindyscope_core::study::{Cancel, Outcome, Study, StudyError, suggest};
use sindyscope_rig::{RigRun, RigSettings, record_rig};
use sindyscope_values::term::Kind;

/// The last run, with the settings that it was made of.
pub(crate) type Recorded = (RigSettings, Arc<RigRun>);

/// A run of the rig and what was found in its record.
#[derive(Debug)]
pub(crate) struct RecordedRig {
    /// The settings that were asked for.
    pub(crate) settings: RigSettings,
    pub(crate) run: Arc<RigRun>,
    /// The study of the record, or why there is none.
    pub(crate) outcome: Result<Arc<Outcome>, String>,
}

/// What stands in place of equations mass by mass.
const BY_MODES: &str =
    "A structure is identified by its modes, not mass by mass: Study in Identify, then Identify its modes.";

/// Records the rig, unless the last run is of the same settings, and studies its record.
///
/// # Errors
/// These settings make no record.
pub(crate) fn record(
    last: &mut Option<Recorded>,
    settings: RigSettings,
    usual_library: bool,
    cancel: &Cancel,
) -> Result<RecordedRig, String> {
    let known = last.as_ref().filter(|(of, _)| *of == settings).map(|(_, run)| Arc::clone(run));
    let run = known.map_or_else(|| record_rig(&settings).map(Arc::new), Ok).map_err(|e| e.to_string())?;
    *last = Some((settings.clone(), Arc::clone(&run)));
    let outcome = if settings.plant.is_structure() {
        Err(BY_MODES.to_owned())
    } else {
        fit(&run, usual_library, cancel).map(Arc::new).map_err(|e| e.to_string())
    };
    Ok(RecordedRig { settings, run, outcome })
}

/// Fits with the settings that the program suggests, and the plant's own terms unless the library is to lack them.
fn fit(run: &RigRun, usual_library: bool, cancel: &Cancel) -> Result<Outcome, StudyError> {
    let records = sets::of_run(run);
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
