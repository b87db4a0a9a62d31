//! The browser's dialog for files to open. There is none for saving: a name is typed, and the browser says where its downloads go.

use super::{DialogAnswer, Purpose};
use crate::app::purpose::PROJECT_ENDING;
use sindyscope_system::browser;

/// Every browser has the dialog.
pub(super) const MAY_BE_ABSENT: bool = false;

/// Asks for files to open; nothing where something is to be saved.
pub(super) fn answer(purpose: Purpose, _name: &str, _frame: &eframe::Frame) -> Option<DialogAnswer> {
    let measured = || sindyscope_files::FORMATS.iter().flat_map(|format| format.extensions).copied();
    let endings: Vec<&str> = match purpose {
        Purpose::Open => measured().chain([PROJECT_ENDING]).collect(),
        Purpose::Add | Purpose::Locate => measured().collect(),
        Purpose::Effects => vec!["toml"],
        Purpose::Series => vec!["csv"],
        _ => return None,
    };
    let several = matches!(purpose, Purpose::Open | Purpose::Add);
    let listed = endings.iter().map(|ending| format!(".{ending}")).collect::<Vec<_>>().join(",");
    Some(Box::pin(browser::ask(listed, several)))
}
