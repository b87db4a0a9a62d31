//! What was found, as the project and the session keep it, and how it comes back.
//!
//! A walk belongs to the records and the base model that it was found with. Where those change, it is put aside; where they
//! come back (a project is opened, the window starts again, a change is undone) the search makes it whole again.

use std::sync::Arc;

use sindyscope_search::Found;

/// Walks put aside that can come back.
const PAST: usize = 4;

/// What is told where a walk that came with a project or the session does not fit.
pub(crate) const DROPPED: &str = "What was found missing was left out: it was found of other data or another base model than are open now. Find what's missing looks again";

/// The walks that are kept.
#[derive(Debug, Default)]
pub(super) struct Shelf {
    /// That in view.
    pub(super) found: Option<Arc<Found>>,
    /// One that came with a project or the session and is not in view yet.
    pub(super) coming: Option<Arc<Found>>,
    /// Those of other records or another base model, the newest first.
    past: Vec<Arc<Found>>,
    pub(super) note: Option<&'static str>,
}

impl Shelf {
    /// Nothing but a walk that came with a project or the session, if one did.
    pub(super) fn awaiting(coming: Option<Arc<Found>>) -> Self {
        Self { coming, ..Self::default() }
    }

    /// What may come back, what is awaited first.
    pub(super) fn candidates(&self) -> Vec<Arc<Found>> {
        self.coming.iter().chain(&self.past).cloned().collect()
    }

    /// A walk is in view again.
    pub(super) fn restored(&mut self, found: Arc<Found>) {
        self.past.retain(|past| !past.is_of_the_same_as(&found));
        if self.coming.as_ref().is_some_and(|coming| coming.is_of_the_same_as(&found)) {
            self.coming = None;
        }
        self.found = Some(found);
    }

    /// What was awaited has not come although all else has: it is dropped, but for a change that is undone.
    pub(super) fn missed(&mut self) {
        if let Some(missed) = self.coming.take() {
            self.lay_down(missed);
            self.note = Some(DROPPED);
        }
    }

    /// The records or the base model are others now.
    pub(super) fn put_aside(&mut self) {
        if let Some(found) = self.found.take() {
            self.lay_down(found);
        }
    }

    fn lay_down(&mut self, found: Arc<Found>) {
        self.past.retain(|past| !past.is_of_the_same_as(&found));
        self.past.insert(0, found);
        self.past.truncate(PAST);
    }
}
