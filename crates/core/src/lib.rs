//! From measured samples to an equation of motion: values in, values out.
//!
//! - [`signal`] smooths and differentiates records, and measures their noise and periods.
//! - [`sparse`] regresses few of many columns; it knows numbers, not what a column means.
//! - [`simulate`] integrates a model along sampled inputs, through the jumps of dry friction.
//! - [`refine`] fits simulated responses to measured ones (output error, multiple shooting).
//! - [`study`] does all of it for one set of settings and records; [`prepare`] and [`sampling`] make raw records fit for it.
//!
//! Nothing here reads files. Threads and the clock come with the feature `runtime`, on by default; without it all runs on one
//! thread. An oscillator with a cubic spring, from its records alone:
//!
//! ```
//! use sindyscope_core::study::{Cancel, Study, suggest};
//! use sindyscope_rig::{ScenarioOptions, generate};
//! use sindyscope_values::record::{RecordSet, Usage};
//! use sindyscope_values::term::{Kind, Term};
//!
//! let measured = generate("duffing", &ScenarioOptions::default()).expect("a scenario of the rig");
//! let records = RecordSet::new(measured.records, Usage::Fit);
//! let settings = suggest(&records, Kind::SecondOrder)?;
//! let outcome = Study::default().run(&records, &settings, &Cancel::default())?;
//! let acceleration = outcome.model.leading().expect("one mass");
//! let spring = acceleration.coefficient(&Term::parse("x^3").expect("a term")).expect("the cubic spring is found");
//! assert!((spring + 0.6).abs() < 0.01, "the rig's spring is −0.6 x³: {spring}");
//! assert!(outcome.train.expect("simulated").nrmse < 0.01);
//! # Ok::<(), sindyscope_core::study::StudyError>(())
//! ```

#![deny(missing_docs)]

pub mod clock;
pub mod dataset;
pub mod parallel;
pub mod prepare;
pub mod refine;
pub mod remedy;
pub mod sampling;
pub mod setting;
pub mod signal;
pub mod simulate;
pub mod sparse;
pub mod study;

/// The book's page for whoever adds a setting, whose example runs with the tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/contributing/setting.md")]
struct ContributingSetting;
