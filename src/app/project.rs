//! A saved project: which records, how they are used, with which settings, what was found missing, what was in view.
//!
//! One text file, a line a value, in an order of its own: a version control system shows what changed.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::disk;
use super::missing::{RoundStep, Walk};
use super::problem::{Problem, file_name};
use super::rig::RigState;
use super::state::{Edit, Pin, Room, Source, leniently};
use super::views::{View, ViewState};
use sindyscope_core::prepare::Preparation;
use sindyscope_core::study::Settings;
use sindyscope_files::ReadOptions;
use sindyscope_report::document::Arrangement;
use sindyscope_search::Found;
use sindyscope_values::record::Usage;

/// The format that this program writes; a higher one is from a newer program. The first had no checksums, no steps and no views;
/// the second neither report nor virtual rig, the third no walk's rounds.
const VERSION: u32 = 4;

/// Bytes of a file that are looked at to tell what it is.
const HEAD: u64 = 1 << 16;

/// The ending of a project's file.
pub(crate) const EXTENSION: &str = "json";

/// Everything that brings a study back.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Project {
    /// What kind of file this is.
    sindyscope_project: u32,
    /// Where the records come from; files relative to the project's folder where they lie in or below it.
    pub(crate) source: Source,
    /// What each file held, by its path as `source` has it.
    #[serde(default)]
    pub(crate) checksums: BTreeMap<PathBuf, String>,
    /// What the files' headers do not say.
    #[serde(default)]
    pub(crate) reading: ReadOptions,
    /// What is done to the records before they are studied, in order.
    #[serde(default)]
    pub(crate) steps: Vec<Preparation>,
    /// What each record is used for, by its name.
    #[serde(default)]
    pub(crate) usage: BTreeMap<String, Usage>,
    /// The settings.
    pub(crate) settings: Settings,
    /// What was added to the base model in "What's missing".
    #[serde(default)]
    pub(crate) walk: Walk,
    /// What the search for it found.
    #[serde(default, deserialize_with = "leniently", skip_serializing_if = "Option::is_none")]
    pub(crate) found: Option<Arc<Found>>,
    /// What the report holds, in which order.
    #[serde(default)]
    pub(crate) report: Arrangement,
    /// What was pinned to be compared.
    #[serde(default)]
    pub(crate) pins: Vec<Pin>,
    /// What was in view.
    #[serde(default)]
    pub(crate) shown: Option<Shown>,
    /// The virtual rig and the class mode.
    #[serde(default)]
    pub(crate) rig: Option<RigState>,
}

/// What the window shows of a project.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct Shown {
    pub(crate) room: Room,
    /// The step of the walk in "What's missing".
    pub(crate) step: RoundStep,
    pub(crate) view: View,
    /// The record's name.
    pub(crate) record: String,
    pub(crate) views: ViewState,
}

impl Project {
    /// A project of these parts.
    pub(crate) fn new(source: Source, reading: ReadOptions, usage: BTreeMap<String, Usage>, edit: &Edit) -> Self {
        let Edit { settings, walk, steps, report, .. } = edit.clone();
        let (checksums, found, pins, shown, rig) = (BTreeMap::new(), None, Vec::new(), None, None);
        Self {
            sindyscope_project: VERSION,
            source,
            checksums,
            reading,
            steps,
            usage,
            settings,
            walk,
            found,
            report,
            pins,
            shown,
            rig,
        }
    }

    /// This project with what its files held when they were read, in their order.
    #[must_use]
    pub(crate) fn with_checksums(mut self, checksums: &[String]) -> Self {
        if let Source::Files(files) = &self.source {
            self.checksums = files.iter().cloned().zip(checksums.iter().cloned()).collect();
        }
        self
    }

    /// This project with what was found missing.
    #[must_use]
    pub(crate) fn with_found(self, found: Option<Arc<Found>>) -> Self {
        Self { found, ..self }
    }

    /// This project with pinned settings.
    #[must_use]
    pub(crate) fn with_pins(self, pins: Vec<Pin>) -> Self {
        Self { pins, ..self }
    }

    /// This project with what is in view.
    #[must_use]
    pub(crate) fn with_shown(self, shown: Shown) -> Self {
        Self { shown: Some(shown), ..self }
    }

    /// This project with the virtual rig as it stands.
    #[must_use]
    pub(crate) fn with_rig(self, rig: RigState) -> Self {
        Self { rig: Some(rig), ..self }
    }

    /// Reads a project; its files' paths come out absolute.
    pub(crate) fn load(path: &Path) -> Result<Self, Problem> {
        let problem = |what: String, advice: &str| Problem::new(what, advice);
        let name = file_name(path);
        let text = fs::read_to_string(path)
            .map_err(|e| problem(format!("{name}: {e}"), "check the path, and that the file may be read"))?;
        let version: Result<Version, _> = serde_json::from_str(&text);
        if let Ok(Version { sindyscope_project: version }) = version
            && version > VERSION
        {
            return Err(problem(
                format!("{name} was saved by a newer Sindyscope (format {version}; this one reads up to {VERSION})"),
                "update the program, or open the measurement itself",
            ));
        }
        let mut project: Self = serde_json::from_str(&text).map_err(|e| {
            problem(format!("{name} is no project of Sindyscope: {e}"), "open the measurement itself, as CSV")
        })?;
        if let Source::Files(files) = &mut project.source {
            let folder = path.parent().unwrap_or(Path::new(""));
            for file in files {
                *file = folder.join(&file);
            }
            project.checksums = project.checksums.into_iter().map(|(file, sum)| (folder.join(file), sum)).collect();
        }
        Ok(project)
    }

    /// Writes the project.
    pub(crate) fn save(&self, path: &Path) -> Result<(), String> {
        let mut project = self.clone();
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let folder = absolute.parent().unwrap_or(Path::new("")).to_owned();
        if let Source::Files(files) = &mut project.source {
            for file in files {
                *file = disk::relative(file, &folder);
            }
            let near = |(file, sum)| (disk::relative(file, &folder), sum);
            project.checksums = self.checksums.iter().map(|(file, sum)| near((file, sum.clone()))).collect();
        }
        let fail = |e: String| format!("the project was not saved: {e}; choose another folder ({})", path.display());
        let text = serde_json::to_string_pretty(&project).map_err(|e| fail(e.to_string()))?;
        disk::replace(path, &(text + "\n")).map_err(|e| fail(e.to_string()))
    }
}

#[derive(Deserialize)]
struct Version {
    sindyscope_project: u32,
}

/// True if a file is a project: by what it holds, whatever its name; by its name only if it holds something else or
/// cannot be read, so that the reason is told.
pub(crate) fn is_project(path: &Path) -> bool {
    let named = || path.extension().is_some_and(|e| e.eq_ignore_ascii_case(EXTENSION));
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    (read.is_ok() && sindyscope_files::is_project(&head)) || named()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::missing::Base;
    use sindyscope_core::prepare::Treatment;
    use sindyscope_search::Choice;

    fn project(file: &Path) -> Project {
        let usage = BTreeMap::from([("2 Hz".to_owned(), Usage::HeldOut)]);
        let settings = Settings { threshold: 0.03, ..Settings::default() };
        let friction = Choice { effect: "coulomb_friction".into(), form: "to ground".into() };
        let walk = Walk { base: Base::Identified, accepted: vec![friction] };
        let steps = vec![Treatment::HoldOut { share: 0.3 }.into()];
        let edit = Edit { settings, walk, steps, ..Edit::default() };
        let pin = Pin { settings: edit.settings.clone(), usage: vec![Usage::Fit], steps: Vec::new() };
        let shown = Shown { view: View::Spectrum, record: "2 Hz".into(), ..Shown::default() };
        Project::new(Source::Files(vec![file.to_owned()]), ReadOptions::default(), usage, &edit)
            .with_checksums(&["12 bytes, crc32 0badcafe".to_owned()])
            .with_pins(vec![pin])
            .with_shown(shown)
    }

    #[test]
    fn a_project_reads_well_in_a_diff() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("study.json");
        let text = |project: &Project| {
            project.save(&path).unwrap();
            fs::read_to_string(&path).unwrap()
        };
        let before = project(&home.path().join("run.csv"));
        let mut after = before.clone();
        after.settings.threshold = 0.05;
        after.usage.insert("2 Hz".into(), Usage::Off);
        let (one, two) = (text(&before), text(&after));
        assert_eq!(one, text(&before), "the same project is the same text");
        assert!(one.starts_with("{\n  \"sindyscope_project\": 4,\n") && one.contains("\"run.csv\""), "{one}");
        let differ: Vec<_> = one.lines().zip(two.lines()).filter(|(a, b)| a != b).collect();
        assert_eq!(differ.len(), 2, "{differ:?}");
    }

    #[test]
    fn a_project_of_the_first_format_is_read() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("old.json");
        let settings = serde_json::to_string(&Settings::default()).unwrap();
        let text =
            format!(r#"{{"sindyscope_project": 1, "source": {{"files": ["run.csv"]}}, "settings": {settings}}}"#);
        fs::write(&path, text).unwrap();
        let loaded = Project::load(&path).unwrap();
        assert_eq!(loaded.source, Source::Files(vec![home.path().join("run.csv")]));
        assert!(loaded.checksums.is_empty() && loaded.shown.is_none() && loaded.found.is_none());
    }

    #[test]
    fn what_was_found_missing_is_saved_and_an_unknown_form_of_it_costs_nothing_else() {
        let home = tempfile::tempdir().unwrap();
        let (path, data) = (home.path().join("study.json"), home.path().join("run.csv"));
        let none = std::collections::HashMap::new();
        let of = ("2 records, 20 samples, crc32 0badcafe".to_owned(), None);
        let found = Found::new(of, &none, &std::collections::HashMap::new(), &std::collections::HashMap::new());
        let project = project(&data).with_found(Some(Arc::new(found.clone())));
        project.save(&path).unwrap();
        assert_eq!(Project::load(&path).unwrap().found.as_deref(), Some(&found));
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("\"rounds\": []", "\"rounds\": [\"of another form\"]")).unwrap();
        let loaded = Project::load(&path).unwrap();
        let dropped = loaded.found.expect("told where it does not fit");
        assert!(!dropped.is_of_the_same_as(&found) && loaded.settings.threshold == 0.03);
    }

    #[test]
    fn a_project_moves_with_its_folder() {
        let home = tempfile::tempdir().unwrap();
        let (here, there) = (home.path().join("here"), home.path().join("there"));
        fs::create_dir(&here).unwrap();
        project(&here.join("run.csv")).save(&here.join("study.json")).unwrap();
        fs::rename(&here, &there).unwrap();
        let loaded = Project::load(&there.join("study.json")).unwrap();
        let value = |p: &Project| serde_json::to_value(p).unwrap();
        assert_eq!(value(&loaded), value(&project(&there.join("run.csv"))));
    }

    #[test]
    fn a_project_is_known_by_what_it_holds() {
        let home = tempfile::tempdir().unwrap();
        for name in ["rig70.sindy", "rig70", "rig70.csv", "rig70.json"] {
            let path = home.path().join(name);
            project(&home.path().join("run.csv")).save(&path).unwrap();
            assert!(is_project(&path), "{name}");
        }
        let table = home.path().join("run.txt");
        fs::write(&table, "t,x\n0,1\n").unwrap();
        assert!(!is_project(&table));
        assert!(is_project(&home.path().join("gone.json")) && !is_project(&home.path().join("gone.sindy")));
    }

    #[test]
    fn other_files_are_refused_with_a_reason() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("p.json");
        for (text, reason) in [
            (r#"{"version": 1, "verdict": "named"}"#, "is no project of Sindyscope"),
            (r#"{"sindyscope_project": 99, "else": 1}"#, "newer Sindyscope"),
        ] {
            fs::write(&path, text).unwrap();
            let problem = Project::load(&path).unwrap_err();
            assert!(problem.what.contains(reason), "{}", problem.what);
        }
    }
}
