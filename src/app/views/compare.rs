//! Pinned settings beside each other: responses, errors, terms and figures.

use crate::app::plot::palette::Painted as _;
use std::fmt::Write as _;
use std::sync::Arc;

use egui::{Color32, Id, RichText, ScrollArea, Stroke, Ui};
use egui_plot::{Line, Plot, PlotPoint, PlotPoints};

use super::panel::{self, AXIS_WIDTH};
use super::scene::Scene;
use super::{Picture, Request, View, ViewState, legend};
use crate::app::plot::palette::{self, Ink};
use crate::app::plot::units;
use crate::app::plot::{axis, decimate, display, number};
use sindyscope_core::study::{Outcome, RecordOutcome, Score};
use sindyscope_values::term::{Symbol, Term};

/// Most outcomes that are kept: letters and colours to tell them apart.
const MOST: usize = 6;

/// Height of a row of the table, points.
const ROW: f32 = 26.0;

/// An outcome with its name and colour.
struct Shown<'a> {
    name: String,
    outcome: &'a Arc<Outcome>,
    color: Color32,
    width: f32,
}

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, picture: &Picture<'_>, state: &mut ViewState) -> Option<Request> {
    let mut asked = None;
    legend::reading(
        ui,
        "Pin a setting, change it, and see what the change does: the lower the line of an error, the better the setting; \
         the table says which terms made the difference.",
    );
    let mut shown: Vec<Shown<'_>> = picture
        .pins
        .iter()
        .enumerate()
        .map(|(k, outcome)| Shown { name: letter(k), outcome, color: ink(k, scene.dark), width: 1.2 })
        .collect();
    shown.push(Shown {
        name: "now".into(),
        outcome: scene.outcome,
        color: Ink::Identified.color(scene.dark),
        width: 1.6,
    });
    let table = table(scene, &shown);
    if !state.printing {
        asked = buttons(ui, picture, &shown, &table);
    }
    let room = ui.available_height();
    let below = (ROW * (table.rows.len() + 1) as f32).min(0.42 * room);
    let height = ((room - below - 16.0 - legend::HEIGHT) / 2.0).max(60.0);
    let range = plots(ui, scene, state, &shown, height);
    ScrollArea::both().id_salt("table of pins").max_height(below).auto_shrink([false, false]).show(ui, |ui| {
        table.show(ui, &shown);
    });
    asked.or(range)
}

fn letter(index: usize) -> String {
    char::from(b'A' + (index % 26) as u8).to_string()
}

fn ink(index: usize, dark: bool) -> Color32 {
    // The orange of this row is that of what is shown now.
    const ROW: [usize; MOST] = [0, 2, 3, 4, 7, 6];
    palette::effect(ROW[index % MOST], dark)
}

fn buttons(ui: &mut Ui, picture: &Picture<'_>, shown: &[Shown<'_>], table: &Table) -> Option<Request> {
    let mut asked = None;
    ui.horizontal_wrapped(|ui| {
        let free = picture.pins.len() < MOST;
        let next = format!("Pin as {}", letter(picture.pins.len()));
        let hint = if free { "Keep this setting, to compare others with it" } else { "Let go of one first" };
        if ui.add_enabled(free, egui::Button::new(next)).on_hover_text(hint).clicked() {
            asked = Some(Request::Pin);
        }
        for (k, pin) in shown.iter().enumerate().take(picture.pins.len()) {
            let settings = &pin.outcome.settings;
            let text = RichText::new(&pin.name).strong().color(pin.color);
            ui.menu_button(text, |ui| {
                ui.weak(format!(
                    "segment {}, threshold {}",
                    settings.smoothing.window,
                    number::significant_trimmed(settings.threshold, 3)
                ));
                if ui.button(format!("Go back to {}", pin.name)).clicked() {
                    asked = Some(Request::Return(k));
                    ui.close();
                }
                if ui.button(format!("Let go of {}", pin.name)).clicked() {
                    asked = Some(Request::Unpin(k));
                    ui.close();
                }
            })
            .response
            .on_hover_text("Go back to this setting, or let go of it")
            .widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Pinned {}", pin.name)));
        }
        if ui.button("Copy as a table").on_hover_text("Terms and figures, separated by tabs").clicked() {
            ui.ctx().copy_text(table.text());
        }
    });
    asked
}

/// The record that is shown, in another outcome.
fn record<'a>(outcome: &'a Outcome, scene: &Scene<'_>) -> Option<&'a RecordOutcome> {
    outcome.records.iter().find(|r| Arc::ptr_eq(&r.record, &scene.record.record))
}

/// Responses over the measurement, and errors beneath.
fn plots(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState, shown: &[Shown<'_>], height: f32) -> Option<Request> {
    let mut asked = None;
    let columns = f64::from(ui.available_width() * ui.ctx().pixels_per_point()).max(100.0) as usize;
    let (from, to) = scene.time_range();
    let interval = scene.interval();
    let start = scene.record.record.start;
    let link = Id::unique("pinned plots");
    ui.horizontal(|ui| {
        ui.add_space(AXIS_WIDTH);
        let measured = ("measured", scene.color(Ink::Measured));
        for (name, color) in std::iter::once(measured).chain(shown.iter().map(|s| (s.name.as_str(), s.color))) {
            legend::swatch(ui, color);
            ui.label(name);
            ui.add_space(8.0);
        }
    });
    for (k, name) in ["response", "error"].into_iter().enumerate() {
        let series: Vec<(&[f64], Color32, f32)> = shown
            .iter()
            .filter_map(|s| {
                let channel = record(s.outcome, scene)?.channels.get(scene.freedom)?;
                Some((if k == 0 { &*channel.response } else { &*channel.error }, s.color, s.width))
            })
            .collect();
        let measured = (scene.measured(), scene.color(Ink::Measured), Ink::Measured.width());
        let series: Vec<_> = if k == 0 { std::iter::once(measured).chain(series).collect() } else { series };
        // One that runs away must not flatten the measurement.
        let most = scene.measured().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let largest = series.iter().flat_map(|s| s.0).filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
        let largest = largest.min(if k == 0 { 1.5 * most } else { most }).max(f64::MIN_POSITIVE);
        let scale = display::scale(ui.ctx(), largest, &scene.shown().1);
        let symbol = if k == 0 { scene.shown().0 } else { "E".into() };
        let time = scene.time_scale();
        let id = Id::unique(("view", View::Compare, name));
        let must_fit = state.cache.must_fit(View::Compare, name);
        let visible = egui_plot::PlotMemory::load(ui.ctx(), id)
            .filter(|m| !must_fit && !m.auto_bounds.x)
            .map_or(from..=to, |m| m.bounds().range_x());
        let response = Plot::new(name)
            .id(id)
            .height(height)
            .link_axis(link, [true, false])
            .link_cursor(link, [true, false])
            .y_axis_min_width(AXIS_WIDTH)
            .x_axis_label(time.axis("t"))
            .y_axis_label(scale.axis(&symbol))
            .x_axis_formatter(|mark, _| axis::linear_label(mark, &time))
            .y_axis_formatter(|mark, _| axis::linear_label(mark, &scale))
            .x_grid_spacer(axis::round_marks(10.0))
            .y_grid_spacer(axis::round_marks(5.0))
            .grid_color(palette::grid(scene.dark))
            .grid_fade(0.0)
            .default_x_bounds(from, to)
            .default_y_bounds(if k == 0 { -1.1 * largest } else { -0.03 * largest }, 1.1 * largest)
            .show_x(false)
            .show_y(false)
            .allow_scroll(false)
            .show(ui, |plot| {
                if must_fit {
                    plot.set_auto_bounds(true);
                }
                for (values, color, width) in &series {
                    let mut points = Vec::new();
                    let all = values.iter().enumerate().map(|(k, v)| PlotPoint::new(start + interval * k as f64, *v));
                    decimate::columns(all, visible.clone(), columns, &mut points);
                    // A wide line drawn as a band loses its width on steep flanks and gains peaks.
                    let line = Line::new("", PlotPoints::Owned(points)).allow_band(false);
                    let line = line.stroke(Stroke::new(*width, *color));
                    plot.line(line.allow_hover(false));
                }
            });
        if !state.printing {
            let axes = [None, Some((&*symbol, &*scene.shown().1))];
            panel::choose_units(ui, response.transform.frame(), (View::Compare, name), axes);
        }
        if response.response.double_clicked() {
            state.cache.fit_all();
            ui.ctx().request_repaint();
        }
        asked = asked.or(panel::menu(&response.response, state, || table(scene, shown).text()));
    }
    asked
}

/// Figures and coefficients, one column an outcome.
struct Table {
    rows: Vec<(String, Vec<String>)>,
    columns: Vec<String>,
}

fn table(scene: &Scene<'_>, shown: &[Shown<'_>]) -> Table {
    let (_, unit) = scene.shown();
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    let mut row = |name: &str, cell: &dyn Fn(&Outcome) -> String| {
        rows.push((name.to_owned(), shown.iter().map(|s| cell(s.outcome)).collect()));
    };
    let rmse = |score: Option<Score>| score.map_or_else(|| "–".to_owned(), |s| units::format_si(s.rmse, &unit, 3));
    row("held-out error", &|o| rmse(o.test));
    row("fitted error", &|o| rmse(o.train));
    row("derivative", &|o| o.settings.smoothing.method.title().to_owned());
    row("segment", &|o| o.settings.smoothing.given().map_or_else(|| "–".to_owned(), |window| window.to_string()));
    row("order", &|o| {
        let smoothing = o.settings.smoothing;
        if smoothing.method.is_local() { smoothing.order.to_string() } else { "–".to_owned() }
    });
    // Its short name: a column as wide as a sentence would push the others out of view.
    row("regression", &|o| o.settings.regressor.name().to_owned());
    row("threshold", &|o| number::significant_trimmed(o.settings.threshold, 3));
    row("condition", &|o| number::significant(o.fits.iter().map(|f| f.condition).fold(1.0, f64::max), 2));
    let mut terms: Vec<(Symbol, Term)> = Vec::new();
    for shown in shown {
        let fitted = |state: &Symbol| shown.outcome.fits.iter().any(|f| f.state == *state);
        for (state, equation) in shown.outcome.model.iter().filter(|(state, _)| fitted(state)) {
            for term in &equation.terms {
                if !terms.iter().any(|(s, t)| *s == state && *t == term.term) {
                    terms.push((state, term.term.clone()));
                }
            }
        }
    }
    let several = scene.outcome.fits.len() > 1;
    for (state, term) in terms {
        let pretty = term.pretty(&scene.layout);
        let name = if several { format!("{pretty} in d{}/dt", scene.layout.name(state)) } else { pretty };
        row(&name, &|o| {
            let equation = o.model.iter().find(|(s, _)| *s == state).map(|(_, e)| e);
            let found = equation.and_then(|e| e.terms.iter().find(|t| t.term == term));
            found.map_or_else(|| "–".into(), |t| number::format_measured(t.coefficient, t.std_error))
        });
    }
    Table { rows, columns: shown.iter().map(|s| s.name.clone()).collect() }
}

impl Table {
    fn show(&self, ui: &mut Ui, shown: &[Shown<'_>]) {
        egui::Grid::new("pins").num_columns(self.columns.len() + 1).striped(true).spacing([18.0, 3.0]).show(ui, |ui| {
            ui.label("");
            // What is shown now stands first, where it is seen however many are pinned.
            let count = shown.len();
            let order = || std::iter::once(count - 1).chain(0..count - 1);
            for shown in order().map(|k| &shown[k]) {
                ui.label(RichText::new(&shown.name).strong().color(shown.color));
            }
            ui.end_row();
            for (name, cells) in &self.rows {
                ui.weak(name);
                for cell in order().filter_map(|k| cells.get(k)) {
                    // What differs from what is shown now stands out.
                    let same = cells.last() == Some(cell);
                    let text = RichText::new(cell).monospace();
                    ui.label(if same { text.weak() } else { text.strong() });
                }
                ui.end_row();
            }
        });
    }

    /// The table with tabs between columns.
    fn text(&self) -> String {
        let mut text = format!("\t{}\n", self.columns.join("\t"));
        for (name, cells) in &self.rows {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name}\t{}", cells.join("\t"));
        }
        text
    }
}
