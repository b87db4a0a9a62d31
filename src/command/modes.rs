//! Structures by their modes: the base that `identify` and `diagnose` take with `--base modes`.

use std::path::Path;

use clap::{ArgMatches, Args, Command, FromArgMatches};
use serde_json::{Map, Value, json};

use super::failure::Failure;
use super::progress::ProgressLine;
use super::source::RecordSource;
use super::{CommandResult, json, table};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::study::{Cancel, Score};
use sindyscope_modes::{BASE, Base, BaseModel, Quantity, Sensor, Structure};
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::{RecordSet, Usage};

/// Which base model is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BaseOptions(pub(super) Base);

impl BaseOptions {
    /// True if the base are modes.
    pub(super) fn is_modes(self) -> bool {
        self.0.model == BaseModel::Modes
    }
}

impl Args for BaseOptions {
    fn augment_args(command: Command) -> Command {
        table::with_options(command, BASE)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for BaseOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut base = Base::default();
        table::given(matches, BASE).apply(&mut base).map_err(table::unfit)?;
        if base.modes.is_some() && base.model != BaseModel::Modes {
            return Err(table::unfit("--modes needs --base modes".into()));
        }
        Ok(Self(base))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// Identifies a structure and prints it.
pub(super) fn identify(
    source: &RecordSource,
    base: BaseOptions,
    json: Option<&Path>,
    progress: &ProgressLine,
) -> CommandResult {
    progress.stage("reading");
    let records = source.read()?;
    progress.stage("looking for modes");
    let watch = Stopwatch::start();
    let found = sindyscope_modes::identify(&records, base.0.modes, &Cancel::default()).map_err(Failure::from)?;
    let fit = watch.milliseconds();
    if let Some(json) = json::write(json, &identified(&found, &records, fit))? {
        return Ok(json);
    }
    Ok(text(&found).into_bytes())
}

/// The result of `identify --base modes`.
fn identified(found: &Structure, records: &RecordSet, fit: f64) -> Value {
    json!({
        "version": json::VERSION,
        "status": "ok",
        "settings": { "base": "modes" },
        "equations": equations(found, &[]),
        "outputs": outputs(found),
        "train": score(found.score(0, Usage::Fit), found, Usage::Fit),
        "test": score(found.score(0, Usage::HeldOut), found, Usage::HeldOut),
        "noise_floor": found.noise_floor,
        "elapsed_ms": { "fit": fit, "simulate": 0.0 },
        "order": found.order(),
        "modes": found.modes.iter().map(json::mode).collect::<Vec<_>>(),
        "records": record_values(found),
        "warnings": [],
        "notices": sindyscope_values::record::notices(records.entries.iter().map(|(r, _)| &**r)),
    })
}

/// The modal equations: `q1`, its rate `p1` and so on; `forces[mode]` are terms besides, of effects.
pub(super) fn equations(found: &Structure, forces: &[Vec<(String, f64)>]) -> Vec<Value> {
    let term = |term: String, coefficient: f64, std_error: Value| {
        json!({ "term": term, "coefficient": coefficient, "std_error": std_error, "at_bound": false })
    };
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
pub(super) fn outputs(found: &Structure) -> Vec<Value> {
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
    let Some(s) = score else { return Value::Null };
    let longest = found.records.iter().filter(|r| r.usage == usage).map(|r| r.samples as f64 * r.interval);
    let mut fields = figures(s);
    fields.insert("horizon".into(), json!(longest.fold(0.0, f64::max)));
    fields.insert("rmse_at_horizon".into(), json!(s.rmse));
    Value::Object(fields)
}

fn figures(s: Score) -> Map<String, Value> {
    let fields = [
        ("rmse", json!(s.rmse)),
        ("nrmse", json!(s.nrmse)),
        ("max_error", json!(s.max_error)),
        ("samples", json!(s.samples)),
        ("best_fit", json!(s.best_fit)),
    ];
    fields.into_iter().map(|(k, v)| (k.to_owned(), v)).collect()
}

pub(super) fn record_values(found: &Structure) -> Vec<Value> {
    let of = |r: &sindyscope_modes::RecordFit| {
        let channels = found.sensors.iter().zip(&r.scores).map(|(sensor, s)| {
            let mut fields = figures(*s);
            fields.insert("name".into(), json!(sensor.name));
            fields.insert("unit".into(), json!(sensor.unit));
            Value::Object(fields)
        });
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

/// The modes as a table, then the errors.
pub(super) fn text(found: &Structure) -> String {
    let mut out = String::from("Mode  Frequency [Hz]        Damping ratio [%]     Shape");
    let names: Vec<&str> = found.sensors.iter().map(|s| s.name.as_str()).collect();
    out.push_str(&format!(" ({})\n", names.join(", ")));
    for (i, mode) in found.modes.iter().enumerate() {
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
