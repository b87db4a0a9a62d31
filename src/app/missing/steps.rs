//! The top of the room: the four steps, the one button that leads through them, and what runs.

use egui::{Align, Color32, Layout, Rect, RichText, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::act::WalkAct;
use super::canvas::WalkCanvas;
use super::known::{WalkContext, stands};
use super::{base, work};
use crate::app::state::RoundStep;
use crate::app::theme::{self, ROW};
use crate::app::widgets::line;
use sindyscope_search::Standing;

/// Height of the steps' row, points.
const HEIGHT: f32 = 34.0;
/// Width from which on every step's name stands beside its number; in less, the one in view alone has it, points.
const ROOMY: f32 = 530.0;
/// Radius of a step's number, points.
const RADIUS: f32 = 10.0;

pub(super) fn show(
    ui: &mut Ui,
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    hidden: bool,
    acts: &mut Vec<WalkAct>,
) {
    line(ui, HEIGHT, |ui| {
        stepper(ui, canvas.view.step, context, acts);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| primary(ui, canvas, context, acts));
    });
    line(ui, ROW + 2.0, |ui| {
        ui.weak(format!("Base: {}", base::label(&context.walk.base)));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if hidden && !canvas.view.revealed {
                let button = egui::Button::new("Reveal the truth");
                if ui.add(button).on_hover_text("Tell what the virtual rig hid in these records").clicked() {
                    acts.push(WalkAct::Reveal);
                }
            }
            under_way(ui, context, acts);
        });
    });
    let (rail, _) = ui.allocate_exact_size(vec2(ui.available_width(), 3.0), Sense::hover());
    ui.painter().hline(rail.x_range(), rail.center().y, Stroke::new(1.0, theme::accents(context.dark).line));
    if let Some(running) = context.running {
        let share = running.progress.share.unwrap_or(0.0).clamp(0.02, 1.0) as f32;
        let done = Rect::from_min_size(rail.min, vec2(share * rail.width(), 2.0));
        ui.painter().rect_filled(done, 0.0, theme::accents(context.dark).accent);
    }
}

/// How far the walk can be walked.
fn reached(context: &WalkContext<'_>, step: RoundStep) -> bool {
    match step {
        RoundStep::Compare => true,
        RoundStep::Name | RoundStep::Add => !context.candidates().is_empty(),
        RoundStep::Verify => !context.walk.accepted.is_empty() || context.round().is_some_and(|r| work::ends(r)),
    }
}

fn stepper(ui: &mut Ui, shown: RoundStep, context: &WalkContext<'_>, acts: &mut Vec<WalkAct>) {
    ui.spacing_mut().item_spacing.x = 0.0;
    let colors = theme::accents(context.dark);
    let roomy = ui.available_width() >= ROOMY;
    for (k, step) in RoundStep::ALL.into_iter().enumerate() {
        let (on, ready) = (shown == step, reached(context, step));
        let color = match (on, ready) {
            (true, _) => ui.visuals().strong_text_color(),
            (false, true) => ui.visuals().text_color(),
            (false, false) => ui.visuals().weak_text_color(),
        };
        let font = egui::FontId::proportional(14.0);
        let label = if on || roomy { step.label() } else { "" };
        let galley = ui.painter().layout_no_wrap(label.to_owned(), font, color);
        let width = if label.is_empty() { 0.0 } else { galley.size().x + 10.0 };
        let size = vec2(2.0 * RADIUS + 6.0 + width, HEIGHT);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        response.widget_info(|| WidgetInfo::selected(egui::Role::Tab, true, on, step.label()));
        let painter = ui.painter();
        let center = pos2(rect.left() + RADIUS + 2.0, rect.center().y);
        let (fill, ink) = match (on, ready) {
            (true, _) => (colors.accent, if context.dark { Color32::BLACK } else { Color32::WHITE }),
            (false, true) => (colors.accent_ground, ui.visuals().strong_text_color()),
            (false, false) => (ui.visuals().widgets.inactive.bg_fill, color),
        };
        if response.hovered() || response.has_focus() {
            painter.rect_filled(rect.shrink2(vec2(0.0, 4.0)), 4.0, ui.visuals().widgets.hovered.weak_bg_fill);
        }
        painter.circle_filled(center, RADIUS, fill);
        let number = egui::FontId::proportional(12.0);
        painter.text(center, egui::Align2::CENTER_CENTER, (k + 1).to_string(), number, ink);
        let at = pos2(center.x + RADIUS + 6.0, rect.center().y - 0.5 * galley.size().y);
        painter.galley(at, galley, color);
        if response.on_hover_text(format!("{}: {}", step.label(), step.tooltip())).clicked() {
            acts.push(WalkAct::Go(step));
        }
        if k + 1 < RoundStep::ALL.len() {
            let (rail, _) = ui.allocate_exact_size(vec2(16.0, HEIGHT), Sense::hover());
            let stroke =
                Stroke::new(1.5, if reached(context, RoundStep::ALL[k + 1]) { colors.accent } else { colors.line });
            ui.painter().hline(rail.x_range().shrink(2.0), rail.center().y, stroke);
        }
    }
}

/// The one button that leads on.
fn primary(ui: &mut Ui, canvas: &WalkCanvas, context: &WalkContext<'_>, acts: &mut Vec<WalkAct>) {
    let first = context.offered().find(|c| stands(c)).map(|c| c.choice.clone());
    let begun = context.round().is_some() || context.looking();
    let ends = context.round().is_some_and(|r| work::ends(r));
    let (text, hint, act): (&str, &str, Option<Vec<WalkAct>>) = match canvas.view.step {
        _ if context.stage().is_none() => ("Find what's missing", "The base model is being fitted", None),
        RoundStep::Compare if !begun => (
            "Find what's missing",
            "Look for a gap beyond noise, and for the effects that would close it",
            Some(vec![WalkAct::Look]),
        ),
        RoundStep::Compare if ends => {
            ("Next", "Nothing can be named: see what is left", Some(vec![WalkAct::Go(RoundStep::Verify)]))
        }
        RoundStep::Compare => {
            let ready = !context.candidates().is_empty();
            ("Next", "Which effect is it?", ready.then(|| vec![WalkAct::Go(RoundStep::Name)]))
        }
        RoundStep::Name | RoundStep::Add if !begun => {
            ("Find what's missing", "Look for the effects that would close the gap", Some(vec![WalkAct::Look]))
        }
        RoundStep::Name if ends => {
            ("Next", "Nothing can be named: see what is left", Some(vec![WalkAct::Go(RoundStep::Verify)]))
        }
        RoundStep::Name => {
            let hint = match first {
                None if context.site.is_some() => "No effect stands at the place that was picked",
                _ => "See what the likeliest effect does to the response",
            };
            ("Next", hint, first.map(|choice| vec![WalkAct::Select(choice), WalkAct::Go(RoundStep::Add)]))
        }
        RoundStep::Add => {
            let chosen = canvas.view.selected.clone().or(first);
            let candidate = chosen.as_ref().and_then(|c| context.candidates().iter().find(|o| o.choice == *c));
            match candidate {
                Some(c) if context.with(&c.choice).is_none() => {
                    let possible = !matches!(c.standing, Standing::NotShown(_)) && context.running.is_none();
                    let act = possible.then(|| vec![WalkAct::Try(c.choice.clone())]);
                    ("Fit it", "It was only screened: fit it to the measured response", act)
                }
                Some(c) if stands(c) => {
                    ("Accept", "Add the effect to the model", Some(vec![WalkAct::Accept(c.choice.clone())]))
                }
                Some(c) => {
                    let hint = "Add it although it was refused or not judged: the verdict stays with you";
                    ("Accept all the same", hint, Some(vec![WalkAct::Accept(c.choice.clone())]))
                }
                None => ("Accept", "Choose an effect first", None),
            }
        }
        RoundStep::Verify if context.looking() => ("Look again", "A look is under way", None),
        RoundStep::Verify if ends => ("Look again", "There is nothing left to look for that these data can show", None),
        RoundStep::Verify => {
            ("Look again", "Ask what is still missing from the model as it stands", Some(vec![WalkAct::Look]))
        }
    };
    let colors = theme::accents(context.dark);
    let ink = if context.dark { Color32::BLACK } else { Color32::WHITE };
    let enabled = act.is_some();
    let ink = if enabled { ink } else { ui.visuals().weak_text_color() };
    let mut button = egui::Button::new(RichText::new(text).size(14.0).color(ink)).min_size(vec2(150.0, 28.0));
    if enabled {
        button = button.fill(colors.accent);
    }
    let response = ui.add_enabled(enabled, button).on_hover_text(hint).on_disabled_hover_text(hint);
    if response.clicked() {
        acts.extend(act.unwrap_or_default());
    }
}

/// What runs, and a button that stops it.
fn under_way(ui: &mut Ui, context: &WalkContext<'_>, acts: &mut Vec<WalkAct>) {
    let Some(running) = context.running else { return };
    if ui.small_button("Cancel").on_hover_text("Stop; what was found stays").clicked() {
        acts.push(WalkAct::Cancel);
    }
    let far = running.progress.words();
    let text = if far.is_empty() { running.sentence.to_owned() } else { format!("{far} · {}", running.sentence) };
    ui.add(egui::Label::new(RichText::new(text).weak()).truncate());
}
