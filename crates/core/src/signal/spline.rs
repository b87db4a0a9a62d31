//! Natural cubic smoothing splines.

use std::f64::consts::TAU;

/// The natural cubic spline that minimises `Σ(y − f)² + λ∫f″²`, knots at the samples (Reinsch 1967), for records of one
/// length; linear in the number of samples.
#[derive(Clone, Debug)]
pub(super) struct Spline {
    /// λ in samples³.
    weight: f64,
    /// Factors `LDLᵀ` of the five-banded matrix that the knots' curvatures solve: the inverse of `D`, and the two bands of `L`.
    inverse: Vec<f64>,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Spline {
    /// The spline of `count` samples (at least 3) that lets half the amplitude of `length` samples a period through.
    pub(super) fn new(count: usize, length: f64) -> Self {
        let weight = (length / TAU).powi(4);
        let inner = count.saturating_sub(2);
        let (middle, off, far) = (2.0 / 3.0 + 6.0 * weight, 1.0 / 6.0 - 4.0 * weight, weight);
        let (mut inverse, mut first, mut second) = (vec![0.0; inner], vec![0.0; inner], vec![0.0; inner]);
        // The diagonal and the bands of the column before, and of the one before that.
        let ((mut d1, mut first1, mut second1), (mut d2, mut second2)) = ((0.0, 0.0, 0.0), (0.0, 0.0));
        for k in 0..inner {
            let d: f64 = middle - d1 * first1 * first1 - d2 * second2 * second2;
            inverse[k] = d.recip();
            first[k] = (off - d1 * first1 * second1) * inverse[k];
            second[k] = far * inverse[k];
            (d2, second2) = (d1, second1);
            (d1, first1, second1) = (d, first[k], second[k]);
        }
        Self { weight, inverse, first, second }
    }

    /// The spline at the samples and its second derivative there, per sample².
    fn fit(&self, samples: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = samples.len();
        let inner = self.inverse.len().min(n.saturating_sub(2));
        // Curvatures of the inner knots, in the middle of zeros for the outer ones.
        let mut bend = vec![0.0; n];
        for k in 0..inner {
            let mut value = samples[k] - 2.0 * samples[k + 1] + samples[k + 2];
            if k > 0 {
                value -= self.first[k - 1] * bend[k];
            }
            if k > 1 {
                value -= self.second[k - 2] * bend[k - 1];
            }
            bend[k + 1] = value;
        }
        for k in (0..inner).rev() {
            bend[k + 1] = bend[k + 1] * self.inverse[k]
                - if k + 1 < inner { self.first[k] * bend[k + 2] } else { 0.0 }
                - if k + 2 < inner { self.second[k] * bend[k + 3] } else { 0.0 };
        }
        let at = |k: usize| if k < n { bend[k] } else { 0.0 };
        let fitted = samples.iter().enumerate().map(|(k, y)| {
            let before = if k > 0 { bend[k - 1] } else { 0.0 };
            y - self.weight * (before - 2.0 * at(k) + at(k + 1))
        });
        (fitted.collect(), bend)
    }

    /// The spline at the samples.
    pub(super) fn smooth(&self, samples: &[f64]) -> Vec<f64> {
        self.fit(samples).0
    }

    /// The spline and its first derivative at the samples, per sample.
    pub(super) fn slope(&self, samples: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (fitted, bend) = self.fit(samples);
        let n = fitted.len();
        let mut slope: Vec<f64> =
            fitted.windows(2).zip(bend.windows(2)).map(|(f, g)| f[1] - f[0] - (2.0 * g[0] + g[1]) / 6.0).collect();
        if n > 1 {
            slope.push(fitted[n - 1] - fitted[n - 2] + (bend[n - 2] + 2.0 * bend[n - 1]) / 6.0);
        }
        (fitted, slope)
    }

    /// Generalised cross-validation (Craven & Wahba 1979): the mean square residual over the squared share of the
    /// freedoms that it has, whose trace comes from the inverse's middle bands (Hutchinson & de Hoog 1985).
    pub(super) fn cross_validation(&self, samples: &[f64]) -> f64 {
        let fitted = self.smooth(samples);
        let squares: f64 = samples.iter().zip(&fitted).map(|(y, f)| (y - f) * (y - f)).sum();
        let (mut diagonal, mut off) = (0.0, 0.0);
        // The inverse's entries (i, i), (i, i+1) and (i+1, i+1) of the rows below.
        let (mut below, mut below_off, mut lowest) = (0.0, 0.0, 0.0);
        for k in (0..self.inverse.len()).rev() {
            let next = -self.first[k] * below - self.second[k] * below_off;
            let after = -self.first[k] * below_off - self.second[k] * lowest;
            let here = self.inverse[k] - self.first[k] * next - self.second[k] * after;
            diagonal += here;
            off += next;
            (lowest, below_off, below) = (below, next, here);
        }
        let n = samples.len() as f64;
        let freedoms = 2.0 + 2.0 / 3.0 * diagonal + 2.0 / 6.0 * off;
        let left = 1.0 - freedoms / n;
        squares / n / (left * left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize) -> Vec<f64> {
        (0..n).map(|k| (0.2 * k as f64).sin() + 0.2 * (1.7 * k as f64).cos()).collect()
    }

    /// The minimum by its definition: dense normal equations of the values at the knots.
    fn dense(y: &[f64], weight: f64) -> (nalgebra::DMatrix<f64>, Vec<f64>) {
        let n = y.len();
        let q = nalgebra::DMatrix::from_fn(n, n - 2, |i, j| match i.wrapping_sub(j) {
            0 | 2 => 1.0,
            1 => -2.0,
            _ => 0.0,
        });
        let r = nalgebra::DMatrix::from_fn(n - 2, n - 2, |i, j| match i.abs_diff(j) {
            0 => 2.0 / 3.0,
            1 => 1.0 / 6.0,
            _ => 0.0,
        });
        let penalty = &q * r.try_inverse().unwrap() * q.transpose();
        let hat = (nalgebra::DMatrix::identity(n, n) + penalty * weight).try_inverse().unwrap();
        let fitted = &hat * nalgebra::DVector::from_column_slice(y);
        (hat, fitted.iter().copied().collect())
    }

    #[test]
    fn it_is_the_minimum_and_its_cross_validation_the_definitions() {
        let y = wave(40);
        for length in [4.0, 12.0, 60.0] {
            let spline = Spline::new(y.len(), length);
            let (hat, fitted) = dense(&y, (length / TAU).powi(4));
            for (a, b) in spline.smooth(&y).iter().zip(&fitted) {
                assert!((a - b).abs() < 1e-9, "{length}: {a} {b}");
            }
            let squares: f64 = y.iter().zip(&fitted).map(|(a, b)| (a - b) * (a - b)).sum();
            let definition = squares / 40.0 / (1.0 - hat.trace() / 40.0).powi(2);
            assert!((spline.cross_validation(&y) / definition - 1.0).abs() < 1e-8, "{length}");
        }
    }

    #[test]
    fn half_of_its_length_passes_and_long_ones_keep_their_digits() {
        let n = 20_000;
        let y: Vec<f64> = (0..n).map(|k| (TAU * f64::from(k) / 2000.0).sin()).collect();
        let half = Spline::new(n as usize, 2000.0).smooth(&y);
        assert!((half[10_500] - 0.5 * y[10_500]).abs() < 1e-5, "{}", half[10_500]);
        let (_, slope) = Spline::new(n as usize, 100.0).slope(&y);
        let wanted = TAU / 2000.0 * (TAU * 10_300.0 / 2000.0).cos();
        let gain = 1.0 / (1.0 + (100.0_f64 / 2000.0).powi(4));
        assert!((slope[10_300] / (gain * wanted) - 1.0).abs() < 1e-6);
    }
}
