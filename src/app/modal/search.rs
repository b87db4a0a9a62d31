//! The search for the force that a structure lacks: what was asked, what was found.

use std::sync::Arc;

use super::room::Asked;
use sindyscope_modes::StructureDiagnosis;

/// The search, as far as it has come.
#[derive(Debug, Default)]
pub(crate) struct ModalSearch {
    /// What it belongs to.
    asked: Option<Asked>,
    found: Option<Arc<StructureDiagnosis>>,
    failure: Option<String>,
    running: bool,
}

impl ModalSearch {
    /// Notes that it begins.
    pub(crate) fn begin(&mut self, asked: Asked) {
        *self = Self { asked: Some(asked), running: true, ..Self::default() };
    }

    /// Notes that it was stopped.
    pub(crate) fn stop(&mut self) {
        *self = Self::default();
    }

    /// Takes in what was found.
    pub(crate) fn take(&mut self, found: Arc<StructureDiagnosis>) {
        (self.found, self.running, self.failure) = (Some(found), false, None);
    }

    /// Notes why nothing was found.
    pub(crate) fn fail(&mut self, reason: String) {
        (self.failure, self.running) = (Some(reason), false);
    }

    /// True if what it belongs to is no more: others are open, or set otherwise.
    pub(crate) fn is_of_others(&self, now: &Asked) -> bool {
        self.asked.as_ref().is_some_and(|asked| asked != now)
    }

    pub(crate) fn found(&self) -> Option<&Arc<StructureDiagnosis>> {
        self.found.as_ref()
    }

    pub(crate) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    pub(crate) fn is_running(&self) -> bool {
        self.running
    }
}
