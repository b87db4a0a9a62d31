//! The virtual test rig: records whose equation of motion is known.
//!
//! A [`Plant`] is shaken by [`Excitation`]s and watched by [`Sensor`]s. [`respond`] integrates it, by another method than
//! the identified model is simulated with, so that no test marks its own homework. A [`Scenario`] is a plant, an
//! excitation and sensors with sensible values for everything; [`generate`] makes its records.

mod adjustable;
mod error;
mod excitation;
pub mod hidden;
mod interpolant;
mod motion;
mod plant;
mod plants;
mod response;
mod scenario;
mod sensor;
mod setup;
mod smooth_phase;
mod truth;
mod wave;
mod words;

pub use adjustable::{EffectValue, ExcitationChoice, PlantChoice, RigDrive, RigRun, RigSettings, record_rig};
pub use error::RigError;
pub use excitation::Excitation;
pub use motion::PlantMotion;
pub use plant::{Contact, Plant};
pub use plants::PlantParameter;
pub use response::{PlantResponse, SampleTimes, StickInterval, respond};
pub use scenario::{Scenario, ScenarioExcitation, ScenarioOptions, ScenarioRun, generate, scenarios};
pub use sensor::{Noise, NoiseKind, Sensor};
pub use setup::{Drive, MeasuredChannel, MeasuredQuantity, Sensors, Setup, SetupRun};
pub use truth::{TrueParameter, TrueTerm, Truth};
pub use wave::{Burst, Derivatives, Harmonic, Multisine, Transition, Wave};
