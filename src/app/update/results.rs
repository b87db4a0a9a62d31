//! Taking in what came of the background work.

use std::sync::Arc;

use super::change::{Update, Want, run};
use crate::app::derived::Derived;
use crate::app::jobs::{Done, Key, Part};
use crate::app::purpose::Purpose;
use crate::app::saving::SaveResult;
use crate::app::state::{ClassRound, State};
use crate::app::stream::StreamAct;
use crate::shell::quoted;

/// The time, and whether the pointer holds something: what was changed is shown for a while after it was let go.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameTime {
    /// The window's time, s.
    pub(crate) now: f64,
    pub(crate) held: bool,
}

/// Takes in something on the way.
pub(crate) fn part(state: &mut State, derived: &mut Derived, part: Part, clock: FrameTime) -> Vec<Want> {
    run(state, derived, |update| match part {
        Part::Fitted(outcome) => update.derived.records.take(outcome, clock.held, clock.now),
        Part::Map(map) => update.derived.map.take(map),
        Part::Search(event) => update.derived.missing.take(event),
        Part::Stream(part) => update.derived.stream.take(*part),
    })
}

/// Takes in what came of a job.
pub(crate) fn finished(state: &mut State, derived: &mut Derived, done: Done, clock: FrameTime) -> Vec<Want> {
    run(state, derived, |update| update.finished(done, clock))
}

/// Takes in why a job came to nothing.
pub(crate) fn failed(state: &mut State, derived: &mut Derived, key: &Key, reason: String) -> Vec<Want> {
    run(state, derived, |update| update.failed(key, reason))
}

impl Update<'_> {
    fn finished(&mut self, done: Done, clock: FrameTime) {
        let derived = &mut *self.derived;
        match done {
            Done::Opened(Ok(opened)) => self.opened(*opened),
            Done::Opened(Err(refused)) => self.not_opened(*refused),
            Done::Chosen { asked, choice } => {
                let document = &mut self.state.document;
                choice.take_over(&asked, &mut document.edit.settings);
                if let Some(suggestion) = &mut document.suggestion {
                    let before = suggestion.clone();
                    choice.take_over(&before, suggestion);
                }
                derived.notices.done(format!("Chosen: {}", choice.reason));
            }
            Done::Calibrated { step, found } => self.take_out(step, &found),
            Done::Fitted(outcome) => derived.records.take(outcome, clock.held, clock.now),
            Done::Component(analysis) => derived.component.fit.take(analysis),
            Done::ComponentSearched(found) => derived.component.search.take(found),
            Done::Modes(analysis) => derived.modal.take(analysis),
            Done::ModalSearched(found) => derived.modal.search.take(found),
            Done::Resampled(ensemble) => derived.records.ensemble = Some(Arc::new(ensemble)),
            Done::Pinned(made) => self.brought_back(made),
            Done::Bought(bought) => derived.questions.take(bought),
            Done::Map(map) => derived.map.take(map),
            Done::Searched => derived.missing.done(),
            Done::Streamed => derived.stream.end(None),
            Done::Series(series) => derived.series.take(series),
            Done::Pages(pages, empty) => derived.report.take(pages, empty),
            Done::Recorded(recorded) => derived.rig.take(*recorded, &mut self.state.rig),
            Done::RoundDrawn { case, hidden, description } => {
                let round = ClassRound::new(case, hidden, description);
                derived.rig.class.drawn(&mut self.state.rig.class, Ok(round));
            }
            Done::RoundSearched { index, answered } => {
                derived.rig.class.searched(&mut self.state.rig.class, Ok((index, answered)));
            }
            Done::Columns(overview) => derived.columns.looked(overview),
            Done::Preview(preview) => derived.columns.previewed(preview),
            Done::Effects(text) => derived.missing.effects_file = Some(text),
            // The program goes on from the one; the window asks a person about the other.
            Done::Restored(..) | Done::Nothing | Done::Saved(SaveResult::Taken { .. }) => {}
            Done::Saved(SaveResult::Written { paths, purpose }) => {
                if purpose == Purpose::StreamRecord {
                    self.state.stream.shown = false;
                    self.stream(StreamAct::Close);
                    return self.open(&paths);
                }
                let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
                let names = names.join(" and ");
                derived.notices.done(match purpose {
                    Purpose::SaveEffects => {
                        format!("Saved {names}: sindyscope diagnose FILE --effects {}", quoted(&names))
                    }
                    _ => format!("Saved {names}"),
                });
            }
        }
    }

    fn failed(&mut self, key: &Key, reason: String) {
        let derived = &mut *self.derived;
        match key {
            Key::Open | Key::Save(_) | Key::Effects => derived.notices.error(reason),
            Key::Choose => derived.notices.error(format!("Nothing was chosen: {reason}")),
            Key::Calibrate => derived.notices.error(format!("Nothing was found: {reason}")),
            Key::Fit => derived.records.failure = Some(reason),
            Key::Component => derived.component.fit.fail(reason),
            Key::ComponentSearch => derived.component.search.fail(reason),
            Key::Modes => derived.modal.fail(reason),
            Key::ModalSearch => derived.modal.search.fail(reason),
            Key::ModalFigure(view) => derived.modal.figures.fail(*view, reason),
            Key::Map => derived.map.fail(reason),
            Key::Search => derived.missing.fail(reason),
            Key::Pages => derived.report.fail(reason),
            Key::Rig => derived.rig.fail(reason),
            Key::Stream => derived.stream.end(Some(reason)),
            Key::Series => derived.series.fail(reason),
            Key::DrawRound => derived.rig.class.drawn(&mut self.state.rig.class, Err(reason)),
            Key::SearchRound => derived.rig.class.searched(&mut self.state.rig.class, Err(reason)),
            Key::Figure(view) => derived.figures.fail(*view, reason),
            Key::Session => {
                derived.notices.error(format!("The session was not saved: {reason}; save a project instead"));
            }
            // What they would add to is there without them.
            Key::Restore | Key::Log | Key::Resample | Key::Pins | Key::Answers | Key::Columns | Key::Preview => {}
        }
    }
}
