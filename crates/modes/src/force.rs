//! Forces that a linear structure may lack, at a place or between two.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::hysteresis::Hysteresis;
use super::limits::{MAX_CHANGE, RATIOS};
use super::motion::PARTS;

/// A force along a step on which the motion goes straight: its mean, its value at the end, and what changes either.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pass {
    pub(crate) mean: f64,
    pub(crate) mean_by: PassSlopes,
    pub(crate) end: f64,
    pub(crate) end_by: PassSlopes,
}

/// Derivatives by the motion before and after a step, by what is inside the force, and by its inner state before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PassSlopes {
    pub(crate) before: f64,
    pub(crate) after: f64,
    pub(crate) inner: [f64; 2],
    pub(crate) memory: f64,
}

/// A kind of force.
///
/// What is inside it: of a clearance the gap, of friction the velocity within which it changes its sign, of hysteresis the
/// displacement at which it yields and the ratio of its loops' shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Effect {
    /// k x³.
    CubicStiffness,
    /// F sgn v.
    CoulombFriction,
    /// A spring that begins where the displacement leaves a gap.
    Clearance,
    /// c |v| v.
    QuadraticDamping,
    /// k x².
    QuadraticStiffness,
    /// k z, ż = w − (|w| z + r w |z|)/d: a spring that slips.
    BoucWenHysteresis,
}

impl Effect {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::CubicStiffness,
        Self::CoulombFriction,
        Self::Clearance,
        Self::QuadraticDamping,
        Self::QuadraticStiffness,
        Self::BoucWenHysteresis,
    ];

    /// The name that the catalogue has for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::CubicStiffness => "cubic_stiffness",
            Self::CoulombFriction => "coulomb_friction",
            Self::Clearance => "clearance",
            Self::QuadraticDamping => "quadratic_damping",
            Self::QuadraticStiffness => "quadratic_stiffness",
            Self::BoucWenHysteresis => "bouc_wen_hysteresis",
        }
    }

    /// What it is called in sentences.
    pub fn title(self) -> &'static str {
        match self {
            Self::CubicStiffness => "Cubic stiffness",
            Self::CoulombFriction => "Coulomb (dry) friction",
            Self::Clearance => "Clearance (freeplay or stops)",
            Self::QuadraticDamping => "Quadratic damping",
            Self::QuadraticStiffness => "Quadratic stiffness",
            Self::BoucWenHysteresis => "Bouc–Wen hysteresis",
        }
    }

    /// Steps of the integration between two samples at first: a force of the velocity is sharper.
    pub(crate) fn parts(self) -> usize {
        if self.is_of_velocity() { PARTS } else { 2 }
    }

    /// True if it depends on the velocity, else on the displacement.
    pub fn is_of_velocity(self) -> bool {
        matches!(self, Self::CoulombFriction | Self::QuadraticDamping)
    }

    /// True if it may act either way; friction, dampers and stops take energy or push back.
    pub(crate) fn has_either_sign(self) -> bool {
        matches!(self, Self::CubicStiffness | Self::QuadraticStiffness | Self::QuadraticDamping)
    }

    /// How many numbers inside it are fitted.
    pub(crate) fn free_inner(self) -> usize {
        match self {
            Self::BoucWenHysteresis => 2,
            Self::Clearance | Self::CoulombFriction => 1,
            _ => 0,
        }
    }

    /// True if another kind is a limiting case of it: where that one does as well, it is preferred.
    pub(crate) fn contains(self, other: Self) -> bool {
        self == Self::BoucWenHysteresis && other == Self::CoulombFriction
    }

    /// True if it has an inner state, which is then the force itself.
    pub fn has_memory(self) -> bool {
        self == Self::BoucWenHysteresis
    }

    /// What is inside it after a change of the first number's logarithm, and of the second number.
    pub(crate) fn moved_inner(self, inner: [f64; 2], change: &[f64]) -> [f64; 2] {
        let by = change.first().map_or(0.0, |c| c.clamp(-MAX_CHANGE[2], MAX_CHANGE[2]));
        let shape = change.get(1).map_or(0.0, |c| c.clamp(-MAX_CHANGE[2], MAX_CHANGE[2]));
        [inner[0] * by.exp(), if shape == 0.0 { inner[1] } else { (inner[1] + shape).clamp(RATIOS.0, RATIOS.1) }]
    }

    /// How much a number inside it changes for a unit of what `moved_inner` takes.
    pub(crate) fn inner_scale(self, which: usize, inner: [f64; 2]) -> f64 {
        if which == 0 { inner[0] } else { 1.0 }
    }

    /// The force where a simulation begins.
    pub(crate) fn still(self, motion: f64, inner: [f64; 2], memory: f64) -> Pass {
        if self.has_memory() {
            let end_by = PassSlopes { memory: 1.0, ..PassSlopes::default() };
            return Pass { end: memory, end_by, ..Pass::default() };
        }
        let (after, by_inner) = self.slope(motion, inner);
        let end_by = PassSlopes { after, inner: [by_inner, 0.0], ..PassSlopes::default() };
        Pass { end: self.at(motion, inner), end_by, ..Pass::default() }
    }

    /// The force over a step from a motion and an inner state, with all derivatives.
    pub(crate) fn pass(self, before: f64, after: f64, inner: [f64; 2], memory: f64) -> Pass {
        if self.has_memory() {
            return Hysteresis::new(inner).pass(before, after, memory);
        }
        let (mean, [by_before, by_after, by_inner]) = self.mean(before, after, inner);
        let mean_by =
            PassSlopes { before: by_before, after: by_after, inner: [by_inner, 0.0], ..PassSlopes::default() };
        Pass { mean, mean_by, ..self.still(after, inner, memory) }
    }

    /// The mean of `pass` and its slope by the motion's end.
    pub(crate) fn mean_and_slope(self, before: f64, after: f64, inner: [f64; 2], memory: f64) -> (f64, f64) {
        if self.has_memory() {
            return Hysteresis::new(inner).mean_and_slope(before, after, memory);
        }
        let (mean, [_, slope, _]) = self.mean(before, after, inner);
        (mean, slope)
    }

    /// The force along a motion (displacement or velocity, as it depends on) that is known at instants.
    pub(crate) fn along(self, motion: &[f64], inner: [f64; 2]) -> Vec<f64> {
        if self.has_memory() {
            return Hysteresis::new(inner).along(motion);
        }
        motion.iter().map(|x| self.at(*x, inner)).collect()
    }

    /// The force at a motion `x` (displacement or velocity, as it depends on); of one with a memory, where it comes from zero.
    pub(crate) fn at(self, x: f64, inner: [f64; 2]) -> f64 {
        let [first, _] = inner;
        match self {
            Self::CubicStiffness => x * x * x,
            Self::CoulombFriction => x / x.hypot(first),
            Self::Clearance => x - x.clamp(-first, first),
            Self::QuadraticDamping => x * x.abs(),
            Self::QuadraticStiffness => x * x,
            Self::BoucWenHysteresis => Hysteresis::new(inner).pass(0.0, x, 0.0).end,
        }
    }

    /// Its derivative by the motion, and by what is inside it first.
    pub(crate) fn slope(self, x: f64, inner: [f64; 2]) -> (f64, f64) {
        let [first, _] = inner;
        match self {
            Self::CubicStiffness => (3.0 * x * x, 0.0),
            Self::CoulombFriction => {
                let cube = x.hypot(first).powi(3);
                (first * first / cube, -x * first / cube)
            }
            Self::Clearance if x.abs() > first => (1.0, -x.signum()),
            Self::Clearance => (0.0, 0.0),
            Self::QuadraticDamping => (2.0 * x.abs(), 0.0),
            Self::QuadraticStiffness => (2.0 * x, 0.0),
            Self::BoucWenHysteresis => {
                let by = Hysteresis::new(inner).pass(0.0, x, 0.0).end_by;
                (by.after, by.inner[0])
            }
        }
    }

    /// The force's mean over a step along which the motion goes straight from `a` to `b`, and the mean's derivatives by
    /// `a`, `b` and what is inside first: switching within the step counts at the instant when it happens.
    pub(crate) fn mean(self, a: f64, b: f64, inner: [f64; 2]) -> (f64, [f64; 3]) {
        let [first, _] = inner;
        match self {
            Self::CubicStiffness => {
                let mean = 0.25 * (a * a * a + a * a * b + a * b * b + b * b * b);
                let by = |a: f64, b: f64| 0.25 * (3.0 * a * a + 2.0 * a * b + b * b);
                (mean, [by(a, b), by(b, a), 0.0])
            }
            Self::QuadraticStiffness => {
                ((a * a + a * b + b * b) / 3.0, [(2.0 * a + b) / 3.0, (2.0 * b + a) / 3.0, 0.0])
            }
            Self::CoulombFriction => {
                let (p, q) = (a.hypot(first), b.hypot(first));
                let (sum, mean) = (p + q, (a + b) / (p + q));
                let by_inner = -mean * (first / p + first / q) / sum;
                (mean, [(1.0 - mean * a / p) / sum, (1.0 - mean * b / q) / sum, by_inner])
            }
            Self::QuadraticDamping if a * b >= 0.0 => {
                let sign = if a + b < 0.0 { -1.0 } else { 1.0 };
                let mean = sign * (a * a + a * b + b * b) / 3.0;
                (mean, [sign * (2.0 * a + b) / 3.0, sign * (2.0 * b + a) / 3.0, 0.0])
            }
            Self::QuadraticDamping => {
                let mean = (b.abs().powi(3) - a.abs().powi(3)) / (3.0 * (b - a));
                (mean, [(mean - a * a.abs()) / (b - a), (b * b.abs() - mean) / (b - a), 0.0])
            }
            Self::Clearance => {
                let beyond = |x: f64| (x.abs() - first).max(0.0);
                let step = b - a;
                if step.abs() < 1e-9 * first.max(1e-12) {
                    let (force, (by, by_inner)) = (self.at(0.5 * (a + b), inner), self.slope(0.5 * (a + b), inner));
                    return (force, [0.5 * by, 0.5 * by, by_inner]);
                }
                let mean = 0.5 * (beyond(b).powi(2) - beyond(a).powi(2)) / step;
                let by_inner = -(beyond(b) - beyond(a)) / step;
                (mean, [(mean - self.at(a, inner)) / step, (self.at(b, inner) - mean) / step, by_inner])
            }
            Self::BoucWenHysteresis => {
                let Pass { mean, mean_by, .. } = Hysteresis::new(inner).pass(a, b, 0.0);
                (mean, [mean_by.before, mean_by.after, mean_by.inner[0]])
            }
        }
    }
}

/// Where a force acts; places count from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Site {
    /// Between a place and the ground.
    Ground(usize),
    /// Between two places, the lower number first.
    Between(usize, usize),
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ground(i) => write!(f, "ground-{}", i + 1),
            Self::Between(i, j) => write!(f, "{}-{}", i + 1, j + 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means and their derivatives against a fine sum and differences.
    #[test]
    fn means_are_those_of_the_straight_path() {
        for effect in Effect::ALL.into_iter().filter(|e| !e.has_memory()) {
            for (a, b) in [(0.3, 0.9), (-0.7, 0.4), (1.2, -1.5), (-0.1, 0.05), (0.8, 0.81)] {
                let inner = [0.25, 0.0];
                let (mean, slopes) = effect.mean(a, b, inner);
                let n = 20_000;
                let at = |k: usize| a + (b - a) * (k as f64 + 0.5) / n as f64;
                // Smoothed friction is the derivative of √(v² + ε²), which `at` has too.
                let sum: f64 = (0..n).map(|k| effect.at(at(k), inner)).sum::<f64>() / n as f64;
                assert!((mean - sum).abs() < 1e-5, "{effect:?} {a} {b}: {mean} {sum}");
                let h = 1e-6;
                let by = |da: f64, db: f64| (effect.mean(a + da, b + db, inner).0 - mean) / h;
                assert!((slopes[0] - by(h, 0.0)).abs() < 1e-4, "{effect:?} {a} {b}");
                assert!((slopes[1] - by(0.0, h)).abs() < 1e-4, "{effect:?} {a} {b}");
                let wider = (effect.mean(a, b, [inner[0] + h, 0.0]).0 - mean) / h;
                assert!((slopes[2] - wider).abs() < 1e-4, "{effect:?} {a} {b}");
            }
        }
    }
}
