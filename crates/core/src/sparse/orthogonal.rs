//! Columns and target without what lies in the columns that stay.

use nalgebra::DVector;

use super::stlsq::{fitted, fixed};
use super::{Constraint, Reduced};

/// Share of a column's power below which what is left of it beside others is rounding: it depends on them.
pub(super) const DEPENDENT: f64 = 1e-20;

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
        let mut basis: Vec<DVector<f64>> = Vec::new();
        for k in &locked {
            let mut direction = reduced.column(*k);
            let whole = direction.norm();
            for q in basis.iter().chain(&basis) {
                direction.axpy(-q.dot(&direction), q, 1.0);
            }
            let norm = direction.norm();
            if norm * norm > DEPENDENT * whole * whole {
                basis.push(direction / norm);
            }
        }
        for v in columns.iter_mut().chain([&mut target]) {
            for q in &basis {
                v.axpy(-q.dot(v), q, 1.0);
            }
        }
        Self { columns, target, free, locked }
    }
}
