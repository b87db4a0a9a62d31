use serde::{Deserialize, Serialize};

use super::{SavitzkyGolay, central};

/// How velocities and accelerations are made from displacements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Differentiation {
    /// The derivative of the Savitzky–Golay filter's own polynomial.
    #[default]
    Filter,
    /// Savitzky–Golay smoothing, then central differences: the report's way.
    SmoothThenDifference,
    /// Central differences of the measured samples, no smoothing.
    Difference,
}

/// Smoothing and differentiation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Smoothing {
    /// The way of differentiating.
    pub method: Differentiation,
    /// Segment length, samples; odd and larger than `order`.
    pub window: usize,
    /// Order of the segment's polynomial.
    pub order: usize,
    /// Whether every library column is passed through the filter that the displacement went through; without it the
    /// smoothing biases the coefficients.
    pub filter_library: bool,
}

impl Default for Smoothing {
    fn default() -> Self {
        Self { method: Differentiation::Filter, window: 31, order: 5, filter_library: true }
    }
}

impl Smoothing {
    /// The filter, where the method has one.
    pub fn filter(&self) -> Option<SavitzkyGolay> {
        (self.method != Differentiation::Difference).then(|| SavitzkyGolay::new(self.window, self.order))
    }

    /// Smooths samples.
    pub fn smooth(&self, samples: &[f64], interval: f64) -> Vec<f64> {
        self.filter().map_or_else(|| samples.to_vec(), |f| f.apply(samples, interval, 0))
    }

    /// The first derivative of samples as measured.
    pub fn differentiate(&self, samples: &[f64], interval: f64) -> Vec<f64> {
        match (self.method, self.filter()) {
            (Differentiation::Filter, Some(filter)) => filter.apply(samples, interval, 1),
            (_, Some(filter)) => central(&filter.apply(samples, interval, 0), interval),
            (_, None) => central(samples, interval),
        }
    }

    /// Samples at each end of a record in which the filter is one-sided and much noisier; a regression leaves them out.
    pub fn margin(&self) -> usize {
        match self.method {
            Differentiation::Difference => 1,
            _ => self.window + 3,
        }
    }

    /// Samples between rows that a regression on filtered columns needs: closer ones repeat each other.
    ///
    /// The filter passes frequencies up to about (order + 1) / (3.2 window) of the Nyquist frequency (Schafer 2011);
    /// two rows for each order still sample that six times over.
    pub fn stride(&self) -> usize {
        match self.method {
            Differentiation::Difference => 1,
            _ if !self.filter_library => 1,
            _ => (self.window / (2 * (self.order + 1))).max(1),
        }
    }
}
