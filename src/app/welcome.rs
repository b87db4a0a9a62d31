//! The centre while no file is open: some samples, where to drop a file, what a file should look like.

use egui::{Align, Layout, RichText, Sense, Stroke, StrokeKind, Ui, vec2};

use super::commands::{CLASSICS_HINT, WindowCommand};
use super::state::Sample;
use super::theme;

/// Samples that stand side by side.
const SAMPLES_IN_A_ROW: usize = 4;

const EXAMPLE: &str = "t [s], x [mm], u [N]
0.000,  0.012, 1.00
0.001,  0.015, 0.99
0.002,  0.021, 0.97";

pub(crate) fn show(ui: &mut Ui, opening: bool) -> Option<WindowCommand> {
    let mut asked = None;
    let colors = theme::accents(ui.visuals().dark_mode);
    let width = ui.available_width().min(620.0);
    let side = 0.5 * (ui.available_width() - width);
    ui.add_space((0.5 * (ui.available_height() - 500.0)).max(8.0));
    ui.horizontal(|ui| {
        ui.add_space(side);
        ui.allocate_ui_with_layout(vec2(width, 500.0), Layout::top_down(Align::Min), |ui| {
            ui.set_width(width);
            if opening {
                ui.label(RichText::new("Opening…").size(20.0));
                return;
            }
            ui.label(RichText::new("Open a measurement").size(20.0).strong());
            ui.weak("Sindyscope finds the equation of motion of a vibrating thing and simulates it over the measurement");
            ui.add_space(12.0);
            let (zone, response) = ui.allocate_exact_size(vec2(width, 92.0), Sense::click());
            let fill = if response.hovered() { colors.accent_ground } else { ui.visuals().faint_bg_color };
            ui.painter().rect(zone, 8.0, fill, Stroke::new(1.0, colors.accent), StrokeKind::Inside);
            let font = egui::FontId::proportional(15.0);
            let text = "Drop measurements or a project here, or click to open them";
            let ink = ui.visuals().text_color();
            ui.painter().text(zone.center(), egui::Align2::CENTER_CENTER, text, font, ink);
            response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, text));
            if response.on_hover_text(WindowCommand::Open.hint(ui.ctx())).clicked() {
                asked = Some(WindowCommand::Open);
            }
            ui.add_space(14.0);
            ui.label(RichText::new("Or try a sample").strong());
            for row in [&Sample::OWN, &Sample::CLASSICS[..SAMPLES_IN_A_ROW]] {
                ui.horizontal(|ui| {
                    let count = SAMPLES_IN_A_ROW as f32;
                    let each = (width - (count - 1.0) * ui.spacing().item_spacing.x) / count;
                    for sample in row {
                        let button = egui::Button::new(sample.label()).min_size(vec2(each, 34.0));
                        if ui.add(button).on_hover_text(sample.tooltip()).clicked() {
                            asked = Some(WindowCommand::Sample(*sample));
                        }
                    }
                });
            }
            ui.horizontal(|ui| {
                let each = (width - 2.0 * ui.spacing().item_spacing.x) / 3.0;
                asked = lists(ui, vec2(each, 30.0)).or(asked);
            });
            ui.add_space(14.0);
            ui.label(RichText::new("What a file should look like").strong());
            egui::Frame::new().fill(ui.visuals().faint_bg_color).corner_radius(6).inner_margin(10).show(ui, |ui| {
                ui.set_width(width - 20.0);
                ui.label(RichText::new(EXAMPLE).monospace());
            });
            ui.add_space(2.0);
            ui.add(
                egui::Label::new(
                    RichText::new(
                        "Time, a displacement (x, several: x1, x2, …) and what drives it (u: a force or the base's motion), evenly \
                         sampled, in a CSV with a header; several files, or a column `record`, make several records. MATLAB, HDF5, NumPy, \
                         Excel, OpenDocument, LabVIEW, TDMS, UFF, MDF and WAV files open alike",
                    )
                    .weak(),
                )
                .wrap(),
            );
        });
    });
    asked
}

/// What leads to more than one record: the classics, a hidden effect, the lessons.
fn lists(ui: &mut Ui, size: egui::Vec2) -> Option<WindowCommand> {
    let button = egui::Button::new("All classics ⏷").min_size(size);
    let (response, menu) = egui::containers::menu::MenuButton::from_button(button).ui(ui, WindowCommand::classics);
    response.on_hover_text(CLASSICS_HINT);
    let mut asked = menu.and_then(|menu| menu.inner);
    for command in [WindowCommand::Demonstration, WindowCommand::Lessons] {
        let spec = command.spec();
        if ui.add(egui::Button::new(spec.label).min_size(size)).on_hover_text(spec.tooltip).clicked() {
            asked = Some(command);
        }
    }
    asked
}
