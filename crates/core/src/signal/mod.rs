//! Smoothing, differentiation, spectra and noise of sampled signals.

mod bins;
mod difference;
mod facts;
mod kalman;
mod noise;
mod savgol;
mod smoother;
mod smoothing;
mod spectral;
mod spectrum;
mod spline;
mod standing;
mod sums;
mod test_function;

pub use bins::{Bins, VisitMean};
pub(crate) use difference::central;
pub use facts::SignalFacts;
pub use noise::{quantisation_step, standard_deviation, standard_deviation_beside_jumps};
pub(crate) use savgol::SavitzkyGolay;
pub use smoother::{SmoothedSignal, Smoother};
pub(crate) use smoothing::odd;
pub use smoothing::{Differentiation, Smoothing};
pub use spectrum::{Peak, Spectrum, main_period, motion_period, turning_period};
pub use standing::rests;
pub(crate) use standing::{shortest_standstill, standstills, standstills_from};
pub(crate) use sums::LANES;
pub use sums::{dot, dots, mean_and_variance, median, ranked, rms};
pub use test_function::TestFunction;

use std::sync::{Arc, OnceLock};

use crate::parallel::prelude::*;

use sindyscope_values::record::{Record, Role};
use sindyscope_values::term::{Kind, Layout, Program, SampleStretch};

/// A record smoothed and differentiated: what the library's columns are computed from.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub interval: f64,
    /// Displacements, then velocities: `[state][sample]`.
    pub states: Vec<Vec<f64>>,
    /// Inputs: `[input][sample]`.
    pub inputs: Vec<Vec<f64>>,
    rates: Vec<LateSeries>,
    input_rates: Vec<LateSeries>,
    smoothing: Smoothing,
    /// Main period of the first displacement, s, if it oscillates.
    pub main_period: Option<f64>,
    /// Length of the smoothing, samples: of the segment, or the period of which half the amplitude passes; zero without.
    pub length: f64,
    /// Standard deviation of each displacement's measurement noise, estimated without a model.
    pub noise: Vec<f64>,
    /// The channels as measured.
    pub measured: Vec<MeasuredSeries>,
}

/// A series that is computed when it is first asked for.
#[derive(Clone, Debug, Default, PartialEq)]
struct LateSeries(OnceLock<Vec<f64>>);

impl From<Vec<f64>> for LateSeries {
    fn from(values: Vec<f64>) -> Self {
        Self(OnceLock::from(values))
    }
}

/// A channel as measured.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredSeries {
    /// What it measures.
    pub role: Role,
    /// One value a sample.
    pub values: Arc<[f64]>,
    /// Standard deviation of its noise, estimated without a model.
    pub noise: f64,
}

impl Signals {
    /// Series that are known with their derivatives, from the time `start` on, `interval` apart, s: those of `states` and of
    /// `inputs`, one row each. Nothing is smoothed.
    pub fn known(
        (start, interval): (f64, f64),
        [states, rates]: [Vec<Vec<f64>>; 2],
        [inputs, input_rates]: [Vec<Vec<f64>>; 2],
    ) -> Self {
        let late = |series: Vec<Vec<f64>>| series.into_iter().map(LateSeries::from).collect();
        Self {
            start,
            interval,
            states,
            inputs,
            rates: late(rates),
            input_rates: late(input_rates),
            smoothing: Smoothing::default(),
            main_period: None,
            length: 1.0,
            noise: Vec::new(),
            measured: Vec::new(),
        }
    }

    /// Time derivative of a state, one value a sample; none if there is no such state.
    pub fn rate(&self, state: usize) -> Option<&[f64]> {
        let differentiate = || self.differentiated(&self.states[state]);
        Some(self.rates.get(state)?.0.get_or_init(differentiate))
    }

    /// First derivative of an input, one value a sample; none if there is no such input.
    pub fn input_rate(&self, input: usize) -> Option<&[f64]> {
        let differentiate = || {
            let measured = self.measured.iter().find(|m| m.role == Role::Input(input));
            measured.map_or_else(Vec::new, |m| self.differentiated(&m.values))
        };
        Some(self.input_rates.get(input)?.0.get_or_init(differentiate))
    }

    /// First derivatives of the inputs: `[input][sample]`.
    pub fn input_rates(&self) -> impl Iterator<Item = &[f64]> + Clone {
        (0..self.input_rates.len()).filter_map(|j| self.input_rate(j))
    }

    fn differentiated(&self, samples: &[f64]) -> Vec<f64> {
        Smoother::new(&self.smoothing, self.length, samples.len()).differentiate(samples, self.interval)
    }

    /// Accelerations of a second-order system, the second half of the rates: `[freedom][sample]`. Without meaning for one of
    /// first order.
    pub fn accelerations(&self) -> impl Iterator<Item = &[f64]> {
        (self.rates.len() / 2..self.rates.len()).filter_map(|k| self.rate(k))
    }

    /// The series that a program reads, borrowed for evaluating it along them.
    pub fn slices(&self, program: &Program) -> SampleStretch<'_> {
        let states = self.states.iter().map(Vec::as_slice).collect();
        let inputs = self.inputs.iter().map(Vec::as_slice).collect();
        let input_rates = if program.reads_input_rates() { self.input_rates().collect() } else { Vec::new() };
        let series = [states, inputs, input_rates, self.accelerations().collect()];
        SampleStretch::of_slices((self.start, self.interval), series)
    }

    /// Smooths and differentiates a record; channels that the layout expects and the record lacks are left empty.
    ///
    /// Velocities are derived from displacements unless measured. Each state's rate is the filter's derivative of the
    /// *smoothed* state, so an equation between states holds between rates and equally filtered columns; only total
    /// variation, which is no filter, gives both from the samples at once.
    pub fn new(record: &Record, layout: &Layout, smoothing: &Smoothing, facts: &SignalFacts) -> Self {
        let interval = record.interval;
        let values = |role: Role| record.channel(role).map(|c| &*c.values);
        let leading = values(Role::Displacement(0)).unwrap_or(&[]);
        let length = Smoother::length(smoothing, leading);
        let smoother = Smoother::new(smoothing, length, record.len());
        let input = |j: usize| match values(Role::Input(j)) {
            None => (Vec::new(), LateSeries::from(Vec::new())),
            Some(u) if smoother.is_linear() => (smoother.smooth(u, interval), LateSeries::default()),
            Some(u) => {
                let SmoothedSignal { position, velocity, .. } = smoother.motion(u, interval);
                (position, velocity.into())
            }
        };
        let inputs = || (0..layout.inputs).map(input).unzip();
        let ((states, derived), (inputs, input_rates)) =
            crate::parallel::join(|| Self::motion(record, layout, &smoother), inputs);
        let rate = |(k, (state, derived)): (usize, (&Vec<f64>, Option<Vec<f64>>))| {
            let measured = k.checked_sub(layout.freedoms).and_then(|i| values(Role::Acceleration(i)));
            match (measured, derived) {
                (Some(a), _) => smoother.smooth(&smoother.smooth(a, interval), interval).into(),
                (None, Some(rate)) => rate.into(),
                // Only an equation between displacements and velocities needs it.
                (None, None) if layout.kind == Kind::SecondOrder && k < layout.freedoms => LateSeries::default(),
                (None, None) => smoother.differentiate(state, interval).into(),
            }
        };
        let rates = states.par_iter().zip(derived).enumerate().map(rate).collect();
        Self {
            start: record.start,
            interval,
            states,
            inputs,
            rates,
            input_rates,
            smoothing: *smoothing,
            main_period: facts.main_period,
            length,
            noise: facts.noise.clone(),
            measured: record
                .channels
                .iter()
                .zip(&facts.channel_noise)
                .map(|(c, noise)| MeasuredSeries { role: c.role, values: Arc::clone(&c.values), noise: *noise })
                .collect(),
        }
    }

    /// The smoothed states, and those rates that came with a state, because they are not what differentiating it again would
    /// give.
    fn motion(record: &Record, layout: &Layout, smoother: &Smoother) -> (Vec<Vec<f64>>, Vec<Option<Vec<f64>>>) {
        let interval = record.interval;
        let values = |role: Role| record.channel(role).map(|c| &*c.values);
        let second_order = layout.kind == Kind::SecondOrder;
        let mut states = Vec::with_capacity(layout.states());
        let mut velocities = Vec::with_capacity(layout.freedoms);
        let mut derived: Vec<Option<Vec<f64>>> = vec![None; layout.states()];
        for i in 0..layout.freedoms {
            let Some(x) = values(Role::Displacement(i)) else {
                states.push(Vec::new());
                velocities.push(Vec::new());
                continue;
            };
            let motion = smoother.motion(x, interval);
            if !smoother.is_linear() {
                derived[i] = Some(motion.velocity.clone());
                if second_order {
                    derived[layout.freedoms + i] = motion.acceleration;
                }
            }
            states.push(motion.position);
            velocities.push(motion.velocity);
        }
        if second_order {
            for (i, derived_velocity) in velocities.into_iter().enumerate() {
                states.push(match values(Role::Velocity(i)) {
                    None => derived_velocity,
                    Some(measured) => {
                        let motion = smoother.motion(measured, interval);
                        if !smoother.is_linear() {
                            derived[layout.freedoms + i] = Some(motion.velocity);
                        }
                        motion.position
                    }
                });
            }
        }
        (states, derived)
    }
}
