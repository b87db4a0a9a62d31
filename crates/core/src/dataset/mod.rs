//! Records made ready, once for all who ask: their noise, their smoothed motion, and what drives a simulation along them.

mod drive;

use std::sync::{Arc, OnceLock};

use crate::signal::{SignalFacts, Signals, Smoothing};
use sindyscope_values::record::{Record, RecordSet, Role, metres};
use sindyscope_values::term::{Kind, Layout};

pub use drive::{RANGE_FACTOR, SimulationDrive, output};

/// Records of one layout under one smoothing, in their set's order.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// Numbers of states and inputs of the records.
    pub layout: Layout,
    /// The records, each with its signals.
    pub records: Vec<Prepared>,
}

/// A record with what was computed of it alone.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// What was measured.
    pub record: Arc<Record>,
    /// Its noise and period.
    pub facts: Arc<SignalFacts>,
    smoothing: Smoothing,
    /// It smoothed and differentiated.
    pub signals: Arc<Signals>,
    /// What a simulation needs; none if none was asked for yet.
    drive: OnceLock<Arc<SimulationDrive>>,
    layout: Layout,
}

impl Dataset {
    /// Takes over a set, keeping what is still right; `check` is asked before each record whether to go on.
    ///
    /// # Errors
    /// That of `check`; nothing has changed then.
    pub fn update<E>(
        &mut self,
        records: &RecordSet,
        layout: &Layout,
        smoothing: &Smoothing,
        mut check: impl FnMut() -> Result<(), E>,
    ) -> Result<(), E> {
        let mut prepared = Vec::with_capacity(records.entries.len());
        for (record, _) in &records.entries {
            check()?;
            let known = self.records.iter().find(|p| Arc::ptr_eq(&p.record, record) && p.layout == *layout);
            prepared.push(match known {
                Some(known) if known.smoothing == *smoothing => known.clone(),
                Some(known) => Prepared::new(record, layout, smoothing, Arc::clone(&known.facts)),
                None => Prepared::new(record, layout, smoothing, SignalFacts::cached(record, layout)),
            });
        }
        (self.layout, self.records) = (*layout, prepared);
        Ok(())
    }
}

impl Prepared {
    fn new(record: &Arc<Record>, layout: &Layout, smoothing: &Smoothing, facts: Arc<SignalFacts>) -> Self {
        let signals = Arc::new(Signals::new(record, layout, smoothing, &facts));
        let (drive, layout) = (OnceLock::new(), *layout);
        Self { record: Arc::clone(record), facts, smoothing: *smoothing, signals, drive, layout }
    }

    /// What a simulation of the whole record needs.
    pub fn drive(&self) -> &Arc<SimulationDrive> {
        let Self { record, layout, facts, signals, .. } = self;
        self.drive.get_or_init(|| Arc::new(SimulationDrive::new(record, layout, facts, signals, 0..record.len())))
    }

    /// True if the inputs' noise is next to nothing.
    pub fn is_quiet(&self) -> bool {
        drive::is_quiet(&self.layout, &self.facts, &self.signals)
    }

    /// True if that is what a simulation of it needs.
    pub(crate) fn has_drive(&self, drive: &Arc<SimulationDrive>) -> bool {
        self.drive.get().is_some_and(|own| Arc::ptr_eq(own, drive))
    }

    /// Noise of what tells most of a degree of freedom; zero where nothing does.
    pub(crate) fn sensor_noise(&self, freedom: usize) -> f64 {
        let sensor = self.record.sensor(freedom).map(|c| c.role);
        let index = self.record.channels.iter().position(|c| Some(c.role) == sensor);
        index.and_then(|k| self.facts.channel_noise.get(k).copied()).unwrap_or(0.0)
    }
}

fn is_length(unit: &str) -> bool {
    !unit.is_empty() && metres(unit).is_some()
}

/// True if the layout's inputs move the base: a length or an angle in the displacement's unit, or a name that says so.
///
/// Two voltages are an instrument's input and output: the input stands for a force.
pub fn base_excited(record: &Record, kind: Kind) -> bool {
    let displacement = record.channel(Role::Displacement(0));
    let input = record.channel(Role::Input(0));
    match (kind, displacement, input) {
        (Kind::SecondOrder, Some(x), Some(u)) => {
            u.name.to_lowercase().contains("base") || (u.unit == x.unit && (u.unit == "rad" || is_length(&u.unit)))
        }
        _ => false,
    }
}
