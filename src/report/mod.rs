//! A study as a document: a web page that needs nothing beside itself, or a picture for print.
//!
//! One content (`content`), written in two ways (`html`, `page`); the figures are the same in both.

mod chart;
mod content;
mod figures;
mod font;
mod html;
mod math;
mod page;
mod physics_figures;
mod style;
mod svg;
mod text;
mod walk;
mod walk_figures;

use std::ffi::OsStr;
use std::path::Path;

use crate::gap::Diagnosis;
use crate::model::{Model, Units};
use crate::record::RecordSet;
use crate::study::Outcome;

/// What a report is made of.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// The document's title.
    pub title: &'a str,
    /// The records, those that are left out too.
    pub records: &'a RecordSet,
    /// What the study found.
    pub outcome: &'a Outcome,
    /// How the settings were chosen, if the program chose them.
    pub choice: Option<&'a str>,
    /// The command that makes this report again.
    pub command: Option<&'a str>,
    /// What the search for missing effects found, if one was made.
    pub diagnosis: Option<&'a Diagnosis>,
}

/// A search for missing effects in plain text, for a terminal.
pub fn walk(diagnosis: &Diagnosis, records: &RecordSet) -> String {
    let units =
        |model: &Model| records.entries.first().map_or_else(Units::default, |(r, _)| Units::of(r, &model.layout));
    walk::text(diagnosis, displacement_unit(records), &units)
}

/// The unit of the first displacement; gaps are in it.
fn displacement_unit(records: &RecordSet) -> &str {
    records.entries.iter().find_map(|(r, _)| r.sensor(0)).map_or("", |c| c.unit.as_str())
}

/// The kinds of document that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A self-contained web page.
    Html,
    /// A picture at twice the size of a screen's points.
    Png,
}

/// Why a report was not written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file's ending that stands for no kind of document.
    #[error("a report can be written to .html or .png, not to {0}")]
    Ending(String),
    /// The file could not be written.
    #[error("cannot write {path}: {source}")]
    Write {
        /// The file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// The picture could not be drawn.
    #[error("cannot draw the report: {0}")]
    Picture(String),
}

impl Format {
    /// The kind of document that a file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none, or no ending.
    pub fn of(path: &Path) -> Result<Self, ReportError> {
        let ending = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        match ending.to_ascii_lowercase().as_str() {
            "html" | "htm" => Ok(Self::Html),
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
        html::document(self.title, &content::blocks(self, &figures::Room::WEB))
    }

    /// The picture, as the bytes of a PNG file.
    ///
    /// # Errors
    /// A picture too large to draw.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let fonts = font::Fonts::new();
        let page = page::document(&content::blocks(self, &figures::Room::PICTURE), &fonts);
        fonts.png(&page, page::SCALE)
    }

    /// Writes the document that the file's ending asks for.
    ///
    /// # Errors
    /// An ending that stands for none; a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ReportError> {
        let bytes = match Format::of(path)? {
            Format::Html => self.html().into_bytes(),
            Format::Png => self.png()?,
        };
        std::fs::write(path, bytes).map_err(|source| ReportError::Write { path: path.display().to_string(), source })
    }
}

#[cfg(test)]
mod tests;
