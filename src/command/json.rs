//! Where the JSON of a result goes.

use std::path::Path;

use serde_json::Value;

use super::failure::Failure;
use sindyscope_analysis::json::text;

/// Writes the JSON that was asked for; what of it goes to standard output (the file `-`) is handed back.
pub(super) fn write(path: Option<&Path>, result: &Value) -> Result<Option<Vec<u8>>, Failure> {
    let Some(path) = path else { return Ok(None) };
    let text = text(result).map_err(|e| Failure::new(format!("cannot write the result as JSON: {e}")))?;
    if path == Path::new("-") {
        return Ok(Some(text.into_bytes()));
    }
    std::fs::write(path, text).map_err(|e| Failure::writing(path, &e))?;
    Ok(None)
}
