//! The records that are open, and what the last study says of them.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use sindyscope_core::prepare::PrepareError;
use sindyscope_core::signal::Smoothing;
use sindyscope_core::study::{Ensemble, Inclusion, Outcome, suggested_half_width};
use sindyscope_rig::Truth;
use sindyscope_values::model::Units;
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Kind, Layout, Symbol, Term};

/// How long after a change the response before it stays in view, s.
const GHOST: f64 = 1.2;

/// What a source holds.
#[derive(Clone, Debug)]
pub(crate) struct Read {
    /// A name for all records.
    pub(crate) title: String,
    pub(crate) set: RecordSet,
    /// What the records hide, if the virtual rig made them blind.
    pub(crate) truth: Option<Truth>,
}

/// The records that are open and what is known of them.
#[derive(Debug, Default)]
pub(crate) struct OpenRecords {
    /// The records, prepared, in the order of reading.
    pub(crate) records: Vec<Arc<Record>>,
    /// The records as they were measured, before any step of the preparation.
    pub(crate) raw: RecordSet,
    /// Why a step was not done, for each of them.
    pub(crate) undone: Vec<Option<PrepareError>>,
    /// A name for them all: a file's, or a sample's.
    pub(crate) title: String,
    /// Changes whenever other records are opened, so that a late answer is recognised.
    pub(crate) generation: u64,
    /// What the records hide, if the virtual rig made them blind.
    pub(crate) truth: Option<Truth>,
    /// The last outcome, if there is one.
    pub(crate) outcome: Option<Arc<Outcome>>,
    /// The outcomes of the document's pins; none where it is not known.
    pub(crate) pins: Vec<Option<Arc<Outcome>>>,
    /// How sure its terms are; for a moment still that of the outcome before.
    pub(crate) ensemble: Option<Arc<Ensemble>>,
    /// Why the newest settings have no outcome.
    pub(crate) failure: Option<String>,
    /// The outcome before the change that is under way.
    ghost: Option<Arc<Outcome>>,
    ghost_until: f64,
    /// Coefficients that the last outcome changed, with the time of the change.
    flashes: HashMap<(Symbol, Term), f64>,
}

impl OpenRecords {
    /// Puts other records in place of these, which come back.
    pub(crate) fn open(&mut self, records: Vec<Arc<Record>>, read: Read, undone: Vec<Option<PrepareError>>) -> Self {
        let Read { title, set: raw, truth } = read;
        let generation = self.generation + 1;
        std::mem::replace(self, Self { records, raw, undone, title, generation, truth, ..Self::default() })
    }

    /// No record is open any more.
    pub(crate) fn close(&mut self) {
        *self = Self { generation: self.generation + 1, ..Self::default() };
    }

    /// The records as they were read.
    pub(crate) fn read(&self) -> Read {
        Read { title: self.title.clone(), set: self.raw.clone(), truth: self.truth.clone() }
    }

    /// The outcomes of the pins that are known, each with its place among the pins.
    pub(crate) fn known_pins(&self) -> (Vec<usize>, Vec<Arc<Outcome>>) {
        let known = |(index, pin): (usize, &Option<Arc<Outcome>>)| Some((index, Arc::clone(pin.as_ref()?)));
        self.pins.iter().enumerate().filter_map(known).unzip()
    }

    /// The title without its ending, for the names of files.
    pub(crate) fn stem(&self, otherwise: &str) -> String {
        let stem = Path::new(&self.title).file_stem();
        stem.map_or_else(|| otherwise.to_owned(), |stem| stem.to_string_lossy().into_owned())
    }

    /// The record as it was measured that a prepared one came from.
    pub(crate) fn origin(&self, prepared: usize) -> Option<&Arc<Record>> {
        let name = &self.records.get(prepared)?.name;
        let whole = |raw: &Record| raw.name == *name;
        // The part that is held out bears the whole's name and the time from which on it lasts.
        let part = |raw: &Record| name.strip_prefix(raw.name.as_str()).is_some_and(|rest| rest.starts_with(" from "));
        let raw = || self.raw.entries.iter().map(|(record, _)| record);
        raw().find(|r| whole(r)).or_else(|| raw().filter(|r| part(r)).max_by_key(|r| r.name.len()))
    }

    /// Where a record stands among an outcome's, which lacks those that are off; the first where it is not there.
    pub(crate) fn place_in(&self, outcome: &Outcome, index: usize) -> usize {
        let record = self.records.get(index);
        let is_it = |r: &Arc<Record>| record.is_some_and(|record| Arc::ptr_eq(record, r));
        outcome.records.iter().position(|r| is_it(&r.record)).unwrap_or(0)
    }

    /// The records with their usage.
    pub(crate) fn set(&self, usage: &[Usage]) -> RecordSet {
        let usage = |i: usize| usage.get(i).copied().unwrap_or_default();
        RecordSet { entries: self.records.iter().enumerate().map(|(i, r)| (Arc::clone(r), usage(i))).collect() }
    }

    /// Numbers of states and inputs.
    pub(crate) fn layout(&self, kind: Kind) -> Layout {
        self.records.first().map_or_else(Layout::default, |r| r.layout(kind))
    }

    /// Takes an outcome; `held` tells whether the pointer still drags.
    pub(crate) fn take(&mut self, outcome: Arc<Outcome>, held: bool, now: f64) {
        self.failure = None;
        if let Some(old) = self.outcome.take() {
            self.note_changes(&old, &outcome, now);
            if self.ghost.is_none() {
                self.ghost = Some(old);
            }
            self.ghost_until = if held { f64::INFINITY } else { now + GHOST };
        }
        self.outcome = Some(outcome);
    }

    /// Lets the ghost go once the drag has ended and some time has passed; tells after how long to look again.
    pub(crate) fn fade(&mut self, held: bool, now: f64) -> Option<f64> {
        self.ghost.as_ref()?;
        if held {
            self.ghost_until = f64::INFINITY;
            return None;
        }
        if self.ghost_until.is_infinite() {
            self.ghost_until = now + GHOST;
        }
        if now >= self.ghost_until {
            self.ghost = None;
            return None;
        }
        Some(self.ghost_until - now)
    }

    /// The outcome before the change that is under way or just over.
    pub(crate) fn ghost(&self) -> Option<&Arc<Outcome>> {
        self.ghost.as_ref()
    }

    /// Seconds since the last change of a coefficient.
    pub(crate) fn since_change(&self, state: Symbol, term: &Term, now: f64) -> Option<f64> {
        self.flashes.get(&(state, term.clone())).map(|at| now - at)
    }

    /// How sure a term is, if that is known.
    pub(crate) fn inclusion(&self, state: Symbol, term: &Term) -> Option<&Inclusion> {
        self.ensemble.as_ref()?.term(state, term)
    }

    fn note_changes(&mut self, old: &Outcome, new: &Outcome, now: f64) {
        self.flashes.retain(|_, at| now - *at < 2.0);
        if old.model.layout != new.model.layout {
            return;
        }
        for ((state, before), (_, after)) in old.model.iter().zip(new.model.iter()) {
            for term in &after.terms {
                // A change that the digits shown do not tell is none.
                let visible = term.std_error.unwrap_or(0.0).max(1e-4 * term.coefficient.abs());
                let moved = before.coefficient(&term.term).is_none_or(|c| (c - term.coefficient).abs() > visible);
                if moved {
                    self.flashes.insert((state, term.term.clone()), now);
                }
            }
        }
    }

    /// The shortest record that is fitted, samples.
    pub(crate) fn shortest(&self, usage: &[Usage]) -> usize {
        let fitted = |i: usize| usage.get(i).copied().unwrap_or_default() == Usage::Fit;
        let lengths = self.records.iter().enumerate().filter(|(i, _)| fitted(*i)).map(|(_, r)| r.len());
        lengths.min().unwrap_or_else(|| self.records.first().map_or(0, |r| r.len()))
    }

    /// The longest segment that the slider offers, samples: odd, two of the longest main periods if that is known, and
    /// never more than a third of the shortest record.
    pub(crate) fn longest_segment(&self, usage: &[Usage]) -> usize {
        let third = (self.shortest(usage) / 3).max(5);
        let periods = self.outcome.iter().flat_map(|o| &o.records).filter_map(|r| {
            let period = r.signals.main_period?;
            Some((2.0 * period / r.signals.interval) as usize)
        });
        let most = periods.max().unwrap_or(501).max(51).min(third);
        most - usize::from(most % 2 == 0)
    }

    /// The half width of the weak form's test functions that the fitted records suggest, samples, once they are known.
    pub(crate) fn suggested_half_width(&self) -> Option<usize> {
        let outcome = self.outcome.as_ref()?;
        let fitted = outcome.records.iter().filter(|r| r.usage == Usage::Fit).map(|r| &*r.signals);
        Some(suggested_half_width(fitted))
    }

    /// A segment's length in milliseconds and in main periods of the first fitted record.
    pub(crate) fn segment_length(&self, smoothing: &Smoothing) -> (Option<f64>, Option<f64>) {
        let record = self.outcome.as_ref().and_then(|o| o.records.iter().find(|r| r.usage == Usage::Fit));
        let interval = record.map(|r| r.signals.interval).or_else(|| self.records.first().map(|r| r.interval));
        let length = interval.map(|h| h * smoothing.window as f64);
        let share = record.and_then(|r| r.signals.main_period).zip(length).map(|(period, length)| length / period);
        (length, share)
    }

    /// The units of what terms are made of.
    pub(crate) fn units(&self, kind: Kind) -> Units {
        self.records.first().map_or_else(Units::default, |r| Units::from_record(r, &r.layout(kind)))
    }

    /// The unit of what the first sensor shows.
    pub(crate) fn unit(&self) -> &str {
        let channel = self.records.first().and_then(|r| r.sensor(0));
        channel.map_or("", |c| c.unit.as_str())
    }
}
