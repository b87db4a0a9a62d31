//! Sequentially thresholded least squares, and what every way to a sparse solution shares.

use super::Reduced;

/// What is decided about a column before the regression.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Constraint {
    /// The threshold decides.
    #[default]
    Free,
    /// Kept whatever its coefficient.
    In,
    /// Not used.
    Out,
    /// Kept at this coefficient.
    Fixed(f64),
}

/// How coefficients are compared with the threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparseOptions {
    /// Coefficients smaller than this are dropped.
    pub threshold: f64,
    /// Ridge weight α while terms are being dropped; the kept ones are refitted without it.
    pub ridge: f64,
    /// Compare coefficients of columns and target divided by their RMS; otherwise as they stand. The ridge penalises
    /// the same coefficients: α‖c‖² beside the mean square residual if scaled, beside the sum of squares if not.
    pub scaled: bool,
}

/// A sparse solution.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Coefficient of each column; 0 where it is not used.
    pub coefficients: Vec<f64>,
    /// Columns fitted (not those fixed), ascending.
    pub support: Vec<usize>,
    /// RMS of the residual.
    pub residual_rms: f64,
    /// Smallest threshold above the one given at which something changes; infinite if nothing will, or not known.
    pub next_change: f64,
    /// Posterior probability that each column belongs; empty but for [`Regressor::Bayes`](super::Regressor::Bayes).
    pub probability: Vec<f64>,
}

impl SparseOptions {
    /// The ridge's weight on a column's scaled coefficient, beside columns of norm √rows.
    pub(super) fn ridge_weight(&self, reduced: &Reduced, column: usize) -> f64 {
        let scale = reduced.scale()[column];
        if self.scaled { self.ridge * reduced.rows().max(1) as f64 } else { self.ridge / (scale * scale) }
    }
}

impl Solution {
    /// Plain least squares on the columns `keep`, fixed ones beside them.
    pub(super) fn on(reduced: &Reduced, constraints: &[Constraint], mut keep: Vec<usize>) -> Self {
        keep.sort_unstable();
        let fixed = fixed(constraints);
        let (b, residual) = reduced.solve(&keep, &fixed, |_| 0.0);
        let mut coefficients = vec![0.0; reduced.columns()];
        for (k, value) in &fixed {
            coefficients[*k] = *value;
        }
        for (b, k) in b.iter().zip(&keep) {
            coefficients[*k] = b * reduced.target_scale() / reduced.scale()[*k];
        }
        let residual_rms = residual * reduced.target_scale();
        Self { coefficients, support: keep, residual_rms, next_change: f64::INFINITY, probability: Vec::new() }
    }
}

/// Columns kept at a coefficient that is given.
pub(super) fn fixed(constraints: &[Constraint]) -> Vec<(usize, f64)> {
    let value = |c: &Constraint| if let Constraint::Fixed(value) = c { Some(*value) } else { None };
    constraints.iter().enumerate().filter_map(|(k, c)| Some((k, value(c)?))).collect()
}

/// Columns whose coefficient is to be found.
pub(super) fn fitted(reduced: &Reduced, constraints: &[Constraint]) -> Vec<usize> {
    (0..reduced.columns())
        .filter(|k| matches!(constraints[*k], Constraint::Free | Constraint::In) && !reduced.unusable(*k))
        .collect()
}

/// Sequentially thresholded least squares (Brunton, Proctor & Kutz 2016): fit, drop the small, again until nothing drops,
/// then refit without ridge.
///
/// `constraints` holds one entry a column.
pub fn stlsq(reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Solution {
    let fixed = fixed(constraints);
    let size = |b: f64, k: usize| {
        if options.scaled { b.abs() } else { (b * reduced.target_scale() / reduced.scale()[k]).abs() }
    };
    let ridge = |k: usize| options.ridge_weight(reduced, k);
    let mut keep = fitted(reduced, constraints);
    let mut next_change = f64::INFINITY;
    loop {
        let (b, _) = reduced.solve(&keep, &fixed, ridge);
        let before = keep.len();
        let mut sizes = b.iter().zip(keep.clone()).map(|(b, k)| size(*b, k));
        keep.retain(|k| {
            let size = sizes.next().unwrap_or(0.0);
            if constraints[*k] == Constraint::In {
                return true;
            }
            let stays = size >= options.threshold;
            // A coefficient that its sign holds at zero is no change to come.
            if stays && size > 0.0 {
                next_change = next_change.min(size);
            }
            stays
        });
        if keep.len() == before {
            break;
        }
    }
    Solution { next_change, ..Solution::on(reduced, constraints, keep) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Regressor, drop_path};

    /// y = 3a − 0.5b + 0.02c with units far apart.
    fn problem(unit: f64) -> (Vec<Vec<f64>>, Vec<f64>) {
        let n = 2000;
        let wave = |a: f64| (0..n).map(|k| (a * f64::from(k)).sin()).collect::<Vec<f64>>();
        let (a, b, c, d) = (wave(0.11), wave(0.07), wave(0.19), wave(0.29));
        let y = (0..n as usize).map(|k| 3.0 * a[k] - 0.5 * b[k] + 0.02 * c[k]).collect();
        let b = b.iter().map(|v| v * unit).collect();
        (vec![a, b, c, d], y)
    }

    fn run(unit: f64, threshold: f64, scaled: bool) -> Solution {
        let (columns, y) = problem(unit);
        let free = vec![Constraint::Free; columns.len()];
        stlsq(&Reduced::new(&columns, &y), &free, &SparseOptions { threshold, ridge: 0.0, scaled })
    }

    #[test]
    fn scaled_thresholds_do_not_know_units() {
        for unit in [1.0, 1e-3, 1e3] {
            assert_eq!(run(unit, 0.05, true).support, [0, 1], "{unit}");
        }
        assert_eq!(run(1.0, 0.05, false).support, [0, 1]);
        assert_eq!(run(1e3, 0.05, false).support, [0], "raw coefficients depend on units, as in the Python package");
    }

    #[test]
    fn locks_hold() {
        let (columns, y) = problem(1.0);
        let reduced = Reduced::new(&columns, &y);
        let options = SparseOptions { threshold: 0.5, ridge: 0.0, scaled: true };
        let constraints = [Constraint::Free, Constraint::Out, Constraint::In, Constraint::Fixed(0.25)];
        let solution = stlsq(&reduced, &constraints, &options);
        assert_eq!(solution.support, [0, 2]);
        assert_eq!(solution.coefficients[1], 0.0);
        assert_eq!(solution.coefficients[3], 0.25);
        let fixed =
            stlsq(&reduced, &[Constraint::Fixed(3.0), Constraint::In, Constraint::In, Constraint::Free], &options);
        assert!((fixed.coefficients[1] + 0.5).abs() < 1e-12 && fixed.residual_rms < 1e-12, "{fixed:?}");
    }

    #[test]
    fn the_drop_path_is_where_terms_leave() {
        let (columns, y) = problem(1.0);
        let reduced = Reduced::new(&columns, &y);
        let free = vec![Constraint::Free; columns.len()];
        let options = SparseOptions { threshold: 0.0, ridge: 0.0, scaled: true };
        let path = drop_path(&Regressor::Stlsq.path(&reduced, &free, &options));
        assert_eq!(path.iter().map(|p| p.1).collect::<Vec<_>>(), [3, 2, 1, 0]);
        for (at, k) in &path {
            let below = stlsq(&reduced, &free, &SparseOptions { threshold: at * (1.0 - 1e-9), ..options });
            let above = stlsq(&reduced, &free, &SparseOptions { threshold: at * (1.0 + 1e-9), ..options });
            assert!(below.support.contains(k) && !above.support.contains(k), "{k} at {at}");
        }
    }

    #[test]
    fn everything_dropped_is_a_zero_model() {
        let solution = run(1.0, 1e9, true);
        assert!(solution.support.is_empty() && solution.coefficients.iter().all(|c| *c == 0.0));
        assert_eq!(solution.next_change, f64::INFINITY);
    }
}
