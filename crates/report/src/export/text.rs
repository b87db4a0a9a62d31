//! The model as plain text.

use super::switched::Switched;
use super::{Export, FormatEntry};

pub(super) const FORMAT: FormatEntry = FormatEntry {
    ending: "txt",
    name: "text",
    runs: false,
    switches: true,
    write: |export, switched, _| document(export, switched),
};

/// The equations with errors and units, then every coefficient in full.
fn document(export: &Export<'_>, switched: &Switched) -> String {
    if let Some(space) = export.space {
        return space.text_document(switched);
    }
    let layout = &export.model.layout;
    let mut lines = vec!["Equations of motion identified by Sindyscope.".to_owned()];
    lines.extend(export.description(switched));
    lines.push(String::new());
    lines.push("Coefficients in full:".into());
    for (state, equation) in export.model.iter() {
        for t in &equation.terms {
            lines.push(format!("  d{}/dt  {:?}  {}", layout.name(state), t.coefficient, t.term.text(layout)));
        }
    }
    lines.extend(export.initial_states("Initial states:"));
    lines.join("\n") + "\n"
}
