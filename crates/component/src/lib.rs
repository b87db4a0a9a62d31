//! The force of a component along a given motion: dampers, mounts and joints that are tested without a mass.
//!
//! What is measured is the force along a motion that a machine prescribes, so nothing is integrated but the states that the
//! component remembers by. [`identify`] regresses the force on candidate terms of displacement, velocity and further inputs;
//! [`diagnose`] looks for the effect that a spring and a damper lack, named by the comparison of the search for missing
//! effects.
//!
//! ```
//! use sindyscope_component::{Specimen, diagnose};
//! use sindyscope_core::study::Cancel;
//! use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
//!
//! // A slider of 3 N beside a damper of 2 N s/m, moved by 10 mm at 1 Hz and 4 mm at 2.3 Hz.
//! let motion = |t: f64| 0.01 * (6.28 * t).sin() + 0.004 * (14.5 * t).sin();
//! let speed = |t: f64| 0.0628 * (6.28 * t).cos() + 0.058 * (14.5 * t).cos();
//! let noise = |k: usize| 0.05 * ((k * 7919 % 1009) as f64 / 1009.0 - 0.5);
//! let series = |of: &dyn Fn(usize) -> f64| (0..4000).map(of).collect();
//! let time = |k: usize| 0.005 * k as f64;
//! let channel = |name: &str, unit: &str, role, values| Channel { name: name.into(), unit: unit.into(), role, values, estimated: false };
//! let channels = vec![
//!     channel("x", "m", Role::Displacement(0), series(&|k| motion(time(k)))),
//!     channel("v", "m/s", Role::Velocity(0), series(&|k| speed(time(k)))),
//!     channel("force", "N", Role::Input(0), series(&|k| 2.0 * speed(time(k)) + 3.0 * speed(time(k)).signum() + noise(k))),
//! ];
//! let record = Record { name: "test".into(), source: None, start: 0.0, interval: 0.005, channels, notices: Vec::new() };
//! let records = RecordSet::new([record], Usage::Fit);
//! let specimen = Specimen::new(&records, None, &Cancel::default())?;
//! let found = diagnose(&specimen, None, 1, &|_, _| {}, &Cancel::default())?;
//! assert_eq!(found.steps[0].effect, "coulomb_friction");
//! assert!((found.steps[0].parameters[0].value - 3.0).abs() < 0.05);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![deny(missing_docs)]

mod columns;
mod diagnose;
mod effect;
mod error;
mod fit;
mod identify;
mod outcome;
mod specimen;

pub use diagnose::{AddedEffect, ComponentDiagnosis, EffectParameter, TriedEffect, base_terms, diagnose};
pub use error::ComponentError;
pub use identify::{ForceSettings, IdentifiedForce, candidate_terms, identify};
pub use outcome::{ComponentModel, ForceFit};
pub use specimen::{GivenMotion, Specimen, force_candidates, force_channel};
