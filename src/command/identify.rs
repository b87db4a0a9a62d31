use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::analysis::analyse;
use super::failure::Failure;
use super::options::StudyOptions;
use super::{Output, json};
use crate::export;
use crate::format::equations;
use crate::report::Report;

/// Options of `identify`.
#[derive(Debug, Args)]
pub(super) struct Options {
    #[command(flatten)]
    study: StudyOptions,
    /// Print the equations of motion alone, in this form
    #[arg(long, value_enum, value_name = "FORM", help_heading = "Output")]
    format: Option<Form>,
    /// Write the model to take along, in the form that the name's ending says: .tex .txt .json .py .m .mo .c; beside a
    /// program also the first record's time and inputs (…_input.csv). May be given several times
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    export: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Form {
    /// One line a term
    Text,
    /// An `aligned` block for a display
    Latex,
    /// A function for `scipy.integrate.solve_ivp`
    Python,
}

/// Identifies and prints.
pub(super) fn run(options: &Options) -> Output {
    // Said before the work is done, not after.
    for path in &options.export {
        export::Format::of(path).map_err(Failure::from)?;
    }
    let analysis = analyse(&options.study)?;
    for path in &options.export {
        export::write(&analysis.outcome, path).map_err(Failure::from)?;
    }
    if let Some(json) = json::write(options.study.json.as_deref(), &json::identified(&analysis))? {
        return Ok(json);
    }
    let model = &analysis.outcome.model;
    let units = analysis.outcome.units();
    let text = match options.format {
        Some(Form::Text) => equations::text(model, Some(&units)),
        Some(Form::Latex) => equations::latex(model),
        Some(Form::Python) => equations::python(model),
        None => {
            let report = Report {
                title: "",
                records: &analysis.records,
                outcome: &analysis.outcome,
                choice: analysis.choice.as_deref(),
                command: None,
                diagnosis: None,
            };
            format!("{}\n{}", equations::text(model, Some(&units)), report.summary())
        }
    };
    Ok(text.into_bytes())
}
