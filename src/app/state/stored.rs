//! What older versions wrote, in the form of today.
//!
//! Sessions of the first version held the parts of the document and of the view side by side; projects up to the fourth did,
//! too, with the checksums by file.

use serde_json::{Map, Value, json};

/// The fields of this name, those that there are.
fn taken(from: &mut Map<String, Value>, names: &[&str]) -> Map<String, Value> {
    names
        .iter()
        .filter_map(|name| from.remove(*name).filter(|v| !v.is_null()).map(|v| ((*name).to_owned(), v)))
        .collect()
}

/// A state of any version.
pub(super) fn upgraded_state(state: Value) -> Value {
    let Value::Object(mut state) = state else { return state };
    if state.contains_key("document") {
        return Value::Object(state);
    }
    let mut document = taken(&mut state, &["source", "reading", "edit", "suggestion", "checksums", "found"]);
    let source = document.entry("source").or_insert_with(|| json!({"sample": "duffing"})).clone();
    let kept: Vec<Value> = match state.remove("kept") {
        Some(Value::Array(kept)) => kept.into_iter().map(without_nulls).collect(),
        _ => Vec::new(),
    };
    // Pins were kept with the source, also with the one that was open.
    if let Some(pins) = kept.iter().find(|kept| kept["source"] == source).and_then(|kept| kept.get("pins")) {
        document.insert("pins".to_owned(), pins.clone());
    }
    let mut shown = taken(&mut state, &["room", "record", "cutting", "view", "views"]);
    if let Some(step) = state.remove("step") {
        shown.insert("walk".to_owned(), json!({ "step": step }));
    }
    state.insert("document".to_owned(), Value::Object(document));
    state.insert("kept".to_owned(), Value::Array(kept));
    state.insert("shown".to_owned(), Value::Object(shown));
    Value::Object(state)
}

fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(fields) => Value::Object(fields.into_iter().filter(|(_, v)| !v.is_null()).collect()),
        other => other,
    }
}

/// A project of any version.
pub(crate) fn upgraded_project(project: Value) -> Value {
    let Value::Object(mut project) = project else { return project };
    if project.contains_key("document") {
        return Value::Object(project);
    }
    let edit = taken(&mut project, &["settings", "steps", "walk", "report"]);
    let mut document = taken(&mut project, &["source", "reading", "pins", "found"]);
    let sums = project.remove("checksums").unwrap_or_default();
    if let Some(Value::Array(files)) = document.get("source").and_then(|source| source.get("files")) {
        let sum = |file: &Value| file.as_str().and_then(|file| sums.get(file)).cloned().unwrap_or_else(|| json!(""));
        let sums: Vec<Value> = files.iter().map(sum).collect();
        document.insert("checksums".to_owned(), Value::Array(sums));
    }
    document.insert("edit".to_owned(), Value::Object(edit));
    if let Some(Value::Object(mut shown)) = project.remove("shown") {
        if let Some(name) = shown.remove("record") {
            project.insert("record".to_owned(), name);
        }
        if let Some(step) = shown.remove("step") {
            shown.insert("walk".to_owned(), json!({ "step": step }));
        }
        project.insert("shown".to_owned(), Value::Object(shown));
    }
    project.insert("document".to_owned(), Value::Object(document));
    Value::Object(project)
}
