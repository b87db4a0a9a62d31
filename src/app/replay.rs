//! Doing again what a log holds, without a window.

use std::time::Duration;

use serde_json::Value;

use super::log::Log;
use super::program::WindowProgram;
use super::state::State;
use super::update::FrameTime;
use sindyscope_system::time::Instant;

/// How long a replay waits for the background work after each message.
const PATIENCE: Duration = Duration::from_secs(900);

/// How long something took: another time each time.
const TIMES: &str = "elapsed_ms";

/// What came of a replay.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// How many messages there were.
    pub messages: usize,
    /// Where the state is another than the log says: the path in it, what the log has, what the replay came to.
    pub differences: Vec<String>,
}

/// Does again what a log holds, each message once the work that the one before asked for has come to rest. Nothing is saved.
///
/// # Errors
/// It is no log, or the work after a message does not end.
pub fn replay(text: &str) -> Result<Replayed, String> {
    let log = Log::read(text)?;
    let mut program = WindowProgram::new(log.start, || {});
    rest(&mut program)?;
    for message in &log.messages {
        program.send(message.clone());
        rest(&mut program).map_err(|e| format!("{e}: {message:?}"))?;
    }
    let differences = log.end.map(|end| differences(&end, &program.state)).unwrap_or_default();
    Ok(Replayed { messages: log.messages.len(), differences })
}

/// Waits for the background work to come to rest.
fn rest(program: &mut WindowProgram) -> Result<(), String> {
    let until = Instant::now() + PATIENCE;
    loop {
        program.advance(FrameTime::default());
        if !program.busy() {
            return Ok(());
        }
        if Instant::now() > until {
            return Err(format!("after {} s the work has not come to rest", PATIENCE.as_secs()));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Where two states differ.
fn differences(logged: &State, replayed: &State) -> Vec<String> {
    let value = |state: &State| serde_json::to_value(state).unwrap_or_default();
    let mut found = Vec::new();
    compare("", &value(logged), &value(replayed), &mut found);
    found
}

fn compare(path: &str, logged: &Value, replayed: &Value, found: &mut Vec<String>) {
    match (logged, replayed) {
        (Value::Object(one), Value::Object(other)) => {
            let keys = one.keys().chain(other.keys().filter(|key| !one.contains_key(*key)));
            for key in keys.filter(|key| *key != TIMES) {
                let of = |fields: &serde_json::Map<String, Value>| fields.get(key).cloned().unwrap_or_default();
                compare(&format!("{path}/{key}"), &of(one), &of(other), found);
            }
        }
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            for (index, (one, other)) in one.iter().zip(other).enumerate() {
                compare(&format!("{path}/{index}"), one, other, found);
            }
        }
        (one, other) if one == other => {}
        (one, other) => found.push(format!("{path}: {one} in the log, {other} now")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::commands::WindowCommand;
    use crate::app::message::Message;
    use crate::app::state::{Document, Room, Shown, Source};

    #[test]
    fn a_replay_tells_where_it_comes_to_something_else() {
        let start = State { document: Document::of(Source::Nothing), ..State::default() };
        let mut log = Log::new(&start);
        log.note(&Message::Do(WindowCommand::Room(Room::Report)));
        let same = replay(&log.text(&State { shown: shown(Room::Report), ..start.clone() })).unwrap();
        assert_eq!(same, Replayed { messages: 1, differences: Vec::new() });
        let other = replay(&log.text(&start)).unwrap();
        assert_eq!(other.differences, ["/shown/room: \"identify\" in the log, \"report\" now"]);
        assert!(replay("{}").unwrap_err().contains("no log"));
    }

    fn shown(room: Room) -> Shown {
        Shown { room, ..Default::default() }
    }
}
