//! One file of measurements, read from the disk once: what it holds, and its records.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::assemble;
use super::column::{FileColumn, FileContents, Flaw};
use super::error::{ReadError, ReadProblem};
use super::format::{FileFormat, Reader, TextTable};
use super::formats::text::{self, TextHead};
use super::formats::{self, foreign, spreadsheet};
use super::heading::Heading;
use super::options::ReadOptions;
use super::overview::{Overview, TableOverview};
use super::selection::{self, Selection};
use super::sheets;
use super::table::{ColumnTable, TableHead};
use sindyscope_core::study::Cancel;
use sindyscope_values::record::Record;

/// A project is recognised by this many of its first bytes.
const PROJECT_HEAD: usize = 1 << 16;

/// One column of a table that lies in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedColumn {
    /// What it is called, as a file's header would: `x [mm]`, `force (N)`.
    pub heading: String,
    /// One value a row; NaN stands for one that is missing.
    pub values: Vec<f64>,
}

/// A table that lies in memory is no file: nothing is recognised as one.
static IN_MEMORY: FileFormat =
    FileFormat::of_columns("table in memory", &[], |_| true, |_| Ok(FileContents::default()));

/// A file of measurements: its bytes, read from the disk once, and the format that they are in.
///
/// [`Self::look`], [`Self::fits`] and [`Self::read`] may follow in any order, each as often as wanted.
#[derive(Debug)]
pub struct MeasuredFile {
    /// Where it is on the disk; none for bytes that came another way.
    path: Option<PathBuf>,
    name: String,
    bytes: Vec<u8>,
    format: &'static FileFormat,
    /// The sheets of a workbook as text, once they have been wanted.
    sheets: OnceLock<Result<Vec<TextTable>, Flaw>>,
    /// Set as soon as nobody wants its records any more.
    cancel: Cancel,
    /// The columns of a table that lies in memory, which has no bytes.
    columns: Vec<NamedColumn>,
    /// How a file of text begins, once that has been wanted; none if it is no text.
    head: OnceLock<Option<TextHead>>,
}

impl MeasuredFile {
    /// Reads a file's bytes, whatever they are: what cannot be used is told by [`Self::look`] and [`Self::read`].
    ///
    /// # Errors
    /// The file cannot be opened or read.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        let bytes = sindyscope_system::fs::read(path)
            .map_err(|error| ReadError::new(path.display().to_string(), ReadProblem::Open(error.to_string())))?;
        Ok(Self { path: Some(path.to_owned()), ..Self::from_bytes(path, bytes) })
    }

    /// Bytes that came another way than from the disk; messages and records name them by the last part of `name`.
    pub fn from_bytes(name: impl AsRef<Path>, bytes: impl Into<Vec<u8>>) -> Self {
        let (name, bytes) = (file_name(name.as_ref()), bytes.into());
        let format = formats::recognise(&ending(&name), &bytes);
        Self {
            path: None,
            name,
            bytes,
            format,
            sheets: OnceLock::new(),
            head: OnceLock::new(),
            cancel: Cancel::default(),
            columns: Vec::new(),
        }
    }

    /// A table that lies in memory, read as a file with the same headings would be; messages and records name it by `name`.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn from_columns(name: &str, columns: Vec<NamedColumn>) -> Result<Self, ReadError> {
        if let [first, rest @ ..] = columns.as_slice()
            && let Some(other) = rest.iter().find(|c| c.values.len() != first.values.len())
        {
            let (one, two) = (first.values.len(), other.values.len());
            let what = format!("`{}` has {one} values and `{}` has {two}", first.heading, other.heading);
            return Err(Flaw::new(what).in_file(name, IN_MEMORY.name));
        }
        let empty = Self::from_bytes("", Vec::new());
        Ok(Self { name: name.to_owned(), format: &IN_MEMORY, columns, ..empty })
    }

    /// The same bytes, taken to be of a format.
    #[must_use]
    pub fn in_format(self, format: &'static FileFormat) -> Self {
        Self { format, sheets: OnceLock::new(), ..self }
    }

    /// The same file, the reading of which this flag stops.
    #[must_use]
    pub fn stopped_by(self, cancel: &Cancel) -> Self {
        Self { cancel: cancel.clone(), ..self }
    }

    /// Where it is on the disk; none for bytes that came another way.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The file's name, without its folder.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it holds, byte by byte.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The format that it is read as.
    pub fn format(&self) -> &'static FileFormat {
        self.format
    }

    /// True if it is a saved project of the window, which is no measurement.
    pub fn is_project(&self) -> bool {
        is_project(&self.bytes)
    }

    /// What the file holds, and what its columns are taken for with these options. Numbers beyond the first rows are not
    /// looked at, so a large file answers at once.
    ///
    /// # Errors
    /// The file is damaged or holds no table. That its columns cannot be told apart is no error.
    pub fn look(&self, options: &ReadOptions) -> Result<Overview, ReadError> {
        self.check_kind()?;
        let heads = self.heads(options)?;
        let tables: Vec<TableOverview> = heads.into_iter().map(|head| TableOverview::new(head, options)).collect();
        if tables.is_empty() {
            // Reading tells why there is none.
            self.table(options)?;
            return Err(ReadError::new(&self.name, ReadProblem::Empty));
        }
        Ok(Overview { file: self.name.clone(), format: self.format.name, tables })
    }

    /// True if header and options tell every column that reading needs. The numbers are not read: they may still be refused.
    pub fn fits(&self, options: &ReadOptions) -> bool {
        let chosen = |head: &TableHead| self.choose(&head.headings, options).is_ok();
        self.check_kind().is_ok() && self.heads(options).is_ok_and(|heads| heads.iter().any(chosen))
    }

    /// The file's records.
    ///
    /// # Errors
    /// The file cannot be read, or its samples cannot be used: with the place and the reason.
    pub fn read(&self, options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
        self.check_kind()?;
        if let Some(rate) = options.rate.filter(|r| !(r.is_normal() && *r > 0.0)) {
            return Err(ReadError::new("", ReadProblem::BadRate(rate)));
        }
        let table = self.table(options)?;
        let stem = Path::new(&self.name)
            .file_stem()
            .filter(|_| self.columns.is_empty())
            .map_or_else(|| self.name.clone(), |s| s.to_string_lossy().into_owned());
        let mut records = assemble::records(&self.name, &stem, table, options, &self.cancel)?;
        for record in &mut records {
            record.source.clone_from(&self.path);
        }
        Ok(records)
    }

    /// Refuses what is no measurement.
    fn check_kind(&self) -> Result<(), ReadError> {
        if self.is_project() {
            return Err(ReadError::new(&self.name, ReadProblem::IsProject));
        }
        if (self.format.recognises)(&self.bytes) {
            return Ok(());
        }
        foreign::refuse(&self.name, &ending(&self.name), &self.bytes)
    }

    fn choose(&self, headings: &[Heading], options: &ReadOptions) -> Result<Selection, ReadError> {
        selection::assign(&self.name, headings, options)
    }

    /// The tables of the file before any column is chosen.
    fn heads(&self, options: &ReadOptions) -> Result<Vec<TableHead>, ReadError> {
        let choose = |headings: &[Heading]| self.choose(headings, options);
        match self.format.reader {
            Reader::Text => text::look(&self.name, &self.bytes, self.head(), &choose),
            Reader::Workbook(texts) => spreadsheet::look(&self.name, self.sheets(texts)?, &choose),
            Reader::Columns(read) => Ok(sheets::heads(&self.contents(read)?)),
        }
    }

    /// The table of the columns that the options choose.
    fn table(&self, options: &ReadOptions) -> Result<ColumnTable, ReadError> {
        let choose = |headings: &[Heading]| self.choose(headings, options);
        match self.format.reader {
            Reader::Text => text::read(&self.name, &self.bytes, self.head(), &choose, &self.cancel),
            Reader::Workbook(texts) => spreadsheet::read(&self.name, self.sheets(texts)?, &choose, &self.cancel),
            Reader::Columns(read) => sheets::table(&self.name, self.format.name, self.contents(read)?, &choose),
        }
    }

    fn head(&self) -> Option<&TextHead> {
        self.head.get_or_init(|| TextHead::new(&self.bytes)).as_ref()
    }

    fn contents<'a>(
        &'a self,
        read: fn(&'a [u8]) -> Result<FileContents<'a>, Flaw>,
    ) -> Result<FileContents<'a>, ReadError> {
        if !self.columns.is_empty() {
            let column =
                |c: &'a NamedColumn| FileColumn::new(&c.heading, "", c.values.len(), move || Ok(c.values.clone()));
            return Ok(FileContents { columns: self.columns.iter().map(column).collect(), notices: Vec::new() });
        }
        read(&self.bytes).map_err(|flaw| flaw.in_file(&self.name, self.format.name))
    }

    fn sheets(&self, texts: fn(&[u8]) -> Result<Vec<TextTable>, Flaw>) -> Result<&[TextTable], ReadError> {
        let texts = self.sheets.get_or_init(|| texts(&self.bytes));
        texts.as_deref().map_err(|flaw| flaw.clone().in_file(&self.name, self.format.name))
    }
}

/// True if a file's first bytes are those of a saved project of the window.
pub fn is_project(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(PROJECT_HEAD)]);
    text.trim_start_matches('\u{feff}').trim_start().starts_with('{') && text.contains("\"sindyscope_project\"")
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

fn ending(name: &str) -> String {
    Path::new(name).extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}
