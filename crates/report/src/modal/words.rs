//! What a search for a structure's missing force came to, in words.

use sindyscope_modes::{Effect, FoundForce, PoleCluster, Sensor, Site, Structure, StructureDiagnosis};
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::Usage;

/// A force as a term of the equations, by the names of its sensors.
pub fn force_term(effect: Effect, site: Site, sensors: &[Sensor]) -> String {
    let across = |letter: &str| across(letter, site, sensors);
    match effect {
        Effect::CubicStiffness => format!("{}^3", across("x")),
        Effect::CoulombFriction => format!("sgn({})", across("v").trim_matches(['(', ')'])),
        Effect::Clearance => format!("clearance({})", across("x").trim_matches(['(', ')'])),
        Effect::QuadraticDamping => format!("{v}*abs({v})", v = across("v")),
        Effect::QuadraticStiffness => format!("{}^2", across("x")),
        Effect::BoucWenHysteresis => "z1".to_owned(),
    }
}

/// The rate of a force's inner state by the names of its sensors and parameters; none where it has none.
pub fn force_rate(effect: Effect, site: Site, sensors: &[Sensor]) -> Option<String> {
    let v = across("v", site, sensors);
    effect.has_memory().then(|| format!("{v} - (abs({v})*z1 + gamma/beta*{v}*abs(z1))/x_b"))
}

/// The same as terms with their coefficients.
pub fn force_rate_terms(force: &FoundForce, sensors: &[Sensor]) -> Vec<(String, f64)> {
    if !force.effect.has_memory() {
        return Vec::new();
    }
    let value = |name: &str| force.parameters.iter().find(|p| p.name == name).map_or(0.0, |p| p.value);
    let (v, yields) = (across("v", force.site, sensors), value("x_b"));
    vec![
        (v.clone(), 1.0),
        (format!("abs({v})*z1"), -1.0 / yields),
        (format!("{v}*abs(z1)"), -value("gamma/beta") / yields),
    ]
}

/// Displacement `x` or velocity `v` across a site.
fn across(letter: &str, site: Site, sensors: &[Sensor]) -> String {
    let several = sensors.iter().any(|s| s.place() > 0);
    let symbol = |place: usize| if several { format!("{letter}{}", place + 1) } else { letter.to_owned() };
    match site {
        Site::Ground(i) => symbol(i),
        Site::Between(i, j) => format!("({}-{})", symbol(i), symbol(j)),
    }
}

/// What is left once all is found, as a part of a sentence.
pub fn remaining(found: &StructureDiagnosis) -> String {
    let noises = significant(found.noises, 3);
    if found.explained && found.noises < 1.0 {
        "what is left on data never fitted is no more than the noise, or half a per cent of the motion".to_owned()
    } else if found.explained {
        format!("what is left on data never fitted is {noises} times the noise")
    } else {
        format!(
            "what is left on data never fitted is {noises} times the noise: something else may act, or the noise grows with the motion"
        )
    }
}

/// The verdict in one sentence.
pub fn verdict(found: &StructureDiagnosis) -> &'static str {
    match (found.verdict(), &found.found) {
        ("nothing_missing", _) => "Nothing is missing: the linear model explains the data.",
        ("named", _) => "A force is missing, and these data name it.",
        ("ambiguous", _) => "A force is missing, and these data do not tell which.",
        (_, Some(_)) => "The best of the forces tried; what is left is more than the noise.",
        (_, None) => "Something is missing, and no force of those tried explains it.",
    }
}

/// What the search came to, a sentence each: the linear model's error, then the force with its values and why it stands.
pub fn diagnosis_lines(found: &StructureDiagnosis) -> Vec<String> {
    let error = |s: &Structure| s.score(0, Usage::HeldOut).or_else(|| s.score(0, Usage::Fit));
    let mut lines = Vec::new();
    if let (Some(score), Some(sensor)) = (error(&found.base), found.base.sensors.first()) {
        lines.push(format!("Linear modes alone: NRMSE {} % of {}.", significant(100.0 * score.nrmse, 3), sensor.name));
    }
    let Some(force) = &found.found else {
        lines.push(verdict(found).to_owned());
        return lines;
    };
    let with = error(&found.last).map(|s| format!(", NRMSE {} % with it", significant(100.0 * s.nrmse, 3)));
    let term = force_term(force.effect, force.site, &found.last.sensors);
    lines.push(format!("{} at {}: {term}{}.", force.effect.title(), force.site, with.unwrap_or_default()));
    for p in &force.parameters {
        let line = format!("{} = {} {}", p.name, format_measured(p.value, p.std_error), p.unit);
        lines.push(line.trim_end().to_owned());
    }
    if let Some(rate) = force_rate(force.effect, force.site, &found.last.sensors) {
        lines.push(format!("dz1/dt = {rate}"));
    }
    lines.push(format!(
        "It leads {} by {} in log predictive density on {} of {} blocks never fitted.",
        if force.lead.against == "none" { "the linear model" } else { &force.lead.against },
        significant(force.lead.difference, 3),
        force.lead.won,
        force.lead.blocks
    ));
    lines.extend(
        force
            .rivals
            .iter()
            .map(|(effect, site)| format!("These data do not tell it from: {} at {site}.", effect.title())),
    );
    lines
}

/// The modes as a table, then the errors of every sensor: what a terminal shows.
pub fn modes_text(found: &Structure) -> String {
    let mut out = String::from("Mode  Frequency [Hz]        Damping ratio [%]     Shape");
    let names: Vec<&str> = found.sensors.iter().map(|s| s.name.as_str()).collect();
    out.push_str(&format!(" ({})\n", names.join(", ")));
    for (i, (mode, _)) in found.modes.iter().zip(&found.in_band).filter(|(_, inside)| **inside).enumerate() {
        let frequency = format_measured(mode.frequency, mode.frequency_error);
        let damping = format_measured(100.0 * mode.damping, mode.damping_error.map(|e| 100.0 * e));
        let entry = |s: usize| {
            let turned = mode.phase[s].to_degrees();
            let phase = if turned.abs() < 1.0 { String::new() } else { format!(" ∠{turned:.0}°") };
            format!("{}{phase}", significant(mode.shape[s], 3))
        };
        let shape: Vec<String> = (0..mode.shape.len()).map(entry).collect();
        out.push_str(&format!("{:>4}  {frequency:<20}  {damping:<20}  {}\n", i + 1, shape.join(", ")));
    }
    let outside = found.modes.iter().zip(&found.in_band).filter(|(_, inside)| !**inside);
    let outside: Vec<String> = outside.map(|(m, _)| significant(m.frequency, 3)).collect();
    if !outside.is_empty() {
        out.push_str(&format!(
            "Outside the band that is driven the model has poles at {} Hz: they stand for what lies beyond it and for drifts.\n",
            outside.join(", ")
        ));
    }
    out.push_str(&format!("Order: {} states.\n", found.order()));
    for (usage, what) in [(Usage::Fit, "Fitted"), (Usage::HeldOut, "Held out")] {
        for (s, sensor) in found.sensors.iter().enumerate() {
            if let Some(score) = found.score(s, usage) {
                out.push_str(&format!(
                    "{what}: {} RMSE {}, NRMSE {} %.\n",
                    sensor.name,
                    format_si(score.rmse, &sensor.unit, 3),
                    significant(100.0 * score.nrmse, 3)
                ));
            }
        }
    }
    out
}

/// What a search came to, then the modes of the linear part: what a terminal shows.
pub fn diagnosis_text(found: &StructureDiagnosis) -> String {
    let mut out = String::new();
    for (k, line) in diagnosis_lines(found).iter().enumerate() {
        // What belongs to the force stands beneath it.
        let indent = if found.found.is_some() && k > 1 { "  " } else { "" };
        out.push_str(&format!("{indent}{line}\n"));
    }
    out.push_str(&format!("Remaining: {}.\n\nModes of the linear part:\n", remaining(found)));
    out.push_str(&modes_text(&found.last));
    out
}

/// A cluster of stable poles in one sentence: how many, over which orders, mean and spread of frequency and damping ratio.
pub fn cluster_words(cluster: &PoleCluster) -> String {
    let PoleCluster { members, orders, frequency, damping, .. } = cluster;
    format!(
        "Cluster of {} stable poles of orders {} to {}: {} Hz, damping {} % (mean and spread)",
        members.len(),
        orders.0,
        orders.1,
        format_measured(frequency.0, Some(frequency.1)),
        format_measured(100.0 * damping.0, Some(100.0 * damping.1)),
    )
}
