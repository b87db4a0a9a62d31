use std::fmt;
use std::path::Path;

use sindyscope_analysis::AnalysisError;
use sindyscope_analysis::batch::BatchError;
use sindyscope_core::remedy::{Remedy, sentence};
use sindyscope_files::ReadError;
use sindyscope_modes::ModesError;
use sindyscope_report::document::ReportError;
use sindyscope_report::export::ExportError;

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

/// What would help, as this command line has it.
pub(super) fn worded(remedies: &[Remedy]) -> String {
    sentence(remedies, word)
}

fn word(remedy: &Remedy) -> String {
    match remedy {
        Remedy::NameColumns { columns, .. } if columns.is_empty() => "say with --columns which column is which".into(),
        Remedy::NameColumns { columns, only, rate } => {
            let pairs: Vec<String> = columns.iter().map(|(key, column)| format!("{key}={column}")).collect();
            let only = if *only { " --only-named" } else { "" };
            let rate = if *rate { " --rate HZ" } else { "" };
            format!("{}: `--columns {}{only}{rate}`", Remedy::naming(columns), pairs.join(","))
        }
        Remedy::GiveRate { .. } => format!("{remedy}: `--rate 1000`"),
        Remedy::OpenProject { file } => {
            format!("open it in the window with `sindyscope {file}`; commands take the measurements that it names")
        }
        Remedy::LeaveToData => "leave the option out to have it chosen from the data; `--help` describes each".into(),
        Remedy::LinearBase => "leave --terms out for a linear spring and damper".into(),
        Remedy::OtherBase => "give other --terms".into(),
        Remedy::FewerEffects => "stop before that effect with --max-effects".into(),
        Remedy::Modes => "identify it by its modes: `--base modes`".into(),
        Remedy::Identify { what } => format!("see `sindyscope identify`, which {what}"),
        Remedy::Do(_) | Remedy::Settings { .. } | Remedy::Use { .. } => remedy.to_string(),
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        Self::new(error.to_string()).try_this(worded(&error.remedies()))
    }
}

impl From<AnalysisError> for Failure {
    fn from(error: AnalysisError) -> Self {
        let advice = match &error {
            AnalysisError::Prepare(_) => {
                "give other times with --crop, other steps with --prepare, or another share with --hold-out".to_owned()
            }
            AnalysisError::MassNeeded => "say it with --mass KG".to_owned(),
            AnalysisError::ForceNeeded => {
                "give the column a unit, as `u [N]`, or fix the coefficient itself: --fix u=VALUE".to_owned()
            }
            AnalysisError::NoMass => {
                "use `sindyscope identify` or `sindyscope diagnose`, or leave out --kind component".to_owned()
            }
            AnalysisError::FirstOrder => {
                "leave out --kind first-order and give the displacement alone, with --columns x=NAME".to_owned()
            }
            other => worded(&other.remedies()),
        };
        Self::new(error.to_string()).try_this(advice)
    }
}

impl From<ModesError> for Failure {
    fn from(error: ModesError) -> Self {
        Self::new(error.to_string()).try_this(worded(&error.remedies()))
    }
}

impl From<BatchError> for Failure {
    fn from(error: BatchError) -> Self {
        let advice = match error {
            BatchError::Read { .. } => "check the path",
            BatchError::Write { .. } => "check that the folder exists and may be written to",
            BatchError::List { .. } | BatchError::Empty(_) => {
                "give a folder of measurements, or a list: a file a line, or CSV with a column `file`"
            }
            BatchError::Settings { .. } => {
                "write TOML with the names of the options of identify, as `window = 31`, or give a saved project"
            }
            BatchError::OtherSettings(_)
            | BatchError::Journal { .. }
            | BatchError::AtWork(_)
            | BatchError::Cancelled => "",
        };
        Self::new(error.to_string()).try_this(advice)
    }
}

impl From<AnalysisError> for Stop {
    fn from(error: AnalysisError) -> Self {
        Self::Failure(error.into())
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
