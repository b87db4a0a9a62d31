//! Orthonormal bases of columns.

use fearless_simd::{Level, dispatch};

use crate::signal::dot;

/// An orthonormal basis of columns of one length, taken in one after the other (Gram & Schmidt, each twice over).
#[derive(Clone, Debug)]
pub struct OrthonormalBasis {
    columns: Vec<Vec<f64>>,
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

    /// A basis of columns that are orthonormal already.
    pub fn from_orthonormal(columns: Vec<Vec<f64>>) -> Self {
        Self { columns, ..Self::default() }
    }

    /// The basis' columns `Q`.
    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// The basis' columns `Q`.
    pub fn into_columns(self) -> Vec<Vec<f64>> {
        self.columns
    }

    /// Leaves of a column what lies outside the basis: `c − Q Qᵀ c`.
    pub fn remove(&self, column: &mut [f64]) {
        dispatch!(Level::new(), _simd => remove_each(&self.columns, column));
    }

    /// Takes a column into the basis, unless next to nothing of it lies outside; true if it was taken. A column that is zero
    /// or not finite is not.
    pub fn push(&mut self, mut column: Vec<f64>) -> bool {
        let whole = dot(&column, &column).sqrt();
        if !(whole > 0.0 && whole.is_finite()) {
            return false;
        }
        column.iter_mut().for_each(|c| *c /= whole);
        self.remove(&mut column);
        self.remove(&mut column);
        let left = dot(&column, &column).sqrt();
        if left < self.least_share {
            return false;
        }
        column.iter_mut().for_each(|c| *c /= left);
        self.push_orthonormal(column);
        true
    }

    /// Takes in a column of norm one that is orthogonal to the basis already.
    pub fn push_orthonormal(&mut self, column: Vec<f64>) {
        self.columns.push(column);
    }
}

#[inline(always)] // into each width of registers
fn remove_each(columns: &[Vec<f64>], column: &mut [f64]) {
    for q in columns {
        let share = dot(q, column);
        column.iter_mut().zip(q).for_each(|(c, q)| *c -= share * q);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_orthonormal_and_dependent_ones_stay_out() {
        let mut basis = OrthonormalBasis::default();
        assert!(basis.push(vec![3.0, 4.0, 0.0]));
        assert!(basis.push(vec![3.0, 4.0, 1e-4]), "nearly parallel, but not to a millionth");
        assert!(!basis.push(vec![-6.0, -8.0, 5.0]));
        assert!(!basis.push(vec![0.0; 3]) && !basis.push(vec![f64::NAN; 3]));
        let [a, b] = basis.columns() else { panic!("two columns") };
        assert!((dot(a, a) - 1.0).abs() < 1e-15 && (dot(b, b) - 1.0).abs() < 1e-15 && dot(a, b).abs() < 1e-15);
        let mut rest = vec![4.0, -3.0, 7.0];
        basis.remove(&mut rest);
        assert!((rest[0] - 4.0).abs() < 1e-12 && (rest[1] + 3.0).abs() < 1e-12 && rest[2].abs() < 1e-12);
    }
}
