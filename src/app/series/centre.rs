//! The centre: the parameters over the series, and the record at the pointer.

use std::sync::Arc;

use egui::{Context, CursorIcon, Label, Pos2, Ui, pos2};

use super::act::{SeriesAct, SeriesAsk};
use super::room::{OpenSeries, SeriesRoom};
use crate::app::figure_panel::FigureLook;
use crate::app::plot::display;
use crate::app::plot::figures::{FigurePlace, Figures};
use crate::app::plot::painter::{ShownPanel, Wish};
use crate::app::theme;
use crate::app::widgets::card;
use sindyscope_analysis::series::{ParameterSeries, Series, SeriesPoint};
use sindyscope_values::format::number::{format_measured, significant_trimmed};

/// Distance within which the pointer is at a record, points.
const NEAR: f32 = 9.0;

/// Draws the figure in all the room there is; a click on a record asks for its file.
pub(crate) fn show(ui: &mut Ui, room: &SeriesRoom, only: Option<&str>, canvas: &mut Figures) -> Option<SeriesAsk> {
    if let Some(failure) = room.failure() {
        ui.add_space(4.0);
        let wrong = theme::accents(ui.visuals().dark_mode).wrong;
        card(ui, wrong, |ui| {
            ui.add(Label::new(failure).wrap());
        });
    }
    let Some(open) = room.found() else {
        let text = if room.is_running() { "reading the table…" } else { "There is no series to show." };
        ui.centered_and_justified(|ui| ui.weak(text));
        return None;
    };
    let key = (Arc::as_ptr(open) as usize, only);
    let figure = canvas.get("series", key, || Some(open.series.figure(only)))?;
    let painted = canvas.draw(ui, &figure, &FigurePlace::new("series", "Series", key));
    let asked = painted.wish.map(|wish| match wish {
        Wish::Table(text) => SeriesAsk::SaveTable(text),
        Wish::Picture => SeriesAsk::SavePicture,
    });
    let record = painted.shown.iter().find_map(|panel| at_pointer(panel, &open.series));
    let clicked = record.and_then(|(panel, parameter, point)| at_record(panel, &open.series, parameter, point));
    canvas.tidy();
    asked.or(clicked)
}

/// The record at the pointer in a panel.
fn at_pointer<'a, 'p>(
    panel: &'p ShownPanel<'_>,
    series: &'a Series,
) -> Option<(&'p ShownPanel<'p>, &'a ParameterSeries, &'a SeriesPoint)> {
    let pointer = panel.plot.response.hover_pos()?;
    let parameter = series.parameters.iter().find(|p| p.name == panel.panel.title)?;
    let place = |point: &SeriesPoint| -> Pos2 {
        let transform = &panel.plot.transform;
        pos2(transform.position_from_point_x(point.at), transform.position_from_point_y(point.value))
    };
    let distance = |point: &&SeriesPoint| place(point).distance(pointer);
    let near = parameter.points.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    (distance(&near) <= NEAR).then_some((panel, parameter, near))
}

/// Says what the record at the pointer is, why it does not fit, and what a click does.
fn at_record(
    panel: &ShownPanel<'_>,
    series: &Series,
    parameter: &ParameterSeries,
    point: &SeriesPoint,
) -> Option<SeriesAsk> {
    let response = &panel.plot.response;
    let file = series.files.get(&point.record);
    let mut text = format!(
        "{}\n{} {}: {} = {}",
        point.record,
        series.abscissa(),
        significant_trimmed(point.at, 5),
        parameter.name,
        format_measured(point.value, point.std_error)
    );
    for reason in series.reasons(&point.record) {
        text += &format!("\n{reason}");
    }
    text += match file {
        Some(_) => "\nA click opens the record",
        None => "\nIts file is not beside the table",
    };
    response.clone().on_hover_text_at_pointer(text);
    let file = file?;
    response.clone().on_hover_cursor(CursorIcon::PointingHand);
    response.clicked().then(|| SeriesAsk::Do(SeriesAct::OpenRecord(file.clone())))
}

/// The figure as SVG.
pub(crate) fn svg(ctx: &Context, open: &OpenSeries, only: Option<&str>, look: FigureLook) -> String {
    open.series.figure(only).svg(look.size, &display::chosen(ctx))
}
