use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use clap::error::ErrorKind;

use super::json;
use super::{CommandResult, usage};
use sindyscope_analysis::effects::of_file;
use sindyscope_analysis::json::effects;
use sindyscope_search::{Entry, guide, guide_of_own};
use sindyscope_values::format::number::significant_trimmed;

/// Options of `effects`.
#[derive(Debug, Args)]
pub(super) struct EffectsOptions {
    /// An effect to describe; every effect with one line if none is given
    #[arg(value_name = "EFFECT")]
    effect: Option<String>,
    /// Effects of one's own besides: a TOML file with a table for each
    #[arg(long, value_name = "FILE")]
    effects: Option<PathBuf>,
    /// Tell it as JSON, on standard output or in a file
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    json: Option<PathBuf>,
}

/// Describes the catalogue of effects that a model may lack.
pub(super) fn run(options: &EffectsOptions) -> CommandResult {
    let own = options.effects.as_deref().map(of_file).transpose()?.unwrap_or_default();
    let mut entries = guide();
    entries.extend(guide_of_own(&own));
    if let Some(wanted) = &options.effect {
        let names: Vec<&str> = entries.iter().map(|e| e.effect).collect();
        entries.retain(|e| e.effect == wanted);
        if entries.is_empty() {
            let problem = format!("there is no effect '{wanted}'; there are {}", names.join(", "));
            return Err(usage("effects", ErrorKind::InvalidValue, problem));
        }
    }
    if let Some(text) = json::write(options.json.as_deref(), &effects(&entries))? {
        return Ok(text);
    }
    if options.json.is_some() {
        return Ok(Vec::new());
    }
    let text = match (&options.effect, entries.as_slice()) {
        (Some(_), [only]) => described(only),
        _ => listed(&entries),
    };
    Ok(text.into_bytes())
}

fn listed(entries: &[Entry]) -> String {
    let mut out = String::new();
    let width = entries.iter().map(|e| e.effect.len()).max().unwrap_or(0);
    let mut family = "";
    for entry in entries {
        if entry.family != family {
            family = entry.family;
            let _ = writeln!(out, "{}{family}", if out.is_empty() { "" } else { "\n" });
        }
        let _ = writeln!(out, "  {:<width$}  {}", entry.effect, entry.explanation);
    }
    out.push_str("\n`sindyscope effects NAME` says more of one.\n");
    out
}

fn described(entry: &Entry) -> String {
    let mut out = format!("{} ({})\n{}\n\n", entry.title, entry.effect, entry.explanation);
    let mut line = |name: &str, text: String| {
        if !text.is_empty() {
            let _ = writeln!(out, "{name:<14}{text}");
        }
    };
    for form in &entry.forms {
        let given: Vec<String> =
            form.example.iter().map(|(name, v)| format!("{name} = {}", significant_trimmed(*v, 3))).collect();
        let mut text = form.terms.join(", ");
        for (state, terms) in &form.states {
            let terms: Vec<String> = terms.iter().map(|(t, c)| format!("{} {t}", significant_trimmed(*c, 4))).collect();
            let _ = write!(text, "; d{state}/dt = {}", terms.join(", "));
        }
        for (before, after) in [("for ", given.join(", ")), ("in place of ", form.replaces.join(", "))] {
            if !text.is_empty() && !after.is_empty() {
                let _ = write!(text, "  ({before}{after})");
            }
        }
        if !text.is_empty() && !form.form.is_empty() {
            let _ = write!(text, "  {}", form.form);
        }
        line("terms", text);
    }
    for parameter in &entry.parameters {
        let mut text = parameter.name.clone();
        if !parameter.unit.is_empty() {
            let _ = write!(text, " in {}", parameter.unit);
        }
        text.push_str(if parameter.positive { ", not negative" } else { ", of either sign" });
        line("parameter", text);
    }
    line("contains", entry.contains.join(", "));
    line("contained in", entry.contained_in.join(", "));
    line("like", entry.shifts_the_zero_as.join(", "));
    line("told apart by", entry.separates.to_owned());
    out
}
