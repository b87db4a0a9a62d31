//! The program: its commands and its window.
//!
//! What they show is computed in the crates below: `sindyscope-values` (terms, equations, records), `sindyscope-core` (the
//! numerics), `sindyscope-files` (readers and writers), `sindyscope-search` (what is missing), `sindyscope-rig` (virtual
//! test rig) and `sindyscope-report` (figures, documents, exported programs).

#[cfg(feature = "desktop")]
pub mod app;
pub mod command;
