//! What a lesson is made of.

use super::facts::Facts;
use crate::app::state::{Room, Sample};
use crate::app::views::View;
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
