//! Discrete Fourier transforms of real series of any length.
//!
//! The transforms of the library below are generic over the number, so each crate that plans one compiles them all: half of what the
//! compiler made of `values`. Planned here, they are compiled once.
//!
//! ```
//! let forward = sindyscope_fourier::forward(4);
//! let (mut series, mut lines) = (vec![1.0, 0.0, -1.0, 0.0], forward.make_output_vec());
//! forward.process(&mut series, &mut lines).expect("buffers of the lengths that the transform made");
//! assert_eq!(lines.iter().map(|line| line.re).collect::<Vec<_>>(), [0.0, 2.0, 0.0]);
//!
//! // There and back, a series is multiplied by its length.
//! sindyscope_fourier::inverse(4).process(&mut lines, &mut series).expect("the same");
//! assert_eq!(series, [4.0, 0.0, -4.0, 0.0]);
//! ```

use std::sync::Arc;

pub use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// The transform of a real series: ⌊n/2⌋ + 1 lines Σ xₖ e^(−2πi jk/n).
pub type Forward = Arc<dyn RealToComplex<f64>>;

/// The way back from the lines, without the division by the length.
pub type Inverse = Arc<dyn ComplexToReal<f64>>;

/// Plans the transform of series of `length` samples.
#[must_use]
pub fn forward(length: usize) -> Forward {
    RealFftPlanner::new().plan_fft_forward(length)
}

/// Plans the transform back to series of `length` samples.
#[must_use]
pub fn inverse(length: usize) -> Inverse {
    RealFftPlanner::new().plan_fft_inverse(length)
}
