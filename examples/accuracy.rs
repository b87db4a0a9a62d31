//! Prints the tables of docs/reference/figures.md: the report's five systems identified in five ways, and what the program finds of itself.
//!
//! `cargo run --profile study --no-default-features --example accuracy [SEEDS] [WORD]`: twenty seeds unless another number
//! is given; only systems whose name holds the word, if one is.

use std::error::Error;

use sindyscope_core::study::{
    Cancel, Differentiation, FreeSettings, Kinematics, Outcome, Scaling, Settings, Study, choose, suggest,
};
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_values::model::Model;
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::{Kind, Symbol, list, polynomials};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// One of the report's systems.
struct System {
    name: &'static str,
    scenario: &'static str,
    /// Segment length, threshold and library of the report; where it gives no segment the Python package's own, 11.
    /// Its friction equations show coefficients of 0.001, so its threshold there was no larger.
    window: usize,
    threshold: f64,
    terms: &'static str,
    /// The true terms of the acceleration.
    truth: &'static [&'static str],
    /// RMSE of x that the report gives, m.
    report: &'static str,
}

const DUFFING_TERMS: &str = "x, x^2, x^3, v, v^2, v^3, u, u^2, u^3";
const FRICTION_TERMS: &str = "x, v, u, du, sgn(x), sgn(v), sgn(u), sgn(du)";
const DUFFING: &[&str] = &["x", "v", "u", "x^3"];
const FRICTION: &[&str] = &["x", "v", "u", "du", "sgn(v)"];

const SYSTEMS: [System; 5] = [
    System {
        name: "Duffing",
        scenario: "duffing",
        window: 11,
        threshold: 0.15,
        terms: DUFFING_TERMS,
        truth: DUFFING,
        report: "2.4e-3",
    },
    System {
        name: "Duffing, noise 0.01 m",
        scenario: "duffing-noisy",
        window: 81,
        threshold: 0.1,
        terms: DUFFING_TERMS,
        truth: DUFFING,
        report: "1.7e-3",
    },
    System {
        name: "friction",
        scenario: "friction",
        window: 11,
        threshold: 1e-3,
        terms: FRICTION_TERMS,
        truth: FRICTION,
        report: "1.42e-6",
    },
    System {
        name: "friction, noise 1e-5 m",
        scenario: "friction-noisy",
        window: 31,
        threshold: 1e-3,
        terms: FRICTION_TERMS,
        truth: FRICTION,
        report: "5.01e-6",
    },
    System {
        name: "friction as in an experiment, steady state",
        scenario: "friction-experiment",
        window: 31,
        threshold: 1e-3,
        terms: FRICTION_TERMS,
        truth: FRICTION,
        report: "8.93e-5 (its own rig)",
    },
];

/// Ways to an equation, in the order of the table's columns.
const WAYS: [&str; 5] =
    ["Python defaults", "Python defaults, report's library", "report's settings", "own choice", "refined"];

impl System {
    /// What is fitted, and what judges: another forcing, or another tone, without noise.
    fn records(&self, seed: u64) -> Result<RecordSet> {
        let seeded = ScenarioOptions { seed, ..ScenarioOptions::default() };
        let clean = Some(Noise::Deviation(0.0));
        let held_out = if self.scenario.starts_with("duffing") {
            ScenarioOptions {
                frequencies: Some(vec![0.13, 0.31]),
                amplitude: Some(0.6),
                together: true,
                noise: clean,
                ..seeded.clone()
            }
        } else {
            ScenarioOptions {
                frequencies: Some(vec![5.843]),
                noise: clean,
                input_noise: clean,
                resolution: Some(0.0),
                ..seeded.clone()
            }
        };
        let made = |options: &ScenarioOptions| -> Result<Vec<Record>> { Ok(generate(self.scenario, options)?.records) };
        let mut set = RecordSet::new(made(&seeded)?, Usage::Fit);
        set.entries.extend(RecordSet::new(made(&held_out)?, Usage::HeldOut).entries);
        Ok(set)
    }

    /// The settings of each way.
    fn settings(&self, set: &RecordSet) -> Result<[Settings; 5]> {
        let suggested = suggest(set, Kind::SecondOrder)?;
        let inputs = if self.terms.contains("du") {
            vec![Symbol::Input(0), Symbol::InputRate(0)]
        } else {
            vec![Symbol::Input(0)]
        };
        let symbols: Vec<Symbol> = [Symbol::State(0), Symbol::Rate(0)].into_iter().chain(inputs).collect();
        let mut squares = list("1")?;
        squares.extend(polynomials(&symbols, 2, true));
        let mut differences = suggested.smoothing;
        (differences.method, differences.filter_library) = (Differentiation::Difference, false);
        let mut smoothed = differences;
        (smoothed.method, smoothed.window, smoothed.order) = (Differentiation::SmoothThenDifference, self.window, 3);
        let package = Settings {
            smoothing: differences,
            terms: squares,
            threshold: 0.1,
            ridge: 0.05,
            scaling: Scaling::Raw,
            kinematics: Kinematics::Fitted,
            ..suggested.clone()
        };
        let library = Settings { terms: list(self.terms)?, ..package.clone() };
        let report = Settings { smoothing: smoothed, threshold: self.threshold, ..library.clone() };
        let free = FreeSettings { window: true, order: true, threshold: true, form: true, refine: false, terms: false };
        let own = choose(set, &suggested, free, &Cancel::default(), &|_, _| {})?.settings;
        let refined = Settings { refine: true, ..own.clone() };
        Ok([package, library, report, own, refined])
    }

    fn outcomes(&self, seed: u64) -> Result<[Outcome; 5]> {
        let set = self.records(seed)?;
        let mut study = Study::default();
        let outcomes: Vec<Outcome> = self
            .settings(&set)?
            .iter()
            .map(|settings| study.run(&set, settings, &Cancel::default()))
            .collect::<std::result::Result<_, _>>()?;
        outcomes.try_into().map_err(|_| "five ways".into())
    }
}

/// The held-out response's RMSE; infinite where the response left the data's range.
fn held_out(outcome: &Outcome) -> f64 {
    outcome.test.filter(|_| !outcome.diverged()).map_or(f64::INFINITY, |s| s.rmse)
}

fn equation(model: &Model) -> String {
    let terms = model.leading().map(|e| e.terms.as_slice()).unwrap_or_default();
    terms.iter().map(|t| format!("{:+.4} {}", t.coefficient, t.term)).collect::<Vec<_>>().join(" ")
}

/// Terms that are there and should not be, or the other way round.
fn wrong_terms(model: &Model, truth: &[&str]) -> usize {
    let terms = model.leading().map(|e| e.terms.as_slice()).unwrap_or_default();
    terms.iter().filter(|t| !truth.contains(&t.term.as_str())).count()
        + truth.iter().filter(|t| !terms.iter().any(|k| k.term.as_str() == **t)).count()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n % 2 == 1 { values[n / 2] } else { 0.5 * (values[n / 2 - 1] + values[n / 2]) }
}

fn figure(value: f64) -> String {
    if value.is_finite() { format!("{value:.2e}") } else { "diverges".into() }
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seeds: u64 = arguments.iter().find_map(|a| a.parse().ok()).unwrap_or(20);
    let word = arguments.iter().find(|a| a.parse::<u64>().is_err());
    let mut found = String::new();
    let mut behind = Vec::new();
    println!("Median RMSE of x (m) over {seeds} seeds, on another forcing, without noise.\n");
    println!("| system | {} | the report itself |", WAYS.join(" | "));
    println!("| --- |{}", " --- |".repeat(WAYS.len() + 1));
    for system in SYSTEMS.iter().filter(|s| word.is_none_or(|w| s.name.contains(w.as_str()))) {
        let mut errors: [Vec<f64>; 5] = Default::default();
        let mut wrong = 0;
        for seed in 0..seeds {
            let outcomes = system.outcomes(seed)?;
            for ((way, errors), outcome) in WAYS.iter().zip(&mut errors).zip(&outcomes) {
                errors.push(held_out(outcome));
                let s = &outcome.settings;
                eprintln!(
                    "{} {seed} {way}: {:.3e} {} (segment {}, order {}, threshold {:.2e}, {:?}, {:.0} ms)",
                    system.name,
                    held_out(outcome),
                    equation(&outcome.model),
                    s.smoothing.window,
                    s.smoothing.order,
                    s.threshold,
                    s.form,
                    outcome.elapsed.fit,
                );
            }
            wrong += usize::from(wrong_terms(&outcomes[3].model, system.truth) > 0);
            if seed == 0 {
                found += &format!(
                    "| {} | {} | {} |",
                    system.name,
                    equation(&outcomes[3].model),
                    equation(&outcomes[4].model)
                );
            }
        }
        found += &format!(" {wrong} of {seeds} |\n");
        let medians = errors.map(median);
        println!("| {} | {} | {} |", system.name, medians.map(figure).join(" | "), system.report);
        let before = medians[..3].iter().copied().fold(f64::INFINITY, f64::min);
        behind.extend(
            medians[3..]
                .iter()
                .zip(&WAYS[3..])
                .filter(|(m, _)| **m >= before)
                .map(|(_, way)| format!("{way} is not ahead on {}", system.name)),
        );
    }
    println!("\n| system | own choice, first seed | refined, first seed | seeds with a wrong term |");
    println!("| --- | --- | --- | --- |\n{found}");
    match behind.as_slice() {
        [] => println!("Own choice and refined fit are ahead of the others on every system."),
        some => println!("{}", some.join("\n")),
    }
    Ok(())
}
