//! The figures of a search for missing effects: the fall of the gap, the force found, the response before and after.

use super::chart::{Axis, BELOW, LEFT, Legend, Line, Panel, RIGHT, WIDTH, class, padded, thinned};
use super::figures::{Figure, Room};
use super::svg::{Anchor, Svg};
use sindyscope_values::format::units::{Scale, format_si, per_second, raised};

use crate::palette::Ink;
use sindyscope_search::{Curve, Diagnosis, Stage, Trace};
use sindyscope_values::record::Usage;

const TOP: f64 = 20.0;
/// Height of a bar of the waterfall.
const BAR: f64 = 11.0;
/// Distance of one stage's bars from the next one's.
const PITCH: f64 = 48.0;
/// Room for the figure at the end of the longest bar.
const FIGURE: f64 = 66.0;
/// Room for a key, wide enough for its words.
const KEY: f64 = 150.0;
/// Height of a response, and of the residuals below it.
const RESPONSE: f64 = 170.0;
const RESIDUAL: f64 = 100.0;
const GAP: f64 = 10.0;
/// Oscillations beyond which single ones cannot be told apart over the width of a figure.
const OSCILLATIONS: usize = 25;

/// The gap of each stage as bars, fitted and not fitted below each other, with the noise as a line through them all.
pub(super) fn waterfall(diagnosis: &Diagnosis, unit: &str) -> Option<Figure> {
    let stages = &diagnosis.stages;
    let gaps = || stages.iter().flat_map(|s| [Some(s.gap.train_rmse), s.gap.test_rmse]).flatten();
    let largest = gaps().chain([diagnosis.noise_floor]).filter(|v| v.is_finite()).fold(0.0, f64::max);
    if largest <= 0.0 {
        return None;
    }
    let has_test = gaps().count() > stages.len();
    let tested = if diagnosis.has_held_out() { "held out: never fitted" } else { "left out of the fit in turn" };
    let width = WIDTH - RIGHT - FIGURE;
    let at = |value: f64| width * (value / largest).clamp(0.0, 1.0);
    let mut svg = Svg::default();
    let mut x = 0.0;
    for (fill, label) in [("fitted", "fitted"), ("unfitted", tested)].into_iter().take(1 + usize::from(has_test)) {
        svg.rect(fill, (x, TOP - 17.0), (22.0, 9.0));
        svg.text("key", (x + 28.0, TOP - 8.0), Anchor::Start, label);
        x += if fill == "fitted" { 90.0 } else { KEY + 40.0 };
    }
    Legend::new(&[(Ink::NoiseFloor, "measurement noise")], x, WIDTH).draw(&mut svg);
    let mut y = TOP + 2.0;
    let names = stages.iter().enumerate().map(|(k, stage)| match (k, stage.effects.last()) {
        (0, _) => "Base model".to_owned(),
        (_, Some(effect)) => format!("+ {}", effect.title),
        (_, None) => "Base model again".to_owned(),
    });
    for (stage, name) in stages.iter().zip(names) {
        svg.text("label", (0.0, y + 11.0), Anchor::Start, &name);
        let mut bar_top = y + 16.0;
        for (fill, rmse) in [("fitted", Some(stage.gap.train_rmse)), ("unfitted", stage.gap.test_rmse)] {
            let Some(rmse) = rmse.filter(|r| r.is_finite()) else { continue };
            svg.rect(fill, (0.0, bar_top), (at(rmse).max(1.0), BAR));
            let text = format_si(rmse, unit, 3);
            svg.text("tick", (at(rmse).max(at(diagnosis.noise_floor)) + 6.0, bar_top + 9.0), Anchor::Start, &text);
            bar_top += BAR + 1.0;
        }
        let (upper, lower) = (y + 14.0, bar_top + 2.0);
        svg.line("rule", (0.0, upper), (0.0, lower));
        svg.line(class(Ink::NoiseFloor), (at(diagnosis.noise_floor), upper), (at(diagnosis.noise_floor), lower));
        y += if has_test { PITCH } else { PITCH - BAR };
    }
    let caption = format!(
        "The gap between simulated and measured displacement (RMSE) from the base model through each effect that was added; dashed, the \
         measurement noise of {}, below which nothing can fall.",
        format_si(diagnosis.noise_floor, unit, 2)
    );
    Some(Figure { drawing: svg, size: (WIDTH, y + 6.0), caption })
}

/// The measured missing force as points, and the effect's own force through them.
pub(super) fn curve(curve: &Curve, title: &str, unit: &str) -> Option<Figure> {
    if curve.measured.len() < 2 {
        return None;
    }
    let acceleration = |points: &[[f64; 2]]| points.iter().map(|p| p[1]).collect::<Vec<f64>>();
    let mut forces = acceleration(&curve.measured);
    forces.sort_by(f64::total_cmp);
    // A few wild points, where noise was differentiated, would press the rest flat.
    let tail = forces.len() / 100;
    let shown = forces[tail..forces.len() - tail].iter().copied().chain(acceleration(&curve.effect));
    let panel = Panel {
        at: (LEFT, TOP),
        size: (WIDTH - LEFT - RIGHT, 190.0),
        x: Axis::linear(&curve.axis, padded(curve.measured.iter().map(|p| p[0])), &raised(&curve.unit)),
        y: Axis::linear("force per mass", padded(shown), &per_second(&per_second(unit))),
        x_labels: true,
        y_labels: true,
        guides: Vec::new(),
        lines: vec![Line { ink: Ink::Identified, points: curve.effect.iter().map(|p| (p[0], p[1])).collect() }],
        dots: curve.measured.iter().map(|p| (p[0], p[1])).collect(),
    };
    let mut drawing = Svg::default();
    panel.draw(&mut drawing);
    let legend = Legend::new(&[(Ink::Identified, title)], LEFT + 92.0, WIDTH);
    legend.dot(&mut drawing, 92.0, "measured");
    legend.draw(&mut drawing);
    let caption = format!(
        "The force per mass that the model lacks along the measured motion (dots) over {}, and the one that is added (line): {title}.",
        curve.axis
    );
    Some(Figure { drawing, size: (WIDTH, TOP + 190.0 + BELOW), caption })
}

/// Measured response with that of the base model and that of the last one, and what each leaves, for the records that tell most.
pub(super) fn overlay(base: &Stage, last: &Stage, unit: &str, room: &Room) -> Vec<Figure> {
    let held_out = base.traces.iter().any(|t| t.usage == Usage::HeldOut);
    let wanted = if held_out { Usage::HeldOut } else { Usage::Fit };
    base.traces
        .iter()
        .filter(|t| t.usage == wanted)
        .filter_map(|before| {
            Some((before, last.traces.iter().find(|t| t.record == before.record && t.usage == wanted)?))
        })
        .take(room.records.div_ceil(4))
        .map(|(before, after)| one_overlay(before, after, unit))
        .collect()
}

fn one_overlay(before: &Trace, after: &Trace, unit: &str) -> Figure {
    let range = stretch(before);
    let time = |k: usize| before.start + before.interval * k as f64;
    let from = range.start;
    let part = |values: &[f64]| values.get(range.clone()).unwrap_or_default().to_vec();
    let (measured, first, second) = (part(&before.measured), part(&before.simulated), part(&after.simulated));
    let residual = |simulated: &[f64]| measured.iter().zip(simulated).map(|(m, s)| s - m).collect::<Vec<f64>>();
    let (left_before, left_after) = (residual(&first), residual(&second));
    let end = range.end.saturating_sub(1).max(range.start + 1);
    let t = Axis::linear("t", time(range.start)..=time(end), "s");
    let panel = |top: f64, height: f64, label: &str, lines: &[(Ink, &[f64])], labelled: bool| {
        let mut panel = Panel {
            at: (LEFT, top),
            size: (WIDTH - LEFT - RIGHT, height),
            x: t.clone(),
            y: Axis::linear(label, padded(lines.iter().flat_map(|(_, v)| v.iter().copied())), unit),
            x_labels: labelled,
            y_labels: true,
            guides: Vec::new(),
            lines: Vec::new(),
            dots: Vec::new(),
        };
        let columns = panel.columns();
        panel.lines = lines
            .iter()
            .map(|(ink, values)| Line { ink: *ink, points: thinned(values, |k| time(from + k), columns) })
            .collect();
        panel
    };
    let mut drawing = Svg::default();
    let lines: [(Ink, &[f64]); 3] = [(Ink::Measured, &measured), (Ink::Ghost, &first), (Ink::Identified, &second)];
    panel(TOP, RESPONSE, "x", &lines, false).draw(&mut drawing);
    let lines: [(Ink, &[f64]); 2] = [(Ink::Ghost, &left_before), (Ink::Identified, &left_after)];
    panel(TOP + RESPONSE + GAP, RESIDUAL, "Δx", &lines, true).draw(&mut drawing);
    let keys = [(Ink::Measured, "measured"), (Ink::Ghost, "base model"), (Ink::Identified, "with what was added")];
    Legend::new(&keys, LEFT, WIDTH).draw(&mut drawing);
    let usage = if before.usage == Usage::HeldOut { "held out: never fitted" } else { "fitted" };
    let shown = if range.len() < before.measured.len() { ", around the base model's largest error" } else { "" };
    let span = Scale::suited(1.0, "s").format(time(end) - time(range.start), 3);
    let caption = format!(
        "Record {} ({usage}), {span}{shown}. Above, the measured displacement and the simulated one before and after; beneath, simulated \
         less measured.",
        before.record
    );
    Figure { drawing, size: (WIDTH, TOP + RESPONSE + GAP + RESIDUAL + BELOW), caption }
}

/// The samples shown: all of them, or so many oscillations around the base model's largest error.
fn stretch(trace: &Trace) -> std::ops::Range<usize> {
    let n = trace.measured.len().min(trace.simulated.len());
    let turns = trace.measured.windows(2).filter(|w| (w[0] < 0.0) != (w[1] < 0.0)).count() / 2;
    if turns <= OSCILLATIONS {
        return 0..n;
    }
    let length = (n * OSCILLATIONS / turns).clamp(2, n);
    let errors = trace.measured.iter().zip(trace.simulated.iter()).map(|(m, s)| (m - s).abs());
    let worst = errors.enumerate().filter(|(_, e)| e.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |p| p.0);
    let start = worst.saturating_sub(length / 2).min(n - length);
    start..start + length
}
