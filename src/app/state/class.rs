//! The class mode: its rounds, guesses and what the program found.

use serde::{Deserialize, Serialize};

use sindyscope_rig::hidden::{ExcitationKind, HiddenRequest, Instruments};

/// What a round hides, and how its data are made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ClassCase {
    /// Seed of all that is drawn.
    pub seed: u64,
    /// The effect; none: the seed draws one.
    pub effect: Option<String>,
    /// Standard deviation of the displacement's noise over its RMS.
    pub noise: f64,
    /// RMS missing force over RMS spring force.
    pub ratio: f64,
    /// How the plant is shaken.
    #[serde(rename = "shaking")]
    pub excitation: ExcitationKind,
    /// Samples in all fitted records together.
    pub samples: usize,
}

impl Default for ClassCase {
    fn default() -> Self {
        Self { seed: 1, effect: None, noise: 0.01, ratio: 0.1, excitation: ExcitationKind::Multisine, samples: 3000 }
    }
}

impl ClassCase {
    /// The same as the virtual rig is asked for it.
    pub(crate) fn request(&self) -> HiddenRequest {
        let request = match &self.effect {
            Some(effect) => HiddenRequest::new([effect.as_str()], self.excitation, self.seed),
            None => HiddenRequest::blind(self.excitation, self.seed),
        };
        HiddenRequest {
            instruments: Instruments::white(self.noise),
            ratio: Some(self.ratio),
            samples: self.samples,
            ..request
        }
    }
}

/// What somebody took it for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Guess {
    /// Who: a student or a group; may be empty.
    pub who: String,
    /// Name of the effect.
    pub effect: String,
}

/// What the program found.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answered {
    /// Names of the effects that it added.
    pub effects: Vec<String>,
    /// Its verdict.
    pub verdict: String,
    /// The verdict in one sentence.
    pub sentence: String,
}

/// One round.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassRound {
    /// What it hides.
    pub case: ClassCase,
    /// Name of the hidden effect, drawn or chosen.
    pub hidden: String,
    /// What is hidden, in words.
    pub description: String,
    /// What the students took it for.
    pub guesses: Vec<Guess>,
    /// Whether the truth was told.
    pub revealed: bool,
    /// What the program found, once it has searched.
    pub answered: Option<Answered>,
}

/// The class mode as it stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ClassState {
    /// The round that is prepared, or the one that is open.
    pub case: ClassCase,
    /// The rounds, the last may be open.
    pub rounds: Vec<ClassRound>,
    /// Who guesses next, and what.
    pub who: String,
    /// The effect chosen in the list of guesses.
    pub guess: Option<String>,
}

impl ClassState {
    /// The round that is open: its truth was not told yet.
    pub(crate) fn open(&self) -> Option<&ClassRound> {
        self.rounds.last().filter(|round| !round.revealed)
    }

    pub(crate) fn open_mut(&mut self) -> Option<&mut ClassRound> {
        self.rounds.last_mut().filter(|round| !round.revealed)
    }

    /// The case whose records are given out: of the open round.
    pub(crate) fn given_out(&self) -> Option<&ClassCase> {
        self.open().map(|round| &round.case)
    }
}

impl ClassRound {
    /// A round that begins.
    pub(crate) fn new(case: ClassCase, hidden: String, description: String) -> Self {
        Self { case, hidden, description, guesses: Vec::new(), revealed: false, answered: None }
    }
}
