//! One figure as a file of its own, at the size that a paper or a slide has room for.

use std::ffi::OsStr;
use std::fmt::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::font::{Face, Fonts};
use super::pdf;
use super::report::ReportError;
use crate::canvas::Coordinate;
use crate::figure::svg::{self, Drawing, Extent};
use crate::figure::{Figure, style};
use crate::palette::ground;
use sindyscope_values::format::shown::ShownUnits;

/// Points to the millimetre.
const POINTS_A_MM: f64 = 72.0 / 25.4;

/// Size of the axes' labels in a figure, as it is drawn.
const LABEL: f64 = 11.5;

/// Pixels to the inch of a picture of pixels: fit for print.
const PRINT: f32 = 300.0;

/// Pixels to the inch of an SVG document.
const SCREEN: f32 = 96.0;

/// How large a figure is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FigureSize {
    /// Width, mm.
    pub width: f64,
    /// Height, mm.
    pub height: f64,
    /// Size of the axes' labels, points.
    pub font: f64,
}

impl Default for FigureSize {
    /// As wide as the text of an A4 page.
    fn default() -> Self {
        Self { width: 160.0, height: 90.0, font: 9.0 }
    }
}

impl FigureSize {
    /// The size with each value where a figure can be drawn and read.
    #[must_use]
    pub fn sound(self) -> Self {
        let within = |value: f64, low: f64, high: f64, usual: f64| {
            if value.is_finite() { value.clamp(low, high) } else { usual }
        };
        let usual = Self::default();
        Self {
            width: within(self.width, 30.0, 500.0, usual.width),
            height: within(self.height, 20.0, 500.0, usual.height),
            font: within(self.font, 4.0, 40.0, usual.font),
        }
    }
}

/// The kinds of file that a figure can be written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    /// Lines and texts that a drawing program can edit.
    Svg,
    /// One page of the figure's size, fonts embedded.
    Pdf,
    /// Pixels, 300 to the inch.
    Png,
}

impl FigureFormat {
    /// Every kind.
    pub const ALL: [Self; 3] = [Self::Svg, Self::Pdf, Self::Png];

    /// The kind that a file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none, or no ending.
    pub fn of(path: &Path) -> Result<Self, ReportError> {
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        let found = Self::ALL.into_iter().find(|f| f.ending().eq_ignore_ascii_case(ending));
        found.ok_or_else(|| {
            ReportError::FigureEnding(match ending {
                "" => "a file without an ending".into(),
                other => format!(".{other}"),
            })
        })
    }

    /// The ending of its files.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Svg => "svg",
            Self::Pdf => "pdf",
            Self::Png => "png",
        }
    }

    /// A drawing, given as an SVG document, as the bytes of a file of this kind.
    ///
    /// # Errors
    /// It is no SVG document, a font cannot be embedded, or it is larger than a picture can be.
    pub fn bytes(self, drawing: &str, title: &str) -> Result<Vec<u8>, ReportError> {
        match self {
            Self::Svg => Ok(drawing.as_bytes().to_vec()),
            Self::Pdf => pdf::document(std::slice::from_ref(&drawing.to_owned()), title, &Fonts::new()),
            Self::Png => Fonts::new().png(drawing, PRINT / SCREEN),
        }
    }
}

impl Figure {
    /// The figure as an SVG document of this size, on white, with values shown in these units.
    pub fn svg(&self, size: FigureSize, units: &ShownUnits) -> String {
        let size = size.sound();
        let points = LABEL / size.font * POINTS_A_MM;
        let extent = Extent { width: size.width * points, height: Some(size.height * points) };
        document(&svg::draw(self, &extent, units), size)
    }
}

/// A figure alone, `size` on paper.
fn document(figure: &Drawing, size: FigureSize) -> String {
    let mut out = String::new();
    // The figure's own height differs from the one asked for where the panels had too little room.
    let height = size.width * figure.size.1 / figure.size.0;
    let (width, length) = (Coordinate(figure.size.0), Coordinate(figure.size.1));
    let (family, rules, ground) = (Face::Text.family(), style::rules(false), ground(false));
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}mm\" height=\"{height:.2}mm\" viewBox=\"0 0 {width} {length}\">\n\
         <style>\ntext{{font-family:\"{family}\",\"Noto Sans\",sans-serif}}\n{rules}.ground{{fill:#{ground:06x}}}\n</style>\n\
         <rect class=\"ground\" width=\"{width}\" height=\"{length}\"/>\n{}</svg>\n",
        size.width,
        figure.svg.numbered(1)
    );
    out
}
