//! An adjustable rig: a plant, an excitation and sensors whose every number can be moved, recorded at once.

mod run;
mod settings;
mod truth;

pub use run::{RigRun, record_rig};
pub use settings::{EffectValue, ExcitationChoice, PlantChoice, RigDrive, RigSettings};

#[cfg(test)]
mod tests;
