//! Modes of structures from few sensors, and the force that a linear structure lacks.
//!
//! [`identify`] takes records of any number of sensors (displacements, velocities, accelerations, mixed) with measured inputs
//! or free decays, and gives a [`Structure`]: natural frequencies, damping ratios and shapes with standard errors, and what
//! is left on each record.
#![deny(missing_docs)]

mod closed;
mod diagnose;
mod error;
mod force;
mod identify;
mod judge;
mod linear;
mod measurement;
mod motion;
mod outcome;
mod pole;
mod screen;
mod settings;
mod study;
mod subspace;

pub use diagnose::{ForceParameter, FoundForce, StructureDiagnosis, diagnose};
pub use error::ModesError;
pub use force::{Effect, Site};
pub use measurement::{Input, Quantity, Sensor};
pub use outcome::{RecordFit, Structure};
pub use pole::Pole;
pub use settings::{BASE, BASES, Base, BaseModel};
pub use study::identify;
