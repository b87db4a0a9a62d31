//! Text with one row a sample: CSV in all its dialects.

use std::borrow::Cow;
use std::collections::HashMap;

use csv::{ByteRecord, Reader, ReaderBuilder};

use crate::error::{ReadError, ReadProblem, RowPlace};
use crate::format::{self, FileFormat};
use crate::heading::{Heading, label};
use crate::selection::Selection;
use crate::table::{Choose, ColumnTable, FIRST_ROWS, LARGEST, TableHead};
use crate::words::printable;
use sindyscope_core::study::Cancel;
use sindyscope_values::record::units;

/// Text separated by commas, semicolons, tabs or blanks.
pub(crate) const FORMAT: FileFormat = FileFormat {
    name: "CSV and other text",
    extensions: &["csv", "tsv", "txt", "dat", "asc"],
    recognises: |_| false,
    reader: format::Reader::Text,
};

/// The header is looked for in this many rows.
const HEAD_ROWS: usize = 200;

/// Rows between two looks at whether the reading is still wanted.
const ROWS_PER_CHECK: usize = 1024;

/// What can stand between cells, the likeliest reading first: a comma may be part of a number, a blank part of a name.
const SEPARATORS: [u8; 4] = [b';', b'\t', b',', b' '];

/// How a text begins, found once for whatever is asked of it.
#[derive(Clone, Debug)]
pub(crate) struct TextHead {
    /// The text in one encoding; where that is the bytes' own, how many of them stand before it.
    decoded: Result<Vec<u8>, usize>,
    /// The first rows, as each separator parts them.
    readings: Vec<(u8, Vec<HeadRow>)>,
}

impl TextHead {
    /// None of bytes that are no text.
    pub(crate) fn new(bytes: &[u8]) -> Option<Self> {
        let decoded = decode(bytes)?;
        let readings = SEPARATORS.map(|separator| (separator, head(&decoded, separator))).to_vec();
        let decoded = match decoded {
            Cow::Owned(text) => Ok(text),
            Cow::Borrowed(text) => Err(bytes.len() - text.len()),
        };
        Some(Self { decoded, readings })
    }

    /// The text of the bytes that this is the head of.
    pub(crate) fn text<'a>(&'a self, bytes: &'a [u8]) -> &'a [u8] {
        self.decoded.as_ref().map_or_else(|before| &bytes[*before..], Vec::as_slice)
    }

    /// Where the rows of numbers begin in that text.
    pub(crate) fn header(&self, file: &str, text: &[u8], choose: &Choose<'_>) -> Result<Header, ReadError> {
        find_header(file, text, &self.readings, choose)
    }
}

/// The bytes that `head` is the head of, as a table of the columns that are wanted.
pub(crate) fn read(
    file: &str,
    bytes: &[u8],
    head: Option<&TextHead>,
    choose: &Choose<'_>,
    cancel: &Cancel,
) -> Result<ColumnTable, ReadError> {
    let head = head.ok_or_else(|| ReadError::new(file, ReadProblem::NotText))?;
    let bytes = head.text(bytes);
    let header = find_header(file, bytes, &head.readings, choose)?;
    read_rows(file, bytes, header, choose, cancel)
}

/// The names of the columns, and the first rows beneath them.
pub(crate) fn look(
    file: &str,
    bytes: &[u8],
    head: Option<&TextHead>,
    choose: &Choose<'_>,
) -> Result<Vec<TableHead>, ReadError> {
    let head = head.ok_or_else(|| ReadError::new(file, ReadProblem::NotText))?;
    let bytes = head.text(bytes);
    // Cells without names can be looked at too.
    let choose = |headings: &[Heading]| {
        if headings.iter().all(|h| h.name.is_empty()) { Ok(Selection::default()) } else { choose(headings) }
    };
    let Header { separator, headings, end, .. } = find_header(file, bytes, &head.readings, &choose)?;
    let mut first: Vec<Vec<f64>> = vec![Vec::new(); headings.len()];
    let mut rows = TextRows::new(bytes, end, separator);
    for _ in 0..FIRST_ROWS {
        if !rows.advance() {
            break;
        }
        for (column, values) in first.iter_mut().enumerate() {
            values.push(number(rows.cell(column)).unwrap_or(f64::NAN));
        }
    }
    let seen = first.first().map_or(0, Vec::len);
    let rest = bytes.get(rows.position()..).unwrap_or_default();
    let last = usize::from(rest.last().is_some_and(|b| *b != b'\n'));
    let rows = seen + if seen == FIRST_ROWS { count_lines(rest) + last } else { 0 };
    Ok(vec![TableHead { name: String::new(), headings, rows, rate: None, first }])
}

/// The file's text in one encoding: no byte-order mark, lines ended by line feeds, comments led by `#` alone.
pub(crate) fn decode(bytes: &[u8]) -> Option<Cow<'_, [u8]>> {
    let wide = |bytes: &[u8], unit: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes.chunks_exact(2).map(|b| unit([b[0], b[1]])).collect();
        Cow::Owned(String::from_utf16_lossy(&units).into_bytes())
    };
    let mut text = match bytes {
        [0xef, 0xbb, 0xbf, rest @ ..] => Cow::Borrowed(rest),
        [0xff, 0xfe, rest @ ..] => wide(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => wide(rest, u16::from_be_bytes),
        _ => Cow::Borrowed(bytes),
    };
    if text.contains(&0) {
        return None;
    }
    if text.contains(&b'\r') && !text.contains(&b'\n') {
        for byte in text.to_mut().iter_mut().filter(|b| **b == b'\r') {
            *byte = b'\n';
        }
    }
    if text.contains(&b'%') || text.contains(&b'#') {
        let mut comments = Vec::new();
        let mut begin = 0;
        for line in text.split(|b| *b == b'\n') {
            let blanks = line.iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
            if matches!(line.get(blanks), Some(b'%' | b'#')) && (blanks > 0 || line[0] == b'%') {
                comments.push(begin..=begin + blanks);
            }
            begin += line.len() + 1;
        }
        for range in comments {
            text.to_mut()[range].fill(b'#');
        }
    }
    Some(text)
}

/// Text in UTF-8, or else in Latin-1, in which every byte is a character.
pub(crate) fn text_of(bytes: &[u8]) -> String {
    std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|b| char::from(*b)).collect(), str::to_owned)
}

/// Cells of the rows after a point in the text.
pub(crate) struct TextRows<'a> {
    bytes: &'a [u8],
    base: usize,
    reader: Reader<&'a [u8]>,
    separator: u8,
    record: ByteRecord,
    /// Where blanks separate: which of the record's fields are cells.
    cells: Vec<usize>,
    /// The line that the reader has come to, and the byte where it begins.
    line: usize,
    counted: usize,
}

impl<'a> TextRows<'a> {
    pub(crate) fn new(bytes: &'a [u8], base: usize, separator: u8) -> Self {
        let reader = ReaderBuilder::new()
            .delimiter(separator)
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .from_reader(&bytes[base..]);
        let line = 1 + count_lines(&bytes[..base]);
        let (record, cells) = (ByteRecord::new(), Vec::new());
        Self { bytes, base, reader, separator, record, cells, line, counted: base }
    }

    /// Reads the next row that is neither blank nor a comment; false at the end.
    pub(crate) fn advance(&mut self) -> bool {
        loop {
            let before = self.position();
            // Neither the length of rows nor their encoding is checked by the reader, and bytes in memory cannot fail.
            if !self.reader.read_byte_record(&mut self.record).unwrap_or(false) {
                return false;
            }
            if before > self.counted {
                self.line += count_lines(&self.bytes[self.counted..before]);
                self.counted = before;
            }
            self.skip_to_row();
            self.cells.clear();
            if self.separator == b' ' {
                let filled = |(i, cell): (usize, &[u8])| (!trim(cell).is_empty()).then_some(i);
                self.cells.extend(self.record.iter().enumerate().filter_map(filled));
                if !self.cells.is_empty() {
                    return true;
                }
            } else if self.record.iter().any(|cell| !trim(cell).is_empty()) {
                return true;
            }
        }
    }

    /// The byte after the last row read.
    fn position(&self) -> usize {
        self.base + self.reader.position().byte() as usize
    }

    /// Moves the line count over blank lines and comments to the row itself.
    fn skip_to_row(&mut self) {
        loop {
            match self.bytes.get(self.counted) {
                Some(b'\n') => self.line += 1,
                Some(b'\r') => {}
                Some(b'#') => {
                    let rest = &self.bytes[self.counted..];
                    self.counted += rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
                    continue;
                }
                _ => return,
            }
            self.counted += 1;
        }
    }

    pub(crate) fn len(&self) -> usize {
        if self.separator == b' ' { self.cells.len() } else { self.record.len() }
    }

    pub(crate) fn cell(&self, column: usize) -> &[u8] {
        let field = if self.separator == b' ' { self.cells.get(column).copied() } else { Some(column) };
        trim(field.and_then(|f| self.record.get(f)).unwrap_or_default())
    }

    /// The row's cells as text, without empty ones at its end.
    pub(crate) fn texts(&self) -> Vec<String> {
        let mut texts: Vec<String> = (0..self.len()).map(|c| text_of(self.cell(c))).collect();
        while texts.last().is_some_and(String::is_empty) {
            texts.pop();
        }
        texts
    }
}

fn count_lines(bytes: &[u8]) -> usize {
    bytes.iter().filter(|b| **b == b'\n').count()
}

fn trim(cell: &[u8]) -> &[u8] {
    cell.trim_ascii()
}

/// A cell's number, with decimal point or comma; may be NaN or infinite.
pub(crate) fn number(cell: &[u8]) -> Option<f64> {
    std::str::from_utf8(cell).ok()?.parse().ok().or_else(|| odd_number(cell))
}

/// Numbers as they are seldom written: decimal comma, quotes inside blanks, a typographic minus, Fortran's exponent.
#[cold]
fn odd_number(cell: &[u8]) -> Option<f64> {
    let text = text_of(cell);
    let text = text.trim_matches('"').trim();
    if text.len() > 64 || !text.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let plain: String = text
        .chars()
        .map(|c| match c {
            ',' => '.',
            '−' => '-',
            'd' | 'D' => 'e',
            other => other,
        })
        .collect();
    plain.parse().ok()
}

/// One row of the file's head.
#[derive(Clone, Debug)]
struct HeadRow {
    cells: Vec<String>,
    line: usize,
    /// The byte after it.
    end: usize,
}

impl HeadRow {
    fn numbers(&self) -> usize {
        self.cells.iter().filter(|c| number(c.as_bytes()).is_some()).count()
    }

    fn is_units(&self) -> bool {
        let unit = |cell: &String| {
            let bare = cell.trim_matches(['[', ']', '(', ')']);
            cell.is_empty() || bare.len() < cell.len() || units::parse(cell).is_some()
        };
        self.numbers() == 0 && self.cells.iter().all(unit)
    }
}

/// Where the rows of numbers begin, and what stands above them.
pub(crate) struct Header {
    pub(crate) separator: u8,
    pub(crate) headings: Vec<Heading>,
    line: usize,
    /// The byte after the header.
    pub(crate) end: usize,
    pub(crate) notices: Vec<String>,
}

/// Cells of a row of names: where blanks separate, a unit in brackets belongs to the name before it.
fn join_brackets(cells: &[String], separator: u8) -> Vec<String> {
    if separator != b' ' {
        return cells.to_vec();
    }
    let mut joined: Vec<String> = Vec::new();
    let mut open = false;
    for cell in cells {
        match joined.last_mut() {
            Some(last) if open || cell.starts_with(['[', '(']) => {
                last.push(' ');
                last.push_str(cell);
            }
            _ => joined.push(cell.clone()),
        }
        open = cell.rfind(['[', '(']).is_some_and(|i| !cell[i..].contains([']', ')']));
    }
    joined
}

/// A row of names above a row with numbers, in one reading of the separator.
struct HeaderRow {
    header: Header,
    /// True if the row of numbers holds nothing else.
    clean: bool,
}

fn find_header(
    file: &str,
    bytes: &[u8],
    heads: &[(u8, Vec<HeadRow>)],
    choose: &Choose<'_>,
) -> Result<Header, ReadError> {
    // Rows of nothing but separators are empty in the reading that has these.
    if heads.iter().any(|(_, rows)| rows.is_empty()) {
        return Err(ReadError::new(file, ReadProblem::Empty));
    }
    let first_line = heads[0].1[0].line;

    // A lone column is a reading of last resort: every text is one column in some separator.
    for several in [true, false] {
        let readings = heads.iter().map(|(separator, rows)| (*separator, rows.as_slice()));
        if let Some(mut header) = best_candidate(readings.clone(), several, choose) {
            header.notices.extend(skipped(first_line, header.line));
            return Ok(header);
        }
        let mut readings = readings;
        if let Some((separator, rows)) = readings.find(|(_, rows)| all_numbers(rows, several)) {
            return without_names(file, bytes, separator, &rows[0], choose);
        }
    }
    // No row of numbers follows the names: the rows below will tell what is wrong.
    let (separator, rows) =
        heads.iter().find(|(_, rows)| rows.first().is_some_and(|r| r.cells.len() > 1)).unwrap_or(&heads[0]);
    let names = join_brackets(&rows[0].cells, *separator);
    let mut end = rows[0].end;
    if rows.get(1).is_some_and(|r| r.is_units() && r.cells.len() <= names.len()) {
        end = rows[1].end;
    }
    let headings = names.iter().map(|n| Heading::new(n, None)).collect();
    Ok(Header { separator: *separator, headings, line: rows[0].line, end, notices: Vec::new() })
}

/// The first row of names that gives all columns that are needed, or else the first that stands above plain numbers.
fn best_candidate<'a>(
    readings: impl Iterator<Item = (u8, &'a [HeadRow])>,
    several: bool,
    choose: &Choose<'_>,
) -> Option<Header> {
    let mut candidates: Vec<HeaderRow> = readings
        .flat_map(|(separator, rows)| (0..rows.len()).filter_map(move |i| candidate(rows, i, separator, several)))
        .collect();
    let fits = candidates.iter().position(|c| choose(&c.header.headings).is_ok());
    let best = fits.or_else(|| candidates.iter().position(|c| c.clean)).unwrap_or(0);
    (best < candidates.len()).then(|| candidates.swap_remove(best).header)
}

/// What is said of lines above the header.
fn skipped(first: usize, header: usize) -> Option<String> {
    match header.saturating_sub(first) {
        0 => None,
        1 => Some(format!("line {first} above the header was skipped")),
        _ => Some(format!("lines {first} to {} above the header were skipped", header - 1)),
    }
}

fn head(bytes: &[u8], separator: u8) -> Vec<HeadRow> {
    let mut rows = TextRows::new(bytes, 0, separator);
    let mut head = Vec::new();
    while head.len() < HEAD_ROWS && rows.advance() {
        head.push(HeadRow { cells: rows.texts(), line: rows.line, end: rows.position() });
    }
    head
}

/// True if the first rows are numbers alone, in several columns or in one.
fn all_numbers(rows: &[HeadRow], several: bool) -> bool {
    let width = rows.first().map_or(0, |r| r.cells.len());
    (width > 1) == several && rows.iter().take(2).all(|r| r.cells.len() == width && r.numbers() == width)
}

fn candidate(rows: &[HeadRow], index: usize, separator: u8, several: bool) -> Option<HeaderRow> {
    let row = &rows[index];
    if row.numbers() > 0 {
        return None;
    }
    let names = join_brackets(&row.cells, separator);
    if (names.len() > 1) != several {
        return None;
    }
    let mut below = rows.get(index + 1)?;
    let mut units: Option<&HeadRow> = None;
    if below.is_units() && below.cells.len() <= names.len() {
        units = Some(below);
        below = rows.get(index + 2)?;
    }
    let numbers = below.numbers();
    // Fewer cells than names may be a row cut short: that is told when it is read.
    if numbers == 0 || below.cells.len() > names.len() {
        return None;
    }
    let unit = |c: usize| units.and_then(|u| u.cells.get(c)).filter(|u| !u.is_empty()).map(String::as_str);
    let headings = names.iter().enumerate().map(|(c, name)| Heading::new(name, unit(c))).collect();
    let end = units.map_or(row.end, |u| u.end);
    let clean = numbers == names.len();
    Some(HeaderRow { header: Header { separator, headings, line: row.line, end, notices: Vec::new() }, clean })
}

/// Rows of numbers from the first line on: names may stand in the comment above, or the user gives the columns' numbers.
fn without_names(
    file: &str,
    bytes: &[u8],
    separator: u8,
    first: &HeadRow,
    choose: &Choose<'_>,
) -> Result<Header, ReadError> {
    let columns = first.cells.len();
    let above: Vec<&[u8]> = bytes.split(|b| *b == b'\n').take(first.line - 1).collect();
    let comment = above.iter().enumerate().rev().find(|(_, line)| line.starts_with(b"#"));
    if let Some((index, line)) = comment {
        let line = trim(line);
        let text = line.iter().position(|b| !matches!(b, b'#' | b'%' | b' ')).map_or(&line[..0], |i| &line[i..]);
        for between_names in SEPARATORS {
            let Some(row) = head(text, between_names).into_iter().next() else { continue };
            let names = join_brackets(&row.cells, between_names);
            let headings: Vec<Heading> = names.iter().map(|name| Heading::new(name, None)).collect();
            if names.len() == columns && choose(&headings).is_ok() {
                let notice = format!("the header was taken from the comment in line {}", index + 1);
                return Ok(Header { separator, headings, line: index + 1, end: 0, notices: vec![notice] });
            }
        }
    }
    let headings = vec![Heading::unnamed(); columns];
    if choose(&headings).is_ok() {
        return Ok(Header { separator, headings, line: first.line, end: 0, notices: Vec::new() });
    }
    Err(ReadError::new(file, ReadProblem::NoHeader { line: first.line, columns }))
}

fn read_rows(
    file: &str,
    bytes: &[u8],
    header: Header,
    choose: &Choose<'_>,
    cancel: &Cancel,
) -> Result<ColumnTable, ReadError> {
    let Header { separator, headings, line: header_line, end, mut notices } = header;
    let selection = choose(&headings)?;
    let expected = headings.len();
    let mut rows = TextRows::new(bytes, end, separator);
    let mut columns = CellReader::new(file, &headings);
    let mut stamps = Vec::new();
    let mut channels: Vec<Vec<f64>> = vec![Vec::new(); selection.channels.len()];
    let mut labels = Labels::default();
    let mut lines = Vec::new();
    let mut gaps = Gaps::default();
    // Where no time tells where a row stands, its number does.
    let (mut places, mut place) = (Vec::new(), 0.0);
    let wanted: Vec<usize> = selection
        .time
        .into_iter()
        .chain(selection.channels.iter().map(|(_, c)| *c))
        .chain(selection.trajectory)
        .collect();
    let needed = wanted.iter().max().map_or(0, |c| c + 1);
    while rows.advance() {
        if lines.len() % ROWS_PER_CHECK == 0 && cancel.is_cancelled() {
            return Err(ReadError::new(file, ReadProblem::Cancelled));
        }
        let cells = rows.len();
        let surplus = (expected..cells).any(|c| !rows.cell(c).is_empty());
        if cells < needed || surplus {
            let error = ReadError::new(file, ReadProblem::RowLength { cells, expected });
            return Err(error.in_row(RowPlace::Line(rows.line)));
        }
        place += 1.0;
        if let Some(column) = wanted.iter().find(|c| is_missing(rows.cell(**c))) {
            gaps.note(|| columns.refuse(&rows, *column, ReadProblem::MissingCell), !lines.is_empty());
            continue;
        }
        // Rows of several records may be mixed: then their numbers do not tell which are missing.
        if let Some(error) = &gaps.first
            && selection.time.is_none()
            && selection.trajectory.is_some()
            && gaps.inside
        {
            return Err(error.clone());
        }
        match selection.time {
            Some(column) => stamps.push(columns.number(&rows, column)?),
            None => places.push(place - 1.0),
        }
        for ((_, column), values) in selection.channels.iter().zip(&mut channels) {
            values.push(columns.number(&rows, *column)?);
        }
        if let Some(column) = selection.trajectory {
            let label = rows.cell(column);
            if label.is_empty() {
                return Err(columns.refuse(&rows, column, ReadProblem::MissingCell));
            }
            labels.push(label);
        }
        lines.push(u32::try_from(rows.line).unwrap_or(u32::MAX));
    }
    if let Some(error) = gaps.first.as_ref().filter(|_| lines.is_empty()) {
        return Err(error.clone());
    }
    notices.extend(gaps.notice());
    if selection.time.is_none() && places.windows(2).any(|w| w[1] - w[0] > 1.0) {
        stamps = places;
    }
    if lines.is_empty() {
        return Err(ReadError::new(file, ReadProblem::HeaderOnly(header_line)));
    }
    let Labels { of_rows: trajectories, names: labels, .. } = labels;
    Ok(ColumnTable {
        headings,
        selection,
        stamps,
        channels,
        trajectories,
        labels,
        rows: lines,
        by_sample: false,
        notices,
    })
}

/// True for a cell that says that there is no value.
pub(crate) fn is_missing(cell: &[u8]) -> bool {
    // Most cells are numbers: those are told by their first byte.
    if cell.first().is_some_and(u8::is_ascii_digit) {
        return false;
    }
    let text = text_of(cell);
    let bare = text.trim_matches('"').trim().to_lowercase();
    matches!(bare.as_str(), "" | "na" | "n/a" | "#n/a" | "nan" | "null" | "none" | "-" | "--")
}

/// Rows that lack a value that is needed.
#[derive(Default)]
struct Gaps {
    count: usize,
    /// The first.
    first: Option<ReadError>,
    /// True if one stands below a row that is whole.
    inside: bool,
}

impl Gaps {
    fn note(&mut self, error: impl FnOnce() -> ReadError, inside: bool) {
        self.first.get_or_insert_with(error);
        self.count += 1;
        self.inside |= inside;
    }

    fn notice(&self) -> Option<String> {
        let first = self.first.as_ref()?;
        let (row, column) = (first.row?, first.column.as_ref()?);
        Some(match self.count {
            1 => format!("{row} has no value of `{column}` and was left out"),
            n => format!("{n} rows without a value, the first of `{column}` in {row}, were left out"),
        })
    }
}

/// Turns cells into numbers, and remembers how decimals are written.
struct CellReader<'a> {
    file: &'a str,
    headings: &'a [Heading],
    points: bool,
    commas: bool,
}

impl<'a> CellReader<'a> {
    fn new(file: &'a str, headings: &'a [Heading]) -> Self {
        Self { file, headings, points: false, commas: false }
    }

    fn refuse(&self, rows: &TextRows<'_>, column: usize, problem: ReadProblem) -> ReadError {
        let error = ReadError::new(self.file, problem).in_row(RowPlace::Line(rows.line));
        error.in_column(label(self.headings, column))
    }

    fn number(&mut self, rows: &TextRows<'_>, column: usize) -> Result<f64, ReadError> {
        let cell = rows.cell(column);
        if let Some(value) = number(cell).filter(|v| v.abs() <= LARGEST) {
            if !self.points && cell.contains(&b'.') {
                self.points = true;
            } else if !self.commas && cell.contains(&b',') {
                self.commas = true;
            }
            if !(self.commas && self.points) {
                return Ok(value);
            }
        }
        Err(self.refuse(rows, column, self.problem(rows.cell(column))))
    }

    #[cold]
    fn problem(&self, bytes: &[u8]) -> ReadProblem {
        let text = text_of(bytes);
        let mut cell = printable(&text.chars().take(40).collect::<String>());
        if cell.len() < text.len() {
            cell.push('…');
        }
        match number(bytes) {
            None => ReadProblem::NotANumber(cell),
            Some(value) if !value.is_finite() => ReadProblem::NotFinite(cell),
            Some(value) if value.abs() > LARGEST => ReadProblem::TooLarge(cell),
            Some(_) => ReadProblem::MixedDecimals(cell),
        }
    }
}

/// The trajectory of each row.
#[derive(Default)]
struct Labels {
    names: Vec<String>,
    of_rows: Vec<u32>,
    known: HashMap<Vec<u8>, u32>,
    last: Option<(Vec<u8>, u32)>,
}

impl Labels {
    fn push(&mut self, label: &[u8]) {
        if let Some((text, index)) = &self.last
            && text == label
        {
            self.of_rows.push(*index);
            return;
        }
        let index = match self.known.get(label) {
            Some(index) => *index,
            None => {
                let index = u32::try_from(self.names.len()).unwrap_or(u32::MAX);
                self.names.push(text_of(label).trim_matches('"').trim().to_owned());
                self.known.insert(label.to_vec(), index);
                index
            }
        };
        self.last = Some((label.to_vec(), index));
        self.of_rows.push(index);
    }
}
