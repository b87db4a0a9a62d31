use clap::{Args, ValueEnum};

use super::analysis::{Analysis, analyse};
use super::failure::Failure;
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
    let json = write_json(&options.study, &analysis)?;
    if let Some(json) = json {
        return Ok(json);
    }
    let model = &analysis.outcome.model;
    let text = match options.format {
        Some(Form::Text) => equations::text(model),
        Some(Form::Latex) => equations::latex(model),
        Some(Form::Python) => equations::python(model),
        None => {
            let report = Report {
                title: "",
                records: &analysis.records,
                outcome: &analysis.outcome,
                choice: analysis.choice.as_deref(),
                command: None,
            };
            format!("{}\n{}", equations::text(model), report.summary())
        }
    };
    Ok(text.into_bytes())
}

/// Writes the JSON that was asked for; what of it goes to standard output is handed back.
pub(super) fn write_json(options: &StudyOptions, analysis: &Analysis) -> Result<Option<Vec<u8>>, Failure> {
    let Some(path) = &options.json else { return Ok(None) };
    let mut text = serde_json::to_string_pretty(&json::identified(analysis))
        .map_err(|e| Failure::new(format!("cannot write the result as JSON: {e}")))?;
    text.push('\n');
    if options.json_only() {
        return Ok(Some(text.into_bytes()));
    }
    std::fs::write(path, text).map_err(|e| Failure::writing(path, &e))?;
    Ok(None)
}
