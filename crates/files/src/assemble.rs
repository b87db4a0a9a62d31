//! From a file's columns to records: trajectories, units, the even grid, and what is refused.

use super::error::{ReadError, ReadProblem, RowPlace};
use super::heading::{Heading, label};
use super::options::ReadOptions;
use super::shared_units;
use super::table::ColumnTable;
use super::words::list;
use sindyscope_core::sampling::{self, Irregular, LEAST_SAMPLES, Sampling};
use sindyscope_core::study::Cancel;
use sindyscope_values::record::estimate;
use sindyscope_values::record::units::{self, Unit};
use sindyscope_values::record::{Channel, Record, Role};

/// Up to this many gaps are told one by one, more in one sentence.
const GAPS_TOLD: usize = 3;

/// The records of one file; names are not yet unique among files.
pub(super) fn records(
    file: &str,
    stem: &str,
    mut table: ColumnTable,
    options: &ReadOptions,
    cancel: &Cancel,
) -> Result<Vec<Record>, ReadError> {
    let mut notices = std::mem::take(&mut table.notices);
    notices.append(&mut table.selection.notices);
    let second = time_unit(file, &table, &mut notices)?;
    let units = convert(&mut table, &mut notices);
    let groups = trajectories(&mut table, &mut notices);
    let several = groups.len() > 1;
    let only_numbers = table.labels.iter().all(|l| l.parse::<f64>().is_ok());

    let mut records: Vec<Record> = Vec::new();
    let mut left_out: Vec<(String, usize)> = Vec::new();
    let count = groups.len();
    for (trajectory, rows) in groups {
        if cancel.is_cancelled() {
            return Err(ReadError::new(file, ReadProblem::Cancelled));
        }
        let of_record = trajectory.as_ref().filter(|_| several).cloned();
        let name = match &trajectory {
            Some(text) if !only_numbers => text.clone(),
            Some(text) if several => format!("{stem} {text}"),
            _ => stem.to_owned(),
        };
        let source = Trajectory { file, table: &table, units: &units, second, label: of_record, name, rows };
        match source.records(options) {
            Ok(parts) => records.extend(parts),
            // A run that was broken off is no reason to refuse the others.
            Err(error) => match *error.problem {
                ReadProblem::TooFewSamples { samples, .. } if several => {
                    left_out.push((trajectory.unwrap_or_default(), samples));
                }
                _ => return Err(error),
            },
        }
    }
    if records.is_empty() {
        let samples = left_out.iter().map(|(_, samples)| *samples).max().unwrap_or(0);
        return Err(ReadError::new(file, ReadProblem::TooFewSamples { records: count, samples }));
    }
    match &left_out[..] {
        [] => {}
        [(label, samples)] => notices.push(format!(
            "record `{label}` has {samples} samples where at least {LEAST_SAMPLES} are needed; it was left out"
        )),
        many => {
            let count = many.len();
            notices.push(format!("{count} records have fewer than {LEAST_SAMPLES} samples; they were left out"));
        }
    }
    for record in &mut records {
        let own = std::mem::take(&mut record.notices);
        record.notices = notices.iter().chain(&own).map(|n| format!("{file}: {n}")).collect();
    }
    Ok(records)
}

/// How a stamp becomes seconds: multiplied by the first, divided by the second, one of which is 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seconds(f64, f64);

impl Seconds {
    pub(super) fn seconds(self, time: f64) -> f64 {
        time * self.0 / self.1
    }

    /// The same, without the last digit that a conversion may have cost.
    fn exactly(self, time: f64) -> f64 {
        if self.0 == self.1 { time } else { sampling::significant(self.seconds(time), 15) }
    }
}

pub(super) fn time_unit(file: &str, table: &ColumnTable, notices: &mut Vec<String>) -> Result<Seconds, ReadError> {
    let Some(column) = table.selection.time else { return Ok(Seconds(1.0, 1.0)) };
    let unit = &table.headings[column].unit;
    if unit.is_empty() {
        return Ok(Seconds(1.0, 1.0));
    }
    let Some(known) = units::parse(unit).filter(Unit::is_time) else {
        let error = ReadError::new(file, ReadProblem::TimeUnit(unit.clone()));
        return Err(error.in_column(label(&table.headings, column)));
    };
    if known.factor == 1.0 {
        return Ok(Seconds(1.0, 1.0));
    }
    notices.push(format!("time was converted from {unit} to s"));
    // Thousands are exact, thousandths are not: 0.5 ms divided is 0.0005 s to the bit.
    Ok(if known.factor < 1.0 { Seconds(1.0, (1.0 / known.factor).round()) } else { Seconds(known.factor, 1.0) })
}

/// Brings every channel that measures the first displacement's quantity, or that per time, to its unit; gives each
/// channel's unit.
pub(super) fn convert(table: &mut ColumnTable, notices: &mut Vec<String>) -> Vec<String> {
    let ColumnTable { headings, selection, channels, .. } = table;
    let unit_of = |column: usize| headings[column].unit.clone();
    let mut units: Vec<String> = selection.channels.iter().map(|(_, column)| unit_of(*column)).collect();
    let Some(reference) = reference(&selection.channels, &units) else { return units };
    for (((role, column), unit), values) in selection.channels.iter().zip(&mut units).zip(channels) {
        let Some((target, factor)) = shared_units::derived(&reference, unit) else { continue };
        // Two spellings of one unit differ by the rounding of their factors at most.
        if (factor - 1.0).abs() < 1e-12 {
            continue;
        }
        for value in values.iter_mut() {
            *value *= factor;
        }
        let (noun, name) = (role.noun(), label(headings, *column));
        notices.push(format!("{noun} `{name}` was converted from {unit} to {target}, the displacement's unit"));
        *unit = target;
    }
    units
}

/// The unit that the others are brought to: the first displacement's, or that which goes with the first velocity or
/// acceleration where no displacement was measured.
fn reference(channels: &[(Role, usize)], units: &[String]) -> Option<String> {
    let (role, unit) = channels.iter().map(|(role, _)| *role).zip(units).next()?;
    let order: usize = match role {
        Role::Velocity(_) => 1,
        Role::Acceleration(_) => 2,
        Role::Displacement(_) | Role::Input(_) => return Some(unit.clone()),
    };
    let length = estimate::displacement_unit(unit, order);
    let derived = units::parse(&length).is_some() && !length.contains(' ');
    // Multiples of gravity become metres per second squared.
    let metres = units::parse("m").zip(units::parse(unit)).and_then(|(m, unit)| m.rates_to(&unit));
    (derived || metres.is_some_and(|n| n as usize == order)).then(|| if derived { length } else { "m".to_owned() })
}

/// A channel that was measured, with the name of its column.
pub(super) fn channel(heading: &Heading, role: Role, unit: &str, values: Vec<f64>) -> Channel {
    let name = if heading.stem.is_empty() { role.symbol().to_owned() } else { heading.stem.clone() };
    Channel { name, role, unit: unit.to_owned(), values: values.into(), estimated: false }
}

/// Which rows belong to each trajectory: a range where they stand together.
enum RowSet {
    All,
    Some(Vec<usize>),
}

fn trajectories(table: &mut ColumnTable, notices: &mut Vec<String>) -> Vec<(Option<String>, RowSet)> {
    let column = table.selection.trajectory;
    match (table.labels.len(), column) {
        (0, _) | (_, None) => vec![(None, RowSet::All)],
        (1, _) => vec![(Some(table.labels[0].clone()), RowSet::All)],
        (n, Some(column)) if n == table.rows.len() => {
            let name = label(&table.headings, column);
            notices.push(format!("column `{name}` differs in every row, so it was not taken to tell records apart"));
            table.labels.clear();
            vec![(None, RowSet::All)]
        }
        (n, _) => {
            let mut rows: Vec<Vec<usize>> = vec![Vec::new(); n];
            for (row, trajectory) in table.trajectories.iter().enumerate() {
                rows[*trajectory as usize].push(row);
            }
            table.labels.iter().cloned().map(Some).zip(rows.into_iter().map(RowSet::Some)).collect()
        }
    }
}

/// A stretch may lie so far off the grid of the one before, in intervals, and is taken to lie on it.
const ON_GRID: f64 = 0.02;

/// A stretch of even samples; `columns[channel][sample]`, its start in the stamps' unit.
struct EvenPiece {
    start: f64,
    columns: Vec<Vec<f64>>,
}

impl EvenPiece {
    fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// One trajectory of a file, on its way to records.
struct Trajectory<'a> {
    file: &'a str,
    table: &'a ColumnTable,
    units: &'a [String],
    second: Seconds,
    /// The label, if the file has several trajectories.
    label: Option<String>,
    name: String,
    rows: RowSet,
}

impl Trajectory<'_> {
    fn len(&self) -> usize {
        match &self.rows {
            RowSet::All => self.table.rows.len(),
            RowSet::Some(rows) => rows.len(),
        }
    }

    fn place(&self, row: usize) -> RowPlace {
        let row = match &self.rows {
            RowSet::All => row,
            RowSet::Some(rows) => rows[row],
        };
        self.table.place(row)
    }

    fn values(&self, column: &[f64], range: std::ops::Range<usize>) -> Vec<f64> {
        match &self.rows {
            RowSet::All => column[range].to_vec(),
            RowSet::Some(rows) => rows[range].iter().map(|r| column[*r]).collect(),
        }
    }

    fn too_few(&self, samples: usize) -> ReadError {
        ReadError::new(self.file, ReadProblem::TooFewSamples { records: 1, samples })
    }

    fn records(&self, options: &ReadOptions) -> Result<Vec<Record>, ReadError> {
        let mut notices = Vec::new();
        let (stamps, sampling, second) = match (self.table.selection.time, options.rate) {
            (Some(column), _) => {
                let mut stamps = self.values(&self.table.stamps, 0..self.len());
                let sampling = sampling::analyse(&mut stamps).map_err(|e| self.irregular(e, &stamps, column))?;
                (stamps, sampling, self.second)
            }
            (None, rate) => {
                let rate = Seconds(1.0, rate.unwrap_or(1.0));
                let places = if self.table.stamps.is_empty() { &[][..] } else { &self.table.stamps };
                match self.values(places, 0..self.len().min(places.len())) {
                    none if none.is_empty() => (none, Sampling::even(self.len(), 1.0), rate),
                    places => {
                        let sampling = Sampling::with_missing(&places);
                        (places, sampling, rate)
                    }
                }
            }
        };
        self.tell(&sampling, &stamps, (second, options.bridge), &mut notices);
        let pieces = self.pieces(&stamps, &sampling, options.bridge);
        let long = |piece: &EvenPiece| piece.len() >= LEAST_SAMPLES;
        let longest = pieces.iter().map(EvenPiece::len).max().unwrap_or(0);
        if longest < LEAST_SAMPLES {
            return Err(self.too_few(longest));
        }
        let split = pieces.iter().filter(|p| long(p)).count() > 1;
        let (count, short) = (pieces.len(), pieces.iter().filter(|p| !long(p)).count());
        let interval = second.exactly(sampling.interval);
        let mut records: Vec<Record> = Vec::new();
        let mut still = 0;
        for EvenPiece { start, columns } in pieces.into_iter().filter(long) {
            if let Some((channel, value)) = self.still(&columns) {
                still += 1;
                if count == still {
                    return Err(self.constant(channel, value));
                }
                continue;
            }
            let name = if split { format!("{} part {}", self.name, records.len() + 1) } else { self.name.clone() };
            let (start, mut channels) = (second.seconds(start), self.channels(columns));
            for told in estimate::complete(&mut channels, interval) {
                let told = format!("{}{told}", self.prefix());
                if !notices.contains(&told) {
                    notices.push(told);
                }
            }
            records.push(Record { name, source: None, start, interval, channels, notices: Vec::new() });
        }
        if records.is_empty() {
            return Err(self.constant(0, self.table.channels[0][0]));
        }
        let fewer = format!("fewer than {LEAST_SAMPLES} samples");
        for (count, what) in [(short, fewer.as_str()), (still, "no motion")] {
            notices.extend(match count {
                0 => None,
                1 => Some(format!("{}a stretch between gaps has {what}; it was left out", self.prefix())),
                _ => Some(format!("{}{count} stretches between gaps have {what}; they were left out", self.prefix())),
            });
        }
        for record in &mut records {
            record.notices.clone_from(&notices);
        }
        Ok(records)
    }

    /// The stretches between gaps, those joined between which no more than `bridge` samples are missing.
    fn pieces(&self, stamps: &[f64], sampling: &Sampling, bridge: usize) -> Vec<EvenPiece> {
        let interval = sampling.interval;
        let mut pieces: Vec<EvenPiece> = Vec::new();
        for stretch in &sampling.stretches {
            let columns = self.table.channels.iter();
            let mut columns: Vec<Vec<f64>> = columns.map(|c| self.values(c, stretch.rows.clone())).collect();
            let before = pieces.last_mut();
            // Samples from the end of the piece before to the beginning of this one, on that piece's grid.
            let apart = before.as_ref().map(|b| (stretch.start - b.start) / interval - (b.len() - 1) as f64);
            let joins = bridge > 0 && apart.is_some_and(|steps| steps.round() - 1.0 <= bridge as f64);
            let on_grid = apart.is_some_and(|steps| (steps - steps.round()).abs() <= ON_GRID);
            let mut start = stretch.start;
            let mut resample = stretch.resample;
            if let (Some(before), true, false) = (&before, joins, on_grid && resample.is_none()) {
                let first = ((stretch.start - before.start) / interval - ON_GRID).ceil();
                start = before.start + first * interval;
                let last = stamps[stretch.rows.end - 1];
                resample = Some((((last - start) / interval + ON_GRID).floor() + 1.0).max(0.0) as usize);
            }
            let few = stretch.rows.len() < sampling::FEWEST_STAMPS || resample == Some(0);
            if resample.is_some() && few {
                // Too short to be put onto the grid: it counts as missing, or as a stretch too short to be used.
                if !joins {
                    pieces.push(EvenPiece { start, columns });
                }
                continue;
            }
            if let Some(points) = resample {
                sampling::resample(&stamps[stretch.rows.clone()], &mut columns, start, interval, points);
            }
            match before {
                Some(before) if joins => {
                    let place = ((start - before.start) / interval).round() as usize;
                    let missing = place.saturating_sub(before.len());
                    for (whole, column) in before.columns.iter_mut().zip(columns) {
                        let filled = sindyscope_core::prepare::fill(whole, &column, missing);
                        whole.extend(filled.into_iter().chain(column));
                    }
                }
                _ => pieces.push(EvenPiece { start, columns }),
            }
        }
        pieces
    }

    /// The first displacement that is constant, with its value.
    fn still(&self, columns: &[Vec<f64>]) -> Option<(usize, f64)> {
        let roles = self.table.selection.channels.iter().map(|(role, _)| role);
        roles
            .zip(columns)
            .position(|(role, values)| matches!(role, Role::Displacement(_)) && is_constant(values))
            .map(|channel| (channel, columns[channel][0]))
    }

    fn constant(&self, channel: usize, value: f64) -> ReadError {
        let column = label(&self.table.headings, self.table.selection.channels[channel].1);
        ReadError::new(self.file, ReadProblem::ConstantDisplacement { record: self.label.clone(), value })
            .in_column(column)
    }

    fn channels(&self, columns: Vec<Vec<f64>>) -> Vec<Channel> {
        let channels = self.table.selection.channels.iter().zip(self.units).zip(columns);
        channels
            .map(|(((role, column), unit), values)| channel(&self.table.headings[*column], *role, unit, values))
            .collect()
    }

    fn irregular(&self, error: Irregular, stamps: &[f64], time: usize) -> ReadError {
        let (row, problem) = match error {
            Irregular::Repeated { row } => (row, ReadProblem::RepeatedTime(stamps[row])),
            Irregular::Falling { row } => {
                (row, ReadProblem::FallingTime { before: stamps[row - 1], time: stamps[row] })
            }
            Irregular::Uneven { row, step, usual, jitter } => {
                let step = sampling::significant(self.second.seconds(step), 4);
                let usual = sampling::significant(self.second.seconds(usual), 4);
                (row, ReadProblem::UnevenTime { step, usual, percent: sampling::significant(100.0 * jitter, 3) })
            }
        };
        ReadError::new(self.file, problem).in_row(self.place(row)).in_column(label(&self.table.headings, time))
    }

    /// `record `a`: `, or nothing if the file has one trajectory.
    fn prefix(&self) -> String {
        self.label.as_ref().map_or(String::new(), |l| format!("record `{l}`: "))
    }

    fn tell(&self, sampling: &Sampling, stamps: &[f64], (second, bridge): (Seconds, usize), notices: &mut Vec<String>) {
        let prefix = self.prefix();
        let interval = second.seconds(sampling.interval);
        let percent = sampling::significant(100.0 * sampling.jitter, 2);
        if let Some(given) = sampling.odd_first {
            let taken = sampling::significant(stamps[0], 6);
            notices.push(format!(
                "{prefix}the first time stamp, {given}, does not fit the others and was taken as {taken}"
            ));
        }
        if let Some(step) = sampling.rounded_to {
            notices.push(format!(
                "{prefix}the time stamps are rounded to {} s; the sampling was taken as even, one sample every {} s",
                sampling::significant(second.seconds(step), 3),
                sampling::significant(interval, 7)
            ));
        }
        if sampling.bridged > 0 {
            let count = sampling.bridged;
            let (steps, were) = if count == 1 { ("step", "was") } else { ("steps", "were") };
            notices.push(format!("{prefix}{count} {steps} of two or three intervals {were} interpolated over"));
        }
        if sampling.stretches.iter().any(|s| s.resample.is_some()) {
            notices.push(format!(
                "{prefix}the time stamps are up to {percent} % of the interval of {} s off an even grid; the samples were interpolated onto it",
                sampling::significant(interval, 4)
            ));
        }
        let gaps: Vec<(usize, f64)> = sampling
            .stretches
            .windows(2)
            .map(|pair| pair[1].rows.start)
            .filter(|row| sampling.missing(stamps[*row] - stamps[row - 1]) > bridge)
            .map(|row| (row, second.seconds(stamps[row] - stamps[row - 1])))
            .collect();
        let filled = sampling.stretches.len().saturating_sub(1 + gaps.len());
        if filled > 0 {
            let (gaps, were) = if filled == 1 { ("gap", "was") } else { ("gaps", "were") };
            notices.push(format!("{prefix}{filled} {gaps} of up to {bridge} samples {were} bridged"));
        }
        let at = |row: usize| {
            format!("before {} (t = {} s)", self.place(row), sampling::significant(second.seconds(stamps[row]), 6))
        };
        if gaps.len() <= GAPS_TOLD {
            for (row, length) in gaps {
                let length = sampling::significant(length, 4);
                notices.push(format!("{prefix}a gap of {length} s {} splits the record", at(row)));
            }
        } else if let Some((row, length)) = gaps.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
            let length = sampling::significant(*length, 4);
            let count = gaps.len();
            notices.push(format!("{prefix}{count} gaps, the longest of {length} s {}, split the record", at(*row)));
        }
    }
}

/// Leaves out inputs that are constant in every record: nothing can be identified from them.
///
/// `file` names a record's file for the notice.
pub(super) fn drop_constant_inputs(records: &mut [Record], file: &dyn Fn(&Record) -> String) {
    let Some(first) = records.first() else { return };
    let constant = |role: Role| records.iter().all(|r| r.channel(role).is_none_or(|c| is_constant(&c.values)));
    let dropped: Vec<Role> =
        first.channels.iter().map(|c| c.role).filter(|r| matches!(r, Role::Input(_)) && constant(*r)).collect();
    if dropped.is_empty() {
        return;
    }
    for record in records {
        let file = file(record);
        let (gone, mut kept): (Vec<Channel>, Vec<Channel>) =
            std::mem::take(&mut record.channels).into_iter().partition(|c| dropped.contains(&c.role));
        let names: Vec<&str> = gone.iter().map(|c| c.name.as_str()).collect();
        match names.len() {
            0 => {}
            1 => record.notices.push(format!("{file}: input {} is constant and was left out", list(&names))),
            _ => record.notices.push(format!("{file}: inputs {} are constant and were left out", list(&names))),
        }
        let mut left = 0;
        for channel in &mut kept {
            if let Role::Input(index) = &mut channel.role {
                if *index != left {
                    *index = left;
                    record.notices.push(format!("{file}: `{}` is now input u{}", channel.name, left + 1));
                }
                left += 1;
            }
        }
        record.channels = kept;
    }
}

/// True if values differ by no more than the rounding of their arithmetic.
fn is_constant(values: &[f64]) -> bool {
    let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
    most - least <= 8.0 * f64::EPSILON * most.abs().max(least.abs())
}
