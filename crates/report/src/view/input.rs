//! The inputs and their rates.

use super::scene::Scene;
use super::{FigureResult, Group, RecordUse, Subject, ViewEntry};
use crate::figure::{Axis, Figure, Fit, Layer};
use crate::palette::Ink;
use sindyscope_values::format::units::per_second;
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

pub(super) const VIEW: ViewEntry = ViewEntry {
    label: "Input",
    tooltip: "The force or base motion that the model was driven by, and its rate",
    reading: "",
    group: Group::Motion,
    records: RecordUse::One,
    slow: false,
    figure,
};

fn figure(subject: &Subject<'_>) -> FigureResult {
    let scene = Scene::new(subject)?;
    if scene.layout.inputs == 0 {
        return Err("No input was measured: the record is a free response".into());
    }
    let index = scene.input;
    let values = scene.record.record.channel(Role::Input(index)).map_or(&[][..], |c| &c.values);
    let rates = scene.record.signals.input_rate(index).unwrap_or(&[]);
    let unit = scene.unit_of(Role::Input(index));
    let panel = |id, symbol, unit: String, name, values, first| {
        let mut panel = scene.over_time(id, Axis::linear(scene.layout.name(symbol), unit, (0.0, 1.0)), first);
        panel.fit = Fit::Curves;
        panel.layers.push(Layer::new(Ink::Input, name, scene.samples(values)));
        (panel.fitted(), 1.0)
    };
    let rate_unit = per_second(&unit);
    let panels = [
        panel("input", Symbol::Input(index), unit, "measured", values, true),
        panel("input rate", Symbol::InputRate(index), rate_unit, "rate, smoothed", rates, false),
    ];
    let caption = format!("The input of record {} and its rate.", scene.record.record.name);
    Ok(Figure::stacked(panels, 200.0, caption))
}
