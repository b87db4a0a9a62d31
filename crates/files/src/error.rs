use super::heading::ColumnKey;
use super::words::{article, list};
use sindyscope_core::remedy::{Remedy, sentence};
use sindyscope_core::sampling::LEAST_SAMPLES;

/// Where a row of numbers stands in its file, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowPlace {
    /// A line of text.
    Line(usize),
    /// A sample of a file that has no lines.
    Sample(usize),
}

impl std::fmt::Display for RowPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Sample(sample) => write!(f, "sample {sample}"),
        }
    }
}

/// Why measurements cannot be read: the message says what is wrong and where, [`ReadError::remedies`] what to try.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}{problem}", self.place())]
pub struct ReadError {
    /// The file's name, or its path where it cannot be opened; empty where no file is to blame.
    pub file: String,
    /// Where the row stands, if one is to blame.
    pub row: Option<RowPlace>,
    /// The column, if one is to blame.
    pub column: Option<String>,
    /// What is wrong.
    pub problem: Box<ReadProblem>,
}

/// What is wrong with measurements.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadProblem {
    /// The file cannot be opened or read.
    #[error("{0}")]
    Open(String),
    /// Nobody wants the records any more.
    #[error("cancelled")]
    Cancelled,
    /// The bytes are no text.
    #[error("this is not a text file")]
    NotText,
    /// The bytes are not what the format says.
    #[error("this {format} file cannot be read: {what}{}", at_byte(.at))]
    Malformed {
        /// The format's name.
        format: &'static str,
        /// What is wrong, as a clause.
        what: String,
        /// The byte where it was found, from 0.
        at: Option<usize>,
        /// What to try; the general advice if empty.
        advice: &'static str,
    },
    /// A project that the window saved.
    #[error("this is a saved project, not a measurement")]
    IsProject,
    /// A file of a kind that holds no table of numbers, or one that only the program that wrote it reads.
    #[error("this is {what}, not a table of measurements")]
    Foreign {
        /// What it is, with its article.
        what: &'static str,
        /// What to export instead.
        advice: &'static str,
    },
    /// Nothing but blank and comment lines.
    #[error("the file is empty")]
    Empty,
    /// A header without a row of numbers.
    #[error("there are no samples below the header in line {0}")]
    HeaderOnly(usize),
    /// Numbers without names.
    #[error("there is no header, only numbers from line {line} on")]
    NoHeader {
        /// The first line of numbers.
        line: usize,
        /// Number of columns.
        columns: usize,
    },
    /// No column is the time, and no sampling rate is given.
    #[error("no column is the time; the columns are {}", list(.0))]
    NoTime(Vec<String>),
    /// No column is a displacement or state.
    #[error("no column is a displacement; the columns are {}{}", list(.columns), doubts(.doubtful))]
    NoDisplacement {
        /// The names of all columns.
        columns: Vec<String>,
        /// Columns whose names start like a known one but are something else, each with the reason.
        doubtful: Vec<(String, String)>,
    },
    /// Two columns have a claim to one role.
    #[error("`{first}` and `{second}` could both be the {}", in_words(.key))]
    TwoColumns {
        /// The short name of what both could be.
        key: String,
        /// One column.
        first: String,
        /// The other.
        second: String,
        /// The numbers of both, from 1.
        numbers: (usize, usize),
    },
    /// Numbered columns with a number left out.
    #[error("`{column}` is there, but no {key}")]
    NumberMissing {
        /// The column with the higher number.
        column: String,
        /// The short name that is missing.
        key: String,
    },
    /// What was said of columns names a column that is not there.
    #[error("there is no column `{name}` for {key}; the columns are {}", list(.columns))]
    UnknownColumn {
        /// The short name on the left of the equals sign.
        key: String,
        /// The name on its right.
        name: String,
        /// The names of all columns.
        columns: Vec<String>,
    },
    /// What was said of columns names a column that is there more than once.
    #[error("{count} columns are called `{name}`")]
    AmbiguousColumn {
        /// The short name on the left of the equals sign.
        key: String,
        /// The name on its right.
        name: String,
        /// How many columns it fits.
        count: usize,
    },
    /// What was said of columns uses one column twice.
    #[error("column `{column}` cannot be both {first} and {second}")]
    ColumnUsedTwice {
        /// The column.
        column: String,
        /// One short name.
        first: String,
        /// The other.
        second: String,
    },
    /// More channels of motion than an equation can be found for.
    #[error("{count} columns are taken for motions, such as `{first}`; up to {most} can be studied together")]
    TooManyMotions {
        /// How many there are.
        count: usize,
        /// The first one's name.
        first: String,
        /// The names of all columns.
        columns: Vec<String>,
        /// The most that are read.
        most: usize,
    },
    /// The sampling rate is not a positive number.
    #[error("a sampling rate of {0} Hz is impossible")]
    BadRate(f64),
    /// The time column's unit is none of time.
    #[error("`{0}` is not a unit of time")]
    TimeUnit(String),
    /// A row has more or fewer cells than the header.
    #[error("{cells} cells where the header has {expected}")]
    RowLength {
        /// Cells in the row.
        cells: usize,
        /// Cells in the header.
        expected: usize,
    },
    /// An empty cell.
    #[error("the value is missing")]
    MissingCell,
    /// A cell that is no number.
    #[error("`{0}` is not a number")]
    NotANumber(String),
    /// A cell that holds NaN or an infinity.
    #[error("`{0}` is not a finite number")]
    NotFinite(String),
    /// A number beyond all measurement, whose square would overflow soon.
    #[error("`{0}` is too large")]
    TooLarge(String),
    /// Decimal points and decimal commas in one file.
    #[error("`{0}`: decimal points and decimal commas are mixed")]
    MixedDecimals(String),
    /// Two samples have one time.
    #[error("the time {0} is there twice")]
    RepeatedTime(f64),
    /// Time runs backwards.
    #[error("the time falls from {before} to {time}")]
    FallingTime {
        /// The time before, in the file's unit.
        before: f64,
        /// The time there, in the file's unit.
        time: f64,
    },
    /// The sampling is too uneven to be evened out.
    #[error("the sampling is uneven: a step of {step} s where {usual} s is usual ({percent} % off)")]
    UnevenTime {
        /// The worst step, s.
        step: f64,
        /// The usual step, s.
        usual: f64,
        /// How far time stamps are off an even grid, % of the usual step.
        percent: f64,
    },
    /// Not enough samples for anything.
    #[error("{}{samples} samples are too few (at least {})", longest(*.records), LEAST_SAMPLES)]
    TooFewSamples {
        /// How many records the file has.
        records: usize,
        /// Samples in the longest stretch without a gap.
        samples: usize,
    },
    /// Two files of a set measure different things.
    #[error("the {quantity} `{column}` is in {unit}, in {other} it is in {other_unit}: these cannot be one quantity")]
    UnitsDiffer {
        /// What it is, in words: `displacement`.
        quantity: &'static str,
        /// The channel's name.
        column: String,
        /// Its unit.
        unit: String,
        /// The file that comes before.
        other: String,
        /// The unit there.
        other_unit: String,
    },
    /// A displacement that does not move.
    #[error("the displacement is constant ({value}{})", of_record(.record))]
    ConstantDisplacement {
        /// The record's label, if the file has several.
        record: Option<String>,
        /// Its value.
        value: f64,
    },
}

impl ReadError {
    /// A problem of a file as a whole.
    pub(super) fn new(file: impl Into<String>, problem: ReadProblem) -> Self {
        Self { file: file.into(), row: None, column: None, problem: Box::new(problem) }
    }

    /// The same, of one column.
    pub(super) fn in_column(self, column: impl Into<String>) -> Self {
        Self { column: Some(column.into()), ..self }
    }

    /// The same, of one row.
    pub(super) fn in_row(self, row: RowPlace) -> Self {
        Self { row: Some(row), ..self }
    }

    /// What a message begins with.
    fn place(&self) -> String {
        let row = self.row.map_or(String::new(), |row| format!(", {row}"));
        let column = self.column.as_ref().map_or(String::new(), |column| format!(", column `{column}`"));
        if self.file.is_empty() { String::new() } else { format!("{}{row}{column}: ", self.file) }
    }

    /// What to try, each by itself.
    pub fn remedies(&self) -> Vec<Remedy> {
        let either = |what: &'static str, or: Remedy| vec![Remedy::to_do(what), or];
        let only = |what: &'static str| vec![Remedy::to_do(what)];
        match &*self.problem {
            ReadProblem::Cancelled => Vec::new(),
            ReadProblem::Open(_) => only("check the path, and that the file may be read"),
            ReadProblem::IsProject => vec![Remedy::OpenProject { file: self.file.clone() }],
            ReadProblem::Malformed { advice: "", .. } => {
                only("copy or export the measurement anew, whole; CSV text with a header such as `t,x,u` always does")
            }
            ReadProblem::Malformed { advice, .. } | ReadProblem::Foreign { advice, .. } => only(advice),
            ReadProblem::NotText => {
                only("export the measurement as CSV text: a header such as `t,x,u`, then one row a sample")
            }
            ReadProblem::Empty | ReadProblem::HeaderOnly(_) => {
                only("a file needs a header such as `t,x,u` and below it one row a sample")
            }
            ReadProblem::NoHeader { columns, .. } => either("add a header such as `t,x,u`", by_number(*columns)),
            ReadProblem::NoTime(columns) => {
                let first = columns.first().map_or("NAME", String::as_str);
                vec![Remedy::columns([("t", first)]), Remedy::rate()]
            }
            ReadProblem::NoDisplacement { columns, doubtful } => {
                let example = doubtful.last().map(|(name, _)| name).or(columns.last());
                let example = example.map_or("NAME", String::as_str);
                vec![Remedy::columns([("x", example)]), Remedy::to_do("name it `x` in the header")]
            }
            ReadProblem::TwoColumns { key, first, second, numbers } => one_or_both(key, (first, second), *numbers),
            ReadProblem::NumberMissing { column, key } => {
                either("number the columns without a hole", Remedy::columns([(key, column)]))
            }
            ReadProblem::UnknownColumn { .. } => only("write the name as in the header, or the column's number from 1"),
            ReadProblem::AmbiguousColumn { key, .. } => vec![Remedy::columns([(key.as_str(), "2")])],
            ReadProblem::ColumnUsedTwice { first, .. } => {
                vec![Remedy::to_do(format!("leave one of them out, or give {first} another column"))]
            }
            ReadProblem::TooManyMotions { first, .. } => {
                let columns = vec![("x1".to_owned(), first.clone())];
                vec![Remedy::NameColumns { columns, only: true, rate: false }]
            }
            ReadProblem::BadRate(_) => vec![Remedy::rate()],
            ReadProblem::TimeUnit(_) => either("give the time in s, ms, us, min or h in the header", Remedy::rate()),
            ReadProblem::RowLength { .. } => {
                only("correct the row; a decimal comma in a file separated by commas also looks like this")
            }
            ReadProblem::MissingCell | ReadProblem::NotFinite(_) => {
                only("fill the value in or delete the row: a longer stretch without rows splits the record in two")
            }
            ReadProblem::NotANumber(_) => {
                only("correct the cell, or delete the row; text columns may stay if they are not used")
            }
            ReadProblem::TooLarge(_) => only("correct the cell, or give the measurement in a larger unit"),
            ReadProblem::MixedDecimals(_) => {
                only("write all numbers with a decimal point, without thousands separators")
            }
            ReadProblem::RepeatedTime(_) => {
                either("delete the double row", Remedy::GiveRate { when: "the time is only rounded too much" })
            }
            ReadProblem::FallingTime { .. } => {
                only("if another run begins there, tell runs apart by a column `record`, or by one file each")
            }
            ReadProblem::UnevenTime { .. } => either(
                "resample the measurement to even steps (done here where at most one step in ten is half as long again as usual)",
                Remedy::GiveRate { when: "only the time stamps are bad" },
            ),
            ReadProblem::TooFewSamples { records: 1, .. } => {
                only("use a longer measurement, or a higher sampling rate")
            }
            ReadProblem::TooFewSamples { .. } => {
                only("check the column that tells the records apart, or join runs that belong together")
            }
            ReadProblem::UnitsDiffer { .. } => only(
                "open the files one by one, or correct the unit in the header; units of one quantity (m and mm) are converted",
            ),
            ReadProblem::ConstantDisplacement { .. } => either("check the sensor", Remedy::columns([("x", "NAME")])),
        }
    }

    /// What to try, in one sentence of plain words.
    pub fn advice(&self) -> String {
        sentence(&self.remedies(), Remedy::to_string)
    }

    /// The names of the file's columns, where the error is about which is which.
    pub fn columns(&self) -> Option<&[String]> {
        match &*self.problem {
            ReadProblem::NoTime(columns)
            | ReadProblem::NoDisplacement { columns, .. }
            | ReadProblem::UnknownColumn { columns, .. }
            | ReadProblem::TooManyMotions { columns, .. } => Some(columns),
            _ => None,
        }
    }

    /// The same, to be added to.
    pub(super) fn columns_mut(&mut self) -> Option<&mut Vec<String>> {
        match &mut *self.problem {
            ReadProblem::NoTime(columns)
            | ReadProblem::NoDisplacement { columns, .. }
            | ReadProblem::UnknownColumn { columns, .. } => Some(columns),
            _ => None,
        }
    }

    /// True if saying which column is which, or how fast was sampled, is what is needed.
    pub fn is_about_columns(&self) -> bool {
        self.columns().is_some()
            || matches!(
                &*self.problem,
                ReadProblem::NoHeader { .. }
                    | ReadProblem::TwoColumns { .. }
                    | ReadProblem::NumberMissing { .. }
                    | ReadProblem::AmbiguousColumn { .. }
                    | ReadProblem::ColumnUsedTwice { .. }
                    | ReadProblem::TimeUnit(_)
                    | ReadProblem::ConstantDisplacement { .. }
            )
    }
}

/// The columns of a file without a header, by their numbers.
fn by_number(columns: usize) -> Remedy {
    let keys: &[&str] = match columns {
        1 => &["x"],
        2 => &["t", "x"],
        _ => &["t", "x", "u"],
    };
    let columns =
        keys.iter().zip(1..).map(|(key, number): (_, usize)| ((*key).to_owned(), number.to_string())).collect();
    Remedy::NameColumns { columns, only: false, rate: keys.len() == 1 }
}

/// One of two columns that could both be `key`, or both where there may be several of its kind; of equal names by number.
fn one_or_both(key: &str, (first, second): (&str, &str), numbers: (usize, usize)) -> Vec<Remedy> {
    let (one, two) = match first == second {
        true => (numbers.0.to_string(), numbers.1.to_string()),
        false => (first.to_owned(), second.to_owned()),
    };
    let several = ColumnKey::of_word(key).is_some_and(|k| k.number.is_none() && k.quantity.is_numbered());
    let both = several.then(|| Remedy::columns([(format!("{key}1"), one.clone()), (format!("{key}2"), two)]));
    [Remedy::columns([(key, one)])].into_iter().chain(both).collect()
}

fn doubts(doubtful: &[(String, String)]) -> String {
    doubtful.iter().map(|(name, why)| format!("; `{name}` is not taken for one: {why}")).collect()
}

fn longest(records: usize) -> String {
    if records > 1 { format!("in the longest of {records} records, ") } else { String::new() }
}

fn at_byte(at: &Option<usize>) -> String {
    at.map_or(String::new(), |byte| format!(" (at byte {byte})"))
}

fn of_record(record: &Option<String>) -> String {
    record.as_ref().map_or(String::new(), |r| format!(", in record `{r}`"))
}

/// What a short name stands for, in words: `displacement x2`.
fn in_words(key: &str) -> String {
    match ColumnKey::of_word(key) {
        Some(known) if known.quantity.is_numbered() => format!("{} {key}", known.quantity.noun()),
        Some(known) => known.quantity.noun().to_owned(),
        None => key.to_owned(),
    }
}

/// The reason that a doubtful column is left out, as a notice.
pub(super) fn doubtful_notice(name: &str, key: ColumnKey, why: &str) -> String {
    format!(
        "column `{name}` is not taken for {}: {why}; if it is one, say which column is which: {key}={name}",
        article(key.quantity.noun())
    )
}
