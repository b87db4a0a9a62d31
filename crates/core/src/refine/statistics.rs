//! Autocorrelation of residuals, and what it does to variances.

use std::f64::consts::TAU;

/// Sums of products of samples so far apart, from none to `order` samples, over series of their own.
pub fn lagged_products<'a>(series: impl Iterator<Item = &'a [f64]> + Clone, order: usize) -> Vec<f64> {
    let lag = |k: usize| -> f64 {
        series.clone().filter(|s| s.len() > k).map(|s| crate::signal::dot(&s[k..], &s[..s.len() - k])).sum()
    };
    (0..=order).map(lag).collect()
}

/// Coefficients of the autoregression that has these correlations, at no lag and at each up to its order, and the variance of
/// its innovations, by the Levinson–Durbin recursion.
///
/// The prediction of sample `n` is `Σ a[k] e[n−1−k]`.
pub fn autoregression(correlation: &[f64]) -> (Vec<f64>, f64) {
    let order = correlation.len() - 1;
    let mut a: Vec<f64> = Vec::with_capacity(order);
    let mut variance = correlation[0];
    for k in 0..order {
        if variance <= 0.0 {
            break;
        }
        let predicted: f64 = a.iter().enumerate().map(|(i, a)| a * correlation[k - i]).sum();
        let reflection = (correlation[k + 1] - predicted) / variance;
        let before = a.clone();
        for i in 0..k {
            a[i] -= reflection * before[k - 1 - i];
        }
        a.push(reflection);
        variance *= 1.0 - reflection * reflection;
    }
    (a, variance)
}

/// Variance inflation of correlated residuals: their power near a frequency (a share of the sampling rate) over that of white
/// ones of the same variance, at least 1. Squared standard errors and log-likelihood ratios of white residuals are off by it.
///
/// An autoregression of order 8 gives the spectrum; the largest value from half to twice the frequency counts.
pub fn inflation(series: &[&[f64]], frequency: f64) -> f64 {
    let products = lagged_products(series.iter().copied(), 8);
    let (a, innovation) = autoregression(&products);
    let variance = products[0];
    if variance <= 0.0 {
        return 1.0;
    }
    (0..9)
        .map(|k| frequency * 2f64.powf(-1.0 + 0.25 * f64::from(k)))
        .filter(|f| *f < 0.5)
        .map(|f| {
            let (mut re, mut im) = (1.0, 0.0);
            for (k, a) in a.iter().enumerate() {
                let angle = TAU * f * (k + 1) as f64;
                re -= a * angle.cos();
                im += a * angle.sin();
            }
            innovation / (re * re + im * im) / variance
        })
        .fold(1.0, f64::max)
}
