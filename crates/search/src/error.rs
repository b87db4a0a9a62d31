use super::data::FEWEST_SAMPLES;
use sindyscope_core::remedy::Remedy;

/// Why a search for missing effects cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GapError {
    /// The records do not go together.
    #[error("{0}")]
    Records(String),
    /// No record is to be fitted.
    #[error("there is no record to fit")]
    NothingToFit,
    /// A record is too short.
    #[error("record `{record}` has {samples} samples; at least {} are needed", FEWEST_SAMPLES)]
    TooShort {
        /// The record.
        record: String,
        /// Its samples.
        samples: usize,
    },
    /// A held-out record has no sample after those that its initial state is estimated from.
    #[error("record `{record}` has {samples} samples: none is left to score after {initial} for the initial state")]
    NothingToScore {
        /// The record.
        record: String,
        /// Its samples.
        samples: usize,
        /// Samples for the initial state.
        initial: usize,
    },
    /// A base term uses what the records do not have.
    #[error("the base model's term {term} uses {symbol}, which the records do not have")]
    Symbol {
        /// The term.
        term: String,
        /// The quantity.
        symbol: String,
    },
    /// A base term holds an acceleration.
    #[error(
        "the base model's term {0} holds an acceleration, which the search for missing effects cannot have; leave it out of the base model, or identify the whole equation"
    )]
    Acceleration(String),
    /// An effect of the user's own that cannot be one, or uses what the records do not have.
    #[error("the effect `{effect}`: {problem}")]
    Effect {
        /// Its name.
        effect: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The base model cannot be fitted.
    #[error(
        "the base model's response cannot be fitted to the records: its simulation does not stay within ten times their range"
    )]
    Base,
    /// The model with an effect added cannot be fitted.
    #[error(
        "with {0} the model's response cannot be fitted to the records: its simulation does not stay within ten times their range"
    )]
    Stage(String),
    /// Stopped from outside.
    #[error("cancelled")]
    Cancelled,
}

impl GapError {
    /// What to try, each by itself.
    pub fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::Records(_) => vec![
                Remedy::to_do("give records with the same channels and units"),
                Remedy::columns::<String, String>([]),
            ],
            Self::TooShort { .. } => vec![Remedy::to_do(
                "give a longer record, or one that was sampled faster: ten periods at forty samples each are plenty",
            )],
            Self::NothingToScore { .. } => vec![Remedy::to_do("estimate the initial state from fewer samples")],
            Self::Symbol { .. } => vec![Remedy::LinearBase, Remedy::columns([("u", "NAME")])],
            Self::Acceleration(_) => vec![Remedy::OtherBase, Remedy::Identify { what: "takes accelerations" }],
            Self::Base => vec![
                Remedy::OtherBase,
                Remedy::LinearBase,
                Remedy::Identify { what: "shows which terms suit the records" },
            ],
            Self::Stage(_) => vec![Remedy::FewerEffects, Remedy::OtherBase],
            Self::Effect { .. } => vec![Remedy::to_do("mend its entry, or leave it out")],
            Self::NothingToFit | Self::Cancelled => Vec::new(),
        }
    }
}
