//! The table of a batch as a series.

use std::path::{Path, PathBuf};

use clap::Args;

use super::CommandResult;
use super::failure::Failure;
use super::json;
use sindyscope_analysis::series::{ParameterSeries, Series, SeriesError, TrendWords, series};
use sindyscope_report::document::{FigureFormat, FigureSize, Paper, SeriesReport};
use sindyscope_values::format::shown::ShownUnits;

/// Width of the picture, and the height of each parameter's plot, mm.
const WIDTH: f64 = 160.0;
const PANEL: f64 = 45.0;

/// Options of `series`.
#[derive(Debug, Args)]
pub(super) struct SeriesOptions {
    /// The table that `batch` wrote
    table: PathBuf,
    /// The column that the series goes over: amplitude, temperature, time [default: the order of the table]
    #[arg(long, value_name = "COLUMN")]
    over: Option<String>,
    /// Draw the parameters with their trends: .svg, .pdf or .png
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write the result as JSON (`-`: to standard output, nothing else there)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Says how parameters go along a series, and which records do not fit.
pub(super) fn run(options: &SeriesOptions) -> CommandResult {
    let SeriesOptions { table, over, out, json } = options;
    let found = series(table, over.as_deref()).map_err(failure)?;
    if let Some(out) = out {
        draw(&found, out)?;
    }
    if let Some(json) = json::write(json.as_deref(), &found.json())? {
        return Ok(json);
    }
    Ok(text(&found).into_bytes())
}

fn failure(error: SeriesError) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        SeriesError::NoParameter(_) => failure.try_this("sindyscope batch FOLDER --out TABLE.csv"),
        SeriesError::NoColumn { .. } | SeriesError::NoNumber { .. } => {
            failure.try_this("name another column with --over, or leave it out")
        }
        SeriesError::Read { .. } => failure,
    }
}

fn draw(found: &Series, out: &Path) -> Result<(), Failure> {
    let format = FigureFormat::of(out).map_err(Failure::from)?;
    let figure = found.figure(None);
    let height = PANEL * figure.rows.len() as f64 + 10.0;
    let drawing = figure.svg(FigureSize { width: WIDTH, height, ..FigureSize::default() }, &ShownUnits::default());
    let bytes = format.bytes(&drawing, &figure.caption).map_err(Failure::from)?;
    std::fs::write(out, bytes).map_err(|e| Failure::new(format!("cannot write {}: {e}", out.display())))
}

fn text(found: &Series) -> String {
    let over = found.over.as_deref().unwrap_or("the order of the table");
    let mut text = format!("{} records over {over}\n", found.records);
    for parameter in &found.parameters {
        text += &line(parameter, found.over.as_deref().unwrap_or("record"));
    }
    if found.odd.is_empty() {
        text += "\nEvery record fits its siblings.\n";
    } else {
        text += "\nRecords that do not fit:\n";
        for odd in &found.odd {
            text += &format!("  {}: {}\n", odd.record, odd.reasons.join("; "));
        }
    }
    text
}

fn line(parameter: &ParameterSeries, unit: &str) -> String {
    let name = &parameter.name;
    let TrendWords { level, centre, slope, scatter, chance } = match parameter.words() {
        Ok(words) => words,
        Err(why) => return format!("  {name}: {why}\n"),
    };
    let scatter = scatter.map_or_else(
        || "no scatter beyond the standard errors".to_owned(),
        |scatter| format!("scatter {scatter} beyond the standard errors"),
    );
    match slope {
        Some(slope) => format!("  {name}: {level} at {centre}, {slope} for 1 of {unit}; {scatter}\n"),
        None => format!("  {name}: {level}, no trend (p = {chance}); {scatter}\n"),
    }
}

/// Writes the report of a table as a series.
pub(super) fn report(
    (table, over): (&Path, Option<&str>),
    (title, command): (&str, &str),
    (paper, out): (Paper, &Path),
    json: Option<&Path>,
) -> CommandResult {
    let found = series(table, over).map_err(failure)?;
    let report = SeriesReport { command: Some(command.to_owned()), paper, ..found.report(title) };
    report.write(out).map_err(Failure::from)?;
    let json = json::write(json, &found.json())?;
    Ok(json.unwrap_or_else(|| format!("wrote {}\n", out.display()).into_bytes()))
}
