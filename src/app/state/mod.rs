//! What a person has decided: all that survives a restart, and nothing else. It knows no room.

mod class;
mod document;
mod lessons;
mod modal;
mod own;
mod rig;
mod room;
mod series;
mod stored;
mod stream;
mod views;
mod walk;

use std::path::{Path, PathBuf};

use egui::ThemePreference;
use serde::{Deserialize, Serialize};

use super::figure_panel::FigureLook;
pub(crate) use class::Answered;
pub use class::{ClassCase, ClassRound, ClassState, Guess};
pub(crate) use document::absolute;
pub use document::{Document, Edit, FoundBeside, Pin, Sample, Source};
pub use lessons::{LessonPosition, LessonProgress};
pub(crate) use modal::ModalShown;
pub use own::OwnEffects;
pub(crate) use rig::Page;
pub use rig::RigState;
pub(crate) use room::Room;
pub use series::{SeriesForm, SeriesOver};
use sindyscope_files::ReadOptions;
use sindyscope_report::component::ComponentView;
use sindyscope_report::view::View;
pub(crate) use stored::upgraded_project;
pub use stream::StreamForm;
pub(crate) use views::ViewState;
pub(crate) use walk::RoundStep;
pub use walk::{Base, Walk, WalkView};

/// Files kept in the list of recent ones, and documents that come back when their files are opened again.
const RECENT: usize = 8;

/// Folders of which it is kept how their files are read.
const FOLDERS: usize = 32;

/// How the files of a folder were read, where a person said which column is which.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FolderReading {
    /// The folder.
    pub folder: PathBuf,
    /// How its files were read last.
    pub reading: ReadOptions,
}

/// What the window shows of a document.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Shown {
    pub(crate) room: Room,
    /// Which record the views show.
    pub(crate) record: usize,
    /// Whether the whole record is shown above the plots, to be cut by dragging.
    pub(crate) cutting: bool,
    pub(crate) view: View,
    pub(crate) views: ViewState,
    /// How a component's force is shown.
    pub(crate) component: ComponentView,
    /// How a structure's modes are shown.
    pub(crate) modal: ModalShown,
    /// The walk in "What's missing".
    pub(crate) walk: WalkView,
}

/// Everything that survives a restart.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct State {
    /// What is open.
    pub document: Document,
    /// What is in view.
    pub shown: Shown,
    /// The saved project that this is, if it is one.
    pub project: Option<PathBuf>,
    /// Files opened lately, the newest first.
    pub recent: Vec<PathBuf>,
    /// What was left with each source lately open, the newest first.
    pub kept: Vec<Document>,
    /// How files were read in each folder lately, the newest first.
    pub folders: Vec<FolderReading>,
    /// Light, dark or as the system is.
    pub theme: ThemePreference,
    /// How large text and all else is drawn, as a factor.
    pub zoom: f32,
    /// How figures are saved.
    pub(crate) figure: FigureLook,
    /// The virtual rig, and the class mode.
    pub rig: RigState,
    /// How far the lessons have come.
    pub lessons: LessonProgress,
    /// The stream.
    pub stream: StreamForm,
    /// The series.
    pub series: SeriesForm,
}

impl Default for State {
    fn default() -> Self {
        Self {
            document: Document::of(Source::Sample(Sample::Duffing)),
            shown: Shown::default(),
            project: None,
            recent: Vec::new(),
            kept: Vec::new(),
            folders: Vec::new(),
            theme: ThemePreference::System,
            zoom: 1.0,
            figure: FigureLook::default(),
            rig: RigState::default(),
            lessons: LessonProgress::default(),
            stream: StreamForm::default(),
            series: SeriesForm::default(),
        }
    }
}

impl State {
    /// A first start with this source.
    pub fn with_source(source: Source, theme: ThemePreference) -> Self {
        Self { document: Document::of(source), theme, ..Self::default() }
    }

    /// A state as any version of the program wrote it.
    ///
    /// # Errors
    /// It is none.
    pub fn of_any_version(state: serde_json::Value) -> Result<Self, serde_json::Error> {
        serde_json::from_value(stored::upgraded_state(state))
    }

    /// What was left with a source.
    pub(crate) fn kept(&self, source: &Source) -> Option<&Document> {
        self.kept.iter().find(|kept| kept.source == *source)
    }

    /// Keeps the document that is open, at the head of the list.
    pub(crate) fn keep(&mut self) {
        self.kept.retain(|kept| kept.source != self.document.source);
        if self.document.is_worth_keeping() {
            self.kept.insert(0, self.document.clone());
        }
        self.kept.truncate(RECENT);
    }

    /// Keeps how a folder's files are read; what the header says by itself needs no keeping.
    pub(crate) fn keep_folder(&mut self, file: &Path, reading: &ReadOptions) {
        let Some(folder) = file.parent().filter(|_| !reading.columns.is_empty()) else { return };
        self.folders.retain(|f| f.folder != folder);
        self.folders.insert(0, FolderReading { folder: folder.to_owned(), reading: reading.clone() });
        self.folders.truncate(FOLDERS);
    }

    /// How the files of a source's folder were read last, if a person said so and `reading` does not say.
    pub(crate) fn folder(&self, source: &Source, reading: &ReadOptions) -> Option<&ReadOptions> {
        let Source::Files(files) = source else { return None };
        let folder = files.first().filter(|_| reading.columns.is_empty())?.parent()?;
        self.folders.iter().find(|f| f.folder == folder).map(|f| &f.reading)
    }

    /// The state with files open instead of what was, if there are any; what was left with them comes back.
    #[must_use]
    pub(crate) fn with_files(mut self, files: &[PathBuf]) -> Self {
        // What is opened is what is to be seen.
        self.series.shown &= files.is_empty();
        let source = Source::Files(files.iter().map(|file| absolute(file)).collect());
        if files.is_empty() || source == self.document.source {
            return self;
        }
        self.keep();
        let document = self.kept(&source).cloned().unwrap_or_else(|| Document::of(source));
        let shown = Shown { record: 0, walk: WalkView::default(), ..self.shown };
        Self { document, project: None, shown, ..self }
    }

    /// Puts a file at the head of the recent ones.
    pub fn remember(&mut self, path: &Path) {
        let path = absolute(path);
        self.recent.retain(|p| *p != path);
        self.recent.insert(0, path);
        self.recent.truncate(RECENT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_core::study::Settings;
    use sindyscope_values::record::Usage;

    fn pin(threshold: f64) -> Pin {
        Pin { settings: Settings { threshold, ..Settings::default() }, usage: Vec::new(), steps: Vec::new() }
    }

    fn again(state: &State) -> State {
        State::of_any_version(serde_json::to_value(state).unwrap()).unwrap()
    }

    #[test]
    fn a_state_survives_a_restart() {
        let mut state = State::with_source(Source::Files(vec!["a.csv".into()]), ThemePreference::Dark);
        state.document.edit = Edit { usage: vec![Usage::HeldOut, Usage::Off], ..Edit::default() };
        state.shown.walk.site = Some(sindyscope_search::Site::Joint(0, 1));
        state.remember("b.csv".as_ref());
        state.remember("b.csv".as_ref());
        let again = again(&state);
        assert_eq!((&again.document, &again.shown.walk), (&state.document, &state.shown.walk));
        assert_eq!(again.recent.len(), 1);
    }

    #[test]
    fn what_is_left_with_a_file_comes_back_with_it() {
        let mut first = State::default().with_files(&["a.csv".into()]);
        first.document.edit.usage = vec![Usage::HeldOut];
        first.document.reading.rate = Some(100.0);
        first.document.pins = vec![pin(0.1), pin(0.2)];
        let document = first.document.clone();
        let second = first.with_files(&["b.csv".into()]);
        assert_eq!((&second.document.edit, second.document.reading.rate), (&Edit::default(), None));
        let third = again(&second).with_files(&["a.csv".into()]);
        assert_eq!(third.document, document);
        assert!(third.kept(&second.document.source).is_none(), "nothing was decided about the second");
    }
}
