//! FIT: how good it is, and what is wrong when something is.

use egui::{Align, Layout, RichText, Ui, vec2};

use super::context::{PanelAct, PanelContext};
use crate::app::plot::display;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{Headline, card, headlines, section};
use sindyscope_core::remedy::Remedy;
use sindyscope_core::study::{Outcome, Score, Severity, Warning};
use sindyscope_values::format::number::{plain, significant};
use sindyscope_values::format::words::capitalised;
use sindyscope_values::record::Usage;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    section(ui, "FIT", |_| {}, |_| {});
    let Some(outcome) = context.data.outcome.clone() else {
        ui.weak("Nothing was fitted yet");
        return;
    };
    headline(ui, &outcome, context.data.unit());
    table(ui, &outcome, context.data.unit());
    condition(ui, &outcome);
    several(ui, context, &outcome);
}

/// A light that says whether the data tell the terms apart.
fn condition(ui: &mut Ui, outcome: &Outcome) {
    let worst = outcome.fits.iter().map(|f| f.condition).fold(1.0, f64::max);
    let layout = outcome.model.layout;
    let colors = theme::accents(ui.visuals().dark_mode);
    let (color, words) = match worst {
        c if c <= 30.0 => (colors.good, "the terms kept can be told apart"),
        c if c <= 1000.0 => (colors.caution, "the terms kept are hard to tell apart"),
        _ => (colors.wrong, "the terms kept cannot be told apart"),
    };
    let size = vec2(ui.available_width(), ROW);
    let response = ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(10.0, ROW), egui::Sense::hover());
        ui.painter().circle_filled(rect.center(), 4.0, color);
        let figure = if worst.is_finite() { significant(worst, 2) } else { "∞".into() };
        ui.add(egui::Label::new(RichText::new(format!("condition {figure}: {words}")).size(12.0)).truncate());
    });
    response.response.on_hover_ui(|ui| {
        ui.label("Condition number of the kept columns, each scaled to RMS 1: so many times may noise be magnified");
        let pairs: Vec<String> = outcome
            .fits
            .iter()
            .flat_map(|f| &f.confused)
            .take(6)
            .map(|(a, b, c)| format!("{} and {} ({})", a.pretty(&layout), b.pretty(&layout), plain(*c, 3)))
            .collect();
        if !pairs.is_empty() {
            ui.label(format!("In the whole library these have correlated errors: {}", pairs.join(", ")));
        }
    });
}

/// What is wrong or doubtful, beneath everything else: it comes and goes.
pub(super) fn warnings(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let colors = theme::accents(ui.visuals().dark_mode);
    let outcome = context.data.outcome.clone();
    let found = outcome.as_ref().map_or(&[][..], |o| &o.warnings);
    if found.is_empty() && context.data.failure.is_none() {
        return;
    }
    section(ui, "WORTH KNOWING", |_| {}, |_| {});
    if let Some(failure) = &context.data.failure {
        card(ui, colors.wrong, |ui| {
            ui.add(egui::Label::new(capitalised(failure)).wrap());
        });
    }
    for warning in found {
        show_warning(ui, warning, context.asks);
    }
}

/// The one figure: the held-out error (else the fitted one) beside the noise floor.
fn headline(ui: &mut Ui, outcome: &Outcome, unit: &str) {
    let (score, what, tooltip) = match (outcome.test, outcome.train) {
        (Some(score), _) => (
            Some(score),
            "held-out error",
            "RMSE of the simulated response on the records that were never fitted: the honest figure",
        ),
        (None, score) => (
            score,
            "fitted error",
            "RMSE of the simulated response on the fitted records; mark a record held out for an honest figure",
        ),
    };
    let colors = theme::accents(ui.visuals().dark_mode);
    let floor = outcome.noise_floor.filter(|f| *f > 0.0);
    // Error and noise are compared at a glance: in one unit, unless that makes numbers too long.
    let figures = score.map(|s| s.rmse).into_iter().chain(floor);
    let (least, most) = figures.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
    let ctx = ui.ctx().clone();
    let common = Some(display::scale(&ctx, least, unit)).filter(|scale| least > 0.0 && most * scale.factor < 1e3);
    let in_unit = |value: f64| {
        common.as_ref().map_or_else(|| display::format(&ctx, value, unit, 3), |scale| scale.format(value, 3))
    };
    let figure = score.map_or_else(|| "diverged".to_owned(), |s| in_unit(s.rmse));
    let color = match (score, floor) {
        (None, _) => colors.wrong,
        (Some(s), Some(floor)) if s.rmse <= 1.3 * floor => colors.good,
        (Some(s), _) if s.nrmse > 0.1 => colors.caution,
        _ => ui.visuals().strong_text_color(),
    };
    let floor = floor.map_or_else(|| "–".to_owned(), in_unit);
    let noise = "The measurement noise's standard deviation, estimated without a model: no model can do better";
    let weak = ui.visuals().weak_text_color();
    headlines(
        ui,
        [
            Headline { text: &figure, color, label: what, hint: tooltip },
            Headline { text: &floor, color: weak, label: "noise floor", hint: noise },
        ],
    );
}

const COLUMNS: [(&str, &str); 4] = [
    ("RMSE", "Root mean square of E(t)"),
    ("max E", "The largest error"),
    ("NRMSE", "RMSE over the record's standard deviation"),
    ("best fit", "100 (1 − ‖y−ŷ‖ / ‖y−ȳ‖)"),
];

fn table(ui: &mut Ui, outcome: &Outcome, unit: &str) {
    let first = 0.20 * ui.available_width();
    let cell = (ui.available_width() - first) / COLUMNS.len() as f32;
    let line = |ui: &mut Ui, label: &str, cells: &[String; 4], heading: bool| {
        ui.allocate_ui_with_layout(vec2(ui.available_width(), ROW - 4.0), Layout::left_to_right(Align::Center), |ui| {
            ui.spacing_mut().item_spacing.x = 0.0;
            let sized = |ui: &mut Ui, width: f32, flow: Layout, text: RichText, tooltip: &str| {
                ui.allocate_ui_with_layout(vec2(width, ROW - 4.0), flow, |ui| {
                    ui.set_min_size(vec2(width, ROW - 4.0));
                    let label = ui.add(egui::Label::new(text).truncate());
                    if !tooltip.is_empty() {
                        label.on_hover_text(tooltip);
                    }
                });
            };
            let left = Layout::left_to_right(Align::Center);
            sized(ui, first, left, RichText::new(label).weak().size(12.0), "");
            for (text, (_, tooltip)) in cells.iter().zip(COLUMNS) {
                let text = RichText::new(text).size(12.0);
                let text = if heading { text.weak() } else { text };
                sized(ui, cell, Layout::right_to_left(Align::Center), text, tooltip);
            }
        });
    };
    // One scale for both rows, named once: figures that stand below each other compare.
    let largest = [outcome.test, outcome.train].into_iter().flatten().map(|s| s.max_error).fold(0.0, f64::max);
    let scale = display::scale(ui.ctx(), largest, unit);
    let scaled = |value: f64| significant(value * scale.factor, 3);
    let cells = |score: Option<Score>| match score {
        Some(s) => [
            scaled(s.rmse),
            scaled(s.max_error),
            format!("{} %", plain(100.0 * s.nrmse, if s.nrmse < 0.1 { 2 } else { 1 })),
            format!("{} %", plain(s.best_fit, 2)),
        ],
        None => ["–", "–", "–", "–"].map(str::to_owned),
    };
    let named = if scale.unit.is_empty() { String::new() } else { format!("in {}", scale.unit) };
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        line(ui, &named, &COLUMNS.map(|(name, _)| name.to_owned()), true);
        line(ui, "held out", &cells(outcome.test), false);
        line(ui, "fitted", &cells(outcome.train), false);
    });
}

/// The channels of the record shown, where there are several.
fn several(ui: &mut Ui, context: &PanelContext<'_>, outcome: &Outcome) {
    let Some(shown) = context.data.records.get(context.shown) else { return };
    let Some(record) = outcome.records.iter().find(|r| std::sync::Arc::ptr_eq(&r.record, shown)) else { return };
    if record.channels.len() < 2 {
        return;
    }
    let usage = if record.usage == Usage::HeldOut { "held out" } else { "fitted" };
    ui.add_space(2.0);
    ui.label(RichText::new(format!("{} ({usage}), by channel", record.record.name)).weak().size(12.0));
    for channel in &record.channels {
        let size = vec2(ui.available_width(), ROW - 4.0);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            let name = channel.name(&outcome.model.layout);
            ui.add_sized(vec2(24.0, ROW - 4.0), egui::Label::new(RichText::new(name)));
            let text = channel.score.map_or_else(
                || "diverged at once".to_owned(),
                |s| {
                    format!(
                        "RMSE {}, best fit {} %",
                        display::format(ui.ctx(), s.rmse, context.data.unit(), 3),
                        plain(s.best_fit, 2)
                    )
                },
            );
            ui.label(RichText::new(text).size(12.0));
        });
    }
}

fn show_warning(ui: &mut Ui, warning: &Warning, asks: &mut Vec<PanelAct>) {
    let colors = theme::accents(ui.visuals().dark_mode);
    let color = match warning.severity {
        Severity::Note => colors.accent,
        Severity::Caution => colors.caution,
        Severity::Wrong => colors.wrong,
    };
    card(ui, color, |ui| {
        ui.add(egui::Label::new(RichText::new(&warning.text).size(12.5)).wrap());
        if let Some(remedy @ (Remedy::Settings { label, .. } | Remedy::Use { label, .. })) = &warning.remedy
            && ui.button(label).clicked()
        {
            asks.push(PanelAct::Remedy(remedy.clone()));
        }
    });
}
