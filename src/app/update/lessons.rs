//! The virtual rig's room, the lessons and what they notice.

use super::change::Update;
use crate::app::jobs::{Job, Key};
use crate::app::lessons::{self, Facts, FitFacts, LessonAct, ModesFacts, Start};
use crate::app::rig::RigAct;
use crate::app::state::{LessonPosition, Page, Room, Source};
use sindyscope_modes::BaseModel;
use sindyscope_report::modal::modes_in_band;
use sindyscope_values::record::Usage;

impl Update<'_> {
    pub(super) fn rig_act(&mut self, act: RigAct) {
        match act {
            RigAct::Study => {
                if let Some(made) = self.derived.rig.current(&self.state.rig) {
                    self.study_source(Source::Rig(Box::new(made.settings.clone())));
                }
            }
            RigAct::StudyRound => {
                if let Some(case) = self.state.rig.class.given_out().cloned() {
                    self.study_source(Source::Round(case));
                }
            }
            RigAct::Classic(sample) => self.study_source(Source::Sample(sample)),
            RigAct::Begin(id) => self.begin_lesson(&id),
            RigAct::DrawRound => {
                self.derived.rig.class.draws();
                self.want_instead(Key::DrawRound, Job::DrawRound(self.state.rig.class.case.clone()));
            }
            RigAct::SearchRound(index) => {
                let Some(case) = self.state.rig.class.rounds.get(index).map(|round| round.case.clone()) else { return };
                self.derived.rig.class.searches(index);
                self.want_instead(Key::SearchRound, Job::SearchRound { index, case });
            }
            RigAct::StopSearch => {
                self.derived.rig.class.searching = None;
                self.cancel(Key::SearchRound);
            }
            // The window asks for a file.
            RigAct::Save(_) => {}
        }
    }

    /// Opens records of the rig in Identify.
    fn study_source(&mut self, source: Source) {
        self.state.shown.room = Room::Identify;
        if self.state.document.source != source || self.derived.records.records.is_empty() {
            self.open_source(source);
        }
    }

    /// Shows the list of lessons.
    pub(super) fn show_lessons(&mut self) {
        (self.state.shown.room, self.state.rig.page) = (Room::Rig, Page::Lessons);
    }

    fn begin_lesson(&mut self, id: &str) {
        let Some(lesson) = lessons::lesson(id) else { return };
        let position = LessonPosition { lesson: id.to_owned(), step: 0, met: Default::default() };
        self.state.lessons.current = Some(position);
        self.derived.teacher.begin();
        self.state.shown.room = lesson.start.room();
        self.state.shown.cutting = false;
        match lesson.start {
            Start::Sample(sample, view) => {
                self.show_view(view);
                self.open_source(Source::Sample(sample));
            }
            Start::Rig(settings) => {
                self.state.rig.page = Page::Rig;
                (self.state.rig.settings, self.state.rig.usual_library) = (settings(), false);
            }
            Start::Records(settings) => {
                self.state.rig.settings = settings();
                self.open_source(Source::Rig(Box::new(settings())));
            }
        }
    }

    /// Turns the page of the open lesson.
    pub(super) fn lesson(&mut self, ask: LessonAct) {
        let Some((lesson, _)) = lessons::open(&self.state.lessons) else { return };
        match (ask, &mut self.state.lessons.current) {
            (LessonAct::Again, _) => self.begin_lesson(lesson.id),
            (LessonAct::Leave, current) => *current = None,
            (LessonAct::Back, Some(position)) => position.step = position.step.saturating_sub(1),
            (LessonAct::Next, Some(position)) if position.step < lesson.steps.len() => position.step += 1,
            (LessonAct::Back, None) => {}
            (LessonAct::Next, current) => {
                *current = None;
                self.state.lessons.finished.insert(lesson.id.to_owned());
                self.show_lessons();
            }
        }
    }

    /// Notices what was done, once everything has come to rest.
    pub(super) fn teach(&mut self) {
        let rests = self.derived.running.is_empty() && self.wants.is_empty();
        if rests && self.state.lessons.current.is_some() {
            let facts = self.facts();
            self.derived.teacher.watch(&mut self.state.lessons, &facts);
        }
    }

    /// What the window shows, as far as a lesson may ask.
    fn facts(&self) -> Facts {
        let (document, shown, records) = (&self.state.document, &self.state.shown, &self.derived.records);
        let held_out = document.edit.usage.get(shown.record) == Some(&Usage::HeldOut);
        let made = self.derived.rig.current(&self.state.rig);
        let outcome = records.outcome.as_ref().filter(|_| records.failure.is_none());
        let by_modes = document.edit.base.model == BaseModel::Modes && !self.derived.modal.is_stale();
        let modes = self.derived.modal.analysis().filter(|_| by_modes).map(|analysis| ModesFacts {
            frequencies: modes_in_band(analysis).map(|(_, mode)| mode.frequency).collect(),
            by_hand: !document.edit.base.poles.is_empty() || document.edit.base.modes.is_some(),
        });
        Facts {
            room: shown.room,
            modes,
            modal_view: shown.modal.view,
            modal_verdict: self.derived.modal.search.found().filter(|_| by_modes).map(|found| found.verdict()),
            view: shown.view,
            shows_held_out: held_out && shown.room == Room::Identify,
            of_the_rig: matches!(document.source, Source::Rig(_)),
            settings: document.edit.settings.clone(),
            identify: outcome.map(|outcome| FitFacts::of(outcome)),
            segment: records.segment_length(&document.edit.settings.smoothing).1,
            looked: self.derived.missing.looked(),
            added: document.edit.walk.accepted.iter().map(|choice| choice.effect.clone()).collect(),
            rig: self.state.rig.settings.clone(),
            usual_library: self.state.rig.usual_library,
            rig_found: made.and_then(|made| made.outcome.as_ref().ok()).map(|outcome| FitFacts::of(outcome)),
            stuck: made.map_or(0.0, |made| made.run.stuck_share()),
        }
    }
}
