//! Modes of structures from few sensors, and the force that a linear structure lacks.
//!
//! [`identify`] takes records of any number of sensors (displacements, velocities, accelerations, mixed) with measured inputs
//! or free decays, and gives a [`Structure`]: natural frequencies, damping ratios and shapes with standard errors, and what
//! is left on each record. [`diagnose`] looks for a force that acts beside the linear structure: which, where and how large, named by
//! the comparison of the search for missing effects. [`analyse`] identifies, and keeps what figures show beside the modes: the
//! stabilization diagram and the model's response along each record.
//!
//! ```
//! use sindyscope_core::study::Cancel;
//! use sindyscope_modes::{Base, identify};
//! use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
//!
//! // A mast after a blow: two modes, at 1.5 and 4 Hz, seen by one accelerometer.
//! let at = |k: usize| {
//!     let t = 0.01 * k as f64;
//!     (-0.1 * t).exp() * (9.42 * t).cos() + 0.5 * (-0.3 * t).exp() * (25.13 * t).cos()
//! };
//! let values = (0..2000).map(at).collect();
//! let channel = Channel { name: "a".into(), unit: "m/s^2".into(), role: Role::Acceleration(0), values, estimated: false };
//! let mut records = RecordSet::default();
//! let (name, channels) = ("blow".into(), vec![channel]);
//! records.add([Record { name, source: None, start: 0.0, interval: 0.01, channels, notices: Vec::new() }], Usage::Fit);
//! let found = identify(&records, &Base::default(), &Cancel::default())?;
//! assert!((found.modes[0].frequency - 1.5).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![deny(missing_docs)]

mod analysis;
mod chosen;
mod closed;
mod cluster;
mod diagnose;
mod error;
mod force;
mod hysteresis;
mod identify;
mod judge;
mod limits;
mod linear;
mod measurement;
mod motion;
mod outcome;
mod pole;
mod position;
mod screen;
mod settings;
mod shape;
mod stabilization;
mod start;
mod study;
mod subspace;

pub use analysis::{ModalAnalysis, ModalRecord, analyse};
pub use cluster::PoleCluster;
pub use diagnose::{ForceParameter, FoundForce, StructureDiagnosis, UnseenRecord, diagnose};
pub use error::ModesError;
pub use force::{Effect, Site};
pub use measurement::{Input, Quantity, Sensor};
pub use outcome::{RecordFit, Structure};
pub use pole::Pole;
pub use position::{SensorPosition, position_text, positions};
pub use settings::{BASE, BASES, Base, BaseModel};
pub use shape::{assurance, phase_collinearity, phase_deviation};
pub use stabilization::{ModeQuality, ProposedPole, Stability, Stabilization, scaled_shape};
pub use start::RecordStart;
pub use study::identify;
