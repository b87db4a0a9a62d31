//! Where an effect acts, and in whose equation of motion a term stands.

use std::fmt;

use serde::{Deserialize, Serialize};

use sindyscope_values::term::{Layout, Symbol, Term};

/// Where an effect acts; masses count from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Site {
    /// Between a mass and the ground.
    Ground(usize),
    /// Between two masses that are neighbours in the chain, the lower number first.
    Joint(usize, usize),
    /// Between a mass and the moving base.
    Base(usize),
}

impl Site {
    /// Every site of a chain of masses: to ground and, where it moves, to the base at each, and between neighbours.
    pub fn all(masses: usize, base_moves: bool) -> Vec<Self> {
        let mut sites: Vec<Self> = (0..masses).map(Self::Ground).collect();
        sites.extend((1..masses).map(|j| Self::Joint(j - 1, j)));
        sites.extend((0..masses).filter(|_| base_moves).map(Self::Base));
        sites
    }

    /// A quantity of each mass (displacement, velocity) across the site; `base` is the base's, zero where it stands still.
    pub(super) fn across(self, of_mass: impl Fn(usize) -> f64, base: f64) -> f64 {
        match self {
            Self::Ground(i) => of_mass(i),
            Self::Joint(i, j) => of_mass(i) - of_mass(j),
            Self::Base(i) => of_mass(i) - base,
        }
    }

    /// The displacement across the site in words: `x`, `x − u`, `x1 − x2`.
    pub fn displacement(self, layout: &Layout) -> String {
        self.words(layout, Symbol::State, Symbol::Input(0))
    }

    /// The velocity across it.
    pub fn velocity(self, layout: &Layout) -> String {
        self.words(layout, Symbol::Rate, Symbol::InputRate(0))
    }

    fn words(self, layout: &Layout, of_mass: fn(usize) -> Symbol, base: Symbol) -> String {
        let of = |i: usize| layout.name(of_mass(i));
        match self {
            Self::Ground(i) => of(i),
            Self::Joint(i, j) => format!("{} − {}", of(i), of(j)),
            Self::Base(i) => format!("{} − {}", of(i), layout.name(base)),
        }
    }

    /// The mass that a force there acts on, and the one that it acts on the other way round.
    pub(super) fn masses(self) -> (usize, Option<usize>) {
        match self {
            Self::Ground(i) | Self::Base(i) => (i, None),
            Self::Joint(i, j) => (i, Some(j)),
        }
    }
}

/// As the interface writes it: `ground-1`, `1-2`, `base-1`.
impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ground(i) => write!(f, "ground-{}", i + 1),
            Self::Joint(i, j) => write!(f, "{}-{}", i + 1, j + 1),
            Self::Base(i) => write!(f, "base-{}", i + 1),
        }
    }
}

/// A term in the equation of one mass's acceleration.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placed {
    pub(super) mass: usize,
    pub(super) term: Term,
}

impl AsRef<Term> for Placed {
    fn as_ref(&self) -> &Term {
        &self.term
    }
}

impl Placed {
    /// The same place with another term.
    pub(super) fn map(&self, change: impl FnOnce(&Term) -> Term) -> Self {
        Self { mass: self.mass, term: change(&self.term) }
    }
}

/// What terms with coefficients sum to in each mass's equation: `[mass][sample]` from `columns[term][sample]`.
pub(super) fn accelerations(
    masses: usize,
    terms: &[Placed],
    coefficients: &[f64],
    columns: &[Vec<f64>],
    samples: usize,
) -> Vec<Vec<f64>> {
    let mut sums = vec![vec![0.0; samples]; masses];
    for ((placed, coefficient), column) in terms.iter().zip(coefficients).zip(columns) {
        sums[placed.mass].iter_mut().zip(column).for_each(|(sum, value)| *sum += coefficient * value);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sites_are_written_as_the_interface_has_them() {
        let names: Vec<String> = Site::all(3, true).iter().map(Site::to_string).collect();
        assert_eq!(names.join(" "), "ground-1 ground-2 ground-3 1-2 2-3 base-1 base-2 base-3");
        assert_eq!(Site::all(1, false), [Site::Ground(0)]);
    }

    #[test]
    fn the_base_has_its_input_s_number_where_there_are_several() {
        let layout = |inputs| Layout { freedoms: 1, inputs, ..Layout::default() };
        assert_eq!(Site::Base(0).displacement(&layout(1)), "x − u");
        assert_eq!(Site::Base(0).velocity(&layout(2)), "v − du1");
    }
}
