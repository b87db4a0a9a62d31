//! The stream in place of the records.

use egui::Ui;

use super::App;
use super::drawing::centre;
use crate::app::jobs::Key;
use crate::app::message::Message;
use crate::app::panel;
use crate::app::program::WindowProgram;
use crate::app::purpose::Purpose;
use crate::app::state::Room;
use crate::app::stream::{self, StreamAct};

impl App {
    /// True if a stream is shown in place of the records.
    pub(super) fn shows_stream(&self) -> bool {
        let state = &self.program.state;
        state.stream.shown && state.shown.room == Room::Identify
    }

    /// Draws the stream and what was found of it.
    pub(super) fn stream(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let WindowProgram { state, derived, .. } = &self.program;
        let (room, figures) = (&derived.stream, &mut self.canvas.stream);
        let running = derived.progress(&Key::Stream).is_some();
        let mut form = state.stream.clone();
        let mut act = None;
        panel::controls(ui, |ui| act = stream::controls(ui, room, running, &mut form));
        panel::findings(ui, |ui| stream::findings(ui, room));
        centre(ui, |ui| stream::show(ui, room, running, figures));
        if form != state.stream {
            self.program.send(Message::Stream(StreamAct::Form(Box::new(form))));
        }
        match act {
            Some(StreamAct::Keep) => self.dialogs.ask(Purpose::StreamRecord, "stream.csv", frame),
            Some(act) => self.program.send(Message::Stream(act)),
            None => {}
        }
    }
}
