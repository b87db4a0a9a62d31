use std::path::PathBuf;

use super::failure::Failure;

/// What works without a window.
const COMMANDS: &str = "the commands, which need no display: `sindyscope identify DATA`, `sindyscope diagnose DATA`, `sindyscope report DATA --out FILE`, \
                        `sindyscope inspect FILE`, \
                        `sindyscope generate list`; `sindyscope --help` describes them";

/// Opens the window with files in it.
pub(super) fn open(files: Vec<PathBuf>) -> Result<(), Failure> {
    if let Some(missing) = files.iter().find(|f| !f.exists()) {
        return Err(Failure::new(format!("{}: there is no such file, nor a command of that name", missing.display()))
            .try_this("check the path; `sindyscope --help` lists the commands"));
    }
    show(files)
}

#[cfg(not(feature = "desktop"))]
fn show(_files: Vec<PathBuf>) -> Result<(), Failure> {
    Err(Failure::new("this build has no window (it was made without the feature `desktop`)").try_this(COMMANDS))
}

#[cfg(feature = "desktop")]
fn show(files: Vec<PathBuf>) -> Result<(), Failure> {
    if !has_display() {
        return Err(Failure::new("there is no display to open the window on").try_this(COMMANDS));
    }
    crate::app::run(files).map_err(|e| Failure::new(format!("the window cannot be opened: {e}")).try_this(COMMANDS))
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
