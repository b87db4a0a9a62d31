//! The virtual test rig: records whose equation of motion is known.
//!
//! A [`Setup`] is a test: a [`Plant`] (equations of motion, and contacts that stick and slip), what drives it
//! ([`Excitation`]), what is measured of it ([`Sensors`]) and when, and a seed. [`Setup::run`] integrates it and gives the
//! records and the [`Truth`]. The integrator is another one than that of the identified model, so no test marks its own
//! homework; the same setup makes the same records for ever. Three ways lead to a setup: the named scenarios
//! ([`generate`]), a rig whose every number can be moved ([`record_rig`]), and plants that hide an effect ([`hidden`]).
//!
//! ```
//! use sindyscope_rig::{Contact, RecordDrive, Excitation, MeasuredChannel, MeasuredQuantity, Plant, SampleTimes, Sensor, Sensors, Setup};
//! use sindyscope_values::model::{Equation, Model};
//! use sindyscope_values::record::Role;
//! use sindyscope_values::term::{Symbol, Term};
//!
//! // ẍ = −4 x + u − 0.3 sgn ẋ, the mass held still while the rest is weaker than the friction.
//! let smooth = Model::second_order(1, vec![Equation::known([(Term::parse("x")?, -4.0), (Term::parse("u")?, 1.0)])]);
//! let plant = Plant { smooth, contacts: vec![Contact::coulomb(Term::parse("v")?, 1, 0.3)] };
//! let sampling = SampleTimes { start: 0.0, interval: 0.01, count: 1000 };
//! let drive = RecordDrive::new("run", vec![Excitation::harmonic(1.0, 0.4)], vec![0.0, 0.0], sampling);
//! let x = MeasuredChannel::new("x", Role::Displacement(0), "m", MeasuredQuantity::State(0), Sensor::noisy(1e-4));
//! let setup = Setup { plant, drives: vec![drive], sensors: Sensors::new([x]), seed: 7 };
//! let run = setup.run()?;
//! assert_eq!(run.records[0].len(), 1000);
//! assert_eq!(run.truth.coefficient(Symbol::Rate(0), &Term::parse("sgn(v)")?), Some(-0.3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![deny(missing_docs)]

mod adjustable;
mod classics;
mod component;
mod error;
mod excitation;
pub mod hidden;
mod interpolant;
mod motion;
mod plant;
mod plants;
mod response;
mod scenario;
mod scenario_comments;
mod scenario_options;
mod scenario_setup;
mod scenarios;
mod sensor;
mod setup;
mod smooth_phase;
mod structures;
mod truth;
mod wave;
mod words;

pub use adjustable::{EffectValue, ExcitationChoice, PlantChoice, RigDrive, RigRun, RigSettings, record_rig};
pub use component::{COMPONENT_SCENARIO, ComponentOptions, component_effects, component_records};
pub use error::RigError;
pub use excitation::Excitation;
pub use motion::PlantMotion;
pub use plant::{Contact, Plant};
pub use plants::PlantParameter;
pub use response::{PlantResponse, SampleTimes, StickInterval, respond};
pub use scenario::{ScenarioRun, generate};
pub use scenario_options::ScenarioOptions;
pub use scenarios::{Scenario, ScenarioExcitation, scenarios};
pub use sensor::{Noise, NoiseKind, Sensor};
pub use setup::{MeasuredChannel, MeasuredQuantity, RecordDrive, Sensors, Setup, SetupRun};
pub use truth::{TrueParameter, TrueTerm, Truth};
pub use wave::{Burst, Derivatives, Harmonic, Multisine, Transition, Wave};
