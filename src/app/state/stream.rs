//! What a person has decided of a stream: where it comes from and how it is identified.

use serde::{Deserialize, Serialize};

use sindyscope_analysis::watch::Watching;

/// A stream as it is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct StreamForm {
    /// Whether the stream is shown in place of the records.
    pub shown: bool,
    /// The source as it is typed.
    pub source: String,
    /// The library; empty: chosen from the first seconds.
    pub terms: String,
    /// How much of it is identified, s; none: as usual.
    pub last: Option<f64>,
    /// False alarms an hour that are allowed.
    pub false_alarms: f64,
}

impl Default for StreamForm {
    fn default() -> Self {
        let Watching { last, false_alarms, .. } = Watching::default();
        Self { shown: false, source: String::new(), terms: String::new(), last, false_alarms }
    }
}
