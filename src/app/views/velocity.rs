//! Velocity, and acceleration: what the equations are fitted to.

use std::sync::Arc;

use egui::Ui;

use super::panel::{self, Curve, Panel, Part};
use super::scene::{self, Scene};
use super::{Request, View, ViewState};
use crate::app::plot::palette::Ink;
use crate::app::plot::units::per_second;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let curve = |ink, name, values, part| Curve { ink, name, samples: scene.samples(values), part };
    let (symbol, unit) = scene.rate_label();
    let rates: Vec<Arc<[f64]>>;
    let mut panels = Vec::new();
    let mut velocity = Panel::new("velocity", symbol.clone(), unit.clone());
    if scene.second_order() {
        let index = scene.layout.freedoms + scene.freedom;
        velocity.curves.push(curve(Ink::Measured, "measured, smoothed", scene.smoothed(index), Part::Leads));
        if let Some(before) = scene.before {
            velocity.curves.push(curve(Ink::Ghost, "before", scene::simulated(before, index), Part::Ghost));
        }
        velocity.curves.push(curve(Ink::Identified, "identified", scene.simulated(index), Part::Follows));
        panels.push(velocity);
        if state.acceleration {
            rates = vec![slopes_of(scene, state, "acceleration", index)];
            let mut acceleration = Panel::new("acceleration", format!("d{symbol}/dt"), per_second(&unit));
            acceleration.curves.push(curve(Ink::Measured, "measured, smoothed", scene.rate(index), Part::Leads));
            acceleration.curves.push(curve(Ink::Identified, "identified", &rates[0], Part::Follows));
            panels.push(acceleration);
        }
    } else {
        rates = vec![slopes_of(scene, state, "velocity", scene.freedom)];
        velocity.curves.push(curve(Ink::Measured, "measured, smoothed", scene.rate(scene.freedom), Part::Leads));
        velocity.curves.push(curve(Ink::Identified, "identified", &rates[0], Part::Follows));
        panels.push(velocity);
    }
    panel::stack(ui, View::Velocity, scene, state, &panels)
}

/// Rate of a simulated state, by central differences of what is drawn anyway.
fn slopes_of(scene: &Scene<'_>, state: &mut ViewState, id: &'static str, index: usize) -> Arc<[f64]> {
    let slopes = || slopes(scene.simulated(index), scene.interval()).into();
    Arc::clone(state.cache.series.entry((id, Ink::Identified)).or_insert_with(slopes))
}

fn slopes(values: &[f64], interval: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..values.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            if a == b { 0.0 } else { (values[b] - values[a]) / (interval * (b - a) as f64) }
        })
        .collect()
}
