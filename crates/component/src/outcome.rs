//! What was identified of a component, as plain values.

use sindyscope_core::study::Score;
use sindyscope_values::model::{Equation, Units};
use sindyscope_values::record::Usage;
use sindyscope_values::term::{Expression, Layout, Symbol, Term};

use super::specimen::{RecordPath, Specimen};

/// The force of a component along a given motion, with the internal states that it remembers by.
#[derive(Clone, Debug)]
pub struct ComponentModel {
    /// One displacement, the inputs beside it and the internal states.
    pub layout: Layout,
    /// The force.
    pub force: Equation,
    /// The rate of each internal state; all begin at zero.
    pub internals: Vec<Equation>,
    /// Units of the symbols.
    pub(crate) units: Units,
    /// The symbol that each internal state is measured like.
    pub(crate) like: Vec<Symbol>,
    /// What it leaves of each record.
    pub records: Vec<ForceFit>,
}

/// What a model leaves of one record's force.
#[derive(Clone, Debug)]
pub struct ForceFit {
    /// The record's name.
    pub name: String,
    /// Fitted or held out.
    pub usage: Usage,
    /// Number of samples.
    pub samples: usize,
    /// Sampling interval, s.
    pub interval: f64,
    /// Measured force minus the model's, at every sample.
    pub residual: Vec<f64>,
    /// The error over the whole record.
    pub score: Score,
    /// Energy that the measured force takes in over the record, and the model's: ∫F v dt.
    pub energy: [f64; 2],
}

impl ComponentModel {
    /// The unit of a term's coefficient in the force; none where a file does not say.
    pub fn unit(&self, term: &Term) -> Option<String> {
        let like = |symbol: Symbol| match symbol {
            Symbol::Internal(k) => self.like.get(k).map(|s| Expression::from(*s)),
            _ => None,
        };
        self.units.coefficient(Symbol::Rate(0), &Term::new(term.expression().replaced(&like)))
    }

    /// The score over all records of a usage together; none where there is none.
    pub fn score(&self, usage: Usage) -> Option<Score> {
        Score::pooled(self.records.iter().filter(|r| r.usage == usage).map(|r| &r.score))
    }
}

/// What a residual over the rows of all records leaves of each.
pub(crate) fn fits(specimen: &Specimen, residual: &[f64]) -> Vec<ForceFit> {
    let mut next = 0;
    let of = |path: &RecordPath| {
        let residual = residual[next..next + path.len()].to_vec();
        next += path.len();
        let work = |force: &dyn Fn(usize) -> f64| {
            path.interval * path.motion[1].iter().enumerate().map(|(k, v)| force(k) * v).sum::<f64>()
        };
        let score = Score::of_residual(&path.force, &residual)?;
        Some(ForceFit {
            name: path.name.clone(),
            usage: path.usage,
            samples: path.len(),
            interval: path.interval,
            energy: [work(&|k| path.force[k]), work(&|k| path.force[k] - residual[k])],
            residual,
            score,
        })
    };
    specimen.paths.iter().filter_map(of).collect()
}
