use serde::{Deserialize, Serialize};

use super::front::Front;
use super::{Constraint, Options, Reduced, Solution, bayes, best_subset, frols, sr3, ssr, stlsq};

/// Ways to a sparse solution. Each starts from the same reduction, ends with plain least squares on the columns that it
/// keeps, and drops more as the threshold rises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Regressor {
    /// Sequentially thresholded least squares.
    #[default]
    Stlsq,
    /// Sparse relaxed regularized regression with a penalty on the number of terms.
    #[serde(rename = "sr3-l0")]
    Sr3L0,
    /// The same with a penalty on the sum of their magnitudes.
    #[serde(rename = "sr3-l1")]
    Sr3L1,
    /// Stepwise elimination of the smallest coefficient.
    Ssr,
    /// Forward selection of the column that explains most, orthogonal to those before.
    Frols,
    /// The best of all subsets.
    BestSubset,
    /// The terms that belong to the equation more likely than not, all subsets weighed.
    Bayes,
}

impl Regressor {
    /// Every way.
    pub const ALL: [Self; 7] =
        [Self::Stlsq, Self::Sr3L0, Self::Sr3L1, Self::Ssr, Self::Frols, Self::BestSubset, Self::Bayes];

    /// The sparse solution at the options' threshold; `constraints` holds one entry a column.
    pub fn solve(self, reduced: &Reduced, constraints: &[Constraint], options: &Options) -> Solution {
        match self {
            Self::Stlsq => stlsq(reduced, constraints, options),
            Self::Sr3L0 => sr3::sr3(reduced, constraints, options, sr3::Penalty::Count, sr3::RELAXATION),
            Self::Sr3L1 => sr3::sr3(reduced, constraints, options, sr3::Penalty::Magnitude, sr3::RELAXATION),
            Self::Bayes => bayes::bayes(reduced, constraints, options),
            Self::Ssr | Self::Frols | Self::BestSubset => {
                self.front(reduced, constraints, options).solution(reduced, constraints, options)
            }
        }
    }

    /// The sets of columns that a way of nested or best sets goes through.
    fn front(self, reduced: &Reduced, constraints: &[Constraint], options: &Options) -> Front {
        match self {
            Self::Ssr => ssr::ssr(reduced, constraints, options),
            Self::Frols => frols::frols(reduced, constraints),
            _ => best_subset::best_subsets(reduced, constraints),
        }
    }

    /// The solutions as the threshold rises from zero, each with the threshold from which on it holds, up to that of the
    /// next.
    ///
    /// Exact for all but relaxed and Bayesian regression, of which thresholds 6 % apart are tried.
    pub fn path(self, reduced: &Reduced, constraints: &[Constraint], options: &Options) -> Vec<(f64, Solution)> {
        match self {
            Self::Stlsq => exact(&|threshold| stlsq(reduced, constraints, &Options { threshold, ..*options })),
            Self::Ssr | Self::Frols | Self::BestSubset => {
                let front = self.front(reduced, constraints, options);
                exact(&|threshold| front.solution(reduced, constraints, &Options { threshold, ..*options }))
            }
            Self::Sr3L0 | Self::Sr3L1 | Self::Bayes => self.tried(reduced, constraints, options),
        }
    }

    /// The path of a way that does not know where it changes.
    fn tried(self, reduced: &Reduced, constraints: &[Constraint], options: &Options) -> Vec<(f64, Solution)> {
        const STEP: f64 = 1.06;
        const SMALLEST: f64 = 1e-4;
        const MOST: usize = 250;
        let solve = |threshold: f64| self.solve(reduced, constraints, &Options { threshold, ..*options });
        let whole = solve(0.0);
        let sizes = (0..reduced.columns()).filter(|k| whole.coefficients[*k] != 0.0).map(|k| {
            let standard = if options.scaled { reduced.scale()[k] / reduced.target_scale() } else { 1.0 };
            (whole.coefficients[k] * standard).abs()
        });
        let smallest = sizes.fold(f64::INFINITY, f64::min);
        let mut path = vec![(0.0, whole)];
        let mut threshold = (0.3 * smallest).clamp(SMALLEST, 1.0);
        for _ in 0..MOST {
            let next = solve(threshold);
            let emptied = next.support.iter().all(|k| constraints[*k] == Constraint::In);
            if path.last().is_some_and(|(_, before)| before.support != next.support) {
                path.push((threshold, next));
            }
            if emptied {
                break;
            }
            threshold *= STEP;
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
pub fn drop_path(path: &[(f64, Solution)]) -> Vec<(f64, usize)> {
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
