//! What the panels show and change, and what they ask the window to do.

use crate::app::commands::WindowCommand;
use crate::app::open::Refused;
use crate::app::questions::Bought;
use crate::app::queue::JobProgress;
use crate::app::records::OpenRecords;
use crate::app::state::Edit;
use sindyscope_core::prepare::Preparation;
use sindyscope_core::remedy::Remedy;
use sindyscope_core::study::{Calibration, Settings};
use sindyscope_values::term::{Kind, Term};

/// What a panel asks the window to do, beside changing the settings.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PanelAct {
    /// A command.
    Do(WindowCommand),
    /// Show another record.
    ShowRecord(usize),
    /// Read the records as data of this kind.
    Kind(Kind),
    /// Take a remedy over.
    Remedy(Remedy),
    /// Prepare the records by these steps.
    Prepare(Vec<Preparation>),
    /// Show the whole record above the plots, to be cut by dragging, or hide it.
    Cut,
    /// Choose where a file is that is not where it was.
    Locate,
    /// Find what a step takes out of a channel, with the equation.
    Calibrate { step: usize, sought: Calibration },
    /// Stop choosing settings, or finding what a step takes out.
    StopChoosing,
}

/// What the panels show and change.
pub(crate) struct PanelContext<'a> {
    pub(crate) data: &'a OpenRecords,
    pub(crate) edit: &'a mut Edit,
    pub(crate) suggestion: &'a Settings,
    /// Whether the records come from files, whose columns can be chosen.
    pub(crate) of_files: bool,
    /// Whether they may be of a structure with several modes: measured ones always, of the program's own those that are.
    pub(crate) may_be_structure: bool,
    /// The record that the views show.
    pub(crate) shown: usize,
    /// Whether the whole record is shown above the plots, to be cut.
    pub(crate) cutting: bool,
    /// Whether settings are being chosen.
    pub(crate) choosing: Option<JobProgress>,
    /// The step whose value is being found.
    pub(crate) calibrating: Option<usize>,
    /// What was not opened, and why.
    pub(crate) refused: Option<&'a Refused>,
    /// What the answers to the open questions would buy.
    pub(crate) bought: &'a [Bought],
    pub(crate) typing: &'a mut Typing,
    pub(crate) asks: &'a mut Vec<PanelAct>,
}

/// What is being typed and not yet taken over.
#[derive(Clone, Debug, Default)]
pub(crate) struct Typing {
    /// Terms to add to the library.
    pub(crate) terms: String,
    /// Known physics to add.
    pub(crate) known: String,
    /// The term whose coefficient is being typed, with the text.
    pub(crate) fixed: Option<(Term, f64)>,
}
