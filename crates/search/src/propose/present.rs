//! The data and the present model as columns of a regression, which every set of effects beside that model shares.

use super::gram::Gram;
use super::path::{MeasuredPath, slope};
use super::rows::{Rows, SensedQuantity};
use crate::columns::{Inputs, forces, forces_of_each};
use crate::data::{Data, RecordSeries};
use crate::effects::Addition;
use crate::parameters::InnerValues;
use crate::site::Placed;
use crate::structure::{Composed, Composition};
use sindyscope_core::refine::Structure as _;
use sindyscope_core::study::Cancel;
use sindyscope_values::record::estimate;
use sindyscope_values::term::{Expression, Symbol};

/// A present model in the weak form.
pub(in super::super) struct PresentModel<'a> {
    pub(super) data: &'a Data,
    pub(super) cancel: &'a Cancel,
    pub(super) present: &'a Composition,
    pub(super) inner: &'a InnerValues,
    pub(super) paths: &'a [MeasuredPath],
    pub(super) rows: Rows,
    /// The target, then the model's own columns.
    pub(super) base: Vec<Vec<f64>>,
    /// Of these columns those that are no coefficients: constants of a free zero.
    pub(super) constants: usize,
    /// Terms of the model.
    pub(super) composed: Composed,
    /// Columns of the model's dampers.
    pub(super) dampers: Vec<usize>,
}

impl<'a> PresentModel<'a> {
    /// The model with these inner values along the measured motion; its rows are whitened against the sensors' noise.
    pub(in super::super) fn new(
        data: &'a Data,
        present: &'a Composition,
        inner: &'a InnerValues,
        cancel: &'a Cancel,
    ) -> Self {
        Self::along(data.measured_paths(), data, present, inner, cancel).whitened()
    }

    /// The model along the motion of each fitted record as something else may have it; its rows are not whitened.
    pub(in super::super) fn along(
        paths: &'a [MeasuredPath],
        data: &'a Data,
        present: &'a Composition,
        inner: &'a InnerValues,
        cancel: &'a Cancel,
    ) -> Self {
        let rows = Rows::new(data, paths);
        let (composed, base, dampers) = (present.compose(inner), Vec::new(), Vec::new());
        let mut new = Self { data, cancel, present, inner, paths, rows, base, constants: 0, composed, dampers };
        new.base = new.base_columns();
        new
    }

    /// The same with rows that are whitened against the sensors' noise, as what proposes needs them.
    pub(in super::super) fn whitened(mut self) -> Self {
        self.learn_noise();
        self.rows.whiten(&mut self.base);
        let first = 1 + self.constants;
        self.dampers = self.present.dampers(self.inner).into_iter().map(|(k, _)| first + k).collect();
        self
    }

    /// The noise of the rows is what passes the model as a plain regression on its columns has it.
    fn learn_noise(&mut self) {
        let solution = self.least_squares(&self.base).unwrap_or_default();
        let masses = self.data.masses();
        let mut slopes = vec![(0.0, 0.0); masses];
        for (placed, value) in self.composed.terms.iter().zip(solution.iter().skip(self.constants)) {
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
        self.rows.learn_noise(&slopes, &deviations, &shown);
    }

    /// The target and the model's columns, not whitened.
    fn base_columns(&mut self) -> Vec<Vec<f64>> {
        let data = self.data;
        let target = self.rows.column(|mass, record| {
            let order = 2 - data.outputs[mass].derivatives();
            Some((&*data.fit()[record].measured[mass], order))
        });
        let mut columns = vec![target];
        // What shifts the zero of an angle that turns over is no constant force: the fit alone places it.
        let open = self.present.offset() || data.estimates_displacements();
        if open || self.present.datum && !self.present.is_periodic() {
            columns.extend(self.zeros());
        }
        self.constants = columns.len() - 1;
        columns.extend(self.columns(&self.composed));
        columns
    }

    /// The share of what the model leaves in the rows that a gain in log density explains.
    pub(in super::super) fn explained(&self, gain: f64) -> f64 {
        1.0 - (-2.0 * gain / (self.rows.worth * self.rows.len() as f64)).exp()
    }

    /// A constant force on each mass in each record: to first order what a shifted zero of its sensor does. Not
    /// whitened.
    pub(super) fn zeros(&self) -> Vec<Vec<f64>> {
        let ones: Vec<Vec<f64>> = self.data.fit().iter().map(|s| vec![1.0; s.len()]).collect();
        let each = (0..self.data.masses()).flat_map(|mass| (0..ones.len()).map(move |record| (mass, record)));
        each.map(|(m, r)| self.rows.column(|mass, record| ((mass, record) == (m, r)).then(|| (&*ones[record], 0))))
            .collect()
    }

    /// The coefficients of some forces along the only record of one mass, beside the model; none where they cannot be told apart.
    pub(in super::super) fn beside<const N: usize>(&self, forces: [Vec<f64>; N]) -> Option<[f64; N]> {
        let columns = forces.iter().map(|force| self.rows.column(|_, _| Some((force, 0))));
        let all: Vec<Vec<f64>> = self.base.iter().cloned().chain(columns).collect();
        let coefficients = self.least_squares(&all)?;
        coefficients.last_chunk().copied()
    }

    /// Least squares of the first column on the others over all rows; none where these cannot be told apart.
    fn least_squares(&self, columns: &[Vec<f64>]) -> Option<Vec<f64>> {
        let gram = Gram::new(columns, std::slice::from_ref(&(0..self.rows.len())), self.cancel);
        let all: Vec<usize> = (1..columns.len()).collect();
        gram.solve(&all).map(|s| s.coefficients)
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

    /// The averages of every term of the accelerations, not whitened.
    pub(super) fn columns(&self, composed: &Composed) -> Vec<Vec<f64>> {
        self.columns_of_each(&[composed]).pop().unwrap_or_default()
    }

    /// The same of several accelerations that do not know of one another.
    pub(super) fn columns_of_each(&self, each: &[&Composed]) -> Vec<Vec<Vec<f64>>> {
        let symbol = |composed: &Composed, placed: &Placed| match placed.term.expression() {
            Expression::Symbol(s) if composed.delays.is_none() => Some(*s).filter(|s| self.direct(*s, 0).is_some()),
            _ => None,
        };
        let along = |composed: &Composed| -> Vec<Placed> {
            composed.terms.iter().filter(|placed| symbol(composed, placed).is_none()).cloned().collect()
        };
        let along: Vec<Vec<Placed>> = each.iter().map(|composed| along(composed)).collect();
        // `[record][acceleration][term][sample]`
        let records = self.data.fit().iter().zip(self.paths);
        let values: Vec<Vec<Vec<Vec<f64>>>> =
            records.map(|(s, measured)| self.values_along(each, &along, s, measured)).collect();
        let columns = |(k, composed): (usize, &&Composed)| {
            let mut next = 0;
            let column = |placed: &Placed| match symbol(composed, placed) {
                Some(symbol) => self
                    .rows
                    .column(|mass, record| (mass == placed.mass).then(|| self.direct(symbol, record)).flatten()),
                None => {
                    let own = next;
                    next += 1;
                    self.rows.column(|mass, record| (mass == placed.mass).then(|| (&*values[record][k][own], 0)))
                }
            };
            composed.terms.iter().map(column).collect()
        };
        each.iter().enumerate().map(columns).collect()
    }

    /// The value of some terms of each of several accelerations along a record; those along the inputs as they were measured go
    /// together.
    fn values_along(
        &self,
        each: &[&Composed],
        along: &[Vec<Placed>],
        s: &RecordSeries,
        measured: &MeasuredPath,
    ) -> Vec<Vec<Vec<f64>>> {
        let mut values = vec![Vec::new(); each.len()];
        let (plain, late): (Vec<usize>, Vec<usize>) =
            (0..each.len()).filter(|k| !along[*k].is_empty()).partition(|k| each[*k].delays.is_none());
        let layout = &self.data.layout;
        let together: Vec<_> = plain.iter().map(|k| (along[*k].as_slice(), each[*k].internals.as_slice())).collect();
        let found = forces_of_each(&together, layout, s, &s.inputs(), &measured.path);
        plain.into_iter().zip(found).for_each(|(k, found)| values[k] = found);
        for k in late {
            let (inputs, rates) = s.delayed_inputs(&each[k].delays);
            let inputs = Inputs {
                values: inputs.iter().map(Vec::as_slice).collect(),
                rates: rates.iter().map(Vec::as_slice).collect(),
            };
            values[k] = forces(&along[k], &each[k].internals, layout, s, &inputs, &measured.path);
        }
        values
    }

    /// The columns of the present model's terms that an addition takes the place of.
    pub(super) fn replaced_by(&self, addition: &Addition) -> impl Iterator<Item = usize> {
        let plain = self.present.plain_terms(self.inner);
        let first = 1 + self.constants;
        addition.replaces.iter().filter_map(move |gone| plain.iter().position(|t| t == gone)).map(move |k| first + k)
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
