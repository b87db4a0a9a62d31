//! Test functions of the weak form: averages that take the derivatives off a measurement.

use super::dot;

/// Exponent p of the test functions (1 − s²)ᵖ: five derivatives vanish at the ends, so sums over samples are integrals.
const EXPONENT: i32 = 6;

/// A test function φ and its derivatives, sampled.
///
/// φ ∝ (1 − s²)⁶ over ± a half width, with a sum of 1. It vanishes at its ends, so that integration by parts moves a
/// derivative from a series to φ: ⟨φ, ẋ⟩ = ⟨−φ̇, x⟩ and ⟨φ, ẍ⟩ = ⟨φ̈, x⟩.
///
/// Source: D. Messenger, D. Bortz, "Weak sparse identification of nonlinear dynamics", Multiscale Model. Simul. 19 (2021)
/// 1474–1497.
#[derive(Clone, Debug)]
pub struct TestFunction {
    /// By derivatives moved; each of `2 half_width + 1` samples, with the sign that moving brings.
    kernels: [Vec<f64>; 3],
}

impl TestFunction {
    /// Narrowest half width, samples: narrower sums are no integrals.
    pub const NARROWEST: usize = 6;
    /// Half width in periods of the motion that leaves most of a motion and little of its noise.
    pub const HALF_WIDTH_IN_PERIODS: f64 = 0.4;

    /// The test function of a half width in samples of an interval in seconds.
    pub fn new(half_width: usize, interval: f64) -> Self {
        let p = f64::from(EXPONENT);
        let width = half_width as f64 * interval;
        let place = |i: usize| (i as f64 - half_width as f64) / half_width as f64;
        let each = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            (0..=2 * half_width).map(|i| value(place(i), 1.0 - place(i) * place(i))).collect()
        };
        let function = each(&|_, q| q.powi(EXPONENT));
        let first = each(&|s, q| 2.0 * p * s * q.powi(EXPONENT - 1) / width);
        let second = each(&|s, q| {
            (4.0 * p * (p - 1.0) * s * s * q.powi(EXPONENT - 2) - 2.0 * p * q.powi(EXPONENT - 1)) / (width * width)
        });
        let total: f64 = function.iter().sum();
        let [function, mut first, mut second] =
            [function, first, second].map(|kernel| -> Vec<f64> { kernel.iter().map(|k| k / total).collect() });
        // Exact for parabolas, however few the samples: a constant would otherwise drown a slow motion's derivative.
        let moment = |kernel: &[f64], order: i32| -> f64 {
            kernel.iter().enumerate().map(|(i, k)| k * (place(i) * width).powi(order)).sum()
        };
        let slope = moment(&first, 1);
        first.iter_mut().for_each(|k| *k /= slope);
        let level = moment(&second, 0);
        second.iter_mut().zip(&function).for_each(|(k, f)| *k -= level * f);
        let bend = moment(&second, 2) / 2.0;
        second.iter_mut().for_each(|k| *k /= bend);
        Self { kernels: [function, first, second] }
    }

    /// Samples between the centres of neighbouring rows: at a sixth of the half width rows begin to repeat each other.
    pub fn spacing(half_width: usize) -> usize {
        half_width / 6
    }

    /// The weights that average the derivative of a series, by its order (0, 1 or 2).
    pub fn kernels(&self) -> &[Vec<f64>; 3] {
        &self.kernels
    }

    /// The averages of a series' derivative of some order (0, 1 or 2), one every `stride` samples, as far as the test function
    /// lies within the series.
    pub fn averages(&self, values: &[f64], order: usize, stride: usize) -> impl Iterator<Item = f64> {
        values.windows(self.kernels[order].len()).step_by(stride).map(move |window| dot(&self.kernels[order], window))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_of_derivatives_are_those_of_a_parabola() {
        let interval = 0.01;
        let parabola: Vec<f64> =
            (0..40).map(|k| interval * f64::from(k)).map(|t| 3.0 + 2.0 * t + 5.0 * t * t).collect();
        for half_width in [2, TestFunction::NARROWEST, 15] {
            let function = TestFunction::new(half_width, interval);
            let mut rows = 0;
            for (k, slope) in function.averages(&parabola, 1, 3).enumerate() {
                let t = interval * (half_width + 3 * k) as f64;
                assert!((slope - 2.0 - 10.0 * t).abs() < 1e-9, "{half_width}: {slope}");
                rows += 1;
            }
            assert_eq!(rows, (40 - 2 * half_width).div_ceil(3), "as many as fit");
            assert!(function.averages(&parabola, 2, 1).all(|bend| (bend - 10.0).abs() < 1e-8));
        }
    }
}
