//! The room "Virtual rig": a plant whose every number can be moved, its motion drawn, recorded and fitted at once; lessons
//! and the class mode beside it.
//!
//! [`RigState`] is what a person decided; [`RigRoom`] is what was made of it, with the threads that make it.

mod class;
mod controls;
mod drawing;
mod found;
mod pages;
mod player;
mod save;
mod work;

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::dialogs::Purpose;
use super::history::History;
use super::missing::plots;
use super::worker::{Busy, Worker};
use class::ClassWork;
pub(crate) use class::records as round;
pub use class::{ClassCase, ClassState};
use player::Player;
use sindyscope_core::study::Outcome;
use sindyscope_rig::{RigRun, RigSettings};
pub(crate) use work::records;
use work::{Answer, Question};

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
pub(crate) struct RigRoom {
    work: Worker<Question, Option<Answer>>,
    asked: Option<(RigSettings, bool)>,
    ticket: u64,
    answered: u64,
    made: Option<Made>,
    /// Why the newest settings have no run.
    failure: Option<String>,
    class: ClassWork,
    saving: Worker<save::Job, Result<Vec<PathBuf>, String>>,
    history: Option<History<RigSettings>>,
    plots: plots::Cache,
}

impl RigRoom {
    pub(crate) fn new(wake: impl Fn() + Clone + Send + Sync + 'static) -> std::io::Result<Self> {
        Ok(Self {
            work: work::worker(wake.clone())?,
            asked: None,
            ticket: 0,
            answered: 0,
            made: None,
            failure: None,
            class: ClassWork::new(wake.clone())?,
            saving: save::worker(wake)?,
            history: None,
            plots: plots::Cache::default(),
        })
    }

    /// True until everything asked for has come.
    pub(crate) fn waiting(&self) -> bool {
        self.answered != self.ticket || self.saving.busy().is_some() || self.class.busy().is_some()
    }

    /// What runs, for the progress line.
    pub(crate) fn busy(&self) -> Option<Busy> {
        self.work.busy().or(self.class.busy())
    }

    /// The last run.
    pub(crate) fn made(&self) -> Option<&Made> {
        self.made.as_ref()
    }

    /// True if the last run is of these settings.
    pub(crate) fn is_current(&self) -> bool {
        self.answered == self.ticket && self.failure.is_none()
    }

    /// Asks for a run of the rig if the last one is of other settings.
    pub(crate) fn attend(&mut self, state: &RigState) {
        let wanted = (&state.settings, state.usual_library);
        if self.asked.as_ref().is_some_and(|(settings, usual)| (settings, *usual) == wanted) {
            return;
        }
        self.ticket += 1;
        self.asked = Some((state.settings.clone(), state.usual_library));
        let question =
            Question { ticket: self.ticket, settings: state.settings.clone(), usual_library: state.usual_library };
        self.work.ask(question);
    }

    /// Takes in what the threads brought; sentences for the notices come back.
    pub(crate) fn collect(&mut self, state: &mut RigState) -> Vec<Result<String, String>> {
        while let Some(answer) = self.work.answer() {
            let Some(answer) = answer else {
                self.answered = self.ticket;
                self.failure = Some("the rig failed by an error of the program itself; please report it".into());
                continue;
            };
            self.answered = self.answered.max(answer.ticket);
            match answer.result {
                Ok((run, outcome)) => {
                    self.failure = None;
                    if answer.ticket == self.ticket {
                        self.take_values(&run, state);
                    }
                    let settings = RigSettings { effect_values: run.effect_values.clone(), ..answer.settings };
                    let fitted = outcome.as_ref().ok().and_then(|o| o.records.first());
                    let channels = fitted.map_or(&[][..], |record| &record.channels);
                    let responses = channels.iter().map(|c| Arc::from(c.response.as_slice())).collect();
                    self.made = Some(Made { settings, run, outcome, responses });
                }
                Err(problem) => self.failure = Some(problem),
            }
        }
        self.class.collect(&mut state.class);
        let saved = std::iter::from_fn(|| self.saving.answer());
        let told = |paths: Vec<PathBuf>| {
            let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
            format!("Saved {}", names.join(" and "))
        };
        saved.map(|result| result.map(told)).collect()
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

    /// Writes something of the room to a file, in the background.
    pub(crate) fn save(&mut self, purpose: Purpose, path: PathBuf, state: &RigState) {
        let job = match purpose {
            Purpose::RigRecords => self.made.clone().map(|made| save::Job::Rig(path, Box::new(made))),
            Purpose::RoundRecords => Some(save::Job::Round(path, state.class.case.clone())),
            Purpose::Rounds => Some(save::Job::Table(path, class::csv(&state.class))),
            _ => None,
        };
        if let Some(job) = job {
            self.saving.ask(job);
        }
    }
}
