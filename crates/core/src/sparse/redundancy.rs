//! Exact linear relations among columns: one force written in several ways.

use nalgebra::{DMatrix, DVector};

/// Columns with exact linear relations among them, known from how they are made: `x2-x1` is `x2` less `x1`.
///
/// Any independent ones among them explain as much as all do, but not with as few and small forces. Of all writings the one
/// is taken whose forces' RMS sum to least (basis pursuit: Chen, Donoho & Saunders 1998): of `k (x2-x1)` and `k x2 - k x1`
/// always the first.
#[derive(Clone, Debug)]
pub(crate) struct Redundancy {
    /// The columns that take part in some relation.
    pub(super) columns: Vec<usize>,
    /// What each of them is the sum of: one column each, one row a part.
    parts: DMatrix<f64>,
}

/// A column of which less than this share of its norm is orthogonal to others depends on them.
const DEPENDENT_NORM: f64 = 1e-9;
/// Another way to write the forces is taken if its forces are smaller by more than this share.
pub(super) const MIN_REDUCTION: f64 = 1e-9;

impl Redundancy {
    /// The relations among columns that are sums of parts: `parts[(i, k)]` times the part `i` in the column `k`. None
    /// where no column is a sum of others.
    pub(crate) fn new(parts: &DMatrix<f64>) -> Option<Self> {
        let all: Vec<usize> = (0..parts.ncols()).collect();
        let rank = independent(parts, &all).len();
        let others = |k: usize| -> Vec<usize> { all.iter().copied().filter(|j| *j != k).collect() };
        let columns: Vec<usize> =
            all.iter().copied().filter(|k| independent(parts, &others(*k)).len() == rank).collect();
        let parts = parts.select_columns(&columns);
        (!columns.is_empty()).then_some(Self { columns, parts })
    }

    /// Of some columns those that are no sum of ones before them.
    pub(super) fn independent(&self, among: &[usize]) -> Vec<usize> {
        let places: Vec<usize> = among.iter().filter_map(|k| self.place(*k)).collect();
        let kept = independent(&self.parts, &places);
        among.iter().copied().filter(|k| self.place(*k).is_none_or(|p| kept.contains(&p))).collect()
    }

    pub(super) fn place(&self, column: usize) -> Option<usize> {
        self.columns.iter().position(|k| *k == column)
    }

    /// Exchanges columns of a writing for others, each time where that lowers the sum of the forces most, until nothing
    /// does: the simplex method, for which the last is the least of all.
    ///
    /// `basis` pairs a column with its coefficient; `others` may come in, `locked` ones do not go out.
    pub(super) fn shorten(
        &self,
        basis: &mut [(usize, f64)],
        others: &[usize],
        scale: &[f64],
        locked: &dyn Fn(usize) -> bool,
    ) -> bool {
        let size = |basis: &[(usize, f64)]| -> f64 { basis.iter().map(|(k, c)| (c * scale[*k]).abs()).sum() };
        let mut changed = false;
        for _ in 0..self.columns.len() {
            let now = size(basis);
            let places: Vec<usize> = basis.iter().filter_map(|(k, _)| self.place(*k)).collect();
            let svd = self.parts.select_columns(&places).svd(true, true);
            let mut best: Option<(f64, Vec<(usize, f64)>)> = None;
            for comes in others.iter().filter(|k| !basis.iter().any(|(b, _)| b == *k)) {
                let Some(place) = self.place(*comes) else { continue };
                let column: DVector<f64> = self.parts.column(place).into_owned();
                let Ok(sum) = svd.solve(&column, DEPENDENT_NORM) else { continue };
                for (out, weight) in sum.iter().enumerate().filter(|(_, w)| w.abs() > 1e-6) {
                    if locked(basis[out].0) {
                        continue;
                    }
                    let coefficient = basis[out].1 / weight;
                    let mut next: Vec<(usize, f64)> =
                        basis.iter().zip(sum.iter()).map(|((k, c), w)| (*k, c - coefficient * w)).collect();
                    next[out] = (*comes, coefficient);
                    let size = size(&next);
                    if size < (1.0 - MIN_REDUCTION) * now && best.as_ref().is_none_or(|(least, _)| size < *least) {
                        best = Some((size, next));
                    }
                }
            }
            let Some((_, next)) = best else { break };
            basis.copy_from_slice(&next);
            changed = true;
        }
        changed
    }
}

/// Indices among `columns` that are no sum of ones before them.
fn independent(parts: &DMatrix<f64>, columns: &[usize]) -> Vec<usize> {
    let mut directions: Vec<DVector<f64>> = Vec::new();
    let mut kept = Vec::new();
    for k in columns {
        let mut rest: DVector<f64> = parts.column(*k).into_owned();
        let norm = rest.norm();
        for d in &directions {
            rest.axpy(-d.dot(&rest), d, 1.0);
        }
        if rest.norm() > DEPENDENT_NORM * norm {
            directions.push(rest.normalize());
            kept.push(*k);
        }
    }
    kept
}
