use std::sync::Arc;

use super::{Format, Report, ReportError};
use crate::model::{Equation, Model, WeightedTerm};
use crate::record::{Channel, Record, RecordSet, Role, Usage};
use crate::signal::Signals;
use crate::study::{
    self, DroppedTerm, Elapsed, EquationFit, Outcome, RecordOutcome, Score, Settings, Severity, Warning,
};
use crate::term::{Symbol, Term};

fn term(text: &str) -> Term {
    Term::parse(text).expect("a term")
}

/// A decaying oscillation in a record of `samples`, with a response that is slightly off.
fn record_outcome(name: &str, usage: Usage, samples: usize) -> RecordOutcome {
    let interval = 0.01;
    let wave = |k: usize, phase: f64| {
        (2.5e-3 * (-0.002 * k as f64 * interval).exp()) * (6.0 * k as f64 * interval + phase).sin()
    };
    let measured: Vec<f64> = (0..samples).map(|k| wave(k, 0.0) + 1e-5 * (k as f64 * 12.9).sin()).collect();
    let response: Vec<f64> = (0..samples).map(|k| wave(k, 0.01)).collect();
    let error: Vec<f64> = measured.iter().zip(&response).map(|(m, r)| (m - r).abs()).collect();
    let velocity = |phase: f64| (0..samples).map(|k| 6.0 * wave(k, phase + 1.57)).collect::<Vec<f64>>();
    let channel = |name: &str, role, unit: &str, values: &[f64]| Channel {
        name: name.into(),
        role,
        unit: unit.into(),
        values: values.into(),
    };
    let record = Record {
        name: name.into(),
        source: Some("measured/<rig> & co.csv".into()),
        start: 0.0,
        interval,
        channels: vec![
            channel("x", Role::Displacement(0), "m", &measured),
            channel("base", Role::Input(0), "m", &vec![0.0; samples]),
        ],
        notices: vec!["The sampling intervals differed by up to 0.3 %: resampled.".into()],
    };
    let signals = Signals {
        start: 0.0,
        interval,
        states: vec![measured.clone(), velocity(0.0)],
        rates: vec![velocity(0.0), measured.clone()],
        inputs: vec![vec![0.0; samples]],
        input_rates: vec![vec![0.0; samples]],
        main_period: Some(std::f64::consts::TAU / 6.0),
        noise: vec![1e-5],
    };
    RecordOutcome {
        record: Arc::new(record),
        usage,
        signals: Arc::new(signals),
        states: vec![response.clone(), velocity(0.01)],
        channels: vec![study::Channel { symbol: Symbol::State(0), response, error, score: Some(score(samples)) }],
        diverged_at: None,
    }
}

fn score(samples: usize) -> Score {
    Score { rmse: 1.72e-5, nrmse: 0.0102, max_error: 3.4e-5, best_fit: 98.98, samples }
}

fn outcome() -> Outcome {
    let weighted =
        |text: &str, coefficient, std_error, share| WeightedTerm { term: term(text), coefficient, std_error, share };
    let acceleration = Equation {
        terms: vec![
            weighted("x", -358.612, Some(0.21), 0.47),
            weighted("u", 358.5, Some(0.3), 0.45),
            weighted("sgn(v-du)", -0.0851, Some(0.0009), 0.05),
            weighted("x^3", 1.23e-7, Some(4e-9), 0.02),
            weighted("v*|v|", -0.0704, None, 0.004),
            weighted("sqrt(|x|)/(1+x^2)", 2.0, Some(0.5), 0.002),
            weighted("1", 0.5, Some(0.1), 0.001),
        ],
    };
    Outcome {
        settings: Settings {
            terms: ["x", "v", "u", "du", "sgn(v-du)", "x^3"].map(term).into(),
            locks: [(term("x"), study::Lock::In)].into(),
            threshold: 0.01,
            ..Settings::default()
        },
        model: Model::second_order(1, vec![acceleration]),
        fits: vec![EquationFit {
            state: Symbol::Rate(0),
            dropped: vec![DroppedTerm { term: term("du"), fell_at: Some(0.0043) }],
            drop_marks: Vec::new(),
            condition: 12.0,
            residual_rms: 0.02,
            rate_rms: 1.0,
        }],
        records: vec![
            record_outcome("long", Usage::Fit, 6000),
            record_outcome("short", Usage::HeldOut, 700),
        ],
        train: Some(score(6000)),
        test: Some(score(700)),
        noise_floor: Some(1e-5),
        warnings: vec![
            Warning { severity: Severity::Wrong, text: "The base is not moved at all in any of these records, so nothing is known of u.".into(), remedy: None },
            Warning { severity: Severity::Caution, text: "One tone only: terms that differ only at other frequencies or amplitudes cannot be told apart by these data, so a model identified from them should not be trusted beyond.".into(), remedy: None },
            Warning { severity: Severity::Note, text: "A tenth of the samples would do.".into(), remedy: None },
        ],
        elapsed: Elapsed { fit: 1.0, simulate: 2.0 },
    }
}

#[test]
fn look() {
    let outcome = outcome();
    let records = RecordSet { entries: outcome.records.iter().map(|r| (r.record.clone(), r.usage)).collect() };
    let report = Report {
        title: "Friction rig <1> & its base",
        records: &records,
        outcome: &outcome,
        choice: Some(
            "Segment 31, order 5 and threshold 0.01 were chosen: of 60 settings tried they gave the smallest error on blocks left out of the fit.",
        ),
        command: Some(
            "sindyscope report long.csv --test short.csv --window 31 --order 5 --threshold 0.01 --out report.html",
        ),
    };
    let t = std::time::Instant::now();
    report.write(std::path::Path::new("/tmp/look.png")).expect("png");
    eprintln!("png {:?}", t.elapsed());
    let t = std::time::Instant::now();
    report.write(std::path::Path::new("/tmp/look.html")).expect("html");
    eprintln!("html {:?}", t.elapsed());
}
