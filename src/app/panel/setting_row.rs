//! Rows of settings, as the table of settings has them.

use egui::{ComboBox, Ui};

use crate::app::widgets::{SliderRow, row, switch};
use sindyscope_core::setting::{NamedValue, Setting, Slider, Spread};
use sindyscope_core::study::Settings;
use sindyscope_values::format::number::significant_trimmed;

/// A setting's row with a slider, as the table has it.
pub(super) fn slider(setting: &'static Setting<Settings>) -> SliderRow<'static> {
    let any = Slider { least: 0.0, most: 1.0, spread: Spread::Linear, step: 0.0 };
    let Slider { least, most, spread, step } = setting.slider.unwrap_or(any);
    let format: &dyn Fn(f64) -> String = match step {
        0.0 => &|v| significant_trimmed(v, 3),
        _ => &|v| format!("{v:.0}"),
    };
    SliderRow {
        unit: setting.unit,
        spread,
        grid: step,
        format,
        ..SliderRow::new(setting.label, setting.help, least..=most)
    }
}

/// A setting's row in which one of several values is picked from a list; `same` tells which of them a value is.
pub(super) fn pick<V: Copy>(
    ui: &mut Ui,
    setting: &'static Setting<Settings>,
    choices: &[NamedValue<V>],
    value: &mut V,
    same: impl Fn(&V, &V) -> bool,
) {
    row(ui, setting.label, setting.help, |ui| {
        let shown = choices.iter().find(|c| same(&c.value, value)).map_or("", |c| c.label);
        let width = ui.available_width();
        let combo = ComboBox::from_id_salt(setting.name).width(width).selected_text(shown).show_ui(ui, |ui| {
            for choice in choices {
                let chosen = same(&choice.value, value);
                if ui.selectable_label(chosen, choice.label).on_hover_text(choice.help).clicked() && !chosen {
                    *value = choice.value;
                }
            }
        });
        combo.response.accessible_name(setting.label);
    });
}

/// A setting's row with a switch of a few positions.
pub(super) fn switch_of<T, V: Copy + PartialEq, const N: usize>(
    ui: &mut Ui,
    setting: &'static Setting<T>,
    choices: &[NamedValue<V>; N],
    value: &mut V,
) {
    row(ui, setting.label, setting.help, |ui| {
        switch(ui, value, &choices.each_ref().map(|c| (c.value, c.label, c.help)))
    });
}
