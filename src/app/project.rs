//! A saved project: the document, what each record is used for, and what was in view.
//!
//! One text file, a line a value, in an order of its own: a version control system shows what changed.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::disk;
use super::problem::{OpeningProblem, file_name};
use super::purpose::PROJECT_ENDING;
use super::state::{Document, RigState, Shown, Source, upgraded_project};
use sindyscope_values::record::Usage;

/// The format that this program writes; a higher one is from a newer program. The first had no checksums, no steps and no views;
/// the second neither report nor virtual rig, the third no walk's rounds; up to the fourth the document's parts stood side by side.
const VERSION: u32 = 5;

/// Everything that brings a study back.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Project {
    /// What kind of file this is.
    sindyscope_project: u32,
    /// The document; its files are relative to the project's folder where they lie in or below it.
    pub(crate) document: Document,
    /// What each record is used for, by its name.
    #[serde(default)]
    pub(crate) usage: BTreeMap<String, Usage>,
    /// What was in view; its record by `record`.
    #[serde(default)]
    pub(crate) shown: Option<Shown>,
    /// The name of the record that was in view.
    #[serde(default)]
    pub(crate) record: String,
    /// The virtual rig and the class mode.
    #[serde(default)]
    pub(crate) rig: Option<RigState>,
}

impl Project {
    /// A project of a document and what is in view. Records are known by their names: their order may change with their files.
    pub(crate) fn new(document: &Document, names: &[String], shown: Shown, rig: RigState) -> Self {
        let mut document = document.clone();
        let usage = names.iter().cloned().zip(std::mem::take(&mut document.edit.usage)).collect();
        document.suggestion = None;
        let record = names.get(shown.record).cloned().unwrap_or_default();
        Self { sindyscope_project: VERSION, document, usage, shown: Some(shown), record, rig: Some(rig) }
    }

    /// Reads a project of any version from what its file holds; its files' paths come out absolute.
    pub(crate) fn read(path: &Path, text: &[u8]) -> Result<Self, OpeningProblem> {
        let name = file_name(path);
        let none = |reason: String| {
            let what = format!("{name} is no project of Sindyscope: {reason}");
            OpeningProblem::new(what, "open the measurement itself, as CSV")
        };
        let value: Value = serde_json::from_slice(text).map_err(|e| none(e.to_string()))?;
        let version = value.get("sindyscope_project").and_then(Value::as_u64);
        let version = version.ok_or_else(|| none("it does not say its format".to_owned()))?;
        if version > u64::from(VERSION) {
            let what =
                format!("{name} was saved by a newer Sindyscope (format {version}; this one reads up to {VERSION})");
            return Err(OpeningProblem::new(what, "update the program, or open the measurement itself"));
        }
        let mut project: Self = serde_json::from_value(upgraded_project(value)).map_err(|e| none(e.to_string()))?;
        if let Source::Files(files) = &mut project.document.source {
            let folder = path.parent().unwrap_or(Path::new(""));
            files.iter_mut().for_each(|file| *file = folder.join(&file));
        }
        Ok(project)
    }

    /// Writes the project.
    pub(crate) fn save(&self, path: &Path) -> Result<(), String> {
        let mut project = self.clone();
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let folder = absolute.parent().unwrap_or(Path::new("")).to_owned();
        if let Source::Files(files) = &mut project.document.source {
            files.iter_mut().for_each(|file| *file = disk::relative(file, &folder));
        }
        let fail = |e: String| format!("the project was not saved: {e}; choose another folder ({})", path.display());
        let text = serde_json::to_string_pretty(&project).map_err(|e| fail(e.to_string()))?;
        disk::replace(path, &(text + "\n")).map_err(|e| fail(e.to_string()))
    }
}

/// True if a file is a project: by what it holds, whatever its name; by its name only if it cannot be read or holds something
/// else, so that the reason is told.
pub(crate) fn is_project(path: &Path, bytes: Option<&[u8]>) -> bool {
    let named = || path.extension().is_some_and(|e| e.eq_ignore_ascii_case(PROJECT_ENDING));
    bytes.is_some_and(sindyscope_files::is_project) || named()
}

/// True if the file of this path is a project.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn is_project_file(path: &Path) -> bool {
    is_project(path, sindyscope_system::fs::read(path).ok().as_deref())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::Arc;

    use super::*;
    use crate::app::state::{Base, Edit, Pin, Walk};
    use crate::app::views::View;
    use sindyscope_core::prepare::Treatment;
    use sindyscope_core::study::Settings;
    use sindyscope_search::{Choice, Found};

    fn project(file: &Path) -> Project {
        let settings = Settings { threshold: 0.03, ..Settings::default() };
        let friction = Choice { effect: "coulomb_friction".into(), form: "to ground".into() };
        let walk = Walk { base: Base::Identified, accepted: vec![friction], ..Walk::default() };
        let steps = vec![Treatment::HoldOut { share: 0.3 }.into()];
        let pin = Pin { settings: settings.clone(), usage: vec![Usage::Fit], steps: Vec::new() };
        let document = Document {
            edit: Edit { settings, walk, steps, usage: vec![Usage::HeldOut], ..Edit::default() },
            checksums: vec!["12 bytes, crc32 0badcafe".to_owned()],
            pins: vec![pin],
            ..Document::of(Source::Files(vec![file.to_owned()]))
        };
        let shown = Shown { view: View::Spectrum, ..Shown::default() };
        Project::new(&document, &["2 Hz".to_owned()], shown, RigState::default())
    }

    fn load(path: &Path) -> Result<Project, OpeningProblem> {
        Project::read(path, &fs::read(path).unwrap())
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
        after.document.edit.settings.threshold = 0.05;
        after.usage.insert("2 Hz".into(), Usage::Off);
        let (one, two) = (text(&before), text(&after));
        assert_eq!(one, text(&before), "the same project is the same text");
        assert!(one.starts_with("{\n  \"sindyscope_project\": 5,\n") && one.contains("\"run.csv\""), "{one}");
        let differ: Vec<_> = one.lines().zip(two.lines()).filter(|(a, b)| a != b).collect();
        assert_eq!(differ.len(), 2, "{differ:?}");
    }

    #[test]
    fn what_was_found_missing_is_saved_and_an_unknown_form_of_it_costs_nothing_else() {
        let home = tempfile::tempdir().unwrap();
        let (path, data) = (home.path().join("study.json"), home.path().join("run.csv"));
        let none = std::collections::HashMap::new();
        let of = ("2 records, 20 samples, crc32 0badcafe".to_owned(), None);
        let found = Found::new(of, &none, &std::collections::HashMap::new(), &std::collections::HashMap::new());
        let mut project = project(&data);
        project.document.found = Some(Arc::new(found.clone()));
        project.save(&path).unwrap();
        assert_eq!(load(&path).unwrap().document.found.as_deref(), Some(&found));
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replacen("\"rounds\": []", "\"rounds\": [\"of another form\"]", 1)).unwrap();
        let loaded = load(&path).unwrap().document;
        let dropped = loaded.found.expect("told where it does not fit");
        assert!(!dropped.is_of_the_same_as(&found) && loaded.edit.settings.threshold == 0.03);
    }

    #[test]
    fn a_project_moves_with_its_folder() {
        let home = tempfile::tempdir().unwrap();
        let (here, there) = (home.path().join("here"), home.path().join("there"));
        fs::create_dir(&here).unwrap();
        project(&here.join("run.csv")).save(&here.join("study.json")).unwrap();
        fs::rename(&here, &there).unwrap();
        let loaded = load(&there.join("study.json")).unwrap();
        let value = |p: &Project| serde_json::to_value(p).unwrap();
        assert_eq!(value(&loaded), value(&project(&there.join("run.csv"))));
    }

    #[test]
    fn a_project_is_known_by_what_it_holds() {
        let home = tempfile::tempdir().unwrap();
        for name in ["rig70.sindy", "rig70", "rig70.csv", "rig70.json"] {
            let path = home.path().join(name);
            project(&home.path().join("run.csv")).save(&path).unwrap();
            assert!(is_project_file(&path), "{name}");
        }
        let table = home.path().join("run.txt");
        fs::write(&table, "t,x\n0,1\n").unwrap();
        assert!(!is_project_file(&table));
        assert!(is_project_file(&home.path().join("gone.json")) && !is_project_file(&home.path().join("gone.sindy")));
    }

    #[test]
    fn other_files_are_refused_with_a_reason() {
        for (text, reason) in [
            (r#"{"version": 1, "verdict": "named"}"#, "is no project of Sindyscope"),
            (r#"{"sindyscope_project": 99, "else": 1}"#, "newer Sindyscope"),
        ] {
            let problem = Project::read("p.json".as_ref(), text.as_bytes()).unwrap_err();
            assert!(problem.what.contains(reason), "{}", problem.what);
        }
    }
}
