//! In which units axes and columns are shown: those that a person chose by a click, else those that suit the data.
//!
//! The choice lies in egui's memory while a frame is drawn, so that every plot sees it, also one that is drawn for print; the
//! window brings it there and keeps what was changed.

use std::fmt::Debug;
use std::hash::Hash;

use egui::{Context, CursorIcon, Id, Popup, Rect, Response, Sense, Ui, WidgetInfo};

use super::units::Scale;
use sindyscope_values::format::shown::ShownUnits;

fn id() -> Id {
    Id::unique("shown units")
}

/// Brings the chosen units where plots find them.
pub(crate) fn install(ctx: &Context, units: &ShownUnits) {
    ctx.data_mut(|d| d.insert_temp(id(), units.clone()));
}

/// The chosen units as they stand.
pub(crate) fn chosen(ctx: &Context) -> ShownUnits {
    ctx.data(|d| d.get_temp(id())).unwrap_or_default()
}

/// How values up to `largest` are shown.
pub(crate) fn scale(ctx: &Context, largest: f64, unit: &str) -> Scale {
    chosen(ctx).scale(largest, unit)
}

/// A value in the unit that was chosen, else in the prefix that suits it alone.
pub(crate) fn format(ctx: &Context, value: f64, unit: &str, digits: usize) -> String {
    scale(ctx, value.abs(), unit).format(value, digits)
}

/// Lets the unit of an axis be chosen by a click on its labels.
pub(crate) fn on_axis(ui: &Ui, labels: Rect, axis: impl Hash + Debug, (symbol, unit): (&str, &str)) {
    if ShownUnits::choices(unit).is_empty() {
        return;
    }
    let response = ui.interact(labels, Id::unique(("unit of an axis", axis)), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, format!("Unit of {symbol}")));
    let response = response.on_hover_cursor(CursorIcon::PointingHand).on_hover_text("Click to choose the unit");
    Popup::menu(&response).show(|ui| menu(ui, unit));
    ring(ui, &response);
}

/// What is reached by the keyboard is seen.
fn ring(ui: &Ui, response: &Response) {
    if response.has_focus() {
        let line = egui::Stroke::new(1.0, ui.visuals().selection.stroke.color);
        ui.painter().rect_stroke(response.rect, 3.0, line, egui::StrokeKind::Inside);
    }
}

/// The units that values in this one may be shown in.
pub(crate) fn menu(ui: &mut Ui, unit: &str) {
    let mut units = chosen(ui.ctx());
    let mut choose = |ui: &mut Ui, label: &str, shown: Option<&str>, hint: &str| {
        let on = units.chosen(unit) == shown;
        if ui.selectable_label(on, label).on_hover_text(hint).clicked() {
            units.choose(unit, shown);
            install(ui.ctx(), &units);
            ui.close();
        }
    };
    choose(ui, "as suits the data", None, "With the prefix that makes short numbers, for each axis by itself");
    for shown in ShownUnits::choices(unit) {
        choose(ui, &shown, Some(&shown), "For every axis, coefficient and figure of this quantity");
    }
}
