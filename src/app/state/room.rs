//! The rooms of the window.

use serde::{Deserialize, Serialize};

/// A room of work: what the centre of the window is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Room {
    /// From a measurement to its equation of motion.
    #[default]
    Identify,
    /// Where a model and the measurement part, and which effect that is.
    Missing,
    /// A plant whose every number can be moved, lessons and the class mode.
    Rig,
    /// What one takes along.
    Report,
}

impl Room {
    /// Every room, in the order of their keys 1, 2, …; with one there is nothing to switch.
    pub(crate) const ALL: [Self; 4] = [Self::Identify, Self::Missing, Self::Rig, Self::Report];

    /// The switch's text.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Identify => "Identify",
            Self::Missing => "What's missing",
            Self::Rig => "Virtual rig",
            Self::Report => "Report",
        }
    }

    /// What one does in it, in one sentence.
    pub(crate) fn tooltip(self) -> &'static str {
        match self {
            Self::Identify => "From the measurement to its equation of motion",
            Self::Missing => "Where a model's response and the measurement part, and which physical effect that is",
            Self::Rig => {
                "A plant whose every number you can move, with its motion and what is found in its record; lessons and a class mode"
            }
            Self::Report => {
                "The pages to take along: choose sections and figures, write between them, save as PDF or HTML"
            }
        }
    }
}
