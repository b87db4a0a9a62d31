//! What a person has decided: all that survives a restart, and nothing else.

use std::path::PathBuf;
use std::sync::Arc;

use egui::ThemePreference;
use serde::{Deserialize, Serialize};

use super::figure_panel::FigureLook;
use super::lessons::Progress;
use super::missing::{RoundStep, Walk};
use super::rig::{ClassCase, RigState};
use super::views::{View, ViewState};
use sindyscope_core::prepare::Preparation;
use sindyscope_core::study::Settings;
use sindyscope_files::ReadOptions;
use sindyscope_report::document::Arrangement;
use sindyscope_rig::RigSettings;
use sindyscope_search::Found;
use sindyscope_values::record::Usage;
use sindyscope_values::term::Kind;

/// Files kept in the list of recent ones.
const RECENT: usize = 8;

/// Folders of which it is kept how their files are read.
const FOLDERS: usize = 32;

/// A record that comes with the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sample {
    /// A Duffing oscillator under harmonic force, with noise; the last part held out.
    Duffing,
    /// A base-excited mass with dry friction at four frequencies; a fifth held out.
    Friction,
    /// The Lorenz system.
    Lorenz,
    /// A Duffing oscillator that moves too little for its library; four times the force held out.
    Overfit,
}

/// Where the records come from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// None is open.
    #[default]
    Nothing,
    /// One that comes with the program.
    Sample(Sample),
    /// Files, read together.
    Files(Vec<PathBuf>),
    /// The virtual rig's, with an effect hidden in them that this seed draws.
    Hidden(u64),
    /// The room "Virtual rig", with these settings.
    Rig(Box<RigSettings>),
    /// A round of the class mode; what it hides is not told with its records.
    Round(ClassCase),
}

/// What undo takes back: everything that decides an outcome.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Edit {
    /// The settings.
    pub settings: Settings,
    /// What each record is used for, in the order of reading.
    pub usage: Vec<Usage>,
    /// What is done to the records before they are studied.
    pub steps: Vec<Preparation>,
    /// What was added to the base model in "What's missing".
    pub walk: Walk,
    /// What the report holds, in which order.
    pub report: Arrangement,
}

/// What a pinned outcome was made with: enough to make it again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pin {
    /// The settings.
    pub settings: Settings,
    /// What each record was used for, in the order of reading.
    #[serde(default)]
    pub usage: Vec<Usage>,
    /// What was done to the records before.
    #[serde(default)]
    pub steps: Vec<Preparation>,
}

/// What was left with a source when another was opened: it comes back with it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Kept {
    /// The source.
    pub source: Source,
    /// What its files' headers do not say.
    pub reading: ReadOptions,
    /// Its settings and usages, if they are other than the program's own choice.
    pub edit: Option<Edit>,
    /// Its pins, in their order.
    pub pins: Vec<Pin>,
    /// What was found missing in it.
    #[serde(deserialize_with = "leniently")]
    pub found: Option<Arc<Found>>,
}

/// How the files of a folder were read, where a person said which column is which.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FolderReading {
    /// The folder.
    pub folder: PathBuf,
    /// How its files were read last.
    pub reading: ReadOptions,
}

/// A room of work: what the centre of the window is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Room {
    /// From a measurement to its equation of motion.
    #[default]
    Identify,
    /// Where a model and the measurement part, and which effect that is.
    Missing,
    /// A plant whose every number can be moved, lessons and the class mode.
    Rig,
    /// What one takes along.
    Report,
}

impl Room {
    /// Every room, in the order of their keys 1, 2, …; with one there is nothing to switch.
    pub(crate) const ALL: [Self; 4] = [Self::Identify, Self::Missing, Self::Rig, Self::Report];

    /// The switch's text.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Identify => "Identify",
            Self::Missing => "What's missing",
            Self::Rig => "Virtual rig",
            Self::Report => "Report",
        }
    }

    /// What one does in it, in one sentence.
    pub(crate) fn tooltip(self) -> &'static str {
        match self {
            Self::Identify => "From the measurement to its equation of motion",
            Self::Missing => "Where a model's response and the measurement part, and which physical effect that is",
            Self::Rig => {
                "A plant whose every number you can move, with its motion and what is found in its record; lessons and a class mode"
            }
            Self::Report => {
                "The pages to take along: choose sections and figures, write between them, save as PDF or HTML"
            }
        }
    }
}

/// Everything that survives a restart.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default)]
pub struct State {
    /// Where the records come from.
    pub source: Source,
    /// What a file's header does not say.
    pub reading: ReadOptions,
    /// The settings and usages that belong to the source; none until it was read for the first time.
    pub edit: Option<Edit>,
    /// The settings that the program chose itself: what reset goes back to.
    pub suggestion: Option<Settings>,
    /// The saved project that this is, if it is one.
    pub project: Option<PathBuf>,
    /// Files opened lately, the newest first.
    pub recent: Vec<PathBuf>,
    /// What was left with each source lately open, the newest first.
    pub kept: Vec<Kept>,
    /// How files were read in each folder lately, the newest first.
    pub folders: Vec<FolderReading>,
    /// What the files held when they were read last, in the order of the source: `120 bytes, crc32 …`.
    pub checksums: Vec<String>,
    /// Light, dark or as the system is.
    pub theme: ThemePreference,
    /// How large text and all else is drawn, as a factor.
    pub zoom: f32,
    /// Which record the views show.
    pub record: usize,
    /// Whether the whole record is shown above the plots, to be cut by dragging.
    pub cutting: bool,
    /// How figures are saved.
    pub(crate) figure: FigureLook,
    /// What was found missing.
    #[serde(deserialize_with = "leniently")]
    pub found: Option<Arc<Found>>,
    /// The virtual rig, and the class mode.
    pub rig: RigState,
    /// How far the lessons have come.
    pub lessons: Progress,
    /// The step of the walk in "What's missing" that is in view.
    pub(crate) step: RoundStep,
    pub(crate) room: Room,
    pub(crate) view: View,
    pub(crate) views: ViewState,
}

impl Default for State {
    fn default() -> Self {
        Self {
            source: Source::Sample(Sample::Duffing),
            reading: ReadOptions::default(),
            edit: None,
            suggestion: None,
            project: None,
            recent: Vec::new(),
            kept: Vec::new(),
            folders: Vec::new(),
            checksums: Vec::new(),
            theme: ThemePreference::System,
            zoom: 1.0,
            record: 0,
            cutting: false,
            figure: FigureLook::default(),
            found: None,
            rig: RigState::default(),
            lessons: Progress::default(),
            step: RoundStep::default(),
            room: Room::default(),
            view: View::default(),
            views: ViewState::default(),
        }
    }
}

impl State {
    /// A first start with this source.
    pub fn with_source(source: Source, theme: ThemePreference) -> Self {
        let kind = if let Source::Sample(sample) = source { sample.kind() } else { Kind::default() };
        let reading = ReadOptions { kind, ..ReadOptions::default() };
        Self { source, reading, theme, ..Self::default() }
    }

    /// What was left with a source.
    pub(crate) fn kept(&self, source: &Source) -> Option<&Kept> {
        self.kept.iter().find(|k| k.source == *source)
    }

    /// Keeps the pins of a source, at the head of the list.
    pub(crate) fn keep_pins(&mut self, source: &Source, pins: Vec<Pin>) {
        let old = self.kept(source).cloned().unwrap_or_default();
        self.keep(Kept { source: source.clone(), pins, ..old });
    }

    /// Keeps what is left with the source that is open, its pins as they are.
    pub(crate) fn keep_edit(&mut self, edit: Option<Edit>, found: Option<Arc<Found>>) {
        if self.source == Source::Nothing {
            return;
        }
        let pins = self.kept(&self.source).map(|k| k.pins.clone()).unwrap_or_default();
        self.keep(Kept { source: self.source.clone(), reading: self.reading.clone(), edit, pins, found });
    }

    fn keep(&mut self, kept: Kept) {
        self.kept.retain(|k| k.source != kept.source);
        if kept.edit.is_some() || !kept.pins.is_empty() || kept.found.is_some() {
            self.kept.insert(0, kept);
        }
        self.kept.truncate(RECENT);
    }

    /// Keeps how a folder's files are read; what the header says by itself needs no keeping.
    pub(crate) fn keep_folder(&mut self, file: &std::path::Path, reading: &ReadOptions) {
        let Some(folder) = file.parent().filter(|_| !reading.columns.is_empty()) else { return };
        self.folders.retain(|f| f.folder != folder);
        self.folders.insert(0, FolderReading { folder: folder.to_owned(), reading: reading.clone() });
        self.folders.truncate(FOLDERS);
    }

    /// How files of a folder were read last, if a person said so.
    pub(crate) fn folder(&self, file: &std::path::Path) -> Option<&ReadOptions> {
        let folder = file.parent()?;
        self.folders.iter().find(|f| f.folder == folder).map(|f| &f.reading)
    }

    /// The state with files open instead of what was, if there are any; what was left with them comes back.
    #[must_use]
    pub(crate) fn with_files(mut self, files: Vec<PathBuf>) -> Self {
        let source = Source::Files(files.into_iter().map(absolute).collect());
        if source == self.source || source == Source::Files(Vec::new()) {
            return self;
        }
        self.keep_edit(self.edit.clone(), self.found.clone());
        let kept = self.kept(&source).cloned().unwrap_or_default();
        let Kept { reading, edit, found, .. } = kept;
        Self { source, reading, edit, found, suggestion: None, project: None, checksums: Vec::new(), record: 0, ..self }
    }

    /// Puts a file at the head of the recent ones.
    pub fn remember(&mut self, path: &std::path::Path) {
        let path = absolute(path.to_owned());
        self.recent.retain(|p| *p != path);
        self.recent.insert(0, path);
        self.recent.truncate(RECENT);
    }
}

/// Reads what was found missing. What another version wrote in another form belongs to no records: it is dropped and told,
/// and all else is read.
pub(crate) fn leniently<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Arc<Found>>, D::Error> {
    let value = Option::<serde_json::Value>::deserialize(deserializer)?;
    Ok(value.map(|value| serde_json::from_value(value).unwrap_or_default()))
}

/// A path that holds wherever the program is started next.
pub(crate) fn absolute(path: PathBuf) -> PathBuf {
    std::path::absolute(&path).unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_survives_a_restart() {
        let mut state = State { source: Source::Files(vec!["a.csv".into()]), ..State::default() };
        state.edit = Some(Edit { usage: vec![Usage::HeldOut, Usage::Off], ..Edit::default() });
        state.remember("b.csv".as_ref());
        state.remember("b.csv".as_ref());
        let text = serde_json::to_string(&state).unwrap();
        let again: State = serde_json::from_str(&text).unwrap();
        assert_eq!((again.source, again.edit, again.recent.len()), (state.source, state.edit, 1));
    }

    #[test]
    fn each_source_keeps_its_pins() {
        let mut state = State::default();
        let pin = |threshold| Pin {
            settings: Settings { threshold, ..Settings::default() },
            usage: Vec::new(),
            steps: Vec::new(),
        };
        let file = Source::Files(vec!["a.csv".into()]);
        state.keep_pins(&file, vec![pin(0.1), pin(0.2)]);
        state.keep_pins(&Source::Sample(Sample::Lorenz), vec![pin(0.3)]);
        let text = serde_json::to_string(&state).unwrap();
        let again: State = serde_json::from_str(&text).unwrap();
        assert_eq!(again.kept(&file).unwrap().pins, [pin(0.1), pin(0.2)]);
        assert_eq!(again.kept(&Source::Sample(Sample::Lorenz)).unwrap().pins, [pin(0.3)]);
        state.keep_pins(&file, Vec::new());
        assert!(state.kept(&file).is_none());
    }

    #[test]
    fn what_is_left_with_a_file_comes_back_with_it() {
        let edit = Edit { usage: vec![Usage::HeldOut], ..Edit::default() };
        let reading = ReadOptions { rate: Some(100.0), ..ReadOptions::default() };
        let first = State {
            source: Source::Files(vec![absolute("a.csv".into())]),
            edit: Some(edit.clone()),
            reading: reading.clone(),
            ..State::default()
        };
        let second = first.with_files(vec!["b.csv".into()]);
        assert_eq!((second.edit.clone(), second.reading.rate), (None, None));
        let again = second.with_files(vec!["a.csv".into()]);
        assert_eq!((again.edit, again.reading), (Some(edit), reading));
    }

    #[test]
    fn an_older_state_lacks_fields_and_is_read_all_the_same() {
        let state: State = serde_json::from_str(r#"{"record": 2}"#).unwrap();
        assert_eq!((state.record, state.source), (2, Source::Sample(Sample::Duffing)));
    }
}
