//! How noisy a channel is, without a model.

/// Standard deviation of the white noise in evenly sampled data.
///
/// Differences of rising order take the smooth motion away and keep the noise, whose variance order `d` multiplies by
/// the binomial coefficient `C(2d, d)` (von Neumann 1941; Gasser, Sroka & Jennen-Steinmetz 1986); the smallest estimate
/// is the one with the least motion left in it. None below 20 samples.
pub fn standard_deviation(samples: &[f64]) -> Option<f64> {
    const ORDERS: std::ops::RangeInclusive<usize> = 2..=10;
    if samples.len() < 2 * ORDERS.end() {
        return None;
    }
    let mut differences = samples.to_vec();
    let mut gain = 1.0;
    let mut best = f64::INFINITY;
    for order in 1..=*ORDERS.end() {
        let left = differences.len() - 1;
        for k in 0..left {
            differences[k] = differences[k + 1] - differences[k];
        }
        differences.truncate(left);
        let d = order as f64;
        gain *= 2.0 * (2.0 * d - 1.0) / d;
        if ORDERS.contains(&order) {
            let power = differences.iter().map(|x| x * x).sum::<f64>() / left as f64;
            best = best.min((power / gain).sqrt());
        }
    }
    best.is_finite().then_some(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, Normal};

    #[test]
    fn finds_the_noise_under_a_motion() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        let noise = Normal::new(0.0, 0.01).unwrap();
        let y: Vec<f64> = (0..5000).map(|k| (0.05 * f64::from(k)).sin() + noise.sample(&mut rng)).collect();
        let found = standard_deviation(&y).unwrap();
        // 5000 samples of a tenth difference: about 3 % sampling error, and the minimum over orders leans low.
        assert!((found / 0.01 - 1.0).abs() < 0.1, "{found}");
    }

    #[test]
    fn clean_motion_has_next_to_none() {
        let y: Vec<f64> = (0..5000).map(|k| (0.05 * f64::from(k)).sin()).collect();
        assert!(standard_deviation(&y).unwrap() < 1e-9);
        assert_eq!(standard_deviation(&[1.0; 10]), None);
    }
}
