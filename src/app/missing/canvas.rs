//! What the room remembers of its drawing from frame to frame: none of it was decided or found.

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
    pub(super) figures: Figures,
}
