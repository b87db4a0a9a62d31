//! What a person has decided in the virtual rig's room.

use serde::{Deserialize, Serialize};

use super::class::ClassState;
use crate::app::rig::player::Player;
use sindyscope_rig::RigSettings;

/// What the centre of the room shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Page {
    /// The rig itself.
    #[default]
    Rig,
    /// The list of lessons.
    Lessons,
    /// The class mode.
    Class,
}

impl Page {
    pub(crate) const ALL: [(Self, &'static str, &'static str); 3] = [
        (
            Self::Rig,
            "Rig",
            "A plant whose every number can be moved, with its motion, its record and what is found in it",
        ),
        (Self::Lessons, "Lessons", "Ten short lessons that notice what you do"),
        (Self::Class, "Class", "Hide an effect, let the students guess, then reveal it"),
    ];
}

/// What a person has decided in the room; kept in the session and in projects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RigState {
    /// The rig's numbers.
    pub settings: RigSettings,
    /// The library lacks the terms of the plant that it does not have by itself.
    pub usual_library: bool,
    /// The class mode.
    pub class: ClassState,
    pub(crate) page: Page,
    pub(crate) player: Player,
}
