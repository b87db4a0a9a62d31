//! The room "Virtual rig": a plant whose every number can be moved, its motion drawn, recorded and fitted at once; lessons
//! and the class mode beside it.
//!
//! [`RigState`] is what a person decided; [`RigRoom`] is what was made of it, with the threads that make it.

pub(crate) mod class;
mod controls;
mod drawing;
mod found;
mod pages;
mod player;
pub(crate) mod save;
pub(crate) mod work;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::dialogs::Purpose;
use super::history::History;
use super::missing::plots;
use class::ClassWork;
pub(crate) use class::records as round;
pub(crate) use class::{Answered, ClassRound};
pub use class::{ClassCase, ClassState};
use player::Player;
use sindyscope_core::study::Outcome;
use sindyscope_rig::{RigRun, RigSettings};
use work::RecordedRig;
pub(crate) use work::records;

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

/// What the room asks the window to do.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Act {
    /// Open the rig's records in Identify.
    Study,
    /// Open the records of the class's round in Identify.
    StudyRound,
    /// Ask for a file to save something to.
    Save(Purpose),
    /// Begin a lesson, by its name.
    Begin(&'static str),
    /// Draw what the next round of the class mode hides.
    DrawRound,
    /// Let the program search in the records of a round.
    SearchRound(usize),
    /// Stop that search.
    StopSearch,
}

/// The last run and what was found in it.
#[derive(Clone, Debug)]
pub(crate) struct Made {
    /// What it was made of.
    pub(crate) settings: RigSettings,
    pub(crate) run: Arc<RigRun>,
    /// What the study of it says, or why there is none.
    pub(crate) outcome: Result<Arc<Outcome>, String>,
    /// The identified response of each mass along the fitted record, as long as it lasted.
    responses: Vec<Arc<[f64]>>,
}

/// The room.
#[derive(Default)]
pub(crate) struct RigRoom {
    /// What the last run was asked with: the settings, and whether the library lacks the plant's own terms.
    asked: Option<(RigSettings, bool)>,
    made: Option<Made>,
    /// Why the newest settings have no run.
    failure: Option<String>,
    pub(crate) class: ClassWork,
    history: Option<History<RigSettings>>,
    figures: plots::Figures,
}

impl RigRoom {
    /// The last run.
    pub(crate) fn made(&self) -> Option<&Made> {
        self.made.as_ref()
    }

    /// The last run if it is of these settings.
    pub(crate) fn current(&self, state: &RigState) -> Option<&Made> {
        self.made.as_ref().filter(|made| self.failure.is_none() && made.settings == state.settings)
    }

    /// True if a run of the rig is to be asked for: the last one that was is of other settings.
    pub(crate) fn wants(&mut self, state: &RigState) -> bool {
        let wanted = (&state.settings, state.usual_library);
        if self.asked.as_ref().is_some_and(|(settings, usual)| (settings, *usual) == wanted) {
            return false;
        }
        self.asked = Some((state.settings.clone(), state.usual_library));
        true
    }

    /// Takes in a run.
    pub(crate) fn take(&mut self, recorded: RecordedRig, state: &mut RigState) {
        let RecordedRig { settings, run, outcome } = recorded;
        self.failure = None;
        if settings == state.settings {
            self.take_values(&run, state);
        }
        let settings = RigSettings { effect_values: run.effect_values.clone(), ..settings };
        let fitted = outcome.as_ref().ok().and_then(|o| o.records.first());
        let channels = fitted.map_or(&[][..], |record| &record.channels);
        let responses = channels.iter().map(|c| Arc::from(c.response.as_slice())).collect();
        self.made = Some(Made { settings, run, outcome, responses });
    }

    /// Notes why the newest settings have no run.
    pub(crate) fn fail(&mut self, reason: String) {
        self.failure = Some(reason);
    }

    /// Keeps the parameters that were suggested for an effect: from now on they are the person's.
    fn take_values(&mut self, run: &RigRun, state: &mut RigState) {
        if state.settings.effect_values == run.effect_values {
            return;
        }
        // Suggesting is no step of its own that undo would stop at.
        let before = state.settings.clone();
        state.settings.effect_values.clone_from(&run.effect_values);
        if let Some((asked, _)) = &mut self.asked {
            asked.effect_values.clone_from(&run.effect_values);
        }
        if let Some(history) = &mut self.history {
            history.replace(&before, &state.settings);
        }
    }

    /// Notes steps for undo.
    pub(crate) fn watch(&mut self, state: &RigState, held: bool, now: f64) {
        let history = self.history.get_or_insert_with(|| History::new(state.settings.clone()));
        history.watch(&state.settings, held, now);
    }

    /// True if there is a step to take back, and to take again.
    pub(crate) fn can_step(&self, state: &RigState) -> (bool, bool) {
        let history = self.history.as_ref();
        history.map_or((false, false), |h| (h.can_undo(&state.settings), h.can_redo(&state.settings)))
    }

    /// Takes the last step back, or takes it again.
    pub(crate) fn step(&mut self, state: &mut RigState, back: bool) {
        let Some(history) = &mut self.history else { return };
        let found = if back { history.undo(&state.settings) } else { history.redo(&state.settings) };
        if let Some(settings) = found {
            state.settings = settings;
        }
    }
}
