//! Samples that are missing, filled in from those beside them.

use nalgebra::{DMatrix, DVector};

/// Samples on either side that a bridge rests on, where there are as many.
const MIN_NEIGHBOURS: usize = 8;

/// Degree of the bridge's polynomial, at most: beyond, noise is carried further than motion.
const MAX_DEGREE: usize = 5;

/// Values of `missing` samples between two stretches: the polynomial of least squares through as many samples on either side
/// as are missing, and eight at least. Of a motion with some thirty samples a period noise stays noise of its size.
pub fn fill(before: &[f64], after: &[f64], missing: usize) -> Vec<f64> {
    let piers = missing.max(MIN_NEIGHBOURS);
    let left = &before[before.len().saturating_sub(piers)..];
    let right = &after[..after.len().min(piers)];
    let reach = (left.len() + missing + right.len()) as f64;
    // From −1 to 1, the middle of the gap at zero: powers of it are well conditioned.
    let middle = left.len() as f64 + 0.5 * (missing as f64 - 1.0);
    let place = |i: usize| 2.0 * (i as f64 - middle) / reach;
    let places: Vec<f64> =
        (0..left.len()).chain(left.len() + missing..left.len() + missing + right.len()).map(place).collect();
    let columns = (places.len() / 2).clamp(1, MAX_DEGREE + 1);
    let powers = DMatrix::from_fn(places.len(), columns, |row, power| places[row].powi(power as i32));
    let known = DVector::from_iterator(places.len(), left.iter().chain(right).copied());
    let value = |coefficients: &DVector<f64>, x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
    let middle_value = known.mean();
    match powers.svd(true, true).solve(&known.add_scalar(-middle_value), 1e-12) {
        Ok(coefficients) => (0..missing).map(|i| middle_value + value(&coefficients, place(left.len() + i))).collect(),
        // The decomposition has both factors, so this does not happen; a straight line is right all the same.
        Err(_) => {
            let (a, b) = (left.last().copied().unwrap_or_default(), right.first().copied().unwrap_or_default());
            (1..=missing).map(|i| a + (b - a) * i as f64 / (missing as f64 + 1.0)).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_gap_in_a_motion_is_bridged_to_a_small_part_of_it() {
        let motion = |i: usize| (TAU * i as f64 / 60.0 + 0.4).sin();
        let values: Vec<f64> = (0..200).map(motion).collect();
        for (missing, allowed) in [(1, 1e-5), (5, 1e-4), (12, 5e-3)] {
            let filled = fill(&values[..90], &values[90 + missing..], missing);
            let far = filled.iter().enumerate().map(|(i, v)| (v - motion(90 + i)).abs()).fold(0.0, f64::max);
            assert!(far < allowed, "{missing}: {far}");
        }
    }

    #[test]
    fn noise_stays_noise_of_its_size() {
        let noise: Vec<f64> = (0..400).map(|i| ((f64::from(i) * 78.233).sin() * 12543.123).fract()).collect();
        for missing in [1, 4, 10, 30] {
            let filled = fill(&noise[..200], &noise[200 + missing..], missing);
            assert!(filled.iter().all(|v| v.abs() < 1.5), "{missing}: {filled:?}");
        }
    }

    #[test]
    fn a_gap_near_an_end_is_bridged_by_what_there_is() {
        let line: Vec<f64> = (0..30).map(f64::from).collect();
        let filled = fill(&line[..2], &line[4..], 2);
        assert!((filled[0] - 2.0).abs() < 1e-9 && (filled[1] - 3.0).abs() < 1e-9, "{filled:?}");
    }
}
