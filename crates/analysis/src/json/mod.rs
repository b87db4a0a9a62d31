//! Results as JSON, for scripts. A number that does not exist is `null`.

mod diagnosed;
mod effects;
mod identified;
pub mod structure;

use serde_json::Value;

pub use diagnosed::{diagnosed, evidence};
pub use effects::effects;
pub(crate) use identified::equations;
pub use identified::{identified, lasting, lasting_gap, mode, of_channel};

/// The version of the fields.
pub const VERSION: u32 = 1;

/// A result as the text of a file.
///
/// # Errors
/// It cannot be written as text.
pub fn text(result: &Value) -> serde_json::Result<String> {
    serde_json::to_string_pretty(result).map(|text| text + "\n")
}
