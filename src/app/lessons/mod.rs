//! Lessons: short walks through the rooms whose steps notice what a person did.
//!
//! A [`Lesson`] is an entry of a table ([`LESSONS`]); a step of it says what to do and has a condition over [`Facts`], which hold what the
//! window shows. There is one mechanism for all: [`Teacher`] compares the facts now with those when the step began.

mod catalogue;
mod facts;
mod lesson;
mod oscillators;
mod panel;
mod structures;

use super::state::{LessonPosition, LessonProgress};
pub(crate) use catalogue::LESSONS;
pub(crate) use facts::{Facts, FitFacts, ModesFacts};
use lesson::Course;
pub(crate) use lesson::{Lesson, Start};
pub(crate) use panel::{LessonAct, list, show};

/// A lesson of the table.
pub(crate) fn lesson(id: &str) -> Option<&'static Lesson> {
    LESSONS.iter().find(|lesson| lesson.id == id)
}

/// The open lesson and the place in it.
pub(crate) fn open(progress: &LessonProgress) -> Option<(&'static Lesson, &LessonPosition)> {
    let position = progress.current.as_ref()?;
    Some((lesson(&position.lesson)?, position))
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
    pub(crate) fn watch(&mut self, progress: &mut LessonProgress, now: &Facts) {
        let Some((lesson, position)) = open(progress) else { return };
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
    use std::collections::BTreeSet;

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
        assert_eq!(names.len(), 15);
    }

    #[test]
    fn what_was_met_stays_met() {
        let mut progress = LessonProgress::default();
        let id = LESSONS[0].id.to_owned();
        progress.current = Some(LessonPosition { lesson: id, step: 0, met: BTreeSet::from([0]) });
        let mut teacher = Teacher::default();
        teacher.begin();
        teacher.watch(&mut progress, &Facts::default());
        assert!(progress.current.unwrap().met.contains(&0));
    }
}
