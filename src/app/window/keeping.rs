//! What is kept: the session, the project, the pins.

use std::path::PathBuf;
use std::sync::Arc;

use egui::Context;

use super::App;
use crate::app::jobs::{Job, Key};
use crate::app::project::{Project, Shown};
use crate::app::session::{self, Keeper};
use crate::app::state::{Pin, State};
use sindyscope_core::prepare::prepare_leniently;
use sindyscope_core::study::Outcome;
use sindyscope_values::record::{Record, Usage};

impl App {
    /// The window as the session's file says it was left, or with files in it; all that a person decides is written there
    /// within a second, so that not even a crash loses it.
    pub fn revived(ctx: &Context, session: PathBuf, files: Vec<PathBuf>) -> Self {
        let (state, problem) = session::load(&session);
        let mut app = Self::with_state(ctx, state.unwrap_or_default().with_files(files));
        if let Some(problem) = problem {
            app.notices.error(problem);
        }
        app.keeper = Some(Keeper::new(session));
        app
    }

    /// What survives a restart.
    pub fn state(&self) -> State {
        let mut state = self.state.clone();
        state.step = self.missing.step();
        state.found = self.missing.found().cloned();
        if !self.bench.records.is_empty() {
            state.edit = Some(self.edit.clone());
            state.suggestion = Some(self.suggestion.clone());
        }
        state
    }

    /// Has the state written once it has changed and nothing is being dragged.
    pub(super) fn keep(&mut self, ctx: &Context) {
        let (now, held) = ctx.input(|i| (i.time, i.pointer.any_down()));
        if held {
            return;
        }
        let Some(wait) = self.keeper.as_ref().map(|keeper| keeper.wait(now)) else { return };
        if let Some(wait) = wait {
            return ctx.request_repaint_after_secs(wait as f32);
        }
        let state = self.state();
        if let Some(keeper) = &mut self.keeper
            && let Some(text) = keeper.text(&state, now)
        {
            self.jobs.want(Key::Session, Job::Session { path: keeper.path().to_owned(), text });
        }
    }

    /// Keeps what was done with the source that is open, for when it is opened again.
    pub(super) fn leave(&mut self) {
        let State { edit, found, .. } = self.state();
        self.state.keep_edit(edit, found);
    }

    /// What is pinned, and what waits to be made again.
    pub(super) fn pins(&self) -> Vec<Pin> {
        self.waiting_pins.iter().chain(&self.bench.pinned).cloned().collect()
    }

    /// Pins what is shown.
    pub(super) fn pin(&mut self, outcome: Arc<Outcome>) {
        let of = |record: &Arc<Record>| outcome.records.iter().find(|r| Arc::ptr_eq(&r.record, record));
        let usage = self.bench.records.iter().map(|r| of(r).map_or(Usage::Off, |r| r.usage)).collect();
        self.bench.pinned.push(Pin { settings: outcome.settings.clone(), usage, steps: self.edit.steps.clone() });
        self.bench.pins.push(outcome);
        self.keep_pins();
    }

    /// Lets go of a pin.
    pub(super) fn unpin(&mut self, index: usize) {
        self.bench.pins.remove(index);
        self.bench.pinned.remove(index);
        self.keep_pins();
    }

    /// Keeps the pins for the next time that these records are open.
    pub(super) fn keep_pins(&mut self) {
        let pins = self.pins();
        self.state.keep_pins(&self.state.source.clone(), pins);
    }

    /// Makes the outcomes of pins again; those of another order wait until the records are read for it.
    pub(super) fn bring_back(&mut self, pins: Vec<Pin>) {
        let kind = self.state.reading.kind;
        let (now, later) = pins.into_iter().partition(|p: &Pin| p.settings.kind == kind);
        self.waiting_pins = later;
        let now: Vec<Pin> = now;
        if !now.is_empty() {
            self.waiting_pins.extend(now.iter().cloned());
            let of = |pin: Pin| {
                if pin.steps == self.edit.steps {
                    return (self.bench.set(&pin.usage), pin.settings);
                }
                let (mut set, _) = prepare_leniently(&self.bench.raw, &pin.steps);
                for ((_, usage), own) in set.entries.iter_mut().zip(&pin.usage) {
                    *usage = *own;
                }
                (set, pin.settings)
            };
            let pins = now.into_iter().map(of).collect();
            self.jobs.want_instead(Key::Pins, Job::Pins(pins));
        }
    }

    /// Puts outcomes that were made again where they were pinned.
    pub(super) fn brought_back(&mut self, made: Vec<Option<Arc<Outcome>>>) {
        let kind = self.state.reading.kind;
        let (mine, others): (Vec<Pin>, Vec<Pin>) =
            std::mem::take(&mut self.waiting_pins).into_iter().partition(|p| p.settings.kind == kind);
        self.waiting_pins = others;
        let lost = made.iter().filter(|m| m.is_none()).count();
        if lost > 0 {
            self.notices.note(format!("{lost} of {} pins could not be made again from these records", made.len()));
        }
        let made = made.into_iter().zip(mine).filter_map(|(outcome, pin)| Some((outcome?, pin)));
        let newer = std::mem::take(&mut self.bench.pins).into_iter().zip(std::mem::take(&mut self.bench.pinned));
        (self.bench.pins, self.bench.pinned) = made.chain(newer).unzip();
        self.keep_pins();
    }

    /// The project as it would be saved now.
    pub(super) fn project(&self) -> Project {
        let usage = self.bench.records.iter().zip(&self.edit.usage).map(|(r, u)| (r.name.clone(), *u)).collect();
        let State { source, reading, found, room, step, view, views, rig, .. } = self.state();
        let record = self.bench.records.get(self.state.record).map_or(String::new(), |r| r.name.clone());
        Project::new(source, reading, usage, &self.edit)
            .with_checksums(&self.state.checksums)
            .with_found(found)
            .with_pins(self.pins())
            .with_shown(Shown { room, step, view, record, views })
            .with_rig(rig)
    }
}
