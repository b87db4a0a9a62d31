//! Columns and a target reduced once to a triangle, from which every least-squares problem on a subset is solved.

use std::sync::Arc;

use fearless_simd::{Level, dispatch};
use nalgebra::{DMatrix, DVector};

use super::bounded::{Bounds, SumOfSquares, active_set};
use super::redundancy::Redundancy;
use crate::signal::{dot, rms};

/// Columns and one target reduced to a small triangle that every least-squares problem on a subset of them can be
/// solved from: `RᵀR = [Θ y]ᵀ[Θ y]`.
///
/// The triangle comes from Householder reflections over blocks of rows, so unlike the Gram matrix it keeps all digits.
/// Columns are scaled to RMS 1 inside.
#[derive(Clone, Debug)]
pub struct Reduced {
    /// Upper triangle of the scaled columns, the target last.
    triangle: DMatrix<f64>,
    scale: Vec<f64>,
    target_scale: f64,
    rows: usize,
    /// The sign that each column's coefficient may have; empty if any.
    signs: Vec<Option<Sign>>,
    /// Which columns are sums of others, if any.
    pub(super) redundancy: Option<Arc<Redundancy>>,
}

/// What coefficients leave of a target.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Unexplained {
    /// RMS of the residual.
    pub(crate) rms: f64,
    /// The residual's part along each column of norm one: white residuals have their own standard deviation here, whatever the
    /// column and however many the rows.
    pub(crate) along: Vec<f64>,
    /// Norm of each column.
    pub(crate) norms: Vec<f64>,
}

impl Unexplained {
    /// What the residual does to a column's moment Θᵀy.
    pub(crate) fn score(&self, column: usize) -> f64 {
        self.along[column] * self.norms[column]
    }

    /// By how much a column's coefficient would have to change to leave nothing along it, the others as they are.
    pub(crate) fn shift(&self, column: usize) -> f64 {
        if self.norms[column] > 0.0 { self.along[column] / self.norms[column] } else { 0.0 }
    }
}

/// A sign that a coefficient may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Sign {
    /// Zero or above.
    NotNegative,
    /// Zero or below.
    NotPositive,
}

impl Sign {
    /// The opposite one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::NotNegative => Self::NotPositive,
            Self::NotPositive => Self::NotNegative,
        }
    }

    /// The admitted value nearest to one.
    pub fn nearest(self, value: f64) -> f64 {
        self.bounds().nearest(value)
    }

    /// The values that it admits.
    pub fn bounds(self) -> Bounds {
        match self {
            Self::NotNegative => Bounds { low: 0.0, high: f64::INFINITY },
            Self::NotPositive => Bounds { low: f64::NEG_INFINITY, high: 0.0 },
        }
    }
}

/// Slope of the sum of squares along a column of norm √rows, as a share of the target's norm, below which it is rounding.
const FLAT: f64 = 1e-12;
/// Rows that one block of reflections works on.
const BLOCK: usize = 256;

impl Reduced {
    /// Reduces columns and a target, all of one length.
    pub fn new(columns: &[impl AsRef<[f64]>], target: &[f64]) -> Self {
        let rows = target.len();
        let scale: Vec<f64> = columns.iter().map(|c| rms(c.as_ref())).collect();
        let target_scale = rms(target);
        let width = columns.len() + 1;
        let mut work = Reflections { stack: vec![0.0; (width + BLOCK) * width], height: width + BLOCK, width };
        let inverse = |s: f64| if s > 0.0 && s.is_finite() { s.recip() } else { 0.0 };
        let all = columns.iter().map(|c| c.as_ref()).zip(scale.iter().copied()).chain([(target, target_scale)]);
        let all: Vec<(&[f64], f64)> = all.map(|(c, s)| (c, inverse(s))).collect();
        for from in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - from);
            for (j, (column, factor)) in all.iter().enumerate() {
                let place = &mut work.stack[j * work.height + width..][..BLOCK];
                for (slot, value) in place.iter_mut().zip(&column[from..from + count]) {
                    *slot = value * factor;
                }
            }
            // The widest registers that the processor has.
            dispatch!(Level::new(), _simd => work.absorb(count));
        }
        let triangle =
            DMatrix::from_fn(width, width, |i, j| if i <= j { work.stack[j * work.height + i] } else { 0.0 });
        Self { triangle, scale, target_scale, rows, signs: Vec::new(), redundancy: None }
    }

    /// This problem with another target: its moments Θᵀy with `columns` are larger by `moments`, in the data's units, its
    /// residual stays. Columns that depend on others get no more.
    #[must_use]
    pub fn shifted(&self, columns: &[usize], moments: &DVector<f64>) -> Self {
        let p = self.columns();
        let mut change = DVector::zeros(p);
        for (k, moment) in columns.iter().zip(moments.iter()).filter(|(k, _)| !self.unusable(**k)) {
            change[*k] = moment / (self.scale[*k] * self.target_scale);
        }
        let least = 1e-12 * (self.rows.max(1) as f64).sqrt();
        let mut shifted = self.clone();
        for i in 0..p {
            let known: f64 = (0..i).map(|k| self.triangle[(k, i)] * change[k]).sum();
            let pivot = self.triangle[(i, i)];
            change[i] = if pivot.abs() > least { (change[i] - known) / pivot } else { 0.0 };
            shifted.triangle[(i, p)] += change[i];
        }
        shifted
    }

    /// The reduction of several problems' rows together; all of the same columns.
    pub fn stack(parts: &[&Self]) -> Self {
        let width = parts.first().map_or(0, |p| p.columns()) + 1;
        // The triangles are the rows; the scales undo each part's own.
        let tall = |j: usize| -> Vec<f64> {
            parts
                .iter()
                .flat_map(|p| {
                    let scale = p.scale.get(j).copied().unwrap_or(p.target_scale);
                    (0..width).map(move |i| p.triangle[(i, j)] * scale)
                })
                .collect()
        };
        let columns: Vec<Vec<f64>> = (0..width - 1).map(tall).collect();
        let mut stacked = Self::new(&columns, &tall(width - 1));
        let rows = parts.iter().map(|p| p.rows).sum::<usize>();
        // Scales are root mean squares over rows: those of the triangles' rows become those of the data's.
        let factor = ((parts.len() * width) as f64 / rows.max(1) as f64).sqrt();
        stacked.scale.iter_mut().for_each(|s| *s *= factor);
        stacked.target_scale *= factor;
        stacked.triangle /= factor;
        stacked.rows = rows;
        stacked.signs = parts.first().map_or_else(Vec::new, |p| p.signs.clone());
        stacked.redundancy = parts.first().and_then(|p| p.redundancy.clone());
        stacked
    }

    /// This problem with signs that coefficients may have, one entry a column; none if a coefficient may have any.
    #[must_use]
    pub fn bounded(mut self, signs: &[Option<Sign>]) -> Self {
        self.signs = if signs.iter().all(Option::is_none) { Vec::new() } else { signs.to_vec() };
        self
    }

    /// The sign that each column's coefficient may have; empty if any.
    pub fn signs(&self) -> &[Option<Sign>] {
        &self.signs
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.scale.len()
    }

    /// Number of rows that were reduced.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// RMS of each column.
    pub fn scale(&self) -> &[f64] {
        &self.scale
    }

    /// RMS of the target.
    pub(crate) fn target_scale(&self) -> f64 {
        self.target_scale
    }

    /// True of a column that is zero or not finite, which no regression can use.
    pub(crate) fn unusable(&self, column: usize) -> bool {
        !(self.scale[column] > 0.0 && self.scale[column].is_finite())
    }

    /// A scaled column, as a column of the triangle.
    pub(super) fn column(&self, column: usize) -> DVector<f64> {
        self.triangle.column(column).into_owned()
    }

    /// The scaled target less what fixed columns contribute; `fixed` pairs a column with its (unscaled) coefficient.
    pub(super) fn target(&self, fixed: &[(usize, f64)]) -> DVector<f64> {
        let mut y = self.triangle.column(self.columns()).into_owned();
        for (column, coefficient) in fixed {
            let factor =
                if self.target_scale > 0.0 { coefficient * self.scale[*column] / self.target_scale } else { 0.0 };
            y.axpy(-factor, &self.triangle.column(*column), 1.0);
        }
        y
    }

    /// `min ‖A c − b‖² + Σ wᵢ cᵢ²` over the scaled columns `keep`, and the RMS of the residual `A c − b`.
    ///
    /// `fixed` columns stand in `b` with their unscaled coefficient; `ridge` gives each column's weight `wᵢ`, beside columns
    /// of norm √rows. Coefficients have the signs that they may have; of dependent columns some are zero.
    pub(super) fn solve(
        &self,
        keep: &[usize],
        fixed: &[(usize, f64)],
        ridge: impl Fn(usize) -> f64,
    ) -> (Vec<f64>, f64) {
        if self.signs.is_empty() {
            return self.solve_freely(keep, fixed, &ridge);
        }
        let bounds: Vec<Bounds> = keep.iter().map(|k| self.signs[*k].map_or(Bounds::OPEN, Sign::bounds)).collect();
        let flat = FLAT * self.target(fixed).norm() * (self.rows.max(1) as f64).sqrt();
        let subset = Subset { reduced: self, keep, fixed, ridge: &ridge };
        let b = active_set(&subset, &bounds, flat).unwrap_or_else(|| vec![0.0; keep.len()]);
        let rms = self.residual_rms(&b, keep, fixed);
        (b, rms)
    }

    /// The scaled target less what fixed and fitted columns contribute.
    fn residual(&self, b: &[f64], keep: &[usize], fixed: &[(usize, f64)]) -> DVector<f64> {
        let mut residual = self.target(fixed);
        for (b, k) in b.iter().zip(keep) {
            residual.axpy(-b, &self.triangle.column(*k), 1.0);
        }
        residual
    }

    fn residual_rms(&self, b: &[f64], keep: &[usize], fixed: &[(usize, f64)]) -> f64 {
        self.residual(b, keep, fixed).norm() / (self.rows.max(1) as f64).sqrt()
    }

    fn solve_freely(&self, keep: &[usize], fixed: &[(usize, f64)], ridge: &impl Fn(usize) -> f64) -> (Vec<f64>, f64) {
        let y = self.target(fixed);
        let p = keep.len();
        let width = y.len();
        let penalised = keep.iter().any(|k| ridge(*k) > 0.0);
        let mut a = DMatrix::zeros(width + if penalised { p } else { 0 }, p);
        for (j, k) in keep.iter().enumerate() {
            a.view_mut((0, j), (width, 1)).copy_from(&self.triangle.column(*k));
            if penalised {
                a[(width + j, j)] = ridge(*k).sqrt();
            }
        }
        let mut rhs = DVector::zeros(a.nrows());
        rhs.rows_mut(0, width).copy_from(&y);
        let b = least_squares(a, rhs);
        let rms = self.residual_rms(&b, keep, fixed);
        (b, rms)
    }

    /// The coefficients of the columns `keep`, in the data's units, at which `‖Θ c − y‖²` is least within their signs.
    pub(crate) fn least_squares(&self, keep: &[usize]) -> Vec<f64> {
        let (b, _) = self.solve(keep, &[], |_| 0.0);
        b.iter().zip(keep).map(|(b, k)| b * self.target_scale / self.scale[*k]).collect()
    }

    /// The coefficients of the columns `keep`, in the data's units, with a ridge that is a share of each column's square.
    pub fn damped(&self, keep: &[usize], ridge: f64) -> Vec<f64> {
        let (b, _) = self.solve(keep, &[], |_| ridge * self.rows as f64);
        b.iter().zip(keep).map(|(b, k)| b * self.target_scale / self.scale[*k]).collect()
    }

    /// What given coefficients, one a column, leave of the target.
    pub(crate) fn unexplained(&self, coefficients: &[f64]) -> Unexplained {
        let mut residual = self.triangle.column(self.columns()) * self.target_scale;
        for (k, c) in coefficients.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            residual.axpy(-c * self.scale[k], &self.triangle.column(k), 1.0);
        }
        let along = |k: usize| {
            let (norm, product) = (self.triangle.column(k).norm(), self.triangle.column(k).dot(&residual));
            if norm > 0.0 && norm.is_finite() { product / norm } else { 0.0 }
        };
        let along = (0..self.columns()).map(along).collect();
        let norms = (0..self.columns()).map(|k| self.triangle.column(k).norm() * self.scale[k]).collect();
        Unexplained { rms: residual.norm() / (self.rows.max(1) as f64).sqrt(), along, norms }
    }

    /// Condition number of the kept columns, each scaled to RMS 1; infinite where they are dependent.
    pub fn condition(&self, keep: &[usize]) -> f64 {
        if keep.is_empty() {
            return 1.0;
        }
        let values = self.triangle.select_columns(keep).singular_values();
        let (largest, smallest) = (values.max(), values.min());
        if smallest > largest * 1e-15 { largest / smallest } else { f64::INFINITY }
    }

    /// `(ΘᵀΘ)⁻¹` of the kept columns, unscaled; none where they are dependent.
    pub(crate) fn inverse_gram(&self, keep: &[usize]) -> Option<DMatrix<f64>> {
        let r = self.triangle.select_columns(keep).qr().r();
        let inverse = r.try_inverse()?;
        let mut gram = &inverse * inverse.transpose();
        for (i, a) in keep.iter().enumerate() {
            for (j, b) in keep.iter().enumerate() {
                gram[(i, j)] /= self.scale[*a] * self.scale[*b];
            }
        }
        gram.iter().all(|g| g.is_finite()).then_some(gram)
    }
}

/// Some reduced columns, others fixed beside them: what [`Reduced::solve`] finds the least of within signs.
struct Subset<'a, R> {
    reduced: &'a Reduced,
    keep: &'a [usize],
    fixed: &'a [(usize, f64)],
    ridge: &'a R,
}

impl<R: Fn(usize) -> f64> SumOfSquares for Subset<'_, R> {
    /// A coefficient can be held only at zero, where its sign changes.
    fn least(&self, free: &[bool], _: &[f64]) -> Option<Vec<f64>> {
        let columns: Vec<usize> = self.keep.iter().zip(free).filter(|(_, free)| **free).map(|(k, _)| *k).collect();
        let (found, _) = self.reduced.solve_freely(&columns, self.fixed, self.ridge);
        let mut found = found.into_iter();
        Some(free.iter().map(|free| if *free { found.next().unwrap_or(0.0) } else { 0.0 }).collect())
    }

    /// The ridge adds nothing to the slope of a coefficient at zero.
    fn descent(&self, at: &[f64]) -> Vec<f64> {
        let residual = self.reduced.residual(at, self.keep, self.fixed);
        self.keep.iter().map(|k| self.reduced.triangle.column(*k).dot(&residual)).collect()
    }
}

/// Least squares by column-pivoted Householder QR; columns that add nothing get zero.
fn least_squares(a: DMatrix<f64>, rhs: DVector<f64>) -> Vec<f64> {
    let p = a.ncols();
    if p == 0 {
        return Vec::new();
    }
    let qr = a.col_piv_qr();
    let mut y = rhs;
    qr.q_tr_mul(&mut y);
    let r = qr.r();
    let limit = r[(0, 0)].abs() * 1e-14;
    let rank = (0..p.min(r.nrows())).take_while(|k| r[(*k, *k)].abs() > limit).count();
    let mut b = DVector::zeros(p);
    for i in (0..rank).rev() {
        let known: f64 = (i + 1..rank).map(|j| r[(i, j)] * b[j]).sum();
        b[i] = (y[i] - known) / r[(i, i)];
    }
    qr.p().inv_permute_rows(&mut b);
    b.iter().copied().collect()
}

/// The triangle so far on top of a block of new rows, column after column.
struct Reflections {
    stack: Vec<f64>,
    height: usize,
    width: usize,
}

impl Reflections {
    /// Reflects `count` new rows into the triangle.
    #[inline(always)] // into each width of registers
    fn absorb(&mut self, count: usize) {
        let Self { stack, height, width } = self;
        for j in 0..*width {
            let (left, right) = stack.split_at_mut((j + 1) * *height);
            let column = &mut left[j * *height..];
            let (top, block) = column.split_at_mut(*width);
            let block = &mut block[..count];
            let below: f64 = block.iter().map(|v| v * v).sum();
            if below == 0.0 {
                continue;
            }
            let alpha = top[j];
            let norm = (alpha * alpha + below).sqrt();
            let beta = if alpha > 0.0 { -norm } else { norm };
            // The reflector is (1, block / pivot); tau its weight.
            let pivot = alpha - beta;
            let tau = (beta - alpha) / beta;
            block.iter_mut().for_each(|v| *v /= pivot);
            top[j] = beta;
            for other in right.chunks_exact_mut(*height) {
                let (other_top, other_block) = other.split_at_mut(*width);
                let other_block = &mut other_block[..count];
                let along = other_top[j] + dot(block, other_block);
                let shift = tau * along;
                other_top[j] -= shift;
                for (o, v) in other_block.iter_mut().zip(block.iter()) {
                    *o -= shift * v;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> (Vec<Vec<f64>>, Vec<f64>) {
        let n = 1000;
        let wave = |a: f64, s: f64| (0..n).map(|k| s * (a * f64::from(k)).sin()).collect::<Vec<f64>>();
        let columns = vec![wave(0.1, 1.0), wave(0.23, 1e-6), wave(0.31, 1e5)];
        let y = (0..n as usize).map(|k| 2.0 * columns[0][k] - 3e6 * columns[1][k] + 1e-5 * columns[2][k]).collect();
        (columns, y)
    }

    #[test]
    fn exact_coefficients_come_back_to_all_digits() {
        let (columns, y) = columns();
        let reduced = Reduced::new(&columns, &y);
        let (b, residual) = reduced.solve(&[0, 1, 2], &[], |_| 0.0);
        for ((b, s), want) in b.iter().zip(reduced.scale()).zip([2.0, -3e6, 1e-5]) {
            let coefficient = b * reduced.target_scale() / s;
            assert!((coefficient / want - 1.0).abs() < 1e-13, "{coefficient} {want}");
        }
        assert!(residual < 1e-13, "{residual}");
    }

    #[test]
    fn parts_stack_to_the_whole() {
        let (columns, mut y) = columns();
        y.iter_mut().enumerate().for_each(|(k, y)| *y += 0.1 * (k as f64).cos());
        let whole = Reduced::new(&columns, &y);
        let part = |range: std::ops::Range<usize>| {
            Reduced::new(&columns.iter().map(|c| &c[range.clone()]).collect::<Vec<_>>(), &y[range.clone()])
        };
        let stacked = Reduced::stack(&[&part(0..300), &part(300..1000)]);
        let (a, ra) = whole.solve(&[0, 1, 2], &[], |_| 0.0);
        let (b, rb) = stacked.solve(&[0, 1, 2], &[], |_| 0.0);
        assert!(
            a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-12) && (ra - rb).abs() < 1e-12,
            "{a:?} {b:?} {ra} {rb}"
        );
        assert!((whole.target_scale() - stacked.target_scale()).abs() < 1e-9 * whole.target_scale());
    }

    #[test]
    fn nearly_dependent_columns_keep_more_digits_than_the_gram_matrix() {
        let n = 500;
        let a: Vec<f64> = (0..n).map(|k| (0.1 * f64::from(k)).sin()).collect();
        let b: Vec<f64> = a.iter().enumerate().map(|(k, a)| a + 1e-7 * (0.37 * k as f64).cos()).collect();
        let y: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 2.0 * a - b).collect();
        let reduced = Reduced::new(&[a, b], &y);
        let (c, _) = reduced.solve(&[0, 1], &[], |_| 0.0);
        // Condition 1e7: the Gram matrix's 1e14 would leave two digits.
        let (c0, c1) =
            (c[0] * reduced.target_scale() / reduced.scale()[0], c[1] * reduced.target_scale() / reduced.scale()[1]);
        assert!((c0 - 2.0).abs() < 1e-7 && (c1 + 1.0).abs() < 1e-7, "{c0} {c1}");
        assert!(reduced.condition(&[0, 1]) > 1e6);
        assert!((reduced.condition(&[0]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bounded_least_squares_is_the_best_of_all_that_keep_to_the_signs() {
        let n = 400;
        let wave = |a: f64| (0..n).map(|k| (a * f64::from(k)).sin()).collect::<Vec<f64>>();
        let base = [wave(0.1), wave(0.103), wave(0.31), wave(0.32), wave(0.9)];
        let mut forbidden = 0;
        for case in 0..40 {
            let c = |j: u32| (f64::from(case * 7 + j * 13) * 1.7).sin();
            let y: Vec<f64> = (0..n as usize)
                .map(|k| {
                    base.iter().zip(0..).map(|(col, j)| c(j) * col[k]).sum::<f64>() + 0.3 * (0.77 * k as f64).cos()
                })
                .collect();
            let signs = [
                None,
                Some(Sign::NotPositive),
                Some(Sign::NotNegative),
                Some(Sign::NotPositive),
                Some(Sign::NotNegative),
            ];
            let reduced = Reduced::new(&base, &y).bounded(&signs);
            let (b, rms) = reduced.solve(&[0, 1, 2, 3, 4], &[], |_| 0.0);
            assert!(b.iter().zip(signs).all(|(b, s)| s.is_none_or(|s| s.bounds().contain(*b))), "{b:?}");
            // Every set of columns that are in, by brute force.
            let best = (0..16_usize)
                .filter_map(|set| {
                    let keep: Vec<usize> =
                        [0].into_iter().chain((0..4).filter(|j| set >> j & 1 == 1).map(|j| j + 1)).collect();
                    let (b, rms) = reduced.solve_freely(&keep, &[], &|_| 0.0);
                    let fits = b.iter().zip(&keep).all(|(b, k)| signs[*k].is_none_or(|s| s.bounds().contain(*b)));
                    fits.then_some(rms)
                })
                .fold(f64::INFINITY, f64::min);
            forbidden += usize::from(b.contains(&0.0));
            assert!((rms - best).abs() < 1e-10, "case {case}: {rms} {best}");
        }
        assert!(forbidden > 20, "the signs matter in {forbidden} cases");
    }

    #[test]
    fn dependent_and_empty_columns_are_no_catastrophe() {
        let (mut columns, y) = columns();
        columns.push(columns[0].clone());
        columns.push(vec![0.0; y.len()]);
        let reduced = Reduced::new(&columns, &y);
        assert!(reduced.unusable(4));
        let (b, residual) = reduced.solve(&[0, 1, 2, 3, 4], &[], |_| 0.0);
        assert!(b.iter().all(|b| b.is_finite()) && residual < 1e-12);
        assert_eq!(reduced.condition(&[0, 3]), f64::INFINITY);
        assert!(reduced.inverse_gram(&[0, 3]).is_none() || reduced.condition(&[0, 3]) > 1e14);
    }
}
