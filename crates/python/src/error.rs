//! Errors as exceptions: the sentences of the commands, what would help in Python's words.

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::{PyErr, import_exception};
use sindyscope_analysis::AnalysisError;
use sindyscope_core::remedy::{Remedy, sentence};
use sindyscope_report::document::ReportError;
use sindyscope_rig::RigError;

import_exception!(sindyscope._error, Error);

/// An exception with its reason and what to try.
pub(crate) fn error(reason: String, advice: String) -> PyErr {
    Error::new_err((reason, advice))
}

/// An analysis without a result.
pub(crate) fn failed(failure: &AnalysisError) -> PyErr {
    if failure.is_cancelled() {
        return PyKeyboardInterrupt::new_err(());
    }
    let advice = match failure {
        AnalysisError::FirstOrder => {
            "leave out kind=\"first-order\" and give the displacement alone, with columns={\"x\": \"NAME\"}".to_owned()
        }
        AnalysisError::MassNeeded => "say it with mass=KG".to_owned(),
        other => sentence(&other.remedies(), word),
    };
    error(failure.to_string(), advice)
}

/// A document that was not written.
pub(crate) fn report_failed(failure: ReportError) -> PyErr {
    let advice = match failure {
        ReportError::Ending(_) => "give `out` a name that ends in .html, .pdf or .png",
        ReportError::Write { .. } => "check that the folder exists and may be written to",
        ReportError::FigureEnding(_) => "end the file's name in .svg, .pdf or .png",
        ReportError::Picture(_) => "write the report to .html",
    };
    error(failure.to_string(), advice.to_owned())
}

/// Records that the virtual rig could not make.
pub(crate) fn rig_failed(failure: &RigError) -> PyErr {
    error(failure.to_string(), String::new())
}

/// What would help, as Python has it.
fn word(remedy: &Remedy) -> String {
    match remedy {
        Remedy::NameColumns { columns, .. } if columns.is_empty() => "say with `columns` which column is which".into(),
        Remedy::NameColumns { columns, only, rate } => {
            let pairs: Vec<String> = columns.iter().map(|(key, column)| format!("{key:?}: {column:?}")).collect();
            let only = if *only { ", only_named=True" } else { "" };
            let rate = if *rate { ", rate=HZ" } else { "" };
            format!("{}: `columns={{{}}}{only}{rate}`", Remedy::naming(columns), pairs.join(", "))
        }
        Remedy::GiveRate { .. } => format!("{remedy}: `rate=1000`"),
        Remedy::LeaveToData => "leave the argument out to have it chosen from the data".into(),
        Remedy::LinearBase => "leave `terms` out for a linear spring and damper".into(),
        Remedy::OtherBase => "give other `terms`".into(),
        Remedy::FewerEffects => "stop before that effect with `max_effects`".into(),
        Remedy::Modes => "identify it by its modes with the command `sindyscope identify`".into(),
        Remedy::Identify { what } => format!("see `sindyscope.identify`, which {what}"),
        Remedy::Do(_) | Remedy::Settings { .. } | Remedy::Use { .. } | Remedy::OpenProject { .. } => remedy.to_string(),
    }
}
