use std::fmt;
use std::path::Path;

use sindyscope_core::study::StudyError;
use sindyscope_files::ReadError;
use sindyscope_report::document::ReportError;
use sindyscope_report::export::ExportError;
use sindyscope_search::GapError;

/// Why the work could not be done, and what to try.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Failure {
    reason: String,
    advice: Option<String>,
    /// What is known all the same: lines to be shown as they are.
    shown: String,
}

/// Why a command has nothing to print.
#[derive(Debug)]
pub(super) enum Stop {
    /// Wrong usage, or help that was asked for.
    Usage(clap::Error),
    /// The work could not be done.
    Failure(Failure),
}

impl Failure {
    pub(super) fn new(reason: impl Into<String>) -> Self {
        Self { reason: reason.into(), advice: None, shown: String::new() }
    }

    #[must_use]
    pub(super) fn try_this(mut self, advice: impl Into<String>) -> Self {
        self.advice = Some(advice.into()).filter(|a: &String| !a.is_empty());
        self
    }

    /// The same with lines to be shown below the advice.
    #[must_use]
    pub(super) fn showing(self, shown: String) -> Self {
        Self { shown, ..self }
    }

    /// A file that could not be written.
    pub(super) fn writing(path: &Path, error: &std::io::Error) -> Self {
        Self::new(format!("cannot write {}: {error}", path.display()))
            .try_this("check that the folder exists and may be written to")
    }
}

impl fmt::Display for Failure {
    /// The reason on one line, what to try on the next.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |text: &str| text.lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; ");
        writeln!(f, "sindyscope: {}", line(&self.reason))?;
        if let Some(advice) = &self.advice {
            writeln!(f, "  try: {}", line(advice))?;
        }
        f.write_str(&self.shown)
    }
}

impl From<Failure> for Stop {
    fn from(failure: Failure) -> Self {
        Self::Failure(failure)
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::new(error.to_string()).try_this(error.advice())
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        let advice = match error {
            StudyError::RecordsDiffer(_) => {
                "give records with the same channels and units, or say with --columns which column is which"
            }
            StudyError::Setting(_) => "leave the option out to have it chosen from the data; `--help` describes each",
            StudyError::NothingToFit | StudyError::Cancelled => "",
        };
        Self::new(error.to_string()).try_this(advice)
    }
}

impl From<GapError> for Failure {
    fn from(error: GapError) -> Self {
        let advice = match error {
            GapError::Records(_) => {
                "give records with the same channels and units, or say with --columns which column is which"
            }
            GapError::TooShort { .. } => {
                "give a longer record, or one that was sampled faster: ten periods at forty samples each are plenty"
            }
            GapError::Symbol { .. } => {
                "leave --terms out for a linear spring and damper, or name an input with --columns u=NAME"
            }
            GapError::Acceleration(_) => "give --terms without accelerations; `sindyscope identify` takes them",
            GapError::Base => {
                "leave --terms out for a linear spring and damper; `sindyscope identify` shows which terms suit the records"
            }
            GapError::Stage(_) => {
                "stop before that effect with --max-effects, or give a richer base model with --terms"
            }
            GapError::NothingToFit | GapError::Cancelled => "",
        };
        Self::new(error.to_string()).try_this(advice)
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        let advice = match error {
            ReportError::Ending(_) => "give --out a name that ends in .html, .pdf or .png",
            ReportError::Write { .. } => "check that the folder exists and may be written to",
            ReportError::FigureEnding(_) => "end the file's name in .svg, .pdf or .png",
            ReportError::Picture(_) => "write the report to .html",
        };
        Self::new(error.to_string()).try_this(advice)
    }
}

impl From<ExportError> for Failure {
    fn from(error: ExportError) -> Self {
        let advice = match error {
            ExportError::Ending(_) => "give --export a name like model.py",
            ExportError::Model(_) => "use fewer terms with --terms, or other ones",
            ExportError::Coefficient(_) => "drop the term with --drop",
            ExportError::Switches(_) => "give --export a name that ends in .py or .c",
            ExportError::Write { .. } => "check that the folder exists and may be written to",
        };
        Self::new(error.to_string()).try_this(advice)
    }
}
