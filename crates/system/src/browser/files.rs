//! Files in memory. Those below [`KEPT`] are kept by the page; any other that is written is a download.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use super::ask_to_wake;
use crate::lock;

/// The folder of what outlasts the page.
pub const KEPT: &str = "/kept";

type Bytes = Arc<Vec<u8>>;

/// What the page has to do with a file.
pub(super) enum FileChange {
    /// Keep these bytes, or none any more.
    Kept(PathBuf, Option<Bytes>),
    /// Hand it to the person.
    Given(String, Bytes),
}

static FILES: Mutex<BTreeMap<PathBuf, Bytes>> = Mutex::new(BTreeMap::new());
static CHANGES: Mutex<Vec<FileChange>> = Mutex::new(Vec::new());

fn get(path: &Path) -> io::Result<Bytes> {
    let missing = || io::Error::new(io::ErrorKind::NotFound, "this page has no such file");
    lock(&FILES).get(path).cloned().ok_or_else(missing)
}

/// What a file holds.
///
/// # Errors
/// There is none of this path.
pub fn read(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    // Copied outside the lock: the page's own thread may wait for it.
    Ok(get(path.as_ref())?.to_vec())
}

/// What a file of text holds.
///
/// # Errors
/// There is none of this path, or it is no text.
pub fn read_to_string(path: impl AsRef<Path>) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))
}

/// Replaces a file below [`KEPT`]; hands any other to the person.
///
/// # Errors
/// The path names no file.
pub fn write(path: impl AsRef<Path>, contents: impl AsRef<[u8]>) -> io::Result<()> {
    let (path, bytes) = (path.as_ref(), Arc::new(contents.as_ref().to_vec()));
    let change = if path.starts_with(KEPT) {
        lock(&FILES).insert(path.to_owned(), Arc::clone(&bytes));
        FileChange::Kept(path.to_owned(), Some(bytes))
    } else {
        let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        FileChange::Given(name.to_string_lossy().into_owned(), bytes)
    };
    lock(&CHANGES).push(change);
    ask_to_wake();
    Ok(())
}

/// Gives a file another path.
///
/// # Errors
/// There is none of this path, or the new one names no file.
pub fn rename(from: impl AsRef<Path>, to: impl AsRef<Path>) -> io::Result<()> {
    let from = from.as_ref();
    write(to, read(from)?)?;
    forget(from);
    Ok(())
}

fn forget(path: &Path) {
    lock(&FILES).remove(path);
    lock(&CHANGES).push(FileChange::Kept(path.to_owned(), None));
    ask_to_wake();
}

pub(crate) fn exists(path: &Path) -> bool {
    lock(&FILES).contains_key(path)
}

/// Paths for files that a person handed in together, in one folder below [`KEPT`]. The folder is named by what they hold, so that files of
/// one name stand side by side, and the same ones twice are there once.
pub fn place(files: Vec<(String, Vec<u8>)>) -> Vec<PathBuf> {
    // FNV-1a: tells the files of one person apart, and no more is asked of it.
    let sum = files
        .iter()
        .flat_map(|(_, bytes)| bytes)
        .fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    let folder = Path::new(KEPT).join("files").join(format!("{sum:016x}"));
    let placed = |(name, bytes): (String, Vec<u8>)| {
        // A path stands in the session's text as it is: without what JSON would write otherwise.
        let plain = |c: char| if c.is_control() || "/\\\"".contains(c) { '_' } else { c };
        let path = folder.join(name.chars().map(plain).collect::<String>());
        if !exists(&path) {
            // It cannot fail: the path was just given a name.
            let _ = write(&path, bytes);
        }
        path
    };
    files.into_iter().map(placed).collect()
}

/// Drops the files that were handed in and that none of these texts names any more.
pub fn drop_unnamed(texts: &[String]) {
    let handed_in = Path::new(KEPT).join("files");
    let named = |path: &Path| texts.iter().any(|text| text.contains(&*path.to_string_lossy()));
    let all: Vec<PathBuf> = lock(&FILES).keys().filter(|path| path.starts_with(&handed_in)).cloned().collect();
    all.iter().filter(|path| !named(path)).for_each(|path| forget(path));
}

pub(super) fn restore(kept: impl Iterator<Item = (String, Vec<u8>)>) {
    lock(&FILES).extend(kept.map(|(path, bytes)| (PathBuf::from(path), Arc::new(bytes))));
}

pub(super) fn changes() -> Vec<FileChange> {
    std::mem::take(&mut *lock(&CHANGES))
}
