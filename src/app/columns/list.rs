//! The list of columns: number, name, first values, and what each is used for.

use crate::app::plot::palette::Painted as _;
use egui::{Align, ComboBox, DragValue, Label, Layout, RichText, ScrollArea, Sense, Stroke, Ui, pos2, vec2};

use super::draft::Draft;
use crate::app::plot::palette::Ink;
use crate::app::theme::{self, ROW};
use crate::app::widgets::line;
use sindyscope_files::{ColumnOverview, ColumnUse, TableOverview};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::record::Role;

/// Widths of the columns of the list, points; the name takes what is left.
const NUMBER: f32 = 34.0;
const VALUES: f32 = 150.0;
const SKETCH: f32 = 90.0;
const USE: f32 = 124.0;
const INDEX: f32 = 44.0;

/// Most masses or inputs.
const MOST: usize = 64;

/// A use that is offered: its name, and its role if it is a channel.
struct UseOffer {
    name: &'static str,
    tooltip: &'static str,
    used: Option<ColumnUse>,
}

const OFFERS: [UseOffer; 8] = [
    UseOffer { name: "not used", tooltip: "The column is left out", used: None },
    UseOffer { name: "time", tooltip: "When the samples were taken", used: Some(ColumnUse::Time) },
    UseOffer {
        name: "displacement",
        tooltip: "A displacement or an angle of a mass; of first-order equations a state",
        used: Some(ColumnUse::Channel(Role::Displacement(0))),
    },
    UseOffer { name: "velocity", tooltip: "A mass's velocity", used: Some(ColumnUse::Channel(Role::Velocity(0))) },
    UseOffer {
        name: "acceleration",
        tooltip: "A mass's acceleration",
        used: Some(ColumnUse::Channel(Role::Acceleration(0))),
    },
    UseOffer {
        name: "force",
        tooltip: "A force or a moment that drives the motion: an input",
        used: Some(ColumnUse::Channel(Role::Input(0))),
    },
    UseOffer {
        name: "base motion",
        tooltip: "The displacement of the base that shakes the masses: an input",
        used: Some(ColumnUse::Channel(Role::Input(0))),
    },
    UseOffer {
        name: "record",
        tooltip: "Tells which record a row belongs to: rows alike are one record",
        used: Some(ColumnUse::Trajectory),
    },
];

pub(super) fn show(ui: &mut Ui, table: &TableOverview, draft: &mut Draft) {
    let search = draft.search.trim().to_lowercase();
    let listed: Vec<usize> = (0..table.columns.len())
        .filter(|c| !draft.chosen_only || draft.uses.get(*c).is_some_and(Option::is_some))
        .filter(|c| search.is_empty() || table.label(*c).to_lowercase().contains(&search))
        .collect();
    ui.spacing_mut().item_spacing = vec2(6.0, 1.0);
    if listed.is_empty() {
        ui.weak("no column is called so");
        return;
    }
    header(ui);
    ScrollArea::vertical().auto_shrink([false, false]).show_rows(ui, ROW, listed.len(), |ui, rows| {
        for column in rows.filter_map(|row| listed.get(row).copied()) {
            let label = table.label(column);
            row(ui, column, &label, &table.columns[column], &mut draft.uses);
        }
    });
}

/// Width of the names, points.
fn name_width(ui: &Ui) -> f32 {
    (ui.max_rect().width() - (NUMBER + VALUES + SKETCH + USE + INDEX + 6.0 * 6.0 + 12.0)).max(60.0)
}

/// What stands in the columns of the list.
fn header(ui: &mut Ui) {
    ui.allocate_ui_with_layout(vec2(ui.available_width(), ROW), Layout::left_to_right(Align::Center), |ui| {
        let name = name_width(ui);
        let heads =
            [(NUMBER, ""), (name, "column"), (VALUES + SKETCH + 6.0, "first values"), (USE, "used as"), (INDEX, "no.")];
        for (width, text) in heads {
            cell(ui, width, |ui| ui.label(RichText::new(text).weak().small()));
        }
    });
}

fn row(ui: &mut Ui, index: usize, label: &str, column: &ColumnOverview, uses: &mut [Option<ColumnUse>]) {
    let Some(used) = uses.get(index).copied() else { return };
    line(ui, ROW, |ui| {
        let dark = ui.visuals().dark_mode;
        if used.is_some() {
            ui.painter().rect_filled(ui.max_rect(), 3.0, theme::accents(dark).accent_ground.gamma_multiply(0.5));
        }
        cell(ui, NUMBER, |ui| ui.weak((index + 1).to_string()));
        let name = name_width(ui);
        cell(ui, name, |ui| ui.add(Label::new(label).truncate()).on_hover_text(label));
        cell(ui, VALUES, |ui| {
            let shown: Vec<String> = column.first.iter().take(3).map(|v| significant_trimmed(*v, 4)).collect();
            ui.add(Label::new(RichText::new(shown.join("  ")).weak().small()).truncate())
        });
        sketch(ui, column, used.is_some());
        choice(ui, index, label, column, uses);
    });
}

fn cell<R>(ui: &mut Ui, width: f32, body: impl FnOnce(&mut Ui) -> R) {
    ui.allocate_ui_with_layout(vec2(width, ROW), Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_size(vec2(width, ROW));
        ui.set_max_width(width);
        body(ui);
    });
}

/// The first values as a line.
fn sketch(ui: &mut Ui, column: &ColumnOverview, used: bool) {
    let (rect, response) = ui.allocate_exact_size(vec2(SKETCH, ROW), Sense::hover());
    let finite = || column.first.iter().enumerate().filter(|(_, v)| v.is_finite());
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (_, v)| (l.min(*v), h.max(*v)));
    let span = if high > low { high - low } else { 1.0 };
    let last = column.first.len().max(2) - 1;
    let inside = rect.shrink2(vec2(2.0, 4.0));
    let line = finite()
        .map(|(i, v)| {
            let up = if high > low { (v - low) / span } else { 0.5 };
            pos2(inside.left() + inside.width() * i as f32 / last as f32, inside.bottom() - inside.height() * up as f32)
        })
        .collect();
    let dark = ui.visuals().dark_mode;
    let color = if used { Ink::Measured.color(dark) } else { ui.visuals().weak_text_color() };
    ui.painter().line(line, Stroke::new(1.0, color));
    if low <= high {
        let count = column.first.len();
        let [low, high] = [low, high].map(|v| significant_trimmed(v, 4));
        response.on_hover_text(format!("the first {count} values: {low} to {high} {}", column.unit));
    }
}

/// What the column is used for, and for which mass or input.
fn choice(ui: &mut Ui, index: usize, label: &str, column: &ColumnOverview, uses: &mut [Option<ColumnUse>]) {
    let used = uses[index];
    let combo = ComboBox::from_id_salt(("use of column", index)).width(USE - 8.0).selected_text(name(used, column));
    let combo = combo.show_ui(ui, |ui| {
        for offer in &OFFERS {
            let on = name(used, column) == offer.name;
            if ui.selectable_label(on, offer.name).on_hover_text(offer.tooltip).clicked() {
                choose(uses, index, offer.used);
            }
        }
    });
    combo.response.accessible_name(format!("Use of {label}"));
    let Some(ColumnUse::Channel(role)) = uses[index] else { return };
    let mut number = role.index() + 1;
    let field = DragValue::new(&mut number).range(1..=MOST).speed(0.05);
    let what = if matches!(role, Role::Input(_)) { "input" } else { "mass" };
    let response = ui.add_sized(vec2(INDEX - 6.0, ROW - 2.0), field);
    let hint =
        if what == "mass" { "Which mass (degree of freedom) this is of" } else { "Which of several inputs this is" };
    let response = response.on_hover_text(hint).accessible_name(format!("Number of {label}"));
    if response.changed() {
        uses[index] = Some(ColumnUse::Channel(at(role, number - 1)));
    }
}

/// The name under which a use is offered.
fn name(used: Option<ColumnUse>, column: &ColumnOverview) -> &'static str {
    match used {
        None => "not used",
        Some(ColumnUse::Time) => "time",
        Some(ColumnUse::Trajectory) => "record",
        Some(ColumnUse::Channel(Role::Displacement(_))) => "displacement",
        Some(ColumnUse::Channel(Role::Velocity(_))) => "velocity",
        Some(ColumnUse::Channel(Role::Acceleration(_))) => "acceleration",
        // Which of the two it is, the unit says; the equations treat both as inputs.
        Some(ColumnUse::Channel(Role::Input(_)))
            if sindyscope_values::record::metres(&column.unit).is_some() && !column.unit.is_empty() =>
        {
            "base motion"
        }
        Some(ColumnUse::Channel(Role::Input(_))) => "force",
    }
}

/// Uses a column otherwise: for the first number that is free; what there is only one of is taken from another column.
fn choose(uses: &mut [Option<ColumnUse>], index: usize, offered: Option<ColumnUse>) {
    uses[index] = None;
    if let Some(ColumnUse::Time | ColumnUse::Trajectory) = offered {
        uses.iter_mut().filter(|u| **u == offered).for_each(|u| *u = None);
    }
    uses[index] = match offered {
        Some(ColumnUse::Channel(role)) => {
            let free = (0..).map(|n| ColumnUse::Channel(at(role, n))).find(|used| !uses.contains(&Some(*used)));
            free.or(offered)
        }
        other => other,
    };
}

/// The same role of another mass or input.
fn at(role: Role, index: usize) -> Role {
    match role {
        Role::Displacement(_) => Role::Displacement(index),
        Role::Velocity(_) => Role::Velocity(index),
        Role::Acceleration(_) => Role::Acceleration(index),
        Role::Input(_) => Role::Input(index),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_use_takes_the_first_free_number_and_there_is_one_time() {
        let displacement = |n| Some(ColumnUse::Channel(Role::Displacement(n)));
        let mut uses = vec![Some(ColumnUse::Time), None, None, displacement(1)];
        choose(&mut uses, 1, displacement(0));
        choose(&mut uses, 2, displacement(0));
        assert_eq!(uses, [Some(ColumnUse::Time), displacement(0), displacement(2), displacement(1)]);
        choose(&mut uses, 2, Some(ColumnUse::Time));
        assert_eq!(uses, [None, displacement(0), Some(ColumnUse::Time), displacement(1)]);
    }
}
