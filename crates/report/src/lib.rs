//! Figures, documents and exported programs of what was found.

mod canvas;
pub mod diagram;
pub mod document;
pub mod export;
pub mod figure;
pub mod palette;
pub mod view;
pub mod walk;
