//! Settings from a file: TOML by the names of the settings, or a saved project.

use std::path::Path;

use serde_json::Value;
use toml::Value as Toml;

use super::BatchError;
use crate::request::AnalysisRequest;
use crate::source::{Preparing, Reading};
use sindyscope_core::prepare::Preparation;
use sindyscope_core::setting::SettingForm;
use sindyscope_core::study::{SETTINGS, Settings};
use sindyscope_files::{ReadOptions, is_project};

/// The format of projects that is read.
const PROJECT_VERSION: u64 = 5;

/// A study that is asked for by a file: TOML (`terms = "x, v"`, `window = 31`, `refine = true`, `[fix]`, `[columns]`), or a project that
/// the window saved, of which all but its records is taken.
///
/// # Errors
/// The file cannot be read, or says something that is no setting.
pub fn settings_of_file(path: &Path) -> Result<AnalysisRequest, BatchError> {
    let bytes = std::fs::read(path).map_err(|e| BatchError::reading(path, &e))?;
    let malformed = |problem: String| BatchError::Settings { file: path.display().to_string(), problem };
    if is_project(&bytes) {
        return of_project(&bytes).map_err(malformed);
    }
    let text = String::from_utf8(bytes).map_err(|_| malformed("it is no text".to_owned()))?;
    let table: toml::Table = text.parse().map_err(|e: toml::de::Error| malformed(e.to_string()))?;
    let mut pairs: Vec<(String, String)> = Vec::new();
    for (name, value) in table {
        let name = name.replace('_', "-");
        let form = AnalysisRequest::names().into_iter().find(|(known, ..)| *known == name).map(|(.., form)| form);
        for text in texts(&name, &value, form) {
            pairs.push((name.clone(), text));
        }
    }
    let pairs = pairs.iter().map(|(name, text)| (name.as_str(), text.as_str()));
    AnalysisRequest::named(pairs).map_err(|e| malformed(e.to_string()))
}

/// The texts of one setting, one for each time that it is given.
fn texts(name: &str, value: &Toml, form: Option<SettingForm>) -> Vec<String> {
    let plain = |value: &Toml| match value {
        Toml::String(text) => text.clone(),
        other => other.to_string(),
    };
    match (value, form) {
        (Toml::Boolean(true), Some(SettingForm::Flag)) => vec![String::new()],
        (Toml::Boolean(false), Some(SettingForm::Flag)) => Vec::new(),
        (Toml::Boolean(whether), _) => vec![if *whether { "yes" } else { "no" }.to_owned()],
        (Toml::Array(values), _) => vec![values.iter().map(plain).collect::<Vec<_>>().join(", ")],
        (Toml::Table(of), _) => {
            let pairs: Vec<String> = of.iter().map(|(key, value)| format!("{key}={}", plain(value))).collect();
            if name == "columns" { vec![pairs.join(",")] } else { pairs }
        }
        (other, _) => vec![plain(other)],
    }
}

fn of_project(bytes: &[u8]) -> Result<AnalysisRequest, String> {
    let mut value: Value = serde_json::from_slice(bytes).map_err(|e| e.to_string())?;
    let version = value["sindyscope_project"].as_u64();
    if version != Some(PROJECT_VERSION) {
        return Err("it was saved by another version: open it in the window and save it again".to_owned());
    }
    let mut document = value["document"].take();
    let mut edit = document["edit"].take();
    let settings: Settings = serde_json::from_value(edit["settings"].take()).map_err(|e| e.to_string())?;
    let steps: Vec<Preparation> = serde_json::from_value(edit["steps"].take()).map_err(|e| e.to_string())?;
    let read: ReadOptions = serde_json::from_value(document["reading"].take()).map_err(|e| e.to_string())?;
    // Settings that say nothing at all are left to the data.
    let told = SETTINGS.iter().filter(|_| settings != Settings::default());
    let told: Vec<_> = told.flat_map(|row| (row.write)(&settings).into_iter().map(|text| (row.name, text))).collect();
    let mut request =
        AnalysisRequest::named(told.iter().map(|(name, text)| (*name, text.as_str()))).map_err(|e| e.to_string())?;
    let ReadOptions { columns, only_named, rate, kind, bridge, .. } = read;
    request.source.reading = Reading { columns, only_named, rate, kind: kind.into() };
    // A step of one record by its name means nothing for others.
    let steps = steps.into_iter().filter(|step| step.record.is_none()).map(|step| step.treatment).collect();
    request.source.preparing = Preparing { steps, bridge };
    Ok(request)
}
