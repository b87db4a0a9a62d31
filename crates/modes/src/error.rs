use sindyscope_core::remedy::Remedy;

/// Why the modes of a structure cannot be identified.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ModesError {
    /// No record is to be fitted.
    #[error("there is no record to fit")]
    NothingToFit,
    /// A record has no sensor.
    #[error("record `{record}` has no displacement, velocity or acceleration")]
    NoSensor {
        /// The record.
        record: String,
    },
    /// A record lacks a channel that another one has.
    #[error("record `{record}` does not measure {channel}, which the first record does")]
    RecordsDiffer {
        /// The record.
        record: String,
        /// The channel's short name.
        channel: String,
    },
    /// A record is too short.
    #[error("record `{record}` has {samples} samples; at least {least} are needed", least = super::measurement::LEAST_SAMPLES)]
    TooShort {
        /// The record.
        record: String,
        /// Its samples.
        samples: usize,
    },
    /// A sensor shows nothing.
    #[error("channel `{channel}` is constant over all records that are fitted")]
    Still {
        /// The channel.
        channel: String,
    },
    /// A position is given for a sensor that there is not.
    #[error("a position is given for `{sensor}`, and no sensor has that name: there are {known}")]
    UnknownSensor {
        /// The name.
        sensor: String,
        /// The sensors' names.
        known: String,
    },
    /// No oscillation was found.
    #[error("no mode was found: nothing in these records swings freely or answers the inputs as a structure does")]
    NoMode,
    /// Stopped from outside.
    #[error("cancelled")]
    Cancelled,
}

impl ModesError {
    /// What to try, each by itself.
    pub fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::NoSensor { .. } => vec![Remedy::columns([("a1", "NAME")])],
            Self::RecordsDiffer { .. } => vec![
                Remedy::to_do("give records with the same channels and units"),
                Remedy::columns::<String, String>([]),
            ],
            Self::TooShort { .. } => {
                vec![Remedy::to_do("give a longer record: twenty periods of the slowest mode are plenty")]
            }
            Self::Still { .. } => vec![Remedy::to_do("leave that channel out")],
            Self::NoMode => vec![
                Remedy::to_do("give records that last twenty periods of the slowest mode"),
                Remedy::columns([("u", "NAME")]),
            ],
            Self::UnknownSensor { .. } => vec![Remedy::to_do("give the positions by the channels' names, or none")],
            Self::NothingToFit | Self::Cancelled => Vec::new(),
        }
    }
}
