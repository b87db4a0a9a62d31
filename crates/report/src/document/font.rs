//! The window's own fonts: widths of texts, and drawings whose letters look the same on every machine.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

use resvg::{tiny_skia, usvg};
use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider as _};

use super::report::ReportError;

/// A face of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Face {
    /// Proportional, for reading.
    Text,
    /// Of fixed width, for columns of numbers and for code.
    Mono,
}

impl Face {
    /// Family name, as the font file gives it.
    pub(super) fn family(self) -> &'static str {
        match self {
            Self::Text => "Ubuntu",
            Self::Mono => "Hack",
        }
    }

    fn file(self) -> &'static [u8] {
        match self {
            Self::Text => epaint_default_fonts::UBUNTU_LIGHT,
            Self::Mono => epaint_default_fonts::HACK_REGULAR,
        }
    }

    /// The face that has the letters which this one lacks.
    fn other(self) -> Self {
        match self {
            Self::Text => Self::Mono,
            Self::Mono => Self::Text,
        }
    }
}

/// Fonts of a page, with the letters measured so far.
pub(super) struct Fonts {
    options: usvg::Options<'static>,
    advances: RefCell<HashMap<(Face, char), f64>>,
}

impl Fonts {
    pub(super) fn new() -> Self {
        let mut fonts = usvg::fontdb::Database::new();
        for face in [Face::Text, Face::Mono] {
            fonts.load_font_data(face.file().to_vec());
        }
        fonts.set_sans_serif_family(Face::Text.family());
        fonts.set_monospace_family(Face::Mono.family());
        let options = usvg::Options {
            fontdb: Arc::new(fonts),
            font_family: Face::Text.family().to_owned(),
            ..usvg::Options::default()
        };
        Self { options, advances: RefCell::default() }
    }

    /// Advance width of a text in one line: the sum over its letters, kerning left out.
    pub(super) fn width(&self, text: &str, size: f64, face: Face) -> f64 {
        size * text.chars().map(|c| self.advance(c, face)).sum::<f64>()
    }

    /// Advance width of a letter at size 1.
    fn advance(&self, letter: char, face: Face) -> f64 {
        let known = self.advances.borrow().get(&(face, letter)).copied();
        known.unwrap_or_else(|| {
            let width = advance(letter, face).or_else(|| advance(letter, face.other())).unwrap_or(UNKNOWN);
            self.advances.borrow_mut().insert((face, letter), width);
            width
        })
    }

    /// Breaks a text into lines no wider than `room`; a word wider than that is broken between letters.
    pub(super) fn lines(&self, text: &str, size: f64, face: Face, room: f64) -> Vec<String> {
        let blank = self.width(" ", size, face);
        let mut lines = Vec::new();
        for paragraph in text.lines() {
            let (mut line, mut used) = (String::new(), 0.0);
            for word in paragraph.split_whitespace() {
                let width = self.width(word, size, face);
                if !line.is_empty() && used + blank + width > room {
                    lines.push(std::mem::take(&mut line));
                    used = 0.0;
                }
                if !line.is_empty() {
                    line.push(' ');
                    used += blank;
                }
                if width <= room {
                    line.push_str(word);
                    used += width;
                    continue;
                }
                for letter in word.chars() {
                    let width = size * self.advance(letter, face);
                    if !line.is_empty() && used + width > room {
                        lines.push(std::mem::take(&mut line));
                        used = 0.0;
                    }
                    line.push(letter);
                    used += width;
                }
            }
            lines.push(line);
        }
        lines
    }

    /// An SVG document as a tree of shapes, its texts laid out.
    pub(super) fn tree(&self, svg: &str) -> Result<usvg::Tree, ReportError> {
        usvg::Tree::from_str(svg, &self.options).map_err(|e| ReportError::Picture(e.to_string()))
    }

    /// Draws an SVG document at `scale` pixels a point.
    pub(super) fn pixels(&self, svg: &str, scale: f32) -> Result<tiny_skia::Pixmap, ReportError> {
        let failed = |problem: &str| ReportError::Picture(problem.to_owned());
        let tree = self.tree(svg)?;
        let size = tree.size().to_int_size().scale_by(scale).ok_or_else(|| failed("the page is empty"))?;
        let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height())
            .ok_or_else(|| failed("the page is larger than a picture can be"))?;
        resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
        Ok(pixels)
    }

    /// Draws an SVG document at `scale` and encodes it as PNG.
    pub(super) fn png(&self, svg: &str, scale: f32) -> Result<Vec<u8>, ReportError> {
        self.pixels(svg, scale)?.encode_png().map_err(|e| ReportError::Picture(e.to_string()))
    }
}

/// Width at size 1 of what neither face has: that of the sign drawn in its place.
const UNKNOWN: f64 = 0.6;

fn advance(letter: char, face: Face) -> Option<f64> {
    let font = FontRef::new(face.file()).ok()?;
    let glyph = font.charmap().map(letter)?;
    let per_em = f64::from(font.metrics(Size::unscaled(), LocationRef::default()).units_per_em);
    let width = font.glyph_metrics(Size::unscaled(), LocationRef::default()).advance_width(glyph)?;
    Some(f64::from(width) / per_em)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_as_wide_as_it_is_drawn() {
        let fonts = Fonts::new();
        for (text, face) in [("Sindyscope 2.5 mm", Face::Text), ("x = 1 ± 2 ẍ", Face::Text), ("RMSE 0.1", Face::Mono)]
        {
            let svg = format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"9\" height=\"9\"><text y=\"20\" font-family=\"{}\" font-size=\"20\">{text}</text></svg>",
                face.family()
            );
            let drawn = f64::from(fonts.tree(&svg).expect("a tree").root().abs_bounding_box().width());
            let told = fonts.width(text, 20.0, face);
            assert!((drawn - told).abs() < 4.0, "{text}: {drawn} {told}");
        }
    }

    #[test]
    fn lines_are_no_wider_than_their_room() {
        let fonts = Fonts::new();
        let text = "a short one and a_name_that_is_longer_than_any_line_could_be.csv at its end";
        let lines = fonts.lines(text, 12.0, Face::Text, 90.0);
        assert!(lines.len() >= 5 && lines.iter().all(|l| fonts.width(l, 12.0, Face::Text) <= 90.0), "{lines:?}");
        assert_eq!(lines.concat().replace(' ', ""), text.replace(' ', ""));
    }
}
