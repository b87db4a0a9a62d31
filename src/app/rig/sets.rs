//! What the records of the rig and of a round are used for.

use sindyscope_rig::RigRun;
use sindyscope_rig::hidden::Hidden;
use sindyscope_values::record::{RecordSet, Usage};

/// The records of a run: one fitted, one held out.
pub(crate) fn of_run(run: &RigRun) -> RecordSet {
    let [fitted, held_out] = &run.records;
    let mut set = RecordSet::new([fitted.clone()], Usage::Fit);
    set.add([held_out.clone()], Usage::HeldOut);
    set
}

/// A round's records with what each is for.
pub(crate) fn of_round(hidden: Hidden) -> RecordSet {
    let mut set = RecordSet::new(hidden.fit, Usage::Fit);
    set.add(hidden.held_out, Usage::HeldOut);
    set
}
