//! How long things took, where there is a clock.

/// Time since it was started.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    #[cfg(feature = "runtime")]
    started: sindyscope_system::time::Instant,
}

impl Stopwatch {
    /// Starts to count.
    pub fn start() -> Self {
        Self {
            #[cfg(feature = "runtime")]
            started: sindyscope_system::time::Instant::now(),
        }
    }

    /// Milliseconds since the start; zero without the feature `runtime`.
    pub fn milliseconds(self) -> f64 {
        #[cfg(feature = "runtime")]
        return 1e3 * self.started.elapsed().as_secs_f64();
        #[cfg(not(feature = "runtime"))]
        0.0
    }
}
