//! How uncertain a regression's coefficients are: how its residuals move them, and which it can hardly tell apart.

use std::sync::Arc;

use rand::SeedableRng as _;

use super::{Regression, SignalOrigin, Target};
use crate::signal::Signals;
use crate::sparse::{Constraint, Reduced, Scores, Solution};
use crate::study::Settings;
use crate::study::noise::{Kernels, Whitening, rate_place, slopes};
use sindyscope_values::term::{Symbol, Term};

/// The regression of every equation, ready to be drawn again.
pub(in crate::study) struct Resampling<'a> {
    regression: &'a Regression,
    settings: &'a Settings,
    equations: Vec<ResampledEquation>,
}

/// One equation of a resampled regression.
struct ResampledEquation {
    constraints: Vec<Constraint>,
    /// How residuals move the moments of `columns`.
    scores: Scores,
    columns: Vec<usize>,
}

impl Resampling<'_> {
    /// The state of each equation.
    pub(in crate::study) fn states(&self) -> impl Iterator<Item = Symbol> + '_ {
        self.regression.targets.iter().map(|target| target.state)
    }

    /// The library.
    pub(in crate::study) fn terms(&self) -> &[Term] {
        &self.regression.terms
    }

    /// For each equation, the terms that may stay or go.
    pub(in crate::study) fn optional(&self) -> Vec<Vec<usize>> {
        let free = |e: &ResampledEquation| {
            (0..e.constraints.len()).filter(|k| e.constraints[*k] == Constraint::Free).collect()
        };
        self.equations.iter().map(free).collect()
    }

    /// The reduced problems of one data set; the same seed draws the same one. Equations are drawn alike: blocks of rows that
    /// count more in one do so in all.
    pub(in crate::study) fn draw(&self, seed: u64) -> Vec<Reduced> {
        let errors = |(target, equation): (&Target, &ResampledEquation)| {
            let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
            target.reduced.shifted(&equation.columns, &equation.scores.draw(&mut random))
        };
        self.regression.targets.iter().zip(&self.equations).map(errors).collect()
    }

    /// The coefficients of the library in every equation of a drawn data set, zero for a term that one is `without`:
    /// `[equation][term]`.
    pub(in crate::study) fn coefficients(&self, drawn: &[Reduced], without: &[Option<usize>]) -> Vec<Vec<f64>> {
        let constrained = |(equation, without): (&ResampledEquation, &Option<usize>)| {
            let mut constraints = equation.constraints.clone();
            if let Some(constraint) = without.and_then(|k| constraints.get_mut(k)) {
                *constraint = Constraint::Out;
            }
            constraints
        };
        let mut constraints: Vec<Vec<Constraint>> = self.equations.iter().zip(without).map(constrained).collect();
        let drawn: Vec<&Reduced> = drawn.iter().collect();
        let (solutions, _) = self.regression.solved(self.settings, &drawn, &mut constraints);
        solutions.into_iter().map(|solution| solution.coefficients).collect()
    }
}

/// Correlation of two coefficients' errors from which on their terms are said to be confused: each is three times as
/// uncertain as it would be alone.
const CONFUSED_CORRELATION: f64 = 0.95;

/// Share of a row's variance that is taken for white where standard errors are sought: what noise does not explain.
const WHITE_SHARE: f64 = 1e-3;

/// What a whitening does to a column: appended to what there is.
type Unwhitened = fn(&Whitening, &[f64], &mut Vec<f64>);

impl Regression {
    /// Every equation's regression, ready to be drawn again.
    pub(in crate::study) fn resampling<'a>(&'a self, settings: &'a Settings) -> Resampling<'a> {
        let equation = |(target, solution): (&Target, Solution)| {
            let constraints = self.constraints(settings, target);
            let others = (0..self.terms.len()).filter(|k| !solution.support.contains(k));
            let columns: Vec<usize> = solution.support.iter().copied().chain(others).collect();
            let scores = self.scores(target, &solution, &columns);
            ResampledEquation { constraints, scores, columns }
        };
        let equations = self.targets.iter().zip(self.solutions(settings).0).map(equation).collect();
        Resampling { regression: self, settings, equations }
    }

    /// Pairs of terms that the data hardly tell apart: the correlation of their coefficients' errors in a fit of the
    /// whole library, strongest first.
    pub(super) fn confused(&self, target: &Target) -> Vec<(Term, Term, f64)> {
        let usable: Vec<usize> = (0..self.terms.len()).filter(|k| !target.reduced.unusable(*k)).collect();
        let usable = target.reduced.independent(&usable);
        let Some(inverse) = target.reduced.inverse_gram(&usable) else { return Vec::new() };
        let mut pairs: Vec<(Term, Term, f64)> = (0..usable.len())
            .flat_map(|j| (0..j).map(move |i| (i, j)))
            .map(|(i, j)| (i, j, inverse[(i, j)] / (inverse[(i, i)] * inverse[(j, j)]).sqrt()))
            .filter(|(.., correlation)| correlation.abs() > CONFUSED_CORRELATION)
            .map(|(i, j, correlation)| (self.terms[usable[i]].clone(), self.terms[usable[j]].clone(), correlation))
            .collect();
        pairs.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        pairs
    }

    /// How a solution's residuals move the moments of some columns, the kept ones first.
    pub(super) fn scores(&self, target: &Target, solution: &Solution, columns: &[usize]) -> Scores {
        let residual = self.residual(target, solution);
        let whitenings = self.whitenings(target, solution).unwrap_or_default();
        let each = |column: &[f64], way: Unwhitened| -> Vec<f64> {
            if whitenings.is_empty() {
                return column.to_vec();
            }
            let mut whole = Vec::with_capacity(column.len());
            for (record, rows) in &self.stretches {
                way(&whitenings[*record], &column[rows.clone()], &mut whole);
            }
            whole
        };
        let weights: Vec<Vec<f64>> = columns.iter().map(|k| each(&target.columns[*k], Whitening::transposed)).collect();
        let kept: Vec<Vec<f64>> =
            solution.support.iter().map(|k| each(&target.columns[*k], Whitening::apply)).collect();
        let residual = each(&residual, Whitening::apply);
        Scores::new(&target.reduced, &solution.support, &kept, &weights, &residual, &self.starts, self.block)
    }

    /// What makes each record's rows uncorrelated, as far as they are correlated by the sensors' noise; none in the weak form.
    fn whitenings(&self, target: &Target, solution: &Solution) -> Option<Vec<Whitening>> {
        let SignalOrigin::Smoothed { records, smoothing, stride } = &self.origin else { return None };
        let kept = self.terms.iter().zip(solution.coefficients.iter().copied()).filter(|(_, c)| *c != 0.0);
        let passing = slopes(kept, &self.layout, records);
        let whitening = |(record, signals): (usize, &Arc<Signals>)| {
            let longest = self.stretches.iter().filter(|(r, _)| *r == record).map(|(_, rows)| rows.len()).max();
            let kernels = Kernels::of_smoothing(smoothing, signals.length, signals.interval)?;
            let rate = rate_place(&signals.measured, &self.layout, target.index)?;
            let covariance = kernels.covariance(&signals.measured, rate, &passing, *stride);
            (covariance[0] > 0.0).then(|| Whitening::new(&covariance, WHITE_SHARE, longest.unwrap_or(0)))
        };
        records.iter().enumerate().map(whitening).collect()
    }
}
