use nalgebra::DMatrix;

use super::Reduced;
use crate::signal::dot;

/// Pieces that a block of rows is cut into, whose scores are summed before they are correlated.
const PIECES: usize = 8;

/// Covariance of the kept columns' coefficients that allows for residuals correlated over up to `block` rows.
///
/// The sandwich estimator with Parzen's kernel over two blocks (Newey & West 1987; Andrews 1991) and a small-sample
/// factor. The kernel matters: residuals of derivatives have neighbours that cancel, and blocks with hard edges, in which
/// the outermost find none, would overstate their sum. `columns`, `residual` and the boundaries between records in
/// `starts` are those that were reduced. None where the columns are dependent or there are fewer than two blocks more than
/// columns.
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
    let mut meat = DMatrix::<f64>::zeros(p, p);
    let piece = block.div_ceil(PIECES).max(1);
    let reach = 2 * block.max(1) / piece;
    let mut blocks = 0.0;
    let mut scores: Vec<f64> = Vec::new();
    let ends = starts.iter().skip(1).copied().chain([residual.len()]);
    for (start, end) in starts.iter().copied().zip(ends) {
        scores.clear();
        for from in (start..end).step_by(piece) {
            let to = (from + piece).min(end);
            scores.extend(keep.iter().map(|k| dot(&columns[*k].as_ref()[from..to], &residual[from..to])));
        }
        let pieces = (end - start).div_ceil(piece);
        for lag in 0..=reach.min(pieces.saturating_sub(1)) {
            let weight = parzen(lag as f64 / (reach + 1) as f64);
            for later in lag..pieces {
                let (here, before) = (&scores[later * p..][..p], &scores[(later - lag) * p..][..p]);
                for i in 0..p {
                    for j in 0..p {
                        let product = here[i] * before[j];
                        meat[(i, j)] += weight * product;
                        if lag > 0 {
                            meat[(j, i)] += weight * product;
                        }
                    }
                }
            }
        }
        blocks += ((end - start) as f64 / block.max(1) as f64).max(1.0);
    }
    let p = p as f64;
    if blocks < p + 2.0 {
        return None;
    }
    Some(&bread * meat * &bread * (blocks / (blocks - p)))
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
