//! Base terms and candidates estimated together, from the data alone: the weak form.
//!
//! Multiplied by a test function of about a period and integrated by parts, the equation of motion holds for averages of what
//! was measured; no model has to be simulated, so it does not matter how far off the present one is. Each set of effects is
//! regressed together with the base model's terms under the bounds of its coefficients. The estimates are where
//! shooting starts, and their residuals rank the sets; neither is a verdict.
//!
//! Source: D. Messenger, D. Bortz, "Weak sparse identification of nonlinear dynamics", Multiscale Model. Simul. 19 (2021) 1474–1497; test functions (1 − s²)⁶.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::columns::{Inputs, Path, forces};
use super::data::{Data, Series};
use super::parameters::InnerValues;
use super::site::Placed;
use super::structure::{Composed, Composition};
use sindyscope_core::refine::{Output, Structure as _};
use sindyscope_core::signal::{TestFunction, dot, rests, rms};
use sindyscope_core::simulate::Delays;
use sindyscope_core::sparse::{BoundedSolution, Bounds, OrthonormalBasis, bounded_least_squares};
use sindyscope_values::term::{Expression, Symbol, Term};

/// Rows of all records together, about.
const MOST_ROWS: usize = 2000;
/// A mass slower than this share of the RMS velocity may stand still, held by a force that no term gives.
const STANDING: f64 = 0.1;
/// A mass that stands still for this share of the time sticks: a smooth motion is as slow for half of it.
const STICKS: f64 = 0.12;
/// Half width of the test functions where a mass sticks, in periods: they must fit between the stops.
const NARROW: f64 = 0.15;
/// Where a mass sticks, a row counts by this power of the share of its window in which the mass moves.
const STRICT: i32 = 4;

/// Averages over the fitted records.
pub(super) struct Weak<'a> {
    data: &'a Data,
    /// For each mass, how its equation is averaged over each record.
    equations: Vec<Vec<Rows>>,
    /// What the rows of each mass's equation count beside the first's.
    scales: Vec<f64>,
    /// Averages of the accelerations, weighted: the rows of one equation behind those of the other.
    target: Vec<f64>,
    /// Averages of terms that no effect changes.
    known: Mutex<HashMap<(usize, String), Vec<f64>>>,
    /// The measured motion of each record.
    paths: Vec<Path>,
    /// Inputs and their rates under each delay, one pair a record.
    delayed: Mutex<HashMap<Vec<u64>, Arc<Vec<Delayed>>>>,
}

/// Inputs and their rates: `[input][sample]`.
type Delayed = (Vec<Vec<f64>>, Vec<Vec<f64>>);

/// How one record is averaged.
struct Rows {
    function: TestFunction,
    stride: usize,
    /// Share of the window, by the test function, in which the mass moves.
    weights: Vec<f64>,
}

/// What a regression came to.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    /// Coefficients of the composition's terms.
    pub(super) coefficients: Vec<f64>,
    /// Weighted sum of squares left, as a share of the acceleration's.
    pub(super) left: f64,
}

impl Rows {
    fn average(&self, values: &[f64], order: usize) -> Vec<f64> {
        let averages = self.function.averages(values, order, self.stride);
        averages.zip(&self.weights).map(|(average, weight)| weight * average).collect()
    }
}

/// How the equation of one mass is averaged over each record, and the averages of its acceleration.
fn equation(data: &Data, mass: usize) -> (Vec<Rows>, Vec<f64>) {
    let place = data.masses() + mass;
    let velocity = data.fit().iter().map(|s| rms(&s.smoothed.states[place])).fold(0.0, f64::max);
    let total: usize = data.fit().iter().map(Series::len).sum();
    let shortest = data.fit().iter().map(Series::len).min().unwrap_or(0);
    let moving: Vec<Vec<f64>> = data
        .fit()
        .iter()
        .map(|s| {
            let v = &s.smoothed.states[place];
            let across = s.input_rates.first().filter(|_| data.base_excited);
            let slowest = |k: usize| across.map_or(v[k].abs(), |du| v[k].abs().min((v[k] - du[k]).abs()));
            let mut moving: Vec<f64> =
                (0..s.len()).map(|k| f64::from(u8::from(slowest(k) >= STANDING * velocity))).collect();
            // Noise of a velocity may hide a rest that the displacement shows.
            if data.outputs[mass] == Output::Displacement(mass) {
                let noise = data.noise / data.weights[mass];
                for rest in rests(&s.measured[mass], noise, data.period / s.interval) {
                    moving[rest].fill(0.0);
                }
            }
            moving
        })
        .collect();
    // A rest that lasts is no stop between slides: what is averaged widely keeps clear of it.
    let stops = |s: &Series, moving: &[f64]| -> f64 {
        let lasting = (data.period / s.interval) as usize;
        let rests = moving.chunk_by(|a, b| a == b).filter(|part| part[0] == 0.0);
        rests.map(<[f64]>::len).filter(|length| *length <= lasting).sum::<usize>() as f64
    };
    let moved: f64 = moving.iter().flatten().sum();
    let stopped: f64 = data.fit().iter().zip(&moving).map(|(s, moving)| stops(s, moving)).sum();
    let sticks = stopped > STICKS * (moved + stopped);
    let mut target = Vec::new();
    let records = data
        .fit()
        .iter()
        .zip(&moving)
        .map(|(s, moving)| {
            let periods = if sticks { NARROW } else { TestFunction::HALF_WIDTH_IN_PERIODS };
            let width = (periods * data.period / s.interval) as usize;
            let half = width.max(TestFunction::NARROWEST).min((shortest / 10).max(2));
            let mut rows = Rows {
                function: TestFunction::new(half, s.interval),
                stride: TestFunction::spacing(half).max(total / MOST_ROWS).max(1),
                weights: vec![1.0; s.len()],
            };
            rows.weights = rows.average(moving, 0);
            if sticks {
                rows.weights.iter_mut().for_each(|w| *w = w.max(0.0).powi(STRICT));
            }
            target.extend(rows.average(&s.measured[mass], 2 - data.outputs[mass].derivatives()));
            rows
        })
        .collect();
    (records, target)
}

impl<'a> Weak<'a> {
    pub(super) fn new(data: &'a Data) -> Self {
        let each: Vec<(Vec<Rows>, Vec<f64>)> = (0..data.masses()).map(|mass| equation(data, mass)).collect();
        let first = rms(&each[0].1);
        let relative = |target: &[f64]| Some(first / rms(target)).filter(|s| s.is_finite() && *s > 0.0).unwrap_or(1.0);
        let scales: Vec<f64> = each.iter().map(|(_, target)| relative(target)).collect();
        let mut target = Vec::new();
        let mut equations = Vec::new();
        for ((rows, own), scale) in each.into_iter().zip(&scales) {
            target.extend(own.iter().map(|a| scale * a));
            equations.push(rows);
        }
        let paths = data.fit().iter().map(Series::path).collect();
        Self { data, equations, scales, target, paths, known: Mutex::default(), delayed: Mutex::default() }
    }

    /// The averages of a term along the measured motion over one mass's equation; what is linear in a measured channel is not
    /// smoothed before.
    fn direct(&self, placed: &Placed) -> Option<Vec<f64>> {
        let Expression::Symbol(symbol) = placed.term.expression() else { return None };
        let mut column = Vec::new();
        for (rows, s) in self.equations[placed.mass].iter().zip(self.data.fit()) {
            let known = |i: usize| s.outputs.get(i).map_or(2, |o| o.derivatives());
            let (values, order): (&[f64], usize) = match symbol {
                Symbol::State(i) if known(*i) == 0 => (&s.measured[*i], 0),
                Symbol::Rate(i) if known(*i) < 2 => (&s.measured[*i], 1 - known(*i)),
                Symbol::Input(j) => (&s.inputs[*j], 0),
                Symbol::InputRate(j) => (&s.inputs[*j], 1),
                _ => return None,
            };
            column.extend(rows.average(values, order));
        }
        Some(column)
    }

    /// The rows of one mass's equation among all.
    fn span(&self, mass: usize) -> std::ops::Range<usize> {
        let rows = |equation: &Vec<Rows>| equation.iter().map(|r| r.weights.len()).sum::<usize>();
        let from: usize = self.equations[..mass].iter().map(rows).sum();
        from..from + rows(&self.equations[mass])
    }

    /// A column that is zero but in one mass's equation.
    fn padded(&self, mass: usize, own: &[f64]) -> Vec<f64> {
        let span = self.span(mass);
        let mut column = vec![0.0; self.target.len()];
        column[span].iter_mut().zip(own).for_each(|(c, v)| *c = self.scales[mass] * v);
        column
    }

    /// The averages of what a composition adds to the acceleration: a shifted zero of the sensor, to first order a constant
    /// force in each record, then its terms.
    fn columns_of(&self, composition: &Composition, inner: &InnerValues) -> Vec<Vec<f64>> {
        let mut columns = if composition.offset() { self.constants() } else { Vec::new() };
        columns.extend(self.columns(&composition.compose(inner)));
        columns
    }

    /// The averages of a constant force on each mass in each record.
    fn constants(&self) -> Vec<Vec<f64>> {
        let mut columns = Vec::new();
        for (mass, equation) in self.equations.iter().enumerate() {
            let mut from = 0;
            for rows in equation {
                let mut own = vec![0.0; self.span(mass).len()];
                own[from..from + rows.weights.len()].copy_from_slice(&rows.weights);
                from += rows.weights.len();
                columns.push(self.padded(mass, &own));
            }
        }
        columns
    }

    /// The averages of every term of the accelerations.
    fn columns(&self, composed: &Composed) -> Vec<Vec<f64>> {
        let plain = composed.delays.is_none();
        // A term of displacement and velocity is the same whatever is done to the input, and beside any other effect.
        let changes = |t: &Term| {
            let mut changes = false;
            t.expression().visit(&mut |e| {
                changes |= match e {
                    Expression::Symbol(Symbol::Internal(_)) => true,
                    Expression::Symbol(Symbol::Input(_) | Symbol::InputRate(_)) => !plain,
                    _ => false,
                }
            });
            changes
        };
        let key = |placed: &Placed| (placed.mass, placed.term.as_str().to_owned());
        let mut columns: Vec<Option<Vec<f64>>> = composed
            .terms
            .iter()
            .map(|placed| {
                if changes(&placed.term) {
                    return None;
                }
                let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
                known.get(&key(placed)).cloned()
            })
            .collect();
        let missing: Vec<usize> = (0..columns.len()).filter(|k| columns[*k].is_none()).collect();
        let along: Vec<Placed> = missing.iter().map(|k| composed.terms[*k].clone()).collect();
        let mut fresh: Vec<Vec<f64>> = vec![Vec::new(); along.len()];
        let taken: Vec<Option<Vec<f64>>> =
            along.iter().map(|t| if changes(&t.term) { None } else { self.direct(t) }).collect();
        if taken.iter().any(Option::is_none) {
            let delayed = (!plain).then(|| self.delayed(&composed.delays));
            for (r, (path, s)) in self.paths.iter().zip(self.data.fit()).enumerate() {
                let inputs = delayed.as_ref().map(|d| &d[r]).map_or_else(
                    || s.inputs(),
                    |(values, rates)| Inputs {
                        values: values.iter().map(Vec::as_slice).collect(),
                        rates: rates.iter().map(Vec::as_slice).collect(),
                    },
                );
                let values = forces(&along, &composed.internals, &self.data.layout, s, &inputs, path);
                for ((column, values), placed) in fresh.iter_mut().zip(values).zip(&along) {
                    column.extend(self.equations[placed.mass][r].average(&values, 0));
                }
            }
        }
        for ((k, fresh), taken) in missing.into_iter().zip(fresh).zip(taken) {
            let placed = &composed.terms[k];
            let column = self.padded(placed.mass, &taken.unwrap_or(fresh));
            if !changes(&placed.term) {
                let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
                known.insert(key(placed), column.clone());
            }
            columns[k] = Some(column);
        }
        columns.into_iter().flatten().collect()
    }

    fn delayed(&self, delays: &Delays) -> Arc<Vec<Delayed>> {
        let lock = || self.delayed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = lock().get(&delays.bits()) {
            return Arc::clone(known);
        }
        let made = Arc::new(self.data.fit().iter().map(|s| s.delayed_inputs(delays)).collect::<Vec<_>>());
        lock().insert(delays.bits(), Arc::clone(&made));
        made
    }

    /// Estimates a composition's coefficients at these inner values, within their bounds; none where its terms cannot be
    /// told apart.
    pub(super) fn estimate(&self, composition: &Composition, inner: &InnerValues) -> Option<Estimate> {
        let columns = self.columns_of(composition, inner);
        let terms = composition.terms();
        let mut bounds = vec![Bounds::OPEN; columns.len() - terms];
        bounds.extend(composition.ranges().coefficients.into_iter().map(|(low, high)| Bounds { low, high }));
        let BoundedSolution { coefficients, sum_of_squares } = bounded_least_squares(&columns, &self.target, &bounds)?;
        let coefficients = coefficients[columns.len() - terms..].to_vec();
        Some(Estimate { coefficients, left: sum_of_squares / dot(&self.target, &self.target).max(f64::MIN_POSITIVE) })
    }
}

/// The target and further columns without what a model's own terms explain.
pub(super) struct Projector {
    basis: OrthonormalBasis,
    target: Vec<f64>,
    /// Terms of the composition that is projected off, and whether the sensor's zero is free in it.
    terms: usize,
    offset: bool,
}

impl Weak<'_> {
    /// Takes a composition's terms out of everything.
    pub(super) fn projector(&self, composition: &Composition, inner: &InnerValues) -> Projector {
        let mut basis = OrthonormalBasis::default();
        for column in self.columns_of(composition, inner) {
            basis.push(column);
        }
        let mut target = self.target.clone();
        basis.remove(&mut target);
        Projector { basis, target, terms: composition.terms(), offset: composition.offset() }
    }
}

impl Projector {
    /// The columns that a composition has beyond the projected one, made orthonormal; none where they add nothing of their
    /// own, or where the composition rewrites the terms that were there.
    pub(super) fn added(
        &self,
        weak: &Weak<'_>,
        composition: &Composition,
        inner: &InnerValues,
    ) -> Option<Vec<Vec<f64>>> {
        let mut terms = weak.columns(&composition.compose(inner));
        let mut columns = if composition.offset() && !self.offset { weak.constants() } else { Vec::new() };
        columns.extend(terms.split_off(self.terms.min(terms.len())));
        if columns.is_empty() {
            return None;
        }
        let mut own = OrthonormalBasis::default();
        for mut column in columns {
            let whole = dot(&column, &column).sqrt();
            self.basis.remove(&mut column);
            self.basis.remove(&mut column);
            if dot(&column, &column).sqrt() < DISTINCT * whole || !own.push(column) {
                return None;
            }
        }
        Some(own.into_columns())
    }

    /// The sum of squares of what the terms leave.
    pub(super) fn left(&self) -> f64 {
        dot(&self.target, &self.target)
    }

    /// What orthonormal columns leave of the target.
    pub(super) fn rest(&self, columns: &[Vec<f64>]) -> Vec<f64> {
        let mut rest = self.target.clone();
        for q in columns {
            let share = dot(q, &rest);
            rest.iter_mut().zip(q).for_each(|(r, q)| *r -= share * q);
        }
        rest
    }

    /// By how much two sets of orthonormal columns together lower the sum of squares; `rest` is what the first leaves. None
    /// where they are alike.
    pub(super) fn gain(&self, first: &[Vec<f64>], rest: &[f64], second: &[Vec<f64>], same: f64) -> Option<f64> {
        let alone = dot(&self.target, &self.target) - dot(rest, rest);
        let [column] = second else {
            let mut basis = OrthonormalBasis::from_orthonormal(first.to_vec());
            let mut gain = alone;
            for column in second {
                if basis.push(column.clone()) {
                    gain += basis.columns().last().map_or(0.0, |q| dot(q, rest).powi(2));
                }
            }
            return Some(gain);
        };
        let left = 1.0 - first.iter().map(|q| dot(q, column).powi(2)).sum::<f64>();
        (left > same).then(|| alone + dot(column, rest).powi(2) / left)
    }
}

/// Share of a column that must lie outside what the model has.
const DISTINCT: f64 = 1e-5;
