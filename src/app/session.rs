//! The session: all that a person has decided, written to the app's folder whenever it has changed, so that a window
//! that was killed comes back as it was.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::state::State;
use sindyscope_system::fs;

/// The format that this program writes; a higher one is from a newer program. In the first, the document's parts stood side by
/// side with what is in view.
const VERSION: u32 = 2;

/// The window's name to the system: where its state is kept, and which icon it has in a task bar.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) const APP_ID: &str = "sindyscope";

/// How often at most the state is looked at, s.
const PACE: f64 = 0.4;

/// How long a window that opens waits for its session before it shows itself without.
pub(crate) const AT_ONCE: Duration = Duration::from_millis(100);

/// How long a window that closes waits for the last write.
pub(crate) const PATIENCE: Duration = Duration::from_secs(3);

/// The file of the session in this system's folder for the app, if it has one; in a browser among what the page keeps.
pub(crate) fn file() -> Option<PathBuf> {
    #[cfg(target_arch = "wasm32")]
    return Some(Path::new(fs::KEPT).join("session.json"));
    #[cfg(not(target_arch = "wasm32"))]
    eframe::storage_dir(APP_ID).map(|folder| folder.join("session.json"))
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
    let read = serde_json::from_str::<Session<Value>>(&text)
        .and_then(|session| Ok((session.sindyscope_session, State::of_any_version(session.state)?)));
    match read {
        Ok((version, state)) if version <= VERSION => (Some(state), None),
        other => {
            let reason = other.map_or_else(|e| e.to_string(), |_| "a newer Sindyscope wrote it".to_owned());
            let aside = path.with_extension("unreadable.json");
            let kept = fs::rename(path, &aside).map_or_else(|_| path.to_owned(), |()| aside);
            let place = kept.display();
            (None, Some(format!("What was open last cannot be brought back ({reason}); it was kept as {place}")))
        }
    }
}

/// Keeps the session's file up to date.
#[derive(Debug)]
pub(crate) struct Keeper {
    path: PathBuf,
    /// The text that is to be in the file.
    written: String,
    /// When the state was looked at last, s.
    looked: f64,
}

impl Keeper {
    /// Keeps a session in a file.
    pub(crate) fn new(path: PathBuf) -> Self {
        Self { path, written: String::new(), looked: f64::NEG_INFINITY }
    }

    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// After how many seconds it is time to look at the state again; none if it is.
    pub(crate) fn wait(&self, now: f64) -> Option<f64> {
        Some(self.looked + PACE - now).filter(|wait| *wait > 0.0)
    }

    /// The text that is to be written, if the state has changed.
    pub(crate) fn text(&mut self, state: &State, now: f64) -> Option<String> {
        self.looked = now;
        let session = Session { sindyscope_session: VERSION, state };
        // Settings have no number that JSON lacks; what it would be, the next change mends.
        let text = serde_json::to_string_pretty(&session).ok().filter(|text| *text != self.written)?;
        self.written.clone_from(&text);
        Some(text)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::app::disk;
    use crate::app::state::Source;

    fn state(record: usize) -> State {
        let mut state = State::with_source(Source::Hidden(u64::MAX), egui::ThemePreference::System);
        state.shown.record = record;
        state
    }

    #[test]
    fn a_change_is_written_once_it_is_time_and_only_then() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("app/session.json");
        let mut keeper = Keeper::new(path.clone());
        assert_eq!(keeper.wait(10.0), None);
        disk::replace(&path, &keeper.text(&state(1), 10.0).unwrap()).unwrap();
        assert!(keeper.wait(10.1).is_some_and(|wait| wait < 1.0), "within a second");
        assert_eq!(keeper.text(&state(1), 10.5), None, "nothing has changed");
        assert_eq!(load(&path).0.unwrap().shown.record, 1);
        disk::replace(&path, &keeper.text(&state(2), 11.0).unwrap()).unwrap();
        let again = load(&path).0.unwrap();
        assert_eq!((again.shown.record, again.document.source), (2, Source::Hidden(u64::MAX)));
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
