//! The Python package's STLSQ, reproduced on stored columns and rates.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use serde_json::Value;
use sindyscope::sparse::{Constraint, Options, Reduced, stlsq};

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
            let options = Options {
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
