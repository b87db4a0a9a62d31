//! DATA: the records, what each is used for, what was noticed while reading.

use egui::{Align, ComboBox, Layout, RichText, Sense, Ui, WidgetInfo, vec2};

use super::context::{PanelAct, PanelContext};
use super::setting_row::switch_of;
use super::{masses, refusal};
use crate::app::commands::WindowCommand;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{row, section, switch};
use sindyscope_component::{force_candidates, force_channel};
use sindyscope_modes::{BASE, BASES, BaseModel};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::record::{Channel, Record, Role, Usage};
use sindyscope_values::term::Kind;

const USAGES: [(Usage, &str, &str); 3] = [
    (Usage::Fit, "fit", "Fitted and simulated"),
    (Usage::HeldOut, "held out", "Never fitted, only simulated and scored: its error is the honest one"),
    (Usage::Off, "off", "Left out"),
];

/// Records shown without scrolling.
const MOST_ROWS: f32 = 9.0;

pub(super) fn show(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let mut asks = Vec::new();
    let addable = !context.data.records.is_empty();
    section(
        ui,
        "DATA",
        |ui| {
            // From right to left.
            let mut button = |label: &str, command: WindowCommand| {
                if ui.button(label).on_hover_text(command.hint(ui.ctx())).clicked() {
                    asks.push(PanelAct::Do(command));
                }
            };
            if addable {
                button("Add record…", WindowCommand::AddRecords);
            }
            if context.of_files {
                button("Columns…", WindowCommand::Columns);
            }
            button("Open…", WindowCommand::Open);
        },
        |_| {},
    );
    context.asks.append(&mut asks);
    if let Some(refused) = context.refused {
        refusal::show(ui, refused, context.asks);
        ui.add_space(2.0);
    }
    if context.data.records.is_empty() {
        return;
    }
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        egui::ScrollArea::vertical()
            .id_salt("records")
            .max_height(MOST_ROWS * (ROW + 1.0))
            .auto_shrink([false, true])
            .show(ui, |ui| {
                for (index, record) in context.data.records.iter().enumerate() {
                    let Some(usage) = context.edit.usage.get_mut(index) else { continue };
                    if record_row(ui, index, record, context.shown == index, usage) {
                        context.asks.push(PanelAct::ShowRecord(index));
                    }
                }
            });
    });
    if let Some(record) =
        context.data.records.get(context.shown).filter(|_| context.edit.settings.kind == Kind::SecondOrder)
    {
        let noun = if context.edit.base.model == BaseModel::Modes { "place" } else { "mass" };
        masses::show(ui, record, noun);
    }
    ui.add_space(2.0);
    component(ui, context);
    if context.edit.component {
        return;
    }
    let mut kind = context.edit.settings.kind;
    row(ui, "Equations", "Order of the equations of motion that are looked for", |ui| {
        let choices = [
            (Kind::SecondOrder, "second order", "Displacements are measured; velocities are derived from them"),
            (Kind::FirstOrder, "first order", "Every state is measured and has an equation of its own"),
        ];
        if switch(ui, &mut kind, &choices) {
            context.asks.push(PanelAct::Kind(kind));
        }
    });
    // Most that the program brings along are masses.
    let chosen = context.may_be_structure || context.edit.base.model == BaseModel::Modes;
    if kind == Kind::SecondOrder && chosen {
        base(ui, context);
    }
}

/// Whether the force along one motion is what is measured, where there is one that may be.
fn component(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let layout = context.data.layout(context.edit.settings.kind);
    let first = context.data.records.first();
    let moves = |c: &&Channel| matches!(c.role, Role::Displacement(_) | Role::Velocity(_));
    let motion: Vec<&Channel> = first.iter().flat_map(|r| r.measured()).filter(moves).collect();
    // An input in the unit of the motion is a base's, not a force.
    let of_base = |c: &Channel| matches!(c.role, Role::Input(_)) && motion.iter().any(|m| m.unit == c.unit);
    let force = layout.inputs > 0 && !first.is_some_and(|r| r.measured().any(of_base));
    let moved = layout.kind == Kind::SecondOrder && layout.freedoms == 1 && !motion.is_empty();
    let possible = context.of_files && force && moved;
    if !possible && !context.edit.component {
        return;
    }
    let hint = "What is measured is the force of a damper, mount or joint along a given motion, without a mass: its equation is \
                looked for, and what that lacks";
    row(ui, "", "", |ui| {
        ui.checkbox(&mut context.edit.component, "component without a mass").on_hover_text(hint);
    });
    if let (Some(record), true) = (first, context.edit.component) {
        force_row(ui, record, &mut context.edit.force);
    }
}

/// Which channel is the force of a component, where there are several that may be.
fn force_row(ui: &mut Ui, record: &Record, force: &mut Option<String>) {
    let candidates: Vec<&str> = force_candidates(record).map(|c| c.name.as_str()).collect();
    if candidates.len() < 2 {
        return;
    }
    let taken = force_channel(record, force.as_deref()).map(|c| c.name.clone()).ok();
    let hint = "The channel that is the force along the motion; the others are inputs beside it. Unless it is chosen here, it is the one \
                whose name or unit says so";
    row(ui, "Force", hint, |ui| {
        let shown = taken.clone().unwrap_or_else(|| "choose…".to_owned());
        let combo = ComboBox::from_id_salt("force of a component").selected_text(shown).show_ui(ui, |ui| {
            for name in candidates {
                if ui.selectable_label(taken.as_deref() == Some(name), name).clicked() {
                    *force = Some(name.to_owned());
                }
            }
        });
        let said = || WidgetInfo::labeled(egui::Role::ComboBox, true, "Force of the component");
        combo.response.widget_info(said);
    });
}

/// What the equations are made of.
fn base(ui: &mut Ui, context: &mut PanelContext<'_>) {
    let Some(setting) = BASE.first() else { return };
    let edit = &mut *context.edit;
    let before = edit.base.model;
    switch_of(ui, setting, &BASES, &mut edit.base.model);
    edit.base_settled |= edit.base.model != before;
}

/// One record; tells whether it was clicked.
fn record_row(ui: &mut Ui, index: usize, record: &Record, shown: bool, usage: &mut Usage) -> bool {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROW), Sense::click());
    let dark = ui.visuals().dark_mode;
    let colors = theme::accents(dark);
    if shown {
        ui.painter().rect_filled(rect, 4.0, colors.accent_ground);
    } else if response.hovered() || response.has_focus() {
        ui.painter().rect_filled(rect, 4.0, ui.visuals().widgets.inactive.bg_fill);
    }
    let name = &record.name;
    response.widget_info(|| WidgetInfo::selected(egui::Role::Button, true, shown, format!("Show record {name}")));
    let mut inner = ui.new_child(
        egui::UiBuilder::new().max_rect(rect.shrink2(vec2(6.0, 0.0))).layout(Layout::right_to_left(Align::Center)),
    );
    let label = |usage: Usage| USAGES.iter().find(|(u, ..)| *u == usage).map_or("", |(_, label, _)| label);
    let combo =
        ComboBox::from_id_salt(("usage", index)).width(82.0).selected_text(label(*usage)).show_ui(&mut inner, |ui| {
            for (choice, label, tooltip) in USAGES {
                ui.selectable_value(usage, choice, label).on_hover_text(tooltip);
            }
        });
    let combo = combo.response.on_hover_text("What this record is used for");
    combo.widget_info(|| WidgetInfo::labeled(egui::Role::ComboBox, true, format!("Use of record {name}")));
    inner.label(RichText::new(format!("{} s", significant_trimmed(record.duration(), 3))).weak());
    if !record.notices.is_empty() {
        let note = egui::Button::new(RichText::new("ℹ").color(colors.accent)).frame(false);
        let note = inner.add(note);
        note.widget_info(|| WidgetInfo::labeled(egui::Role::Button, true, format!("Notices of record {name}")));
        let list = |ui: &mut Ui| {
            ui.set_max_width(320.0);
            for notice in &record.notices {
                ui.add(egui::Label::new(format!("• {notice}")).wrap());
            }
        };
        egui::Popup::menu(&note).show(list);
        note.on_hover_ui(list);
    }
    inner.with_layout(Layout::left_to_right(Align::Center), |ui| {
        let mut text = RichText::new(name);
        if *usage == Usage::Off {
            text = text.weak();
        }
        ui.add(egui::Label::new(text).truncate().selectable(false));
    });
    response.clicked()
}
