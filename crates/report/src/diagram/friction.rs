//! Damping and friction over the velocity: what is left when everything else that the equation knows is taken away.

use super::element::{Element, ElementSamples};
use super::{BinnedMeans, MOST_POINTS, abscissae};

/// Intervals of velocity.
const INTERVALS: usize = 41;

/// The force per unit mass that follows the velocity, measured and found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrictionForce {
    /// Velocities of the measured points.
    pub at: Vec<f64>,
    /// Measured force at each.
    pub force: Vec<f64>,
    /// Means of all measured samples, with standard errors.
    pub mean: BinnedMeans,
    /// The found equation's damping and friction.
    pub curve: Vec<[f64; 2]>,
}

impl FrictionForce {
    /// The friction of an element along stretches of motion; none if nothing moves.
    pub fn new(element: &Element, stretches: &[ElementSamples]) -> Option<Self> {
        let speeds = stretches.iter().flat_map(|s| &s.velocity).filter(|v| v.is_finite());
        let most = speeds.fold(0.0_f64, |m, v| m.max(v.abs()));
        if most <= 0.0 {
            return None;
        }
        let forces: Vec<Vec<f64>> = stretches
            .iter()
            .map(|s| s.velocity.iter().zip(&s.residual).map(|(v, e)| element.friction(*v) - e).collect())
            .collect();
        let series = || stretches.iter().zip(&forces).map(|(s, f)| (&s.velocity[..], &f[..]));
        let count: usize = forces.iter().map(Vec::len).sum();
        let step = count.div_ceil(MOST_POINTS).max(1);
        let points = series().flat_map(|(v, f)| v.iter().zip(f)).step_by(step);
        let (at, force) = points.map(|(v, f)| (*v, *f)).unzip();
        Some(Self {
            at,
            force,
            mean: BinnedMeans::new(series(), most, INTERVALS),
            curve: abscissae(most).map(|v| [v, element.friction(v)]).collect(),
        })
    }
}
