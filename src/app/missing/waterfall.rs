//! The gap from stage to stage: base, each effect, and the noise beneath.

use crate::app::plot::palette::Painted as _;
use std::sync::Arc;

use egui::{Align2, Color32, FontId, Rect, Response, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

use super::stage_color;
use crate::app::plot::{display, palette};
use sindyscope_search::Stage;
use sindyscope_values::format::number::significant;

/// Widest bar, points.
const WIDEST: f32 = 46.0;
/// Size of a bar's figure.
const FIGURE: f32 = 11.0;

/// Draws held-out and fitted bars side by side for each stage on one axis from zero, and the noise as a dashed line.
pub(super) fn show(ui: &mut Ui, stages: &[&Arc<Stage>], noise: f64, unit: &str, size: egui::Vec2) -> Option<Response> {
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let dark = ui.visuals().dark_mode;
    let figures: Vec<[Option<f64>; 2]> = stages.iter().map(|s| [s.gap.test_rmse, Some(s.gap.train_rmse)]).collect();
    let largest = figures.iter().flatten().flatten().copied().filter(|v| v.is_finite()).fold(noise, f64::max);
    if largest <= 0.0 {
        return None;
    }
    let scale = display::scale(ui.ctx(), largest, unit);
    let painter = ui.painter();
    let (strong, weak) = (ui.visuals().text_color(), ui.visuals().weak_text_color());
    let area = Rect::from_min_max(rect.min + vec2(8.0, 34.0), rect.max - vec2(74.0, 34.0));
    let y = |v: f64| area.bottom() - (v / largest) as f32 * area.height();
    let title = scale.axis("RMSE");
    painter.text(rect.min, Align2::LEFT_TOP, title, FontId::proportional(11.5), strong);
    legend(ui, rect, dark);
    painter.hline(area.x_range(), area.bottom(), Stroke::new(1.0, weak));
    let line = y(noise);
    let slot = area.width() / stages.len().max(1) as f32;
    let width = (0.34 * slot).min(WIDEST);
    for (k, (stage, pair)) in stages.iter().zip(&figures).enumerate() {
        let centre = area.left() + slot * (k as f32 + 0.5);
        let color = stage_color(k, dark);
        for (side, value) in pair.iter().enumerate() {
            let Some(value) = value.filter(|v| v.is_finite()) else { continue };
            let left = if side == 0 { centre - width - 1.0 } else { centre + 1.0 };
            let bar =
                Rect::from_min_max(pos2(left, y(value).min(area.bottom() - 1.0)), pos2(left + width, area.bottom()));
            if side == 0 {
                painter.rect_filled(bar, 1.0, color);
            } else {
                painter.rect(bar, 1.0, color.gamma_multiply(0.3), Stroke::new(1.0, color), StrokeKind::Inside);
            }
            let text = significant(value * scale.factor, 3);
            // The line of the noise strikes no figure through.
            let crossed = (0.0..FIGURE + 2.0).contains(&(bar.top() - line));
            let foot = if crossed { line } else { bar.top() } - 1.0;
            painter.text(pos2(bar.center().x, foot), Align2::CENTER_BOTTOM, text, FontId::proportional(FIGURE), strong);
        }
        let name = stage.effects.last().map_or("base", |e| e.title.as_str());
        let name = if k == 0 { name.to_owned() } else { format!("+ {name}") };
        label(
            ui,
            &name,
            Rect::from_min_size(pos2(centre - 0.5 * slot, area.bottom() + 3.0), vec2(slot - 4.0, 30.0)),
            strong,
        );
    }
    let ink = palette::Ink::NoiseFloor.color(dark);
    let ends = [pos2(area.left(), line), pos2(area.right(), line)];
    painter.extend(egui::Shape::dashed_line(&ends, Stroke::new(1.2, ink), 6.0, 4.0));
    let text = format!("noise {}", significant(noise * scale.factor, 2));
    painter.text(
        pos2(area.right() + 4.0, line.min(area.bottom() - 6.0)),
        Align2::LEFT_CENTER,
        text,
        FontId::proportional(11.0),
        ink,
    );
    Some(response.on_hover_text(
        "Error of the simulated response after each effect: filled on data never fitted, outlined on the fitted records; \
         no model gets below the noise",
    ))
}

fn legend(ui: &Ui, rect: Rect, dark: bool) {
    let painter = ui.painter();
    let color = ui.visuals().text_color();
    let ink = stage_color(0, dark);
    let mut right = rect.right();
    for (name, filled) in [("fitted", false), ("not fitted", true)] {
        let text = painter.text(pos2(right, rect.top()), Align2::RIGHT_TOP, name, FontId::proportional(11.5), color);
        let square = Rect::from_min_size(pos2(text.left() - 14.0, text.center().y - 4.5), vec2(9.0, 9.0));
        if filled {
            painter.rect_filled(square, 1.0, ink);
        } else {
            painter.rect(square, 1.0, ink.gamma_multiply(0.3), Stroke::new(1.0, ink), StrokeKind::Inside);
        }
        right = square.left() - 12.0;
    }
}

/// A name in at most two lines beneath its bars.
fn label(ui: &Ui, text: &str, rect: Rect, color: Color32) {
    let mut job = egui::text::LayoutJob::simple(text.to_owned(), FontId::proportional(11.0), color, rect.width());
    job.halign = egui::Align::Center;
    job.wrap.max_rows = 2;
    let galley = ui.painter().layout_job(job);
    ui.painter().galley(rect.center_top(), galley, color);
}
