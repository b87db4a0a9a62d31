//! What a study found, as JSON.

use serde_json::{Value, json};

use super::VERSION;
use crate::analyse::Analysis;
use sindyscope_core::study::{
    Calibration, EquationFit, Formulation, Horizon, Kinematics, Lock, Outcome, Scaling, Score, Settings, Severity,
};
use sindyscope_values::format::equations::{integrated_state, is_kinematic};
use sindyscope_values::model::{Equation, Mode, Model, Units, WeightedTerm};
use sindyscope_values::record::Usage;
use sindyscope_values::term::{Kind, Layout, Symbol, Term, integral};

/// The result of `identify`.
pub fn identified(analysis: &Analysis) -> Value {
    let outcome = &analysis.outcome;
    json!({
        "version": VERSION,
        "status": if outcome.diverged() { "diverged" } else { "ok" },
        "settings": settings(&outcome.settings, &outcome.model.layout),
        "equations": equations(&outcome.model, &outcome.units()),
        "integral_form": match outcome.settings.form {
            Formulation::Integral => json!(integral_form(&outcome.model)),
            Formulation::Derivative | Formulation::Weak { .. } => Value::Null,
        },
        "train": run(outcome.train, analysis.horizons[0]),
        "test": run(outcome.test, analysis.horizons[1]),
        "noise_floor": outcome.noise_floor,
        "elapsed_ms": { "fit": outcome.elapsed.fit, "simulate": outcome.elapsed.simulate },
        "probabilities": probabilities(outcome),
        "calibrated": analysis.calibrated.iter().map(|found| {
            let what = if let Calibration::Delay(_) = found.what { "delay" } else { "gain" };
            json!({ "channel": found.what.role().short_name(), "quantity": what, "value": found.value, "std_error": found.std_error })
        }).collect::<Vec<_>>(),
        "records": records(outcome),
        "physical": outcome.physical().iter().map(|p| json!({
            "name": p.name,
            "title": p.title,
            "value": p.value,
            "std_error": p.std_error,
            "unit": p.unit,
        })).collect::<Vec<_>>(),
        "modes": outcome.modes().iter().map(mode).collect::<Vec<_>>(),
        "refinement": outcome.refinement.as_ref().map(|r| json!({
            "rmse": r.rmse.first(),
            "converged": r.converged,
            "before": r.before,
        })),
        "warnings": outcome.warnings.iter().map(|w| json!({
            "severity": match w.severity {
                Severity::Note => "note",
                Severity::Caution => "caution",
                Severity::Wrong => "wrong",
            },
            "text": w.text,
        })).collect::<Vec<_>>(),
        "notices": analysis.records.notices(),
        "choice": analysis.choice,
    })
}

/// Posterior probability of each candidate term, where the regressor gives one.
fn probabilities(outcome: &Outcome) -> Vec<Value> {
    let layout = &outcome.model.layout;
    let each = |fit: &EquationFit| -> Vec<Value> {
        let state = layout.name(fit.state);
        let entry = |(term, p): &(Term, f64)| json!({ "state": state, "term": term.text(layout), "probability": p });
        fit.probability.iter().map(entry).collect()
    };
    outcome.fits.iter().flat_map(each).collect()
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
    let mut all: Vec<Term> = Vec::new();
    for freedom in 0..layout.freedoms {
        let terms = settings.of_equation(freedom).into_owned().terms;
        all.extend(terms.into_iter().filter(|t| !all.contains(t)).collect::<Vec<_>>());
    }
    json!({
        "by_equation": by_equation(settings, layout),
        "window": smoothing.window,
        "order": smoothing.order,
        "form": match settings.form {
            Formulation::Derivative => "derivative",
            Formulation::Weak { .. } => "weak",
            Formulation::Integral => "integral",
        },
        "half_width": match settings.form {
            Formulation::Weak { half_width } => half_width,
            Formulation::Derivative | Formulation::Integral => None,
        },
        "regressor": settings.regressor.name(),
        "threshold": settings.threshold,
        "ridge": settings.ridge,
        "terms": all.iter().map(text).collect::<Vec<_>>(),
        "lock": locked(Lock::In),
        "drop": locked(Lock::Out),
        "fix": fixed,
        "kind": match settings.kind {
            Kind::SecondOrder => "second-order",
            Kind::FirstOrder => "first-order",
        },
        "method": smoothing.method.name(),
        "length_from_data": smoothing.method.is_global() && smoothing.from_data,
        "filter_library": smoothing.filter_library,
        "scaling": match settings.scaling {
            Scaling::Scaled => "scaled",
            Scaling::Raw => "raw",
        },
        "fit_kinematics": settings.kinematics == Kinematics::Fitted,
        "constrain": settings.known.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "mass": settings.mass,
        "refine": settings.refine,
    })
}

/// What single equations have of their own, by the velocity's (first order: the state's) name.
fn by_equation(settings: &Settings, layout: &Layout) -> Value {
    let each = settings.own.iter().map(|(freedom, own)| {
        let symbol = match layout.kind {
            Kind::SecondOrder => Symbol::Rate(*freedom),
            Kind::FirstOrder => Symbol::State(*freedom),
        };
        let text = |t: &Term| t.text(layout);
        let locked = |wanted: Lock| -> Vec<String> {
            own.locks.iter().filter(|(_, l)| **l == wanted).map(|(t, _)| text(t)).collect()
        };
        let value = json!({
            "terms": own.terms.as_ref().map(|terms| terms.iter().map(text).collect::<Vec<_>>()),
            "lock": locked(Lock::In),
            "drop": locked(Lock::Out),
            "constrain": own.known.iter().map(ToString::to_string).collect::<Vec<_>>(),
        });
        (layout.name(symbol), value)
    });
    Value::Object(each.collect())
}

/// The equations. What is not known of an error is null; that of `dx/dt = v` is known, 0.
pub(crate) fn equations(model: &Model, units: &Units) -> Vec<Value> {
    model
        .iter()
        .map(|(state, equation)| {
            let known = is_kinematic(model, state, equation);
            let terms: Vec<Value> = equation
                .terms
                .iter()
                .map(|t| {
                    json!({
                        "term": t.term.text(&model.layout),
                        "coefficient": t.coefficient,
                        "unit": units.coefficient(state, &t.term),
                        "std_error": match t.std_error {
                            Some(error) => json!(error),
                            None if known => json!(0.0),
                            None => Value::Null,
                        },
                        // Signs are all that bounds a coefficient, and one that a sign holds is zero.
                        "at_bound": t.coefficient == 0.0 && t.std_error.is_none(),
                        "share": t.share,
                    })
                })
                .collect();
            json!({ "state": model.layout.name(state), "terms": terms })
        })
        .collect()
}

/// The equations integrated once over time, but for each one's constant.
fn integral_form(model: &Model) -> Vec<Value> {
    let fitted = model.iter().filter(|(state, equation)| !is_kinematic(model, *state, equation));
    let written = |(state, equation): (Symbol, &Equation)| {
        let term = |t: &WeightedTerm| {
            json!({
                "term": integral(&t.term, &model.layout),
                "coefficient": t.coefficient,
                "std_error": t.std_error,
            })
        };
        let terms: Vec<Value> = equation.terms.iter().map(term).collect();
        json!({ "left": integrated_state(model, state), "terms": terms })
    };
    fitted.map(written).collect()
}

/// Angles in radians.
pub fn mode(mode: &Mode) -> Value {
    json!({
        "frequency": mode.frequency,
        "std_error": mode.frequency_error,
        "damping": mode.damping,
        "damping_std_error": mode.damping_error,
        "shape": mode.shape,
        "shape_std_error": mode.shape_error,
        "phase": mode.phase,
    })
}

/// A score's figures; `null` where there is none.
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

/// A score of what predicts to the end of a record of so many seconds; `null` where there is none.
pub fn lasting(of_run: Option<Score>, seconds: f64) -> Value {
    let mut value = score(of_run);
    if let (Value::Object(fields), Some(s)) = (&mut value, of_run) {
        fields.insert("horizon".into(), json!(seconds));
        fields.insert("rmse_at_horizon".into(), json!(s.rmse));
    }
    value
}

/// The errors of what predicts to the end of every record, fitted ones and held out, the longest of so many seconds.
pub fn lasting_gap([train, test]: [Option<Score>; 2], seconds: f64) -> Value {
    json!({
        "train_rmse": train.map(|s| s.rmse),
        "test_rmse": test.map(|s| s.rmse),
        "train_nrmse": train.map(|s| s.nrmse),
        "test_nrmse": test.map(|s| s.nrmse),
        "horizon": seconds,
        "rmse_at_horizon": train.map(|s| s.rmse),
        "test_rmse_at_horizon": test.map(|s| s.rmse),
    })
}

/// A sensor's figures on a record, with its name and unit.
pub fn of_channel(name: &str, unit: &str, of_record: Score) -> Value {
    let mut value = score(Some(of_record));
    if let Value::Object(fields) = &mut value {
        fields.insert("name".into(), json!(name));
        fields.insert("unit".into(), json!(unit));
    }
    value
}

/// The errors of a free run, and how far it predicts.
fn run(of_run: Option<Score>, horizon: Option<Horizon>) -> Value {
    let mut value = score(of_run);
    if let (None, Some(_)) = (of_run, horizon) {
        value = json!({ "rmse": null, "nrmse": null, "max_error": null, "samples": 0, "best_fit": null });
    }
    if let Value::Object(fields) = &mut value {
        fields.insert("horizon".into(), json!(horizon.map(|h| h.seconds)));
        fields.insert("rmse_at_horizon".into(), json!(horizon.map(|h| h.rmse)));
    }
    value
}

fn records(outcome: &Outcome) -> Vec<Value> {
    outcome
        .records
        .iter()
        .map(|r| {
            let channels: Vec<Value> = r
                .sensors(&outcome.model.layout)
                .into_iter()
                .map(|c| {
                    let mut value = json!({ "name": c.name, "unit": c.unit });
                    if let (Value::Object(to), Value::Object(figures)) = (&mut value, score(c.score)) {
                        to.extend(figures);
                    }
                    value
                })
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
                "standing": {
                    "share": r.standing_share(),
                    "stops": r.standing.len(),
                    "stops_simulated": r.sticks.len(),
                },
            })
        })
        .collect()
}
