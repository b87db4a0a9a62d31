//! Rows of numbers and choices, as the rig and the class mode have them.

use std::ops::RangeInclusive;

use egui::Ui;

use crate::app::widgets::{SliderRow, Spread, row};
use sindyscope_values::format::number::significant_trimmed;

/// A number with its unit, as it is typed.
pub(super) fn with_unit(unit: &str) -> impl Fn(f64) -> String {
    // Small numbers have zeros enough.
    move |value| {
        let digits = if value.abs() < 0.01 { 2 } else { 3 };
        format!("{} {unit}", significant_trimmed(value, digits)).trim_end().to_owned()
    }
}

/// One number over decades.
pub(super) fn number(
    ui: &mut Ui,
    value: &mut f64,
    label: &str,
    tooltip: &str,
    unit: &str,
    range: RangeInclusive<f64>,
) -> bool {
    let spoken = if unit.is_empty() { String::new() } else { format!(", {unit}") };
    let (spread, format) = (Spread::Logarithmic, &with_unit(unit));
    SliderRow { unit: &spoken, spread, format, ..SliderRow::new(label, tooltip, range) }.show(ui, value)
}

/// A share in percent, from nothing on.
pub(super) fn share(ui: &mut Ui, value: &mut f64, label: &str, tooltip: &str, most: f64) {
    percent(ui, value, (label, tooltip), 0.01..=100.0 * most, Spread::LogarithmicFromZero);
}

/// A share in percent within a range.
pub(super) fn percent(
    ui: &mut Ui,
    value: &mut f64,
    (label, tooltip): (&str, &str),
    range: RangeInclusive<f64>,
    spread: Spread,
) {
    let mut percent = 100.0 * *value;
    let setting = SliderRow { unit: "%", spread, format: &with_unit("%"), ..SliderRow::new(label, tooltip, range) };
    if setting.show(ui, &mut percent) {
        *value = percent / 100.0;
    }
}

/// A seed, from 1 on.
pub(super) fn seed(ui: &mut Ui, value: &mut u64, tooltip: &str, most: u32) {
    let mut seed = *value as f64;
    let format: &dyn Fn(f64) -> String = &|v| format!("{v:.0}");
    if (SliderRow { grid: 1.0, format, ..SliderRow::new("Seed", tooltip, 1.0..=f64::from(most)) }).show(ui, &mut seed) {
        *value = seed as u64;
    }
}

/// A choice from a list of values with their labels and hints; the new one, if another is chosen.
pub(super) fn combo<T: Copy + PartialEq>(
    ui: &mut Ui,
    name: &str,
    tooltip: &str,
    chosen: T,
    list: &[(T, &str, &str)],
) -> Option<T> {
    let mut picked = None;
    row(ui, name, tooltip, |ui| {
        let shown = list.iter().find(|(value, ..)| *value == chosen).map_or("", |(_, label, _)| label);
        let width = ui.available_width();
        let combo = egui::ComboBox::from_id_salt(name).width(width).truncate().selected_text(shown).show_ui(ui, |ui| {
            for (value, label, hint) in list {
                if ui.selectable_label(*value == chosen, *label).on_hover_text(*hint).clicked() {
                    picked = Some(*value);
                }
            }
        });
        combo.response.accessible_name(name);
    });
    picked.filter(|value| *value != chosen)
}
