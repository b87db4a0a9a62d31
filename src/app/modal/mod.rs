//! Structures by their modes: what was found of them, the views of it in the centre, the columns beside.
//!
//! [`ModalRoom`] is what was found; how it is shown lies in the state. Figures come from [`sindyscope_report::modal`].

mod centre;
mod columns;
mod missing;
mod proposal;
mod room;

pub(crate) use centre::{ModalAct, ModalCanvas, show, svg};
pub(crate) use columns::{controls, findings};
pub(crate) use missing::{missing_findings, missing_svg, show_missing};
pub(crate) use proposal::reason_for_modes;
pub(crate) use room::{ModalFigureRequest, ModalRoom};
