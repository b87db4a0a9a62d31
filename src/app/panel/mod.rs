//! The two columns beside the plots: data and settings on the left, what was found on the right.

mod context;
mod data;
mod equation;
mod fit;
mod library;
mod masses;
mod physics;
mod preparation;
mod proposal;
mod questions;
mod refusal;
mod setting_row;
mod smoothing;
mod threshold;

use egui::{Margin, Panel, ScrollArea, Ui, UiBuilder};

use super::state::Room;
use sindyscope_modes::BaseModel;

pub(crate) use context::{PanelAct, PanelContext, Typing};

/// The left column: data and settings; in the other rooms, what counts there.
pub(crate) fn left(
    ui: &mut Ui,
    context: &mut PanelContext<'_>,
    room: Room,
    own: impl FnOnce(&mut Ui, &mut PanelContext<'_>),
) {
    controls(ui, |ui| {
        data::show(ui, context);
        if context.data.records.is_empty() {
            return;
        }
        preparation::show(ui, context);
        match room {
            Room::Identify if context.edit.component || context.edit.base.model == BaseModel::Modes => own(ui, context),
            Room::Identify => {
                smoothing::show(ui, context);
                library::show(ui, context);
                threshold::show(ui, context);
                physics::show(ui, context);
            }
            Room::Missing | Room::Report => own(ui, context),
            // That room has a column of its own.
            Room::Rig => {}
        }
        ui.add_space(8.0);
    });
}

/// The right column: what was found.
pub(crate) fn right(ui: &mut Ui, context: &mut PanelContext<'_>, now: f64) {
    findings(ui, |ui| {
        proposal::show(ui, context);
        fit::show(ui, context);
        equation::show(ui, context, now);
        if let Some(outcome) = &context.data.outcome {
            physics::found(ui, outcome);
        }
        questions::show(ui, context);
        fit::warnings(ui, context);
        ui.add_space(8.0);
    });
}

/// The left column itself, as wide in every room.
pub(crate) fn controls(ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    column(Panel::left("settings").default_size(304.0).size_range(272.0..=420.0), ui, body);
}

/// The right column itself, as wide in every room.
pub(crate) fn findings(ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    column(Panel::right("findings").default_size(330.0).size_range(290.0..=460.0), ui, body);
}

fn column(panel: Panel, ui: &mut Ui, body: impl FnOnce(&mut Ui)) {
    let fill = ui.visuals().panel_fill;
    let frame = egui::Frame::new().fill(fill).inner_margin(Margin { left: 12, right: 4, top: 2, bottom: 0 });
    panel.frame(frame).show(ui, |ui| {
        // What is in the column never widens it: a number of one digit more would move the plots.
        let room = ui.available_rect_before_wrap();
        let mut inside = ui.new_child(UiBuilder::new().max_rect(room));
        inside.shrink_clip_rect(room);
        ScrollArea::vertical().auto_shrink([false, false]).show(&mut inside, |ui| {
            // Room for the scroll bar, kept also while there is none.
            let width = ui.available_width() - 8.0;
            ui.set_max_width(width);
            body(ui);
        });
        ui.advance_cursor_after_rect(room);
    });
}
