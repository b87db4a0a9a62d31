//! Each term's coefficient along the threshold.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Guide, Layer, Panel, Points, Shape, Ticks};
use crate::palette::Ink;
use sindyscope_core::study::{EquationFit, PathTerm, Scaling};
use sindyscope_values::format::number::significant_trimmed;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Path",
    tooltip: "Each term's coefficient along the threshold: what drops out where, and what it changes",
    reading: "Each line is a term; where it ends the term drops out. A coefficient that stays level while others drop can be \
              trusted; one that jumps stood in for them. A click sets the threshold.",
    group: Group::Settings,
    records: RecordUse::None,
    slow: false,
    figure,
};

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let options = subject.options;
    let fits = &scene.outcome.fits;
    let fit = fits.get(options.freedom.min(fits.len().saturating_sub(1))).filter(|f| !f.path.is_empty());
    let fit = fit.ok_or("No term of the library can be used: there is no path to show")?;
    let log = options.raw_path || !options.signed_path;
    let value = |term: &PathTerm, c: f64| match (options.raw_path, log) {
        (true, _) => c.abs(),
        (false, true) => (c * term.standard).abs(),
        (false, false) => c * term.standard,
    };
    let (low, high) = range(fit);
    let curves: Vec<Vec<[f64; 2]>> = fit.path.iter().map(|term| steps(term, low, high, &value)).collect();
    let (id, symbol) = match (options.raw_path, log) {
        (true, _) => ("raw path", "magnitude of the coefficient"),
        (false, true) => ("path", "magnitude as a share of the rate's RMS"),
        (false, false) => ("signed path", "coefficient, as a share of the rate's RMS"),
    };
    let values = curves.iter().flatten().map(|p| if log { p[1].log10() } else { p[1] }).filter(|y| y.is_finite());
    let (bottom, top) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
    let margin = 0.06 * (top - bottom).max(0.1);
    let x = Axis::logarithmic("threshold", "", (low.log10(), high.log10())).with_ticks(Ticks::Round);
    let mut panel =
        Panel::new(id, x, Axis { logarithmic: log, ..Axis::linear(symbol, "", (bottom - margin, top + margin)) });
    for (k, (term, curve)) in fit.path.iter().zip(curves).enumerate() {
        let name = term.term.pretty(&scene.layout);
        panel.layers.push(Layer::new(Ink::of_term(k), name, Shape::Line(Points::new(curve))));
    }
    let threshold = scene.outcome.settings.threshold;
    let text = format!("now {}", significant_trimmed(threshold, 3));
    panel.guides.push(Guide::At { ink: Ink::Cursor, at: threshold.max(0.5 * low), text });
    panel.columns = columns(fit, scene.outcome.settings.scaling);
    let caption = "Coefficients along the threshold: where a line ends, the term drops out.";
    Ok(Figure::stacked([(panel, 1.0)], 260.0, caption))
}

/// Thresholds that the plot reaches over.
fn range(fit: &EquationFit) -> (f64, f64) {
    let changes = fit.path.iter().flat_map(|t| &t.coefficients).map(|(from, _)| *from).filter(|from| *from > 0.0);
    let (low, high) = changes.fold((f64::INFINITY, 0.0_f64), |(a, b), from| (a.min(from), b.max(from)));
    if high > 0.0 { (0.4 * low.max(1e-6 * high), 1.6 * high) } else { (1e-3, 1.0) }
}

/// Level stretches of a coefficient with the steps between them; it pauses where the term is not in use.
fn steps(term: &PathTerm, low: f64, high: f64, value: &impl Fn(&PathTerm, f64) -> f64) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for (k, (from, c)) in term.coefficients.iter().enumerate() {
        let (from, to) = (from.max(low), term.coefficients.get(k + 1).map_or(high, |(from, _)| *from).max(low));
        let y = if *c == 0.0 { f64::NAN } else { value(term, *c) };
        points.extend([[from, y], [to, y]]);
    }
    points
}

/// Coefficients in the records' units, one row a stretch of thresholds.
fn columns(fit: &EquationFit, scaling: Scaling) -> Vec<(String, Vec<f64>)> {
    let compares = match scaling {
        Scaling::Scaled => "threshold from (share)",
        Scaling::Raw => "threshold from",
    };
    let first = fit.path.first().map_or(&[][..], |t| &t.coefficients);
    let threshold = (compares.to_owned(), first.iter().map(|(from, _)| *from).collect());
    let term = |t: &PathTerm| (t.term.to_string(), t.coefficients.iter().map(|(_, c)| *c).collect());
    std::iter::once(threshold).chain(fit.path.iter().map(term)).collect()
}
