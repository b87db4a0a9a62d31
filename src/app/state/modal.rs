//! How a structure's modes are shown.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use sindyscope_report::modal::{ModalOptions, ModalView};
use sindyscope_report::palette::Ink;

/// How a structure's modes are shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ModalShown {
    /// The view.
    pub(crate) view: ModalView,
    /// What of it is shown.
    pub(crate) options: ModalOptions,
    /// The record never fitted that is shown in "What's missing", from zero.
    pub(crate) unseen: usize,
    /// Curves switched off in the legends.
    pub(crate) hidden: BTreeSet<Ink>,
}
