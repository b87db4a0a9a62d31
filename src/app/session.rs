//! The session: all that a person has decided, written to the app's folder whenever it has changed, so that a window
//! that was killed comes back as it was.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::disk;
use super::state::State;
use super::worker::Worker;

/// The format that this program writes; a higher one is from a newer program.
const VERSION: u32 = 1;

/// How often at most the state is looked at, s.
const PACE: f64 = 0.4;

/// How long a window that closes waits for the last write.
const PATIENCE: Duration = Duration::from_secs(3);

/// The file of the session in this system's folder for the app, if it has one.
pub(crate) fn file() -> Option<PathBuf> {
    eframe::storage_dir(super::APP_ID).map(|folder| folder.join("session.json"))
}

/// What the file holds.
#[derive(Serialize, Deserialize)]
struct Session<S> {
    sindyscope_session: u32,
    state: S,
}

/// Reads a session; none if there is none. One that cannot be read is put aside, and the sentence says where.
pub(crate) fn load(path: &Path) -> (Option<State>, Option<String>) {
    let Ok(text) = fs::read_to_string(path) else { return (None, None) };
    match serde_json::from_str::<Session<State>>(&text) {
        Ok(session) if session.sindyscope_session <= VERSION => (Some(session.state), None),
        other => {
            let reason = other.map_or_else(|e| e.to_string(), |_| "a newer Sindyscope wrote it".to_owned());
            let aside = path.with_extension("unreadable.json");
            let kept = fs::rename(path, &aside).map_or_else(|_| path.to_owned(), |()| aside);
            let place = kept.display();
            (None, Some(format!("What was open last cannot be brought back ({reason}); it was kept as {place}")))
        }
    }
}

/// Keeps the session's file up to date, in a thread of its own.
pub(crate) struct Keeper {
    writer: Worker<String, Result<(), String>>,
    /// The text that was handed to the writer last.
    written: String,
    /// When the state was looked at last, s.
    looked: f64,
}

impl Keeper {
    /// Keeps a session in a file.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(crate) fn new(path: PathBuf) -> std::io::Result<Self> {
        let writer = Worker::spawn(
            "session",
            || {},
            move |text: String, _, _| Some(disk::replace(&path, &text).map_err(|e| format!("{}: {e}", path.display()))),
            || Err("an error of the program itself".to_owned()),
        )?;
        Ok(Self { writer, written: String::new(), looked: f64::NEG_INFINITY })
    }

    /// Looks at the state if that was some time ago, and has it written if it has changed. Gives the seconds after which
    /// to look again, if it was too soon.
    pub(crate) fn watch(&mut self, state: impl FnOnce() -> State, now: f64) -> Option<f64> {
        let wait = self.looked + PACE - now;
        if wait > 0.0 {
            return Some(wait);
        }
        self.looked = now;
        self.write(&state());
        None
    }

    fn write(&mut self, state: &State) {
        let session = Session { sindyscope_session: VERSION, state };
        // Settings have no number that JSON lacks; what it would be, the next change mends.
        let Ok(text) = serde_json::to_string_pretty(&session) else { return };
        if text != self.written {
            self.written.clone_from(&text);
            self.writer.ask(text);
        }
    }

    /// Writes the state and waits until that is done: the window closes.
    pub(crate) fn finish(&mut self, state: &State) {
        self.write(state);
        let until = Instant::now() + PATIENCE;
        while self.busy() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Why the last write failed, told once.
    pub(crate) fn failure(&self) -> Option<String> {
        std::iter::from_fn(|| self.writer.answer()).filter_map(Result::err).last()
    }

    /// True while something is being written.
    pub(crate) fn busy(&self) -> bool {
        self.writer.busy().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::state::Source;

    fn state(record: usize) -> State {
        State { source: Source::Hidden(u64::MAX), record, ..State::default() }
    }

    #[test]
    fn a_change_is_written_once_it_is_time_and_only_then() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("app/session.json");
        let mut keeper = Keeper::new(path.clone()).unwrap();
        assert_eq!(keeper.watch(|| state(1), 10.0), None);
        assert!(keeper.watch(|| state(2), 10.1).is_some_and(|wait| wait < 1.0), "within a second");
        keeper.finish(&state(1));
        assert_eq!(load(&path).0.unwrap().record, 1);
        assert_eq!(keeper.watch(|| state(2), 10.5), None);
        keeper.finish(&state(2));
        let again = load(&path).0.unwrap();
        assert_eq!((again.record, again.source), (2, Source::Hidden(u64::MAX)));
    }

    #[test]
    fn a_damaged_session_is_put_aside_and_told() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("session.json");
        for text in ["{ half", r#"{"sindyscope_session": 99, "state": {}}"#] {
            fs::write(&path, text).unwrap();
            let (state, told) = load(&path);
            assert!(state.is_none());
            let told = told.unwrap();
            assert!(told.contains("session.unreadable.json"), "{told}");
            assert_eq!(fs::read_to_string(home.path().join("session.unreadable.json")).unwrap(), text);
        }
        assert!(matches!(load(&path), (None, None)));
    }
}
