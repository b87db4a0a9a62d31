//! What inputs make of the modes along a segment, and the constants of a mode for one step.

use nalgebra::Complex;

use super::super::limits::DIFFERENCES;
use super::super::measurement::SensorSeries;
use super::super::pole::{self, Pole};
use super::{ClosedModel, Segment};

/// What all segments of a record share while poles and drives stay: computed once for a simulation.
pub(super) struct Propagation {
    pub(super) steps: Vec<DriveStep>,
    /// Of each mode as it is, then faster and then more damped by [`DIFFERENCES`]; these where derivatives are asked for.
    filters: Vec<Vec<DriveFilter>>,
    /// `padded[input]`
    padded: Vec<Vec<f64>>,
    parts: usize,
}

/// How an input drives a state over each part of a sampling interval.
struct DriveFilter {
    decay: Complex<f64>,
    weights: Vec<[Complex<f64>; pole::POINTS]>,
}

impl Propagation {
    pub(super) fn new(poles: &[Pole], series: &SensorSeries, parts: usize, with_derivatives: bool) -> Self {
        let step = series.interval / parts as f64;
        let filter = |pole: Pole| DriveFilter {
            decay: (pole.eigenvalue() * step).exp(),
            weights: pole::input_weights(pole.eigenvalue(), series.interval, parts),
        };
        let of = |pole: &Pole| {
            let mut all = vec![filter(*pole)];
            if with_derivatives {
                all.push(filter(pole.scaled(1.0 + DIFFERENCES[0], 1.0)));
                all.push(filter(pole.scaled(1.0, 1.0 + DIFFERENCES[1])));
            }
            all
        };
        Self {
            steps: poles.iter().map(|p| DriveStep::new(*p, step)).collect(),
            filters: poles.iter().map(of).collect(),
            padded: series.inputs.iter().map(|u| pole::padded(u)).collect(),
            parts,
        }
    }
}

/// Responses of the modes to the inputs along one segment, from rest, on the fine grid.
pub(super) struct Driven {
    pub(super) instants: usize,
    /// With the drives as they are, `[instant][mode]`.
    pub(super) linear: Vec<Complex<f64>>,
    /// To a unit of each input, `[instant][mode][input]`; empty where no derivatives are asked for.
    pub(super) by_drive: Vec<Complex<f64>>,
    /// What the logarithms of frequency and damping change of `linear`, `[instant][mode][which]`; empty likewise.
    pub(super) by_pole: Vec<[Complex<f64>; 2]>,
}

impl Driven {
    pub(super) fn new(model: &ClosedModel, along: &Propagation, segment: Segment, with_derivatives: bool) -> Self {
        let instants = (segment.length - 1) * along.parts + 1;
        let (m, inputs) = (model.modes(), model.inputs());
        let zero = Complex::new(0.0, 0.0);
        let mut linear = vec![zero; instants * m];
        let mut by_drive = vec![zero; if with_derivatives { instants * m * inputs } else { 0 }];
        let mut by_pole = vec![[zero; 2]; if with_derivatives { instants * m } else { 0 }];
        for (i, filters) in along.filters.iter().enumerate() {
            for (j, padded) in along.padded.iter().enumerate() {
                let (drive, input) = (model.drive[i][j], &padded[segment.start..]);
                if let (true, [own, frequency, damping]) = (with_derivatives, filters.as_slice()) {
                    each([own, frequency, damping], input, instants, |t, [state, by_frequency, by_damping]| {
                        linear[t * m + i] += state * drive;
                        by_drive[(t * m + i) * inputs + j] = *state;
                        by_pole[t * m + i][0] += (by_frequency - state) * (drive / DIFFERENCES[0]);
                        by_pole[t * m + i][1] += (by_damping - state) * (drive / DIFFERENCES[1]);
                    });
                } else {
                    each([&filters[0]], input, instants, |t, [state]| linear[t * m + i] += state * drive);
                }
            }
        }
        Self { instants, linear, by_drive, by_pole }
    }
}

/// Tells the states of several filters at each instant along a padded input, side by side: one recursion alone waits for its last
/// sum.
fn each<const N: usize>(
    filters: [&DriveFilter; N],
    padded: &[f64],
    instants: usize,
    mut tell: impl FnMut(usize, &[Complex<f64>; N]),
) {
    let mut states = [Complex::new(0.0, 0.0); N];
    tell(0, &states);
    let parts = filters[0].weights.len();
    let (mut n, mut part) = (0, 0);
    for t in 1..instants {
        for (state, filter) in states.iter_mut().zip(filters) {
            *state = filter.decay * *state + pole::driven(&filter.weights[part], padded, n);
        }
        part += 1;
        if part == parts {
            (n, part) = (n + 1, 0);
        }
        tell(t, &states);
    }
}

/// What a mode has of constants for a step.
#[derive(Clone, Copy)]
pub(super) struct DriveStep {
    pub(super) decay: Complex<f64>,
    /// What a constant force of one adds to the state in a step.
    pub(super) weight: Complex<f64>,
    /// The eigenvalue's derivatives by the logarithms of frequency and damping, and those of decay and weight.
    pub(super) lambda_by: [Complex<f64>; 2],
    pub(super) decay_by: [Complex<f64>; 2],
    pub(super) weight_by: [Complex<f64>; 2],
    /// `λᵖ/β` for displacement, velocity and acceleration: a state Z shows `Im(λᵖ Z)/β`, β the imaginary part of λ.
    pub(super) shows: [Complex<f64>; 3],
    /// Its derivatives, `[which][order]`.
    pub(super) shows_by: [[Complex<f64>; 3]; 2],
}

impl DriveStep {
    pub(super) fn new(pole: Pole, step: f64) -> Self {
        let lambda = pole.eigenvalue();
        let beat = lambda.im;
        let root = lambda.im / pole.omega;
        let by_damping = Complex::new(-pole.damping, -pole.damping * pole.damping / root) * pole.omega;
        let lambda_by = [lambda, by_damping];
        let decay = (lambda * step).exp();
        let weight = (decay - 1.0) / lambda;
        let of_weight = (decay * step - weight) / lambda;
        let shows = [0, 1, 2].map(|order| lambda.powi(order) / beat);
        let shows_by = lambda_by.map(|by| {
            [0, 1, 2].map(|order| {
                let through = if order == 0 {
                    Complex::new(0.0, 0.0)
                } else {
                    lambda.powi(order - 1) * by * (f64::from(order) / beat)
                };
                through - lambda.powi(order) * (by.im / (beat * beat))
            })
        });
        Self {
            decay,
            weight,
            lambda_by,
            decay_by: lambda_by.map(|by| decay * by * step),
            weight_by: lambda_by.map(|by| of_weight * by),
            shows,
            shows_by,
        }
    }
}

/// The imaginary part of a product.
pub(super) fn imaginary(a: Complex<f64>, b: Complex<f64>) -> f64 {
    a.re * b.im + a.im * b.re
}
