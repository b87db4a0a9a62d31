//! Figures of views that are kept until they would be others; those that take longer than a frame are made beside the window.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock, Weak};

use super::{Picture, View};
use sindyscope_core::study::{Outcome, SettingsGrid};
use sindyscope_report::view::{Drawn, Subject, ViewOptions};

/// Figures of so many samples are made at once: that costs less than a frame.
const AT_ONCE: usize = 1 << 13;
/// The same of views that hardly compute anything.
const QUICK_AT_ONCE: usize = 1 << 20;

/// What is shown in place of a figure whose computation failed.
const CRASHED: &str = "This view failed by an error of the program itself; please report which data it was";

/// The figures of all views.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept(HashMap<View, One>);

#[derive(Clone, Debug)]
struct One {
    made_of: MadeOf,
    cell: Arc<OnceLock<Drawn>>,
    /// The last one that was finished.
    shown: Option<Arc<OnceLock<Drawn>>>,
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
pub(super) struct Ready(Arc<OnceLock<Drawn>>);

impl std::ops::Deref for Ready {
    type Target = Drawn;

    fn deref(&self) -> &Drawn {
        static NOTHING: Drawn = Err(String::new());
        self.0.get().unwrap_or(&NOTHING)
    }
}

impl Kept {
    /// True while a figure is being computed.
    pub(super) fn busy(&self) -> bool {
        self.0.values().any(|one| one.cell.get().is_none())
    }

    /// The figure of a view that was made last.
    pub(super) fn shown(&self, view: View) -> Option<Ready> {
        let one = self.0.get(&view)?;
        let cell = if one.cell.get().is_some() { Some(&one.cell) } else { one.shown.as_ref() };
        cell.map(|cell| Ready(Arc::clone(cell)))
    }

    /// The figure of a view, or the last one while it is being made; none if there is no last one.
    pub(super) fn get(
        &mut self,
        ctx: &egui::Context,
        view: View,
        picture: &Picture<'_>,
        options: &ViewOptions,
    ) -> Option<Ready> {
        let made_of = MadeOf::new(picture, options);
        let known = self.0.get(&view);
        // One at a time: while a slider is dragged, what is under way is let end and shown.
        let under_way = known.is_some_and(|one| one.cell.get().is_none());
        if !under_way && known.is_none_or(|one| one.made_of != made_of) {
            let shown = known.map(|one| Arc::clone(&one.cell));
            let cell = make(ctx, view, picture, options);
            self.0.insert(view, One { made_of, cell, shown });
        }
        self.shown(view).filter(|ready| ready.0.get().is_some())
    }
}

/// Makes a figure: at once, or beside the window if it takes longer than a frame.
fn make(ctx: &egui::Context, view: View, picture: &Picture<'_>, options: &ViewOptions) -> Arc<OnceLock<Drawn>> {
    let cell = Arc::new(OnceLock::new());
    let samples: usize = picture.outcome.records.iter().map(|r| r.record.len()).sum();
    let at_once = samples <= if view.entry().slow { AT_ONCE } else { QUICK_AT_ONCE };
    if at_once {
        let _ = cell.set(view.figure(&picture.subject(options)));
        return cell;
    }
    let (outcome, previous) = (Arc::clone(picture.outcome), picture.previous.map(Arc::clone));
    let (landscape, pins) = (picture.search.map.map(Arc::clone), picture.pins.to_vec());
    let (record, options, filled, ctx) = (picture.record, options.clone(), Arc::clone(&cell), ctx.clone());
    let work = move || {
        let subject = Subject {
            outcome: &outcome,
            previous: previous.as_deref(),
            record,
            landscape: landscape.as_deref(),
            pins: &pins,
            options: &options,
        };
        let drawn = catch_unwind(AssertUnwindSafe(|| view.figure(&subject)));
        let _ = filled.set(drawn.unwrap_or_else(|_| Err(CRASHED.into())));
        ctx.request_repaint();
    };
    if std::thread::Builder::new().name("figure".into()).spawn(work).is_err() {
        let _ = cell.set(Err("The system gives no thread for this view; try again".into()));
    }
    cell
}
