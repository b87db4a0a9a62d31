//! Numbers drawn at random.

use rand::RngExt;
use rand_pcg::Pcg64;

/// Evenly in the logarithm.
pub(super) fn log_uniform(random: &mut Pcg64, low: f64, high: f64) -> f64 {
    (low.ln() + (high / low).ln() * random.random::<f64>()).exp()
}

/// −1 or 1.
pub(super) fn sign(random: &mut Pcg64) -> f64 {
    if random.random::<bool>() { 1.0 } else { -1.0 }
}

/// One of a list that is not empty.
pub(super) fn one_of<T: Copy>(list: &[T], random: &mut Pcg64) -> T {
    list[random.random_range(0..list.len())]
}
