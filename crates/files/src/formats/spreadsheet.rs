//! Sheets of Excel and `OpenDocument`, read as the text that they would be exported as.
//!
//! Every rule for text (header, row of units, comments, missing values) then counts for them too, and lines in messages are
//! the sheet's rows.

use sindyscope_core::study::Cancel;
use std::fmt::Write;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};

use calamine::{Data, DataRef, Reader as _, Sheets, open_workbook_auto_from_rs};

use super::text::{self, TextHead};
use crate::column::Flaw;
use crate::error::{ReadError, ReadProblem};
use crate::format::{FileFormat, Reader, TextTable};
use crate::table::{Choose, ColumnTable, TableHead};
use crate::words::list;

pub(crate) const FORMAT: FileFormat = FileFormat {
    name: "Excel or OpenDocument",
    extensions: &["xlsx", "xlsm", "xlsb", "xls", "ods"],
    recognises: |bytes| {
        // An archive's directory, which names what it holds, stands at its end.
        let (head, tail) = (&bytes[..bytes.len().min(4096)], &bytes[bytes.len().saturating_sub(8192)..]);
        let has = |name: &[u8]| [head, tail].iter().any(|part| part.windows(name.len()).any(|w| w == name));
        let other = has(b"word/document") || has(b"ppt/presentation");
        let zipped = bytes.starts_with(b"PK\x03\x04")
            && (has(b"[Content_Types].xml") || has(b"xl/") || has(b"opendocument.spreadsheet"));
        (zipped && !other) || bytes.starts_with(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")
    },
    reader: Reader::Workbook(sheets),
};

/// Cells of one sheet, empty ones between others included; more are no table.
const MOST_CELLS: usize = 200_000_000;

/// Seconds of a day, the unit in which sheets count time.
const DAY: f64 = 86_400.0;

/// The sheets that read as a table.
pub(crate) fn look(file: &str, sheets: &[TextTable], choose: &Choose<'_>) -> Result<Vec<TableHead>, ReadError> {
    let mut tables = Vec::new();
    let mut reason = None;
    for TextTable { name, text, head } in sheets {
        match text::look(file, text.as_bytes(), head.as_ref(), choose) {
            Ok(found) => tables.extend(found.into_iter().map(|table| TableHead { name: name.clone(), ..table })),
            Err(error) => reason = reason.or(Some(error)),
        }
    }
    match reason {
        Some(error) if tables.is_empty() => Err(error),
        _ => Ok(tables),
    }
}

/// The text of each sheet.
fn sheets(bytes: &[u8]) -> Result<Vec<TextTable>, Flaw> {
    // The library that reads sheets is not proof against every damaged file.
    catch_unwind(AssertUnwindSafe(|| texts(bytes))).unwrap_or_else(|_| Err(Flaw::new("it is damaged")))
}

/// The first sheet that reads as a table.
pub(crate) fn read(
    file: &str,
    sheets: &[TextTable],
    choose: &Choose<'_>,
    cancel: &Cancel,
) -> Result<ColumnTable, ReadError> {
    let mut first: Option<ReadError> = None;
    for (index, TextTable { name, text, head }) in sheets.iter().enumerate() {
        match text::read(file, text.as_bytes(), head.as_ref(), choose, cancel) {
            Ok(mut table) => {
                if sheets.len() > 1 {
                    let others = sheets.iter().enumerate().filter(|(other, _)| *other != index);
                    let others: Vec<&str> = others.map(|(_, other)| other.name.as_str()).collect();
                    table.notices.push(format!("sheet `{name}` was read, not {}", list(&others)));
                }
                return Ok(table);
            }
            Err(error) if matches!(*error.problem, ReadProblem::Cancelled) => return Err(error),
            Err(error) => {
                // A sheet with a header says more of what is wrong than an empty or a described one.
                let is_bare = |e: &ReadError| matches!(*e.problem, ReadProblem::Empty | ReadProblem::HeaderOnly(_));
                if first.as_ref().is_none_or(|first| is_bare(first) && !is_bare(&error)) {
                    first = Some(error);
                }
            }
        }
    }
    Err(first.unwrap_or_else(|| ReadError::new(file, ReadProblem::Empty)))
}

fn texts(bytes: &[u8]) -> Result<Vec<TextTable>, Flaw> {
    let damaged = |error: calamine::Error| {
        let text = error.to_string();
        if text.to_lowercase().contains("password") {
            return Flaw::new("it is protected by a password").try_this("save it without a password");
        }
        Flaw::new(format!("it is damaged or cut short ({text})"))
    };
    let mut book = open_workbook_auto_from_rs(Cursor::new(bytes)).map_err(damaged)?;
    let mut texts = Vec::new();
    for name in book.sheet_names() {
        let mut text = SheetText::default();
        if let Sheets::Xlsx(book) = &mut book {
            // Cell by cell: a range would have room for all that a far corner spans.
            let mut cells = book.worksheet_cells_reader(&name).map_err(|e| damaged(e.into()))?;
            while let Some(cell) = cells.next_cell().map_err(|e| damaged(e.into()))? {
                let (row, column) = cell.get_position();
                match cell.get_value() {
                    DataRef::SharedString(shared) => text.add(row, column, SheetCell::Text(shared))?,
                    value => text.add_data(row, column, &Data::from(value.clone()))?,
                }
            }
        } else {
            let range = book.worksheet_range(&name).map_err(damaged)?;
            let (row, column) = range.start().unwrap_or_default();
            for (r, c, value) in range.used_cells() {
                text.add_data(row + r as u32, column + c as u32, value)?;
            }
        }
        if !text.text.trim().is_empty() {
            let head = TextHead::new(text.text.as_bytes());
            texts.push(TextTable { name, text: text.text, head });
        }
    }
    Ok(texts)
}

enum SheetCell<'a> {
    Text(&'a str),
    Number(f64),
}

/// Lines of text with tabs between the cells.
#[derive(Default)]
struct SheetText {
    text: String,
    row: u32,
    column: u32,
    cells: usize,
}

impl SheetText {
    fn add_data(&mut self, row: u32, column: u32, data: &Data) -> Result<(), Flaw> {
        match data {
            Data::Int(value) => self.add(row, column, SheetCell::Number(*value as f64)),
            Data::Float(value) => self.add(row, column, SheetCell::Number(*value)),
            Data::Bool(value) => self.add(row, column, SheetCell::Number(f64::from(u8::from(*value)))),
            // A time of day or a date, in seconds, to the microsecond that its digits hold.
            Data::DateTime(value) => {
                let seconds = (value.as_f64() * DAY * 1e6).round() / 1e6;
                self.add(row, column, SheetCell::Number(seconds))
            }
            Data::String(value) | Data::DateTimeIso(value) | Data::DurationIso(value) => {
                self.add(row, column, SheetCell::Text(value))
            }
            Data::Error(_) => self.add(row, column, SheetCell::Text("nan")),
            _ => Ok(()),
        }
    }

    fn add(&mut self, row: u32, column: u32, cell: SheetCell<'_>) -> Result<(), Flaw> {
        // A row that comes late would stand in the wrong line.
        if row < self.row || (row == self.row && column < self.column) {
            return Err(Flaw::new(format!("its cells are out of order at row {}", row + 1)));
        }
        let steps = (row - self.row) as usize + if row > self.row { column } else { column - self.column } as usize;
        self.cells = self.cells.saturating_add(steps + 1);
        if self.cells > MOST_CELLS {
            return Err(Flaw::new("its sheet has too many cells").try_this("export the sheet as CSV"));
        }
        if row > self.row {
            (self.row..row).for_each(|_| self.text.push('\n'));
            (self.row, self.column) = (row, 0);
        }
        (self.column..column).for_each(|_| self.text.push('\t'));
        self.column = column;
        match cell {
            // In quotes a cell would be read to the closing one.
            SheetCell::Text(text) => self.text.extend(text.chars().map(|c| match c {
                '\t' | '\n' | '\r' | '\0' => ' ',
                '"' => '\'',
                other => other,
            })),
            SheetCell::Number(value) => {
                let _ = write!(self.text, "{value:?}");
            }
        }
        Ok(())
    }
}
