//! The window's own fonts: widths of texts, and pictures of pages that look the same on every machine.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

use resvg::{tiny_skia, usvg};

use super::ReportError;
use super::svg::escape;

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
}

/// Fonts of a page, with the letters measured so far.
pub(super) struct Fonts {
    options: usvg::Options<'static>,
    advances: RefCell<HashMap<(Face, char), f64>>,
}

/// Size at which widths are measured; others are in proportion.
const MEASURED_SIZE: f64 = 100.0;

impl Fonts {
    pub(super) fn new() -> Self {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
        fonts.load_font_data(epaint_default_fonts::HACK_REGULAR.to_vec());
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
        let widths: f64 = text.chars().map(|c| self.advance(c, face)).sum();
        widths * size / MEASURED_SIZE
    }

    fn advance(&self, letter: char, face: Face) -> f64 {
        if let Some(width) = self.advances.borrow().get(&(face, letter)) {
            return *width;
        }
        // A blank alone has no box, so letters are measured between two bars.
        let wide = |text: &str| {
            let svg = format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"9\" height=\"9\"><text xml:space=\"preserve\" y=\"{MEASURED_SIZE}\" \
                 font-family=\"{}\" font-size=\"{MEASURED_SIZE}\">|{}|</text></svg>",
                face.family(),
                escape(text)
            );
            usvg::Tree::from_str(&svg, &self.options)
                .map_or(0.0, |tree| f64::from(tree.root().abs_bounding_box().width()))
        };
        let width = (wide(letter.encode_utf8(&mut [0; 4])) - wide("")).max(0.0);
        self.advances.borrow_mut().insert((face, letter), width);
        width
    }

    /// Breaks a text into lines no wider than `room`; a word wider than that stands alone.
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
                line.push_str(word);
                used += width;
            }
            lines.push(line);
        }
        lines
    }

    /// Draws an SVG document at `scale` and encodes it as PNG, `scale` written down as the resolution.
    pub(super) fn png(&self, svg: &str, scale: f32) -> Result<Vec<u8>, ReportError> {
        let failed = |problem: String| ReportError::Picture(problem);
        let tree = usvg::Tree::from_str(svg, &self.options).map_err(|e| failed(e.to_string()))?;
        let size = tree.size().to_int_size().scale_by(scale).ok_or_else(|| failed("the page is empty".into()))?;
        let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height())
            .ok_or_else(|| failed("the page is larger than a picture can be".into()))?;
        resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
        pixels.encode_png().map_err(|e| failed(e.to_string()))
    }
}
