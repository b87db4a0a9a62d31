//! The result as JSON, for scripts. A number that does not exist is `null`.

use serde_json::{Value, json};

use super::analysis::Analysis;
use crate::model::Model;
use crate::record::Usage;
use crate::study::{Differentiation, Form, Kinematics, Lock, Outcome, Scaling, Score, Settings, Severity};
use crate::term::{Kind, Layout, Term};

/// The version of the fields below.
const VERSION: u32 = 1;

/// The result of `identify`.
pub(super) fn identified(analysis: &Analysis) -> Value {
    let outcome = &analysis.outcome;
    json!({
        "version": VERSION,
        "status": if outcome.diverged() { "diverged" } else { "ok" },
        "settings": settings(&outcome.settings, &outcome.model.layout),
        "equations": equations(&outcome.model),
        "train": score(outcome.train),
        "test": score(outcome.test),
        "noise_floor": outcome.noise_floor,
        "elapsed_ms": { "fit": outcome.elapsed.fit, "simulate": outcome.elapsed.simulate },
        "records": records(outcome),
        "warnings": outcome.warnings.iter().map(|w| json!({
            "severity": match w.severity {
                Severity::Note => "note",
                Severity::Caution => "caution",
                Severity::Wrong => "wrong",
            },
            "text": w.text,
        })).collect::<Vec<_>>(),
        "notices": crate::record::notices(analysis.records.entries.iter().map(|(r, _)| &**r)),
        "choice": analysis.choice,
    })
}

fn settings(settings: &Settings, layout: &Layout) -> Value {
    let text = |t: &Term| t.text(layout);
    let locked = |wanted: Lock| -> Vec<String> {
        settings.locks.iter().filter(|(_, l)| **l == wanted).map(|(t, _)| text(t)).collect()
    };
    let fixed: serde_json::Map<String, Value> = settings
        .locks
        .iter()
        .filter_map(|(t, l)| match l {
            Lock::Fixed(value) => Some((text(t), json!(value))),
            Lock::In | Lock::Out => None,
        })
        .collect();
    let smoothing = &settings.smoothing;
    json!({
        "window": smoothing.window,
        "order": smoothing.order,
        "form": match settings.form {
            Form::Derivative => "derivative",
            Form::Weak { .. } => "weak",
        },
        "half_width": match settings.form {
            Form::Weak { half_width } => half_width,
            Form::Derivative => None,
        },
        "threshold": settings.threshold,
        "ridge": settings.ridge,
        "terms": settings.terms.iter().map(text).collect::<Vec<_>>(),
        "lock": locked(Lock::In),
        "drop": locked(Lock::Out),
        "fix": fixed,
        "kind": match settings.kind {
            Kind::SecondOrder => "second-order",
            Kind::FirstOrder => "first-order",
        },
        "method": match smoothing.method {
            Differentiation::Filter => "filter",
            Differentiation::SmoothThenDifference => "smooth-then-difference",
            Differentiation::Difference => "difference",
        },
        "filter_library": smoothing.filter_library,
        "scaling": match settings.scaling {
            Scaling::Scaled => "scaled",
            Scaling::Raw => "raw",
        },
        "fit_kinematics": settings.kinematics == Kinematics::Fitted,
    })
}

/// The equations; a coefficient that was given and not fitted has no error: 0.
pub(super) fn equations(model: &Model) -> Vec<Value> {
    model
        .iter()
        .map(|(state, equation)| {
            let terms: Vec<Value> = equation
                .terms
                .iter()
                .map(|t| {
                    json!({
                        "term": t.term.text(&model.layout),
                        "coefficient": t.coefficient,
                        "std_error": t.std_error.unwrap_or(0.0),
                        "share": t.share,
                    })
                })
                .collect();
            json!({ "state": model.layout.name(state), "terms": terms })
        })
        .collect()
}

fn score(score: Option<Score>) -> Value {
    score.map_or(Value::Null, |s| {
        json!({
            "rmse": s.rmse,
            "nrmse": s.nrmse,
            "max_error": s.max_error,
            "samples": s.samples,
            "best_fit": s.best_fit,
        })
    })
}

fn records(outcome: &Outcome) -> Vec<Value> {
    outcome
        .records
        .iter()
        .map(|r| {
            let channels: Vec<Value> = r
                .channels
                .iter()
                .map(|c| json!({ "state": outcome.model.layout.name(c.symbol), "score": score(c.score) }))
                .collect();
            json!({
                "name": r.record.name,
                "usage": match r.usage {
                    Usage::Fit => "fit",
                    Usage::HeldOut => "held-out",
                    Usage::Off => "off",
                },
                "samples": r.record.len(),
                "rate": r.record.interval.recip(),
                "diverged_at": r.diverged_at,
                "channels": channels,
            })
        })
        .collect()
}
