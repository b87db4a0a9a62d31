//! The columns beside a series: what it is of and goes over on the left; trends and records that do not fit on the right.

use egui::{ComboBox, Grid, Label, Link, RichText, Ui, vec2};

use super::act::{SeriesAct, SeriesAsk};
use super::room::SeriesRoom;
use crate::app::problem::file_name;
use crate::app::purpose::ReportForm;
use crate::app::state::{SeriesForm, SeriesOver};
use crate::app::theme;
use crate::app::widgets::{card, row, section};
use sindyscope_analysis::series::{OddRecord, ParameterSeries, Series, TrendWords};

/// What stands for the order of the table.
const ORDER: &str = "order of the table";
/// What stands for every parameter.
const ALL: &str = "all";

/// Draws the left column; the form is changed by what is chosen.
pub(crate) fn controls(ui: &mut Ui, room: &SeriesRoom, form: &mut SeriesForm) -> Option<SeriesAsk> {
    let mut ask = None;
    section(
        ui,
        "SERIES",
        |_| (),
        |ui| {
            if let Some(table) = &form.table {
                let name = Label::new(RichText::new(file_name(table)).strong()).truncate();
                ui.add(name).on_hover_text(table.display().to_string());
            }
            if let Some(open) = room.found() {
                ui.label(format!("{} records", open.series.records));
                ui.add_space(4.0);
                over(ui, &open.columns, open.series.over.as_deref(), form);
                parameter(ui, &open.series, form);
            }
            ui.add_space(6.0);
            ask = buttons(ui, room);
        },
    );
    ask
}

fn over(ui: &mut Ui, columns: &[String], shown: Option<&str>, form: &mut SeriesForm) {
    row(ui, "over", "What was varied: the column of the table that the parameters are drawn over", |ui| {
        let combo = ComboBox::from_id_salt("series over").width(ui.available_width()).truncate();
        let combo = combo.selected_text(shown.unwrap_or(ORDER)).show_ui(ui, |ui| {
            if ui.selectable_label(shown.is_none(), ORDER).clicked() {
                form.over = Some(SeriesOver::Order);
            }
            for column in columns {
                if ui.selectable_label(shown == Some(column), column).clicked() {
                    form.over = Some(SeriesOver::Column(column.clone()));
                }
            }
        });
        combo.response.accessible_name("Series over");
    });
}

fn parameter(ui: &mut Ui, series: &Series, form: &mut SeriesForm) {
    row(ui, "parameter", "Show one parameter alone, or all of them", |ui| {
        let shown = form.parameter.clone();
        let combo = ComboBox::from_id_salt("series parameter").width(ui.available_width()).truncate();
        let combo = combo.selected_text(shown.as_deref().unwrap_or(ALL)).show_ui(ui, |ui| {
            if ui.selectable_label(shown.is_none(), ALL).clicked() {
                form.parameter = None;
            }
            for name in series.parameters.iter().map(|p| &p.name) {
                if ui.selectable_label(shown.as_ref() == Some(name), name).clicked() {
                    form.parameter = Some(name.clone());
                }
            }
        });
        combo.response.accessible_name("Parameter of the series");
    });
}

fn buttons(ui: &mut Ui, room: &SeriesRoom) -> Option<SeriesAsk> {
    let mut ask = None;
    let found = room.found().is_some();
    ui.horizontal_wrapped(|ui| {
        let mut button = |ui: &mut Ui, label: &str, hint: &str, enabled: bool, does: SeriesAsk| {
            if ui.add_enabled(enabled, egui::Button::new(label)).on_hover_text(hint).clicked() {
                ask = Some(does);
            }
        };
        button(ui, "Other table…", "Open another table that `sindyscope batch` wrote", true, SeriesAsk::Open);
        let hint = "Read the table again: a batch may have written it anew";
        button(ui, "Read again", hint, !room.is_running(), SeriesAsk::Do(SeriesAct::Again));
        let hint = "The figure for a paper or a slide: SVG, PDF or PNG";
        button(ui, "Save picture…", hint, found, SeriesAsk::SavePicture);
        let hint = "Figures, trends and the records that do not fit, as PDF or as a web page";
        button(ui, "Save report…", hint, found, SeriesAsk::SaveReport(ReportForm::Pdf));
        button(ui, "Close", "Go back to the records", true, SeriesAsk::Do(SeriesAct::Close));
    });
    ask
}

/// Draws the right column; a click on a record asks for its file.
pub(crate) fn findings(ui: &mut Ui, room: &SeriesRoom) -> Option<SeriesAsk> {
    let open = room.found()?;
    let series = &open.series;
    section(ui, "PARAMETERS", |_| (), |ui| parameters(ui, series));
    let mut ask = None;
    section(
        ui,
        "RECORDS THAT DO NOT FIT",
        |_| (),
        |ui| {
            for odd in &series.odd {
                ask = record(ui, series, odd).or(ask.take());
            }
        },
    );
    if series.odd.is_empty() {
        let good = theme::accents(ui.visuals().dark_mode).good;
        card(ui, good, |ui| {
            ui.label("Every record fits its siblings.");
        });
    }
    ui.add_space(8.0);
    ask
}

/// The table of the parameters: value, change, scatter.
fn parameters(ui: &mut Ui, series: &Series) {
    let over = series.over.as_deref().unwrap_or("record");
    Grid::new("parameters of the series").num_columns(3).spacing(vec2(12.0, 3.0)).show(ui, |ui| {
        for parameter in &series.parameters {
            parameter_rows(ui, parameter, over);
        }
    });
}

fn parameter_rows(ui: &mut Ui, parameter: &ParameterSeries, over: &str) {
    let TrendWords { level, centre, slope, scatter, chance } = match parameter.words() {
        Ok(words) => words,
        Err(why) => {
            ui.strong(&parameter.name);
            ui.label("");
            ui.weak(why);
            ui.end_row();
            return;
        }
    };
    ui.strong(&parameter.name);
    ui.monospace(level).on_hover_text(format!("Value at {over} {centre}, ± standard error"));
    ui.weak(format!("in {} records", parameter.points.len()));
    ui.end_row();
    ui.label("");
    match slope {
        Some(slope) => {
            ui.monospace(slope).on_hover_text(format!("Chance alone would make a slope as steep: p = {chance}"));
            ui.weak(format!("for 1 of {over}"));
        }
        None => {
            ui.weak("no trend");
            ui.weak(format!("p = {chance}"));
        }
    }
    ui.end_row();
    if let Some(scatter) = scatter {
        ui.label("");
        ui.monospace(scatter);
        ui.weak("scatter").on_hover_text("Standard deviation between records beyond their standard errors");
        ui.end_row();
    }
}

fn record(ui: &mut Ui, series: &Series, odd: &OddRecord) -> Option<SeriesAsk> {
    let mut ask = None;
    let caution = theme::accents(ui.visuals().dark_mode).caution;
    card(ui, caution, |ui| {
        let name = RichText::new(&odd.record).strong();
        match series.files.get(&odd.record) {
            Some(file) => {
                let hint = format!("Open {}", file.display());
                if ui.add(Link::new(name)).on_hover_text(hint).clicked() {
                    ask = Some(SeriesAsk::Do(SeriesAct::OpenRecord(file.clone())));
                }
            }
            None => drop(ui.label(name).on_hover_text("Its file is not beside the table")),
        }
        for reason in &odd.reasons {
            ui.add(Label::new(reason).wrap());
        }
    });
    ask
}
