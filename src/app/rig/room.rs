//! The room: the last run, what is waited for, and what undo takes back.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::work::RecordedRig;
use crate::app::history::History;
use crate::app::purpose::Purpose;
use crate::app::state::{Answered, ClassRound, ClassState, RigState, Sample};
use sindyscope_core::study::Outcome;
use sindyscope_rig::{RigRun, RigSettings};

/// What the room asks the window to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum RigAct {
    /// Open the rig's records in Identify.
    Study,
    /// Open the records of the class's round in Identify.
    StudyRound,
    /// Open a classic of the rig in Identify.
    Classic(Sample),
    /// Ask for a file to save something to: the window's own matter.
    #[serde(skip)]
    Save(Purpose),
    /// Begin a lesson, by its name.
    Begin(String),
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
    pub(super) responses: Vec<Arc<[f64]>>,
}

/// The room.
#[derive(Default)]
pub(crate) struct RigRoom {
    /// What the last run was asked with: the settings, and whether the library lacks the plant's own terms.
    pub(super) asked: Option<(RigSettings, bool)>,
    pub(super) made: Option<Made>,
    /// Why the newest settings have no run.
    pub(super) failure: Option<String>,
    pub(crate) class: ClassWork,
    pub(super) history: Option<History<RigSettings>>,
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

    /// Watches the settings; true once a change has come to rest.
    pub(crate) fn watch(&mut self, state: &RigState, held: bool, now: f64) -> bool {
        self.steps(state).watch(&state.settings, held, now)
    }

    /// Notes a step that undo takes back.
    pub(crate) fn note(&mut self, state: &RigState) {
        self.steps(state).note(&state.settings);
    }

    fn steps(&mut self, state: &RigState) -> &mut History<RigSettings> {
        self.history.get_or_insert_with(|| History::new(state.settings.clone()))
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

/// What the class mode waits for.
#[derive(Debug, Default)]
pub(crate) struct ClassWork {
    /// The round that is searched, and how far the search has come.
    pub(crate) searching: Option<usize>,
    pub(crate) progress: Option<f64>,
    pub(crate) drawing: bool,
    pub(crate) failure: Option<String>,
}

impl ClassWork {
    /// A round is being drawn.
    pub(crate) fn draws(&mut self) {
        (self.failure, self.drawing) = (None, true);
    }

    /// A round is being searched.
    pub(crate) fn searches(&mut self, index: usize) {
        (self.failure, self.searching) = (None, Some(index));
    }

    /// The round that was to be drawn, or why there is none.
    pub(crate) fn drawn(&mut self, state: &mut ClassState, round: Result<ClassRound, String>) {
        self.drawing = false;
        match round {
            Ok(round) => state.rounds.push(round),
            Err(problem) => self.failure = Some(problem),
        }
    }

    /// What the search found, or why it found nothing.
    pub(crate) fn searched(&mut self, state: &mut ClassState, answered: Result<(usize, Answered), String>) {
        self.searching = None;
        match answered {
            Ok((index, answered)) => {
                if let Some(round) = state.rounds.get_mut(index) {
                    round.answered = Some(answered);
                }
            }
            Err(problem) => self.failure = Some(problem),
        }
    }
}
