//! SMOOTHING: how displacements become velocities and accelerations.

use egui::{RichText, Ui};

use super::{Ask, Desk};
use crate::app::commands::Command;
use crate::app::theme::ROW;
use crate::app::widgets::{Setting, Spread, row, section};
use sindyscope_core::signal::TestFunction;
use sindyscope_core::study::{Differentiation, Formulation};
use sindyscope_values::format::number::significant_trimmed;

const METHODS: [(Differentiation, &str, &str); 7] = [
    (
        Differentiation::Filter,
        "filter's derivative",
        "Savitzky–Golay: a polynomial is laid through each segment and differentiated itself",
    ),
    (
        Differentiation::SmoothThenDifference,
        "smooth, then difference",
        "Savitzky–Golay smoothing, then central differences of the smoothed samples",
    ),
    (
        Differentiation::Spline,
        "smoothing spline",
        "A natural cubic spline that weighs curvature against misfit; its weight by generalised cross-validation",
    ),
    (
        Differentiation::Spectral,
        "spectral",
        "The whole record's Fourier transform behind a soft low-pass, whose edge is where the noise begins: for long records \
         of smooth motion",
    ),
    (
        Differentiation::Kalman,
        "Kalman smoother",
        "The likeliest motion if its jerk is white noise; how strong by the record's likelihood",
    ),
    (
        Differentiation::TotalVariation,
        "total variation",
        "The motion whose acceleration changes least in sum, so that it may jump: for dry friction and impacts. Slow: \
         records of up to 100 000 samples; its library is not filtered alike, so coefficients lean a little",
    ),
    (
        Differentiation::Difference,
        "difference only",
        "Central differences of the samples as measured: for data without noise",
    ),
];

const FORMS: [(Formulation, &str, &str); 3] = [
    (
        Formulation::Derivative,
        "at samples",
        "The equation holds at each sample, between derivatives of the smoothed motion",
    ),
    (
        Formulation::Weak { half_width: None },
        "weak form",
        "The equation holds in averages over test functions, which take the derivatives off the measurement: smoothing \
         then biases nothing but forces that are not linear, and the sensor's noise is weighed out",
    ),
    (
        Formulation::Integral,
        "integral form",
        "The equation is integrated once over time: velocities are held against integrals of the terms, and no \
         acceleration is needed",
    ),
];

pub(super) fn show(ui: &mut Ui, desk: &mut Desk<'_>) {
    let choosing = desk.choosing;
    let mut asks = Vec::new();
    section(ui, "SMOOTHING", |ui| choose(ui, choosing, &mut asks), |_| {});
    desk.asks.append(&mut asks);
    let smoothing = &mut desk.edit.settings.smoothing;
    let suggestion = desk.suggestion.smoothing;
    row(ui, "Derivative", "How velocities and accelerations are made from displacements", |ui| {
        let shown = METHODS.iter().find(|(m, ..)| *m == smoothing.method).map_or("", |(_, label, _)| label);
        let width = ui.available_width();
        let combo = egui::ComboBox::from_id_salt("derivative").width(width).selected_text(shown).show_ui(ui, |ui| {
            for (method, label, tooltip) in METHODS {
                ui.selectable_value(&mut smoothing.method, method, label).on_hover_text(tooltip);
            }
        });
        combo.response.accessible_name("Derivative");
    });
    let (local, global) = (smoothing.method.is_local(), smoothing.method.is_global());
    if global {
        row(ui, "", "", |ui| {
            ui.checkbox(&mut smoothing.from_data, "strength from the data").on_hover_text(
                "Each record says itself how much it is smoothed; otherwise the length below does. Choose for me tries both",
            );
        });
        if smoothing.from_data {
            let used = desk.bench.outcome.as_ref().filter(|o| o.settings.smoothing == *smoothing);
            let words = used
                .and_then(|o| o.records.first())
                .map(|r| format!("half passes at a period of {} samples", significant_trimmed(r.signals.length, 3)));
            row(ui, "", "", |ui| ui.label(RichText::new(words.unwrap_or_default()).weak()));
        }
    }
    ui.add_enabled_ui(local || global && !smoothing.from_data, |ui| {
        let shortest = if local { (smoothing.order + 2) | 1 } else { 3 };
        let longest = desk.bench.longest_segment(&desk.edit.usage).max(shortest + 2);
        let mut window = smoothing.window as f64;
        let segment = Setting {
            label: if global { "Length" } else { "Segment" },
            tooltip: if global {
                "The period of which half the amplitude passes: longer takes out more noise, too long flattens the motion"
            } else {
                "Samples that each polynomial is laid through: longer takes out more noise, too long flattens the motion"
            },
            unit: ", samples",
            range: shortest as f64..=longest as f64,
            spread: Spread::Logarithmic,
            grid: 2.0,
            suggestion: Some(suggestion.window as f64),
            marks: &[],
            format: &|v| format!("{v:.0}"),
        };
        if segment.show(ui, &mut window) {
            *smoothing = smoothing.with_window((window as usize) | 1);
        }
        let (seconds, periods) = desk.bench.segment_length(smoothing);
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
        let setting = Setting {
            label: "Order",
            tooltip: "Degree of each segment's polynomial: higher follows faster motion and lets more noise through",
            unit: "",
            range: 2.0..=9.0,
            spread: Spread::Linear,
            grid: 1.0,
            suggestion: Some(suggestion.order as f64),
            marks: &[],
            format: &|v| format!("{v:.0}"),
        };
        if setting.show(ui, &mut order) {
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
    form(ui, desk);
}

/// How the equation is held against the data, and the weak form's test functions.
fn form(ui: &mut Ui, desk: &mut Desk<'_>) {
    let form = &mut desk.edit.settings.form;
    row(ui, "Equation", "How the equation is held against the data", |ui| {
        let same = |a: &Formulation, b: &Formulation| std::mem::discriminant(a) == std::mem::discriminant(b);
        let shown = FORMS.iter().find(|(f, ..)| same(f, form)).map_or("", |(_, label, _)| label);
        let width = ui.available_width();
        let combo = egui::ComboBox::from_id_salt("form").width(width).selected_text(shown).show_ui(ui, |ui| {
            for (choice, label, tooltip) in FORMS {
                let chosen = same(&choice, form);
                if ui.selectable_label(chosen, label).on_hover_text(tooltip).clicked() && !chosen {
                    *form = choice;
                }
            }
        });
        combo.response.accessible_name("Equation");
    });
    let Formulation::Weak { half_width } = form else { return };
    let usage = &desk.edit.usage;
    let longest = (desk.bench.shortest(usage) / 4).max(TestFunction::NARROWEST + 1);
    let suggested =
        desk.bench.suggested_half_width().unwrap_or(TestFunction::NARROWEST).clamp(TestFunction::NARROWEST, longest);
    let mut value = half_width.unwrap_or(suggested) as f64;
    let setting = Setting {
        label: "Half width",
        tooltip: "Samples that each test function reaches to either side: it matters little, as long as some fit into the record",
        unit: ", samples",
        range: TestFunction::NARROWEST as f64..=longest as f64,
        spread: Spread::Logarithmic,
        grid: 1.0,
        suggestion: Some(suggested as f64),
        marks: &[],
        format: &|v| format!("{v:.0}"),
    };
    if setting.show(ui, &mut value) {
        *half_width = Some(value as usize);
    }
}

/// The button that chooses, or while it works its progress and a way to stop it: of one height, so that nothing jumps.
fn choose(ui: &mut Ui, choosing: Option<crate::app::queue::Progress>, asks: &mut Vec<Ask>) {
    match choosing {
        None => {
            let button = ui.button(Command::Choose.spec().label).on_hover_text(Command::Choose.hint(ui.ctx()));
            if button.clicked() {
                asks.push(Ask::Do(Command::Choose));
            }
        }
        Some(busy) => {
            if ui.button("Cancel").on_hover_text("Stop and leave the settings as they are").clicked() {
                asks.push(Ask::StopErrand);
            }
            let share = busy.share.unwrap_or(0.0) as f32;
            let bar = egui::ProgressBar::new(share).desired_width(110.0).desired_height(ROW - 8.0);
            ui.add(bar).on_hover_text(format!("{:.0} % of the settings tried", 100.0 * share));
        }
    }
}
