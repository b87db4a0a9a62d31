//! Velocity over displacement.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Layer, LayerRole, Panel, Points, Shape};
use crate::palette::Ink;
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Phase",
    tooltip: "Velocity over displacement: loops, limit cycles and sticking show here",
    reading: "",
    group: Group::Motion,
    records: RecordUse::One,
    slow: false,
    figure,
};

/// One curve: abscissae and ordinates.
type PhaseCurve<'a> = (&'a [f64], &'a [f64]);

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    // A first-order state is shown over the one before it.
    let (across, up) = if scene.second_order() {
        (scene.freedom, scene.layout.freedoms + scene.freedom)
    } else {
        (scene.freedom, (scene.freedom + 1) % scene.layout.freedoms.max(1))
    };
    let (y_name, y_unit) = if scene.second_order() {
        scene.rate_label()
    } else {
        (scene.layout.name(Symbol::State(up)), scene.unit_of(Role::Displacement(up)))
    };
    let measured: PhaseCurve<'_> = (scene.smoothed(across), scene.smoothed(up));
    let identified: PhaseCurve<'_> = (scene.simulated(across), scene.simulated(up));
    let x = Axis::linear(scene.layout.name(Symbol::State(across)), scene.unit(), extent(measured.0, identified.0));
    let mut panel = Panel::new("phase", x, Axis::linear(y_name, y_unit, extent(measured.1, identified.1)));
    for (ink, name, (xs, ys)) in
        [(Ink::Measured, "measured, smoothed", measured), (Ink::Identified, "identified", identified)]
    {
        panel.layers.push(Layer::new(ink, name, Shape::Line(Points::of(xs, ys))));
        if let (Some(x), Some(y)) = (xs.first(), ys.first()) {
            // Where it begins.
            panel.layers.push(Layer::new(ink, "", Shape::Marks(Points::new([[*x, *y]]))).playing(LayerRole::Ghost));
        }
    }
    let caption = format!("Phase portrait of record {}; the measured states are smoothed.", scene.record.record.name);
    Ok(Figure::stacked([(panel, 1.0)], 240.0, caption))
}

/// Range of what is shown, with a margin; the measurement's, and of the identified what does not run away.
fn extent(measured: &[f64], identified: &[f64]) -> (f64, f64) {
    let range = |values: &[f64]| {
        let finite = values.iter().filter(|v| v.is_finite());
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)))
    };
    let (measured, identified) = (range(measured), range(identified));
    let (mut low, mut high) = if measured.0 <= measured.1 { measured } else { identified };
    let room = 0.5 * (high - low);
    if identified.0 <= identified.1 {
        (low, high) = (low.min(identified.0.max(low - room)), high.max(identified.1.min(high + room)));
    }
    if low.is_nan() || high.is_nan() || low > high {
        return (-1.0, 1.0);
    }
    let span = high - low;
    let margin = if span > 1e-12 * high.abs().max(low.abs()) {
        0.06 * span
    } else if high == 0.0 {
        1.0
    } else {
        0.2 * high.abs()
    };
    (low - margin, high + margin)
}
