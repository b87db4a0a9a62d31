//! Terms along the given motion, internal states included.

use std::ops::Range;

use super::effect::ForceAddition;
use super::specimen::{RecordPath, Specimen};
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Expression, Layout, Program, SampleStretch, Symbol, Term};

/// The rows of all records one after the other: which are fitted, and which are not.
#[derive(Clone, Debug)]
pub(crate) struct ComponentRows {
    /// One range a record; empty where nothing of it is fitted.
    pub(crate) seen: Vec<Range<usize>>,
    pub(crate) unseen: Vec<Range<usize>>,
    pub(crate) count: usize,
}

impl ComponentRows {
    /// The rows of a specimen as it says.
    pub(crate) fn new(specimen: &Specimen) -> Self {
        Self::split(specimen, |p| p.unseen_from)
    }

    /// The rows up to a sample of each record, and those from there on.
    pub(crate) fn split(specimen: &Specimen, from: impl Fn(&RecordPath) -> usize) -> Self {
        let (mut seen, mut unseen, mut next) = (Vec::new(), Vec::new(), 0);
        for path in &specimen.paths {
            let border = next + from(path);
            seen.push(next..border);
            next += path.len();
            unseen.push(border..next);
        }
        Self { seen, unseen, count: next }
    }

    pub(crate) fn fitted(&self) -> usize {
        self.seen.iter().map(Range::len).sum()
    }
}

/// The values of terms at every row: `[term][row]`; the first internal state begins each record as `starts` says, or at zero,
/// others at zero.
pub(crate) fn columns(specimen: &Specimen, addition: &ForceAddition, starts: &[f64]) -> Vec<Vec<f64>> {
    let layout = Layout { internals: addition.internals.len(), ..specimen.layout };
    let expressions: Vec<Expression> = addition.terms.iter().map(|t| t.expression().clone()).collect();
    let program = Program::new(&expressions, &layout);
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); expressions.len()];
    let rates = Rates::new(&addition.internals, &layout);
    for (k, path) in specimen.paths.iter().enumerate() {
        let mut states: Vec<Vec<f64>> = path.motion.to_vec();
        states.extend(rates.states(path, starts.get(k).copied().unwrap_or(0.0)));
        let series = [states.as_slice(), &path.inputs, &path.input_rates, &[]];
        let stretch = SampleStretch::new((path.start, path.interval), series);
        program.columns(&stretch.block(), &mut columns);
    }
    columns
}

/// Terms without internal states at every row.
pub(crate) fn plain_columns(specimen: &Specimen, terms: &[Term]) -> Vec<Vec<f64>> {
    columns(specimen, &ForceAddition::plain(terms.to_vec()), &[])
}

/// The rates of internal states, compiled.
struct Rates {
    program: Program,
    layout: Layout,
}

impl Rates {
    fn new(internals: &[Equation], layout: &Layout) -> Self {
        let sum = |e: &Equation| {
            let parts = e.terms.iter().map(|t| t.term.expression().clone() * t.coefficient);
            Expression::Sum(parts.collect())
        };
        Self { program: Program::new(&internals.iter().map(sum).collect::<Vec<_>>(), layout), layout: *layout }
    }

    /// The internal states along a record, by Runge and Kutta's method over each sampling interval, the motion between
    /// samples by the cubic through the four nearest.
    fn states(&self, path: &RecordPath, start: f64) -> Vec<Vec<f64>> {
        let count = self.layout.internals;
        let mut states = vec![Vec::with_capacity(path.len()); count];
        if count == 0 {
            return states;
        }
        let given: Vec<&[f64]> =
            path.motion.iter().chain(&path.inputs).chain(&path.input_rates).map(Vec::as_slice).collect();
        let inputs = self.layout.inputs;
        let address = |symbol| Program::address(&self.layout, symbol);
        let mut places: Vec<usize> = vec![address(Symbol::State(0)), address(Symbol::Rate(0))];
        places.extend((0..inputs).map(|j| address(Symbol::Input(j))));
        places.extend((0..inputs).map(|j| address(Symbol::InputRate(j))));
        let first = address(Symbol::Internal(0));
        let mut slots = self.program.slots();
        let h = path.interval;
        let mut z = vec![0.0; count];
        z[0] = start;
        let (mut sum, mut rate, mut trial) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        for k in 0..path.len() {
            for (series, value) in states.iter_mut().zip(&z) {
                series.push(*value);
            }
            if k + 1 == path.len() {
                break;
            }
            sum.fill(0.0);
            trial.copy_from_slice(&z);
            for (stage, weight, reach) in [(0, 1.0, 0.5), (1, 2.0, 0.5), (1, 2.0, 1.0), (2, 1.0, 0.0)] {
                for (place, series) in places.iter().zip(&given) {
                    slots[*place] = match stage {
                        0 => series[k],
                        1 => middle(series, k),
                        _ => series[k + 1],
                    };
                }
                slots[first..first + count].copy_from_slice(&trial);
                self.program.run(&mut slots);
                for (i, rate) in rate.iter_mut().enumerate() {
                    *rate = slots[self.program.output(i)];
                }
                for i in 0..count {
                    sum[i] += weight * rate[i];
                    trial[i] = z[i] + reach * h * rate[i];
                }
            }
            for i in 0..count {
                z[i] += h / 6.0 * sum[i];
            }
        }
        states
    }
}

/// A series halfway between sample `k` and the next.
fn middle(series: &[f64], k: usize) -> f64 {
    let (a, b) = (series[k], series[k + 1]);
    match (k.checked_sub(1).map(|i| series[i]), series.get(k + 2)) {
        (Some(before), Some(after)) => (9.0 * (a + b) - before - after) / 16.0,
        _ => 0.5 * (a + b),
    }
}
