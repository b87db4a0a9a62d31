//! Studies whose coefficients are refined by the output error.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use sindyscope_core::study::{Cancel, Lock, Outcome, Settings, Study, suggest};
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Kind, Term, list};

fn duffing(seed: u64) -> (RecordSet, Settings) {
    let options = ScenarioOptions { seed, duration: Some(50.0), rate: Some(40.0), ..ScenarioOptions::default() };
    let mut records = RecordSet::new(generate("duffing-noisy", &options).unwrap().records, Usage::Fit);
    let other = ScenarioOptions {
        frequencies: Some(vec![0.13, 0.31]),
        amplitude: Some(0.6),
        together: true,
        noise: Some(Noise::Deviation(0.0)),
        ..options
    };
    let held_out = RecordSet::new(generate("duffing-noisy", &other).unwrap().records, Usage::HeldOut);
    records.entries.extend(held_out.entries);
    let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
    settings.terms = list("x, x^3, v, u").unwrap();
    settings.threshold = 0.0;
    (records, settings)
}

fn run(records: &RecordSet, settings: &Settings) -> Outcome {
    Study::default().run(records, settings, &Cancel::default()).unwrap()
}

const TRUTH: [(&str, f64); 4] = [("x", -1.0), ("x^3", -0.6), ("v", -0.2), ("u", 1.0)];

#[test]
fn the_refined_fit_is_nearer_to_the_truth_and_its_errors_say_how_near() {
    let (mut held, mut better) = (0, 0);
    const SEEDS: u64 = 30;
    for seed in 0..SEEDS {
        let (records, mut settings) = duffing(seed);
        let sparse = run(&records, &settings);
        settings.refine = true;
        let refined = run(&records, &settings);
        let refinement = refined.refinement.as_ref().unwrap();
        assert!(refinement.converged && refinement.before.len() == 4);
        // Noise of 0.01, and four coefficients and two initial values of 2000 samples fitted to it.
        assert!((refinement.rmse[0] / 0.01 - 1.0).abs() < 0.06, "{}", refinement.rmse[0]);
        better += usize::from(refined.test.unwrap().rmse < sparse.test.unwrap().rmse);
        for (term, value) in TRUTH {
            let term = Term::parse(term).unwrap();
            let found = refined.model.leading().unwrap().terms.iter().find(|t| t.term == term).unwrap();
            held += usize::from((found.coefficient - value).abs() < 1.645 * found.std_error.unwrap());
        }
    }
    let share = held as f64 / (4.0 * SEEDS as f64);
    // 120 intervals of 90 %: two standard deviations are 5.5 %.
    assert!((0.84..=0.955).contains(&share), "{share}");
    assert!(better as f64 > 0.8 * SEEDS as f64, "{better}");
}

#[test]
fn fixed_coefficients_stay_and_the_covariance_is_that_of_the_terms() {
    let (records, mut settings) = duffing(1);
    settings.refine = true;
    settings.locks.insert(Term::parse("u").unwrap(), Lock::Fixed(1.0));
    let outcome = run(&records, &settings);
    let terms = &outcome.model.leading().unwrap().terms;
    let fixed = terms.iter().position(|t| t.term.as_str() == "u").unwrap();
    assert_eq!((terms[fixed].coefficient, terms[fixed].std_error), (1.0, None));
    let covariance = outcome.covariance.of_equation(0);
    for (i, term) in terms.iter().enumerate() {
        let error = covariance[i][i].sqrt();
        assert!((error - term.std_error.unwrap_or(0.0)).abs() <= 1e-12 * error, "{}", term.term);
    }
    let shares: f64 = terms.iter().map(|t| t.share).sum();
    assert!((shares - 1.0).abs() < 1e-9);
    let physical = outcome.physical();
    let frequency = physical.iter().find(|p| p.name == "f_n").unwrap();
    let error = (frequency.value - 1.0 / std::f64::consts::TAU).abs();
    assert!(error < 4.0 * frequency.std_error.unwrap(), "{frequency:?}");
}

#[test]
fn where_it_cannot_be_done_it_says_so_and_the_fit_stands() {
    let options = ScenarioOptions { duration: Some(20.0), ..ScenarioOptions::default() };
    let records = RecordSet::new(generate("friction", &options).unwrap().records, Usage::Fit);
    let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
    settings.refine = true;
    settings.terms = list("x^3").unwrap();
    settings.locks.insert(Term::parse("x^3").unwrap(), Lock::Fixed(1e30));
    let outcome = run(&records, &settings);
    assert!(outcome.refinement.is_none() && outcome.warnings.iter().any(|w| w.text.starts_with("Not refined")));
    let (records, mut settings) = duffing(0);
    settings.refine = true;
    let cancel = Cancel::default();
    cancel.cancel();
    assert!(Study::default().run(&records, &settings, &cancel).is_err());
}
