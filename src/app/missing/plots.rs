//! Figures that are kept as long as what they are made of, and how they are zoomed.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

use egui::{Id, Sense, Ui};

use crate::app::plot::painter::{self, Look, Painted, Plots};
use sindyscope_report::figure::Figure;

/// Frames after which a figure that is not drawn is forgotten.
const FORGOTTEN: u64 = 64;

/// Figures of a room.
#[derive(Default)]
pub(in crate::app) struct Figures {
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
pub(in crate::app) struct Shown<'a> {
    /// A name that is unique among rooms.
    pub(in crate::app) place: &'static str,
    /// What tells it from others of this name that stand beside it.
    pub(in crate::app) number: u64,
    /// What it is to those who hear the window.
    pub(in crate::app) name: &'a str,
    /// What tells its data from others: those are shown whole.
    pub(in crate::app) data: u64,
    /// Small letters, as on a card.
    pub(in crate::app) compact: bool,
    /// What it reacts to if it is not zoomed.
    pub(in crate::app) sense: Sense,
    /// Strength, 0 to 1.
    pub(in crate::app) strength: f32,
}

impl<'a> Shown<'a> {
    pub(in crate::app) fn new(place: &'static str, name: &'a str, data: impl Hash) -> Self {
        let data = painter::stamp(data);
        Self { place, number: 0, name, data, compact: false, sense: Sense::click(), strength: 1.0 }
    }
}

/// The name of a panel in egui's memory.
pub(super) fn plot_id(place: &'static str, number: u64, panel: &'static str) -> Id {
    Id::unique(("room", place, number, panel))
}

impl Figures {
    /// Forgets what was not drawn lately.
    pub(in crate::app) fn tidy(&mut self) {
        self.now += 1;
        if self.now.is_multiple_of(FORGOTTEN) {
            let now = self.now;
            self.kept.retain(|_, kept| now - kept.used < FORGOTTEN);
        }
    }

    /// A figure, made anew if it would be another.
    pub(in crate::app) fn get(
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
    pub(in crate::app) fn draw<'f>(&mut self, ui: &mut Ui, figure: &'f Figure, shown: &Shown<'_>) -> Painted<'f> {
        let place = |panel: &'static str| plot_id(shown.place, shown.number, panel);
        let mut look = Look::new(&place, shown.data, shown.name);
        (look.compact, look.sense, look.strength) = (shown.compact, shown.sense, shown.strength);
        painter::show(ui, &mut self.plots, figure, &mut look)
    }
}
