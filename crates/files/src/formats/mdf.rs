//! Measurement Data Format, version 4 (`.mf4`), of the car industry's loggers.
//!
//! After *ASAM MDF 4.1*. Blocks refer to each other by address: data groups hold channel groups, these hold channels. Data
//! may be in one block or in lists of blocks, deflated or not; records of several channel groups may be mixed.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::io::Read;
use std::sync::Arc;

use flate2::read::ZlibDecoder;

use super::bytes::{Cursor, Number, Order};
use crate::column::{FileColumn, FileContents, Flaw};
use crate::format::FileFormat;

pub(crate) const FORMAT: FileFormat = FileFormat::of_columns(
    "MDF4",
    &["mf4", "mdf", "dat4"],
    |bytes| bytes.starts_with(b"MDF     ") || bytes.starts_with(UNFINISHED),
    read,
);

const UNFINISHED: &[u8] = b"UnFinMF ";

/// Where the header block stands.
const HEADER: usize = 64;

/// Channels and blocks that are followed: more are a loop or damage.
const MOST_BLOCKS: usize = 1_000_000;

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let finished = !bytes.starts_with(UNFINISHED);
    if finished && !bytes.starts_with(b"MDF     ") {
        return Err(Flaw::new("its first bytes are not those of an MDF file"));
    }
    let version = Cursor::new(bytes, 28, Order::Little).u16()?;
    if version < 400 {
        return Err(Flaw::new(format!("it is of version {}.{:02}; version 4 is read", version / 100, version % 100))
            .try_this("convert it to MDF 4 with the program that wrote it, or export CSV"));
    }
    let mut file = File { bytes, seen: HashSet::new() };
    let mut contents = FileContents::default();
    let header = file.block(HEADER, b"##HD")?;
    let mut group = header.link(0);
    let mut number = 0;
    while let Some(at) = group {
        let block = file.once(at, b"##DG")?;
        data_group(&mut file, &block, finished, &mut number, &mut contents)?;
        group = block.link(0);
    }
    Ok(contents)
}

/// A block: its links and its data.
struct MdfBlock<'a> {
    id: [u8; 4],
    links: Vec<usize>,
    data: &'a [u8],
    /// Where the data begin in the file.
    at: usize,
}

impl MdfBlock<'_> {
    /// The address of a block that this one refers to.
    fn link(&self, index: usize) -> Option<usize> {
        self.links.get(index).copied().filter(|link| *link != 0)
    }

    fn cursor(&self) -> Cursor<'_> {
        Cursor::new(self.data, 0, Order::Little)
    }
}

struct File<'a> {
    bytes: &'a [u8],
    /// Addresses of blocks that stand in chains: each is followed once.
    seen: HashSet<usize>,
}

impl<'a> File<'a> {
    fn any_block(&self, at: usize) -> Result<MdfBlock<'a>, Flaw> {
        let mut cursor = Cursor::new(self.bytes, at, Order::Little);
        let id: [u8; 4] = cursor.take(4)?.try_into().map_err(|_| Flaw::at("a block is cut short", at))?;
        cursor.u32()?;
        let (len, count) = (cursor.size()?, cursor.size()?);
        // A file that was not closed has lengths of zero.
        let len = len.max(24).min(self.bytes.len().saturating_sub(at));
        if count > (len - 24.min(len)) / 8 {
            return Err(Flaw::at(format!("a block has {count} links, more than its length"), at));
        }
        let mut links = Vec::with_capacity(count);
        for _ in 0..count {
            links.push(cursor.size()?);
        }
        let start = cursor.position();
        let data = self.bytes.get(start..at + len).ok_or_else(|| Flaw::at("a block is cut short", at))?;
        Ok(MdfBlock { id, links, data, at: start })
    }

    fn block(&self, at: usize, id: &[u8; 4]) -> Result<MdfBlock<'a>, Flaw> {
        let block = self.any_block(at)?;
        if block.id != *id {
            let name = |id: &[u8; 4]| String::from_utf8_lossy(id).into_owned();
            return Err(Flaw::at(format!("there is a block `{}` where `{}` should be", name(&block.id), name(id)), at));
        }
        Ok(block)
    }

    /// A block in a chain, where none comes twice.
    fn once(&mut self, at: usize, id: &[u8; 4]) -> Result<MdfBlock<'a>, Flaw> {
        self.follow(at)?;
        self.block(at, id)
    }

    fn follow(&mut self, at: usize) -> Result<(), Flaw> {
        if !self.seen.insert(at) || self.seen.len() > MOST_BLOCKS {
            return Err(Flaw::at("its blocks refer to each other in a circle", at));
        }
        Ok(())
    }

    /// A block's text: plain, or the first `TX` of its XML.
    fn text(&self, at: Option<usize>) -> String {
        let Some(block) = at.and_then(|at| self.any_block(at).ok()) else { return String::new() };
        let text = block.data.split(|b| *b == 0).next().unwrap_or_default();
        let text = String::from_utf8_lossy(text);
        match &block.id {
            b"##TX" => text.trim().to_owned(),
            b"##MD" => {
                let inner = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>"));
                let plain = inner.map_or("", |(text, _)| text).trim();
                plain.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&")
            }
            _ => String::new(),
        }
    }

    /// All bytes of a data group's records.
    fn data(&mut self, at: Option<usize>, contents: &mut FileContents<'_>) -> Result<Cow<'a, [u8]>, Flaw> {
        let mut data: Cow<'a, [u8]> = Cow::Borrowed(&[]);
        let mut pending: Vec<usize> = at.into_iter().collect();
        while let Some(at) = pending.pop() {
            self.follow(at)?;
            let block = self.any_block(at)?;
            match &block.id {
                b"##DT" | b"##DV" | b"##SD" if data.is_empty() => data = Cow::Borrowed(block.data),
                b"##DT" | b"##DV" | b"##SD" => data.to_mut().extend_from_slice(block.data),
                b"##DZ" => {
                    let inflated = inflate(&block)?;
                    if data.is_empty() {
                        data = Cow::Owned(inflated);
                    } else {
                        data.to_mut().extend(inflated);
                    }
                }
                b"##DL" => {
                    pending.extend(block.link(0));
                    pending.extend(block.links.iter().skip(1).rev().filter(|link| **link != 0));
                }
                b"##HL" => pending.extend(block.link(0)),
                id => {
                    let name = String::from_utf8_lossy(id).into_owned();
                    contents.notices.push(format!("data in a block `{name}` are not read (at byte {at})"));
                }
            }
        }
        Ok(data)
    }
}

fn inflate(block: &MdfBlock<'_>) -> Result<Vec<u8>, Flaw> {
    let mut cursor = block.cursor();
    cursor.take(2)?;
    let kind = cursor.u8()?;
    cursor.u8()?;
    let columns = cursor.u32()? as usize;
    let (original, packed) = (cursor.size()?, cursor.size()?);
    if kind > 1 {
        return Err(Flaw::at(format!("its data are compressed in way {kind}; deflate is read"), block.at));
    }
    let packed = cursor.take(packed.min(cursor.left()))?;
    let mut inflated = Vec::new();
    let result = ZlibDecoder::new(packed).take(original as u64).read_to_end(&mut inflated);
    if let Err(error) = result {
        return Err(Flaw::at(format!("compressed data are damaged ({error})"), block.at));
    }
    let rows = inflated.len().checked_div(columns).unwrap_or(0);
    if kind == 1 && rows > 1 {
        // Bytes were stored column after column; what does not fill a row stands at the end.
        let whole = rows * columns;
        let mut plain = vec![0; whole];
        for (index, byte) in inflated[..whole].iter().enumerate() {
            plain[index % rows * columns + index / rows] = *byte;
        }
        plain.extend_from_slice(&inflated[whole..]);
        return Ok(plain);
    }
    Ok(inflated)
}

/// Records of one channel group, side by side.
#[derive(Clone)]
enum MdfRecords<'a> {
    File(&'a [u8]),
    Gathered(Arc<[u8]>),
}

impl MdfRecords<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::File(bytes) => bytes,
            Self::Gathered(bytes) => bytes,
        }
    }
}

/// A channel group's description.
struct MdfGroup<'a> {
    block: MdfBlock<'a>,
    id: u64,
    cycles: usize,
    /// True if its records have a length each, and no channels.
    variable: bool,
    data_bytes: usize,
    invalid_bytes: usize,
}

fn data_group<'a>(
    file: &mut File<'a>,
    block: &MdfBlock<'a>,
    finished: bool,
    number: &mut usize,
    contents: &mut FileContents<'a>,
) -> Result<(), Flaw> {
    let id_size = usize::from(block.cursor().u8()?);
    let mut groups: Vec<MdfGroup<'a>> = Vec::new();
    let mut next = block.link(1);
    while let Some(at) = next {
        let block = file.once(at, b"##CG")?;
        next = block.link(0);
        let mut cursor = block.cursor();
        let (id, cycles, flags) = (cursor.u64()?, cursor.size()?, cursor.u16()?);
        cursor.take(6)?;
        let (data_bytes, invalid_bytes) = (cursor.u32()? as usize, cursor.u32()? as usize);
        groups.push(MdfGroup { block, id, cycles, variable: flags & 1 != 0, data_bytes, invalid_bytes });
    }
    let data = file.data(block.link(2), contents)?;
    let mut records: HashMap<u64, MdfRecords<'a>> = HashMap::new();
    if id_size == 0 {
        if let Some(group) = groups.first() {
            let plain = match data {
                Cow::Borrowed(bytes) => MdfRecords::File(bytes),
                Cow::Owned(bytes) => MdfRecords::Gathered(bytes.into()),
            };
            records.insert(group.id, plain);
        }
    } else {
        for (id, bytes) in sort(&data, id_size, &groups)? {
            records.insert(id, MdfRecords::Gathered(bytes.into()));
        }
    }
    for group in &groups {
        *number += 1;
        if !group.variable
            && let Some(records) = records.get(&group.id)
        {
            channels(file, group, records, finished, *number, contents)?;
        }
    }
    Ok(())
}

/// Records that are mixed, by their group.
fn sort(data: &[u8], id_size: usize, groups: &[MdfGroup<'_>]) -> Result<HashMap<u64, Vec<u8>>, Flaw> {
    if !matches!(id_size, 1 | 2 | 4 | 8) {
        return Err(Flaw::new(format!("record numbers of {id_size} bytes are impossible")));
    }
    let lengths: HashMap<u64, Option<usize>> =
        groups.iter().map(|g| (g.id, (!g.variable).then(|| g.data_bytes.saturating_add(g.invalid_bytes)))).collect();
    let mut sorted: HashMap<u64, Vec<u8>> = HashMap::new();
    let mut cursor = Cursor::new(data, 0, Order::Little);
    while cursor.left() > id_size {
        let mut id = 0;
        for (place, byte) in cursor.take(id_size)?.iter().enumerate() {
            id |= u64::from(*byte) << (8 * place);
        }
        let len = match lengths.get(&id) {
            Some(Some(len)) => *len,
            Some(None) => cursor.u32()? as usize,
            None => return Err(Flaw::new(format!("a record belongs to group {id}, which is not described"))),
        };
        // The last record may be cut short.
        let Ok(record) = cursor.take(len) else { break };
        sorted.entry(id).or_default().extend_from_slice(record);
    }
    Ok(sorted)
}

/// Where a channel's values stand in each record, and how they become numbers.
#[derive(Clone)]
struct Value {
    kind: MdfNumber,
    byte: usize,
    bit: u32,
    bits: u32,
    order: Order,
    /// The bit that says that a value is invalid, from the record's first byte.
    invalid: Option<usize>,
    conversion: Conversion,
}

#[derive(Clone, Copy, PartialEq)]
enum MdfNumber {
    Unsigned,
    Signed,
    Float(Number),
    /// The record's number.
    Index,
}

impl Value {
    fn physical(&self, record: &[u8], index: usize) -> f64 {
        if let Some(bit) = self.invalid
            && record.get(bit / 8).is_some_and(|byte| byte >> (bit % 8) & 1 == 1)
        {
            return f64::NAN;
        }
        let raw = match self.kind {
            MdfNumber::Index => Some(index as f64),
            MdfNumber::Float(number) => number.get(record, self.byte, self.order),
            MdfNumber::Unsigned => self.integer(record).map(|v| v as f64),
            MdfNumber::Signed => self.integer(record).map(|v| {
                let unused = 64 - self.bits;
                ((v << unused) as i64 >> unused) as f64
            }),
        };
        raw.map_or(f64::NAN, |raw| self.conversion.physical(raw))
    }

    fn integer(&self, record: &[u8]) -> Option<u64> {
        let bytes = (self.bit + self.bits).div_ceil(8) as usize;
        let raw = record.get(self.byte..self.byte.checked_add(bytes)?)?;
        let join = |word: u64, byte: &u8| word << 8 | u64::from(*byte);
        let word = match self.order {
            Order::Little => raw.iter().rev().fold(0, join),
            Order::Big => raw.iter().fold(0, join),
        };
        Some((word >> self.bit) & (u64::MAX >> (64 - self.bits)))
    }
}

/// From raw to physical values.
#[derive(Clone, Debug)]
enum Conversion {
    None,
    Linear(f64, f64),
    Rational([f64; 6]),
    /// Pairs of raw and physical values, with interpolation or without.
    Table(Vec<(f64, f64)>, bool),
}

impl Conversion {
    fn physical(&self, x: f64) -> f64 {
        match self {
            Self::None => x,
            Self::Linear(offset, factor) => offset + factor * x,
            Self::Rational([a, b, c, d, e, f]) => (a * x * x + b * x + c) / (d * x * x + e * x + f),
            Self::Table(pairs, interpolated) => {
                let above = pairs.partition_point(|(raw, _)| *raw < x);
                match (above.checked_sub(1).map(|i| pairs[i]), pairs.get(above)) {
                    (Some((x0, y0)), Some((x1, y1))) => {
                        let share = (x - x0) / (x1 - x0);
                        if *interpolated {
                            y0 + share * (y1 - y0)
                        } else if share > 0.5 {
                            *y1
                        } else {
                            y0
                        }
                    }
                    (Some((_, last)), None) => last,
                    (None, Some((_, first))) => *first,
                    (None, None) => x,
                }
            }
        }
    }
}

/// A channel's conversion with the unit that it gives, or the kind of one that is not read.
fn conversion(file: &File<'_>, at: Option<usize>) -> Result<(Conversion, String), String> {
    let Some(at) = at else { return Ok((Conversion::None, String::new())) };
    let damaged = |flaw: Flaw| flaw.what;
    let block = file.block(at, b"##CC").map_err(damaged)?;
    let unit = file.text(block.link(1));
    let mut cursor = block.cursor();
    let kind = cursor.u8().map_err(damaged)?;
    cursor.take(5).map_err(damaged)?;
    let count = usize::from(cursor.u16().map_err(damaged)?);
    cursor.take(16).map_err(damaged)?;
    let mut values = Vec::new();
    for _ in 0..count {
        values.push(cursor.f64().map_err(damaged)?);
    }
    let conversion = match (kind, &values[..]) {
        // None, or to texts: the numbers behind them remain.
        (0 | 7.., _) => Conversion::None,
        (1, [offset, factor, ..]) => Conversion::Linear(*offset, *factor),
        (2, [a, b, c, d, e, f, ..]) => Conversion::Rational([*a, *b, *c, *d, *e, *f]),
        (4 | 5, pairs) if pairs.len() >= 2 => {
            let mut pairs: Vec<(f64, f64)> = pairs.chunks_exact(2).map(|p| (p[0], p[1])).collect();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            Conversion::Table(pairs, kind == 4)
        }
        (3, _) => return Err("a formula".into()),
        _ => return Err(format!("kind {kind}")),
    };
    Ok((conversion, unit))
}

fn channels<'a>(
    file: &mut File<'a>,
    group: &MdfGroup<'a>,
    records: &MdfRecords<'a>,
    finished: bool,
    number: usize,
    contents: &mut FileContents<'a>,
) -> Result<(), Flaw> {
    let record = group.data_bytes.saturating_add(group.invalid_bytes);
    let held = records.bytes().len().checked_div(record).unwrap_or(0);
    let said = group.cycles;
    let len = if finished { held.min(said) } else { held };
    let name = file.text(group.block.link(2));
    let own_name = if name.is_empty() { format!("group {number}") } else { name };
    if finished && held < said && record > 0 {
        contents
            .notices
            .push(format!("{own_name}: {said} samples are said to follow, the file has {held}; those were taken"));
    }
    let mut next = group.block.link(1);
    let mut left_out: Vec<String> = Vec::new();
    while let Some(at) = next {
        let block = file.once(at, b"##CN")?;
        next = block.link(0);
        let name = file.text(block.link(2));
        let mut cursor = block.cursor();
        let (kind, sync, data_type, bit) = (cursor.u8()?, cursor.u8()?, cursor.u8()?, u32::from(cursor.u8()?));
        let (byte, bits, flags, invalid) =
            (cursor.u32()? as usize, cursor.u32()?, cursor.u32()?, cursor.u32()? as usize);
        let is_index = matches!(kind, 3 | 6);
        let order = if matches!(data_type, 1 | 3 | 5) { Order::Big } else { Order::Little };
        let value_kind = match (data_type, bits) {
            _ if is_index => Some(MdfNumber::Index),
            (0 | 1, 1..=64) if bit + bits <= 64 => Some(MdfNumber::Unsigned),
            (2 | 3, 1..=64) if bit + bits <= 64 => Some(MdfNumber::Signed),
            (4 | 5, 16) => Some(MdfNumber::Float(Number::F16)),
            (4 | 5, 32) => Some(MdfNumber::Float(Number::F32)),
            (4 | 5, 64) => Some(MdfNumber::Float(Number::F64)),
            _ => None,
        };
        // Structures and arrays have parts of their own; lengths that vary hold texts.
        let plain = block.link(1).is_none() && matches!(kind, 0 | 2 | 3 | 4 | 6);
        let Some(value_kind) = value_kind.filter(|_| plain && flags & 1 == 0) else {
            left_out.push(name);
            continue;
        };
        let (conversion, converted_unit) = conversion(file, block.link(4)).unwrap_or_else(|kind| {
            let what = format!("`{name}` has a conversion ({kind}) that is not applied: its values are raw");
            contents.notices.push(what);
            (Conversion::None, String::new())
        });
        let unit = Some(file.text(block.link(6))).filter(|u| !u.is_empty()).unwrap_or(converted_unit);
        let has_invalid = flags & 2 != 0 && group.invalid_bytes > 0;
        let invalid = has_invalid.then(|| group.data_bytes.saturating_mul(8).saturating_add(invalid));
        let value = Value { kind: value_kind, byte, bit, bits: bits.max(1), order, invalid, conversion };
        let records = records.clone();
        let decode = move || {
            let chunks = records.bytes().chunks_exact(record.max(1)).take(len);
            Ok(chunks.enumerate().map(|(index, record)| value.physical(record, index)).collect())
        };
        let column = FileColumn::new(&name, &unit, len, decode);
        let column = column.in_group(own_name.clone());
        let is_time = matches!(kind, 2 | 3) && sync <= 1;
        contents.columns.push(if is_time { column.into_time() } else { column });
    }
    if !left_out.is_empty() {
        let names = crate::words::list(&left_out);
        contents.notices.push(format!("{own_name}: texts, arrays and structures were left out: {names}"));
    }
    Ok(())
}
