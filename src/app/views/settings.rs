//! What a person does in the views of settings: click a setting, walk over the map by the keyboard.

use egui::{Key, Sense, Ui, vec2};
use egui_plot::PlotPoint;

use super::picture::{Picture, ViewAct};
use crate::app::plot::painter::ShownPanel;
use crate::app::plot::{legend, pointer};
use sindyscope_core::study::{SettingsGrid, SettingsGridPoint};
use sindyscope_report::figure::MarkerShape;
use sindyscope_report::view::{PARSIMONIOUS_SIGN, Scene, View, front_point};

/// Distance within which the pointer finds a setting, points.
const REACH: f32 = 14.0;

/// What a view's plots are to those who hear the window.
pub(super) fn name(view: View) -> String {
    match view {
        View::Map => "Map of segment length and threshold".into(),
        View::Path => "Coefficients along the threshold".into(),
        View::Front => "Error over the number of terms".into(),
        _ => format!("Plot of {}", view.label()),
    }
}

/// What the signs on the map mean, and buttons that go there.
pub(super) fn signs(ui: &mut Ui, map: &SettingsGrid) -> Option<ViewAct> {
    let mut asked = None;
    ui.horizontal(|ui| {
        for (sign, text, place) in [
            (MarkerShape::Circle, "now", None),
            (MarkerShape::Cross, "smallest error", map.best),
            (PARSIMONIOUS_SIGN, "fewest terms within one standard error of it", map.parsimonious),
        ] {
            if sign != MarkerShape::Circle {
                ui.add_space(10.0);
            }
            let (rect, _) = ui.allocate_exact_size(vec2(20.0, legend::HEIGHT), Sense::hover());
            legend::sign(ui.painter(), rect.center(), sign);
            let Some(place) = place else {
                ui.label(text);
                continue;
            };
            let button = egui::Button::new(text).frame_when_inactive(false).min_size(vec2(0.0, legend::HEIGHT));
            if ui.add(button).on_hover_text("Take this setting over").clicked() {
                asked = Some(take(map, place));
            }
        }
    });
    asked
}

/// What a place of the map asks for.
fn take(map: &SettingsGrid, (window, threshold): SettingsGridPoint) -> ViewAct {
    ViewAct::Set { window: Some(map.windows[window]), threshold: map.thresholds[threshold] }
}

/// Takes a setting over that is clicked, or that the arrow keys lead to.
pub(super) fn interact(
    ui: &Ui,
    view: View,
    scene: &Scene<'_>,
    picture: &Picture<'_>,
    shown: &[ShownPanel<'_>],
) -> Option<ViewAct> {
    let ShownPanel { plot, .. } = shown.first()?;
    let response = &plot.response;
    let clicked = response.interact_pointer_pos().filter(|_| response.clicked());
    let at = clicked.map(|p| plot.transform.value_from_position(p));
    match (view, picture.search.map) {
        (View::Path, _) => {
            let [low, high] = [plot.transform.bounds().min()[0], plot.transform.bounds().max()[0]];
            let x = at?.x.clamp(low, high);
            let threshold: f64 = format!("{:.2e}", 10f64.powf(x)).parse().ok()?;
            Some(ViewAct::Set { window: None, threshold })
        }
        (View::Front, Some(map)) => {
            let pointer = response.hover_pos().filter(|_| !response.dragged())?;
            let (place, remark) = nearest(map, &plot.transform, pointer, shown)?;
            pointer::tooltip(response).show(|ui| ui.monospace(remark));
            clicked.map(|_| take(map, place))
        }
        (View::Map, Some(map)) => {
            if response.clicked() {
                response.request_focus();
            }
            let (columns, rows) = (map.thresholds.len(), map.windows.len());
            let within = |v: f64, count: usize| (v >= 0.0 && v < count as f64).then_some(v as usize);
            let there = at.and_then(|p| Some((within(p.y, rows)?, within(p.x, columns)?)));
            there.map(|place| take(map, place)).or_else(|| by_keys(ui, scene, map, response))
        }
        _ => None,
    }
}

/// The setting of the front's view that lies nearest to the pointer, and what is known of it.
fn nearest(
    map: &SettingsGrid,
    transform: &egui_plot::PlotTransform,
    pointer: egui::Pos2,
    shown: &[ShownPanel<'_>],
) -> Option<(SettingsGridPoint, String)> {
    let axis = &shown.first()?.panel.y;
    let position =
        |[x, y]: [f64; 2]| transform.position_from_point(&PlotPoint::new(x, axis.coordinate(y))).distance(pointer);
    let all = map.known().filter_map(|(place, cell)| Some((place, position(front_point(cell)?))));
    let (place, distance) = all.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (distance < REACH).then(|| (place, sindyscope_report::view::setting_remark(map, place)))
}

fn by_keys(ui: &Ui, scene: &Scene<'_>, map: &SettingsGrid, response: &egui::Response) -> Option<ViewAct> {
    if !response.has_focus() {
        return None;
    }
    let stroke = ui.visuals().selection.stroke;
    ui.painter().rect_stroke(response.rect.expand(1.0), 0.0, stroke, egui::StrokeKind::Outside);
    let filter = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
    ui.memory_mut(|m| m.set_focus_lock_filter(response.id, filter));
    let (window, threshold) = map.place_of(&scene.outcome.settings)?;
    let pressed = |key| ui.input_mut(|i| i.consume_key(egui::Modifiers::NONE, key));
    let step = |at: usize, by: isize, count: usize| at.saturating_add_signed(by).min(count - 1);
    [(Key::ArrowUp, 1, 0), (Key::ArrowDown, -1, 0), (Key::ArrowRight, 0, 1), (Key::ArrowLeft, 0, -1)]
        .into_iter()
        .filter(|(key, ..)| pressed(*key))
        .map(|(_, up, right)| (step(window, up, map.windows.len()), step(threshold, right, map.thresholds.len())))
        .map(|place| take(map, place))
        .next_back()
}
