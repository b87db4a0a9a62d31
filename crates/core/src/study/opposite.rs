//! Forces between two masses that are equal and opposite (Newton's third law): what a coefficient is in the equation of one
//! mass it is in that of the other with the other sign, and divided by the ratio of the masses.

use nalgebra::{DMatrix, DVector};

use super::known::{Known, Pair};
use super::settings::Settings;
use crate::refine::scaled_inverse;
use sindyscope_values::model::Model;
use sindyscope_values::term::{Symbol, Term};

/// Displacements and velocities at which terms are compared.
const TRIAL_STATES: [(f64, f64); 3] = [(0.013, -0.21), (-0.83, 1.7), (2.9, 0.37)];
/// Displacement and velocity that all masses are moved by in common: a joint's force does not change.
const TRIAL_SHIFT: f64 = 0.61;

/// Least ratio of two masses, and least inverse of it.
const MIN_RATIO: f64 = 1e-6;

/// Steps of the search for coefficients that obey, at most.
const MAX_STEPS: usize = 60;
/// Step, as a share of the parameters, at which that search ends.
const CONVERGED_STEP: f64 = 1e-12;

impl Pair {
    /// True if both are of the same two masses.
    pub fn is_of_same_masses(&self, other: &Self) -> bool {
        let masses = |pair: &Self| (pair.first.min(pair.second), pair.first.max(pair.second));
        masses(self) == masses(other)
    }

    /// True if a term is a force between the two: it depends on both, and on nothing but their relative motion.
    pub(super) fn joins(&self, term: &Term) -> bool {
        let own = |s: &Symbol| matches!(s, Symbol::State(i) | Symbol::Rate(i) if *i == self.first || *i == self.second);
        let symbols = term.symbols();
        let moves = |mass: usize| symbols.iter().any(|s| matches!(s, Symbol::State(i) | Symbol::Rate(i) if *i == mass));
        if !symbols.iter().all(own) || !moves(self.first) || !moves(self.second) {
            return false;
        }
        let value = |(a, b): (f64, f64), moved: f64| {
            term.expression().value(&|s| match s {
                Symbol::State(i) if i == self.first => a + moved,
                Symbol::Rate(i) if i == self.first => b + moved,
                Symbol::State(_) | Symbol::Rate(_) => 0.4 * a * b + moved,
                _ => 0.0,
            })
        };
        TRIAL_STATES.iter().all(|at| {
            let (here, there) = (value(*at, 0.0), value(*at, TRIAL_SHIFT));
            (here - there).abs() <= 1e-9 * (here.abs() + there.abs())
        })
    }

    /// The second mass over the first one in a model that obeys, with its standard error; none without a force between them.
    ///
    /// `covariance` is that of the coefficients of all accelerations, in their order.
    pub(super) fn found(&self, model: &Model, covariance: &[Vec<f64>]) -> Option<(f64, Option<f64>)> {
        let first = model.layout.states() - model.layout.freedoms;
        let start = |mass: usize| model.equations[first..first + mass].iter().map(|e| e.terms.len()).sum::<usize>();
        let terms = |mass: usize| model.equations[first + mass].terms.iter().enumerate();
        let joint = |(k, part): &(usize, &sindyscope_values::model::WeightedTerm)| {
            let other = terms(self.second).find(|(_, other)| other.term == part.term && self.joins(&part.term));
            other.map(|(j, other)| (*k, part.coefficient, j, other.coefficient, part.share))
        };
        let largest = terms(self.first).filter_map(|t| joint(&t)).max_by(|a, b| a.4.total_cmp(&b.4));
        let (i, a, j, b, _) = largest?;
        let ratio = -a / b;
        let (i, j) = (start(self.first) + i, start(self.second) + j);
        let entry = |row: usize, column: usize| covariance.get(row).and_then(|r| r.get(column)).copied();
        let variance = || Some(entry(i, i)? / (a * a) + entry(j, j)? / (b * b) - 2.0 * entry(i, j)? / (a * b));
        let error = variance().map(|v| ratio.abs() * v.max(0.0).sqrt()).filter(|e| *e > 0.0 && e.is_finite());
        Some((ratio, error))
    }
}

/// The pairs that some settings know of.
pub(super) fn pairs(settings: &Settings) -> Vec<Pair> {
    settings
        .known
        .iter()
        .filter_map(|known| if let Known::Opposite(pair) = known { Some(*pair) } else { None })
        .collect()
}

/// What a coefficient is.
#[derive(Clone, Copy, Debug)]
enum FollowingPart {
    /// A parameter.
    Own(usize),
    /// A parameter with the other sign, over a ratio of masses that is known.
    Over(usize, f64),
    /// A parameter with the other sign, times another one: the inverse ratio of the masses.
    Times(usize, usize),
}

/// How the coefficients of several equations follow from fewer parameters.
#[derive(Clone, Debug)]
pub(super) struct SharedParameters {
    parts: Vec<FollowingPart>,
    /// For each parameter the coefficient that it is; none of the inverse of a ratio.
    owners: Vec<Option<usize>>,
}

impl SharedParameters {
    /// Of coefficients that each belong to a term in the equation of a degree of freedom.
    pub(super) fn new(terms: &[(usize, &Term)], pairs: &[Pair]) -> Self {
        let mut owners: Vec<Option<usize>> = Vec::new();
        let partner = |k: usize| {
            let (freedom, term) = terms[k];
            pairs.iter().enumerate().find_map(|(p, pair)| {
                let joined = pair.second == freedom && pair.joins(term);
                let other = terms.iter().position(|(f, t)| *f == pair.first && *t == term)?;
                joined.then_some((p, other))
            })
        };
        let mut own = vec![0; terms.len()];
        for k in (0..terms.len()).filter(|k| partner(*k).is_none()) {
            own[k] = owners.len();
            owners.push(Some(k));
        }
        let mut inverse: Vec<Option<usize>> = vec![None; pairs.len()];
        let mut parts = Vec::with_capacity(terms.len());
        for k in 0..terms.len() {
            parts.push(match partner(k) {
                None => FollowingPart::Own(own[k]),
                Some((p, of)) => match pairs[p].ratio {
                    Some(ratio) => FollowingPart::Over(own[of], ratio),
                    None => {
                        let place = *inverse[p].get_or_insert_with(|| {
                            owners.push(None);
                            owners.len() - 1
                        });
                        FollowingPart::Times(own[of], place)
                    }
                },
            });
        }
        Self { parts, owners }
    }

    /// True if every coefficient is a parameter of its own.
    pub(super) fn is_plain(&self) -> bool {
        self.parts.iter().all(|p| matches!(p, FollowingPart::Own(_)))
    }

    /// For each parameter the coefficient that it is; none of the inverse of a ratio of masses.
    pub(super) fn owners(&self) -> &[Option<usize>] {
        &self.owners
    }

    /// The values that the inverse of a ratio may have.
    pub(super) const RATIOS: (f64, f64) = (MIN_RATIO, 1.0 / MIN_RATIO);

    /// One coefficient at some parameters.
    pub(super) fn coefficient(&self, index: usize, parameters: &[f64]) -> f64 {
        match self.parts[index] {
            FollowingPart::Own(p) => parameters[p],
            FollowingPart::Over(p, ratio) => -parameters[p] / ratio,
            FollowingPart::Times(p, inverse) => -parameters[p] * parameters[inverse],
        }
    }

    /// Parameters near coefficients that need not obey.
    pub(super) fn parameters(&self, coefficients: &[f64]) -> Vec<f64> {
        let slope = |(p, owner): (usize, &Option<usize>)| {
            owner.map_or_else(
                || {
                    // Least squares of what the second mass feels over what the first does.
                    let (mut product, mut square) = (0.0, 0.0);
                    for (part, c) in self.parts.iter().zip(coefficients) {
                        if let FollowingPart::Times(of, inverse) = part
                            && *inverse == p
                            && let Some(owner) = self.owners[*of]
                        {
                            product -= coefficients[owner] * c;
                            square += coefficients[owner].powi(2);
                        }
                    }
                    if product > 0.0 && square > 0.0 { product / square } else { 1.0 }
                },
                |k| coefficients[k],
            )
        };
        self.owners.iter().enumerate().map(slope).collect()
    }

    /// What the coefficients do as each parameter moves.
    pub(super) fn slopes(&self, parameters: &[f64]) -> DMatrix<f64> {
        let mut slopes = DMatrix::zeros(self.parts.len(), self.owners.len());
        for (k, part) in self.parts.iter().enumerate() {
            match *part {
                FollowingPart::Own(p) => slopes[(k, p)] = 1.0,
                FollowingPart::Over(p, ratio) => slopes[(k, p)] = -1.0 / ratio,
                FollowingPart::Times(p, inverse) => {
                    slopes[(k, p)] = -parameters[inverse];
                    slopes[(k, inverse)] = -parameters[p];
                }
            }
        }
        slopes
    }

    /// The coefficients that obey and are nearest to those given, distances measured by their information matrix; and what
    /// they do, to first order, as those given move. None where the matrix does not tell.
    pub(super) fn nearest(&self, given: &[f64], information: &DMatrix<f64>) -> Option<(Vec<f64>, DMatrix<f64>)> {
        let wanted = DVector::from_column_slice(given);
        let at = |parameters: &[f64]| {
            DVector::from_iterator(given.len(), (0..given.len()).map(|k| self.coefficient(k, parameters)))
        };
        let distance = |parameters: &[f64]| {
            let off = at(parameters) - &wanted;
            off.dot(&(information * &off))
        };
        let mut parameters = self.parameters(given);
        let mut left = distance(&parameters);
        for _ in 0..MAX_STEPS {
            let (inverse, slopes) = self.normal(&parameters, information)?;
            let step = inverse * slopes.transpose() * information * (&wanted - at(&parameters));
            let tried = [1.0, 0.5, 0.1, 0.01].iter().find_map(|share| {
                let moved = |(p, (value, by)): (usize, (&f64, &f64))| {
                    let next = value + share * by;
                    if self.owners[p].is_some() { next } else { next.clamp(Self::RATIOS.0, Self::RATIOS.1) }
                };
                let next: Vec<f64> = parameters.iter().zip(step.iter()).enumerate().map(moved).collect();
                let found = distance(&next);
                (found <= left).then_some((next, found))
            });
            let Some((next, found)) = tried else { break };
            let still = next.iter().zip(&parameters).all(|(a, b)| (a - b).abs() <= CONVERGED_STEP * b.abs());
            (parameters, left) = (next, found);
            if still {
                break;
            }
        }
        let (inverse, slopes) = self.normal(&parameters, information)?;
        let follows = &slopes * inverse * slopes.transpose() * information;
        Some((at(&parameters).iter().copied().collect(), follows))
    }

    /// The inverse of the parameters' information, and the coefficients' slopes.
    fn normal(&self, parameters: &[f64], information: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let slopes = self.slopes(parameters);
        let inverse = scaled_inverse(&(slopes.transpose() * information * &slopes), 0.0)?;
        inverse.iter().all(|v| v.is_finite()).then_some((inverse, slopes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{Cancel, Outcome, Own, Study, known_list, suggest};
    use sindyscope_rig::{Noise, ScenarioOptions, generate};
    use sindyscope_values::record::{RecordSet, Usage};
    use sindyscope_values::term::{Kind, list};

    const PAIR: Pair = Pair { first: 0, second: 1, ratio: None };

    #[test]
    fn a_force_between_two_masses_depends_on_their_relative_motion_alone() {
        let joins = |text: &str| PAIR.joins(&Term::parse(text).unwrap());
        for text in ["x2-x1", "v1-v2", "sgn(v2-v1)", "(x2-x1)^3", "(x2-x1)^2*(v2-v1)"] {
            assert!(joins(text), "{text}");
        }
        for text in ["x1", "x2-2*x1", "x1*x2", "v1", "1", "u", "x3-x1", "sgn(v1)", "x2-x1-u"] {
            assert!(!joins(text), "{text}");
        }
    }

    #[test]
    fn the_nearest_coefficients_that_obey_are_those_of_least_squares() {
        let terms = list("x1, x2-x1, v2-v1").unwrap();
        let all: Vec<(usize, &Term)> = terms.iter().map(|t| (0, t)).chain(terms[1..].iter().map(|t| (1, t))).collect();
        let known = SharedParameters::new(&all, &[Pair { ratio: Some(2.0), ..PAIR }]);
        let (found, follows) = known.nearest(&[-3.0, 5.0, 0.4, -3.0, -0.3], &DMatrix::identity(5, 5)).unwrap();
        // s of (s − 5)² + (s/2 − 3)²: (5 + 1.5)/1.25.
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(close(found[0], -3.0) && close(found[1], 5.2) && close(found[3], -2.6), "{found:?}");
        assert!(close(follows[(1, 1)], 0.8) && close(follows[(1, 3)], -0.4), "{follows}");
        let sought = SharedParameters::new(&all, &[PAIR]);
        assert!(!sought.is_plain() && sought.owners().len() == 4);
        // One ratio for both terms, and what obeys already stays.
        let (found, _) = sought.nearest(&[-3.0, 5.0, 0.4, -2.5, -0.2], &DMatrix::identity(5, 5)).unwrap();
        assert!(found.iter().zip([-3.0, 5.0, 0.4, -2.5, -0.2]).all(|(a, b)| close(*a, b)), "{found:?}");
        let (found, _) = sought.nearest(&[-3.0, 5.0, 0.4, -2.6, -0.3], &DMatrix::identity(5, 5)).unwrap();
        assert!(close(found[1] / found[3], found[2] / found[4]), "{found:?}");
    }

    fn chain(seed: u64) -> RecordSet {
        let options = ScenarioOptions {
            seed,
            duration: Some(10.0),
            noise: Some(Noise::ShareOfPeak(0.01)),
            ..ScenarioOptions::default()
        };
        RecordSet::new(generate("two-masses", &options).unwrap().records, Usage::Fit)
    }

    fn run(known: &str, refine: bool, seed: u64) -> Outcome {
        let records = chain(seed);
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        let own = |terms: &str| Own { terms: Some(list(terms).unwrap()), ..Own::default() };
        settings.own = [(0, own("x1, x2-x1, v1, v2-v1, u")), (1, own("x2-x1, v2-v1"))].into();
        settings.known = known_list(known).unwrap();
        (settings.threshold, settings.refine) = (0.0, refine);
        Study::default().run(&records, &settings, &Cancel::default()).unwrap()
    }

    #[test]
    fn the_ratio_of_the_masses_is_found_and_a_known_one_is_kept_to() {
        // The rig's chain: 2 kg and 1 kg, 600 N/m and 1.2 N s/m between them.
        let coefficient = |outcome: &Outcome, state: usize, text: &str| {
            let term = Term::parse(text).unwrap();
            let found = outcome.model.equations[state].terms.iter().find(|t| t.term == term).unwrap();
            (found.coefficient, found.std_error.unwrap())
        };
        for refine in [false, true] {
            let (free, sought, known) = (run("", refine, 3), run("m2/m1", refine, 3), run("m2/m1=0.5", refine, 3));
            for text in ["x2-x1", "v2-v1"] {
                let ratio = |o: &Outcome| -coefficient(o, 2, text).0 / coefficient(o, 3, text).0;
                assert!((ratio(&known) - 0.5).abs() < 1e-9 && (ratio(&free) - 0.5).abs() > 1e-9, "{}", ratio(&known));
                assert!((ratio(&sought) / coefficient_ratio(&sought) - 1.0).abs() < 1e-9, "{}", ratio(&sought));
            }
            // A weak damper is known better from both equations than from one.
            let error = |o: &Outcome| coefficient(o, 2, "v2-v1").1;
            assert!(error(&known) < 0.7 * error(&free) && error(&sought) < 0.7 * error(&free));
            let told = sought.physical();
            let ratio = told.iter().find(|p| p.name == "m2/m1").unwrap();
            assert!((ratio.value - 0.5).abs() < 4.0 * ratio.std_error.unwrap() + 0.005, "{ratio:?}");
        }
    }

    fn coefficient_ratio(outcome: &Outcome) -> f64 {
        PAIR.found(&outcome.model, outcome.covariance.all()).unwrap().0
    }

    #[test]
    fn a_pair_without_a_force_between_it_is_refused() {
        let records = chain(1);
        let refused = |known: &str, terms: &str| {
            let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
            (settings.known, settings.terms) = (known_list(known).unwrap(), list(terms).unwrap());
            Study::default().run(&records, &settings, &Cancel::default()).unwrap_err().to_string()
        };
        assert!(refused("m2/m1", "x1, x2, v1, v2, u").contains("x2-x1"));
        assert!(refused("m3/m1", "x1, x2-x1, u").contains("m3"));
    }
}
