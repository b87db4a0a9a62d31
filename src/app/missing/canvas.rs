//! What the room remembers of its drawing from frame to frame: none of it was decided or found.

use super::own::OwnDraft;
use crate::app::plot::figures::Figures;
use crate::app::state::WalkView;
use sindyscope_search::Choice;

/// What is drawn on.
#[derive(Default)]
pub(crate) struct WalkCanvas {
    /// What is in view, while the room is drawn: what a person changes there becomes a message.
    pub(crate) view: WalkView,
    /// The candidate under the pointer.
    pub(super) hovered: Option<Choice>,
    /// The mass whose response is shown: that of the views of Identify too.
    pub(super) mass: usize,
    /// Terms of the base that are being typed.
    pub(super) typing: Option<String>,
    /// Effects of the person's own that are being written, while their window is open.
    pub(super) own: Option<OwnDraft>,
    pub(super) figures: Figures,
}

impl WalkCanvas {
    /// Puts the text of a file of effects into the window of own effects.
    pub(crate) fn take_effects(&mut self, text: &str) {
        self.own = Some(OwnDraft::of_file(text));
    }
}
