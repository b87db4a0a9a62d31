//! Lessons: short walks through the rooms whose steps notice what a person did.
//!
//! A [`Lesson`] is an entry of a table; a step of it says what to do and has a condition over [`Facts`], which hold what the
//! window shows. There is one mechanism for all: [`Teacher`] compares the facts now with those when the step began.

mod catalogue;
mod facts;
mod panel;

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::state::{Room, Sample};
use super::views::View;
pub(crate) use catalogue::LESSONS;
pub(crate) use facts::{Facts, Found};
pub(crate) use panel::{Ask, list, show};
use sindyscope_rig::RigSettings;

/// A lesson.
pub(crate) struct Lesson {
    /// Its name in the session.
    pub(crate) id: &'static str,
    pub(crate) title: &'static str,
    /// What it is about, in one sentence.
    pub(crate) about: &'static str,
    pub(crate) start: Start,
    pub(crate) steps: &'static [Exercise],
    /// What to take along.
    pub(crate) closing: &'static str,
}

/// What is open when a lesson begins.
#[derive(Clone, Copy)]
pub(crate) enum Start {
    /// A sample in Identify.
    Sample(Sample, View),
    /// A rig in its room.
    Rig(fn() -> RigSettings),
    /// The records of a rig in Identify.
    Records(fn() -> RigSettings),
}

impl Start {
    /// The room that it begins in.
    pub(crate) fn room(self) -> Room {
        match self {
            Self::Sample(..) | Self::Records(_) => Room::Identify,
            Self::Rig(_) => Room::Rig,
        }
    }
}

/// One thing to do.
pub(crate) struct Exercise {
    /// What to do, in one or two sentences.
    pub(crate) task: &'static str,
    /// What was seen, once it is done.
    pub(crate) seen: &'static str,
    /// True once it is done.
    pub(crate) done: fn(&Course<'_>) -> bool,
}

/// What a step may look at.
pub(crate) struct Course<'a> {
    pub(crate) now: &'a Facts,
    /// When the step began.
    pub(crate) before: &'a Facts,
    /// When the lesson began.
    pub(crate) first: &'a Facts,
    /// The smallest error in Identify so far, in the record's unit.
    pub(crate) best: f64,
}

/// How far a person has come; kept in the session.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Progress {
    /// The lesson that is open.
    pub current: Option<Position>,
    /// Names of the lessons that were gone through.
    pub finished: BTreeSet<String>,
}

/// A place in a lesson.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Position {
    /// The lesson's name.
    pub lesson: String,
    /// The step in view; as many as there are: the closing sentence.
    pub step: usize,
    /// Steps whose condition was met.
    pub met: BTreeSet<usize>,
}

/// A lesson of the table.
pub(crate) fn lesson(id: &str) -> Option<&'static Lesson> {
    LESSONS.iter().find(|lesson| lesson.id == id)
}

impl Progress {
    /// The open lesson and the place in it.
    pub(crate) fn open(&self) -> Option<(&'static Lesson, &Position)> {
        let position = self.current.as_ref()?;
        Some((lesson(&position.lesson)?, position))
    }
}

/// Watches what a person does during a lesson.
#[derive(Default)]
pub(crate) struct Teacher {
    /// The facts when the lesson began, and when the step in view did; none until everything has come to rest.
    first: Option<Facts>,
    before: Option<(usize, Facts)>,
    best: f64,
}

impl Teacher {
    /// Begins anew: with a lesson, or with one that comes back.
    pub(crate) fn begin(&mut self) {
        *self = Self { best: f64::INFINITY, ..Self::default() };
    }

    /// Looks at the facts while nothing is being computed; notes in the progress what was met.
    pub(crate) fn watch(&mut self, progress: &mut Progress, now: &Facts) {
        let Some((lesson, position)) = progress.open() else { return };
        let step = position.step;
        let first = self.first.get_or_insert_with(|| now.clone());
        if let Some(error) = now.identify.as_ref().and_then(|found| found.error) {
            self.best = self.best.min(error);
        }
        if self.before.as_ref().is_none_or(|(of, _)| *of != step) {
            self.before = Some((step, now.clone()));
        }
        let (Some((_, before)), Some(task)) = (&self.before, lesson.steps.get(step)) else { return };
        let course = Course { now, before, first, best: self.best };
        if (task.done)(&course)
            && let Some(position) = &mut progress.current
        {
            position.met.insert(step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lesson_has_its_own_name_and_begins_with_something_to_do() {
        let mut names = BTreeSet::new();
        for lesson in LESSONS {
            assert!(names.insert(lesson.id), "{}", lesson.id);
            assert!(lesson.steps.len() >= 2, "{}: a lesson is a walk", lesson.id);
            let nothing = Facts::default();
            let course = Course { now: &nothing, before: &nothing, first: &nothing, best: f64::INFINITY };
            for (index, step) in lesson.steps.iter().enumerate() {
                assert!(!(step.done)(&course), "{}: step {index} is done before anything was", lesson.id);
                assert!(step.task.len() < 330 && step.seen.len() < 330, "{}: step {index} is too long", lesson.id);
            }
        }
        assert_eq!(names.len(), 10);
    }

    #[test]
    fn what_was_met_stays_met() {
        let mut progress = Progress::default();
        let id = LESSONS[0].id.to_owned();
        progress.current = Some(Position { lesson: id, step: 0, met: BTreeSet::from([0]) });
        let mut teacher = Teacher::default();
        teacher.begin();
        teacher.watch(&mut progress, &Facts::default());
        assert!(progress.current.unwrap().met.contains(&0));
    }
}
