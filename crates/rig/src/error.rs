use super::Plant;

/// Why the virtual rig could not make a record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// A name that no scenario has.
    #[error("there is no scenario {name:?}; choose one of: {known}")]
    UnknownScenario {
        /// The name given.
        name: String,
        /// Every scenario's name.
        known: String,
    },
    /// An option whose value cannot be used.
    #[error("{option}: {problem}")]
    BadOption {
        /// The option's name.
        option: &'static str,
        /// What is wrong and what would do.
        problem: String,
    },
    /// No plant that is as a regime wants it.
    #[error(
        "no case of the regime {regime} with {effects} was found in {attempts} draws ({problem}); take another seed"
    )]
    NotDrawn {
        /// The regime's name.
        regime: &'static str,
        /// What was to be hidden.
        effects: String,
        /// How many plants were drawn.
        attempts: u64,
        /// What was wrong with the last.
        problem: String,
    },
    /// The motion grew without bound.
    #[error("the motion grows without bound at t = {time:.6} s; take a smaller amplitude or other parameters")]
    Unbounded {
        /// When, s.
        time: f64,
    },
    /// The motion needs too many integration steps.
    #[error(
        "the motion takes too many steps to integrate (reached t = {time:.6} s); take a shorter duration or lower frequencies"
    )]
    TooLong {
        /// How far it came, s.
        time: f64,
    },
    /// A plant with more contacts than can be integrated.
    #[error("a plant has at most {} contacts, not {given}", Plant::MOST_CONTACTS)]
    Contacts {
        /// How many it has.
        given: usize,
    },
    /// Inputs or initial values that are not the plant's.
    #[error(
        "the plant has {states} states and {inputs} inputs, but {given_states} initial values and {given_inputs} excitations were given"
    )]
    Mismatch {
        /// Number of the plant's states.
        states: usize,
        /// Number of its inputs.
        inputs: usize,
        /// Number of initial values given.
        given_states: usize,
        /// Number of excitations given.
        given_inputs: usize,
    },
}
