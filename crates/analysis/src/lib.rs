//! Whole analyses as commands, scripts and batches ask for them: records and settings named in words in, results out.
//!
//! - [`source`]: how records are read and prepared, as tables of settings.
//! - [`request`]: a study as it is asked for, with what is left to be chosen from the data.
//! - [`mod@analyse`]: chooses what was left open and runs the study; [`missing`]: the search for missing effects;
//!   [`effects`]: those of one's own that it looks for besides.
//! - [`component`]: the same of components without a mass.
//! - [`batch`]: many records with the same settings, resumed wherever it ended.
//! - [`series`]: the table of such a batch over one of its quantities: trends, and records that do not fit.
//! - [`watch`]: a stream, the last seconds of which are identified as they come.
//! - [`json`]: the results as the JSON that scripts rely on, the same from a command and from Python.
//!
//! Nothing here knows the words of a shell, the window or Python: an [`AnalysisError`] says what is wrong, and each of them
//! words what would help.
//!
//! ```
//! use sindyscope_analysis::{AnalysisRequest, analyse, json};
//! use sindyscope_core::study::Cancel;
//! use sindyscope_rig::{ScenarioOptions, generate};
//! use sindyscope_values::record::{RecordSet, Usage};
//!
//! let measured = generate("duffing", &ScenarioOptions::default()).expect("a scenario of the rig");
//! let records = RecordSet::new(measured.records, Usage::Fit);
//! let request = AnalysisRequest::named([("terms", "x, v, u, x^3"), ("window", "31")])?;
//! let analysis = analyse(&request, records, &Cancel::default(), &|_| ())?;
//! assert_eq!(json::identified(&analysis)["status"], "ok");
//! # Ok::<(), sindyscope_analysis::AnalysisError>(())
//! ```

#![deny(missing_docs)]

pub mod analyse;
#[cfg(not(target_arch = "wasm32"))]
pub mod batch;
pub mod component;
pub mod effects;
mod error;
pub mod json;
pub mod missing;
pub mod request;
pub mod series;
pub mod source;
pub mod watch;

pub use analyse::{Analysis, AnalysisProgress, analyse};
pub use error::AnalysisError;
pub use missing::{MissingRequest, search};
pub use request::{AnalysisRequest, Terms};
pub use source::{KindName, Preparing, Reading, RecordSource};
