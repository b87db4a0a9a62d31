use super::outcome::{Candidate, Place};

/// What a running search tells as it goes.
#[derive(Clone, Debug)]
pub enum Progress {
    /// A sentence on what is being done, and the share done so far, 0 to 1.
    Step(&'static str, f64),
    /// Where the gap is.
    Place(Box<Place>),
    /// The ranking so far, best first; replaces the one before.
    Ranking(Vec<Candidate>),
}
