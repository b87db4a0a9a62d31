//! Records of the room as files.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::room::Made;
use super::sets;
use crate::app::state::ClassCase;
use sindyscope_files::write_csv;
use sindyscope_rig::hidden::draw;
use sindyscope_system::fs;
use sindyscope_values::record::Record;

/// Writes the rig's records, and the truth beside them.
pub(crate) fn rig(path: PathBuf, made: &Made) -> Result<Vec<PathBuf>, String> {
    let comments = vec![
        "Sindyscope's virtual rig; the record `held out` is for checking, not for fitting".to_owned(),
        made.run.truth.description.clone(),
    ];
    csv(&path, sets::of_run(&made.run).entries.iter().map(|(r, _)| &**r), &comments)?;
    let beside = path.with_extension("truth.json");
    let text = serde_json::to_string_pretty(&truth(made)).map_err(|e| failed(&beside, &e.to_string()))?;
    fs::write(&beside, text + "\n").map_err(|e| failed(&beside, &e.to_string()))?;
    Ok(vec![path, beside])
}

/// Writes the records of a class's round, without what they hide.
pub(crate) fn round(path: PathBuf, case: &ClassCase) -> Result<Vec<PathBuf>, String> {
    let hidden = draw(&case.request()).map_err(|e| e.to_string())?;
    let comments = vec!["Sindyscope, a virtual rig that hides an effect: which is it?".to_owned()];
    csv(&path, hidden.fit.iter().chain(&hidden.held_out), &comments)?;
    Ok(vec![path])
}

/// Writes the last seconds of a stream.
pub(crate) fn stream(path: PathBuf, record: &Record) -> Result<Vec<PathBuf>, String> {
    csv(&path, [record], &["Sindyscope: the last seconds of a stream".to_owned()])?;
    Ok(vec![path])
}

fn csv<'a>(path: &Path, records: impl IntoIterator<Item = &'a Record>, comments: &[String]) -> Result<(), String> {
    let mut bytes = Vec::new();
    write_csv(records, &mut bytes, comments).map_err(|e| failed(path, &e.to_string()))?;
    fs::write(path, bytes).map_err(|e| failed(path, &e.to_string()))
}

fn failed(path: &Path, reason: &str) -> String {
    format!("{} was not saved: {reason}; choose another folder", path.display())
}

/// What moved the rig, for a script: the equations' terms, every parameter, and the rig's settings.
fn truth(made: &Made) -> serde_json::Value {
    let truth = &made.run.truth;
    let terms: Vec<_> = truth
        .terms
        .iter()
        .map(|t| {
            let term = t.term.as_ref().map_or_else(|| t.text.clone(), ToString::to_string);
            json!({ "state": truth.layout.name(t.state), "term": term, "coefficient": t.coefficient })
        })
        .collect();
    let parameters: Vec<_> = truth
        .parameters
        .iter()
        .map(|p| json!({ "effect": p.effect, "name": p.name, "value": p.value, "unit": p.unit }))
        .collect();
    json!({
        "version": 1,
        "description": truth.description,
        "effects": truth.effects,
        "terms": terms,
        "parameters": parameters,
        "missing_force_share": made.run.ratio,
        "settings": made.settings,
    })
}
