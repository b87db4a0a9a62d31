//! Files as a whole: written so that no reader ever finds half of one, and told apart by what they hold.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use flate2::Crc;

use sindyscope_core::study::Cancel;
use sindyscope_files::{MeasuredFile, ReadError};

/// Replaces a file's text: whoever reads it, also after a crash or a power cut, finds the old text or the new one.
///
/// # Errors
/// The folder cannot be made or written to; the old file is as it was.
pub(crate) fn replace(path: &Path, text: &str) -> io::Result<()> {
    // A browser's files are written whole.
    if cfg!(target_arch = "wasm32") {
        return sindyscope_system::fs::write(path, text);
    }
    static COUNT: AtomicU64 = AtomicU64::new(0);
    // A link stays a link: what it points to is replaced.
    let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?.to_string_lossy();
    // Two windows, or two saves of one, never share a temporary file.
    let own = format!(".{name}.{}-{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let temporary = folder.join(own);
    let written = File::create(&temporary).and_then(|mut file| {
        file.write_all(text.as_bytes())?;
        file.sync_all()
    });
    let renamed = written.and_then(|()| fs::rename(&temporary, &path));
    if renamed.is_err() {
        // What is left of a failed attempt is of no use; that it cannot be removed changes nothing.
        let _ = fs::remove_file(&temporary);
    }
    renamed
}

/// What tells a file's contents from another's, as text: length and CRC-32.
pub(crate) fn checksum(bytes: &[u8]) -> String {
    let mut crc = Crc::new();
    crc.update(bytes);
    format!("{} bytes, crc32 {:08x}", bytes.len(), crc.sum())
}

/// Files that were read, each once.
#[derive(Debug, Default)]
pub(crate) struct Files {
    read: HashMap<PathBuf, MeasuredFile>,
    /// Stops the reading of their records.
    cancel: Cancel,
}

impl Files {
    /// No file yet; the reading of their records is stopped by this flag.
    pub(crate) fn stopped_by(cancel: &Cancel) -> Self {
        Self { read: HashMap::new(), cancel: cancel.clone() }
    }

    /// A file, read if it was not.
    ///
    /// # Errors
    /// It is not there or cannot be read.
    pub(crate) fn get(&mut self, path: &Path) -> Result<&MeasuredFile, ReadError> {
        match self.read.entry(path.to_owned()) {
            Entry::Occupied(known) => Ok(known.into_mut()),
            Entry::Vacant(place) => Ok(place.insert(MeasuredFile::open(path)?.stopped_by(&self.cancel))),
        }
    }

    /// A file for whoever reads records of it.
    ///
    /// # Errors
    /// As [`Self::get`].
    pub(crate) fn take(&mut self, path: &Path) -> Result<MeasuredFile, ReadError> {
        self.read.remove(path).map_or_else(|| Ok(MeasuredFile::open(path)?.stopped_by(&self.cancel)), Ok)
    }
}

/// A file seen from a folder: relative where it lies in or below it, absolute elsewhere.
pub(crate) fn relative(file: &Path, folder: &Path) -> PathBuf {
    let absolute = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    absolute.strip_prefix(folder).map_or(absolute.clone(), Path::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("below/session.json");
        replace(&path, "one").unwrap();
        replace(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn what_cannot_be_written_leaves_no_trace() {
        let home = tempfile::tempdir().unwrap();
        let folder = home.path().join("taken");
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("inside"), "").unwrap();
        assert!(replace(&folder, "text").is_err(), "a folder is no file");
        assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_checksum_tells_contents_apart() {
        assert_eq!(checksum(b"t,x\n0,1\n"), checksum(b"t,x\n0,1\n"));
        assert_ne!(checksum(b"t,x\n0,1\n"), checksum(b"t,x\n0,2\n"));
        assert!(checksum(b"t,x\n0,1\n").starts_with("8 bytes, crc32 "));
    }

    #[test]
    fn a_file_is_read_once() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("a.csv");
        fs::write(&path, "one").unwrap();
        let mut files = Files::default();
        files.get(&path).unwrap();
        fs::remove_file(&path).unwrap();
        assert_eq!(files.take(&path).unwrap().bytes(), b"one");
    }
}
