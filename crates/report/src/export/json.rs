//! The model as JSON.

use serde_json::{Value, json};

use super::{Export, FormatEntry};
use sindyscope_values::term::{Kind, Symbol};

/// Version of the fields below.
const VERSION: u32 = 1;

pub(super) const FORMAT: FormatEntry =
    FormatEntry { ending: "json", name: "JSON", runs: false, switches: true, write: |export, _, _| document(export) };

/// Equations, units and initial states; a number that does not exist is `null`.
fn document(export: &Export<'_>) -> String {
    if let Some(space) = export.space {
        return space.json_document();
    }
    let Export { model, units, starts, .. } = export;
    let layout = &model.layout;
    let equations = model.iter().map(|(state, equation)| {
        let terms = equation.terms.iter().map(|t| {
            json!({
                "term": t.term.text(layout),
                "coefficient": t.coefficient,
                "std_error": t.std_error,
                "unit": units.coefficient(state, &t.term),
            })
        });
        json!({ "state": layout.name(state), "terms": terms.collect::<Vec<_>>() })
    });
    let quantity = |s: Symbol| json!({ "name": layout.name(s), "unit": units.of_symbol(s) });
    let starts = starts.iter().map(|s| json!({ "record": s.record, "state": s.state }));
    let value: Value = json!({
        "version": VERSION,
        "kind": match layout.kind {
            Kind::SecondOrder => "second-order",
            Kind::FirstOrder => "first-order",
        },
        "states": layout.state_symbols().map(quantity).collect::<Vec<_>>(),
        "inputs": (0..layout.inputs).map(Symbol::Input).map(quantity).collect::<Vec<_>>(),
        "equations": equations.collect::<Vec<_>>(),
        "static_ratio": model.static_ratio,
        "initial_states": starts.collect::<Vec<_>>(),
    });
    format!("{value:#}\n")
}
