//! What every plot of the window shares: the painter of figures, colours, and the units that a person chose.

pub(crate) mod beside;
pub(crate) mod display;
pub(crate) mod export;
pub(crate) mod figures;
mod layers;
pub(crate) mod legend;
mod look;
pub(crate) mod painter;
pub mod palette;
pub(crate) mod pointer;
pub(crate) mod readout;
pub(crate) mod sketch;

pub use sindyscope_values::format::{number, units};
