//! Orthonormal bases of columns.

use fearless_simd::{Level, dispatch};

use crate::signal::{LANES, dot};

/// Neighbouring rows of a column.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    /// The first of them.
    pub first: usize,
    /// What stands in them.
    pub values: Vec<f64>,
}

impl Stretch {
    fn end(&self) -> usize {
        self.first + self.values.len()
    }

    /// Inner product over the rows that two stretches share; none if they share none.
    fn dot(&self, other: &Self) -> Option<f64> {
        let (first, end) = (self.first.max(other.first), self.end().min(other.end()));
        let shared = |s: &'_ Self| first - s.first..end - s.first;
        (first < end).then(|| dot(&self.values[shared(self)], &other.values[shared(other)]))
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
        let last = self.values.iter().rposition(something);
        let end = last.map_or(self.first, |last| (self.first + last + 1).next_multiple_of(LANES));
        self.values.truncate(end - self.first);
        let first = self.first + self.values.iter().position(something).unwrap_or(0);
        let without = (first / LANES * LANES).saturating_sub(self.first);
        self.values.drain(..without);
        self.first += without;
    }
}

/// A column that is zero but for stretches of neighbouring rows.
#[derive(Clone, Debug, Default)]
pub struct LocalColumn {
    /// In the order of their rows, none overlapping or touching the next.
    stretches: Vec<Stretch>,
}

impl From<Vec<f64>> for LocalColumn {
    fn from(values: Vec<f64>) -> Self {
        Self { stretches: vec![Stretch { first: 0, values }] }
    }
}

/// The sum of stretches, in any order.
impl FromIterator<Stretch> for LocalColumn {
    fn from_iter<I: IntoIterator<Item = Stretch>>(stretches: I) -> Self {
        let mut column = Self::default();
        for stretch in stretches.into_iter().filter(|stretch| !stretch.values.is_empty()) {
            column.add(&stretch, 1.0);
        }
        column
    }
}

/// An entry of a column of norm one below which it is lost in the rounding of the others.
const NEGLIGIBLE: f64 = 1e-18;

impl LocalColumn {
    /// The rows in which there is something, in their order.
    pub fn stretches(&self) -> &[Stretch] {
        &self.stretches
    }

    /// The column with all its rows, so many.
    pub fn whole(&self, rows: usize) -> Vec<f64> {
        let mut whole = vec![0.0; rows];
        for s in &self.stretches {
            whole[s.first..s.end()].copy_from_slice(&s.values);
        }
        whole
    }

    /// Inner product with a column that has all rows.
    pub fn dot(&self, column: &[f64]) -> f64 {
        self.stretches.iter().map(|s| dot(&s.values, &column[s.first..s.end()])).sum()
    }

    fn norm(&self) -> f64 {
        self.stretches.iter().map(|s| dot(&s.values, &s.values)).sum::<f64>().sqrt()
    }

    fn divide(&mut self, by: f64) {
        self.stretches.iter_mut().flat_map(|s| &mut s.values).for_each(|c| *c /= by);
    }

    /// Adds so many times a stretch.
    #[inline(always)] // into each width of registers
    fn add(&mut self, stretch: &Stretch, times: f64) {
        let own = self.holding(stretch.first, stretch.end());
        let from = stretch.first - own.first;
        let rows = own.values[from..from + stretch.values.len()].iter_mut();
        rows.zip(&stretch.values).for_each(|(c, q)| *c += times * q);
    }

    /// The stretch that holds these rows: those that overlap or touch them become one.
    fn holding(&mut self, first: usize, end: usize) -> &mut Stretch {
        let from = self.stretches.partition_point(|s| s.end() < first);
        let to = self.stretches.partition_point(|s| s.first <= end);
        if from == to {
            self.stretches.insert(from, Stretch { first, values: vec![0.0; end - first] });
        } else {
            let end = end.max(self.stretches[to - 1].end());
            let others: Vec<Stretch> = self.stretches.drain(from + 1..to).collect();
            let own = &mut self.stretches[from];
            own.reach(first, end);
            for other in others {
                own.values[other.first - own.first..][..other.values.len()].copy_from_slice(&other.values);
            }
        }
        &mut self.stretches[from]
    }

    fn cut(&mut self) {
        self.stretches.iter_mut().for_each(Stretch::cut);
        self.stretches.retain(|s| !s.values.is_empty());
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
        let share = q.dot(column);
        for s in &q.stretches {
            column[s.first..s.end()].iter_mut().zip(&s.values).for_each(|(c, q)| *c -= share * q);
        }
    }
}

#[inline(always)] // into each width of registers
fn remove_each_nearby(columns: &[LocalColumn], column: &mut LocalColumn) {
    for q in columns {
        let pairs = q.stretches.iter().flat_map(|s| column.stretches.iter().filter_map(|own| s.dot(own)));
        let share: f64 = pairs.sum();
        if share.abs() > NEGLIGIBLE {
            q.stretches.iter().for_each(|s| column.add(s, -share));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_a_few_rows_are_as_orthonormal() {
        let n = 700;
        let stretch = |first: usize, end: usize, w: f64| Stretch {
            first,
            values: (first..end).map(|i| (w * i as f64).cos()).collect(),
        };
        let column = |first: usize, end: usize, w: f64| LocalColumn::from_iter([stretch(first, end, w)]);
        let mut basis = OrthonormalBasis::default();
        for (first, end) in [(0, 90), (90, 250), (250, 700)] {
            assert!(basis.push(column(first, end, 0.3)) && basis.push(column(first, end, 0.7)));
        }
        let few: usize = basis.columns().iter().flat_map(LocalColumn::stretches).map(|s| s.values.len()).sum();
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
    fn columns_of_stretches_far_apart_stay_as_short() {
        let n = 1000;
        let wave = |first: usize, w: f64| Stretch {
            first,
            values: (first..first + 50).map(|i| (w * i as f64).cos()).collect(),
        };
        // What begins each of ten runs, as two sensors see it: one behind the other in the rows.
        let column = |run: usize, w: f64| LocalColumn::from_iter([wave(500 + 50 * run, w), wave(50 * run, 0.7 * w)]);
        let mut basis = OrthonormalBasis::default();
        for run in 0..10 {
            assert!([0.3, 0.5, 0.9].map(|w| basis.push(column(run, w))).iter().all(|taken| *taken));
            assert!(!basis.push(column(run, 0.5)));
        }
        let of_column = |c: &LocalColumn| c.stretches().iter().map(|s| s.values.len()).sum::<usize>();
        assert!(basis.columns().iter().all(|c| c.stretches().len() == 2 && of_column(c) < 100 + 4 * LANES));
        for (i, a) in basis.columns().iter().enumerate() {
            for (j, b) in basis.columns().iter().enumerate() {
                assert!((a.dot(&b.whole(n)) - f64::from(i == j)).abs() < 1e-14, "{i} and {j}");
            }
        }
        let joined = LocalColumn::from_iter([wave(0, 0.3), wave(100, 0.3), wave(30, 0.3), wave(70, 0.3)]);
        let [all] = joined.stretches() else { panic!("one stretch") };
        assert!((all.first, all.values.len()) == (0, 150) && all.values[90] == (0.3 * 90.0_f64).cos());
        assert_eq!(all.values[40], 2.0 * (0.3 * 40.0_f64).cos());
    }

    #[test]
    fn columns_become_orthonormal_and_dependent_ones_stay_out() {
        let mut basis = OrthonormalBasis::default();
        assert!(basis.push(vec![3.0, 4.0, 0.0]));
        assert!(basis.push(vec![3.0, 4.0, 1e-4]), "nearly parallel, but not to a millionth");
        assert!(!basis.push(vec![-6.0, -8.0, 5.0]));
        assert!(!basis.push(vec![0.0; 3]) && !basis.push(vec![f64::NAN; 3]));
        let [a, b] = basis.columns() else { panic!("two columns") };
        let [a, b] = [&a.whole(3)[..], &b.whole(3)[..]];
        assert!((dot(a, a) - 1.0).abs() < 1e-15 && (dot(b, b) - 1.0).abs() < 1e-15 && dot(a, b).abs() < 1e-15);
        let mut rest = vec![4.0, -3.0, 7.0];
        basis.remove(&mut rest);
        assert!((rest[0] - 4.0).abs() < 1e-12 && (rest[1] + 3.0).abs() < 1e-12 && rest[2].abs() < 1e-12);
    }
}
