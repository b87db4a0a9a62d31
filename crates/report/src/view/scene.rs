//! One record of an outcome as the views see it: symbols, units, series.

use super::Subject;
use crate::figure::thin::Spacing;
use crate::figure::{Axis, Guide, Panel, Samples, Shape};
use crate::palette::{Ink, Tint};
use sindyscope_core::study::{Outcome, RecordOutcome, SensorResponse};
use sindyscope_values::format::number::significant;
use sindyscope_values::format::units::per_second;
use sindyscope_values::record::{Role, Usage};
use sindyscope_values::term::{Kind, Layout, Symbol};

/// Why there is nothing to show.
pub(super) const NO_RECORD: &str = "No record is marked fit or held out, so there is nothing to show";

/// The name that all axes of time share: they are zoomed together.
const TIME: &str = "time axis";

/// One record of an outcome, and what is chosen of it.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// What was found.
    pub outcome: &'a Outcome,
    /// The record.
    pub record: &'a RecordOutcome,
    /// The same record of the outcome before.
    pub before: Option<&'a RecordOutcome>,
    /// The record's place in the outcome.
    pub index: usize,
    /// States and inputs of the model.
    pub layout: Layout,
    /// The degree of freedom or state shown.
    pub freedom: usize,
    /// The input shown.
    pub input: usize,
}

impl<'a> Scene<'a> {
    /// The scene of a subject.
    ///
    /// # Errors
    /// Its outcome has no record.
    pub fn new(subject: &Subject<'a>) -> Result<Self, String> {
        let records = &subject.outcome.records;
        let last = records.len().checked_sub(1).ok_or(NO_RECORD)?;
        let index = subject.record.min(last);
        let record = &records[index];
        let same = |other: &&RecordOutcome| std::sync::Arc::ptr_eq(&other.record, &record.record);
        let layout = subject.outcome.model.layout;
        Ok(Self {
            outcome: subject.outcome,
            record,
            before: subject.previous.and_then(|outcome| outcome.records.iter().find(same)),
            index,
            layout,
            freedom: subject.options.freedom.min(layout.freedoms.saturating_sub(1)),
            input: subject.options.input.min(layout.inputs.saturating_sub(1)),
        })
    }

    /// Whether accelerations are found from displacements and velocities.
    pub fn second_order(&self) -> bool {
        self.layout.kind == Kind::SecondOrder
    }

    /// Sampling interval, s; one second for a record of a single sample that does not tell it.
    pub(super) fn interval(&self) -> f64 {
        let interval = self.record.record.interval;
        if interval > 0.0 && interval.is_finite() { interval } else { 1.0 }
    }

    /// Where this record's samples lie.
    pub(super) fn spacing(&self) -> Spacing {
        Spacing { start: self.record.record.start, interval: self.interval() }
    }

    /// A series of this record's samples.
    pub(super) fn samples(&self, values: &[f64]) -> Shape {
        Shape::Samples(Samples::new(values, self.spacing()))
    }

    /// What the sensor showed.
    pub(super) fn measured(&self) -> &'a [f64] {
        self.record.record.sensor(self.freedom).map_or(&[], |c| &c.values)
    }

    /// Smoothed state of an index into the state vector.
    pub(super) fn smoothed(&self, state: usize) -> &'a [f64] {
        self.record.signals.states.get(state).map_or(&[], Vec::as_slice)
    }

    /// Rate of the smoothed state.
    pub(super) fn rate(&self, state: usize) -> &'a [f64] {
        self.record.signals.rate(state).unwrap_or(&[])
    }

    /// Simulated state, as long as the response lasted.
    pub(super) fn simulated(&self, state: usize) -> &'a [f64] {
        simulated(self.record, state)
    }

    /// What is compared of the degree of freedom shown.
    pub fn channel(&self) -> Option<&'a SensorResponse> {
        self.record.channels.get(self.freedom)
    }

    /// The same of the outcome before.
    pub(super) fn channel_before(&self) -> Option<&'a SensorResponse> {
        self.before.and_then(|r| r.channels.get(self.freedom))
    }

    /// Name and unit of what the sensor shows; a displacement, or what the record has in its place.
    pub fn shown(&self) -> (String, String) {
        let displacement = || self.layout.name(Symbol::State(self.freedom));
        let name = self.channel().map_or_else(displacement, |c| c.name(&self.layout));
        let unit = self.record.record.sensor(self.freedom).map(|c| c.unit.trim().to_owned());
        (name, unit.unwrap_or_default())
    }

    /// The unit of the displacement (or state) shown; empty if the record does not say.
    pub(super) fn unit(&self) -> String {
        self.unit_of(Role::Displacement(self.freedom))
    }

    pub(super) fn unit_of(&self, role: Role) -> String {
        self.record.record.channel(role).map(|c| c.unit.trim().to_owned()).unwrap_or_default()
    }

    /// Symbol and unit of the rate of the state shown: its velocity, or the rate of a first-order state.
    pub(super) fn rate_label(&self) -> (String, String) {
        let unit = per_second(&self.unit());
        if self.second_order() {
            (self.layout.name(Symbol::Rate(self.freedom)), unit)
        } else {
            (format!("d{}/dt", self.layout.name(Symbol::State(self.freedom))), unit)
        }
    }

    /// Standard deviation of the noise on the displacement shown.
    pub(super) fn noise(&self) -> Option<f64> {
        let own = self.record.signals.noise.get(self.freedom).copied();
        let floor = if self.freedom == 0 { self.outcome.noise_floor.or(own) } else { own };
        floor.filter(|n| *n > 0.0 && n.is_finite())
    }

    /// Whole range of time, with a narrow margin.
    pub(super) fn time_range(&self) -> (f64, f64) {
        time_range(self.spacing(), self.record.record.len())
    }

    /// The axis of time, zoomed together with all others.
    pub(super) fn time(&self) -> Axis {
        Axis::linear("t", "s", self.time_range()).linked(TIME)
    }

    /// A panel over time, with what every one shows: what is held out, and where the response left the data's range.
    pub(super) fn over_time(&self, id: &'static str, y: Axis, first: bool) -> Panel {
        let mut panel = Panel::new(id, self.time(), y);
        if self.record.usage == Usage::HeldOut {
            let spacing = self.spacing();
            let stretches = vec![(spacing.start, spacing.at(self.record.record.len().saturating_sub(1)))];
            let text = if first { "held out".to_owned() } else { String::new() };
            panel.guides.push(Guide::Stretches { tint: Tint::HeldOut, stretches, text });
        }
        if let Some(at) = self.record.diverged_at {
            let text = if first { format!("diverged at t = {} s", significant(at, 4)) } else { String::new() };
            panel.guides.push(Guide::At { ink: Ink::Diverged, at, text });
        }
        panel
    }

    /// How the record is used, in words.
    pub(super) fn usage(&self) -> &'static str {
        match self.record.usage {
            Usage::HeldOut => "held out: never fitted",
            Usage::Fit | Usage::Off => "fitted",
        }
    }
}

/// Time of so many samples, with a narrow margin.
pub(crate) fn time_range(spacing: Spacing, samples: usize) -> (f64, f64) {
    let length = spacing.interval * samples.saturating_sub(1) as f64;
    let margin = if length > 0.0 { 0.01 * length } else { 0.5 };
    (spacing.start - margin, spacing.start + length + margin)
}

pub(super) fn simulated(record: &RecordOutcome, state: usize) -> &[f64] {
    record.states.get(state).map_or(&[], Vec::as_slice)
}
