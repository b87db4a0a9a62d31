//! Effects of a person's own, as they are written down in "What's missing" and kept with the document.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use sindyscope_analysis::{AnalysisError, effects};
use sindyscope_search::OwnEffect;

/// Effects of a person's own: a TOML text as `--effects FILE` takes it, and what it says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct OwnEffects {
    text: String,
    effects: Arc<[OwnEffect]>,
}

impl OwnEffects {
    /// The effects of a text; of none without an entry.
    ///
    /// # Errors
    /// An entry is wrong: the error names line and column.
    pub fn of_text(text: &str) -> Result<Self, AnalysisError> {
        let effects = if text.trim().is_empty() { Vec::new() } else { effects::of_text("", text)? };
        Ok(Self { text: text.to_owned(), effects: effects.into() })
    }

    /// The text, with the person's own comments and order.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What it says.
    pub fn effects(&self) -> &[OwnEffect] {
        &self.effects
    }

    /// True if the other has this effect, and as it is here where it is one of these.
    pub(crate) fn is_alike_in(&self, effect: &str, other: &Self) -> bool {
        let of = |own: &Self| own.effects.iter().find(|e| e.name == effect).cloned();
        of(self) == of(other)
    }
}

/// A text that another version wrote and this one refuses says no effect; it stays to be mended.
impl From<String> for OwnEffects {
    fn from(text: String) -> Self {
        Self::of_text(&text).unwrap_or_else(|_| Self { text, effects: Arc::default() })
    }
}

impl From<OwnEffects> for String {
    fn from(own: OwnEffects) -> Self {
        own.text
    }
}
