//! What every plot of the window shares: colours, units and numbers, decimation, pictures.

pub mod axis;
pub mod decimate;
pub(crate) mod display;
pub mod export;
pub mod palette;
pub(crate) mod pointer;
pub mod raster;
pub mod vector;

pub use sindyscope_values::format::{number, units};
