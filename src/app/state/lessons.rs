//! How far a person has come in the lessons.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

/// How far a person has come; kept in the session.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LessonProgress {
    /// The lesson that is open.
    pub current: Option<LessonPosition>,
    /// Names of the lessons that were gone through.
    pub finished: BTreeSet<String>,
}

/// A place in a lesson.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LessonPosition {
    /// The lesson's name.
    pub lesson: String,
    /// The step in view; as many as there are: the closing sentence.
    pub step: usize,
    /// Steps whose condition was met.
    pub met: BTreeSet<usize>,
}
