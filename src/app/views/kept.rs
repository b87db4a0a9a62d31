//! Figures of views that are kept until they would be others; those that take longer than a frame are made in the
//! background.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock, Weak};

use super::picture::Picture;
use sindyscope_core::study::{Outcome, SettingsGrid};
use sindyscope_report::view::{FigureResult, Subject, View, ViewOptions};

/// Figures of so many samples are made at once: that costs less than a frame.
const AT_ONCE: usize = 1 << 13;
/// The same of views that hardly compute anything.
const QUICK_AT_ONCE: usize = 1 << 18;

/// The figures of all views.
#[derive(Clone, Debug, Default)]
pub(crate) struct ViewFigures(HashMap<View, One>);

#[derive(Clone, Debug)]
struct One {
    made_of: MadeOf,
    cell: Arc<OnceLock<FigureResult>>,
    /// The last one that was finished.
    shown: Option<Arc<OnceLock<FigureResult>>>,
}

/// What a figure was made of. Weak references, so that the addresses compared are not given to newer outcomes meanwhile.
#[derive(Clone, Debug)]
struct MadeOf {
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

/// A figure as the kept cell holds it.
pub(super) struct Ready(Arc<OnceLock<FigureResult>>);

impl std::ops::Deref for Ready {
    type Target = FigureResult;

    fn deref(&self) -> &FigureResult {
        static NOTHING: FigureResult = Err(String::new());
        self.0.get().unwrap_or(&NOTHING)
    }
}

impl ViewFigures {
    /// True while a figure is being computed.
    pub(crate) fn busy(&self) -> bool {
        self.0.values().any(|one| one.cell.get().is_none())
    }

    /// The figure of a view could not be made, for this reason.
    pub(crate) fn fail(&mut self, view: View, reason: String) {
        if let Some(one) = self.0.get(&view) {
            // One that was made meanwhile stays.
            let _ = one.cell.set(Err(reason));
        }
    }

    /// The figure of a view, or the last one while it is being made; none if there is no last one.
    pub(super) fn shown(&self, view: View) -> Option<Ready> {
        let one = self.0.get(&view)?;
        let made = |cell: &&Arc<OnceLock<FigureResult>>| cell.get().is_some();
        Some(&one.cell).filter(made).or(one.shown.as_ref().filter(made)).map(|cell| Ready(Arc::clone(cell)))
    }

    /// Makes the figure of a view if it would be another now; one that takes longer than a frame is to be made in the
    /// background.
    pub(crate) fn attend(&mut self, view: View, picture: &Picture<'_>, options: &ViewOptions) -> Option<FigureRequest> {
        let made_of = MadeOf::new(picture, options);
        let known = self.0.get(&view);
        // One at a time: while a slider is dragged, what is under way is let end and shown.
        let under_way = known.is_some_and(|one| one.cell.get().is_none());
        if under_way || known.is_some_and(|one| one.made_of == made_of) {
            return None;
        }
        let shown = known.map(|one| Arc::clone(&one.cell));
        let request = FigureRequest::new(view, picture, options);
        self.0.insert(view, One { made_of, cell: Arc::clone(&request.cell), shown });
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
    fn new(view: View, picture: &Picture<'_>, options: &ViewOptions) -> Self {
        Self {
            view,
            outcome: Arc::clone(picture.outcome),
            previous: picture.previous.map(Arc::clone),
            landscape: picture.search.map.map(Arc::clone),
            pins: picture.pins.to_vec(),
            record: picture.record,
            options: options.clone(),
            cell: Arc::new(OnceLock::new()),
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
