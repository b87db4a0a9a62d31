//! SMOOTHING: how displacements become velocities and accelerations.

use egui::{RichText, Ui};

use super::context::{PanelAct, PanelContext};
use super::setting_row::{pick, slider};
use crate::app::commands::WindowCommand;
use crate::app::theme::ROW;
use crate::app::widgets::{SliderRow, row, section};
use sindyscope_core::signal::TestFunction;
use sindyscope_core::study::{Differentiation, FORMS, Formulation, METHODS, setting};
use sindyscope_values::format::number::significant_trimmed;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let choosing = context.choosing;
    let mut asks = Vec::new();
    section(ui, "SMOOTHING", |ui| choose(ui, choosing, &mut asks), |_| {});
    context.asks.append(&mut asks);
    let smoothing = &mut context.edit.settings.smoothing;
    let suggestion = context.suggestion.smoothing;
    pick(ui, setting("differentiation"), &METHODS, &mut smoothing.method, |a, b| a == b);
    let (local, global) = (smoothing.method.is_local(), smoothing.method.is_global());
    if global {
        row(ui, "", "", |ui| {
            ui.checkbox(&mut smoothing.from_data, "strength from the data").on_hover_text(
                "Each record says itself how much it is smoothed; otherwise the length below does. Choose for me tries both",
            );
        });
        if smoothing.from_data {
            let used = context.data.outcome.as_ref().filter(|o| o.settings.smoothing == *smoothing);
            let words = used
                .and_then(|o| o.records.first())
                .map(|r| format!("half passes at a period of {} samples", significant_trimmed(r.signals.length, 3)));
            row(ui, "", "", |ui| ui.label(RichText::new(words.unwrap_or_default()).weak()));
        }
    }
    ui.add_enabled_ui(local || global && !smoothing.from_data, |ui| {
        let shortest = if local { (smoothing.order + 2) | 1 } else { 3 };
        let longest = context.data.longest_segment(&context.edit.usage).max(shortest + 2);
        let mut window = smoothing.window as f64;
        let segment = SliderRow {
            label: if global { "Length" } else { setting("window").label },
            range: shortest as f64..=longest as f64,
            suggestion: Some(suggestion.window as f64),
            ..slider(setting("window"))
        };
        if segment.show(ui, &mut window) {
            *smoothing = smoothing.with_window((window as usize) | 1);
        }
        let (seconds, periods) = context.data.segment_length(smoothing);
        let mut words = Vec::new();
        if let Some(seconds) = seconds {
            words.push(format!("{} ms", significant_trimmed(1e3 * seconds, 3)));
        }
        if let Some(periods) = periods {
            words.push(format!("{} main periods", significant_trimmed(periods, 2)));
        }
        row(ui, "", "", |ui| ui.label(RichText::new(words.join(" · ")).weak()));
    });
    ui.add_enabled_ui(local, |ui| {
        let mut order = smoothing.order as f64;
        let row = SliderRow { suggestion: Some(suggestion.order as f64), ..slider(setting("order")) };
        if row.show(ui, &mut order) {
            smoothing.order = order as usize;
            smoothing.window = smoothing.window.max((smoothing.order + 2) | 1);
        }
    });
    let linear = local || global && smoothing.method != Differentiation::TotalVariation;
    ui.add_enabled_ui(linear, |ui| {
        row(ui, "", "", |ui| {
            ui.checkbox(&mut smoothing.filter_library, "filter the library columns too").on_hover_text(
                "Passes every library column through the filter that the displacement went through; without it the \
                 smoothing biases the coefficients",
            );
        });
    });
    form(ui, context);
}

/// How the equation is held against the data, and the weak form's test functions.
fn form(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let form = &mut context.edit.settings.form;
    let same = |a: &Formulation, b: &Formulation| std::mem::discriminant(a) == std::mem::discriminant(b);
    pick(ui, setting("form"), &FORMS, form, same);
    let Formulation::Weak { half_width } = form else { return };
    let usage = &context.edit.usage;
    let longest = (context.data.shortest(usage) / 4).max(TestFunction::NARROWEST + 1);
    let suggested =
        context.data.suggested_half_width().unwrap_or(TestFunction::NARROWEST).clamp(TestFunction::NARROWEST, longest);
    let mut value = half_width.unwrap_or(suggested) as f64;
    let row = SliderRow {
        range: TestFunction::NARROWEST as f64..=longest as f64,
        suggestion: Some(suggested as f64),
        ..slider(setting("half-width"))
    };
    if row.show(ui, &mut value) {
        *half_width = Some(value as usize);
    }
}

/// The button that chooses, or while it works its progress and a way to stop it: of one height, so that nothing jumps.
fn choose(ui: &mut Ui, choosing: Option<crate::app::queue::JobProgress>, asks: &mut Vec<PanelAct>) {
    match choosing {
        None => {
            let button =
                ui.button(WindowCommand::Choose.spec().label).on_hover_text(WindowCommand::Choose.hint(ui.ctx()));
            if button.clicked() {
                asks.push(PanelAct::Do(WindowCommand::Choose));
            }
        }
        Some(busy) => {
            if ui.button("Cancel").on_hover_text("Stop and leave the settings as they are").clicked() {
                asks.push(PanelAct::StopChoosing);
            }
            let share = busy.share.unwrap_or(0.0) as f32;
            let bar = egui::ProgressBar::new(share).desired_width(110.0).desired_height(ROW - 8.0);
            let stage = busy.stage.unwrap_or("choosing");
            ui.add(bar).on_hover_text(format!("{:.0} %: {stage}", 100.0 * share));
        }
    }
}
