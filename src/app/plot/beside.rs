//! Figures that are kept until they would be others, and may be made beside the window: the last one is shown meanwhile.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, OnceLock};

use sindyscope_report::view::FigureResult;

/// A figure for each view `V`, each made of an `M`.
#[derive(Clone, Debug)]
pub(crate) struct FiguresBeside<V, M>(HashMap<V, One<M>>);

#[derive(Clone, Debug)]
struct One<M> {
    made_of: M,
    cell: Arc<OnceLock<FigureResult>>,
    /// The last one that was finished.
    shown: Option<Arc<OnceLock<FigureResult>>>,
}

impl<V, M> Default for FiguresBeside<V, M> {
    fn default() -> Self {
        Self(HashMap::new())
    }
}

/// A figure as the kept cell holds it.
pub(crate) struct Ready(Arc<OnceLock<FigureResult>>);

impl std::ops::Deref for Ready {
    type Target = FigureResult;

    fn deref(&self) -> &FigureResult {
        static NOTHING: FigureResult = Err(String::new());
        self.0.get().unwrap_or(&NOTHING)
    }
}

impl<V: Copy + Eq + Hash, M: PartialEq> FiguresBeside<V, M> {
    /// True while a figure is being computed.
    pub(crate) fn busy(&self) -> bool {
        self.0.values().any(|one| one.cell.get().is_none())
    }

    /// The figure of a view could not be made, for this reason.
    pub(crate) fn fail(&mut self, view: V, reason: String) {
        if let Some(one) = self.0.get(&view) {
            // One that was made meanwhile stays.
            let _ = one.cell.set(Err(reason));
        }
    }

    /// The figure of a view, or the last one while it is being made; none if there is no last one.
    pub(crate) fn shown(&self, view: V) -> Option<Ready> {
        let one = self.0.get(&view)?;
        let made = |cell: &&Arc<OnceLock<FigureResult>>| cell.get().is_some();
        Some(&one.cell).filter(made).or(one.shown.as_ref().filter(made)).map(|cell| Ready(Arc::clone(cell)))
    }

    /// The empty cell of a figure that is to be made; none if it would be the same, or one is under way.
    pub(crate) fn renew(&mut self, view: V, made_of: M) -> Option<Arc<OnceLock<FigureResult>>> {
        let known = self.0.get(&view);
        // One at a time: while a slider is dragged, what is under way is let end and shown.
        let under_way = known.is_some_and(|one| one.cell.get().is_none());
        if under_way || known.is_some_and(|one| one.made_of == made_of) {
            return None;
        }
        let shown = known.map(|one| Arc::clone(&one.cell));
        let cell = Arc::new(OnceLock::new());
        self.0.insert(view, One { made_of, cell: Arc::clone(&cell), shown });
        Some(cell)
    }
}
