//! A joint that slips: Bouc and Wen's inner state along a straight path, in closed form.
//!
//! The equation is the catalogue's, `ż = w − (|w| z + r w |z|)/d` with `d = x_b` and `r = γ/β`
//! ([`sindyscope_search::hysteresis_rate`]). It knows no time: over the distance ξ that the motion has gone one way, the stretch
//! `y` against that way follows `dy/dξ = 1 − (y + r |y|)/d`, which is linear on either side of zero.
//!
//! Source: Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249.

use super::force::{Pass, PassSlopes};

/// Relative step of the derivatives by what is inside the force.
const DIFFERENCE: f64 = 1e-6;
/// `κ ξ` below which an exponential counts as its series.
const STRAIGHT: f64 = 1e-3;
/// Share of `d` below which a path has no length.
const SHORTEST: f64 = 1e-10;

/// The joint with the displacement `d` at which it yields and the ratio `r` of its loops' shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hysteresis {
    pub(crate) length: f64,
    pub(crate) ratio: f64,
}

/// The stretch at the end of a path, and its integral along it.
#[derive(Clone, Copy)]
struct Gone {
    end: f64,
    integral: f64,
}

impl Hysteresis {
    pub(crate) fn new([length, ratio]: [f64; 2]) -> Self {
        Self { length, ratio }
    }

    /// Rate of the stretch by the distance.
    fn rate(self, y: f64) -> f64 {
        1.0 - (y + self.ratio * y.abs()) / self.length
    }

    /// On a branch where `dy/dξ = 1 − κ y`.
    fn branch(kappa: f64, y: f64, distance: f64) -> Gone {
        let reach = kappa * distance;
        // φ = ∫ e^{−κξ} dξ and ψ = ∫ φ dξ.
        let (phi, psi) = if reach.abs() < STRAIGHT {
            let first = 1.0 - reach / 2.0 * (1.0 - reach / 3.0 * (1.0 - reach / 4.0));
            let second = 0.5 * (1.0 - reach / 3.0 * (1.0 - reach / 4.0 * (1.0 - reach / 5.0)));
            (first * distance, second * distance * distance)
        } else {
            let phi = -(-reach).exp_m1() / kappa;
            (phi, (distance - phi) / kappa)
        };
        Gone { end: y + (1.0 - kappa * y) * phi, integral: y * phi + psi }
    }

    /// From a stretch, over a distance.
    fn gone(self, y: f64, distance: f64) -> Gone {
        let [against, along] = [1.0 - self.ratio, 1.0 + self.ratio].map(|r| r / self.length);
        if y >= 0.0 {
            return Self::branch(along, y, distance);
        }
        // Where the stretch comes to zero; below its fixed point it never does.
        let whole = -against * y;
        let zero = if whole.abs() < STRAIGHT {
            -y * (1.0 - whole / 2.0 * (1.0 - 2.0 * whole / 3.0 * (1.0 - 0.75 * whole)))
        } else if whole > -1.0 {
            whole.ln_1p() / against
        } else {
            f64::INFINITY
        };
        if distance <= zero {
            return Self::branch(against, y, distance);
        }
        let (first, second) = (Self::branch(against, y, zero), Self::branch(along, 0.0, distance - zero));
        Gone { end: second.end, integral: first.integral + second.integral }
    }

    /// The inner state's mean and end over a motion from `before` to `after`.
    fn mean_and_end(self, before: f64, after: f64, memory: f64) -> (f64, f64) {
        let way = if after < before { -1.0 } else { 1.0 };
        let distance = (after - before).abs();
        if distance <= SHORTEST * self.length {
            return (memory, memory + (after - before) * self.rate(way * memory));
        }
        let gone = self.gone(way * memory, distance);
        (way * gone.integral / distance, way * gone.end)
    }

    /// The inner state's mean over a motion, and its slope by the motion's end.
    pub(crate) fn mean_and_slope(self, before: f64, after: f64, memory: f64) -> (f64, f64) {
        let (mean, end) = self.mean_and_end(before, after, memory);
        (mean, self.slope(before, after, memory, (mean, end)))
    }

    fn slope(self, before: f64, after: f64, memory: f64, (mean, end): (f64, f64)) -> f64 {
        if (after - before).abs() <= 1e3 * SHORTEST * self.length {
            let way = if after < before { -1.0 } else { 1.0 };
            return 0.5 * self.rate(way * memory);
        }
        (end - mean) / (after - before)
    }

    /// The inner state over a motion, with all derivatives.
    pub(crate) fn pass(self, before: f64, after: f64, memory: f64) -> Pass {
        let way = if after < before { -1.0 } else { 1.0 };
        let (mean, end) = self.mean_and_end(before, after, memory);
        let slope = self.slope(before, after, memory, (mean, end));
        // The equation has no other variable than y: dy = rate · dξ, so ∂y/∂y₀ is the ratio of the rates, and its mean that of
        // their integral.
        let (first, last) = (self.rate(way * memory), self.rate(way * end));
        let distance = (after - before).abs();
        let straight = distance <= 1e3 * SHORTEST * self.length || first.abs() < DIFFERENCE;
        let (mean_by_memory, end_by_memory) = if straight {
            // It stays, or yields already.
            let kappa = (1.0 + self.ratio) / self.length;
            let lasting = Self::branch(kappa, 0.0, distance).end;
            (if distance > 0.0 { lasting / distance } else { 1.0 }, 1.0 - kappa * lasting)
        } else {
            (way * (end - memory) / (first * distance), last / first)
        };
        let moved = |length: f64, ratio: f64| {
            let (m, e) = Self { length, ratio }.mean_and_end(before, after, memory);
            (m - mean, e - end)
        };
        let step = DIFFERENCE * self.length;
        let by_length = moved(self.length + step, self.ratio);
        let by_ratio = moved(self.length, self.ratio + DIFFERENCE);
        let inner = |l: f64, r: f64| [l / step, r / DIFFERENCE];
        Pass {
            mean,
            mean_by: PassSlopes {
                // The mean of a path that is shifted is that of the path that is not; so is its end.
                before: -slope,
                after: slope,
                inner: inner(by_length.0, by_ratio.0),
                memory: mean_by_memory,
            },
            end,
            end_by: PassSlopes {
                before: -last,
                after: last,
                inner: inner(by_length.1, by_ratio.1),
                memory: end_by_memory,
            },
        }
    }

    /// The inner state along a motion that is known at instants, from zero.
    pub(crate) fn along(self, motion: &[f64]) -> Vec<f64> {
        let mut state = 0.0;
        let mut all = Vec::with_capacity(motion.len());
        for (k, x) in motion.iter().enumerate() {
            if k > 0 {
                state = self.mean_and_end(motion[k - 1], *x, state).1;
            }
            all.push(state);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (before, after, inner state before): loading, unloading through zero, a path along which the state stays below zero.
    const PATHS: [(f64, f64, f64); 5] =
        [(0.1, 0.5, 0.05), (0.5, -0.4, 0.2), (-0.3, 0.6, -0.24), (0.2, 0.21, -0.2), (0.0, -1e-5, 0.1)];
    const SHAPES: [[f64; 2]; 4] = [[0.5, 1.0], [0.4, 0.1], [0.6, -0.6], [0.3, 3.0]];

    /// Against the catalogue's equation in very small steps.
    #[test]
    fn paths_are_those_of_the_catalogues_equation() {
        for inner in SHAPES {
            let joint = Hysteresis::new(inner);
            for (before, after, memory) in PATHS {
                let (mean, end) = joint.mean_and_end(before, after, memory);
                let n = 20_000;
                let h = (after - before) / f64::from(n);
                let rate = |z: f64| catalogue_rate(h.signum(), z, inner) * h.signum();
                let (mut z, mut sum) = (memory, 0.0);
                for _ in 0..n {
                    let middle = z + 0.5 * h * rate(z);
                    sum += middle;
                    z += h * rate(middle);
                }
                assert!((z - end).abs() < 1e-6 * (1.0 + end.abs()), "{inner:?} {before} {after} {memory}: {end} {z}");
                assert!(
                    (sum / f64::from(n) - mean).abs() < 1e-6 * (1.0 + mean.abs()),
                    "{inner:?} {before} {after} {memory}: {mean}"
                );
            }
        }
    }

    fn catalogue_rate(w: f64, z: f64, inner: [f64; 2]) -> f64 {
        use sindyscope_values::term::{Expression, Symbol};
        let (speed, state) = (Expression::from(Symbol::Rate(0)), Expression::from(Symbol::Internal(0)));
        let terms = sindyscope_search::hysteresis_rate(&speed, &state, inner, 1);
        let value = |symbol: Symbol| if symbol == Symbol::Rate(0) { w } else { z };
        terms.iter().map(|(term, weight)| weight * term.expression().value(&value)).sum()
    }

    #[test]
    fn derivatives_are_those_of_the_path() {
        for inner in SHAPES {
            for (before, after, memory) in PATHS {
                let of = |da: f64, db: f64, dz: f64, inner: [f64; 2]| {
                    Hysteresis::new(inner).mean_and_end(before + da, after + db, memory + dz)
                };
                let pass = Hysteresis::new(inner).pass(before, after, memory);
                let h = 1e-7;
                let [d, r] = inner;
                let check = |(m, e): (f64, f64), mean_by: f64, end_by: f64, what: &str| {
                    let near = |numeric: f64, by: f64| (numeric - by).abs() < 1e-3 * (1.0 + by.abs());
                    assert!(near((m - pass.mean) / h, mean_by), "{inner:?} {before} {after} {memory}: mean by {what}");
                    assert!(near((e - pass.end) / h, end_by), "{inner:?} {before} {after} {memory}: end by {what}");
                };
                check(of(h, 0.0, 0.0, inner), pass.mean_by.before, pass.end_by.before, "before");
                check(of(0.0, h, 0.0, inner), pass.mean_by.after, pass.end_by.after, "after");
                check(of(0.0, 0.0, h, inner), pass.mean_by.memory, pass.end_by.memory, "memory");
                check(of(0.0, 0.0, 0.0, [d + h, r]), pass.mean_by.inner[0], pass.end_by.inner[0], "length");
                check(of(0.0, 0.0, 0.0, [d, r + h]), pass.mean_by.inner[1], pass.end_by.inner[1], "ratio");
            }
        }
    }
}
