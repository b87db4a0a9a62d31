//! The error on what was not fitted over the number of terms.

use crate::app::plot::palette::Painted as _;
use egui::{Id, Stroke, Ui, WidgetInfo};
use egui_plot::{GridInput, GridMark, Line, Plot, PlotPoints, Points};

use super::map::{self, Marker, Quantity};
use super::panel::{self, AXIS_WIDTH};
use super::scene::Scene;
use super::{Picture, Request, View, ViewState, legend};
use crate::app::plot::{axis, palette};
use sindyscope_core::study::{GridCell, GridPoint, SettingsGrid};
use sindyscope_report::palette::Ink;

const ID: &str = "front";

/// Distance within which the pointer finds a setting, points.
const REACH: f32 = 14.0;

pub(super) fn show(ui: &mut Ui, scene: &Scene<'_>, picture: &Picture<'_>, state: &mut ViewState) -> Option<Request> {
    let Some(map) = picture.search.map else {
        legend::note(ui, picture.search.failure.unwrap_or("Computing the map…"));
        return None;
    };
    legend::reading(
        ui,
        "Each point is a setting, the line joins the best for each number of terms: past its bend further terms buy \
         nothing. A click takes the setting over.",
    );
    let gone = map::signs(ui, map, state.printing);
    let points = points(map);
    let front: Vec<[f64; 2]> = map.front().into_iter().filter_map(|place| point(map, place)).collect();
    let now = map.place_of(&scene.outcome.settings).and_then(|place| dot(map.nearest(place)?));
    let (least, most) =
        points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p.1[1]), b.max(p.1[1])));
    let terms = points.iter().map(|p| p.1[0]).fold(1.0, f64::max);
    let id = Id::unique(("view", View::Front, ID));
    let must_fit = state.cache.must_fit(View::Front, ID);
    let label = format!("{} (share of the motion)", Quantity::Error.label(map.judge));
    let response = Plot::new(ID)
        .id(id)
        .height(ui.available_height())
        .y_axis_min_width(AXIS_WIDTH)
        .x_axis_label("number of terms")
        .y_axis_label(label)
        .x_axis_formatter(|mark, _| format!("{:.0}", mark.value))
        .y_axis_formatter(
            |mark, _| if mark.step_size < 1.0 { String::new() } else { map::percent(10f64.powf(mark.value)) },
        )
        .x_grid_spacer(whole_marks)
        .y_grid_spacer(axis::decade_marks)
        .grid_color(palette::grid(scene.dark))
        .grid_fade(0.3)
        .default_x_bounds(-0.5, terms + 0.5)
        .default_y_bounds(least - 0.15, most.max(least + 0.5) + 0.15)
        .show_x(false)
        .show_y(false)
        .allow_scroll(false)
        .show(ui, |plot| {
            if must_fit {
                plot.set_auto_bounds(true);
            }
            let all: Vec<[f64; 2]> = points.iter().map(|p| p.1).collect();
            let faint = scene.color(Ink::Measured).gamma_multiply(0.55);
            plot.points(Points::new("", all).radius(2.2).color(faint).allow_hover(false));
            let strong = Ink::Identified.color(scene.dark);
            plot.line(
                Line::new("", PlotPoints::from(front.clone())).stroke(Stroke::new(1.6, strong)).allow_hover(false),
            );
            plot.points(Points::new("", front).radius(4.0).color(strong).allow_hover(false));
        });
    let plot = &response.response;
    plot.widget_info(|| WidgetInfo::labeled(egui::Role::Canvas, true, "Error over the number of terms"));
    let frame = *response.transform.frame();
    let position = |p: [f64; 2]| response.transform.position_from_point(&p.into());
    let signs = [
        (map.best.and_then(|p| point(map, p)), Marker::Best),
        (map.parsimonious.and_then(|p| point(map, p)), Marker::Parsimonious),
        (now, Marker::Now),
    ];
    for (at, sign) in signs {
        if let Some(at) = at.map(position).filter(|at| frame.contains(*at)) {
            map::mark(ui, at, sign);
        }
    }
    let mut asked = None;
    if plot.double_clicked() {
        state.cache.fit_all();
        ui.ctx().request_repaint();
    }
    if let Some(pointer) = plot.hover_pos().filter(|_| !plot.dragged() && !state.printing) {
        let distance = |p: &&(GridPoint, [f64; 2])| position(p.1).distance(pointer);
        let near = points.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).filter(|p| distance(p) < REACH);
        if let Some((place, _)) = near {
            if plot.clicked() {
                asked = Some(map::take(map, *place));
            }
            map::tooltip(plot, map, *place);
        }
    }
    gone.or(asked).or(panel::menu(&response.response, state, || map::table(map)))
}

/// Marks at whole numbers.
fn whole_marks(input: GridInput) -> Vec<GridMark> {
    let ((low, high), base) = (input.bounds, input.base_step_size);
    let step = (6.0 * base).ceil().max(1.0);
    let marks = axis::round_marks(step / base)(input);
    // Labels of ten grid steps' distance are drawn; one digit needs less room.
    let bears_label = |m: GridMark| GridMark { step_size: m.step_size.max(10.0 * base), ..m };
    marks.into_iter().filter(|m| m.value.fract() == 0.0 && (low..=high).contains(&m.value)).map(bears_label).collect()
}

/// Every setting that did not fail, with its terms and log₁₀ of its error.
fn points(map: &SettingsGrid) -> Vec<(GridPoint, [f64; 2])> {
    map.known().filter_map(|(place, _)| Some((place, point(map, place)?))).collect()
}

fn point(map: &SettingsGrid, place: GridPoint) -> Option<[f64; 2]> {
    dot(map.cell(place)?)
}

/// A cell's terms and log₁₀ of its error, unless it failed.
fn dot(cell: &GridCell) -> Option<[f64; 2]> {
    (cell.failed == 0.0 && cell.error > 0.0).then(|| [cell.terms as f64, cell.error.log10()])
}
