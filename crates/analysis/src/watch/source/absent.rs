//! Sources where there are neither threads nor sockets, as in a browser: none can be opened.

use std::time::Duration;

use super::{Arrival, StreamSource};
use sindyscope_core::study::Cancel;

/// What arrives from a source: nothing.
#[derive(Debug)]
pub struct Arriving(());

impl Arriving {
    /// Opens no source.
    ///
    /// # Errors
    /// Always: a sentence.
    pub fn open(source: &StreamSource, _: &Cancel) -> Result<Self, String> {
        Err(format!("{source} cannot be followed from a browser: use the program itself"))
    }

    /// Nothing comes any more.
    pub fn next(&self, _: Duration) -> Option<Arrival> {
        Some(Arrival::Ended)
    }
}
