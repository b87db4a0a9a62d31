//! Before and after a force was added, on data never fitted.

use std::collections::BTreeSet;

use crate::figure::thin::Spacing;
use crate::figure::{Axis, Figure, Fit, Layer, Panel, Samples, Shape};
use crate::palette::Ink;
use sindyscope_modes::{Sensor, UnseenRecord};
use sindyscope_values::format::units::raised;

/// The response of one sensor along a record never fitted, and beneath it what the linear model and the one with the force leave.
pub fn before_and_after(record: &UnseenRecord, at: usize, sensor: &Sensor) -> Figure {
    let spacing = Spacing { start: 0.0, interval: record.interval };
    let seconds = record.interval * record.measured[at].len() as f64;
    let time = || Axis::linear("t", "s", (0.0, seconds)).linked("time never fitted");
    let samples = |values: &[f64]| Shape::Samples(Samples::new(values, spacing));
    let modelled = |left: &[f64]| -> Vec<f64> { record.measured[at].iter().zip(left).map(|(y, e)| y - e).collect() };
    let mut upper =
        Panel::new("unseen response", time(), Axis::linear(sensor.name.as_str(), raised(&sensor.unit), (-1.0, 1.0)));
    let mut lower = Panel::new("unseen error", time(), Axis::linear("E", raised(&sensor.unit), (-1.0, 1.0)));
    let (linear, with) = (Ink::of_stage(0), Ink::of_stage(1));
    upper.layers.push(Layer::new(Ink::Measured, "measured", samples(&record.measured[at])));
    upper.layers.push(Layer::new(linear, "linear modes", samples(&modelled(&record.before[at]))));
    lower.layers.push(Layer::new(linear, "", samples(&record.before[at])));
    if let Some(after) = &record.after {
        upper.layers.push(Layer::new(with, "with the force", samples(&modelled(&after[at]))));
        lower.layers.push(Layer::new(with, "", samples(&after[at])));
    }
    for panel in [&mut upper, &mut lower] {
        panel.fit = Fit::Curves;
        panel.y.range = panel.shown_y(&BTreeSet::new());
    }
    let caption = format!(
        "{} on data never fitted, record {}: measured, of the linear modes and of the modes with the force; beneath, what each \
         leaves.",
        sensor.name, record.name
    );
    Figure::stacked([(upper, 1.5), (lower, 1.0)], 300.0, caption)
}
