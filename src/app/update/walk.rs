//! "What's missing": acts of its room, the walk that comes back, and pins.

use std::sync::Arc;

use super::change::Update;
use crate::app::jobs::{Job, Key, PinnedStudy};
use crate::app::missing::{WalkAct, WantedSearch};
use crate::app::state::{Document, Pin, Room};
use sindyscope_core::study::Outcome;
use sindyscope_values::record::{Record, Usage};

impl Update<'_> {
    /// Does what the room "What's missing" asks for.
    pub(super) fn walk(&mut self, act: WalkAct) {
        match act {
            WalkAct::Use => match self.derived.missing.taken_over(&self.state.document.edit) {
                Some(Ok(settings)) => {
                    self.change_settings(|old| *old = settings);
                    self.state.shown.room = Room::Identify;
                    self.derived.notices.done("The model of the walk is the equation here; undo takes it back");
                }
                Some(Err(problem)) => self.derived.notices.error(problem),
                None => {}
            },
            act => {
                let (document, view) = (&mut self.state.document, &mut self.state.shown.walk);
                let wanted = self.derived.missing.act(act, &self.derived.records, &mut document.edit, view);
                self.search(wanted);
            }
        }
    }

    /// Asks for the search that the room wants.
    pub(super) fn search(&mut self, wanted: Option<WantedSearch>) {
        match wanted {
            Some(WantedSearch::Search(request)) => self.want_instead(Key::Search, Job::Search(request)),
            Some(WantedSearch::Nothing) => self.cancel(Key::Search),
            None => {}
        }
    }

    /// Brings back what was kept with a document of what was found missing.
    pub(super) fn bring_back_findings(&mut self, document: &Document) {
        let wanted = self.derived.missing.bring_back(document.found.clone());
        self.search(wanted);
        self.derived.modal.bring_back(document.beside.structure.clone());
        self.derived.component.bring_back(document.beside.component);
    }

    /// Pins what is shown.
    pub(super) fn pin(&mut self) {
        let Some(outcome) = self.derived.records.outcome.clone() else { return };
        let used = |record: &Arc<Record>| outcome.records.iter().find(|r| Arc::ptr_eq(&r.record, record));
        let usage = self.derived.records.records.iter().map(|r| used(r).map_or(Usage::Off, |r| r.usage)).collect();
        let steps = self.state.document.edit.steps.clone();
        self.state.document.pins.push(Pin { settings: outcome.settings.clone(), usage, steps });
        self.derived.records.pins.push(Some(outcome));
    }

    /// Lets go of a pin.
    pub(super) fn unpin(&mut self, index: usize) {
        if index < self.state.document.pins.len() {
            self.state.document.pins.remove(index);
            self.derived.records.pins.remove(index);
        }
    }

    /// Asks for the outcomes of the pins again; those of another order wait until the records are read for it.
    pub(super) fn bring_back_pins(&mut self) {
        let document = &self.state.document;
        let records = &mut self.derived.records;
        records.pins = vec![None; document.pins.len()];
        let mut pinned = Vec::new();
        for (index, pin) in document.pins.iter().enumerate() {
            if pin.settings.kind != document.reading.kind {
                continue;
            }
            // Those that are prepared otherwise are prepared with the study.
            let (records, steps) = if pin.steps == document.edit.steps {
                (records.set(&pin.usage), None)
            } else {
                (records.raw.clone(), Some(pin.steps.clone()))
            };
            pinned.push(PinnedStudy {
                index,
                records,
                steps,
                usage: pin.usage.clone(),
                settings: pin.settings.clone(),
            });
        }
        if !pinned.is_empty() {
            self.want_instead(Key::Pins, Job::Pins(pinned));
        }
    }

    /// Puts outcomes that were made again where they were pinned; what cannot be made again is let go of.
    pub(super) fn brought_back(&mut self, made: Vec<(usize, Option<Arc<Outcome>>)>) {
        let (count, mut lost) = (made.len(), Vec::new());
        for (index, outcome) in made {
            match self.derived.records.pins.get_mut(index) {
                Some(pin) if outcome.is_some() => *pin = outcome,
                _ => lost.push(index),
            }
        }
        for index in lost.iter().rev() {
            self.unpin(*index);
        }
        if !lost.is_empty() {
            let text = format!("{} of {count} pins could not be made again from these records", lost.len());
            self.derived.notices.note(text);
        }
    }
}
