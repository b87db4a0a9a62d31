//! What the window shows, as far as a lesson may ask.

use crate::app::state::Room;
use crate::app::views::View;
use sindyscope_core::study::{Outcome, Settings};
use sindyscope_report::modal::ModalView;
use sindyscope_rig::RigSettings;

/// A term that was found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FoundTerm {
    /// As it is typed: `sgn(v)`.
    pub(crate) term: String,
    pub(crate) coefficient: f64,
    /// Standard error over the coefficient; none where it is not known.
    pub(crate) doubt: Option<f64>,
}

/// What a study found.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FitFacts {
    /// RMSE of the simulated response on data never fitted, else on what was fitted; none if it diverged.
    pub(crate) error: Option<f64>,
    pub(crate) noise: f64,
    /// The terms of the leading equation.
    pub(crate) terms: Vec<FoundTerm>,
    /// Share of the samples at which something stands.
    pub(crate) standing: f64,
}

impl FitFacts {
    /// What an outcome says.
    pub(crate) fn of(outcome: &Outcome) -> Self {
        let terms = outcome.model.leading().map_or(&[][..], |equation| &equation.terms);
        let doubt = |error: Option<f64>, of: f64| error.map(|e| (e / of).abs()).filter(|d| d.is_finite());
        Self {
            error: outcome.test.or(outcome.train).map(|score| score.rmse),
            noise: outcome.noise_floor.unwrap_or(0.0),
            terms: terms
                .iter()
                .map(|t| FoundTerm {
                    term: t.term.to_string(),
                    coefficient: t.coefficient,
                    doubt: doubt(t.std_error, t.coefficient),
                })
                .collect(),
            standing: outcome
                .records
                .iter()
                .map(sindyscope_core::study::RecordOutcome::standing_share)
                .fold(0.0, f64::max),
        }
    }

    /// A term by how it is typed.
    pub(crate) fn term(&self, text: &str) -> Option<&FoundTerm> {
        self.terms.iter().find(|t| t.term == text)
    }

    /// Standard error over the coefficient of a term; infinite if it was not found.
    pub(crate) fn doubt(&self, text: &str) -> f64 {
        self.term(text).and_then(|t| t.doubt).unwrap_or(f64::INFINITY)
    }
}

/// What is found of a structure's modes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ModesFacts {
    /// Of each mode in the driven band, Hz.
    pub(crate) frequencies: Vec<f64>,
    /// Their number was given, or the poles were chosen in the stabilization diagram.
    pub(crate) by_hand: bool,
}

/// What the window shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Facts {
    pub(crate) room: Room,
    pub(crate) view: View,
    /// The record in view is held out.
    pub(crate) shows_held_out: bool,
    /// Records are open that came from the rig's room.
    pub(crate) of_the_rig: bool,
    pub(crate) settings: Settings,
    /// What Identify found; none while it has found nothing.
    pub(crate) identify: Option<FitFacts>,
    /// What was found of a structure's modes; none where the base is a chain, or they are not of the settings as they stand.
    pub(crate) modes: Option<ModesFacts>,
    /// The view of modes in Identify.
    pub(crate) modal_view: ModalView,
    /// The verdict on what the modes lack.
    pub(crate) modal_verdict: Option<&'static str>,
    /// Length of the smoothing segment in main periods.
    pub(crate) segment: Option<f64>,
    /// A look for missing effects has come to its end.
    pub(crate) looked: bool,
    /// Names of the effects that were added to the model.
    pub(crate) added: Vec<String>,
    /// The rig's numbers.
    pub(crate) rig: RigSettings,
    /// The rig's library lacks the plant's own terms.
    pub(crate) usual_library: bool,
    /// What was found in the rig's record; none while there is none.
    pub(crate) rig_found: Option<FitFacts>,
    /// Share of the time in which the rig sticks.
    pub(crate) stuck: f64,
}

impl Facts {
    /// A parameter of the rig's effect; zero if it has none of that name.
    pub(crate) fn parameter(&self, name: &str) -> f64 {
        self.rig.effect_values.iter().find(|v| v.name == name).map_or(0.0, |v| v.value)
    }

    /// True if the library of Identify holds a term.
    pub(crate) fn tries(&self, text: &str) -> bool {
        self.settings.terms.iter().any(|term| term.as_str() == text)
    }

    /// The error in Identify; infinite where there is none.
    pub(crate) fn error(&self) -> f64 {
        self.identify.as_ref().and_then(|found| found.error).unwrap_or(f64::INFINITY)
    }

    /// The error in the rig's room; infinite where there is none.
    pub(crate) fn rig_error(&self) -> f64 {
        self.rig_found.as_ref().and_then(|found| found.error).unwrap_or(f64::INFINITY)
    }

    /// Standard error over the coefficient of a term in the rig's room; infinite if it was not found.
    pub(crate) fn rig_doubt(&self, text: &str) -> f64 {
        self.rig_found.as_ref().map_or(f64::INFINITY, |found| found.doubt(text))
    }

    /// Number of terms that Identify kept.
    pub(crate) fn count(&self) -> usize {
        self.identify.as_ref().map_or(0, |found| found.terms.len())
    }
}
