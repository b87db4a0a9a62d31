//! How the errors of the identified coefficients are correlated, over all equations.

use nalgebra::DMatrix;

use crate::sparse::Scores;
use sindyscope_values::model::Model;

/// Covariance of the errors of the fitted equations' coefficients: equation after equation, terms in their order. Zero for
/// a coefficient that was given, not a number where nothing is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Covariance {
    entries: Vec<Vec<f64>>,
    /// The first coefficient of each fitted equation, and one past the last.
    starts: Vec<usize>,
}

impl Covariance {
    /// That of equations with these numbers of terms, of which nothing is known yet: all NaN.
    pub(super) fn unknown(terms: impl IntoIterator<Item = usize>) -> Self {
        let mut starts = vec![0];
        for count in terms {
            starts.push(starts[starts.len() - 1] + count);
        }
        let all = starts[starts.len() - 1];
        Self { entries: vec![vec![f64::NAN; all]; all], starts }
    }

    /// That of regressions on the same rows: the scores of each, and the place of each of its equation's terms among the
    /// columns that were fitted (none for a coefficient that was given).
    pub(super) fn of_regression(fits: &[(Scores, Vec<Option<usize>>)]) -> Self {
        let mut covariance = Self::unknown(fits.iter().map(|(_, places)| places.len()));
        for (a, (scores, rows)) in fits.iter().enumerate() {
            for (b, (others, columns)) in fits.iter().enumerate().skip(a) {
                let found = scores.covariance(others);
                for (i, row) in rows.iter().enumerate() {
                    for (j, column) in columns.iter().enumerate() {
                        let entry = match (row.zip(*column), &found) {
                            (Some(place), Some(found)) => found[place],
                            (Some(_), None) => f64::NAN,
                            (None, _) => 0.0,
                        };
                        covariance.set((a, i), (b, j), entry);
                    }
                }
            }
        }
        covariance
    }

    /// Sets an entry and the one across: each place is a fitted equation and the place of a term in it.
    pub(super) fn set(&mut self, a: (usize, usize), b: (usize, usize), value: f64) {
        let [i, j] = [a, b].map(|(equation, term)| self.starts[equation] + term);
        self.entries[i][j] = value;
        self.entries[j][i] = value;
    }

    /// Adds the product of errors that belong together, one for each coefficient.
    pub(super) fn add_product(&mut self, errors: &[f64]) {
        for (row, a) in self.entries.iter_mut().zip(errors) {
            row.iter_mut().zip(errors).for_each(|(entry, b)| *entry += a * b);
        }
    }

    /// Makes the coefficients at some places follow from themselves by a matrix: they are no longer free.
    pub(super) fn transform(&mut self, matrix: &DMatrix<f64>, places: &[(usize, usize)]) {
        let all = self.entries.len();
        let at: Vec<usize> = places.iter().map(|(equation, term)| self.starts[*equation] + term).collect();
        let mut whole = DMatrix::identity(all, all);
        for (i, row) in at.iter().enumerate() {
            for (j, column) in at.iter().enumerate() {
                whole[(*row, *column)] = matrix[(i, j)];
            }
        }
        let entries = DMatrix::from_fn(all, all, |i, j| self.entries[i][j]);
        let entries = &whole * entries * whole.transpose();
        self.entries = (0..all).map(|i| (0..all).map(|j| entries[(i, j)]).collect()).collect();
    }

    /// Writes the standard errors to a model's coefficients; `fitted` are its equations that were fitted.
    pub(super) fn tell(&self, model: &mut Model, fitted: impl Iterator<Item = usize>) {
        for (equation, index) in fitted.enumerate() {
            for (k, term) in model.equations[index].terms.iter_mut().enumerate() {
                let at = self.starts[equation] + k;
                // A coefficient that was given has no error that data could tell.
                term.std_error = Some(self.entries[at][at].sqrt()).filter(|e| *e > 0.0 && e.is_finite());
            }
        }
    }

    /// All of it.
    pub fn all(&self) -> &[Vec<f64>] {
        &self.entries
    }

    /// The covariance within one fitted equation, `[term][term]`; empty if there is no such equation.
    pub fn of_equation(&self, equation: usize) -> Vec<Vec<f64>> {
        let (Some(from), Some(to)) = (self.starts.get(equation), self.starts.get(equation + 1)) else {
            return Vec::new();
        };
        self.entries[*from..*to].iter().map(|row| row[*from..*to].to_vec()).collect()
    }
}
