//! The Universal File Format: functions of dataset 58, as text and binary (58b); other datasets are passed over.
//!
//! After *Universal Dataset 58: Function at Nodal DOF* (Structural Dynamics Research Lab, University of Cincinnati). Only
//! time responses are used; their ordinate's type (displacement, velocity, acceleration, force) decides their role.

use std::sync::Arc;

use super::bytes::{Number, Order, Strided};
use super::text::text_of;
use crate::column::{FileColumn, FileContents, Flaw, TimeBase};
use crate::format::FileFormat;
use crate::heading::{ColumnKey, ColumnQuantity, Meaning};
use sindyscope_values::record::units;

pub(crate) const FORMAT: FileFormat =
    FileFormat::of_columns("Universal File Format 58", &["uff", "unv", "ufb", "bunv", "uff58"], recognises, read);

/// The first line is a delimiter, the second a dataset's number.
fn recognises(bytes: &[u8]) -> bool {
    let mut lines = UffLines { bytes: &bytes[..bytes.len().min(1000)], at: 0 };
    let first = loop {
        match lines.next() {
            Some(line) if line.trim_ascii().is_empty() => {}
            other => break other,
        }
    };
    first.is_some_and(is_delimiter) && lines.next().and_then(dataset).is_some()
}

fn is_delimiter(line: &[u8]) -> bool {
    line.trim_ascii() == b"-1" && line.starts_with(b"    ")
}

/// A dataset's number, and the rest of its line.
fn dataset(line: &[u8]) -> Option<(String, Vec<String>)> {
    let text = text_of(line);
    let mut words = text.split_whitespace().map(str::to_owned);
    let number = words.next()?;
    let digits = number.trim_end_matches(['b', 'B']);
    (!digits.is_empty() && digits.len() <= 5 && digits.bytes().all(|b| b.is_ascii_digit()))
        .then(|| (number.to_lowercase(), words.collect()))
}

/// Lines of a file that may hold bytes that are no text between them.
struct UffLines<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> UffLines<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let len = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        self.at += len + 1;
        let line = &rest[..len];
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

/// Names of the kinds of function that are no time response.
fn kind(function: i64) -> &'static str {
    match function {
        2 => "an auto-spectrum",
        3 => "a cross-spectrum",
        4 => "a frequency response",
        5 => "a transmissibility",
        6 => "a coherence",
        7 => "an autocorrelation",
        8 => "a cross-correlation",
        9 => "a power spectral density",
        12 => "a spectrum",
        _ => "another function than a time response",
    }
}

fn read(bytes: &[u8]) -> Result<FileContents<'_>, Flaw> {
    let mut contents = FileContents::default();
    let mut lines = UffLines { bytes, at: 0 };
    let mut passed: Vec<String> = Vec::new();
    let mut spectra: Vec<&'static str> = Vec::new();
    let mut found = 0;
    let mut any = false;
    while let Some(line) = lines.next() {
        if !is_delimiter(line) {
            continue;
        }
        let Some((number, rest)) = lines.next().and_then(dataset) else { continue };
        any = true;
        if number != "58" && number != "58b" {
            if !passed.contains(&number) {
                passed.push(number);
            }
            while lines.next().is_some_and(|line| !is_delimiter(line)) {}
            continue;
        }
        found += 1;
        match function(&mut lines, (number == "58b").then_some(&rest), found, &mut contents)? {
            None => {}
            Some(kind) if spectra.contains(&kind) => {}
            Some(kind) => spectra.push(kind),
        }
    }
    if !any {
        return Err(Flaw::new("no dataset begins in it (a line `    -1`, then the dataset's number)"));
    }
    if contents.columns.is_empty() {
        let sets = passed.join(", ");
        let what = match (found, spectra.first()) {
            (0, _) => format!("it holds no measured functions (dataset 58), only datasets {sets}"),
            (_, Some(kind)) => format!("its function is {kind}, not a time response"),
            _ => "its functions have no samples".into(),
        };
        return Err(
            Flaw::new(what).try_this("export the time histories: dataset 58 with function type 1 (time response)")
        );
    }
    if !spectra.is_empty() {
        contents.notices.push(format!("only time responses are used; {} was left out", spectra.join(" and ")));
    }
    number_roles(&mut contents);
    Ok(contents)
}

/// Reads one function after its dataset's number; what it is if it is no time response.
fn function<'a>(
    lines: &mut UffLines<'a>,
    binary: Option<&Vec<String>>,
    count: usize,
    contents: &mut FileContents<'a>,
) -> Result<Option<&'static str>, Flaw> {
    let begin = lines.at;
    let cut = || Flaw::at(format!("the header of function {count} is cut short"), begin);
    let mut header = Vec::new();
    for _ in 0..11 {
        header.push(text_of(lines.next().ok_or_else(cut)?));
    }
    let words = |line: usize| header[line].split_whitespace().collect::<Vec<_>>();
    let whole = |text: Option<&&str>| text.and_then(|t| t.parse::<i64>().ok());
    let real = |text: Option<&&str>| text.and_then(|t| t.replace(['D', 'd'], "e").parse::<f64>().ok());
    let kind_of = whole(words(5).first()).ok_or_else(cut)?;
    let form = words(6);
    let (data, said, spacing) = (whole(form.first()), whole(form.get(1)), whole(form.get(2)));
    let (Some(data), Some(said), Some(spacing)) = (data, said, spacing) else {
        return Err(Flaw::at(format!("the form of function {count}'s data is not given (record 7)"), begin));
    };
    let said = usize::try_from(said).map_err(|_| Flaw::at(format!("function {count} has {said} samples"), begin))?;
    let (start, interval) = (real(form.get(3)).unwrap_or(0.0), real(form.get(4)).unwrap_or(0.0));
    let (is_double, is_complex) = (matches!(data, 4 | 6), matches!(data, 5 | 6));
    if !matches!(data, 2 | 4 | 5 | 6) {
        return Err(Flaw::at(
            format!("function {count} has data of type {data}, which is none of 2, 4, 5 and 6"),
            begin,
        ));
    }
    let even = spacing == 1;
    let per_sample = usize::from(!even) + if is_complex { 2 } else { 1 };
    let needed = said.saturating_mul(per_sample);

    let raw = raw_data(lines, binary, &DataForm { number: count, begin, is_double, even, needed }, contents)?;
    if kind_of != 1 {
        return Ok(Some(kind(kind_of)));
    }
    if is_complex {
        return Ok(Some("a complex function"));
    }
    let held = raw.samples(needed, per_sample)?;
    if held < said {
        contents
            .notices
            .push(format!("function {count}'s header tells of {said} samples, the file has {held}; those were taken"));
    }
    let (_, time_unit) = axis(&header[7]);
    let (label, unit) = axis(&header[8]);
    let time_unit = if units::parse(&time_unit).is_some_and(|u| u.is_time()) { time_unit } else { "s".to_owned() };
    let base = if even {
        let second = units::parse(&time_unit).map_or(1.0, |u| u.factor);
        if !(interval.is_normal() && interval > 0.0 && start.is_finite()) {
            return Err(Flaw::at(format!("function {count} has a time step of {interval}"), begin));
        }
        TimeBase::Even { start: start * second, interval: interval * second }
    } else {
        let stamps: Arc<[f64]> = raw.read(0, per_sample, held)?.into();
        TimeBase::Stamps(stamps, time_unit)
    };
    let name = name(&header, &label);
    let decode = move || raw.read(per_sample - 1, per_sample, held);
    let mut column = FileColumn::new(&name, &unit, held, decode);
    column.base = base;
    let quantity = quantity(words(8).first().copied());
    if let Some(quantity) = quantity.filter(|_| !matches!(column.heading.meaning, Meaning::Known(_))) {
        column.heading.meaning = Meaning::Known(ColumnKey { quantity, number: None });
    }
    contents.columns.push(column);
    Ok(None)
}

/// What the header of a function says of its data.
struct DataForm {
    /// The function, counted from 1 in the file.
    number: usize,
    /// The byte where its header begins.
    begin: usize,
    is_double: bool,
    /// The samples are even: no abscissa stands beside them.
    even: bool,
    /// How many numbers there should be.
    needed: usize,
}

/// The data of a function, up to the delimiter behind them.
fn raw_data<'a>(
    lines: &mut UffLines<'a>,
    binary: Option<&Vec<String>>,
    form: &DataForm,
    contents: &mut FileContents<'a>,
) -> Result<Raw<'a>, Flaw> {
    let from = lines.at.min(lines.bytes.len());
    let Some(words) = binary else {
        let mut to = from;
        while let Some(line) = lines.next() {
            if is_delimiter(line) {
                break;
            }
            to = lines.at.min(lines.bytes.len());
        }
        return Ok(Raw::Text(&lines.bytes[from..to]));
    };
    let DataForm { number, begin, is_double, even, needed } = *form;
    let field = |index: usize| words.get(index).and_then(|w| w.parse::<usize>().ok());
    let order = if field(0) == Some(2) { Order::Big } else { Order::Little };
    if field(1).is_some_and(|form| form != 2) {
        return Err(Flaw::at(format!("function {number} is not in IEEE numbers"), begin));
    }
    let size = if is_double && even { 8 } else { 4 };
    let rest = lines.bytes.len() - from;
    let len = field(3).unwrap_or_else(|| needed.saturating_mul(size));
    if len > rest {
        contents.notices.push(format!("function {number} is cut short: {len} bytes are said to follow, {rest} do"));
    }
    let to = from + len.min(rest);
    lines.at = to;
    while lines.next().is_some_and(|line| !is_delimiter(line)) {}
    Ok(Raw::Binary { bytes: &lines.bytes[from..to], order, is_double, even })
}

/// What an ordinate of this type measures.
fn quantity(ordinate: Option<&str>) -> Option<ColumnQuantity> {
    match ordinate? {
        "8" => Some(ColumnQuantity::Displacement),
        "11" => Some(ColumnQuantity::Velocity),
        "12" => Some(ColumnQuantity::Acceleration),
        "9" | "13" => Some(ColumnQuantity::Input),
        _ => None,
    }
}

/// A function's data as they stand in the file.
#[derive(Clone, Copy)]
enum Raw<'a> {
    Text(&'a [u8]),
    Binary { bytes: &'a [u8], order: Order, is_double: bool, even: bool },
}

impl Raw<'_> {
    /// How many whole samples there are, of so many numbers in all.
    fn samples(&self, needed: usize, per_sample: usize) -> Result<usize, Flaw> {
        let numbers = match self {
            Self::Text(text) => UffNumbers { text, at: 0 }.take(needed).count(),
            // Uneven double data are pairs of a single and a double.
            Self::Binary { bytes, is_double: true, even: false, .. } => bytes.len() / 12 * 2,
            Self::Binary { bytes, is_double, .. } => bytes.len() / if *is_double { 8 } else { 4 },
        };
        Ok(numbers.min(needed) / per_sample)
    }

    /// Every number of so many a sample that has this place in it.
    fn read(&self, place: usize, per_sample: usize, count: usize) -> Result<Vec<f64>, Flaw> {
        match *self {
            Self::Text(text) => {
                let mut values = Vec::with_capacity(count);
                let numbers = UffNumbers { text, at: 0 }.skip(place).step_by(per_sample).take(count);
                for (index, word) in numbers.enumerate() {
                    let text = text_of(word).replace(['D', 'd'], "e");
                    values.push(text.parse().map_err(|_| {
                        let text: String = text.chars().take(40).collect();
                        Flaw::new(format!("sample {}: `{text}` is not a number", index + 1))
                    })?);
                }
                Ok(values)
            }
            Self::Binary { bytes, order, is_double, even } => {
                let number = if is_double && (even || place > 0) { Number::F64 } else { Number::F32 };
                let stride = match (is_double, even) {
                    (true, true) => 8,
                    (true, false) => 12,
                    (false, _) => 4 * per_sample,
                };
                Strided { start: 4 * place, stride, count, number, order }.read(bytes)
            }
        }
    }
}

/// Numbers as Fortran writes them: between blanks, or side by side where they fill their columns.
struct UffNumbers<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Iterator for UffNumbers<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.text.get(self.at..)?;
        let begin = self.at + rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let mut end = begin + 1;
        while let Some(byte) = self.text.get(end) {
            let sign = matches!(byte, b'-' | b'+') && !matches!(self.text[end - 1], b'e' | b'E' | b'd' | b'D');
            if byte.is_ascii_whitespace() || sign {
                break;
            }
            end += 1;
        }
        self.at = end;
        Some(&self.text[begin..end])
    }
}

/// An axis's label and unit, which stand in fixed columns.
fn axis(record: &str) -> (String, String) {
    let part = |from: usize| {
        let text: String = record.chars().skip(from).take(20).collect();
        let text = text.trim();
        if text.eq_ignore_ascii_case("none") { String::new() } else { text.to_owned() }
    };
    (part(26), part(47))
}

/// A function's name: its identification, or the place it was measured at.
fn name(header: &[String], label: &str) -> String {
    let given = |text: &str| Some(text.trim().to_owned()).filter(|t| !t.is_empty() && !t.eq_ignore_ascii_case("none"));
    if let Some(name) = given(&header[0]) {
        return name;
    }
    let place: String = header[5].chars().skip(31).take(10).collect();
    if let Some(name) = given(&place) {
        return name;
    }
    let rest: String = header[5].chars().skip(41).take(14).collect();
    let mut degrees = rest.split_whitespace().filter_map(|w| w.parse::<i64>().ok());
    let label = given(label).unwrap_or_else(|| "function".into());
    match (degrees.next(), degrees.next()) {
        (Some(node), Some(direction)) if node != 0 => format!("{label} {node}:{direction}"),
        _ => label,
    }
}

/// Numbers the functions of one kind, where there are several.
fn number_roles(contents: &mut FileContents<'_>) {
    let quantities =
        [ColumnQuantity::Displacement, ColumnQuantity::Velocity, ColumnQuantity::Acceleration, ColumnQuantity::Input];
    for quantity in quantities {
        let of_kind = |meaning: &Meaning| *meaning == Meaning::Known(ColumnKey { quantity, number: None });
        let alike = contents.columns.iter_mut().filter(|c| of_kind(&c.heading.meaning));
        let alike: Vec<&mut FileColumn<'_>> = alike.collect();
        if alike.len() > 1 {
            for (index, column) in alike.into_iter().enumerate() {
                column.heading.meaning = Meaning::Known(ColumnKey { quantity, number: Some(index + 1) });
            }
        }
    }
}
