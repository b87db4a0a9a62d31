//! Structures by their modes: the base that `identify` and `diagnose` take with `--base modes`.

use std::path::{Path, PathBuf};

use clap::{ArgMatches, Args, Command, FromArgMatches};
use serde_json::{Map, Value, json};

use super::failure::Failure;
use super::progress::ProgressLine;
use super::{CommandResult, json, table};
use sindyscope_analysis::RecordSource;
use sindyscope_analysis::json::{VERSION, evidence, lasting, lasting_gap, mode, of_channel};
use sindyscope_core::clock::Stopwatch;
use sindyscope_core::study::{Cancel, Score};
use sindyscope_files::positions_in;
use sindyscope_modes::{BASE, Base, BaseModel, FoundForce, Quantity, Sensor, Site, Structure, StructureDiagnosis};
use sindyscope_report::document::{ModesReport, Paper};
use sindyscope_report::export::{ExportFormat, StateSpace};
use sindyscope_report::modal::{diagnosis_lines, force_term, remaining};
use sindyscope_values::format::number::{format_measured, significant};
use sindyscope_values::format::units::format_si;
use sindyscope_values::record::{RecordSet, Usage};

/// Which base model is asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct BaseOptions(pub(super) Base);

impl BaseOptions {
    /// True if the base are modes.
    pub(super) fn is_modes(&self) -> bool {
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
        for (given, option) in [
            (base.modes.is_some(), "--modes"),
            (!base.poles.is_empty(), "--poles"),
            (!base.positions.is_empty(), "--positions"),
        ] {
            if given && base.model != BaseModel::Modes {
                return Err(table::unfit(format!("{option} needs --base modes")));
            }
        }
        if base.modes.is_some() && !base.poles.is_empty() {
            return Err(table::unfit("--poles says the number of modes too: leave --modes out".into()));
        }
        Ok(Self(base))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        Self::from_arg_matches(matches).map(|new| *self = new)
    }
}

/// What a command writes beside the text that it prints.
pub(super) struct WrittenFiles<'a> {
    pub(super) json: Option<&'a Path>,
    /// The model, each in the form of its ending.
    pub(super) export: &'a [PathBuf],
}

impl WrittenFiles<'_> {
    /// Refuses endings that stand for no form, before the work is done.
    fn endings(&self) -> Result<(), Failure> {
        self.export.iter().try_for_each(|path| ExportFormat::of(path).map(|_| ()).map_err(Failure::from))
    }

    /// Exports a structure and writes the JSON; the JSON where it goes to standard output. A form that cannot hold the model takes
    /// nothing from the others.
    fn write(&self, space: &StateSpace<'_>, records: &RecordSet, result: &Value) -> Result<Option<Vec<u8>>, Failure> {
        let refused: Vec<_> = self.export.iter().filter_map(|path| space.write(records, path).err()).collect();
        let json = json::write(self.json, result)?;
        refused.into_iter().next().map_or(Ok(json), |first| Err(Failure::from(first)))
    }
}

/// The base with the positions that the first record's file tells.
fn placed(base: &Base, records: &RecordSet) -> Base {
    let file = records.entries.first().and_then(|(record, _)| record.source.as_deref());
    base.clone().placed(file.and_then(positions_in).as_deref())
}

/// What a document about modes is, beside what it tells.
pub(super) struct ReportShape<'a> {
    pub(super) title: &'a str,
    /// The command that makes it again.
    pub(super) command: &'a str,
    pub(super) paper: Paper,
    pub(super) out: &'a Path,
}

/// Writes a document about a structure's modes, with what they lack if that is asked for.
pub(super) fn report(
    source: &RecordSource,
    base: &Base,
    diagnose: bool,
    shape: &ReportShape<'_>,
    json: Option<&Path>,
    progress: &ProgressLine,
) -> CommandResult {
    progress.stage("reading");
    let records = source.read()?;
    let tell = |what: &'static str, share: f64| progress.share(what, share);
    let watch = Stopwatch::start();
    let base = &placed(base, &records);
    let analysis = sindyscope_modes::analyse(&records, base, &tell, &Cancel::default()).map_err(Failure::from)?;
    let fit = watch.milliseconds();
    let modes = if base.poles.is_empty() { base.modes } else { Some(base.poles.len()) };
    let search = || sindyscope_modes::diagnose(&records, modes, &tell, &Cancel::default()).map_err(Failure::from);
    let diagnosis = diagnose.then(search).transpose()?;
    progress.stage("drawing");
    let &ReportShape { title, command, paper, out } = shape;
    let (analysis, diagnosis) = (&analysis, diagnosis.as_ref());
    let report = ModesReport { title, analysis, diagnosis, command: Some(command), paper };
    report.write(out).map_err(Failure::from)?;
    let mut result = identified(&analysis.structure, &records, fit);
    if let Some(diagnosis) = diagnosis {
        result["diagnosis"] = diagnosed(diagnosis, &records, watch.milliseconds());
    }
    let json = json::write(json, &result)?;
    Ok(json.unwrap_or_else(|| format!("wrote {}\n", out.display()).into_bytes()))
}

/// Identifies a structure and prints it.
pub(super) fn identify(
    source: &RecordSource,
    base: &BaseOptions,
    written: &WrittenFiles<'_>,
    progress: &ProgressLine,
) -> CommandResult {
    written.endings()?;
    progress.stage("reading");
    let records = source.read()?;
    progress.stage("looking for modes");
    let watch = Stopwatch::start();
    let cancel = Cancel::default();
    let found = if base.0.poles.is_empty() {
        sindyscope_modes::identify(&records, base.0.modes, &cancel)
    } else {
        sindyscope_modes::analyse(&records, &base.0, &|_, _| {}, &cancel).map(|analysis| analysis.structure)
    };
    let found = found.map_err(Failure::from)?;
    let fit = watch.milliseconds();
    let json = written.write(&StateSpace::new(&found, None), &records, &identified(&found, &records, fit))?;
    Ok(json.unwrap_or_else(|| text(&found).into_bytes()))
}

/// The result of `identify --base modes`.
fn identified(found: &Structure, records: &RecordSet, fit: f64) -> Value {
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
        "notices": sindyscope_values::record::notices(records.entries.iter().map(|(r, _)| &**r)),
    })
}

/// The modes in the band that is driven, or those outside it.
fn listed(found: &Structure, inside: bool) -> Vec<Value> {
    found.modes.iter().zip(&found.in_band).filter(|(_, b)| **b == inside).map(|(m, _)| mode(m)).collect()
}

/// The modal equations: `q1`, its rate `p1` and so on; `forces[mode]` are terms besides, of effects.
pub(super) fn equations(found: &Structure, forces: &[Vec<(String, f64)>]) -> Vec<Value> {
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
    let longest = found.records.iter().filter(|r| r.usage == usage).map(|r| r.samples as f64 * r.interval);
    lasting(score, longest.fold(0.0, f64::max))
}

pub(super) fn record_values(found: &Structure) -> Vec<Value> {
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

/// The modes as a table, then the errors.
pub(super) fn text(found: &Structure) -> String {
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

/// Searches for the force that a structure lacks and prints what was found.
pub(super) fn diagnose(
    source: &RecordSource,
    base: &BaseOptions,
    written: &WrittenFiles<'_>,
    progress: &ProgressLine,
) -> CommandResult {
    written.endings()?;
    if !base.0.poles.is_empty() {
        return Err(Failure::new("a search chooses its poles itself")
            .try_this("leave --poles out, or give --modes")
            .into());
    }
    progress.stage("reading");
    let records = source.read()?;
    let watch = Stopwatch::start();
    let tell = |what: &'static str, share: f64| progress.share(what, share);
    let found = sindyscope_modes::diagnose(&records, base.0.modes, &tell, &Cancel::default()).map_err(Failure::from)?;
    let elapsed = watch.milliseconds();
    let space = StateSpace::new(&found.last, found.found.as_ref());
    let json = written.write(&space, &records, &diagnosed(&found, &records, elapsed))?;
    Ok(json.unwrap_or_else(|| told(&found).into_bytes()))
}

/// The result of `diagnose --base modes`.
fn diagnosed(found: &StructureDiagnosis, records: &RecordSet, elapsed: f64) -> Value {
    let forces = found.found.as_ref().map_or_else(Vec::new, |f| {
        let text = force_term(f.effect, f.site, &found.last.sensors);
        f.drives.iter().map(|d| vec![(text.clone(), *d)]).collect()
    });
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
        "final": { "equations": equations(&found.last, &forces), "outputs": outputs(&found.last), "gap": gap(&found.last) },
        "order": found.last.order(),
        "modes": listed(&found.last, true),
        "modes_outside_band": listed(&found.last, false),
        "records": record_values(&found.last),
        "elapsed_ms": elapsed,
        "description": null,
        "notices": sindyscope_values::record::notices(records.entries.iter().map(|(r, _)| &**r)),
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

/// The search as text.
fn told(found: &StructureDiagnosis) -> String {
    let mut out = String::new();
    for (k, line) in diagnosis_lines(found).iter().enumerate() {
        // What belongs to the force stands beneath it.
        let indent = if found.found.is_some() && k > 1 { "  " } else { "" };
        out.push_str(&format!("{indent}{line}\n"));
    }
    out.push_str(&format!("Remaining: {}.\n\nModes of the linear part:\n", remaining(found)));
    out.push_str(&text(&found.last));
    out
}
