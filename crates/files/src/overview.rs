//! What a file holds before anything is read from it: its tables, their columns and first values, and what each column is
//! taken for. Numbers beyond the first rows are not looked at, so a wide file answers at once.

use serde::{Deserialize, Serialize};

use super::column_map::ColumnMap;
use super::guess;
use super::heading::{ColumnKey, ColumnQuantity, Heading};
use super::options::ReadOptions;
use super::selection;
use super::table::TableHead;
use sindyscope_values::record::Role;
use sindyscope_values::record::units;

/// What a column is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum ColumnUse {
    /// When the samples were taken.
    Time,
    /// Which record a row belongs to.
    Trajectory,
    /// A channel of the record.
    Channel(Role),
}

impl ColumnUse {
    fn from_key(key: ColumnKey, from_zero: bool) -> Self {
        let index = (key.number.unwrap_or(1) + usize::from(from_zero && key.number.is_some())).saturating_sub(1);
        match key.quantity {
            ColumnQuantity::Time => Self::Time,
            ColumnQuantity::Trajectory => Self::Trajectory,
            ColumnQuantity::Displacement => Self::Channel(Role::Displacement(index)),
            ColumnQuantity::Velocity => Self::Channel(Role::Velocity(index)),
            ColumnQuantity::Acceleration => Self::Channel(Role::Acceleration(index)),
            ColumnQuantity::Input => Self::Channel(Role::Input(index)),
        }
    }

    /// The short name, as a [`ColumnMap`] takes it: `t`, `record`, `x2`; without the number where there is `one` only.
    pub fn key(self, one: bool) -> String {
        match self {
            Self::Time => "t".into(),
            Self::Trajectory => "record".into(),
            Self::Channel(role) if one && role.index() == 0 => role.symbol().into(),
            Self::Channel(role) => format!("{}{}", role.symbol(), role.index() + 1),
        }
    }
}

/// One column of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnOverview {
    /// As the file calls it, with its unit if that stands there; empty without a name.
    pub name: String,
    /// The unit; empty if none is given.
    pub unit: String,
    /// What it is taken for as things stand.
    pub taken: Option<ColumnUse>,
    /// What it may be: a proposal, for columns that are not taken.
    pub guess: Option<ColumnUse>,
    /// Its first values, 200 at most; NaN where there is no number. Empty where the file was not looked into so far.
    pub first: Vec<f64>,
    /// What a [`ColumnMap`] calls it: its name, or its number from 1 where the name does not tell it from others.
    reference: String,
}

/// Columns that can stand in one record.
#[derive(Clone, Debug, PartialEq)]
pub struct TableOverview {
    /// What the file calls it: a group or a sheet; may be empty.
    pub name: String,
    /// Number of rows; of text, of lines that may hold one.
    pub rows: usize,
    /// Samples a second, where the file tells the sampling apart from the columns, Hz; else that of an evenly rising time.
    pub rate: Option<f64>,
    /// The columns, in the order of the file; a time that is no column of the file comes last.
    pub columns: Vec<ColumnOverview>,
}

impl TableOverview {
    /// What the columns of a table are taken for with these options, and what the others may be.
    pub(super) fn new(head: TableHead, options: &ReadOptions) -> Self {
        let TableHead { name, headings, rows, rate, first } = head;
        let mut taken = selection::taken(&headings, options);
        number_the_alike(&mut taken);
        let guesses =
            if options.only_named { vec![None; headings.len()] } else { guess::guess(&headings, &first, &taken) };
        let zero = |quantity: ColumnQuantity| {
            taken.iter().flatten().any(|key| key.quantity == quantity && key.number == Some(0))
        };
        let used = |key: &ColumnKey| ColumnUse::from_key(*key, zero(key.quantity));
        let references = references(&headings);
        let columns: Vec<ColumnOverview> = headings
            .iter()
            .zip(first.into_iter().chain(std::iter::repeat_with(Vec::new)))
            .zip(references)
            .enumerate()
            .map(|(c, ((heading, first), reference))| ColumnOverview {
                name: heading.name.clone(),
                unit: heading.unit.clone(),
                taken: taken[c].as_ref().map(used),
                guess: guesses[c].as_ref().map(used),
                first,
                reference,
            })
            .collect();
        let rate = rate.or_else(|| rate_of(&columns));
        Self { name, rows, rate, columns }
    }

    /// What `uses[column]` says, as options of reading take it.
    pub fn map(&self, uses: &[Option<ColumnUse>]) -> ColumnMap {
        let symbol = |used: &ColumnUse| used.key(false).trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
        let mut map = ColumnMap::default();
        for (column, used) in self.columns.iter().zip(uses) {
            let Some(used) = used else { continue };
            let one = uses.iter().flatten().filter(|other| symbol(other) == symbol(used)).count() == 1;
            // A reference is never empty, and a use's key is one of the known ones.
            let _ = map.set(&used.key(one), &column.reference);
        }
        map
    }

    /// What each column is taken for, or else may be.
    pub fn proposed(&self) -> Vec<Option<ColumnUse>> {
        self.columns.iter().map(|c| c.taken.or(c.guess)).collect()
    }

    /// What a person calls a column: its name, or its number.
    pub fn label(&self, column: usize) -> String {
        match self.columns.get(column) {
            Some(c) if !c.name.is_empty() => c.name.clone(),
            _ => format!("column {}", column + 1),
        }
    }
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Overview {
    /// The file's name, without its folder.
    pub file: String,
    /// What a file dialog calls its format.
    pub format: &'static str,
    /// Its tables, at least one.
    pub tables: Vec<TableOverview>,
}

impl Overview {
    /// The table to look at first: one in which something is taken for a motion, or else the one with the most numbers.
    pub fn main(&self) -> usize {
        let moves = |t: &TableOverview| {
            t.columns
                .iter()
                .any(|c| matches!(c.taken, Some(ColumnUse::Channel(role)) if !matches!(role, Role::Input(_))))
        };
        let size = |t: &TableOverview| t.rows.saturating_mul(t.columns.len());
        let largest = || (0..self.tables.len()).max_by_key(|i| (size(&self.tables[*i]), self.tables.len() - i));
        self.tables.iter().position(moves).or_else(largest).unwrap_or(0)
    }
}

/// Numbers columns that are taken for one quantity by names without a number, such as `force_left` and `force_right`.
fn number_the_alike(taken: &mut [Option<ColumnKey>]) {
    for quantity in
        [ColumnQuantity::Displacement, ColumnQuantity::Velocity, ColumnQuantity::Acceleration, ColumnQuantity::Input]
    {
        let of_quantity = || taken.iter().flatten().filter(|key| key.quantity == quantity);
        if of_quantity().filter(|key| key.number.is_none()).count() < 2 {
            continue;
        }
        let used: Vec<usize> = of_quantity().filter_map(|key| key.number).collect();
        let mut free = (1..).filter(|number| !used.contains(number));
        for key in taken.iter_mut().flatten().filter(|key| key.quantity == quantity && key.number.is_none()) {
            key.number = free.next();
        }
    }
}

/// Samples a second by the first values of the time, if they rise evenly, Hz.
fn rate_of(columns: &[ColumnOverview]) -> Option<f64> {
    let time = columns.iter().find(|c| c.taken.or(c.guess) == Some(ColumnUse::Time))?;
    let factor = match time.unit.as_str() {
        "" => 1.0,
        unit => units::parse(unit).filter(units::Unit::is_time)?.factor,
    };
    let mut steps: Vec<f64> = time.first.windows(2).map(|w| (w[1] - w[0]) * factor).collect();
    steps.sort_by(f64::total_cmp);
    let middle = *steps.get(steps.len() / 2)?;
    // Rounded stamps: the mean of all steps is nearer to the truth than any of them.
    let mean = (time.first.last()? - time.first.first()?) * factor / steps.len() as f64;
    (middle > 0.0 && (mean / middle - 1.0).abs() < 0.2).then(|| sindyscope_core::sampling::significant(mean.recip(), 4))
}

/// What a [`ColumnMap`] calls each column.
fn references(headings: &[Heading]) -> Vec<String> {
    let lower: Vec<String> = headings.iter().map(|h| h.name.to_lowercase()).collect();
    let mut counts = std::collections::HashMap::new();
    for name in &lower {
        *counts.entry(name.as_str()).or_insert(0usize) += 1;
    }
    // A name with an equals sign or a quote in it would be read otherwise than it was written.
    let plain = |name: &str| !name.is_empty() && !name.contains(['=', '"']) && name.trim_matches(',') == name;
    headings
        .iter()
        .zip(&lower)
        .enumerate()
        .map(|(c, (heading, lower))| {
            if plain(&heading.name) && counts[lower.as_str()] == 1 { heading.name.clone() } else { (c + 1).to_string() }
        })
        .collect()
}
