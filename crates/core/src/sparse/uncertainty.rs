//! Standard errors of coefficients whose residuals are correlated.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::Reduced;
use crate::signal::dot;

/// Pieces that a block of rows is cut into; the scores within a piece are summed before pieces are correlated.
const PIECES_A_BLOCK: usize = 8;
/// Pieces on either side of one that the fit without it leaves out.
const LEFT_OUT_PIECES: usize = 3 * PIECES_A_BLOCK / 4;
/// Sum of leverages below which a fit without the rows is taken to be the same.
const NEGLIGIBLE_LEVERAGE: f64 = 0.01;

/// How residuals that are correlated over up to a block of rows move a fit: the scores of pieces of the rows.
///
/// A score is what the rows' residuals do to the moments Θᵀy. Those of kept columns are the mean of the score itself and of
/// that in a fit that a block around the piece is left out of, for a fit draws its own residuals to nothing the more it hangs
/// on them (Cameron & Miller 2015).
///
/// Where something is known of how residuals are correlated, `C = LLᵀ`, columns and residual are those times L⁻¹, and only
/// what is not known is left to the kernel (prewhitening, Andrews & Monahan 1992); `weights` are then the columns times Lᵀ.
#[derive(Clone, Debug)]
pub(crate) struct Scores {
    /// Of each record one column a piece, the kept columns' scores first.
    records: Vec<DMatrix<f64>>,
    /// Inverse of the kept columns' Gram matrix, if they are independent.
    bread: Option<DMatrix<f64>>,
    kept: usize,
    /// Pieces over which the kernel reaches.
    reach: usize,
    /// Blocks that there are.
    blocks: f64,
}

impl Scores {
    /// The scores of a fit: of the columns `keep`, and of others whose weights come after theirs.
    ///
    /// `residual` and the boundaries between records in `starts` are those of the rows that were reduced.
    pub(crate) fn new(
        reduced: &Reduced,
        keep: &[usize],
        columns: &[Vec<f64>],
        weights: &[Vec<f64>],
        residual: &[f64],
        starts: &[usize],
        block: usize,
    ) -> Self {
        let (bread, kept, block) = (reduced.inverse_gram(keep), keep.len(), block.max(1));
        let piece = block.div_ceil(PIECES_A_BLOCK);
        let ends = starts.iter().skip(1).copied().chain([residual.len()]);
        let ranges: Vec<Range<usize>> = starts.iter().zip(ends).map(|(start, end)| *start..end).collect();
        let blocks = ranges.iter().map(|r| (r.len() as f64 / block as f64).max(1.0)).sum();
        let of_record = |range: &Range<usize>| {
            let parts: Vec<Range<usize>> =
                range.clone().step_by(piece).map(|from| from..(from + piece).min(range.end)).collect();
            let score = |i: usize, t: usize| dot(&weights[i][parts[t].clone()], &residual[parts[t].clone()]);
            let mut scores = DMatrix::from_fn(weights.len(), parts.len(), score);
            if let Some(bread) = bread.as_ref().filter(|_| kept > 0) {
                let product =
                    |i: usize, j: usize, part: &Range<usize>| dot(&weights[i][part.clone()], &columns[j][part.clone()]);
                let gram = |part| DMatrix::from_fn(kept, kept, |i, j| product(i, j, part)) * bread;
                let grams: Vec<DMatrix<f64>> = parts.iter().map(gram).collect();
                // What a fit hangs on the pieces around one, as that moves on.
                let mut around = DMatrix::<f64>::zeros(kept, kept);
                grams.iter().take(LEFT_OUT_PIECES).for_each(|g| around += g);
                for t in 0..parts.len() {
                    if let Some(comes) = grams.get(t + LEFT_OUT_PIECES) {
                        around += comes;
                    }
                    if let Some(goes) = t.checked_sub(LEFT_OUT_PIECES + 1) {
                        around -= &grams[goes];
                    }
                    if around.trace() < NEGLIGIBLE_LEVERAGE {
                        continue;
                    }
                    let mut own = scores.view_mut((0, t), (kept, 1));
                    let left = DMatrix::identity(kept, kept) - &around;
                    if let Some(without) = left.lu().solve(&own) {
                        own += without;
                        own *= 0.5;
                    }
                }
            }
            scores
        };
        let records = ranges.iter().map(of_record).collect();
        Self { records, bread, kept, reach: 2 * block / piece, blocks }
    }

    /// Covariance of the kept columns' coefficients with those of a fit of the same rows, which may be the same fit: the
    /// sandwich estimator with Parzen's kernel over two blocks (Newey & West 1987; Andrews 1991).
    ///
    /// The kernel matters: residuals of derivatives have neighbours that cancel, and blocks with hard edges, in which the
    /// outermost find none, would overstate their sum. None where the columns are dependent or there are fewer than two blocks
    /// more than columns.
    pub(crate) fn covariance(&self, other: &Self) -> Option<DMatrix<f64>> {
        let breads = self.bread.as_ref().zip(other.bread.as_ref());
        let (bread, others) = breads?;
        if [self, other].iter().any(|s| s.kept > 0 && s.blocks < s.kept as f64 + 2.0) {
            return None;
        }
        let mut meat = DMatrix::<f64>::zeros(self.kept, other.kept);
        let window = self.window();
        let side = window.len() / 2;
        let mut sums = [DVector::zeros(self.kept), DVector::zeros(other.kept)];
        for (scores, other) in self.records.iter().zip(&other.records) {
            let pieces = scores.ncols();
            for centre in 0..pieces + 2 * side {
                let near = centre.saturating_sub(2 * side)..pieces.min(centre + 1);
                for (sum, scores) in sums.iter_mut().zip([scores, other]) {
                    let kept = sum.len();
                    sum.fill(0.0);
                    for t in near.clone() {
                        sum.axpy(window[t + 2 * side - centre], &scores.column(t).rows(0, kept), 1.0);
                    }
                }
                meat.ger(1.0, &sums[0], &sums[1], 1.0);
            }
        }
        Some(bread * meat * others)
    }

    /// Weights of neighbouring pieces, their squares' sum one: Parzen's kernel is what such a triangle of half its width
    /// makes of uncorrelated scores.
    fn window(&self) -> Vec<f64> {
        let half = (self.reach + 1) as f64 / 2.0;
        let side = half.ceil() as usize - 1;
        let weight = |k: usize| 1.0 - (k as f64 - side as f64).abs() / half;
        let triangle: Vec<f64> = (0..=2 * side).map(weight).collect();
        let norm = dot(&triangle, &triangle).sqrt();
        triangle.into_iter().map(|w| w / norm).collect()
    }

    /// What another draw of the residuals might change the moments by, the kept columns' first: each piece's score times a
    /// random number that is correlated over blocks as the kernel does (dependent wild bootstrap, Shao 2010).
    pub(crate) fn draw(&self, random: &mut impl Rng) -> DVector<f64> {
        let window = self.window();
        let mut sum = DVector::zeros(self.records.first().map_or(0, DMatrix::nrows));
        for scores in &self.records {
            let white: Vec<f64> =
                (0..scores.ncols() + window.len() - 1).map(|_| StandardNormal.sample(random)).collect();
            for (score, near) in scores.column_iter().zip(white.windows(window.len())) {
                sum.axpy(dot(&window, near), &score, 1.0);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Constraint, SparseOptions, stlsq};
    use rand::SeedableRng as _;
    use rand_distr::StandardNormal;

    /// Share of repeats in which the 90 % interval holds the truth, for residuals coloured by a moving sum.
    fn coverage(smear: usize, block: usize) -> f64 {
        let n = 4000;
        let columns: Vec<Vec<f64>> =
            [0.013, 0.029].iter().map(|a| (0..n).map(|k| (a * k as f64).sin()).collect()).collect();
        let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
        let mut held = 0;
        const REPEATS: usize = 300;
        for _ in 0..REPEATS {
            let white: Vec<f64> = (0..n + smear).map(|_| StandardNormal.sample(&mut rng)).collect();
            let noise: Vec<f64> = (0..n).map(|k| white[k..k + smear].iter().sum()).collect();
            let y: Vec<f64> = (0..n).map(|k| columns[0][k] - columns[1][k] + noise[k]).collect();
            let reduced = Reduced::new(&columns, &y);
            let options = SparseOptions { threshold: 0.0, ridge: 0.0, scaled: true };
            let solution = stlsq(&reduced, &[Constraint::Free; 2], &options);
            let residual: Vec<f64> = (0..n)
                .map(|k| y[k] - solution.coefficients[0] * columns[0][k] - solution.coefficients[1] * columns[1][k])
                .collect();
            let scores = Scores::new(&reduced, &[0, 1], &columns, &columns, &residual, &[0], block);
            let covariance = scores.covariance(&scores).unwrap();
            let error = (solution.coefficients[0] - 1.0).abs();
            held += usize::from(error < 1.645 * covariance[(0, 0)].sqrt());
        }
        held as f64 / REPEATS as f64
    }

    #[test]
    fn draws_scatter_as_the_covariance_says() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let n = 2000;
        let columns: Vec<Vec<f64>> =
            [0.05, 0.08].iter().map(|a| (0..n).map(|k| (a * k as f64).cos()).collect()).collect();
        let white: Vec<f64> = (0..n + 10).map(|_| StandardNormal.sample(&mut rng)).collect();
        let y: Vec<f64> = (0..n).map(|k| columns[0][k] + white[k..k + 10].iter().sum::<f64>()).collect();
        let reduced = Reduced::new(&columns, &y);
        let fit = reduced.least_squares(&[0, 1]);
        let residual: Vec<f64> = (0..n).map(|k| y[k] - fit[0] * columns[0][k] - fit[1] * columns[1][k]).collect();
        let scores = Scores::new(&reduced, &[0, 1], &columns, &columns, &residual, &[0], 40);
        let covariance = scores.covariance(&scores).unwrap();
        const DRAWS: usize = 4000;
        let mut scatter = DMatrix::<f64>::zeros(2, 2);
        for _ in 0..DRAWS {
            let drawn = reduced.shifted(&[0, 1], &scores.draw(&mut rng)).least_squares(&[0, 1]);
            let moved = DVector::from_fn(2, |i, _| drawn[i] - fit[i]);
            scatter += &moved * moved.transpose() / DRAWS as f64;
        }
        // A variance from 4000 draws is known to 2.2 %.
        for k in 0..2 {
            assert!((scatter[(k, k)] / covariance[(k, k)] - 1.0).abs() < 0.1, "{scatter} {covariance}");
        }
    }

    #[test]
    fn intervals_hold_the_truth_for_white_and_coloured_residuals() {
        // 300 repeats: three standard deviations of a 90 % share are ±5 %.
        for smear in [1, 20] {
            let share = coverage(smear, 120);
            assert!((0.84..0.96).contains(&share), "{smear}: {share}");
        }
    }
}
