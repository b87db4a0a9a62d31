//! The lesson's strip above the status line, and the list of lessons.

use egui::{Align, Layout, Margin, Panel, RichText, ScrollArea, Sense, Stroke, Ui, vec2};
use serde::{Deserialize, Serialize};

use super::catalogue::LESSONS;
use super::lesson::Lesson;
use crate::app::state::{LessonPosition, LessonProgress};
use crate::app::theme;
use crate::app::widgets::card;

/// Height of the strip, points.
const HEIGHT: f32 = 92.0;

/// What a person asked for in the strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LessonAct {
    /// The next step, or the end.
    Next,
    /// The step before.
    Back,
    /// The lesson from its beginning.
    Again,
    /// Leave the lesson where it is.
    Leave,
}

/// The strip of the open lesson.
pub(crate) fn show(ui: &mut Ui, lesson: &Lesson, position: &LessonPosition) -> Option<LessonAct> {
    let mut asked = None;
    let colors = theme::accents(ui.visuals().dark_mode);
    let frame = egui::Frame::new().fill(colors.card).stroke(Stroke::new(1.0, colors.line)).inner_margin(Margin {
        left: 12,
        right: 12,
        top: 6,
        bottom: 4,
    });
    Panel::bottom("lesson").resizable(false).exact_size(HEIGHT).frame(frame).show(ui, |ui| {
        let count = lesson.steps.len();
        let met = position.met.contains(&position.step);
        ui.horizontal(|ui| {
            ui.label(RichText::new(format!("Lesson: {}", lesson.title)).strong());
            ui.add_space(8.0);
            dots(ui, position, count);
            let words = if position.step < count {
                format!("step {} of {count}", position.step + 1)
            } else {
                "done".to_owned()
            };
            ui.weak(words);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if ui.button("Leave").on_hover_text("Leave the lesson; everything stays as it is").clicked() {
                    asked = Some(LessonAct::Leave);
                }
                if ui.button("Start again").on_hover_text("From the lesson's beginning, with its own data").clicked() {
                    asked = Some(LessonAct::Again);
                }
            });
        });
        ui.horizontal_top(|ui| {
            let buttons = 150.0;
            let size = vec2((ui.available_width() - buttons).max(100.0), ui.available_height());
            ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
                ui.set_min_size(size);
                ui.spacing_mut().item_spacing.y = 1.0;
                match lesson.steps.get(position.step) {
                    Some(step) if met => {
                        let text = format!("✔ {}", step.seen);
                        ui.add(egui::Label::new(RichText::new(text).size(13.5).color(colors.good)).wrap());
                    }
                    Some(step) => {
                        ui.add(egui::Label::new(RichText::new(step.task).size(13.5)).wrap());
                    }
                    None => {
                        let text = RichText::new(lesson.closing).size(13.5).strong();
                        ui.add(egui::Label::new(text).wrap());
                    }
                }
            });
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let last = position.step >= count;
                let label = match (last, met) {
                    (true, _) => "Finish",
                    (false, true) => "Next step",
                    (false, false) => "Skip",
                };
                let text = RichText::new(label);
                let mut button = egui::Button::new(if met || last { text.strong() } else { text.weak() });
                if met || last {
                    button = button.fill(colors.accent_ground);
                }
                if ui.add(button).clicked() {
                    asked = Some(LessonAct::Next);
                }
                let back = ui.add_enabled(position.step > 0, egui::Button::new("Step back"));
                if back.clicked() {
                    asked = Some(LessonAct::Back);
                }
            });
        });
    });
    asked
}

/// A dot a step: filled once its condition was met.
fn dots(ui: &mut Ui, position: &LessonPosition, count: usize) {
    let colors = theme::accents(ui.visuals().dark_mode);
    for step in 0..count {
        let (rect, _) = ui.allocate_exact_size(vec2(9.0, 9.0), Sense::hover());
        let center = rect.center();
        if position.met.contains(&step) {
            ui.painter().circle_filled(center, 3.5, colors.good);
        } else {
            ui.painter().circle_stroke(center, 3.5, Stroke::new(1.0, colors.line));
        }
        if step == position.step {
            ui.painter().circle_stroke(center, 4.5, Stroke::new(1.5, colors.accent));
        }
    }
}

/// The list of lessons; tells which was chosen.
pub(crate) fn list(ui: &mut Ui, progress: &LessonProgress) -> Option<&'static str> {
    let mut chosen = None;
    let colors = theme::accents(ui.visuals().dark_mode);
    ui.add_space(4.0);
    ui.label(RichText::new("Lessons").size(18.0).strong());
    ui.add(
        egui::Label::new(
            RichText::new("Each is a few minutes with the real controls; a strip below tells what to do and notices what you did.")
                .weak(),
        )
        .wrap(),
    );
    ui.add_space(4.0);
    ScrollArea::vertical().id_salt("lessons").auto_shrink([false, false]).show(ui, |ui| {
        let columns = if ui.available_width() > 620.0 { 2 } else { 1 };
        let width = (ui.available_width() - 10.0 * columns as f32) / columns as f32;
        for pair in LESSONS.chunks(columns) {
            ui.horizontal_top(|ui| {
                for lesson in pair {
                    let finished = progress.finished.contains(lesson.id);
                    let open = progress.current.as_ref().is_some_and(|p| p.lesson == lesson.id);
                    let edge = if finished { colors.good } else { colors.accent };
                    ui.allocate_ui_with_layout(vec2(width, 0.0), Layout::top_down(Align::Min), |ui| {
                        ui.set_width(width);
                        card(ui, edge, |ui| {
                            ui.set_min_height(62.0);
                            ui.horizontal(|ui| {
                                ui.label(RichText::new(lesson.title).strong());
                                ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                                    let label = match (open, finished) {
                                        (true, _) => "open",
                                        (false, true) => "again",
                                        (false, false) => "begin",
                                    };
                                    let button = ui.add_enabled(!open, egui::Button::new(label));
                                    let name = format!("Begin the lesson {}", lesson.title);
                                    button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, !open, &name));
                                    if button.clicked() {
                                        chosen = Some(lesson.id);
                                    }
                                    if finished {
                                        ui.colored_label(colors.good, "✔ done");
                                    }
                                });
                            });
                            ui.add(egui::Label::new(RichText::new(lesson.about).weak()).wrap());
                        });
                    });
                }
            });
        }
    });
    chosen
}
