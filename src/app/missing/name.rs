//! Name: which effects would close the gap, as cards.

use egui::{RichText, ScrollArea, Ui, vec2};

use super::act::WalkAct;
use super::canvas::WalkCanvas;
use super::known::{WalkContext, stands};
use super::subject::site_name;
use super::{cards, words};
use crate::app::widgets::line;
use sindyscope_search::{Candidate, Standing};
use sindyscope_values::format::words::capitalised;

/// Space between cards, points.
const SPACE: f32 = 8.0;

pub(super) fn show(ui: &mut Ui, canvas: &mut WalkCanvas, context: &WalkContext<'_>, acts: &mut Vec<WalkAct>) {
    let Some(before) = context.stage() else { return };
    let candidates = context.candidates();
    if candidates.is_empty() {
        let text = if context.looking() { "looking for effects…" } else { "Press “Find what's missing” first" };
        ui.centered_and_justified(|ui| ui.weak(text));
        return;
    }
    let likely = |c: &&Candidate| stands(c) || matches!(c.standing, Standing::Screened) && c.explained > 0.02;
    let hidden = context.offered().filter(|c| !likely(c)).count();
    line(ui, 24.0, |ui| {
        let text = context
            .round()
            .map_or_else(|| "Candidates so far; the likeliest are being refitted.".to_owned(), |r| words::finding(r));
        let text = match context.site {
            Some(site) => format!("{} alone: {text}", capitalised(&site_name(site, context.subject.masses()))),
            None => text,
        };
        // From the right: a long sentence goes on in a second row, not over the box.
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.checkbox(&mut canvas.view.show_all, format!("show all ({hidden} more)")).on_hover_text(
                "Also the effects that were refused, and those that these data cannot show, with the reason",
            );
            ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
                ui.add(egui::Label::new(RichText::new(text).size(13.5)).wrap());
            });
        });
    });
    if let Some(next) = context.round().and_then(|r| r.next_experiment.as_ref()) {
        line(ui, 20.0, |ui| {
            let color = crate::app::theme::accents(context.dark).caution;
            ui.add(egui::Label::new(words::two(ui, "What would tell them apart:", color, &next.text)).truncate())
                .on_hover_text(&next.text);
        });
    }
    // With nothing that stands there is more to learn from what was refused.
    let all = canvas.view.show_all || !context.offered().any(stands) && !context.looking();
    let shown: Vec<&Candidate> = context.offered().filter(|c| all || likely(c)).collect();
    let tall = ui.available_height() - 4.0;
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        let room_wide = ui.available_width() - 10.0;
        let columns = ((room_wide + SPACE) / (cards::NARROWEST + SPACE)).floor().max(1.0);
        let width = (room_wide - SPACE * (columns - 1.0)) / columns;
        ui.spacing_mut().item_spacing = vec2(SPACE, SPACE);
        // Few cards take the height that there is.
        let rows = shown.len().div_ceil(columns as usize).max(1) as f32;
        let height = ((tall - SPACE * (rows - 1.0)) / rows).clamp(cards::HEIGHT, cards::TALLEST);
        for (row, group) in shown.chunks(columns as usize).enumerate() {
            ui.horizontal(|ui| {
                for (k, candidate) in group.iter().enumerate() {
                    let rank = stands(candidate).then_some(row * columns as usize + k + 1);
                    cards::card(ui, canvas, context, before, candidate, (rank, vec2(width, height)), acts);
                }
            });
        }
    });
}
