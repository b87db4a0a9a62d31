//! The right column: the error, the equation of the force, the records.

use egui::{Align, Label, Layout, RichText, Sense, Ui, WidgetInfo, pos2, vec2};

use crate::app::plot::display;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{Headline, card, headlines, line, section, share_bar};
use sindyscope_component::{ComponentModel, Specimen};
use sindyscope_values::format::equations::by_share;
use sindyscope_values::format::number::{align_at_point, format_measured, significant};
use sindyscope_values::format::units::{as_fraction, format_si};
use sindyscope_values::model::Equation;
use sindyscope_values::record::Usage;
use sindyscope_values::term::{Expression, Symbol, Term};

/// Width of the column of the shares' bars, points.
const BAR: f32 = 44.0;

/// Draws the column of a model; `noise` is that of the force, `failure` why there is none.
pub(crate) fn findings(
    ui: &mut Ui,
    of: Option<(&Specimen, &ComponentModel)>,
    noise: Option<f64>,
    failure: Option<&str>,
) {
    if let Some(failure) = failure {
        let wrong = theme::accents(ui.visuals().dark_mode).wrong;
        card(ui, wrong, |ui| {
            ui.add(Label::new(failure).wrap());
        });
    }
    let Some((specimen, model)) = of else { return };
    fit(ui, specimen, model, noise);
    section(ui, "EQUATION", |_| {}, |_| {});
    equation(ui, "F =", &model.force, (model, true));
    for (k, internal) in model.internals.iter().enumerate() {
        let name = Term::new(Expression::Symbol(Symbol::Internal(k))).pretty(&model.layout);
        // Their coefficients have another unit than those of a force.
        equation(ui, &format!("d{name}/dt ="), internal, (model, false));
    }
    records(ui, specimen, model);
    ui.add_space(8.0);
}

fn fit(ui: &mut Ui, specimen: &Specimen, model: &ComponentModel, noise: Option<f64>) {
    section(ui, "FIT", |_| {}, |_| {});
    let (_, unit) = specimen.force();
    let (score, label) = match (model.score(Usage::HeldOut), model.score(Usage::Fit)) {
        (Some(score), _) => (Some(score), "held-out error"),
        (None, score) => (score, "fitted error"),
    };
    let colors = theme::accents(ui.visuals().dark_mode);
    let color = match (score, noise) {
        (Some(s), Some(noise)) if s.rmse <= 1.3 * noise => colors.good,
        (Some(s), _) if s.nrmse <= 0.1 => ui.visuals().strong_text_color(),
        _ => colors.caution,
    };
    let ctx = ui.ctx().clone();
    let told = |value: Option<f64>| value.map_or_else(|| "–".into(), |v| display::format(&ctx, v, unit, 3));
    let (error, floor) = (told(score.map(|s| s.rmse)), told(noise));
    let weak = ui.visuals().weak_text_color();
    headlines(
        ui,
        [
            Headline { text: &error, color, label, hint: "RMSE of the force along the given motion" },
            Headline { text: &floor, color: weak, label: "noise floor", hint: "The force's noise, estimated" },
        ],
    );
}

/// An equation: each term's coefficient ± standard error, the term, its unit in a force where `units` asks for it, its share.
fn equation(ui: &mut Ui, head: &str, equation: &Equation, (model, units): (&ComponentModel, bool)) {
    line(ui, ROW, |ui| {
        ui.label(RichText::new(head).size(14.0));
        if equation.terms.is_empty() {
            ui.weak("0");
        }
    });
    let terms = by_share(equation);
    let numbers: Vec<String> = terms.iter().map(|t| format_measured(t.coefficient, t.std_error)).collect();
    for (term, number) in terms.iter().zip(align_at_point(&numbers)) {
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::hover());
        let pretty = term.term.pretty(&model.layout);
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, format!("{} {pretty}", number.trim())));
        let unit = model.unit(&term.term).filter(|u| units && u != "1").map(|u| as_fraction(&u)).unwrap_or_default();
        let bar = egui::Rect::from_min_max(
            pos2(rect.right() - BAR - 4.0, rect.center().y - 3.0),
            pos2(rect.right() - 4.0, rect.center().y + 3.0),
        );
        share_bar(ui, bar, term.share, theme::accents(ui.visuals().dark_mode).accent);
        let text = rect.with_max_x(bar.left() - 6.0);
        let flow = Layout::left_to_right(Align::Center);
        let mut inside = ui.new_child(egui::UiBuilder::new().max_rect(text).layout(flow));
        inside.label(RichText::new(number).monospace());
        inside.label(RichText::new(pretty).strong());
        inside.add(Label::new(RichText::new(&unit).weak().size(11.5)).truncate());
        response.on_hover_text(format!("Its share of the right-hand side: {} %", significant(100.0 * term.share, 2)));
    }
}

/// A line for each record: its error, and how much of the energy the model takes.
fn records(ui: &mut Ui, specimen: &Specimen, model: &ComponentModel) {
    section(ui, "RECORDS", |_| {}, |_| {});
    let (_, unit) = specimen.force();
    for fit in &model.records {
        let [measured, identified] = fit.energy;
        let usage = if fit.usage == Usage::HeldOut { "held out" } else { "fitted" };
        let text = format!(
            "{}, {} %, energy {} %, {usage}",
            format_si(fit.score.rmse, unit, 3),
            significant(100.0 * fit.score.nrmse, 3),
            significant(100.0 * identified / measured, 3),
        );
        line(ui, ROW - 4.0, |ui| {
            ui.add(Label::new(&fit.name).truncate());
            ui.add(Label::new(RichText::new(text).size(12.0)).truncate()).on_hover_text(
                "RMSE, share of the force, and the energy that the model takes over that of the measured force",
            );
        });
    }
}
