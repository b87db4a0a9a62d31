//! Components without a mass: `identify` and `diagnose` with `--kind component`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use super::failure::Failure;
use super::progress::ProgressLine;
use super::{CommandResult, json};
use sindyscope_analysis::component::{ComponentAnalysis, DiagnosedComponent, diagnose_component, identify_component};
use sindyscope_analysis::{AnalysisRequest, MissingRequest, RecordSource};
use sindyscope_component::{ComponentModel, Specimen};
use sindyscope_core::study::{Cancel, Score};
use sindyscope_report::component::{effect_lines, error_share, verdict};
use sindyscope_report::document::{ComponentReport, Paper};
use sindyscope_report::export::ExportFormat;
use sindyscope_values::format::equations;
use sindyscope_values::format::number::significant;
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::Usage;
use sindyscope_values::term::Symbol;

/// Identifies the force of a component and prints it.
pub(super) fn identify(
    request: &AnalysisRequest,
    exports: &[PathBuf],
    json: Option<&Path>,
    progress: &ProgressLine,
) -> CommandResult {
    let formats: Vec<ExportFormat> = exports.iter().map(|path| export_format(path)).collect::<Result<_, _>>()?;
    progress.stage("reading");
    let records = request.source.read()?;
    progress.stage("fitting the force");
    let analysis = identify_component(request, &records, &Cancel::default())?;
    for (path, format) in exports.iter().zip(formats) {
        std::fs::write(path, exported(&analysis, format)).map_err(|e| Failure::writing(path, &e))?;
    }
    if let Some(json) = json::write(json, &analysis.json())? {
        return Ok(json);
    }
    Ok(identified(&analysis).into_bytes())
}

/// Searches for what the force of a component lacks and prints it.
pub(super) fn diagnose(
    source: &RecordSource,
    request: &MissingRequest,
    json: Option<&Path>,
    progress: &ProgressLine,
) -> CommandResult {
    progress.stage("reading");
    let records = source.read()?;
    let tell = |what: &'static str, share: f64| progress.share(what, share);
    let found = diagnose_component(source, request, &records, &tell, &Cancel::default())?;
    if let Some(json) = json::write(json, &found.json())? {
        return Ok(json);
    }
    Ok(diagnosed(&found).into_bytes())
}

/// The form that a file's ending asks for, of those that hold a force along a given motion.
fn export_format(path: &Path) -> Result<ExportFormat, Failure> {
    match ExportFormat::of(path)? {
        format @ (ExportFormat::Text | ExportFormat::Latex | ExportFormat::Python | ExportFormat::Json) => Ok(format),
        other => Err(Failure::new(format!("the force of a component cannot be exported to .{}", other.ending()))
            .try_this("give a name that ends in .txt, .tex, .py or .json")),
    }
}

fn exported(analysis: &ComponentAnalysis, format: ExportFormat) -> String {
    let model = &analysis.found.model;
    match format {
        ExportFormat::Json => format!("{:#}\n", analysis.json()),
        ExportFormat::Latex => format!("\\[ F ={} \\]\n", equations::latex_sum(&model.force, &model.layout)),
        ExportFormat::Python => {
            let mut symbols: Vec<Symbol> = model.force.terms.iter().flat_map(|t| t.term.symbols()).collect();
            symbols.sort_unstable();
            symbols.dedup();
            let names: Vec<String> = symbols.iter().map(|s| model.layout.name(*s)).collect();
            let sum = equations::python_sum(&model.force, &model.layout);
            let (name, unit) = analysis.specimen.force();
            let arguments = names.join(", ");
            format!(
                "import numpy as np\n\n\ndef force({arguments}):\n    \"\"\"{name} in {unit}; numbers or arrays of samples, \
                 in the units of the records.\"\"\"\n    return {sum}\n"
            )
        }
        _ => equation(model),
    }
}

fn identified(analysis: &ComponentAnalysis) -> String {
    let mut out = equation(&analysis.found.model);
    out.push('\n');
    out.push_str(&errors(&analysis.found.model, &analysis.specimen));
    let (_, unit) = analysis.specimen.force();
    let _ = writeln!(
        out,
        "noise of the force {} (standard deviation, estimated)",
        format_si(analysis.found.noise_floor, unit, 2)
    );
    let _ = writeln!(
        out,
        "threshold {} of columns and force divided by their RMS",
        significant(analysis.found.threshold, 2)
    );
    out
}

/// The force, then the internal states.
fn equation(model: &ComponentModel) -> String {
    let mut out = equations::sum("F", &model.force, &model.layout, |term| model.unit(term));
    for (k, equation) in model.internals.iter().enumerate() {
        let state = format!("d{}/dt", model.layout.name(Symbol::Internal(k)));
        out.push_str(&equations::sum(&state, equation, &model.layout, |_| None));
    }
    out
}

/// Errors of each record, energy beside them.
fn errors(model: &ComponentModel, specimen: &Specimen) -> String {
    let (name, unit) = specimen.force();
    let line = |what: &str, s: Score| {
        format!("{what}: RMSE of {name} {}, NRMSE {} %", format_si(s.rmse, unit, 3), significant(100.0 * s.nrmse, 3))
    };
    let mut out = String::new();
    for record in &model.records {
        let what = if record.usage == Usage::Fit { "fitted" } else { "held out" };
        let [measured, identified] = record.energy;
        let share = significant(100.0 * identified / measured, 4);
        let _ = writeln!(
            out,
            "{}; energy taken {share} % of the measured",
            line(&format!("{} {what}", record.name), record.score)
        );
    }
    out
}

fn diagnosed(diagnosis: &DiagnosedComponent) -> String {
    let found = &diagnosis.found;
    let mut out = format!("Spring and damper alone: NRMSE {} %.\n{}\n", error_share(&found.base), verdict(found));
    for step in &found.steps {
        out.push_str(&effect_lines(step).join("\n  "));
        out.push('\n');
    }
    let _ = writeln!(out, "Remaining: {}.\n", diagnosis.remaining());
    out.push_str(&equation(found.last()));
    out.push('\n');
    out.push_str(&errors(found.last(), &diagnosis.specimen));
    out
}

/// Writes a document about a component's force, with what it lacks if that is asked for.
pub(super) fn report(
    request: &AnalysisRequest,
    missing: Option<&MissingRequest>,
    (title, paper, out): (&str, Paper, &Path),
    json: Option<&Path>,
    progress: &ProgressLine,
) -> CommandResult {
    progress.stage("reading");
    let records = request.source.read()?;
    progress.stage("fitting the force");
    let analysis = identify_component(request, &records, &Cancel::default())?;
    let mut result = analysis.json();
    let tell = |what: &'static str, share: f64| progress.share(what, share);
    let search = |missing| diagnose_component(&request.source, missing, &records, &tell, &Cancel::default());
    let diagnosis = missing.map(search).transpose()?;
    let (model, lacking) = match &diagnosis {
        None => (&analysis.found.model, Vec::new()),
        Some(diagnosis) => {
            result["diagnosis"] = diagnosis.json();
            let found = &diagnosis.found;
            let mut lines = vec![verdict(found).to_owned()];
            for step in &found.steps {
                let (values, sentences): (Vec<String>, Vec<String>) =
                    effect_lines(step).into_iter().skip(1).partition(|line| !line.ends_with('.'));
                lines.push(effect_lines(step).swap_remove(0));
                lines.push(format!("{}. {}", values.join(", "), sentences.join(" ")));
            }
            lines.push(format!("Remaining: {}.", diagnosis.remaining()));
            (found.last(), lines)
        }
    };
    progress.stage("drawing");
    let report = ComponentReport { title, specimen: &analysis.specimen, model, lacking: &lacking, paper };
    report.write(out).map_err(Failure::from)?;
    let json = json::write(json, &result)?;
    Ok(json.unwrap_or_else(|| format!("wrote {}\n", out.display()).into_bytes()))
}
