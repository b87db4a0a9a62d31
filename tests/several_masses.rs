//! Several masses in a chain: every equation found, every doubt told.
//!
//! The intervals' study prints its table:
//! `cargo test --profile study --no-default-features --test several_masses -- --ignored --nocapture`
#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

use sindyscope_core::study::{Cancel, FreeSettings, Lock, Outcome, Own, Settings, Study, choose, suggest};
use sindyscope_rig::{Noise, ScenarioOptions, ScenarioRun, generate};
use sindyscope_values::model::Model;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Kind, Symbol, Term, list};

fn made(scenario: &str, options: ScenarioOptions) -> (RecordSet, Model) {
    let ScenarioRun { records, truth, .. } = generate(scenario, &options).unwrap();
    (RecordSet::new(records, Usage::Fit), truth.model())
}

/// Six seconds of two masses.
fn two_masses(noise: f64, seed: u64) -> (RecordSet, Model) {
    let noise = (noise > 0.0).then_some(Noise::ShareOfPeak(noise));
    made("two-masses", ScenarioOptions { seed, duration: Some(6.0), noise, ..ScenarioOptions::default() })
}

/// Each equation with a list of its own: the true terms.
fn true_terms(settings: Settings, truth: &Model) -> Settings {
    let n = truth.layout.freedoms;
    let own = (0..n).map(|i| {
        let terms = truth.equations[n + i].terms.iter().map(|t| t.term.clone()).collect();
        (i, Own { terms: Some(terms), ..Own::default() })
    });
    Settings { own: own.collect(), threshold: 0.0, ..settings }
}

fn run(records: &RecordSet, settings: &Settings) -> Outcome {
    Study::default().run(records, settings, &Cancel::default()).unwrap()
}

/// The settings that the program chooses where nothing is asked for.
fn chosen(records: &RecordSet, mut settings: Settings) -> Settings {
    settings.refine = false;
    let free = FreeSettings { window: true, order: true, threshold: true, form: true, refine: true, terms: false };
    choose(records, &settings, free, &Cancel::default(), &|_, _| {}).unwrap().settings
}

fn texts(model: &Model, state: usize) -> Vec<String> {
    let mut texts: Vec<String> = model.equations[state].terms.iter().map(|t| t.term.text(&model.layout)).collect();
    texts.sort();
    texts
}

#[test]
fn clean_data_of_two_masses_give_the_sparse_equations_to_a_thousandth() {
    let options = ScenarioOptions { duration: Some(3.0), rate: Some(100.0), ..ScenarioOptions::default() };
    let (records, truth) = made("two-masses", options);
    let settings = chosen(&records, suggest(&records, Kind::SecondOrder).unwrap());
    let outcome = run(&records, &settings);
    for state in 2..4 {
        assert_eq!(
            texts(&outcome.model, state),
            texts(&truth, state),
            "of a library with the same force in several writings"
        );
        for term in &truth.equations[state].terms {
            let found = outcome.model.equations[state].coefficient(&term.term).unwrap();
            assert!((found / term.coefficient - 1.0).abs() < 1e-3, "{}: {found} {}", term.term, term.coefficient);
        }
    }
}

#[test]
fn refined_equations_of_two_masses_tell_how_sure_they_are() {
    let (records, truth) = two_masses(0.01, 3);
    let settings = true_terms(suggest(&records, Kind::SecondOrder).unwrap(), &truth);
    let coarse = run(&records, &settings);
    assert!(coarse.model.equations[2..].iter().flat_map(|e| &e.terms).all(|t| t.std_error.is_some_and(|e| e > 0.0)));
    let refined = run(&records, &Settings { refine: true, ..settings });
    assert!(refined.refinement.as_ref().unwrap().converged);
    for (state, equation) in truth.equations.iter().enumerate().skip(2) {
        for term in &equation.terms {
            let found = refined.model.equations[state].terms.iter().find(|t| t.term == term.term).unwrap();
            let error = found.std_error.unwrap();
            assert!((found.coefficient - term.coefficient).abs() < 4.0 * error, "{found:?} {}", term.coefficient);
        }
    }
    // The modes of the truth, each within its own doubt.
    let known = sindyscope_values::model::modes(&truth, &[]);
    let found = refined.modes();
    assert_eq!((known.len(), found.len()), (2, 2));
    for (found, known) in found.iter().zip(&known) {
        let within = |value: f64, truth: f64, error: Option<f64>| (value - truth).abs() < 4.0 * error.unwrap();
        assert!(within(found.frequency, known.frequency, found.frequency_error), "{found:?} {known:?}");
        assert!(within(found.damping, known.damping, found.damping_error), "{found:?} {known:?}");
        for i in (0..2).filter(|i| known.shape[*i] != 1.0) {
            assert!(within(found.shape[i], known.shape[i], found.shape_error[i]), "{found:?} {known:?}");
        }
    }
}

#[test]
fn each_equation_keeps_to_its_own_list_lock_and_constraint() {
    let (records, _) = two_masses(0.001, 1);
    let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
    settings.threshold = 0.0;
    let own = |terms: &str| Own { terms: Some(list(terms).unwrap()), ..Own::default() };
    settings.own = [(0, own("x1, x2, v1, v2, u")), (1, own("x2-x1, v2-v1, sgn(v2)"))].into();
    settings.own.get_mut(&1).unwrap().locks.insert(Term::parse("sgn(v2)").unwrap(), Lock::Out);
    settings.own.get_mut(&0).unwrap().known.push("v1<=0".parse().unwrap());
    let outcome = run(&records, &settings);
    assert_eq!(texts(&outcome.model, 2), ["u", "v1", "v2", "x1", "x2"]);
    assert_eq!(texts(&outcome.model, 3), ["v2-v1", "x2-x1"]);
    assert_eq!(outcome.fits[1].dropped.len(), 1, "a term that is no candidate was not dropped");
    settings.own.insert(2, own("x1"));
    let error = Study::default().run(&records, &settings, &Cancel::default()).unwrap_err().to_string();
    assert!(error.contains("v3") && error.contains("v1, v2"), "{error}");
}

#[test]
fn a_good_models_horizon_is_the_record_and_that_of_chaos_is_shorter() {
    let (records, truth) = two_masses(0.01, 5);
    let cancel = Cancel::default();
    let mut study = Study::default();
    let settings = true_terms(suggest(&records, Kind::SecondOrder).unwrap(), &truth);
    let outcome = study.run(&records, &Settings { refine: true, ..settings }, &cancel).unwrap();
    let horizon = study.horizon(&outcome, Usage::Fit, &cancel).unwrap().unwrap();
    let length = records.entries[0].0.duration();
    assert!((horizon.seconds - length).abs() < 0.02 * length, "{horizon:?}");
    assert!(horizon.rmse <= 1.05 * outcome.train.unwrap().rmse, "{horizon:?} {:?}", outcome.train);
    let (records, _) = made("lorenz", ScenarioOptions::default());
    let mut settings = suggest(&records, Kind::FirstOrder).unwrap();
    settings.terms = list("x1, x2, x3, x1*x2, x1*x3").unwrap();
    settings.threshold = 0.01;
    (settings.smoothing.window, settings.smoothing.order) = (9, 5);
    let outcome = study.run(&records, &settings, &cancel).unwrap();
    let horizon = study.horizon(&outcome, Usage::Fit, &cancel).unwrap().unwrap();
    assert!((2.0..15.0).contains(&horizon.seconds), "{horizon:?} of 20 s");
    assert!(horizon.rmse < 1e-3 * outcome.train.unwrap().rmse, "{horizon:?}");
}

#[test]
fn a_contact_in_a_place_is_the_rigs_and_the_identifiers() {
    let options = ScenarioOptions {
        duration: Some(8.0),
        parameters: vec![("F23".into(), 0.6)],
        noise: Some(Noise::ShareOfPeak(1e-4)),
        ..ScenarioOptions::default()
    };
    let (records, truth) = made("three-masses", options);
    assert!(
        texts(&truth, 4).contains(&"sgn(v3-v2)".to_owned()) && !texts(&truth, 3).contains(&"sgn(v3-v2)".to_owned())
    );
    let settings = true_terms(suggest(&records, Kind::SecondOrder).unwrap(), &truth);
    let outcome = run(&records, &Settings { refine: true, ..settings });
    for (state, sign) in [(4, 1.0), (5, -1.0)] {
        let term = Term::parse("sgn(v3-v2)").unwrap();
        let known = truth.equations[state].coefficient(&term).unwrap();
        let found = outcome.model.equations[state].coefficient(&term).unwrap();
        assert!(known * sign > 0.0 && (found / known - 1.0).abs() < 0.02, "{found} {known}");
    }
}

/// Share of the 90 % intervals that hold the truth, of each coefficient and each mode, in 100 draws of 1 % noise.
#[test]
#[ignore = "minutes where tests are not optimised; run with --profile study"]
fn ninety_per_cent_intervals_of_two_masses_hold_the_truth() {
    const DRAWS: u64 = 100;
    let mut held: Vec<(String, usize, f64)> = Vec::new();
    for seed in 0..DRAWS {
        let (records, truth) = two_masses(0.01, seed);
        let settings = true_terms(suggest(&records, Kind::SecondOrder).unwrap(), &truth);
        let outcome = run(&records, &Settings { refine: true, ..settings });
        let mut figures: Vec<(String, f64, f64, f64)> = Vec::new();
        for (state, equation) in truth.equations.iter().enumerate().skip(2) {
            for term in &equation.terms {
                let found = outcome.model.equations[state].terms.iter().find(|t| t.term == term.term).unwrap();
                let name = format!("v{} {}", state - 1, term.term.text(&truth.layout));
                figures.push((name, term.coefficient, found.coefficient, found.std_error.unwrap()));
            }
        }
        for (k, (known, found)) in sindyscope_values::model::modes(&truth, &[]).iter().zip(outcome.modes()).enumerate()
        {
            figures.push((format!("f{}", k + 1), known.frequency, found.frequency, found.frequency_error.unwrap()));
            figures.push((format!("zeta{}", k + 1), known.damping, found.damping, found.damping_error.unwrap()));
        }
        held.resize(figures.len(), (String::new(), 0, 0.0));
        for (slot, (name, truth, value, error)) in held.iter_mut().zip(figures) {
            slot.0 = name;
            slot.1 += usize::from((value - truth).abs() < 1.645 * error);
            slot.2 = slot.2.max((value - truth).abs() / error);
        }
    }
    println!("| figure | held of {DRAWS} | largest error, standard errors |\n| --- | --- | --- |");
    for (name, count, largest) in &held {
        println!("| {name} | {count} | {largest:.2} |");
    }
    let all = held.iter().map(|h| h.1).sum::<usize>() as f64 / (held.len() as u64 * DRAWS) as f64;
    println!("all: {:.1} %", 100.0 * all);
    // A share of 100 draws is known to 3 %; coefficients of one motion are correlated.
    assert!((0.85..=0.95).contains(&all), "{all}");
    assert!(held.iter().all(|h| (80..=99).contains(&h.1)), "{held:?}");
}

/// Terms of all accelerations that are chosen for two masses of 300 samples with 1 % of noise, and those of the truth that are
/// not among them.
fn chosen_terms(measured: &str) -> (usize, Vec<String>) {
    let made = |seed| {
        let options = ScenarioOptions {
            seed,
            duration: Some(3.0),
            rate: Some(100.0),
            noise: Some(Noise::ShareOfPeak(0.01)),
            measure: Some(vec![measured.to_owned()]),
            ..ScenarioOptions::default()
        };
        generate("two-masses", &options).unwrap()
    };
    let fitted = made(3);
    let records = RecordSet::new(fitted.records, Usage::Fit);
    let start = suggest(&records, Kind::SecondOrder).unwrap();
    let free = FreeSettings { window: true, order: true, threshold: true, form: true, refine: true, terms: false };
    let cancel = Cancel::default();
    let settings = choose(&records, &start, free, &cancel, &|_, _| {}).unwrap().settings;
    let outcome = Study::default().run(&records, &settings, &cancel).unwrap();
    let terms = outcome.model.equations[2..].iter().map(|e| e.terms.len()).sum();
    let lacks = |state: usize| {
        let found = &outcome.model.equations[state];
        let truth = fitted.truth.equation(Symbol::Rate(state - 2)).map(|(term, _)| term);
        truth.filter(|t| found.coefficient(t).is_none()).map(ToString::to_string).collect::<Vec<_>>()
    };
    (terms, [2, 3].map(lacks).concat())
}

#[test]
#[ignore = "half a minute where tests are not optimised; run with --profile study"]
fn few_samples_of_two_masses_give_a_sparse_answer() {
    for measured in ["x", "a"] {
        let (terms, lacks) = chosen_terms(measured);
        // Seven are true, of 28 candidates; of some, as v2 and v2-v1, chance may take the other.
        assert!(terms <= 11 && lacks.len() <= 1, "{measured}: {terms} terms, without {lacks:?}");
    }
}
