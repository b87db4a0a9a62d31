//! Whole files.

#[cfg(not(target_arch = "wasm32"))]
pub use std::fs::{read, read_to_string, rename, write};

#[cfg(target_arch = "wasm32")]
pub use super::browser::files::{KEPT, read, read_to_string, rename, write};

use std::path::Path;

/// True if there is a file, or a folder, of this path.
pub fn exists(path: impl AsRef<Path>) -> bool {
    #[cfg(target_arch = "wasm32")]
    return super::browser::files::exists(path.as_ref());
    #[cfg(not(target_arch = "wasm32"))]
    path.as_ref().exists()
}
