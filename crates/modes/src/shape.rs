//! What a complex shape says of its mode: how nearly all sensors swing in or against one phase, and how alike two shapes are.

use std::f64::consts::PI;

use nalgebra::{Complex, Matrix2};

/// Modal phase collinearity: 1 where all entries of a shape lie on one line of the complex plane, 0 where they have no common
/// phase; none for fewer than two entries, or a shape of zeros.
///
/// With `S` the 2 × 2 matrix of the sums of squares and products of real and imaginary parts and its eigenvalues λ₁ ≥ λ₂:
/// `((λ₁ − λ₂)/(λ₁ + λ₂))²`.
///
/// Source: R. Pappa, K. Elliott, A. Schenk, J. Guid. Control Dyn. 16 (1993) 852.
pub fn phase_collinearity(shape: &[Complex<f64>]) -> Option<f64> {
    let (xx, yy, xy) = moments(shape)?;
    let difference = (xx - yy).powi(2) + 4.0 * xy * xy;
    Some(difference / (xx + yy).powi(2))
}

/// Mean phase deviation, rad: the mean angle of the entries from the line through the origin that fits them best, each weighed by its
/// magnitude; from 0 to about π/4 for random phases. None as for [`phase_collinearity`].
///
/// Source: E. Reynders, J. Houbrechts, G. De Roeck, Mech. Syst. Signal Process. 29 (2012) 228.
pub fn phase_deviation(shape: &[Complex<f64>]) -> Option<f64> {
    let (xx, yy, xy) = moments(shape)?;
    let line = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (mut sum, mut weights) = (0.0, 0.0);
    for entry in shape.iter().filter(|e| e.norm() > 0.0) {
        // An entry and the one turned by half a turn lie on one line.
        let turned = (entry.arg() - line).rem_euclid(PI);
        sum += entry.norm() * turned.min(PI - turned);
        weights += entry.norm();
    }
    Some(sum / weights)
}

/// Modal assurance criterion of two shapes: 1 where one is a multiple of the other, 0 where they have nothing in common.
///
/// Source: R. Allemang, D. Brown, Proc. 1st Int. Modal Analysis Conf. (1982) 110.
pub fn assurance(first: &[Complex<f64>], second: &[Complex<f64>]) -> f64 {
    let power = |shape: &[Complex<f64>]| shape.iter().map(|e| e.norm_sqr()).sum::<f64>();
    let product: Complex<f64> = first.iter().zip(second).map(|(a, b)| a.conj() * b).sum();
    let powers = power(first) * power(second);
    if powers > 0.0 { (product.norm_sqr() / powers).min(1.0) } else { 0.0 }
}

/// Sums of squares of real and of imaginary parts, and of their products.
fn moments(shape: &[Complex<f64>]) -> Option<(f64, f64, f64)> {
    let sum = |of: fn(&Complex<f64>) -> f64| shape.iter().map(of).sum::<f64>();
    let moments = Matrix2::new(sum(|e| e.re * e.re), sum(|e| e.re * e.im), 0.0, sum(|e| e.im * e.im));
    let all = moments.trace();
    (shape.len() > 1 && all.is_finite() && all > 0.0).then_some((moments.m11, moments.m22, moments.m12))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(shape: &[f64], angle: f64) -> Vec<Complex<f64>> {
        shape.iter().map(|s| Complex::from_polar(1.0, angle) * *s).collect()
    }

    #[test]
    fn a_real_shape_is_collinear_whatever_its_phase() {
        for angle in [0.0, 0.4, 1.3, 2.9] {
            let shape = turned(&[1.0, -0.6, 0.3], angle);
            assert!((phase_collinearity(&shape).unwrap() - 1.0).abs() < 1e-12);
            assert!(phase_deviation(&shape).unwrap() < 1e-7);
        }
    }

    #[test]
    fn a_travelling_wave_has_no_common_phase() {
        let wave: Vec<_> = (0..8).map(|k| Complex::from_polar(1.0, PI * f64::from(k) / 8.0)).collect();
        assert!(phase_collinearity(&wave).unwrap() < 1e-12);
        // Angles spread evenly over a quarter turn to either side.
        assert!((phase_deviation(&wave).unwrap() - PI / 4.0).abs() < 1e-9);
    }

    #[test]
    fn one_sensor_tells_nothing_of_the_phase() {
        assert_eq!(
            (phase_collinearity(&turned(&[1.0], 0.3)), phase_deviation(&turned(&[0.0, 0.0], 0.0))),
            (None, None)
        );
    }

    #[test]
    fn assurance_tells_multiples_from_others() {
        let (a, b) = (turned(&[1.0, 0.5], 0.2), turned(&[-2.0, -1.0], 1.0));
        assert!((assurance(&a, &b) - 1.0).abs() < 1e-12);
        assert!(assurance(&a, &turned(&[0.5, -1.0], 0.0)) < 1e-12);
    }
}
