//! The regression stage: library columns over every fitted record, reduced once, thresholded often.

mod opposed;
mod rows;
pub(super) mod sliding;
mod uncertainty;
mod written;

use std::ops::Range;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::candidates::{lock_of, offered, sign_of};
use super::covariance::Covariance;
use super::weak::{StateRows, WeakForm};
use super::{EquationFit, Formulation, Kinematics, Lock, Scaling, Settings, StudyError};
use crate::signal::{Differentiation, Signals, Smoothing, dot, rms};
use crate::sparse::{
    Constraint, Reduced, Scores, Sign, Solution, SparseOptions, Unexplained, between, drop_path, stlsq,
};
use crate::study::outcome::{DroppedTerm, PathTerm};
use opposed::DependentCoefficients;
use rows::{filtered, integrated, smooth_alike};
use sindyscope_values::model::{Equation, Model, WeightedTerm, kinematic};
use sindyscope_values::term::{Expression, Kind, Layout, Program, Symbol, Term};
use sliding::{Moving, keep};
pub(super) use sliding::{RowRaster, shortest_standstills, sliding, standing};
pub(super) use uncertainty::Resampling;

/// Library columns and the rates to explain, over every fitted record.
#[derive(Debug)]
pub(super) struct Regression {
    layout: Layout,
    terms: Vec<Term>,
    /// Each fitted state with its columns, its rate and the reduced problem.
    targets: Vec<Target>,
    /// First row of each record.
    starts: Vec<usize>,
    /// The record and the rows of each stretch in which rows follow one another without a gap.
    stretches: Vec<(usize, Range<usize>)>,
    /// Rows over which residuals are correlated.
    block: usize,
    origin: SignalOrigin,
}

/// What thresholding has left.
pub(super) struct Identified {
    pub(super) model: Model,
    pub(super) fits: Vec<EquationFit>,
    /// One for each equation, and the column of each of its terms.
    solutions: Vec<Solution>,
    columns: Vec<Vec<usize>>,
    follows: Option<DependentCoefficients>,
}

/// Where rows come from.
#[derive(Debug)]
enum SignalOrigin {
    /// From smoothed records, every `stride`-th sample.
    Smoothed { records: Vec<Arc<Signals>>, smoothing: Smoothing, stride: usize },
    /// From smoothed records, integrated over time.
    Integrated(Smoothing),
    /// From averages, white as far as the noise is known.
    Averaged(WeakForm),
    /// From several regressions.
    Joined,
}

/// What the rows of a regression are.
#[derive(Clone, Debug)]
pub(super) enum Basis {
    /// The equation at samples.
    Samples,
    /// Its averages over test functions.
    Averages(WeakForm),
    /// Its integral over time.
    Integrals,
}

#[derive(Debug)]
struct Target {
    state: Symbol,
    index: usize,
    columns: Arc<Vec<Vec<f64>>>,
    rate: Vec<f64>,
    reduced: Reduced,
    /// RMS of the rate itself, where rows are weighted and theirs is another.
    rate_rms: f64,
}

/// The rows of records that a regression uses.
pub(super) struct RowChoice<'a> {
    /// Samples from one row to the next.
    pub(super) stride: usize,
    /// The rows of a record, counted in strides from its first sample.
    pub(super) inside: &'a dyn Fn(&Signals) -> Range<usize>,
    /// Where the records are pieces of a longer one: samples of its shortest standstill of each velocity whose sign is taken.
    pub(super) shortest_standstills: Option<&'a [Option<usize>]>,
}

/// Rows that a regression uses, at most: more say nothing new and cost time.
const MAX_ROWS: usize = 120_000;

impl Regression {
    /// Computes, filters and reduces the columns of `terms` over `records`.
    pub(super) fn new(
        layout: &Layout,
        terms: &[Term],
        records: &[Arc<Signals>],
        smoothing: &Smoothing,
        basis: &Basis,
        fitted: &[usize],
    ) -> Result<Self, StudyError> {
        if let Basis::Averages(weak) = basis {
            return Self::averaged(layout, terms, records, weak, fitted);
        }
        let total: usize = records.iter().map(|r| r.states.first().map_or(0, Vec::len)).sum();
        let length = records.iter().map(|r| r.length).fold(f64::INFINITY, f64::min);
        let stride = smoothing.stride(length).max(total.div_ceil(MAX_ROWS));
        let inside = |signals: &Signals| {
            let count = signals.states.first().map_or(0, Vec::len);
            // A record of a few segments cannot spare both ends.
            let margin = smoothing.margin(signals.length).min(count / 8).div_ceil(stride);
            margin..count.div_ceil(stride) - margin
        };
        let rows = RowChoice { stride, inside: &inside, shortest_standstills: None };
        let regression = Self::of_rows(layout, terms, records, smoothing, basis, fitted, &rows)?;
        enough(regression.rows(), terms)?;
        Ok(regression)
    }

    /// The regression of some rows of each record, however few, every `stride`-th sample from the first: what `inside` says.
    pub(super) fn of_rows(
        layout: &Layout,
        terms: &[Term],
        records: &[Arc<Signals>],
        smoothing: &Smoothing,
        basis: &Basis,
        fitted: &[usize],
        rows: &RowChoice<'_>,
    ) -> Result<Self, StudyError> {
        let RowChoice { stride, inside, shortest_standstills } = *rows;
        let expressions: Vec<Expression> = terms.iter().map(|t| t.expression().clone()).collect();
        let program = Program::new(&expressions, layout);
        let filter = if smoothing.filter_library { smoothing.filter() } else { None };
        let derived = smoothing.method == Differentiation::Filter;
        let jumps: Vec<bool> = terms.iter().map(Term::switches).collect();
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); terms.len()];
        let mut rates: Vec<Vec<f64>> = vec![Vec::new(); fitted.len()];
        let mut starts = Vec::with_capacity(records.len());
        let mut block = 1;
        let moving = Moving::new(layout, terms, records, shortest_standstills, |signals| {
            let inside = inside(signals);
            RowRaster {
                rows: inside.len(),
                first: inside.start * stride,
                stride,
                reach: signals.length.ceil() as usize,
            }
        });
        for (signals, moving) in records.iter().zip(&moving.rows) {
            let inside = inside(signals);
            starts.push(rates.first().map_or(0, Vec::len));
            let slices = signals.slices(&program);
            let samples = slices.block();
            match &filter {
                Some(filter) => filtered(&program, &samples, filter, stride, &inside, derived, &jumps, &mut columns),
                None => {
                    let mut full: Vec<Vec<f64>> = vec![Vec::new(); terms.len()];
                    program.columns(&samples, &mut full);
                    smooth_alike(smoothing, signals, &jumps, &mut full);
                    for (column, full) in columns.iter_mut().zip(&full) {
                        column.extend(full.iter().step_by(stride).skip(inside.start).take(inside.len()));
                    }
                }
            }
            for (rate, state) in rates.iter_mut().zip(fitted) {
                let along = signals.rate(*state).unwrap_or(&[]);
                rate.extend(along.iter().step_by(stride).skip(inside.start).take(inside.len()));
            }
            keep(moving, starts[starts.len() - 1], columns.iter_mut().chain(&mut rates));
            let together = 2.0 * signals.length.max(1.0) * signals.interval;
            let together = signals.main_period.unwrap_or(together).max(together);
            block = block.max((together / (signals.interval * stride as f64)).ceil() as usize);
        }
        let rate_rms: Vec<f64> = rates.iter().map(|rate| rms(rate)).collect();
        let stretches = moving.stretches();
        let origin = if let Basis::Integrals = basis {
            for (record, rows) in &stretches {
                let step = records[*record].interval * stride as f64;
                columns.iter_mut().chain(&mut rates).for_each(|series| integrated(&mut series[rows.clone()], step));
            }
            SignalOrigin::Integrated(*smoothing)
        } else {
            SignalOrigin::Smoothed { records: records.to_vec(), smoothing: *smoothing, stride }
        };
        let symbols: Vec<Symbol> = layout.state_symbols().collect();
        let columns = Arc::new(columns);
        let redundancy = written::redundancy(terms);
        let targets = fitted
            .iter()
            .zip(rates.into_iter().zip(rate_rms))
            .map(|(index, (rate, rate_rms))| {
                let reduced = Reduced::new(&columns, &rate).redundant(redundancy.clone());
                Target { state: symbols[*index], index: *index, columns: Arc::clone(&columns), rate, reduced, rate_rms }
            })
            .collect();
        Ok(Self { layout: *layout, terms: terms.to_vec(), targets, starts, stretches, block, origin })
    }

    /// The regression of averages over test functions.
    fn averaged(
        layout: &Layout,
        terms: &[Term],
        records: &[Arc<Signals>],
        weak: &WeakForm,
        fitted: &[usize],
    ) -> Result<Self, StudyError> {
        let mut rows = vec![StateRows { columns: vec![Vec::new(); terms.len()], rate: Vec::new() }; fitted.len()];
        let mut starts = Vec::with_capacity(records.len());
        let mut block = 1;
        let moving = Moving::new(layout, terms, records, None, |signals| weak.raster(signals));
        for (signals, moving) in records.iter().zip(&moving.rows) {
            starts.push(rows.first().map_or(0, |r| r.rate.len()));
            weak.append(layout, terms, signals, fitted, moving, &mut rows);
            let row = signals.interval * weak.stride() as f64;
            let together = weak.span() as f64 * signals.interval;
            let together = signals.main_period.unwrap_or(together).max(together);
            block = block.max((together / row).ceil() as usize);
        }
        enough(rows.first().map_or(0, |r| r.rate.len()), terms)?;
        let symbols: Vec<Symbol> = layout.state_symbols().collect();
        let redundancy = written::redundancy(terms);
        let targets = fitted
            .iter()
            .zip(rows)
            .map(|(index, StateRows { columns, rate })| {
                let reduced = Reduced::new(&columns, &rate).redundant(redundancy.clone());
                let rates = || records.iter().filter_map(|s| s.rate(*index));
                let squares: f64 = rates().map(|rate| dot(rate, rate)).sum();
                let samples: usize = rates().map(<[f64]>::len).sum();
                let rate_rms = (squares / samples.max(1) as f64).sqrt();
                let columns = Arc::new(columns);
                Target { state: symbols[*index], index: *index, columns, rate, reduced, rate_rms }
            })
            .collect();
        let origin = SignalOrigin::Averaged(weak.clone());
        let stretches = moving.stretches();
        Ok(Self { layout: *layout, terms: terms.to_vec(), targets, starts, stretches, block, origin })
    }

    /// The regression of other records on some terms, their rows made in the same way.
    pub(super) fn on_records(&self, terms: &[Term], records: &[Arc<Signals>]) -> Result<Self, StudyError> {
        let fitted: Vec<usize> = self.fitted().collect();
        let (smoothing, basis) = match &self.origin {
            SignalOrigin::Smoothed { smoothing, .. } => (*smoothing, Basis::Samples),
            SignalOrigin::Integrated(smoothing) => (*smoothing, Basis::Integrals),
            SignalOrigin::Averaged(weak) => (Smoothing::default(), Basis::Averages(weak.clone())),
            SignalOrigin::Joined => return Err(StudyError::NothingToFit),
        };
        Self::new(&self.layout, terms, records, &smoothing, &basis, &fitted)
    }

    /// Samples that a row is made from.
    pub(super) fn span(&self, signals: &Signals) -> f64 {
        if let SignalOrigin::Averaged(weak) = &self.origin { weak.span() as f64 } else { signals.length }
    }

    /// The coefficients of a model's own terms, none dropped: `[fitted equation][term]`.
    pub(super) fn refitted(&self, model: &Model, settings: &Settings) -> Vec<Vec<f64>> {
        let plain = SparseOptions { threshold: 0.0, ridge: 0.0, scaled: true };
        self.targets
            .iter()
            .map(|target| {
                let kept = &model.equations[target.index].terms;
                let place = |term: &Term| self.terms.iter().position(|t| t == term);
                let decided = self.constraints(settings, target);
                let constraints: Vec<Constraint> = (self.terms.iter().zip(decided))
                    .map(|(term, decided)| match decided {
                        Constraint::Fixed(value) => Constraint::Fixed(value),
                        _ if kept.iter().any(|k| k.term == *term) => Constraint::In,
                        _ => Constraint::Out,
                    })
                    .collect();
                let coefficients = stlsq(&target.reduced, &constraints, &plain).coefficients;
                kept.iter().map(|k| place(&k.term).map_or(k.coefficient, |at| coefficients[at])).collect()
            })
            .collect()
    }

    /// This regression, within the signs that are known of the forces' coefficients.
    pub(super) fn bounded(mut self, settings: &Settings) -> Self {
        for target in &mut self.targets {
            let Some(freedom) = freedom(&self.layout, target) else { continue };
            let settings = settings.of_equation(freedom);
            let signs: Vec<Option<Sign>> = self.terms.iter().map(|t| sign_of(&settings, t, freedom)).collect();
            target.reduced = target.reduced.clone().bounded(&signs);
        }
        self
    }

    /// The reduced problem of several regressions on the same terms together; without their columns, so only for
    /// [`Self::model`] and thresholds.
    pub(super) fn joined(parts: &[&Self]) -> Self {
        let first = parts[0];
        let targets = (0..first.targets.len())
            .map(|t| Target {
                state: first.targets[t].state,
                index: first.targets[t].index,
                columns: Arc::default(),
                rate: Vec::new(),
                reduced: Reduced::stack(&parts.iter().map(|p| &p.targets[t].reduced).collect::<Vec<_>>()),
                rate_rms: first.targets[t].rate_rms,
            })
            .collect();
        Self {
            layout: first.layout,
            terms: first.terms.clone(),
            targets,
            starts: Vec::new(),
            stretches: Vec::new(),
            block: first.block,
            origin: SignalOrigin::Joined,
        }
    }

    /// The reduced problem of the same rows, each weighed by a bell (Hann's) over the stretch that it lies in: the scores of its
    /// residuals are those of stretches with soft edges. Residuals of derivatives have neighbours that cancel, and at a hard edge these
    /// are missing. Without its columns, as [`Self::joined`].
    pub(super) fn tapered(&self) -> Self {
        let weights = self.bell();
        let weighed = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(&weights).map(|(value, weight)| value * weight).collect()
        };
        let of_target = |target: &Target| {
            let columns: Vec<Vec<f64>> = target.columns.iter().map(|column| weighed(column)).collect();
            let reduced = Reduced::new(&columns, &weighed(&target.rate));
            let (columns, rate) = (Arc::default(), Vec::new());
            Target { state: target.state, index: target.index, columns, rate, reduced, rate_rms: target.rate_rms }
        };
        let targets = self.targets.iter().map(of_target).collect();
        Self {
            layout: self.layout,
            terms: self.terms.clone(),
            targets,
            starts: Vec::new(),
            stretches: Vec::new(),
            block: self.block,
            origin: SignalOrigin::Joined,
        }
    }

    /// The weight of each row in a bell over its stretch, whose square is Hann's.
    fn bell(&self) -> Vec<f64> {
        let weight = |row: usize, rows: usize| (std::f64::consts::PI * (row as f64 + 0.5) / rows as f64).sin();
        self.stretches.iter().flat_map(|(_, rows)| (0..rows.len()).map(|row| weight(row, rows.len()))).collect()
    }

    /// Standard deviation that white noise of unit deviation, of which each fitted equation's rate has the response `kernels[equation]`
    /// by sample, gives a residual's part along each column of norm one, with soft edges: `[equation][term]`. It is larger in
    /// short stretches, where less cancels. One where a column is zero.
    pub(super) fn spread_of_noise(&self, kernels: &[Vec<f64>], stride: usize) -> Vec<Vec<f64>> {
        let weights = self.bell();
        let of_column = |column: &Vec<f64>, kernel: &[f64]| {
            let (mut squares, mut norm) = (0.0, 0.0);
            for (_, rows) in &self.stretches {
                let mut passed = vec![0.0; (rows.len().saturating_sub(1)) * stride + kernel.len()];
                for (row, place) in rows.clone().enumerate() {
                    let weighed = weights[place] * column[place];
                    norm += weighed * weighed;
                    let pushed = &mut passed[row * stride..row * stride + kernel.len()];
                    pushed.iter_mut().zip(kernel).for_each(|(sum, k)| *sum += weights[place] * weighed * k);
                }
                squares += dot(&passed, &passed);
            }
            let spread = (squares / norm).sqrt();
            if spread.is_finite() && spread > 0.0 { spread } else { 1.0 }
        };
        let of_target = |(target, kernel): (&Target, &Vec<f64>)| {
            target.columns.iter().map(|column| of_column(column, kernel)).collect()
        };
        self.targets.iter().zip(kernels).map(of_target).collect()
    }

    /// The library's columns whose coefficient in a fitted equation of a model was found, not given.
    pub(super) fn fitted_columns(&self, equation: usize, model: &Model, settings: &Settings) -> Vec<usize> {
        let target = &self.targets[equation];
        let given = self.constraints(settings, target);
        let kept = &model.equations[target.index].terms;
        let is_fitted = |k: &usize| {
            !matches!(given[*k], Constraint::Fixed(_)) && kept.iter().any(|kept| kept.term == self.terms[*k])
        };
        (0..self.terms.len()).filter(is_fitted).collect()
    }

    /// `(ΘᵀΘ)⁻¹` of a fitted equation's columns; none where they are dependent.
    pub(super) fn inverse_gram(&self, equation: usize, columns: &[usize]) -> Option<DMatrix<f64>> {
        self.targets[equation].reduced.inverse_gram(columns)
    }

    /// A model's coefficients by the library's columns, zero for terms that it lacks: `[fitted equation][term]`.
    pub(super) fn coefficients_of(&self, model: &Model) -> Vec<Vec<f64>> {
        let of = |target: &Target| {
            let equation = &model.equations[target.index];
            self.terms.iter().map(|term| equation.coefficient(term).unwrap_or(0.0)).collect()
        };
        self.targets.iter().map(of).collect()
    }

    /// What given coefficients, `[fitted equation][term]`, leave of the rates of these rows.
    pub(super) fn left_by(&self, coefficients: &[Vec<f64>]) -> Vec<Unexplained> {
        self.targets.iter().zip(coefficients).map(|(target, c)| target.reduced.unexplained(c)).collect()
    }

    /// The library's term of an index.
    pub(super) fn term(&self, index: usize) -> &Term {
        &self.terms[index]
    }

    /// Rows that there are.
    pub(super) fn rows(&self) -> usize {
        self.targets.first().map_or(0, |t| t.reduced.rows())
    }

    /// The thresholds at which some term drops out, ascending.
    pub(super) fn marks(&self, settings: &Settings) -> Vec<f64> {
        let options = options(settings);
        let mut marks: Vec<f64> = self
            .targets
            .iter()
            .flat_map(|t| drop_path(&settings.regressor.path(&t.reduced, &self.constraints(settings, t), &options)))
            .map(|(at, _)| at)
            .collect();
        marks.sort_by(f64::total_cmp);
        marks.dedup();
        marks
    }

    /// One threshold for each set of terms that thresholding can leave, at most `most`: the sparsest first.
    pub(super) fn thresholds(&self, settings: &Settings, most: usize) -> Vec<f64> {
        let marks = self.marks(settings);
        let mut edges = vec![0.0];
        edges.extend(&marks);
        // The last interval holds no free term at all; it is tried too, for locked terms may do.
        let mut thresholds: Vec<f64> = edges
            .iter()
            .enumerate()
            .map(|(k, below)| between(*below, edges.get(k + 1).copied().unwrap_or(f64::INFINITY)))
            .collect();
        thresholds.reverse();
        thresholds.truncate(most);
        thresholds
    }

    /// The thresholded equations with coefficients alone.
    pub(super) fn model(&self, settings: &Settings) -> Model {
        self.sparse(settings).0
    }

    /// The thresholded equations with coefficients alone, and what they leave of the rates: the largest share of a
    /// rate's RMS.
    pub(super) fn sparse(&self, settings: &Settings) -> (Model, f64) {
        let mut equations = self.unfitted_equations();
        let mut misfit = 0.0_f64;
        for (target, solution) in self.targets.iter().zip(self.solutions(settings).0) {
            misfit = misfit.max(solution.residual_rms / target.reduced.target_scale());
            equations[target.index] = Equation::known(
                self.terms
                    .iter()
                    .zip(&solution.coefficients)
                    .filter(|(_, c)| **c != 0.0)
                    .map(|(term, c)| (term.clone(), *c)),
            );
        }
        (Model { layout: self.layout, equations, static_ratio: 1.0 }, misfit)
    }

    /// What this regression's coefficients, no term dropped, leave of another's rates: the largest share of a rate's RMS.
    pub(super) fn leaves_of(&self, other: &Self) -> f64 {
        let share = |(own, other): (&Target, &Target)| {
            let every: Vec<usize> = (0..self.terms.len()).filter(|k| !own.reduced.unusable(*k)).collect();
            let mut left = other.rate.clone();
            for (k, c) in every.iter().zip(own.reduced.least_squares(&every)) {
                left.iter_mut().zip(&other.columns[*k]).for_each(|(left, value)| *left -= c * value);
            }
            rms(&left) / rms(&other.rate)
        };
        self.targets.iter().zip(&other.targets).map(share).fold(0.0, f64::max)
    }

    /// The columns of the terms, the rate, and what is decided of each term, of the only equation; none of several.
    #[expect(clippy::type_complexity, reason = "five views of one problem")]
    pub(super) fn whole(
        &self,
        settings: &Settings,
    ) -> Option<(&[Term], &[Vec<f64>], &[f64], Vec<Constraint>, Vec<Option<Sign>>)> {
        let [target] = self.targets.as_slice() else { return None };
        let freedom = freedom(&self.layout, target)?;
        let settings = settings.of_equation(freedom);
        let signs = self.terms.iter().map(|t| sign_of(&settings, t, freedom)).collect();
        Some((&self.terms, &target.columns, &target.rate, self.constraints(&settings, target), signs))
    }

    /// The state of an index of the state vector.
    pub(super) fn symbol(&self, index: usize) -> Option<Symbol> {
        self.layout.state_symbols().nth(index)
    }

    /// The states whose rates are fitted, as indices into the state vector.
    pub(super) fn fitted(&self) -> impl Iterator<Item = usize> {
        self.targets.iter().map(|t| t.index)
    }

    fn constraints(&self, settings: &Settings, target: &Target) -> Vec<Constraint> {
        // A decision about a term of the force says nothing about dx/dt.
        let Some(freedom) = freedom(&self.layout, target) else { return vec![Constraint::Free; self.terms.len()] };
        let offers = self.offers(settings, target);
        let settings = settings.of_equation(freedom);
        self.terms
            .iter()
            .zip(offers)
            .map(|(term, offered)| match lock_of(&settings, term) {
                _ if !offered => Constraint::Out,
                Some(Lock::In) => Constraint::In,
                Some(Lock::Out) => Constraint::Out,
                Some(Lock::Fixed(value)) => Constraint::Fixed(value),
                None => Constraint::Free,
            })
            .collect()
    }

    /// Whether each term is a candidate of one equation: an acceleration is none in its own.
    fn offers(&self, settings: &Settings, target: &Target) -> Vec<bool> {
        let Some(freedom) = freedom(&self.layout, target) else { return vec![true; self.terms.len()] };
        let own = Expression::Symbol(Symbol::Acceleration(freedom));
        let listed = (!settings.own.is_empty()).then(|| offered(&settings.of_equation(freedom)));
        let is_offered = |t: &Term| *t.expression() != own && listed.as_ref().is_none_or(|list| list.contains(t));
        self.terms.iter().map(is_offered).collect()
    }

    fn unfitted_equations(&self) -> Vec<Equation> {
        let empty = Equation { terms: Vec::new() };
        let kinematic = (0..self.layout.freedoms).map(kinematic).filter(|_| self.layout.kind == Kind::SecondOrder);
        kinematic.chain(std::iter::repeat(empty)).take(self.layout.states()).collect()
    }

    /// Thresholds every equation. The coefficients' errors are [`Self::errors`], which takes as long again.
    pub(super) fn identify(&self, settings: &Settings) -> Identified {
        let options = options(settings);
        let mut equations = self.unfitted_equations();
        let mut fits = Vec::with_capacity(self.targets.len());
        let mut columns = Vec::with_capacity(self.targets.len());
        let (solutions, constraints, follows) = self.solutions(settings);
        for ((target, solution), constraints) in self.targets.iter().zip(&solutions).zip(&constraints) {
            let path = settings.regressor.path(&target.reduced, constraints, &options);
            let (equation, kept) = self.equation(target, solution, constraints);
            equations[target.index] = equation;
            columns.push(kept);
            fits.push(self.fit(target, solution, constraints, &path, &self.offers(settings, target)));
        }
        let model = Model { layout: self.layout, equations, static_ratio: 1.0 };
        Identified { model, fits, solutions, columns, follows }
    }

    /// The covariance of all coefficients' errors.
    pub(super) fn errors(&self, identified: &Identified) -> Covariance {
        let Identified { solutions, columns, follows, .. } = identified;
        let of_target = |((target, solution), kept): ((&Target, &Solution), &Vec<usize>)| {
            let places = kept.iter().map(|k| solution.support.iter().position(|s| s == k)).collect();
            (self.scores(target, solution, &solution.support), places)
        };
        let scores: Vec<(Scores, Vec<Option<usize>>)> =
            self.targets.iter().zip(solutions).zip(columns).map(of_target).collect();
        let mut covariance = Covariance::of_regression(&scores);
        if let Some(follows) = follows {
            follows.transform(&mut covariance, columns);
        }
        covariance
    }

    /// An equation, and the column of each of its terms.
    fn equation(&self, target: &Target, solution: &Solution, constraints: &[Constraint]) -> (Equation, Vec<usize>) {
        let scale = target.reduced.scale();
        let force: f64 = solution.coefficients.iter().zip(scale).map(|(c, s)| (c * s).abs()).sum();
        let kept: Vec<usize> = (0..self.terms.len())
            .filter(|k| solution.support.contains(k) || matches!(constraints[*k], Constraint::Fixed(_)))
            .collect();
        let terms = kept
            .iter()
            .map(|k| {
                let coefficient = solution.coefficients[*k];
                WeightedTerm {
                    term: self.terms[*k].clone(),
                    coefficient,
                    std_error: None,
                    share: if force > 0.0 { (coefficient * scale[*k]).abs() / force } else { 0.0 },
                }
            })
            .collect();
        (Equation { terms }, kept)
    }

    fn residual(&self, target: &Target, solution: &Solution) -> Vec<f64> {
        let mut residual = target.rate.clone();
        for (column, c) in target.columns.iter().zip(&solution.coefficients).filter(|(_, c)| **c != 0.0) {
            for (r, value) in residual.iter_mut().zip(column) {
                *r -= c * value;
            }
        }
        residual
    }

    /// The course of every coefficient along the threshold.
    fn path(&self, target: &Target, path: &[(f64, Solution)]) -> Vec<PathTerm> {
        let scale = target.reduced.scale();
        self.terms
            .iter()
            .enumerate()
            .map(|(k, term)| PathTerm {
                term: term.clone(),
                standard: scale[k] / target.reduced.target_scale(),
                coefficients: path.iter().map(|(from, solution)| (*from, solution.coefficients[k])).collect(),
            })
            .filter(|term| term.coefficients.iter().any(|(_, c)| *c != 0.0))
            .collect()
    }

    fn fit(
        &self,
        target: &Target,
        solution: &Solution,
        constraints: &[Constraint],
        path: &[(f64, Solution)],
        offers: &[bool],
    ) -> EquationFit {
        let drops = drop_path(path);
        let dropped = (0..self.terms.len())
            .filter(|k| offers[*k] && !solution.support.contains(k) && !matches!(constraints[*k], Constraint::Fixed(_)))
            .map(|k| DroppedTerm {
                term: self.terms[k].clone(),
                fell_at: drops.iter().find(|(_, column)| *column == k).map(|(at, _)| *at),
            })
            .collect();
        EquationFit {
            state: target.state,
            dropped,
            drop_marks: drops.iter().map(|(at, k)| (*at, self.terms[*k].clone())).collect(),
            path: self.path(target, path),
            condition: target.reduced.condition(&solution.support),
            confused: self.confused(target),
            shift: Vec::new(),
            probability: self.terms.iter().cloned().zip(solution.probability.iter().copied()).collect(),
            residual_rms: solution.residual_rms * target.rate_rms / target.reduced.target_scale(),
            rate_rms: target.rate_rms,
        }
    }
}

/// The degree of freedom (first order: the state) whose force a target is; none of dx/dt.
fn freedom(layout: &Layout, target: &Target) -> Option<usize> {
    match layout.kind {
        Kind::SecondOrder => target.index.checked_sub(layout.freedoms),
        Kind::FirstOrder => Some(target.index),
    }
}

fn enough(rows: usize, terms: &[Term]) -> Result<(), StudyError> {
    if rows < terms.len() + 2 {
        return Err(StudyError::Setting(format!(
            "{rows} samples are left to fit {} terms: shorten the segment or the library, or fit more records",
            terms.len()
        )));
    }
    Ok(())
}

/// What the rows are in the form that the settings ask for.
pub(super) fn basis(
    layout: &Layout,
    terms: &[Term],
    records: &[Arc<Signals>],
    form: Formulation,
    fitted: &[usize],
) -> Result<Basis, StudyError> {
    match form {
        Formulation::Derivative => Ok(Basis::Samples),
        Formulation::Integral => Ok(Basis::Integrals),
        Formulation::Weak { half_width } => {
            WeakForm::new(layout, terms, records, half_width, fitted, MAX_ROWS).map(Basis::Averages)
        }
    }
}

/// The states whose rates are fitted, as indices into the state vector.
pub(super) fn fitted_states(layout: &Layout, kinematics: Kinematics) -> Vec<usize> {
    let first = match (layout.kind, kinematics) {
        (Kind::SecondOrder, Kinematics::Known) => layout.freedoms,
        _ => 0,
    };
    (first..layout.states()).collect()
}

fn options(settings: &Settings) -> SparseOptions {
    SparseOptions { threshold: settings.threshold, ridge: settings.ridge, scaled: settings.scaling == Scaling::Scaled }
}
