//! The state while it is changed, and what is wanted of the queue meanwhile.

use crate::app::derived::Derived;
use crate::app::history::History;
use crate::app::jobs::{Job, Key};
use crate::app::queue::JobProgress;
use crate::app::state::{Edit, FoundBeside, State};
use sindyscope_core::study::Settings;
use sindyscope_values::record::RecordSet;

/// What is wanted of the queue.
#[derive(Debug)]
pub(crate) enum Want {
    /// This job; a short run of its key may end before.
    Job(Key, Job),
    /// This job instead of whatever runs under its key.
    Instead(Key, Job),
    /// Nothing more under this key.
    Cancel(Key),
}

/// The state while it is changed.
pub(crate) struct Update<'a> {
    pub(super) state: &'a mut State,
    pub(super) derived: &'a mut Derived,
    pub(super) wants: Vec<Want>,
}

/// Changes the state; what is wanted in the background comes back.
pub(super) fn run(state: &mut State, derived: &mut Derived, change: impl FnOnce(&mut Update<'_>)) -> Vec<Want> {
    let mut update = Update { state, derived, wants: Vec::new() };
    change(&mut update);
    let (document, derived) = (&mut update.state.document, &*update.derived);
    document.found = derived.missing.found().cloned();
    document.beside = FoundBeside { structure: derived.modal.kept(), component: derived.component.searched() };
    update.wants
}

impl Update<'_> {
    /// The records with their use, and the settings.
    pub(super) fn study(&self) -> (RecordSet, Settings) {
        let edit = &self.state.document.edit;
        (self.derived.records.set(&edit.usage), edit.settings.clone())
    }

    pub(super) fn note_step(&mut self) {
        self.derived.history.note(&self.state.document.edit);
    }

    /// Changes the settings: a step of its own for undo.
    pub(super) fn change_settings(&mut self, change: impl FnOnce(&mut Settings)) {
        self.note_step();
        change(&mut self.state.document.edit.settings);
        self.note_step();
    }

    pub(super) fn want(&mut self, key: Key, job: Job) {
        self.derived.running.entry(key.clone()).or_default();
        self.wants.push(Want::Job(key, job));
    }

    pub(super) fn want_instead(&mut self, key: Key, job: Job) {
        self.derived.running.insert(key.clone(), JobProgress::default());
        self.wants.push(Want::Instead(key, job));
    }

    pub(super) fn cancel(&mut self, key: Key) {
        self.derived.running.remove(&key);
        self.wants.push(Want::Cancel(key));
    }

    /// Forgets what can be undone: another document is open.
    pub(super) fn forget_steps(&mut self, edit: &Edit) {
        self.derived.history = History::new(edit.clone());
    }
}
