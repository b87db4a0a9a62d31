//! Which terms of a library are sums of others, so that one force can be written in several ways.

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::sparse::Redundancy;
use sindyscope_values::term::{Expression, Term};

/// The relations among terms that are sums of the same parts: `x2-x1` of `x2` and `x1`.
pub(super) fn redundancy(terms: &[Term]) -> Option<Arc<Redundancy>> {
    let sums: Vec<Vec<(f64, Term)>> = terms.iter().map(|t| parts(t.expression())).collect();
    // Most libraries have no sums at all.
    if sums.iter().all(|s| s.len() < 2) {
        return None;
    }
    let mut all: Vec<&Term> = sums.iter().flatten().map(|(_, part)| part).collect();
    all.sort_unstable();
    all.dedup();
    let mut matrix = DMatrix::zeros(all.len(), terms.len());
    for (k, sum) in sums.iter().enumerate() {
        for (weight, part) in sum {
            if let Ok(row) = all.binary_search(&part) {
                matrix[(row, k)] += weight;
            }
        }
    }
    Redundancy::new(&matrix).map(Arc::new)
}

/// The parts of a sum, each with the number in front of it.
fn parts(expression: &Expression) -> Vec<(f64, Term)> {
    let addends =
        if let Expression::Sum(parts) = expression { parts.as_slice() } else { std::slice::from_ref(expression) };
    addends.iter().map(Expression::apart).map(|(factor, rest)| (factor, Term::new(rest))).collect()
}
