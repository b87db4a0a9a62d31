//! Figures that are kept as long as what they are made of, and how they are zoomed.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

use egui::{Id, Sense, Ui};

use super::painter::{self, Look, PaintedFigure, Plots};
use sindyscope_report::figure::Figure;

/// Frames after which a figure that is not drawn is forgotten.
const FORGOTTEN: u64 = 64;

/// Figures of a room.
#[derive(Default)]
pub(crate) struct Figures {
    kept: HashMap<u64, Kept>,
    plots: Plots,
    now: u64,
}

struct Kept {
    made_of: u64,
    /// As long as it is held, so are its series: their addresses, by which `made_of` knows them, are not given to others.
    figure: Option<Arc<Figure>>,
    used: u64,
}

/// How a figure is shown in a room.
pub(crate) struct FigurePlace<'a> {
    /// A name that is unique among rooms.
    pub(crate) place: &'static str,
    /// What tells it from others of this name that stand beside it.
    pub(crate) number: u64,
    /// What it is to those who hear the window.
    pub(crate) name: &'a str,
    /// What tells its data from others: those are shown whole.
    pub(crate) data: u64,
    /// Small letters, as on a card.
    pub(crate) compact: bool,
    /// What it reacts to if it is not zoomed.
    pub(crate) sense: Sense,
    /// Strength, 0 to 1.
    pub(crate) strength: f32,
}

impl<'a> FigurePlace<'a> {
    pub(crate) fn new(place: &'static str, name: &'a str, data: impl Hash) -> Self {
        let data = painter::stamp(data);
        Self { place, number: 0, name, data, compact: false, sense: Sense::click(), strength: 1.0 }
    }
}

/// The name of a panel in egui's memory.
pub(crate) fn plot_id(place: &'static str, number: u64, panel: &'static str) -> Id {
    Id::unique(("room", place, number, panel))
}

impl Figures {
    /// Forgets what was not drawn lately.
    pub(crate) fn tidy(&mut self) {
        self.now += 1;
        if self.now.is_multiple_of(FORGOTTEN) {
            let now = self.now;
            self.kept.retain(|_, kept| now - kept.used < FORGOTTEN);
        }
    }

    /// A figure, made anew if it would be another.
    pub(crate) fn get(
        &mut self,
        name: impl Hash,
        made_of: impl Hash,
        make: impl FnOnce() -> Option<Figure>,
    ) -> Option<Arc<Figure>> {
        let (key, made_of, used) = (painter::stamp(name), painter::stamp(made_of), self.now);
        let kept = self.kept.get(&key).filter(|kept| kept.made_of == made_of);
        let figure = match kept {
            Some(kept) => kept.figure.clone(),
            None => make().map(Arc::new),
        };
        self.kept.insert(key, Kept { made_of, figure: figure.clone(), used });
        figure
    }

    /// Draws a figure into all the room there is.
    pub(crate) fn draw<'f>(&mut self, ui: &mut Ui, figure: &'f Figure, shown: &FigurePlace<'_>) -> PaintedFigure<'f> {
        let place = |panel: &'static str| plot_id(shown.place, shown.number, panel);
        let mut look = Look::new(&place, shown.data, shown.name);
        (look.compact, look.sense, look.strength) = (shown.compact, shown.sense, shown.strength);
        painter::show(ui, &mut self.plots, figure, &mut look)
    }
}
