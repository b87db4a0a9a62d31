//! Least squares within bounds: `min ‖A c − b‖²` subject to `lᵢ ≤ cᵢ ≤ uᵢ`.
//!
//! [`active_set`] knows only where a sum of squares is least while some coefficients are held, and how it slopes; the
//! linear algebra behind that is the caller's: [`Reduced`](super::Reduced) solves by orthogonal factors,
//! [`bounded_least_squares`] by the normal equations.
//!
//! Source: P. Stark, R. Parker, "Bounded-variable least squares", Computational Statistics 10 (1995) 129–141, which extends
//! C. Lawson, R. Hanson, "Solving Least Squares Problems" (1974), chapter 23, to bounds on both sides.

use nalgebra::{DMatrix, DVector};

use crate::signal::dot;

/// The range that a coefficient may lie in, both ends included; an infinite end is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The least value.
    pub low: f64,
    /// The largest value.
    pub high: f64,
}

impl Bounds {
    /// No bounds.
    pub const OPEN: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// True if a value lies between the bounds; a NaN does not.
    pub fn contain(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// The value between the bounds that is nearest to one.
    #[must_use]
    pub fn nearest(self, value: f64) -> f64 {
        value.max(self.low).min(self.high)
    }
}

/// A convex sum of squares `‖A c − b‖²` of some coefficients.
pub(super) trait SumOfSquares {
    /// The coefficients at which it is least if those that are not `free` stay at their values in `at`; none where the free
    /// ones are not determined. Coefficients that are held come back as they are in `at`.
    fn least(&self, free: &[bool], at: &[f64]) -> Option<Vec<f64>>;

    /// Half of how steeply it falls with each coefficient: `Aᵀ(b − A c)`.
    fn descent(&self, at: &[f64]) -> Vec<f64>;
}

/// The coefficients within `bounds`, one a coefficient, at which a sum of squares is least; none where it is not determined.
///
/// A coefficient leaves its bound only if the sum falls by more than `tolerance` per unit of it. The result satisfies the
/// optimality conditions: the slope is zero along coefficients between their bounds, and points out of the range at bounds.
pub(super) fn active_set(sum: &impl SumOfSquares, bounds: &[Bounds], tolerance: f64) -> Option<Vec<f64>> {
    let n = bounds.len();
    let mut at: Vec<f64> = bounds.iter().map(|b| b.nearest(0.0)).collect();
    let unbounded = sum.least(&vec![true; n], &at)?;
    if unbounded.iter().zip(bounds).all(|(c, b)| b.contain(*c)) {
        return Some(unbounded);
    }
    let mut free: Vec<bool> = at.iter().zip(bounds).map(|(c, b)| b.low < *c && *c < b.high).collect();
    // One that was set free and came back at once would be chosen again.
    let mut barred = vec![false; n];
    // In exact arithmetic the sum falls with each round, so that no set comes twice; the limit is for rounding.
    for _ in 0..3 * n + 3 {
        let mut wanted = sum.least(&free, &at)?;
        while let Some((out, bound, share)) = first_to_leave(&free, bounds, &at, &wanted) {
            at.iter_mut().zip(&wanted).for_each(|(c, w)| *c += share * (w - *c));
            at[out] = bound;
            free[out] = false;
            barred[out] |= share == 0.0;
            wanted = sum.least(&free, &at)?;
        }
        if wanted != at {
            // What came back at once from another place may not do so from here.
            barred.fill(false);
        }
        at = wanted;
        let inward = |(i, slope): (usize, &f64)| {
            let slope = if at[i] == bounds[i].low { *slope } else { -slope };
            let may = !free[i] && !barred[i] && bounds[i].low < bounds[i].high;
            (may && slope > tolerance).then_some((i, slope))
        };
        let descent = sum.descent(&at);
        let Some((enters, _)) = descent.iter().enumerate().filter_map(inward).max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        free[enters] = true;
    }
    Some(at)
}

/// Of the free coefficients the first to reach a bound on the straight way from `at` to `wanted`: its index, the bound, and
/// the share of the way; none if all arrive within their bounds.
fn first_to_leave(free: &[bool], bounds: &[Bounds], at: &[f64], wanted: &[f64]) -> Option<(usize, f64, f64)> {
    let leaves = |i: usize| {
        let bound = match wanted[i] {
            w if w < bounds[i].low => bounds[i].low,
            w if w > bounds[i].high => bounds[i].high,
            _ => return None,
        };
        free[i].then(|| (i, bound, (bound - at[i]) / (wanted[i] - at[i])))
    };
    (0..free.len()).filter_map(leaves).min_by(|a, b| a.2.total_cmp(&b.2))
}

/// Coefficients within their bounds, and the sum of squares that they leave.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundedSolution {
    /// One a column.
    pub coefficients: Vec<f64>,
    /// `‖A c − b‖²`.
    pub sum_of_squares: f64,
}

/// Ridge added to the normal equations of columns scaled to norm one, so that nearly collinear columns can be solved for.
const RIDGE: f64 = 1e-10;
/// Slope of the sum of squares along a unit column, as a share of the target's norm, below which it is rounding.
const FLAT: f64 = 1e-12;

/// `min ‖A c − b‖²` subject to `bounds`, one a column, by the normal equations: for few columns of many rows, of which half
/// the digits are enough.
///
/// `columns[j]` and `target` have one length. A column of zeros gets the coefficient nearest to zero. None if a column or the
/// target is not finite.
///
/// # Panics
/// If there are not as many bounds as columns.
pub fn bounded_least_squares(
    columns: &[impl AsRef<[f64]>],
    target: &[f64],
    bounds: &[Bounds],
) -> Option<BoundedSolution> {
    assert_eq!(columns.len(), bounds.len(), "one pair of bounds for each column");
    let equations = NormalEquations::new(columns, target);
    if !equations.sizes.iter().chain([&equations.target_square]).all(|square| square.is_finite()) {
        return None;
    }
    let scaled: Vec<Bounds> = bounds.iter().zip(&equations.sizes).map(|(b, size)| scaled(*b, *size)).collect();
    let values = active_set(&equations, &scaled, FLAT * equations.target_square.sqrt())?;
    let sum_of_squares = equations.sum_of_squares(&values);
    let unscaled = |((value, inverse), bounds): ((f64, &f64), &Bounds)| bounds.nearest(value * inverse);
    let coefficients = values.into_iter().zip(&equations.inverse).zip(bounds).map(unscaled).collect();
    Some(BoundedSolution { coefficients, sum_of_squares })
}

/// The bounds of a coefficient times its column's norm; those of an empty column let it stay at zero.
fn scaled(bounds: Bounds, size: f64) -> Bounds {
    if size > 0.0 {
        Bounds { low: bounds.low * size, high: bounds.high * size }
    } else {
        Bounds { low: 0.0, high: 0.0 }
    }
}

/// `AᵀA c = Aᵀb` for columns scaled to norm one.
struct NormalEquations {
    /// Norm of each column.
    sizes: Vec<f64>,
    /// Its inverse; zero of an empty column.
    inverse: Vec<f64>,
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    /// `‖b‖²`.
    target_square: f64,
}

impl NormalEquations {
    fn new(columns: &[impl AsRef<[f64]>], target: &[f64]) -> Self {
        let n = columns.len();
        let column = |i: usize| columns[i].as_ref();
        let sizes: Vec<f64> = columns.iter().map(|c| dot(c.as_ref(), c.as_ref()).sqrt()).collect();
        let inverse: Vec<f64> = sizes.iter().map(|s| if *s > 0.0 { s.recip() } else { 0.0 }).collect();
        let entry = |i: usize, j: usize| if i == j { 1.0 } else { dot(column(i), column(j)) * inverse[i] * inverse[j] };
        let matrix = DMatrix::from_fn(n, n, entry);
        let right = DVector::from_fn(n, |i, _| dot(column(i), target) * inverse[i]);
        Self { sizes, matrix, right, target_square: dot(target, target), inverse }
    }

    /// A row of the matrix times a vector, over some of its entries.
    fn row(&self, i: usize, values: &[f64], which: impl Fn(usize) -> bool) -> f64 {
        (0..values.len()).filter(|j| which(*j)).map(|j| self.matrix[(i, j)] * values[j]).sum()
    }

    /// `‖A c − b‖² = bᵀb − 2 cᵀAᵀb + cᵀAᵀA c`.
    fn sum_of_squares(&self, values: &[f64]) -> f64 {
        let linear: f64 = values.iter().zip(&self.right).map(|(c, r)| c * r).sum();
        let quadratic: f64 = values.iter().enumerate().map(|(i, c)| c * self.row(i, values, |_| true)).sum();
        (self.target_square - 2.0 * linear + quadratic).max(0.0)
    }
}

impl SumOfSquares for NormalEquations {
    fn least(&self, free: &[bool], at: &[f64]) -> Option<Vec<f64>> {
        let places: Vec<usize> = (0..at.len()).filter(|i| free[*i] && self.sizes[*i] > 0.0).collect();
        let part = DMatrix::from_fn(places.len(), places.len(), |i, j| {
            self.matrix[(places[i], places[j])] + if i == j { RIDGE } else { 0.0 }
        });
        let rest = places.iter().map(|i| self.right[*i] - self.row(*i, at, |j| !places.contains(&j)));
        let solved = part.cholesky()?.solve(&DVector::from_iterator(places.len(), rest));
        let mut values = at.to_vec();
        places.iter().zip(solved.iter()).for_each(|(i, value)| values[*i] = *value);
        Some(values)
    }

    fn descent(&self, at: &[f64]) -> Vec<f64> {
        (0..at.len()).map(|i| self.right[i] - self.row(i, at, |_| true) - RIDGE * at[i]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{Reduced, Sign};
    use proptest::collection::vec;
    use proptest::prelude::*;

    /// Columns, a target and bounds.
    type Problem = (Vec<Vec<f64>>, Vec<f64>, Vec<Bounds>);

    fn bounds() -> impl Strategy<Value = Bounds> {
        let end = -1.5..1.5;
        prop_oneof![
            Just(Bounds::OPEN),
            Just(Bounds { low: 0.0, high: f64::INFINITY }),
            Just(Bounds { low: f64::NEG_INFINITY, high: 0.0 }),
            (end.clone(), end).prop_map(|(a, b): (f64, f64)| Bounds { low: a.min(b), high: a.max(b) }),
        ]
    }

    /// Up to eight columns, some of which are zero, repeat another one, or nearly do, in units far apart.
    fn problem() -> impl Strategy<Value = Problem> {
        const ROWS: usize = 14;
        let column = || vec(-1.0..1.0_f64, ROWS);
        (vec((column(), 0..9_usize, -3..4_i32, bounds()), 1..9), column()).prop_map(|(drawn, target)| {
            let mut columns: Vec<Vec<f64>> = Vec::new();
            for (column, kind, power, _) in &drawn {
                let unit = 10_f64.powi(*power);
                columns.push(match (kind, columns.last()) {
                    (0, _) => vec![0.0; ROWS],
                    (1, Some(last)) => last.iter().map(|c| unit * c).collect(),
                    (2, Some(last)) => last.iter().zip(column).map(|(l, c)| l + 1e-3 * c).collect(),
                    _ => column.iter().map(|c| unit * c).collect(),
                });
            }
            (columns, target, drawn.into_iter().map(|(.., bounds)| bounds).collect())
        })
    }

    /// The largest norm among a target and its columns times their coefficients: what rounding is a share of.
    fn size((columns, target, _): &Problem, coefficients: &[f64]) -> f64 {
        let parts = columns.iter().zip(coefficients).map(|(a, c)| c.abs() * dot(a, a).sqrt());
        parts.fold(dot(target, target).sqrt(), f64::max)
    }

    /// The Karush–Kuhn–Tucker conditions, to a share of the norm of each column times the [`size`] of the problem.
    fn assert_optimal(problem: &Problem, coefficients: &[f64], exact: f64) {
        let (columns, target, bounds) = problem;
        let size = size(problem, coefficients);
        let mut residual = target.clone();
        for (column, c) in columns.iter().zip(coefficients) {
            residual.iter_mut().zip(column).for_each(|(r, a)| *r -= c * a);
        }
        for (i, ((column, c), bounds)) in columns.iter().zip(coefficients).zip(bounds).enumerate() {
            assert!(bounds.contain(*c), "{i}: {c} in {bounds:?}");
            let unit = dot(column, column).sqrt() * size;
            let slope = if unit > 0.0 { dot(column, &residual) / unit } else { 0.0 };
            // Rounding may leave a coefficient next to its bound.
            let near = |end: f64| (c - end).abs() <= 1e-9 * end.abs();
            assert!(slope <= exact || near(bounds.high), "{i}: the sum would fall with more than {c}: {slope:e}");
            assert!(slope >= -exact || near(bounds.low), "{i}: the sum would fall with less than {c}: {slope:e}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn what_is_found_satisfies_the_optimality_conditions(problem in problem()) {
            let (columns, target, bounds) = &problem;
            let found = bounded_least_squares(columns, target, bounds).unwrap();
            assert_optimal(&problem, &found.coefficients, 1e-6);
            let residual: Vec<f64> = (0..target.len())
                .map(|k| target[k] - columns.iter().zip(&found.coefficients).map(|(a, c)| c * a[k]).sum::<f64>())
                .collect();
            let size = size(&problem, &found.coefficients);
            prop_assert!((dot(&residual, &residual) - found.sum_of_squares).abs() <= 1e-12 * size * size);
        }

        #[test]
        fn signs_are_kept_at_the_optimum_of_reduced_columns(
            (columns, target, drawn) in problem(),
            signs in vec(prop_oneof![Just(None), Just(Some(Sign::NotNegative)), Just(Some(Sign::NotPositive))], 8),
        ) {
            let signs = &signs[..columns.len()];
            let range = |s: &Option<Sign>| s.map_or(Bounds::OPEN, Sign::bounds);
            let bounds: Vec<Bounds> = signs.iter().map(range).collect();
            let reduced = Reduced::new(&columns, &target).bounded(signs);
            let usable: Vec<usize> = (0..drawn.len()).filter(|k| !reduced.unusable(*k)).collect();
            let mut coefficients = vec![0.0; columns.len()];
            usable.iter().zip(reduced.least_squares(&usable)).for_each(|(k, c)| coefficients[*k] = c);
            assert_optimal(&(columns, target, bounds), &coefficients, 1e-9);
        }
    }

    #[test]
    fn a_coefficient_that_was_held_on_the_way_is_released_where_that_is_better() {
        // Free, the second and third coefficient would be negative; beside a second one at zero the third is positive.
        let columns = [vec![1.0, 1.0, 1.0, 0.0], vec![0.9, 1.1, 1.0, 0.2], vec![0.0, 0.1, 0.0, 1.0]];
        let target = [1.0, 0.3, 0.6, 0.05];
        let positive = Bounds { low: 0.0, high: f64::INFINITY };
        let found = bounded_least_squares(&columns, &target, &[Bounds::OPEN, positive, positive]).unwrap();
        let problem = (columns.to_vec(), target.to_vec(), vec![Bounds::OPEN, positive, positive]);
        assert_optimal(&problem, &found.coefficients, 1e-9);
    }

    #[test]
    fn what_is_not_finite_has_no_solution() {
        assert_eq!(bounded_least_squares(&[[1.0, f64::NAN]], &[1.0, 1.0], &[Bounds::OPEN]), None);
        assert_eq!(bounded_least_squares(&[[1.0, 1.0]], &[f64::INFINITY, 1.0], &[Bounds::OPEN]), None);
        let nothing: [[f64; 2]; 0] = [];
        assert_eq!(bounded_least_squares(&nothing, &[3.0, 4.0], &[]).map(|s| s.sum_of_squares), Some(25.0));
    }
}
