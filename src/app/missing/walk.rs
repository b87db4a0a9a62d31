use serde::{Deserialize, Serialize};

use sindyscope_search::Choice;
use sindyscope_values::term::Term;

/// The model that a walk starts from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Base {
    /// A linear spring and damper that suit the data.
    #[default]
    Linear,
    /// The terms of the equation that was identified.
    Identified,
    /// These terms of the acceleration.
    Typed(Vec<Term>),
}

/// What a person has decided in "What's missing".
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Walk {
    /// Where it starts.
    pub base: Base,
    /// The effects that were added, in this order.
    pub accepted: Vec<Choice>,
}

/// One of the four steps of a round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum RoundStep {
    /// Where do response and measurement part?
    #[default]
    Compare,
    /// Which effect is it?
    Name,
    /// What would it change?
    Add,
    /// Did the gap shrink?
    Verify,
}

impl RoundStep {
    pub(crate) const ALL: [Self; 4] = [Self::Compare, Self::Name, Self::Add, Self::Verify];

    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Compare => "Compare",
            Self::Name => "Name",
            Self::Add => "Add",
            Self::Verify => "Verify",
        }
    }

    pub(crate) fn tooltip(self) -> &'static str {
        match self {
            Self::Compare => "Where the simulated response and the measurement part, and whether by more than noise",
            Self::Name => "Which physical effects would close the gap, the likeliest first",
            Self::Add => "See what an effect does to the response before it is added",
            Self::Verify => "Before and after on data that were never fitted, and what is left",
        }
    }
}
