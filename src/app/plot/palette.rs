//! The shared palette as egui draws it.

use egui::{Color32, Stroke};
use egui_plot::LineStyle;

use sindyscope_report::palette;
pub use sindyscope_report::palette::{Ink, Tint};

/// An ink as egui draws it.
pub trait Painted {
    /// The colour on the dark or the light theme's plot ground.
    fn color(self, dark: bool) -> Color32;
    /// Solid or dashed.
    fn style(self) -> LineStyle;
    /// Colour and width.
    fn stroke(self, dark: bool) -> Stroke;
}

impl Painted for Ink {
    fn color(self, dark: bool) -> Color32 {
        rgb(self.rgb(dark))
    }

    fn style(self) -> LineStyle {
        self.dash().map_or(LineStyle::Solid, |length| LineStyle::Dashed { length })
    }

    fn stroke(self, dark: bool) -> Stroke {
        Stroke::new(self.width(), self.color(dark))
    }
}

/// The ground of a plot.
pub fn ground(dark: bool) -> Color32 {
    rgb(palette::ground(dark))
}

/// Grid lines and the plot's frame.
pub fn grid(dark: bool) -> Color32 {
    rgb(palette::grid(dark))
}

/// The line at the pointer.
pub fn cursor(dark: bool) -> Color32 {
    Ink::Cursor.color(dark)
}

/// A tint over a stretch of an abscissa.
pub fn tint(tint: Tint, dark: bool) -> Color32 {
    let (color, opacity) = tint.rgba(dark);
    let [r, g, b, _] = rgb(color).to_array();
    Color32::from_rgba_unmultiplied(r, g, b, opacity)
}

/// A colour from `0xRRGGBB`.
pub fn rgb(hex: u32) -> Color32 {
    let [_, r, g, b] = hex.to_be_bytes();
    Color32::from_rgb(r, g, b)
}
