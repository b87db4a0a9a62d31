//! Every equation's solution, and what equal and opposite forces between masses make of several equations' solutions.

use nalgebra::DMatrix;

use super::{Regression, freedom, options};
use crate::sparse::{Constraint, Reduced, Solution};
use crate::study::Settings;
use crate::study::covariance::Covariance;
use crate::study::known::Pair;
use crate::study::opposite::{SharedParameters, pairs};
use sindyscope_values::term::Term;

/// Residual, as a share of the rate, below which it is rounding.
const MIN_RESIDUAL: f64 = 1e-12;

/// What the coefficients of all equations do as those of least squares, equation by equation, move.
pub(super) struct DependentCoefficients {
    /// For each coefficient its target and its column.
    places: Vec<(usize, usize)>,
    matrix: DMatrix<f64>,
}

impl DependentCoefficients {
    /// Makes the covariance of free coefficients that of those that follow from them; `columns` are each equation's terms
    /// among the columns.
    pub(super) fn transform(&self, covariance: &mut Covariance, columns: &[Vec<usize>]) {
        let place = |(target, column): &(usize, usize)| {
            columns.get(*target)?.iter().position(|c| c == column).map(|term| (*target, term))
        };
        if let Some(places) = self.places.iter().map(place).collect::<Option<Vec<_>>>() {
            covariance.transform(&self.matrix, &places);
        }
    }
}

impl Regression {
    /// The thresholded solution of every equation, with its constraints.
    pub(super) fn solutions(
        &self,
        settings: &Settings,
    ) -> (Vec<Solution>, Vec<Vec<Constraint>>, Option<DependentCoefficients>) {
        let mut constraints: Vec<Vec<Constraint>> =
            self.targets.iter().map(|target| self.constraints(settings, target)).collect();
        let reduced: Vec<&Reduced> = self.targets.iter().map(|target| &target.reduced).collect();
        let (solutions, follows) = self.solved(settings, &reduced, &mut constraints);
        (solutions, constraints, follows)
    }

    /// The thresholded solution of every equation's reduced problem under its constraints, which the other equations may
    /// add to.
    pub(super) fn solved(
        &self,
        settings: &Settings,
        reduced: &[&Reduced],
        constraints: &mut [Vec<Constraint>],
    ) -> (Vec<Solution>, Option<DependentCoefficients>) {
        let options = options(settings);
        let solve = |target: usize, constraints: &[Constraint]| {
            let mut solution = settings.regressor.solve(reduced[target], constraints, &options);
            // What a sign holds at zero is no term.
            let Solution { support, coefficients, .. } = &mut solution;
            support.retain(|k| coefficients[*k] != 0.0 || constraints[*k] == Constraint::In);
            solution
        };
        let mut solutions: Vec<Solution> = constraints.iter().enumerate().map(|(t, c)| solve(t, c)).collect();
        let pairs = pairs(settings);
        if pairs.is_empty() {
            return (solutions, None);
        }
        for target in self.join(&pairs, &solutions, constraints) {
            solutions[target] = solve(target, &constraints[target]);
        }
        let follows = self.oppose(&pairs, reduced, &mut solutions);
        (solutions, follows)
    }

    /// Keeps a force between two masses in both equations where it is in one; the targets that are to be solved again.
    fn join(&self, pairs: &[Pair], solutions: &[Solution], constraints: &mut [Vec<Constraint>]) -> Vec<usize> {
        let mut again = Vec::new();
        let target = |mass: usize| self.targets.iter().position(|t| freedom(&self.layout, t) == Some(mass));
        for pair in pairs {
            let (Some(a), Some(b)) = (target(pair.first), target(pair.second)) else { continue };
            for column in (0..self.terms.len()).filter(|k| pair.joins(&self.terms[*k])) {
                for (with, without) in [(a, b), (b, a)] {
                    let lacks =
                        solutions[with].support.contains(&column) && !solutions[without].support.contains(&column);
                    if lacks && constraints[without][column] == Constraint::Free {
                        constraints[without][column] = Constraint::In;
                        again.push(without);
                    }
                }
            }
        }
        again.sort_unstable();
        again.dedup();
        again
    }

    /// Moves the coefficients to the nearest ones that obey, each equation's measured by what its rows know of them.
    fn oppose(
        &self,
        pairs: &[Pair],
        reduced: &[&Reduced],
        solutions: &mut [Solution],
    ) -> Option<DependentCoefficients> {
        let places: Vec<(usize, usize)> =
            solutions.iter().enumerate().flat_map(|(t, s)| s.support.iter().map(move |k| (t, *k))).collect();
        // Of dx/dt there is no mass: no pair has it.
        let mass = |target: usize| freedom(&self.layout, &self.targets[target]).unwrap_or(usize::MAX);
        let terms: Vec<(usize, &Term)> = places.iter().map(|(t, k)| (mass(*t), &self.terms[*k])).collect();
        let shared = SharedParameters::new(&terms, pairs);
        if shared.is_plain() {
            return None;
        }
        let mut information = DMatrix::zeros(places.len(), places.len());
        let mut squares: Vec<DMatrix<f64>> = Vec::with_capacity(solutions.len());
        let mut first = 0;
        for (reduced, solution) in reduced.iter().zip(solutions.iter()) {
            let count = solution.support.len();
            let square = reduced.inverse_gram(&solution.support)?.try_inverse()?;
            let error = solution.residual_rms.max(MIN_RESIDUAL * reduced.target_scale());
            information.view_mut((first, first), (count, count)).copy_from(&(&square / (error * error)));
            squares.push(square);
            first += count;
        }
        let given: Vec<f64> = places.iter().map(|(t, k)| solutions[*t].coefficients[*k]).collect();
        let (nearest, matrix) = shared.nearest(&given, &information)?;
        let mut moved = nearest.iter().zip(&given).map(|(a, b)| a - b);
        for ((reduced, solution), square) in reduced.iter().zip(solutions).zip(squares) {
            let by: Vec<f64> = moved.by_ref().take(solution.support.len()).collect();
            let by = nalgebra::DVector::from_vec(by);
            let rows = reduced.rows().max(1) as f64;
            solution.residual_rms = (solution.residual_rms.powi(2) + by.dot(&(square * &by)) / rows).sqrt();
            solution.support.iter().zip(by.iter()).for_each(|(k, by)| solution.coefficients[*k] += by);
        }
        Some(DependentCoefficients { places, matrix })
    }
}
