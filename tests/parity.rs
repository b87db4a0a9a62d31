//! The Python packages' results, reproduced on stored samples, columns and rates.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;

use serde_json::Value;
use sindyscope_core::signal::{Differentiation, SignalFacts, Signals, Smoothing};
use sindyscope_core::sparse::{Constraint, Reduced, Regressor, SparseOptions, stlsq};
use sindyscope_values::record::{Channel, Record, Role};
use sindyscope_values::term::Kind;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn stlsq_gives_what_the_python_package_gives() {
    let fixture: Value = serde_json::from_str(include_str!("fixtures/stlsq.json")).unwrap();
    let mut cases = 0;
    for problem in fixture["problems"].as_array().unwrap() {
        let columns: Vec<Vec<f64>> = problem["columns"].as_array().unwrap().iter().map(numbers).collect();
        let reduced = Reduced::new(&columns, &numbers(&problem["rate"]));
        for case in problem["cases"].as_array().unwrap() {
            let options = SparseOptions {
                threshold: case["threshold"].as_f64().unwrap(),
                ridge: case["ridge"].as_f64().unwrap(),
                scaled: false,
            };
            let solution = stlsq(&reduced, &vec![Constraint::Free; columns.len()], &options);
            for (ours, theirs) in solution.coefficients.iter().zip(numbers(&case["coefficients"])) {
                let tolerance = 1e-8 * theirs.abs().max(1.0);
                assert!((ours - theirs).abs() <= tolerance, "{} {options:?}: {ours} {theirs}", problem["name"]);
            }
            cases += 1;
        }
    }
    assert_eq!(cases, 45, "every stored case is compared");
}

/// Stored columns with their rate and results.
struct Stored {
    name: String,
    columns: usize,
    reduced: Reduced,
    results: Value,
}

fn stored() -> Vec<Stored> {
    let fixture: Value = serde_json::from_str(include_str!("fixtures/sparse.json")).unwrap();
    let problem = |problem: &Value| {
        let columns: Vec<Vec<f64>> = problem["columns"].as_array().unwrap().iter().map(numbers).collect();
        let reduced = Reduced::new(&columns, &numbers(&problem["rate"]));
        Stored { name: problem["name"].to_string(), columns: columns.len(), reduced, results: problem.clone() }
    };
    let problems: Vec<Stored> = fixture["problems"].as_array().unwrap().iter().map(problem).collect();
    assert_eq!(problems.len(), 3, "every stored problem is compared");
    problems
}

fn support(value: &Value) -> Vec<usize> {
    value.as_array().unwrap().iter().map(|v| v.as_u64().unwrap() as usize).collect()
}

const RAW: SparseOptions = SparseOptions { threshold: 0.0, ridge: 0.0, scaled: false };

#[test]
fn relaxed_regression_keeps_what_the_python_package_keeps() {
    for Stored { name, columns, reduced, results } in stored() {
        for case in results["sr3"].as_array().unwrap() {
            let regressor = if case["penalty"] == "l0" { Regressor::Sr3L0 } else { Regressor::Sr3L1 };
            let options = SparseOptions { threshold: case["threshold"].as_f64().unwrap(), ..RAW };
            let solution = regressor.solve(&reduced, &vec![Constraint::Free; columns], &options);
            assert_eq!(solution.support, support(&case["support"]), "{name} {case}");
        }
    }
}

#[test]
fn elimination_and_forward_selection_take_the_python_packages_steps() {
    for Stored { name, columns, reduced, results } in stored() {
        for (regressor, field) in [(Regressor::Ssr, "ssr"), (Regressor::Frols, "frols")] {
            let mut ours = regressor.supports(&reduced, &vec![Constraint::Free; columns], &RAW);
            ours.iter_mut().for_each(|set| set.sort_unstable());
            let theirs: Vec<Vec<usize>> = results[field].as_array().unwrap().iter().map(support).collect();
            // The first of its eliminations is written over by the last.
            let theirs = if regressor == Regressor::Ssr { &theirs[1..] } else { &theirs };
            for set in theirs {
                assert_eq!(ours[set.len()], *set, "{name} {field}");
            }
            assert!(theirs.len() >= columns - 1);
        }
    }
}

#[test]
fn best_subsets_are_those_of_brute_force() {
    for Stored { name, columns, reduced, results } in stored() {
        let free = vec![Constraint::Free; columns];
        let ours = Regressor::BestSubset.supports(&reduced, &free, &RAW);
        let theirs = results["best"].as_array().unwrap();
        assert_eq!(ours.len(), theirs.len());
        for (ours, theirs) in ours.iter().zip(theirs) {
            let mut sorted = ours.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, support(&theirs["support"]), "{name}");
        }
        for (_, solution) in Regressor::BestSubset.path(&reduced, &free, &RAW) {
            let theirs = numbers(&theirs[solution.support.len()]["coefficients"]);
            for (ours, theirs) in solution.coefficients.iter().zip(theirs) {
                assert!((ours - theirs).abs() <= 1e-8 * theirs.abs().max(1.0), "{name}: {ours} {theirs}");
            }
        }
    }
}

#[test]
fn the_smoothing_spline_is_that_of_scipy() {
    let fixture: Value = serde_json::from_str(include_str!("fixtures/spline.json")).unwrap();
    let values: Arc<[f64]> = numbers(&fixture["samples"]).into();
    let record = Record {
        name: "stored".into(),
        source: None,
        start: 0.0,
        interval: fixture["interval"].as_f64().unwrap(),
        channels: vec![Channel {
            name: "x".into(),
            role: Role::Displacement(0),
            unit: "m".into(),
            values,
            estimated: false,
        }],
        notices: Vec::new(),
    };
    let layout = record.layout(Kind::SecondOrder);
    let cases = fixture["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 3);
    for case in cases {
        let window = case["length"].as_u64().unwrap() as usize;
        let smoothing = Smoothing { method: Differentiation::Spline, ..Smoothing::default() }.with_window(window);
        let signals = Signals::new(&record, &layout, &smoothing, &SignalFacts::new(&record, &layout));
        for (ours, field) in signals.states.iter().zip(["position", "velocity"]) {
            for (ours, theirs) in ours.iter().zip(numbers(&case[field])) {
                assert!((ours - theirs).abs() < 1e-8 * (1.0 + theirs.abs()), "{window} {field}: {ours} {theirs}");
            }
        }
    }
}
