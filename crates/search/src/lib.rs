//! What is missing: where a model's response and the measurement part, which physical effect that is, and how sure one can be.
//!
//! A [`Search`] holds the records. It fits the base model to them ([`Search::base`]); [`Search::look`] asks a fitted
//! [`Stage`] four things: is there a gap beyond noise, where is it, which effects of the catalogue would close it, and
//! does the gap shrink on data that were never fitted. Each candidate that was refitted carries the stage that comes of
//! adding it, so a walk is a chain of stages. [`Search::diagnose`] walks on its own until nothing more can be named.

mod audit;
mod between;
mod columns;
mod data;
mod decide;
mod diagnose;
mod effects;
mod error;
mod evidence;
mod experiment;
mod fit;
mod found;
mod guide;
mod judge;
mod motion;
mod outcome;
mod parameters;
mod pipeline;
mod place;
mod progress;
mod propose;
mod ranking;
mod records;
mod refit;
mod reorder;
mod restore;
mod rule;
mod ruling;
mod screen;
mod search;
mod sets;
mod show;
mod site;
mod structure;
#[cfg(test)]
mod tests;
mod walk;
mod weak;
mod words;

pub use effects::Axis;
pub use error::GapError;
pub use evidence::LEVEL;
pub use found::Found;
pub use guide::{Entry, EntryForm, EntryParameter, guide};
pub use outcome::{
    Added, Beginnings, Blind, Candidate, Choice, Curve, Diagnosis, Evidence, Finding, Gap, HeldFit, Lead, Map,
    MissingForce, Parameter, Place, Profile, Remaining, Round, SensorTrace, Stage, Standing, Test, Trace, Verdict,
};
pub use progress::Progress;
pub use records::{RecordScore, StretchScore};
pub use restore::Restored;
pub use search::{Ask, Listener, Search};
pub use site::Site;
pub use walk::Step;
pub use words::within;
