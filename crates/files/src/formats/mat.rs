//! MATLAB's `.mat` files of versions 4, 5 and 7. Version 7.3 is HDF5.
//!
//! After *MAT-File Format* (The `MathWorks`). Vectors are columns, a matrix is one column for each column it has (or each
//! row, where it is wider than high), the fields of structures are variables named `structure.field`.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::bytes::{Cursor, DataBytes, Number, Order, Strided};
use crate::column::{FileColumn, FileContents, Flaw};
use crate::format::FileFormat;

pub(crate) const FORMAT: FileFormat =
    FileFormat::of_columns("MATLAB", &["mat"], |bytes| bytes.starts_with(b"MATLAB "), read);

/// Structures within structures are followed so deep.
const DEEPEST: usize = 6;

/// A matrix with more channels than this is no set of time series.
const MOST_COLUMNS: usize = 10_000;

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let order = match bytes.get(126..128) {
        Some(b"IM") => Some(Order::Little),
        Some(b"MI") => Some(Order::Big),
        _ => None,
    };
    match order {
        Some(order) => version_5(bytes, order),
        None => version_4(bytes),
    }
}

/// A matrix of numbers, stored column after column.
struct MatlabMatrix<'a> {
    name: String,
    rows: usize,
    columns: usize,
    source: DataBytes<'a>,
    start: usize,
    number: Number,
    order: Order,
}

impl<'a> MatlabMatrix<'a> {
    fn add_to(self, contents: &mut FileContents<'a>) {
        let Self { name, rows, columns, source, start, number, order } = self;
        let size = number.size();
        // A matrix that is wider than high holds its channels in rows.
        let (len, count, stride, step) =
            if columns > rows { (columns, rows, rows * size, size) } else { (rows, columns, size, rows * size) };
        if count > MOST_COLUMNS {
            contents.notices.push(format!("`{name}` is a matrix of {rows} by {columns} and was left out"));
            return;
        }
        for channel in 0..count {
            let label = if count > 1 { format!("{name}({})", channel + 1) } else { name.clone() };
            let numbers = Strided { start: start + channel * step, stride, count: len, number, order };
            let source = source.clone();
            contents.columns.push(FileColumn::new(&label, "", len, move || numbers.read(source.bytes())));
        }
    }
}

fn version_5(bytes: &[u8], order: Order) -> Result<FileContents<'_>, Flaw> {
    let mut contents = FileContents::default();
    let mut cursor = Cursor::new(bytes, 128, order);
    while cursor.left() >= 8 {
        let at = cursor.position();
        let tag = Tag::read(&mut cursor)?;
        match tag.kind {
            COMPRESSED => {
                let mut inflated = Vec::new();
                // Deflate gives at most a thousandfold, so a file's size bounds this.
                let packed = &bytes[tag.start..tag.start + tag.len];
                let whole = ZlibDecoder::new(packed).read_to_end(&mut inflated);
                if let Err(error) = whole {
                    let what = format!("a variable's compressed data are damaged ({error}); it was left out");
                    contents.notices.push(what);
                } else {
                    let source = DataBytes::Inflated(inflated.into());
                    let inner = source.clone();
                    let mut inside = Cursor::new(inner.bytes(), 0, order);
                    let result = Tag::read(&mut inside).and_then(|tag| match tag.kind {
                        MATRIX => matrix(&source, tag, order, "", 0, &mut contents),
                        _ => Ok(()),
                    });
                    if let Err(flaw) = result {
                        contents.notices.push(format!("a variable was left out: {}", flaw.what));
                    }
                }
            }
            MATRIX => {
                if let Err(flaw) = matrix(&DataBytes::File(bytes), tag, order, "", 0, &mut contents) {
                    contents.notices.push(format!("a variable was left out: {}", flaw.what));
                }
            }
            _ => {}
        }
        // Compressed elements are not padded.
        let end = tag.start + tag.len;
        cursor.move_to(if tag.kind == COMPRESSED { end } else { end.next_multiple_of(8) });
        if cursor.position() <= at {
            return Err(Flaw::at("an element has no length", at));
        }
    }
    if cursor.left() > 0 && contents.columns.is_empty() {
        return Err(Flaw::at("it is cut short", cursor.position()));
    }
    Ok(contents)
}

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// The head of an element: its type and where its data are.
#[derive(Clone, Copy)]
struct Tag {
    kind: u32,
    start: usize,
    len: usize,
}

impl Tag {
    /// Reads a tag and leaves the cursor after its data.
    fn read(cursor: &mut Cursor<'_>) -> Result<Self, Flaw> {
        let word = cursor.u32()?;
        let tag = if word >> 16 != 0 {
            let tag = Self { kind: word & 0xffff, start: cursor.position(), len: (word >> 16) as usize };
            if tag.len > 4 {
                return Err(Flaw::at("a short element is longer than four bytes", tag.start));
            }
            cursor.take(4)?;
            tag
        } else {
            let len = cursor.u32()? as usize;
            let start = cursor.position();
            if len > cursor.left() {
                let left = cursor.left();
                return Err(Flaw::at(
                    format!("{len} bytes are said to follow and only {left} do: it is cut short"),
                    start,
                ));
            }
            cursor.take(len)?;
            // What is behind the last element need not be padded.
            let padding = len.next_multiple_of(8) - len;
            cursor.take(padding.min(cursor.left()))?;
            Self { kind: word, start, len }
        };
        Ok(tag)
    }

    /// The type of its numbers.
    fn number(self) -> Option<Number> {
        Some(match self.kind {
            1 => Number::I8,
            2 => Number::U8,
            3 => Number::I16,
            4 => Number::U16,
            5 => Number::I32,
            6 => Number::U32,
            7 => Number::F32,
            9 => Number::F64,
            12 => Number::I64,
            13 => Number::U64,
            _ => return None,
        })
    }
}

/// Adds a variable's columns, or those of a structure's fields.
fn matrix<'a>(
    source: &DataBytes<'a>,
    tag: Tag,
    order: Order,
    prefix: &str,
    depth: usize,
    contents: &mut FileContents<'a>,
) -> Result<(), Flaw> {
    let bytes = source.bytes();
    let end = tag.start + tag.len;
    // An empty field of a structure is a matrix of no bytes.
    if tag.len == 0 {
        return Ok(());
    }
    let within = bytes.get(..end).ok_or_else(|| Flaw::at("a variable is cut short", tag.start))?;
    let mut cursor = Cursor::new(within, tag.start, order);
    let flags_at = Tag::read(&mut cursor)?;
    let flags = Cursor::new(within, flags_at.start, order).u32()?;
    let (class, is_complex) = (flags & 0xff, flags & 0x800 != 0);
    // Objects (tables, time series, handles) hold their data elsewhere.
    if class == 17 {
        contents.notices.push(OBJECT.into());
        return Ok(());
    }
    let dimensions = Tag::read(&mut cursor)?;
    let mut read = Cursor::new(within, dimensions.start, order);
    let mut extents = Vec::new();
    for _ in 0..dimensions.len / 4 {
        extents.push(read.u32()? as usize);
    }
    let name = Tag::read(&mut cursor)?;
    let text = |tag: Tag| String::from_utf8_lossy(&within[tag.start..tag.start + tag.len]).into_owned();
    let own = text(name);
    let name = match (prefix, own.as_str()) {
        ("", own) => own.to_owned(),
        (prefix, "") => prefix.to_owned(),
        (prefix, own) => format!("{prefix}.{own}"),
    };
    // What functions and objects refer to stands in a variable without a name.
    if name.is_empty() {
        return Ok(());
    }
    let elements = extents.iter().try_fold(1usize, |product, n| product.checked_mul(*n));
    let Some(elements) = elements else {
        return Err(Flaw::at(format!("the size of `{name}` is impossible"), dimensions.start));
    };
    match class {
        2 if elements == 1 && depth < DEEPEST => {
            let length = Tag::read(&mut cursor)?;
            let width = Cursor::new(within, length.start, order).u32()? as usize;
            let names = Tag::read(&mut cursor)?;
            if width == 0 {
                return Ok(());
            }
            for field in within[names.start..names.start + names.len].chunks(width) {
                let field = String::from_utf8_lossy(field.split(|b| *b == 0).next().unwrap_or_default()).into_owned();
                let tag = Tag::read(&mut cursor)?;
                if tag.kind == MATRIX {
                    matrix(source, tag, order, &format!("{name}.{field}"), depth + 1, contents)?;
                }
            }
        }
        6..=15 if is_complex => contents.notices.push(format!("`{name}` is complex and was left out")),
        6..=15 if elements > 0 => {
            let data = Tag::read(&mut cursor)?;
            let number =
                data.number().ok_or_else(|| Flaw::at(format!("`{name}` is of an unknown type"), data.start))?;
            let rows = extents.first().copied().unwrap_or(1);
            let columns = elements / rows;
            if elements.checked_mul(number.size()).is_none_or(|size| size > data.len) {
                let what = format!("`{name}` is said to have {elements} values, but {} bytes follow", data.len);
                return Err(Flaw::at(what, data.start));
            }
            if extents.len() > 2 && extents[2..].iter().any(|n| *n > 1) && extents[..2].iter().all(|n| *n > 1) {
                contents.notices.push(format!("`{name}` has more than two dimensions and was left out"));
                return Ok(());
            }
            MatlabMatrix { name, rows, columns, source: source.clone(), start: data.start, number, order }
                .add_to(contents);
        }
        1 | 2 | 3 | 5 if elements > 0 => {
            let what = match class {
                1 => "a cell array",
                5 => "a sparse matrix",
                3 => "an object",
                _ => "an array of structures",
            };
            contents.notices.push(format!("`{name}` is {what} and was left out"));
        }
        _ => {}
    }
    Ok(())
}

const OBJECT: &str = "an object (such as a table or a time series) was left out: save its columns as plain vectors";

fn version_4(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let mut contents = FileContents::default();
    let mut at = 0;
    while at < bytes.len() {
        let kind = |order| Cursor::new(bytes, at, order).u32().ok().filter(|t| *t < 5000 && t / 100 % 10 == 0);
        let order = match (kind(Order::Little), kind(Order::Big)) {
            (Some(kind), _) if kind < 1000 => Order::Little,
            (_, Some(kind)) if (1000..2000).contains(&kind) => Order::Big,
            _ if at == 0 => {
                return Err(Flaw::new("neither its first bytes nor its length are those of a MATLAB file"));
            }
            _ => return Err(Flaw::at("no variable begins where one should", at)),
        };
        let mut cursor = Cursor::new(bytes, at, order);
        let kind = cursor.u32()?;
        let (rows, columns) = (cursor.u32()? as usize, cursor.u32()? as usize);
        let is_complex = cursor.u32()? != 0;
        let name_len = cursor.u32()? as usize;
        let name = cursor.take(name_len)?;
        let name = String::from_utf8_lossy(name.split(|b| *b == 0).next().unwrap_or_default()).into_owned();
        let number = match kind / 10 % 10 {
            0 => Number::F64,
            1 => Number::F32,
            2 => Number::I32,
            3 => Number::I16,
            4 => Number::U16,
            5 => Number::U8,
            _ => return Err(Flaw::at(format!("`{name}` is of an unknown type"), at)),
        };
        let start = cursor.position();
        let size = rows.checked_mul(columns).and_then(|n| n.checked_mul(number.size() * (1 + usize::from(is_complex))));
        let Some(size) = size.filter(|size| *size <= cursor.left()) else {
            let what = format!("`{name}` is said to be {rows} by {columns}, more than the file holds: it is cut short");
            return Err(Flaw::at(what, start));
        };
        match kind % 10 {
            0 if is_complex => contents.notices.push(format!("`{name}` is complex and was left out")),
            0 if size > 0 => {
                let source = DataBytes::File(bytes);
                MatlabMatrix { name, rows, columns, source, start, number, order }.add_to(&mut contents);
            }
            2 => contents.notices.push(format!("`{name}` is a sparse matrix and was left out")),
            _ => {}
        }
        at = start + size;
    }
    Ok(contents)
}
