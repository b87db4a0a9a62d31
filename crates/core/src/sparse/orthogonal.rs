//! Columns and target without what lies in the columns that stay.

use nalgebra::DVector;

use super::stlsq::{fitted, fixed};
use super::{Constraint, OrthonormalBasis, Reduced};

/// A column of which less than this share of its power lies outside others depends on them; what is left is rounding.
pub(super) const DEPENDENT_POWER: f64 = 1e-20;

/// What of the free columns and of the target lies outside the columns that stay in any case.
pub(super) struct Remainder {
    /// Scaled free columns, as rows of the triangle.
    pub(super) columns: Vec<DVector<f64>>,
    /// The scaled target.
    pub(super) target: DVector<f64>,
    /// The index of each free column.
    pub(super) free: Vec<usize>,
    /// The columns that stay.
    pub(super) locked: Vec<usize>,
}

impl Remainder {
    pub(super) fn new(reduced: &Reduced, constraints: &[Constraint]) -> Self {
        let (free, locked): (Vec<usize>, Vec<usize>) =
            fitted(reduced, constraints).into_iter().partition(|k| constraints[*k] == Constraint::Free);
        let mut target = reduced.target(&fixed(constraints));
        let mut columns: Vec<DVector<f64>> = free.iter().map(|k| reduced.column(*k)).collect();
        let mut basis = OrthonormalBasis::with_least_share(DEPENDENT_POWER.sqrt());
        for k in &locked {
            basis.push(reduced.column(*k).as_slice().to_vec());
        }
        for column in columns.iter_mut().chain([&mut target]) {
            basis.remove(column.as_mut_slice());
        }
        Self { columns, target, free, locked }
    }
}
