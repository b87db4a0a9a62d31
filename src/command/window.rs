use std::path::{Path, PathBuf};

use super::failure::Failure;

/// What works without a window.
const COMMANDS: &str = "the commands, which need no display: `sindyscope identify DATA`, `sindyscope diagnose DATA`, `sindyscope report DATA --out FILE`, \
                        `sindyscope inspect FILE`, \
                        `sindyscope generate list`; `sindyscope --help` describes them";

/// Opens the window with files in it; the log of the session is kept as it goes, if one is named.
pub(super) fn open(files: Vec<PathBuf>, log: Option<PathBuf>) -> Result<(), Failure> {
    if let Some(missing) = files.iter().find(|f| !f.exists()) {
        return Err(Failure::new(format!("{}: there is no such file, nor a command of that name", missing.display()))
            .try_this("check the path; `sindyscope --help` lists the commands"));
    }
    show(files, log)
}

#[cfg(not(feature = "desktop"))]
fn show(_files: Vec<PathBuf>, _log: Option<PathBuf>) -> Result<(), Failure> {
    Err(Failure::new("this build has no window (it was made without the feature `desktop`)").try_this(COMMANDS))
}

#[cfg(feature = "desktop")]
fn show(files: Vec<PathBuf>, log: Option<PathBuf>) -> Result<(), Failure> {
    if !has_display() {
        return Err(Failure::new("there is no display to open the window on").try_this(COMMANDS));
    }
    crate::app::run(files, log)
        .map_err(|e| Failure::new(format!("the window cannot be opened: {e}")).try_this(COMMANDS))
}

/// Does again what the log of a session holds, without a window; says how many acts there were and what comes out otherwise.
#[cfg(feature = "desktop")]
pub(super) fn replay(log: &Path) -> Result<Vec<u8>, Failure> {
    let cannot = |reason: String| Failure::new(format!("{}: {reason}", log.display()));
    let text = std::fs::read_to_string(log).map_err(|e| cannot(e.to_string()))?;
    let replayed = crate::app::replay(&text).map_err(cannot)?;
    let mut told = format!("{} acts done again; ", replayed.messages);
    match replayed.differences.as_slice() {
        [] => told.push_str("the state is as the log says\n"),
        differences => {
            told.push_str(&format!("the state differs from the log in {} places\n", differences.len()));
            differences.iter().for_each(|difference| told.push_str(&format!("  {difference}\n")));
        }
    }
    Ok(told.into_bytes())
}

#[cfg(not(feature = "desktop"))]
pub(super) fn replay(_log: &Path) -> Result<Vec<u8>, Failure> {
    show(Vec::new(), None).map(|()| Vec::new())
}

/// Whether a window can be shown: elsewhere than on Linux and its kin there is always a display.
#[cfg(feature = "desktop")]
fn has_display() -> bool {
    let named = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    !cfg!(all(unix, not(target_os = "macos")))
        || named("DISPLAY")
        || named("WAYLAND_DISPLAY")
        || named("WAYLAND_SOCKET")
}
