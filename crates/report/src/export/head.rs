//! What stands at the top of every exported program: what it is, its equations, units, and how to run it.

use super::Export;
use super::switched::Switched;
use sindyscope_values::format::equations;
use sindyscope_values::term::{Expression, Symbol, Term};

impl Export<'_> {
    /// The lines at the top of a program, without comment signs; `usage` says how to run it.
    pub(super) fn head(&self, switched: &Switched, usage: &[String]) -> Vec<String> {
        let what = if self.space.is_some() { "State space of a structure" } else { "Equations of motion" };
        let mut lines = vec![format!(
            "{what} identified by Sindyscope, and {} response to sampled inputs.",
            if self.space.is_some() { "its" } else { "their" }
        )];
        lines.extend(self.description(switched));
        lines.push("The numbers above are rounded to their standard errors; those in the program are not.".into());
        lines.extend(self.initial_states("Initial states (the program starts from the first):"));
        lines.push(String::new());
        lines.extend(usage.iter().cloned());
        lines
    }

    /// The equations, the units, and what sticks.
    pub(super) fn description(&self, switched: &Switched) -> Vec<String> {
        if let Some(space) = self.space {
            return space.description(switched);
        }
        let mut lines = vec![String::new()];
        lines.extend(equations::text(self.model, Some(&self.units)).lines().map(str::to_owned));
        lines.push(String::new());
        lines.push(format!("Units: {}.", self.unit_list()));
        lines.extend(self.sticking(switched));
        lines
    }

    /// The state that each record's response begins with, under a heading; nothing where there is none.
    pub(super) fn initial_states(&self, heading: &str) -> Vec<String> {
        let names = self.state_names();
        let each = self.starts.iter().map(|start| {
            let state: Vec<String> = names.iter().zip(&start.state).map(|(n, x)| format!("{n} = {x:?}")).collect();
            format!("  {}: {}", start.record, state.join(", "))
        });
        let lines: Vec<String> = each.collect();
        if lines.is_empty() { lines } else { [vec![String::new(), heading.to_owned()], lines].concat() }
    }

    /// Each quantity with its unit.
    pub(super) fn unit_list(&self) -> String {
        let layout = &self.model.layout;
        let inputs = (0..layout.inputs).map(Symbol::Input);
        let quantities = layout.state_symbols().chain(inputs);
        let each = quantities.map(|s| match self.units.of_symbol(s) {
            Some(unit) => format!("{} in {unit}", layout.name(s)),
            None => format!("{} (unit not known)", layout.name(s)),
        });
        std::iter::once("time t in s".to_owned()).chain(each).collect::<Vec<_>>().join(", ")
    }

    /// How the signs that may stick behave.
    pub(super) fn sticking(&self, switched: &Switched) -> Option<String> {
        let name = |e: &Expression| Term::new(e.clone()).summary(&switched.layout);
        let sliding: Vec<String> =
            switched.surfaces.iter().filter(|s| s.slides).map(|s| format!("sgn({})", name(&s.expression))).collect();
        if sliding.is_empty() {
            return None;
        }
        Some(format!(
            "Sticking: where its argument stays at zero, {} takes the value that keeps it there, up to a magnitude of {:?}.",
            sliding.join(", "),
            switched.hold
        ))
    }
}

/// Lines as comments; what could end a comment early is taken out.
pub(super) fn comment(sign: &str, lines: &[String]) -> String {
    let mut out = String::new();
    for line in lines {
        let line: String = line.chars().map(|c| if c.is_control() || c == '\\' { ' ' } else { c }).collect();
        out.push_str(format!("{sign} {line}").trim_end());
        out.push('\n');
    }
    out
}
