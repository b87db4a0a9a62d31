use sindyscope_core::remedy::Remedy;

/// Why a component cannot be identified.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ComponentError {
    /// No record is to be fitted.
    #[error("there is no record to fit")]
    NothingToFit,
    /// No channel is the force.
    #[error("record `{record}` has no force")]
    NoForce {
        /// The record.
        record: String,
    },
    /// Several inputs could be the force.
    #[error("record `{record}` does not say which of {names} is the force of the component")]
    WhichForce {
        /// The record.
        record: String,
        /// The inputs.
        names: String,
    },
    /// The motion is not measured.
    #[error("record `{record}` has neither displacement nor velocity of the component")]
    NoMotion {
        /// The record.
        record: String,
    },
    /// More than one motion.
    #[error("record `{record}` has the motions of several places; a component has one, along it")]
    SeveralMotions {
        /// The record.
        record: String,
    },
    /// A record lacks a channel that another one has.
    #[error("record `{record}` does not measure {channel}, which the first record does")]
    RecordsDiffer {
        /// The record.
        record: String,
        /// The channel.
        channel: String,
    },
    /// A record is too short.
    #[error("record `{record}` has {samples} samples; at least {least} are needed", least = super::specimen::LEAST_SAMPLES)]
    TooShort {
        /// The record.
        record: String,
        /// Its samples.
        samples: usize,
    },
    /// The force does not change.
    #[error("the force `{channel}` is constant over all records that are fitted")]
    Still {
        /// The channel.
        channel: String,
    },
    /// A term with a quantity that a component does not have.
    #[error("the term {term} uses {symbol}, which these records do not give")]
    Symbol {
        /// The term.
        term: String,
        /// The quantity.
        symbol: String,
    },
    /// No term is offered.
    #[error("the list of candidate terms is empty")]
    NoTerms,
    /// The motion cannot be smoothed.
    #[error("{0}")]
    Motion(String),
    /// Stopped from outside.
    #[error("cancelled")]
    Cancelled,
}

impl ComponentError {
    /// What to try, each by itself.
    pub fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::NoForce { .. } | Self::WhichForce { .. } => vec![Remedy::columns([("F", "NAME")])],
            Self::NoMotion { .. } => vec![Remedy::columns([("x", "NAME")])],
            Self::SeveralMotions { .. } => vec![Remedy::columns([("x", "NAME"), ("F", "NAME")])],
            Self::RecordsDiffer { .. } => vec![Remedy::to_do("give records with the same channels and units")],
            Self::TooShort { .. } => vec![Remedy::to_do("give a longer record: ten periods of the motion are plenty")],
            Self::Still { .. } => vec![Remedy::to_do("check which column is the force")],
            Self::Symbol { .. } => vec![Remedy::to_do("use x, v, du and the inputs u, u2, … of these records")],
            Self::NoTerms => vec![Remedy::to_do("offer at least one term")],
            Self::NothingToFit | Self::Motion(_) | Self::Cancelled => Vec::new(),
        }
    }
}
