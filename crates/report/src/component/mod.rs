//! The figures of a component without a mass, and what was found of it in words.

mod figures;
mod words;

use serde::{Deserialize, Serialize};

use crate::figure::Figure;
use sindyscope_component::{ComponentModel, Specimen};

pub use words::{effect_lines, error_share, verdict};

/// One way of looking at a component's force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ComponentView {
    /// Over displacement and over velocity.
    #[default]
    Loops,
    /// Over time, the error beneath.
    Time,
    /// Energy that it takes, record by record.
    Energy,
}

impl ComponentView {
    /// Every view, in the order of the tabs.
    pub const ALL: [Self; 3] = [Self::Loops, Self::Time, Self::Energy];

    /// The tab's text.
    pub fn label(self) -> &'static str {
        match self {
            Self::Loops => "Loops",
            Self::Time => "Force",
            Self::Energy => "Energy",
        }
    }

    /// What the view shows, in one sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Loops => "Force over displacement and over velocity, measured and identified",
            Self::Time => "Force over time, measured and identified, with the error beneath",
            Self::Energy => "Energy that the force takes in a cycle, measured and identified, in every record",
        }
    }

    /// The figure of one record of a model; none where there is no such record.
    pub fn figure(self, specimen: &Specimen, model: &ComponentModel, record: usize) -> Option<Figure> {
        let fit = model.records.get(record)?;
        let motion = specimen.motions().nth(record)?;
        Some(match self {
            Self::Loops => figures::loops(specimen, fit, &motion),
            Self::Time => figures::over_time(specimen, fit, &motion),
            Self::Energy => figures::energy(specimen, model),
        })
    }
}
