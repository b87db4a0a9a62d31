//! Forces of terms along a given motion.

use super::data::RecordSeries;
use super::internal::internal_states;
use sindyscope_core::simulate::Delays;
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Expression, Kind, Layout, Program, SampleBlock, Term};

/// Columns that are computed at once: each instruction serves all of them.
pub(crate) const COLUMNS_AT_ONCE: usize = 8;

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

    /// Of a mass, from its velocity at the samples on either side.
    pub(super) fn acceleration(&self, mass: usize, interval: f64) -> Vec<f64> {
        let v = &self.v[mass];
        let slope = |k: usize| {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(v.len() - 1));
            (v[after] - v[before]) / ((after - before) as f64 * interval)
        };
        (0..v.len()).map(slope).collect()
    }

    /// Displacements, then velocities.
    pub(super) fn states(&self) -> Vec<&[f64]> {
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
        Clock { start: self.clock, interval: self.interval }
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

/// Terms of accelerations and the equations of the internal states that they read.
pub(super) type Forcing<'a, T> = (&'a [T], &'a [Equation]);

/// The value of each term at every sample; internal states run along the motion from zero.
pub(super) fn forces(
    terms: &[impl AsRef<Term>],
    internals: &[Equation],
    layout: &Layout,
    series: &RecordSeries,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Vec<Vec<f64>> {
    forces_of_each(&[(terms, internals)], layout, series, inputs, path).pop().unwrap_or_default()
}

/// As [`forces`], of several effects that do not know of one another.
pub(super) fn forces_of_each<T: AsRef<Term>>(
    each: &[Forcing<'_, T>],
    layout: &Layout,
    series: &RecordSeries,
    inputs: &Inputs<'_>,
    path: &MotionPath,
) -> Vec<Vec<Vec<f64>>> {
    let internals: Vec<&[Equation]> = each.iter().map(|(_, internals)| *internals).collect();
    let along = internal_states(&internals, layout, series.clock(), inputs, path);
    let of_one = |((terms, internals), z): (&Forcing<'_, T>, &Vec<Vec<f64>>)| {
        let layout = Layout { internals: internals.len(), kind: Kind::SecondOrder, ..*layout };
        let mut states = path.states();
        states.extend(z.iter().map(Vec::as_slice));
        let block = SampleBlock {
            start: series.clock,
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
    };
    each.iter().zip(&along).map(of_one).collect()
}
