//! Force over displacement and velocity, over time, and the energy that it takes.

use std::collections::BTreeSet;

use crate::figure::thin::Spacing;
use crate::figure::{Axis, Figure, Fit, Layer, Panel, PanelRow, PlotBar, Points, Samples, Shape, Ticks, extent, lead};
use crate::palette::Ink;
use sindyscope_component::{ComponentModel, ForceFit, GivenMotion, Specimen};
use sindyscope_values::record::Usage;
use sindyscope_values::term::Symbol;

/// The force over displacement, and over velocity.
pub(super) fn loops(specimen: &Specimen, fit: &ForceFit, motion: &GivenMotion<'_>) -> Figure {
    let (name, unit) = specimen.force();
    let identified: Vec<f64> = motion.force.iter().zip(&fit.residual).map(|(f, e)| f - e).collect();
    let panel = |id: &'static str, symbol: &str, over: &[f64], over_unit: String| {
        let range = lead(over.iter().copied(), std::iter::empty());
        let force = lead(motion.force.iter().copied(), identified.iter().copied());
        let mut panel = Panel::new(id, Axis::linear(symbol, over_unit, range), Axis::linear(name, unit, force));
        for (ink, name, values) in
            [(Ink::Measured, "measured", motion.force), (Ink::Identified, "identified", &identified)]
        {
            panel.layers.push(Layer::new(ink, name, Shape::Line(Points::of(over, values))));
        }
        panel
    };
    let of_symbol = |symbol| specimen.unit(symbol);
    let panels = vec![
        panel("over-displacement", "x", motion.displacement, of_symbol(Symbol::State(0))),
        panel("over-velocity", "v", motion.velocity, of_symbol(Symbol::Rate(0))),
    ];
    let held_out = if fit.usage == Usage::HeldOut { " (held out)" } else { "" };
    Figure {
        rows: vec![PanelRow::new(panels, 1.0)],
        legend: Vec::new(),
        caption: format!("Force of record {}{held_out} over displacement and over velocity.", fit.name),
        height: 260.0,
    }
}

/// The force over time, and the error beneath.
pub(super) fn over_time(specimen: &Specimen, fit: &ForceFit, motion: &GivenMotion<'_>) -> Figure {
    let (name, unit) = specimen.force();
    let spacing = Spacing { start: 0.0, interval: fit.interval };
    let time = || Axis::linear("t", "s", (0.0, fit.interval * fit.samples as f64)).linked("component time");
    let samples = |values: &[f64]| Shape::Samples(Samples::new(values, spacing));
    let identified: Vec<f64> = motion.force.iter().zip(&fit.residual).map(|(f, e)| f - e).collect();
    let mut upper = Panel::new("force", time(), Axis::linear(name, unit, (-1.0, 1.0)));
    upper.layers.push(Layer::new(Ink::Measured, "measured", samples(motion.force)));
    upper.layers.push(Layer::new(Ink::Identified, "identified", samples(&identified)));
    let mut lower = Panel::new("force error", time(), Axis::linear("E", unit, (-1.0, 1.0)));
    lower.layers.push(Layer::new(Ink::Error, "error", samples(&fit.residual)));
    for panel in [&mut upper, &mut lower] {
        panel.fit = Fit::Curves;
        panel.y.range = panel.shown_y(&BTreeSet::new());
    }
    let caption =
        format!("Force of record {} over time, measured and identified, and the error between them.", fit.name);
    Figure::stacked([(upper, 1.6), (lower, 1.0)], 300.0, caption)
}

/// The energy that the force takes in a cycle of each record, measured and identified.
pub(super) fn energy(specimen: &Specimen, model: &ComponentModel) -> Figure {
    let (_, unit) = specimen.force();
    let cycles = |fit: &ForceFit| (fit.interval * fit.samples as f64 / specimen.period()).max(1.0);
    let names = model.records.iter().enumerate().map(|(r, fit)| {
        let held_out = if fit.usage == Usage::HeldOut { " (held out)" } else { "" };
        (r as f64, format!("{}{held_out}", fit.name))
    });
    let x =
        Axis::linear("record", "", (-0.6, model.records.len() as f64 - 0.4)).with_ticks(Ticks::Named(names.collect()));
    // ∫F v dt: a velocity in m/s makes N m.
    let velocity = specimen.unit(Symbol::Rate(0));
    let unit = velocity.strip_suffix("/s").map_or_else(|| format!("{unit} {velocity} s"), |x| format!("{unit} {x}"));
    let taken = model.records.iter().flat_map(|fit| [fit.energy[0] / cycles(fit), fit.energy[1] / cycles(fit), 0.0]);
    let mut panel = Panel::new("energy", x, Axis::linear("energy a cycle", unit, extent(taken)));
    for (k, ink, name) in [(0, Ink::Measured, "measured"), (1, Ink::Identified, "identified")] {
        let bar = |(r, fit): (usize, &ForceFit)| {
            let (from, height) = (r as f64 - 0.34 + 0.35 * k as f64, fit.energy[k] / cycles(fit));
            PlotBar { from, to: from + 0.33, height, text: String::new(), text_at: height }
        };
        let bars = model.records.iter().enumerate().map(bar).collect();
        panel.layers.push(Layer::new(ink, name, Shape::Bars { bars, hollow: false }));
    }
    let column = |head: &str, of: &dyn Fn(&ForceFit) -> f64| (head.to_owned(), model.records.iter().map(of).collect());
    panel.columns = vec![
        column("cycles", &cycles),
        column("energy measured", &|fit| fit.energy[0]),
        column("energy identified", &|fit| fit.energy[1]),
    ];
    panel.fixed = true;
    let caption =
        "Energy that the force takes in a cycle of the motion's main period, measured and identified, in each record.";
    Figure::stacked([(panel, 1.0)], 260.0, caption)
}
