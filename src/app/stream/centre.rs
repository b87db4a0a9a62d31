//! The centre: the alarm, and what arrives with what is identified from it.

use egui::{Label, RichText, Ui};

use super::room::StreamRoom;
use crate::app::plot::figures::{FigurePlace, Figures};
use crate::app::theme;
use crate::app::widgets::card;

/// Draws the banner and the figure in all the room there is.
pub(crate) fn show(ui: &mut Ui, room: &StreamRoom, running: bool, canvas: &mut Figures) {
    let accents = theme::accents(ui.visuals().dark_mode);
    ui.add_space(4.0);
    if let Some(failure) = &room.failure {
        card(ui, accents.wrong, |ui| {
            ui.add(Label::new(failure).wrap());
        });
    }
    if let Some(alarm) = room.alarm() {
        card(ui, accents.wrong, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new("Alarm").strong().color(accents.wrong));
                ui.add(Label::new(RichText::new(alarm).strong()).wrap());
            });
        });
    }
    let figure = canvas.get("stream", room.generation, || room.figure());
    match figure {
        Some(figure) => {
            let place = FigurePlace::new("stream", "Stream", room.generation);
            canvas.draw(ui, &figure, &place);
        }
        None => {
            let text = match (running, &room.waiting) {
                (true, Some(waiting)) => format!("{waiting}…"),
                (true, None) => "waiting for the first rows…".to_owned(),
                (false, _) => {
                    "Say on the left where rows come from: a file that a logger writes, udp://:9000, or a serial \
                               line. They are text as in a file of measurements, with a header: `t,x,u`."
                        .to_owned()
                }
            };
            ui.centered_and_justified(|ui| ui.weak(text));
        }
    }
    canvas.tidy();
}
