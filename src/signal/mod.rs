//! Smoothing, differentiation, spectra and noise of sampled signals.

mod difference;
mod noise;
mod savgol;
mod smoothing;
pub mod spectrum;
mod sums;

pub use difference::central;
pub use noise::standard_deviation;
pub use savgol::SavitzkyGolay;
pub use smoothing::{Differentiation, Smoothing};
pub use spectrum::{Peak, Spectrum};
pub(crate) use sums::{dot, mean_and_variance, rms};

use std::sync::Arc;

use crate::record::{Record, Role};
use crate::term::{Kind, Layout};

/// A record smoothed and differentiated: what the library's columns are computed from.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s.
    pub interval: f64,
    /// State vector, one series a state: displacements, then velocities.
    pub states: Vec<Vec<f64>>,
    /// Time derivative of each state of `states`.
    pub rates: Vec<Vec<f64>>,
    /// Inputs.
    pub inputs: Vec<Vec<f64>>,
    /// First derivative of each input.
    pub input_rates: Vec<Vec<f64>>,
    /// Main period of the first displacement, s, if it oscillates.
    pub main_period: Option<f64>,
    /// Standard deviation of each displacement's measurement noise, estimated without a model.
    pub noise: Vec<f64>,
    /// The channels as measured.
    pub measured: Vec<Measured>,
}

/// A channel as measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// What it measures.
    pub role: Role,
    /// One value a sample.
    pub values: Arc<[f64]>,
    /// Standard deviation of its noise, estimated without a model.
    pub noise: f64,
}

/// What a record tells before any smoothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// Main period of the first displacement, s, if it oscillates.
    pub main_period: Option<f64>,
    /// Standard deviation of each displacement's noise.
    pub noise: Vec<f64>,
    /// Standard deviation of each input's noise.
    pub input_noise: Vec<f64>,
    /// Standard deviation of each channel's noise, in the record's order.
    pub channel_noise: Vec<f64>,
}

impl Facts {
    /// Measures a record.
    pub fn new(record: &Record, layout: &Layout) -> Self {
        let values = |role: Role| record.channel(role).map(|c| &*c.values);
        let channel_noise: Vec<f64> =
            record.channels.iter().map(|c| standard_deviation(&c.values).unwrap_or(0.0)).collect();
        let noise =
            |role: Role| record.channels.iter().position(|c| c.role == role).map_or(0.0, |index| channel_noise[index]);
        let main = values(Role::Displacement(0)).and_then(|x| Spectrum::new(x, record.interval)).and_then(|s| s.peak());
        Self {
            main_period: main.map(|peak| peak.frequency.recip()),
            noise: (0..layout.freedoms).map(|i| noise(Role::Displacement(i))).collect(),
            input_noise: (0..layout.inputs).map(|j| noise(Role::Input(j))).collect(),
            channel_noise,
        }
    }
}

impl Signals {
    /// Smooths and differentiates a record; channels that the layout expects and the record lacks are left empty.
    ///
    /// Velocities are derived from displacements unless measured. Each state's rate is the filter's derivative of the
    /// *smoothed* state, so an equation between states holds between rates and equally filtered columns.
    pub fn new(record: &Record, layout: &Layout, smoothing: &Smoothing, facts: &Facts) -> Self {
        let interval = record.interval;
        let values = |role: Role| record.channel(role).map(|c| &*c.values);
        let smoothed = |role: Role| values(role).map_or_else(Vec::new, |v| smoothing.smooth(v, interval));
        let mut states: Vec<Vec<f64>> = (0..layout.freedoms).map(|i| smoothed(Role::Displacement(i))).collect();
        if layout.kind == Kind::SecondOrder {
            for i in 0..layout.freedoms {
                states.push(match (values(Role::Velocity(i)), values(Role::Displacement(i))) {
                    (Some(velocity), _) => smoothing.smooth(velocity, interval),
                    (None, Some(x)) => smoothing.differentiate(x, interval),
                    (None, None) => Vec::new(),
                });
            }
        }
        let rates = states
            .iter()
            .enumerate()
            .map(|(k, state)| match k.checked_sub(layout.freedoms).and_then(|i| values(Role::Acceleration(i))) {
                Some(a) => smoothing.smooth(&smoothing.smooth(a, interval), interval),
                None => smoothing.differentiate(state, interval),
            })
            .collect();
        let inputs = (0..layout.inputs).map(|j| smoothed(Role::Input(j))).collect();
        let input_rates = (0..layout.inputs)
            .map(|j| values(Role::Input(j)).map_or_else(Vec::new, |u| smoothing.differentiate(u, interval)))
            .collect();
        Self {
            start: record.start,
            interval,
            states,
            rates,
            inputs,
            input_rates,
            main_period: facts.main_period,
            noise: facts.noise.clone(),
            measured: record
                .channels
                .iter()
                .zip(&facts.channel_noise)
                .map(|(c, noise)| Measured { role: c.role, values: Arc::clone(&c.values), noise: *noise })
                .collect(),
        }
    }
}
