//! What a table says of one record.

use serde_json::{Map, Value, json};

use crate::analyse::Analysis;
use sindyscope_core::study::Score;
use sindyscope_values::format::equations::is_kinematic;

/// Cells of a table by the names of their columns, in order.
pub type Row = Map<String, Value>;

/// The row of a study: `status`, `error`, errors in the first sensor's unit, settings that were chosen, and each coefficient with
/// its standard error (`v: x`, `v: x std_error`).
pub fn row(analysis: &Analysis) -> Row {
    let outcome = &analysis.outcome;
    let mut row = Row::new();
    let mut put = |name: &str, value: Value| row.insert(name.to_owned(), value);
    put("status", json!(if outcome.diverged() { "diverged" } else { "ok" }));
    put("error", Value::Null);
    let rmse = |score: Option<Score>| json!(score.map(|s| s.rmse));
    let nrmse = |score: Option<Score>| json!(score.map(|s| s.nrmse));
    put("train_rmse", rmse(outcome.train));
    put("train_nrmse", nrmse(outcome.train));
    put("test_rmse", rmse(outcome.test));
    put("test_nrmse", nrmse(outcome.test));
    put("noise_floor", json!(outcome.noise_floor));
    put("threshold", json!(outcome.settings.threshold));
    let layout = &outcome.model.layout;
    for (state, equation) in outcome.model.iter().filter(|(s, e)| !is_kinematic(&outcome.model, *s, e)) {
        for term in &equation.terms {
            let name = format!("{}: {}", layout.name(state), term.term.text(layout));
            put(&name, json!(term.coefficient));
            put(&format!("{name} std_error"), json!(term.std_error));
        }
    }
    row
}

/// The row of a search for missing effects, from its JSON: `verdict`, `effects` in the order in which they were added with their `places`,
/// what cannot be told from the last (`indistinguishable`), errors without and with them, and each parameter with its standard error
/// (`coulomb_friction: F_c`, `coulomb_friction: F_c std_error`).
pub fn diagnosis_row(result: &Value) -> Row {
    let mut row = Row::new();
    let mut put = |name: &str, value: Value| row.insert(name.to_owned(), value);
    put("status", json!("ok"));
    put("error", Value::Null);
    put("verdict", result["verdict"].clone());
    let steps: &[Value] = result["steps"].as_array().map_or(&[], Vec::as_slice);
    let listed = |values: &mut dyn Iterator<Item = &Value>| {
        json!(values.filter_map(Value::as_str).collect::<Vec<_>>().join(", "))
    };
    put("effects", listed(&mut steps.iter().map(|step| &step["effect"])));
    put("places", listed(&mut steps.iter().map(|step| &step["place"])));
    let last = steps.last().and_then(|step| step["indistinguishable"].as_array());
    put("indistinguishable", listed(&mut last.into_iter().flatten()));
    for (stage, prefix) in [("base", "base_"), ("final", "")] {
        for error in ["train_rmse", "train_nrmse", "test_rmse", "test_nrmse"] {
            put(&format!("{prefix}{error}"), result[stage]["gap"][error].clone());
        }
    }
    put("noise_floor", result["noise_floor"].clone());
    for step in steps {
        let effect = step["effect"].as_str().unwrap_or_default();
        for parameter in step["parameters"].as_array().into_iter().flatten() {
            let name = format!("{effect}: {}", parameter["name"].as_str().unwrap_or_default());
            put(&name, parameter["value"].clone());
            put(&format!("{name} std_error"), parameter["std_error"].clone());
        }
    }
    row
}

/// The row of a record that could not be used, with the sentence that says why.
pub fn failed(sentence: &str) -> Row {
    let line = sentence.lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; ");
    [("status".to_owned(), json!("failed")), ("error".to_owned(), json!(line))].into_iter().collect()
}
