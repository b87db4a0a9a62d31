//! Scores of sets of columns: regressions on Gram matrices, each block of rows left out in turn.

use nalgebra::DMatrix;
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::signal::dots;
use sindyscope_core::study::Cancel;

/// Most columns that one regression takes.
pub(super) const MOST: usize = 40;
/// Ridge on the diagonal of scaled normal equations, so that nearly dependent columns can be solved for.
const RIDGE: f64 = 1e-9;
/// Least variance of a whitened residual that counts: correlated rows leave less than one.
const LEAST_VARIANCE: f64 = 0.2;

/// Products of columns, over all rows and over each block. Column 0 is the target.
#[derive(Debug, Default)]
pub(super) struct Gram {
    total: DMatrix<f64>,
    blocks: Vec<(f64, DMatrix<f64>)>,
}

/// What a regression on all rows comes to.
#[derive(Clone, Debug)]
pub(super) struct GramSolution {
    pub(super) coefficients: Vec<f64>,
    pub(super) left: f64,
}

impl Gram {
    /// Of a cancelled search the products are not all there.
    pub(super) fn new(columns: &[Vec<f64>], blocks: &[std::ops::Range<usize>], cancel: &Cancel) -> Self {
        let blocks: Vec<(f64, DMatrix<f64>)> = blocks
            .into_par_iter()
            .filter(|_| !cancel.is_cancelled())
            .map(|rows| {
                let mut products = DMatrix::zeros(columns.len(), columns.len());
                // Not in tiles, which each processor adds up otherwise: where a fit lands may hang on the last digit of its start.
                let part = |k: usize| &columns[k][rows.clone()];
                let mut of_column = Vec::new();
                for j in 0..columns.len() {
                    if cancel.is_cancelled() {
                        break;
                    }
                    of_column.clear();
                    dots(part(j), (0..=j).map(part), &mut of_column);
                    for (i, product) in of_column.iter().enumerate() {
                        (products[(i, j)], products[(j, i)]) = (*product, *product);
                    }
                }
                (rows.len() as f64, products)
            })
            .collect();
        let zero = DMatrix::zeros(columns.len(), columns.len());
        let total = blocks.iter().fold(zero, |sum, (_, block)| sum + block);
        Self { total, blocks }
    }

    /// The same with further columns behind, over all rows alone; `columns` are those of before.
    pub(super) fn beside(&self, columns: &[&[f64]], further: &[Vec<f64>]) -> Self {
        let before = columns.len();
        let count = before + further.len();
        let all = |k: usize| columns.get(k).copied().unwrap_or_else(|| &further[k - before]);
        let mut total = self.total.clone().resize(count, count, 0.0);
        let mut of_column = Vec::new();
        for j in before..count {
            of_column.clear();
            dots(all(j), (0..=j).map(all), &mut of_column);
            for (i, product) in of_column.iter().enumerate() {
                (total[(i, j)], total[(j, i)]) = (*product, *product);
            }
        }
        Self { total, blocks: Vec::new() }
    }

    /// Least squares of the target on some columns; none where they cannot be told apart.
    pub(super) fn solve(&self, columns: &[usize]) -> Option<GramSolution> {
        let mut coefficients = vec![0.0; columns.len()];
        solve(|i, j| self.total[(i, j)], columns, &mut coefficients)?;
        let gained: f64 = columns.iter().zip(&coefficients).map(|(c, x)| x * self.total[(*c, 0)]).sum();
        Some(GramSolution { left: self.total[(0, 0)] - gained, coefficients })
    }

    /// Log density of the blocks, each predicted from the others, in whitened rows; −∞ where that cannot be solved. What a block
    /// misses is counted in the uncertainty of its prediction too: a block that alone shows an effect is not held against it.
    ///
    /// So counted it is what all rows leave less what the others leave. Source: R. Brown, J. Durbin, J. Evans, "Techniques for testing
    /// the constancy of regression relationships over time", J. R. Stat. Soc. B 37 (1975) 149–192 (recursive residuals).
    pub(super) fn predictive(&self, columns: &[usize], worth: f64) -> f64 {
        let rows: f64 = self.blocks.iter().map(|b| b.0).sum();
        let Some(all) = Fit::new(|i, j| self.total[(i, j)], columns) else { return f64::NEG_INFINITY };
        let mut sum = 0.0;
        for (count, block) in &self.blocks {
            let Some(others) = Fit::new(|i, j| self.total[(i, j)] - block[(i, j)], columns) else {
                return f64::NEG_INFINITY;
            };
            let freedom = (rows - count - columns.len() as f64 / worth).max(1.0);
            let variance = (others.left / freedom).max(LEAST_VARIANCE);
            let missed = (all.left - others.left).max(0.0);
            sum -= 0.5 * (worth * (count * variance.ln() + missed / variance) + all.information - others.information);
        }
        sum
    }
}

/// What some columns leave of the target, and the logarithm of the determinant of their products.
struct Fit {
    left: f64,
    information: f64,
}

impl Fit {
    fn new(of: impl Fn(usize, usize) -> f64, columns: &[usize]) -> Option<Self> {
        let mut x = [0.0; MOST];
        let x = &mut x[..columns.len()];
        let information = solve(&of, columns, x)?;
        let gained: f64 = columns.iter().zip(&*x).map(|(c, x)| x * of(*c, 0)).sum();
        Some(Self { left: of(0, 0) - gained, information })
    }
}

/// Solves the normal equations of the target (column 0) on some columns by Cholesky factorisation and gives the logarithm of
/// their determinant; none where the columns are dependent.
fn solve(of: impl Fn(usize, usize) -> f64, columns: &[usize], x: &mut [f64]) -> Option<f64> {
    let n = columns.len();
    let mut determinant = 0.0;
    let mut a = [0.0; MOST * MOST];
    for i in 0..n {
        for j in 0..=i {
            let mut value = of(columns[i], columns[j]) * if i == j { 1.0 + RIDGE } else { 1.0 };
            let diagonal = value;
            for k in 0..j {
                value -= a[i * MOST + k] * a[j * MOST + k];
            }
            a[i * MOST + j] = if i == j {
                if value <= 1e-12 * diagonal {
                    return None;
                }
                determinant += value.ln();
                value.sqrt()
            } else {
                value / a[j * MOST + j]
            };
        }
    }
    for i in 0..n {
        let mut value = of(columns[i], 0);
        for k in 0..i {
            value -= a[i * MOST + k] * x[k];
        }
        x[i] = value / a[i * MOST + i];
    }
    for i in (0..n).rev() {
        let mut value = x[i];
        for k in i + 1..n {
            value -= a[k * MOST + i] * x[k];
        }
        x[i] = value / a[i * MOST + i];
    }
    Some(determinant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_made_of_columns_is_solved_for_and_predicted() {
        let a: Vec<f64> = (0..40).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let b: Vec<f64> = (0..40).map(|k| (0.7 * f64::from(k)).cos()).collect();
        let y: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 2.0 * a - 3.0 * b).collect();
        let gram = Gram::new(&[y, a, b], &[0..20, 20..40], &Cancel::default());
        let solution = gram.solve(&[1, 2]).expect("independent columns");
        assert!((solution.coefficients[0] - 2.0).abs() < 1e-6 && solution.left.abs() < 1e-6);
        assert!(gram.predictive(&[1, 2], 1.0) > gram.predictive(&[1], 1.0));
    }

    #[test]
    fn a_block_that_alone_tells_two_columns_apart_does_not_speak_against_them() {
        // The two run alike but in the first block, as two springs do along a motion that has settled.
        let noise = |k: i32| 0.1 * (12.9898 * f64::from(k)).sin();
        let a: Vec<f64> = (0..80).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let b: Vec<f64> =
            (0..80).zip(&a).map(|(k, a)| if k < 20 { a.powi(3) } else { a + 1e-3 * noise(k + 7) }).collect();
        let y: Vec<f64> = a.iter().zip(&b).zip(0..).map(|((a, b), k)| 2.0 * a - 3.0 * b + noise(k)).collect();
        let blocks = [0..20, 20..40, 40..60, 60..80];
        let gram = Gram::new(&[y, a, b], &blocks, &Cancel::default());
        for one in [1, 2] {
            assert!(gram.predictive(&[1, 2], 1.0) > gram.predictive(&[one], 1.0));
        }
    }
}
