//! Measured samples: trajectories with their channels, units and roles.
//!
//! Two files need each other: `types` completes a record by `estimate`, which makes channels of it.

use std::collections::HashSet;

pub mod estimate;
mod types;
pub mod units;

pub use types::{Channel, Record, RecordSet, Role, Usage};
pub use units::{BASES as UNIT_BASES, factors as unit_factors, metres, parse as parse_unit};

/// What was found and done while reading records, each sentence once.
pub fn notices<'a>(records: impl IntoIterator<Item = &'a Record>) -> Vec<&'a str> {
    let mut told = HashSet::new();
    records.into_iter().flat_map(|r| &r.notices).map(String::as_str).filter(|n| told.insert(*n)).collect()
}
