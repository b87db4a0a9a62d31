//! Rows of text that arrive one after another, as a growing file, a line or a network brings them.

use super::assemble::{Seconds, channel, convert, time_unit};
use super::error::{ReadError, ReadProblem};
use super::formats::text::{Header, TextHead, TextRows, decode, is_missing, number};
use super::heading::Heading;
use super::options::ReadOptions;
use super::selection::{self, Selection};
use super::table::{ColumnTable, LARGEST};
use sindyscope_values::record::Channel;

/// Bytes among which the header must end.
const HEAD_BYTES: usize = 1 << 18;

/// Reads rows of text as they arrive. Header, units and separators are those of files of text; a line that has not ended yet
/// waits for the rest of it.
///
/// ```
/// use sindyscope_files::{ArrivingRows, ArrivedRow, ReadOptions};
///
/// let mut rows = ArrivingRows::new("bench", ReadOptions::default());
/// let mut arrived = Vec::new();
/// rows.take(b"time [ms],x [mm]\n0,1.5\n10,1.", &mut arrived)?;
/// rows.take(b"25\n", &mut arrived)?;
/// assert_eq!(arrived[1], ArrivedRow::Sample { time: Some(0.01), values: vec![1.25] });
/// assert_eq!(rows.channels().expect("the header has come")[0].unit, "mm");
/// # Ok::<(), sindyscope_files::ReadError>(())
/// ```
#[derive(Debug)]
pub struct ArrivingRows {
    name: String,
    options: ReadOptions,
    /// What came and was not read yet: the head until it is whole, then the line that has not ended.
    pending: Vec<u8>,
    head: Option<ArrivingColumns>,
}

/// What a line says.
#[derive(Clone, Debug, PartialEq)]
pub enum ArrivedRow {
    /// A sample: its time, s, if there is a column of it, and a value of each channel; not a number where it is missing.
    Sample {
        /// Time of the sample, s.
        time: Option<f64>,
        /// One value a channel, in its unit.
        values: Vec<f64>,
    },
    /// Names of columns, or another record's first row follows: whatever writes the rows has begun anew.
    Anew,
    /// Neither: what stands there.
    Unreadable(String),
}

/// What the header says of the columns.
#[derive(Debug)]
struct ArrivingColumns {
    separator: u8,
    count: usize,
    selection: Selection,
    second: Seconds,
    /// By what each channel is multiplied to be in its unit.
    factors: Vec<f64>,
    channels: Vec<Channel>,
    /// The label of the record that the last row belongs to.
    record: Vec<u8>,
    notices: Vec<String>,
}

impl ArrivingRows {
    /// Rows of a source that messages call by `name`.
    pub fn new(name: &str, options: ReadOptions) -> Self {
        Self { name: name.to_owned(), options, pending: Vec::new(), head: None }
    }

    /// What is measured, without samples, once the header has come.
    pub fn channels(&self) -> Option<&[Channel]> {
        self.head.as_ref().map(|head| head.channels.as_slice())
    }

    /// What was found and done while the header was read, one sentence each.
    pub fn notices(&self) -> &[String] {
        self.head.as_ref().map_or(&[], |head| &head.notices)
    }

    /// The source begins anew: a line that never ended is given up.
    pub fn begin_anew(&mut self) {
        if self.head.is_some() {
            self.pending.clear();
        }
    }

    /// Takes what has arrived, and adds the rows that are whole.
    ///
    /// # Errors
    /// The header cannot be used: what is which, and what would help.
    pub fn take(&mut self, bytes: &[u8], rows: &mut Vec<ArrivedRow>) -> Result<(), ReadError> {
        self.pending.extend_from_slice(bytes);
        let Some(end) = self.pending.iter().rposition(|b| *b == b'\n').map(|i| i + 1) else {
            return if self.pending.len() > HEAD_BYTES { Err(self.refuse(ReadProblem::NotText)) } else { Ok(()) };
        };
        let mut from = 0;
        if self.head.is_none() {
            let Some((head, after)) = self.find_head(end)? else { return Ok(()) };
            (self.head, from) = (Some(head), after);
        }
        if let Some(head) = &mut self.head {
            match decode(&self.pending[from..end]) {
                Some(text) => head.read(&text, rows),
                None => rows.push(ArrivedRow::Unreadable("bytes that are no text".into())),
            }
        }
        self.pending.drain(..end);
        Ok(())
    }

    fn refuse(&self, problem: ReadProblem) -> ReadError {
        ReadError::new(&self.name, problem)
    }

    /// The header, once a row of numbers stands below it, and the byte after it.
    fn find_head(&self, end: usize) -> Result<Option<(ArrivingColumns, usize)>, ReadError> {
        let bytes = &self.pending[..end];
        let whole = bytes.len() >= HEAD_BYTES;
        let Some(head) = TextHead::new(bytes) else { return Err(self.refuse(ReadProblem::NotText)) };
        let text = head.text(bytes);
        // Text in another encoding, whose bytes would be others, is not what loggers send.
        let shifted = bytes.len() - text.len().min(bytes.len());
        let choose = |headings: &[Heading]| selection::assign(&self.name, headings, &self.options);
        let header = match head.header(&self.name, text, &choose) {
            Ok(header) => header,
            Err(error) if *error.problem == ReadProblem::Empty && !whole => return Ok(None),
            Err(error) => return Err(error),
        };
        let mut below = TextRows::new(text, header.end, header.separator);
        let numbers = below.advance() && (0..below.len()).any(|c| number(below.cell(c)).is_some());
        if !numbers && !whole {
            return Ok(None);
        }
        let after = header.end + shifted;
        Ok(Some((self.columns(header)?, after)))
    }

    fn columns(&self, header: Header) -> Result<ArrivingColumns, ReadError> {
        let Header { separator, headings, mut notices, .. } = header;
        let mut selection = selection::assign(&self.name, &headings, &self.options)?;
        notices.append(&mut selection.notices);
        // Converting ones gives the factors.
        let mut table = ColumnTable {
            selection: selection.clone(),
            stamps: Vec::new(),
            channels: vec![vec![1.0]; selection.channels.len()],
            trajectories: Vec::new(),
            labels: Vec::new(),
            rows: Vec::new(),
            by_sample: false,
            notices: Vec::new(),
            headings,
        };
        let second = time_unit(&self.name, &table, &mut notices)?;
        let units = convert(&mut table, &mut notices);
        let channels = selection
            .channels
            .iter()
            .zip(&units)
            .map(|((role, column), unit)| channel(&table.headings[*column], *role, unit, Vec::new()));
        Ok(ArrivingColumns {
            separator,
            count: table.headings.len(),
            channels: channels.collect(),
            factors: table.channels.iter().map(|ones| ones[0]).collect(),
            second,
            selection,
            record: Vec::new(),
            notices,
        })
    }
}

impl ArrivingColumns {
    fn read(&mut self, text: &[u8], rows: &mut Vec<ArrivedRow>) {
        let mut lines = TextRows::new(text, 0, self.separator);
        while lines.advance() {
            if let Some(column) = self.selection.trajectory
                && lines.cell(column) != self.record
            {
                if !self.record.is_empty() {
                    rows.push(ArrivedRow::Anew);
                }
                self.record = lines.cell(column).to_vec();
            }
            rows.push(self.row(&lines));
        }
    }

    fn row(&self, line: &TextRows<'_>) -> ArrivedRow {
        let value = |column: usize| match line.cell(column) {
            cell if is_missing(cell) => Some(f64::NAN),
            cell => number(cell).filter(|v| v.abs() <= LARGEST),
        };
        let time = self.selection.time.map(|column| value(column).filter(|t| t.is_finite()));
        let values: Option<Vec<f64>> = (self.selection.channels.iter().zip(&self.factors))
            .map(|((_, column), factor)| value(*column).map(|v| v * factor))
            .collect();
        let surplus = (self.count..line.len()).any(|c| !line.cell(c).is_empty());
        let needed = self.selection.channels.iter().map(|(_, c)| *c).chain(self.selection.time).max().unwrap_or(0);
        match (time, values) {
            (Some(None), _) | (_, None) => {}
            (time, Some(values)) if !surplus && line.len() > needed => {
                return ArrivedRow::Sample { time: time.flatten().map(|t| self.second.seconds(t)), values };
            }
            _ => {}
        }
        let names = line.len() == self.count && (0..line.len()).all(|c| number(line.cell(c)).is_none());
        if names { ArrivedRow::Anew } else { ArrivedRow::Unreadable(line.texts().join(" ")) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_values::record::Role;

    fn read(pieces: &[&str], options: ReadOptions) -> Result<(ArrivingRows, Vec<ArrivedRow>), ReadError> {
        let mut reader = ArrivingRows::new("bench", options);
        let mut rows = Vec::new();
        for piece in pieces {
            reader.take(piece.as_bytes(), &mut rows)?;
        }
        Ok((reader, rows))
    }

    fn sample(time: f64, values: &[f64]) -> ArrivedRow {
        ArrivedRow::Sample { time: Some(time), values: values.to_vec() }
    }

    const TEXT: &str = "# bench 3\nt [ms];x [mm];u [m]\n0;1,5;0,002\n10;-2;0,004\n20;;0,1\n";

    #[test]
    fn any_pieces_give_the_same_rows_and_units_as_the_file_would() {
        let (reader, whole) = read(&[TEXT], ReadOptions::default()).unwrap();
        assert_eq!(whole[..2], [sample(0.0, &[1.5, 2.0]), sample(0.01, &[-2.0, 4.0])]);
        assert!(matches!(&whole[2], ArrivedRow::Sample { values, .. } if values[0].is_nan() && values[1] == 100.0));
        let channels: Vec<(Role, &str)> = reader.channels().unwrap().iter().map(|c| (c.role, &*c.unit)).collect();
        assert_eq!(channels, [(Role::Displacement(0), "mm"), (Role::Input(0), "mm")]);
        assert!(reader.notices().iter().any(|n| n.contains("converted")), "{:?}", reader.notices());
        for size in [1, 2, 3, 7, 20] {
            let pieces: Vec<String> =
                TEXT.as_bytes().chunks(size).map(|c| String::from_utf8(c.to_vec()).unwrap()).collect();
            let pieces: Vec<&str> = pieces.iter().map(String::as_str).collect();
            let (_, rows) = read(&pieces, ReadOptions::default()).unwrap();
            assert_eq!(format!("{rows:?}"), format!("{whole:?}"), "{size}");
        }
    }

    #[test]
    fn a_header_that_comes_again_and_a_line_that_is_none_are_told() {
        let text = "t,x\n0,1\n1,2\n2,oops\n3\nt,x\n0,5\n";
        let (_, rows) = read(&[text], ReadOptions::default()).unwrap();
        assert!(matches!(&rows[2], ArrivedRow::Unreadable(what) if what == "2 oops"), "{rows:?}");
        assert!(matches!(&rows[3], ArrivedRow::Unreadable(_)), "{rows:?}");
        assert_eq!(rows[4..], [ArrivedRow::Anew, sample(0.0, &[5.0])]);
        let (_, rows) = read(&["run,t,x\na,0,1\na,1,2\nb,0,1\n"], ReadOptions::default()).unwrap();
        assert_eq!(rows[2..], [ArrivedRow::Anew, sample(0.0, &[1.0])]);
    }

    #[test]
    fn a_header_waits_for_its_first_row_and_is_refused_as_that_of_a_file() {
        let (reader, rows) = read(&["t,x\n"], ReadOptions::default()).unwrap();
        assert!(reader.channels().is_none() && rows.is_empty());
        let error = read(&["t,y\n0,1\n"], ReadOptions::default()).expect_err("no displacement");
        assert!(matches!(*error.problem, ReadProblem::NoDisplacement { .. }), "{error}");
        let named = ReadOptions { columns: "x=2,t=1".parse().unwrap(), ..ReadOptions::default() };
        let (_, rows) = read(&["0 1\n", "0.5 2\n"], named).unwrap();
        assert_eq!(rows, [sample(0.0, &[1.0]), sample(0.5, &[2.0])]);
    }
}
