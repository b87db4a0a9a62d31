//! Which columns of a file can stand in one record, and how the chosen ones become a table.
//!
//! Columns that share a group, a length and a time base make a sheet.

use super::column::{FileColumn, FileContents, Flaw, TimeBase};
use super::error::{ReadError, ReadProblem, RowPlace};
use super::heading::{ColumnKey, ColumnQuantity, Heading, Meaning, label};
use super::selection::Selection;
use super::table::{Choose, ColumnTable, FIRST_ROWS, LARGEST, TableHead};
use super::words::list;
use sindyscope_values::record::units;

/// Columns that can stand in one record.
struct ColumnSheet<'c, 'a> {
    group: &'c str,
    base: &'c TimeBase,
    len: usize,
    columns: Vec<&'c FileColumn<'a>>,
    headings: Vec<Heading>,
}

impl ColumnSheet<'_, '_> {
    /// True if the last heading is that of the time base, which is no column of the file.
    fn has_base(&self) -> bool {
        self.headings.len() > self.columns.len()
    }

    fn decode(&self, column: usize) -> Result<Vec<f64>, Flaw> {
        let mut values = match (self.columns.get(column), self.base) {
            (Some(column), _) => (column.decode)()?,
            (None, TimeBase::Even { start, interval }) => (0..self.len).map(|k| start + interval * k as f64).collect(),
            (None, TimeBase::Stamps(stamps, _)) => stamps.to_vec(),
            (None, TimeBase::Unknown) => Vec::new(),
        };
        if values.len() < self.len {
            let name = label(&self.headings, column);
            return Err(Flaw::new(format!("column `{name}` has {} values instead of {}", values.len(), self.len)));
        }
        values.truncate(self.len);
        Ok(values)
    }
}

/// Names by which files call a sampling rate or interval that stands among their variables.
const RATES: &[&str] = &["fs", "fsamp", "rate", "samplerate", "samplingrate", "samplingfrequency", "sr"];
const INTERVALS: &[&str] = &["dt", "ts", "tsamp", "deltat", "interval", "sampletime", "samplingtime"];

/// A lone number that tells the sampling of all columns without a time base.
fn sampling_variable(columns: &[FileColumn<'_>]) -> Option<(f64, String)> {
    columns.iter().filter(|c| c.len == 1).find_map(|column| {
        let plain: String =
            column.heading.stem.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
        let known = |names: &[&str]| names.contains(&plain.as_str());
        if !(known(RATES) || known(INTERVALS)) {
            return None;
        }
        let value = *(column.decode)().ok()?.first()?;
        let interval = if known(RATES) { value.recip() } else { value };
        let scale = units::parse(&column.heading.unit).filter(|u| u.is_time() || u.is_frequency());
        let interval = match scale {
            Some(unit) if unit.is_frequency() => interval / unit.factor,
            Some(unit) => interval * unit.factor,
            None => interval,
        };
        (interval.is_normal() && interval > 0.0).then(|| (interval, column.heading.name.clone()))
    })
}

fn sheets<'c, 'a>(columns: &'c [FileColumn<'a>], known: Option<&'c TimeBase>) -> Vec<ColumnSheet<'c, 'a>> {
    let mut sheets: Vec<ColumnSheet<'c, 'a>> = Vec::new();
    for column in columns.iter().filter(|c| c.len > 1) {
        let base = known.filter(|_| column.base == TimeBase::Unknown).unwrap_or(&column.base);
        let same = |sheet: &&mut ColumnSheet<'_, '_>| {
            sheet.group == column.group && sheet.len == column.len && sheet.base == base
        };
        match sheets.iter_mut().find(same) {
            Some(sheet) => sheet.columns.push(column),
            None => {
                let (group, len, columns) = (column.group.as_str(), column.len, vec![column]);
                sheets.push(ColumnSheet { group, base, len, columns, headings: Vec::new() });
            }
        }
    }
    for sheet in &mut sheets {
        sheet.headings = sheet.columns.iter().map(|c| c.heading.clone()).collect();
        let unit = match sheet.base {
            TimeBase::Unknown => continue,
            TimeBase::Even { .. } => "s",
            TimeBase::Stamps(_, unit) => unit,
        };
        if !sheet.columns.iter().any(|c| c.is_time()) {
            let mut time = Heading::new("time", Some(unit));
            time.meaning = Meaning::Known(ColumnKey { quantity: ColumnQuantity::Time, number: None });
            sheet.headings.push(time);
        }
    }
    sheets
}

/// Values that are decoded at most to show the first ones: a column is decoded whole.
const LOOKED_AT: usize = 4_000_000;

/// The tables of a file, before any column is chosen.
pub(super) fn heads(contents: &FileContents<'_>) -> Vec<TableHead> {
    let told = sampling_variable(&contents.columns);
    let known = told.map(|(interval, _)| TimeBase::Even { start: 0.0, interval });
    let mut left = LOOKED_AT;
    let mut heads = Vec::new();
    for sheet in sheets(&contents.columns, known.as_ref()) {
        let mut first = Vec::new();
        for column in 0..sheet.headings.len() {
            let decoded = if sheet.len <= left { sheet.decode(column).ok() } else { None };
            left = left.saturating_sub(sheet.len);
            let mut values = decoded.unwrap_or_default();
            values.truncate(FIRST_ROWS);
            first.push(values);
        }
        let rate = match sheet.base {
            TimeBase::Even { interval, .. } if sheet.has_base() => Some(interval.recip()),
            _ => None,
        };
        let ColumnSheet { group, len: rows, headings, .. } = sheet;
        heads.push(TableHead { name: group.to_owned(), headings, rows, rate, first });
    }
    heads
}

/// Chooses the columns that are wanted and decodes them.
///
/// Sheets that measure the same quantities are records of one file; other sheets are left out, with a notice.
pub(super) fn table(
    file: &str,
    format: &'static str,
    contents: FileContents<'_>,
    choose: &Choose<'_>,
) -> Result<ColumnTable, ReadError> {
    let FileContents { columns, mut notices } = contents;
    let told = sampling_variable(&columns);
    let known = told.as_ref().map(|(interval, _)| TimeBase::Even { start: 0.0, interval: *interval });
    let sheets = sheets(&columns, known.as_ref());
    if sheets.is_empty() {
        let names: Vec<&str> = columns.iter().map(|c| c.heading.name.as_str()).collect();
        let held = if names.is_empty() { String::new() } else { format!(" (there is {})", list(&names)) };
        let mut what = format!("it holds no columns of numbers{held}");
        for notice in notices {
            what += &format!("; {notice}");
        }
        return Err(Flaw::new(what).try_this(NO_COLUMNS).in_file(file, format));
    }
    let chosen: Vec<Result<Selection, ReadError>> = sheets.iter().map(|s| choose(&s.headings)).collect();
    let Some(first) = chosen.iter().position(Result::is_ok) else {
        return Err(no_sheet(&sheets, chosen));
    };
    let selected: Vec<(&ColumnSheet<'_, '_>, &Selection)> =
        sheets.iter().zip(&chosen).filter_map(|(sheet, selection)| Some((sheet, selection.as_ref().ok()?))).collect();
    let (leading, selection) = selected[0];
    let alike = |(sheet, other): &(&ColumnSheet<'_, '_>, &Selection)| {
        sheet.headings == leading.headings && other.channels == selection.channels && other.trajectory.is_none()
    };
    let runs: Vec<&ColumnSheet<'_, '_>> = if selection.trajectory.is_none() {
        selected.iter().copied().filter(alike).map(|(s, _)| s).collect()
    } else {
        vec![leading]
    };
    let used = |sheet: &ColumnSheet<'_, '_>| runs.iter().any(|run| std::ptr::eq(*run, sheet));
    let unused: Vec<&str> =
        sheets.iter().filter(|s| !used(s)).flat_map(|s| s.columns.iter().map(|c| c.heading.name.as_str())).collect();
    if !unused.is_empty() {
        notices.push(format!("columns of another length, sampling or group were left out: {}", list(&unused)));
    }
    if leading.has_base()
        && selection.time == Some(leading.columns.len())
        && let Some((interval, name)) = told.filter(|_| Some(leading.base) == known.as_ref())
    {
        notices.push(format!("the sampling interval, {interval} s, was taken from `{name}`"));
    }
    let mut filling = Filling::new(file, format, &sheets[first].headings, selection);
    for (index, sheet) in runs.iter().enumerate() {
        filling.add(sheet, (runs.len() > 1).then(|| run_label(&runs, index)))?;
    }
    notices.extend(filling.notice());
    filling.into_table(selection.clone(), notices)
}

/// What to try where a file holds nothing that is a measurement.
const NO_COLUMNS: &str = "save each channel as a numeric vector or as a column of a matrix, all of one length";

/// A run's name: that of its group if that tells it from the others.
fn run_label(runs: &[&ColumnSheet<'_, '_>], index: usize) -> String {
    let group = runs[index].group;
    let own = !group.is_empty() && runs.iter().filter(|r| r.group == group).count() == 1;
    if own { group.to_owned() } else { (index + 1).to_string() }
}

/// Why no sheet has all that is needed: the reason of the largest, with the columns of all.
fn no_sheet(sheets: &[ColumnSheet<'_, '_>], chosen: Vec<Result<Selection, ReadError>>) -> ReadError {
    let size = |sheet: &ColumnSheet<'_, '_>| sheet.len.saturating_mul(sheet.columns.len());
    let largest = (0..sheets.len()).max_by_key(|&i| (size(&sheets[i]), sheets.len() - i)).unwrap_or(0);
    let others = sheets.iter().enumerate().filter(|(i, _)| *i != largest);
    let others: Vec<String> = others.flat_map(|(_, s)| (0..s.columns.len()).map(|c| label(&s.headings, c))).collect();
    let mut errors = chosen.into_iter().filter_map(Result::err);
    let Some(mut error) = errors.nth(largest) else {
        return Flaw::new("it holds no columns of numbers").in_file("", "");
    };
    if let Some(columns) = error.columns_mut() {
        // The time base is no column to be chosen: advice speaks of the last one.
        if sheets[largest].has_base() && columns.len() == sheets[largest].headings.len() {
            columns.rotate_right(1);
        }
        for name in others {
            if !columns.contains(&name) {
                columns.push(name);
            }
        }
    }
    error
}

/// A table on its way: rows of one sheet after another.
struct Filling<'a> {
    file: &'a str,
    format: &'static str,
    headings: &'a [Heading],
    selection: &'a Selection,
    stamps: Vec<f64>,
    channels: Vec<Vec<f64>>,
    trajectories: Vec<u32>,
    labels: Vec<String>,
    rows: Vec<u32>,
    /// The number of each row, counting those without values; of all sheets.
    places: Vec<f64>,
    /// Rows so far, with those without values.
    counted: usize,
    /// Rows without a value: how many, and sample and column of the first.
    missing: usize,
    first_missing: Option<(usize, usize)>,
}

impl<'a> Filling<'a> {
    fn new(file: &'a str, format: &'static str, headings: &'a [Heading], selection: &'a Selection) -> Self {
        Self {
            file,
            format,
            headings,
            selection,
            stamps: Vec::new(),
            channels: vec![Vec::new(); selection.channels.len()],
            trajectories: Vec::new(),
            labels: Vec::new(),
            rows: Vec::new(),
            places: Vec::new(),
            counted: 0,
            missing: 0,
            first_missing: None,
        }
    }

    fn add(&mut self, sheet: &ColumnSheet<'_, '_>, run: Option<String>) -> Result<(), ReadError> {
        let decode = |column: usize| sheet.decode(column).map_err(|flaw| flaw.in_file(self.file, self.format));
        let mut wanted: Vec<(usize, Vec<f64>)> = Vec::new();
        for column in self.selection.time.into_iter().chain(self.selection.channels.iter().map(|(_, c)| *c)) {
            wanted.push((column, decode(column)?));
        }
        let trajectory = self.selection.trajectory.map(decode).transpose()?;
        let whole = self.whole_rows(sheet, &wanted)?;
        for row in (0..sheet.len).filter(|row| whole.as_ref().is_none_or(|w| w[*row])) {
            self.rows.push(u32::try_from(row + 1).unwrap_or(u32::MAX));
            self.places.push((self.counted + row) as f64);
            if let Some(values) = &trajectory {
                self.label(values[row].to_string());
            } else if let Some(run) = &run {
                self.label(run.clone());
            }
        }
        self.counted += sheet.len;
        let kept = |values: Vec<f64>| match &whole {
            None => values,
            Some(whole) => values.into_iter().zip(whole).filter(|(_, keep)| **keep).map(|(v, _)| v).collect(),
        };
        let mut wanted = wanted.into_iter().map(|(_, values)| kept(values));
        let join = |all: &mut Vec<f64>, more: Vec<f64>| {
            if all.is_empty() { *all = more } else { all.extend(more) }
        };
        if self.selection.time.is_some() {
            join(&mut self.stamps, wanted.next().unwrap_or_default());
        }
        for (channel, values) in self.channels.iter_mut().zip(wanted) {
            join(channel, values);
        }
        Ok(())
    }

    /// Which rows have all values, or none if all have.
    fn whole_rows(
        &mut self,
        sheet: &ColumnSheet<'_, '_>,
        wanted: &[(usize, Vec<f64>)],
    ) -> Result<Option<Vec<bool>>, ReadError> {
        let mut whole: Option<Vec<bool>> = None;
        for (column, values) in wanted {
            for (row, value) in values.iter().enumerate() {
                if value.abs() <= LARGEST {
                    continue;
                }
                if !value.is_nan() {
                    let problem = if value.is_infinite() { ReadProblem::NotFinite } else { ReadProblem::TooLarge };
                    return Err(self.refuse(row, *column, problem(value.to_string())));
                }
                let rows = whole.get_or_insert_with(|| vec![true; sheet.len]);
                if rows[row] {
                    rows[row] = false;
                    self.missing += 1;
                    if self.first_missing.is_none_or(|(first, _)| row < first) {
                        self.first_missing = Some((row, *column));
                    }
                }
            }
        }
        if let Some(rows) = &whole
            // Rows of several records may be mixed: then their numbers do not tell which are missing.
            && let Some(row) = inside(rows).filter(|_| self.selection.time.is_none() && self.selection.trajectory.is_some())
        {
            let column = wanted.iter().find(|(_, values)| values[row].is_nan()).map_or(0, |(c, _)| *c);
            return Err(self.refuse(row, column, ReadProblem::MissingCell));
        }
        Ok(whole)
    }

    /// What is wrong with the value of a row, from zero, in a column.
    fn refuse(&self, row: usize, column: usize, problem: ReadProblem) -> ReadError {
        let error = ReadError::new(self.file, problem).in_row(RowPlace::Sample(row + 1));
        error.in_column(label(self.headings, column))
    }

    fn label(&mut self, label: String) {
        let last = self.trajectories.last().filter(|i| self.labels[**i as usize] == label).copied();
        let index = last.or_else(|| self.labels.iter().position(|l| *l == label).and_then(|i| u32::try_from(i).ok()));
        let index = index.unwrap_or_else(|| {
            self.labels.push(label);
            u32::try_from(self.labels.len() - 1).unwrap_or(u32::MAX)
        });
        self.trajectories.push(index);
    }

    fn notice(&self) -> Option<String> {
        let (row, column) = self.first_missing?;
        let (row, column) = (row + 1, label(self.headings, column));
        Some(match self.missing {
            1 => format!("sample {row} has no value of `{column}` and was left out"),
            n => format!("{n} samples without a value, the first of `{column}` at sample {row}, were left out"),
        })
    }

    fn into_table(self, selection: Selection, notices: Vec<String>) -> Result<ColumnTable, ReadError> {
        if self.rows.is_empty()
            && let Some((row, column)) = self.first_missing
        {
            return Err(self.refuse(row, column, ReadProblem::MissingCell));
        }
        let gaps = selection.time.is_none() && self.places.windows(2).any(|w| w[1] - w[0] > 1.0);
        Ok(ColumnTable {
            headings: self.headings.to_vec(),
            selection,
            stamps: if gaps { self.places } else { self.stamps },
            channels: self.channels,
            trajectories: self.trajectories,
            labels: self.labels,
            rows: self.rows,
            by_sample: true,
            notices,
        })
    }
}

/// The first row without a value between rows that have all.
fn inside(whole: &[bool]) -> Option<usize> {
    let first = whole.iter().position(|w| *w)?;
    let last = whole.iter().rposition(|w| *w)?;
    (first..last).find(|row| !whole[*row])
}
