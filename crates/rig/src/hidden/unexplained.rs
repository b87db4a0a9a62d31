//! How much of a motion the plant that the search is told of cannot follow.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use super::assembly::Assembly;
use super::calibrate::shift;
use super::contribution::SensorFault;
use super::host_plant::{DriveKind, HostPlant, Magnitude};
use crate::motion::PlantMotion;

/// The least damping of the plant that a residual force is given to: what is driven at an undamped resonance grows for ever.
const LEAST_DAMPING: f64 = 4e-3;

/// RMS over the motions of the displacement that the known terms cannot follow with any coefficients and initial states: to
/// first order about the coefficients that explain most of the acceleration.
pub(super) fn beyond_base(assembly: &Assembly, host_plant: &HostPlant, motions: &[PlantMotion]) -> f64 {
    if assembly.parts.iter().any(|p| p.seen != SensorFault::True) {
        let errors = motions.iter().enumerate().flat_map(|(k, motion)| {
            let missing = assembly.missing(motion, shift(k));
            (0..motion.times.len()).map(move |i| missing.iter().map(|m| m[i]).sum::<f64>()).collect::<Vec<_>>()
        });
        return Magnitude::over(errors).rms;
    }
    let columns: Vec<Vec<Vec<f64>>> = motions.iter().map(|m| regressors(assembly, host_plant, m)).collect();
    let missing: Vec<Vec<f64>> = motions
        .iter()
        .enumerate()
        .map(|(k, motion)| {
            let parts = assembly.missing(motion, shift(k));
            (0..motion.times.len()).map(|i| parts.iter().map(|m| m[i]).sum()).collect()
        })
        .collect();
    let stacked = |pick: &dyn Fn(usize) -> Vec<f64>| -> Vec<f64> { (0..motions.len()).flat_map(pick).collect() };
    let count = columns.first().map_or(0, Vec::len);
    let forces: Vec<Vec<f64>> = (0..count).map(|j| stacked(&|r| columns[r][j].clone())).collect();
    let Some((_, explained)) = project(&forces, &stacked(&|r| missing[r].clone())) else { return f64::INFINITY };
    // Regressors begin with the deflection, where there is a spring, and the damper's velocity.
    let (stiffness, damping) = if host_plant.sprung {
        (1.0 - explained[0], host_plant.damping - explained[1])
    } else {
        (0.0, host_plant.damping - explained[0])
    };
    let plant = |force: &[f64], step: f64, begin: [f64; 2]| {
        respond(force, step, begin, stiffness.max(0.0), damping.max(LEAST_DAMPING))
    };
    let step = |r: usize| motions[r].times[1] - motions[r].times[0];
    let mut responses: Vec<Vec<f64>> =
        (0..count).map(|j| stacked(&|r| plant(&columns[r][j], step(r), [0.0; 2]))).collect();
    for own in 0..motions.len() {
        for begin in [[1.0, 0.0], [0.0, 1.0]] {
            responses.push(stacked(&|r| {
                let still = vec![0.0; motions[r].times.len()];
                if r == own { plant(&still, step(r), begin) } else { still }
            }));
        }
    }
    let target = stacked(&|r| plant(&missing[r], step(r), [0.0; 2]));
    project(&responses, &target).map_or(f64::INFINITY, |(left, _)| left)
}

/// What the known terms are made of, along a motion.
fn regressors(assembly: &Assembly, host_plant: &HostPlant, motion: &PlantMotion) -> Vec<Vec<f64>> {
    let [_, v, r, w, u] = assembly.series(motion);
    let mut columns = Vec::new();
    if host_plant.sprung {
        columns.push(r.clone());
    }
    columns.push(if host_plant.grounded_damper { v } else { w });
    if host_plant.cubic > 0.0 {
        columns.push(r.iter().map(|r| r.powi(3)).collect());
    }
    if host_plant.datum.is_some() {
        columns.push(vec![1.0; r.len()]);
    }
    if host_plant.drive == DriveKind::Force {
        columns.push(u);
    }
    columns
}

/// RMS of what columns leave of a target, and their coefficients.
fn project(columns: &[Vec<f64>], target: &[f64]) -> Option<(f64, Vec<f64>)> {
    let sizes: Vec<f64> =
        columns.iter().map(|c| Magnitude::over(c.iter().copied()).rms.max(f64::MIN_POSITIVE)).collect();
    let matrix = DMatrix::from_fn(target.len(), columns.len(), |i, j| columns[j][i] / sizes[j]);
    let right = DVector::from_column_slice(target);
    let normal = matrix.transpose() * &matrix + DMatrix::identity(columns.len(), columns.len()) * 1e-9;
    let solved = normal.cholesky()?.solve(&(matrix.transpose() * &right));
    let left = right - &matrix * &solved;
    let rms = Magnitude::over(left.iter().copied()).rms;
    rms.is_finite().then(|| (rms, solved.iter().zip(&sizes).map(|(c, size)| c / size).collect()))
}

/// Displacement of ÿ + c ẏ + k y = f, the force going straight from one sample to the next.
fn respond(force: &[f64], step: f64, [mut y, mut rate]: [f64; 2], stiffness: f64, damping: f64) -> Vec<f64> {
    // The force and its slope as two more states: one matrix exponential is the whole of a step.
    let system = Matrix4::new(
        0.0, 1.0, 0.0, 0.0, //
        -stiffness, -damping, 1.0, 0.0, //
        0.0, 0.0, 0.0, 1.0, //
        0.0, 0.0, 0.0, 0.0,
    );
    let advance = (system * step).exp();
    let mut displacement = Vec::with_capacity(force.len());
    for (k, f) in force.iter().enumerate() {
        displacement.push(y);
        let next = force.get(k + 1).unwrap_or(f);
        let state = advance * Vector4::new(y, rate, *f, (next - f) / step);
        (y, rate) = (state[0], state[1]);
    }
    displacement
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_residual_force_is_answered_as_the_oscillator_would() {
        // ÿ + y = t from rest: y = t − sin t, exactly linear between samples.
        let step = 0.1;
        let force: Vec<f64> = (0..200).map(|k| step * f64::from(k)).collect();
        let answer = respond(&force, step, [0.0, 0.0], 1.0, 0.0);
        assert!(force.iter().zip(&answer).all(|(t, y)| (y - (t - t.sin())).abs() < 1e-9));
    }

    #[test]
    fn what_columns_explain_is_not_left() {
        let columns = [vec![1.0, 1.0, 1.0, 1.0], vec![0.0, 1.0, 2.0, 3.0]];
        let (left, coefficients) = project(&columns, &[1.0, 3.0, 5.0, 7.0]).unwrap();
        assert!(left < 1e-6 && (coefficients[0] - 1.0).abs() < 1e-6 && (coefficients[1] - 2.0).abs() < 1e-6);
        // Orthogonal to both, RMS one.
        assert!((project(&columns, &[1.0, -1.0, -1.0, 1.0]).unwrap().0 - 1.0).abs() < 1e-6);
    }
}
