//! What a step asks for.

use serde::{Deserialize, Serialize};

use crate::app::state::RoundStep;
use sindyscope_search::Choice;

/// What a step asks for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum WalkAct {
    /// Look at the model as it stands.
    Look,
    /// Tell what the virtual rig hid.
    Reveal,
    /// Stop.
    Cancel,
    /// Go to a step.
    Go(RoundStep),
    /// Choose a candidate.
    Select(Choice),
    /// Fit a candidate that was only screened.
    Try(Choice),
    /// Begin again with the base alone.
    Restart,
    /// Add a candidate to the walk.
    Accept(Choice),
    /// Take the last effect back.
    Undo,
    /// Take the model as it stands over as the equation of Identify.
    Use,
    /// Copy the model as it stands.
    Copy,
    /// Choose a file of effects of one's own: the window's own matter, as those that follow.
    #[serde(skip)]
    OpenEffects,
    /// Save effects of one's own: the text of the file.
    #[serde(skip)]
    SaveEffects(#[serde(skip)] String),
    /// Save a figure.
    #[serde(skip)]
    SaveFigure(WalkFigure),
    /// Save a plot's numbers: what it is called, and the text of the file.
    #[serde(skip)]
    SaveTable(#[serde(skip)] &'static str, String),
}

/// A figure that is saved alone.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum WalkFigure {
    /// The plots over time of the step that is in view.
    Time(RoundStep),
    /// The missing force over displacement and velocity.
    Map,
    /// The missing force along one quantity.
    Profile,
    /// What is left at the end, along the quantity that orders it best.
    Left,
    /// The force of a candidate over the quantity at its place.
    Curve(Choice),
    /// The force of the formula that describes what is left, over the quantity that orders it best.
    Description,
    /// The error after each effect.
    Waterfall,
    /// Why an effect was named, block by block: its index among those that were added.
    Why(usize),
}

impl WalkFigure {
    /// What it is called, in the title of the panel and in the name of the file.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Time(RoundStep::Add) => "preview",
            Self::Time(RoundStep::Verify) => "before and after",
            Self::Time(_) => "gap",
            Self::Map => "map",
            Self::Profile => "missing force",
            Self::Left => "what is left",
            Self::Curve(_) => "effect",
            Self::Description => "description",
            Self::Waterfall => "errors",
            Self::Why(_) => "why",
        }
    }

    /// What it is to those who hear the window.
    pub(super) fn spoken(&self) -> &'static str {
        match self {
            Self::Map => "Map of the missing force",
            Self::Profile | Self::Left => "Missing force along one quantity",
            Self::Description => "Missing force and the formula through it",
            Self::Why(_) => "What each block that was never fitted says for the effect",
            other => other.name(),
        }
    }

    /// Where it is shown.
    pub(super) fn place(&self) -> &'static str {
        match self {
            Self::Time(RoundStep::Add) => "add",
            Self::Time(RoundStep::Verify) => "verify",
            Self::Time(_) => "compare",
            other => other.name(),
        }
    }
}
