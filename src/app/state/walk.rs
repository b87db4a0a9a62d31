//! What a person has decided in "What's missing", and what is in view there.

use serde::{Deserialize, Serialize};

use super::own::OwnEffects;
use sindyscope_search::{Choice, Site};
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
    /// Effects of the person's own, searched beside the catalogue's.
    #[serde(skip_serializing_if = "has_none")]
    pub own: OwnEffects,
}

fn has_none(own: &OwnEffects) -> bool {
    own.text().is_empty()
}

impl Walk {
    /// The start: the usual base, nothing added; a person's own effects stay.
    pub(crate) fn afresh(&self) -> Self {
        Self { own: self.own.clone(), ..Self::default() }
    }

    /// Searches these effects of the person's own from now on. What was added goes back to before the first effect that is no more
    /// what it was.
    pub(crate) fn take_own(&mut self, own: OwnEffects) {
        let stays = |choice: &&Choice| self.own.is_alike_in(&choice.effect, &own);
        let kept = self.accepted.iter().take_while(stays).count();
        self.accepted.truncate(kept);
        self.own = own;
    }
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

/// What is in view in "What's missing".
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct WalkView {
    /// The step.
    pub(crate) step: RoundStep,
    /// The candidate that is looked at.
    pub(crate) selected: Option<Choice>,
    /// Candidates that were passed over.
    pub(crate) skipped: Vec<Choice>,
    /// Whether also those are shown that were refused or cannot be shown by the data.
    pub(crate) show_all: bool,
    /// The place whose candidates are shown alone.
    pub(crate) site: Option<Site>,
    /// The record shown while comparing.
    pub(crate) record: usize,
    /// The record shown to verify: the first held-out one until another is chosen.
    pub(crate) verified: Option<usize>,
    /// The quantity that the missing force is shown over; none: the one that suits what is looked at.
    pub(crate) profile: Option<String>,
    /// Whether what the virtual rig hid is told.
    pub(crate) revealed: bool,
}

impl WalkView {
    /// Forgets what was chosen among candidates that are no more.
    pub(crate) fn pass_over(&mut self) {
        self.selected = None;
        self.skipped.clear();
    }

    /// Shows the candidates of a place alone; those of every place if it was picked before.
    pub(crate) fn pick(&mut self, site: Site) {
        self.site = if self.site == Some(site) { None } else { Some(site) };
        self.selected = None;
        self.profile = None;
    }
}
