//! Measured samples: trajectories with their channels, units and roles.

mod types;

pub use types::{Channel, Record, RecordSet, Role, Usage};
