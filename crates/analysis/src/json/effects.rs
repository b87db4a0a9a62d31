//! The catalogue of effects as JSON.

use serde_json::{Map, Value, json};

use super::VERSION;
use sindyscope_search::{Entry, EntryForm};

/// Entries of the catalogue of effects.
pub fn effects(entries: &[Entry]) -> Value {
    json!({ "version": VERSION, "effects": entries.iter().map(entry).collect::<Vec<_>>() })
}

fn entry(entry: &Entry) -> Value {
    json!({
        "effect": entry.effect,
        "title": entry.title,
        "family": entry.family,
        "explanation": entry.explanation,
        "formula": entry.formula,
        "axis": entry.axis,
        "parameters": entry.parameters.iter().map(|p| json!({
            "name": p.name,
            "unit": p.unit,
            "positive": p.positive,
            "inner": p.inner,
        })).collect::<Vec<_>>(),
        "forms": entry.forms.iter().map(form).collect::<Vec<_>>(),
        "contains": entry.contains,
        "contained_in": entry.contained_in,
        "shifts_the_zero_as": entry.shifts_the_zero_as,
        "separates": entry.separates,
    })
}

fn form(form: &EntryForm) -> Value {
    let example: Map<String, Value> = form.example.iter().map(|(n, v)| ((*n).to_owned(), json!(v))).collect();
    let states: Map<String, Value> = form
        .states
        .iter()
        .map(|(state, terms)| {
            let terms: Vec<Value> = terms.iter().map(|(t, c)| json!({ "term": t, "coefficient": c })).collect();
            (state.clone(), Value::Array(terms))
        })
        .collect();
    json!({
        "form": form.form,
        "place": form.place,
        "example": example,
        "terms": form.terms,
        "states": states,
        "replaces": form.replaces,
    })
}
