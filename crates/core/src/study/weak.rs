//! The weak form: equations held against averages over test functions that take the derivatives off the measurement.

use std::ops::Range;
use std::sync::Arc;

use super::StudyError;
use super::noise::{Kernels, Sensitivity, Whitening, place, rate_place, slopes, symbols};
use super::regression::sliding::{RowRaster, stretch_of_sliding};
use crate::signal::{MeasuredSeries, Signals, TestFunction};
use crate::sparse::Reduced;
use sindyscope_values::term::{Expression, Kind, Layout, Program, Symbol, Term, derivative};

/// Share of a row's variance that is no sensor's noise: what forces on the smoothed motion and the model itself miss.
/// Without it the fastest rows, in which there is next to no motion, would weigh most. A tenth and a thousandth do as well
/// on the report's systems.
const WHITE_SHARE: f64 = 1e-2;
/// Ridge, as a share of a column's square, of the fit whose slopes say what noise passes: without it slopes across a path
/// along which terms are nearly dependent would be arbitrary.
const SLOPE_RIDGE: f64 = 1e-4;

/// How measurements are averaged, and what their noise does to the averages.
///
/// With a test function φ that vanishes at its ends, ⟨φ, ẍ⟩ = ⟨φ̈, x⟩: the equation ẍ = Σ θₖ fₖ becomes one between
/// averages of what was measured, terms linear in velocities included; only forces that are not linear are evaluated on
/// the smoothed motion (Messenger & Bortz 2021; Reinbold, Gurevich & Grigoriev 2020). White noise of a sensor passes the
/// linear part of the equation, so the covariance of the averages is known, and they are whitened with it.
#[derive(Clone, Debug)]
pub(super) struct WeakForm {
    half_width: usize,
    /// Samples between the centres of neighbouring test functions.
    stride: usize,
    /// Share of a row's variance that is no sensor's noise.
    floor: f64,
    /// For each fitted state what noise of each symbol passes.
    passing: Vec<Vec<Sensitivity>>,
}

/// Columns and rate of one fitted state.
#[derive(Clone, Debug, Default)]
pub(super) struct StateRows {
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) rate: Vec<f64>,
}

/// The half width of the weak form's test functions that records suggest, samples.
pub fn suggested_half_width<'a>(records: impl Iterator<Item = &'a Signals>) -> usize {
    let (mut shortest, mut period) = (usize::MAX, f64::INFINITY);
    for signals in records {
        shortest = shortest.min(length(signals));
        period = signals.main_period.map_or(period, |p| period.min(p / signals.interval));
    }
    let half_width =
        if period.is_finite() { TestFunction::HALF_WIDTH_IN_PERIODS * period } else { 0.02 * shortest as f64 };
    (half_width as usize).min(shortest / 10).max(TestFunction::NARROWEST)
}

/// The half width that records suggest, or as much less as lets test functions lie between the standstills of a body that
/// sticks, where dry friction is whatever holds it: a quarter of a stretch of sliding leaves half of it to their centres.
fn half_width_for(terms: &[Term], layout: &Layout, records: &[Arc<Signals>]) -> usize {
    let suggested = suggested_half_width(records.iter().map(|s| &**s));
    let sliding = stretch_of_sliding(terms, layout, records);
    sliding.map_or(suggested, |samples| suggested.min(samples / 4).max(TestFunction::NARROWEST))
}

fn length(signals: &Signals) -> usize {
    signals.states.first().map_or(0, Vec::len)
}

impl WeakForm {
    /// The weak form of the equations of some states over some records.
    pub(super) fn new(
        layout: &Layout,
        terms: &[Term],
        records: &[Arc<Signals>],
        half_width: Option<usize>,
        fitted: &[usize],
        most_rows: usize,
    ) -> Result<Self, StudyError> {
        let half_width = half_width.unwrap_or_else(|| half_width_for(terms, layout, records)).max(2);
        if let Some(short) = records.iter().map(|s| length(s)).filter(|n| *n < 4 * half_width).min() {
            return Err(StudyError::Setting(format!(
                "a record of {short} samples is too short for test functions of half width {half_width}: it needs {}",
                4 * half_width
            )));
        }
        let total: usize = records.iter().map(|s| length(s)).sum();
        let stride = TestFunction::spacing(half_width).max(total.div_ceil(most_rows)).max(1);
        let mut weak = Self { half_width, stride, floor: WHITE_SHARE, passing: Vec::new() };
        weak.passing = weak.passing(layout, terms, records, fitted);
        Ok(weak)
    }

    /// Samples between neighbouring rows.
    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    /// How its rows lie on a record's samples.
    pub(super) fn raster(&self, signals: &Signals) -> RowRaster {
        RowRaster {
            rows: self.rows(length(signals)),
            first: self.half_width,
            stride: self.stride,
            reach: self.half_width,
        }
    }

    /// Number of rows of a series of `samples` samples.
    fn rows(&self, samples: usize) -> usize {
        samples.saturating_sub(self.span()) / self.stride + 1
    }

    /// Samples that one row averages over.
    pub(super) fn span(&self) -> usize {
        2 * self.half_width + 1
    }

    /// What noise passes: the slopes of the equation nearest to the data, in the library's terms and in every symbol by
    /// itself, fitted without whitening.
    fn passing(
        &self,
        layout: &Layout,
        terms: &[Term],
        records: &[Arc<Signals>],
        fitted: &[usize],
    ) -> Vec<Vec<Sensitivity>> {
        let mut all: Vec<Term> = symbols(layout).into_iter().map(|s| Term::new(Expression::Symbol(s))).collect();
        all.extend(terms.iter().filter(|t| !all.contains(t)).cloned().collect::<Vec<_>>());
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); all.len() + 1];
        let mut rates: Vec<Vec<f64>> = vec![Vec::new(); fitted.len()];
        for signals in records {
            let function = TestFunction::new(self.half_width, signals.interval);
            for (column, averages) in columns.iter_mut().zip(self.columns(layout, &all, signals, &function)) {
                column.extend(averages);
            }
            for (rate, state) in rates.iter_mut().zip(fitted) {
                if let Some((channel, order)) = rate_place(&signals.measured, layout, *state) {
                    rate.extend(function.averages(&signals.measured[channel].values, order, self.stride));
                }
            }
        }
        let rows = rates.first().map_or(0, Vec::len);
        columns[all.len()].resize(rows, 1.0);
        rates
            .iter()
            .map(|rate| {
                let reduced = Reduced::new(&columns, rate);
                let usable: Vec<usize> = (0..columns.len()).filter(|k| !reduced.unusable(*k)).collect();
                let coefficients = reduced.damped(&usable, SLOPE_RIDGE);
                let known = usable.iter().zip(coefficients).filter_map(|(k, c)| Some((all.get(*k)?, c)));
                slopes(known, layout, records)
            })
            .collect()
    }

    /// Appends a record's rows that are kept, whitened, to those of each fitted state.
    pub(super) fn append(
        &self,
        layout: &Layout,
        terms: &[Term],
        signals: &Signals,
        fitted: &[usize],
        kept: &[Range<usize>],
        rows: &mut [StateRows],
    ) {
        let function = TestFunction::new(self.half_width, signals.interval);
        let columns = self.columns(layout, terms, signals, &function);
        let both = Kernels { rate: function.kernels().clone(), column: function.kernels().clone() };
        for ((state, passing), rows) in fitted.iter().zip(&self.passing).zip(rows) {
            let Some((channel, order)) = rate_place(&signals.measured, layout, *state) else { continue };
            let measured = &signals.measured[channel].values;
            let rate: Vec<f64> = function.averages(measured, order, self.stride).collect();
            let covariance = both.covariance(&signals.measured, (channel, order), passing, self.stride);
            let longest = kept.iter().map(Range::len).max().unwrap_or(0);
            let whitening = Whitening::new(&covariance, self.floor, longest);
            for stretch in kept {
                for (whole, column) in rows.columns.iter_mut().zip(&columns) {
                    whitening.apply(&column[stretch.clone()], whole);
                }
                whitening.apply(&rate[stretch.clone()], &mut rows.rate);
            }
        }
    }

    /// The averages of every term, not yet whitened: `[term][row]`.
    fn columns(&self, layout: &Layout, terms: &[Term], signals: &Signals, function: &TestFunction) -> Vec<Vec<f64>> {
        let parts: Vec<Vec<AveragedPart>> =
            terms.iter().map(|t| parts(t.expression(), layout, &signals.measured)).collect();
        let on_path: Vec<Expression> = parts
            .iter()
            .flatten()
            .filter_map(|p| if let AveragedSeries::Path(e) = &p.source { Some(e.clone()) } else { None })
            .collect();
        let mut along = vec![Vec::new(); on_path.len()];
        let program = Program::new(&on_path, layout);
        program.columns(&signals.slices(&program).block(), &mut along);
        let mut along = along.iter();
        parts
            .iter()
            .map(|parts| {
                let mut column: Vec<f64> = Vec::new();
                for AveragedPart { factor, order, source } in parts {
                    let values: &[f64] = match source {
                        AveragedSeries::Measured(channel) => &signals.measured[*channel].values,
                        AveragedSeries::Path(_) => along.next().map_or(&[], Vec::as_slice),
                    };
                    column.resize(self.rows(values.len()), 0.0);
                    let averages = function.averages(values, *order, self.stride);
                    column.iter_mut().zip(averages).for_each(|(c, a)| *c += factor * a);
                }
                column
            })
            .collect()
    }
}

/// A part of a term: a series times a factor, whose derivative of some order is averaged.
#[derive(Clone, Debug, PartialEq)]
struct AveragedPart {
    factor: f64,
    order: usize,
    source: AveragedSeries,
}

#[derive(Clone, Debug, PartialEq)]
enum AveragedSeries {
    Measured(usize),
    /// Evaluated along the smoothed motion.
    Path(Expression),
}

/// A term taken apart: what is linear comes from the measurement, `xⁿ v` is the derivative of `xⁿ⁺¹/(n+1)`, and `g(x) a` that
/// of `g v` without what `g` changes by.
fn parts(expression: &Expression, layout: &Layout, measured: &[MeasuredSeries]) -> Vec<AveragedPart> {
    let addends: &[Expression] =
        if let Expression::Sum(parts) = expression { parts } else { std::slice::from_ref(expression) };
    let taken: Option<Vec<Vec<AveragedPart>>> = addends
        .iter()
        .map(|e| {
            let one = linear(e, measured).or_else(|| total_derivative(e, layout, measured));
            one.map(|part| vec![part]).or_else(|| inertial(e, layout))
        })
        .collect();
    let whole = || vec![AveragedPart { factor: 1.0, order: 0, source: AveragedSeries::Path(expression.clone()) }];
    taken.map_or_else(whole, |parts| parts.concat())
}

/// The numbers of a product multiplied, and its other factors.
fn factors(expression: &Expression) -> (f64, Vec<&Expression>) {
    let all =
        if let Expression::Product(parts) = expression { parts.as_slice() } else { std::slice::from_ref(expression) };
    let number = |e: &Expression| if let Expression::Number(n) = e { Some(*n) } else { None };
    (all.iter().filter_map(number).product(), all.iter().filter(|e| number(e).is_none()).collect())
}

fn linear(expression: &Expression, measured: &[MeasuredSeries]) -> Option<AveragedPart> {
    let (factor, rest) = factors(expression);
    let [Expression::Symbol(symbol)] = rest.as_slice() else { return None };
    let (channel, order) = place(measured, *symbol)?;
    Some(AveragedPart { factor, order, source: AveragedSeries::Measured(channel) })
}

fn total_derivative(expression: &Expression, layout: &Layout, measured: &[MeasuredSeries]) -> Option<AveragedPart> {
    let (factor, rest) = factors(expression);
    let rate = rest.iter().position(|e| matches!(e, Expression::Symbol(Symbol::Rate(_))))?;
    let Expression::Symbol(Symbol::Rate(freedom)) = rest[rate] else { return None };
    // A velocity measured by itself needs no derivative.
    if layout.kind != Kind::SecondOrder || place(measured, Symbol::Rate(*freedom))?.1 == 0 {
        return None;
    }
    let state = Expression::Symbol(Symbol::State(*freedom));
    let mut power = 1.0;
    for (_, e) in rest.iter().enumerate().filter(|(k, _)| *k != rate) {
        match e {
            Expression::Power(base, n) if **base == state => power += n,
            e if **e == state => power += 1.0,
            _ => return None,
        }
    }
    if power == 0.0 {
        return None;
    }
    let integral = Expression::Power(Box::new(state), power).normal();
    Some(AveragedPart { factor: factor / power, order: 1, source: AveragedSeries::Path(integral) })
}

/// A product of an acceleration and a function of displacements: `g a = d(g v)/dt − (dg/dt) v`.
fn inertial(expression: &Expression, layout: &Layout) -> Option<Vec<AveragedPart>> {
    let (factor, rest) = factors(expression);
    let place = rest.iter().position(|e| matches!(e, Expression::Symbol(Symbol::Acceleration(_))))?;
    let Expression::Symbol(Symbol::Acceleration(freedom)) = rest[place] else { return None };
    let others = rest.iter().enumerate().filter(|(k, _)| *k != place).map(|(_, e)| (*e).clone());
    let function = Expression::Product(others.collect()).normal();
    let mut moves = true;
    function.visit(&mut |e| moves &= !matches!(e, Expression::Symbol(s) if !matches!(s, Symbol::State(_))));
    if !moves {
        return None;
    }
    let velocity = Expression::Symbol(Symbol::Rate(*freedom));
    let changes = (0..layout.freedoms).map(|i| derivative(&function, Symbol::State(i)) * Symbol::Rate(i)).collect();
    let part = |factor: f64, order: usize, e: Expression| AveragedPart {
        factor,
        order,
        source: AveragedSeries::Path(e.normal()),
    };
    Some(vec![
        part(factor, 1, function.clone() * velocity.clone()),
        part(-factor, 0, Expression::Sum(changes) * velocity),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{SignalFacts, Smoothing, dot, rms};
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};
    use sindyscope_values::record::{Channel, Record, Role};

    const INTERVAL: f64 = 0.01;
    const LAYOUT: Layout = Layout { kind: Kind::SecondOrder, freedoms: 1, inputs: 1, internals: 0 };

    /// A motion's displacement and input, each with white noise of its own.
    fn signals(motion: impl Fn(f64) -> [f64; 2], noise: f64, count: usize) -> Arc<Signals> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let mut deviate = || -> f64 {
            let deviate: f64 = StandardNormal.sample(&mut rng);
            noise * deviate
        };
        let mut series = |which: usize| -> Arc<[f64]> {
            (0..count).map(|k| motion(INTERVAL * k as f64)[which] + deviate()).collect()
        };
        let channel =
            |role, values| Channel { name: String::new(), role, unit: String::new(), values, estimated: false };
        let record = Record {
            name: String::new(),
            source: None,
            start: 0.0,
            interval: INTERVAL,
            channels: vec![channel(Role::Displacement(0), series(0)), channel(Role::Input(0), series(1))],
            notices: Vec::new(),
        };
        Arc::new(Signals::new(&record, &LAYOUT, &Smoothing::default(), &SignalFacts::new(&record, &LAYOUT)))
    }

    fn terms(list: &str) -> Vec<Term> {
        sindyscope_values::term::list(list).unwrap()
    }

    fn rows(weak: &WeakForm, terms: &[Term], signals: &Signals) -> StateRows {
        let mut rows = [StateRows { columns: vec![Vec::new(); terms.len()], rate: Vec::new() }];
        let all = 0..weak.raster(signals).rows;
        weak.append(&LAYOUT, terms, signals, &[1], &[all], &mut rows);
        let [rows] = rows;
        rows
    }

    #[test]
    fn a_motion_keeps_its_equation() {
        // x = sin 3t + sin 5t obeys ẍ = −9x − v + u with u = ẍ + 9x + v.
        let motion = |t: f64| {
            let (x, v, a) = (
                (3.0 * t).sin() + (5.0 * t).sin(),
                3.0 * (3.0 * t).cos() + 5.0 * (5.0 * t).cos(),
                -9.0 * (3.0 * t).sin() - 25.0 * (5.0 * t).sin(),
            );
            [x, a + 9.0 * x + v]
        };
        let signals = signals(motion, 0.0, 3000);
        let terms = terms("x, v, u, x*v");
        for half_width in [TestFunction::NARROWEST, 20, 100, 400] {
            let weak =
                WeakForm::new(&LAYOUT, &[], &[Arc::clone(&signals)], Some(half_width), &[1], usize::MAX).unwrap();
            let StateRows { columns, rate } = rows(&weak, &terms, &signals);
            let found = Reduced::new(&columns, &rate).least_squares(&[0, 1, 2, 3]);
            for (found, truth) in found.iter().zip([-9.0, -1.0, 1.0, 0.0]) {
                // Sums over the narrowest test function are integrals to five digits.
                assert!((found - truth).abs() < 1e-4, "{half_width}: {found} {truth}");
            }
        }
    }

    #[test]
    fn accelerations_are_averaged_without_being_estimated() {
        let motion = |t: f64| [(3.0 * t).sin(), -9.0 * (3.0 * t).sin()];
        let product: Vec<f64> = (0..3000).map(|k| motion(INTERVAL * k as f64)).map(|[x, a]| x.cos() * a).collect();
        for (noise, bound) in [(0.0, 1e-5), (1e-3, 4e-3)] {
            let signals = signals(motion, noise, 3000);
            let function = TestFunction::new(40, INTERVAL);
            let weak = WeakForm::new(&LAYOUT, &[], &[Arc::clone(&signals)], Some(40), &[1], usize::MAX).unwrap();
            let averaged: Vec<f64> = function.averages(&product, 0, weak.stride).collect();
            let column = weak.columns(&LAYOUT, &terms("cos(x)*a"), &signals, &function).swap_remove(0);
            let apart: Vec<f64> = averaged.iter().zip(&column).map(|(a, b)| a - b).collect();
            assert!(rms(&apart) < bound * rms(&averaged), "{noise}: {} of {}", rms(&apart), rms(&averaged));
        }
    }

    #[test]
    fn noise_alone_gives_rows_that_do_not_hang_together() {
        let signals = signals(|_| [0.0; 2], 1e-3, 200_000);
        let mut weak = WeakForm::new(&LAYOUT, &[], &[Arc::clone(&signals)], Some(30), &[1], usize::MAX).unwrap();
        weak.floor = 1e-9;
        let passing = |(symbol, mean)| Sensitivity { symbol, mean, spread: 0.0 };
        let slopes = [(Symbol::State(0), -40.0), (Symbol::Rate(0), -2.0), (Symbol::Input(0), 30.0)];
        weak.passing = vec![slopes.map(passing).to_vec()];
        let StateRows { columns, rate } = rows(&weak, &terms("x, v, u"), &signals);
        let residual: Vec<f64> = (0..rate.len())
            .map(|k| rate[k] + 40.0 * columns[0][k] + 2.0 * columns[1][k] - 30.0 * columns[2][k])
            .collect();
        let power = dot(&residual, &residual) / residual.len() as f64;
        // 40 000 rows: a variance is known to 0.7 %, a correlation to 0.005; the noise itself to 1 %.
        assert!((power.sqrt() / 1e-3 - 1.0).abs() < 0.02, "{power}");
        for lag in 1..20 {
            let correlation = dot(&residual[lag..], &residual[..residual.len() - lag]) / residual.len() as f64 / power;
            assert!(correlation.abs() < 0.03, "{lag}: {correlation}");
        }
    }

    #[test]
    fn derivatives_are_taken_off_what_is_linear() {
        let measured = signals(|t| [t, t], 0.0, 100).measured.clone();
        let orders = |text: &str| -> Vec<(f64, usize, bool)> {
            let parts = parts(Term::parse(text).unwrap().expression(), &LAYOUT, &measured);
            parts.iter().map(|p| (p.factor, p.order, matches!(p.source, AveragedSeries::Measured(_)))).collect()
        };
        assert_eq!(orders("v"), [(1.0, 1, true)]);
        assert_eq!(orders("-2*x"), [(-2.0, 0, true)]);
        assert_eq!(orders("v-du"), [(1.0, 1, true), (-1.0, 1, true)]);
        assert_eq!(orders("x^2*v"), [(1.0 / 3.0, 1, false)]);
        assert_eq!(orders("2*a"), [(2.0, 2, true)]);
        assert_eq!(orders("3*x^2*a"), [(3.0, 1, false), (-3.0, 0, false)]);
        assert_eq!(orders("v*a"), [(1.0, 0, false)]);
        assert_eq!(orders("v/x"), [(1.0, 0, false)], "its integral is a logarithm");
        assert_eq!(orders("v*|v|"), [(1.0, 0, false)]);
        assert_eq!(orders("x-u^2"), [(1.0, 0, false)]);
    }

    #[test]
    fn a_record_too_short_is_refused_in_words() {
        let signals = signals(|t| [t.sin(), t.cos()], 0.0, 100);
        let refused = WeakForm::new(&LAYOUT, &[], &[signals], Some(50), &[1], usize::MAX).unwrap_err();
        assert!(refused.to_string().contains("half width 50"), "{refused}");
    }
}
