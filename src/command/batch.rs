use std::path::PathBuf;

use clap::Args;

use super::CommandResult;
use super::failure::Failure;
use super::progress::ProgressLine;
use sindyscope_analysis::AnalysisRequest;
use sindyscope_analysis::batch::{
    BatchPart, BatchRequest, BatchSummary, batch, batch_items, missing_of_settings, settings_of_file,
};
use sindyscope_analysis::missing::MAX_EFFECTS;
use sindyscope_core::study::Cancel;

/// Options of `batch`.
#[derive(Debug, Args)]
pub(super) struct BatchOptions {
    /// A folder of measurements, or a list of them: a file a line, or CSV with a column `file`, which may have a column `test` (a
    /// file to hold out) and others, which the table takes over
    #[arg(value_name = "LIST|FOLDER")]
    records: PathBuf,
    /// The table to write, a row a record: CSV, or Parquet where its name ends in .parquet. What is done is kept beside it (TABLE.journal) and is not done again
    #[arg(long, value_name = "TABLE")]
    out: PathBuf,
    /// The settings: a TOML file with the names of the options of identify (terms = "x, v, u"), or a saved project [default: all
    /// chosen from each record]
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Search each record for missing effects, as diagnose does: the row has the verdict, the effects with their parameters, and the errors
    /// without and with them. Of the settings it takes terms (the base model), lock, initial, and how records are read; reports take
    /// the others for the equation that they begin with
    #[arg(long)]
    diagnose: bool,
    /// Most effects that are added
    #[arg(long, value_name = "N", default_value_t = MAX_EFFECTS, value_parser = clap::value_parser!(u8).range(..=20), requires = "diagnose")]
    max_effects: u8,
    /// Write a report of each record into this folder, as HTML: its equation and, with --diagnose, what the search found
    #[arg(long, value_name = "FOLDER")]
    reports: Option<PathBuf>,
    /// Do the K-th of N parts alone, as a task of a job array does; the same without --part does what is left and writes the table
    #[arg(long, value_name = "K/N")]
    part: Option<BatchPart>,
}

/// Works through the records.
pub(super) fn run(options: &BatchOptions, progress: &ProgressLine) -> CommandResult {
    let BatchOptions { records, out, settings, diagnose, max_effects, reports, part } = options;
    let items = batch_items(records).map_err(Failure::from)?;
    let study = settings.as_deref().map(settings_of_file).transpose().map_err(Failure::from)?;
    let study: AnalysisRequest = study.unwrap_or_default();
    let missing = diagnose.then(|| missing_of_settings(&study, *max_effects, reports.is_some())).transpose()?;
    let request = BatchRequest { items, study, missing, out: out.clone(), reports: reports.clone(), part: *part };
    let summary = batch(&request, &Cancel::default(), &|told| progress.show(told)).map_err(Failure::from)?;
    let BatchSummary { records, now, before, failed, left, written } = summary;
    let mut text = format!("{records} records: {now} done now, {before} before, {failed} failed");
    text += &match (written, left) {
        (true, _) => format!("; wrote {}\n", out.display()),
        (false, 0) => "; all parts are done: the same without --part writes the table\n".to_owned(),
        (false, left) => format!("; {left} left to other parts\n"),
    };
    Ok(text.into_bytes())
}
