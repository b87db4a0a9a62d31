//! The centre of the room: its pages, and on the first the drawing over the record.

use std::sync::Arc;

use egui::{Align, Layout, RichText, Stroke, Ui, vec2};

use super::room::{Made, RigAct, RigRoom};
use super::{class, drawing};
use crate::app::lessons;
use crate::app::plot::figures::{FigurePlace, Figures};
use crate::app::plot::{painter, palette};
use crate::app::state::{LessonProgress, Page, RigState};
use crate::app::theme::{self, ROW};
use crate::app::widgets::{card, switch};
use sindyscope_report::figure::thin::Spacing;
use sindyscope_report::figure::{Axis, Figure, Fit, Layer, LayerRole, Panel, Samples, Shape};

/// Width from which on pages and player stand in one row, points.
const ROOMY: f32 = 560.0;

/// Draws the centre; `figures` is what the drawing remembers.
pub(crate) fn show(
    ui: &mut Ui,
    room: &RigRoom,
    figures: &mut Figures,
    state: &mut RigState,
    progress: &LessonProgress,
) -> Vec<RigAct> {
    let mut acts = Vec::new();
    let duration = room.made.as_ref().map_or(0.0, |m| m.run.records[0].duration());
    let frequency = state.settings.natural_frequencies().first().copied().unwrap_or(1.0);
    let plays = state.page == Page::Rig && duration > 0.0;
    // In little room the player has a row of its own.
    let roomy = ui.available_width() >= ROOMY;
    row(ui, |ui| {
        switch(ui, &mut state.page, &Page::ALL);
        if plays && roomy {
            ui.add_space(12.0);
            state.player.show(ui, duration, frequency);
        }
    });
    if plays && !roomy {
        row(ui, |ui| state.player.show(ui, duration, frequency));
    }
    match state.page {
        Page::Rig => {
            state.player.advance(ui, duration, frequency);
            rig(ui, room, figures, state);
        }
        Page::Lessons => acts.extend(lessons::list(ui, progress).map(|id| RigAct::Begin(id.to_owned()))),
        Page::Class => class::show(ui, &room.class, &mut state.class, &mut acts),
    }
    figures.tidy();
    acts
}

fn rig(ui: &mut Ui, room: &RigRoom, figures: &mut Figures, state: &RigState) {
    let colors = theme::accents(ui.visuals().dark_mode);
    if let Some(failure) = &room.failure {
        card(ui, colors.wrong, |ui| {
            ui.add(
                egui::Label::new(RichText::new(sindyscope_values::format::units::raised(failure)).color(colors.wrong))
                    .wrap(),
            );
        });
    }
    let Some(made) = &room.made else {
        if room.failure.is_none() {
            ui.centered_and_justified(|ui| ui.weak("recording…"));
        }
        return;
    };
    drawing::show(ui, made, state.player.at);
    ui.visuals_mut().extreme_bg_color = palette::ground(ui.visuals().dark_mode);
    record(ui, figures, made, state.player.at);
}

/// The record over time: what was measured, the identified response, the input; a line where the drawing is.
fn record(ui: &mut Ui, figures: &mut Figures, made: &Made, at: f64) {
    let record = &made.run.records[0];
    let address = |values: &Arc<[f64]>| values.as_ptr() as usize;
    let series = made.responses.iter().chain([&made.run.input]).chain(record.channels.iter().map(|c| &c.values));
    let made_of: Vec<usize> = series.map(address).collect();
    let Some(figure) = figures.get("record", made_of, || Some(drawing_of(made))) else { return };
    let data = (record.start.to_bits(), record.interval.to_bits(), record.len());
    let place = FigurePlace::new("virtual rig", "Record of the rig", data);
    let painted = figures.draw(ui, &figure, &place);
    let stroke = Stroke::new(1.5, theme::accents(ui.visuals().dark_mode).accent);
    painter::line_at(ui, &painted, record.start + at, stroke);
}

/// The record of a rig over time.
fn drawing_of(made: &Made) -> Figure {
    let record = &made.run.records[0];
    let spacing = Spacing { start: record.start, interval: record.interval };
    let length = record.interval * record.len().saturating_sub(1).max(1) as f64;
    let time = Axis::linear("t", "s", (record.start - 0.01 * length, record.start + 1.01 * length)).linked("rig time");
    let samples = |values: &Arc<[f64]>| Shape::Samples(Samples::new(Arc::clone(values), spacing));
    let panel = |id, symbol: &str, unit: &str, layers: Vec<Layer>| {
        let y = Axis::linear(symbol, unit, (0.0, 1.0));
        Panel { fit: Fit::Curves, layers, ..Panel::new(id, time.clone(), y) }.fitted()
    };
    const NAMES: [&str; 3] = ["x1", "x2", "x3"];
    let masses = made.run.displacements.len();
    let mut panels: Vec<(Panel, f64)> = Vec::new();
    for (mass, name) in NAMES.iter().enumerate().take(masses) {
        let Some(channel) = record.channels.get(mass) else { continue };
        let mut layers = vec![Layer::new(palette::Ink::Measured, "measured", samples(&channel.values))];
        let identified = made.responses.get(mass);
        layers.extend(
            identified
                .map(|v| Layer::new(palette::Ink::Identified, "identified", samples(v)).playing(LayerRole::Follows)),
        );
        panels.push((panel(*name, if masses == 1 { "x" } else { name }, made.settings.unit(), layers), 1.3));
    }
    if !made.run.input.is_empty() {
        let layers = vec![Layer::new(palette::Ink::Input, "input", samples(&made.run.input))];
        panels.push((panel("u", "u", made.settings.input_unit(), layers), 0.7));
    }
    Figure::stacked(panels, 240.0, "The record of the virtual rig.")
}

fn row(ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    let size = vec2(ui.available_width(), ROW + 4.0);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), body);
}
