use std::path::PathBuf;

use clap::Args;

use super::Output;
use super::analysis::analyse;
use super::failure::Failure;
use super::identify::write_json;
use super::options::StudyOptions;
use crate::report::{Format, Report};

/// Options of `report`.
#[derive(Debug, Args)]
pub(super) struct Options {
    #[command(flatten)]
    study: StudyOptions,
    /// The document to write: .html (self-contained) or .png, by the ending
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Its title [default: the names of the files]
    #[arg(long, value_name = "TEXT", help_heading = "Output")]
    title: Option<String>,
}

/// Identifies and writes the document.
pub(super) fn run(options: &Options) -> Output {
    // Said before the work is done, not after.
    Format::of(&options.out).map_err(Failure::from)?;
    let analysis = analyse(&options.study)?;
    let command = options.study.command("report", &analysis.outcome.settings, Some(&options.out));
    let title = options.title.clone().unwrap_or_else(|| title(&options.study.data));
    let report = Report {
        title: &title,
        records: &analysis.records,
        outcome: &analysis.outcome,
        choice: analysis.choice.as_deref(),
        command: Some(&command),
    };
    report.write(&options.out).map_err(Failure::from)?;
    let json = write_json(&options.study, &analysis)?;
    Ok(json.unwrap_or_else(|| format!("wrote {}\n", options.out.display()).into_bytes()))
}

/// The names of the files, without folders and endings.
fn title(files: &[PathBuf]) -> String {
    const NAMED: usize = 3;
    let names: Vec<_> = files.iter().filter_map(|f| f.file_stem()).map(|s| s.to_string_lossy()).collect();
    match names.len() {
        0..=NAMED => names.join(", "),
        n => format!("{} and {} more", names[..NAMED - 1].join(", "), n + 1 - NAMED),
    }
}

#[cfg(test)]
impl Options {
    pub(super) fn study(&self) -> &StudyOptions {
        &self.study
    }
}
