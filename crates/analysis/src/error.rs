use sindyscope_core::prepare::PrepareError;
use sindyscope_core::remedy::Remedy;
use sindyscope_core::sampling::{Irregular, significant};
use sindyscope_core::study::StudyError;
use sindyscope_files::ReadError;
use sindyscope_search::GapError;

/// Why an analysis has no result.
#[derive(Clone, Debug, thiserror::Error)]
pub enum AnalysisError {
    /// The records cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The records cannot be prepared as asked for.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// What was found of the channels cannot be taken out of the records.
    #[error("{0}")]
    Calibrate(PrepareError),
    /// The study ends without an outcome.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The search for missing effects cannot be made.
    #[error(transparent)]
    Search(#[from] GapError),
    /// The force of a component cannot be found.
    #[error(transparent)]
    Component(#[from] sindyscope_component::ComponentError),
    /// The modes of a structure cannot be found.
    #[error(transparent)]
    Modes(#[from] sindyscope_modes::ModesError),
    /// Components are identified and diagnosed by functions of their own.
    #[error(
        "a component without a mass has no equation of motion: its force is identified, or what the force lacks is searched for"
    )]
    NoMass,
    /// No setting has the name.
    #[error("there is no setting `{name}`; there are {known}")]
    UnknownSetting {
        /// The name that was given.
        name: String,
        /// All names that there are.
        known: String,
    },
    /// A setting cannot be what it was said to be.
    #[error("{name}: {problem}")]
    Value {
        /// The setting.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Settings, each possible, that do not go together.
    #[error("{0}")]
    Settings(String),
    /// The force's coefficient follows from the mass, which was not given.
    #[error("`u=1/m` needs the mass")]
    MassNeeded,
    /// The force's coefficient follows from the mass if the input is a force.
    #[error("`u=1/m` needs one input that is a force in newtons")]
    ForceNeeded,
    /// A list of terms for single equations where one for all is needed.
    #[error("a list for each equation is not possible here")]
    ListForEach,
    /// A file of one's own effects cannot be read.
    #[error("cannot read the effects in {file}: {problem}")]
    EffectsUnread {
        /// The file.
        file: String,
        /// Why.
        problem: String,
    },
    /// An effect of one's own is wrong.
    #[error("{file}, line {line}, column {column}: {problem}")]
    Effects {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What is wrong, and what would be right.
        problem: String,
    },
    /// The steps between a stream's time stamps differ.
    #[error("{}", uneven(.irregular))]
    UnevenStream {
        /// What is irregular.
        irregular: Irregular,
    },
    /// A stream's time stamps lie too far off an even grid.
    #[error(
        "the time stamps of the stream are up to {percent} % of their interval off an even grid: they tell when rows arrived, not when samples were taken"
    )]
    JitteringStream {
        /// The largest distance, as a share of the interval, %.
        percent: f64,
    },
    /// Missing effects of first-order data.
    #[error("missing effects are searched in equations of second order: of a displacement, whose velocity is derived")]
    FirstOrder,
}

fn uneven(irregular: &Irregular) -> String {
    match irregular {
        Irregular::Uneven { step, usual, .. } => {
            format!(
                "the stream is not sampled evenly: a step of {} s stands among steps of {} s",
                significant(*step, 4),
                significant(*usual, 4)
            )
        }
        Irregular::Repeated { .. } | Irregular::Falling { .. } => "the time of the stream does not rise".into(),
    }
}

impl AnalysisError {
    /// What to try, each by itself; of what only whoever asked can word (an option, an argument), nothing.
    pub fn remedies(&self) -> Vec<Remedy> {
        match self {
            Self::Read(error) => error.remedies(),
            Self::Study(error) => error.remedies(),
            Self::Search(error) => error.remedies(),
            Self::Component(error) => error.remedies(),
            Self::Modes(error) => error.remedies(),
            Self::Prepare(_) => vec![Remedy::to_do("give other times, other steps of preparation, or another share")],
            Self::UnevenStream { .. } | Self::JitteringStream { .. } => {
                vec![
                    Remedy::to_do("let the source count its samples, and send that as the time"),
                    Remedy::GiveRate { when: "the samples are even, whatever their stamps say" },
                ]
            }
            Self::MassNeeded => vec![Remedy::to_do("give the mass in kilograms")],
            Self::ForceNeeded => {
                vec![Remedy::to_do("give the input the unit N, or fix the coefficient of `u` itself")]
            }
            Self::ListForEach => vec![Remedy::to_do("give one list for all equations, without `v1:`")],
            Self::FirstOrder => vec![Remedy::to_do("give the displacement alone, as of second order")],
            Self::NoMass => vec![Remedy::to_do("use the functions or commands that identify and diagnose components")],
            Self::EffectsUnread { .. } => {
                vec![Remedy::to_do("give the path of a TOML file with a table for each effect")]
            }
            Self::Effects { .. }
            | Self::Calibrate(_)
            | Self::UnknownSetting { .. }
            | Self::Value { .. }
            | Self::Settings(_) => Vec::new(),
        }
    }

    /// Whether the work was stopped from outside.
    pub fn is_cancelled(&self) -> bool {
        match self {
            Self::Read(error) => *error.problem == sindyscope_files::ReadProblem::Cancelled,
            Self::Study(error) => *error == StudyError::Cancelled,
            Self::Search(error) => *error == GapError::Cancelled,
            Self::Component(error) => *error == sindyscope_component::ComponentError::Cancelled,
            Self::Modes(error) => *error == sindyscope_modes::ModesError::Cancelled,
            _ => false,
        }
    }
}
