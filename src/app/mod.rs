//! The window.

pub mod plot;
pub(crate) mod views;
