//! Records of the room as files, written in the background.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::class::ClassCase;
use super::{Made, work};
use crate::app::worker::Worker;
use sindyscope_files::write_csv;
use sindyscope_rig::hidden::draw;
use sindyscope_values::record::Record;

/// What is to be written, and where.
pub(super) enum Job {
    /// The rig's records, and the truth beside them.
    Rig(PathBuf, Box<Made>),
    /// The records of a class's round, without what they hide.
    Round(PathBuf, ClassCase),
    /// A text.
    Table(PathBuf, String),
}

pub(super) fn worker(wake: impl Fn() + Send + 'static) -> std::io::Result<Worker<Job, Result<Vec<PathBuf>, String>>> {
    Worker::spawn(
        "rig files",
        wake,
        |job, _, _| Some(write(job)),
        || Err("nothing was saved: an error of the program; please report it".to_owned()),
    )
}

fn write(job: Job) -> Result<Vec<PathBuf>, String> {
    match job {
        Job::Rig(path, made) => {
            let truth = truth(&made);
            let comments = vec![
                "Sindyscope's virtual rig; the record `held out` is for checking, not for fitting".to_owned(),
                made.run.truth.told.description.clone(),
            ];
            csv(&path, work::records(&made.run).entries.iter().map(|(r, _)| &**r), &comments)?;
            let beside = path.with_extension("truth.json");
            let text = serde_json::to_string_pretty(&truth).map_err(|e| failed(&beside, &e.to_string()))?;
            fs::write(&beside, text + "\n").map_err(|e| failed(&beside, &e.to_string()))?;
            Ok(vec![path, beside])
        }
        Job::Round(path, case) => {
            let hidden = draw(&case.request()).map_err(|e| e.to_string())?;
            let comments = vec!["Sindyscope, a virtual rig that hides an effect: which is it?".to_owned()];
            csv(&path, hidden.fit.iter().chain(&hidden.held_out), &comments)?;
            Ok(vec![path])
        }
        Job::Table(path, text) => {
            fs::write(&path, text).map_err(|e| failed(&path, &e.to_string()))?;
            Ok(vec![path])
        }
    }
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
        .told
        .parameters
        .iter()
        .map(|p| json!({ "effect": p.effect, "name": p.name, "value": p.value, "unit": p.unit }))
        .collect();
    json!({
        "version": 1,
        "description": truth.told.description,
        "effects": truth.told.effects,
        "terms": terms,
        "parameters": parameters,
        "missing_force_share": made.run.ratio,
        "settings": made.settings,
    })
}
