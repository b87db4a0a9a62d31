use nalgebra::{DMatrix, DVector};

use super::Reduced;
use crate::signal::dot;

/// Pieces that a block of rows is cut into, whose influences are summed before they are correlated.
const PIECES: usize = 8;

const WIDE: usize = 3 * PIECES / 4;
/// Covariance of the kept columns' coefficients that allows for residuals correlated over up to `block` rows.
///
/// The sandwich estimator with Parzen's kernel over two blocks (Newey & West 1987; Andrews 1991) on jackknife influences:
/// what rows do to a fit that a block around them is left out of, for their own residuals are drawn to nothing the more
/// the fit hangs on them (Cameron & Miller 2015). The kernel matters: residuals of derivatives have neighbours that cancel,
/// and blocks with hard edges, in which the outermost find none, would overstate their sum. `columns`, `residual` and the
/// boundaries between records in `starts` are those that were reduced. None where the columns are dependent or there are
/// fewer than two blocks more than columns.
pub fn clustered_covariance(
    reduced: &Reduced,
    keep: &[usize],
    columns: &[impl AsRef<[f64]>],
    residual: &[f64],
    starts: &[usize],
    block: usize,
) -> Option<DMatrix<f64>> {
    let bread = reduced.inverse_gram(keep)?;
    let p = keep.len();
    if p == 0 {
        return Some(DMatrix::zeros(0, 0));
    }
    let piece = block.div_ceil(PIECES).max(1);
    let reach = 2 * block.max(1) / piece;
    let ends = || starts.iter().skip(1).copied().chain([residual.len()]);
    let blocks: f64 =
        starts.iter().zip(ends()).map(|(start, end)| ((end - start) as f64 / block.max(1) as f64).max(1.0)).sum();
    if blocks < p as f64 + 2.0 {
        return None;
    }
    let mut meat = DMatrix::<f64>::zeros(p, p);
    for (start, end) in starts.iter().copied().zip(ends()) {
        let part = |from: usize| from..(from + piece).min(end);
        let products = |i: usize, j: usize, rows: std::ops::Range<usize>| {
            dot(&columns[keep[i]].as_ref()[rows.clone()], &columns[keep[j]].as_ref()[rows])
        };
        let grams: Vec<DMatrix<f64>> = (start..end)
            .step_by(piece)
            .map(|from| &bread * DMatrix::from_fn(p, p, |i, j| products(i, j, part(from))))
            .collect();
        let influences: Vec<DVector<f64>> = (start..end)
            .step_by(piece)
            .enumerate()
            .map(|(t, from)| {
                let score =
                    DVector::from_fn(p, |i, _| dot(&columns[keep[i]].as_ref()[part(from)], &residual[part(from)]));
                let around = t.saturating_sub(WIDE)..(t + WIDE + 1).min(grams.len());
                let mut left = DMatrix::identity(p, p);
                grams[around].iter().for_each(|g| left -= g);
                let influence = &bread * score;
                match left.lu().solve(&influence) {
                    Some(without) => (influence + without) * 0.5,
                    None => influence,
                }
            })
            .collect();
        for lag in 0..=reach.min(influences.len().saturating_sub(1)) {
            let weight = parzen(lag as f64 / (reach + 1) as f64);
            for (later, before) in influences.iter().skip(lag).zip(&influences) {
                meat.ger(weight, later, before, 1.0);
                if lag > 0 {
                    meat.ger(weight, before, later, 1.0);
                }
            }
        }
    }
    Some(meat)
}

/// Parzen's kernel: weights of correlations, falling to zero at one, that never make a variance negative.
fn parzen(z: f64) -> f64 {
    if z <= 0.5 { 1.0 - 6.0 * z * z * (1.0 - z) } else { 2.0 * (1.0 - z).powi(3) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Constraint, Options, stlsq};
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

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
            let options = Options { threshold: 0.0, ridge: 0.0, scaled: true };
            let solution = stlsq(&reduced, &[Constraint::Free; 2], &options);
            let residual: Vec<f64> = (0..n)
                .map(|k| y[k] - solution.coefficients[0] * columns[0][k] - solution.coefficients[1] * columns[1][k])
                .collect();
            let covariance = clustered_covariance(&reduced, &[0, 1], &columns, &residual, &[0], block).unwrap();
            let error = (solution.coefficients[0] - 1.0).abs();
            held += usize::from(error < 1.645 * covariance[(0, 0)].sqrt());
        }
        held as f64 / REPEATS as f64
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
