//! Which sets of effects are worth a fit.
//!
//! A model is linear in its coefficients once its inner quantities (a gap, a speed, a delay, a hidden state's rate) are fixed. So
//! one regression in the weak form takes the base model and every effect at every point of its inner grid together, and each
//! set of effects is scored by how well it predicts blocks of data that are left out in turn. The base model's signs are free.
//! It cannot name an effect: it orders the sets that are then fitted. What it costs when it errs is time, or a set not tried.
//!
//! Source: D. Messenger, D. Bortz, Multiscale Model. Simul. 19 (2021) 1474–1497 (weak form).

mod gram;
mod path;
mod rows;
mod turning;

use std::collections::HashMap;

use super::columns::{Inputs, forces};
use super::constants::{Constants, LARGEST_SET};
use super::data::{Data, RecordSeries};
use super::effects::{Addition, Direction, ForceAxis, Form};
use super::parameters::{InnerValues, Parameters};
use super::site::Placed;
use super::structure::{Composed, Composition, counted_from};
use gram::{Gram, MOST};
use path::slope;
pub(super) use path::{MeasuredPath, usual_speed};
use rows::{Rows, SensedQuantity};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::refine::Structure as _;
use sindyscope_core::signal::dot;
use sindyscope_core::study::Cancel;
use sindyscope_values::record::estimate;
use sindyscope_values::term::{Expression, Symbol, Term};

/// Rounds of a finer grid about what the best sets hold: each makes its step a third, and a ninth is near enough for a fit.
const ZOOMS: usize = 2;

/// A set of effects with the values that its fit starts from.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    /// Indices of the forms.
    pub(super) forms: Vec<usize>,
    /// The model with them.
    pub(super) composition: Composition,
    /// Its parameters by the regression.
    pub(super) shared: Vec<f64>,
    /// Log density of the blocks left out in turn, less that of the present model.
    pub(super) gain: f64,
}

/// An effect at one point of its inner grid.
#[derive(Clone, Debug)]
struct GridPoint {
    form: usize,
    inner: Vec<f64>,
    /// Distance of the next point in each direction, of the logarithm where the grid is logarithmic.
    step: Vec<PathStep>,
    /// Its columns in the pool.
    columns: std::ops::Range<usize>,
    /// Columns of the present model that its own take the place of.
    replaces: Vec<usize>,
    /// So many of its columns are terms of the present model, changed: of the input, or counted from another zero. Each stands
    /// for the replaced column of the same place.
    rewrites: usize,
    /// It has a state of its own.
    remembers: bool,
}

#[derive(Clone, Copy, Debug)]
enum PathStep {
    Even(f64),
    Ratio(f64),
}

/// The data and the present model as a regression.
struct SetRegression<'a> {
    data: &'a Data,
    cancel: &'a Cancel,
    forms: &'a [Form],
    present: &'a Composition,
    inner: &'a InnerValues,
    paths: &'a [MeasuredPath],
    rows: Rows,
    /// The target, then the present model's own.
    base: Vec<Vec<f64>>,
    /// Of the present model's columns those that are no coefficients: constants of a free zero.
    constants: usize,
    /// Columns of the present model's dampers.
    dampers: Vec<usize>,
    /// Length of each column in the pool before it was scaled to one.
    scales: Vec<f64>,
    pool: Vec<Vec<f64>>,
    /// The zero of a force that repeats with every turn is open.
    turning: bool,
}

/// Best scores found: for each set of forms, sorted, the score and the grid points.
type FoundSets = HashMap<Vec<usize>, (f64, Vec<usize>)>;

/// What sets are scored by.
#[derive(Clone, Copy)]
enum Score {
    /// How well they predict blocks of rows that are left out in turn.
    LeftOut,
    /// How little they leave where all rows count at once.
    AllRows,
}

impl Data {
    /// Sets of the forms beside a present model, best first; the set of none is not among them. A set must bring more than the
    /// share `crumb` of what the best set that it contains gains.
    pub(super) fn propose(
        &self,
        present: &Composition,
        inner: &InnerValues,
        forms: &[Form],
        crumb: f64,
        cancel: &Cancel,
    ) -> Vec<Proposal> {
        let mut regression = SetRegression::new(self, present, inner, forms, cancel);
        if regression.rows.len() < 4 * (regression.base.len() + 2) {
            return Vec::new();
        }
        let mut points = regression.points();
        let found = regression.search(&mut points);
        if cancel.is_cancelled() {
            return Vec::new();
        }
        let mut sets = ranked(&found, forms, crumb, &self.constants);
        sets.extend(regression.common(&points));
        sets.extend(regression.leaving_least(&found, &mut points));
        let mut known: Vec<Vec<usize>> = Vec::new();
        sets.retain(|(_, set)| {
            let new = !known.contains(set);
            known.push(set.clone());
            new
        });
        let none = found.get(&Vec::new()).map_or(0.0, |f| f.0);
        let proposal = |(score, set): (f64, Vec<usize>)| {
            let chosen: Vec<Form> = set.iter().map(|p| forms[points[*p].form].clone()).collect();
            let start = regression.proposal(&set, &points)?;
            let about = regression.held_about(&set, &points);
            let again = about.and_then(|point| self.propose_about(point, present, inner, &chosen, cancel));
            let Proposal { composition, shared, .. } = again.unwrap_or_else(|| start.clone());
            Some(Proposal { forms: start.forms, composition, shared, gain: score - none })
        };
        let proposals: Vec<Proposal> = sets.into_iter().filter_map(proposal).collect();
        self.counters.propose(proposals.len());
        proposals
    }

    /// The start of these forms together, displacements counted from a point; none where an effect among them holds the zero.
    fn propose_about(
        &self,
        point: f64,
        present: &Composition,
        inner: &InnerValues,
        forms: &[Form],
        cancel: &Cancel,
    ) -> Option<Proposal> {
        if forms.iter().any(Form::has_a_mean) || present.holds_the_zero() {
            return None;
        }
        let from_there = InnerValues { equilibrium: Some(point), ..inner.clone() };
        self.propose_together(present, &from_there, forms, cancel).map(|(start, _)| start)
    }

    /// The start of exactly these forms together beside a present model; none where the data cannot tell their columns apart.
    pub(super) fn propose_exactly(
        &self,
        present: &Composition,
        inner: &InnerValues,
        forms: &[Form],
        cancel: &Cancel,
    ) -> Option<Proposal> {
        let (start, about) = self.propose_together(present, inner, forms, cancel)?;
        let again = about.and_then(|point| self.propose_about(point, present, inner, forms, cancel));
        Some(again.unwrap_or(start))
    }

    /// The start of exactly these forms together, and the point that the base model's spring then holds the motion about, where
    /// that is open.
    fn propose_together(
        &self,
        present: &Composition,
        inner: &InnerValues,
        forms: &[Form],
        cancel: &Cancel,
    ) -> Option<(Proposal, Option<f64>)> {
        let mut regression = SetRegression::new(self, present, inner, forms, cancel);
        let mut points = regression.points();
        let mut found = FoundSets::new();
        let all: Vec<usize> = (0..forms.len()).filter(|k| !forms[*k].is_outside()).collect();
        let mut chosen: Vec<usize> = Vec::new();
        for form in &all {
            let best = (0..points.len()).filter(|p| points[*p].form == *form).max_by(|a, b| {
                let score = |p: usize| regression.gain(&[&chosen[..], &[p]].concat(), &points);
                score(*a).total_cmp(&score(*b))
            })?;
            chosen.push(best);
        }
        let gram = regression.gram();
        regression.note(&gram, &points, vec![chosen], &mut found, Score::LeftOut);
        regression.zoom(&mut points, &mut found, 1, Score::LeftOut);
        let set = found.into_values().next().map(|(_, set)| set)?;
        let mut start = regression.proposal(&set, &points)?;
        let about = regression.held_about(&set, &points);
        // What has no force of its own begins in the middle of its range.
        for (k, form) in forms.iter().enumerate().filter(|(_, form)| form.is_outside()) {
            let Parameters { coefficients, inner } = start.composition.named(&start.shared);
            let mut composition = start.composition.with(form);
            let inner = composition.inner_after(&start.composition, &inner, &[]);
            let paths: Vec<_> = self.fit().iter().map(RecordSeries::path).collect();
            composition.scales = self.scales(&composition, &inner, &paths);
            start.forms.push(k);
            start = Proposal { composition, shared: Parameters { coefficients, inner }.row(), ..start };
        }
        Some((start, about))
    }
}

impl<'a> SetRegression<'a> {
    fn new(
        data: &'a Data,
        present: &'a Composition,
        inner: &'a InnerValues,
        forms: &'a [Form],
        cancel: &'a Cancel,
    ) -> Self {
        let paths = data.measured_paths();
        let rows = Rows::new(data, paths);
        let mut new = Self {
            data,
            cancel,
            forms,
            present,
            inner,
            paths,
            rows,
            base: Vec::new(),
            constants: 0,
            dampers: Vec::new(),
            scales: Vec::new(),
            pool: Vec::new(),
            turning: false,
        };
        new.whiten();
        new.base = new.base_columns();
        let first = 1 + new.constants;
        new.turning = new.has_open_turns();
        new.dampers = present.dampers(inner).into_iter().map(|(k, _)| first + k).collect();
        new.reset();
        new
    }

    /// Whitens against the noise that passes the base model as a plain regression has it.
    fn whiten(&mut self) {
        let columns = self.base_columns();
        let gram = Gram::new(&columns, std::slice::from_ref(&(0..self.rows.len())), self.cancel);
        let all: Vec<usize> = (1..columns.len()).collect();
        let solution = gram.solve(&all).map(|s| s.coefficients).unwrap_or_default();
        let composed = self.present.compose(self.inner);
        let masses = self.data.masses();
        let mut slopes = vec![(0.0, 0.0); masses];
        for (placed, value) in composed.terms.iter().zip(solution.iter().skip(self.constants)) {
            let slope = |symbol| match sindyscope_values::term::derivative(placed.term.expression(), symbol) {
                Expression::Number(n) => n * value,
                _ => 0.0,
            };
            slopes[placed.mass].0 -= slope(Symbol::State(placed.mass));
            slopes[placed.mass].1 -= slope(Symbol::Rate(placed.mass));
        }
        let floor = 1e-6 * self.data.loudest();
        let deviations: Vec<f64> = self.data.weights.iter().map(|w| self.data.noise.max(floor) / w).collect();
        let shown: Vec<Vec<SensedQuantity>> =
            (0..masses).map(|mass| self.data.fit().iter().map(|s| sensed_quantity(s, mass)).collect()).collect();
        self.rows.whiten(&slopes, &deviations, &shown);
    }

    /// The target and the present model's columns.
    fn base_columns(&mut self) -> Vec<Vec<f64>> {
        let data = self.data;
        let target = self.rows.column(|mass, record| {
            let order = 2 - data.outputs[mass].derivatives();
            Some((&*data.fit()[record].measured[mass], order))
        });
        let mut columns = vec![target];
        // What shifts the zero of an angle that turns over is no constant force: the fit alone places it.
        if self.present.offset() || self.present.datum && !self.present.is_periodic() {
            columns.extend(self.zeros());
        }
        self.constants = columns.len() - 1;
        columns.extend(self.columns(&self.present.compose(self.inner)));
        columns
    }

    /// A constant force on each mass in each record: to first order what a shifted zero of its sensor does.
    fn zeros(&self) -> Vec<Vec<f64>> {
        let ones: Vec<Vec<f64>> = self.data.fit().iter().map(|s| vec![1.0; s.len()]).collect();
        let each = (0..self.data.masses()).flat_map(|mass| (0..ones.len()).map(move |record| (mass, record)));
        each.map(|(m, r)| self.rows.column(|mass, record| ((mass, record) == (m, r)).then(|| (&*ones[record], 0))))
            .collect()
    }

    /// What the sensor shows of a symbol, or its derivative, where the measurement itself gives a linear term.
    fn direct(&self, symbol: Symbol, record: usize) -> Option<(&[f64], usize)> {
        let s: &RecordSeries = &self.data.fit()[record];
        let known = |i: usize| s.outputs.get(i).map_or(2, |o| o.derivatives());
        let path = &self.paths[record].path;
        match symbol {
            Symbol::State(i) if known(i) == 0 => Some((&path.x[i], 0)),
            Symbol::Rate(i) if known(i) == 0 => Some((&path.x[i], 1)),
            Symbol::Rate(i) if known(i) == 1 => Some((&s.measured[i], 0)),
            Symbol::Input(j) => Some((&s.inputs[j], 0)),
            Symbol::InputRate(j) => Some((&s.inputs[j], 1)),
            _ => None,
        }
    }

    /// The averages of every term of the accelerations.
    fn columns(&self, composed: &Composed) -> Vec<Vec<f64>> {
        let plain = composed.delays.is_none();
        let symbol = |placed: &Placed| match placed.term.expression() {
            Expression::Symbol(s) if plain => Some(*s).filter(|s| self.direct(*s, 0).is_some()),
            _ => None,
        };
        let along: Vec<Placed> = composed.terms.iter().filter(|t| symbol(t).is_none()).cloned().collect();
        let values: Vec<Vec<Vec<f64>>> = if along.is_empty() {
            Vec::new()
        } else {
            let each = self.data.fit().iter().zip(self.paths);
            each.map(|(s, measured)| {
                let delayed = (!plain).then(|| s.delayed_inputs(&composed.delays));
                let inputs = delayed.as_ref().map_or_else(
                    || s.inputs(),
                    |(values, rates)| Inputs {
                        values: values.iter().map(Vec::as_slice).collect(),
                        rates: rates.iter().map(Vec::as_slice).collect(),
                    },
                );
                forces(&along, &composed.internals, &self.data.layout, s, &inputs, &measured.path)
            })
            .collect()
        };
        let mut next = 0;
        composed
            .terms
            .iter()
            .map(|placed| match symbol(placed) {
                Some(symbol) => self
                    .rows
                    .column(|mass, record| (mass == placed.mass).then(|| self.direct(symbol, record)).flatten()),
                None => {
                    let own = next;
                    next += 1;
                    self.rows.column(|mass, record| (mass == placed.mass).then(|| (&*values[record][own], 0)))
                }
            })
            .collect()
    }

    /// The pool as it is before any effect.
    fn reset(&mut self) {
        self.pool.clear();
        self.scales.clear();
        for column in self.base.clone() {
            self.push(column);
        }
    }

    fn push(&mut self, mut column: Vec<f64>) {
        let scale = if self.pool.is_empty() { 1.0 } else { dot(&column, &column).sqrt().max(f64::MIN_POSITIVE) };
        column.iter_mut().for_each(|c| *c /= scale);
        self.pool.push(column);
        self.scales.push(scale);
    }

    /// The columns of the present model's terms that an addition takes the place of.
    fn replaced_by(&self, addition: &Addition) -> impl Iterator<Item = usize> {
        let plain = self.present.plain_terms(self.inner);
        let first = 1 + self.constants;
        addition.replaces.iter().filter_map(move |gone| plain.iter().position(|t| t == gone)).map(move |k| first + k)
    }

    /// The columns of a form at inner values, and which of the present model's they replace.
    fn of_form(&self, form: &Form, inner: &[f64]) -> (Vec<Vec<f64>>, Vec<usize>, usize) {
        if self.turning && form.is_periodic() {
            return self.of_turning(form);
        }
        let addition = form.addition(inner);
        let first = 1 + self.constants;
        let composed = self.present.compose(self.inner);
        if form.rewrites_input() {
            let with = self.present.with(form);
            let all = with.inner_after(self.present, self.inner, inner);
            let changed = with.compose(&all);
            let of_input = |placed: &Placed| {
                placed.term.symbols().iter().any(|s| matches!(s, Symbol::Input(_) | Symbol::InputRate(_)))
            };
            let places: Vec<usize> = (0..composed.terms.len()).filter(|k| of_input(&composed.terms[*k])).collect();
            let terms = places.iter().map(|k| changed.terms[*k].clone()).collect();
            let columns = self.columns(&Composed { terms, ..changed });
            let rewrites = columns.len();
            return (columns, places.into_iter().map(|k| first + k).collect(), rewrites);
        }
        if addition.offset {
            return (self.zeros(), Vec::new(), 0);
        }
        if self.present.datum && form.has_a_mean() {
            let equilibrium = Some(self.present.origin);
            let from_there = self.present.compose(&InnerValues { equilibrium, ..self.inner.clone() });
            let mut columns = self.columns(&from_there);
            let rewrites = columns.len();
            let own = Composed { terms: addition.terms, internals: addition.internals, ..composed };
            columns.extend(self.columns(&own));
            return (columns, (first..first + rewrites).chain(1..first).collect(), rewrites);
        }
        // Displacements count from the equilibrium here as in the present model's own terms.
        let from_there = |term: &Term| match self.inner.equilibrium {
            Some(equilibrium) if equilibrium != 0.0 => counted_from(term, equilibrium),
            _ => term.clone(),
        };
        let replaces = self.replaced_by(&addition).collect();
        let mut internals = addition.internals;
        internals.iter_mut().flat_map(|e| &mut e.terms).for_each(|t| t.term = from_there(&t.term));
        let terms = addition.terms.iter().map(|t| t.map(from_there)).collect();
        let own = Composed { terms, internals, ..composed };
        (self.columns(&own), replaces, 0)
    }

    /// The best points of every form's grid, with their columns in the pool.
    fn points(&mut self) -> Vec<GridPoint> {
        let base = Gram::new(&self.pool, std::slice::from_ref(&(0..self.rows.len())), self.cancel);
        let of_base: Vec<usize> = (1..self.pool.len()).collect();
        let alone = base.solve(&of_base).map_or(f64::INFINITY, |s| s.left);
        let grid: Vec<(usize, Vec<f64>, Vec<PathStep>)> = self
            .forms
            .iter()
            .enumerate()
            .filter(|(_, form)| !form.is_outside())
            .flat_map(|(k, form)| {
                let steps = steps(form);
                form.grid().into_iter().map(move |inner| (k, inner, steps.clone()))
            })
            .collect();
        let preloads = self.zeros();
        let preloaded = base.beside(&self.pool.iter().map(Vec::as_slice).collect::<Vec<_>>(), &preloads);
        // What it leaves beside the base, and beside a constant force too: under a load a contact lies elsewhere.
        type Built = ([f64; 2], Vec<Vec<f64>>, GridPoint);
        let built: Vec<Built> = grid
            .into_par_iter()
            .filter(|_| !self.cancel.is_cancelled())
            .filter_map(|(form, inner, step)| {
                let (columns, replaces, rewrites) = self.of_form(&self.forms[form], &inner);
                let beside = |base: &Gram, further: &[Vec<f64>]| {
                    self.left_beside((base, further), &columns, (&replaces, rewrites), form)
                };
                // Only what depends on the displacement has a place that a load moves.
                let moves = self.forms[form].axis == ForceAxis::Displacement;
                let under_load = if moves { beside(&preloaded, &preloads) } else { None };
                let left = [beside(&base, &[]), under_load].map(|l| l.unwrap_or(f64::INFINITY));
                let remembers = !self.forms[form].addition(&inner).internals.is_empty();
                let point = GridPoint { form, inner, step, columns: 0..columns.len(), replaces, rewrites, remembers };
                // What takes the place of a term may leave more than it alone, and less beside what else is missing.
                let exchanged = !point.replaces.is_empty() && left[0].is_finite();
                // What is met often may be nothing alone, or act the wrong way round, and be right beside another effect: a steady
                // force beside the sine of an angle whose zero is open, friction beside a spring that is none.
                let asked = self.forms[form].is_common();
                (left[0] < alone || left[1] < alone || exchanged || asked).then_some((left, columns, point))
            })
            .collect();
        let constants = &self.data.constants;
        let mut kept: Vec<Built> = Vec::new();
        for form in 0..self.forms.len() {
            let of_form: Vec<&Built> = built.iter().filter(|(_, _, p)| p.form == form).collect();
            let mut own: Vec<&Built> = Vec::new();
            for (beside, count) in [(0, constants.grid_points), (1, constants.grid_points.div_ceil(3))] {
                let mut sorted = of_form.clone();
                sorted.retain(|b| b.0[beside].is_finite() || beside == 0 && b.0[1].is_infinite());
                sorted.sort_by(|a, b| a.0[beside].total_cmp(&b.0[beside]));
                let further = sorted.into_iter().take(count);
                own.extend(further.filter(|b| !own.iter().any(|o| std::ptr::eq(*o, *b))).collect::<Vec<_>>());
            }
            kept.extend(own.into_iter().cloned());
        }
        kept.into_iter().map(|(_, columns, point)| self.admit(columns, point)).collect()
    }

    fn admit(&mut self, columns: Vec<Vec<f64>>, point: GridPoint) -> GridPoint {
        let from = self.pool.len();
        columns.into_iter().for_each(|c| self.push(c));
        GridPoint { columns: from..self.pool.len(), ..point }
    }

    /// What one effect's columns leave beside the base's and further ones, of which the products are given; none where its signs
    /// are wrong.
    fn left_beside(
        &self,
        (base, further): (&Gram, &[Vec<f64>]),
        columns: &[Vec<f64>],
        (replaces, rewrites): (&[usize], usize),
        form: usize,
    ) -> Option<f64> {
        let before: Vec<&[f64]> = self.pool[..self.base.len()].iter().chain(further).map(Vec::as_slice).collect();
        let gram = base.beside(&before, columns);
        let chosen: Vec<usize> = (1..before.len() + columns.len()).filter(|k| !replaces.contains(k)).collect();
        let own = chosen.len() - columns.len() + rewrites;
        let solution = gram.solve(&chosen)?;
        self.signs_hold(form, &solution.coefficients[own..]).then_some(solution.left)
    }

    fn gram(&self) -> Gram {
        Gram::new(&self.pool, &self.rows.blocks, self.cancel)
    }

    /// The columns of a set: the base's that are not replaced, then each effect's.
    fn columns_of(&self, set: &[usize], points: &[GridPoint]) -> Vec<usize> {
        let gone = |c: &usize| set.iter().any(|p| points[*p].replaces.contains(c));
        let base = (1..self.base.len()).filter(|c| !gone(c));
        base.chain(set.iter().flat_map(|p| points[*p].columns.clone())).collect()
    }

    /// What a set gains over all rows; −∞ where its signs are wrong. For a few sets, for it makes the products anew.
    fn gain(&self, set: &[usize], points: &[GridPoint]) -> f64 {
        let columns = self.columns_of(set, points);
        let chosen: Vec<Vec<f64>> =
            std::iter::once(0).chain(columns.iter().copied()).map(|c| self.pool[c].clone()).collect();
        let gram = Gram::new(&chosen, std::slice::from_ref(&(0..self.rows.len())), self.cancel);
        gram.solve(&(1..chosen.len()).collect::<Vec<_>>()).map_or(f64::NEG_INFINITY, |s| -s.left)
    }

    /// True if no coefficient of a form acts the wrong way round.
    fn signs_hold(&self, form: usize, values: &[f64]) -> bool {
        let mut coefficients = self.forms[form].coefficients.iter().zip(values);
        self.is_turning(form) || coefficients.all(|(c, v)| c.sign == Direction::Any || !c.sign.forbids(*v))
    }

    /// True if every coefficient of a set has a physical sign, and a force that remembers leaves no damper that pushes.
    fn stands(&self, set: &[usize], points: &[GridPoint], columns: &[usize], coefficients: &[f64]) -> bool {
        // A branch that remembers holds the acceleration itself, and with it its noise: what it takes no damper gives back.
        let pushing = |(column, c): (&usize, &f64)| {
            self.dampers.contains(column)
                && c / self.scales[*column] > self.data.constants.pushing_rate(self.data.period)
        };
        if set.iter().any(|p| points[*p].remembers) && columns.iter().zip(coefficients).any(pushing) {
            return false;
        }
        let mut from = coefficients.len() - set.iter().map(|p| points[*p].columns.len()).sum::<usize>();
        set.iter().all(|p| {
            let own = &coefficients[from..from + points[*p].columns.len()];
            from += own.len();
            self.signs_hold(points[*p].form, &own[points[*p].rewrites..])
        })
    }

    /// Scores sets and keeps the best of each set of forms.
    fn note(&self, gram: &Gram, points: &[GridPoint], sets: Vec<Vec<usize>>, found: &mut FoundSets, by: Score) {
        let scored: Vec<(Vec<usize>, f64, Vec<usize>)> = sets
            .into_par_iter()
            .filter_map(|set| {
                let columns = self.columns_of(&set, points);
                if columns.len() > MOST || self.cancel.is_cancelled() {
                    return None;
                }
                let solution = gram.solve(&columns)?;
                if !self.stands(&set, points, &columns, &solution.coefficients) {
                    return None;
                }
                let score = match by {
                    Score::LeftOut => gram.predictive(&columns, self.rows.worth),
                    Score::AllRows => -solution.left,
                };
                let mut key: Vec<usize> = set.iter().map(|p| points[*p].form).collect();
                key.sort_unstable();
                Some((key, score, set))
            })
            .collect();
        for (key, score, set) in scored {
            let known = found.get(&key).map_or(f64::NEG_INFINITY, |f| f.0);
            if score > known {
                found.insert(key, (score, set));
            }
        }
    }

    /// Singles, pairs, the best pairs with a third, and finer grids about what they hold.
    fn search(&mut self, points: &mut Vec<GridPoint>) -> FoundSets {
        let gram = self.gram();
        let mut found = FoundSets::new();
        self.note(&gram, points, vec![Vec::new()], &mut found, Score::LeftOut);
        self.note(&gram, points, (0..points.len()).map(|p| vec![p]).collect(), &mut found, Score::LeftOut);
        let pairs = self.pairs(&gram, points);
        self.note(&gram, points, pairs, &mut found, Score::LeftOut);
        let best = best_of(&found, 2, self.data.constants.pairs_extended);
        let mut thirds: Vec<Vec<usize>> = Vec::new();
        for pair in &best {
            for form in 0..self.forms.len() {
                // Points of a form are sorted best first.
                let of_form = (0..points.len()).filter(|p| points[*p].form == form).take(2);
                thirds
                    .extend(of_form.filter(|p| self.go_together(pair, *p, points)).map(|p| [&pair[..], &[p]].concat()));
            }
        }
        self.note(&gram, points, thirds, &mut found, Score::LeftOut);
        self.zoom(points, &mut found, self.data.constants.zoomed, Score::LeftOut);
        found
    }

    /// For each two forms the pair of points that leaves least.
    fn pairs(&self, gram: &Gram, points: &[GridPoint]) -> Vec<Vec<usize>> {
        let of_first = |a: usize| {
            if self.cancel.is_cancelled() {
                return Vec::new();
            }
            let mut best: HashMap<usize, (f64, usize)> = HashMap::new();
            for b in a + 1..points.len() {
                if !self.go_together(&[a], b, points) {
                    continue;
                }
                let set = [a, b];
                let columns = self.columns_of(&set, points);
                let Some(solution) =
                    gram.solve(&columns).filter(|s| self.stands(&set, points, &columns, &s.coefficients))
                else {
                    continue;
                };
                let entry = best.entry(points[b].form).or_insert((f64::INFINITY, b));
                if solution.left < entry.0 {
                    *entry = (solution.left, b);
                }
            }
            best.into_iter()
                .map(move |(form, (left, b))| ((points[a].form, form), left, vec![a, b]))
                .collect::<Vec<_>>()
        };
        let all: Vec<_> = (0..points.len()).into_par_iter().flat_map_iter(of_first).collect();
        let mut best: HashMap<(usize, usize), (f64, Vec<usize>)> = HashMap::new();
        for (key, left, set) in all {
            let entry = best.entry(key).or_insert((f64::INFINITY, Vec::new()));
            if left < entry.0 {
                *entry = (left, set);
            }
        }
        best.into_values().map(|(_, set)| set).collect()
    }

    /// True if a point's effect may stand beside those of a set: another kind, replacing other terms.
    fn go_together(&self, set: &[usize], point: usize, points: &[GridPoint]) -> bool {
        let new = &points[point];
        set.iter().all(|p| {
            let had = &points[*p];
            let apart = !new.replaces.iter().any(|r| had.replaces.contains(r));
            apart && !self.forms[had.form].is_kin(&self.forms[new.form])
        })
    }

    /// Makes the grid finer, round by round, about what the best sets hold.
    fn zoom(&mut self, points: &mut Vec<GridPoint>, found: &mut FoundSets, beam: usize, by: Score) {
        for _ in 0..ZOOMS {
            if !self.cancel.is_cancelled() {
                self.look_between(points, found, beam, by);
            }
        }
    }

    /// Tries points between those of the grid about what the best sets hold, one inner quantity at a time.
    fn look_between(&mut self, points: &mut Vec<GridPoint>, found: &mut FoundSets, beam: usize, by: Score) {
        let sets: Vec<Vec<usize>> = (1..=LARGEST_SET).flat_map(|n| best_of(found, n, beam)).collect();
        let mut about: HashMap<usize, Vec<usize>> = HashMap::new();
        for p in sets.iter().flatten() {
            if about.contains_key(p) || points[*p].inner.is_empty() || self.cancel.is_cancelled() {
                continue;
            }
            let new = between(&points[*p], &self.forms[points[*p].form]);
            let made: Vec<_> = new
                .into_par_iter()
                .map(|(inner, step)| {
                    let (columns, replaces, rewrites) = self.of_form(&self.forms[points[*p].form], &inner);
                    let GridPoint { form, remembers, .. } = points[*p];
                    let point =
                        GridPoint { form, inner, step, columns: 0..columns.len(), replaces, rewrites, remembers };
                    (columns, point)
                })
                .collect();
            let mut own = Vec::new();
            for (columns, point) in made {
                let point = self.admit(columns, point);
                own.push(points.len());
                points.push(point);
            }
            about.insert(*p, own);
        }
        let gram = self.gram();
        let mut nearer: Vec<Vec<usize>> = Vec::new();
        for set in &sets {
            for (place, p) in set.iter().enumerate() {
                for new in about.get(p).into_iter().flatten() {
                    let mut changed = set.clone();
                    changed[place] = *new;
                    nearer.push(changed);
                }
            }
        }
        self.note(&gram, points, nearer, found, by);
    }

    /// Where few blocks can be left out in turn, the effects and pairs that leave least where all rows count at once: each block may
    /// hold what no other does, as the growth of a motion before it settles. Of three effects some always follow few periods.
    fn leaving_least(&mut self, found: &FoundSets, points: &mut Vec<GridPoint>) -> Vec<(f64, Vec<usize>)> {
        let constants = &self.data.constants;
        if !self.rows.few_blocks {
            return Vec::new();
        }
        let mut least = FoundSets::new();
        let sets = found.values().map(|(_, set)| set).filter(|set| set.len() < LARGEST_SET).cloned().collect();
        self.note(&self.gram(), points, sets, &mut least, Score::AllRows);
        self.zoom(points, &mut least, constants.pairs_extended, Score::AllRows);
        let gram = self.gram();
        let left = |set: &Vec<usize>| gram.solve(&self.columns_of(set, points)).map_or(f64::INFINITY, |s| s.left);
        let mut near = Vec::new();
        for size in 1..LARGEST_SET {
            let best = best_of(&least, size, constants.proposals_of(LARGEST_SET));
            let first = best.first().map_or(f64::INFINITY, left);
            near.extend(best.into_iter().filter(|set| self.is_near(left(set), first)));
        }
        let predictive = |set: &[usize]| gram.predictive(&self.columns_of(set, points), self.rows.worth);
        near.into_iter().map(|set| (predictive(&set), set)).collect()
    }

    /// True if what a set leaves is next to as little as the least, where all rows count at once.
    fn is_near(&self, left: f64, least: f64) -> bool {
        let rows = self.rows.worth * self.rows.len() as f64;
        0.5 * rows * (left / least).ln() < self.data.constants.lead
    }

    /// Of effects that are met most often, the sets of each size that leave least, with those that leave next to as little. All
    /// rows count at once: in a decay the rows that are left out in turn are the only ones of their amplitude.
    fn common(&self, points: &[GridPoint]) -> Vec<(f64, Vec<usize>)> {
        let gram = self.gram();
        let of_common: Vec<usize> = (0..points.len()).filter(|p| self.forms[points[*p].form].is_common()).collect();
        let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
        let mut out: Vec<(f64, Vec<usize>)> = Vec::new();
        for _ in 0..LARGEST_SET {
            let larger = sets.iter().flat_map(|set| of_common.iter().map(move |p| (set, *p)));
            let larger = larger.filter(|(set, p)| set.last().is_none_or(|last| last < p));
            sets = larger
                .filter(|(set, p)| self.go_together(set, *p, points))
                .map(|(set, p)| [&set[..], &[p]].concat())
                .collect();
            let left = |set: &Vec<usize>| {
                let columns = self.columns_of(set, points);
                let solution = gram.solve(&columns)?;
                let stands = self.stands(set, points, &columns, &solution.coefficients);
                stands.then_some((solution.left, columns))
            };
            let mut own: Vec<(f64, Vec<usize>, &Vec<usize>)> =
                sets.iter().filter_map(|set| left(set).map(|(left, columns)| (left, columns, set))).collect();
            own.sort_by(|a, b| a.0.total_cmp(&b.0));
            let Some(least) = own.first().map(|o| o.0) else { continue };
            let count = self.data.constants.proposals_of(LARGEST_SET);
            let near = own.into_iter().take_while(|(left, ..)| self.is_near(*left, least)).take(count);
            out.extend(near.map(|(_, columns, set)| (gram.predictive(&columns, self.rows.worth), set.clone())));
        }
        out
    }

    /// The value of each column of a set.
    fn values(&self, set: &[usize], points: &[GridPoint]) -> Option<HashMap<usize, f64>> {
        let columns = self.columns_of(set, points);
        let chosen: Vec<Vec<f64>> =
            std::iter::once(0).chain(columns.iter().copied()).map(|c| self.pool[c].clone()).collect();
        let gram = Gram::new(&chosen, std::slice::from_ref(&(0..self.rows.len())), self.cancel);
        let solution = gram.solve(&(1..chosen.len()).collect::<Vec<_>>())?;
        Some(columns.iter().zip(&solution.coefficients).map(|(c, x)| (*c, x / self.scales[*c])).collect())
    }

    /// The point from which the spring of the base model pulls beside a set, where that point is open: the constants beside it
    /// say how far it is from where displacements were counted from. None where it is further off than any motion is held about.
    fn held_about(&self, set: &[usize], points: &[GridPoint]) -> Option<f64> {
        let counted = self.inner.equilibrium.filter(|_| self.present.datum)?;
        let value = self.values(set, points)?;
        let first = 1 + self.constants;
        let spring = self.present.plain_terms(self.inner).iter().position(|t| t.term.as_str() == "x")?;
        let pull = value.get(&(first + spring))?;
        let force = (1..first).map(|c| value.get(&c)).sum::<Option<f64>>()? / self.constants as f64;
        let point = counted - force / pull;
        self.data.is_held_about(point).then_some(point)
    }

    /// A set as a model with values to start from.
    fn proposal(&self, set: &[usize], points: &[GridPoint]) -> Option<Proposal> {
        let value = self.values(set, points)?;
        let mut composition = self.present.clone();
        let mut inner = self.inner.clone();
        for p in set {
            let next = composition.with(&self.forms[points[*p].form]);
            inner = next.inner_after(&composition, &inner, &points[*p].inner);
            composition = next;
        }
        let value = |column: usize| value.get(&column).copied();
        let turning = set.iter().find(|p| self.is_turning(points[**p].form));
        let turned = turning.and_then(|p| self.turned(&points[*p], value));
        inner.equilibrium = inner.equilibrium.map(|e| match turned {
            _ if composition.holds_the_zero() => composition.origin,
            Some((_, point)) => point,
            None => e,
        });
        let first = 1 + self.constants;
        let terms = self.present.compose(self.inner).terms.len();
        // A changed term keeps its place.
        let rewritten = |c: usize| {
            let changed = |p: &GridPoint| p.replaces.iter().take(p.rewrites).position(|r| *r == c);
            set.iter().find_map(|p| changed(&points[*p]).map(|k| points[*p].columns.start + k))
        };
        let base = (first..first + terms).filter_map(|c| value(rewritten(c).unwrap_or(c)));
        let own = set.iter().filter(|p| !self.forms[points[**p].form].is_offset());
        let own = own.flat_map(|p| match turned.filter(|_| Some(p) == turning) {
            Some((coefficient, _)) => vec![coefficient],
            None => points[*p].columns.clone().skip(points[*p].rewrites).filter_map(value).collect(),
        });
        let mut coefficients: Vec<f64> = base.chain(own).collect();
        let ranges = composition.ranges().coefficients;
        if coefficients.len() != ranges.len() {
            return None;
        }
        coefficients.iter_mut().zip(&ranges).for_each(|(c, (low, high))| *c = c.clamp(*low, *high));
        let paths: Vec<_> = self.data.fit().iter().map(RecordSeries::path).collect();
        composition.scales = self.data.scales(&composition, &inner, &paths);
        let forms = set.iter().map(|p| points[*p].form).collect();
        Some(Proposal { forms, composition, shared: Parameters { coefficients, inner }.row(), gain: 0.0 })
    }
}

/// What the sensor of a mass shows, and what one sample of it does to the motion that is estimated from it.
fn sensed_quantity(series: &RecordSeries, mass: usize) -> SensedQuantity {
    let order = series.outputs[mass].derivatives();
    if order == 0 {
        return SensedQuantity::Displacement;
    }
    let inputs: Vec<&[f64]> = series.inputs.iter().map(Vec::as_slice).collect();
    let displacement = estimate::response(&series.measured[mass], &inputs, series.interval, order);
    if order == 1 {
        SensedQuantity::Velocity { displacement }
    } else {
        SensedQuantity::Acceleration { velocity: slope(&displacement, series.interval), displacement }
    }
}

/// The steps of a form's grid.
fn steps(form: &Form) -> Vec<PathStep> {
    let of = |grid: &[f64]| {
        let [.., a, b] = grid else { return PathStep::Even(0.0) };
        match grid {
            [first, second, ..]
                if *first > 0.0 && grid.len() > 2 && ((second / first) / (b / a) - 1.0).abs() < 1e-6 =>
            {
                PathStep::Ratio(b / a)
            }
            _ => PathStep::Even(b - a),
        }
    };
    form.inner.iter().map(|inner| of(&inner.grid)).collect()
}

/// Points between a point and its neighbours, one inner quantity at a time, with finer steps.
fn between(point: &GridPoint, form: &Form) -> Vec<(Vec<f64>, Vec<PathStep>)> {
    let mut out = Vec::new();
    for (k, quantity) in form.inner.iter().enumerate() {
        for share in [-2.0 / 3.0, -1.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0] {
            let (mut inner, mut step) = (point.inner.clone(), point.step.clone());
            let (value, finer) = match step[k] {
                PathStep::Even(d) => (inner[k] + share * d, PathStep::Even(d / 3.0)),
                PathStep::Ratio(d) => (inner[k] * d.powf(share), PathStep::Ratio(d.powf(1.0 / 3.0))),
            };
            let (low, high) = quantity.bounds;
            if value > low && value < high && value != inner[k] {
                (inner[k], step[k]) = (value, finer);
                out.push((inner, step));
            }
        }
    }
    out
}

/// The sets of a size with the highest scores.
fn best_of(found: &FoundSets, size: usize, count: usize) -> Vec<Vec<usize>> {
    let mut all: Vec<_> = found.iter().filter(|(key, _)| key.len() == size).collect();
    all.sort_by(|a, b| b.1.0.total_cmp(&a.1.0).then_with(|| a.0.cmp(b.0)));
    all.into_iter().take(count).map(|(_, (_, set))| set.clone()).collect()
}

/// The sets to be fitted, by score, so many of each size. What a set contains (one effect less, or a poorer kind of one) comes
/// before it, unless the set brings more than a crumb of all that was gained.
fn ranked(found: &FoundSets, forms: &[Form], crumb: f64, constants: &Constants) -> Vec<(f64, Vec<usize>)> {
    let none = found.get(&Vec::new()).map_or(f64::NEG_INFINITY, |f| f.0);
    let mut placed: Vec<(f64, bool, &Vec<usize>, &Vec<usize>)> = Vec::new();
    for (key, (score, set)) in found.iter().filter(|(key, _)| !key.is_empty()) {
        let mut held = Vec::new();
        for (k, form) in key.iter().enumerate() {
            let mut rest = key.clone();
            rest.remove(k);
            held.push(rest.clone());
            for simpler in (0..forms.len()).filter(|s| forms[*form].is_richer_kind_of(&forms[*s])) {
                let mut other = [&rest[..], &[simpler]].concat();
                other.sort_unstable();
                held.push(other);
            }
        }
        let best = held.iter().filter_map(|h| found.get(h)).map(|f| f.0).fold(f64::NEG_INFINITY, f64::max);
        let enough = best + crumb * (best - none).max(0.0);
        let stands = *score > enough;
        let place = if stands { *score } else { score.min(best) - 1e-6 * best.abs() };
        placed.push((place, stands || key.len() == 1, key, set));
    }
    placed.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.2.cmp(b.2)));
    let mut counts = [0; LARGEST_SET];
    placed.retain(|(place, stands, key, _)| {
        let count = &mut counts[key.len() - 1];
        let keep = *stands && place.is_finite() && *count < constants.proposals_of(key.len());
        *count += usize::from(keep);
        keep
    });
    placed.into_iter().map(|(.., key, set)| (found[key].0, set.clone())).collect()
}
