//! The inputs and their rates.

use egui::Ui;

use super::panel::{self, Curve, Panel, Part};
use super::scene::Scene;
use super::{Request, View, ViewState, legend};
use crate::app::plot::palette::Ink;
use crate::app::plot::units::per_second;
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    if scene.layout.inputs == 0 {
        legend::note(ui, "No input was measured: the record is a free response");
        return None;
    }
    let index = scene.input;
    let signals = &scene.record.signals;
    let values = scene.record.record.channel(Role::Input(index)).map_or(&[][..], |c| &c.values);
    let rates = signals.input_rates.get(index).map_or(&[][..], Vec::as_slice);
    let unit = scene.unit_of(Role::Input(index));
    let name = |symbol| scene.layout.name(symbol);
    let curve = |name, values| Curve { ink: Ink::Input, name, samples: scene.samples(values), part: Part::Leads };
    let mut upper = Panel::new("input", name(Symbol::Input(index)), unit.clone());
    upper.curves.push(curve("measured", values));
    let mut lower = Panel::new("input rate", name(Symbol::InputRate(index)), per_second(&unit));
    lower.curves.push(curve("rate, smoothed", rates));
    panel::stack(ui, View::Input, scene, state, &[upper, lower])
}
