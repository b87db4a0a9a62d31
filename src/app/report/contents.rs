//! The contents of the report in the left column: a list of sections and texts.

use egui::{Align, CursorIcon, Key, Layout, Rect, RichText, Sense, Ui, WidgetInfo, vec2};

use crate::app::theme::{self, ROW};
use crate::app::widgets::{icon, line, row, section};
use sindyscope_report::document::{Arrangement, Item, Section};

/// Width of the handle in front of an entry, points.
const HANDLE: f32 = 18.0;
/// Width of the buttons behind it, points.
const BUTTONS: f32 = 60.0;

/// What is going on in the list.
#[derive(Debug, Default)]
pub(super) struct Contents {
    /// The entry that is being dragged.
    dragged: Option<usize>,
    /// A text that was just added is to be typed in.
    fresh: bool,
}

/// What is to be done to the list once it was drawn.
enum ContentsChange {
    Move(usize, usize),
    Remove(usize),
}

impl Contents {
    /// Draws the list; what is changed in it is the person's. For the sections in `empty` the study has nothing.
    pub(super) fn show(&mut self, ui: &mut Ui, report: &mut Arrangement, empty: &[Section], usual_title: &str) {
        let mut reset = false;
        let changed = !report.is_usual();
        section(
            ui,
            "REPORT",
            |ui| {
                let hint = "Every section again, in the usual order; your texts go";
                reset = changed && icon(ui, "↺", "Usual contents", hint, true).clicked();
            },
            |ui| {
                title_row(ui, report, usual_title);
                if ui
                    .button("Add text")
                    .on_hover_text("A paragraph of your own, at the top; move it where it belongs")
                    .clicked()
                {
                    report.items.insert(0, Item::Text { text: String::new() });
                    self.fresh = true;
                }
                self.entries(ui, report, empty);
            },
        );
        if reset {
            report.items = Arrangement::default().items;
        }
    }

    fn entries(&mut self, ui: &mut Ui, report: &mut Arrangement, empty: &[Section]) {
        let mut change = None;
        let mut rects: Vec<Rect> = Vec::new();
        let count = report.items.len();
        for (k, item) in report.items.iter_mut().enumerate() {
            let top = ui.cursor().top();
            let dragged = self.dragged == Some(k);
            line(ui, ROW, |ui| {
                ui.spacing_mut().item_spacing.x = 2.0;
                let name = name(item);
                if handle(ui, dragged, &name) {
                    self.dragged = Some(k);
                }
                let width = ui.available_width() - BUTTONS - if is_text(item) { 30.0 } else { 0.0 };
                ui.allocate_ui_with_layout(vec2(width, ROW), Layout::left_to_right(Align::Center), |ui| {
                    ui.set_min_width(width);
                    match item {
                        Item::Section { section, shown } => tick(ui, *section, shown, empty.contains(section)),
                        Item::Text { .. } => {
                            ui.label("Text");
                        }
                    }
                });
                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                    let down = icon(ui, "⏷", &format!("Move down: {name}"), "One place down", k + 1 < count);
                    let up = icon(ui, "⏶", &format!("Move up: {name}"), "One place up", k > 0);
                    if up.clicked() {
                        change = Some(ContentsChange::Move(k, k - 1));
                    }
                    if down.clicked() {
                        change = Some(ContentsChange::Move(k, k + 1));
                    }
                    if is_text(item) && icon(ui, "🗑", "Remove the text", "Remove the text", true).clicked() {
                        change = Some(ContentsChange::Remove(k));
                    }
                });
            });
            if let Item::Text { text } = item {
                self.text(ui, text, k);
            }
            rects.push(Rect::from_x_y_ranges(ui.max_rect().x_range(), top..=ui.cursor().top()));
        }
        self.drag(ui, &rects, &mut change);
        match change {
            Some(ContentsChange::Move(from, to)) => report.move_item(from, to),
            Some(ContentsChange::Remove(k)) => {
                report.items.remove(k);
            }
            None => {}
        }
    }

    fn text(&mut self, ui: &mut Ui, text: &mut String, index: usize) {
        let hint = "A paragraph; a blank line begins another, “# ” in front makes a heading";
        let field = egui::TextEdit::multiline(text).hint_text(hint).desired_width(f32::INFINITY).desired_rows(3);
        let response = ui.add(field).accessible_name(format!("Text at place {}", index + 1));
        if index == 0 && std::mem::take(&mut self.fresh) {
            response.request_focus();
        }
        if response.has_focus() && ui.input(|i| i.key_pressed(Key::Escape)) {
            response.surrender_focus();
        }
    }

    /// Moves the entry that is dragged past a neighbour as soon as the pointer has come to that one's middle.
    fn drag(&mut self, ui: &Ui, rects: &[Rect], change: &mut Option<ContentsChange>) {
        let Some(k) = self.dragged else { return };
        let pointer = ui.input(|i| i.pointer.latest_pos().filter(|_| i.pointer.any_down()));
        let Some(pointer) = pointer.filter(|_| k < rects.len()) else {
            self.dragged = None;
            return;
        };
        ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        let place = if k > 0 && pointer.y < rects[k - 1].center().y {
            k - 1
        } else if k + 1 < rects.len() && pointer.y > rects[k + 1].center().y {
            k + 1
        } else {
            return;
        };
        *change = Some(ContentsChange::Move(k, place));
        self.dragged = Some(place);
        ui.ctx().request_repaint();
    }
}

/// The row for the report's title.
pub(super) fn title_row(ui: &mut Ui, report: &mut Arrangement, usual_title: &str) {
    row(ui, "title", "The report's title; empty: the name of the data", |ui| {
        let width = ui.available_width();
        let field = egui::TextEdit::singleline(&mut report.title).hint_text(usual_title).desired_width(width);
        ui.add(field).accessible_name("Title of the report");
    });
}

fn is_text(item: &Item) -> bool {
    matches!(item, Item::Text { .. })
}

fn name(item: &Item) -> String {
    match item {
        Item::Section { section, .. } => section.label().to_owned(),
        Item::Text { .. } => "Text".to_owned(),
    }
}

/// What an entry is dragged by; true as a drag begins.
fn handle(ui: &mut Ui, dragged: bool, name: &str) -> bool {
    let colors = theme::accents(ui.visuals().dark_mode);
    let color = if dragged { colors.accent } else { ui.visuals().weak_text_color() };
    let label = egui::Label::new(RichText::new("☰").size(12.0).color(color)).selectable(false).sense(Sense::drag());
    let response = ui.add_sized(vec2(HANDLE, ROW), label).on_hover_cursor(CursorIcon::Grab);
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, format!("Drag {name}")));
    response.drag_started()
}

/// A section's tick; one that the study has nothing for says so.
fn tick(ui: &mut Ui, section: Section, shown: &mut bool, empty: bool) {
    let text = RichText::new(section.label());
    let (text, hint) = match (*shown && empty, nothing(section)) {
        (true, reason) => (text.weak(), format!("{}. {reason}", section.tooltip())),
        (false, _) => (text, section.tooltip().to_owned()),
    };
    let response = ui.add(egui::Checkbox::new(shown, text)).on_hover_text(hint);
    response.widget_info(|| WidgetInfo::selected(egui::Role::CheckBox, true, *shown, section.label()));
    if *shown && empty {
        ui.weak("–").on_hover_text(nothing(section)).accessible_name("nothing yet");
    }
}

/// Why a section may be empty.
fn nothing(section: Section) -> &'static str {
    match section {
        Section::Missing | Section::Waterfall | Section::Rounds | Section::Overlay | Section::Remaining => {
            "Nothing yet: it comes from a walk in What's missing"
        }
        Section::Command => "Nothing yet: save the project, and the command that makes the report from it stands here",
        _ => "These data have nothing for it",
    }
}
