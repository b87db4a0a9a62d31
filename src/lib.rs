//! Sindyscope finds the equation of motion of a vibrating thing from its measurements.
//!
//! The rooms, in the order in which a measurement passes through them:
//! [`record`] (measured samples) → [`signal`] (smoothed and differentiated) → [`term`] (candidate terms) →
//! [`sparse`] (sparse regression) → [`model`] (equations of motion) → [`simulate`] (the model's response) →
//! `dataset` (records made ready once: noise, smoothed motion, what drives a simulation) →
//! [`study`] (settings and records in, outcome out) →
//! [`diagram`] (the outcome's forces, frequency response, decay and residual, as numbers to draw). [`refine`] fits the simulated response itself, and [`gap`] finds what a
//! model lacks. [`export`] writes the model for other programs. [`rig`] is the virtual test rig that makes records with a known truth.

#[cfg(feature = "desktop")]
pub mod app;
pub mod command;
mod dataset;
pub mod diagram;
pub mod export;
pub mod format;
pub mod gap;
pub mod model;
pub mod record;
pub mod refine;
pub mod report;
pub mod rig;
pub mod signal;
pub mod simulate;
pub mod sparse;
pub mod study;
pub mod term;
