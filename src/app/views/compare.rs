//! The table of pinned settings, and the buttons that pin them.

use std::fmt::Write as _;
use std::sync::Arc;

use egui::{Color32, RichText, ScrollArea, Ui};

use super::picture::{Picture, ViewAct};
use crate::app::plot::palette::{Ink, Painted as _};
use crate::app::plot::{number, units};
use sindyscope_core::study::{Outcome, Score};
use sindyscope_report::view::{MOST_PINS, Scene, pin_letter};
use sindyscope_values::term::{Symbol, Term};

/// Height of a row of the table, points.
const ROW: f32 = 26.0;

/// An outcome with its name and colour.
struct Pinned<'a> {
    name: String,
    outcome: &'a Arc<Outcome>,
    color: Color32,
}

fn shown<'a>(picture: &Picture<'a>, dark: bool) -> Vec<Pinned<'a>> {
    let pin = |(k, outcome): (usize, &'a Arc<Outcome>)| Pinned {
        name: pin_letter(k),
        outcome,
        color: Ink::Pin(k as u8).color(dark),
    };
    let now = Pinned { name: "now".into(), outcome: picture.outcome, color: Ink::Identified.color(dark) };
    picture.pins.iter().enumerate().map(pin).chain([now]).collect()
}

/// Height that the table takes.
pub(super) fn height(ui: &Ui, scene: &Scene<'_>, picture: &Picture<'_>) -> f32 {
    let rows = table_of(scene, &shown(picture, false)).rows.len();
    (ROW * (rows + 1) as f32).min(0.42 * ui.available_height())
}

/// Draws the table.
pub(super) fn table(ui: &mut Ui, scene: &Scene<'_>, picture: &Picture<'_>, height: f32) {
    let shown = shown(picture, ui.visuals().dark_mode);
    ScrollArea::both().id_salt("table of pins").max_height(height).auto_shrink([false, false]).show(ui, |ui| {
        table_of(scene, &shown).show(ui, &shown);
    });
}

/// Buttons to pin what is shown, and to go back to what was.
pub(super) fn buttons(ui: &mut Ui, scene: &Scene<'_>, picture: &Picture<'_>) -> Option<ViewAct> {
    let shown = shown(picture, ui.visuals().dark_mode);
    let table = table_of(scene, &shown);
    let mut asked = None;
    ui.horizontal_wrapped(|ui| {
        let free = picture.pins.len() < MOST_PINS;
        let next = format!("Pin as {}", pin_letter(picture.pins.len()));
        let hint = if free { "Keep this setting, to compare others with it" } else { "Let go of one first" };
        if ui.add_enabled(free, egui::Button::new(next)).on_hover_text(hint).clicked() {
            asked = Some(ViewAct::Pin);
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
                    asked = Some(ViewAct::Return(k));
                    ui.close();
                }
                if ui.button(format!("Let go of {}", pin.name)).clicked() {
                    asked = Some(ViewAct::Unpin(k));
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

/// Figures and coefficients, one column an outcome.
struct Table {
    rows: Vec<(String, Vec<String>)>,
    columns: Vec<String>,
}

fn table_of(scene: &Scene<'_>, shown: &[Pinned<'_>]) -> Table {
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
    fn show(&self, ui: &mut Ui, shown: &[Pinned<'_>]) {
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
