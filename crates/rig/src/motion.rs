//! A plant driven once: its states, what drives them and where its contacts stick, at the instants of the samples.

use super::RigError;
use super::excitation::Excitation;
use super::interpolant::Accuracy;
use super::plant::Plant;
use super::response::{PlantResponse, StickInterval, respond_at};
use sindyscope_values::term::{Expression, Program};

/// The motion of a plant, without any sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantMotion {
    /// The instants of the samples, in the plant's unit of time.
    pub times: Vec<f64>,
    /// `states[state][sample]`.
    pub states: Vec<Vec<f64>>,
    /// `rates[state][sample]`: the states' time derivatives.
    pub rates: Vec<Vec<f64>>,
    /// `inputs[input][order][sample]`: each input and its first and second time derivatives.
    pub inputs: Vec<[Vec<f64>; 3]>,
    /// Each time in which a contact stuck, in the order in which they began.
    pub stops: Vec<StickInterval>,
}

impl PlantMotion {
    /// Moves a plant along its inputs from its state at t = 0, seen at instants in order and none before 0.
    pub(super) fn along(
        plant: &Plant,
        inputs: &[Excitation],
        initial: &[f64],
        times: Vec<f64>,
        accuracy: Accuracy,
    ) -> Result<Self, RigError> {
        let PlantResponse { states, rates, stops } = respond_at(accuracy, plant, inputs, initial, &times)?;
        let series = |input: &Excitation| {
            let mut values = Vec::with_capacity(times.len());
            input.append_at(&times, &mut values);
            let orders: [Vec<f64>; 3] = std::array::from_fn(|order| values.iter().map(|v| v.0[order]).collect());
            orders
        };
        let inputs = inputs.iter().map(series).collect();
        Ok(Self { times, states, rates, inputs, stops })
    }

    /// `values[expression][sample]`: what expressions in the plant's symbols are along the motion.
    pub(super) fn values(&self, plant: &Plant, expressions: &[Expression]) -> Vec<Vec<f64>> {
        let layout = plant.smooth.layout;
        let expressions: Vec<Expression> = expressions.iter().map(Expression::normal).collect();
        let program = Program::new(&expressions, &layout);
        let mut slots = program.slots();
        let mut values = vec![Vec::with_capacity(self.times.len()); expressions.len()];
        for (sample, t) in self.times.iter().enumerate() {
            slots[0] = *t;
            for (slot, series) in slots[1..].iter_mut().zip(&self.states) {
                *slot = series[sample];
            }
            let first = 1 + layout.states();
            for (input, orders) in self.inputs.iter().enumerate() {
                for (order, series) in orders.iter().enumerate() {
                    slots[first + order * layout.inputs + input] = series[sample];
                }
            }
            program.run(&mut slots);
            for (index, series) in values.iter_mut().enumerate() {
                series.push(slots[program.output(index)]);
            }
        }
        values
    }

    /// Share of the time between the first and the last sample in which a contact sticks.
    pub fn stuck_share(&self) -> f64 {
        let (whole, stuck) = self.stuck();
        if whole > 0.0 { stuck / whole } else { 0.0 }
    }

    /// The time between the first and the last sample, and how much of it a contact sticks.
    pub(super) fn stuck(&self) -> (f64, f64) {
        let (Some(from), Some(to)) = (self.times.first(), self.times.last()) else { return (0.0, 0.0) };
        let lengths = self.stops.iter().map(|s| (s.to.min(*to) - s.from.max(*from)).max(0.0));
        (to - from, lengths.sum())
    }
}

/// Root mean square; 0 of nothing.
pub(super) fn rms<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for value in values {
        sum += value * value;
        count += 1.0;
    }
    (sum / count.max(1.0)).sqrt()
}
