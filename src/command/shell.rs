//! Paths as they are typed into a shell.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// A path as it is typed from a folder; of another drive, as it is.
pub(super) fn seen_from(folder: &Path, path: &Path) -> PathBuf {
    if path.is_relative() {
        return path.to_owned();
    }
    let common = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    if common == 0 {
        return path.to_owned();
    }
    let up = folder.components().skip(common).map(|_| OsStr::new(".."));
    up.chain(path.components().skip(common).map(|c| c.as_os_str())).collect()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_told_from_where_one_stands() {
        let here = Path::new("/home/me/rig");
        for (path, told) in [
            ("run.csv", "run.csv"),
            ("/home/me/rig/data/run.csv", "data/run.csv"),
            ("/home/me/run.csv", "../run.csv"),
            ("/data/run.csv", "../../../data/run.csv"),
        ] {
            assert_eq!(seen_from(here, Path::new(path)), Path::new(told));
        }
    }
}
