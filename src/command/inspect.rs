use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use serde_json::{Value, json};

use super::CommandResult;
use super::failure::{Failure, worded};
use super::json;
use super::progress::ProgressLine;
use super::source::ReadingOptions;
use sindyscope_analysis::json::VERSION;
use sindyscope_core::signal::standard_deviation;
use sindyscope_files::{ColumnUse, MeasuredFile, Overview, ReadError, ReadOptions, read_opened};
use sindyscope_values::format::number::significant_trimmed;
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::{Record, Role, notices};

/// Options of `inspect`.
#[derive(Debug, Args)]
pub(super) struct InspectOptions {
    /// Measurements to look into
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    reading: ReadingOptions,
    /// Tell it as JSON, on standard output or in a file
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    json: Option<PathBuf>,
}

/// Columns that are listed at most, and values shown of each.
const LISTED: usize = 40;
const VALUES: usize = 3;

/// A file, what it holds, and what was read from it.
struct Inspected<'a> {
    file: &'a PathBuf,
    /// None if it is damaged: reading says why.
    holds: Option<Overview>,
    found: Result<Vec<Arc<Record>>, ReadError>,
}

/// Tells what files hold.
pub(super) fn run(options: &InspectOptions, progress: &ProgressLine) -> CommandResult {
    progress.stage("reading");
    let reading = ReadOptions { keep_constant_inputs: true, ..options.reading.0.options() };
    let inspected: Vec<Inspected<'_>> = options.files.iter().map(|file| inspect(file, &reading)).collect();
    if inspected.iter().all(|i| i.found.is_err())
        && let Some(Inspected { found: Err(error), holds, .. }) = inspected.first()
    {
        let shown = holds.as_ref().map_or(String::new(), |holds| list(holds) + &perhaps(holds, error));
        return Err(Failure::from(error.clone()).showing(shown).into());
    }
    let result = json!({ "version": VERSION, "files": inspected.iter().map(as_json).collect::<Vec<_>>() });
    if let Some(json) = json::write(options.json.as_deref(), &result)? {
        return Ok(json);
    }
    Ok(inspected.iter().map(text).collect::<Vec<_>>().join("\n").into_bytes())
}

fn inspect<'a>(file: &'a PathBuf, reading: &ReadOptions) -> Inspected<'a> {
    let opened = match MeasuredFile::open(file) {
        Ok(opened) => [opened],
        Err(error) => return Inspected { file, holds: None, found: Err(error) },
    };
    let found = read_opened(&opened, &[], reading);
    let found = found.map(|set| set.entries.into_iter().map(|(record, _)| record).collect());
    Inspected { file, holds: opened[0].look(reading).ok(), found }
}

/// Its short name, as `--columns` takes it: `x`, `u2`.
fn short(record: &Record, role: Role) -> String {
    let several = record.channels.iter().filter(|c| c.role.symbol() == role.symbol()).count() > 1 || role.index() > 0;
    if several { format!("{}{}", role.symbol(), role.index() + 1) } else { role.symbol().to_owned() }
}

fn range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}

fn as_json(inspected: &Inspected<'_>) -> Value {
    let file = inspected.file.display().to_string();
    let mut told = match &inspected.found {
        Err(error) => json!({
            "file": file,
            "status": "refused",
            "error": error.to_string(),
            "advice": worded(&error.remedies()),
            "columns": error.columns(),
        }),
        Ok(records) => json!({
            "file": file,
            "status": "ok",
            "records": records.iter().map(|r| json!({
                "name": r.name,
                "start": r.start,
                "rate": r.interval.recip(),
                "samples": r.len(),
                "duration": r.duration(),
                "channels": r.channels.iter().map(|c| {
                    let (low, high) = range(&c.values);
                    json!({
                        "name": c.name,
                        "role": short(r, c.role),
                        "quantity": c.role.noun(),
                        "unit": Some(&c.unit).filter(|u| !u.is_empty()),
                        "min": low,
                        "max": high,
                        "noise": standard_deviation(&c.values),
                    })
                }).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
            "notices": notices(records.iter().map(AsRef::as_ref)),
        }),
    };
    told["holds"] = inspected.holds.as_ref().map_or(Value::Null, held);
    told
}

/// What a file holds, before it is read.
fn held(holds: &Overview) -> Value {
    let short = |used: Option<ColumnUse>| used.map(|used| used.key(false));
    let first = |values: &[f64]| -> Vec<Option<f64>> {
        values.iter().take(VALUES).map(|v| Some(*v).filter(|v| v.is_finite())).collect()
    };
    json!({
        "format": holds.format,
        "tables": holds.tables.iter().map(|t| json!({
            "name": Some(&t.name).filter(|n| !n.is_empty()),
            "rows": t.rows,
            "rate": t.rate,
            "proposed_columns": t.map(&t.proposed()).to_string(),
            "columns": t.columns.iter().map(|c| json!({
                "name": c.name,
                "unit": Some(&c.unit).filter(|u| !u.is_empty()),
                "role": short(c.taken),
                "may_be": short(c.guess),
                "first": first(&c.first),
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
    })
}

/// A line that proposes which column is which, where that may help.
fn perhaps(holds: &Overview, error: &ReadError) -> String {
    let table = &holds.tables[holds.main()];
    let proposed = table.map(&table.proposed()).to_string();
    if !error.is_about_columns() || proposed.is_empty() {
        return String::new();
    }
    format!("  perhaps: --columns \"{proposed}\"\n")
}

/// A file's tables with their columns, as lines of text.
fn list(holds: &Overview) -> String {
    let mut out = String::new();
    for table in &holds.tables {
        let name = if table.name.is_empty() { String::new() } else { format!(" `{}`", table.name) };
        let rate = table.rate.map_or(String::new(), |r| format!(" at {} Hz", significant_trimmed(r, 6)));
        let _ = writeln!(out, "  table{name}: {} columns of {} rows{rate}", table.columns.len(), table.rows);
        let labels: Vec<String> = (0..table.columns.len().min(LISTED)).map(|c| table.label(c)).collect();
        let width = labels.iter().map(|l| l.chars().count()).max().unwrap_or(0);
        for ((number, column), label) in table.columns.iter().enumerate().zip(&labels) {
            let used = match (column.taken, column.guess) {
                (Some(used), _) => used.key(false),
                (None, Some(guess)) => format!("{}?", guess.key(false)),
                (None, None) => "-".into(),
            };
            let values: Vec<String> = column.first.iter().take(VALUES).map(|v| significant_trimmed(*v, 5)).collect();
            let more = if column.first.len() > VALUES { ", …" } else { "" };
            let _ = writeln!(out, "    {:>3} {label:<width$}  {used:<6} {}{more}", number + 1, values.join(", "));
        }
        if table.columns.len() > LISTED {
            let _ = writeln!(out, "    and {} more; `--json` lists all", table.columns.len() - LISTED);
        }
    }
    out
}

fn text(inspected: &Inspected<'_>) -> String {
    let mut out = format!("{}\n", inspected.file.display());
    let records = match &inspected.found {
        Ok(records) => records,
        Err(error) => {
            let _ = writeln!(out, "  cannot be used: {error}\n  try: {}", worded(&error.remedies()));
            if let Some(holds) = &inspected.holds {
                out += &list(holds);
                out += &perhaps(holds, error);
            }
            return out;
        }
    };
    for record in records {
        let _ = writeln!(
            out,
            "  record {}: {} samples at {} Hz, {} s from t = {} s",
            record.name,
            record.len(),
            significant_trimmed(record.interval.recip(), 6),
            significant_trimmed(record.duration(), 6),
            significant_trimmed(record.start, 6),
        );
        let width = record.channels.iter().map(|c| c.name.chars().count()).max().unwrap_or(0);
        for channel in &record.channels {
            let (low, high) = range(&channel.values);
            let unit = if channel.unit.is_empty() { "no unit" } else { &channel.unit };
            let noise = standard_deviation(&channel.values).unwrap_or(0.0);
            let _ = writeln!(
                out,
                "    {:<3} {:<width$}  {} in {unit}, {} to {}, noise {}",
                short(record, channel.role),
                channel.name,
                channel.role.noun(),
                significant_trimmed(low, 4),
                significant_trimmed(high, 4),
                format_si(noise, &channel.unit, 2),
            );
        }
    }
    for notice in notices(records.iter().map(AsRef::as_ref)) {
        let _ = writeln!(out, "  note: {notice}");
    }
    if let Some(holds) = &inspected.holds {
        out += &list(holds);
    }
    out
}
