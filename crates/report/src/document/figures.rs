//! The figures of a study: response and error over time, phase portrait, spectrum.

use std::ops::RangeInclusive;

use super::chart::{
    Axis, BELOW, Extent, Guide, LEFT, Legend, Line, Panel, RIGHT, padded, thinned, thinned_logarithmic,
};
use super::svg::Svg;
use crate::palette::Ink;
use sindyscope_core::signal::Spectrum;
use sindyscope_core::study::{Outcome, RecordOutcome, SensorResponse};
use sindyscope_values::format::number::significant;
use sindyscope_values::format::units::{Scale, per_second};
use sindyscope_values::record::{Record, Role, Usage};
use sindyscope_values::term::{Kind, Layout, Symbol};

/// A drawing with its words.
pub(super) struct Figure {
    pub(super) drawing: Svg,
    /// Width and height.
    pub(super) size: (f64, f64),
    pub(super) caption: String,
}

/// How many figures a kind of document has room for.
pub(super) struct Room {
    /// Records whose response is drawn.
    pub(super) records: usize,
}

impl Room {
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
/// Samples of a phase portrait beyond which only the last periods are drawn.
const PORTRAIT_SAMPLES: usize = 6000;
/// Powers of ten that a spectrum shows below its highest line.
const SPECTRUM_DECADES: f64 = 7.0;

/// Width from which on a whole record and its detail have room beside each other.
const TWO_COLUMNS: f64 = 450.0;

const GAP: f64 = 10.0;
const RESPONSE_HEIGHT: f64 = 145.0;
const ERROR_HEIGHT: f64 = 70.0;
const PORTRAIT_HEIGHT: f64 = 240.0;

/// The responses of as many records as there is room for.
pub(super) fn responses(outcome: &Outcome, room: &Room) -> Vec<Figure> {
    select(outcome, room.records).into_iter().filter_map(|record| response(outcome, record, &Extent::PAGE)).collect()
}

/// The record that portrait and spectrum are drawn of: a held-out one tells more.
pub(super) fn telling(outcome: &Outcome) -> Option<&RecordOutcome> {
    let held_out = outcome.records.iter().find(|r| r.usage == Usage::HeldOut);
    held_out.or(outcome.records.first())
}

/// Records drawn if there are too many: fitted and held-out ones in turn, in the set's order.
fn select(outcome: &Outcome, most: usize) -> Vec<&RecordOutcome> {
    let held_out = || outcome.records.iter().filter(|r| r.usage == Usage::HeldOut);
    let fitted = outcome.records.len() - held_out().count();
    let room_for_held_out = held_out().count().min((most / 2).max(most.saturating_sub(fitted)));
    let mut room = [most - room_for_held_out, room_for_held_out];
    outcome
        .records
        .iter()
        .filter(|r| {
            let room = &mut room[usize::from(r.usage == Usage::HeldOut)];
            let yes = *room > 0;
            *room = room.saturating_sub(1);
            yes
        })
        .collect()
}

/// The measurement that a channel is held against, and its unit.
fn measured<'a>(record: &'a Record, channel: &SensorResponse) -> Option<(&'a [f64], &'a str)> {
    record.channel(channel.role).map(|c| (&*c.values, c.unit.as_str()))
}

/// The stretch around the largest error that a detail shows, if the record is too long to tell single periods apart.
fn detail(record: &RecordOutcome, channel: &SensorResponse) -> Option<RangeInclusive<f64>> {
    let period = record.signals.main_period.filter(|p| *p > 0.0 && p.is_finite())?;
    let (start, end) = (record.record.start, record.record.start + record.record.duration());
    let length = PERIODS_OF_DETAIL * period;
    if end - start < PERIODS_SHOWN * period {
        return None;
    }
    let (worst, _) =
        channel.error.iter().enumerate().filter(|(_, e)| e.is_finite()).max_by(|p, q| p.1.total_cmp(q.1))?;
    let from = (record.record.time(worst) - 0.5 * length).clamp(start, end - length);
    Some(from..=from + length)
}

/// Measured and identified response with the error beneath, on one time axis.
pub(super) fn response(outcome: &Outcome, record: &RecordOutcome, extent: &Extent) -> Option<Figure> {
    let layout = &outcome.model.layout;
    let mut drawing = Svg::default();
    let mut detailed = false;
    let channels: Vec<_> =
        record.channels.iter().filter(|c| measured(&record.record, c).is_some()).take(CHANNELS_SHOWN).collect();
    let last = channels.len().checked_sub(1)?;
    let mut keys = vec![(Ink::Measured, "measured"), (Ink::Identified, "identified"), (Ink::Error, "error E")];
    if outcome.noise_floor.is_some() {
        keys.push((Ink::NoiseFloor, "noise floor"));
    }
    if record.diverged_at.is_some() {
        keys.push((Ink::Diverged, "diverged"));
    }
    let legend = Legend::new(&keys, LEFT, extent.width);
    legend.draw(&mut drawing);
    let mut top = legend.top();
    let shrunk = if last == 0 { 1.0 } else { 0.7 };
    let count = channels.len() as f64;
    let fixed = top + (2.0 * count - 1.0) * GAP + BELOW;
    let stretch = shrunk * extent.stretch(fixed, count * shrunk * (RESPONSE_HEIGHT + ERROR_HEIGHT));
    let heights = (stretch * RESPONSE_HEIGHT, stretch * ERROR_HEIGHT);
    for (index, channel) in channels.iter().enumerate() {
        let Some((values, unit)) = measured(&record.record, channel) else { continue };
        let symbol = channel.name(layout);
        let noise = outcome.noise_floor.filter(|_| index == 0);
        // A response on its way out of the data's range would press the measurement flat.
        let y_range = padded(values.iter().copied());
        let most = channel.error.iter().copied().filter(|e| e.is_finite()).fold(0.0, f64::max);
        let span = y_range.end() - y_range.start();
        let error_range = 0.0..=(1.08 * most.max(noise.unwrap_or(0.0))).clamp(1e-12 * span, span);
        let y = Axis::linear(&symbol, y_range, unit);
        let error_symbol = if layout.freedoms > 1 { format!("E of {symbol}") } else { "E".into() };
        let error = Axis::linear(&error_symbol, error_range, unit);

        let whole = record.record.start..=record.record.start + record.record.duration();
        let detail = detail(record, channels[0]);
        detailed |= detail.is_some();
        let frame = extent.width - LEFT - RIGHT;
        let columns = match detail.clone() {
            None => vec![(LEFT, frame, whole)],
            Some(detail) if extent.width < TWO_COLUMNS => vec![(LEFT, frame, detail)],
            Some(detail) => vec![(LEFT, 0.6 * frame, whole), (LEFT + 0.6 * frame + GAP, 0.4 * frame - GAP, detail)],
        };
        for (column, (left, width, range)) in columns.into_iter().enumerate() {
            let mut guides = Vec::new();
            if let (0, Some(detail)) = (column, &detail) {
                guides.push(Guide::Stretch(detail.clone()));
            }
            guides.extend(record.diverged_at.map(|t| Guide::At(Ink::Diverged, t)));
            let mut error_guides = Vec::new();
            if let (0, Some(detail)) = (column, &detail) {
                error_guides.push(Guide::Stretch(detail.clone()));
            }
            error_guides.extend(noise.map(|level| Guide::Level(Ink::NoiseFloor, level)));
            let mut upper = Panel {
                at: (left, top),
                size: (width, heights.0),
                x: Axis::linear("t", range.clone(), "s"),
                y: y.clone(),
                x_labels: false,
                y_labels: column == 0,
                guides,
                lines: Vec::new(),
                dots: Vec::new(),
            };
            upper.lines = [(Ink::Measured, values), (Ink::Identified, channel.response.as_slice())]
                .map(|(ink, values)| Line { ink, points: visible(&record.record, values, &range, upper.columns()) })
                .into();
            upper.draw(&mut drawing);
            let mut lower = Panel {
                at: (left, top + heights.0 + GAP),
                size: (width, heights.1),
                x: upper.x,
                y: error.clone(),
                x_labels: index == last,
                y_labels: column == 0,
                guides: error_guides,
                lines: Vec::new(),
                dots: Vec::new(),
            };
            let points = visible(&record.record, &channel.error, &range, lower.columns());
            lower.lines.push(Line { ink: Ink::Error, points });
            lower.draw(&mut drawing);
        }
        top += heights.0 + heights.1 + 2.0 * GAP;
    }
    Some(Figure {
        drawing,
        size: (extent.width, top - GAP + BELOW),
        caption: response_caption(outcome, record, channels.len(), detailed),
    })
}

fn response_caption(outcome: &Outcome, record: &RecordOutcome, channels: usize, detailed: bool) -> String {
    let usage = match record.usage {
        Usage::HeldOut => "held out: never fitted",
        Usage::Fit | Usage::Off => "fitted",
    };
    let name = &record.record.name;
    let mut caption = match channels {
        1 => {
            let symbol = outcome.model.layout.name(Symbol::State(0));
            format!(
                "Record {name} ({usage}). Above, the measured and the identified response; beneath, the error \
                 E(t) = |{symbol} measured − {symbol} identified|"
            )
        }
        _ => format!(
            "Record {name} ({usage}). Measured and identified responses, each with its error E(t) = |measured − identified| beneath"
        ),
    };
    if outcome.noise_floor.is_some() {
        caption.push_str("; dashed, the standard deviation of the measurement noise");
    }
    caption.push('.');
    if detailed {
        caption.push_str(" Right, the tinted stretch, where the error is largest.");
    }
    if let Some(t) = record.diverged_at {
        caption.push_str(&format!(" The response leaves the data's range at t = {} s.", significant(t, 4)));
    }
    caption
}

/// The samples in a stretch of time, thinned to so many columns.
fn visible(record: &Record, values: &[f64], range: &RangeInclusive<f64>, columns: usize) -> Vec<(f64, f64)> {
    let position = |t: f64| (t - record.start) / record.interval;
    let first = (position(*range.start()).floor().max(0.0) as usize).min(values.len());
    let last = ((position(*range.end()).ceil() + 1.0).max(0.0) as usize).clamp(first, values.len());
    thinned(&values[first..last], |i| record.time(first + i), columns)
}

/// The two states of the phase portrait.
fn portrait_states(layout: &Layout) -> Option<(usize, usize)> {
    match (layout.kind, layout.freedoms) {
        (_, 0) | (Kind::FirstOrder, 1) => None,
        (Kind::SecondOrder, n) => Some((0, n)),
        (Kind::FirstOrder, n) => Some((0, n - 1)),
    }
}

/// The phase portrait of a record, measured and identified; none of a model of one state.
pub(super) fn portrait(outcome: &Outcome, record: &RecordOutcome, extent: &Extent) -> Option<Figure> {
    let layout = &outcome.model.layout;
    let (a, b) = portrait_states(layout)?;
    let unit = record.record.channel(Role::Displacement(0)).map_or("", |c| c.unit.as_str());
    let samples = record.record.len();
    let shown = match record.signals.main_period {
        Some(period) => {
            ((20.0 * period / record.record.interval) as usize).clamp(PORTRAIT_SAMPLES / 4, PORTRAIT_SAMPLES)
        }
        None => PORTRAIT_SAMPLES,
    };
    let from = samples.saturating_sub(shown);
    let curve = |states: &[Vec<f64>]| -> Vec<(f64, f64)> {
        match (states.get(a), states.get(b)) {
            (Some(x), Some(y)) => x.iter().copied().zip(y.iter().copied()).skip(from).collect(),
            _ => Vec::new(),
        }
    };
    let (measured, identified) = (curve(&record.signals.states), curve(&record.states));
    let names: Vec<String> = layout.state_symbols().map(|s| layout.name(s)).collect();
    let y_unit = if layout.kind == Kind::SecondOrder { per_second(unit) } else { unit.to_owned() };
    let keys = [(Ink::Measured, "measured"), (Ink::Identified, "identified")];
    let x = Axis::linear(&names[a], padded(measured.iter().map(|p| p.0)), unit);
    let y = Axis::linear(&names[b], padded(measured.iter().map(|p| p.1)), &y_unit);
    let lines = vec![Line { ink: Ink::Measured, points: measured }, Line { ink: Ink::Identified, points: identified }];
    let which = if from > 0 {
        format!(", the last {} s", significant(shown as f64 * record.record.interval, 3))
    } else {
        String::new()
    };
    let caption = format!("Phase portrait of record {}{which}; the measured states are smoothed.", record.record.name);
    Some(single(extent, PORTRAIT_HEIGHT, &keys, (x, y), lines, caption))
}

/// A figure of one panel.
fn single(
    extent: &Extent,
    height: f64,
    keys: &[(Ink, &str)],
    (x, y): (Axis, Axis),
    lines: Vec<Line>,
    caption: String,
) -> Figure {
    let mut drawing = Svg::default();
    let legend = Legend::new(keys, LEFT, extent.width);
    legend.draw(&mut drawing);
    let height = height * extent.stretch(legend.top() + BELOW, height);
    let panel = Panel {
        at: (LEFT, legend.top()),
        size: (extent.width - LEFT - RIGHT, height),
        x,
        y,
        x_labels: true,
        y_labels: true,
        guides: Vec::new(),
        lines,
        dots: Vec::new(),
    };
    panel.draw(&mut drawing);
    Figure { drawing, size: (extent.width, legend.top() + height + BELOW), caption }
}

/// The amplitude spectra of what the first sensor showed, of the response and of the error.
pub(super) fn spectrum(outcome: &Outcome, record: &RecordOutcome, extent: &Extent) -> Option<Figure> {
    let channel = record.channels.first()?;
    let (values, unit) = measured(&record.record, channel)?;
    let compared = values.len().min(channel.response.len());
    let difference: Vec<f64> = values.iter().zip(&channel.response).map(|(m, r)| m - r).collect();
    let lines = |values: &[f64]| -> Vec<(f64, f64)> {
        Spectrum::new(values, record.record.interval)
            .map_or_else(Vec::new, |s| (1..s.amplitudes.len()).map(|k| (s.frequency(k), s.amplitudes[k])).collect())
    };
    let all = [
        (Ink::Measured, lines(&values[..compared])),
        (Ink::Identified, lines(&channel.response[..compared])),
        (Ink::Error, lines(&difference)),
    ];
    let (first, last) = (all[0].1.first()?.0, all[0].1.last()?.0);
    let highest = all[0].1.iter().map(|p| p.1).fold(0.0, f64::max);
    if !(highest > 0.0 && last > first) {
        return None;
    }
    let scale = Scale::suited(highest, unit);
    let columns = extent.width as usize;
    let x = Axis::logarithmic("f", first..=last, "Hz");
    let lowest = highest * 10f64.powf(-SPECTRUM_DECADES);
    let y = Axis::logarithmic("amplitude", scale.factor * lowest..=scale.factor * highest * 2.0, &scale.unit);
    let thin = |(ink, points): (Ink, Vec<(f64, f64)>)| {
        let points = thinned_logarithmic(&points, columns).into_iter();
        Line { ink, points: points.map(|(f, a)| (f, scale.factor * a)).collect() }
    };
    let lines = all.into_iter().map(thin).collect();
    let keys = [(Ink::Measured, "measured"), (Ink::Identified, "identified"), (Ink::Error, "error E")];
    let symbol = channel.name(&outcome.model.layout);
    let caption = format!("Amplitude spectrum of {symbol} and of its error, record {}.", record.record.name);
    Some(single(extent, PORTRAIT_HEIGHT, &keys, (x, y), lines, caption))
}
