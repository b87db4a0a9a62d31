//! What is missing: where a model's response and the measurement part, which physical effect that is, and how sure one can be.
//!
//! A [`Search`] holds the records. It fits the base model to them ([`Search::base`]); [`Search::look`] asks a fitted
//! [`Stage`] four things: is there a gap beyond noise, where is it, which effects of the catalogue would close it, and
//! does the gap shrink on data that were never fitted. Each candidate that was refitted carries the stage that comes of
//! adding it, so a walk is a chain of stages. [`Search::diagnose`] walks on its own until nothing more can be named.
//!
//! Nothing here reads files or knows of a window. What a linear model of a Duffing oscillator lacks:
//!
//! ```
//! use sindyscope_core::study::Cancel;
//! use sindyscope_rig::{ScenarioOptions, generate};
//! use sindyscope_search::{Ask, Search, Verdict};
//! use sindyscope_values::record::{RecordSet, Usage};
//!
//! let measured = generate("duffing", &ScenarioOptions::default()).expect("a scenario of the rig");
//! let records = RecordSet::new(measured.records, Usage::Fit);
//! let search = Search::new(&records, &Ask::default())?;
//! let diagnosis = search.diagnose(&|_| {}, &Cancel::default())?;
//! assert_eq!(diagnosis.verdict, Verdict::Named);
//! assert!(diagnosis.sentence.contains("Cubic stiffness") || diagnosis.sentence.contains("cubic stiffness"));
//! # Ok::<(), sindyscope_search::GapError>(())
//! ```

#![deny(missing_docs)]

mod audit;
mod between;
mod borne;
mod clocks;
mod colour;
mod columns;
mod constants;
mod data;
mod describe;
mod diagnose;
mod effects;
mod effort;
mod error;
mod estimated;
mod evidence;
mod experiment;
mod fit;
mod folds;
mod found;
mod guide;
mod internal;
mod judge;
mod landing;
mod motion;
mod outcome;
mod parameters;
mod pipeline;
mod place;
mod progress;
mod propose;
mod records;
mod reorder;
mod restore;
mod ruling;
mod screen;
mod search;
mod setting;
mod show;
mod site;
mod slips;
mod structure;
#[cfg(test)]
mod tests;
mod walk;
mod words;

pub use constants::{CONSTANTS, Constant, Constants};
pub use effects::{
    DESCRIPTION, ForceAxis, OwnEffect, OwnError, OwnPart, OwnQuantity, OwnSign, OwnState, OwnTerm, hysteresis_rate,
};
pub use effort::SearchEffort;
pub use error::GapError;
pub use experiment::{NextExperiment, ProposedDrive, ProposedTest};
pub use found::Found;
pub use guide::{Entry, EntryForm, EntryParameter, guide, guide_of_own};
pub use outcome::{
    Added, Beginnings, Blind, Candidate, Choice, Curve, Description, Diagnosis, Evidence, Finding, Gap, HeldFit, Lead,
    Map, MissingForce, Parameter, Place, Profile, ProposedSet, Remaining, Round, SensorTrace, Stage, Standing, Test,
    Trace, Verdict,
};
pub use progress::Progress;
pub use records::{FreeRun, RecordScore, StretchScore};
pub use restore::Restored;
pub use search::{Ask, Listener, Search};
pub use site::Site;
pub use walk::Step;
pub use words::within;
