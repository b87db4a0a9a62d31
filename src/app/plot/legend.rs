//! Legends: a line above each plot, so that they never cover data. A click switches a curve, Alt-click shows it alone.

use egui::{Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Role, Sense, Stroke, TextStyle, Ui};
use egui::{Vec2, WidgetInfo, pos2, vec2};

use super::look::Look;
use super::palette;
use crate::app::widgets;
use sindyscope_report::figure::{Cells, KeyMark, LayerRole, LegendEntry, MarkerShape, Panel};
use sindyscope_values::format::shown::ShownUnits;

/// Height of a legend, points; kept whether or not there is an entry, so that nothing jumps.
pub(crate) const HEIGHT: f32 = 20.0;

/// Length of the piece of line that stands for a curve.
const SAMPLE: f32 = 24.0;

/// Between it and the curve's name, points.
const GAP: f32 = 6.0;

/// A line of a legend's height, its contents from `left` on.
pub(crate) fn line(ui: &mut Ui, left: f32, contents: impl FnOnce(&mut Ui)) {
    widgets::line(ui, HEIGHT, |ui| {
        ui.add_space(left);
        contents(ui);
    });
}

/// Width of a shade beside its name, points.
pub(super) const SWATCH: f32 = 16.0;

/// Width of these words in a line, points.
pub(super) fn text_width(ui: &Ui, text: &str) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().layout_no_wrap(text.to_owned(), font, Color32::PLACEHOLDER).size().x
}

/// Width of an entry with this name, points.
fn entry_width(text: f32) -> f32 {
    SAMPLE + GAP + text + 8.0
}

/// Room kept for the curves of before a change while a panel has none to show: what stands at the right must not change its words
/// whenever a slider is moved.
pub(super) fn to_come(ui: &Ui, panel: &Panel) -> f32 {
    let absent = panel.layers.iter().filter(|layer| layer.part == LayerRole::Ghost && layer.is_empty());
    absent.map(|layer| entry_width(text_width(ui, &layer.name)) + ui.spacing().item_spacing.x).sum()
}

/// Draws entries from left to right; a click switches an ink where inks can be.
pub(super) fn entries(ui: &mut Ui, keys: &[LegendEntry], look: &mut Look<'_>) {
    let switched = look.hidden.is_some();
    for key in keys {
        // In little room without its value, which stands in the right column too.
        let name = match key.name.split_once(|c: char| c.is_ascii_digit()) {
            Some((words, _)) if ui.available_width() < 150.0 => words.trim_end(),
            _ => &key.name,
        };
        let on = look.shows(key.ink);
        if !entry(ui, key, name, (look.color(key.ink, ui.visuals().dark_mode), on, switched)) {
            continue;
        }
        let alt = ui.input(|i| i.modifiers.alt);
        let Some(hidden) = look.hidden.as_deref_mut() else { continue };
        let others = || keys.iter().map(|k| k.ink).filter(|ink| *ink != key.ink);
        if alt {
            let alone = on && others().all(|ink| hidden.contains(&ink));
            hidden.remove(&key.ink);
            for ink in others() {
                if alone {
                    hidden.remove(&ink);
                } else {
                    hidden.insert(ink);
                }
            }
        } else if on {
            hidden.insert(key.ink);
        } else {
            hidden.remove(&key.ink);
        }
    }
}

/// One entry; true if it was clicked.
fn entry(ui: &mut Ui, key: &LegendEntry, name: &str, (color, on, switched): (Color32, bool, bool)) -> bool {
    let font = TextStyle::Body.resolve(ui.style());
    let text_color = if on { ui.visuals().text_color() } else { ui.visuals().weak_text_color() };
    let galley = ui.painter().layout_no_wrap(name.to_owned(), font, text_color);
    let size = vec2(entry_width(galley.size().x), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, if switched { Sense::click() } else { Sense::hover() });
    let painter = ui.painter();
    if switched && (response.hovered() || response.has_focus()) {
        painter.rect_filled(rect, 3.0, ui.visuals().widgets.hovered.weak_bg_fill);
    }
    let y = rect.center().y;
    let ends = [pos2(rect.left() + 2.0, y), pos2(rect.left() + 2.0 + SAMPLE, y)];
    let color = color.gamma_multiply(if on { 1.0 } else { 0.35 });
    let stroke = Stroke::new(key.ink.width().max(1.2), color);
    match (key.mark, key.ink.dash()) {
        (KeyMark::Line, Some(length)) => {
            painter.extend(egui::Shape::dashed_line(&ends, stroke, length.min(6.0), 3.5));
        }
        (KeyMark::Line, None) => {
            painter.line_segment(ends, stroke);
        }
        (KeyMark::Dot, _) => {
            painter.circle_filled(ends[0].lerp(ends[1], 0.5), 3.0, color);
        }
        (KeyMark::Patch, _) => {
            let patch = Rect::from_center_size(ends[0].lerp(ends[1], 0.5), vec2(16.0, 10.0));
            painter.rect_filled(patch, 1.0, color.gamma_multiply(0.4));
        }
    }
    let at = pos2(ends[1].x + GAP, y - galley.size().y / 2.0);
    painter.galley(at, galley, text_color);
    if !switched {
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, name));
        return false;
    }
    response.widget_info(|| WidgetInfo::selected(Role::CheckBox, ui.is_enabled(), on, name));
    response.on_hover_text("Click to hide or show, Alt-click to show alone").clicked()
}

/// The shade of a stretch of time, to be named beside it.
pub(crate) fn swatch(ui: &mut Ui, tint: Color32) -> egui::Response {
    let (rect, response) = ui.allocate_exact_size(vec2(SWATCH, 11.0), Sense::hover());
    let frame = Stroke::new(1.0, tint.gamma_multiply(4.0));
    ui.painter().rect(rect, 1.0, tint, frame, egui::StrokeKind::Inside);
    response
}

/// How a view is to be read, in one sentence above it.
pub(crate) fn reading(ui: &mut Ui, text: &str) {
    ui.add(egui::Label::new(egui::RichText::new(text).weak().size(12.0)).wrap());
    ui.add_space(2.0);
}

/// A sentence in the middle of an empty view.
pub(crate) fn note(ui: &mut Ui, text: &str) {
    ui.centered_and_justified(|ui| ui.weak(text));
}

/// A small label on a plot, on a ground of its own so that it reads over curves.
pub(super) fn tag(painter: &Painter, ui: &Ui, anchor: Align2, at: Pos2, text: &str, color: Color32, ground: Color32) {
    let mut font = TextStyle::Body.resolve(ui.style());
    font.size *= 0.85;
    let galley = painter.layout_no_wrap(text.to_owned(), font, color);
    let rect = anchor.anchor_size(at, galley.size() + Vec2::new(6.0, 2.0));
    painter.rect_filled(rect, 2.0, ground.gamma_multiply(0.8));
    painter.galley(rect.min + vec2(3.0, 1.0), galley, color);
}

/// Draws a sign: white with a dark edge, so that it shows on every colour.
pub(crate) fn sign(painter: &Painter, at: Pos2, sign: MarkerShape) {
    let (dark, light) = (Stroke::new(4.0, Color32::BLACK), Stroke::new(2.0, Color32::WHITE));
    for stroke in [dark, light] {
        match sign {
            MarkerShape::Circle => {
                painter.circle_stroke(at, 7.0, stroke);
            }
            MarkerShape::Cross => {
                painter.line_segment([at - vec2(5.0, 5.0), at + vec2(5.0, 5.0)], stroke);
                painter.line_segment([at - vec2(5.0, -5.0), at + vec2(5.0, -5.0)], stroke);
            }
            MarkerShape::Diamond => {
                let corners = [vec2(0.0, -9.0), vec2(9.0, 0.0), vec2(0.0, 9.0), vec2(-9.0, 0.0)];
                painter.add(egui::Shape::closed_line(corners.map(|c| at + c).to_vec(), stroke));
            }
        }
    }
}

/// The colours of cells from a frame's right edge on, from and to, and how far their values stand from them, points.
const BAR: (f32, f32) = (10.0, 22.0);
const BESIDE: f32 = 4.0;
/// Least room for the colours and their values, points: plots beneath each other end alike.
const COLOURS: f32 = 74.0;

/// Letters of the values beside colours.
fn of_colours() -> FontId {
    FontId::proportional(11.0)
}

/// The width that the colours of cells take with their values, points.
pub(super) fn colours_width(ui: &Ui, cells: &Cells, units: &ShownUnits) -> f32 {
    let width = |text: String| ui.painter().layout_no_wrap(text, of_colours(), Color32::PLACEHOLDER).size().x;
    let widest = cells.marks(units).into_iter().map(|(_, text)| width(text)).fold(0.0, f32::max);
    (BAR.1 + BESIDE + widest).max(COLOURS)
}

/// The colours of cells with their values, right of a frame.
pub(super) fn colours(ui: &Ui, frame: Rect, cells: &Cells, units: &ShownUnits) {
    const PIECES: usize = 48;
    let dark = ui.visuals().dark_mode;
    let bar =
        Rect::from_min_max(pos2(frame.right() + BAR.0, frame.top() + 2.0), pos2(frame.right() + BAR.1, frame.bottom()));
    let mut mesh = Mesh::default();
    let y = |share: f64| bar.bottom() - bar.height() * share as f32;
    for k in 0..PIECES {
        let (from, to) = (k as f64 / PIECES as f64, (k + 1) as f64 / PIECES as f64);
        let color = palette::rgb(cells.rgb(0.5 * (from + to), dark));
        mesh.add_colored_rect(Rect::from_x_y_ranges(bar.x_range(), y(to)..=y(from)), color);
    }
    let painter = ui.painter();
    painter.add(mesh);
    painter.rect_stroke(bar, 0.0, Stroke::new(1.0, palette::cursor(dark)), egui::StrokeKind::Outside);
    let (font, color) = (of_colours(), ui.visuals().text_color());
    for (share, text) in cells.marks(units) {
        let anchor = match share {
            s if s < 0.05 => Align2::LEFT_BOTTOM,
            s if s > 0.95 => Align2::LEFT_TOP,
            _ => Align2::LEFT_CENTER,
        };
        painter.text(pos2(bar.right() + BESIDE, y(share)), anchor, text, font.clone(), color);
    }
}
