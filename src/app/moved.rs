//! Files that are no longer where they were: looked for where they are likely to be, or named, so that a person can say.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::disk;
use super::problem::{Problem, file_name};

/// What helps to find files, and to tell that they are the same.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// What each file held.
    pub(crate) checksums: BTreeMap<PathBuf, String>,
    /// Where a person found files that had moved.
    pub(crate) moved: Vec<(PathBuf, PathBuf)>,
    /// The folder of the project that names them.
    pub(crate) folder: Option<PathBuf>,
}

/// Puts the files that have moved where they are now; notes tell which, and which hold something else than before.
pub(crate) fn find(files: &mut [PathBuf], known: &Known, notes: &mut Vec<String>) -> Result<(), Problem> {
    for file in files {
        let (name, sum) = (file_name(file), known.checksums.get(file));
        if !file.exists() {
            let Some(found) = known.elsewhere(file, sum) else { return Err(gone(file)) };
            notes.push(format!("{name} was found in {}", folder(&found)));
            *file = found;
        }
        if let Some(sum) = sum
            && disk::checksum(file).is_ok_and(|now| now != *sum)
        {
            notes.push(format!("{name} holds something else than when it was open last: results may differ"));
        }
    }
    Ok(())
}

impl Known {
    /// Where a file is now: where a person says, or where one of its name with the same contents lies.
    fn elsewhere(&self, file: &Path, sum: Option<&String>) -> Option<PathBuf> {
        if let Some((_, chosen)) = self.moved.iter().rev().find(|(old, _)| old == file) {
            return chosen.exists().then(|| chosen.clone());
        }
        let name = file.file_name()?;
        // What lay beside a file that moved has moved with it, likely.
        let beside =
            self.moved.iter().filter(|(old, _)| old.parent() == file.parent()).filter_map(|(_, new)| new.parent());
        let mut folders = beside.chain(self.folder.as_deref());
        let same = |path: &PathBuf| match (sum, disk::checksum(path)) {
            (Some(sum), Ok(now)) => *sum == now,
            (None, Ok(_)) => true,
            (_, Err(_)) => false,
        };
        folders.find_map(|folder| Some(folder.join(name)).filter(same))
    }
}

fn gone(file: &Path) -> Problem {
    let what = format!("{} is not in {}", file_name(file), folder(file));
    Problem { missing: Some(file.to_owned()), ..Problem::new(what, "say where it is now: nothing else is lost") }
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
        let sum = disk::checksum(&new.join("b.csv")).unwrap();
        let known = Known {
            checksums: ["b.csv", "c.csv"].map(|n| (old.join(n), sum.clone())).into(),
            moved: vec![(old.join("a.csv"), new.join("a.csv"))],
            folder: None,
        };
        let (mut files, mut notes) = ([old.join("a.csv"), old.join("b.csv")], Vec::new());
        find(&mut files, &known, &mut notes).unwrap();
        assert_eq!(files, [new.join("a.csv"), new.join("b.csv")]);
        assert_eq!(notes.len(), 2);
        let problem = find(&mut [old.join("c.csv")], &known, &mut notes).unwrap_err();
        assert!(problem.what.starts_with("c.csv is not in ") && problem.missing == Some(old.join("c.csv")));
    }

    #[test]
    fn a_file_that_changed_is_told() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("a.csv");
        fs::write(&file, "new").unwrap();
        let checksums = [(file.clone(), "3 bytes, crc32 00000000".to_owned())].into();
        let mut notes = Vec::new();
        find(&mut [file], &Known { checksums, ..Known::default() }, &mut notes).unwrap();
        assert!(notes[0].contains("a.csv holds something else"), "{notes:?}");
    }
}
