//! Following a stream.

use super::change::Update;
use crate::app::jobs::{Job, Key};
use crate::app::stream::StreamAct;

impl Update<'_> {
    pub(super) fn stream(&mut self, act: StreamAct) {
        match act {
            StreamAct::Form(form) => self.state.stream = *form,
            StreamAct::Start => {
                self.derived.stream.begin();
                let form = Box::new(self.state.stream.clone());
                self.want_instead(Key::Stream, Job::Stream(form));
            }
            StreamAct::Pause(paused) => self.derived.stream.pause(paused),
            StreamAct::Stop => {
                self.cancel(Key::Stream);
                self.derived.stream.end(None);
            }
            StreamAct::Close => {
                self.cancel(Key::Stream);
                self.derived.stream.end(None);
                self.state.stream.shown = false;
            }
            // The window asks for the file, and opens it once it is written.
            StreamAct::Keep => {}
        }
    }
}
