//! Savitzky–Golay smoothing and differentiation (Savitzky & Golay 1964; Gram polynomials after Gorry 1990).

use fearless_simd::{Level, dispatch};
use nalgebra::DMatrix;

use super::sums::dot;

/// A local polynomial of one order fitted to segments of one odd length; any derivative, right up to the ends.
///
/// Built on orthonormal (Gram) polynomials by their three-term recurrence, so long segments and high orders stay accurate.
#[derive(Clone, Debug)]
pub(crate) struct SavitzkyGolay {
    half: usize,
    /// `basis[(j, i)]`: orthonormal polynomial of degree `j` at position `i − half`.
    basis: DMatrix<f64>,
    /// Recurrence `p_{j+1}(s) = (s·p_j(s) − beta_j·p_{j−1}(s)) / beta_{j+1}`.
    beta: Vec<f64>,
}

/// Outputs that are summed up at once: they stay in registers while the weights pass.
const LANES: usize = 16;

/// Neighbouring outputs of an even or odd kernel, whose right half is given; the first sample is the first output's leftmost.
#[inline(always)] // into each width of registers
fn weighed<const OUTPUTS: usize, const ODD: bool>(samples: &[f64], right: &[f64]) -> [f64; OUTPUTS] {
    let half = right.len() - 1;
    let near = |from: usize| samples[from..].first_chunk::<OUTPUTS>();
    let mut sums = [0.0; OUTPUTS];
    for (k, weight) in right.iter().enumerate() {
        let (Some(before), Some(after)) = (near(half - k), near(half + k)) else { break };
        for (sum, (b, a)) in sums.iter_mut().zip(before.iter().zip(after)) {
            let both = if k == 0 {
                *a
            } else if ODD {
                a - b
            } else {
                a + b
            };
            *sum += weight * both;
        }
    }
    sums
}

/// All outputs of an even or odd kernel; mirrored samples share one multiplication.
#[inline(always)] // into each width of registers
fn all_weighed<const ODD: bool>(samples: &[f64], right: &[f64], out: &mut [f64]) {
    let mut blocks = out.chunks_exact_mut(LANES);
    let mut first = 0;
    for block in blocks.by_ref() {
        block.copy_from_slice(&weighed::<LANES, ODD>(&samples[first..], right));
        first += LANES;
    }
    for (k, o) in blocks.into_remainder().iter_mut().enumerate() {
        [*o] = weighed::<1, ODD>(&samples[first + k..], right);
    }
}

impl SavitzkyGolay {
    /// The filter of a segment length `window` (made odd upwards) and polynomial `order` (at most `window` − 1).
    pub(crate) fn new(window: usize, order: usize) -> Self {
        let half = window / 2;
        let window = 2 * half + 1;
        let order = order.min(window - 1);
        let mut basis = DMatrix::zeros(order + 1, window);
        let mut beta = vec![(window as f64).sqrt()];
        basis.row_mut(0).fill(1.0 / beta[0]);
        for j in 0..order {
            let mut next: Vec<f64> = (0..window)
                .map(|i| {
                    let s = i as f64 - half as f64;
                    let before = if j == 0 { 0.0 } else { beta[j] * basis[(j - 1, i)] };
                    s * basis[(j, i)] - before
                })
                .collect();
            let norm = next.iter().map(|p| p * p).sum::<f64>().sqrt();
            next.iter_mut().for_each(|p| *p /= norm);
            beta.push(norm);
            basis.row_mut(j + 1).copy_from_slice(&next);
        }
        Self { half, basis, beta }
    }

    /// Segment length, samples.
    pub(crate) fn window(&self) -> usize {
        2 * self.half + 1
    }

    /// Polynomial order.
    pub(crate) fn order(&self) -> usize {
        self.basis.nrows() - 1
    }

    /// Derivative `derivative` of each polynomial at position `s`, samples from the segment's centre; into `values`, which holds those
    /// of lower derivatives before it: `order + 1` values each.
    fn at<'a>(&self, s: f64, derivative: usize, values: &'a mut Vec<f64>) -> &'a [f64] {
        let width = self.order() + 1;
        values.clear();
        values.resize((derivative + 1) * width, 0.0);
        values[0] = 1.0 / self.beta[0];
        for d in 0..=derivative {
            let (below, own) = values.split_at_mut(d * width);
            for j in 0..width - 1 {
                let lower = if d == 0 { 0.0 } else { d as f64 * below[(d - 1) * width + j] };
                let before = if j == 0 { 0.0 } else { self.beta[j] * own[j - 1] };
                own[j + 1] = (s * own[j] + lower - before) / self.beta[j + 1];
            }
        }
        &values[derivative * width..]
    }

    /// Weights of the segment's samples for derivative `derivative` at position `s` from its centre, per sample^derivative.
    pub(crate) fn weights(&self, s: f64, derivative: usize) -> Vec<f64> {
        let mut values = Vec::new();
        let p = self.at(s, derivative, &mut values);
        (0..self.window()).map(|i| p.iter().enumerate().map(|(j, p)| p * self.basis[(j, i)]).sum()).collect()
    }

    /// Weights of the smoothing whose derivative the filter's first derivative is: `D x = K ẋ` with this `K`.
    ///
    /// A sum over differences of neighbours is a sum over averages of `ẋ` between them; each average is taken by the
    /// formula of order six through the six samples around. So an equation `ẋ = f` holds between `D x` and `K f`
    /// whatever the filter does to either, jumps of `f` included; the plain smoothing agrees with `K` only for slow
    /// motions. Four samples longer than the segment.
    pub(crate) fn companion(&self) -> Vec<f64> {
        const AVERAGE: [f64; 6] = [11.0, -93.0, 802.0, 802.0, -93.0, 11.0];
        let slope = self.weights(0.0, 1);
        let mut kernel = vec![0.0; self.window() + 4];
        let mut step = 0.0;
        for (k, weight) in slope[..slope.len() - 1].iter().enumerate() {
            step -= weight;
            for (slot, share) in kernel[k..].iter_mut().zip(AVERAGE) {
                *slot += step * share / 1440.0;
            }
        }
        kernel
    }

    /// Derivative `derivative` (0: smoothing) of `samples`, `interval` apart.
    ///
    /// Within half a segment of an end the polynomial of the end segment is evaluated. A record shorter than the
    /// segment is fitted by one polynomial with the largest odd segment that fits.
    pub(crate) fn apply(&self, samples: &[f64], interval: f64, derivative: usize) -> Vec<f64> {
        let mut out = vec![0.0; samples.len()];
        self.apply_strided(samples, interval, derivative, 1, &mut out);
        out
    }

    /// [`Self::apply`] at every `stride`-th sample from the first, into `out` (`⌈samples / stride⌉` values).
    pub(crate) fn apply_strided(
        &self,
        samples: &[f64],
        interval: f64,
        derivative: usize,
        stride: usize,
        out: &mut [f64],
    ) {
        let n = samples.len();
        debug_assert_eq!(out.len(), n.div_ceil(stride), "one value for each stride");
        if n == 0 {
            return;
        }
        if n < self.window() {
            let odd = if n % 2 == 1 { n } else { n - 1 };
            return Self::new(odd, self.order()).apply_strided(samples, interval, derivative, stride, out);
        }
        let scale = interval.powi(i32::try_from(derivative).unwrap_or(i32::MAX)).recip();
        let kernel: Vec<f64> = self.weights(0.0, derivative).iter().map(|w| w * scale).collect();
        self.inside(samples, &kernel, derivative % 2 == 1, stride, out);
        self.ends(samples, scale, derivative, stride, out);
    }

    /// The part at least half a segment from both ends.
    fn inside(&self, samples: &[f64], kernel: &[f64], odd: bool, stride: usize, out: &mut [f64]) {
        let (n, h) = (samples.len(), self.half);
        if stride == 1 {
            let (right, out) = (&kernel[h..], &mut out[h..n - h]);
            // The widest registers that the processor has: each output is the same sum in the same order in all of them.
            dispatch!(Level::new(), _simd => if odd {
                all_weighed::<true>(samples, right, out);
            } else {
                all_weighed::<false>(samples, right, out);
            });
        } else {
            for (o, centre) in out.iter_mut().zip((0..n).step_by(stride)) {
                if centre >= h && centre + h < n {
                    *o = dot(kernel, &samples[centre - h..=centre + h]);
                }
            }
        }
    }

    fn ends(&self, samples: &[f64], scale: f64, derivative: usize, stride: usize, out: &mut [f64]) {
        let (n, h) = (samples.len(), self.half);
        let fit = |segment: &[f64]| -> Vec<f64> {
            self.basis.row_iter().map(|p| p.iter().zip(segment).map(|(p, y)| p * y).sum()).collect()
        };
        let mut values = Vec::new();
        let mut evaluate = |coefficients: &[f64], s: f64| -> f64 {
            scale * self.at(s, derivative, &mut values).iter().zip(coefficients).map(|(p, c)| p * c).sum::<f64>()
        };
        let first = fit(&samples[..self.window()]);
        let last = fit(&samples[n - self.window()..]);
        for (o, i) in out.iter_mut().zip((0..n).step_by(stride)) {
            if i < h {
                *o = evaluate(&first, i as f64 - h as f64);
            } else if i + h >= n {
                *o = evaluate(&last, i as f64 - (n - 1 - h) as f64);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: usize, interval: f64) -> Vec<f64> {
        (0..n).map(|k| (1.3 * interval * k as f64).sin()).collect()
    }

    fn largest(values: impl Iterator<Item = f64>) -> f64 {
        values.map(f64::abs).fold(0.0, f64::max)
    }

    #[test]
    fn polynomials_of_its_order_pass_unchanged_up_to_the_ends() {
        let interval = 0.1;
        let y: Vec<f64> = (0..200).map(|k| (interval * k as f64 - 7.0).powi(3)).collect();
        for (window, order) in [(5, 3), (31, 3), (101, 5), (199, 9)] {
            let filter = SavitzkyGolay::new(window, order);
            for derivative in 0..3 {
                let want = |t: f64| match derivative {
                    0 => t.powi(3),
                    1 => 3.0 * t * t,
                    _ => 6.0 * t,
                };
                let out = filter.apply(&y, interval, derivative);
                let error = largest(out.iter().enumerate().map(|(k, o)| o - want(interval * k as f64 - 7.0)));
                // 2000 is the largest value: what is left is rounding, amplified by 1/interval² and the end segment.
                assert!(error < 1e-7, "{window} {order} {derivative}: {error}");
            }
        }
    }

    #[test]
    fn wide_windows_of_high_order_stay_accurate() {
        // An unscaled Vandermonde matrix fails here by twelve orders of magnitude.
        let interval = 0.005;
        let y = wave(5000, interval);
        let filter = SavitzkyGolay::new(201, 9);
        let first = filter.apply(&y, interval, 1);
        let inside = largest((100..4900).map(|k| first[k] - 1.3 * (1.3 * interval * k as f64).cos()));
        assert!(inside < 1e-10, "{inside}");
        let second = filter.apply(&y, interval, 2);
        let inside = largest((100..4900).map(|k| second[k] + 1.69 * y[k]));
        assert!(inside < 1e-6, "{inside}");
    }

    #[test]
    fn the_kernel_is_the_textbook_one() {
        let weights = SavitzkyGolay::new(5, 2).weights(0.0, 0);
        for (w, want) in weights.iter().zip([-3.0, 12.0, 17.0, 12.0, -3.0]) {
            assert!((w - want / 35.0).abs() < 1e-15, "{w}");
        }
        let slope = SavitzkyGolay::new(5, 1).weights(0.0, 1);
        for (w, want) in slope.iter().zip([-2.0, -1.0, 0.0, 1.0, 2.0]) {
            assert!((w - want / 10.0).abs() < 1e-15, "{w}");
        }
    }

    #[test]
    fn the_companion_smooths_as_the_derivative_does() {
        for (window, order) in [(11, 3), (31, 5), (13, 11)] {
            let filter = SavitzkyGolay::new(window, order);
            let kernel = filter.companion();
            assert!((kernel.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let slope = filter.weights(0.0, 1);
            for rate in [0.01, 0.1, 0.3, 0.7] {
                let half = kernel.len() / 2;
                let smooth: f64 =
                    kernel.iter().enumerate().map(|(k, w)| w * (rate * (k as f64 - half as f64)).cos()).sum();
                let half = slope.len() / 2;
                let of_sine: f64 =
                    slope.iter().enumerate().map(|(k, w)| w * (rate * (k as f64 - half as f64)).sin()).sum();
                // The average's own error is 191/60480 of the sixth power of the phase between samples.
                assert!(
                    (of_sine / rate - smooth).abs() < 0.004 * f64::powi(rate, 6) + 1e-12,
                    "{window} {order} {rate}"
                );
            }
        }
    }

    #[test]
    fn a_stride_picks_from_the_full_result() {
        let y = wave(1003, 0.05);
        let filter = SavitzkyGolay::new(41, 5);
        for derivative in 0..3 {
            let full = filter.apply(&y, 0.05, derivative);
            for stride in [2, 3, 7] {
                let mut some = vec![0.0; y.len().div_ceil(stride)];
                filter.apply_strided(&y, 0.05, derivative, stride, &mut some);
                for (k, s) in some.iter().enumerate() {
                    assert!((s - full[k * stride]).abs() < 1e-11 * (1.0 + s.abs()), "{derivative} {stride} {k}");
                }
            }
        }
    }

    #[test]
    fn a_record_shorter_than_the_segment_is_still_smoothed() {
        let y = wave(12, 0.1);
        let out = SavitzkyGolay::new(31, 3).apply(&y, 0.1, 0);
        assert_eq!(out.len(), 12);
        assert!(largest(out.iter().zip(&y).map(|(a, b)| a - b)) < 0.05);
    }
}
