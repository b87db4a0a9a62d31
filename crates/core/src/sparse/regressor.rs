//! The choice among ways to a sparse solution, and each way's course along the threshold.

use serde::{Deserialize, Serialize};

use super::candidate_models::CandidateModels;
use super::writing::{self, one_writing};
use super::{Constraint, Reduced, Solution, SparseOptions, bayes, best_subset, frols, sr3, ssr, stlsq};

/// Ways to a sparse solution. Each starts from the same reduction, ends with plain least squares on the columns that it
/// keeps, drops more as the threshold rises, and keeps of orthogonal columns those whose coefficient exceeds it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Regressor {
    /// Sequentially thresholded least squares (Brunton, Proctor & Kutz 2016).
    #[default]
    Stlsq,
    /// Sparse relaxed regularized regression with a penalty on the number of terms (Zheng et al. 2019); ν = 1.
    #[serde(rename = "sr3-l0")]
    Sr3L0,
    /// Sparse relaxed regularized regression with a penalty on the sum of the coefficients' magnitudes; ν = 1.
    #[serde(rename = "sr3-l1")]
    Sr3L1,
    /// Stepwise elimination of the smallest coefficient (Boninsegna, Nüske & Clementi 2018).
    ///
    /// This way, [`Self::Frols`] and [`Self::BestSubset`] give one set of terms of each size. Among these the threshold τ
    /// decides: the set whose mean square residual, as a share of the target's, plus τ² for each term is smallest.
    Ssr,
    /// Forward selection of the column that explains most, orthogonal to those before (Chen, Billings & Luo 1989).
    Frols,
    /// The best of all subsets: exact up to 16 free columns; of more, those that elimination keeps longest.
    BestSubset,
    /// Spike and slab: the terms that belong more likely than not (George & `McCulloch` 1993).
    Bayes,
}

impl Regressor {
    /// Every way.
    pub const ALL: [Self; 7] =
        [Self::Stlsq, Self::Sr3L0, Self::Sr3L1, Self::Ssr, Self::Frols, Self::BestSubset, Self::Bayes];

    /// The name in commands and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stlsq => "stlsq",
            Self::Sr3L0 => "sr3-l0",
            Self::Sr3L1 => "sr3-l1",
            Self::Ssr => "ssr",
            Self::Frols => "frols",
            Self::BestSubset => "best-subset",
            Self::Bayes => "bayes",
        }
    }

    /// The name in a sentence.
    pub fn title(self) -> &'static str {
        match self {
            Self::Stlsq => "sequentially thresholded least squares (STLSQ)",
            Self::Sr3L0 => "sparse relaxed regularized regression (SR3), L0",
            Self::Sr3L1 => "sparse relaxed regularized regression (SR3), L1",
            Self::Ssr => "stepwise elimination (SSR)",
            Self::Frols => "forward orthogonal selection (FROLS)",
            Self::BestSubset => "best subset, all tried",
            Self::Bayes => "Bayesian, spike and slab",
        }
    }

    /// The sparse solution at the options' threshold; `constraints` holds one entry a column. Of columns that are sums of
    /// each other those are used that write the same with the smallest forces.
    pub fn solve(self, reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Solution {
        let written = |solve: &dyn Fn(&[Constraint]) -> Solution| writing::solve(reduced, constraints, options, solve);
        match self {
            Self::Stlsq => written(&|c| stlsq(reduced, c, options)),
            Self::Sr3L0 => written(&|c| sr3::sr3(reduced, c, options, sr3::Penalty::Count)),
            Self::Sr3L1 => written(&|c| sr3::sr3(reduced, c, options, sr3::Penalty::Magnitude)),
            Self::Bayes => written(&|c| bayes::bayes(reduced, c, options)),
            Self::Ssr | Self::Frols | Self::BestSubset => {
                self.front(reduced, constraints, options).solution(reduced, constraints, options)
            }
        }
    }

    /// The sets of columns, the smallest first, that a way of one set for each size goes through; none of the others.
    pub fn supports(self, reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Vec<Vec<usize>> {
        match self {
            Self::Ssr | Self::Frols | Self::BestSubset => {
                self.front(reduced, constraints, options).supports().map(<[usize]>::to_vec).collect()
            }
            Self::Stlsq | Self::Sr3L0 | Self::Sr3L1 | Self::Bayes => Vec::new(),
        }
    }

    fn front(self, reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> CandidateModels {
        let constraints = &one_writing(reduced, constraints, options);
        match self {
            Self::Ssr => ssr::ssr(reduced, constraints, options),
            Self::Frols => frols::frols(reduced, constraints),
            _ => best_subset::best_subsets(reduced, constraints),
        }
    }

    /// The solutions as the threshold rises from zero, each with the threshold from which on it holds, up to that of the
    /// next.
    ///
    /// Exact but for relaxed and Bayesian regression, where thresholds 15 % apart are tried and a change between two is
    /// narrowed down to 0.1 %.
    pub fn path(self, reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Vec<(f64, Solution)> {
        match self {
            Self::Stlsq => {
                exact(&|threshold| self.solve(reduced, constraints, &SparseOptions { threshold, ..*options }))
            }
            Self::Ssr | Self::Frols | Self::BestSubset => {
                let front = self.front(reduced, constraints, options);
                exact(&|threshold| front.solution(reduced, constraints, &SparseOptions { threshold, ..*options }))
            }
            Self::Sr3L0 | Self::Sr3L1 | Self::Bayes => self.tried(reduced, constraints, options),
        }
    }

    /// The path of a way that does not know where it changes.
    fn tried(self, reduced: &Reduced, constraints: &[Constraint], options: &SparseOptions) -> Vec<(f64, Solution)> {
        const STEP: f64 = 1.15;
        const NARROW: f64 = 1.001;
        const SPAN: f64 = 1e-6;
        let solve = |threshold: f64| self.solve(reduced, constraints, &SparseOptions { threshold, ..*options });
        let whole = solve(0.0);
        let sizes: Vec<f64> = (0..reduced.columns())
            .filter(|k| constraints[*k] == Constraint::Free && whole.coefficients[*k] != 0.0)
            .map(|k| {
                let unit = if options.scaled { reduced.scale()[k] / reduced.target_scale() } else { 1.0 };
                (whole.coefficients[k] * unit).abs()
            })
            .collect();
        let (smallest, largest) = sizes.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), s| (a.min(*s), b.max(*s)));
        let mut path = vec![(0.0, whole)];
        if largest == 0.0 || !largest.is_finite() {
            return path;
        }
        let mut threshold = 0.3 * smallest.max(SPAN * largest);
        let mut last = 0.0;
        // A column alone may be worth more than it was among the others.
        while threshold < 1e3 * largest {
            let next = solve(threshold);
            let emptied = next.support.iter().all(|k| constraints[*k] == Constraint::In);
            if path.last().is_some_and(|(_, before)| before.support != next.support) {
                let (mut below, mut above, mut found) = (last, threshold, next);
                while below > 0.0 && above > NARROW * below {
                    let middle = f64::sqrt(below * above);
                    let between = solve(middle);
                    if path.last().is_some_and(|(_, before)| before.support == between.support) {
                        below = middle;
                    } else {
                        (above, found) = (middle, between);
                    }
                }
                path.push((above, found));
                // Another change may hide between this one and the threshold tried.
                last = above;
                threshold = if above < threshold { (NARROW * above).min(threshold) } else { threshold * STEP };
            } else {
                last = threshold;
                threshold *= STEP;
            }
            if emptied && path.last().is_some_and(|(_, s)| s.support.iter().all(|k| constraints[*k] == Constraint::In))
            {
                break;
            }
        }
        path
    }
}

/// The path of a way whose solutions say where they change.
fn exact(solve: &dyn Fn(f64) -> Solution) -> Vec<(f64, Solution)> {
    const MOST: usize = 400;
    let mut path = vec![(0.0, solve(0.0))];
    while let Some((_, before)) = path.last()
        && before.next_change.is_finite()
        && path.len() <= MOST
    {
        let change = before.next_change;
        path.push((change, solve(change.next_up().max(change * (1.0 + 1e-12)))));
    }
    path
}

/// The thresholds at which columns leave as the threshold rises from zero, ascending, each with the column that leaves.
///
/// A column that comes back at a higher threshold (collinear columns can) is listed where it leaves for good.
pub(crate) fn drop_path(path: &[(f64, Solution)]) -> Vec<(f64, usize)> {
    let columns = path.first().map_or(0, |(_, s)| s.coefficients.len());
    let mut leaves: Vec<Option<f64>> = vec![None; columns];
    for pair in path.windows(2) {
        let [(_, before), (change, after)] = pair else { continue };
        for k in &before.support {
            if !after.support.contains(k) {
                leaves[*k] = Some(*change);
            }
        }
    }
    for k in path.last().into_iter().flat_map(|(_, s)| &s.support) {
        leaves[*k] = None;
    }
    let mut path: Vec<(f64, usize)> = leaves.iter().enumerate().filter_map(|(k, at)| at.map(|at| (at, k))).collect();
    path.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    path
}

/// A threshold well inside an interval between two marks.
pub fn between(below: f64, above: f64) -> f64 {
    match (below > 0.0, above.is_finite()) {
        (true, true) => (below * above).sqrt(),
        (true, false) => 2.0 * below,
        (false, true) => 0.3 * above,
        (false, false) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = a − 0.5b + 0.1c (+ 0.02d in places that nothing else explains), orthogonal columns, units far apart.
    fn problem(unit: f64) -> Reduced {
        let n = 2000;
        let wave = |cycles: f64| -> Vec<f64> {
            (0..n).map(|k| (2.0 * std::f64::consts::PI * cycles * f64::from(k) / f64::from(n)).sin()).collect()
        };
        let (a, b, c, d, e) = (wave(3.0), wave(7.0), wave(11.0), wave(19.0), wave(23.0));
        let y: Vec<f64> = (0..n as usize).map(|k| a[k] - 0.5 * b[k] + 0.1 * c[k] + 0.03 * d[k]).collect();
        Reduced::new(&[a, b.iter().map(|v| v * unit).collect(), c, d, e], &y)
    }

    fn options(threshold: f64, scaled: bool) -> SparseOptions {
        SparseOptions { threshold, ridge: 0.0, scaled }
    }

    #[test]
    fn of_orthogonal_columns_every_way_keeps_those_beyond_the_threshold() {
        for regressor in Regressor::ALL {
            for unit in [1.0, 1e-3] {
                let reduced = problem(unit);
                // RMS of the target is 1.12/√2: scaled coefficients are 0.89, 0.44, 0.089 and 0.027.
                for (threshold, kept) in [(0.01, 4), (0.05, 3), (0.2, 2), (0.6, 1), (2.0, 0)] {
                    let solution = regressor.solve(&reduced, &[Constraint::Free; 5], &options(threshold, true));
                    let wanted: Vec<usize> = (0..kept).collect();
                    assert_eq!(solution.support, wanted, "{regressor:?} {threshold} {unit}");
                    if kept > 1 {
                        assert!((solution.coefficients[1] * unit + 0.5).abs() < 1e-9, "{regressor:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn every_way_honours_what_was_decided() {
        let reduced = problem(1.0);
        let decided = [Constraint::Fixed(0.8), Constraint::Out, Constraint::Free, Constraint::Free, Constraint::In];
        for regressor in Regressor::ALL {
            for scaled in [true, false] {
                let solution = regressor.solve(&reduced, &decided, &options(0.06, scaled));
                assert_eq!(solution.support, [2, 4], "{regressor:?} {scaled}");
                assert_eq!((solution.coefficients[0], solution.coefficients[1]), (0.8, 0.0));
            }
        }
    }

    #[test]
    fn every_path_ends_empty_and_says_what_solving_says() {
        let mut random = 1_u32;
        let mut noise = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random) / f64::from(u32::MAX) - 0.5
        };
        let common: Vec<f64> = (0..300).map(|_| noise()).collect();
        let columns: Vec<Vec<f64>> = (0..8).map(|_| common.iter().map(|c| c + noise()).collect()).collect();
        let y: Vec<f64> =
            (0..300).map(|r| columns[0][r] - 0.6 * columns[1][r] + 0.2 * columns[2][r] + 0.3 * noise()).collect();
        let reduced = Reduced::new(&columns, &y);
        let free = [Constraint::Free; 8];
        for regressor in Regressor::ALL {
            let path = regressor.path(&reduced, &free, &options(0.0, true));
            assert!(path.last().is_some_and(|(_, s)| s.support.is_empty()), "{regressor:?}");
            assert!(path.windows(2).all(|w| w[0].0 < w[1].0), "{regressor:?}");
            for (k, (from, solution)) in path.iter().enumerate() {
                // A little inside the interval: where a way that is tried changes is known to 0.1 %.
                let to = path.get(k + 1).map_or(2.0 * from, |next| next.0);
                if to > 1.01 * from {
                    let threshold = if *from == 0.0 { 0.5 * to } else { (from * to).sqrt() };
                    let there = regressor.solve(&reduced, &free, &options(threshold, true));
                    assert_eq!(there.support, solution.support, "{regressor:?} {threshold}");
                }
            }
            assert_eq!(drop_path(&path).len(), path[0].1.support.len(), "{regressor:?}: each leaves once");
        }
    }

    #[test]
    fn nothing_to_choose_from_is_no_catastrophe() {
        let reduced = Reduced::new(&[vec![0.0; 10], vec![f64::NAN; 10]], &[0.0; 10]);
        let none = Reduced::new(&Vec::<Vec<f64>>::new(), &[1.0, 2.0]);
        for regressor in Regressor::ALL {
            assert!(regressor.solve(&reduced, &[Constraint::Free; 2], &options(0.1, true)).support.is_empty());
            assert_eq!(regressor.path(&reduced, &[Constraint::Free; 2], &options(0.1, false)).len(), 1);
            assert!(regressor.path(&none, &[], &options(0.1, true))[0].1.coefficients.is_empty());
        }
    }
}
