//! `LabVIEW`'s binary measurements, `.tdms`.
//!
//! After *TDMS File Format Internal Structure* (National Instruments). Segments follow each other, each with what it changes
//! of the objects' description and then raw data: contiguous, interleaved or as a data-acquisition card gave them (`DAQmx`).
//! Linear and polynomial scales are applied; channels with other scales are given raw, with a notice.

use std::collections::HashMap;

use super::bytes::{Cursor, Number, Order};
use crate::column::{FileColumn, FileContents, Flaw, TimeBase};
use crate::format::FileFormat;

pub(crate) const FORMAT: FileFormat =
    FileFormat::of_columns("TDMS", &["tdms"], |bytes| bytes.starts_with(b"TDSm"), read);

/// Bits of a segment's table of contents.
mod contains {
    pub(super) const METADATA: u32 = 1 << 1;
    pub(super) const NEW_LIST: u32 = 1 << 2;
    pub(super) const RAW_DATA: u32 = 1 << 3;
    pub(super) const INTERLEAVED: u32 = 1 << 5;
    pub(super) const BIG_ENDIAN: u32 = 1 << 6;
}

/// How a raw data index begins: none, as before, or that of a data-acquisition card.
const NO_DATA: u32 = 0xffff_ffff;
const AS_BEFORE: u32 = 0;
const DAQMX_SCALER: u32 = 0x1269;
const DAQMX_LINE: u32 = 0x126a;

/// A scale's input: the raw values.
const RAW: u32 = 0xffff_ffff;

/// A chain of scales is followed so far.
const MOST_SCALES: usize = 100;

/// Stretches of raw data that are noted in all: more are no measurement.
const MOST_PIECES: usize = 50_000_000;

/// A property's value, as far as it is of use.
#[derive(Clone, Debug, PartialEq)]
enum Property {
    Text(String),
    Number(f64),
}

/// Where an object's values stand in a chunk of raw data.
#[derive(Clone, Debug)]
struct Index {
    kind: TdmsKind,
    /// Values in a chunk.
    count: usize,
    /// Bytes of one value; for text, of all that a chunk has.
    size: usize,
    /// Widths in bytes of the rows that a card's buffers give; empty without a card.
    widths: Vec<usize>,
    /// Buffer, byte within its row and bit within the byte.
    place: (usize, usize, Option<u32>),
}

/// What an object's values are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TdmsKind {
    Number(Number),
    /// Text, time stamps, complex numbers: passed over, a value being this many bytes.
    Other,
}

/// Values that stand at even distances.
#[derive(Clone, Copy, Debug)]
struct TdmsPiece {
    start: usize,
    stride: usize,
    count: usize,
    number: Number,
    order: Order,
    bit: Option<u32>,
}

#[derive(Default)]
struct Object {
    path: String,
    properties: HashMap<String, Property>,
    index: Option<Index>,
    pieces: Vec<TdmsPiece>,
    is_other: bool,
    /// True if the segments that are read have values of it.
    is_active: bool,
}

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let mut objects: Vec<Object> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    let mut active: Vec<usize> = Vec::new();
    let mut contents = FileContents::default();
    let mut pieces = 0;
    let mut at = 0;
    while at < bytes.len() {
        let mut cursor = Cursor::new(bytes, at, Order::Little);
        let cut = |at| format!("the file ends within the segment at byte {at}: what comes before it was read");
        let lead = lead_in(&mut cursor);
        let lead = match lead {
            Ok(lead) => lead,
            Err(flaw) if at == 0 => return Err(flaw),
            Err(_) => {
                contents.notices.push(format!("no segment begins at byte {at}: what comes before it was read"));
                break;
            }
        };
        let begin = cursor.position();
        let (next, raw) = (lead.next.and_then(|n| begin.checked_add(n)), begin.checked_add(lead.raw));
        let end = next.filter(|n| *n <= bytes.len()).unwrap_or(bytes.len());
        if next.is_none_or(|n| n > bytes.len()) {
            contents.notices.push(cut(at));
        }
        let raw = raw.filter(|r| *r <= end);
        if lead.contains & contains::METADATA != 0 {
            let new_list = lead.contains & contains::NEW_LIST != 0;
            let within = Cursor::new(&bytes[..raw.unwrap_or(end)], begin, cursor.order);
            if let Err(flaw) = metadata(within, new_list, &mut objects, &mut known, &mut active) {
                if at == 0 {
                    return Err(flaw);
                }
                contents.notices.push(format!(
                    "the description at byte {begin} is damaged ({}); what comes before it was read",
                    flaw.what
                ));
                break;
            }
        }
        if let Some(raw) = raw.filter(|_| lead.contains & contains::RAW_DATA != 0) {
            let interleaved = lead.contains & contains::INTERLEAVED != 0;
            pieces += chunks(raw..end, interleaved, cursor.order, &mut objects, &active)?;
            if pieces > MOST_PIECES {
                return Err(Flaw::at("its data are in too many pieces", raw));
            }
        }
        if end <= at {
            return Err(Flaw::at("a segment has no length", at));
        }
        at = end;
    }
    columns(bytes, objects, &mut contents);
    Ok(contents)
}

struct LeadIn {
    contains: u32,
    next: Option<usize>,
    raw: usize,
}

fn lead_in(cursor: &mut Cursor<'_>) -> Result<LeadIn, Flaw> {
    let at = cursor.position();
    if cursor.take(4)? != b"TDSm" {
        return Err(Flaw::at("no segment begins where one should", at));
    }
    let contains = cursor.u32()?;
    cursor.order = if contains & contains::BIG_ENDIAN != 0 { Order::Big } else { Order::Little };
    cursor.u32()?;
    let next = cursor.u64()?;
    // All bits set: the program that wrote it was stopped.
    let next = if next == u64::MAX { None } else { usize::try_from(next).ok() };
    let raw = cursor.size()?;
    Ok(LeadIn { contains, next, raw })
}

fn metadata(
    mut cursor: Cursor<'_>,
    new_list: bool,
    objects: &mut Vec<Object>,
    known: &mut HashMap<String, usize>,
    active: &mut Vec<usize>,
) -> Result<(), Flaw> {
    if new_list {
        for object in active.drain(..) {
            objects[object].is_active = false;
        }
    }
    for _ in 0..cursor.u32()? {
        let path = text(&mut cursor)?;
        let object = *known.entry(path.clone()).or_insert_with(|| {
            objects.push(Object { path, ..Object::default() });
            objects.len() - 1
        });
        let had_data = index(&mut cursor, &mut objects[object])?;
        let was_active = std::mem::replace(&mut objects[object].is_active, had_data);
        if had_data && !was_active {
            active.push(object);
        } else if was_active && !had_data {
            active.retain(|other| *other != object);
        }
        for _ in 0..cursor.u32()? {
            let name = text(&mut cursor)?;
            if let Some(value) = property(&mut cursor)? {
                objects[object].properties.insert(name, value);
            }
        }
    }
    Ok(())
}

fn text(cursor: &mut Cursor<'_>) -> Result<String, Flaw> {
    let len = cursor.u32()? as usize;
    cursor.take(len).map(|bytes| String::from_utf8_lossy(bytes).into_owned())
}

/// The kind of a type's values, and the bytes of one; none for text.
fn kind(of: u32, at: usize) -> Result<(TdmsKind, Option<usize>), Flaw> {
    let number = |n: Number| (TdmsKind::Number(n), Some(n.size()));
    Ok(match of {
        1 => number(Number::I8),
        2 => number(Number::I16),
        3 => number(Number::I32),
        4 => number(Number::I64),
        5 | 0x21 => number(Number::U8),
        6 => number(Number::U16),
        7 => number(Number::U32),
        8 => number(Number::U64),
        9 | 0x19 => number(Number::F32),
        10 | 0x1a => number(Number::F64),
        0x20 => (TdmsKind::Other, None),
        0x44 | 0x0010_000d => (TdmsKind::Other, Some(16)),
        0x0008_000c => (TdmsKind::Other, Some(8)),
        other => return Err(Flaw::at(format!("values of type {other:#x} are not known"), at)),
    })
}

/// Reads where an object's values are; true if it has any.
fn index(cursor: &mut Cursor<'_>, object: &mut Object) -> Result<bool, Flaw> {
    let header = cursor.u32()?;
    let at = cursor.position();
    match header {
        NO_DATA => return Ok(false),
        AS_BEFORE => {
            return if object.index.is_some() {
                Ok(true)
            } else {
                Err(Flaw::at("an object is described as before, but it was not there before", at))
            };
        }
        _ => {}
    }
    let of = cursor.u32()?;
    cursor.u32()?;
    let count = cursor.size()?;
    if header == DAQMX_SCALER || header == DAQMX_LINE {
        let mut first = None;
        for _ in 0..cursor.u32()? {
            let (of, buffer, offset) = (cursor.u32()?, cursor.u32()? as usize, cursor.u32()? as usize);
            if header == DAQMX_LINE {
                cursor.u8().map(u32::from)?
            } else {
                cursor.u32()?
            };
            cursor.u32()?;
            let kinds = [Number::U8, Number::I8, Number::U16, Number::I16, Number::U32, Number::I32];
            let number = kinds.get(of as usize).copied();
            let number = number.ok_or_else(|| Flaw::at(format!("a card's values of type {of} are not known"), at))?;
            let bit = (offset % 8) as u32;
            let place = if header == DAQMX_LINE { (buffer, offset / 8, Some(bit)) } else { (buffer, offset, None) };
            first.get_or_insert((number, place));
        }
        let mut widths = Vec::new();
        for _ in 0..cursor.u32()? {
            widths.push(cursor.u32()? as usize);
        }
        let (number, place) = first.ok_or_else(|| Flaw::at("a card's channel has no values", at))?;
        object.index = Some(Index { kind: TdmsKind::Number(number), count, size: number.size(), widths, place });
        return Ok(true);
    }
    let (kind, size) = kind(of, at)?;
    let size = match size {
        Some(size) => size,
        None => cursor.size()?,
    };
    object.is_other |= kind == TdmsKind::Other;
    // Text takes its bytes as a whole.
    let (count, size) = if of == 0x20 { (1, size) } else { (count, size) };
    object.index = Some(Index { kind, count, size, widths: Vec::new(), place: (0, 0, None) });
    Ok(true)
}

fn property(cursor: &mut Cursor<'_>) -> Result<Option<Property>, Flaw> {
    let at = cursor.position();
    let of = cursor.u32()?;
    Ok(match (of, kind(of, at)?) {
        (0x20, _) => Some(Property::Text(text(cursor)?)),
        (_, (TdmsKind::Number(number), _)) => {
            let order = cursor.order;
            number.get(cursor.take(number.size())?, 0, order).map(Property::Number)
        }
        (_, (TdmsKind::Other, size)) => {
            cursor.take(size.unwrap_or(0))?;
            None
        }
    })
}

/// Notes where the active objects' values stand in a segment's raw data; gives the number of pieces.
fn chunks(
    raw: std::ops::Range<usize>,
    interleaved: bool,
    order: Order,
    objects: &mut [Object],
    active: &[usize],
) -> Result<usize, Flaw> {
    if raw.is_empty() {
        return Ok(0);
    }
    let impossible = || Flaw::at("the size of a chunk of data is impossible", raw.start);
    let indices: Vec<(usize, Index)> =
        active.iter().filter_map(|object| Some((*object, objects[*object].index.clone()?))).collect();
    let card = indices.iter().find(|(_, index)| !index.widths.is_empty()).map(|(_, index)| index.widths.clone());
    // Rows of each buffer of a card, and where it begins in a chunk.
    let mut buffers: Vec<(usize, usize)> = Vec::new();
    let mut chunk = 0usize;
    if let Some(widths) = &card {
        for (buffer, width) in widths.iter().enumerate() {
            let here = indices.iter().filter(|(_, index)| index.place.0 == buffer);
            let rows = here.map(|(_, index)| index.count).max().unwrap_or(0);
            buffers.push((chunk, *width));
            chunk = rows.checked_mul(*width).and_then(|s| s.checked_add(chunk)).ok_or_else(impossible)?;
        }
    } else {
        for (_, index) in &indices {
            let size = index.count.checked_mul(index.size);
            chunk = size.and_then(|s| s.checked_add(chunk)).ok_or_else(impossible)?;
        }
    }
    if chunk == 0 {
        return Ok(0);
    }
    let row: usize = indices.iter().map(|(_, index)| index.size).fold(0, usize::saturating_add);
    let mut count = 0;
    let mut start = raw.start;
    while start < raw.end {
        let mut offset = 0;
        for (object, index) in &indices {
            let (begin, stride) = if card.is_some() {
                let (buffer, byte, _) = index.place;
                let (begin, width) = *buffers.get(buffer).ok_or_else(impossible)?;
                (begin.saturating_add(byte), width)
            } else if interleaved {
                (offset, row)
            } else {
                (offset, index.size)
            };
            offset =
                offset.saturating_add(if interleaved { index.size } else { index.count.saturating_mul(index.size) });
            let TdmsKind::Number(number) = index.kind else { continue };
            // The last chunk may be cut short.
            let begin = start.saturating_add(begin);
            let room = (raw.end + stride).saturating_sub(begin.saturating_add(number.size()));
            let held = room.checked_div(stride).unwrap_or(0);
            let piece =
                TdmsPiece { start: begin, stride, count: index.count.min(held), number, order, bit: index.place.2 };
            if piece.count > 0 {
                add(&mut objects[*object].pieces, piece);
                count += 1;
            }
        }
        start = start.saturating_add(chunk);
    }
    Ok(count)
}

/// Appends a piece, or lengthens the last where it goes on.
fn add(pieces: &mut Vec<TdmsPiece>, piece: TdmsPiece) {
    if let Some(last) = pieces.last_mut()
        && last.start + last.count * last.stride == piece.start
        && (last.stride, last.number, last.order, last.bit) == (piece.stride, piece.number, piece.order, piece.bit)
    {
        last.count += piece.count;
        return;
    }
    pieces.push(piece);
}

/// The names in a path: `/'group'/'channel'`, a quote doubled within.
fn names(path: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = path;
    while let Some(after) = rest.strip_prefix("/'") {
        let mut name = String::new();
        let mut letters = after.char_indices().peekable();
        let mut end = after.len();
        while let Some((place, letter)) = letters.next() {
            if letter == '\'' && letters.next_if(|(_, next)| *next == '\'').is_none() {
                end = place + 1;
                break;
            }
            name.push(letter);
        }
        names.push(name);
        rest = &after[end..];
    }
    names
}

fn columns<'a>(bytes: &'a [u8], objects: Vec<Object>, contents: &mut FileContents<'a>) {
    let of_path: HashMap<String, HashMap<String, Property>> =
        objects.iter().filter(|o| names(&o.path).len() < 2).map(|o| (o.path.clone(), o.properties.clone())).collect();
    for object in objects {
        let names = names(&object.path);
        let [group, name] = &names[..] else { continue };
        let len: usize = object.pieces.iter().map(|p| p.count).sum();
        if object.is_other && len == 0 {
            contents.notices.push(format!("`{name}` holds no real numbers and was left out"));
            continue;
        }
        let text = |key: &str| match object.properties.get(key) {
            Some(Property::Text(text)) => text.as_str(),
            _ => "",
        };
        let number = |key: &str| match object.properties.get(key) {
            Some(Property::Number(number)) => Some(*number),
            _ => None,
        };
        let base = match number("wf_increment").filter(|step| step.is_normal() && *step > 0.0) {
            Some(interval) => {
                let start = number("wf_start_offset").filter(|s| s.is_finite()).unwrap_or(0.0);
                TimeBase::Even { start, interval }
            }
            None => TimeBase::Unknown,
        };
        let group_path = format!("/'{}'", group.replace('\'', "''"));
        let sources = [Some(&object.properties), of_path.get(&group_path), of_path.get("/")];
        let scales = sources.into_iter().flatten().find_map(scales);
        let scales = scales.unwrap_or(Ok(Vec::new())).unwrap_or_else(|kind| {
            contents
                .notices
                .push(format!("`{name}` has a scale of kind {kind}, which is not applied: its values are raw"));
            Vec::new()
        });
        let unit = Some(text("unit_string")).filter(|u| !u.is_empty()).unwrap_or(text("NI_UnitDescription")).to_owned();
        let pieces = object.pieces;
        let decode = move || {
            let mut values = Vec::with_capacity(len);
            for piece in &pieces {
                let TdmsPiece { start, stride, count, number, order, bit } = *piece;
                let read = (0..count).map_while(|k| number.get(bytes, start + k * stride, order));
                match bit {
                    Some(bit) => values.extend(read.map(|v| f64::from((v as u64 >> bit & 1) as u8))),
                    None => values.extend(read),
                }
            }
            for coefficients in &scales {
                for value in &mut values {
                    *value = coefficients.iter().rev().fold(0.0, |sum, c| sum * *value + c);
                }
            }
            Ok(values)
        };
        let column = FileColumn::new(name, &unit, len, decode);
        contents.columns.push(FileColumn { base, group: group.clone(), ..column });
    }
}

/// The polynomials from raw to scaled values, the first to be applied first; the kind of one that is none, as an error.
fn scales(properties: &HashMap<String, Property>) -> Option<Result<Vec<Vec<f64>>, String>> {
    let number = |key: &str| match properties.get(key) {
        Some(Property::Number(number)) => Some(*number),
        _ => None,
    };
    if matches!(properties.get("NI_Scaling_Status"), Some(Property::Text(status)) if status == "scaled") {
        return None;
    }
    let count = number("NI_Number_Of_Scales").filter(|n| (1.0..=MOST_SCALES as f64).contains(n))? as usize;
    let mut chain = Vec::new();
    let mut scale = count - 1;
    for _ in 0..count {
        let prefix = format!("NI_Scale[{scale}]");
        // A scale without a kind is a card's own.
        let Some(Property::Text(kind)) = properties.get(&format!("{prefix}_Scale_Type")) else { break };
        let value = |key: &str| number(&format!("{prefix}_{kind}_{key}"));
        match kind.as_str() {
            "Linear" => chain.push(vec![value("Y_Intercept").unwrap_or(0.0), value("Slope").unwrap_or(1.0)]),
            "Polynomial" => {
                let size = value("Coefficients_Size").map_or(4, |n| n.clamp(0.0, 100.0) as usize);
                chain.push((0..size).map(|i| value(&format!("Coefficients[{i}]")).unwrap_or(0.0)).collect());
            }
            "AdvancedAPI" => {}
            other => return Some(Err(other.to_owned())),
        }
        match value("Input_Source") {
            Some(source) if source as u32 != RAW && (source as usize) < scale => scale = source as usize,
            _ => break,
        }
    }
    chain.reverse();
    Some(Ok(chain))
}
