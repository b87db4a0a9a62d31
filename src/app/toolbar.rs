//! The bar at the top: the file, the rooms, what helps everywhere.

use egui::{Align, Layout, Margin, Panel, RichText, Ui, vec2};

use super::commands::{CLASSICS_HINT, WindowCommand};
use super::problem::file_name;
use super::state::{Room, Sample, Source, State};
use super::theme::ROW;
use super::widgets::{icon, switch};
use crate::app::records::OpenRecords;

/// Width kept for the file's name, points, and its most characters.
const TITLE: f32 = 190.0;
const LONGEST: usize = 22;

/// Width of the signs on the right before they were drawn for the first time, points.
const SIGNS: f32 = 200.0;

/// What the bar shows.
pub(crate) struct Toolbar<'a> {
    pub(crate) state: &'a State,
    pub(crate) data: &'a OpenRecords,
    /// Whether there is something that a picture or a report can show.
    pub(crate) drawn: bool,
    /// Whether there are equations to export.
    pub(crate) exported: bool,
    pub(crate) can_undo: bool,
    pub(crate) can_redo: bool,
    pub(crate) opening: bool,
}

/// What a person asked for in the bar.
pub(crate) enum ToolbarAct {
    Do(WindowCommand),
    Recent(std::path::PathBuf),
}

pub(crate) fn show(ui: &mut Ui, bar: &Toolbar<'_>) -> Vec<ToolbarAct> {
    let mut asked = Vec::new();
    let frame = egui::Frame::new().fill(ui.visuals().panel_fill).inner_margin(Margin::symmetric(12, 5));
    Panel::top("toolbar").resizable(false).frame(frame).show(ui, |ui| {
        ui.horizontal(|ui| {
            ui.set_min_height(ROW + 2.0);
            ui.label(RichText::new("Sindyscope").size(15.0).strong());
            ui.add_space(6.0);
            // The rooms stay where they are, however long the file's name is.
            let size = vec2(TITLE, ROW + 2.0);
            ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
                ui.set_min_size(size);
                let name = title(bar);
                let menu = ui.menu_button(format!("{} ⏷", shortened(&name)), |ui| file_menu(ui, bar, &mut asked));
                menu.response.on_hover_text(name);
            });
            if Room::ALL.len() > 1 {
                ui.add_space(12.0);
                let mut room = bar.state.shown.room;
                if switch(ui, &mut room, &Room::ALL.map(|r| (r, r.label(), r.tooltip()))) {
                    asked.push(ToolbarAct::Do(WindowCommand::Room(room)));
                }
            }
            // Laid out from left to right, so that Tab goes that way too; the width is that of the frame before.
            let id = egui::Id::unique("toolbar signs");
            let width = ui.data(|d| d.get_temp(id)).unwrap_or(SIGNS);
            ui.add_space((ui.available_width() - width).max(0.0));
            let signs = ui.scope(|ui| {
                ui.spacing_mut().item_spacing.x = 2.0;
                let dark = ui.visuals().dark_mode;
                let ctx = ui.ctx().clone();
                let mut button = |ui: &mut Ui, sign: &str, command: WindowCommand, enabled: bool| {
                    if icon(ui, sign, command.spec().label, &command.hint(&ctx), enabled).clicked() {
                        asked.push(ToolbarAct::Do(command));
                    }
                };
                button(ui, "⟲", WindowCommand::Undo, bar.can_undo);
                button(ui, "⟳", WindowCommand::Redo, bar.can_redo);
                ui.add_space(8.0);
                button(ui, "🔍", WindowCommand::Palette, true);
                button(ui, "📷", WindowCommand::PlotPicture, bar.drawn);
                button(ui, if dark { "☀" } else { "🌙" }, WindowCommand::Theme, true);
                button(ui, "?", WindowCommand::Help, true);
            });
            let drawn = signs.response.rect.width();
            if (drawn - width).abs() > 0.5 {
                ui.data_mut(|d| d.insert_temp(id, drawn));
                ui.ctx().request_repaint();
            }
        });
    });
    asked
}

fn title(bar: &Toolbar<'_>) -> String {
    if let (true, Room::Identify, Some(table)) = (bar.state.series.shown, bar.state.shown.room, &bar.state.series.table)
    {
        return file_name(table);
    }
    match (&bar.state.project, bar.data.records.is_empty()) {
        (Some(project), _) => file_name(project),
        (None, true) if bar.opening => "opening…".to_owned(),
        (None, true) => "no file".to_owned(),
        (None, false) => bar.data.title.clone(),
    }
}

/// A name with its middle left out where it is longer than the bar has room for.
fn shortened(name: &str) -> String {
    let count = name.chars().count();
    if count <= LONGEST {
        return name.to_owned();
    }
    let (head, tail) = (LONGEST / 2, LONGEST - LONGEST / 2 - 1);
    let first: String = name.chars().take(head).collect();
    let last: String = name.chars().skip(count - tail).collect();
    format!("{first}…{last}")
}

fn file_menu(ui: &mut Ui, bar: &Toolbar<'_>, asked: &mut Vec<ToolbarAct>) {
    ui.set_min_width(240.0);
    let open = !bar.data.records.is_empty();
    let mut entry = |ui: &mut Ui, command: WindowCommand, enabled: bool| {
        if command.menu(ui, enabled) {
            asked.push(ToolbarAct::Do(command));
        }
    };
    entry(ui, WindowCommand::Open, true);
    entry(ui, WindowCommand::OpenPath, true);
    entry(ui, WindowCommand::Stream, true);
    entry(ui, WindowCommand::Series, true);
    entry(ui, WindowCommand::AddRecords, open);
    entry(ui, WindowCommand::Columns, matches!(bar.state.document.source, Source::Files(_)) && open);
    ui.separator();
    ui.weak("Samples");
    for sample in Sample::OWN {
        entry(ui, WindowCommand::Sample(sample), true);
    }
    let menu = ui.menu_button("Classics", WindowCommand::classics);
    menu.response.on_hover_text(CLASSICS_HINT);
    let classic = menu.inner.flatten();
    entry(ui, WindowCommand::Demonstration, true);
    entry(ui, WindowCommand::Lessons, true);
    ui.separator();
    entry(ui, WindowCommand::SaveProject, open);
    entry(ui, WindowCommand::SaveProjectAs, open);
    entry(ui, WindowCommand::ExportModel, bar.exported);
    entry(ui, WindowCommand::SaveReport, bar.drawn);
    entry(ui, WindowCommand::PlotPicture, bar.drawn);
    entry(ui, WindowCommand::WindowPicture, true);
    ui.separator();
    entry(ui, WindowCommand::Reset, open);
    entry(ui, WindowCommand::Close, open);
    entry(ui, WindowCommand::Quit, true);
    asked.extend(classic.map(ToolbarAct::Do));
    if !bar.state.recent.is_empty() {
        ui.separator();
        ui.weak("Recent files");
        for path in &bar.state.recent {
            if ui.button(file_name(path)).on_hover_text(path.display().to_string()).clicked() {
                asked.push(ToolbarAct::Recent(path.clone()));
            }
        }
    }
}
