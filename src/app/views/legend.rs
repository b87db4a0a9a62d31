//! Legends: a line above each plot, so that they never cover data. A click switches a curve, Alt-click shows it alone.

use crate::app::plot::palette::Painted as _;
use std::collections::BTreeSet;

use egui::{Align2, Role, Sense, Stroke, TextStyle, Ui, Vec2, WidgetInfo, pos2, vec2};
use egui_plot::LineStyle;

use super::scene::Scene;
use crate::app::plot::palette::Ink;

/// Height of a legend, points; kept whether or not there is an entry, so that nothing jumps.
pub(super) const HEIGHT: f32 = 20.0;

/// Length of the piece of line that stands for a curve.
const SAMPLE: f32 = 24.0;

pub(super) struct Entry<'a> {
    pub(super) ink: Ink,
    pub(super) name: &'a str,
}

/// Draws entries from left to right.
pub(super) fn entries(
    ui: &mut Ui,
    scene: &Scene<'_>,
    entries: &[Entry<'_>],
    hidden: &mut BTreeSet<Ink>,
    printing: bool,
) {
    for entry in entries {
        let on = !hidden.contains(&entry.ink);
        if printing && !on {
            continue;
        }
        let response = one(ui, scene, entry, on);
        if printing || !response.clicked() {
            continue;
        }
        let others: Vec<Ink> = entries.iter().map(|e| e.ink).filter(|i| *i != entry.ink).collect();
        if ui.input(|i| i.modifiers.alt) {
            let alone = on && others.iter().all(|i| hidden.contains(i));
            hidden.remove(&entry.ink);
            for ink in others {
                if alone {
                    hidden.remove(&ink);
                } else {
                    hidden.insert(ink);
                }
            }
        } else if on {
            hidden.insert(entry.ink);
        } else {
            hidden.remove(&entry.ink);
        }
    }
}

fn one(ui: &mut Ui, scene: &Scene<'_>, entry: &Entry<'_>, on: bool) -> egui::Response {
    let font = TextStyle::Body.resolve(ui.style());
    let text_color = if on { ui.visuals().text_color() } else { ui.visuals().weak_text_color() };
    let galley = ui.painter().layout_no_wrap(entry.name.to_owned(), font, text_color);
    let gap = 6.0;
    let size = vec2(SAMPLE + gap + galley.size().x + 8.0, HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    response.widget_info(|| WidgetInfo::selected(Role::CheckBox, ui.is_enabled(), on, entry.name));
    let painter = ui.painter();
    if response.hovered() || response.has_focus() {
        painter.rect_filled(rect, 3.0, ui.visuals().widgets.hovered.weak_bg_fill);
    }
    let y = rect.center().y;
    let ends = [pos2(rect.left() + 2.0, y), pos2(rect.left() + 2.0 + SAMPLE, y)];
    let color = scene.color(entry.ink).gamma_multiply(if on { 1.0 } else { 0.35 });
    let stroke = Stroke::new(entry.ink.width().max(1.2), color);
    match entry.ink.style() {
        LineStyle::Dashed { length } => {
            painter.extend(egui::Shape::dashed_line(&ends, stroke, length.min(6.0), 3.5));
        }
        _ => {
            painter.line_segment(ends, stroke);
        }
    }
    let at = pos2(ends[1].x + gap, y - galley.size().y / 2.0);
    painter.galley(at, galley, text_color);
    response.on_hover_text("Click to hide or show, Alt-click to show alone")
}

/// The shade of a stretch of time, to be named beside it.
pub(super) fn swatch(ui: &mut Ui, tint: egui::Color32) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(16.0, 11.0), Sense::hover());
    let frame = Stroke::new(1.0, tint.gamma_multiply(4.0));
    ui.painter().rect(rect, 1.0, tint, frame, egui::StrokeKind::Inside);
    response
}

/// How a view is to be read, in one sentence above it.
pub(super) fn reading(ui: &mut Ui, text: &str) {
    ui.add(egui::Label::new(egui::RichText::new(text).weak().size(12.0)).wrap());
    ui.add_space(2.0);
}

/// A sentence in the middle of an empty view.
pub(super) fn note(ui: &mut Ui, text: &str) {
    ui.centered_and_justified(|ui| ui.weak(text));
}

/// A small label on a plot, on a ground of its own so that it reads over curves.
pub(super) fn tag(
    painter: &egui::Painter,
    ui: &Ui,
    anchor: Align2,
    at: egui::Pos2,
    text: &str,
    color: egui::Color32,
    ground: egui::Color32,
) {
    let mut font = TextStyle::Body.resolve(ui.style());
    font.size *= 0.85;
    let galley = painter.layout_no_wrap(text.to_owned(), font, color);
    let rect = anchor.anchor_size(at, galley.size() + Vec2::new(6.0, 2.0));
    painter.rect_filled(rect, 2.0, ground.gamma_multiply(0.8));
    painter.galley(rect.min + vec2(3.0, 1.0), galley, color);
}
