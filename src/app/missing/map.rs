//! The missing force over displacement and velocity, and along single quantities.

use crate::app::plot::palette::Painted as _;
use egui::{Align2, Color32, FontId, Mesh, Rect, Response, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::plots::{Axes, extent};
use crate::app::plot::{display, palette};
use sindyscope_search::{Map, Profile};
use sindyscope_values::format::number::significant;

/// Scores from which a cell's mean is no chance.
const SIGNIFICANT: f64 = 3.0;
/// Room for the colour scale, points.
const BAR: f32 = 62.0;

/// Draws the map with its colour scale; where there is none, says why.
pub(super) fn show(ui: &mut Ui, map: &Map, acceleration: &str, size: egui::Vec2, why: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, "Map of the missing force"));
    let dark = ui.visuals().dark_mode;
    let (Some(x), Some(y)) = (ends(&map.columns), ends(&map.rows)) else {
        let weak = ui.visuals().weak_text_color();
        ui.painter().text(rect.center(), Align2::CENTER_CENTER, why, FontId::proportional(13.0), weak);
        return response;
    };
    let plot = Rect::from_min_max(rect.min, rect.max - vec2(BAR, 0.0));
    let axes = Axes::draw(ui, plot, (x, &map.across.0, &map.across.1), (y, &map.up.0, &map.up.1));
    let columns = map.columns.len() - 1;
    let sure = |k: usize| map.score.get(k).is_some_and(|s| s.abs() >= SIGNIFICANT);
    let most = |only_sure: bool| {
        let cells = map.mean.iter().enumerate().filter(|(k, m)| m.is_finite() && (!only_sure || sure(*k)));
        cells.map(|(_, m)| m.abs()).fold(0.0, f64::max)
    };
    let largest = if most(true) > 0.0 { most(true) } else { most(false) };
    let mut mesh = Mesh::default();
    for (k, mean) in map.mean.iter().enumerate().filter(|(_, m)| m.is_finite()) {
        let (row, column) = (k / columns, k % columns);
        let low = axes.at(map.columns[column], map.rows[row]);
        let high = axes.at(map.columns[column + 1], map.rows[row + 1]);
        let color = if sure(k) { palette::diverging(mean / largest, dark) } else { unsure(dark) };
        mesh.add_colored_rect(Rect::from_two_pos(low, high), color);
    }
    ui.painter().with_clip_rect(axes.area).add(Shape::mesh(mesh));
    bar(ui, rect, axes.area, largest, acceleration, dark);
    let Some(pointer) = response.hover_pos().filter(|p| axes.area.contains(*p)) else { return response };
    let [a, b] = axes.value(pointer);
    let cell = |edges: &[f64], v: f64| edges.windows(2).position(|e| e[0] <= v && v <= e[1]);
    let found = cell(&map.columns, a).zip(cell(&map.rows, b)).map(|(c, r)| r * columns + c);
    let text = match found.map(|k| (k, map.mean[k])).filter(|(_, m)| m.is_finite()) {
        None => "The motion never was here".to_owned(),
        Some((k, mean)) => format!(
            "Missing force {} {acceleration}\n{}",
            significant(mean, 3),
            if sure(k) {
                format!("{} times its standard error", significant(map.score[k].abs(), 2))
            } else {
                "within what chance does, or too few visits".to_owned()
            }
        ),
    };
    response.on_hover_text(text)
}

fn ends(edges: &[f64]) -> Option<(f64, f64)> {
    Some((*edges.first()?, *edges.last()?))
}

/// The colour scale at the right: its ends, zero, and what grey is.
fn bar(ui: &Ui, rect: Rect, area: Rect, largest: f64, unit: &str, dark: bool) {
    let scale = display::scale(ui.ctx(), largest, unit);
    let left = area.right() + 10.0;
    let grey = Rect::from_min_size(pos2(left, area.bottom() - 10.0), vec2(10.0, 10.0));
    let bar = Rect::from_min_max(pos2(left, area.top()), pos2(left + 10.0, grey.top() - 6.0));
    let mut mesh = Mesh::default();
    let steps = 32;
    for k in 0..steps {
        let at = |k: i32| bar.bottom() - bar.height() * k as f32 / steps as f32;
        let share = 2.0 * (f64::from(k) + 0.5) / f64::from(steps) - 1.0;
        mesh.add_colored_rect(Rect::from_x_y_ranges(bar.x_range(), at(k + 1)..=at(k)), palette::diverging(share, dark));
    }
    let painter = ui.painter();
    painter.add(mesh);
    painter.rect_filled(grey, 0.0, unsure(dark));
    let edge = Stroke::new(1.0, palette::grid(dark));
    painter.rect_stroke(bar, 0.0, edge, egui::StrokeKind::Outside);
    painter.rect_stroke(grey, 0.0, edge, egui::StrokeKind::Outside);
    let (font, color) = (FontId::proportional(10.5), ui.visuals().weak_text_color());
    let number = |v: f64| significant(v * scale.factor, 2);
    for (value, y, anchor) in [
        (largest, bar.top(), Align2::LEFT_TOP),
        (0.0, bar.center().y, Align2::LEFT_CENTER),
        (-largest, bar.bottom(), Align2::LEFT_BOTTOM),
    ] {
        painter.text(pos2(bar.right() + 4.0, y), anchor, number(value), font.clone(), color);
    }
    painter.text(pos2(grey.right() + 4.0, grey.center().y), Align2::LEFT_CENTER, "unsure", font.clone(), color);
    let name = pos2(left, rect.top());
    painter.text(name, Align2::LEFT_TOP, &scale.unit, FontId::proportional(11.5), ui.visuals().text_color());
}

fn unsure(dark: bool) -> Color32 {
    if dark { Color32::from_gray(0x50) } else { Color32::from_gray(0xC6) }
}

/// Draws the mean missing force along one quantity, with a band of two standard errors.
pub(super) fn profile(ui: &mut Ui, profile: &Profile, acceleration: &str, size: egui::Vec2, note: &str) -> Response {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Image, true, "Missing force along one quantity"));
    let dark = ui.visuals().dark_mode;
    let error = |k: usize| profile.error.get(k).copied().filter(|e| e.is_finite()).unwrap_or(0.0);
    let points = || profile.at.iter().zip(&profile.mean).enumerate().filter(|(_, (_, m))| m.is_finite());
    let x = extent(points().map(|(_, (a, _))| *a));
    let y = extent(points().flat_map(|(k, (_, m))| [m - 2.0 * error(k), m + 2.0 * error(k), 0.0]));
    let axes = Axes::draw(ui, rect, (x, &profile.axis.0, &profile.axis.1), (y, "missing force", acceleration));
    let painter = ui.painter().with_clip_rect(axes.area);
    let color = palette::Ink::Error.color(dark);
    let zero = axes.at(x.0, 0.0).y;
    painter.hline(axes.area.x_range(), zero, Stroke::new(1.0, ui.visuals().weak_text_color()));
    let mut mesh = Mesh::default();
    for (k, (a, m)) in points() {
        let (top, bottom) = (axes.at(*a, m + 2.0 * error(k)), axes.at(*a, m - 2.0 * error(k)));
        let index = mesh.vertices.len() as u32;
        mesh.colored_vertex(top, color.gamma_multiply(0.25));
        mesh.colored_vertex(bottom, color.gamma_multiply(0.25));
        if index >= 2 {
            mesh.add_triangle(index - 2, index - 1, index);
            mesh.add_triangle(index - 1, index, index + 1);
        }
    }
    painter.add(Shape::mesh(mesh));
    let line: Vec<egui::Pos2> = points().map(|(_, (a, m))| axes.at(*a, *m)).collect();
    for point in &line {
        painter.circle_filled(*point, 2.2, color);
    }
    painter.add(Shape::line(line, Stroke::new(1.5, color)));
    if !note.is_empty() {
        let at = axes.area.right_top() + vec2(-6.0, 4.0);
        painter.text(at, Align2::RIGHT_TOP, note, FontId::proportional(12.0), ui.visuals().strong_text_color());
    }
    response.on_hover_text(format!(
        "Mean missing force in bins of {}, band ± 2 standard errors; this quantity alone explains {} % of its energy",
        profile.axis.0,
        significant(100.0 * profile.share, 2)
    ))
}
