//! The centre of the room: its pages, and on the first the drawing over the record.

use crate::app::plot::palette::Painted as _;
use std::sync::Arc;

use egui::{Align, Layout, RichText, Stroke, Ui, vec2};

use super::plots::{self, Frame, Panel, Trace};
use super::{Act, Made, Page, RigRoom, RigState, class, drawing};
use crate::app::lessons::{self, Progress};
use crate::app::plot::palette::Ink;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{card, switch};

/// Width from which on pages and player stand in one row, points.
const ROOMY: f32 = 560.0;

impl RigRoom {
    /// Draws the centre.
    pub(crate) fn show(&mut self, ui: &mut Ui, state: &mut RigState, progress: &Progress) -> Vec<Act> {
        let mut acts = Vec::new();
        let duration = self.made.as_ref().map_or(0.0, |m| m.run.records[0].duration());
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
                self.rig(ui, state);
            }
            Page::Lessons => acts.extend(lessons::list(ui, progress).map(Act::Begin)),
            Page::Class => class::show(ui, self, &mut state.class, &mut acts),
        }
        self.plots.tidy();
        acts
    }

    fn rig(&mut self, ui: &mut Ui, state: &RigState) {
        let colors = theme::accents(ui.visuals().dark_mode);
        if let Some(failure) = &self.failure {
            card(ui, colors.wrong, |ui| {
                ui.add(
                    egui::Label::new(
                        RichText::new(sindyscope_values::format::units::raised(failure)).color(colors.wrong),
                    )
                    .wrap(),
                );
            });
        }
        let Some(made) = self.made.clone() else {
            if self.failure.is_none() {
                ui.centered_and_justified(|ui| ui.weak("recording…"));
            }
            return;
        };
        drawing::show(ui, &made, state.player.at);
        ui.visuals_mut().extreme_bg_color = crate::app::plot::palette::ground(ui.visuals().dark_mode);
        self.record(ui, &made, state.player.at);
    }

    /// The record over time: what was measured, the identified response, the input; a line where the drawing is.
    fn record(&mut self, ui: &mut Ui, made: &Made, at: f64) {
        let dark = ui.visuals().dark_mode;
        let record = &made.run.records[0];
        let masses = made.run.displacements.len();
        const NAMES: [&str; 3] = ["x1", "x2", "x3"];
        let mut panels: Vec<Panel<'_>> = Vec::new();
        for (mass, name) in NAMES.iter().enumerate().take(masses) {
            let Some(channel) = record.channels.get(mass) else { continue };
            let mut traces = vec![Trace::measured(&channel.values, dark)];
            traces.extend(made.responses.get(mass).map(|values| Trace {
                name: "identified",
                color: Ink::Identified.color(dark),
                width: Ink::Identified.width(),
                values: Arc::clone(values),
                leads: false,
            }));
            let symbol = if masses == 1 { "x" } else { name };
            panels.push(panel(symbol, made.settings.unit(), traces, 1.3));
        }
        if !made.run.input.is_empty() {
            let color = Ink::Input.color(dark);
            let values = Arc::clone(&made.run.input);
            let trace = Trace { name: "input", color, width: 1.2, values, leads: true };
            panels.push(panel("u", made.settings.input_unit(), vec![trace], 0.7));
        }
        let frame = Frame {
            id: "virtual rig",
            start: record.start,
            interval: record.interval,
            samples: record.len(),
            held_out: false,
            worst: &[],
            dark,
            height: ui.available_height() - 2.0,
        };
        let shown = plots::stack(ui, &mut self.plots, &frame, &panels);
        for plot in shown {
            let area = *plot.transform.frame();
            let x = plot.transform.position_from_point_x(record.start + at);
            if area.x_range().contains(x) {
                ui.painter().vline(x, area.y_range(), Stroke::new(1.5, theme::accents(dark).accent));
            }
        }
    }
}

fn row(ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    let size = vec2(ui.available_width(), ROW + 4.0);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), body);
}

fn panel<'a>(symbol: &'a str, unit: &str, traces: Vec<Trace<'a>>, share: f32) -> Panel<'a> {
    Panel { symbol, unit: unit.to_owned(), traces, band: None, level: None, aside: String::new(), empty: "", share }
}
