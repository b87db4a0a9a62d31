//! Sparse relaxed regularized regression.

use nalgebra::{DMatrix, DVector};

use super::stlsq::{fitted, fixed};
use super::{Constraint, Reduced, Solution, SparseOptions};

/// What sparsity costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Penalty {
    /// The number of coefficients (L0).
    Count,
    /// The sum of their magnitudes (L1).
    Magnitude,
}

/// Relaxation ν: how far the sparse coefficients may be from those that fit; the value of the package PySINDy.
pub(super) const RELAXATION: f64 = 1.0;
/// Iterations, at most; the last one stands.
const MAX_ITERATIONS: usize = 500;
/// Change of the coefficients, as a share of their norm, at which the iteration ends.
const CONVERGED_CHANGE: f64 = 1e-8;

/// Sparse relaxed regularized regression (Zheng, Askham, Brunton, Kutz & Aravkin 2019): coefficients `b` that fit and a
/// sparse copy `u` near them, `min ½‖y − Xb‖² + λR(u) + ‖b − u‖²/2ν`, in turns from plain least squares; the columns of
/// `u` that are not zero are refitted.
///
/// λ comes from the threshold τ, so that of orthogonal columns those stay whose coefficient exceeds it: λ = τ²/2ν for the
/// count; for the magnitudes λ = τ/(1 + ν) on scaled columns and λ = τ/ν on raw ones, whose own power dwarfs 1/ν.
pub(super) fn sr3(
    reduced: &Reduced,
    constraints: &[Constraint],
    options: &SparseOptions,
    penalty: Penalty,
) -> Solution {
    let keep = fitted(reduced, constraints);
    let height = reduced.columns() + 1;
    let p = keep.len();
    if p == 0 {
        return Solution::on(reduced, constraints, keep);
    }
    let relaxation = SparseOptions { ridge: RELAXATION.recip(), ..*options };
    let mut a = DMatrix::zeros(height + 2 * p, p);
    let mut sides = DMatrix::zeros(height + 2 * p, p + 1);
    sides.view_mut((0, 0), (height, 1)).copy_from(&reduced.target(&fixed(constraints)));
    for (j, k) in keep.iter().enumerate() {
        a.view_mut((0, j), (height, 1)).copy_from(&reduced.column(*k));
        a[(height + j, j)] = options.ridge_weight(reduced, *k).sqrt();
        let weight = relaxation.ridge_weight(reduced, *k).sqrt();
        a[(height + p + j, j)] = weight;
        sides[(height + p + j, j + 1)] = weight;
    }
    let qr = a.qr();
    let Some(answers) = qr.r().solve_upper_triangular(&(qr.q().transpose() * sides)) else {
        return Solution::on(reduced, constraints, keep);
    };
    let (own, of_sparse) = (answers.column(0), answers.columns(1, p));
    let shift: Vec<f64> = keep
        .iter()
        .map(|k| match (options.scaled, penalty) {
            (true, Penalty::Count) => options.threshold,
            (true, Penalty::Magnitude) => options.threshold * RELAXATION / (1.0 + RELAXATION),
            (false, _) => options.threshold * reduced.scale()[*k] / reduced.target_scale(),
        })
        .collect();
    let (start, _) = reduced.solve(&keep, &fixed(constraints), |k| options.ridge_weight(reduced, k));
    let mut sparse = DVector::from_vec(start);
    let mut next = DVector::zeros(p);
    for _ in 0..MAX_ITERATIONS {
        next.copy_from(&own);
        next.gemv(1.0, &of_sparse, &sparse, 1.0);
        for ((b, shift), k) in next.iter_mut().zip(&shift).zip(&keep) {
            *b = match (constraints[*k], penalty) {
                (Constraint::In, _) => *b,
                (_, Penalty::Count) if b.abs() >= *shift => *b,
                (_, Penalty::Count) => 0.0,
                (_, Penalty::Magnitude) => b.signum() * (b.abs() - shift).max(0.0),
            };
        }
        let change = (&next - &sparse).norm();
        std::mem::swap(&mut next, &mut sparse);
        if change <= CONVERGED_CHANGE * sparse.norm() {
            break;
        }
    }
    let stays = |(k, b): (&usize, &f64)| (*b != 0.0 || constraints[*k] == Constraint::In).then_some(*k);
    Solution::on(reduced, constraints, keep.iter().zip(&sparse).filter_map(stays).collect())
}
