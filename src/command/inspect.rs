use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::Output;
use super::failure::Failure;
use super::json::{self, VERSION};
use super::options::{KindName, positive};
use crate::format::number::significant_trimmed;
use crate::format::units::format_si;
use crate::record::{ColumnMap, ReadError, ReadOptions, Record, Role, notices, read_files};
use crate::signal::standard_deviation;

/// Options of `inspect`.
#[derive(Debug, Args)]
pub(super) struct Options {
    /// Measurements to look into
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Which column is which, where the header does not say: t=NAME,x=NAME,u=NAME,…
    #[arg(long, value_name = "t=NAME,x=NAME,…")]
    columns: Option<ColumnMap>,
    /// Sampling rate, Hz, for files without a time column
    #[arg(long, value_name = "HZ", value_parser = positive, allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Displacements given and velocities derived, or every state given
    #[arg(long, value_enum, default_value_t)]
    kind: KindName,
    /// Tell it as JSON, on standard output or in a file
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    json: Option<PathBuf>,
}

/// A file, and what was read from it.
struct Inspected<'a> {
    file: &'a PathBuf,
    found: Result<Vec<Record>, ReadError>,
}

/// Tells what files hold.
pub(super) fn run(options: &Options) -> Output {
    let reading = ReadOptions {
        columns: options.columns.clone().unwrap_or_default(),
        rate: options.rate,
        kind: options.kind.into(),
        keep_constant_inputs: true,
        ..ReadOptions::default()
    };
    let inspected: Vec<Inspected<'_>> =
        options.files.iter().map(|file| Inspected { file, found: read_files(&[file], &reading) }).collect();
    if inspected.iter().all(|i| i.found.is_err())
        && let Some(Inspected { found: Err(error), .. }) = inspected.first()
    {
        return Err(Failure::from(error.clone()).into());
    }
    let result = json!({ "version": VERSION, "files": inspected.iter().map(as_json).collect::<Vec<_>>() });
    if let Some(json) = json::write(options.json.as_deref(), &result)? {
        return Ok(json);
    }
    Ok(inspected.iter().map(text).collect::<Vec<_>>().join("\n").into_bytes())
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
    match &inspected.found {
        Err(error) => json!({
            "file": file,
            "status": "refused",
            "error": error.to_string(),
            "advice": error.advice(),
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
            "notices": notices(records),
        }),
    }
}

fn text(inspected: &Inspected<'_>) -> String {
    let mut out = format!("{}\n", inspected.file.display());
    let records = match &inspected.found {
        Ok(records) => records,
        Err(error) => {
            let _ = writeln!(out, "  cannot be used: {error}\n  try: {}", error.advice());
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
    for notice in notices(records) {
        let _ = writeln!(out, "  note: {notice}");
    }
    out
}
