//! Signals, sparse regression, simulation and refinement of equations of motion.

pub mod clock;
pub mod dataset;
pub mod parallel;
pub mod prepare;
pub mod refine;
pub mod sampling;
pub mod signal;
pub mod simulate;
pub mod sparse;
pub mod study;
