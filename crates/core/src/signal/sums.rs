//! Sums, means and ranks of series.

use fearless_simd::{Level, dispatch};

/// Lanes of a sum.
pub(crate) const LANES: usize = 8;

/// Inner product Σ aᵢbᵢ of two series of one length, several lanes at once: the same sum in registers of any width.
#[inline(always)] // into each width of registers
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a8, b8) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = a8.remainder().iter().zip(b8.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a8.zip(b8) {
        for (s, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *s += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Inner products of a series with others of its length, appended to `out` one after the other, in the widest registers that
/// the processor has.
pub fn dots<'s>(series: &[f64], others: impl IntoIterator<Item = &'s [f64]>, out: &mut Vec<f64>) {
    let others = others.into_iter();
    dispatch!(Level::new(), _simd => each(series, others, out));
}

#[inline(always)] // into each width of registers
fn each<'s>(series: &[f64], others: impl Iterator<Item = &'s [f64]>, out: &mut Vec<f64>) {
    for other in others {
        out.push(dot(series, other));
    }
}

/// Root mean square; 0 of nothing.
pub fn rms(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { (dot(values, values) / values.len() as f64).sqrt() }
}

/// The value that `rank` others are below, from zero, in the order of [`f64::total_cmp`]; none if there are not as many.
pub fn ranked(mut values: Vec<f64>, rank: usize) -> Option<f64> {
    (rank < values.len()).then(|| *values.select_nth_unstable_by(rank, f64::total_cmp).1)
}

/// The median; the upper one of an even number of values, none of nothing.
pub fn median(values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    ranked(values, middle)
}

/// Mean and variance; 0 of nothing.
pub fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|y| (y - mean) * (y - mean)).sum::<f64>() / n)
}
