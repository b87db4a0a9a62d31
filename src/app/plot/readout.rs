//! Values at the pointer.

use egui::{Color32, Stroke, Ui, pos2};

use super::look::{Look, ShownPanel};
use super::{display, palette, pointer};
use sindyscope_report::figure::{Axis, Figure, LayerRole, Panel, Shape};
use sindyscope_values::format::number;
use sindyscope_values::format::shown::ShownUnits;

/// Whether values are read along the abscissa: then each named layer has one there.
pub(super) fn reads_along(panel: &Panel) -> bool {
    panel.layers.iter().any(|layer| {
        !layer.name.is_empty()
            && match &layer.shape {
                Shape::Samples(_) => true,
                Shape::Line(points) => points.is_rising() && !panel.fixed,
                _ => false,
            }
    })
}

/// Shows what is known at the pointer: values of all panels that share the abscissa, with a line through them.
pub(super) fn show(ui: &Ui, figure: &Figure, shown: &[ShownPanel<'_>], look: &Look<'_>) {
    let pointed = shown.iter().find_map(|s| Some((s, s.plot.response.hover_pos()?)));
    let Some((at, position)) = pointed.filter(|(s, _)| !s.plot.response.dragged()) else { return };
    let units = display::chosen(ui.ctx());
    let place = at.plot.transform.value_from_position(position);
    if !reads_along(at.panel) {
        let text = [cell_text(at.panel, place.x, place.y, &units), place_text(at.panel, place.x, place.y, &units)];
        if let Some(text) = text.into_iter().flatten().next() {
            pointer::tooltip(&at.plot.response).show(|ui| ui.monospace(text));
        }
        return;
    }
    let together = |s: &&ShownPanel<'_>| {
        std::ptr::eq(s.panel, at.panel) || s.panel.x.link.is_some() && s.panel.x.link == at.panel.x.link
    };
    let panels: Vec<&ShownPanel<'_>> = shown.iter().filter(together).collect();
    let Some((abscissa, head)) = abscissa(figure, at.panel, place.x, &units) else { return };
    let dark = ui.visuals().dark_mode;
    let mut rows = vec![(at.panel.x.symbol.clone(), head, ui.visuals().text_color())];
    for ShownPanel { panel, plot } in panels {
        let frame = *plot.transform.frame();
        let painter = ui.painter().with_clip_rect(frame);
        let x = plot.transform.position_from_point_x(panel.x.coordinate(abscissa));
        painter.vline(x, frame.y_range(), Stroke::new(1.0, palette::cursor(dark)));
        let alone = panel.layers.iter().filter(|l| l.part != LayerRole::Ghost && !l.name.is_empty()).count() == 1;
        for layer in panel.layers.iter().filter(|l| look.shows(l.ink)) {
            let Some(value) = layer.value_at(abscissa) else { continue };
            let color = look.color(layer.ink, dark);
            let y = plot.transform.position_from_point_y(panel.y.coordinate(value));
            painter.circle(pos2(x, y), 3.5, color, Stroke::new(1.2, palette::ground(dark)));
            let linked = panel.x.link.is_some();
            let name = match (linked, alone) {
                (false, _) => layer.name.clone(),
                (true, true) if layer.name == panel.y.symbol => layer.name.clone(),
                (true, _) => format!("{} {}", panel.y.symbol, layer.name),
            };
            rows.push((name, value_text(&panel.y, value, &units), color));
        }
    }
    pointer::tooltip(&at.plot.response).show(|ui| table_of(ui, &rows));
}

/// The abscissa that is read, that of a sample where there are samples, and its text.
fn abscissa(figure: &Figure, panel: &Panel, coordinate: f64, units: &ShownUnits) -> Option<(f64, String)> {
    let samples = figure.panels().flat_map(|p| &p.layers).filter_map(|layer| match &layer.shape {
        Shape::Samples(samples) if panel.x.link.is_some() => Some(samples),
        _ => None,
    });
    let scale = panel.x.scale(units);
    let Some(samples) = samples.max_by_key(|s| s.values.len()) else {
        let value = panel.x.value(coordinate);
        let scale = if panel.x.logarithmic { units.scale(value, &panel.x.unit) } else { scale };
        return Some((value, scale.format(value, 4)));
    };
    let t = samples.spacing.at(samples.nearest(coordinate)?);
    let decimals = (-(samples.spacing.interval * scale.factor).log10()).ceil().clamp(0.0, 9.0) as usize;
    Some((t, format!("{} {}", number::plain(t * scale.factor, decimals), scale.unit)))
}

fn value_text(axis: &Axis, value: f64, units: &ShownUnits) -> String {
    if axis.logarithmic {
        units.scale(value.abs(), &axis.unit).format(value, 3)
    } else {
        axis.scale(units).format(value, 4)
    }
}

/// The place under the pointer.
fn place_text(panel: &Panel, x: f64, y: f64, units: &ShownUnits) -> Option<String> {
    (!panel.fixed).then(|| format!("{}\n{}", panel.x.text(x, units), panel.y.text(y, units)))
}

/// What is known of the cell under the pointer.
fn cell_text(panel: &Panel, x: f64, y: f64, units: &ShownUnits) -> Option<String> {
    let cells = panel.layers.iter().find_map(|layer| match &layer.shape {
        Shape::Cells(cells) => Some(cells),
        _ => None,
    })?;
    let found = cells.at(x, y)?;
    let value = cells.values.get(found).copied().filter(|v| v.is_finite());
    let remark = cells.remarks.get(found).map_or("", String::as_str);
    let said = match (value, matches!(cells.colours, sindyscope_report::figure::Colours::Shades(_))) {
        (_, true) => remark.to_owned(),
        (None, false) => "the motion never was here".to_owned(),
        (Some(value), false) => {
            let text = units.scale(value.abs(), &cells.unit).format(value, 3);
            format!("{} {text}\n{remark}", cells.name).trim_end().to_owned()
        }
    };
    match place_text(panel, x, y, units) {
        Some(place) => Some(format!("{place}\n{said}")),
        None => (!said.is_empty()).then_some(said),
    }
}

/// Names and values below each other, decimal points aligned.
pub(crate) fn table_of(ui: &mut Ui, rows: &[(String, String, Color32)]) {
    let values: Vec<&str> = rows.iter().map(|r| r.1.as_str()).collect();
    let values = number::align_at_point(&values);
    egui::Grid::new("values at the pointer").num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
        for ((name, _, color), value) in rows.iter().zip(values) {
            ui.colored_label(*color, name);
            ui.monospace(value);
            ui.end_row();
        }
    });
}
