//! The restoring force over deflection and velocity, and its slices through zero.
//!
//! The force-state map of Masri and Caughey (J. Appl. Mech. 46 (1979) 433–447): what of the acceleration the inputs and the
//! rest of the structure do not explain is a surface over the state plane if the element has no memory.

use super::element::{Element, ElementSamples};
use super::{CellMeans, MOST_POINTS, abscissae};

/// Share of the largest velocity (or deflection) within which a sample belongs to a slice.
const SLICE: f64 = 0.12;

/// Cells of the map along either axis.
const CELLS: usize = 36;

/// A restoring force per unit mass as measured, with the found equation's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestoringForce {
    /// Mean measured force over deflection and velocity.
    pub map: CellMeans,
    /// Stiffness and damping of the plane through the measured force, per unit mass: k/m and c/m.
    pub linear: [f64; 2],
    /// Mean of what the plane leaves: what is not linear.
    pub curved: CellMeans,
    /// Over the deflection, at velocities near zero: the stiffness.
    pub stiffness: Slice,
    /// Over the velocity, at deflections near zero: damping and friction.
    pub damping: Slice,
}

/// A slice through a restoring force.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slice {
    /// Abscissae of the measured points.
    pub at: Vec<f64>,
    /// Measured force at each, moved along the equation's surface onto the slice: what the equation does not say stays in it.
    pub force: Vec<f64>,
    /// Samples within the slice; the points are some of them.
    pub samples: usize,
    /// How far from zero the other quantity was.
    pub within: f64,
    /// The found equation's force.
    pub curve: Vec<[f64; 2]>,
}

impl RestoringForce {
    /// The force of an element along stretches of motion; none if they hold no motion.
    pub fn new(element: &Element, stretches: &[ElementSamples]) -> Option<Self> {
        let largest = |pick: fn(&ElementSamples) -> &Vec<f64>| {
            stretches.iter().flat_map(&pick).filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()))
        };
        let most = [largest(|s| &s.deflection), largest(|s| &s.velocity)];
        if !(most[0] > 0.0 && most[1] > 0.0) {
            return None;
        }
        let forces: Vec<Vec<f64>> = stretches
            .iter()
            .map(|s| {
                let state = s.deflection.iter().zip(&s.velocity);
                state.zip(&s.residual).map(|((x, v), e)| element.force(*x, *v) - e).collect()
            })
            .collect();
        let series = stretches.iter().zip(&forces);
        let map = CellMeans::new(series.map(|(s, f)| (&s.deflection[..], &s.velocity[..], &f[..])), most, CELLS);
        let linear = plane(stretches, &forces);
        let rests: Vec<Vec<f64>> = stretches
            .iter()
            .zip(&forces)
            .map(|(s, f)| {
                let state = s.deflection.iter().zip(&s.velocity);
                state.zip(f).map(|((x, v), f)| f - linear[0] * x - linear[1] * v).collect()
            })
            .collect();
        let series = stretches.iter().zip(&rests);
        let curved = CellMeans::new(series.map(|(s, f)| (&s.deflection[..], &s.velocity[..], &f[..])), most, CELLS);
        let stiffness = slice(stretches, |s| (&s.deflection, &s.velocity), most, |x| element.force(x, 0.0));
        let damping = slice(stretches, |s| (&s.velocity, &s.deflection), [most[1], most[0]], |v| element.force(0.0, v));
        Some(Self { map, linear, curved, stiffness, damping })
    }
}

/// Stiffness and damping of the plane through zero that lies nearest to a force; zero where the motion does not tell them.
fn plane(stretches: &[ElementSamples], forces: &[Vec<f64>]) -> [f64; 2] {
    let (mut xx, mut xv, mut vv, mut xf, mut vf) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (s, forces) in stretches.iter().zip(forces) {
        let state = s.deflection.iter().zip(&s.velocity);
        for ((x, v), f) in state.zip(forces).filter(|(_, f)| f.is_finite()) {
            xx += x * x;
            xv += x * v;
            vv += v * v;
            xf += x * f;
            vf += v * f;
        }
    }
    let determinant = xx * vv - xv * xv;
    if determinant <= 1e-12 * xx * vv {
        return [0.0, 0.0];
    }
    [(xf * vv - vf * xv) / determinant, (vf * xx - xf * xv) / determinant]
}

/// Samples near zero of the second of two quantities, over the first.
fn slice(
    stretches: &[ElementSamples],
    pick: fn(&ElementSamples) -> (&Vec<f64>, &Vec<f64>),
    most: [f64; 2],
    force: impl Fn(f64) -> f64,
) -> Slice {
    let within = SLICE * most[1];
    let inside = |s: &ElementSamples| {
        let (along, aside) = pick(s);
        let near = along.iter().zip(aside).zip(&s.residual).filter(|((_, b), _)| b.abs() <= within);
        near.map(|((a, _), e)| [*a, force(*a) - e]).collect::<Vec<_>>()
    };
    let points: Vec<[f64; 2]> = stretches.iter().flat_map(inside).collect();
    let step = points.len().div_ceil(MOST_POINTS).max(1);
    Slice {
        at: points.iter().step_by(step).map(|p| p[0]).collect(),
        force: points.iter().step_by(step).map(|p| p[1]).collect(),
        samples: points.len(),
        within,
        curve: abscissae(most[0]).map(|a| [a, force(a)]).collect(),
    }
}
