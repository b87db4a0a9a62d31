//! Internal states of effects that remember, along a given motion from zero.

use fearless_simd::{Level, dispatch};

use super::columns::{COLUMNS_AT_ONCE, Clock, Inputs, MotionPath};
use sindyscope_values::model::{Equation, WeightedTerm};
use sindyscope_values::term::{Expression, Kind, Layout, Program, SampleBlock, Symbol};

/// The internal states of each of several sets of equations, those that are alike but for their numbers at once:
/// `[set][state][sample]`.
pub(super) fn internal_states(
    each: &[&[Equation]],
    layout: &Layout,
    clock: Clock,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Vec<Vec<Vec<f64>>> {
    let with = |internals: &[Equation]| Layout { internals: internals.len(), kind: Kind::SecondOrder, ..*layout };
    let mut states: Vec<Option<Vec<Vec<f64>>>> =
        each.iter().map(|internals| integrate_linear(internals, &with(internals), clock, inputs, path)).collect();
    let others = (0..each.len()).filter(|k| states[*k].is_none());
    let others: Vec<(usize, CompiledRates)> = others.map(|k| (k, CompiledRates::new(each[k], with(each[k])))).collect();
    let alike = others.chunk_by(|(_, a), (_, b)| a.program.is_like(&b.program)).flat_map(|c| c.chunks(COLUMNS_AT_ONCE));
    for some in alike {
        let rates: Vec<&CompiledRates> = some.iter().map(|(_, rates)| rates).collect();
        let found = match rates.len() {
            1 => integrated::<1>(&rates, clock, inputs, path),
            _ => dispatch!(Level::new(), _simd => integrated::<COLUMNS_AT_ONCE>(&rates, clock, inputs, path)),
        };
        some.iter().zip(found).for_each(|((k, _), found)| states[*k] = Some(found));
    }
    states.into_iter().map(Option::unwrap_or_default).collect()
}

/// The internal states of one set of equations.
pub(super) fn integrate(
    internals: &[Equation],
    layout: &Layout,
    clock: Clock,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Vec<Vec<f64>> {
    internal_states(&[internals], layout, clock, inputs, path).pop().unwrap_or_default()
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
    if count == 0 {
        return Some(Vec::new());
    }
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

/// The rates of internal states, compiled.
struct CompiledRates {
    layout: Layout,
    count: usize,
    program: Program,
}

impl CompiledRates {
    fn new(internals: &[Equation], layout: Layout) -> Self {
        let part = |t: &WeightedTerm| {
            Expression::Product(vec![Expression::Number(t.coefficient), t.term.expression().clone()])
        };
        let rate = |equation: &Equation| Expression::Sum(equation.terms.iter().map(part).collect()).normal();
        let rates: Vec<Expression> = internals.iter().map(rate).collect();
        Self { count: internals.len(), program: Program::new(&rates, &layout), layout }
    }
}

/// The motion and the inputs, and the slots that they have in a program.
struct MotionSlots<'a> {
    clock: Clock,
    samples: usize,
    time: usize,
    /// Slots of displacement and velocity, and their series.
    states: Vec<([usize; 2], [&'a [f64]; 2])>,
    /// The same of inputs and their rates.
    inputs: Vec<([usize; 2], [&'a [f64]; 2])>,
}

impl<'a> MotionSlots<'a> {
    fn new(layout: &Layout, clock: Clock, inputs: &Inputs<'a>, path: &'a MotionPath) -> Self {
        let slots = |value: Symbol, rate: Symbol| [value, rate].map(|symbol| Program::address(layout, symbol));
        let states = path.x.iter().zip(&path.v).enumerate();
        let driven = inputs.values.iter().zip(&inputs.rates).enumerate().take(layout.inputs);
        Self {
            clock,
            samples: path.len(),
            time: Program::address(layout, Symbol::Time),
            states: states.map(|(i, (x, v))| (slots(Symbol::State(i), Symbol::Rate(i)), [&x[..], &v[..]])).collect(),
            inputs: driven.map(|(j, (u, du))| (slots(Symbol::Input(j), Symbol::InputRate(j)), [*u, *du])).collect(),
        }
    }

    /// Writes what holds a share of an interval after a sample: of the displacement the cubic that the velocities give, of all else a
    /// straight line.
    #[inline(always)] // into each width of registers
    fn load<const W: usize>(&self, slots: &mut [[f64; W]], k: usize, s: f64) {
        let h = self.clock.interval;
        let next = (k + 1).min(self.samples - 1);
        let r = 1.0 - s;
        slots[self.time] = [self.clock.start + h * (k as f64 + s); W];
        for ([x, v], [displacement, velocity]) in &self.states {
            let between = r * r * ((1.0 + 2.0 * s) * displacement[k] + s * h * velocity[k])
                + s * s * ((1.0 + 2.0 * r) * displacement[next] - r * h * velocity[next]);
            slots[*x] = [between; W];
            slots[*v] = [velocity[k] + s * (velocity[next] - velocity[k]); W];
        }
        for ([u, du], [values, rates]) in &self.inputs {
            slots[*u] = [values[k] + s * (values[next] - values[k]); W];
            slots[*du] = [rates[k] + s * (rates[next] - rates[k]); W];
        }
    }
}

/// Internal states of equations that are alike, by the classical Runge–Kutta method, one step a sample.
#[inline(always)] // into each width of registers
fn integrated<const W: usize>(
    rates: &[&CompiledRates],
    clock: Clock,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Vec<Vec<Vec<f64>>> {
    let CompiledRates { layout, count, program } = rates[0];
    let (n, count) = (path.len(), *count);
    let mut slots: Vec<[f64; W]> = Vec::new();
    for place in 0..W {
        // A place that nobody has goes with the first.
        rates.get(place).unwrap_or(&rates[0]).program.prepare_beside(&mut slots, place);
    }
    let motion = MotionSlots::new(layout, clock, inputs, path);
    let z = Program::address(layout, Symbol::Internal(0));
    let h = clock.interval;
    let mut out = vec![vec![Vec::with_capacity(n); count]; rates.len()];
    let mut state = vec![[0.0; W]; count];
    let mut stages = vec![[[0.0; W]; 4]; count];
    for k in 0..n {
        for (j, s) in state.iter().enumerate() {
            out.iter_mut().zip(s).for_each(|(out, s)| out[j].push(*s));
        }
        for (i, (place, weight)) in [(0.0, 0.0), (0.5, 0.5), (0.5, 0.5), (1.0, 1.0)].into_iter().enumerate() {
            // The two middle stages are at one instant.
            if i != 2 {
                motion.load(&mut slots, k, place);
            }
            for ((slot, state), stages) in slots[z..].iter_mut().zip(&state).zip(&stages) {
                let before = if i == 0 { [0.0; W] } else { stages[i - 1] };
                slot.iter_mut().zip(state).zip(before).for_each(|((slot, s), k)| *slot = s + weight * h * k);
            }
            program.run_beside(&mut slots);
            for (j, stages) in stages.iter_mut().enumerate() {
                stages[i] = slots[program.output(j)];
            }
        }
        for (state, [k1, k2, k3, k4]) in state.iter_mut().zip(&stages) {
            for (p, s) in state.iter_mut().enumerate() {
                *s += h / 6.0 * (k1[p] + 2.0 * (k2[p] + k3[p]) + k4[p]);
                // A trial value of an inner quantity may be stiffer than the steps are short.
                if !s.is_finite() || s.abs() > 1e100 {
                    *s = 0.0;
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_values::term::Term;

    /// z′ = v − β |v| z − γ v |z|, or one that relaxes.
    fn equation(terms: &[(&str, f64)]) -> Equation {
        Equation::known(terms.iter().map(|(term, value)| (Term::parse(term).unwrap(), *value)))
    }

    #[test]
    fn states_of_equations_integrated_at_once_are_those_of_each_alone() {
        let n = 500;
        let series = |rate: f64| -> Vec<f64> { (0..n).map(|k| (rate * 0.01 * k as f64).sin()).collect() };
        let path = MotionPath { x: vec![series(3.0)], v: vec![series(4.0)] };
        let inputs = Inputs { values: Vec::new(), rates: Vec::new() };
        let layout = Layout { freedoms: 1, ..Layout::default() };
        let hysteresis = |i: u32| {
            let (beta, gamma) = (0.5 + 0.1 * f64::from(i), 0.3);
            vec![equation(&[("v", 1.0), ("abs(v)*z", -beta), ("v*abs(z)", -gamma)])]
        };
        let mut sets: Vec<Vec<Equation>> = (0..11).map(hysteresis).collect();
        // Others among them: none, one that is linear, and one of another form.
        sets.insert(2, Vec::new());
        sets.insert(4, vec![equation(&[("v", 1.0), ("z", -2.0)])]);
        sets.push(vec![equation(&[("v", 1.0), ("z^3", -2.0)])]);
        let each: Vec<&[Equation]> = sets.iter().map(Vec::as_slice).collect();
        let clock = Clock { start: 0.0, interval: 0.01 };
        let together = internal_states(&each, &layout, clock, &inputs, &path);
        assert_eq!(together.len(), sets.len());
        for (set, together) in each.iter().zip(&together) {
            assert_eq!(*together, integrate(set, &layout, clock, &inputs, &path));
            assert_eq!(together.len(), set.len());
            assert!(together.iter().all(|z| z.len() == n && z[0] == 0.0 && z[n - 1] != 0.0));
        }
    }
}
