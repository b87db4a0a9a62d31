//! What the figures of views are made of, and which of them take longer than a frame.

use std::sync::{Arc, OnceLock, Weak};

use super::picture::Picture;
use crate::app::plot::beside::FiguresBeside;
use sindyscope_core::study::{Outcome, SettingsGrid};
use sindyscope_report::view::{FigureResult, Subject, View, ViewOptions};

/// Figures of so many samples are made at once: that costs less than a frame.
const AT_ONCE: usize = 1 << 13;
/// The same of views that hardly compute anything.
const QUICK_AT_ONCE: usize = 1 << 18;

/// The figures of all views.
pub(crate) type ViewFigures = FiguresBeside<View, MadeOf>;

/// What a figure was made of. Weak references, so that the addresses compared are not given to newer outcomes meanwhile.
#[derive(Clone, Debug)]
pub(crate) struct MadeOf {
    outcome: Weak<Outcome>,
    previous: Weak<Outcome>,
    landscape: Weak<SettingsGrid>,
    pins: Vec<Weak<Outcome>>,
    record: usize,
    options: ViewOptions,
}

impl MadeOf {
    fn new(picture: &Picture<'_>, options: &ViewOptions) -> Self {
        Self {
            outcome: Arc::downgrade(picture.outcome),
            previous: picture.previous.map_or_else(Weak::new, Arc::downgrade),
            landscape: picture.search.map.map_or_else(Weak::new, Arc::downgrade),
            pins: picture.pins.iter().map(Arc::downgrade).collect(),
            record: picture.record,
            options: options.clone(),
        }
    }
}

impl PartialEq for MadeOf {
    fn eq(&self, other: &Self) -> bool {
        let Self { outcome, previous, landscape, pins, record, options } = self;
        outcome.ptr_eq(&other.outcome)
            && previous.ptr_eq(&other.previous)
            && landscape.ptr_eq(&other.landscape)
            && pins.len() == other.pins.len()
            && pins.iter().zip(&other.pins).all(|(a, b)| a.ptr_eq(b))
            && *record == other.record
            && *options == other.options
    }
}

impl ViewFigures {
    /// Makes the figure of a view if it would be another now; one that takes longer than a frame is to be made in the
    /// background.
    pub(crate) fn attend(&mut self, view: View, picture: &Picture<'_>, options: &ViewOptions) -> Option<FigureRequest> {
        let cell = self.renew(view, MadeOf::new(picture, options))?;
        let request = FigureRequest::new(view, picture, options, cell);
        if request.takes_longer_than_a_frame() {
            return Some(request);
        }
        request.make();
        None
    }
}

/// A figure that takes longer than a frame, to be made in the background.
#[derive(Clone, Debug)]
pub(crate) struct FigureRequest {
    pub(crate) view: View,
    outcome: Arc<Outcome>,
    previous: Option<Arc<Outcome>>,
    landscape: Option<Arc<SettingsGrid>>,
    pins: Vec<Arc<Outcome>>,
    record: usize,
    options: ViewOptions,
    cell: Arc<OnceLock<FigureResult>>,
}

impl FigureRequest {
    fn new(view: View, picture: &Picture<'_>, options: &ViewOptions, cell: Arc<OnceLock<FigureResult>>) -> Self {
        Self {
            view,
            outcome: Arc::clone(picture.outcome),
            previous: picture.previous.map(Arc::clone),
            landscape: picture.search.map.map(Arc::clone),
            pins: picture.pins.to_vec(),
            record: picture.record,
            options: options.clone(),
            cell,
        }
    }

    fn takes_longer_than_a_frame(&self) -> bool {
        let samples: usize = self.outcome.records.iter().map(|r| r.record.len()).sum();
        samples > if self.view.entry().slow { AT_ONCE } else { QUICK_AT_ONCE }
    }

    /// Makes the figure; the window shows it from the next frame on.
    pub(crate) fn make(self) {
        let subject = Subject {
            outcome: &self.outcome,
            previous: self.previous.as_deref(),
            record: self.record,
            landscape: self.landscape.as_deref(),
            pins: &self.pins,
            options: &self.options,
        };
        // It was empty when it was asked for.
        let _ = self.cell.set(self.view.figure(&subject));
    }
}
