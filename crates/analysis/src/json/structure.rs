//! The results of structures, whose base are modes.

use serde_json::{Map, Value, json};

use super::{VERSION, evidence, lasting, lasting_gap, mode, of_channel};
use sindyscope_core::study::Score;
use sindyscope_modes::{FoundForce, Quantity, Sensor, Site, Structure, StructureDiagnosis};
use sindyscope_report::modal::{force_rate, force_rate_terms, force_term, remaining};
use sindyscope_values::record::{RecordSet, Usage};

/// The result of `identify --base modes`; `fit` is how long it took, ms.
pub fn identified(found: &Structure, records: &RecordSet, fit: f64) -> Value {
    json!({
        "version": VERSION,
        "status": "ok",
        "settings": { "base": "modes" },
        "equations": equations(found, &[]),
        "outputs": outputs(found),
        "train": score(found.score(0, Usage::Fit), found, Usage::Fit),
        "test": score(found.score(0, Usage::HeldOut), found, Usage::HeldOut),
        "noise_floor": found.noise_floor,
        "elapsed_ms": { "fit": fit, "simulate": 0.0 },
        "order": found.order(),
        "modes": listed(found, true),
        "modes_outside_band": listed(found, false),
        "records": record_values(found),
        "warnings": [],
        "notices": records.notices(),
    })
}

/// The modes in the band that is driven, or those outside it.
fn listed(found: &Structure, inside: bool) -> Vec<Value> {
    found.modes.iter().zip(&found.in_band).filter(|(_, b)| **b == inside).map(|(m, _)| mode(m)).collect()
}

/// The modal equations: `q1`, its rate `p1` and so on; `forces[mode]` are terms besides, of effects.
fn equations(found: &Structure, forces: &[Vec<(String, f64)>]) -> Vec<Value> {
    let term = |term: String, coefficient: f64, std_error: Value| json!({ "term": term, "coefficient": coefficient, "std_error": std_error, "at_bound": false });
    let mut all = Vec::new();
    for (i, mode) in found.modes.iter().enumerate() {
        let (q, p) = (format!("q{}", i + 1), format!("p{}", i + 1));
        let omega = std::f64::consts::TAU * mode.frequency;
        all.push(json!({ "state": q, "terms": [term(p.clone(), 1.0, json!(0.0))] }));
        let relative = mode.frequency_error.map(|e| e / mode.frequency);
        let mut terms = vec![
            term(q, -omega * omega, json!(relative.map(|r| 2.0 * r * omega * omega))),
            term(p.clone(), -2.0 * mode.damping * omega, json!(mode.damping_error.map(|e| 2.0 * e * omega))),
        ];
        for (input, b) in found.inputs.iter().zip(&found.participation[i]) {
            terms.push(term(input.name.clone(), *b, Value::Null));
        }
        for (text, coefficient) in forces.get(i).into_iter().flatten() {
            terms.push(term(text.clone(), *coefficient, Value::Null));
        }
        all.push(json!({ "state": p, "terms": terms }));
    }
    all
}

/// What each sensor shows of the modes.
fn outputs(found: &Structure) -> Vec<Value> {
    let of = |(s, sensor): (usize, &Sensor)| {
        let symbol = match sensor.quantity {
            Quantity::Displacement => "q",
            Quantity::Velocity => "dq",
            Quantity::Acceleration => "ddq",
        };
        let terms = found.modes.iter().enumerate().map(|(i, mode)| {
            json!({
                "term": format!("{symbol}{}", i + 1),
                "coefficient": mode.shape[s] * if mode.phase[s] == 0.0 { 1.0 } else { mode.phase[s].cos() },
                "std_error": mode.shape_error[s],
            })
        });
        json!({ "channel": sensor.name, "unit": sensor.unit, "terms": terms.collect::<Vec<_>>() })
    };
    found.sensors.iter().enumerate().map(of).collect()
}

/// A score, with how long a free run predicts: a linear model at rest or swinging lasts the whole record.
fn score(score: Option<Score>, found: &Structure, usage: Usage) -> Value {
    let longest = found.records.iter().filter(|r| r.usage == usage).map(|r| r.samples as f64 * r.interval);
    lasting(score, longest.fold(0.0, f64::max))
}

fn record_values(found: &Structure) -> Vec<Value> {
    let of = |r: &sindyscope_modes::RecordFit| {
        let channels =
            found.sensors.iter().zip(&r.scores).map(|(sensor, s)| of_channel(&sensor.name, &sensor.unit, *s));
        json!({
            "name": r.name,
            "usage": if r.usage == Usage::Fit { "fit" } else { "held-out" },
            "fitted": r.usage == Usage::Fit,
            "samples": r.samples,
            "rate": r.interval.recip(),
            "rmse": r.scores.first().map(|s| s.rmse),
            "nrmse": r.scores.first().map(|s| s.nrmse),
            "channels": channels.collect::<Vec<_>>(),
        })
    };
    found.records.iter().map(of).collect()
}

/// The result of `diagnose --base modes`; `elapsed` is how long it took, ms.
pub fn diagnosed(found: &StructureDiagnosis, records: &RecordSet, elapsed: f64) -> Value {
    let forces = found.found.as_ref().map_or_else(Vec::new, |f| {
        let text = force_term(f.effect, f.site, &found.last.sensors);
        f.drives.iter().map(|d| vec![(text.clone(), *d)]).collect()
    });
    let mut last = equations(&found.last, &forces);
    let inner = found.found.iter().map(|f| force_rate_terms(f, &found.last.sensors)).find(|terms| !terms.is_empty());
    last.extend(inner.map(|terms| {
        let term = |(text, coefficient): (String, f64)| json!({ "term": text, "coefficient": coefficient, "std_error": null, "at_bound": false });
        json!({ "state": "z1", "terms": terms.into_iter().map(term).collect::<Vec<_>>() })
    }));
    json!({
        "version": VERSION,
        "verdict": found.verdict(),
        "explained": found.explained,
        "noise_floor": found.last.noise_floor,
        "base": { "equations": equations(&found.base, &[]), "outputs": outputs(&found.base), "gap": gap(&found.base) },
        "steps": found.found.iter().map(|f| step(f, found)).collect::<Vec<_>>(),
        "remaining": {
            "significant": !found.explained,
            "p_value": null,
            "note": remaining(found),
        },
        "final": { "equations": last, "outputs": outputs(&found.last), "gap": gap(&found.last) },
        "order": found.last.order(),
        "modes": listed(&found.last, true),
        "modes_outside_band": listed(&found.last, false),
        "records": record_values(&found.last),
        "elapsed_ms": elapsed,
        "description": null,
        "notices": records.notices(),
    })
}

fn gap(found: &Structure) -> Value {
    let longest = found.records.iter().map(|r| r.samples as f64 * r.interval).fold(0.0, f64::max);
    lasting_gap([Usage::Fit, Usage::HeldOut].map(|usage| found.score(0, usage)), longest)
}

fn step(force: &FoundForce, found: &StructureDiagnosis) -> Value {
    let text = force_term(force.effect, force.site, &found.last.sensors);
    let at = |site: Site| site.to_string();
    let mut indistinguishable: Vec<&str> = force.rivals.iter().map(|(e, _)| e.name()).collect();
    indistinguishable.sort_unstable();
    indistinguishable.dedup();
    json!({
        "effect": force.effect.name(),
        "form": "",
        "place": at(force.site),
        "title": force.effect.title(),
        "terms": [text],
        "inner_rate": force_rate(force.effect, force.site, &found.last.sensors),
        "equations": (0..force.drives.len()).map(|i| (format!("p{}", i + 1), json!([text]))).collect::<Map<_, _>>(),
        "where": format!("at {}, in every mode that moves it", at(force.site)),
        "parameters": force.parameters.iter().map(|p| json!({
            "name": p.name, "value": p.value, "std_error": p.std_error, "at_bound": false, "unit": p.unit,
        })).collect::<Vec<_>>(),
        "gap": gap(&found.last),
        "evidence": evidence(&force.lead),
        "alternatives": force.tried.iter().filter(|(e, s, _)| (*e, *s) != (force.effect, force.site)).map(|(e, s, error)| json!({
            "effect": e.name(), "place": at(*s), "title": e.title(), "test_nrmse": error,
        })).collect::<Vec<_>>(),
        "indistinguishable": indistinguishable,
        "indistinguishable_places": force.rivals.iter().map(|(e, s)| json!({
            "effect": e.name(), "place": at(*s), "title": e.title(),
        })).collect::<Vec<_>>(),
        "next_experiment": null,
    })
}
