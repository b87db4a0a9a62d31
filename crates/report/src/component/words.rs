//! What a search for what a component's force lacks came to, in words.

use sindyscope_component::{AddedEffect, ComponentDiagnosis, ComponentModel};
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::record::Usage;

/// An effect that was added, in lines: what it is, its values, why it stands, what it cannot be told from.
pub fn effect_lines(step: &AddedEffect) -> Vec<String> {
    let form = if step.form.is_empty() { String::new() } else { format!(" ({})", step.form) };
    let terms: Vec<String> = step.terms.iter().map(|t| t.summary(&step.model.layout)).collect();
    let mut lines =
        vec![format!("{}{form}: {}; NRMSE {} % with it.", step.title, terms.join(", "), error_share(&step.model))];
    for p in &step.parameters {
        let unit = if p.unit == "1" { "" } else { &p.unit };
        lines.push(format!("{} = {} {unit}", p.name, format_measured(p.value, p.std_error)).trim_end().to_owned());
    }
    let lead = &step.lead;
    let against = if lead.against == "nothing" { "the model without it" } else { &lead.against };
    lines.push(format!(
        "It leads {against} by {} in log predictive density on {} of {} blocks never fitted.",
        significant(lead.difference, 3),
        lead.won,
        lead.blocks
    ));
    lines.extend(step.rivals.iter().map(|rival| format!("These data do not tell it from: {}.", rival.title)));
    lines
}

/// Error on what was held out, else on what was fitted, in percent of the force.
pub fn error_share(model: &ComponentModel) -> String {
    let score = model.score(Usage::HeldOut).or_else(|| model.score(Usage::Fit));
    significant(100.0 * score.map_or(f64::NAN, |s| s.nrmse), 3)
}

/// The verdict in a sentence.
pub fn verdict(found: &ComponentDiagnosis) -> &'static str {
    match found.verdict() {
        "nothing_missing" => "Nothing is missing: spring, damper and inputs explain the force.",
        "unexplained" if found.steps.is_empty() => "Something is missing, and no effect of those tried explains it.",
        "unexplained" => "The best of those tried; what is left is more than the noise:",
        "ambiguous" => "Missing, and not told from others:",
        _ => "Missing:",
    }
}
