//! The values that every part of Sindyscope speaks: terms, equations of motion, records and their units.

pub mod format;
pub mod model;
pub mod record;
pub mod term;
