//! A saved project: which records, how they are used, with which settings.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::errand::{Problem, file_name};
use super::missing::Walk;
use super::state::{Edit, Pin, Source};
use crate::record::{ReadOptions, Usage};
use crate::study::Settings;

/// The format that this program writes; a higher one is from a newer program.
const VERSION: u32 = 1;

/// Bytes of a file that are looked at to tell what it is.
const HEAD: u64 = 1 << 16;

/// The ending of a project's file.
pub(crate) const EXTENSION: &str = "json";

/// Everything that brings a study back.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Project {
    /// What kind of file this is.
    sindyscope_project: u32,
    /// Where the records come from; files relative to the project's folder where they lie in or below it.
    pub(crate) source: Source,
    /// What the files' headers do not say.
    #[serde(default)]
    pub(crate) reading: ReadOptions,
    /// What each record is used for, by its name.
    #[serde(default)]
    pub(crate) usage: BTreeMap<String, Usage>,
    /// The settings.
    pub(crate) settings: Settings,
    /// What was added to the base model in "What's missing".
    #[serde(default)]
    pub(crate) walk: Walk,
    /// What was pinned to be compared.
    #[serde(default)]
    pub(crate) pins: Vec<Pin>,
}

impl Project {
    /// A project of these parts.
    pub(crate) fn new(source: Source, reading: ReadOptions, usage: BTreeMap<String, Usage>, edit: &Edit) -> Self {
        let Edit { settings, walk, .. } = edit.clone();
        Self { sindyscope_project: VERSION, source, reading, usage, settings, walk, pins: Vec::new() }
    }

    /// This project with pinned settings.
    #[must_use]
    pub(crate) fn with_pins(self, pins: Vec<Pin>) -> Self {
        Self { pins, ..self }
    }

    /// Reads a project; its files' paths come out absolute.
    pub(crate) fn load(path: &Path) -> Result<Self, Problem> {
        let problem = |what: String, advice: &str| Problem { what, advice: advice.into(), columns: Vec::new() };
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
                *file = relative(file, &folder);
            }
        }
        let fail = |e: String| format!("the project was not saved: {e}; choose another folder ({})", path.display());
        let text = serde_json::to_string_pretty(&project).map_err(|e| fail(e.to_string()))?;
        fs::write(path, text + "\n").map_err(|e| fail(e.to_string()))
    }
}

#[derive(Deserialize)]
struct Version {
    sindyscope_project: u32,
}

fn relative(file: &Path, folder: &Path) -> PathBuf {
    let absolute = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    absolute.strip_prefix(folder).map_or(absolute.clone(), Path::to_owned)
}

/// True if a file is a project: by what it holds, whatever its name; by its name only if it holds something else or
/// cannot be read, so that the reason is told.
pub(crate) fn is_project(path: &Path) -> bool {
    let named = || path.extension().is_some_and(|e| e.eq_ignore_ascii_case(EXTENSION));
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    (read.is_ok() && crate::record::is_project(&head)) || named()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::missing::Base;
    use crate::gap::Choice;

    fn project(file: &Path) -> Project {
        let usage = BTreeMap::from([("2 Hz".to_owned(), Usage::HeldOut)]);
        let settings = Settings { threshold: 0.03, ..Settings::default() };
        let friction = Choice { effect: "coulomb_friction".into(), form: "to ground".into() };
        let walk = Walk { base: Base::Identified, accepted: vec![friction] };
        let edit = Edit { settings, walk, ..Edit::default() };
        let pin = Pin { settings: edit.settings.clone(), usage: vec![Usage::Fit] };
        Project::new(Source::Files(vec![file.to_owned()]), ReadOptions::default(), usage, &edit).with_pins(vec![pin])
    }

    #[test]
    fn a_project_moves_with_its_folder() {
        let home = tempfile::tempdir().unwrap();
        let (here, there) = (home.path().join("here"), home.path().join("there"));
        fs::create_dir(&here).unwrap();
        project(&here.join("run.csv")).save(&here.join("study.json")).unwrap();
        fs::rename(&here, &there).unwrap();
        let loaded = Project::load(&there.join("study.json")).unwrap();
        assert_eq!(loaded, project(&there.join("run.csv")));
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
