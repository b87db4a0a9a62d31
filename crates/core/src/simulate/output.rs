//! What sensors measure of a simulated motion.

use super::Response;

/// What a sensor shows of a motion; degrees of freedom count from zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Output {
    /// A displacement.
    Displacement(usize),
    /// A velocity.
    Velocity(usize),
    /// An acceleration.
    Acceleration(usize),
}

impl Output {
    /// The series that it shows of a response with this number of degrees of freedom; for an acceleration the response must
    /// have its rates.
    pub fn series(self, response: &Response, freedoms: usize) -> &[f64] {
        match self {
            Self::Displacement(k) => &response.states[k],
            Self::Velocity(k) => &response.states[freedoms + k],
            Self::Acceleration(k) => &response.rates[freedoms + k],
        }
    }

    /// The mass whose motion it shows.
    pub fn mass(self) -> usize {
        match self {
            Self::Displacement(k) | Self::Velocity(k) | Self::Acceleration(k) => k,
        }
    }

    /// How often it is the displacement's derivative.
    pub fn derivatives(self) -> usize {
        match self {
            Self::Displacement(_) => 0,
            Self::Velocity(_) => 1,
            Self::Acceleration(_) => 2,
        }
    }

    /// True for an acceleration, which jumps where friction changes its side.
    pub fn is_rate(self) -> bool {
        matches!(self, Self::Acceleration(_))
    }
}
