//! A second-order library that grows as far as blocks of data that were not fitted bear it out.
//!
//! The equation is held against its averages over test functions once, for all terms that any stage offers; each block of
//! rows is reduced to a Gram matrix, and every subset of terms is then fitted to all blocks but one and judged on that one
//! without looking at a sample again. Nothing is simulated, so a chaotic motion is judged like any other.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::candidates::candidate_terms;
use super::regression::{self, Regression, fitted_states};
use super::{Cancel, Formulation, Kinematics, Settings, StudyError, base_excited};
use crate::signal::{SignalFacts, Signals, dot};
use crate::sparse::{Constraint, Sign};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::model::{Equation, Model, WeightedTerm};
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Expression, Function, Kind, Layout, Symbol, Term, TermFamily, polynomials};

/// Degree of the products that are offered.
const DEGREE: usize = 3;
/// Inputs, at most, whose products are offered: of more, only their first powers.
const MAX_MULTIPLIED_INPUTS: usize = 2;
/// Displacement from which on the sine of it can be told from a line and a cube, rad.
const MIN_ANGLE: f64 = 0.5;
/// Samples of all records together that are used, at most.
const MAX_SAMPLES: usize = 24_000;
/// Blocks of rows, at most.
const MAX_BLOCKS: usize = 20;
/// Rows of a block, at least.
const MIN_BLOCK_ROWS: usize = 20;
/// Terms of an equation, at most.
const MAX_TERMS: usize = 9;

/// One stage of growth.
struct LibraryStage {
    name: &'static str,
    terms: Vec<Term>,
}

/// What a record with a single degree of freedom is offered, stage by stage; each has the terms of those before.
fn stages(layout: &Layout, base: bool, angle: bool) -> Vec<LibraryStage> {
    let mut linear = TermFamily::States.terms(layout);
    linear.extend(TermFamily::Inputs.terms(layout));
    if base {
        linear.extend(TermFamily::InputRates.terms(layout));
    }
    linear.extend(TermFamily::Constant.terms(layout));
    let mut symbols: Vec<Symbol> = layout.state_symbols().collect();
    if layout.inputs <= MAX_MULTIPLIED_INPUTS {
        symbols.extend((0..layout.inputs).map(Symbol::Input));
    }
    let products = polynomials(&symbols, DEGREE, true);
    let call = |function: Function, symbol: Symbol| Term::new(Expression::call(function, Expression::Symbol(symbol)));
    let mut laws = vec![call(Function::Sgn, Symbol::Rate(0))];
    laws.extend(TermFamily::QuadraticDamping.terms(layout));
    let displacement = || Expression::Symbol(Symbol::State(0));
    laws.extend([displacement().abs(), displacement().power(5.0)].map(Term::new));
    let mut offered =
        vec![("linear terms", linear), ("products to degree 3", products), ("sgn v, v|v|, |x|, x^5", laws)];
    if angle {
        offered.push(("sin x, cos x", [Function::Sin, Function::Cos].map(|f| call(f, Symbol::State(0))).to_vec()));
    }
    let mut all: Vec<Term> = Vec::new();
    let mut stage = |(name, terms): (&'static str, Vec<Term>)| {
        all.extend(terms.into_iter().filter(|t| !all.contains(t)).collect::<Vec<_>>());
        LibraryStage { name, terms: all.clone() }
    };
    offered.into_iter().map(&mut stage).collect()
}

/// The regression on everything that any stage offers, reduced block by block.
#[derive(Clone, Debug)]
struct Blocks {
    terms: Vec<Term>,
    /// `[Θ y]ᵀ[Θ y]` of each block, columns scaled to norm 1 over all blocks, the rate last.
    grams: Vec<DMatrix<f64>>,
    rows: Vec<usize>,
    total: DMatrix<f64>,
    /// What each column, and the rate at the end, was multiplied with.
    scale: Vec<f64>,
    constraints: Vec<Constraint>,
    signs: Vec<Option<Sign>>,
}

/// A subset of terms with what it leaves.
#[derive(Clone, Debug)]
struct TermSubset {
    terms: Vec<usize>,
    /// Of each block its mean square, fitted to all others, as a share of the rate's mean square.
    errors: Vec<f64>,
}

impl TermSubset {
    fn mean(&self) -> f64 {
        self.errors.iter().sum::<f64>() / self.errors.len().max(1) as f64
    }
}

impl Blocks {
    /// None where there are too few rows to judge by.
    fn new(regression: &Regression, settings: &Settings) -> Option<Self> {
        let (terms, columns, rate, constraints, signs) = regression.whole(settings)?;
        let rows = rate.len();
        let count = (rows / MIN_BLOCK_ROWS).min(MAX_BLOCKS);
        if count < 3 {
            return None;
        }
        let mut rate = rate.to_vec();
        for (column, constraint) in columns.iter().zip(&constraints) {
            if let Constraint::Fixed(value) = constraint {
                rate.iter_mut().zip(column).for_each(|(y, x)| *y -= value * x);
            }
        }
        let all: Vec<&[f64]> = columns.iter().map(Vec::as_slice).chain([rate.as_slice()]).collect();
        let norm = |series: &[f64]| series.iter().map(|v| v * v).sum::<f64>().sqrt();
        let scale: Vec<f64> =
            all.iter().map(|s| norm(s).recip()).map(|s| if s.is_finite() { s } else { 0.0 }).collect();
        let gram = |range: Range<usize>| {
            let part = |k: usize| &all[k][range.clone()];
            let mut gram = DMatrix::zeros(all.len(), all.len());
            for i in 0..all.len() {
                for j in 0..=i {
                    let product = dot(part(i), part(j)) * scale[i] * scale[j];
                    gram[(i, j)] = product;
                    gram[(j, i)] = product;
                }
            }
            gram
        };
        let ranges: Vec<Range<usize>> = (0..count).map(|b| b * rows / count..(b + 1) * rows / count).collect();
        let grams: Vec<DMatrix<f64>> = ranges.iter().cloned().map(gram).collect();
        let total = grams.iter().fold(DMatrix::zeros(all.len(), all.len()), |sum, gram| sum + gram);
        let rows = ranges.iter().map(Range::len).collect();
        Some(Self { terms: terms.to_vec(), grams, rows, total, scale, constraints, signs })
    }

    /// Coefficients of scaled columns that fit a Gram matrix best; none where they depend on each other, or have signs that
    /// they may not have.
    fn fit(&self, gram: &DMatrix<f64>, terms: &[usize]) -> Option<DVector<f64>> {
        let y = gram.nrows() - 1;
        let a = DMatrix::from_fn(terms.len(), terms.len(), |i, j| gram[(terms[i], terms[j])]);
        let b = DVector::from_fn(terms.len(), |i, _| gram[(terms[i], y)]);
        let factor = a.cholesky()?;
        let conditioned =
            (0..terms.len()).all(|i| factor.l_dirty()[(i, i)].powi(2) > DEPENDENT * gram[(terms[i], terms[i])]);
        let solution = factor.solve(&b);
        let allowed = |(c, k): (&f64, &usize)| self.signs[*k].is_none_or(|sign| sign.bounds().nearest(*c) == *c);
        (conditioned && solution.iter().zip(terms).all(allowed)).then_some(solution)
    }

    /// What coefficients leave of a Gram matrix' rows: a sum of squares.
    fn left(gram: &DMatrix<f64>, terms: &[usize], coefficients: &DVector<f64>) -> f64 {
        let y = gram.nrows() - 1;
        let mut left = gram[(y, y)];
        for (i, a) in terms.iter().enumerate() {
            left -= 2.0 * coefficients[i] * gram[(*a, y)];
            for (j, b) in terms.iter().enumerate() {
                left += coefficients[i] * coefficients[j] * gram[(*a, *b)];
            }
        }
        left.max(0.0)
    }

    fn left_of(&self, terms: &[usize]) -> f64 {
        self.fit(&self.total, terms).map_or(f64::INFINITY, |c| Self::left(&self.total, terms, &c))
    }

    fn judged(&self, terms: Vec<usize>) -> Option<TermSubset> {
        let all = self.rows.iter().sum::<usize>() as f64 / self.total[(self.terms.len(), self.terms.len())];
        let error = |(gram, rows): (&DMatrix<f64>, &usize)| {
            let c = self.fit(&(&self.total - gram), &terms)?;
            Some(Self::left(gram, &terms, &c) / *rows as f64 * all)
        };
        let errors = self.grams.iter().zip(&self.rows).map(error).collect::<Option<Vec<f64>>>()?;
        Some(TermSubset { terms, errors })
    }

    /// What an equation that was fitted elsewhere leaves of all rows, as a share of the rate's mean square; none where it has
    /// terms that are not offered here.
    fn left_by(&self, equation: &Equation) -> Option<f64> {
        let rate = self.terms.len();
        let (mut places, mut coefficients) = (Vec::new(), Vec::new());
        for WeightedTerm { term, coefficient, .. } in &equation.terms {
            let k = self.terms.iter().position(|t| t == term)?;
            if !matches!(self.constraints[k], Constraint::Fixed(_)) {
                places.push(k);
                coefficients.push(coefficient * self.scale[rate] / self.scale[k]);
            }
        }
        let left = Self::left(&self.total, &places, &DVector::from_vec(coefficients)) / self.total[(rate, rate)];
        left.is_finite().then_some(left)
    }

    /// The columns of a pool that can be chosen, and those that are in every subset.
    fn choosable(&self, pool: &[usize]) -> (Vec<usize>, Vec<usize>) {
        let decided = |wanted: Constraint| move |k: &usize| self.constraints[*k] == wanted;
        let locked = (0..self.terms.len()).filter(decided(Constraint::In)).collect();
        (pool.iter().copied().filter(decided(Constraint::Free)).collect(), locked)
    }

    /// The subset of those given that leaves least, with what it leaves.
    fn least(&self, subsets: impl Iterator<Item = Vec<usize>>) -> Option<(f64, Vec<usize>)> {
        let judged = subsets.map(|set| (self.left_of(&set), set));
        judged.filter(|(left, _)| left.is_finite()).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Exchanges terms after the first `locked` for others as long as less is left.
    fn exchanged(&self, mut present: (f64, Vec<usize>), free: &[usize], locked: usize) -> (f64, Vec<usize>) {
        loop {
            let set = &present.1;
            let others = || free.iter().filter(|k| !set.contains(k));
            let exchanges = (locked..set.len()).flat_map(|place| {
                others().map(move |k| {
                    let mut next = set.clone();
                    next[place] = *k;
                    next
                })
            });
            // Each exchange leaves less, so no set comes twice.
            match self.least(exchanges) {
                Some(next) if next.0 < present.0 * (1.0 - MIN_GAIN) => present = next,
                _ => return present,
            }
        }
    }

    /// For each number of terms of a pool the subset that leaves least of those that a search from both ends finds, fewest
    /// first: one adds terms from none, the other drops them from all, and both exchange single terms at each size. Along a
    /// limit cycle or a steady tone terms are so much alike that the first alone would not find its way.
    fn best_subsets(&self, pool: &[usize]) -> Vec<TermSubset> {
        let (free, locked) = self.choosable(pool);
        let mut best: Vec<(f64, Vec<usize>)> = Vec::new();
        let mut present = locked.clone();
        while present.len() < MAX_TERMS + locked.len() {
            let with = free.iter().filter(|k| !present.contains(k)).map(|k| [present.as_slice(), &[*k]].concat());
            let Some(next) = self.least(with) else { break };
            let next = self.exchanged(next, &free, locked.len());
            present.clone_from(&next.1);
            best.push(next);
        }
        let mut all = locked.clone();
        for k in &free {
            all.push(*k);
            if self.fit(&self.total, &all).is_none() {
                all.pop();
            }
        }
        while all.len() > locked.len() + 1 {
            let without = (locked.len()..all.len()).map(|place| {
                let mut next = all.clone();
                next.remove(place);
                next
            });
            let Some(mut next) = self.least(without) else { break };
            if let Some(known) = best.get_mut(next.1.len() - locked.len() - 1) {
                next = self.exchanged(next, &free, locked.len());
                if next.0 < known.0 {
                    known.clone_from(&next);
                }
            }
            all = next.1;
        }
        best.into_iter().filter_map(|(_, set)| self.judged(set)).collect()
    }
}

/// Share by which an exchange of terms has to lower what is left, that of rounding.
const MIN_GAIN: f64 = 1e-9;
/// Share of a column's square that no other column of its subset explains, at least.
const DEPENDENT: f64 = 1e-9;
/// More terms are taken where they lower the held-out error to this share or below, as a first-order library's degree is.
const MAX_ERROR_RATIO: f64 = 0.5;

/// Of subsets the one with the fewest terms beyond which the held-out error is never halved.
fn parsimonious(subsets: Vec<TermSubset>) -> Option<TermSubset> {
    let least = subsets.iter().map(TermSubset::mean).fold(f64::INFINITY, f64::min);
    subsets.into_iter().find(|s| MAX_ERROR_RATIO * MAX_ERROR_RATIO * s.mean() <= least)
}

/// What growing a library came to.
#[derive(Clone, Debug)]
pub(super) struct Growth {
    /// The terms that the data bear out, if they leave at most half of what the library at the start does.
    pub(super) terms: Option<Vec<Term>>,
    /// What was tried, each with the share of the acceleration that it leaves, in words.
    pub(super) tried: String,
    /// The terms of it that the library at the start lacks.
    pub(super) lacking: Vec<Term>,
    /// Share of the acceleration that the library at the start leaves of blocks not fitted.
    start: f64,
    /// The best equation: its terms, and the mean square that it leaves of blocks not fitted as a share of the rate's.
    best: (Vec<Term>, f64),
    blocks: Blocks,
}

/// What the averaged equation leaves of the acceleration's mean square, at most, for it to count as exact: a thousandth of
/// the acceleration.
const EXACT: f64 = 1e-6;
/// An equation that leaves this many times the mean square of the exact one, or more, is another one.
const INEXACT_RATIO: f64 = 100.0;

impl Growth {
    /// What a library that a person gave lacks, as the end of a sentence; none where nothing leaves half as much.
    pub(super) fn advice(&self) -> Option<String> {
        let names: Vec<&str> = self.lacking.iter().map(Term::as_str).collect();
        let percent = |share: f64| significant_trimmed(100.0 * share, 2);
        let (it, with) = (if names.len() == 1 { "it" } else { "them" }, percent(self.best.1.sqrt()));
        (!names.is_empty()).then(|| {
            let (names, without) = (names.join(", "), percent(self.start));
            format!("with {names} the equation would leave {with} % of the acceleration in blocks not fitted, without {without} %: add {it}")
        })
    }

    /// The terms of the equation that holds in averages over blocks not fitted, where `model` does not: where that equation is
    /// exact to a thousandth of the acceleration and the model leaves ten times as much, or where its terms are new and the
    /// model leaves twice as much.
    ///
    /// What the response of such a model errs by is then no reason to prefer it: either the motion is chaotic and no response
    /// follows it for long, or something acts beside the equation that no term can stand for, such as static friction above the
    /// sliding level.
    pub(super) fn instead_of(&self, model: &Model) -> Option<&[Term]> {
        let (terms, least) = &self.best;
        let equation = model.equations.last()?;
        let left = self.blocks.left_by(equation).unwrap_or(f64::INFINITY);
        let inexact = *least <= EXACT && left >= INEXACT_RATIO * least;
        let outgrown = self.terms.is_some() && MAX_ERROR_RATIO * MAX_ERROR_RATIO * left >= *least;
        (inexact || outgrown).then_some(terms)
    }
}

/// Seeks the terms of the only acceleration in stages: linear, then products of displacement, velocity and input to degree
/// 3, then the sign of the velocity, its square with its sign, the magnitude of the displacement and its fifth power, and where
/// the motion is large enough its sine and cosine. A stage is taken where it halves what the stages before leave of blocks that
/// were not fitted, or leaves no more with fewer terms; the library of `settings` stays where nothing leaves less than half of what that does.
///
/// None where there is more than one equation, or too little data to judge.
///
/// # Errors
/// Cancelled.
pub(super) fn grown(
    records: &RecordSet,
    layout: &Layout,
    settings: &Settings,
    cancel: &Cancel,
) -> Result<Option<Growth>, StudyError> {
    let single = layout.kind == Kind::SecondOrder && layout.freedoms == 1 && settings.own.is_empty();
    let fitted: Vec<&Arc<Record>> = records.with(Usage::Fit).collect();
    if !single || settings.kinematics == Kinematics::Fitted || fitted.is_empty() {
        return Ok(None);
    }
    let most = MAX_SAMPLES / fitted.len();
    let short = fitted.iter().map(|r| if r.len() > most { Arc::new(r.slice(0..most)) } else { Arc::clone(r) });
    let signals: Vec<Arc<Signals>> = short
        .map(|r| Arc::new(Signals::new(&r, layout, &settings.smoothing, &SignalFacts::cached(&r, layout))))
        .collect();
    cancel.check()?;
    let reach = signals.iter().flat_map(|s| &s.states[0]).fold(0.0_f64, |most, x| most.max(x.abs()));
    let stages = stages(layout, base_excited(fitted[0], Kind::SecondOrder), reach > MIN_ANGLE);
    let mut pool = stages.last().map_or_else(Vec::new, |s| s.terms.clone());
    pool.extend(settings.terms.iter().filter(|t| !pool.contains(t)).cloned().collect::<Vec<_>>());
    let wide = Settings { terms: pool, ..settings.clone() };
    let terms = candidate_terms(&wide, layout);
    let states = fitted_states(layout, settings.kinematics);
    // Averages have no bias of smoothed accelerations, which products would seem to explain.
    let regression = regression::basis(layout, &terms, &signals, Formulation::Weak { half_width: None }, &states)
        .and_then(|basis| Regression::new(layout, &terms, &signals, &settings.smoothing, &basis, &states));
    cancel.check()?;
    let Ok(regression) = regression else { return Ok(None) };
    let Some(blocks) = Blocks::new(&regression, &wide) else { return Ok(None) };
    let place =
        |list: &[Term]| -> Vec<usize> { list.iter().filter_map(|t| terms.iter().position(|o| o == t)).collect() };
    let best = |list: &[Term]| parsimonious(blocks.best_subsets(&place(list)));
    let offered = candidate_terms(settings, layout);
    let Some(start) = best(&offered) else { return Ok(None) };
    let mut tried = Vec::new();
    let mut found: Option<TermSubset> = None;
    for stage in &stages {
        let Some(subset) = best(&candidate_terms(&Settings { terms: stage.terms.clone(), ..settings.clone() }, layout))
        else {
            continue;
        };
        tried.push(format!("{} {} %", stage.name, significant_trimmed(100.0 * subset.mean().sqrt(), 2)));
        let shorter = |f: &TermSubset| subset.terms.len() < f.terms.len() && subset.mean() <= f.mean();
        if found.as_ref().is_none_or(|f| subset.mean() <= MAX_ERROR_RATIO * MAX_ERROR_RATIO * f.mean() || shorter(f)) {
            found = Some(subset);
        }
    }
    let better = |f: &TermSubset| f.mean() <= MAX_ERROR_RATIO * MAX_ERROR_RATIO * start.mean();
    let new = |f: &TermSubset| f.terms.iter().any(|k| !offered.contains(&terms[*k]));
    let found = found.filter(|f| better(f) && new(f));
    let taken = found.as_ref().map_or("the library at the start stays".to_owned(), |f| {
        let names: Vec<&str> = f.terms.iter().map(|k| terms[*k].as_str()).collect();
        format!("taken: {}", names.join(", "))
    });
    let tried = format!(
        "library grown by what it leaves of the acceleration in blocks not fitted: at the start {} %, {}; {taken}",
        significant_trimmed(100.0 * start.mean().sqrt(), 2),
        tried.join(", ")
    );
    let named = |subset: &TermSubset| subset.terms.iter().map(|k| terms[*k].clone()).collect::<Vec<Term>>();
    let best = found.as_ref().unwrap_or(&start);
    let lacking = |f: &TermSubset| -> Vec<Term> { named(f).into_iter().filter(|t| !offered.contains(t)).collect() };
    Ok(Some(Growth {
        lacking: found.as_ref().map(lacking).unwrap_or_default(),
        start: start.mean().sqrt(),
        best: (named(best), best.mean()),
        terms: found.as_ref().map(named),
        tried,
        blocks,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subset(terms: usize, error: f64) -> TermSubset {
        TermSubset { terms: (0..terms).collect(), errors: vec![error; 3] }
    }

    #[test]
    fn more_terms_are_taken_only_where_they_halve_the_error() {
        let chosen = |errors: &[f64]| {
            let subsets = errors.iter().enumerate().map(|(k, e)| subset(k + 1, e * e)).collect();
            parsimonious(subsets).unwrap().terms.len()
        };
        assert_eq!(chosen(&[1.0, 0.6, 0.55, 0.52]), 1);
        assert_eq!(chosen(&[1.0, 0.6, 0.02, 0.011]), 3);
        assert_eq!(chosen(&[1.0, 0.9, 0.8, 0.01]), 4, "four terms that only together explain it");
    }
}
