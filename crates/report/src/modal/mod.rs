//! The figures of a structure's modes: where they come from, what they make of each record, and how they swing.
//!
//! Each is a pure function from a [`ModalAnalysis`] and a few choices to a [`Figure`]; the window shows them, and reports hold them.

mod responses;
mod shapes;
mod stabilization;
#[cfg(test)]
mod tests;
mod unseen;
mod words;

use serde::{Deserialize, Serialize};

use crate::figure::Figure;
use sindyscope_modes::ModalAnalysis;
use sindyscope_values::format::number::format_measured;
use sindyscope_values::model::Mode;

pub use responses::modal_averages;
pub use unseen::before_and_after;
pub use words::{
    cluster_words, diagnosis_lines, diagnosis_text, force_rate, force_rate_terms, force_term, modes_text, remaining,
    verdict,
};

/// One way of looking at a structure's modes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModalView {
    /// Poles by order.
    #[default]
    Stabilization,
    /// Responses over frequency, measured and modelled.
    Responses,
    /// Shapes over the sensors, and how alike they are.
    Shapes,
}

/// What is shown of the modes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ModalOptions {
    /// The sensor whose response is shown, from zero; the last one there is if there are fewer.
    pub sensor: usize,
    /// The input that it answers, likewise.
    pub input: usize,
    /// The mode whose shape is shown alone, from zero; none: all.
    pub mode: Option<usize>,
    /// Whether frequencies are shown on a logarithmic axis.
    pub log_frequency: bool,
    /// Segments averaged in a frequency response; zero: the usual number.
    pub averages: usize,
    /// Whether poles that stand for noise are shown.
    pub spurious: bool,
    /// How far the shapes have swung, rad; none: as they are at their largest.
    #[serde(skip)]
    pub swing: Option<f64>,
}

/// What a figure is of.
#[derive(Clone, Copy, Debug)]
pub struct ModalSubject<'a> {
    /// The modes.
    pub analysis: &'a ModalAnalysis,
    /// Which of the analysis's records; the others are laid over it where they compare.
    pub record: usize,
    /// What a person chose.
    pub options: &'a ModalOptions,
}

impl ModalView {
    /// Every view, in the order of the tabs.
    pub const ALL: [Self; 3] = [Self::Stabilization, Self::Responses, Self::Shapes];

    /// The tab's text.
    pub fn label(self) -> &'static str {
        match self {
            Self::Stabilization => "Stabilization",
            Self::Responses => "Responses",
            Self::Shapes => "Shapes",
        }
    }

    /// What the view shows, in one sentence.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Stabilization => "The poles of models of growing order, over the spectrum: a mode is what stays",
            Self::Responses => "Responses over frequency, measured and of the modes, and what the modes miss",
            Self::Shapes => "How far each sensor swings in each mode, and how alike the shapes are",
        }
    }

    /// How the view is read.
    pub fn reading(self) -> &'static str {
        match self {
            Self::Stabilization => {
                "A column of full marks is a mode: it stays as the order grows; an upright bar, its cluster. Click a mark to take it as \
                 a mode, or a chosen mode to leave it."
            }
            Self::Responses => {
                "Where measured and modelled lie on each other the modes are right; a peak that moves from record to record is a \
                 nonlinear structure."
            }
            Self::Shapes => {
                "Two shapes with an assurance near one are one mode seen twice, or too few sensors to tell two."
            }
        }
    }

    /// The figure, or why there is none.
    ///
    /// # Errors
    /// A sentence that says what the view lacks.
    pub fn figure(self, subject: &ModalSubject<'_>) -> Result<Figure, String> {
        match self {
            Self::Stabilization => Ok(stabilization::figure(subject)),
            Self::Responses => responses::figure(subject),
            Self::Shapes => shapes::figure(subject),
        }
    }
}

/// A mode in words, by its number: `2: 4.231 ± 0.002 Hz`.
pub fn mode_name(number: usize, mode: &Mode) -> String {
    format!("{number}: {} Hz", format_measured(mode.frequency, mode.frequency_error))
}

/// Each mode in the driven band, with its place among all modes.
pub fn modes_in_band(analysis: &ModalAnalysis) -> impl Iterator<Item = (usize, &Mode)> {
    let structure = &analysis.structure;
    structure.modes.iter().enumerate().filter(|(k, _)| structure.in_band[*k])
}

/// Each mode in the driven band, with its number, from one.
pub fn numbered_modes(analysis: &ModalAnalysis) -> impl Iterator<Item = (usize, &Mode)> {
    modes_in_band(analysis).enumerate().map(|(k, (_, mode))| (k + 1, mode))
}
