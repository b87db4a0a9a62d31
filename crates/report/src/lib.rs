//! Figures, documents and exported programs of what was found.

pub mod diagram;
pub mod document;
pub mod export;
pub mod palette;
