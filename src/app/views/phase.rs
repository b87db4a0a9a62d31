//! Velocity over displacement.

use egui::{Align, Id, Layout, Stroke, Ui, vec2};
use egui_plot::{Line, Plot, PlotMemory, PlotPoint, PlotPoints, Points};

use super::legend::{self, Entry};
use super::panel::{self, AXIS_WIDTH};
use super::scene::Scene;
use super::{Request, View, ViewState};
use crate::app::plot::palette::{self, Ink};
use crate::app::plot::units::Scale;
use crate::app::plot::{axis, decimate, display, export, pointer};
use sindyscope_values::term::Symbol;

const ID: &str = "phase";

/// Points of one curve that are drawn at sixty frames a second.
const MOST_POINTS: usize = 20_000;

/// One curve: abscissae and ordinates.
type Path<'a> = (Ink, &'a [f64], &'a [f64]);

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, state: &mut ViewState) -> Option<Request> {
    // A first-order state is shown over the one before it.
    let (across, up) = if scene.second_order() {
        (scene.freedom, scene.layout.freedoms + scene.freedom)
    } else {
        (scene.freedom, (scene.freedom + 1) % scene.layout.freedoms.max(1))
    };
    let paths: [Path<'_>; 2] = [
        (Ink::Measured, scene.smoothed(across), scene.smoothed(up)),
        (Ink::Identified, scene.simulated(across), scene.simulated(up)),
    ];
    let (x_name, y_name, y_unit) = if scene.second_order() {
        let (symbol, unit) = scene.rate_label();
        (scene.layout.name(Symbol::State(across)), symbol, unit)
    } else {
        let name = |i| scene.layout.name(Symbol::State(i));
        (name(across), name(up), scene.unit_of(sindyscope_values::record::Role::Displacement(up)))
    };
    let names =
        [Entry { ink: Ink::Measured, name: "measured, smoothed" }, Entry { ink: Ink::Identified, name: "identified" }];
    let size = vec2(ui.available_width(), legend::HEIGHT);
    ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.add_space(AXIS_WIDTH);
        legend::entries(ui, scene, &names, &mut state.hidden, state.printing);
    });

    let [x_range, y_range] =
        *state.cache.portrait.get_or_insert_with(|| [extent(&paths, |p| p.1), extent(&paths, |p| p.2)]);
    let largest = |(a, b): (f64, f64)| a.abs().max(b.abs());
    let x_scale = display::scale(ui.ctx(), largest(x_range), &scene.unit());
    let y_scale = display::scale(ui.ctx(), largest(y_range), &y_unit);
    let id = Id::unique(("view", View::Phase, ID));
    let must_fit = state.cache.must_fit(View::Phase, ID);
    let memory = PlotMemory::load(ui.ctx(), id);
    let (min, max) = memory
        .filter(|m| !must_fit && !m.auto_bounds.any())
        .map_or(([x_range.0, y_range.0], [x_range.1, y_range.1]), |m| (m.bounds().min(), m.bounds().max()));
    let room = ui.available_size();
    for (ink, xs, ys) in paths {
        let drawn = state.cache.drawn.entry((ID, ink)).or_default();
        let pixels = ui.ctx().pixels_per_point();
        let pixels = [f64::from(room.x * pixels), f64::from(room.y * pixels)];
        if let Some(wanted) = drawn.wanted(min, max, pixels, false) {
            let points = xs.iter().zip(ys).map(|(x, y)| PlotPoint::new(*x, *y));
            decimate::loops(points, (wanted.min, wanted.max), wanted.scale, MOST_POINTS, &mut drawn.points);
        }
    }
    let (cache, hidden) = (&state.cache, &state.hidden);
    let response = Plot::new(ID)
        .id(id)
        .height(room.y)
        .y_axis_min_width(AXIS_WIDTH)
        .x_axis_label(x_scale.axis(&x_name))
        .y_axis_label(y_scale.axis(&y_name))
        .x_axis_formatter(|mark, _| axis::linear_label(mark, &x_scale))
        .y_axis_formatter(|mark, _| axis::linear_label(mark, &y_scale))
        .x_grid_spacer(axis::round_marks(10.0))
        .y_grid_spacer(axis::round_marks(5.0))
        .grid_color(palette::grid(scene.dark))
        .grid_fade(0.0)
        .default_x_bounds(x_range.0, x_range.1)
        .default_y_bounds(y_range.0, y_range.1)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false)
        .show(ui, |plot| {
            if must_fit {
                plot.set_auto_bounds(true);
            }
            let scroll = plot.ctx().input(|i| i.smooth_scroll_delta.y);
            if scroll != 0.0 && plot.response().contains_pointer() {
                plot.zoom_bounds_around_hovered(egui::Vec2::splat((scroll / 240.0).exp()));
            }
            for (ink, xs, ys) in paths.iter().filter(|p| !hidden.contains(&p.0)) {
                if let Some(drawn) = cache.drawn.get(&(ID, *ink)) {
                    let stroke = Stroke::new(ink.width(), scene.color(*ink));
                    for run in drawn.points.split(|p| p.x.is_nan()) {
                        let line = Line::new("", PlotPoints::Borrowed(run)).stroke(stroke);
                        plot.line(line.allow_hover(false).allow_band(false));
                    }
                }
                if let (Some(x), Some(y)) = (xs.first(), ys.first()) {
                    let start = Points::new("", vec![[*x, *y]]).color(scene.color(*ink)).allow_hover(false);
                    plot.points(start.radius(ink.width() + 1.6));
                }
            }
        });
    if !state.printing {
        let axes = [Some((&*x_name, &*scene.unit())), Some((&*y_name, &*y_unit))];
        panel::choose_units(ui, response.transform.frame(), (View::Phase, ID), axes);
    }
    if response.response.double_clicked() {
        state.cache.fit_all();
        ui.ctx().request_repaint();
    }
    if let Some(pointer) = response.response.hover_pos().filter(|_| !response.response.dragged()) {
        let at = response.transform.value_from_position(pointer);
        pointer::tooltip(&response.response).show(|ui| {
            let text = format!("{x_name} {}\n{y_name} {}", x_scale.format(at.x, 4), y_scale.format(at.y, 4));
            ui.monospace(text);
        });
    }
    panel::menu(&response.response, state, || {
        let headers: Vec<String> = ["measured", "identified"]
            .iter()
            .flat_map(|which| {
                [(&x_name, scene.unit()), (&y_name, y_unit.clone())]
                    .map(|(n, u)| Scale::plain(u).axis(&format!("{n} {which}")))
            })
            .collect();
        let columns = [paths[0].1, paths[0].2, paths[1].1, paths[1].2];
        export::csv(&headers, columns.iter().map(|c| c.len()).max().unwrap_or(0), |r, c| columns[c].get(r).copied())
    })
}

/// Range of what is shown, with a margin; the measurement's, and of the identified what does not run away.
fn extent<'a>(paths: &[Path<'a>; 2], pick: impl Fn(&Path<'a>) -> &'a [f64]) -> (f64, f64) {
    let range = |values: &[f64]| {
        values
            .iter()
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)))
    };
    let (measured, identified) = (range(pick(&paths[0])), range(pick(&paths[1])));
    let (mut low, mut high) = if measured.0 <= measured.1 { measured } else { identified };
    let room = 0.5 * (high - low);
    if identified.0 <= identified.1 {
        (low, high) = (low.min(identified.0.max(low - room)), high.max(identified.1.min(high + room)));
    }
    if low.is_nan() || high.is_nan() || low > high {
        return (-1.0, 1.0);
    }
    let span = high - low;
    let margin = if span > 1e-12 * high.abs().max(low.abs()) {
        0.06 * span
    } else if high == 0.0 {
        1.0
    } else {
        0.2 * high.abs()
    };
    (low - margin, high + margin)
}
