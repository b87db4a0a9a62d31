//! Files that are no longer where they were: looked for where they are likely to be, or named, so that a person can say.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::disk::{Files, checksum};
use super::problem::{OpeningProblem, file_name};
use sindyscope_files::MeasuredFile;

/// What helps to find files, and to tell that they are the same.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownFiles {
    /// What each file held.
    pub(crate) checksums: BTreeMap<PathBuf, String>,
    /// Where a person found files that had moved.
    pub(crate) moved: Vec<(PathBuf, PathBuf)>,
    /// The folder of the project that names them.
    pub(crate) folder: Option<PathBuf>,
}

/// What the files hold, with where each is now; notes tell which have moved, and which hold something else than before.
///
/// # Errors
/// A file is nowhere to be found, or cannot be read.
pub(crate) fn load(
    paths: &[PathBuf],
    known: &KnownFiles,
    files: &mut Files,
    notes: &mut Vec<String>,
) -> Result<Vec<(PathBuf, MeasuredFile)>, OpeningProblem> {
    let mut loaded = Vec::with_capacity(paths.len());
    for path in paths {
        let (name, sum) = (file_name(path), known.checksums.get(path).filter(|sum| !sum.is_empty()));
        let (place, file) = match files.take(path) {
            Ok(file) => (path.clone(), file),
            Err(_) if !sindyscope_system::fs::exists(path) => {
                let found = known.elsewhere(path, sum, files).ok_or_else(|| gone(path))?;
                notes.push(format!("{name} was found in {}", folder(&found.0)));
                found
            }
            Err(error) => return Err(OpeningProblem::reading(&error)),
        };
        if sum.is_some_and(|sum| *sum != checksum(file.bytes())) {
            notes.push(format!("{name} holds something else than when it was open last: results may differ"));
        }
        loaded.push((place, file));
    }
    Ok(loaded)
}

impl KnownFiles {
    /// Where a file is now: where a person says, or where one of its name with the same contents lies.
    fn elsewhere(&self, file: &Path, sum: Option<&String>, files: &mut Files) -> Option<(PathBuf, MeasuredFile)> {
        let mut load = |path: PathBuf| files.take(&path).ok().map(|file| (path, file));
        if let Some((_, chosen)) = self.moved.iter().rev().find(|(old, _)| old == file) {
            return load(chosen.clone());
        }
        let name = file.file_name()?;
        // What lay beside a file that moved has moved with it, likely.
        let beside =
            self.moved.iter().filter(|(old, _)| old.parent() == file.parent()).filter_map(|(_, new)| new.parent());
        let same = |file: &MeasuredFile| sum.is_none_or(|sum| *sum == checksum(file.bytes()));
        let mut folders = beside.chain(self.folder.as_deref());
        folders.find_map(|folder| load(folder.join(name)).filter(|(_, file)| same(file)))
    }
}

fn gone(file: &Path) -> OpeningProblem {
    let what = format!("{} is not in {}", file_name(file), folder(file));
    OpeningProblem {
        missing: Some(file.to_owned()),
        ..OpeningProblem::new(what, "say where it is now: nothing else is lost")
    }
}

fn folder(file: &Path) -> String {
    match file.parent().filter(|p| !p.as_os_str().is_empty()) {
        Some(parent) => parent.display().to_string(),
        None => "this folder".into(),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn files_are_found_where_their_fellows_moved_if_they_hold_the_same() {
        let home = tempfile::tempdir().unwrap();
        let [old, new] = ["old", "new"].map(|f| home.path().join(f));
        fs::create_dir(&new).unwrap();
        for (name, text) in [("a.csv", "a"), ("b.csv", "b"), ("c.csv", "other")] {
            fs::write(new.join(name), text).unwrap();
        }
        let sum = checksum(b"b");
        let known = KnownFiles {
            checksums: ["b.csv", "c.csv"].map(|n| (old.join(n), sum.clone())).into(),
            moved: vec![(old.join("a.csv"), new.join("a.csv"))],
            folder: None,
        };
        let mut notes = Vec::new();
        let wanted = [old.join("a.csv"), old.join("b.csv")];
        let found = load(&wanted, &known, &mut Files::default(), &mut notes).unwrap();
        assert_eq!([&found[0].0, &found[1].0], [&new.join("a.csv"), &new.join("b.csv")]);
        assert_eq!(notes.len(), 2);
        let problem = load(&[old.join("c.csv")], &known, &mut Files::default(), &mut notes).unwrap_err();
        assert!(problem.what.starts_with("c.csv is not in ") && problem.missing == Some(old.join("c.csv")));
    }

    #[test]
    fn a_file_that_changed_is_told() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("a.csv");
        fs::write(&file, "new").unwrap();
        let checksums = [(file.clone(), "3 bytes, crc32 00000000".to_owned())].into();
        let mut notes = Vec::new();
        let known = KnownFiles { checksums, ..KnownFiles::default() };
        load(&[file], &known, &mut Files::default(), &mut notes).unwrap();
        assert!(notes[0].contains("a.csv holds something else"), "{notes:?}");
    }
}
