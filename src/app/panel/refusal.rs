//! A file that was not opened: why, what to try, and the way to say what its header does not.

use egui::{Label, RichText, Ui};

use super::context::PanelAct;
use crate::app::commands::WindowCommand;
use crate::app::open::Refused;
use crate::app::state::Source;
use crate::app::theme;
use crate::app::widgets::card;

pub(super) fn show(ui: &mut Ui, refused: &Refused, asks: &mut Vec<PanelAct>) {
    let wrong = theme::accents(ui.visuals().dark_mode).wrong;
    card(ui, wrong, |ui| {
        ui.add(Label::new(&refused.problem.what).wrap());
        if !refused.problem.advice.is_empty() {
            ui.add(Label::new(RichText::new(&refused.problem.advice).weak()).wrap());
        }
        if refused.problem.missing.is_some() {
            if ui.button("Choose the file…").clicked() {
                asks.push(PanelAct::Locate);
            }
        } else if matches!(refused.opening.document.source, Source::Files(_)) {
            let hint = "Show what the file holds, and say which column is the time, a displacement, a force, …";
            if ui.button("Choose the columns…").on_hover_text(hint).clicked() {
                asks.push(PanelAct::Do(WindowCommand::Columns));
            }
        }
    });
}
