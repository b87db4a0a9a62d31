//! The program: its commands and its window.
//!
//! What they show is computed in the crates below: `sindyscope-values` (terms, equations, records), `sindyscope-core` (the
//! numerics), `sindyscope-files` (readers and writers), `sindyscope-search` (what is missing), `sindyscope-rig` (virtual
//! test rig), `sindyscope-report` (figures, documents, exported programs) and `sindyscope-analysis` (whole studies by the names of
//! their settings, batches, JSON).

#[cfg(feature = "desktop")]
pub mod app;
#[cfg(not(target_arch = "wasm32"))]
pub mod command;
mod shell;
