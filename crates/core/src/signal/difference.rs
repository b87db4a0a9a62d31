//! Plain finite differences.

/// First derivative by central differences, second order right up to the ends.
pub(crate) fn central(samples: &[f64], interval: f64) -> Vec<f64> {
    let n = samples.len();
    match n {
        0 => Vec::new(),
        1 => vec![0.0],
        2 => vec![(samples[1] - samples[0]) / interval; 2],
        _ => {
            let half = 0.5 / interval;
            let mut out = Vec::with_capacity(n);
            out.push(half * (-3.0 * samples[0] + 4.0 * samples[1] - samples[2]));
            out.extend(samples.windows(3).map(|w| half * (w[2] - w[0])));
            out.push(half * (3.0 * samples[n - 1] - 4.0 * samples[n - 2] + samples[n - 3]));
            out
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_are_exact_up_to_the_ends() {
        let y: Vec<f64> = (0..9).map(|k| f64::from(k * k)).collect();
        for (k, d) in central(&y, 1.0).iter().enumerate() {
            assert!((d - 2.0 * k as f64).abs() < 1e-12, "{k}: {d}");
        }
        assert!(central(&[], 1.0).is_empty());
        assert_eq!(central(&[1.0, 3.0], 0.5), [4.0, 4.0]);
    }
}
