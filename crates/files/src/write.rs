//! Records to CSV, so that reading gives the same records again.

use std::io::{self, Write};

use super::heading::{ColumnQuantity, Heading, Meaning};
use sindyscope_values::record::{Channel, Record, Role};

/// Writes records as CSV: comment lines, a header with units, one row a sample; with a column `record` if there are several.
/// Estimated channels are left out: reading estimates them again.
///
/// Values are written with as few digits as bring them back to the bit. A channel keeps its name where the name tells what
/// it measures; else its role's symbol (`x`, `u2`) stands before it.
///
/// # Errors
/// What the writer says; no record; records whose channels or units differ.
pub fn write_csv<'a>(
    records: impl IntoIterator<Item = &'a Record>,
    out: &mut impl Write,
    comments: &[String],
) -> io::Result<()> {
    let records: Vec<&Record> = records.into_iter().collect();
    let refuse = |reason: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
    let Some(first) = records.first() else { return refuse("there is no record to write") };
    let likeness = |r: &Record| r.measured().map(|c| (c.role, c.unit.clone())).collect::<Vec<_>>();
    if records.iter().any(|r| likeness(r) != likeness(first)) {
        return refuse("records of different channels or units do not fit in one file");
    }
    for line in comments.iter().flat_map(|c| c.lines()) {
        writeln!(out, "# {line}")?;
    }
    let mut csv = csv::WriterBuilder::new().comment(Some(b'#')).from_writer(out);
    csv.write_field("t [s]")?;
    for channel in first.measured() {
        let several = first.measured().filter(|c| c.role.symbol() == channel.role.symbol()).count() > 1;
        csv.write_field(heading(channel, several))?;
    }
    if records.len() > 1 {
        csv.write_field("record")?;
    }
    csv.write_record(None::<&[u8]>)?;
    let mut cell = Vec::new();
    for (number, record) in records.iter().enumerate() {
        let decimals = decimals(record.start).zip(decimals(record.interval)).map(|(s, i)| s.max(i));
        let name = match clean(&record.name) {
            name if name.is_empty() => (number + 1).to_string(),
            name => name,
        };
        for sample in 0..record.len() {
            cell.clear();
            match decimals {
                Some(d) => write!(cell, "{:.d$}", record.time(sample))?,
                None => write!(cell, "{:?}", record.time(sample))?,
            }
            csv.write_field(&cell)?;
            for channel in record.measured() {
                cell.clear();
                write!(cell, "{:?}", channel.values[sample])?;
                csv.write_field(&cell)?;
            }
            if records.len() > 1 {
                csv.write_field(&name)?;
            }
            csv.write_record(None::<&[u8]>)?;
        }
    }
    csv.flush()
}

/// A header that reads back as the channel's role: its own name if that does, else with the role's symbol before it.
fn heading(channel: &Channel, several: bool) -> String {
    let symbol = channel.role.symbol();
    let short = if several { format!("{symbol}{}", channel.role.index() + 1) } else { symbol.to_owned() };
    let (name, unit) = (clean(&channel.name), clean(&channel.unit).replace(['[', ']'], ""));
    let with_unit = |name: &str| if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") };
    let candidates = [with_unit(&name), with_unit(&format!("{short} {name}")), with_unit(&short)];
    candidates.into_iter().find(|text| reads_back(text, channel.role, &unit, several)).unwrap_or(short)
}

fn reads_back(text: &str, role: Role, unit: &str, several: bool) -> bool {
    let heading = Heading::new(text, None);
    let Meaning::Known(key) = heading.meaning else { return false };
    let quantity = match role {
        Role::Displacement(_) => ColumnQuantity::Displacement,
        Role::Velocity(_) => ColumnQuantity::Velocity,
        Role::Acceleration(_) => ColumnQuantity::Acceleration,
        Role::Input(_) => ColumnQuantity::Input,
    };
    let number = if several { Some(role.index() + 1) } else { None };
    key.quantity == quantity && key.number == number && heading.unit == unit
}

/// A text without line ends and other control characters.
fn clean(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>().trim().to_owned()
}

/// Decimals of a time that is short in decimal; none if it is not.
fn decimals(time: f64) -> Option<usize> {
    const MOST: usize = 12;
    let text = format!("{time}");
    let count = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    (count <= MOST).then_some(count)
}
