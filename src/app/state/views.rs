//! How views show what was found.

use std::collections::{BTreeSet, HashMap};

use serde::{Deserialize, Serialize};

use sindyscope_report::palette::Ink;
use sindyscope_report::view::{Group, View, ViewOptions};
use sindyscope_values::format::shown::ShownUnits;

/// How views show it. What is serialized survives a restart; the rest is remembered while the window is open.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ViewState {
    /// What of it is shown.
    #[serde(flatten)]
    pub(crate) options: ViewOptions,
    /// Curves switched off in the legends.
    pub(crate) hidden: BTreeSet<Ink>,
    /// The units that axes and coefficients are shown in, where a person chose.
    pub(crate) units: ShownUnits,
    /// Which of the residual's correlations is shown.
    pub(crate) partner: usize,
    #[serde(skip)]
    recent: HashMap<Group, View>,
}

impl ViewState {
    /// Notes which view was shown, to come back to it.
    pub(crate) fn remember(&mut self, view: View) {
        self.recent.insert(view.group(), view);
    }

    /// The view of a group that was shown last; its first if none was.
    pub(crate) fn recent(&self, group: Group) -> View {
        self.recent.get(&group).copied().or_else(|| group.views().next()).unwrap_or_default()
    }
}
