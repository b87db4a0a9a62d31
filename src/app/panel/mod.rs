//! The two columns beside the plots: data and settings on the left, what was found on the right.

mod data;
mod equation;
mod fit;
mod library;
mod masses;
mod physics;
mod preparation;
mod questions;
mod refusal;
mod smoothing;
mod threshold;

use egui::{ComboBox, Margin, Panel, ScrollArea, Ui, UiBuilder};

use super::commands::Command;
use super::open::Refused;
use super::questions::Bought;
use super::queue::JobProgress;
use super::records::OpenRecords;
use super::state::{Edit, Room};
use super::widgets::{SliderRow, row, switch};
use sindyscope_core::prepare::Preparation;
use sindyscope_core::remedy::Remedy;
use sindyscope_core::setting::{NamedValue, Setting, Slider, Spread};
use sindyscope_core::study::{Calibration, Settings};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::term::{Kind, Term};

/// What a panel asks the window to do, beside changing the settings.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PanelAct {
    /// A command.
    Do(Command),
    /// Show another record.
    ShowRecord(usize),
    /// Read the records as data of this kind.
    Kind(Kind),
    /// Take a remedy over.
    Remedy(Remedy),
    /// Prepare the records by these steps.
    Prepare(Vec<Preparation>),
    /// Show the whole record above the plots, to be cut by dragging, or hide it.
    Cut,
    /// Choose where a file is that is not where it was.
    Locate,
    /// Find what a step takes out of a channel, with the equation.
    Calibrate { step: usize, sought: Calibration },
    /// Stop choosing settings, or finding what a step takes out.
    StopChoosing,
}

/// What the panels show and change.
pub(crate) struct PanelContext<'a> {
    pub(crate) bench: &'a OpenRecords,
    pub(crate) edit: &'a mut Edit,
    pub(crate) suggestion: &'a Settings,
    /// Whether the records come from files, whose columns can be chosen.
    pub(crate) of_files: bool,
    /// The record that the views show.
    pub(crate) shown: usize,
    /// Whether the whole record is shown above the plots, to be cut.
    pub(crate) cutting: bool,
    /// Whether settings are being chosen.
    pub(crate) choosing: Option<JobProgress>,
    /// The step whose value is being found.
    pub(crate) calibrating: Option<usize>,
    /// What was not opened, and why.
    pub(crate) refused: Option<&'a Refused>,
    /// What the answers to the open questions would buy.
    pub(crate) bought: &'a [Bought],
    pub(crate) typing: &'a mut Typing,
    pub(crate) asks: &'a mut Vec<PanelAct>,
}

/// What is being typed and not yet taken over.
#[derive(Clone, Debug, Default)]
pub(crate) struct Typing {
    /// Terms to add to the library.
    pub(crate) terms: String,
    /// Known physics to add.
    pub(crate) known: String,
    /// The term whose coefficient is being typed, with the text.
    pub(crate) fixed: Option<(Term, f64)>,
}

/// The left column: data and settings; in the other rooms, what counts there.
pub(crate) fn left(
    ui: &mut Ui,
    desk: &mut PanelContext<'_>,
    room: Room,
    own: impl FnOnce(&mut Ui, &mut PanelContext<'_>),
) {
    controls(ui, |ui| {
        data::show(ui, desk);
        if desk.bench.records.is_empty() {
            return;
        }
        preparation::show(ui, desk);
        match room {
            Room::Identify => {
                smoothing::show(ui, desk);
                library::show(ui, desk);
                threshold::show(ui, desk);
                physics::show(ui, desk);
            }
            Room::Missing | Room::Report => own(ui, desk),
            // That room has a column of its own.
            Room::Rig => {}
        }
        ui.add_space(8.0);
    });
}

/// The right column: what was found.
pub(crate) fn right(ui: &mut Ui, desk: &mut PanelContext<'_>, now: f64) {
    findings(ui, |ui| {
        fit::show(ui, desk);
        equation::show(ui, desk, now);
        if let Some(outcome) = &desk.bench.outcome {
            physics::found(ui, outcome);
        }
        questions::show(ui, desk);
        fit::warnings(ui, desk);
        ui.add_space(8.0);
    });
}

/// A setting's row with a slider, as the table has it.
fn slider(setting: &'static Setting<Settings>) -> SliderRow<'static> {
    let any = Slider { least: 0.0, most: 1.0, spread: Spread::Linear, step: 0.0 };
    let Slider { least, most, spread, step } = setting.slider.unwrap_or(any);
    let format: &dyn Fn(f64) -> String = match step {
        0.0 => &|v| significant_trimmed(v, 3),
        _ => &|v| format!("{v:.0}"),
    };
    SliderRow {
        label: setting.label,
        tooltip: setting.help,
        unit: setting.unit,
        range: least..=most,
        spread,
        grid: step,
        suggestion: None,
        marks: &[],
        format,
    }
}

/// A setting's row in which one of several values is picked from a list; `same` tells which of them a value is.
fn pick<V: Copy>(
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
fn switch_of<V: Copy + PartialEq, const N: usize>(
    ui: &mut Ui,
    setting: &'static Setting<Settings>,
    choices: &[NamedValue<V>; N],
    value: &mut V,
) {
    row(ui, setting.label, setting.help, |ui| {
        switch(ui, value, &choices.each_ref().map(|c| (c.value, c.label, c.help)))
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
