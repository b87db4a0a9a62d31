//! How a figure is to be shown, and what a panel became on the screen: what the painter and its parts share.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};

use egui::{Id, Sense};
use egui_plot::PlotResponse;

use super::palette::{Ink, Painted as _};
use sindyscope_report::figure::Panel;

/// How a figure is shown.
pub(crate) struct Look<'a> {
    /// The name of the place where it is shown, beside which a panel's name is unique.
    pub(crate) place: &'a dyn Fn(&'static str) -> Id,
    /// What tells its data from others: those are fitted anew.
    pub(crate) data: u64,
    /// Inks switched off in the legends; none: they cannot be.
    pub(crate) hidden: Option<&'a mut BTreeSet<Ink>>,
    /// The panel shown of a row of which one is shown; none: the figure's own choice.
    pub(crate) pick: Option<usize>,
    /// Strength of what an outcome decides, 0 to 1: less while a newer one is being computed.
    pub(crate) strength: f32,
    /// Small letters, and the ordinate named above.
    pub(crate) compact: bool,
    /// What fixed panels react to.
    pub(crate) sense: Sense,
    /// What the figure is to those who hear the window.
    pub(crate) name: &'a str,
}

/// A number that tells data from others.
pub(crate) fn stamp(data: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    data.hash(&mut hasher);
    hasher.finish()
}

impl<'a> Look<'a> {
    pub(crate) fn new(place: &'a dyn Fn(&'static str) -> Id, data: impl Hash, name: &'a str) -> Self {
        let (hidden, pick, strength, compact) = (None, None, 1.0, false);
        Self { place, data: stamp(data), hidden, pick, strength, compact, sense: Sense::click(), name }
    }

    /// An ink in this theme; what an outcome decides is faded while it is stale.
    pub(super) fn color(&self, ink: Ink, dark: bool) -> egui::Color32 {
        let color = ink.color(dark);
        match ink {
            Ink::Identified | Ink::Error | Ink::Diverged => color.gamma_multiply(self.strength),
            _ => color,
        }
    }

    pub(super) fn shows(&self, ink: Ink) -> bool {
        self.hidden.as_ref().is_none_or(|hidden| !hidden.contains(&ink))
    }
}

/// A panel that was drawn.
pub(crate) struct ShownPanel<'a> {
    pub(crate) panel: &'a Panel,
    pub(crate) plot: PlotResponse<()>,
}
