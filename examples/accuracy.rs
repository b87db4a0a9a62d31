//! Prints the README's table: the report's systems identified, beside the report's figures.
//!
//! `cargo run --release --example accuracy`

use std::error::Error;

use sindyscope::model::Model;
use sindyscope::record::{Record, RecordSet, Usage};
use sindyscope::rig::{Noise, ScenarioOptions, generate};
use sindyscope::study::{Cancel, Free, Lock, Outcome, Settings, Study, choose, suggest};
use sindyscope::term::{Kind, Term, list};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Seeds over which noisy figures are the median.
const SEEDS: u64 = 10;

/// Terms of the report's friction study, and what of them is known physics.
const FRICTION_TERMS: &str = "x, v, u, du, sgn(x), sgn(v), sgn(u), sgn(du)";
const FRICTION_KNOWN: &str = "x, v, u, du";

fn records(scenario: &str, options: &ScenarioOptions) -> Result<Vec<Record>> {
    Ok(generate(scenario, options)?.records)
}

/// Fits some records with the settings that the program chooses and simulates others.
fn identify(fit: Vec<Record>, held_out: Vec<Record>, terms: &str, known: &str) -> Result<Outcome> {
    let mut set = RecordSet::new(fit, Usage::Fit);
    set.entries.extend(RecordSet::new(held_out, Usage::HeldOut).entries);
    let mut start: Settings = suggest(&set, Kind::SecondOrder)?;
    start.terms = list(terms)?;
    start.locks = list(known)?.into_iter().map(|term| (term, Lock::In)).collect();
    let free = Free { window: true, order: true, threshold: true, form: true };
    let choice = choose(&set, &start, free, &Cancel::default(), &|_| {})?;
    Ok(Study::default().run(&set, &choice.settings, &Cancel::default())?)
}

/// The held-out response's RMSE, against the clean truth where the held-out records are clean.
fn held_out(outcome: &Outcome) -> f64 {
    outcome.test.map_or(f64::NAN, |s| s.rmse)
}

fn equation(model: &Model) -> String {
    let terms = model.leading().map(|e| e.terms.as_slice()).unwrap_or_default();
    terms.iter().map(|t| format!("{:+.4} {}", t.coefficient, t.term)).collect::<Vec<_>>().join(" ")
}

fn false_terms(model: &Model, truth: &[&str]) -> usize {
    let terms = model.leading().map(|e| e.terms.as_slice()).unwrap_or_default();
    terms.iter().filter(|t| !truth.contains(&t.term.as_str())).count()
        + truth.iter().filter(|t| !terms.iter().any(|k| k.term.as_str() == **t)).count()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

fn seeded(seed: u64) -> ScenarioOptions {
    ScenarioOptions { seed, ..ScenarioOptions::default() }
}

/// A force that no Duffing record was fitted on: two other tones at once.
fn other_force() -> ScenarioOptions {
    ScenarioOptions {
        frequencies: Some(vec![0.13, 0.31]),
        amplitude: Some(0.6),
        together: true,
        noise: Some(Noise::Deviation(0.0)),
        ..ScenarioOptions::default()
    }
}

fn held_out_tone(noise: f64) -> ScenarioOptions {
    ScenarioOptions {
        frequencies: Some(vec![5.843]),
        noise: Some(Noise::Deviation(noise)),
        ..ScenarioOptions::default()
    }
}

fn main() -> Result<()> {
    println!("| system | identified | RMSE of x (m) | report |");
    println!("| --- | --- | --- | --- |");
    let duffing_terms = "x, v, u, x^2, x^3, v*|v|, sgn(v)";
    let duffing = identify(records("duffing", &seeded(1))?, records("duffing", &other_force())?, duffing_terms, "")?;
    row("Duffing, clean", &duffing, held_out(&duffing), "0.0024");
    let truth = ["x", "v", "u", "x^3"];
    let mut outcomes = Vec::new();
    for seed in 0..SEEDS {
        outcomes.push(identify(
            records("duffing-noisy", &seeded(seed))?,
            records("duffing", &other_force())?,
            duffing_terms,
            "",
        )?);
    }
    summary("Duffing, noise 0.01 m", &outcomes, &truth, "0.0017");
    let friction = identify(
        records("friction", &seeded(1))?,
        records("friction", &held_out_tone(0.0))?,
        FRICTION_TERMS,
        FRICTION_KNOWN,
    )?;
    row("friction, clean", &friction, held_out(&friction), "1.42e-6");
    let truth = ["x", "v", "u", "du", "sgn(v)"];
    let mut outcomes = Vec::new();
    for seed in 0..SEEDS {
        outcomes.push(identify(
            records("friction-noisy", &seeded(seed))?,
            records("friction", &held_out_tone(0.0))?,
            FRICTION_TERMS,
            FRICTION_KNOWN,
        )?);
    }
    summary("friction, noise 1e-5 m", &outcomes, &truth, "5.01e-6");
    let friction = Term::parse("sgn(v)")?;
    let worst = outcomes
        .iter()
        .filter_map(|o| o.model.leading()?.coefficient(&friction))
        .map(|f| (f / -0.0856 - 1.0).abs())
        .fold(0.0, f64::max);
    println!("\nLargest error of the friction force over the seeds: {:.1} %", 100.0 * worst);
    let unlocked =
        identify(records("friction", &seeded(1))?, records("friction", &held_out_tone(0.0))?, FRICTION_TERMS, "")?;
    println!("\nFriction, clean, nothing locked: {} (RMSE {:.2e})", equation(&unlocked.model), held_out(&unlocked));
    Ok(())
}

fn row(system: &str, outcome: &Outcome, rmse: f64, report: &str) {
    let s = &outcome.settings;
    println!(
        "| {system} | {} (segment {}, order {}, threshold {}) | {rmse:.2e} | {report} |",
        equation(&outcome.model),
        s.smoothing.window,
        s.smoothing.order,
        s.threshold
    );
}

fn summary(system: &str, outcomes: &[Outcome], truth: &[&str], report: &str) {
    let wrong = outcomes.iter().filter(|o| false_terms(&o.model, truth) > 0).count();
    let errors = outcomes.iter().map(held_out).collect::<Vec<_>>();
    for o in outcomes {
        let s = &o.settings;
        eprintln!(
            "{system}: {} {:.2e} w{} o{} thr {}",
            equation(&o.model),
            held_out(o),
            s.smoothing.window,
            s.smoothing.order,
            s.threshold
        );
    }
    if let Some(first) = outcomes.first() {
        row(&format!("{system} ({} seeds, {wrong} with a wrong term)", outcomes.len()), first, median(errors), report);
    }
}
