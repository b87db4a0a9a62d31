//! The questions that a base and a mass leave open, each answer with the error that it would buy.

use egui::{Align, Button, Layout, RichText, Ui, vec2};

use super::context::PanelContext;
use crate::app::questions::{Bought, replies};
use crate::app::theme::{self, ROW};
use crate::app::widgets::card;
use sindyscope_values::format::units::format_si;

/// Share of the error that an answer must save to be worth a question.
const WORTH: f64 = 0.05;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let kind = context.edit.settings.kind;
    let replies = replies(&context.data.layout(kind), &context.data.units(kind));
    let Some(outcome) = &context.data.outcome else { return };
    if replies.is_empty() || !context.edit.settings.known.is_empty() {
        return;
    }
    let now = outcome.test.or(outcome.train).map(|s| s.rmse).filter(|r| r.is_finite());
    let least = context.bought.iter().flatten().map(|s| s.rmse).fold(f64::INFINITY, f64::min);
    if !least.is_finite() || now.is_some_and(|rmse| least > (1.0 - WORTH) * rmse) {
        return;
    }
    let dark = ui.visuals().dark_mode;
    let (accents, unit) = (theme::accents(dark), context.data.unit().to_owned());
    let error = if outcome.test.is_some() { "held-out error" } else { "fitted error" };
    let was = now.map_or_else(|| "diverged".to_owned(), |rmse| format_si(rmse, &unit, 3));
    card(ui, accents.accent, |ui| {
        ui.add(egui::Label::new(RichText::new("What is known of base and mass?").strong()).wrap());
        let text = format!("The {error} is {was}; with the answer it would be as said beside it.");
        ui.add(egui::Label::new(RichText::new(text).weak().size(12.0)).wrap());
        for (k, reply) in replies.into_iter().enumerate() {
            let size = vec2(ui.available_width(), ROW);
            ui.allocate_ui_with_layout(size, Layout::right_to_left(Align::Center), |ui| {
                let bought = context.bought.get(k).map_or_else(String::new, |b| told(b, &unit));
                let best = context.bought.get(k).and_then(|b| b.as_ref()).is_some_and(|s| s.rmse <= 1.001 * least);
                let color = if best { accents.good } else { ui.visuals().text_color() };
                ui.label(RichText::new(bought).monospace().size(12.0).color(color));
                ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                    let hint = format!("{}; it is fitted at once, and undo takes it back", reply.hint);
                    if ui.add(Button::new(reply.label).truncate()).on_hover_text(hint).clicked() {
                        context.edit.settings.known = reply.known;
                    }
                });
            });
        }
    });
}

fn told(bought: &Bought, unit: &str) -> String {
    bought.as_ref().map_or_else(|| "diverges".to_owned(), |s| format_si(s.rmse, unit, 3))
}
