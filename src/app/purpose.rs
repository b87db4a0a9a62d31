//! What a file is wanted for.

use sindyscope_report::export::ExportFormat;

/// The ending of a project's file, and of a log's.
pub(crate) const PROJECT_ENDING: &str = "json";

/// What a file is wanted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// To be read: measurements or a project.
    Open,
    /// To be read beside what is open.
    Add,
    /// To be read in place of a file that is not where it was.
    Locate,
    /// To be read: effects of a person's own.
    Effects,
    /// To save effects of a person's own to.
    SaveEffects,
    /// To save the project to.
    Project,
    /// To export the model to, in the form that the name's ending says.
    Model,
    /// To save a picture of the plot to.
    Plot,
    /// To save the numbers of a plot to.
    Table,
    /// To save a picture of the window to.
    Window,
    /// To save the report to, as what the name's ending says.
    Report(ReportForm),
    /// To save the virtual rig's records to.
    RigRecords,
    /// To save the records of a class's round to.
    RoundRecords,
    /// To export the rounds of a class to.
    Rounds,
    /// To save the last seconds of a stream to, and open them.
    StreamRecord,
    /// To be read: a table that a batch wrote.
    Series,
    /// To save the log of the session to.
    Log,
}

impl Purpose {
    /// The dialog's title, and the label of the path field.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Open => "Open measurements or a project",
            Self::Add => "Add records",
            Self::Locate => "Choose where the file is now",
            Self::Effects => "Open effects of your own (.toml)",
            Self::SaveEffects => "Save the effects of your own (.toml)",
            Self::Project => "Save the project",
            Self::Model => "Export the model (.tex .txt .json .py .m .mo .c)",
            Self::Plot => "Save the figure (.svg .pdf .png)",
            Self::Table => "Save the numbers of the plot (.csv)",
            Self::Window => "Save a picture of the window",
            Self::Report(_) => "Save the report (.pdf .html .png)",
            Self::RigRecords => "Save the rig's records",
            Self::RoundRecords => "Save the round's records",
            Self::Rounds => "Export the rounds",
            Self::StreamRecord => "Keep the last seconds as a record (.csv)",
            Self::Series => "Open a table that a batch wrote (.csv, .parquet)",
            Self::Log => "Save the log of this session",
        }
    }

    /// What the path field's button says.
    pub(crate) fn verb(self) -> &'static str {
        match self {
            Self::Open | Self::Effects | Self::Series => "Open",
            Self::Add => "Add files",
            Self::Locate => "Choose",
            Self::Project
            | Self::SaveEffects
            | Self::Model
            | Self::Plot
            | Self::Table
            | Self::Window
            | Self::Report(_)
            | Self::RigRecords
            | Self::RoundRecords
            | Self::Rounds
            | Self::StreamRecord
            | Self::Log => "Save",
        }
    }

    /// True if something is written to the file.
    pub(crate) fn saves(self) -> bool {
        self.ending().is_some()
    }

    /// The ending that a file saved for it gets if its name has none.
    pub(crate) fn ending(self) -> Option<&'static str> {
        match self {
            Self::Open | Self::Add | Self::Locate | Self::Effects | Self::Series => None,
            Self::SaveEffects => Some("toml"),
            Self::Project | Self::Log => Some(PROJECT_ENDING),
            Self::Model => Some(ExportFormat::Python.ending()),
            Self::Plot | Self::Window => Some("png"),
            Self::Report(form) => Some(form.ending()),
            Self::Table | Self::RigRecords | Self::RoundRecords | Self::Rounds | Self::StreamRecord => Some("csv"),
        }
    }
}

/// What a report is saved as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReportForm {
    Html,
    Pdf,
}

impl ReportForm {
    /// The ending of its files.
    pub(crate) fn ending(self) -> &'static str {
        match self {
            Self::Html => "html",
            Self::Pdf => "pdf",
        }
    }
}
