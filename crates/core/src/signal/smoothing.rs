//! How records are smoothed and differentiated, as a person sets it.

use serde::{Deserialize, Serialize};

use super::SavitzkyGolay;

/// How velocities and accelerations are made from displacements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Differentiation {
    /// The derivative of the Savitzky–Golay filter's own polynomial.
    #[default]
    Filter,
    /// Savitzky–Golay smoothing, then central differences: the report's way.
    SmoothThenDifference,
    /// Natural cubic smoothing spline (Reinsch 1967).
    Spline,
    /// The whole record's Fourier transform behind a soft low-pass.
    Spectral,
    /// Kalman smoother of a motion whose jerk is white noise (Rauch, Tung & Striebel 1965).
    Kalman,
    /// Total variation: the least sum of changes of the acceleration (after Chartrand 2011); not linear.
    TotalVariation,
    /// Central differences of the measured samples, no smoothing.
    Difference,
}

impl Differentiation {
    /// Every way.
    pub const ALL: [Self; 7] = [
        Self::Filter,
        Self::SmoothThenDifference,
        Self::Spline,
        Self::Spectral,
        Self::Kalman,
        Self::TotalVariation,
        Self::Difference,
    ];

    /// The name in commands and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Filter => "filter",
            Self::SmoothThenDifference => "smooth-then-difference",
            Self::Spline => "spline",
            Self::Spectral => "spectral",
            Self::Kalman => "kalman",
            Self::TotalVariation => "total-variation",
            Self::Difference => "difference",
        }
    }

    /// The name in a sentence.
    pub fn title(self) -> &'static str {
        match self {
            Self::Filter | Self::SmoothThenDifference => "Savitzky–Golay",
            Self::Spline => "smoothing spline",
            Self::Spectral => "spectral low-pass",
            Self::Kalman => "Kalman smoother",
            Self::TotalVariation => "total variation",
            Self::Difference => "central differences",
        }
    }

    /// Whether polynomials are laid through segments, which have a length and an order.
    pub fn is_local(self) -> bool {
        matches!(self, Self::Filter | Self::SmoothThenDifference)
    }

    /// Whether the record is smoothed as a whole, with one parameter: the period of which half the amplitude passes.
    pub fn is_global(self) -> bool {
        !self.is_local() && self != Self::Difference
    }
}

/// Smoothing and differentiation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(default)]
pub struct Smoothing {
    /// The way of differentiating.
    pub method: Differentiation,
    /// Segment length, samples; odd and larger than `order`. For ways that smooth the record as a whole the period, in
    /// samples, of which half the amplitude passes: about what a segment of that length and order five lets through.
    pub window: usize,
    /// Order of the segment's polynomial.
    pub order: usize,
    /// Whether every library column is passed through the filter that the displacement went through; without it the
    /// smoothing biases the coefficients.
    pub filter_library: bool,
    /// Whether ways that smooth the record as a whole take that period from each record itself instead of `window`: a
    /// spline by generalised cross-validation, a Kalman smoother (and total variation with it) by its likelihood, a
    /// spectral low-pass by the noise's edge in the spectrum.
    pub from_data: bool,
}

impl Default for Smoothing {
    fn default() -> Self {
        Self { method: Differentiation::Filter, window: 31, order: 5, filter_library: true, from_data: true }
    }
}

/// A segment length from a number of samples: the number itself, or the next one, for segments have a middle.
pub(crate) fn odd(samples: usize) -> usize {
    samples | 1
}

impl Smoothing {
    /// Longest record that total variation is for: its time per sample is a hundred times the others'.
    pub const MOST_VARIATION: usize = 100_000;

    /// This smoothing with a length of `window` samples; a local method's stays given, a global one's is no longer sought in
    /// the data.
    pub fn with_window(self, window: usize) -> Self {
        Self { window, from_data: self.from_data && !self.method.is_global(), ..self }
    }

    /// The length that is given, if one is.
    pub fn given(&self) -> Option<usize> {
        (self.method.is_local() || self.method.is_global() && !self.from_data).then_some(self.window)
    }

    /// The Savitzky–Golay filter, where the method has one.
    pub(crate) fn filter(&self) -> Option<SavitzkyGolay> {
        self.method.is_local().then(|| SavitzkyGolay::new(self.window, self.order))
    }

    /// Samples at each end of a record in which a smoothing of this length is one-sided and much noisier; a regression
    /// leaves them out.
    pub fn margin(&self, length: f64) -> usize {
        match self.method {
            Differentiation::Difference => 1,
            _ => length.ceil() as usize + 3,
        }
    }

    /// Samples between rows that a regression on filtered columns needs: closer ones repeat each other.
    ///
    /// The filter passes frequencies up to about (order + 1) / (3.2 length) of the Nyquist frequency (Schafer 2011);
    /// two rows for each order still sample that six times over. The other ways pass what one of order five does.
    pub fn stride(&self, length: f64) -> usize {
        let order = if self.method.is_local() { self.order } else { 5 };
        match self.method {
            Differentiation::Difference | Differentiation::TotalVariation => 1,
            _ if !self.filter_library => 1,
            _ => (length as usize / (2 * (order + 1))).max(1),
        }
    }
}
