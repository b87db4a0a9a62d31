//! The figures of a report: which views of which records it draws, and in which room.

use crate::figure::Figure;
use crate::figure::svg::{self, Drawing, Extent};
use crate::palette::Ink;
use crate::view::{Subject, View, ViewOptions};
use crate::walk::{self, Compared, WalkResponse};
use sindyscope_core::study::{Outcome, RecordOutcome};
use sindyscope_search::{Curve, Diagnosis, Lead, Stage, Trace};
use sindyscope_values::format::shown::ShownUnits;
use sindyscope_values::record::Usage;

/// How many figures a kind of document has room for.
pub(super) struct FigureLimits {
    /// Records whose response is drawn.
    pub(super) records: usize,
}

impl FigureLimits {
    /// A document that may be long.
    pub(super) const PAGES: Self = Self { records: 8 };
    /// One picture.
    pub(super) const PICTURE: Self = Self { records: 2 };
}

/// Periods of the response beyond which single ones cannot be told apart over the width of a figure.
const PERIODS_SHOWN: f64 = 25.0;
/// Periods that a detail shows.
const PERIODS_OF_DETAIL: f64 = 5.0;
/// Channels of a record that are drawn.
const CHANNELS_SHOWN: usize = 3;
/// Oscillations beyond which single ones cannot be told apart over the width of a figure.
const OSCILLATIONS: usize = 25;

pub(super) fn drawn(figure: &Figure, extent: &Extent) -> Drawing {
    svg::draw(figure, extent, &ShownUnits::default())
}

/// A view of the record that tells most: a held-out one if there is one.
pub(super) fn telling(outcome: &Outcome, view: View, extent: &Extent) -> Option<Drawing> {
    let held_out = outcome.records.iter().position(|r| r.usage == Usage::HeldOut);
    let options = ViewOptions { log_frequency: true, ..ViewOptions::default() };
    let figure = view.figure(&Subject::new(outcome, held_out.unwrap_or(0), &options)).ok()?;
    Some(drawn(&figure, extent))
}

/// The responses of as many records as there is room for.
pub(super) fn responses(outcome: &Outcome, room: &FigureLimits) -> Vec<Drawing> {
    select(outcome, room.records).into_iter().flat_map(|record| response(outcome, record)).collect()
}

/// The responses of a record, each of its channels, with the stretch of the largest error drawn out.
fn response(outcome: &Outcome, record: usize) -> Vec<Drawing> {
    let channels = outcome.records[record].channels.len().min(CHANNELS_SHOWN);
    let one = |freedom: usize| {
        let options = ViewOptions { freedom, ..ViewOptions::default() };
        let mut figure = View::Response.figure(&Subject::new(outcome, record, &options)).ok()?;
        if let Some(stretch) = detail(&outcome.records[record], freedom) {
            figure = figure.with_detail(stretch);
            figure.caption += " Right, the tinted stretch, where the error is largest.";
        }
        Some(drawn(&figure, &Extent::PAGE))
    };
    (0..channels).filter_map(one).collect()
}

/// Records drawn if there are too many: fitted and held-out ones in turn, in the set's order.
fn select(outcome: &Outcome, most: usize) -> Vec<usize> {
    let held_out = |k: &usize| outcome.records[*k].usage == Usage::HeldOut;
    let count = (0..outcome.records.len()).filter(held_out).count();
    let fitted = outcome.records.len() - count;
    let room_for_held_out = count.min((most / 2).max(most.saturating_sub(fitted)));
    let mut room = [most - room_for_held_out, room_for_held_out];
    let mut takes = |k: &usize| {
        let room = &mut room[usize::from(held_out(k))];
        let yes = *room > 0;
        *room = room.saturating_sub(1);
        yes
    };
    (0..outcome.records.len()).filter(|k| takes(k)).collect()
}

/// The stretch around the largest error that a detail shows, if the record is too long to tell single periods apart.
fn detail(record: &RecordOutcome, freedom: usize) -> Option<(f64, f64)> {
    let period = record.signals.main_period.filter(|p| *p > 0.0 && p.is_finite())?;
    let (start, end) = (record.record.start, record.record.start + record.record.duration());
    let length = PERIODS_OF_DETAIL * period;
    if end - start < PERIODS_SHOWN * period {
        return None;
    }
    let errors = record.channels.get(freedom)?.error.iter().enumerate().filter(|(_, e)| e.is_finite());
    let (worst, _) = errors.max_by(|p, q| p.1.total_cmp(q.1))?;
    let from = (record.record.time(worst) - 0.5 * length).clamp(start, end - length);
    Some((from, from + length))
}

/// How the error falls from stage to stage.
pub(super) fn waterfall(diagnosis: &Diagnosis, unit: &str) -> Option<Drawing> {
    let stages: Vec<&Stage> = diagnosis.stages.iter().map(AsRef::as_ref).collect();
    let tested = if diagnosis.has_held_out() { "held out: never fitted" } else { "left out of the fit in turn" };
    Some(drawn(&walk::waterfall(&stages, diagnosis.noise_floor, unit, tested)?, &Extent::PAGE))
}

/// Why an effect was named, block by block.
pub(super) fn why(lead: &Lead, index: usize) -> Option<Drawing> {
    Some(drawn(&walk::why(lead, index)?, &Extent::PAGE))
}

/// The measured missing force and an effect's own.
pub(super) fn curve(curve: &Curve, title: &str, unit: &str) -> Option<Drawing> {
    Some(drawn(&walk::curve(curve, title, Ink::Effect(0), &walk::force_unit(unit))?, &Extent::PAGE))
}

/// Measured response with that of the base model and that of the last one, and what each leaves, for the records that tell most.
pub(super) fn overlay(base: &Stage, last: &Stage, unit: &str, room: &FigureLimits) -> Vec<Drawing> {
    let held_out = base.traces.iter().any(|t| t.usage == Usage::HeldOut);
    let wanted = if held_out { Usage::HeldOut } else { Usage::Fit };
    let compared = Compared { mass: 0, symbol: "x", unit, noise: 0.0 };
    let one = |(before, after): (&Trace, &Trace)| {
        let base = WalkResponse { name: "base model", ink: Ink::Identified, width: 1.0, trace: before };
        let ink = Ink::of_stage(last.effects.len());
        let last = WalkResponse { name: "with what was added", ink, width: 1.4, trace: after };
        let mut figure = walk::responses(&compared, &[base, last])?;
        if let Some(stretch) = stretch(before) {
            figure.panels_mut().for_each(|panel| panel.x.range = stretch);
            figure.caption += " The stretch around the base model's largest error.";
        }
        Some(drawn(&figure, &Extent::PAGE))
    };
    let before = base.traces.iter().filter(|t| t.usage == wanted);
    let pairs = before.filter_map(|before| {
        Some((before, last.traces.iter().find(|t| t.record == before.record && t.usage == wanted)?))
    });
    pairs.take(room.records.div_ceil(4)).filter_map(one).collect()
}

/// So many oscillations around the largest error; none of a record that has no more.
fn stretch(trace: &Trace) -> Option<(f64, f64)> {
    let n = trace.measured.len().min(trace.simulated.len());
    let turns = trace.measured.windows(2).filter(|w| (w[0] < 0.0) != (w[1] < 0.0)).count() / 2;
    if turns <= OSCILLATIONS {
        return None;
    }
    let length = (n * OSCILLATIONS / turns).clamp(2, n);
    let errors = trace.measured.iter().zip(trace.simulated.iter()).map(|(m, s)| (m - s).abs());
    let worst = errors.enumerate().filter(|(_, e)| e.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |p| p.0);
    let first = worst.saturating_sub(length / 2).min(n - length);
    let time = |k: usize| trace.start + trace.interval * k as f64;
    Some((time(first), time(first + length - 1)))
}
