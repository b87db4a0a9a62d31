use clap::{Args, ValueEnum};

use super::analysis::analyse;
use super::options::StudyOptions;
use super::{Output, json};
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
    let analysis = analyse(&options.study)?;
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
