//! Figures that are computed beside the window and shown until newer ones are there.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, OnceLock, Weak};

use egui::Ui;

use super::figure::{Figure, Graph};
use super::scene::Scene;
use super::{View, legend};
use sindyscope_core::study::Outcome;

/// Figures of so many samples are computed at once: that costs less than a frame.
const AT_ONCE: usize = 1 << 13;

/// What is shown in place of a figure whose computation failed.
const CRASHED: &str = "This view failed by an error of the program itself; please report which data it was";

/// What decides a figure beside its outcome.
pub(super) type Choice = [usize; 6];

/// The figures of all views.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept(HashMap<View, One>);

#[derive(Clone, Debug)]
struct One {
    outcome: Weak<Outcome>,
    choice: Choice,
    cell: Arc<OnceLock<Figure>>,
    /// The last one that was finished.
    shown: Option<Arc<OnceLock<Figure>>>,
}

/// The graphs of a figure; none after saying in their place what is being computed or why there are none.
pub(super) fn graphs<'a>(ui: &mut Ui, figure: Option<&'a OnceLock<Figure>>, waiting: &str) -> Option<&'a Vec<Graph>> {
    match figure.and_then(OnceLock::get) {
        Some(Figure::Graphs(graphs)) => return Some(graphs),
        Some(Figure::Note(note)) => legend::note(ui, note),
        None => legend::note(ui, waiting),
    }
    None
}

impl Kept {
    /// True while a figure is being computed.
    pub(super) fn busy(&self) -> bool {
        self.0.values().any(|one| one.cell.get().is_none())
    }

    /// The figure of a view, or the last one while it is being computed; none if there is no last one.
    pub(super) fn get(
        &mut self,
        ui: &Ui,
        view: View,
        scene: &Scene<'_>,
        choice: Choice,
        printing: bool,
        compute: impl FnOnce(&Outcome) -> Figure + Send + 'static,
    ) -> Option<Arc<OnceLock<Figure>>> {
        let known = self.0.get(&view);
        let same = known.is_some_and(|o| o.choice == choice && o.outcome.as_ptr() == Arc::as_ptr(scene.outcome));
        // One at a time: while a slider is dragged, what is under way is let end and shown.
        let under_way = known.is_some_and(|o| o.cell.get().is_none());
        // A picture cannot wait.
        let wanted = if printing { !same || under_way } else { !same && !under_way };
        if wanted {
            let shown = known.filter(|o| o.cell.get().is_some()).map(|o| Arc::clone(&o.cell));
            let cell = Arc::new(OnceLock::new());
            let one = One { outcome: Arc::downgrade(scene.outcome), choice, cell: Arc::clone(&cell), shown };
            self.0.insert(view, one);
            let outcome = Arc::clone(scene.outcome);
            let samples: usize = outcome.records.iter().map(|r| r.record.len()).sum();
            if samples <= AT_ONCE || printing {
                let _ = cell.set(compute(&outcome));
            } else {
                let ctx = ui.ctx().clone();
                let work = move || {
                    let figure = catch_unwind(AssertUnwindSafe(|| compute(&outcome)));
                    let _ = cell.set(figure.unwrap_or_else(|_| Figure::Note(CRASHED.into())));
                    ctx.request_repaint();
                };
                if std::thread::Builder::new().name("figure".into()).spawn(work).is_err() {
                    self.0.remove(&view);
                }
            }
        }
        let one = self.0.get(&view)?;
        let finished = one.cell.get().is_some();
        if finished { Some(Arc::clone(&one.cell)) } else { one.shown.clone() }
    }
}
