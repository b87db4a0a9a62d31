//! The state space as plain text, as JSON and as LaTeX.

use nalgebra::DMatrix;
use serde_json::{Value, json};

use super::super::latex::{escaped, unit};
use super::super::switched::{Switched, literal};
use super::StateSpace;
use crate::modal::{force_rate, force_term};
use sindyscope_modes::{Quantity, Sensor};
use sindyscope_values::term::latex_number;

/// Version of the fields of the JSON.
const VERSION: u32 = 1;

impl StateSpace<'_> {
    /// Modes, meaning and every number in full.
    pub(in super::super) fn text_document(&self, switched: &Switched) -> String {
        let mut lines = vec!["State space of a structure identified by Sindyscope.".to_owned()];
        lines.extend(self.description(switched));
        for (name, matrix) in self.matrices() {
            lines.push(String::new());
            lines.push(format!("{name} ({} x {}):", matrix.nrows(), matrix.ncols()));
            lines.extend((0..matrix.nrows()).map(|r| {
                let row: Vec<String> = matrix.row(r).iter().map(|v| literal(*v)).collect();
                format!("  {}", row.join("  "))
            }));
        }
        let names = self.state_names();
        for start in self.starts() {
            let state: Vec<String> = names.iter().zip(&start.state).map(|(n, x)| format!("{n} = {x:?}")).collect();
            lines.push(String::new());
            lines.push(format!("Initial state of {}: {}", start.record, state.join(", ")));
        }
        lines.join("\n") + "\n"
    }

    /// A, B, C, D, then G, H and the offsets as columns; without those that have no column.
    fn matrices(&self) -> Vec<(&'static str, DMatrix<f64>)> {
        let column = |values: &[f64]| DMatrix::from_column_slice(values.len(), 1, values);
        let mut all = vec![("A", self.a.clone()), ("B", self.b.clone()), ("C", self.c.clone()), ("D", self.d.clone())];
        if let Some(force) = &self.force {
            all.push(("G", column(&force.on_rates)));
            all.push(("H", column(&force.on_outputs)));
        }
        if let Some(inner) = self.on_inner() {
            all.push(("E", column(&inner)));
        }
        all.push(("offset", column(&self.offsets)));
        all.retain(|(_, matrix)| matrix.ncols() > 0);
        all
    }

    /// The same as data.
    pub(in super::super) fn json_document(&self) -> String {
        let rows = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
            (0..matrix.nrows()).map(|r| matrix.row(r).iter().copied().collect()).collect()
        };
        let quantity = |s: &Sensor| match s.quantity {
            Quantity::Displacement => "displacement",
            Quantity::Velocity => "velocity",
            Quantity::Acceleration => "acceleration",
        };
        let names = self.state_names();
        let m = self.structure.modes.len();
        let states = names.iter().enumerate().map(|(i, name)| {
            if self.inner_state() == Some(i) {
                return json!({ "name": name, "unit": self.unit_of_inner(), "mode": null });
            }
            let unit = self.unit_of_mode(i % m);
            let unit = if i < m { unit } else { format!("{unit}/s") };
            json!({ "name": name, "unit": unit, "mode": i % m + 1 })
        });
        let modes = self.structure.modes.iter().zip(&self.structure.in_band).map(|(mode, in_band)| {
            json!({
                "frequency": mode.frequency, "std_error": mode.frequency_error,
                "damping": mode.damping, "damping_error": mode.damping_error, "in_band": in_band,
            })
        });
        let force = self.force.as_ref().map(|force| {
            json!({
                "effect": force.effect.name(),
                "place": force.site.to_string(),
                "term": force_term(force.effect, force.site, &self.structure.sensors),
                "of": if force.effect.is_of_velocity() { "velocity" } else { "displacement" },
                "across": force.across,
                "parameters": force.parameters.iter().map(|p| json!({
                    "name": p.name, "value": p.value, "std_error": p.std_error, "unit": p.unit,
                })).collect::<Vec<_>>(),
                "G": force.on_rates,
                "H": force.on_outputs,
                "E": self.on_inner(),
                "inner_rate": force_rate(force.effect, force.site, &self.structure.sensors),
            })
        });
        let named = |name: &str, unit: &str| json!({ "name": name, "unit": unit });
        let value: Value = json!({
            "version": VERSION,
            "kind": "state-space",
            "coordinates": "modal",
            "states": states.collect::<Vec<_>>(),
            "inputs": self.structure.inputs.iter().map(|u| named(&u.name, &u.unit)).collect::<Vec<_>>(),
            "outputs": self.structure.sensors.iter().map(|s| json!({
                "name": s.name, "unit": s.unit, "quantity": quantity(s),
            })).collect::<Vec<_>>(),
            "A": rows(&self.a), "B": rows(&self.b), "C": rows(&self.c), "D": rows(&self.d),
            "force": force,
            "offset": self.offsets,
            "modes": modes.collect::<Vec<_>>(),
            "initial_states": self.starts().iter().map(|s| json!({ "record": s.record, "state": s.state })).collect::<Vec<_>>(),
        });
        format!("{value:#}\n")
    }

    /// The same as a small LaTeX document.
    pub(in super::super) fn latex_document(&self, switched: &Switched) -> String {
        let mut out = String::from(
            "\\documentclass{article}\n\\usepackage[T1]{fontenc}\n\\usepackage[utf8]{inputenc}\n\\usepackage{amsmath}\n\
             \\setcounter{MaxMatrixCols}{80}\n\\begin{document}\n\n\
             % State space of a structure identified by Sindyscope; pdflatex makes a page of this file.\n",
        );
        let (input, feed) = if self.structure.inputs.is_empty() { ("", "") } else { (" + B u", " + D u") };
        let (force, through) = match (&self.force, self.inner_state()) {
            (None, _) => ("", ""),
            (Some(_), None) => (" + G f", " + H f"),
            (Some(_), Some(_)) => (" + G f + E g", " + H f"),
        };
        out.push_str(&format!(
            "\\begin{{align*}}\n\\dot X &= A X{input}{force}, & y &= C X{feed}{through} + y_0\n\\end{{align*}}\n\n"
        ));
        for line in self.description(switched).iter().skip(3).take_while(|l| !l.starts_with("mode")) {
            if !line.is_empty() {
                out.push_str(&format!("\\noindent {}\n\n", escaped(line)));
            }
        }
        out.push_str("\\begin{center}\n\\begin{tabular}{rrrl}\nmode & frequency, Hz & damping ratio & unit of $q$ \\\\ \\hline\n");
        let number = |x: f64| format!("${}$", latex_number(&literal(x)));
        let with_error = |x: f64, error: Option<f64>| match error {
            Some(e) if e.is_finite() => format!("{} $\\pm$ {}", number(x), number(e)),
            _ => number(x),
        };
        for (i, mode) in self.structure.modes.iter().enumerate() {
            out.push_str(&format!(
                "{} & {} & {} & {} \\\\\n",
                i + 1,
                with_error(mode.frequency, mode.frequency_error),
                with_error(mode.damping, mode.damping_error),
                unit(&self.unit_of_mode(i))
            ));
        }
        out.push_str("\\end{tabular}\n\\end{center}\n\n");
        if let Some(force) = &self.force {
            for line in self.force_words(force) {
                out.push_str(&format!("\\noindent {}\n\n", escaped(line.trim())));
            }
        }
        out.push_str("{\\footnotesize\n");
        for (name, matrix) in self.matrices() {
            let name = if name == "offset" { "y_0" } else { name };
            let row =
                |r: usize| matrix.row(r).iter().map(|v| latex_number(&literal(*v))).collect::<Vec<_>>().join(" & ");
            let rows: Vec<String> = (0..matrix.nrows()).map(row).collect();
            out.push_str(&format!("\\[ {name} = \\begin{{bmatrix}}\n{}\n\\end{{bmatrix}} \\]\n", rows.join(" \\\\\n")));
        }
        out.push_str("}\n\n\\end{document}\n");
        out
    }
}
