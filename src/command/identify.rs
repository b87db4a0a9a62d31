use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::failure::{Failure, worded};
use super::modes::BaseOptions;
use super::progress::ProgressLine;
use super::request::StudyOptions;
use super::{CommandResult, component, json, modes, table};
use sindyscope_analysis::json::identified;
use sindyscope_analysis::{Analysis, AnalysisError, AnalysisRequest, KindName, analyse};
use sindyscope_core::remedy::Remedy;
use sindyscope_core::study::{self, Calibrated, Calibration, Cancel, Horizon, Outcome, SETTINGS};
use sindyscope_report::document::{Arrangement, Report};
use sindyscope_report::export;
use sindyscope_values::format::equations;
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::{Role, Usage};

/// Options of `identify`.
#[derive(Debug, Args)]
pub(super) struct IdentifyOptions {
    #[command(flatten)]
    pub(super) study: StudyOptions,
    #[command(flatten)]
    base: BaseOptions,
    /// Print the equations of motion alone, in this form
    #[arg(long, value_enum, value_name = "FORM", help_heading = "Output")]
    format: Option<EquationStyle>,
    /// Write the model to take along, in the form that the name's ending says: .tex .txt .json .py .m .mo .c; beside a
    /// program also the first record's time and inputs (…_input.csv). May be given several times
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    export: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EquationStyle {
    /// One line a term
    Text,
    /// An `aligned` block for a display
    Latex,
    /// A function for `scipy.integrate.solve_ivp`
    Python,
}

/// Identifies and prints.
pub(super) fn run(options: &IdentifyOptions, progress: &ProgressLine) -> CommandResult {
    // Said before the work is done, not after.
    for path in &options.export {
        export::ExportFormat::of(path).map_err(Failure::from)?;
    }
    if options.base.is_modes() {
        if let Some(name) = SETTINGS.iter().map(|s| s.name).find(|name| options.study.request.given.has(name)) {
            return Err(Failure::new(format!("--{name} says how a chain of masses is identified, not modes"))
                .try_this("leave it out, or leave out --base modes")
                .into());
        }
        let source = &options.study.request.source;
        let written = modes::WrittenFiles { json: options.study.json.as_deref(), export: &options.export };
        return modes::identify(source, &options.base, &written, progress);
    }
    if options.study.request.source.reading.kind == KindName::Component {
        return component::identify(&options.study.request, &options.export, options.study.json.as_deref(), progress);
    }
    let analysis = study(&options.study.request, progress)?;
    // A form that cannot hold the model takes nothing from the others, nor from the result.
    let refused = options.export.iter().filter_map(|path| export::write(&analysis.outcome, path).err());
    let refused: Vec<_> = refused.collect();
    let json = json::write(options.study.json.as_deref(), &identified(&analysis))?;
    if let Some(first) = refused.into_iter().next() {
        return Err(Failure::from(first).into());
    }
    if let Some(json) = json {
        return Ok(json);
    }
    let model = &analysis.outcome.model;
    let units = analysis.outcome.units();
    let text = match options.format {
        Some(EquationStyle::Text) => equations::text(model, Some(&units)),
        Some(EquationStyle::Latex) => equations::latex(model),
        Some(EquationStyle::Python) => equations::python(model),
        None => {
            let report = Report {
                title: "",
                records: &analysis.records,
                outcome: &analysis.outcome,
                choice: analysis.choice.as_deref(),
                command: None,
                diagnosis: None,
                arrangement: &Arrangement::default(),
            };
            let integrated = match analysis.outcome.settings.form {
                study::Formulation::Integral => equations::integral_text(model, Some(&units)) + "or\n",
                _ => String::new(),
            };
            let mut text = format!("{integrated}{}\n{}", equations::text(model, Some(&units)), report.summary());
            text.push_str(&remedies(&analysis.outcome));
            text.push_str(&found_of_channels(&analysis));
            text.push_str(&predicts(&analysis));
            text
        }
    };
    Ok(text.into_bytes())
}

/// Reads the records and runs the study that is asked for.
pub(super) fn study(request: &AnalysisRequest, progress: &ProgressLine) -> Result<Analysis, AnalysisError> {
    progress.stage("reading");
    let records = request.source.read()?;
    analyse(request, records, &Cancel::default(), &|told| progress.show(told))
}

/// What would help where something is doubtful, a line each.
fn remedies(outcome: &Outcome) -> String {
    let of = |remedy: &Remedy| match remedy {
        Remedy::Settings { label, settings } => {
            let options = table::change(SETTINGS, &outcome.settings, settings);
            if options.is_empty() {
                format!("Try: {label}.\n")
            } else {
                format!("Try: {label}, `{}`.\n", options.trim())
            }
        }
        Remedy::Use { label, .. } => format!("Try: {label}, with `--test` before its file or `--hold-out SHARE`.\n"),
        other => format!("Try: {}.\n", worded(std::slice::from_ref(other))),
    };
    outcome.warnings.iter().filter_map(|warning| warning.remedy.as_ref()).map(of).collect()
}

/// What was found of the channels and taken out of the records, a line each.
fn found_of_channels(analysis: &Analysis) -> String {
    let name = |role: Role| {
        let channel = analysis.records.entries.first().and_then(|(r, _)| r.channel(role));
        channel.map_or_else(String::new, |c| c.name.clone())
    };
    let of = |found: &Calibrated| match found.what {
        Calibration::Delay(role) => {
            let which = if found.value < 0.0 { "early" } else { "late" };
            let by = format_measured(1e3 * found.value.abs(), found.std_error.map(|e| 1e3 * e));
            format!("Found with the equation: {} is {by} ms {which}; it was moved.\n", name(role))
        }
        Calibration::Gain(role) => {
            let gain = format_measured(found.value, found.std_error);
            format!(
                "Found with the equation: {} shows {gain} times what there is; it was divided by that.\n",
                name(role)
            )
        }
    };
    analysis.calibrated.iter().map(of).collect()
}

/// How far free runs predict, where that is not the whole record; a line for what was fitted and one for what was held out.
fn predicts(analysis: &Analysis) -> String {
    let outcome = &analysis.outcome;
    let unit = analysis.records.entries.first().and_then(|(r, _)| r.channel(Role::Displacement(0)));
    let unit = unit.map_or("", |c| c.unit.as_str());
    let of = |(usage, horizon): (Usage, Option<Horizon>)| {
        let longest = outcome.records.iter().filter(|r| r.usage == usage).map(|r| r.record.duration());
        let (longest, Horizon { seconds, rmse }) = (longest.fold(0.0, f64::max), horizon?);
        let what = if usage == Usage::Fit { "what was fitted" } else { "what was held out" };
        (seconds < 0.99 * longest).then(|| {
            format!(
                "Of {what} a free run predicts {} s of {} s, with an error of {}.\n",
                significant(seconds, 3),
                significant(longest, 3),
                format_si(rmse, unit, 3)
            )
        })
    };
    [Usage::Fit, Usage::HeldOut].into_iter().zip(analysis.horizons).filter_map(of).collect()
}
