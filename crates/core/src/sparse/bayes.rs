//! Spike-and-slab regression.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};

use super::stlsq::{fitted, fixed};
use super::{Constraint, Reduced, Solution, SparseOptions};

/// Free columns, at most, of which every subset is weighed (2¹² = 4096); more are sampled.
const MAX_ENUMERATED: usize = 12;
/// Sweeps of the sampler through the columns before it counts.
const BURN_IN: usize = 60;
/// Sweeps of the sampler that are counted.
const SWEEPS: usize = 300;
/// Flips after which the posterior is computed anew, for each adds rounding.
const FLIPS_PER_REFRESH: usize = 256;
/// A column stays if its inclusion probability is larger: the median probability model (Barbieri & Berger 2004).
const MEDIAN_PROBABILITY: f64 = 0.5;
/// Least width of the prior's spike, as a threshold; smaller thresholds count as this one.
const MIN_SPIKE_WIDTH: f64 = 1e-5;
/// Least standard deviation of the residual, as a share of the target's RMS: without noise the posterior would be
/// degenerate.
const MIN_NOISE: f64 = 1e-6;

/// Columns that belong to the equation more likely than not, by stochastic search variable selection (George &
/// `McCulloch` 1993): a column that belongs has a coefficient from a wide normal distribution (the slab), one that does not
/// has one from a narrow one (the spike), and either is as likely beforehand.
///
/// The threshold is what matters in practice: a coefficient of its size is as likely under the spike as under the slab.
/// So with many data the columns beyond it stay, as in thresholded least squares, and with few the probabilities say how
/// far that is known. Rows are taken as independent, with the variance that the whole library leaves. Every subset of up
/// to twelve free columns is weighed, of more they are sampled (always alike).
pub(super) fn bayes(reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Solution {
    let keep = fitted(reduced, constraints);
    let mut probability = vec![0.0; reduced.columns()];
    for (k, constraint) in constraints.iter().enumerate() {
        probability[k] = f64::from(u8::from(matches!(constraint, Constraint::In | Constraint::Fixed(_))));
    }
    let mut posterior = Posterior::new(reduced, constraints, options, &keep);
    let found = if posterior.free.len() <= MAX_ENUMERATED { posterior.enumerate() } else { posterior.sample() };
    for (j, found) in posterior.free.iter().zip(found) {
        probability[keep[*j]] = found;
    }
    let stays = |k: &usize| constraints[*k] == Constraint::In || probability[*k] > MEDIAN_PROBABILITY;
    let support = keep.into_iter().filter(stays).collect();
    Solution { probability, ..Solution::on(reduced, constraints, support) }
}

/// The coefficients' distribution, given which of the columns belong.
struct Posterior {
    /// Gram matrix and products with the target over the noise's variance.
    gram: DMatrix<f64>,
    along: DVector<f64>,
    /// Variances of spike and slab, one a column.
    spike: Vec<f64>,
    slab: Vec<f64>,
    /// Places of the columns that are to be decided on.
    free: Vec<usize>,
    belongs: Vec<bool>,
    covariance: DMatrix<f64>,
    mean: DVector<f64>,
    flips: usize,
}

impl Posterior {
    fn new(reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions, keep: &[usize]) -> Self {
        let p = keep.len();
        let fixed = fixed(constraints);
        let target = reduced.target(&fixed);
        let (whole, residual) = reduced.solve(keep, &fixed, |_| 0.0);
        let rows = reduced.rows() as f64;
        let noise = (residual * residual * rows / (rows - p as f64).max(1.0)).max(MIN_NOISE * MIN_NOISE);
        let columns: Vec<DVector<f64>> = keep.iter().map(|k| reduced.column(*k)).collect();
        let penalty = |k: usize| options.ridge_weight(reduced, k);
        let gram = DMatrix::from_fn(p, p, |i, j| {
            (columns[i].dot(&columns[j]) + if i == j { penalty(keep[i]) } else { 0.0 }) / noise
        });
        let along = DVector::from_iterator(p, columns.iter().map(|c| c.dot(&target) / noise));
        let edge = |k: usize| {
            let unit = if options.scaled { 1.0 } else { reduced.scale()[k] / reduced.target_scale() };
            (options.threshold * unit).max(MIN_SPIKE_WIDTH)
        };
        // A term's share of the target is of order one, unless the threshold is.
        let slab: Vec<f64> = keep.iter().map(|k| 1.0 + (10.0 * edge(*k)).powi(2)).collect();
        let spike = keep.iter().zip(&slab).map(|(k, slab)| spike(edge(*k), *slab)).collect();
        let free: Vec<usize> = (0..p).filter(|j| constraints[keep[*j]] == Constraint::Free).collect();
        let belongs =
            keep.iter().zip(&whole).map(|(k, b)| constraints[*k] == Constraint::In || b.abs() >= edge(*k)).collect();
        let mut posterior = Self {
            gram,
            along,
            spike,
            slab,
            free,
            belongs,
            covariance: DMatrix::zeros(p, p),
            mean: DVector::zeros(p),
            flips: 0,
        };
        posterior.refresh();
        posterior
    }

    fn variance(&self, j: usize, belongs: bool) -> f64 {
        if belongs { self.slab[j] } else { self.spike[j] }
    }

    /// Mean and covariance from scratch.
    fn refresh(&mut self) {
        // In units of the prior's deviations the matrix is the identity and more, so its inverse keeps its digits.
        let deviation: Vec<f64> = (0..self.belongs.len()).map(|j| self.variance(j, self.belongs[j]).sqrt()).collect();
        let p = deviation.len();
        let precision = DMatrix::from_fn(p, p, |i, j| {
            deviation[i] * self.gram[(i, j)] * deviation[j] + f64::from(u8::from(i == j))
        });
        if let Some(cholesky) = precision.cholesky() {
            let inverse = cholesky.inverse();
            self.covariance = DMatrix::from_fn(p, p, |i, j| deviation[i] * inverse[(i, j)] * deviation[j]);
            self.mean = &self.covariance * &self.along;
        }
    }

    /// By how much the logarithm of the evidence rises if a column is decided on the other way, and the factor of its
    /// column of the covariance in the update that follows.
    fn change(&self, j: usize) -> (f64, f64) {
        let (now, then) = (self.variance(j, self.belongs[j]), self.variance(j, !self.belongs[j]));
        let more = then.recip() - now.recip();
        // The prior's variance bounds the posterior's: so written nothing cancels, and rounding cannot make it negative.
        let spread = self.covariance[(j, j)].clamp(f64::MIN_POSITIVE, now);
        let grown = (1.0 - spread / now) + spread / then;
        let factor = more / grown;
        let rise = -0.5 * (grown.ln() + factor * self.mean[j].powi(2) + (then / now).ln());
        (rise, factor)
    }

    fn flip(&mut self, j: usize, factor: f64) {
        self.belongs[j] = !self.belongs[j];
        self.flips += 1;
        if self.flips.is_multiple_of(FLIPS_PER_REFRESH) {
            self.refresh();
            return;
        }
        let column = self.covariance.column(j).into_owned();
        let mean = self.mean[j];
        self.mean.axpy(-factor * mean, &column, 1.0);
        self.covariance.ger(-factor, &column, &column, 1.0);
    }

    /// The probability of each free column, every subset weighed: in Gray's order, one flip from each to the next.
    fn enumerate(&mut self) -> Vec<f64> {
        let count = self.free.len();
        let free = self.free.clone();
        let mut evidence = 0.0;
        // Weights relative to the largest so far.
        let (mut largest, mut total) = (0.0_f64, 1.0);
        let mut with: Vec<f64> = free.iter().map(|j| f64::from(u8::from(self.belongs[*j]))).collect();
        for step in 1..1_usize << count {
            let j = free[step.trailing_zeros() as usize];
            let (rise, factor) = self.change(j);
            self.flip(j, factor);
            evidence += rise;
            if evidence > largest {
                let shrink = (largest - evidence).exp();
                total *= shrink;
                with.iter_mut().for_each(|w| *w *= shrink);
                largest = evidence;
            }
            let weight = (evidence - largest).exp();
            total += weight;
            for (with, j) in with.iter_mut().zip(&free) {
                if self.belongs[*j] {
                    *with += weight;
                }
            }
        }
        with.into_iter().map(|w| w / total).collect()
    }

    /// Each free column's inclusion probability by Gibbs sampling, coefficients integrated out; probabilities are averaged, not
    /// draws.
    fn sample(&mut self) -> Vec<f64> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(1);
        let free = self.free.clone();
        let mut with = vec![0.0; free.len()];
        for sweep in 0..BURN_IN + SWEEPS {
            for (with, j) in with.iter_mut().zip(&free) {
                let (rise, factor) = self.change(*j);
                let other = (1.0 + (-rise).exp()).recip();
                if sweep >= BURN_IN {
                    *with += if self.belongs[*j] { 1.0 - other } else { other };
                }
                if random.random::<f64>() < other {
                    self.flip(*j, factor);
                }
            }
        }
        with.into_iter().map(|w| w / SWEEPS as f64).collect()
    }
}

/// The variance of the spike whose density at `edge` is the slab's, narrower than that.
fn spike(edge: f64, slab: f64) -> f64 {
    // With s = slab/spike: ln s = edge²/slab (s − 1). Its larger root is wanted; fixed-point iteration rises to it.
    let share = edge * edge / slab;
    let mut ratio = share.recip();
    for _ in 0..60 {
        ratio = 1.0 + ratio.ln() / share;
    }
    slab / ratio
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution as _, StandardNormal};

    fn problem(rows: usize, columns: usize, truth: &[f64]) -> Reduced {
        let mut random = rand_pcg::Pcg64::seed_from_u64(11);
        let mut column = || (0..rows).map(|_| StandardNormal.sample(&mut random)).collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = (0..columns).map(|_| column()).collect();
        let noise = column();
        let y: Vec<f64> =
            (0..rows).map(|r| truth.iter().zip(&columns).map(|(b, c)| b * c[r]).sum::<f64>() + noise[r]).collect();
        Reduced::new(&columns, &y)
    }

    fn options(threshold: f64) -> SparseOptions {
        SparseOptions { threshold, ridge: 0.0, scaled: true }
    }

    #[test]
    fn spike_and_slab_cross_at_the_threshold() {
        for (edge, slab) in [(1e-5, 1.0), (0.02, 1.04), (0.5, 26.0), (3.0, 901.0)] {
            let spike = spike(edge, slab);
            let density = |variance: f64| -0.5 * (edge * edge / variance + variance.ln());
            assert!((density(spike) - density(slab)).abs() < 1e-9 && spike < edge * edge, "{edge}");
        }
    }

    /// The evidence of every subset by the definition: a normal density of the data with covariance `σ²I + XDXᵀ`.
    #[test]
    fn probabilities_are_those_of_the_definition() {
        let (rows, p) = (30, 4);
        let mut random = rand_pcg::Pcg64::seed_from_u64(2);
        let mut column = || (0..rows).map(|_| StandardNormal.sample(&mut random)).collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = (0..p).map(|_| column()).collect();
        let noise = column();
        let y: Vec<f64> = (0..rows).map(|r| 0.6 * columns[0][r] + 0.25 * columns[1][r] + noise[r]).collect();
        let reduced = Reduced::new(&columns, &y);
        let free = [Constraint::Free; 4];
        let (_, residual) = reduced.solve(&[0, 1, 2, 3], &[], |_| 0.0);
        let noise = residual * residual * rows as f64 / (rows - p) as f64;
        let scaled = DMatrix::from_fn(rows, p, |r, k| columns[k][r] / reduced.scale()[k]);
        let target = DVector::from_fn(rows, |r, _| y[r] / reduced.target_scale());
        let slab = 1.0 + (10.0_f64 * 0.2).powi(2);
        let spike = spike(0.2, slab);
        let mut with = [0.0; 4];
        let mut total = 0.0;
        for bits in 0..16 {
            let prior =
                DMatrix::from_diagonal(&DVector::from_fn(p, |k, _| if bits >> k & 1 == 1 { slab } else { spike }));
            let covariance = DMatrix::identity(rows, rows) * noise + &scaled * prior * scaled.transpose();
            let cholesky = covariance.cholesky().unwrap();
            let density =
                (-0.5 * target.dot(&cholesky.solve(&target)) - cholesky.l().diagonal().map(f64::ln).sum()).exp();
            total += density;
            (0..p).filter(|k| bits >> k & 1 == 1).for_each(|k| with[k] += density);
        }
        let found = bayes(&reduced, &free, &options(0.2)).probability;
        for (found, with) in found.iter().zip(with) {
            assert!((found - with / total).abs() < 1e-9, "{found} {}", with / total);
        }
    }

    #[test]
    fn sampling_agrees_with_enumeration() {
        let reduced = problem(60, 11, &[1.0, 0.3, 0.15, 0.0, 0.1]);
        let keep: Vec<usize> = (0..11).collect();
        let new = || Posterior::new(&reduced, &[Constraint::Free; 11], &options(0.1), &keep);
        for (exact, sampled) in new().enumerate().iter().zip(new().sample()) {
            // 300 sweeps, somewhat alike: three standard errors of a probability are below 0.1.
            assert!((exact - sampled).abs() < 0.1, "{exact} {sampled}");
        }
    }

    #[test]
    fn many_data_are_sure_and_few_are_not() {
        let truth = [1.0, 0.3, 0.08];
        let sure = bayes(&problem(20_000, 5, &truth), &[Constraint::Free; 5], &options(0.15));
        assert_eq!(sure.support, [0, 1]);
        assert!(sure.probability.iter().all(|p| *p < 0.05 || *p > 0.95), "{:?}", sure.probability);
        let unsure = bayes(&problem(25, 5, &truth), &[Constraint::Free; 5], &options(0.15));
        assert!(unsure.probability.iter().any(|p| *p > 0.05 && *p < 0.95), "{:?}", unsure.probability);
    }

    #[test]
    fn exact_and_dependent_columns_give_finite_probabilities() {
        let n = 200;
        let a: Vec<f64> = (0..n).map(|k| (0.1 * f64::from(k)).sin()).collect();
        let y: Vec<f64> = a.iter().map(|a| 2.0 * a).collect();
        let columns = vec![a.clone(), a, vec![0.0; 200], (0..n).map(|k| (0.3 * f64::from(k)).cos()).collect()];
        for threshold in [0.0, 0.1, 10.0, 1e9] {
            let solution = bayes(&Reduced::new(&columns, &y), &[Constraint::Free; 4], &options(threshold));
            assert!(solution.probability.iter().all(|p| (0.0..=1.0).contains(p)), "{threshold} {solution:?}");
        }
    }
}
