use nalgebra::DMatrix;

use super::Reduced;

/// Covariance of the kept columns' coefficients that allows for residuals correlated over up to `block` rows.
///
/// The sandwich estimator with blocks of neighbouring rows as clusters (Liang & Zeger 1986) and its small-sample
/// factor. `columns`, `residual` and the boundaries between records in `starts` are those that were reduced. None where
/// the columns are dependent or there are fewer than two blocks more than columns.
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
    let mut score = vec![0.0; p];
    let mut clusters: usize = 0;
    let ends = starts.iter().skip(1).copied().chain([residual.len()]);
    for (start, end) in starts.iter().copied().zip(ends) {
        for from in (start..end).step_by(block.max(1)) {
            let to = (from + block.max(1)).min(end);
            for (s, k) in score.iter_mut().zip(keep) {
                *s = columns[*k].as_ref()[from..to].iter().zip(&residual[from..to]).map(|(c, r)| c * r).sum();
            }
            for i in 0..p {
                for j in 0..p {
                    meat[(i, j)] += score[i] * score[j];
                }
            }
            clusters += 1;
        }
    }
    if clusters < p + 2 {
        return None;
    }
    let factor = clusters as f64 / (clusters as f64 - p as f64);
    Some(&bread * meat * &bread * factor)
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
