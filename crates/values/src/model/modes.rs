//! Natural frequencies, damping ratios and shapes of the linear part of a model's equations.

use nalgebra::{Complex, DMatrix, DVector, Schur};

use super::Model;
use super::physical::slope;
use crate::term::{Kind, Symbol};
use serde::{Deserialize, Serialize};

/// A free oscillation of the linear part: `q e^(λt)` with a complex shape `q`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// Natural frequency |λ|/2π, Hz: that of the oscillation without its damping.
    pub frequency: f64,
    /// Its standard error; none where that is not known.
    pub frequency_error: Option<f64>,
    /// Damping ratio −Re λ/|λ|, of critical damping.
    pub damping: f64,
    /// Its standard error; none where that is not known.
    pub damping_error: Option<f64>,
    /// How far each displacement swings, in relation to the one that swings furthest, which has 1; negative where it
    /// swings against that.
    pub shape: Vec<f64>,
    /// Standard errors of the shape; none for the one that the others are related to, and where they are not known.
    pub shape_error: Vec<Option<f64>>,
    /// How far each displacement is ahead of that, rad, from −π/2 to π/2: zero where the damping is proportional.
    pub phase: Vec<f64>,
}

/// The derivatives of the accelerations at rest by displacements and velocities, and what one unit of each coefficient
/// adds to them.
struct LinearizedModel {
    whole: DMatrix<f64>,
    /// For each coefficient: its equation, and its term's slopes by displacements, then velocities.
    each: Vec<(usize, f64, Vec<f64>)>,
}

/// Iterations of the eigenvalues' search, at most.
const ITERATIONS: usize = 10_000;
/// Share of the largest eigenvalue that the oscillating part of another must reach.
const OSCILLATES: f64 = 1e-7;
/// Share of a coefficient that it is moved by for a difference.
const NUDGE: f64 = 1e-5;

/// The oscillating modes of a second-order model linearised at rest, the lowest frequency first; none of another kind.
///
/// `covariance` is that of the accelerations' coefficients, equation after equation in the order of their terms; empty, or
/// not a number, where it is not known. Errors are propagated to first order (the delta method).
pub fn modes(model: &Model, covariance: &[Vec<f64>]) -> Vec<Mode> {
    if model.is_implicit() {
        // Coefficients of the solved equations are not those that the covariance is of.
        return model.explicit().map_or_else(|_| Vec::new(), |explicit| modes(&explicit, &[]));
    }
    let Some(linear) = LinearizedModel::new(model) else { return Vec::new() };
    let found = linear.solved(&linear.whole);
    found
        .iter()
        .map(|(eigenvalue, shape)| {
            let first = furthest(shape);
            let values = figures(*eigenvalue, shape, first);
            let errors = linear.errors(*eigenvalue, first, &values, covariance);
            let n = shape.len();
            Mode {
                frequency: values[0],
                frequency_error: errors[0],
                damping: values[1],
                damping_error: errors[1],
                shape: values[2..].to_vec(),
                shape_error: (0..n).map(|i| errors[2 + i].filter(|_| i != first)).collect(),
                phase: shape.iter().map(|q| tilt(q / shape[first])).collect(),
            }
        })
        .collect()
}

impl LinearizedModel {
    fn new(model: &Model) -> Option<Self> {
        let layout = model.layout;
        if layout.kind != Kind::SecondOrder || layout.internals > 0 || layout.freedoms == 0 {
            return None;
        }
        let n = layout.freedoms;
        let symbols: Vec<Symbol> = (0..n).map(Symbol::State).chain((0..n).map(Symbol::Rate)).collect();
        let mut whole = DMatrix::zeros(n, 2 * n);
        let mut each = Vec::new();
        for (i, equation) in model.equations[n..2 * n].iter().enumerate() {
            for term in &equation.terms {
                let slopes: Vec<f64> = symbols.iter().map(|s| slope(term.term.expression(), *s)).collect();
                for (j, slope) in slopes.iter().enumerate() {
                    whole[(i, j)] += term.coefficient * slope;
                }
                each.push((i, term.coefficient, slopes));
            }
        }
        whole.iter().all(|v: &f64| v.is_finite()).then_some(Self { whole, each })
    }

    /// Each oscillating mode's eigenvalue, its imaginary part positive, and shape.
    fn solved(&self, linear: &DMatrix<f64>) -> Vec<(Complex<f64>, DVector<Complex<f64>>)> {
        let n = linear.nrows();
        let mut companion = DMatrix::zeros(2 * n, 2 * n);
        companion.view_mut((0, n), (n, n)).fill_with_identity();
        companion.view_mut((n, 0), (n, 2 * n)).copy_from(linear);
        let Some(schur) = Schur::try_new(companion, f64::EPSILON, ITERATIONS) else { return Vec::new() };
        let all = schur.complex_eigenvalues();
        let largest = all.iter().map(|l| l.norm()).fold(0.0, f64::max);
        let mut found: Vec<Complex<f64>> = all.iter().copied().filter(|l| l.im > OSCILLATES * largest).collect();
        found.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let shape = |l: &Complex<f64>| {
            let entry = |i: usize, j: usize| {
                let own = if i == j { l * l } else { Complex::from(0.0) };
                own - l * linear[(i, n + j)] - linear[(i, j)]
            };
            let rows = DMatrix::from_fn(n, n, entry).svd(false, true).v_t?;
            // The right singular vector of the least singular value, which nalgebra puts last.
            Some((*l, rows.row(n - 1).adjoint()))
        };
        found.iter().filter_map(shape).collect()
    }

    /// Standard errors of a mode's figures.
    fn errors(
        &self,
        eigenvalue: Complex<f64>,
        first: usize,
        values: &[f64],
        covariance: &[Vec<f64>],
    ) -> Vec<Option<f64>> {
        if covariance.len() != self.each.len() {
            return vec![None; values.len()];
        }
        let gradients: Option<Vec<Vec<f64>>> =
            (0..self.each.len()).map(|k| self.gradient(k, eigenvalue, first)).collect();
        let Some(gradients) = gradients else { return vec![None; values.len()] };
        let error = |figure: usize| {
            let slopes = || gradients.iter().enumerate().map(|(k, g)| (k, g[figure])).filter(|(_, g)| *g != 0.0);
            let sums = slopes().flat_map(|(i, a)| slopes().map(move |(j, b)| (i, j, a * b)));
            let variance: f64 = sums.map(|(i, j, w)| w * covariance[i][j]).sum();
            Some(variance.sqrt()).filter(|e| *e > 0.0 && e.is_finite())
        };
        (0..values.len()).map(error).collect()
    }

    /// How a mode's figures change with a coefficient; none where the mode is lost on the way.
    fn gradient(&self, coefficient: usize, eigenvalue: Complex<f64>, first: usize) -> Option<Vec<f64>> {
        let (equation, value, slopes) = &self.each[coefficient];
        let figures_there = 2 + self.whole.nrows();
        if slopes.iter().all(|s| *s == 0.0) {
            return Some(vec![0.0; figures_there]);
        }
        let step = NUDGE * value.abs().max(f64::MIN_POSITIVE);
        let moved = |by: f64| -> Option<Vec<f64>> {
            let mut linear = self.whole.clone();
            for (j, slope) in slopes.iter().enumerate() {
                linear[(*equation, j)] += by * slope;
            }
            let near = |(l, _): &(Complex<f64>, DVector<Complex<f64>>)| (l - eigenvalue).norm();
            let found = self.solved(&linear);
            let (l, shape) = found.iter().min_by(|a, b| near(a).total_cmp(&near(b)))?;
            Some(figures(*l, shape, first))
        };
        let (ahead, behind) = (moved(step)?, moved(-step)?);
        Some(ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * step)).collect())
    }
}

/// Frequency, damping ratio, then the shape.
fn figures(eigenvalue: Complex<f64>, shape: &DVector<Complex<f64>>, first: usize) -> Vec<f64> {
    let size = eigenvalue.norm();
    let swing = |q: &Complex<f64>| {
        let q = q / shape[first];
        if q.re < 0.0 { -q.norm() } else { q.norm() }
    };
    [size / std::f64::consts::TAU, -eigenvalue.re / size].into_iter().chain(shape.iter().map(swing)).collect()
}

/// The displacement that swings furthest.
fn furthest(shape: &DVector<Complex<f64>>) -> usize {
    let sizes = shape.iter().map(|q| q.norm()).enumerate();
    sizes.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
}

/// The angle of a number to the real axis, rad.
fn tilt(q: Complex<f64>) -> f64 {
    let angle = if q.re < 0.0 { (-q).arg() } else { q.arg() };
    // Minus zero reads badly.
    angle + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Equation, Mass, physical};
    use crate::term::list;

    fn model(equations: &[(&str, &[f64])]) -> Model {
        let equation = |(terms, coefficients): &(&str, &[f64])| {
            Equation::known(list(terms).unwrap().into_iter().zip(coefficients.iter().copied()))
        };
        Model::second_order(1, equations.iter().map(equation).collect())
    }

    #[test]
    fn one_mass_has_the_frequency_and_damping_of_its_parameters() {
        let model = model(&[("x, v, u, sgn(v), x^3", &[-400.0, -2.0, 1.0, -0.5, -1e4])]);
        let covariance: Vec<Vec<f64>> = (0..5)
            .map(|i| (0..5).map(|j| if i == j { [4.0, 0.01, 1.0, 1.0, 1.0][i] } else { 0.0 }).collect())
            .collect();
        let found = modes(&model, &covariance);
        let [mode] = found.as_slice() else { panic!("{found:?}") };
        let known = physical(&model, &covariance, Mass::Unknown, None);
        assert!((mode.frequency - known[0].value).abs() < 1e-9 && (mode.damping - known[1].value).abs() < 1e-9);
        for (error, known) in [(mode.frequency_error, known[0].std_error), (mode.damping_error, known[1].std_error)] {
            assert!((error.unwrap() / known.unwrap() - 1.0).abs() < 1e-6, "{error:?} {known:?}");
        }
        assert_eq!((mode.shape.as_slice(), mode.phase.as_slice()), ([1.0].as_slice(), [0.0].as_slice()));
        assert_eq!(mode.shape_error, [None]);
    }

    #[test]
    fn two_equal_masses_swing_together_and_against_each_other() {
        // Springs k – k – k between two grounds: ω² = k and 3 k, damping proportional.
        let model = model(&[
            ("x1, x2-x1, v1, v2-v1", &[-100.0, 100.0, -0.1, 0.1]),
            ("x2, x2-x1, v2, v2-v1", &[-100.0, -100.0, -0.1, -0.1]),
        ]);
        let found = modes(&model, &[]);
        assert_eq!(found.len(), 2);
        for (mode, (square, side)) in found.iter().zip([(100.0_f64, 1.0), (300.0, -1.0)]) {
            assert!((mode.frequency - square.sqrt() / std::f64::consts::TAU).abs() < 1e-9, "{mode:?}");
            assert!((mode.damping - 0.5e-3 * square.sqrt()).abs() < 1e-9, "{mode:?}");
            assert!((mode.shape[0] * mode.shape[1] - side).abs() < 1e-9, "{mode:?}");
            assert!(mode.phase.iter().all(|p| p.abs() < 1e-9) && mode.frequency_error.is_none());
        }
    }

    #[test]
    fn a_damper_in_one_place_turns_the_phases() {
        let model = model(&[("x1, x2-x1, v1", &[-100.0, 100.0, -3.0]), ("x2-x1", &[-100.0])]);
        let found = modes(&model, &[]);
        assert!(found[0].phase.iter().any(|p| p.abs() > 0.01), "{found:?}");
        // Each mode obeys the equations: λ² q = (J_x + λ J_v) q.
        for mode in &found {
            let size = std::f64::consts::TAU * mode.frequency;
            let l = Complex::new(-mode.damping * size, size * (1.0 - mode.damping * mode.damping).sqrt());
            let q: Vec<Complex<f64>> = mode
                .shape
                .iter()
                .zip(&mode.phase)
                .map(|(s, p)| Complex::from_polar(s.abs(), *p) * s.signum())
                .collect();
            let left = l * l * q[1] + 100.0 * (q[1] - q[0]);
            assert!(left.norm() < 1e-6 * size * size, "{mode:?} {left}");
        }
    }

    #[test]
    fn errors_are_those_of_many_draws() {
        use rand::SeedableRng as _;
        use rand_distr::{Distribution as _, StandardNormal};
        let mean = [-400.0, 300.0, -1.0, -600.0, -1.2];
        let spread = [2.0, 3.0, 0.05, 4.0, 0.06];
        let built = |c: &[f64]| model(&[("x1, x2-x1, v1", &c[..3]), ("x2-x1, v2-v1", &c[3..])]);
        let covariance: Vec<Vec<f64>> =
            (0..5).map(|i| (0..5).map(|j| if i == j { spread[i] * spread[i] } else { 0.0 }).collect()).collect();
        let found = modes(&built(&mean), &covariance);
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        const DRAWS: usize = 1500;
        let mut drawn: Vec<Vec<f64>> = vec![Vec::new(); 6];
        for _ in 0..DRAWS {
            let c: Vec<f64> = mean
                .iter()
                .zip(spread)
                .map(|(m, s)| {
                    let z: f64 = StandardNormal.sample(&mut rng);
                    m + s * z
                })
                .collect();
            for (k, mode) in modes(&built(&c), &[]).iter().enumerate() {
                let other = mode.shape.iter().copied().find(|s| *s != 1.0).unwrap();
                for (slot, value) in drawn[3 * k..].iter_mut().zip([mode.frequency, mode.damping, other]) {
                    slot.push(value);
                }
            }
        }
        for (k, mode) in found.iter().enumerate() {
            let shape = mode.shape_error.iter().flatten().next().copied();
            for (values, error) in drawn[3 * k..].iter().zip([mode.frequency_error, mode.damping_error, shape]) {
                let mean = values.iter().sum::<f64>() / DRAWS as f64;
                let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (DRAWS - 1) as f64).sqrt();
                // A standard deviation of 1500 draws is known to 1.8 %.
                assert!((error.unwrap() / spread - 1.0).abs() < 0.08, "{k}: {error:?} {spread}");
            }
        }
    }
}
