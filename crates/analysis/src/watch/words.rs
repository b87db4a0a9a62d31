//! What a stream tells, in sentences.

use super::{ArrivalCounts, Settled};
use sindyscope_core::study::{Alarm, AlarmCause, Cleared};
use sindyscope_values::format::number::significant;
use sindyscope_values::term::{Layout, Term};

/// What the model no longer explains.
pub fn alarm_words(alarm: &Alarm, layout: &Layout) -> String {
    match &alarm.cause {
        AlarmCause::Coefficient { state, term, before, after } => format!(
            "as if the coefficient of {} in d{}/dt were {} in place of {}",
            term.text(layout),
            layout.name(*state),
            significant(*after, 4),
            significant(*before, 4)
        ),
        AlarmCause::Residual { state, ratio } => format!(
            "{} times as much as usual is left of d{}/dt, along no term of the model",
            significant(*ratio, 3),
            layout.name(*state)
        ),
    }
}

/// Why an alarm ended.
pub fn cleared_words(why: Cleared, last: f64) -> String {
    match why {
        Cleared::Returned => "the model from before explains what arrives again".into(),
        Cleared::Relearned => format!("the last {last} s all came since it began and are the new measure"),
    }
}

/// What the stream is identified with, one sentence.
pub fn settled_words(settled: &Settled) -> String {
    let Settled { settings, blocking, opening, last, .. } = settled;
    let layout = opening.layout(settings.kind);
    let terms: Vec<String> = settings.terms.iter().map(|t: &Term| t.text(&layout)).collect();
    format!(
        "{} samples a second; the last {last} s are identified in {} blocks of {} s: terms {}, segments of {} samples, order {}, \
         threshold {}",
        significant(opening.interval.recip(), 6),
        blocking.kept,
        significant(blocking.seconds(), 3),
        terms.join(", "),
        settings.smoothing.window,
        settings.smoothing.order,
        significant(settings.threshold, 3)
    )
}

/// What has become of all rows, one sentence.
pub fn summary_words(counts: ArrivalCounts, alarms: usize) -> String {
    let ArrivalCounts { taken, repeated, late, unreadable, restarts, gaps } = counts;
    let mut text = format!("{taken} rows, {}", plural(alarms, "alarm"));
    for (count, what) in [
        (gaps, "gap"),
        (restarts, "new beginning"),
        (repeated, "row that came twice"),
        (late, "row out of order"),
        (unreadable, "line that is no row"),
    ] {
        if count > 0 {
            text += &format!(", {}", plural(count, what));
        }
    }
    text
}

fn plural(count: usize, what: &str) -> String {
    match (count, what.split_once(' ')) {
        (1, _) => format!("1 {what}"),
        (_, Some((first, rest))) if rest.starts_with("that is") => format!("{count} {first}s that are no rows"),
        (_, Some(("new", rest))) => format!("{count} new {rest}s"),
        (_, Some((first, rest))) => format!("{count} {first}s {rest}"),
        (_, None) => format!("{count} {what}s"),
    }
}
