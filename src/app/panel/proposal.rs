//! The question which base model suits records that a chain of masses hardly explains.

use egui::{RichText, Ui};

use super::context::PanelContext;
use crate::app::modal::reason_for_modes;
use crate::app::theme;
use crate::app::widgets::card;
use sindyscope_modes::BaseModel;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    // What the program brings along are masses.
    let reason = if context.may_be_structure { reason_for_modes(context.data, context.edit) } else { None };
    let Some(reason) = reason else { return };
    let accent = theme::accents(ui.visuals().dark_mode).accent;
    ui.add_space(4.0);
    card(ui, accent, |ui| {
        ui.add(egui::Label::new(RichText::new("A structure with several modes?").strong()).wrap());
        ui.add(egui::Label::new(RichText::new(reason).weak().size(12.0)).wrap());
        ui.horizontal_wrapped(|ui| {
            let modes =
                "Its natural frequencies, damping ratios and shapes, as many as the data bear; undo takes it back";
            if ui.button("Identify its modes").on_hover_text(modes).clicked() {
                context.edit.base.model = BaseModel::Modes;
                context.edit.base_settled = true;
            }
            let chain = "An equation of motion for each sensor, as it stands; the question is not asked again";
            if ui.button("Keep the chain of masses").on_hover_text(chain).clicked() {
                context.edit.base_settled = true;
            }
        });
    });
}
