//! The records of a batch: those of a folder, or of a list.

use std::path::{Path, PathBuf};

use super::BatchError;
use sindyscope_files::FORMATS;

/// One record of a batch.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchItem {
    /// What it is called in the table: its file as the list or the folder has it.
    pub name: String,
    /// The file that is fitted.
    pub data: PathBuf,
    /// A file that is held out, where the list has one.
    pub test: Option<PathBuf>,
    /// What else the list says of it, by column: amplitude, specimen.
    pub said: Vec<(String, String)>,
}

/// The column of a list that names the files.
const FILE: &str = "file";
/// The column of a list that names files to hold out.
const TEST: &str = "test";

/// The records of a folder in the order of their names, or of a list: a file a line, or CSV with a column `file`, which may have a
/// column `test` and any others. Files of a list stand as seen from its folder.
///
/// # Errors
/// The list or folder cannot be read, or names no record.
pub fn batch_items(path: &Path) -> Result<Vec<BatchItem>, BatchError> {
    let items = if path.is_dir() { of_folder(path)? } else { of_list(path)? };
    if items.is_empty() { Err(BatchError::Empty(path.display().to_string())) } else { Ok(items) }
}

fn of_folder(folder: &Path) -> Result<Vec<BatchItem>, BatchError> {
    let reading = |e: std::io::Error| BatchError::reading(folder, &e);
    let known = |path: &Path| {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        FORMATS.iter().any(|format| format.extensions.contains(&ending.as_str()))
    };
    let mut items = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(reading)? {
        let entry = entry.map_err(reading)?;
        let (data, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if data.is_file() && known(&data) && !name.starts_with('.') {
            items.push(BatchItem { name, data, test: None, said: Vec::new() });
        }
    }
    items.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(items)
}

fn of_list(list: &Path) -> Result<Vec<BatchItem>, BatchError> {
    let text = std::fs::read_to_string(list).map_err(|e| BatchError::reading(list, &e))?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let item = |name: &str| BatchItem { name: name.to_owned(), data: folder.join(name), test: None, said: Vec::new() };
    let malformed = |e: csv::Error| BatchError::List { file: list.display().to_string(), problem: e.to_string() };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let heads: Vec<String> = reader.headers().map_err(malformed)?.iter().map(str::to_owned).collect();
    let Some(files) = heads.iter().position(|head| head.eq_ignore_ascii_case(FILE)) else {
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
        return Ok(lines.map(item).collect());
    };
    let mut items = Vec::new();
    for cells in reader.records() {
        let cells = cells.map_err(malformed)?;
        let mut item = item(&cells[files]);
        for (k, (head, cell)) in heads.iter().zip(&cells).enumerate() {
            if head.eq_ignore_ascii_case(TEST) {
                item.test = Some(cell).filter(|c| !c.is_empty()).map(|c| folder.join(c));
            } else if k != files {
                item.said.push((head.clone(), cell.to_owned()));
            }
        }
        items.push(item);
    }
    Ok(items)
}
