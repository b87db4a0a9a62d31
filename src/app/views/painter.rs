//! Draws figures: rows of graphs with their axes, legends, values at the pointer and menus.

use crate::app::plot::palette::Painted as _;
use egui::{Align, Align2, FontId, Id, Layout, Mesh, Rect, Stroke, Ui, pos2, vec2};
use egui_plot::{Bar, BarChart, FilledArea, HLine, Line, Plot, PlotPoints, Points};

use super::figure::{Axis, Graph, Shape};
use super::legend::{self, Entry};
use super::panel::{self, AXIS_WIDTH};
use super::scene::Scene;
use super::{Request, View, ViewState};
use crate::app::plot::palette::{self, Ink};
use crate::app::plot::units::Scale;
use crate::app::plot::{axis, display, export, number, pointer};
use sindyscope_report::diagram::Cells;

/// Room for a map's colours and their values, points.
const BAR: f32 = 64.0;

/// Least height of a graph, points.
const LEAST: f32 = 70.0;

/// Graphs beside each other, and the row's share of the height.
pub(super) type Row<'a> = (&'a [usize], f32);

/// A line of names in the inks of the graphs.
pub(super) fn names(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState, entries: &[Entry<'_>]) {
    let size = vec2(ui.available_width(), legend::HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.add_space(AXIS_WIDTH);
        legend::entries(ui, scene, entries, &mut state.hidden, state.printing);
    });
}

/// Draws rows of graphs into all the room there is.
pub(super) fn rows(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    state: &mut ViewState,
    graphs: &[Graph],
    rows: &[Row<'_>],
) -> Option<Request> {
    let mut asked = None;
    let captions = rows.len() as f32 * (legend::HEIGHT + 3.0 * ui.spacing().item_spacing.y);
    let shares: f32 = rows.iter().map(|r| r.1).sum();
    let room = ui.available_height() - captions;
    for (row, share) in rows {
        let height = (room * share / shares).max(LEAST);
        let shown: Vec<&Graph> = row.iter().filter_map(|k| graphs.get(*k)).collect();
        if shown.is_empty() {
            continue;
        }
        let gap = 6.0;
        let width = (ui.available_width() - gap * (shown.len() - 1) as f32) / shown.len() as f32;
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = gap;
            for graph in shown {
                let size = vec2(width, height + legend::HEIGHT);
                ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
                    ui.set_max_width(width);
                    asked = graph_in(ui, view, scene, state, graph, height).or(asked.take());
                });
            }
        });
    }
    asked
}

fn graph_in(
    ui: &mut Ui,
    view: View,
    scene: &Scene<'_>,
    state: &mut ViewState,
    graph: &Graph,
    height: f32,
) -> Option<Request> {
    let size = vec2(ui.available_width(), legend::HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.add_space(AXIS_WIDTH);
        ui.add(egui::Label::new(egui::RichText::new(&graph.caption).size(12.5)).truncate());
    });
    let id = Id::unique(("view", view, graph.id));
    let must_fit = state.cache.must_fit(view, graph.id);
    let bar = if graph.map.is_some() { BAR } else { 0.0 };
    let hidden = &state.hidden;
    let units = display::chosen(ui.ctx());
    let scales = [graph.x.scale(&units), graph.y.scale(&units)];
    let width = ui.available_width() - bar;
    // Labels of a narrow plot stand closer.
    let apart = if width < 380.0 { 7.6 } else { 10.0 };
    let mut plot = Plot::new(graph.id)
        .id(id)
        .width(width)
        .height(height)
        .y_axis_min_width(AXIS_WIDTH)
        .x_axis_label(label(&graph.x, &scales[0]))
        .y_axis_label(label(&graph.y, &scales[1]))
        .grid_color(palette::grid(scene.dark))
        .grid_fade(if graph.x.log || graph.y.log { 0.3 } else { 0.0 })
        .default_x_bounds(graph.x.range.0, graph.x.range.1)
        .default_y_bounds(graph.y.range.0, graph.y.range.1)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false);
    plot = if graph.x.log {
        plot.x_grid_spacer(axis::decade_marks).x_axis_formatter(|mark, _| axis::decade_label(mark, &graph.x.unit))
    } else {
        plot.x_grid_spacer(axis::round_marks(apart)).x_axis_formatter(|mark, _| axis::linear_label(mark, &scales[0]))
    };
    plot = if graph.y.log {
        plot.y_grid_spacer(axis::decade_marks).y_axis_formatter(|mark, _| axis::decade_label(mark, &graph.y.unit))
    } else if graph.y.unit == "°" {
        plot.y_grid_spacer(axis::degree_marks).y_axis_formatter(|mark, _| axis::linear_label(mark, &scales[1]))
    } else {
        plot.y_grid_spacer(axis::round_marks(4.5)).y_axis_formatter(|mark, _| axis::linear_label(mark, &scales[1]))
    };
    let response = plot.show(ui, |plot| {
        if must_fit {
            plot.set_auto_bounds(true);
        }
        let scroll = plot.ctx().input(|i| i.smooth_scroll_delta.y);
        if scroll != 0.0 && plot.response().contains_pointer() {
            plot.zoom_bounds_around_hovered(egui::Vec2::splat((scroll / 240.0).exp()));
        }
        for (ink, shape) in graph.layers.iter().filter(|l| !hidden.contains(&l.0)) {
            draw(plot, scene, *ink, shape);
        }
    });
    let frame = *response.transform.frame();
    if let Some((cells, name, unit)) = &graph.map {
        let largest = cells.visited().fold(0.0_f64, |m, (.., v)| m.max(v.abs()));
        let mut mesh = Mesh::default();
        for (column, row, mean) in cells.visited() {
            let (left, right) = cells.edges(0, column);
            let (bottom, top) = cells.edges(1, row);
            let corner = |x: f64, y: f64| {
                pos2(response.transform.position_from_point_x(x), response.transform.position_from_point_y(y))
            };
            let color = palette::diverging(mean / largest, scene.dark);
            mesh.add_colored_rect(Rect::from_two_pos(corner(left, bottom), corner(right, top)), color);
        }
        ui.painter().with_clip_rect(frame).add(mesh);
        colours(ui, frame, largest, name, unit, scene.dark);
    }
    if !state.printing {
        panel::choose_units(
            ui,
            &frame,
            (view, graph.id),
            [&graph.x, &graph.y].map(|a| (!a.log).then_some((&*a.symbol, &*a.unit))),
        );
    }
    if response.response.double_clicked() {
        state.cache.fit_all();
        ui.ctx().request_repaint();
    }
    if let Some(pointer) = response.response.hover_pos().filter(|_| !response.response.dragged()) {
        let at = response.transform.value_from_position(pointer);
        pointer::tooltip(&response.response).show(|ui| {
            let mut text = format!("{}\n{}", graph.x.text(at.x, &units), graph.y.text(at.y, &units));
            if let Some((cells, name, unit)) = &graph.map {
                let mean = value_at(cells, at.x, at.y);
                text += &mean.map_or_else(
                    || "\nthe motion never was here".to_owned(),
                    |m| format!("\n{name} {}", units.scale(m.abs(), unit).format(m, 3)),
                );
            }
            ui.monospace(text);
        });
    }
    panel::menu(&response.response, state, || {
        let headers: Vec<String> = graph.columns.iter().map(|c| c.0.clone()).collect();
        let rows = graph.columns.iter().map(|c| c.1.len()).max().unwrap_or(0);
        export::csv(&headers, rows, |row, column| graph.columns[column].1.get(row).copied())
    })
}

fn label(axis: &Axis, scale: &Scale) -> String {
    if axis.log { axis.symbol.clone() } else { scale.axis(&axis.symbol) }
}

fn draw<'a>(plot: &mut egui_plot::PlotUi<'a>, scene: &Scene<'_>, ink: Ink, shape: &'a Shape) {
    let color = scene.color(ink);
    let stroke = Stroke::new(ink.width(), color);
    match shape {
        Shape::Line(points) => {
            let line = Line::new("", PlotPoints::Borrowed(points)).stroke(stroke).style(ink.style());
            plot.line(line.allow_hover(false).allow_band(false));
        }
        Shape::Dots(points) => {
            // Where many lie on each other the colour deepens.
            let faint = if points.len() > 400 { 0.45 } else { 0.8 };
            let dots = Points::new("", PlotPoints::Borrowed(points)).radius(1.5).color(color.gamma_multiply(faint));
            plot.points(dots.allow_hover(false));
        }
        Shape::Marks(points) => {
            let radius = if ink == Ink::Identified { 2.6 } else { 4.0 };
            plot.points(Points::new("", PlotPoints::Borrowed(points)).radius(radius).color(color).allow_hover(false));
        }
        Shape::Errors(errors) => {
            for [x, low, high] in errors {
                let bar = vec![[*x, *low], [*x, *high]];
                plot.line(Line::new("", bar).stroke(Stroke::new(1.2, color)).allow_hover(false));
            }
        }
        Shape::Band([x, low, high]) => {
            plot.add(FilledArea::new("", x, low, high).fill_color(color.gamma_multiply(0.25)).allow_hover(false));
        }
        Shape::Bars(edges, heights) => {
            let bar = |e: &[f64], h: f64| Bar::new(0.5 * (e[0] + e[1]), h).width(0.94 * (e[1] - e[0]));
            let fill = color.gamma_multiply(0.5);
            let bars = edges.windows(2).zip(heights).map(|(e, h)| bar(e, *h).fill(fill).stroke(Stroke::NONE)).collect();
            plot.bar_chart(BarChart::new("", bars).allow_hover(false));
        }
        Shape::Levels(levels) => {
            for level in levels {
                let line = HLine::new("", *level).stroke(stroke).style(ink.style());
                plot.hline(line.allow_hover(false));
            }
        }
    }
}

fn value_at(cells: &Cells, x: f64, y: f64) -> Option<f64> {
    let place = |axis: usize, v: f64| {
        (0..cells.count[axis]).find(|k| {
            let (low, high) = cells.edges(axis, *k);
            (low..=high).contains(&v)
        })
    };
    let (column, row) = (place(0, x)?, place(1, y)?);
    cells.mean.get(row * cells.count[0] + column).copied().filter(|m| m.is_finite())
}

/// A map's colours with their values, right of its frame.
fn colours(ui: &Ui, frame: Rect, largest: f64, name: &str, unit: &str, dark: bool) {
    const PIECES: usize = 48;
    let scale = display::scale(ui.ctx(), largest, unit);
    let bar =
        Rect::from_min_max(pos2(frame.right() + 12.0, frame.top() + 16.0), pos2(frame.right() + 24.0, frame.bottom()));
    let mut mesh = Mesh::default();
    let y = |share: f64| bar.bottom() - bar.height() * share as f32;
    for k in 0..PIECES {
        let (from, to) = (k as f64 / PIECES as f64, (k + 1) as f64 / PIECES as f64);
        let color = palette::diverging(from + to - 1.0, dark);
        mesh.add_colored_rect(Rect::from_x_y_ranges(bar.x_range(), y(to)..=y(from)), color);
    }
    let painter = ui.painter();
    painter.add(mesh);
    painter.rect_stroke(bar, 0.0, Stroke::new(1.0, palette::cursor(dark)), egui::StrokeKind::Outside);
    let (font, color) = (FontId::proportional(11.0), ui.visuals().text_color());
    for (share, anchor) in [(0.0, Align2::LEFT_BOTTOM), (0.5, Align2::LEFT_CENTER), (1.0, Align2::LEFT_TOP)] {
        let text = number::significant((2.0 * share - 1.0) * largest * scale.factor, 2);
        painter.text(pos2(bar.right() + 5.0, y(share)), anchor, text, font.clone(), color);
    }
    let title = if scale.unit.is_empty() { name } else { &scale.unit };
    painter.text(pos2(bar.left(), frame.top()), Align2::LEFT_TOP, title, font, color);
}
