//! A file format: how it is recognised and who reads it.

use super::column::{FileContents, Flaw};
use super::formats::text::TextHead;

/// A file format that measurements are read from.
#[derive(Clone, Copy, Debug)]
pub struct FileFormat {
    /// What a file dialog calls it.
    pub name: &'static str,
    /// Endings of its files, without the dot, in lower case.
    pub extensions: &'static [&'static str],
    pub(super) recognises: fn(&[u8]) -> bool,
    pub(super) reader: Reader,
}

/// Finds the columns of a file in its bytes.
pub type ReadColumns = for<'a> fn(&'a [u8]) -> Result<FileContents<'a>, Flaw>;

/// A table of text: that of a file, or one sheet of a workbook.
#[derive(Clone, Debug)]
pub(super) struct TextTable {
    pub(super) name: String,
    pub(super) text: String,
    pub(super) head: Option<TextHead>,
}

/// How a format is read.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reader {
    /// As text, row by row.
    Text,
    /// As one table of text a sheet.
    Workbook(fn(&[u8]) -> Result<Vec<TextTable>, Flaw>),
    /// Column by column, each decoded only where it is wanted.
    Columns(ReadColumns),
}

impl FileFormat {
    /// A format whose files hold named columns of numbers.
    ///
    /// `recognises` says whether a file's bytes are of this format, whatever its ending; it should look at the first few alone.
    pub const fn of_columns(
        name: &'static str,
        extensions: &'static [&'static str],
        recognises: fn(&[u8]) -> bool,
        read: ReadColumns,
    ) -> Self {
        Self { name, extensions, recognises, reader: Reader::Columns(read) }
    }
}
