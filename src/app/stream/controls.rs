//! The columns beside a stream: where it comes from on the left, what is identified on the right.

use egui::{DragValue, Label, RichText, TextEdit, Ui, vec2};

use super::act::StreamAct;
use super::room::StreamRoom;
use crate::app::state::StreamForm;
use crate::app::theme::{self, ROW};
use crate::app::widgets::{card, row, section};
use sindyscope_analysis::watch::{USUAL_LAST, summary_words};
use sindyscope_values::format::equations::is_kinematic;
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::model::Units;

/// Longest stretch that is kept, s.
const LONGEST: f64 = 86_400.0;

/// Draws the left column; the form is changed by what is typed.
pub(crate) fn controls(ui: &mut Ui, room: &StreamRoom, running: bool, form: &mut StreamForm) -> Option<StreamAct> {
    let mut act = None;
    section(
        ui,
        "STREAM",
        |_| (),
        |ui| {
            ui.add_enabled_ui(!running, |ui| fields(ui, form));
            ui.add_space(6.0);
            act = buttons(ui, room, running, form);
        },
    );
    section(
        ui,
        "ARRIVED",
        |_| (),
        |ui| {
            ui.add(Label::new(summary_words(room.counts, room.alarms)).wrap());
            if let Some(waiting) = room.waiting.as_ref().filter(|_| running) {
                ui.add(Label::new(RichText::new(format!("{waiting}…")).weak()).wrap());
            }
            if let Some(share) = room.filled.filter(|_| running) {
                ui.weak(if share < 1.0 { "collecting the first seconds" } else { "choosing the settings" });
                ui.add(egui::ProgressBar::new(share as f32).desired_height(6.0));
            }
        },
    );
    if !room.lines.is_empty() {
        section(
            ui,
            "TOLD",
            |_| (),
            |ui| {
                for text in &room.lines {
                    ui.add(Label::new(RichText::new(text).size(12.0)).wrap());
                }
            },
        );
    }
    act
}

fn fields(ui: &mut Ui, form: &mut StreamForm) {
    let text = |ui: &mut Ui, name: &str, hint: &str, value: &mut String| {
        let field = TextEdit::singleline(value).hint_text(hint).desired_width(f32::INFINITY);
        ui.add_sized(vec2(ui.available_width(), ROW - 2.0), field).accessible_name(name.to_owned());
    };
    let tip =
        "A file that grows, udp://ADDRESS:PORT, or serial:///dev/ttyUSB0?baud=115200; rows are text with a header";
    row(ui, "source", tip, |ui| text(ui, "Stream's source", "bench.csv, udp://:9000", &mut form.source));
    let tip = "The candidate library; where nothing is said it is chosen from the first seconds";
    row(ui, "terms", tip, |ui| text(ui, "Stream's terms", "chosen", &mut form.terms));
    row(ui, "last", "How much of the stream is identified: its last seconds", |ui| {
        let mut own = form.last.is_some();
        if ui.checkbox(&mut own, "").on_hover_text("Say how much, in place of what is usual").changed() {
            form.last = own.then_some(USUAL_LAST);
        }
        match &mut form.last {
            Some(last) => {
                let field = DragValue::new(last).range(0.1..=LONGEST).speed(0.5).max_decimals(2).suffix(" s");
                ui.add(field).accessible_name("Stream's last seconds".to_owned());
            }
            None => drop(ui.weak(format!("{USUAL_LAST} s, more of a slow motion"))),
        }
    });
    let tip = "False alarms: how many a stream without any change may raise; fewer are slower to tell a change";
    row(ui, "alarms", tip, |ui| {
        let field = DragValue::new(&mut form.false_alarms).range(1e-4..=1000.0).speed(0.01).max_decimals(4);
        ui.add(field.suffix(" an hour")).accessible_name("False alarms an hour".to_owned());
    });
}

fn buttons(ui: &mut Ui, room: &StreamRoom, running: bool, form: &StreamForm) -> Option<StreamAct> {
    let mut act = None;
    ui.horizontal_wrapped(|ui| {
        let mut button = |ui: &mut Ui, label: &str, hint: &str, enabled: bool, does: StreamAct| {
            if ui.add_enabled(enabled, egui::Button::new(label)).on_hover_text(hint).clicked() {
                act = Some(does);
            }
        };
        if running {
            let (label, hint) = match room.paused {
                false => ("Pause", "Let the figures stand; the stream goes on, and nothing is lost"),
                true => ("Go on", "Show what came meanwhile"),
            };
            button(ui, label, hint, true, StreamAct::Pause(!room.paused));
            button(ui, "Stop", "Follow the stream no longer; what was found stays", true, StreamAct::Stop);
        } else {
            let said = !form.source.trim().is_empty();
            button(ui, "Start", "Follow the source from now on", said, StreamAct::Start);
        }
        let hint = "Save the last seconds as a file and open it in Identify";
        button(ui, "Keep as record…", hint, room.record.is_some(), StreamAct::Keep);
        button(ui, "Close", "Go back to the records; the stream is followed no longer", true, StreamAct::Close);
    });
    act
}

/// Draws the right column: the equation as it is now.
pub(crate) fn findings(ui: &mut Ui, room: &StreamRoom) {
    let (Some(update), Some(settled)) = (room.last(), &room.settled) else {
        section(ui, "EQUATION", |_| (), |ui| ui.weak("not identified yet"));
        return;
    };
    let (model, layout) = (&update.model, &update.model.layout);
    let units = Units::from_record(&settled.opening, layout);
    section(
        ui,
        "EQUATION",
        |_| (),
        |ui| {
            for (state, equation) in model.iter().filter(|(state, equation)| !is_kinematic(model, *state, equation)) {
                ui.strong(format!("d{}/dt =", layout.name(state)));
                egui::Grid::new(("stream equation", state.to_owned())).num_columns(2).spacing(vec2(12.0, 4.0)).show(
                    ui,
                    |ui| {
                        for term in &equation.terms {
                            ui.monospace(format_measured(term.coefficient, term.std_error));
                            let unit = units.coefficient(state, &term.term).unwrap_or_default();
                            ui.label(term.term.text(layout)).on_hover_text(format!("coefficient in {unit}"));
                            ui.end_row();
                        }
                    },
                );
            }
        },
    );
    section(
        ui,
        "NOW",
        |_| (),
        |ui| {
            ui.label(format!("at {} s, {} s of rows", significant(update.time, 5), significant(update.covered, 3)));
            match &update.judged {
                Some(judged) => {
                    ui.label(format!("residual {} of the usual", significant(judged.ratio, 3))).on_hover_text(
                        "RMS of what the model from before the newest block leaves of it, over that of usual blocks",
                    );
                    ui.label(format!("chance {}", significant(judged.p_value, 2)))
                        .on_hover_text("Chance that a block of a stream in which nothing changes lies so far out");
                }
                None => drop(ui.weak("too few blocks for a judgement")),
            }
        },
    );
    let accents = theme::accents(ui.visuals().dark_mode);
    if update.alarm.is_none() && update.judged.is_some() {
        card(ui, accents.good, |ui| {
            ui.label("The model explains what arrives.");
        });
    }
}
