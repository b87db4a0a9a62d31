//! The picture of a stream: what arrived last, and what was identified over time.

use super::Settled;
use sindyscope_core::study::StreamUpdate;
use sindyscope_report::figure::thin::Spacing;
use sindyscope_report::figure::{Axis, Figure, Guide, Layer, Panel, Points, Samples, Shape};
use sindyscope_report::palette::{Ink, Tint};
use sindyscope_values::format::equations::is_kinematic;
use sindyscope_values::model::{Units, WeightedTerm};
use sindyscope_values::record::{Channel, Record, Role};
use sindyscope_values::term::{Symbol, Term};

/// Names of the coefficients' panels, and with that the most of them that are drawn.
const PANELS: [&str; 6] = ["stream c1", "stream c2", "stream c3", "stream c4", "stream c5", "stream c6"];
/// Height of a panel, points.
const HEIGHT: f64 = 95.0;
/// Share of a panel's height, and of that of the record.
const SHARES: (f64, f64) = (1.0, 1.3);
/// Standard errors of a 95 % band.
const TWO_SIDED: f64 = 1.96;

/// The last seconds as they arrived, the coefficients of up to six terms over time with their 95 % band, and the residual over the
/// usual one; stretches with an alarm are tinted. None as long as nothing has come.
pub fn stream_figure<'a>(
    record: Option<&Record>,
    settled: Option<&Settled>,
    updates: impl IntoIterator<Item = &'a StreamUpdate>,
) -> Option<Figure> {
    let record = record?;
    let mut panels = vec![(incoming(record, Role::Displacement(0))?, SHARES.1)];
    let updates: Vec<&StreamUpdate> = updates.into_iter().collect();
    if let (Some(settled), Some(first), Some(last)) = (settled, updates.first(), updates.last()) {
        let over = time_axis((first.time, last.time));
        let alarms = alarms(&updates);
        let tinted = |mut panel: Panel, said: bool| {
            if !alarms.is_empty() {
                let text = if said { "alarm".to_owned() } else { String::new() };
                panel.guides.push(Guide::Stretches { tint: Tint::Worst, stretches: alarms.clone(), text });
            }
            (panel, SHARES.0)
        };
        let units = Units::from_record(&settled.opening, &last.model.layout);
        let drawn = drawn_terms(&updates);
        for ((state, term), id) in drawn.iter().zip(PANELS) {
            let unit = units.coefficient(*state, term).unwrap_or_default();
            panels.push(tinted(coefficient(id, (*state, term), &unit, &updates, over.clone()), false));
        }
        panels.extend(residual(&updates, over.clone()).map(|panel| tinted(panel, true)));
    }
    let height = HEIGHT * panels.iter().map(|(_, share)| share).sum::<f64>();
    let caption = "A stream: what arrived last, the coefficients of its last seconds over time with their 95 % band, and what \
                   the model from before each block leaves of it, over the usual.";
    Some(Figure::stacked(panels, height, caption))
}

fn time_axis((from, to): (f64, f64)) -> Axis {
    Axis::linear("t", "s", (from, to.max(from + 1e-9)))
}

/// What a channel showed last.
fn incoming(record: &Record, role: Role) -> Option<Panel> {
    let Channel { name, unit, values, .. } = record.channel(role)?;
    let samples = Samples::new(values.clone(), Spacing { start: record.start, interval: record.interval });
    let range = widened(samples.range().unwrap_or((0.0, 1.0)));
    let x = time_axis((record.start, record.time(record.len().saturating_sub(1))));
    let mut panel = Panel::new("stream incoming", x, Axis::linear(name.clone(), unit.clone(), range));
    panel.title = "arrived last".into();
    panel.layers.push(Layer::new(Ink::Measured, name.clone(), Shape::Samples(samples)));
    Some(panel)
}

/// A range with a margin on either side.
fn widened((low, high): (f64, f64)) -> (f64, f64) {
    let margin = 0.06 * (high - low).max(1e-6 * high.abs()).max(f64::MIN_POSITIVE);
    (low - margin, high + margin)
}

/// The terms that were identified most often, in their order in the equations.
fn drawn_terms(updates: &[&StreamUpdate]) -> Vec<(Symbol, Term)> {
    let mut found: Vec<(Symbol, Term, usize)> = Vec::new();
    for update in updates {
        let model = &update.model;
        for (state, equation) in model.iter().filter(|(state, equation)| !is_kinematic(model, *state, equation)) {
            for WeightedTerm { term, .. } in &equation.terms {
                match found.iter_mut().find(|(s, t, _)| *s == state && t == term) {
                    Some((_, _, count)) => *count += 1,
                    None => found.push((state, term.clone(), 1)),
                }
            }
        }
    }
    let mut counts: Vec<usize> = found.iter().map(|f| f.2).collect();
    counts.sort_unstable_by(|a, b| b.cmp(a));
    let least = counts.get(PANELS.len() - 1).copied().unwrap_or(0);
    found.into_iter().filter(|f| f.2 >= least).map(|(state, term, _)| (state, term)).take(PANELS.len()).collect()
}

/// A coefficient over time.
fn coefficient(
    id: &'static str,
    (state, term): (Symbol, &Term),
    unit: &str,
    updates: &[&StreamUpdate],
    over: Axis,
) -> Panel {
    let found = |update: &&&StreamUpdate| -> Option<(f64, f64, Option<f64>)> {
        let (_, equation) = update.model.iter().find(|(s, _)| *s == state)?;
        let term = equation.terms.iter().find(|t| t.term == *term)?;
        Some((update.time, term.coefficient, term.std_error))
    };
    let values: Vec<(f64, f64, Option<f64>)> = updates.iter().filter_map(|u| found(&u)).collect();
    let band: Vec<[f64; 3]> =
        values.iter().filter_map(|(t, c, error)| error.map(|e| [*t, c - TWO_SIDED * e, c + TWO_SIDED * e])).collect();
    let layout = &updates[0].model.layout;
    // The first blocks alone know little: the range is that of most of the values.
    let settled = &values[values.len() / 4..];
    let ends = settled.iter().map(|(_, c, e)| (c - TWO_SIDED * e.unwrap_or(0.0), c + TWO_SIDED * e.unwrap_or(0.0)));
    let range = ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or((0.0, 1.0));
    let name = term.text(layout);
    let mut panel = Panel::new(id, over, Axis::linear("c", unit, widened(range)));
    panel.title = format!("coefficient of {name} in d{}/dt", layout.name(state));
    panel.layers.push(Layer::new(Ink::Identified, "", Shape::Band(band)));
    let line = Points::new(values.iter().map(|(t, c, _)| [*t, *c]));
    panel.layers.push(Layer::new(Ink::Identified, name, Shape::Line(line)));
    panel
}

/// What the model from before each block leaves of it, over the usual; none while no block was judged.
fn residual(updates: &[&StreamUpdate], over: Axis) -> Option<Panel> {
    let points: Vec<[f64; 2]> = updates.iter().filter_map(|u| u.judged.as_ref().map(|j| [u.time, j.ratio])).collect();
    let most = points.iter().map(|p| p[1]).reduce(f64::max)?;
    let mut panel = Panel::new("stream residual", over, Axis::linear("residual", "", (0.0, 1.06 * most.max(1.5))));
    panel.title = "residual over the usual".into();
    panel.layers.push(Layer::new(Ink::Error, "residual", Shape::Line(Points::new(points))));
    Some(panel)
}

/// From when to when an alarm stood.
fn alarms(updates: &[&StreamUpdate]) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    let mut before = None;
    for update in updates {
        if update.alarm.is_some() {
            match found.last_mut().filter(|_| before.is_some()) {
                Some(stretch) => stretch.1 = update.time,
                None => found.push((update.time, update.time)),
            }
        } else if let (Some(_), Some(stretch)) = (before, found.last_mut()) {
            stretch.1 = update.time;
        }
        before = update.alarm.as_ref().map(|_| update.time);
    }
    found
}
