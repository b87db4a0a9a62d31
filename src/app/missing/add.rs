//! Add: what an effect does to the response, before it is added.

use std::sync::Arc;

use egui::{RichText, ScrollArea, Ui, vec2};

use super::act::WalkAct;
use super::act::WalkFigure;
use super::canvas::WalkCanvas;
use super::choice;
use super::figures::{self, Manner};
use super::known::{WalkContext, stands};
use super::{cards, compare, words};
use crate::app::state::RoundStep;
use crate::app::widgets::line;
use sindyscope_search::{Candidate, Stage};

pub(super) fn show(
    ui: &mut Ui,
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    before: &Arc<Stage>,
    acts: &mut Vec<WalkAct>,
) {
    let candidates = context.candidates();
    if candidates.is_empty() {
        let text = if context.looking() { "looking for effects…" } else { "Press “Find what's missing” first" };
        ui.centered_and_justified(|ui| ui.weak(text));
        return;
    }
    let by_choice = |choice: &Option<sindyscope_search::Choice>| {
        choice.as_ref().and_then(|choice| context.offered().find(|c| c.choice == *choice))
    };
    let next = choice::next(canvas, context);
    let chosen = choice::looked_at(canvas, context);
    let list = (0.32 * ui.available_height()).max(150.0);
    // The pointer was over a row in the frame before: the rows lie beneath the plot.
    let hovered =
        ui.data(|d| d.get_temp::<Option<sindyscope_search::Choice>>(egui::Id::unique("hovered candidate"))).flatten();
    let shown = by_choice(&hovered).or(chosen);
    let aside = shown.map_or_else(String::new, |c| format!("preview: {}", c.title));
    if compare::record(ui, context, (&before.traces, &mut canvas.view.record, &mut canvas.mass), &aside).is_some() {
        let size = vec2(ui.available_width(), ui.available_height() - list - 36.0);
        let figure = WalkFigure::Time(RoundStep::Add);
        figures::show(ui, canvas, context, (&figure, shown.map(|c| &c.choice)), Manner::new(size), acts);
    }
    buttons(ui, canvas, context, chosen, next, acts);
    let mut under = None;
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        ui.set_width(ui.available_width() - 10.0);
        for candidate in context.offered() {
            let marks =
                (chosen.is_some_and(|c| c.choice == candidate.choice), canvas.view.skipped.contains(&candidate.choice));
            if cards::row(ui, context, before, candidate, marks, acts) {
                under = Some(candidate.choice.clone());
            }
        }
    });
    canvas.hovered = under.clone().or_else(|| chosen.map(|c| c.choice.clone()));
    if under != hovered {
        ui.data_mut(|d| d.insert_temp(egui::Id::unique("hovered candidate"), under));
        ui.ctx().request_repaint();
    }
}

/// Skip and undo; to accept is the button that leads on.
fn buttons(
    ui: &mut Ui,
    canvas: &mut WalkCanvas,
    context: &WalkContext<'_>,
    chosen: Option<&Candidate>,
    next: Option<&Candidate>,
    acts: &mut Vec<WalkAct>,
) {
    line(ui, 30.0, |ui| {
        let Some(chosen) = chosen else { return };
        let mut after = context.offered().filter(|c| stands(c) && c.choice != chosen.choice);
        let after = after.find(|c| !canvas.view.skipped.contains(&c.choice)).map(|c| c.choice.clone());
        let skip = ui.add_enabled(after.is_some(), egui::Button::new("Skip").min_size(vec2(60.0, 24.0)));
        if skip.on_hover_text("Pass it over and preview the next").clicked() {
            canvas.view.skipped.push(chosen.choice.clone());
            if let Some(choice) = after {
                acts.push(WalkAct::Select(choice));
            }
        }
        let undo = ui
            .add_enabled(!context.walk.accepted.is_empty(), egui::Button::new("Undo last").min_size(vec2(80.0, 24.0)));
        if undo.on_hover_text("Take the effect that was added last out of the model").clicked() {
            acts.push(WalkAct::Undo);
        }
        let refused = context.known.refused.as_ref().filter(|(c, _)| *c == chosen.choice);
        let text = match (refused, next) {
            (Some((_, why)), _) => format!("It could not be fitted: {why}"),
            (None, None) => "Nothing that stands is left to add".to_owned(),
            (None, Some(_)) => match context.with(&chosen.choice).zip(context.stage()) {
                Some((after, before)) => match words::times(&before.gap, &after.gap) {
                    Some(times) => format!("gap {} ({times})", words::shrinks(&before.gap, &after.gap, context.unit)),
                    None => format!("gap {}", words::shrinks(&before.gap, &after.gap, context.unit)),
                },
                None => chosen.why.clone(),
            },
        };
        ui.add(egui::Label::new(RichText::new(text).strong()).truncate());
        if next.is_none() && ui.link("what is left").clicked() {
            acts.push(WalkAct::Go(RoundStep::Verify));
        }
    });
}
