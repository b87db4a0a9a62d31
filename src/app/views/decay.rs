//! A free decay: frequency and damping over amplitude.

use super::{Request, View, ViewState, kept, painter};
use egui::Ui;
use egui_plot::PlotPoint;

use super::figure::{Axis, Figure, Graph, Shape, lead, points};
use super::legend::{self, Entry};
use super::scene::Scene;
use crate::app::plot::palette::Ink;
use sindyscope_report::diagram::{Decay, NoDecay};
use sindyscope_values::term::Symbol;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    let (index, freedom) = (scene.index, scene.freedom);
    let (name, unit) = (scene.layout.name(Symbol::State(freedom)), scene.unit());
    let choice = [index, freedom, 0, 0, 0, 0];
    let printing = state.printing;
    let figure = state.cache.figures.get(ui, View::Decay, scene, choice, printing, move |outcome| {
        match Decay::of_record(outcome, &outcome.records[index], freedom) {
            Ok((measured, simulated)) => figure(&measured, simulated.as_ref(), &name, &unit),
            Err(why) => Figure::Note(
                match why {
                    NoDecay::Driven => {
                        "This record is no free decay: its input never rests for long. Release the structure, or let the \
                         force stop, and record how the motion dies out"
                    }
                    NoDecay::FewSwings => {
                        "This record is no free decay: fewer than eight half swings stand out of the noise"
                    }
                    NoDecay::NotDecaying => "This record is no free decay: the swings do not become smaller",
                }
                .into(),
            ),
        }
    });
    let graphs = kept::graphs(ui, figure.as_deref(), "Computing frequency and damping…")?;
    legend::reading(
        ui,
        "A backbone that rises with amplitude is a hardening spring, one that falls a softening one. A damping ratio that \
         is level is viscous, one that grows as the amplitude falls dry friction, one that grows with it drag.",
    );
    let names = [Entry { ink: Ink::Measured, name: "measured" }, Entry { ink: Ink::Identified, name: "identified" }];
    painter::names(ui, scene, state, &names);
    painter::rows(ui, View::Decay, scene, state, graphs, &[(&[0], 1.2), (&[1], 1.2), (&[2], 0.9)])
}

fn figure(measured: &Decay, simulated: Option<&Decay>, name: &str, unit: &str) -> Figure {
    let empty = Decay::default();
    let simulated = simulated.unwrap_or(&empty);
    let largest = measured.amplitude.iter().copied().fold(0.0, f64::max);
    let amplitude = Axis::linear(format!("amplitude of {name}"), unit, (-0.02 * largest, 1.04 * largest));
    let layers = |x: fn(&Decay) -> &Vec<f64>, y: &dyn Fn(&Decay) -> Vec<f64>| {
        vec![
            (Ink::Measured, Shape::Marks(points(x(measured), &y(measured)))),
            (Ink::Identified, Shape::Line(points(x(simulated), &y(simulated)))),
        ]
    };
    let columns = |x: &Axis, y: &Axis, pick_x: fn(&Decay) -> &Vec<f64>, pick: &dyn Fn(&Decay) -> Vec<f64>| {
        let of = |which: &str, decay: &Decay| {
            [
                (format!("{} {which}", x.header()), pick_x(decay).clone()),
                (format!("{} {which}", y.header()), pick(decay)),
            ]
        };
        [of("measured", measured), of("identified", simulated)].concat()
    };
    let graph =
        |id, caption: &str, x: Axis, y: Axis, pick_x: fn(&Decay) -> &Vec<f64>, pick: &dyn Fn(&Decay) -> Vec<f64>| {
            let columns = columns(&x, &y, pick_x, pick);
            let mut layers = layers(pick_x, pick);
            if y.log {
                for (_, shape) in &mut layers {
                    if let Shape::Marks(points) | Shape::Line(points) = shape {
                        points.iter_mut().for_each(|p: &mut PlotPoint| p.y = p.y.max(f64::MIN_POSITIVE).log10());
                    }
                }
            }
            Graph { id, caption: caption.into(), x, y, layers, map: None, columns, outside: None }
        };
    let percent = |d: &Decay| d.damping.iter().map(|z| 100.0 * z).collect::<Vec<f64>>();
    let frequency = lead(measured.frequency.iter().copied(), simulated.frequency.iter().copied());
    // Frequencies that agree to the last digit should not look like a storm.
    let middle = 0.5 * (frequency.0 + frequency.1);
    let half = (0.5 * (frequency.1 - frequency.0)).max(2e-3 * middle);
    let mut ratios = percent(measured);
    ratios.sort_by(f64::total_cmp);
    let high = ratios.get(ratios.len() * 97 / 100).copied().unwrap_or(1.0).max(1e-6);
    let low = ratios.first().copied().unwrap_or(0.0).min(0.0).max(-0.2 * high);
    let times = measured.time.first().zip(measured.time.last()).map_or((0.0, 1.0), |(a, b)| (*a, *b));
    let margin = 0.03 * (times.1 - times.0);
    let level = |a: &f64| a.max(f64::MIN_POSITIVE).log10();
    let levels = lead(measured.amplitude.iter().map(level), simulated.amplitude.iter().map(level));
    Figure::Graphs(vec![
        graph(
            "backbone",
            "backbone: frequency over amplitude",
            amplitude.clone(),
            Axis::linear("frequency", "Hz", (middle - half, middle + half)),
            |d| &d.amplitude,
            &|d| d.frequency.clone(),
        ),
        graph(
            "damping",
            "damping ratio over amplitude",
            amplitude.clone(),
            Axis::linear("damping ratio", "%", (low - 0.05 * high, 1.15 * high)),
            |d| &d.amplitude,
            &percent,
        ),
        graph(
            "envelope",
            "amplitude over time: straight is viscous, bent down dry friction",
            Axis::linear("t", "s", (times.0 - margin, times.1 + margin)),
            Axis::log("amplitude", unit, levels),
            |d| &d.time,
            &|d| d.amplitude.clone(),
        ),
    ])
}
