use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

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

    /// Number of measured displacements (or states) and inputs, as equations of the given order.
    pub fn layout(&self, kind: Kind) -> Layout {
        let count = |pick: fn(&Role) -> bool| self.channels.iter().filter(|c| pick(&c.role)).count();
        Layout {
            kind,
            freedoms: count(|r| matches!(r, Role::Displacement(_))),
            inputs: count(|r| matches!(r, Role::Input(_))),
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

    /// The records of a usage.
    pub fn with(&self, usage: Usage) -> impl Iterator<Item = &Arc<Record>> {
        self.entries.iter().filter(move |(_, u)| *u == usage).map(|(r, _)| r)
    }
}
