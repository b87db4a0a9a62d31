//! Records, their channels and what each is used for.

use std::collections::HashSet;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::estimate;
use crate::term::{Kind, Layout};

/// What a channel measures; indices count from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Role {
    /// Displacement of a degree of freedom, or a state of a first-order system.
    Displacement(usize),
    /// Velocity of a degree of freedom.
    Velocity(usize),
    /// Acceleration of a degree of freedom.
    Acceleration(usize),
    /// Force or base displacement.
    Input(usize),
}

impl Role {
    /// The quantity in words.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Displacement(_) => "displacement",
            Self::Velocity(_) => "velocity",
            Self::Acceleration(_) => "acceleration",
            Self::Input(_) => "input",
        }
    }

    /// The quantity's letter, without a number.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Displacement(_) => "x",
            Self::Velocity(_) => "v",
            Self::Acceleration(_) => "a",
            Self::Input(_) => "u",
        }
    }

    /// Its short name, with its number: `a1`, `u2`.
    pub fn short_name(self) -> String {
        format!("{}{}", self.symbol(), self.index() + 1)
    }

    /// The role of a short name, whose number may be left out where it is one: `a`, `u2`; none if a text is none.
    pub fn of_short_name(text: &str) -> Option<Self> {
        let symbol = text.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = if symbol.len() < text.len() { text[symbol.len()..].parse::<usize>().ok()? } else { 1 };
        let index = number.checked_sub(1)?;
        Some(match symbol {
            "x" => Self::Displacement(index),
            "v" => Self::Velocity(index),
            "a" => Self::Acceleration(index),
            "u" => Self::Input(index),
            _ => return None,
        })
    }

    /// Which of several, from zero.
    pub fn index(self) -> usize {
        match self {
            Self::Displacement(i) | Self::Velocity(i) | Self::Acceleration(i) | Self::Input(i) => i,
        }
    }
}

/// One measured quantity of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The header's name, without its unit.
    pub name: String,
    /// What it measures.
    pub role: Role,
    /// The header's unit, or that of an SI quantity left unsaid: empty.
    pub unit: String,
    /// One value a sample, in `unit`; every value is finite.
    pub values: Arc<[f64]>,
    /// No sensor showed it: it was estimated from what was measured, and no model is held against it.
    pub estimated: bool,
}

/// One trajectory: evenly sampled channels of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Short name, unique in its set.
    pub name: String,
    /// The file it was read from.
    pub source: Option<PathBuf>,
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub interval: f64,
    /// Channels, sorted by role; all of one length.
    pub channels: Vec<Channel>,
    /// What was found and done while reading, one sentence each.
    pub notices: Vec<String>,
}

impl Record {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |c| c.values.len())
    }

    /// True if there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Time of sample `index`, s.
    pub fn time(&self, index: usize) -> f64 {
        self.start + self.interval * index as f64
    }

    /// Time from the first to the last sample, s.
    pub fn duration(&self) -> f64 {
        self.interval * self.len().saturating_sub(1) as f64
    }

    /// The channel with a role.
    pub fn channel(&self, role: Role) -> Option<&Channel> {
        self.channels.iter().find(|c| c.role == role)
    }

    /// What tells most of a degree of freedom: its displacement where that was measured, else velocity or acceleration.
    pub fn sensor(&self, freedom: usize) -> Option<&Channel> {
        [Role::Displacement(freedom), Role::Velocity(freedom), Role::Acceleration(freedom)]
            .into_iter()
            .find_map(|role| self.channel(role).filter(|c| !c.estimated))
    }

    /// What tells most of each degree of freedom, the first one first.
    pub fn sensors(&self) -> impl Iterator<Item = &Channel> {
        (0..self.channels.len()).map_while(|freedom| self.sensor(freedom))
    }

    /// The channels that were measured.
    pub fn measured(&self) -> impl Iterator<Item = &Channel> {
        self.channels.iter().filter(|c| !c.estimated)
    }

    /// This record with an estimate of each displacement that no sensor showed but whose velocity or acceleration one did; a
    /// notice names each.
    #[must_use]
    pub fn completed(mut self) -> Self {
        self.notices.extend(estimate::complete(&mut self.channels, self.interval));
        self
    }

    /// The samples of a range of indices, cut to those that there are; the name stays.
    pub fn slice(&self, range: Range<usize>) -> Self {
        let end = range.end.min(self.len());
        let range = range.start.min(end)..end;
        let cut = |c: &Channel| Channel { values: c.values[range.clone()].into(), ..c.clone() };
        Self { start: self.time(range.start), channels: self.channels.iter().map(cut).collect(), ..self.clone() }
    }

    /// The samples from one time up to, and without, another, s.
    pub fn between(&self, from: f64, to: f64) -> Self {
        self.slice(self.index_at(from)..self.index_at(to))
    }

    /// The first sample at a time or after it; the number of samples if there is none.
    pub fn index_at(&self, time: f64) -> usize {
        // A time that came from an index must lead back to it, whatever the last digit.
        let position = ((time - self.start) / self.interval - 1e-6).ceil();
        (position.max(0.0) as usize).min(self.len())
    }

    /// The samples before a time, and those from it on.
    pub fn split_at(&self, time: f64) -> (Self, Self) {
        let index = self.index_at(time);
        (self.slice(0..index), self.slice(index..self.len()))
    }

    /// Number of measured displacements (or states) and inputs, as equations of the given order.
    pub fn layout(&self, kind: Kind) -> Layout {
        let count = |pick: fn(&Role) -> bool| self.channels.iter().filter(|c| pick(&c.role)).count();
        Layout {
            kind,
            freedoms: count(|r| matches!(r, Role::Displacement(_))),
            inputs: count(|r| matches!(r, Role::Input(_))),
            internals: 0,
        }
    }
}

/// What a record is used for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Usage {
    /// Fitted and simulated.
    #[default]
    Fit,
    /// Never fitted, only simulated and scored.
    HeldOut,
    /// Left out.
    Off,
}

/// Records with their usage; cheap to clone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordSet {
    /// Each record with what it is used for.
    pub entries: Vec<(Arc<Record>, Usage)>,
}

impl RecordSet {
    /// A set in which every record has one usage.
    pub fn new(records: impl IntoIterator<Item = Record>, usage: Usage) -> Self {
        Self { entries: records.into_iter().map(|r| (Arc::new(r), usage)).collect() }
    }

    /// What was found and done while reading its records, each sentence once.
    pub fn notices(&self) -> Vec<&str> {
        super::notices(self.entries.iter().map(|(record, _)| &**record))
    }

    /// The records of a usage.
    pub fn with(&self, usage: Usage) -> impl Iterator<Item = &Arc<Record>> {
        self.entries.iter().filter(move |(_, u)| *u == usage).map(|(r, _)| r)
    }

    /// Adds records, whose names are changed where the set has them already.
    pub fn add(&mut self, records: impl IntoIterator<Item = Record>, usage: Usage) {
        let mut taken: HashSet<String> = self.entries.iter().map(|(r, _)| r.name.clone()).collect();
        for mut record in records {
            // Its file's name before it says more than a number behind it.
            let stem = record.source.as_ref().and_then(|s| s.file_stem()).map(|s| s.to_string_lossy().into_owned());
            let with_stem = stem.filter(|s| *s != record.name).map(|s| format!("{s} {}", record.name));
            let counted = (2..).map(|n| format!("{} ({n})", record.name));
            let mut names = [Some(record.name.clone()), with_stem].into_iter().flatten().chain(counted);
            let name = names.find(|name| !taken.contains(name));
            drop(names);
            record.name = name.unwrap_or_default();
            taken.insert(record.name.clone());
            self.entries.push((Arc::new(record), usage));
        }
    }

    /// What all records that are not off measure: displacements (or states) and inputs, with their units.
    ///
    /// # Errors
    /// No such record, one without displacements, or two that measure different things; the sentence says which and what.
    pub fn layout(&self, kind: Kind) -> Result<Layout, String> {
        let mut used = self.entries.iter().filter(|(_, usage)| *usage != Usage::Off).map(|(record, _)| record);
        let first = used.next().ok_or("there is no record to use")?;
        let layout = first.layout(kind);
        if layout.freedoms == 0 {
            return Err(format!("record `{}` has no displacement, and none was estimated", first.name));
        }
        for other in used {
            if let Some(difference) = first.difference(other) {
                return Err(difference);
            }
        }
        Ok(layout)
    }
}

impl Record {
    /// What tells another record's displacements and inputs from this one's, in a sentence.
    fn difference(&self, other: &Self) -> Option<String> {
        let several = |role: Role| {
            let like = |c: &&Channel| c.role.symbol() == role.symbol();
            self.channels.iter().filter(like).count().max(other.channels.iter().filter(like).count()) > 1
        };
        let words = |role: Role| {
            let number = if several(role) { (role.index() + 1).to_string() } else { String::new() };
            format!("{} {}{number}", role.noun(), role.symbol())
        };
        let counts = |c: &&Channel| matches!(c.role, Role::Displacement(_) | Role::Input(_));
        for (one, two) in [(self, other), (other, self)] {
            for channel in one.channels.iter().filter(counts) {
                let Some(same) = two.channel(channel.role) else {
                    let (role, one, two) = (words(channel.role), &one.name, &two.name);
                    return Some(format!("record `{two}` has no {role}, record `{one}` has"));
                };
                if !channel.unit.is_empty() && !same.unit.is_empty() && channel.unit != same.unit {
                    let (role, one, two) = (words(channel.role), &one.name, &two.name);
                    let (unit, other) = (&channel.unit, &same.unit);
                    return Some(format!("{role} is in {unit} in record `{one}` and in {other} in record `{two}`"));
                }
            }
        }
        None
    }
}
