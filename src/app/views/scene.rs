//! One record of an outcome as the views see it: symbols, units, series.

use crate::app::plot::palette::Painted as _;
use std::sync::Arc;

use super::{Picture, ViewState};
use crate::app::plot::decimate::Samples;
use crate::app::plot::palette::Ink;
use crate::app::plot::units::{Scale, per_second};
use sindyscope_core::study::{Outcome, RecordOutcome};
use sindyscope_values::record::Role;
use sindyscope_values::term::{Kind, Layout, Symbol};

/// Share of its strength that what is shown loses while a newer outcome is being computed.
const STALE_FADE: f32 = 0.45;

/// Seconds over which it fades: an outcome that comes at once leaves no flicker.
const FADE_TIME: f32 = 0.6;

pub(super) struct Scene<'a> {
    pub(super) outcome: &'a Arc<Outcome>,
    pub(super) record: &'a RecordOutcome,
    /// The same record of the outcome before.
    pub(super) before: Option<&'a RecordOutcome>,
    pub(super) index: usize,
    pub(super) layout: Layout,
    /// The degree of freedom or state shown.
    pub(super) freedom: usize,
    /// The input shown.
    pub(super) input: usize,
    pub(super) dark: bool,
    strength: f32,
}

impl<'a> Scene<'a> {
    /// The scene of a picture; none if its outcome has no record.
    pub(super) fn new(ui: &egui::Ui, picture: &Picture<'a>, state: &mut ViewState) -> Option<Self> {
        let records = &picture.outcome.records;
        let index = picture.record.min(records.len().checked_sub(1)?);
        let record = &records[index];
        let before = picture
            .previous
            .and_then(|outcome| outcome.records.iter().find(|r| Arc::ptr_eq(&r.record, &record.record)));
        let layout = picture.outcome.model.layout;
        let freedom = state.freedom.min(layout.freedoms.saturating_sub(1));
        let input = state.input.min(layout.inputs.saturating_sub(1));
        state.cache.attend_to(picture, [index, freedom, input]);
        let fade = ui.ctx().animate_bool_with_time(egui::Id::unique("stale views"), picture.stale, FADE_TIME);
        Some(Self {
            outcome: picture.outcome,
            record,
            before,
            index,
            layout,
            freedom,
            input,
            dark: ui.visuals().dark_mode,
            strength: 1.0 - STALE_FADE * fade,
        })
    }

    /// The colour of an ink in this theme; what an outcome decides is faded while it is stale.
    pub(super) fn color(&self, ink: Ink) -> egui::Color32 {
        let color = ink.color(self.dark);
        match ink {
            Ink::Identified | Ink::Error | Ink::Diverged => color.gamma_multiply(self.strength),
            _ => color,
        }
    }

    pub(super) fn second_order(&self) -> bool {
        self.layout.kind == Kind::SecondOrder
    }

    /// A series of this record's samples.
    pub(super) fn samples<'s>(&self, values: &'s [f64]) -> Samples<'s> {
        Samples { values, start: self.record.record.start, interval: self.interval() }
    }

    /// Sampling interval, s; one second for a record of a single sample that does not tell it.
    pub(super) fn interval(&self) -> f64 {
        let interval = self.record.record.interval;
        if interval > 0.0 && interval.is_finite() { interval } else { 1.0 }
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
        self.record.signals.rates.get(state).map_or(&[], Vec::as_slice)
    }

    /// Simulated state, as long as the response lasted.
    pub(super) fn simulated(&self, state: usize) -> &'a [f64] {
        simulated(self.record, state)
    }

    pub(super) fn channel(&self) -> Option<&'a sindyscope_core::study::SensorResponse> {
        self.record.channels.get(self.freedom)
    }

    pub(super) fn channel_before(&self) -> Option<&'a sindyscope_core::study::SensorResponse> {
        self.before.and_then(|r| r.channels.get(self.freedom))
    }

    /// Name and unit of what the sensor shows; a displacement, or what the record has in its place.
    pub(super) fn shown(&self) -> (String, String) {
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
        let start = self.record.record.start;
        let length = self.interval() * self.record.record.len().saturating_sub(1) as f64;
        let margin = if length > 0.0 { 0.01 * length } else { 0.5 };
        (start - margin, start + length + margin)
    }

    /// Seconds, or their parts where the record is short.
    pub(super) fn time_scale(&self) -> Scale {
        let (low, high) = self.time_range();
        Scale::suited(high - low, "s")
    }
}

pub(super) fn simulated(record: &RecordOutcome, state: usize) -> &[f64] {
    record.states.get(state).map_or(&[], Vec::as_slice)
}
