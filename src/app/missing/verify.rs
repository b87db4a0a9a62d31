//! Verify: did the gap shrink on data never fitted, and what is left.

use sindyscope_search::{DESCRIPTION, Finding, Stage, Verdict, within};
use sindyscope_values::format::units::raised;

use egui::{RichText, ScrollArea, Ui, vec2};

use super::act::WalkAct;
use super::act::WalkFigure;
use super::canvas::WalkCanvas;
use super::choice;
use super::figures::{self, Manner};
use super::known::WalkContext;
use super::{compare, words};
use crate::app::state::RoundStep;
use crate::app::theme;
use crate::app::widgets::card;

pub(super) fn show(ui: &mut Ui, canvas: &mut WalkCanvas, context: &WalkContext<'_>, acts: &mut Vec<WalkAct>) {
    let stages = context.stages();
    let (Some(first), Some(last)) = (stages.first(), stages.last()) else {
        ui.centered_and_justified(|ui| ui.weak("fitting…"));
        return;
    };
    verdict(ui, context, first, last);
    let mut shown = choice::record_shown(canvas, last);
    let was = shown;
    let below = (0.40 * ui.available_height()).max(210.0);
    let any = compare::record(ui, context, (&last.traces, &mut shown, &mut canvas.mass), "").is_some();
    if shown != was {
        canvas.view.verified = Some(shown);
    }
    if any {
        let size = vec2(ui.available_width(), ui.available_height() - below - 6.0);
        figures::show(ui, canvas, context, (&WalkFigure::Time(RoundStep::Verify), None), Manner::new(size), acts);
    }
    let height = ui.available_height() - 4.0;
    ui.horizontal_top(|ui| {
        let half = 0.54 * (ui.available_width() - 8.0);
        figures::show(ui, canvas, context, (&WalkFigure::Waterfall, None), Manner::new(vec2(half, height)), acts);
        ui.vertical(|ui| {
            let width = ui.available_width();
            ui.set_width(width);
            ScrollArea::vertical().id_salt("what is left").max_height(height).auto_shrink([false, false]).show(
                ui,
                |ui| {
                    ui.set_max_width(width - 10.0);
                    left(ui, canvas, context, height, acts);
                },
            );
        });
    });
}

/// The verdict in one sentence, in room of a fixed height.
fn verdict(ui: &mut Ui, context: &WalkContext<'_>, first: &Stage, last: &Stage) {
    let size = vec2(ui.available_width(), 40.0);
    ui.allocate_ui_with_layout(size, egui::Layout::top_down(egui::Align::Min), |ui| {
        ui.set_min_size(size);
        let colors = theme::accents(context.dark);
        let (text, color) = match context.conclusion() {
            Some(d) => {
                let color = match d.verdict {
                    Verdict::Named | Verdict::NothingMissing => colors.good,
                    Verdict::Ambiguous | Verdict::Unexplained => colors.caution,
                };
                (raised(&d.sentence), color)
            }
            None if last.effects.is_empty() => {
                ("Nothing was added yet: this is the base model.".to_owned(), ui.visuals().text_color())
            }
            None => {
                let names: Vec<String> = last.effects.iter().map(|e| within(&e.title)).collect();
                let text = format!(
                    "With {} the error on data never fitted goes {}.",
                    names.join(" and "),
                    words::shrinks(&first.gap, &last.gap, context.unit)
                );
                (text, ui.visuals().text_color())
            }
        };
        ui.add(egui::Label::new(RichText::new(text).size(14.0).strong().color(color)).wrap());
    });
}

/// What remains, and what would tell more.
fn left(ui: &mut Ui, canvas: &mut WalkCanvas, context: &WalkContext<'_>, height: f32, acts: &mut Vec<WalkAct>) {
    let colors = theme::accents(context.dark);
    let round = context.round();
    let asked = round.or_else(|| {
        let accepted = &context.walk.accepted;
        accepted.len().checked_sub(1).and_then(|n| context.known.rounds.get(&accepted[..n]))
    });
    if let Some(round) = asked
        && let Finding::Ambiguous(_) = round.finding
    {
        card(ui, colors.caution, |ui| {
            ui.add(egui::Label::new(words::finding(round)).wrap());
            if let Some(next) = &round.next_experiment {
                ui.add(egui::Label::new(RichText::new(raised(&next.text)).weak()).wrap());
            }
        });
    }
    let description = context.conclusion().and_then(|d| d.description.as_ref());
    // A formula has a picture of its own.
    if description.is_none() && round.is_some_and(|r| r.finding == Finding::Unexplained && !r.place.profiles.is_empty())
    {
        ui.label(RichText::new("What is left, over the quantity that orders it best").strong());
        let size = vec2(ui.available_width(), (height - 90.0).clamp(130.0, 260.0));
        figures::show(ui, canvas, context, (&WalkFigure::Left, None), Manner::new(size).compact(), acts);
    }
    if let Some(description) = description {
        card(ui, colors.caution, |ui| {
            ui.add(egui::Label::new(raised(&description.sentence)).wrap());
            let size = vec2(ui.available_width(), (height - 90.0).clamp(130.0, 220.0));
            figures::show(ui, canvas, context, (&WalkFigure::Description, None), Manner::new(size).compact(), acts);
            // Beside other effects than those that were added it would be another formula.
            let accepted: Vec<&str> = context.walk.accepted.iter().map(|c| c.effect.as_str()).collect();
            if accepted == description.beside && ui.button("Add it to the model").clicked() {
                let own = description.stage.effects.iter().filter(|e| e.choice.effect == DESCRIPTION);
                acts.extend(own.map(|e| WalkAct::Accept(e.choice.clone())));
            }
        });
    }
    if let Some(d) = context.conclusion() {
        let (edge, head) = if d.remaining.significant {
            (colors.caution, format!("What is left is more than noise ({}).", words::p_value(d.remaining.p_value)))
        } else {
            let (edge, of) = if d.explained { (colors.good, "") } else { (colors.caution, " of the data fitted") };
            (edge, format!("What is left{of} is noise ({}).", words::no_gap(d.remaining.p_value)))
        };
        card(ui, edge, |ui| {
            ui.add(egui::Label::new(RichText::new(head).strong()).wrap());
            could_hide(ui, d.remaining.limits());
        });
    } else if context.running.is_some() {
        ui.weak("asking what is left…");
    }
    if !context.walk.accepted.is_empty() && ui.button("Undo last effect").clicked() {
        acts.push(WalkAct::Undo);
    }
}

/// What these data could still hide, the first few at once.
fn could_hide(ui: &mut Ui, note: &str) {
    const SHOWN: usize = 5;
    let small = |text: String| egui::Label::new(RichText::new(text).size(12.0)).wrap();
    // Names of effects have commas of their own.
    let parts: Vec<&str> = note.split_inclusive("%, ").map(|part| part.trim_end_matches(", ")).collect();
    if note.is_empty() {
        return;
    }
    let (first, rest) = parts.split_at(parts.len().min(SHOWN));
    let end = if rest.is_empty() { "" } else { ", …" };
    ui.add(small(first.join(", ") + end));
    if !rest.is_empty() {
        let head = RichText::new(format!("{} more effects", rest.len())).weak().size(12.0);
        egui::CollapsingHeader::new(head).id_salt("could hide").show(ui, |ui| ui.add(small(rest.join(", "))));
    }
}
