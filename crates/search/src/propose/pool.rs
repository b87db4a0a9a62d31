//! The data, the present model and the effects as columns of one regression.

use super::gram::Gram;
use super::path::slope;
use super::rows::{Rows, SensedQuantity};
use super::{GridPoint, SetRegression};
use crate::columns::{Inputs, forces};
use crate::data::{Data, RecordSeries};
use crate::effects::{Addition, Form};
use crate::parameters::InnerValues;
use crate::site::Placed;
use crate::structure::{Composed, Composition, counted_from};
use sindyscope_core::refine::Structure as _;
use sindyscope_core::signal::dot;
use sindyscope_core::study::Cancel;
use sindyscope_values::record::estimate;
use sindyscope_values::term::{Expression, Symbol, Term};

impl<'a> SetRegression<'a> {
    pub(super) fn new(
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
    pub(super) fn zeros(&self) -> Vec<Vec<f64>> {
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
    pub(super) fn columns(&self, composed: &Composed) -> Vec<Vec<f64>> {
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

    pub(super) fn push(&mut self, mut column: Vec<f64>) {
        let scale = if self.pool.is_empty() { 1.0 } else { dot(&column, &column).sqrt().max(f64::MIN_POSITIVE) };
        column.iter_mut().for_each(|c| *c /= scale);
        self.pool.push(column);
        self.scales.push(scale);
    }

    /// The columns of the present model's terms that an addition takes the place of.
    pub(super) fn replaced_by(&self, addition: &Addition) -> impl Iterator<Item = usize> {
        let plain = self.present.plain_terms(self.inner);
        let first = 1 + self.constants;
        addition.replaces.iter().filter_map(move |gone| plain.iter().position(|t| t == gone)).map(move |k| first + k)
    }

    /// The columns of a form at inner values, and which of the present model's they replace.
    pub(super) fn of_form(&self, form: &Form, inner: &[f64]) -> (Vec<Vec<f64>>, Vec<usize>, usize) {
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

    pub(super) fn gram(&self) -> Gram {
        Gram::new(&self.pool, &self.rows.blocks, self.cancel)
    }

    /// The columns of a set: the base's that are not replaced, then each effect's.
    pub(super) fn columns_of(&self, set: &[usize], points: &[GridPoint]) -> Vec<usize> {
        let gone = |c: &usize| set.iter().any(|p| points[*p].replaces.contains(c));
        let base = (1..self.base.len()).filter(|c| !gone(c));
        base.chain(set.iter().flat_map(|p| points[*p].columns.clone())).collect()
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
