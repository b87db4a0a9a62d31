//! Velocity, and acceleration: what the equations are fitted to.

use super::scene::{self, Scene};
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Fit, Layer, LayerRole, Panel};
use crate::palette::Ink;
use sindyscope_values::format::units::per_second;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Velocity",
    tooltip: "Velocity from the smoothed measurement and from the identified model",
    reading: "",
    group: Group::Motion,
    records: RecordUse::One,
    slow: false,
    figure,
};

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    let (symbol, unit) = scene.rate_label();
    let mut panels = Vec::new();
    if scene.second_order() {
        let index = scene.layout.freedoms + scene.freedom;
        let before = scene.before.map(|r| scene::simulated(r, index));
        let axis = Axis::linear(symbol.as_str(), unit.as_str(), (0.0, 1.0));
        panels.push(panel(&scene, "velocity", axis, scene.smoothed(index), before, scene.simulated(index)));
        if subject.options.acceleration {
            let axis = Axis::linear(format!("d{symbol}/dt"), per_second(&unit), (0.0, 1.0));
            let slopes = slopes(scene.simulated(index), scene.interval());
            panels.push(panel(&scene, "acceleration", axis, scene.rate(index), None, &slopes));
        }
    } else {
        let slopes = slopes(scene.simulated(scene.freedom), scene.interval());
        let axis = Axis::linear(symbol.as_str(), unit, (0.0, 1.0));
        panels.push(panel(&scene, "velocity", axis, scene.rate(scene.freedom), None, &slopes));
    }
    let caption = format!(
        "{symbol} of record {} ({}), measured (smoothed) and identified.",
        scene.record.record.name,
        scene.usage()
    );
    let height = 145.0 * panels.len() as f64;
    Ok(Figure::stacked(panels.into_iter().map(|p| (p, 1.0)), height, caption))
}

fn panel(
    scene: &Scene<'_>,
    id: &'static str,
    y: Axis,
    measured: &[f64],
    before: Option<&[f64]>,
    identified: &[f64],
) -> Panel {
    let mut panel = scene.over_time(id, y, id == "velocity");
    panel.fit = Fit::Curves;
    panel.layers.push(Layer::new(Ink::Measured, "measured, smoothed", scene.samples(measured)));
    let before = scene.samples(before.unwrap_or_default());
    panel.layers.push(Layer::new(Ink::Ghost, "before", before).playing(LayerRole::Ghost));
    panel.layers.push(Layer::new(Ink::Identified, "identified", scene.samples(identified)).playing(LayerRole::Follows));
    panel.fitted()
}

/// Rate of a simulated state, by central differences of what is drawn anyway.
fn slopes(values: &[f64], interval: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..values.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            if a == b { 0.0 } else { (values[b] - values[a]) / (interval * (b - a) as f64) }
        })
        .collect()
}
