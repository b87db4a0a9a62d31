//! Candidate sets of columns, among which a threshold decides.

use super::{Constraint, Reduced, Solution, SparseOptions};

/// Sets of columns of rising size with what each leaves of the target: the candidates among which a threshold decides.
///
/// A set is worth another column if that explains a larger share of the target's RMS than the threshold τ: what is
/// smallest is the mean square left, as a share of the target's, plus τ² for each column. Of columns that are orthogonal
/// to each other exactly those whose scaled coefficient exceeds τ stay, as in thresholded least squares.
pub(super) struct CandidateModels {
    sets: Vec<(Vec<usize>, f64)>,
}

impl CandidateModels {
    /// The sets, each found by plain least squares to leave something.
    pub(super) fn new(reduced: &Reduced, constraints: &[Constraint], sets: impl Iterator<Item = Vec<usize>>) -> Self {
        let left = |set: &[usize]| {
            let share = Solution::on(reduced, constraints, set.to_vec()).residual_rms / reduced.target_scale();
            if share.is_finite() { share * share } else { 0.0 }
        };
        Self {
            sets: sets
                .map(|set| {
                    let left = left(&set);
                    (set, left)
                })
                .collect(),
        }
    }

    /// Each set's columns.
    pub(super) fn supports(&self) -> impl Iterator<Item = &[usize]> {
        self.sets.iter().map(|(set, _)| set.as_slice())
    }

    /// The set that the threshold decides for, and the threshold at which another takes its place.
    fn decide(&self, threshold: f64) -> (&[usize], f64) {
        let cost = |(set, left): &(Vec<usize>, f64)| left + threshold * threshold * set.len() as f64;
        let smaller = |a: &&(Vec<usize>, f64), b: &&(Vec<usize>, f64)| {
            cost(a).total_cmp(&cost(b)).then(a.0.len().cmp(&b.0.len()))
        };
        let Some((set, left)) = self.sets.iter().min_by(smaller) else { return (&[], f64::INFINITY) };
        let change = self
            .sets
            .iter()
            .filter(|(other, _)| other.len() < set.len())
            .map(|(other, more)| ((more - left).max(0.0) / (set.len() - other.len()) as f64).sqrt())
            .fold(f64::INFINITY, f64::min);
        (set, change.max(threshold))
    }

    /// The solution at the options' threshold, which is a share of the target's RMS whatever the scaling.
    pub(super) fn solution(&self, reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Solution {
        let (set, next_change) = self.decide(options.threshold);
        Solution { next_change, ..Solution::on(reduced, constraints, set.to_vec()) }
    }
}
