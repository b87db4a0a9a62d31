//! What the sensors' noise does to a regression's rows: how it passes the equation, and how to make uncorrelated rows of it.

use std::sync::Arc;

use crate::signal::{MeasuredSeries, Signals, Smoother, Smoothing, dot, mean_and_variance, rms};
use sindyscope_values::record::Role;
use sindyscope_values::term::{Expression, Kind, Layout, Program, Symbol, Term, derivative};

/// Noise of a channel, at least, as a share of its RMS: in clean data what is left is the arithmetic's.
const MIN_NOISE: f64 = 1e-4;
/// Samples of a record, in its middle, along which slopes are averaged, at most.
const MAX_SLOPE_SAMPLES: usize = 1 << 14;
/// Rows of the factor, at most; the last one serves those beyond.
const MAX_FACTOR_ROWS: usize = 20_000;
/// Change from one row of the factor to the next, as a share of a row's deviation, from which on all further rows are the
/// same.
const SETTLED_CHANGE: f64 = 1e-9;

/// What an equation makes of a small change of one symbol: its slope along the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensitivity {
    pub(super) symbol: Symbol,
    pub(super) mean: f64,
    /// Standard deviation of the slope: a hardening spring passes noise even where, on average, it passes none.
    pub(super) spread: f64,
}

/// What a sensor may measure of a layout: its states, inputs and their rates.
pub(super) fn symbols(layout: &Layout) -> Vec<Symbol> {
    let inputs = (0..layout.inputs).flat_map(|j| [Symbol::Input(j), Symbol::InputRate(j)]);
    layout.state_symbols().chain(inputs).collect()
}

/// The slopes along the smoothed motion of some records of a sum of terms, each with its coefficient.
pub(super) fn slopes<'a>(
    terms: impl Iterator<Item = (&'a Term, f64)>,
    layout: &Layout,
    records: &[Arc<Signals>],
) -> Vec<Sensitivity> {
    let addend = |(t, c): (&Term, f64)| Expression::Product(vec![Expression::Number(c), t.expression().clone()]);
    let equation = Expression::Sum(terms.map(addend).collect());
    let symbols = symbols(layout);
    let slopes: Vec<Expression> = symbols.iter().map(|s| derivative(&equation, *s)).collect();
    let program = Program::new(&slopes, layout);
    let mut along = vec![Vec::new(); slopes.len()];
    for signals in records {
        let slices = signals.slices(&program);
        let count = signals.states.first().map_or(0, Vec::len);
        let from = (count - count.min(MAX_SLOPE_SAMPLES)) / 2;
        program.columns(&slices.block().slice(from..count - from).block(), &mut along);
    }
    symbols
        .iter()
        .zip(&along)
        .map(|(symbol, slope)| {
            let (mean, variance) = mean_and_variance(slope);
            Sensitivity { symbol: *symbol, mean, spread: variance.sqrt() }
        })
        .filter(|p| p.mean.is_finite() && p.spread.is_finite())
        .collect()
}

/// What a unit impulse of a channel's noise makes of the rows around it, by how often the channel is differentiated; one
/// value a sample, all of one length.
#[derive(Clone, Debug)]
pub(super) struct Kernels {
    /// In the rate.
    pub(super) rate: [Vec<f64>; 3],
    /// In the library's columns.
    pub(super) column: [Vec<f64>; 3],
}

/// Segment lengths after which the response to an impulse has died out: of two passes of a local filter, and of a global
/// one.
const RESPONSE_REACH: [usize; 2] = [4, 12];

impl Kernels {
    /// Those of rates and columns that were smoothed; none where the smoothing is not linear.
    pub(super) fn of_smoothing(smoothing: &Smoothing, length: f64, interval: f64) -> Option<Self> {
        let reach = RESPONSE_REACH[usize::from(smoothing.method.is_global())] * length.ceil() as usize;
        let count = (reach | 1).max(65);
        let smoother = Smoother::new(smoothing, length, count);
        if !smoother.is_linear() {
            return None;
        }
        let mut impulse = vec![0.0; count];
        impulse[count / 2] = 1.0;
        let smooth = |values: &[f64]| smoother.smooth(values, interval);
        let slope = |values: &[f64]| smoother.differentiate(values, interval);
        let (smoothed, velocity) = (smooth(&impulse), slope(&impulse));
        let acceleration = slope(&velocity);
        let alike = |values: &[f64]| if smoothing.filter_library { smooth(values) } else { values.to_vec() };
        Some(Self {
            rate: [smooth(&smoothed), slope(&smoothed), acceleration.clone()],
            column: [alike(&smoothed), alike(&velocity), alike(&acceleration)],
        })
    }

    /// Covariance of a row with itself and those after it, `stride` samples apart, in the noise of the rate's channel.
    pub(super) fn covariance(
        &self,
        measured: &[MeasuredSeries],
        rate: (usize, usize),
        passing: &[Sensitivity],
        stride: usize,
    ) -> Vec<f64> {
        let noise: Vec<f64> = measured.iter().map(|m| m.noise.max(MIN_NOISE * rms(&m.values))).collect();
        let unit = noise[rate.0];
        let shares: Vec<f64> = noise.iter().map(|n| if unit > 0.0 { n / unit } else { 1.0 }).collect();
        let count = self.rate[0].len();
        let mut passes = vec![vec![0.0; count]; measured.len()];
        let mut add = |channel: usize, kernel: &[f64], factor: f64| {
            let factor = factor * shares[channel];
            passes[channel].iter_mut().zip(kernel).for_each(|(p, k)| *p += factor * k);
        };
        add(rate.0, &self.rate[rate.1], 1.0);
        // What passes at one time and not at another is correlated with nothing else.
        let mut others = Vec::new();
        for Sensitivity { symbol, mean, spread } in passing {
            if let Some((channel, order)) = place(measured, *symbol) {
                add(channel, &self.column[order], -mean);
                let factor = shares[channel] * spread;
                others.push(self.column[order].iter().map(|k| factor * k).collect());
            }
        }
        let lag = |shift: usize| passes.iter().chain(&others).map(|p| dot(&p[shift..], &p[..count - shift])).sum();
        let mut covariance: Vec<f64> = (0..count).step_by(stride).map(lag).collect();
        let least = f64::EPSILON * covariance[0];
        let last = covariance.iter().rposition(|c| c.abs() > least).unwrap_or(0);
        covariance.truncate(last + 1);
        covariance
    }
}

/// The channel that a symbol is measured by, and how often that must be differentiated.
pub(super) fn place(measured: &[MeasuredSeries], symbol: Symbol) -> Option<(usize, usize)> {
    let channel = |role: Role| measured.iter().position(|m| m.role == role);
    match symbol {
        Symbol::State(i) => Some((channel(Role::Displacement(i))?, 0)),
        Symbol::Rate(i) => match channel(Role::Velocity(i)) {
            Some(channel) => Some((channel, 0)),
            None => Some((channel(Role::Displacement(i))?, 1)),
        },
        Symbol::Acceleration(i) => match channel(Role::Acceleration(i)) {
            Some(channel) => Some((channel, 0)),
            None => place(measured, Symbol::Rate(i)).map(|(channel, order)| (channel, order + 1)),
        },
        Symbol::Input(j) => Some((channel(Role::Input(j))?, 0)),
        Symbol::InputRate(j) => Some((channel(Role::Input(j))?, 1)),
        Symbol::InputAcceleration(j) => Some((channel(Role::Input(j))?, 2)),
        _ => None,
    }
}

/// The channel that a state's rate is measured by, and how often that must be differentiated.
pub(super) fn rate_place(measured: &[MeasuredSeries], layout: &Layout, state: usize) -> Option<(usize, usize)> {
    let velocity = state.checked_sub(layout.freedoms).filter(|_| layout.kind == Kind::SecondOrder);
    let Some(freedom) = velocity else {
        return place(measured, Symbol::State(state)).map(|(channel, order)| (channel, order + 1));
    };
    let acceleration = measured.iter().position(|m| m.role == Role::Acceleration(freedom));
    acceleration
        .map(|channel| (channel, 0))
        .or_else(|| place(measured, Symbol::Rate(freedom)).map(|(channel, order)| (channel, order + 1)))
}

/// A stationary banded covariance's Cholesky factor, row by row.
#[derive(Clone, Debug)]
pub(super) struct Whitening {
    /// Each row of the factor up to its diagonal, so that it lies beside the values it is multiplied with; the last goes on.
    rows: Vec<Vec<f64>>,
    /// What a column of the factor comes to, from its diagonal on.
    settled: Vec<f64>,
}

impl Whitening {
    /// Factors the covariance of a row with itself and those after it; a share `floor` of the variance is white.
    pub(super) fn new(covariance: &[f64], floor: f64, rows: usize) -> Self {
        let band = covariance.len() - 1;
        let mut factor: Vec<Vec<f64>> = Vec::new();
        let floor = floor * covariance[0];
        for i in 0..rows.min(MAX_FACTOR_ROWS) {
            let reach = band.min(i);
            let mut row = vec![0.0; reach + 1];
            for lag in (0..=reach).rev() {
                // The entry in column i − lag, from what both rows have before it.
                let (place, other) = (reach - lag, if lag == 0 { &row } else { &factor[i - lag] });
                let own = other.len() - 1;
                let shared = place.min(own);
                let known = dot(&row[place - shared..place], &other[own - shared..own]);
                let sum = covariance[lag] + if lag == 0 { floor } else { 0.0 } - known;
                row[place] = if lag == 0 { sum.max(floor).sqrt() } else { sum / other[own] };
            }
            let alike = |(a, b): (&f64, &f64)| (a - b).abs() <= SETTLED_CHANGE * covariance[0].sqrt();
            let settled = i > band && factor.last().is_some_and(|before| before.iter().zip(&row).all(alike));
            factor.push(row);
            if settled {
                break;
            }
        }
        let settled = factor.last().map_or_else(Vec::new, |row| row.iter().rev().copied().collect());
        Self { rows: factor, settled }
    }

    /// Appends to what there is a column times the factor's inverse: whitened.
    pub(super) fn apply(&self, column: &[f64], whole: &mut Vec<f64>) {
        let Some(last) = self.rows.len().checked_sub(1) else { return };
        whole.reserve(column.len());
        for (i, value) in column.iter().enumerate() {
            if let Some((diagonal, row)) = self.rows[i.min(last)].split_last() {
                let known = dot(row, &whole[whole.len() - row.len()..]);
                whole.push((value - known) / diagonal);
            }
        }
    }

    /// Appends a column times the factor's transpose to what there is.
    pub(super) fn transposed(&self, column: &[f64], whole: &mut Vec<f64>) {
        let band = self.settled.len();
        whole.extend(column.iter().enumerate().map(|(i, _)| {
            let below = &column[i..column.len().min(i + band)];
            if i + 1 >= self.rows.len() {
                return dot(&self.settled[..below.len()], below);
            }
            let entry = |lag: usize| {
                let row = self.rows.get(i + lag)?;
                row.get(row.len().checked_sub(lag + 1)?)
            };
            below.iter().enumerate().map(|(lag, value)| value * entry(lag).unwrap_or(&self.settled[lag])).sum()
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_and_its_transpose_make_the_covariance() {
        // What a moving sum over four rows makes of white noise, and no white share worth speaking of.
        let covariance = [4.0, 3.0, 2.0, 1.0];
        let n = 40;
        let whitening = Whitening::new(&covariance, 1e-9, n);
        let unit = |k: usize| -> Vec<f64> { (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect() };
        for k in 0..n {
            // L Lᵀ e: the inverse undone by what it is the inverse of.
            let (mut upper, mut back) = (Vec::new(), Vec::new());
            let column: Vec<f64> = (0..n).map(|i| covariance.get(i.abs_diff(k)).copied().unwrap_or(0.0)).collect();
            whitening.apply(&column, &mut upper);
            whitening.transposed(&unit(k), &mut back);
            for i in 0..n {
                assert!((upper[i] - back[i]).abs() < 1e-6, "{i} {k}: {} {}", upper[i], back[i]);
            }
        }
    }

    #[test]
    fn kernels_say_what_noise_makes_of_a_smoothed_rate() {
        use crate::signal::Differentiation;
        for method in
            [Differentiation::Filter, Differentiation::Spline, Differentiation::Spectral, Differentiation::Kalman]
        {
            let smoothing = Smoothing { method, from_data: false, ..Smoothing::default() };
            let kernels = Kernels::of_smoothing(&smoothing, 31.0, 0.01).unwrap();
            // What a slow wave makes of the response to an impulse is how the wave is smoothed and differentiated.
            let rate = std::f64::consts::TAU / (8.0 * 31.0);
            for (order, kernel) in kernels.rate.iter().enumerate() {
                let middle = (kernel.len() / 2) as f64;
                let waves = kernel.iter().enumerate().map(|(i, k)| (k, rate * (middle - i as f64)));
                let passed: f64 = match order {
                    1 => waves.map(|(k, phase)| k * phase.sin()).sum(),
                    _ => waves.map(|(k, phase)| k * phase.cos()).sum(),
                };
                let gain = passed.abs() / (rate / 0.01).powi(order as i32);
                assert!((gain - 1.0).abs() < 0.01, "{method:?} {order}: {gain}");
            }
        }
    }
}
