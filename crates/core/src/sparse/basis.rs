//! Orthonormal bases of columns.

use fearless_simd::{Level, dispatch};

use crate::signal::{LANES, dot};

/// A column that is zero but for neighbouring rows.
#[derive(Clone, Debug)]
pub struct LocalColumn {
    /// The first of those rows.
    pub first: usize,
    /// What stands in them.
    pub values: Vec<f64>,
}

impl From<Vec<f64>> for LocalColumn {
    fn from(values: Vec<f64>) -> Self {
        Self { first: 0, values }
    }
}

/// An entry of a column of norm one below which it is lost in the rounding of the others.
const NEGLIGIBLE: f64 = 1e-18;

impl LocalColumn {
    fn end(&self) -> usize {
        self.first + self.values.len()
    }

    /// The column with all its rows, so many.
    pub fn whole(&self, rows: usize) -> Vec<f64> {
        let mut whole = vec![0.0; rows];
        whole[self.first..self.end()].copy_from_slice(&self.values);
        whole
    }

    /// Inner product with a column that has all rows.
    pub fn dot(&self, column: &[f64]) -> f64 {
        dot(&self.values, &column[self.first..self.end()])
    }

    fn norm(&self) -> f64 {
        dot(&self.values, &self.values).sqrt()
    }

    fn divide(&mut self, by: f64) {
        self.values.iter_mut().for_each(|c| *c /= by);
    }

    /// Has these rows too.
    fn reach(&mut self, first: usize, end: usize) {
        if first < self.first {
            self.values.splice(0..0, std::iter::repeat_n(0.0, self.first - first));
            self.first = first;
        }
        let length = end.saturating_sub(self.first).max(self.values.len());
        self.values.resize(length, 0.0);
    }

    /// Does without rows at its ends in which there is nothing; each row that stays keeps its lane in a sum.
    fn cut(&mut self) {
        let something = |c: &f64| c.abs() > NEGLIGIBLE;
        if let Some(last) = self.values.iter().rposition(something) {
            let end = (self.first + last + 1).next_multiple_of(LANES);
            self.values.truncate(end - self.first);
        }
        let first = self.first + self.values.iter().position(something).unwrap_or(0);
        let without = (first / LANES * LANES).saturating_sub(self.first);
        self.values.drain(..without);
        self.first += without;
    }
}

/// An orthonormal basis of columns with the same rows, taken in one after the other (Gram & Schmidt, each twice over). Columns that
/// are zero but for a few rows cost as little, if they are taken in before those that fill all rows.
#[derive(Clone, Debug)]
pub struct OrthonormalBasis {
    columns: Vec<LocalColumn>,
    least_share: f64,
}

impl Default for OrthonormalBasis {
    /// An empty basis that takes in columns of which more than a millionth lies outside.
    fn default() -> Self {
        Self::with_least_share(1e-6)
    }
}

impl OrthonormalBasis {
    /// An empty basis that takes in a column if more than this share of its norm lies outside.
    pub(crate) fn with_least_share(least_share: f64) -> Self {
        Self { columns: Vec::new(), least_share }
    }

    /// The basis' columns `Q`.
    pub fn columns(&self) -> &[LocalColumn] {
        &self.columns
    }

    /// Leaves of a column what lies outside the basis: `c − Q Qᵀ c`.
    pub fn remove(&self, column: &mut [f64]) {
        dispatch!(Level::new(), _simd => remove_each(&self.columns, column));
    }

    /// Takes a column into the basis, unless next to nothing of it lies outside; true if it was taken. A column that is zero
    /// or not finite is not.
    pub fn push(&mut self, column: impl Into<LocalColumn>) -> bool {
        let mut column = column.into();
        let whole = column.norm();
        if !(whole > 0.0 && whole.is_finite()) {
            return false;
        }
        column.divide(whole);
        for _ in 0..2 {
            dispatch!(Level::new(), _simd => remove_each_nearby(&self.columns, &mut column));
        }
        let left = column.norm();
        if left < self.least_share {
            return false;
        }
        column.divide(left);
        self.push_orthonormal(column);
        true
    }

    /// Takes in a column of norm one that is orthogonal to the basis already.
    pub fn push_orthonormal(&mut self, column: impl Into<LocalColumn>) {
        let mut column = column.into();
        column.cut();
        self.columns.push(column);
    }
}

#[inline(always)] // into each width of registers
fn remove_each(columns: &[LocalColumn], column: &mut [f64]) {
    for q in columns {
        remove(q, q.dot(column), &mut column[q.first..q.end()]);
    }
}

#[inline(always)] // into each width of registers
fn remove_each_nearby(columns: &[LocalColumn], column: &mut LocalColumn) {
    for q in columns {
        let (first, end) = (q.first.max(column.first), q.end().min(column.end()));
        if first >= end {
            continue;
        }
        let share =
            dot(&q.values[first - q.first..end - q.first], &column.values[first - column.first..end - column.first]);
        if share.abs() > NEGLIGIBLE {
            column.reach(q.first, q.end());
            let from = q.first - column.first;
            remove(q, share, &mut column.values[from..from + q.values.len()]);
        }
    }
}

#[inline(always)] // into each width of registers
fn remove(q: &LocalColumn, share: f64, rows: &mut [f64]) {
    rows.iter_mut().zip(&q.values).for_each(|(c, q)| *c -= share * q);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_a_few_rows_are_as_orthonormal() {
        let n = 700;
        let column = |first: usize, end: usize, w: f64| LocalColumn {
            first,
            values: (first..end).map(|i| (w * i as f64).cos()).collect(),
        };
        let mut basis = OrthonormalBasis::default();
        for (first, end) in [(0, 90), (90, 250), (250, 700)] {
            assert!(basis.push(column(first, end, 0.3)) && basis.push(column(first, end, 0.7)));
        }
        let few: usize = basis.columns().iter().map(|c| c.values.len()).sum();
        assert!(few < 2 * (n + 3 * LANES), "{few} values");
        assert!(basis.push(column(0, n, 0.45).whole(n)) && basis.push(column(60, 120, 0.1)));
        assert!(!basis.push(column(0, n, 0.3)), "it is the sum of three that were taken in");
        for (i, a) in basis.columns().iter().enumerate() {
            for (j, b) in basis.columns().iter().enumerate() {
                assert!((a.dot(&b.whole(n)) - f64::from(i == j)).abs() < 1e-14, "{i} and {j}");
            }
        }
        let mut rest = column(100, 400, 0.2).whole(n);
        basis.remove(&mut rest);
        assert!(basis.columns().iter().all(|q| q.dot(&rest).abs() < 1e-13));
    }

    #[test]
    fn columns_become_orthonormal_and_dependent_ones_stay_out() {
        let mut basis = OrthonormalBasis::default();
        assert!(basis.push(vec![3.0, 4.0, 0.0]));
        assert!(basis.push(vec![3.0, 4.0, 1e-4]), "nearly parallel, but not to a millionth");
        assert!(!basis.push(vec![-6.0, -8.0, 5.0]));
        assert!(!basis.push(vec![0.0; 3]) && !basis.push(vec![f64::NAN; 3]));
        let [a, b] = basis.columns() else { panic!("two columns") };
        let [a, b] = [&a.values[..], &b.values[..]];
        assert!((dot(a, a) - 1.0).abs() < 1e-15 && (dot(b, b) - 1.0).abs() < 1e-15 && dot(a, b).abs() < 1e-15);
        let mut rest = vec![4.0, -3.0, 7.0];
        basis.remove(&mut rest);
        assert!((rest[0] - 4.0).abs() < 1e-12 && (rest[1] + 3.0).abs() < 1e-12 && rest[2].abs() < 1e-12);
    }
}
