//! Sums, means and ranks of series.

use fearless_simd::{Level, Simd, SimdBase as _, SimdFrom as _, dispatch, f64x4};

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
    dispatch!(Level::new(), simd => each(simd, series, others, out));
}

/// Inner products that are added up side by side: each addition waits for the one before it, and others fill the time.
const SIDE_BY_SIDE: usize = 4;

#[inline(always)] // into each width of registers
fn each<'s, S: Simd>(simd: S, series: &[f64], mut others: impl Iterator<Item = &'s [f64]>, out: &mut Vec<f64>) {
    loop {
        let mut some = [series; SIDE_BY_SIDE];
        let count = some.iter_mut().zip(&mut others).map(|(place, other)| *place = other).count();
        match count {
            SIDE_BY_SIDE => out.extend(several(simd, series, some)),
            _ => return out.extend(some[..count].iter().map(|other| dot(series, other))),
        }
    }
}

/// Each one as [`dot`] has it.
#[inline(always)] // into each width of registers
fn several<S: Simd>(simd: S, series: &[f64], others: [&[f64]; SIDE_BY_SIDE]) -> [f64; SIDE_BY_SIDE] {
    // No closure holds numbers side by side: it would be compiled for a processor without such registers.
    let mut sums = [[f64x4::splat(simd, 0.0); 2]; SIDE_BY_SIDE];
    let (whole, rest) = series.as_chunks::<LANES>();
    let others = others.map(|other| other[..series.len()].as_chunks::<LANES>());
    for (k, a) in whole.iter().enumerate() {
        let a = halves(simd, a);
        for (sums, (other, _)) in sums.iter_mut().zip(&others) {
            let b = halves(simd, &other[k]);
            sums[0] += a[0] * b[0];
            sums[1] += a[1] * b[1];
        }
    }
    let mut products = [0.0; SIDE_BY_SIDE];
    for ((product, sums), (_, other)) in products.iter_mut().zip(sums).zip(others) {
        let lanes: [[f64; LANES / 2]; 2] = [sums[0].into(), sums[1].into()];
        *product = lanes.as_flattened().iter().sum::<f64>() + rest.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
    }
    products
}

#[inline(always)] // into each width of registers
fn halves<S: Simd>(simd: S, [a, b, c, d, e, f, g, h]: &[f64; LANES]) -> [f64x4<S>; 2] {
    [f64x4::simd_from(simd, [*a, *b, *c, *d]), f64x4::simd_from(simd, [*e, *f, *g, *h])]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_side_by_side_are_those_of_one_at_a_time_to_the_last_digit() {
        let series = |from: usize, n: usize| -> Vec<f64> { (from..from + n).map(|k| (k as f64).sin()).collect() };
        for (length, count) in [(0, 5), (3, 1), (8, 4), (37, 7), (100, 9)] {
            let (own, others) = (series(1, length), (0..count).map(|k| series(9 * k, length)).collect::<Vec<_>>());
            let mut found = vec![1.0];
            dots(&own, others.iter().map(Vec::as_slice), &mut found);
            let wanted: Vec<f64> = std::iter::once(1.0).chain(others.iter().map(|other| dot(&own, other))).collect();
            assert_eq!(found, wanted, "{length} {count}");
        }
    }
}
