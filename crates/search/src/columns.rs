//! Forces of terms along a given motion, and what a linear oscillator makes of them.

use super::data::RecordSeries;
use sindyscope_core::simulate::Delays;
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Expression, Kind, Layout, Program, SampleBlock, Slots, Symbol, Term};

/// Displacements and velocities along a record: `[mass][sample]`.
#[derive(Clone, Debug, Default)]
pub(super) struct MotionPath {
    pub(super) x: Vec<Vec<f64>>,
    pub(super) v: Vec<Vec<f64>>,
}

impl MotionPath {
    /// That of displacements, then velocities, and no more.
    pub(super) fn of(states: &[Vec<f64>]) -> Self {
        let (x, v) = states.split_at(states.len() / 2);
        Self { x: x.to_vec(), v: v.to_vec() }
    }

    pub(super) fn len(&self) -> usize {
        self.x.first().map_or(0, Vec::len)
    }

    /// Displacements, then velocities.
    fn states(&self) -> Vec<&[f64]> {
        self.x.iter().chain(&self.v).map(Vec::as_slice).collect()
    }
}

/// The inputs that a force is evaluated with.
pub(super) struct Inputs<'a> {
    pub(super) values: Vec<&'a [f64]>,
    pub(super) rates: Vec<&'a [f64]>,
}

impl RecordSeries {
    pub(super) fn clock(&self) -> Clock {
        Clock { start: self.start, interval: self.interval }
    }

    /// Its motion as smoothed without a model.
    pub(super) fn path(&self) -> MotionPath {
        MotionPath::of(&self.smoothed.states)
    }

    pub(super) fn inputs(&self) -> Inputs<'_> {
        Inputs {
            values: self.inputs.iter().map(Vec::as_slice).collect(),
            rates: self.input_rates.iter().map(Vec::as_slice).collect(),
        }
    }

    /// The inputs later by their delays: values and rates.
    pub(super) fn delayed_inputs(&self, delays: &Delays) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let grid = self.grid.delayed(delays);
        (grid.sampled(0), grid.sampled(1))
    }
}

/// Time of the first sample and sampling interval, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    pub(super) start: f64,
    pub(super) interval: f64,
}

/// The value of each term at every sample; internal states run along the motion from zero.
pub(super) fn forces(
    terms: &[impl AsRef<Term>],
    internals: &[Equation],
    layout: &Layout,
    series: &RecordSeries,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Vec<Vec<f64>> {
    let layout = Layout { internals: internals.len(), kind: Kind::SecondOrder, ..*layout };
    let z = integrate(internals, &layout, series.clock(), inputs, path);
    let mut states = path.states();
    states.extend(z.iter().map(Vec::as_slice));
    let block = SampleBlock {
        start: series.start,
        interval: series.interval,
        states: &states,
        inputs: &inputs.values,
        input_rates: &inputs.rates,
        accelerations: &[],
    };
    let expressions: Vec<Expression> = terms.iter().map(|t| t.as_ref().expression().clone()).collect();
    let mut columns = vec![Vec::with_capacity(path.len()); terms.len()];
    Program::new(&expressions, &layout).columns(&block, &mut columns);
    columns
}

/// Internal states that are linear in themselves along a motion: exact for forces that change evenly between samples.
fn integrate_linear(
    internals: &[Equation],
    layout: &Layout,
    clock: Clock,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Option<Vec<Vec<f64>>> {
    let count = internals.len();
    if count > MOST_LINEAR {
        return None;
    }
    let outside = Layout { internals: 0, ..*layout };
    let mut a = nalgebra::DMatrix::zeros(3 * count, 3 * count);
    let mut drives: Vec<Expression> = Vec::with_capacity(count);
    for (i, equation) in internals.iter().enumerate() {
        let mut drive = Vec::new();
        for t in &equation.terms {
            match t.term.expression() {
                Expression::Symbol(Symbol::Internal(j)) => a[(i, *j)] += t.coefficient,
                e if outside.covers(e) => {
                    drive.push(Expression::Product(vec![Expression::Number(t.coefficient), e.clone()]));
                }
                _ => return None,
            }
        }
        a[(i, count + i)] = 1.0;
        a[(count + i, 2 * count + i)] = clock.interval.recip();
        drives.push(if drive.is_empty() { Expression::Number(0.0) } else { Expression::Sum(drive).normal() });
    }
    let states = path.states();
    let block = SampleBlock {
        start: clock.start,
        interval: clock.interval,
        states: &states,
        inputs: &inputs.values,
        input_rates: &inputs.rates,
        accelerations: &[],
    };
    let n = path.len();
    let mut forces = vec![Vec::with_capacity(n); count];
    Program::new(&drives, &outside).columns(&block, &mut forces);
    let step = (a * clock.interval).exp();
    let after = step.view((0, 2 * count), (count, count)).clone_owned();
    let before = step.view((0, count), (count, count)) - &after;
    let step = step.view((0, 0), (count, count)).clone_owned();
    let parts = [&step, &before, &after];
    Some(match count {
        1 => stepped::<1>(parts, &forces),
        2 => stepped::<2>(parts, &forces),
        3 => stepped::<3>(parts, &forces),
        _ => stepped::<MOST_LINEAR>(parts, &forces),
    })
}

/// States from zero on: each is so much of the states before, and of the forces at the step's beginning and at its end.
fn stepped<const N: usize>(parts: [&nalgebra::DMatrix<f64>; 3], forces: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let [step, before, after]: [[[f64; N]; N]; 3] =
        parts.map(|part| std::array::from_fn(|i| std::array::from_fn(|j| part[(i, j)])));
    let n = forces[0].len();
    let at = |k: usize| -> [f64; N] { std::array::from_fn(|j| forces[j][k]) };
    let mut out = vec![Vec::with_capacity(n); N];
    let mut state = [0.0; N];
    for k in 0..n {
        for (o, s) in out.iter_mut().zip(&state) {
            o.push(*s);
        }
        if k + 1 < n {
            let (now, then) = (at(k), at(k + 1));
            let part = |i: usize, j: usize| step[i][j] * state[j] + before[i][j] * now[j] + after[i][j] * then[j];
            state = std::array::from_fn(|i| (0..N).map(|j| part(i, j)).sum());
        }
    }
    out
}

/// Internal states that the linear way takes.
const MOST_LINEAR: usize = 4;

/// Internal states along a motion, by the classical Runge–Kutta method, one step a sample.
pub(super) fn integrate(
    internals: &[Equation],
    layout: &Layout,
    clock: Clock,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Vec<Vec<f64>> {
    const STEPS: usize = 1;
    let n = path.len();
    let count = internals.len();
    if count == 0 {
        return Vec::new();
    }
    if let Some(linear) = integrate_linear(internals, layout, clock, inputs, path) {
        return linear;
    }
    let expressions: Vec<Expression> = internals
        .iter()
        .map(|equation| {
            let part = |t: &sindyscope_values::model::WeightedTerm| {
                Expression::Product(vec![Expression::Number(t.coefficient), t.term.expression().clone()])
            };
            Expression::Sum(equation.terms.iter().map(part).collect()).normal()
        })
        .collect();
    let program = Program::new(&expressions, layout);
    let mut slots: Slots = program.slots();
    let address = |s: Symbol| Program::address(layout, s);
    let (time, z) = (address(Symbol::Time), address(Symbol::Internal(0)));
    let places: Vec<(usize, usize)> =
        (0..path.x.len()).map(|i| (address(Symbol::State(i)), address(Symbol::Rate(i)))).collect();
    let driven: Vec<(usize, usize)> =
        (0..layout.inputs).map(|j| (address(Symbol::Input(j)), address(Symbol::InputRate(j)))).collect();
    let h = clock.interval;
    // The displacement between two samples is the cubic that their velocities give, all else a straight line.
    let load = |slots: &mut Slots, k: usize, s: f64| {
        let next = (k + 1).min(n - 1);
        let line = |a: &[f64]| a[k] + s * (a[next] - a[k]);
        let r = 1.0 - s;
        slots[time] = clock.start + h * (k as f64 + s);
        for ((x, v), (displacement, velocity)) in places.iter().zip(path.x.iter().zip(&path.v)) {
            slots[*x] = r * r * ((1.0 + 2.0 * s) * displacement[k] + s * h * velocity[k])
                + s * s * ((1.0 + 2.0 * r) * displacement[next] - r * h * velocity[next]);
            slots[*v] = line(velocity);
        }
        for ((u, du), (values, rates)) in driven.iter().zip(inputs.values.iter().zip(&inputs.rates)) {
            slots[*u] = line(values);
            slots[*du] = line(rates);
        }
    };
    let mut out = vec![Vec::with_capacity(n); count];
    let mut state = vec![0.0; count];
    let mut stage = vec![vec![0.0; count]; 4];
    for k in 0..n {
        for (o, s) in out.iter_mut().zip(&state) {
            o.push(*s);
        }
        for part in 0..STEPS {
            let length = h / STEPS as f64;
            let from = part as f64 / STEPS as f64;
            for (i, (place, weight)) in [(0.0, 0.0), (0.5, 0.5), (0.5, 0.5), (1.0, 1.0)].into_iter().enumerate() {
                // The two middle stages are at one instant.
                if i != 2 {
                    load(&mut slots, k, from + place / STEPS as f64);
                }
                for j in 0..count {
                    let before = if i == 0 { 0.0 } else { stage[i - 1][j] };
                    slots[z + j] = state[j] + weight * length * before;
                }
                program.run(&mut slots);
                for (j, s) in stage[i].iter_mut().enumerate() {
                    *s = slots[program.output(j)];
                }
            }
            for (j, s) in state.iter_mut().enumerate() {
                *s += length / 6.0 * (stage[0][j] + 2.0 * (stage[1][j] + stage[2][j]) + stage[3][j]);
                // A trial value of an inner quantity may be stiffer than the steps are short.
                if !s.is_finite() || s.abs() > 1e100 {
                    *s = 0.0;
                }
            }
        }
    }
    out
}
