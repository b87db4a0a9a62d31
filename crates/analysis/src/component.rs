//! Components without a mass, as commands and scripts ask for them.

use serde_json::{Value, json};

use crate::error::AnalysisError;
use crate::json::{VERSION, evidence, lasting, lasting_gap, of_channel};
use crate::missing::MissingRequest;
use crate::request::{AnalysisRequest, Terms};
use crate::source::RecordSource;
use sindyscope_component::{
    AddedEffect, ComponentDiagnosis, ComponentModel, ForceSettings, IdentifiedForce, Specimen, TriedEffect,
};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::study::{Cancel, Lock};
use sindyscope_values::model::Equation;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Layout, Symbol, Term};

/// Settings that say how a component's force is regressed; no other can be given.
const TAKEN: [&str; 4] = ["terms", "lock", "threshold", "ridge"];

/// A component whose force was regressed.
#[derive(Clone, Debug)]
pub struct ComponentAnalysis {
    /// The component as it was measured.
    pub specimen: Specimen,
    /// What was found.
    pub found: IdentifiedForce,
    /// What the file reader has to say.
    pub notices: Vec<String>,
    /// Time of the work, ms.
    pub elapsed: f64,
}

/// A component and the effects that its force was found to lack.
#[derive(Clone, Debug)]
pub struct DiagnosedComponent {
    /// The component as it was measured.
    pub specimen: Specimen,
    /// What was found.
    pub found: ComponentDiagnosis,
    /// What the file reader has to say.
    pub notices: Vec<String>,
    /// Time of the work, ms.
    pub elapsed: f64,
}

fn specimen(source: &RecordSource, records: &RecordSet, cancel: &Cancel) -> Result<Specimen, AnalysisError> {
    Ok(Specimen::new(records, source.reading.columns.force(), cancel)?)
}

fn notices(records: &RecordSet) -> Vec<String> {
    let all = records.notices();
    all.into_iter().map(str::to_owned).collect()
}

/// Identifies the force of prepared records.
///
/// # Errors
/// Settings that components do not have, records that are no component's, cancelled.
pub fn identify_component(
    request: &AnalysisRequest,
    records: &RecordSet,
    cancel: &Cancel,
) -> Result<ComponentAnalysis, AnalysisError> {
    use sindyscope_core::study::{SETTINGS, Settings};
    if let Some(other) = SETTINGS.iter().map(|s| s.name).find(|n| request.given.has(n) && !TAKEN.contains(n)) {
        let taken = TAKEN.join(", ");
        return Err(AnalysisError::Settings(format!("{other} says nothing of a component's force; {taken} do")));
    }
    let mut given = Settings::default();
    request.given.apply(&mut given).map_err(AnalysisError::Settings)?;
    if !given.own.is_empty() {
        return Err(AnalysisError::ListForEach);
    }
    let settings = ForceSettings {
        terms: request.given.has("terms").then(|| given.terms.clone()),
        locks: given.locks.iter().filter(|(_, lock)| **lock == Lock::In).map(|(t, _)| t.clone()).collect(),
        threshold: request.given.has("threshold").then_some(given.threshold),
        ridge: given.ridge,
    };
    let specimen = specimen(&request.source, records, cancel)?;
    let watch = Stopwatch::start();
    let found = sindyscope_component::identify(&specimen, &settings, cancel)?;
    Ok(ComponentAnalysis { specimen, found, notices: notices(records), elapsed: watch.milliseconds() })
}

/// Searches for what the force of prepared records lacks; `tell` is told what is being done and the share that is done.
///
/// # Errors
/// A base that cannot be used, records that are no component's, cancelled.
pub fn diagnose_component(
    source: &RecordSource,
    request: &MissingRequest,
    records: &RecordSet,
    tell: &dyn Fn(&'static str, f64),
    cancel: &Cancel,
) -> Result<DiagnosedComponent, AnalysisError> {
    let specimen = specimen(source, records, cancel)?;
    let mut base = request.base.as_ref().map(Terms::for_all).transpose()?;
    for known in &request.known {
        let base = base.get_or_insert_with(|| sindyscope_component::base_terms(&specimen));
        base.extend(known.for_all()?.into_iter().filter(|t| !base.contains(t)).collect::<Vec<_>>());
    }
    let most = usize::from(request.max_effects);
    let watch = Stopwatch::start();
    let found = sindyscope_component::diagnose(&specimen, base.as_deref(), most, tell, cancel)?;
    Ok(DiagnosedComponent { specimen, found, notices: notices(records), elapsed: watch.milliseconds() })
}

impl ComponentAnalysis {
    /// The result as JSON.
    pub fn json(&self) -> Value {
        let Self { specimen, found, notices, elapsed } = self;
        let model = &found.model;
        json!({
            "version": VERSION,
            "status": "ok",
            "settings": {
                "kind": "component",
                "window": null,
                "order": null,
                "threshold": found.threshold,
                "ridge": found.ridge,
                "terms": texts(&found.terms, &model.layout),
            },
            "equations": equations(model),
            "train": score(model, Usage::Fit),
            "test": score(model, Usage::HeldOut),
            "noise_floor": found.noise_floor,
            "elapsed_ms": { "fit": elapsed, "simulate": 0.0 },
            "records": records(model, specimen),
            "warnings": [],
            "notices": notices,
        })
    }
}

impl DiagnosedComponent {
    /// The result as JSON.
    pub fn json(&self) -> Value {
        let Self { specimen, found, notices, elapsed } = self;
        json!({
            "version": VERSION,
            "verdict": found.verdict(),
            "explained": found.explained(),
            "noise_floor": found.noise_floor,
            "base": { "equations": equations(&found.base), "gap": gap(&found.base) },
            "steps": found.steps.iter().map(step).collect::<Vec<_>>(),
            "remaining": { "significant": !found.explained(), "p_value": null, "note": self.remaining() },
            "final": { "equations": equations(found.last()), "gap": gap(found.last()) },
            "records": records(found.last(), specimen),
            "elapsed_ms": elapsed,
            "description": null,
            "notices": notices,
        })
    }

    /// What is left, in words.
    pub fn remaining(&self) -> String {
        use sindyscope_values::format::number::significant;
        let (share, noises) = (significant(100.0 * self.found.left, 3), significant(self.found.noises, 3));
        let left = format!("what is left on data never fitted is {share} % of the force, {noises} times the noise");
        if self.found.explained() { left } else { format!("{left}: something else may act") }
    }
}

fn texts(terms: &[Term], layout: &Layout) -> Vec<String> {
    terms.iter().map(|t| t.text(layout)).collect()
}

fn equations(model: &ComponentModel) -> Vec<Value> {
    let of = |state: &str, equation: &Equation| {
        let terms = equation.terms.iter().map(|t| {
            json!({
                "term": t.term.text(&model.layout),
                "coefficient": t.coefficient,
                "unit": if state == "F" { model.unit(&t.term) } else { None },
                "std_error": t.std_error,
                "at_bound": false,
                "share": t.share,
            })
        });
        json!({ "state": state, "terms": terms.collect::<Vec<_>>() })
    };
    let mut all = vec![of("F", &model.force)];
    for (k, equation) in model.internals.iter().enumerate() {
        all.push(of(&model.layout.name(Symbol::Internal(k)), equation));
    }
    all
}

/// The longest record of a usage, s: along a given motion a prediction lasts.
fn longest(model: &ComponentModel, usage: Usage) -> f64 {
    let records = model.records.iter().filter(|r| r.usage == usage);
    records.map(|r| r.samples as f64 * r.interval).fold(0.0, f64::max)
}

fn score(model: &ComponentModel, usage: Usage) -> Value {
    lasting(model.score(usage), longest(model, usage))
}

fn gap(model: &ComponentModel) -> Value {
    lasting_gap([Usage::Fit, Usage::HeldOut].map(|usage| model.score(usage)), longest(model, Usage::Fit))
}

fn records(model: &ComponentModel, specimen: &Specimen) -> Vec<Value> {
    let (name, unit) = specimen.force();
    let of = |r: &sindyscope_component::ForceFit| {
        json!({
            "name": r.name,
            "usage": if r.usage == Usage::Fit { "fit" } else { "held-out" },
            "fitted": r.usage == Usage::Fit,
            "samples": r.samples,
            "rate": r.interval.recip(),
            "rmse": r.score.rmse,
            "nrmse": r.score.nrmse,
            "energy": { "measured": r.energy[0], "identified": r.energy[1] },
            "channels": [of_channel(name, unit, r.score)],
        })
    };
    model.records.iter().map(of).collect()
}

fn tried(effect: &TriedEffect) -> Value {
    json!({ "effect": effect.effect, "title": effect.title, "test_nrmse": effect.unseen, "behind": effect.behind })
}

fn step(step: &AddedEffect) -> Value {
    let terms = texts(&step.terms, &step.model.layout);
    json!({
        "effect": step.effect,
        "form": step.form,
        "place": null,
        "title": step.title,
        "terms": terms,
        "equations": { "F": terms },
        "where": "in the force along the given motion",
        "parameters": step.parameters.iter().map(|p| json!({
            "name": p.name, "value": p.value, "std_error": p.std_error, "at_bound": p.at_bound, "unit": p.unit,
        })).collect::<Vec<_>>(),
        "gap": gap(&step.model),
        "evidence": evidence(&step.lead),
        "alternatives": step.others.iter().chain(&step.rivals).map(tried).collect::<Vec<_>>(),
        "indistinguishable": step.rivals.iter().map(|r| r.effect).collect::<Vec<_>>(),
        "next_experiment": null,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sindyscope_rig::{ComponentOptions, component_records};

    fn records() -> RecordSet {
        let options = ComponentOptions {
            seed: 3,
            effect: Some("input_dependent_friction".into()),
            ..ComponentOptions::default()
        };
        let (made, _) = component_records(&options).unwrap();
        let mut records = RecordSet::new(made[..1].iter().cloned(), Usage::Fit);
        records.add(made[1..].iter().cloned(), Usage::HeldOut);
        records
    }

    #[test]
    fn a_components_force_is_told_as_scripts_rely_on() {
        let request = AnalysisRequest::named([("terms", "1, x, v, sgn(v), u*sgn(v)"), ("threshold", "0.001")]).unwrap();
        let found = identify_component(&request, &records(), &Cancel::default()).unwrap().json();
        assert_eq!(found["equations"][0]["state"], "F");
        assert_eq!(found["equations"][0]["terms"][1]["unit"], "N/m");
        assert_eq!(found["records"][0]["channels"][0]["name"], "force");
        for part in ["train", "test"] {
            assert!(found[part]["nrmse"].as_f64().unwrap() < 0.05, "{part}");
        }
        let known = MissingRequest { known: Vec::new(), ..MissingRequest::default() };
        let found = diagnose_component(&RecordSource::default(), &known, &records(), &|_, _| {}, &Cancel::default());
        let found = found.unwrap().json();
        assert_eq!(
            (&found["verdict"], &found["steps"][0]["effect"]),
            (&json!("named"), &json!("input_dependent_friction"))
        );
        assert_eq!(found["steps"][0]["parameters"][1]["unit"], "N/V");
        assert!(found["steps"][0]["evidence"]["quantile"].as_f64().unwrap() > 0.0);
        assert!(found["final"]["gap"]["test_rmse"].as_f64() < found["base"]["gap"]["test_rmse"].as_f64());
    }

    #[test]
    fn what_is_no_component_is_refused() {
        let refused = |settings: &[(&str, &str)], records: &RecordSet| {
            let request = AnalysisRequest::named(settings.iter().copied()).unwrap();
            identify_component(&request, records, &Cancel::default()).unwrap_err().to_string()
        };
        assert!(refused(&[("window", "31")], &records()).starts_with("window says nothing of a component's force"));
        assert!(refused(&[("terms", "x, x2")], &records()).contains("x2"));
        let mut still = records();
        for (record, _) in &mut still.entries {
            let record = std::sync::Arc::make_mut(record);
            record.channels.retain(|c| !matches!(c.role, sindyscope_values::record::Role::Input(_)));
        }
        assert!(refused(&[], &still).ends_with("has no force"));
    }
}
