//! `NumPy`'s `.npy` and `.npz`.
//!
//! After NEP 1, *A Simple File Format for `NumPy` Arrays*. A structured array's fields are named columns; a plain matrix has
//! columns without names.

use std::io::{Cursor as Seek, Read};

use super::bytes::{Cursor, DataBytes, Number, Order, Strided};
use crate::column::{FileColumn, FileContents, Flaw};
use crate::format::FileFormat;

pub(crate) const FORMAT: FileFormat = FileFormat::of_columns(
    "NumPy array",
    &["npy"],
    |bytes| bytes.starts_with(MAGIC),
    |bytes| {
        let mut contents = FileContents::default();
        add_array("", DataBytes::File(bytes), &mut contents)?;
        Ok(contents)
    },
);

pub(crate) const ARCHIVE: FileFormat = FileFormat::of_columns(
    "NumPy archive",
    &["npz"],
    // An archive's first entry stands in its first bytes.
    |bytes| {
        let name = bytes.get(26..28).map_or(0, |b| usize::from(b[0]) + 256 * usize::from(b[1]));
        bytes.starts_with(b"PK\x03\x04") && bytes.get(30..30 + name).is_some_and(|n| n.ends_with(b".npy"))
    },
    read_archive,
);

const MAGIC: &[u8] = b"\x93NUMPY";

/// A matrix with more columns than this is no set of time series.
const MOST_COLUMNS: usize = 10_000;

/// Arrays in an archive that are looked at.
const MOST_ARRAYS: usize = 10_000;

fn read_archive(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let mut archive = zip::ZipArchive::new(Seek::new(bytes))
        .map_err(|error| Flaw::new(format!("its directory is damaged or cut short ({error})")))?;
    let mut contents = FileContents::default();
    for index in 0..archive.len().min(MOST_ARRAYS) {
        let mut entry = match archive.by_index(index) {
            Ok(entry) => entry,
            Err(error) => {
                contents.notices.push(format!("array {} is damaged ({error}) and was left out", index + 1));
                continue;
            }
        };
        let name = entry.name().map_or_else(|_| (index + 1).to_string(), |n| n.trim_end_matches(".npy").to_owned());
        let mut inflated = Vec::new();
        let added = entry
            .read_to_end(&mut inflated)
            .map_err(|error| Flaw::new(format!("its data are damaged ({error})")))
            .and_then(|_| add_array(&name, DataBytes::Inflated(inflated.into()), &mut contents));
        if let Err(flaw) = added {
            contents.notices.push(format!("array `{name}` was left out: {}", flaw.what));
        }
    }
    Ok(contents)
}

fn add_array<'a>(name: &str, source: DataBytes<'a>, contents: &mut FileContents<'a>) -> Result<(), Flaw> {
    let bytes = source.bytes();
    let mut cursor = Cursor::new(bytes, 0, Order::Little);
    if cursor.take(6)? != MAGIC {
        return Err(Flaw::new("its first bytes are not those of a NumPy array"));
    }
    let version = cursor.u8()?;
    cursor.u8()?;
    let len = if version >= 2 { cursor.u32()? as usize } else { usize::from(cursor.u16()?) };
    let text = String::from_utf8_lossy(cursor.take(len)?).into_owned();
    let start = cursor.position();
    let header = Literal::parse(&text).ok_or_else(|| Flaw::at("its header is no Python dictionary", 10))?;
    let entry = |key: &str| header.entry(key).ok_or_else(|| Flaw::at(format!("its header lacks `{key}`"), 10));
    let fortran = matches!(entry("fortran_order")?, Literal::Word(word) if word == "True");
    let Literal::List(shape) = entry("shape")? else { return Err(Flaw::at("its shape is none", 10)) };
    let shape: Option<Vec<usize>> = shape.iter().map(Literal::count).collect();
    let shape = shape.ok_or_else(|| Flaw::at("its shape is none", 10))?;
    let fields = fields(entry("descr")?)?;
    let width: usize = fields.iter().map(|f| f.size).fold(0, usize::saturating_add);
    let elements = shape.iter().try_fold(1usize, |product, n| product.checked_mul(*n));
    let size = elements.and_then(|n| n.checked_mul(width));
    if size.is_none_or(|size| size > cursor.left()) {
        let what =
            format!("its shape {shape:?} needs more than the {} bytes that follow: it is cut short", cursor.left());
        return Err(Flaw::at(what, start));
    }
    let (rows, columns) = match shape[..] {
        [] => (1, 1),
        [n] => (n, 1),
        [rows, columns] => (rows, columns),
        _ => return Err(Flaw::new(format!("it has {} dimensions; one or two are read", shape.len()))),
    };
    let (row_step, column_step) = if fortran { (1, rows) } else { (columns, 1) };
    let (len, count, step, next) =
        if columns > rows { (columns, rows, column_step, row_step) } else { (rows, columns, row_step, column_step) };
    if count > MOST_COLUMNS {
        return Err(Flaw::new(format!("it is a matrix of {rows} by {columns}, too wide for time series")));
    }
    let mut offset = 0;
    for field in &fields {
        let at = start + offset;
        offset += field.size;
        let Some((number, order)) = field.number else {
            if !field.name.is_empty() || fields.len() == 1 {
                let what = if field.name.is_empty() { name } else { &field.name };
                contents.notices.push(format!("`{what}` holds no real numbers (`{}`) and was left out", field.kind));
            }
            continue;
        };
        for channel in 0..count {
            let base = match (name, field.name.as_str()) {
                ("", field) => field.to_owned(),
                (name, "") => name.to_owned(),
                (name, field) => format!("{name}.{field}"),
            };
            let label = if count > 1 && !base.is_empty() { format!("{base}({})", channel + 1) } else { base };
            let start = at + channel * next * width;
            let numbers = Strided { start, stride: step * width, count: len, number, order };
            let source = source.clone();
            contents.columns.push(FileColumn::new(&label, "", len, move || numbers.read(source.bytes())));
        }
    }
    Ok(())
}

/// One field of an element.
struct Field {
    name: String,
    size: usize,
    kind: String,
    number: Option<(Number, Order)>,
}

fn fields(descr: &Literal) -> Result<Vec<Field>, Flaw> {
    let field = |name: &str, kind: &str| {
        let order = if kind.starts_with('>') { Order::Big } else { Order::Little };
        let plain = kind.trim_start_matches(['<', '>', '=', '|']);
        let number = match plain {
            "f8" => Some(Number::F64),
            "f4" => Some(Number::F32),
            "f2" => Some(Number::F16),
            "i1" => Some(Number::I8),
            "i2" => Some(Number::I16),
            "i4" => Some(Number::I32),
            "i8" => Some(Number::I64),
            "u1" | "b1" => Some(Number::U8),
            "u2" => Some(Number::U16),
            "u4" => Some(Number::U32),
            "u8" => Some(Number::U64),
            _ => None,
        };
        let letters = plain.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        // A time stamp has its unit behind its size: `M8[ns]`; text in UCS-4 counts characters.
        let count = letters.split('[').next().and_then(|n| n.parse::<usize>().ok());
        let size = count.and_then(|n| n.checked_mul(if plain.starts_with('U') { 4 } else { 1 }));
        let size = size.ok_or_else(|| Flaw::new(format!("values of type `{kind}` are not read")).try_this(PLAIN))?;
        Ok(Field { name: name.to_owned(), size, kind: kind.to_owned(), number: number.map(|n| (n, order)) })
    };
    match descr {
        Literal::Text(kind) => Ok(vec![field("", kind)?]),
        Literal::List(list) => list
            .iter()
            .map(|item| match item {
                Literal::List(pair) => match &pair[..] {
                    [Literal::Text(name), Literal::Text(kind)] => field(name, kind),
                    _ => Err(Flaw::new("a field of its elements is itself an array or a structure").try_this(PLAIN)),
                },
                _ => Err(Flaw::at("the type of its elements is none", 10)),
            })
            .collect(),
        _ => Err(Flaw::at("the type of its elements is none", 10)),
    }
}

const PLAIN: &str = "save plain arrays of numbers: `numpy.savez('file.npz', t=t, x=x, u=u)`";

/// What a Python expression of constants says.
#[derive(Clone, Debug, PartialEq)]
enum Literal {
    Text(String),
    /// A number, `True`, `False` or `None`.
    Word(String),
    /// A list or a tuple.
    List(Vec<Self>),
    Map(Vec<(Self, Self)>),
}

impl Literal {
    fn parse(text: &str) -> Option<Self> {
        let mut rest = text.trim();
        Self::next(&mut rest, 0)
    }

    fn entry(&self, key: &str) -> Option<&Self> {
        let Self::Map(entries) = self else { return None };
        entries.iter().find(|(k, _)| matches!(k, Self::Text(text) if text == key)).map(|(_, value)| value)
    }

    fn count(&self) -> Option<usize> {
        let Self::Word(word) = self else { return None };
        word.trim_end_matches('L').parse().ok()
    }

    fn next(rest: &mut &str, depth: usize) -> Option<Self> {
        if depth > 8 {
            return None;
        }
        *rest = rest.trim_start();
        let first = rest.chars().next()?;
        match first {
            '\'' | '"' => {
                let (text, after) = rest[1..].split_once(first)?;
                *rest = after;
                Some(Self::Text(text.to_owned()))
            }
            '(' | '[' => {
                *rest = &rest[1..];
                let close = if first == '(' { ')' } else { ']' };
                let mut items = Vec::new();
                while !Self::closes(rest, close) {
                    items.push(Self::next(rest, depth + 1)?);
                    Self::comma(rest);
                }
                Some(Self::List(items))
            }
            '{' => {
                *rest = &rest[1..];
                let mut entries = Vec::new();
                while !Self::closes(rest, '}') {
                    let key = Self::next(rest, depth + 1)?;
                    *rest = rest.trim_start().strip_prefix(':')?;
                    entries.push((key, Self::next(rest, depth + 1)?));
                    Self::comma(rest);
                }
                Some(Self::Map(entries))
            }
            _ => {
                let end = rest.find(|c: char| !(c.is_alphanumeric() || "+-._".contains(c))).unwrap_or(rest.len());
                let (word, after) = rest.split_at(end);
                *rest = after;
                (!word.is_empty()).then(|| Self::Word(word.to_owned()))
            }
        }
    }

    fn closes(rest: &mut &str, close: char) -> bool {
        match rest.trim_start().strip_prefix(close) {
            Some(after) => {
                *rest = after;
                true
            }
            None => false,
        }
    }

    fn comma(rest: &mut &str) {
        let plain = rest.trim_start();
        *rest = plain.strip_prefix(',').unwrap_or(plain);
    }
}
