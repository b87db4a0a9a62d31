//! What a stream tells, as JSON: one object a line.

use serde_json::{Value, json};

use super::{ArrivalCounts, Settled};
use crate::json::{VERSION, equations};
use sindyscope_core::study::{Alarm, AlarmCause, AlarmChange, Cleared, StreamUpdate};
use sindyscope_values::model::Units;
use sindyscope_values::term::Layout;

/// What is identified after a block.
pub fn update_json(update: &StreamUpdate, settled: &Settled) -> Value {
    let layout = &update.model.layout;
    let units = Units::from_record(&settled.opening, layout);
    json!({
        "version": VERSION,
        "time": update.time,
        "samples": update.samples,
        "covered": update.covered,
        "equations": equations(&update.model, &units),
        "residual_ratio": update.judged.as_ref().map(|j| j.ratio),
        "p_value": update.judged.as_ref().map(|j| j.p_value),
        "alarm": update.alarm.as_ref().map(|alarm| alarm_json(alarm, layout)),
        "change": update.change.map(|change| match change {
            AlarmChange::Raised => "raised",
            AlarmChange::Cleared(Cleared::Returned) => "returned",
            AlarmChange::Cleared(Cleared::Relearned) => "relearned",
        }),
    })
}

fn alarm_json(alarm: &Alarm, layout: &Layout) -> Value {
    match &alarm.cause {
        AlarmCause::Coefficient { state, term, before, after } => json!({
            "since": alarm.since,
            "cause": "coefficient",
            "state": layout.name(*state),
            "term": term.text(layout),
            "before": before,
            "after": after,
        }),
        AlarmCause::Residual { state, ratio } => {
            json!({ "since": alarm.since, "cause": "residual", "state": layout.name(*state), "ratio": ratio })
        }
    }
}

/// What has become of all rows, at the end.
pub fn summary_json(counts: ArrivalCounts, alarms: usize) -> Value {
    let ArrivalCounts { taken, repeated, late, unreadable, restarts, gaps } = counts;
    json!({
        "version": VERSION,
        "summary": {
            "rows": taken, "repeated": repeated, "late": late, "unreadable": unreadable, "restarts": restarts, "gaps": gaps,
            "alarms": alarms,
        },
    })
}
