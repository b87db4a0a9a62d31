//! What a search for missing effects found, as JSON.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::VERSION;
use super::identified::equations;
use sindyscope_search::{
    Candidate, Curve, Diagnosis, Finding, FreeRun, Gap, Lead, Parameter, RecordScore, Round, Step,
};
use sindyscope_values::model::{Model, Units};
use sindyscope_values::record::RecordSet;

/// The result of `diagnose`.
pub fn diagnosed(diagnosis: &Diagnosis, records: &RecordSet) -> Value {
    let units = |model: &Model| {
        records.entries.first().map_or_else(Units::default, |(r, _)| Units::from_record(r, &model.layout))
    };
    let stage = |k: Option<usize>| {
        k.and_then(|k| Some((diagnosis.stages.get(k)?, diagnosis.scores_of(k)))).map_or(
            Value::Null,
            |(s, scores)| json!({ "equations": equations(&s.model, &units(&s.model)), "gap": gap(&s.gap, scores) }),
        )
    };
    let notices = [records.notices(), diagnosis.notices.iter().map(String::as_str).collect()].concat();
    json!({
        "version": VERSION,
        "verdict": diagnosis.verdict.word(),
        "explained": diagnosis.explained,
        "noise_floor": diagnosis.noise_floor,
        "base": stage(Some(0)),
        "steps": diagnosis.steps().iter().map(step).collect::<Vec<_>>(),
        "remaining": {
            "significant": diagnosis.remaining.significant,
            "p_value": diagnosis.remaining.p_value,
            "note": diagnosis.remaining.note,
        },
        "final": stage(diagnosis.stages.len().checked_sub(1)),
        "description": diagnosis.description.as_ref().filter(|d| d.closes).map(|d| json!({
            "terms": d.terms,
            "beside": d.beside,
            "equations": equations(&d.stage.model, &units(&d.stage.model)),
            "gap": gap(&d.stage.gap, &d.scores),
            "evidence": evidence(&d.lead),
            "indistinguishable": d.alternatives,
            "curve": curve(&d.curve),
            "records": d.scores.iter().map(record).collect::<Vec<_>>(),
            "sentence": d.sentence,
        })),
        "records": diagnosis.records().iter().map(record).collect::<Vec<_>>(),
        "elapsed_ms": diagnosis.elapsed_ms,
        "sentence": diagnosis.sentence,
        "notices": notices,
        "not_shown": diagnosis.blind.iter().map(|b| json!({ "effect": b.effect, "reason": b.reason })).collect::<Vec<_>>(),
        "superseded": diagnosis.superseded(),
        "rounds": diagnosis.rounds.iter().map(round).collect::<Vec<_>>(),
    })
}

/// A formula's force over a quantity: value, force per mass and its standard error.
fn curve(curve: &Curve) -> Value {
    let errors = curve.deviation.iter().map(|e| Some(*e)).chain(std::iter::repeat(None));
    let points = curve.effect.iter().zip(errors).map(|([at, force], error)| json!([at, force, error]));
    json!({ "over": curve.axis, "unit": curve.unit, "points": points.collect::<Vec<_>>() })
}

/// Errors of the free run; those over stretches as long as the horizon stand beside them.
fn gap(gap: &Gap, scores: &[RecordScore]) -> Value {
    let train =
        FreeRun::over(scores, true).unwrap_or(FreeRun { rmse: Some(gap.train_rmse), nrmse: Some(gap.train_nrmse) });
    let test = FreeRun::over(scores, false).unwrap_or(FreeRun { rmse: gap.test_rmse, nrmse: gap.test_nrmse });
    json!({
        "train_rmse": train.rmse,
        "test_rmse": test.rmse,
        "train_nrmse": train.nrmse,
        "test_nrmse": test.nrmse,
        "horizon": gap.horizon,
        "rmse_at_horizon": gap.train_rmse,
        "test_rmse_at_horizon": gap.test_rmse,
    })
}

fn step(step: &Step<'_>) -> Value {
    let named = step.candidate.delta_bic;
    let mut indistinguishable: Vec<&str> = step.indistinguishable().iter().map(|c| c.choice.effect.as_str()).collect();
    indistinguishable.sort_unstable();
    indistinguishable.dedup();
    json!({
        "effect": step.added.choice.effect,
        "form": step.added.choice.form,
        "place": step.added.place.map(|site| site.to_string()),
        "title": step.added.title,
        "terms": step.added.terms,
        "equations": step.added.equations.iter().cloned().collect::<BTreeMap<_, _>>(),
        "where": step.round.place.words(),
        "parameters": step.added.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "gap": gap(&step.after.gap, step.scores),
        "why": step.candidate.why,
        "evidence": step.round.lead.as_ref().map(evidence),
        "delta_bic": named,
        "alternatives": step.alternatives().map(|c| alternative(c, named)).collect::<Vec<_>>(),
        "indistinguishable": indistinguishable,
        "indistinguishable_places": step.indistinguishable().iter().map(|c| json!({
            "effect": c.choice.effect,
            "place": c.place.map(|site| site.to_string()),
            "title": c.title,
        })).collect::<Vec<_>>(),
        "next_experiment": step.round.next_experiment.as_ref().map(|next| &next.text),
    })
}

/// Why the name stands: log predictive density on data never fitted, against the nearest rival.
pub fn evidence(lead: &Lead) -> Value {
    json!({
        "blocks": lead.blocks,
        "won": lead.won,
        "difference": lead.difference,
        "std_error": lead.std_error,
        "quantile": lead.quantile,
        "against": lead.against,
        "fitted": lead.fitted,
    })
}

/// The final equations along one record.
fn record(score: &RecordScore) -> Value {
    json!({
        "name": score.name,
        "fitted": score.fitted,
        "samples": score.samples,
        "rmse": score.rmse,
        "nrmse": score.nrmse,
        "stretches": score.stretches.map(|s| json!({ "seconds": s.seconds, "rmse": s.rmse })),
    })
}

fn parameter(parameter: &Parameter) -> Value {
    json!({
        "name": parameter.name,
        "value": parameter.value,
        "std_error": parameter.std_error,
        "at_bound": parameter.at_bound,
        "unit": parameter.unit,
    })
}

/// A refitted candidate against the named one: a positive difference speaks for the named one.
fn alternative(candidate: &Candidate, named: f64) -> Value {
    json!({
        "effect": candidate.choice.effect,
        "form": candidate.choice.form,
        "place": candidate.place.map(|site| site.to_string()),
        "title": candidate.title,
        "delta_bic": candidate.delta_bic - named,
        "train_rmse": candidate.stage.as_ref().map(|s| s.gap.train_rmse),
        "test_rmse": candidate.stage.as_ref().and_then(|s| s.gap.test_rmse),
        "refused": candidate.refusal(),
        "why": candidate.why,
    })
}

fn round(round: &Round) -> Value {
    json!({
        "finding": match round.finding {
            Finding::Nothing => "nothing",
            Finding::Named => "named",
            Finding::Ambiguous(_) => "ambiguous",
            Finding::Unexplained => "unexplained",
        },
        "significant": round.evidence.significant,
        "p_value": round.evidence.p_value,
        "where": round.place.words(),
        "candidates": round.candidates.iter().map(|c| json!({
            "effect": c.choice.effect,
            "form": c.choice.form,
            "place": c.place.map(|site| site.to_string()),
            "explained": c.explained,
            "delta_bic": c.delta_bic,
            "test_rmse": c.stage.as_ref().and_then(|s| s.gap.test_rmse),
            "why": c.why,
        })).collect::<Vec<_>>(),
    })
}
