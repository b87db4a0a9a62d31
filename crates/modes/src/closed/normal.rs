//! The normal equations of a model that is fitted over segments: what all share, and each one's initial state.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::super::limits::LOOP_RIDGE;

/// Sums of the normal equations: what segments share, and each one's initial state.
pub(super) struct Normal {
    /// Empty where the initial states alone are free.
    pub(super) shared: NormalBlock,
    pub(super) locals: Vec<Local>,
}

pub(super) struct NormalBlock {
    pub(super) matrix: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
}

pub(super) struct Local {
    pub(super) own: NormalBlock,
    /// Shared parameters by initial states.
    pub(super) cross: DMatrix<f64>,
    /// Initial states by those of the next segment, where it is held to this one.
    pub(super) next: Option<DMatrix<f64>>,
}

impl NormalBlock {
    pub(super) fn zeros(size: usize) -> Self {
        Self { matrix: DMatrix::zeros(size, size), gradient: DVector::zeros(size) }
    }

    /// What the parameters are multiplied by to have sums of squares of one; one for those that do nothing.
    pub(super) fn scale(&self) -> DVector<f64> {
        self.matrix.diagonal().map(|d| if d > 0.0 { d.sqrt() } else { 1.0 })
    }

    /// The scaled matrix with a damped diagonal.
    fn damped(&self, scale: &DVector<f64>, damping: f64) -> DMatrix<f64> {
        let at = |i: usize, j: usize| {
            let value = self.matrix[(i, j)] / (scale[i] * scale[j]);
            if i == j { value.max(f64::EPSILON) + damping + LOOP_RIDGE } else { value }
        };
        DMatrix::from_fn(scale.len(), scale.len(), at)
    }
}

/// A change of all parameters.
pub(super) struct Change {
    /// Empty where the initial states alone are free.
    pub(super) shared: DVector<f64>,
    /// `local[segment]`
    pub(super) local: Vec<DVector<f64>>,
}

impl Normal {
    /// Scaled and damped, with the initial states eliminated segment by segment.
    pub(super) fn eliminated(&self, damping: f64, scale: &DVector<f64>) -> Option<Eliminated> {
        let size = scale.len();
        let mut matrix = self.shared.damped(scale, damping);
        let mut right = self.shared.gradient.component_div(scale);
        let scaled = |local: &Local| {
            let own = local.own.scale();
            let cross = DMatrix::from_fn(size, own.len(), |i, j| local.cross[(i, j)] / (scale[i] * own[j]));
            (local.own.damped(&own, damping), cross, local.own.gradient.component_div(&own), own)
        };
        let mut blocks: Vec<_> = self.locals.iter().map(scaled).collect();
        let mut done = Vec::new();
        for k in 0..blocks.len() {
            let (own, cross, gradient, scale) = blocks[k].clone();
            let factor = Cholesky::new(own)?;
            let (by_cross, by_gradient) = (factor.solve(&cross.transpose()), factor.solve(&gradient));
            if size > 0 {
                matrix -= &cross * &by_cross;
                right -= &cross * &by_gradient;
            }
            let next = self.locals[k].next.as_ref().zip(blocks.get_mut(k + 1)).map(|(next, after)| {
                let next = DMatrix::from_fn(scale.len(), scale.len(), |i, j| next[(i, j)] / (scale[i] * after.3[j]));
                after.0 -= next.transpose() * factor.solve(&next);
                if size > 0 {
                    after.1 -= by_cross.transpose() * &next;
                }
                after.2 -= next.tr_mul(&by_gradient);
                next
            });
            done.push(EliminatedState { factor, gradient, cross, scale, next });
        }
        Some(Eliminated { matrix, right, states: done })
    }

    /// The damped step.
    pub(super) fn step(&self, damping: f64) -> Option<Change> {
        let scale = self.shared.scale();
        let size = scale.len();
        let Eliminated { matrix, right, states } = self.eliminated(damping, &scale)?;
        let shared = if size > 0 { Cholesky::new(matrix)?.solve(&right) } else { DVector::zeros(0) };
        let mut after: Option<DVector<f64>> = None;
        let mut local = Vec::new();
        for EliminatedState { factor, mut gradient, cross, scale, next } in states.into_iter().rev() {
            if size > 0 {
                gradient -= cross.tr_mul(&shared);
            }
            if let (Some(next), Some(after)) = (next, &after) {
                gradient -= next * after;
            }
            let own = factor.solve(&gradient);
            local.push(own.component_div(&scale));
            after = Some(own);
        }
        local.reverse();
        Some(Change { shared: shared.component_div(&scale), local })
    }
}

/// Normal equations of the shared parameters, and of each initial state for what they and the next one are.
pub(super) struct Eliminated {
    pub(super) matrix: DMatrix<f64>,
    right: DVector<f64>,
    states: Vec<EliminatedState>,
}

struct EliminatedState {
    factor: Cholesky<f64, nalgebra::Dyn>,
    gradient: DVector<f64>,
    cross: DMatrix<f64>,
    scale: DVector<f64>,
    next: Option<DMatrix<f64>>,
}
