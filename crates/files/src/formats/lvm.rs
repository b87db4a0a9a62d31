//! `LabVIEW`'s measurement text, `.lvm`.
//!
//! After *Specification for the `LabVIEW` Measurement File (.lvm)*. A file is a header, then one block a segment: a header of
//! its own, a row of names, rows of numbers. Where the step of the time column is not that of the header, the column counts.

use std::sync::Arc;

use super::text::{number, text_of};
use crate::column::{FileColumn, FileContents, Flaw, TimeBase};
use crate::format::FileFormat;
use crate::heading::{ColumnKey, ColumnQuantity, Heading, Meaning};
use sindyscope_core::sampling::significant;
use sindyscope_values::record::units;

pub(crate) const FORMAT: FileFormat = FileFormat::of_columns(
    "LabVIEW measurement",
    &["lvm"],
    |bytes| bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).starts_with(MAGIC),
    read,
);

const MAGIC: &[u8] = b"LabVIEW Measurement";
const END: &[u8] = b"***End_of_Header***";

/// A header's step that is further off the time column's than this share is wrong.
const STEP_DOUBT: f64 = 1e-2;

/// More columns than this are no measurement.
const MOST_COLUMNS: usize = 10_000;

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if !bytes.starts_with(MAGIC) {
        return Err(Flaw::new("its first line is not `LabVIEW Measurement`")
            .try_this("if it is a table of numbers, give its name the ending .txt or .csv"));
    }
    let head = &bytes[..bytes.len().min(2000)];
    let comma = head.windows(15).any(|w| w.eq_ignore_ascii_case(b"Separator,Comma"));
    let separator = if comma { b',' } else { b'\t' };
    let mut contents = FileContents::default();
    let mut entries: Vec<(String, Vec<String>)> = Vec::new();
    let mut own_headers = 0;
    let mut segments: Vec<LvmSegment> = Vec::new();
    let mut names: Option<Vec<String>> = None;
    let mut has_names = false;
    for (index, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let blank = line.iter().all(|b| *b == separator || b.is_ascii_whitespace());
        if line.starts_with(END) {
            own_headers += 1;
            // The first header is that of the file.
            has_names = own_headers < 2;
            names = None;
        } else if blank {
            // A segment ends with an empty line.
            if names.is_some() && has_names {
                (names, has_names, own_headers) = (None, true, 1);
                entries.retain(|(key, _)| FILE_KEYS.contains(&key.as_str()));
            }
        } else if own_headers < 2 {
            let mut cells = line.split(|b| *b == separator).map(|cell| text_of(cell).trim().to_owned());
            let key = cells.next().unwrap_or_default();
            entries.push((key, cells.collect()));
        } else if names.is_none() {
            let cells: Vec<String> = line.split(|b| *b == separator).map(|c| text_of(c).trim().to_owned()).collect();
            if cells.len() > MOST_COLUMNS {
                return Err(Flaw::new(format!("line {} has {} columns", index + 1, cells.len())));
            }
            segments.push(LvmSegment::new(&entries, &cells));
            (names, has_names) = (Some(cells), true);
        } else if let Some(segment) = segments.last_mut() {
            segment.add_row(line, separator, index + 1)?;
        }
    }
    segments.retain(|s| s.columns.first().is_some_and(|c| !c.values.is_empty()));
    if segments.is_empty() {
        return Err(Flaw::new("no rows of numbers follow its headers: it is cut short"));
    }
    let several = segments.len() > 1;
    for (index, segment) in segments.into_iter().enumerate() {
        let group = if several { format!("segment {}", index + 1) } else { String::new() };
        segment.add_to(&mut contents, &group);
    }
    Ok(contents)
}

/// Keys that stand in the file's header and count for every segment.
const FILE_KEYS: &[&str] = &["Separator", "Decimal_Separator", "Multi_Headings", "X_Columns", "Time_Pref"];

/// One column of a segment.
struct SegmentColumn {
    name: String,
    unit: String,
    start: f64,
    interval: Option<f64>,
    is_x: bool,
    values: Vec<f64>,
}

struct LvmSegment {
    columns: Vec<SegmentColumn>,
}

impl LvmSegment {
    fn new(entries: &[(String, Vec<String>)], names: &[String]) -> Self {
        let entry = |key: &str| entries.iter().rev().find(|(k, _)| k == key).map(|(_, cells)| cells.as_slice());
        let setting = |key: &str| entry(key).and_then(<[String]>::first).map_or("", String::as_str);
        let (multi, none) = (setting("X_Columns") == "Multi", setting("X_Columns") == "No");
        let mut names = names;
        while names.last().is_some_and(|n| n.is_empty() || n == "Comment") {
            names = &names[..names.len() - 1];
        }
        let mut columns = Vec::new();
        for (column, name) in names.iter().enumerate() {
            let is_x = name == "X_Value" || (column == 0 && !none && !multi);
            // Without time columns the first cell of every row is empty.
            if column == 0 && none {
                continue;
            }
            // Each list of the header begins behind its key; with one time column in front its cells stand under the channels,
            // with several each stands under its channel's own time column.
            let cell = if multi { column & !1 } else { column.saturating_sub(1) };
            let of = |key: &str| entry(key).and_then(|cells| cells.get(cell)).map_or("", String::as_str);
            let value = |key: &str| number(of(key).as_bytes()).filter(|v| v.is_finite());
            columns.push(SegmentColumn {
                name: name.clone(),
                unit: of("Y_Unit_Label").to_owned(),
                start: value("X0").unwrap_or(0.0),
                interval: value("Delta_X").filter(|step| *step > 0.0),
                is_x,
                values: Vec::new(),
            });
        }
        Self { columns }
    }

    fn add_row(&mut self, line: &[u8], separator: u8, number_of_line: usize) -> Result<(), Flaw> {
        let mut cells = line.split(|b| *b == separator);
        if self.columns.first().is_some_and(|c| !c.is_x) {
            cells.next();
        }
        for column in &mut self.columns {
            let cell = cells.next().unwrap_or_default().trim_ascii();
            let value = if cell.is_empty() { Some(f64::NAN) } else { number(cell) };
            column.values.push(value.ok_or_else(|| {
                let text: String = text_of(cell).chars().take(40).collect();
                Flaw::new(format!("line {number_of_line}, column `{}`: `{text}` is not a number", column.name))
            })?);
        }
        Ok(())
    }

    fn add_to(self, contents: &mut FileContents<'_>, group: &str) {
        let Self { mut columns } = self;
        // A unit of time on every channel is the template's, not the sensors'.
        let channels: Vec<&SegmentColumn> = columns.iter().filter(|c| !c.is_x).collect();
        let is_time = |unit: &str| units::parse(unit).is_some_and(|u| u.is_time());
        if channels.len() > 1 && channels.iter().all(|c| is_time(&c.unit)) {
            let unit = channels[0].unit.clone();
            contents
                .notices
                .push(format!("the header gives every channel the unit {unit}; only the time column has it"));
            for column in &mut columns {
                column.unit.clear();
            }
        }
        let xs: Vec<usize> = (0..columns.len()).filter(|c| columns[*c].is_x).collect();
        let own_time = columns.iter().position(|c| !c.is_x && is_named_time(&c.name));
        let mut bases: Vec<TimeBase> = Vec::new();
        let mut told = false;
        for (index, column) in columns.iter().enumerate() {
            let clock = xs.iter().rev().find(|x| **x <= index).copied().or(own_time);
            let stamps = clock.filter(|c| columns[*c].values.iter().any(|v| !v.is_nan()));
            bases.push(match (stamps, column.interval) {
                (Some(clock), said) => {
                    let step = median_step(&columns[clock].values);
                    if let Some((said, step)) = said.zip(step)
                        && !told
                        && !column.is_x
                        && Some(index) != own_time
                        && (said / step - 1.0).abs() > STEP_DOUBT
                    {
                        told = true;
                        contents.notices.push(format!(
                            "the header gives a time step (Delta_X) of {} s, but column `{}` advances by {} s; the column counts",
                            significant(said, 6),
                            columns[clock].name,
                            significant(step, 6),
                        ));
                    }
                    TimeBase::Unknown
                }
                (None, Some(interval)) => TimeBase::Even { start: column.start, interval },
                (None, None) => TimeBase::Unknown,
            });
        }
        let clocks: Vec<Option<Arc<[f64]>>> = xs.iter().map(|x| Some(columns[*x].values.as_slice().into())).collect();
        let one_clock = clocks.windows(2).all(|pair| same_stamps(&pair[0], &pair[1]));
        for (index, (column, base)) in columns.into_iter().zip(bases).enumerate() {
            let SegmentColumn { name, unit, values, is_x, .. } = column;
            // Time columns that agree are one.
            if is_x && (xs.first() != Some(&index) || !one_clock) {
                continue;
            }
            let base = match xs.iter().rposition(|x| *x <= index) {
                Some(clock) if !one_clock => {
                    clocks[clock].clone().map_or(TimeBase::Unknown, |stamps| TimeBase::Stamps(stamps, "s".into()))
                }
                _ => base,
            };
            let len = values.len();
            let unit = if is_x || Some(index) == own_time { "s" } else { unit.as_str() };
            let column = FileColumn::new(&name, unit, len, move || Ok(values.clone()));
            let column = FileColumn { base, group: group.to_owned(), ..column };
            contents.columns.push(if is_x { column.into_time() } else { column });
        }
    }
}

fn is_named_time(name: &str) -> bool {
    matches!(Heading::new(name, None).meaning, Meaning::Known(ColumnKey { quantity: ColumnQuantity::Time, .. }))
}

/// True if two time columns say the same, where both say anything.
fn same_stamps(one: &Option<Arc<[f64]>>, two: &Option<Arc<[f64]>>) -> bool {
    let (Some(one), Some(two)) = (one, two) else { return true };
    one.iter().zip(two.iter()).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}

fn median_step(stamps: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = stamps.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0.0).collect();
    let middle = steps.len() / 2;
    (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}
