//! The virtual rig's room, the lessons and what they notice.

use egui::Ui;

use super::App;
use crate::app::dialogs::Purpose;
use crate::app::lessons::{self, Ask, Facts, Found, Position, Start};
use crate::app::open::Opening;
use crate::app::panel;
use crate::app::rig::{Act, Page};
use crate::app::state::{Room, Source};
use sindyscope_values::record::Usage;

impl App {
    /// The columns beside the rig.
    pub(super) fn rig_columns(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        let mut acts = Vec::new();
        panel::controls(ui, |ui| acts.extend(self.rig.controls(ui, &mut self.state.rig)));
        panel::findings(ui, |ui| acts.extend(self.rig.findings(ui, &mut self.state.rig)));
        for act in acts {
            self.rig_act(act, frame);
        }
    }

    /// The rig's room itself.
    pub(super) fn rig_centre(&mut self, ui: &mut Ui, frame: &eframe::Frame) {
        for act in self.rig.show(ui, &mut self.state.rig, &self.state.lessons) {
            self.rig_act(act, frame);
        }
    }

    fn rig_act(&mut self, act: Act, frame: &eframe::Frame) {
        match act {
            Act::Study => {
                let made = self.rig.current(&self.state.rig);
                if let Some(settings) = made.map(|made| made.settings.clone()) {
                    self.study(Source::Rig(Box::new(settings)));
                }
            }
            Act::StudyRound => {
                if let Some(case) = self.state.rig.class.given_out().cloned() {
                    self.study(Source::Round(case));
                }
            }
            Act::Save(purpose) => {
                let name = match purpose {
                    Purpose::Rounds => "rounds.csv".to_owned(),
                    Purpose::RoundRecords => format!("round-{}.csv", self.state.rig.class.rounds.len()),
                    _ => "virtual-rig.csv".to_owned(),
                };
                self.dialogs.ask(purpose, &name, frame);
            }
            Act::Begin(id) => self.begin_lesson(id),
            Act::DrawRound | Act::SearchRound(_) | Act::StopSearch => self.class_act(&act),
        }
    }

    /// Opens records of the rig in Identify.
    fn study(&mut self, source: Source) {
        self.state.room = Room::Identify;
        if self.state.source != source || self.bench.records.is_empty() {
            self.begin(Opening::of(source));
        }
    }

    /// Shows the list of lessons.
    pub(super) fn show_lessons(&mut self) {
        (self.state.room, self.state.rig.page) = (Room::Rig, Page::Lessons);
    }

    fn begin_lesson(&mut self, id: &str) {
        let Some(lesson) = lessons::lesson(id) else { return };
        self.state.lessons.current = Some(Position { lesson: id.to_owned(), step: 0, met: Default::default() });
        self.teacher.begin();
        self.state.room = lesson.start.room();
        self.state.cutting = false;
        match lesson.start {
            Start::Sample(sample, view) => {
                self.state.view = view;
                self.open_sample(sample);
            }
            Start::Rig(settings) => {
                self.state.rig.page = Page::Rig;
                (self.state.rig.settings, self.state.rig.usual_library) = (settings(), false);
            }
            Start::Records(settings) => {
                self.state.rig.settings = settings();
                self.begin(Opening::of(Source::Rig(Box::new(settings()))));
            }
        }
    }

    /// The strip of the open lesson.
    pub(super) fn lesson(&mut self, ui: &mut Ui) {
        let Some((lesson, position)) = self.state.lessons.open() else { return };
        let Some(ask) = lessons::show(ui, lesson, position) else { return };
        let count = lesson.steps.len();
        match ask {
            Ask::Again => self.begin_lesson(lesson.id),
            Ask::Leave => self.state.lessons.current = None,
            Ask::Back => {
                if let Some(position) = &mut self.state.lessons.current {
                    position.step = position.step.saturating_sub(1);
                }
            }
            Ask::Next => match &mut self.state.lessons.current {
                Some(position) if position.step < count => position.step += 1,
                _ => {
                    self.state.lessons.current = None;
                    self.state.lessons.finished.insert(lesson.id.to_owned());
                    self.show_lessons();
                }
            },
        }
    }

    /// Notices what was done, once everything has come to rest.
    pub(super) fn teach(&mut self) {
        if self.state.lessons.current.is_none() || self.busy() {
            return;
        }
        let facts = self.facts();
        self.teacher.watch(&mut self.state.lessons, &facts);
    }

    /// What the window shows, as far as a lesson may ask.
    fn facts(&self) -> Facts {
        let held_out = self.edit.usage.get(self.state.record) == Some(&Usage::HeldOut);
        let made = self.rig.current(&self.state.rig);
        let outcome = self.bench.outcome.as_ref().filter(|_| self.bench.failure.is_none());
        Facts {
            room: self.state.room,
            view: self.state.view,
            shows_held_out: held_out && self.state.room == Room::Identify,
            of_the_rig: matches!(self.state.source, Source::Rig(_)),
            settings: self.edit.settings.clone(),
            identify: outcome.map(|outcome| Found::of(outcome)),
            segment: self.bench.segment_length(&self.edit.settings.smoothing).1,
            looked: self.missing.looked(),
            added: self.edit.walk.accepted.iter().map(|choice| choice.effect.clone()).collect(),
            rig: self.state.rig.settings.clone(),
            usual_library: self.state.rig.usual_library,
            rig_found: made.and_then(|made| made.outcome.as_ref().ok()).map(|outcome| Found::of(outcome)),
            stuck: made.map_or(0.0, |made| made.run.stuck_share()),
        }
    }
}
