//! What coefficients say in the words of mechanics: natural frequency, damping ratio, stiffness, friction force.

use std::borrow::Cow;

use super::Model;
use crate::term::{Expression, Kind, Symbol, Term, derivative};

/// A parameter of the mechanical system that an equation describes.
#[derive(Clone, Debug, PartialEq)]
pub struct Physical {
    /// Its symbol as a script reads it: `f_n`, `zeta`, `m`, `k`, `c`, `F_f`, `k_3`.
    pub name: Cow<'static, str>,
    /// Its symbol as a person writes it.
    pub symbol: Cow<'static, str>,
    /// What it is.
    pub title: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error, from those of the coefficients and their correlation; none where they have none, or it was given.
    pub std_error: Option<f64>,
    /// Its unit; empty for a plain number.
    pub unit: String,
}

/// How coefficients are turned into forces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mass {
    /// Only ratios to the mass are known.
    Unknown,
    /// The moving mass, kg.
    Given(f64),
    /// The input is the force on the mass, N: its coefficient is one over the mass.
    FromForce,
}

/// A sum of coefficients with weights.
struct Sum(Vec<f64>);

impl Sum {
    fn value(&self, coefficients: &[f64]) -> f64 {
        self.0.iter().zip(coefficients).map(|(w, c)| w * c).sum()
    }

    fn is_zero(&self) -> bool {
        self.0.iter().all(|w| *w == 0.0)
    }

    /// This, times a factor, plus another, times another.
    fn and(&self, factor: f64, other: &Self, times: f64) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| factor * a + times * b).collect())
    }
}

/// The parameters of a model of one degree of freedom of second order, linearised at rest; none of another.
///
/// `covariance` is that of the leading equation's coefficients in the order of its terms, empty if it is not known; `metre` is the length, in metres, of
/// the displacements' unit, none if they are no lengths. Errors are propagated to first order (the delta method).
pub fn physical(model: &Model, covariance: &[Vec<f64>], mass: Mass, metre: Option<f64>) -> Vec<Physical> {
    if model.layout.kind != Kind::SecondOrder || model.layout.freedoms != 1 || model.layout.internals != 0 {
        return Vec::new();
    }
    let Some(equation) = model.leading().filter(|e| !e.terms.is_empty()) else { return Vec::new() };
    let coefficients: Vec<f64> = equation.terms.iter().map(|t| t.coefficient).collect();
    let sum = |weight: &dyn Fn(&Term) -> f64| Sum(equation.terms.iter().map(|t| weight(&t.term)).collect());
    let (x, v, u) = (Symbol::State(0), Symbol::Rate(0), Symbol::Input(0));
    let spring = sum(&|t| -slope(t.expression(), x));
    let damper = sum(&|t| -slope(t.expression(), v));
    let cubic = sum(&|t| -slope(&derivative(&derivative(t.expression(), x), x), x) / 6.0);
    let rubbing = sum(&|t| -jump(t));
    let force = sum(&|t| slope(t.expression(), u));
    // Where nothing is known of the errors, or of some coefficient's, none is claimed.
    let known = covariance.len() == coefficients.len();
    let error = |gradient: &Sum| -> Option<f64> {
        let terms = || gradient.0.iter().enumerate().filter(|(_, g)| **g != 0.0);
        let variance: f64 = terms()
            .flat_map(|(i, a)| terms().map(move |(j, b)| (i, j, a * b)))
            .map(|(i, j, w)| w * covariance[i][j])
            .sum();
        Some(variance.max(0.0).sqrt()).filter(|e| *e > 0.0 && e.is_finite())
    };
    let mut found: Vec<Physical> = Vec::new();
    let mut add = |name: &'static str, symbol: &'static str, title, value: f64, gradient: &Sum, unit: &str| {
        if value.is_finite() {
            let std_error = known.then(|| error(gradient)).flatten();
            found.push(Physical {
                name: name.into(),
                symbol: symbol.into(),
                title,
                value,
                std_error,
                unit: unit.into(),
            });
        }
    };
    let stiffness = spring.value(&coefficients);
    let damping = damper.value(&coefficients);
    let nothing = Sum(vec![0.0; coefficients.len()]);
    if stiffness > 0.0 {
        let omega = stiffness.sqrt();
        let turn = std::f64::consts::TAU;
        let gradient = spring.and(0.5 / (omega * turn), &nothing, 0.0);
        add("f_n", "f₀", "natural frequency, undamped, small motion", omega / turn, &gradient, "Hz");
        if !damper.is_zero() {
            let gradient = damper.and(0.5 / omega, &spring, -0.25 * damping / (stiffness * omega));
            add("zeta", "ζ", "damping ratio, of critical damping", 0.5 * damping / omega, &gradient, "");
        }
    }
    let (m, of_mass) = match mass {
        Mass::Given(m) => {
            add("m", "m", "mass, as given", m, &nothing, "kg");
            (m, nothing)
        }
        Mass::FromForce => {
            let Some(metre) = metre else { return found };
            let b = force.value(&coefficients);
            if b <= 0.0 {
                return found;
            }
            let m = 1.0 / (b * metre);
            let gradient = force.and(-m / b, &nothing, 0.0);
            add("m", "m", "mass, from the force's coefficient", m, &gradient, "kg");
            (m, gradient)
        }
        Mass::Unknown => return found,
    };
    for (sum, factor, name, symbol, title, unit) in [
        (&spring, Some(1.0), "k", "k", "stiffness", "N/m"),
        (&damper, Some(1.0), "c", "c", "viscous damping", "N·s/m"),
        (&rubbing, metre, "F_f", "F_f", "dry friction force", "N"),
        (&cubic, metre.map(|l| l.powi(-2)), "k_3", "k₃", "cubic stiffness", "N/m³"),
    ] {
        let Some(factor) = factor.filter(|_| !sum.is_zero()) else { continue };
        let value = sum.value(&coefficients);
        add(name, symbol, title, m * factor * value, &sum.and(m * factor, &of_mass, factor * value), unit);
    }
    found
}

/// The slope of an expression by a symbol at rest; zero where it has none.
pub(super) fn slope(expression: &Expression, by: Symbol) -> f64 {
    let value = derivative(expression, by).value(&|_| 0.0);
    if value.is_finite() { value } else { 0.0 }
}

/// Half the jump of a term as the velocity turns around at the middle position; zero if it has none.
fn jump(term: &Term) -> f64 {
    if !term.switches() {
        return 0.0;
    }
    let at = |v: f64| term.expression().value(&|s| if s == Symbol::Rate(0) { v } else { 0.0 });
    let half = 0.5 * (at(1e-9) - at(-1e-9));
    if half.abs() > 1e-6 { half } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Equation;
    use crate::term::list;

    fn model(terms: &str, coefficients: &[f64]) -> Model {
        let terms = list(terms).unwrap();
        Model::second_order(1, vec![Equation::known(terms.into_iter().zip(coefficients.iter().copied()))])
    }

    fn value(found: &[Physical], name: &str) -> (f64, f64) {
        let p = found.iter().find(|p| p.name == name).unwrap_or_else(|| panic!("no {name}: {found:?}"));
        (p.value, p.std_error.unwrap_or(0.0))
    }

    #[test]
    fn a_sprung_mass_gets_its_parameters_back() {
        // m = 2 kg, k = 800 N/m, c = 4 N s/m, F_f = 0.3 N, k3 = 5e4 N/m³, force in N, displacement in mm.
        let (m, k, c, f, k3, unit) = (2.0, 800.0, 4.0, 0.3, 5e4, 1e-3);
        let terms = "x, v, sgn(v), x^3, u";
        let coefficients = [-k / m, -c / m, -f / m / unit, -k3 / m * unit * unit, 1.0 / m / unit];
        let model = model(terms, &coefficients);
        for mass in [Mass::Given(m), Mass::FromForce] {
            let found = physical(&model, &[], mass, Some(unit));
            let omega = f64::sqrt(k / m);
            let want = [
                ("f_n", omega / std::f64::consts::TAU),
                ("zeta", c / (2.0 * m * omega)),
                ("m", m),
                ("k", k),
                ("c", c),
                ("F_f", f),
                ("k_3", k3),
            ];
            assert_eq!(found.len(), want.len());
            for (name, want) in want {
                let (got, error) = value(&found, name);
                assert!((got / want - 1.0).abs() < 1e-12 && error == 0.0, "{name}: {got} {want}");
            }
        }
        let ratios = physical(&model, &[], Mass::Unknown, Some(unit));
        assert_eq!(ratios.iter().map(|p| &*p.name).collect::<Vec<_>>(), ["f_n", "zeta"]);
    }

    #[test]
    fn relative_and_bent_springs_count_by_their_slope() {
        let found = physical(
            &model("x-u, v-du, sin(x), v*|v|, |x|*sgn(v)", &[-300.0, -1.0, -61.0, -5.0, -2.0]),
            &[],
            Mass::Given(1.0),
            Some(1.0),
        );
        assert!((value(&found, "k").0 - 361.0).abs() < 1e-9 && (value(&found, "c").0 - 1.0).abs() < 1e-12);
        assert!((value(&found, "k_3").0 + 61.0 / 6.0).abs() < 1e-9, "a sine softens");
        assert!(
            !found.iter().any(|p| p.name == "F_f"),
            "friction that vanishes in the middle is no dry friction there"
        );
        let soft = physical(&model("x, v", &[4.0, -1.0]), &[], Mass::Unknown, Some(1.0));
        assert!(soft.is_empty(), "what does not spring back has no natural frequency: {soft:?}");
    }

    #[test]
    fn errors_are_those_of_many_draws() {
        use rand::SeedableRng as _;
        use rand_distr::{Distribution as _, StandardNormal};
        let mean = [-400.0, -2.0, 0.5];
        // Correlated errors: L Lᵀ.
        let lower = [[4.0, 0.0, 0.0], [0.03, 0.05, 0.0], [-0.004, 0.001, 0.006]];
        let covariance: Vec<Vec<f64>> =
            (0..3).map(|i| (0..3).map(|j| (0..3).map(|k| lower[i][k] * lower[j][k]).sum()).collect()).collect();
        let found = physical(&model("x, v, u", &mean), &covariance, Mass::FromForce, Some(1.0));
        let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
        const DRAWS: usize = 4000;
        let mut drawn: Vec<Vec<f64>> = vec![Vec::new(); found.len()];
        for _ in 0..DRAWS {
            let z: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            let c: Vec<f64> = (0..3).map(|i| mean[i] + (0..3).map(|k| lower[i][k] * z[k]).sum::<f64>()).collect();
            for (values, p) in drawn.iter_mut().zip(physical(&model("x, v, u", &c), &[], Mass::FromForce, Some(1.0))) {
                values.push(p.value);
            }
        }
        for (p, values) in found.iter().zip(&drawn) {
            let mean = values.iter().sum::<f64>() / DRAWS as f64;
            let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (DRAWS - 1) as f64).sqrt();
            // A standard deviation of 4000 draws is known to 1.1 %; first order costs about a hundredth more.
            assert!((p.std_error.unwrap() / spread - 1.0).abs() < 0.05, "{}: {:?} {spread}", p.name, p.std_error);
        }
    }
}
