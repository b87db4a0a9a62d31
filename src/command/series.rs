//! The table of a batch as a series.

use std::path::{Path, PathBuf};

use clap::Args;

use super::CommandResult;
use super::failure::Failure;
use super::json;
use sindyscope_analysis::series::{LEAST_RECORDS, ParameterSeries, Series, SeriesError, series};
use sindyscope_report::document::{FigureFormat, FigureSize};
use sindyscope_values::format::number::{format_measured, significant};
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
    let figure = found.figure();
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
    let ParameterSeries { name, points, trend } = parameter;
    let Some(trend) = trend else {
        return format!("  {name}: in {} records, too few for a trend ({LEAST_RECORDS})\n", points.len());
    };
    let level = format_measured(trend.level, Some(trend.level_error));
    let scatter = match trend.scatter {
        0.0 => "no scatter beyond the standard errors".to_owned(),
        scatter => format!("scatter {} beyond the standard errors", significant(scatter, 2)),
    };
    if trend.told() {
        let slope = format_measured(trend.slope, Some(trend.slope_error));
        let place = significant(trend.centre, 3);
        return format!("  {name}: {level} at {place}, {slope} for 1 of {unit}; {scatter}\n");
    }
    format!("  {name}: {level}, no trend (p = {}); {scatter}\n", significant(trend.p_value, 2))
}
