//! The tabs above the plots.

use egui::{RichText, Stroke, Ui};

use crate::app::commands::WindowCommand;
use crate::app::state::ViewState;
use crate::app::theme;
use crate::app::views::{Group, View};
use crate::app::widgets::tab;

/// Width from which on the groups and the views of one stand in one row, points.
const ONE_ROW: f32 = 600.0;

/// The tabs above the plots: groups on the left, the views of the one that is open behind them, or beneath.
pub(super) fn show(ui: &mut Ui, shown: &mut View, views: &ViewState) {
    if ui.available_width() >= ONE_ROW {
        ui.horizontal(|ui| {
            groups(ui, shown, views);
            ui.add_space(8.0);
            views_of_group(ui, shown);
        });
    } else {
        ui.horizontal(|ui| groups(ui, shown, views));
        ui.horizontal_wrapped(|ui| views_of_group(ui, shown));
    }
}

fn groups(ui: &mut Ui, shown: &mut View, views: &ViewState) {
    ui.spacing_mut().item_spacing.x = 2.0;
    let colors = theme::accents(ui.visuals().dark_mode);
    let open = shown.group();
    egui::Frame::new().fill(colors.card).corner_radius(4.0).stroke(Stroke::new(1.0, colors.line)).show(ui, |ui| {
        for group in Group::ALL {
            let on = open == group;
            let fill = if on { colors.accent_ground } else { egui::Color32::TRANSPARENT };
            let color = if on { ui.visuals().strong_text_color() } else { ui.visuals().text_color() };
            let button = egui::Button::new(RichText::new(group.label()).color(color)).fill(fill).stroke(Stroke::NONE);
            let response = ui.add(button).on_hover_text(group.tooltip());
            response.widget_info(|| egui::WidgetInfo::selected(egui::Role::Tab, true, on, group.label()));
            if response.clicked() && !on {
                *shown = views.recent(group);
            }
        }
    });
}

fn views_of_group(ui: &mut Ui, shown: &mut View) {
    ui.spacing_mut().item_spacing.x = 2.0;
    for view in shown.group().views() {
        let hint = WindowCommand::View(view).hint(ui.ctx());
        if tab(ui, view.label(), hint, *shown == view) {
            *shown = view;
        }
    }
}
