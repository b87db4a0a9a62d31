//! A study as a document: a web page that needs nothing beside itself, pages of a PDF, or a picture; and single figures.
//!
//! What it holds is arranged (`arrangement`, `sections`), the content is the same in every form (`content`), and so are the figures;
//! `html` writes a web page, `page` draws sheets as SVG, `pdf` turns those into a PDF.

mod arrangement;
mod component;
mod content;
mod drawings;
mod font;
mod html;
mod math;
mod modes;
mod page;
mod pdf;
mod report;
mod sections;
mod series;
mod single;
mod style;
mod text;
mod walk;

use std::ffi::OsStr;
use std::path::Path;

use drawings::FigureLimits;
use font::Fonts;
use report::{displacement_unit, units};
use sections::ComposedDocument;
use sindyscope_search::Diagnosis;
use sindyscope_values::record::RecordSet;

pub use arrangement::{Arrangement, Item, Paper, Section, Sections};
pub use component::ComponentReport;
pub use modes::ModesReport;
pub use report::{Report, ReportError};
pub use series::{OddRow, SeriesReport, TrendRow};
pub use single::{FigureFormat, FigureSize};

/// A search for missing effects in plain text, for a terminal.
pub fn walk(diagnosis: &Diagnosis, records: &RecordSet) -> String {
    walk::text(diagnosis, (displacement_unit(records), &records.notices()), &|model| units(records, model))
}

/// The kinds of document that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DocumentFormat {
    /// A self-contained web page.
    Html,
    /// Pages of paper with embedded fonts.
    Pdf,
    /// A picture at twice the size of a screen's points.
    Png,
}

impl DocumentFormat {
    /// The kind of document that a file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none, or no ending.
    pub fn of(path: &Path) -> Result<Self, ReportError> {
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        match ending.to_ascii_lowercase().as_str() {
            "html" | "htm" => Ok(Self::Html),
            "pdf" => Ok(Self::Pdf),
            "png" => Ok(Self::Png),
            "" => Err(ReportError::Ending("a file without an ending".into())),
            _ => Err(ReportError::Ending(format!(".{ending}"))),
        }
    }
}

impl Report<'_> {
    /// Errors, doubts and settings in plain text, for a terminal.
    pub fn summary(&self) -> String {
        text::document(&content::summary(self))
    }

    /// The web page.
    pub fn html(&self) -> String {
        html::document(self.heading(), &self.compose(&FigureLimits::PAGES).blocks)
    }

    /// The pages of paper, each as an SVG document that uses the window's fonts, and the sections that were asked for and that this
    /// study has nothing for.
    pub fn pages(&self) -> (Vec<String>, Vec<Section>) {
        let composed = self.compose(&FigureLimits::PAGES);
        let pages = page::pages(&composed.blocks, &Fonts::new(), self.arrangement.paper, self.heading());
        (pages, composed.empty)
    }

    /// The PDF, as the bytes of a file: the same for the same report, whenever it is made.
    ///
    /// # Errors
    /// A font that cannot be embedded.
    pub fn pdf(&self) -> Result<Vec<u8>, ReportError> {
        pdf::document(&self.pages().0, self.heading(), &Fonts::new())
    }

    /// The picture, as the bytes of a PNG file.
    ///
    /// # Errors
    /// A picture too large to draw.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let fonts = Fonts::new();
        let sheet = page::sheet(&self.compose(&FigureLimits::PICTURE).blocks, &fonts);
        fonts.png(&sheet, page::SCALE)
    }

    /// Writes the document that the file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none; a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let bytes = match DocumentFormat::of(path)? {
            DocumentFormat::Html => self.html().into_bytes(),
            DocumentFormat::Pdf => self.pdf()?,
            DocumentFormat::Png => self.png()?,
        };
        sindyscope_system::fs::write(path, bytes)
            .map_err(|source| ReportError::Write { path: path.display().to_string(), source })
    }

    fn compose(&self, room: &FigureLimits) -> ComposedDocument {
        sections::compose(self, self.arrangement, room)
    }

    /// The title: one's own, or the name of the data.
    fn heading(&self) -> &str {
        match self.arrangement.title.trim() {
            "" => self.title,
            own => own,
        }
    }
}

/// Writes blocks as the document that the file's ending asks for.
fn write_blocks(path: &Path, title: &str, paper: Paper, blocks: &[content::Block]) -> Result<(), ReportError> {
    let bytes = match DocumentFormat::of(path)? {
        DocumentFormat::Html => html::document(title, blocks).into_bytes(),
        DocumentFormat::Pdf => {
            let fonts = Fonts::new();
            pdf::document(&page::pages(blocks, &fonts, paper, title), title, &fonts)?
        }
        DocumentFormat::Png => {
            let fonts = Fonts::new();
            fonts.png(&page::sheet(blocks, &fonts), page::SCALE)?
        }
    };
    sindyscope_system::fs::write(path, bytes)
        .map_err(|source| ReportError::Write { path: path.display().to_string(), source })
}

/// A page of a report as pixels: `width` × `height`, four bytes each, red first, opacity last and multiplied into the others.
#[derive(Clone, Debug)]
pub struct Pixels {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The pixels, row by row.
    pub bytes: Vec<u8>,
}

/// Draws a page as pixels, so wide.
///
/// # Errors
/// What is given is no SVG document, or no picture can be that large.
pub fn pixels(page: &str, width: u32) -> Result<Pixels, ReportError> {
    let fonts = Fonts::new();
    let natural = fonts.tree(page)?.size().width();
    let drawn = fonts.pixels(page, width as f32 / natural)?;
    Ok(Pixels { width: drawn.width(), height: drawn.height(), bytes: drawn.take() })
}

#[cfg(test)]
mod tests;
