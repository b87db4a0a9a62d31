//! A pole pair of a structure, and the response of its mode to a sampled force.

use std::f64::consts::TAU;

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

/// Nodes and weights of Gauss–Legendre quadrature on the interval from zero to one.
const NODES: [(f64, f64); 8] = [
    (0.019_855_071_751_231_9, 0.050_614_268_145_188_1),
    (0.101_666_761_293_186_6, 0.111_190_517_226_687_2),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_6),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_6),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_2),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_1),
];
/// Samples before and after the present one through which the input's polynomial goes.
const BEFORE: usize = 2;
pub(crate) const POINTS: usize = 6;
/// Least and largest damping ratio of a mode.
pub(crate) const DAMPING: (f64, f64) = (5e-5, 0.5);

/// An oscillation `q″ + 2ζω q′ + ω² q = u` by its eigenvalue `λ = −ζω + iω√(1−ζ²)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pole {
    /// Natural frequency ω, rad/s.
    pub omega: f64,
    /// Damping ratio ζ.
    pub damping: f64,
}

impl Pole {
    /// A pole of this natural frequency, Hz, and damping ratio.
    pub fn at(frequency: f64, damping: f64) -> Self {
        Self { omega: TAU * frequency, damping }
    }

    /// Natural frequency, Hz.
    pub fn frequency(self) -> f64 {
        self.omega / TAU
    }

    /// The eigenvalue with the positive imaginary part, 1/s.
    pub fn eigenvalue(self) -> Complex<f64> {
        let damping = self.damping.clamp(DAMPING.0, DAMPING.1);
        Complex::new(-damping, (1.0 - damping * damping).sqrt()) * self.omega
    }

    /// True if the damping lies within its bounds.
    pub(crate) fn is_free(self) -> bool {
        self.damping > DAMPING.0 && self.damping < DAMPING.1
    }

    /// The pole of which frequency and damping ratio are these times as large.
    pub(crate) fn scaled(self, omega: f64, damping: f64) -> Self {
        Self { omega: self.omega * omega, damping: (self.damping * damping).clamp(DAMPING.0, DAMPING.1) }
    }
}

/// Weights `b[part][j]` by which samples `u[n−2..=n+3]` drive `Z′ = λZ + u` over each of `parts` equal parts of the interval
/// from sample `n` to the next: exact for the polynomial of fifth degree through these samples.
///
/// The samples of a multisine at nine a period of its fastest line are followed to 10⁻⁴; held constant between samples it is
/// off by a tenth.
pub(crate) fn input_weights(lambda: Complex<f64>, interval: f64, parts: usize) -> Vec<[Complex<f64>; POINTS]> {
    let step = 1.0 / parts as f64;
    let of_part = |part: usize| {
        let mut weights = [Complex::new(0.0, 0.0); POINTS];
        for (node, weight) in NODES {
            let at = (part as f64 + node) * step;
            let decay = (lambda * (interval * step * (1.0 - node))).exp() * (weight * interval * step);
            for (j, sum) in weights.iter_mut().enumerate() {
                *sum += decay * lagrange(j, at);
            }
        }
        weights
    };
    (0..parts).map(of_part).collect()
}

/// The polynomial that is one at node `j` and zero at the others, at a time in sampling intervals after the present sample.
fn lagrange(j: usize, at: f64) -> f64 {
    let node = |k: usize| k as f64 - BEFORE as f64;
    (0..POINTS).filter(|k| *k != j).map(|k| (at - node(k)) / (node(j) - node(k))).product()
}

/// A series with as many samples before and behind it as the polynomials reach, turned about its ends.
pub(crate) fn padded(series: &[f64]) -> Vec<f64> {
    let n = series.len();
    let at = |k: isize| -> f64 {
        let last = n as isize - 1;
        if k < 0 {
            2.0 * series[0] - series[(-k).min(last) as usize]
        } else if k > last {
            2.0 * series[n - 1] - series[(2 * last - k).max(0) as usize]
        } else {
            series[k as usize]
        }
    };
    if n == 0 {
        return Vec::new();
    }
    (-(BEFORE as isize)..(n + POINTS - BEFORE) as isize).map(at).collect()
}

/// The rate of change of a series, by the polynomial of sixth degree through seven samples: at nine samples a period it is followed to
/// a thousandth.
pub(crate) fn rate(series: &[f64], interval: f64) -> Vec<f64> {
    let n = series.len();
    let padded = padded(series);
    let at = |k: usize, by: isize| -> f64 {
        let place = k as isize + by + BEFORE as isize;
        usize::try_from(place).ok().and_then(|p| padded.get(p)).copied().unwrap_or(0.0)
    };
    let slope = |k: usize| {
        let reach: &[f64] = if (3..n.saturating_sub(3)).contains(&k) { &[0.75, -0.15, 1.0 / 60.0] } else { &[0.5] };
        let each = reach.iter().enumerate();
        each.map(|(by, w)| w * (at(k, by as isize + 1) - at(k, -(by as isize) - 1))).sum::<f64>() / interval
    };
    (0..n).map(slope).collect()
}

/// What drives the state between sample `n` and the next, from a padded series.
pub(crate) fn driven(weights: &[Complex<f64>; POINTS], padded: &[f64], n: usize) -> Complex<f64> {
    let mut sum = Complex::new(0.0, 0.0);
    for (weight, value) in weights.iter().zip(&padded[n..n + POINTS]) {
        sum += weight * *value;
    }
    sum
}

/// The state `Z` of a mode at rest at first along an input sampled evenly (padded by [`padded`]), one value a sample.
pub(crate) fn response(lambda: Complex<f64>, interval: f64, padded: &[f64], states: &mut [Complex<f64>]) {
    let weights = input_weights(lambda, interval, 1);
    for (out, values) in states.iter_mut().zip(padded.windows(POINTS)) {
        let mut sum = Complex::new(0.0, 0.0);
        for (weight, value) in weights[0].iter().zip(values) {
            sum += weight * *value;
        }
        *out = sum;
    }
    accumulate((lambda * interval).exp(), states);
}

/// Stretches of a record whose recursions go side by side: one alone waits for its last sum.
const LANES: usize = 8;

/// From what drives a state between a sample and the next, the states: `Z(n+1) = d Z(n) + g(n)` from rest.
fn accumulate(decay: Complex<f64>, states: &mut [Complex<f64>]) {
    let length = states.len() / LANES;
    let mut last = [Complex::new(0.0, 0.0); LANES];
    for k in 0..length {
        for (lane, state) in last.iter_mut().enumerate() {
            let slot = &mut states[lane * length + k];
            let next = decay * *state + *slot;
            *slot = *state;
            *state = next;
        }
    }
    // What each stretch carries on from those before it.
    let whole = (0..length).fold(Complex::new(1.0, 0.0), |power, _| power * decay);
    let mut carried = [Complex::new(0.0, 0.0); LANES];
    for lane in 1..LANES {
        carried[lane] = carried[lane - 1] * whole + last[lane - 1];
    }
    let mut power = Complex::new(1.0, 0.0);
    for k in 0..length {
        for (lane, from) in carried.iter().enumerate().skip(1) {
            states[lane * length + k] += power * from;
        }
        power *= decay;
    }
    let mut state = carried[LANES - 1] * whole + last[LANES - 1];
    for slot in &mut states[LANES * length..] {
        let next = decay * state + *slot;
        *slot = state;
        state = next;
    }
}

/// The same along a force that is known at `parts` times as many instants and straight between them.
pub(crate) fn response_fine(
    lambda: Complex<f64>,
    interval: f64,
    force: &[f64],
    parts: usize,
    states: &mut [Complex<f64>],
) {
    let step = interval / parts as f64;
    let weights: Vec<Complex<f64>> = (0..=parts)
        .map(|k| {
            let mut sum = Complex::new(0.0, 0.0);
            for (node, weight) in NODES {
                // The hat function of instant k, over the part before it and the one behind.
                if k > 0 {
                    let at = (k - 1) as f64 + node;
                    sum += (lambda * (interval - at * step)).exp() * (node * weight * step);
                }
                if k < parts {
                    let at = k as f64 + node;
                    sum += (lambda * (interval - at * step)).exp() * ((1.0 - node) * weight * step);
                }
            }
            sum
        })
        .collect();
    for (n, out) in states.iter_mut().enumerate() {
        let mut sum = Complex::new(0.0, 0.0);
        if let Some(values) = force.get(n * parts..=(n + 1) * parts) {
            for (weight, value) in weights.iter().zip(values) {
                sum += weight * *value;
            }
        }
        *out = sum;
    }
    accumulate((lambda * interval).exp(), states);
}

/// A free oscillation of unit size, sample by sample: its real and imaginary part.
pub(crate) fn swing(decay: Complex<f64>, real: &mut [f64], imaginary: &mut [f64]) {
    let mut lanes = [Complex::new(1.0, 0.0); LANES];
    for k in 1..LANES {
        lanes[k] = lanes[k - 1] * decay;
    }
    let step = lanes[LANES - 1] * decay;
    for (real, imaginary) in real.chunks_mut(LANES).zip(imaginary.chunks_mut(LANES)) {
        for ((re, im), state) in real.iter_mut().zip(imaginary.iter_mut()).zip(&mut lanes) {
            (*re, *im) = (state.re, state.im);
            *state *= step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At nine samples a period of the input the response is that of the exact solution.
    #[test]
    fn a_mode_follows_a_sampled_tone() {
        let pole = Pole { omega: 3.0, damping: 0.02 };
        let lambda = pole.eigenvalue();
        let (interval, drive) = (TAU / 4.0 / 9.0, 4.0_f64);
        let input: Vec<f64> = (0..400).map(|n| (drive * interval * n as f64).sin()).collect();
        let mut states = vec![Complex::new(0.0, 0.0); input.len()];
        response(lambda, interval, &padded(&input), &mut states);
        // Z′ = λZ + (e^{iωt} − e^{−iωt})/2i, from rest.
        let exact = |t: f64| {
            let part = |s: Complex<f64>| ((s * t).exp() - (lambda * t).exp()) / (s - lambda) * 0.5;
            let two_i = Complex::new(0.0, 1.0);
            (part(Complex::new(0.0, drive)) - part(Complex::new(0.0, -drive))) / two_i
        };
        let largest = states.iter().map(|z| z.norm()).fold(0.0, f64::max);
        // The last polynomials reach past the record.
        for (n, z) in states.iter().enumerate().take(input.len() - POINTS) {
            assert!((z - exact(interval * n as f64)).norm() < 2e-3 * largest, "{n}");
        }
    }

    #[test]
    fn parts_of_an_interval_add_up() {
        let lambda = Pole { omega: 5.0, damping: 0.1 }.eigenvalue();
        let [whole, parts] = [1, 3].map(|p| input_weights(lambda, 0.1, p));
        for j in 0..POINTS {
            let sum: Complex<f64> = (0..3).map(|k| (lambda * (0.1 * (2 - k) as f64 / 3.0)).exp() * parts[k][j]).sum();
            assert!((sum - whole[0][j]).norm() < 1e-12);
        }
    }
}
