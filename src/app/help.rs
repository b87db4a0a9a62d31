//! F1: keys, mouse, and how to read the window.

use egui::{Context, Grid, RichText, ScrollArea, Window};

use super::commands::WindowCommand;

const READING: &[(&str, &str)] = &[
    (
        "Measured and identified",
        "the wide line is the measurement, the narrow one on it the identified model's simulated response",
    ),
    ("E(t)", "what the response misses, with the measurement noise as a dashed line: a good model stays near it"),
    (
        "Held out",
        "a record that is never fitted, only simulated: its error is the honest figure, and the one in large type",
    ),
    (
        "Prepare",
        "steps that are done to the records before they are studied, in order; the measurement itself stays as it is, and \
         everything you decide is kept within a second, also if the program is killed",
    ),
    ("Threshold", "terms smaller than it are dropped; the marks under the slider show at which value each one falls"),
    (
        "What's missing",
        "a walk in four steps: where response and measurement part, which effect that is, what it would change, and whether \
         the gap shrinks on data never fitted; each effect keeps its colour in plots, cards and the equation",
    ),
    (
        "Virtual rig",
        "a plant whose every number you move: its motion is drawn, recorded and fitted at once, the truth beside what was found; \
         lessons notice what you do, and the class mode hides an effect to be guessed",
    ),
    (
        "Report",
        "tick the sections, drag them or use the arrows, and write between them; the pages in the centre are the ones that are saved",
    ),
    ("Shares", "the bars in the equation: how much of the forces' RMS a term carries"),
];

const MOUSE: &[(&str, &str)] = &[
    ("Drag in a plot", "move along"),
    ("Right drag", "zoom into a box"),
    ("Ctrl + wheel", "zoom at the pointer"),
    ("Double-click", "show all data"),
    ("Legend entry", "hide or show a curve; Alt-click shows it alone"),
    ("Slider, arrow keys", "one step; with Shift a fine one"),
    ("Slider, Shift + drag", "follow slowly"),
    ("Slider, double-click", "back to what the program chose"),
    ("A term of the equation", "keep it, never use it, or fix its coefficient"),
];

/// Draws the help while it is open; gives the command whose button was clicked.
pub(crate) fn show(ctx: &Context, open: &mut bool) -> Option<WindowCommand> {
    let mut asked = None;
    if *open && ctx.input_mut(|i| i.consume_key(egui::Modifiers::NONE, egui::Key::Escape)) {
        *open = false;
    }
    let middle = ctx.content_rect().center();
    Window::new("Help")
        .open(open)
        .default_width(560.0)
        .default_height(520.0)
        .collapsible(false)
        .pivot(egui::Align2::CENTER_CENTER)
        .default_pos(middle)
        .show(ctx, |ui| {
            ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
                let spec = WindowCommand::SaveLog.spec();
                if ui.button(spec.label).on_hover_text(spec.tooltip).clicked() {
                    asked = Some(WindowCommand::SaveLog);
                }
                pairs(ui, "How to read it", READING.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())));
                pairs(ui, "Mouse", MOUSE.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())));
                let mut groups: Vec<&str> = Vec::new();
                for spec in WindowCommand::all().into_iter().map(WindowCommand::spec) {
                    if !groups.contains(&spec.group) {
                        groups.push(spec.group);
                    }
                }
                for group in groups {
                    let of_group =
                        WindowCommand::all().into_iter().map(WindowCommand::spec).filter(|s| s.group == group);
                    let keyed: Vec<_> = of_group
                        .filter_map(|s| {
                            let key = ctx.format_shortcut(&s.key?);
                            Some((key, format!("{}: {}", s.label.trim_end_matches('…'), s.tooltip)))
                        })
                        .collect();
                    if !keyed.is_empty() {
                        pairs(ui, group, keyed.into_iter());
                    }
                }
            });
        });
    asked
}

fn pairs(ui: &mut egui::Ui, title: &str, rows: impl Iterator<Item = (String, String)>) {
    ui.add_space(6.0);
    ui.label(RichText::new(title).strong());
    Grid::new(title).num_columns(2).min_col_width(150.0).spacing([12.0, 4.0]).show(ui, |ui| {
        for (name, text) in rows {
            ui.label(name);
            ui.add(egui::Label::new(RichText::new(text).weak()).wrap());
            ui.end_row();
        }
    });
}
