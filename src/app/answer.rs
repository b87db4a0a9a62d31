//! What a background job finds for what was asked, and whether that is still what is wanted.

use std::sync::Arc;

/// The answer `T` to what was asked by `K`.
#[derive(Debug)]
pub(crate) struct Answer<K, T> {
    /// What it belongs to.
    asked: Option<K>,
    found: Option<Arc<T>>,
    failure: Option<String>,
    running: bool,
}

impl<K, T> Default for Answer<K, T> {
    fn default() -> Self {
        Self { asked: None, found: None, failure: None, running: false }
    }
}

impl<K: PartialEq, T> Answer<K, T> {
    /// Notes that something else is asked.
    pub(crate) fn begin(&mut self, asked: K) {
        *self = Self { asked: Some(asked), running: true, ..Self::default() };
    }

    /// Forgets what was asked, and what was found.
    pub(crate) fn stop(&mut self) {
        *self = Self::default();
    }

    /// Takes in what was found.
    pub(crate) fn take(&mut self, found: Arc<T>) {
        (self.found, self.running, self.failure) = (Some(found), false, None);
    }

    /// Notes why nothing was found.
    pub(crate) fn fail(&mut self, reason: String) {
        (self.failure, self.running) = (Some(reason), false);
    }

    /// True if this was asked, whether or not it is answered.
    pub(crate) fn is_of(&self, wanted: &K) -> bool {
        self.asked.as_ref() == Some(wanted)
    }

    /// True if something else was asked: others are open, or set otherwise.
    pub(crate) fn is_of_others(&self, wanted: &K) -> bool {
        self.asked.as_ref().is_some_and(|asked| asked != wanted)
    }

    pub(crate) fn found(&self) -> Option<&Arc<T>> {
        self.found.as_ref()
    }

    pub(crate) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    pub(crate) fn is_running(&self) -> bool {
        self.running
    }
}
