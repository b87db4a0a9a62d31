//! What a file's header does not say.

use serde::{Deserialize, Serialize};

use super::column_map::ColumnMap;
use sindyscope_values::term::Kind;

/// What a file's header does not say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReadOptions {
    /// Which column is which; what is not said here is decided from the header.
    pub columns: ColumnMap,
    /// Columns that `columns` does not name are ignored, whatever the header says of them.
    pub only_named: bool,
    /// Sampling rate, Hz, instead of a time column.
    pub rate: Option<f64>,
    /// Order of the equations: for first order every velocity is a state, and so are `y` and `z`.
    pub kind: Kind,
    /// Up to this many consecutive missing samples are filled in; more split the record. None by itself.
    pub bridge: usize,
    /// Keeps inputs that are constant throughout, for records that join others in which they are not.
    pub keep_constant_inputs: bool,
}
