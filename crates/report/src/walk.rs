//! The figures of a search for missing effects: the gap over time and over the motion, an effect's force, the fall of the error.

use std::sync::Arc;

use crate::figure::thin::Spacing;
use crate::figure::{
    Axis, Cells, Colours, Figure, Fit, Guide, Layer, LayerRole, Panel, PlotBar, Points, Samples, Shape, Ticks, extent,
};
use crate::palette::{Ink, Tint};
use crate::view::time_range;
use sindyscope_search::{Curve, Lead, Map, MissingForce, Profile, Stage, Trace};
use sindyscope_values::format::number::significant;
use sindyscope_values::format::units::{Scale, format_si, per_second, raised};
use sindyscope_values::record::Usage;

/// Scores from which a cell's mean is no chance.
const SIGNIFICANT: f64 = 3.0;

/// Share of the points below and above which a lone one does not set the limits.
const OUTLYING: f64 = 0.005;

/// Letters in a line of an effect's name beneath its bars.
const NAME: usize = 20;

/// The name that the axes of time of one search share.
const TIME: &str = "walk time";

/// The sensor whose response is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared<'a> {
    /// The mass that it is on, from zero.
    pub mass: usize,
    /// Its symbol.
    pub symbol: &'a str,
    /// Its unit.
    pub unit: &'a str,
    /// Standard deviation of its noise; zero: not known.
    pub noise: f64,
}

/// A simulated response beside the measured one.
#[derive(Clone, Copy, Debug)]
pub struct WalkResponse<'a> {
    /// Which model's.
    pub name: &'a str,
    /// Its ink.
    pub ink: Ink,
    /// Width of its line, points.
    pub width: f32,
    /// The response.
    pub trace: &'a Trace,
}

impl Compared<'_> {
    fn panel(&self, trace: &Trace, id: &'static str, symbol: &str) -> Panel {
        over_time(trace, id, Axis::linear(symbol, self.unit, (0.0, 1.0)))
    }

    /// Measured less simulated.
    fn gap(&self, trace: &Trace) -> Vec<f64> {
        let (measured, simulated) = trace.of_mass(self.mass);
        measured.iter().zip(simulated.iter()).map(|(m, s)| m - s).collect()
    }

    fn noise_band(&self, text: String) -> Option<Guide> {
        (self.noise > 0.0).then_some(Guide::Around { ink: Ink::NoiseFloor, level: self.noise, text })
    }
}

fn spacing(trace: &Trace) -> Spacing {
    Spacing { start: trace.start, interval: trace.interval }
}

fn over_time(trace: &Trace, id: &'static str, y: Axis) -> Panel {
    let (spacing, samples) = (spacing(trace), trace.measured.len());
    let x = Axis::linear("t", "s", time_range(spacing, samples)).linked(TIME);
    let mut panel = Panel { fit: Fit::Curves, ..Panel::new(id, x, y) };
    if trace.usage == Usage::HeldOut {
        let stretches = vec![(spacing.start, spacing.at(samples.saturating_sub(1)))];
        panel.guides.push(Guide::Stretches { tint: Tint::HeldOut, stretches, text: String::new() });
    }
    panel
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The measured response with those of models over each other, and what each leaves beneath.
pub fn responses(compared: &Compared<'_>, responses: &[WalkResponse<'_>]) -> Option<Figure> {
    let trace = responses.first()?.trace;
    let samples = |values: Arc<[f64]>| Shape::Samples(Samples::new(values, spacing(trace)));
    let mut upper = compared.panel(trace, "response", compared.symbol);
    upper.layers.push(Layer::new(Ink::Measured, "measured", samples(Arc::clone(trace.of_mass(compared.mass).0))));
    let mut lower = compared.panel(trace, "gap", "gap");
    let mut sizes = Vec::new();
    for WalkResponse { name, ink, width, trace } in responses {
        let simulated = Arc::clone(trace.of_mass(compared.mass).1);
        upper.layers.push(Layer::new(*ink, *name, samples(simulated)).playing(LayerRole::Follows).wide(*width));
        let gap = compared.gap(trace);
        sizes.push(format_si(rms(&gap), compared.unit, 3));
        lower.layers.push(Layer::new(*ink, *name, samples(gap.into())).wide(1.0));
    }
    lower.title = format!("RMS {}", sizes.join(" → "));
    lower.guides.extend(compared.noise_band("± noise".into()));
    let usage = if trace.usage == Usage::HeldOut { "held out: never fitted" } else { "fitted" };
    let caption = format!(
        "Record {} ({usage}). Above, the measured displacement and the simulated ones; beneath, measured less simulated.",
        trace.record
    );
    Some(Figure::stacked([(upper.fitted(), 1.3), (lower.fitted(), 1.0)], 270.0, caption))
}

/// The force that a model lacks along a record, with what it is called.
#[derive(Clone, Copy, Debug)]
pub struct Lacking<'a> {
    /// The force; none where it is not known.
    pub force: Option<&'a MissingForce>,
    /// What it is called.
    pub name: &'a str,
    /// Its unit.
    pub unit: &'a str,
    /// What is said in its place.
    pub note: &'a str,
    /// Whether its worst stretches are marked.
    pub marked: bool,
}

/// Measured and simulated, their difference, and the force that is missing, on one time axis.
pub fn gap(compared: &Compared<'_>, response: &WalkResponse<'_>, lacking: &Lacking<'_>) -> Figure {
    let trace = response.trace;
    let samples = |values: Arc<[f64]>| Shape::Samples(Samples::new(values, spacing(trace)));
    let (measured, simulated) = trace.of_mass(compared.mass);
    let mut upper = compared.panel(trace, "response", compared.symbol);
    upper.layers.push(Layer::new(Ink::Measured, "measured", samples(Arc::clone(measured))));
    let simulated = Layer::new(response.ink, response.name, samples(Arc::clone(simulated)));
    upper.layers.push(simulated.playing(LayerRole::Follows).wide(response.width));
    let left = compared.gap(trace);
    let mut middle = compared.panel(trace, "gap", "gap");
    middle.title = format!("RMS {}", format_si(rms(&left), compared.unit, 3));
    middle.layers.push(Layer::new(Ink::Error, "measured − simulated", samples(left.into())));
    middle.guides.extend(compared.noise_band(format!("± noise {}", format_si(compared.noise, compared.unit, 2))));
    let mut lower = over_time(trace, "force", Axis::linear("force", lacking.unit, (0.0, 1.0)));
    lower.note = lacking.note.to_owned();
    if let Some(missing) = lacking.force {
        let spacing = Spacing { start: missing.start, interval: missing.interval };
        let force = Samples::new(Arc::clone(&missing.force), spacing);
        let deviation = Samples::new(Arc::clone(&missing.deviation), spacing);
        let band = Shape::Tube(force.clone(), deviation);
        lower.layers.push(Layer::new(Ink::Input, lacking.name, Shape::Samples(force)).wide(1.2));
        lower.layers.insert(0, Layer::new(Ink::Input, "± 1 σ", band).playing(LayerRole::Follows));
        if lacking.marked {
            for panel in [&mut upper, &mut middle, &mut lower] {
                panel.guides.extend(worst(missing));
            }
        }
    }
    let caption = format!(
        "Record {}: the measured and the simulated displacement, their difference, and the force per mass that the model lacks.",
        trace.record
    );
    Figure::stacked([(upper.fitted(), 1.4), (middle.fitted(), 1.0), (lower.fitted(), 1.0)], 330.0, caption)
}

/// The stretches in which most is missing: the worst, and those after it.
fn worst(missing: &MissingForce) -> impl Iterator<Item = Guide> {
    let (worst, others) = missing.worst.split_at(missing.worst.len().min(1));
    [(Tint::Worst, worst.to_vec()), (Tint::Bad, others.to_vec())]
        .into_iter()
        .map(|(tint, stretches)| Guide::Stretches { tint, stretches, text: String::new() })
}

/// The measured missing force as points, and the effect's own force through them, with the band that its errors give; `title` and
/// `ink` are the effect's.
pub fn curve(curve: &Curve, title: &str, ink: Ink, unit: &str) -> Option<Figure> {
    if curve.measured.len() < 2 {
        return None;
    }
    let both = || curve.measured.iter().chain(&curve.effect);
    let x = Axis::linear(raised(&curve.axis), raised(&curve.unit), extent(both().map(|p| p[0])));
    let y = Axis::linear("missing force", unit, usual_extent(both().map(|p| p[1])));
    let mut panel = Panel { fixed: true, ..Panel::new("curve", x, y) };
    panel.layers.push(Layer::new(Ink::Measured, "measured", Shape::Dots(Points::new(curve.measured.iter().copied()))));
    let effect = Points::new(curve.effect.iter().copied());
    // Over time it is a dense curve, over a quantity of the motion a law, or a cloud where it depends on more.
    let over_time = curve.axis == "t";
    let shape = if over_time || curve.is_law() { Shape::Line(effect) } else { Shape::Dots(effect) };
    let banded = !curve.deviation.is_empty() && matches!(shape, Shape::Line(_));
    if banded {
        let span = |([at, force], error): (&[f64; 2], &f64)| [*at, force - 2.0 * error, force + 2.0 * error];
        let band = Shape::Band(curve.effect.iter().zip(&curve.deviation).map(span).collect());
        panel.layers.push(Layer::new(ink, "± 2 standard errors", band));
    }
    panel.layers.push(Layer::new(ink, title, shape).wide(if over_time { 1.0 } else { 2.0 }));
    let head = |axis: &Axis, of: &str| format!("{}{of}", axis.header());
    let part = |points: &[[f64; 2]], k: usize| points.iter().map(|p| p[k]).collect::<Vec<f64>>();
    panel.columns = vec![
        (head(&panel.x, ""), part(&curve.measured, 0)),
        (head(&panel.y, ""), part(&curve.measured, 1)),
        (head(&panel.x, " of the effect"), part(&curve.effect, 0)),
        (Scale::plain(unit).axis("force of the effect"), part(&curve.effect, 1)),
    ];
    if !curve.deviation.is_empty() {
        panel.columns.push((Scale::plain(unit).axis("std error of the effect"), curve.deviation.clone()));
    }
    let caption = format!(
        "The force per mass that the model lacks along the measured motion (dots) over {}, and the one that is added: {title}{}.",
        raised(&curve.axis),
        if banded { ", with two standard errors as the fit gives them" } else { "" }
    );
    Some(Figure::stacked([(panel, 1.0)], 190.0, caption))
}

/// Least and largest value with a margin, without the few that lie far off: one outlier must not flatten a plot.
fn usual_extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let mut sorted: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    let (Some(least), Some(most)) = (sorted.iter().copied().reduce(f64::min), sorted.iter().copied().reduce(f64::max))
    else {
        return (-1.0, 1.0);
    };
    sorted.sort_by(f64::total_cmp);
    let cut = (OUTLYING * sorted.len() as f64).ceil() as usize;
    let (low, high) = (sorted[cut.min(sorted.len() - 1)], sorted[sorted.len().saturating_sub(1 + cut)]);
    // Only what lies beyond all the others' range is an outlier.
    let reach = high - low;
    extent([least.max(low - reach), most.min(high + reach)].into_iter())
}

/// The mean missing force over displacement and velocity; none where there is no map.
pub fn map(map: &Map, acceleration: &str) -> Option<Figure> {
    let ends = |edges: &[f64]| Some((*edges.first()?, *edges.last()?));
    let x = Axis::linear(raised(&map.across.0), raised(&map.across.1), ends(&map.columns)?);
    let y = Axis::linear(raised(&map.up.0), raised(&map.up.1), ends(&map.rows)?);
    let sure = |k: usize| map.score.get(k).is_some_and(|s| s.abs() >= SIGNIFICANT);
    let most = |only_sure: bool| {
        let cells = map.mean.iter().enumerate().filter(|(k, m)| m.is_finite() && (!only_sure || sure(*k)));
        cells.map(|(_, m)| m.abs()).fold(0.0, f64::max)
    };
    let largest = if most(true) > 0.0 { most(true) } else { most(false) };
    let remark = |k: usize| {
        if sure(k) {
            format!("{} times its standard error", significant(map.score[k].abs(), 2))
        } else {
            "within what chance does, or too few visits".to_owned()
        }
    };
    let cells = Cells {
        columns: map.columns.clone(),
        rows: map.rows.clone(),
        values: map.mean.clone(),
        unsure: (0..map.mean.len()).map(|k| !sure(k)).collect(),
        remarks: (0..map.mean.len()).map(remark).collect(),
        colours: Colours::Diverging(largest),
        name: "missing force".into(),
        unit: acceleration.to_owned(),
    };
    let mut panel = Panel { fixed: true, ..Panel::new("map", x, y) };
    panel.title = "grey: unsure".into();
    let columns = map.columns.len().saturating_sub(1).max(1);
    let known: Vec<usize> = (0..map.mean.len()).filter(|k| map.mean[*k].is_finite()).collect();
    let middle = |edges: &[f64], k: usize| edges.get(k..k + 2).map_or(f64::NAN, |e| 0.5 * (e[0] + e[1]));
    let column = |of: &dyn Fn(usize) -> f64| known.iter().map(|k| of(*k)).collect::<Vec<f64>>();
    panel.columns = vec![
        (panel.x.header(), column(&|k| middle(&map.columns, k % columns))),
        (panel.y.header(), column(&|k| middle(&map.rows, k / columns))),
        (Scale::plain(acceleration).axis("missing force"), column(&|k| map.mean[k])),
        ("over its standard error".to_owned(), column(&|k| map.score.get(k).copied().unwrap_or(f64::NAN))),
    ];
    panel.layers.push(Layer::new(Ink::Measured, "", Shape::Cells(cells)));
    let caption =
        "The mean force per mass that the model lacks, where the motion was; grey cells are within what chance does.";
    Some(Figure::stacked([(panel, 1.0)], 240.0, caption))
}

/// The mean missing force along one quantity, with a band of two standard errors; `note` stands beside it.
pub fn profile(profile: &Profile, acceleration: &str, note: &str) -> Figure {
    let error = |k: usize| profile.error.get(k).copied().filter(|e| e.is_finite()).unwrap_or(0.0);
    let points: Vec<(usize, [f64; 2])> = (profile.at.iter().zip(&profile.mean).map(|(a, m)| [*a, *m]).enumerate())
        .filter(|(_, p)| p[1].is_finite())
        .collect();
    let spans: Vec<[f64; 3]> =
        points.iter().map(|(k, [a, m])| [*a, m - 2.0 * error(*k), m + 2.0 * error(*k)]).collect();
    let x = Axis::linear(raised(&profile.axis.0), raised(&profile.axis.1), extent(points.iter().map(|(_, p)| p[0])));
    let forces = spans.iter().flat_map(|s| [s[1], s[2]]).chain([0.0]);
    let y = Axis::linear("missing force", acceleration, extent(forces));
    let mut panel = Panel { fixed: true, ..Panel::new("profile", x, y) };
    panel.title = note.to_owned();
    let line = Points::new(points.iter().map(|(_, p)| *p));
    panel.guides.push(Guide::Level { ink: Ink::Cursor, at: 0.0, text: String::new() });
    panel.layers = vec![
        Layer::new(Ink::Error, "± 2 standard errors", Shape::Band(spans)),
        Layer::new(Ink::Error, "mean", Shape::Line(line.clone())).wide(1.5),
        Layer::new(Ink::Error, "", Shape::Marks(line)),
    ];
    panel.columns = vec![
        (panel.x.header(), profile.at.clone()),
        (panel.y.header(), profile.mean.clone()),
        (Scale::plain(acceleration).axis("std error"), profile.error.clone()),
    ];
    let caption = format!(
        "The mean force per mass that the model lacks in bins of {}, with a band of two standard errors; this quantity alone \
         explains {} % of its energy.",
        raised(&profile.axis.0),
        significant(100.0 * profile.share, 2)
    );
    Figure::stacked([(panel, 1.0)], 190.0, caption)
}

/// The error of each stage as bars, on data never fitted and on fitted data, with the noise as a line through them all; `tested`
/// says how the first were judged.
pub fn waterfall(stages: &[&Stage], noise: f64, unit: &str, tested: &str) -> Option<Figure> {
    let errors: Vec<[Option<f64>; 2]> = stages.iter().map(|s| [s.gap.test_rmse, Some(s.gap.train_rmse)]).collect();
    let largest = errors.iter().flatten().flatten().copied().filter(|v| v.is_finite()).fold(noise, f64::max);
    if largest <= 0.0 || stages.is_empty() {
        return None;
    }
    let has_test = errors.iter().any(|e| e[0].is_some());
    let names = stages.iter().enumerate().map(|(k, stage)| (k as f64, stage_name(k, stage))).collect();
    let said = if has_test { format!("filled: {tested}; outlined: fitted") } else { "on the fitted data".into() };
    let x = Axis::linear(said, "", (-0.6, stages.len() as f64 - 0.4)).with_ticks(Ticks::Named(names));
    let y = Axis::linear("RMSE", unit, (0.0, 1.15 * largest));
    let scale = Scale::suited(largest, unit);
    let mut panel = Panel { fixed: true, ..Panel::new("errors", x, y) };
    for (k, pair) in errors.iter().enumerate() {
        for (side, error) in pair.iter().enumerate() {
            let Some(height) = error.filter(|v| v.is_finite()) else { continue };
            let (from, to) = match (has_test, side) {
                (false, _) => (-0.2, 0.2),
                (true, 0) => (-0.36, -0.01),
                (true, _) => (0.01, 0.36),
            };
            let text = significant(height * scale.factor, 3);
            // The line of the noise strikes no figure through.
            let crossed = (height..height + 0.1 * largest).contains(&noise);
            let text_at = if crossed { noise } else { height };
            let bar = PlotBar { from: k as f64 + from, to: k as f64 + to, height, text, text_at };
            panel.layers.push(Layer::new(Ink::of_stage(k), "", Shape::Bars { bars: vec![bar], hollow: side == 1 }));
        }
    }
    let text = format!("measurement noise {}", format_si(noise, unit, 2));
    panel.guides.push(Guide::Level { ink: Ink::NoiseFloor, at: noise, text });
    panel.columns = vec![
        ("effects".to_owned(), stages.iter().map(|s| s.effects.len() as f64).collect()),
        (Scale::plain(unit).axis("RMSE not fitted"), errors.iter().map(|e| e[0].unwrap_or(f64::NAN)).collect()),
        (Scale::plain(unit).axis("RMSE fitted"), errors.iter().map(|e| e[1].unwrap_or(f64::NAN)).collect()),
        (Scale::plain(unit).axis("noise"), vec![noise; stages.len()]),
    ];
    let caption = format!(
        "The gap between simulated and measured displacement (RMSE) from the base model through each effect that was added; dashed, \
         the measurement noise of {}, below which nothing can fall.",
        format_si(noise, unit, 2)
    );
    Some(Figure::stacked([(panel, 1.0)], 190.0, caption))
}

/// Why an effect was named rather than the nearest other set: by how much it predicts each block better that was never fitted.
/// `index` is the effect's among those that were added. None where the blocks are not known.
pub fn why(lead: &Lead, index: usize) -> Option<Figure> {
    if lead.each.is_empty() {
        return None;
    }
    let bar = |(k, height): (usize, &f64)| {
        let at = (k + 1) as f64;
        PlotBar { from: at - 0.4, to: at + 0.4, height: *height, text: String::new(), text_at: *height }
    };
    let (won, lost): (Vec<_>, Vec<_>) = lead.each.iter().enumerate().partition(|(_, d)| **d > 0.0);
    let (low, high) = lead.each.iter().fold((0.0_f64, 0.0_f64), |(low, high), d| (low.min(*d), high.max(*d)));
    let room = 0.08 * (high - low).max(f64::MIN_POSITIVE);
    let x = Axis::linear("block that was never fitted", "", (0.4, lead.each.len() as f64 + 0.6));
    let y = Axis::linear("log density gained", "", (if low < 0.0 { low - room } else { 0.0 }, high + room));
    let mut panel = Panel { fixed: true, ..Panel::new("blocks", x, y) };
    let parts = [(won, Ink::of_stage(index + 1), "predicted better"), (lost, Ink::Error, "predicted worse")];
    for (bars, ink, name) in parts {
        if !bars.is_empty() {
            let bars = bars.into_iter().map(bar).collect();
            panel.layers.push(Layer::new(ink, name, Shape::Bars { bars, hollow: false }));
        }
    }
    panel.columns = vec![
        ("block".to_owned(), (1..=lead.each.len()).map(|k| k as f64).collect()),
        ("log density gained".to_owned(), lead.each.clone()),
    ];
    let caption = format!(
        "Why this effect: by how much it predicts each block of data better that was never fitted than {} does (log predictive density). \
         {} of {} blocks are predicted better; the sum is {} ± {}.",
        lead.against_words(),
        lead.won,
        lead.blocks,
        significant(lead.difference, 2),
        significant(lead.std_error, 2)
    );
    Some(Figure::stacked([(panel, 1.0)], 130.0, caption))
}

/// What a stage is called beneath its bars, in lines that are short enough.
fn stage_name(index: usize, stage: &Stage) -> String {
    let name = match (index, stage.effects.last()) {
        (0, _) => "base model".to_owned(),
        (_, Some(effect)) => format!("+ {}", effect.title),
        (_, None) => "base model again".to_owned(),
    };
    let mut lines = vec![String::new()];
    for word in name.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.is_empty() || line.chars().count() + word.chars().count() < NAME => {
                if !line.is_empty() {
                    line.push(' ');
                }
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines.join("\n")
}

/// The unit of a force per mass where displacements have this one.
pub fn force_unit(displacement: &str) -> String {
    per_second(&per_second(displacement))
}
