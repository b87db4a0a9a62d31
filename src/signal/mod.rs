//! Smoothing, differentiation, spectra and noise of sampled signals.

pub mod spectrum;

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
}
