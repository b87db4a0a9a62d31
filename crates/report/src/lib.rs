//! Figures, documents and exported programs of what was found.
//!
//! - [`view`]: the views of a study (response, spectrum, restoring force, …), each a pure function that gives a [`figure`].
//! - [`figure`]: figures as plain values, their ticks, legends and tables, and the painter that draws them as SVG.
//! - [`component`]: the figures of a component's force.
//! - [`modal`]: the figures of a structure's modes.
//! - [`walk`]: the figures of a search for missing effects.
//! - [`diagram`]: what is computed for them: forces across an element, frequency response, decay, residual.
//! - [`document`]: reports as web page, PDF or picture, and single figures as SVG, PDF or PNG.
//! - [`export`]: the identified model as a program: Python, MATLAB, Modelica, C, LaTeX, JSON.
//! - [`palette`]: the one set of colours, in the light and the dark theme.
//!
//! The window paints the same figures with egui; nothing here knows it, or reads a file.
//!
//! ```
//! use sindyscope_report::document::FigureSize;
//! use sindyscope_report::figure::{Axis, Figure, Layer, Panel, Points, Shape};
//! use sindyscope_report::palette::Ink;
//! use sindyscope_values::format::shown::ShownUnits;
//!
//! let decay = Points::new((0..200).map(|k| 0.01 * f64::from(k)).map(|t| [t, (-t).exp() * (20.0 * t).cos()]));
//! let mut panel = Panel::new("decay", Axis::linear("t", "s", (0.0, 2.0)), Axis::linear("x", "m", (-1.1, 1.1)));
//! panel.layers.push(Layer::new(Ink::Measured, "measured", Shape::Line(decay)));
//! let figure = Figure::stacked([(panel, 1.0)], 240.0, "A free decay.");
//! let svg = figure.svg(FigureSize::default(), &ShownUnits::default());
//! assert!(svg.starts_with("<svg ") && svg.contains(">t (s)</text>"));
//! ```

#![deny(missing_docs)]

mod canvas;
pub mod component;
pub mod diagram;
pub mod document;
pub mod export;
pub mod figure;
pub mod modal;
pub mod palette;
pub mod view;
pub mod walk;

/// The book's pages for contributors, whose examples run with the documentation's.
#[cfg(doctest)]
mod book {
    #[doc = include_str!("../../../docs/contributing/view.md")]
    struct ViewPage;

    #[doc = include_str!("../../../docs/contributing/export.md")]
    struct ExportPage;
}
