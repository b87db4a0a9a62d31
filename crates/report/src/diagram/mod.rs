//! The diagrams of vibration work, as numbers: what views and reports draw of an outcome beside its response.
//!
//! Each is computed from an [`Outcome`](sindyscope_core::study::Outcome) and knows neither of a window nor of a page: forces across an
//! element of the structure ([`Element`], [`RestoringForce`], [`FrictionForce`]), the [`FrequencyResponse`], a free
//! decay's backbone and damping ([`Decay`]), and what the residual still tells ([`Residual`]).

mod bins;
mod decay;
mod element;
mod frequency_response;
mod friction;
mod residual;
mod restoring;
#[cfg(test)]
mod tests;

pub use bins::{BinnedMeans, CellMeans};
pub use decay::{Decay, NoDecay};
pub use element::{Element, ElementEnds, ElementSamples};
pub use frequency_response::{DrivenSeries, FrequencyResponse, NoResponse, ResponseEstimate, Tone};
pub use friction::FrictionForce;
pub use residual::{Correlation, Histogram, Partner, Residual, ResidualSource};
pub use restoring::{RestoringForce, Slice};

/// Points of a scatter that are drawn: more would only hide each other.
const MOST_POINTS: usize = 4000;

/// Points along a curve of an equation.
const CURVE: usize = 200;

/// Abscissae of a curve over ±`most`, with one close on either side of zero: friction jumps there.
fn abscissae(most: f64) -> impl Iterator<Item = f64> {
    let half = CURVE / 2;
    let side = move |sign: f64| {
        let at = move |k: usize| if k == 0 { 1e-9 } else { k as f64 / half as f64 };
        (0..=half).map(move |k| sign * most * at(k))
    };
    let negative: Vec<f64> = side(-1.0).collect();
    negative.into_iter().rev().chain(side(1.0))
}
