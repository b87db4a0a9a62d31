//! A set of effects fitted to its end: coefficients by linear least squares, inner quantities by Levenberg and Marquardt's steps
//! on what the linear part leaves.
//!
//! The motion is given, so nothing is integrated but the effects' own states, and no effect changes another's columns.
//!
//! Source: G. Golub, V. Pereyra, "Separable nonlinear least squares", Inverse Problems 19 (2003) R1.

use nalgebra::{DMatrix, DVector};

use super::columns::{ComponentRows, columns, plain_columns};
use super::effect::ForceForm;
use super::specimen::Specimen;
use sindyscope_core::signal::dot;
use sindyscope_core::study::Cancel;
use sindyscope_values::term::{Expression, Symbol, Term};

/// Steps of a fit, at most.
const MAX_STEPS: usize = 20;
/// A step that lowers the sum of squares by a smaller share is the last.
const LEAST_GAIN: f64 = 1e-6;
/// Step of a difference quotient, as a share of an inner quantity's range.
const DIFFERENCE: f64 = 1e-4;
/// Grid points from which a fit begins.
const STARTS: usize = 2;
/// Correlation of the residual from one lag on which counts as none.
const UNCORRELATED: f64 = 0.05;
/// First samples of a record that tell where a state begins.
const HEAD: usize = 4;
/// Ridge on columns of length one: keeps columns that depend on each other solvable.
const RIDGE: f64 = 1e-12;

/// A model of a component: base terms and effects with their values.
#[derive(Clone, Debug)]
pub(crate) struct FittedComponent {
    /// Effects, by index in the catalogue.
    pub(crate) set: Vec<usize>,
    /// Inner quantities of each effect.
    pub(crate) inner: Vec<Vec<f64>>,
    /// Coefficients of the base terms, then of each effect's.
    pub(crate) coefficients: Vec<f64>,
    /// Standard errors of the same, for correlated residuals.
    pub(crate) errors: Vec<f64>,
    /// Standard errors of the inner quantities.
    pub(crate) inner_errors: Vec<Vec<f64>>,
    /// RMS of each coefficient's part of the force over the fitted rows.
    pub(crate) parts: Vec<f64>,
    /// What is left at every row.
    pub(crate) residual: Vec<f64>,
}

impl FittedComponent {
    /// Number of values that were fitted.
    pub(crate) fn unknowns(&self) -> usize {
        self.coefficients.len() + self.inner.iter().map(Vec::len).sum::<usize>()
    }

    /// The coefficients of an effect, by its place in the set.
    pub(crate) fn of_effect(&self, place: usize, forms: &[ForceForm], base: usize) -> std::ops::Range<usize> {
        let before: usize = self.set[..place].iter().map(|k| forms[*k].coefficients.len()).sum();
        base + before..base + before + forms[self.set[place]].coefficients.len()
    }
}

/// Fits sets of effects to a specimen.
pub(crate) struct ComponentFitter<'a> {
    pub(crate) specimen: &'a Specimen,
    pub(crate) forms: &'a [ForceForm],
    pub(crate) rows: ComponentRows,
    /// Columns of the base terms.
    base: Vec<Vec<f64>>,
    force: Vec<f64>,
    cancel: &'a Cancel,
}

/// What a linear fit gives.
struct LinearFit {
    coefficients: Vec<f64>,
    squares: f64,
}

impl<'a> ComponentFitter<'a> {
    pub(crate) fn new(
        specimen: &'a Specimen,
        base: &[Term],
        forms: &'a [ForceForm],
        rows: ComponentRows,
        cancel: &'a Cancel,
    ) -> Self {
        let force = specimen.paths.iter().flat_map(|p| p.force.iter().copied()).collect();
        Self { specimen, forms, rows, base: plain_columns(specimen, base), force, cancel }
    }

    pub(crate) fn base(&self) -> usize {
        self.base.len()
    }

    fn over_seen(&self, a: &[f64], b: &[f64]) -> f64 {
        self.rows.seen.iter().map(|r| dot(&a[r.clone()], &b[r.clone()])).sum()
    }

    fn linear(&self, columns: &[&[f64]]) -> LinearFit {
        let n = columns.len();
        let mut gram = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                gram[(i, j)] = self.over_seen(columns[i], columns[j]);
            }
        }
        let lengths: Vec<f64> = (0..n).map(|i| gram[(i, i)].sqrt()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| {
            gram[(i.max(j), i.min(j))] / (lengths[i] * lengths[j]) + if i == j { RIDGE } else { 0.0 }
        });
        let moments = DVector::from_fn(n, |i, _| self.over_seen(columns[i], &self.force) / lengths[i]);
        let solution = scaled.cholesky().map(|c| c.solve(&moments));
        let coefficients: Vec<f64> = match solution {
            Some(s) if s.iter().all(|c| c.is_finite()) => s.iter().zip(&lengths).map(|(c, l)| c / l).collect(),
            _ => return LinearFit { coefficients: vec![0.0; n], squares: f64::INFINITY },
        };
        // From the residual itself: the Gram matrix alone would lose half of the digits.
        let mut squares = 0.0;
        for range in &self.rows.seen {
            for row in range.clone() {
                let fitted: f64 = columns.iter().zip(&coefficients).map(|(column, c)| c * column[row]).sum();
                squares += (self.force[row] - fitted).powi(2);
            }
        }
        LinearFit { coefficients, squares }
    }

    fn made(&self, effect: usize, inner: &[f64]) -> Vec<Vec<f64>> {
        columns(self.specimen, &self.forms[effect].at(inner), &[])
    }

    fn all<'c>(&'c self, effects: &'c [Vec<Vec<f64>>]) -> Vec<&'c [f64]> {
        self.base.iter().chain(effects.iter().flatten()).map(Vec::as_slice).collect()
    }

    fn residual(&self, columns: &[&[f64]], coefficients: &[f64]) -> Vec<f64> {
        let mut left = self.force.clone();
        for (column, c) in columns.iter().zip(coefficients) {
            left.iter_mut().zip(*column).for_each(|(l, v)| *l -= c * v);
        }
        left
    }

    /// Fits a set; effects that `from` has begin where they are there, others from the best points of their grids.
    pub(crate) fn fit(&self, set: &[usize], from: Option<&FittedComponent>) -> Option<FittedComponent> {
        let known =
            |k: &usize| from.and_then(|f| f.set.iter().position(|s| s == k).map(|place| f.inner[place].clone()));
        let given: Vec<Option<Vec<f64>>> = set.iter().map(known).collect();
        let open: Vec<usize> = (0..set.len()).filter(|i| given[*i].is_none()).collect();
        let mut starts: Vec<(f64, Vec<Vec<f64>>)> = Vec::new();
        let fixed: Vec<Option<Vec<Vec<f64>>>> =
            set.iter().zip(&given).map(|(k, inner)| inner.as_ref().map(|i| self.made(*k, i))).collect();
        let grids: Vec<Vec<Vec<f64>>> = open.iter().map(|i| grid(&self.forms[set[*i]])).collect();
        let mut point = vec![0; open.len()];
        loop {
            if self.cancel.is_cancelled() {
                return None;
            }
            let mut inner: Vec<Vec<f64>> = given.iter().map(|g| g.clone().unwrap_or_default()).collect();
            for (place, (i, grid)) in point.iter().zip(open.iter().zip(&grids)) {
                inner[*i].clone_from(&grid[*place]);
            }
            let made: Vec<Vec<Vec<f64>>> =
                (0..set.len()).map(|i| fixed[i].clone().unwrap_or_else(|| self.made(set[i], &inner[i]))).collect();
            starts.push((self.linear(&self.all(&made)).squares, inner));
            // The next point of all grids together.
            let Some(turn) = (0..point.len()).find(|i| point[*i] + 1 < grids[*i].len()) else { break };
            point[..turn].fill(0);
            point[turn] += 1;
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let free = set.iter().any(|k| !self.forms[*k].inner.is_empty());
        starts.truncate(if free { STARTS } else { 1 });
        let ends = starts.into_iter().filter_map(|(squares, inner)| self.descend(set, squares, inner));
        let (_, inner) = ends.min_by(|a, b| a.0.total_cmp(&b.0))?;
        self.finished(set, inner)
    }

    /// Steps from inner quantities until nothing betters them noticeably.
    fn descend(&self, set: &[usize], squares: f64, mut inner: Vec<Vec<f64>>) -> Option<(f64, Vec<Vec<f64>>)> {
        let places: Vec<(usize, usize)> =
            inner.iter().enumerate().flat_map(|(i, v)| (0..v.len()).map(move |j| (i, j))).collect();
        if places.is_empty() {
            return squares.is_finite().then_some((squares, inner));
        }
        let bounds = |(i, j): (usize, usize)| self.forms[set[i]].inner[j].bounds;
        let mut made: Vec<Vec<Vec<f64>>> = set.iter().zip(&inner).map(|(k, v)| self.made(*k, v)).collect();
        let mut best = self.linear(&self.all(&made));
        let mut damping = 1e-3;
        for _ in 0..MAX_STEPS {
            if self.cancel.is_cancelled() || !best.squares.is_finite() {
                return None;
            }
            let residual = self.residual(&self.all(&made), &best.coefficients);
            let slopes = self.slopes(set, &inner, &made, &places);
            let n = places.len();
            // The slopes of what the linear part leaves: projected off its columns.
            let (normal, gradient) = self.projected(&made, &slopes, (&best.coefficients, &residual));
            let mut bettered = false;
            for _ in 0..6 {
                let mut damped = normal.clone();
                for i in 0..n {
                    damped[(i, i)] += damping * normal[(i, i)].max(f64::MIN_POSITIVE);
                }
                let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                    damping *= 10.0;
                    continue;
                };
                let mut next = inner.clone();
                for (k, (i, j)) in places.iter().enumerate() {
                    let (low, high) = bounds((*i, *j));
                    next[*i][*j] = (next[*i][*j] + step[k]).clamp(low, high);
                }
                let trial: Vec<Vec<Vec<f64>>> = (0..set.len())
                    .map(|i| if next[i] == inner[i] { made[i].clone() } else { self.made(set[i], &next[i]) })
                    .collect();
                let found = self.linear(&self.all(&trial));
                if found.squares < best.squares {
                    bettered = found.squares < (1.0 - LEAST_GAIN) * best.squares;
                    (inner, made, best) = (next, trial, found);
                    damping *= 0.2;
                    break;
                }
                damping *= 8.0;
            }
            if !bettered {
                break;
            }
        }
        Some((best.squares, inner))
    }

    /// Slopes of each effect's part of the force by its inner quantities at unit coefficients: `[place][term][row]`.
    fn slopes(
        &self,
        set: &[usize],
        inner: &[Vec<f64>],
        made: &[Vec<Vec<f64>>],
        places: &[(usize, usize)],
    ) -> Vec<(usize, Vec<Vec<f64>>)> {
        let of = |&(i, j): &(usize, usize)| {
            let (low, high) = self.forms[set[i]].inner[j].bounds;
            let mut moved = inner[i].clone();
            let step = (DIFFERENCE * (high - low)).min(0.01 * moved[j].abs().max(1e-3 * (high - low)));
            let step = if moved[j] + step > high { -step } else { step };
            moved[j] += step;
            let there = self.made(set[i], &moved);
            let slope = there.iter().zip(&made[i]).map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b) / step).collect());
            (i, slope.collect())
        };
        places.iter().map(of).collect()
    }

    /// How the force changes with each inner quantity, at given coefficients: `[place][row]`.
    fn tangents(
        &self,
        made: &[Vec<Vec<f64>>],
        slopes: &[(usize, Vec<Vec<f64>>)],
        coefficients: &[f64],
    ) -> Vec<Vec<f64>> {
        let first = |effect: usize| self.base.len() + made[..effect].iter().map(Vec::len).sum::<usize>();
        let tangent = |(effect, columns): &(usize, Vec<Vec<f64>>)| {
            let mut sum = vec![0.0; self.rows.count];
            for (column, c) in columns.iter().zip(&coefficients[first(*effect)..]) {
                sum.iter_mut().zip(column).for_each(|(s, v)| *s += c * v);
            }
            sum
        };
        slopes.iter().map(tangent).collect()
    }

    /// Normal matrix and gradient of the inner quantities' step.
    fn projected(
        &self,
        made: &[Vec<Vec<f64>>],
        slopes: &[(usize, Vec<Vec<f64>>)],
        (coefficients, residual): (&[f64], &[f64]),
    ) -> (DMatrix<f64>, DVector<f64>) {
        let all = self.all(made);
        // What the linear part cannot follow of each tangent.
        let follow = |tangent: Vec<f64>| {
            let follower = ComponentFitter { force: tangent, base: Vec::new(), rows: self.rows.clone(), ..*self };
            let fit = follower.linear(&all);
            follower.residual(&all, &fit.coefficients)
        };
        let directions: Vec<Vec<f64>> = self.tangents(made, slopes, coefficients).into_iter().map(follow).collect();
        let n = directions.len();
        let normal = DMatrix::from_fn(n, n, |i, j| self.over_seen(&directions[i], &directions[j]));
        let gradient = DVector::from_fn(n, |i, _| self.over_seen(&directions[i], residual));
        (normal, gradient)
    }

    /// The fit at inner quantities, with the standard errors of all values together.
    fn finished(&self, set: &[usize], inner: Vec<Vec<f64>>) -> Option<FittedComponent> {
        let mut made: Vec<Vec<Vec<f64>>> = set.iter().zip(&inner).map(|(k, v)| self.made(*k, v)).collect();
        for place in 0..set.len() {
            self.begin(set, &inner, place, &mut made);
        }
        let all = self.all(&made);
        let linear = self.linear(&all);
        if !linear.squares.is_finite() {
            return None;
        }
        let residual = self.residual(&all, &linear.coefficients);
        let places: Vec<(usize, usize)> =
            inner.iter().enumerate().flat_map(|(i, v)| (0..v.len()).map(move |j| (i, j))).collect();
        let slopes = self.slopes(set, &inner, &made, &places);
        let tangents = self.tangents(&made, &slopes, &linear.coefficients);
        let directions: Vec<&[f64]> = all.iter().copied().chain(tangents.iter().map(Vec::as_slice)).collect();
        let n = directions.len();
        let lengths: Vec<f64> =
            directions.iter().map(|d| self.over_seen(d, d).sqrt()).map(|l| if l > 0.0 { l } else { 1.0 }).collect();
        let information = DMatrix::from_fn(n, n, |i, j| {
            self.over_seen(directions[i], directions[j]) / (lengths[i] * lengths[j]) + if i == j { RIDGE } else { 0.0 }
        });
        let freedom = self.rows.fitted().saturating_sub(n).max(1) as f64;
        let variance = linear.squares / freedom * self.inflation(&residual);
        let inverse = information.cholesky().map(|c| c.inverse());
        let error = |i: usize| inverse.as_ref().map_or(f64::INFINITY, |m| (variance * m[(i, i)]).sqrt() / lengths[i]);
        let mut inner_errors: Vec<Vec<f64>> = inner.iter().map(|v| vec![0.0; v.len()]).collect();
        for (k, (i, j)) in places.iter().enumerate() {
            inner_errors[*i][*j] = error(all.len() + k);
        }
        let parts = all.iter().zip(&linear.coefficients).zip(&lengths).map(|((_, c), length)| c.abs() * length);
        let rows = (self.rows.fitted().max(1) as f64).sqrt();
        Some(FittedComponent {
            set: set.to_vec(),
            parts: parts.map(|p| p / rows).collect(),
            errors: (0..all.len()).map(error).collect(),
            coefficients: linear.coefficients,
            inner_errors,
            inner,
            residual,
        })
    }

    /// Lets an effect's own state begin each record at the value that the force's first samples ask for, where the opening then
    /// errs less: a loop may be under way when a record begins. Of a record held out this is all that is fitted.
    fn begin(&self, set: &[usize], inner: &[Vec<f64>], place: usize, made: &mut [Vec<Vec<f64>>]) {
        let addition = self.forms[set[place]].at(&inner[place]);
        let state = Expression::Symbol(Symbol::Internal(0));
        let Some(term) = addition.terms.iter().position(|t| *t.expression() == state) else { return };
        let all = self.all(made);
        let linear = self.linear(&all);
        let before: usize = self.base.len() + made[..place].iter().map(Vec::len).sum::<usize>();
        let stiffness = linear.coefficients[before + term];
        let residual = self.residual(&all, &linear.coefficients);
        if stiffness == 0.0 || !linear.squares.is_finite() {
            return;
        }
        let mut openings = Vec::new();
        let mut starts = Vec::new();
        let mut next = 0;
        for path in &self.specimen.paths {
            let quarter = ((0.25 * self.specimen.period / path.interval) as usize).clamp(HEAD, path.len());
            let head = residual[next..next + HEAD].iter().sum::<f64>() / HEAD as f64 / stiffness;
            let reach = made[place][term][next..next + path.len()].iter().fold(0.0, |most: f64, z| most.max(z.abs()));
            starts.push(head.clamp(-reach, reach));
            openings.push(next..next + quarter);
            next += path.len();
        }
        let mut trial = made.to_vec();
        trial[place] = columns(self.specimen, &addition, &starts);
        let there = self.residual(&self.all(&trial), &linear.coefficients);
        for (start, opening) in starts.iter_mut().zip(openings) {
            if dot(&there[opening.clone()], &there[opening.clone()])
                >= dot(&residual[opening.clone()], &residual[opening])
            {
                *start = 0.0;
            }
        }
        made[place] = columns(self.specimen, &addition, &starts);
    }

    /// How much the variance of an estimate grows because neighbouring residuals are alike: 1 + 2 Σ ρ.
    fn inflation(&self, residual: &[f64]) -> f64 {
        let longest = self.rows.seen.iter().map(ExactSizeIterator::len).max().unwrap_or(0) / 4;
        let square = self.over_seen(residual, residual);
        if square <= 0.0 {
            return 1.0;
        }
        let mut sum = 1.0;
        for lag in 1..longest {
            let part = |r: &std::ops::Range<usize>| match r.len() > lag {
                true => dot(&residual[r.start..r.end - lag], &residual[r.start + lag..r.end]),
                false => 0.0,
            };
            let correlation = self.rows.seen.iter().map(part).sum::<f64>() / square;
            if correlation < UNCORRELATED {
                break;
            }
            sum += 2.0 * correlation;
        }
        sum
    }
}

/// All points of a form's grids together.
fn grid(form: &ForceForm) -> Vec<Vec<f64>> {
    form.inner.iter().fold(vec![Vec::new()], |points, inner| {
        points.iter().flat_map(|p| inner.grid.iter().map(move |value| [p.as_slice(), &[*value]].concat())).collect()
    })
}
