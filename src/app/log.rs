//! What was done in a session, as a file: a bug report that can be run again, and a test that was clicked together.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::message::Message;
use super::state::State;

/// The format that this program writes; a higher one is from a newer program.
const VERSION: u32 = 1;

/// Messages kept: older ones are of little use to whoever looks for an error.
const KEPT: usize = 10_000;

/// The messages of a session.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Log {
    sindyscope_log: u32,
    /// What the session began with.
    pub(crate) start: State,
    pub(crate) messages: Vec<Message>,
    /// What it had come to when the log was saved.
    #[serde(default)]
    pub(crate) end: Option<State>,
}

impl Log {
    /// A log that begins with this state.
    pub(crate) fn new(start: &State) -> Self {
        Self { sindyscope_log: VERSION, start: start.clone(), messages: Vec::new(), end: None }
    }

    /// Notes a message. While a slider is dragged its last place alone is noted.
    pub(crate) fn note(&mut self, message: &Message) {
        if self.messages.last().is_some_and(|last| message.replaces(last)) {
            self.messages.pop();
        }
        if self.messages.len() < KEPT {
            self.messages.push(message.clone());
        }
    }

    /// Reads a log.
    ///
    /// # Errors
    /// It is none, or one of a newer program.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        let value: Value = serde_json::from_str(text).map_err(|e| format!("this is no log of Sindyscope: {e}"))?;
        match value.get("sindyscope_log").and_then(Value::as_u64) {
            None => Err("this is no log of Sindyscope: it does not say its format".to_owned()),
            Some(version) if version > u64::from(VERSION) => {
                Err(format!("the log is of a newer Sindyscope (format {version}; this one reads up to {VERSION})"))
            }
            Some(_) => serde_json::from_value(value).map_err(|e| format!("this log cannot be read: {e}")),
        }
    }

    /// The log as a text, with what the session has come to.
    pub(crate) fn text(&self, end: &State) -> String {
        let log = Self { end: Some(end.clone()), ..self.clone() };
        // A state has no number that JSON lacks.
        serde_json::to_string_pretty(&log).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_dragged_slider_the_last_place_is_noted() {
        let mut log = Log::new(&State::default());
        for zoom in [1.1, 1.2, 1.3] {
            log.note(&Message::Zoom(zoom));
        }
        log.note(&Message::Step);
        log.note(&Message::Zoom(1.4));
        assert_eq!(log.messages, [Message::Zoom(1.3), Message::Step, Message::Zoom(1.4)]);
    }
}
