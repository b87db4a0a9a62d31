//! Other ways to the same equation find it too.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use sindyscope_core::study::{
    Cancel, Differentiation, Formulation, FreeSettings, Outcome, Regressor, Settings, Smoothing, Study, choose,
    settings_grid, suggest,
};
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Kind, list, rate};

const TRUTH: [(&str, f64); 4] = [("x", -1.0), ("v", -0.2), ("x^3", -0.6), ("u", 1.0)];

/// A Duffing oscillator, driven, with noise: one record fitted, one held out.
fn duffing() -> (RecordSet, Settings) {
    let record = |seed: u64| {
        let options = ScenarioOptions { seed, duration: Some(60.0), rate: Some(50.0), ..ScenarioOptions::default() };
        generate("duffing-noisy", &options).unwrap().records.remove(0)
    };
    let mut records = RecordSet::new(vec![record(3), record(4)], Usage::Fit);
    records.entries[1].1 = Usage::HeldOut;
    let settings = suggest(&records, Kind::SecondOrder).unwrap();
    (records, settings)
}

fn run(records: &RecordSet, settings: &Settings) -> Outcome {
    Study::default().run(records, settings, &Cancel::default()).unwrap()
}

#[test]
#[ignore = "half a minute where tests are not optimised; run with --profile study"]
fn every_regressor_finds_the_equation_once_its_threshold_is_chosen() {
    let (records, settings) = duffing();
    let free = FreeSettings { window: false, order: false, threshold: true, form: false, refine: false, terms: false };
    for regressor in Regressor::ALL {
        let start = Settings { regressor, ..settings.clone() };
        let chosen = choose(&records, &start, free, &Cancel::default(), &|_, _| {}).unwrap().settings;
        assert_eq!(chosen.regressor, regressor);
        let outcome = run(&records, &chosen);
        let found = &outcome.model.leading().unwrap().terms;
        for (term, value) in TRUTH {
            let c = found.iter().find(|t| t.term.as_str() == term).map(|t| t.coefficient);
            // Noise of 1 %: what the default finds is off by as much.
            assert!(c.is_some_and(|c| (c - value).abs() < 0.05), "{regressor:?} {term}: {c:?}");
        }
        assert!(found.len() <= 6, "{regressor:?}: {found:?}");
        assert!(outcome.test.unwrap().nrmse < 0.05, "{regressor:?}: {:?}", outcome.test);
        let fit = &outcome.fits[0];
        assert_eq!(fit.probability.is_empty(), regressor != Regressor::Bayes);
        assert!(fit.path.len() >= TRUTH.len() && fit.drop_marks.len() >= TRUTH.len());
    }
}

#[test]
fn the_map_is_made_with_every_regressor() {
    let (records, settings) = duffing();
    for regressor in Regressor::ALL {
        let settings = Settings { regressor, ..settings.clone() };
        let map = settings_grid(&records, &settings, (4, 6), &Cancel::default(), &|_| {}).unwrap();
        let best = map.cell(map.parsimonious.unwrap()).unwrap();
        assert!(map.complete() && best.error < 0.05, "{regressor:?} {best:?}");
    }
}

#[test]
fn saved_settings_of_before_are_read_and_every_regressor_is_written_and_read() {
    let old: Settings = serde_json::from_str("{\"threshold\": 0.1}").unwrap();
    assert_eq!((old.regressor, old.threshold), (Regressor::Stlsq, 0.1));
    for regressor in Regressor::ALL {
        let text = serde_json::to_string(&Settings { regressor, ..Settings::default() }).unwrap();
        assert!(text.contains(&format!("\"regressor\":\"{}\"", regressor.name())), "{text}");
        assert_eq!(serde_json::from_str::<Settings>(&text).unwrap().regressor, regressor);
    }
}

/// The settings with another way of differentiating.
fn differentiated(settings: &Settings, method: Differentiation) -> Settings {
    Settings { smoothing: Smoothing { method, ..settings.smoothing }, ..settings.clone() }
}

#[test]
#[ignore = "half a minute where tests are not optimised; run with --profile study"]
fn every_differentiation_finds_the_equation_once_its_strength_is_chosen() {
    let (records, settings) = duffing();
    let free = FreeSettings { window: true, order: false, threshold: true, form: false, refine: false, terms: false };
    for method in [Differentiation::Spline, Differentiation::Spectral, Differentiation::Kalman] {
        let start = differentiated(&settings, method);
        let choice = choose(&records, &start, free, &Cancel::default(), &|_, _| {}).unwrap();
        assert_eq!(choice.settings.smoothing.method, method);
        let outcome = run(&records, &choice.settings);
        let found = &outcome.model.leading().unwrap().terms;
        for (term, value) in TRUTH {
            let c = found.iter().find(|t| t.term.as_str() == term).map(|t| t.coefficient);
            assert!(c.is_some_and(|c| (c - value).abs() < 0.1), "{method:?} {term}: {c:?}; {}", choice.reason);
        }
        assert!(outcome.test.unwrap().nrmse < 0.05, "{method:?}: {:?}; {}", outcome.test, choice.reason);
    }
}

#[test]
fn left_to_the_data_every_differentiation_gives_a_model_that_holds() {
    let (records, settings) = duffing();
    for method in Differentiation::ALL.into_iter().filter(|m| m.is_global()) {
        let outcome = run(&records, &differentiated(&settings, method));
        assert!(outcome.test.unwrap().nrmse < 0.1, "{method:?}: {:?}", outcome.test);
        let length = outcome.records[0].signals.length;
        assert!((3.0..400.0).contains(&length), "{method:?}: {length}");
    }
}

#[test]
fn the_map_is_made_with_every_differentiation() {
    let (records, settings) = duffing();
    for method in [Differentiation::Spline, Differentiation::TotalVariation, Differentiation::Difference] {
        let settings = differentiated(&settings, method);
        let map = settings_grid(&records, &settings, (3, 3), &Cancel::default(), &|_| {}).unwrap();
        assert!(map.complete(), "{method:?}");
        let place = map.parsimonious.unwrap();
        let there = map.settings_at(place, &settings);
        let outcome = run(&records, &there);
        assert_eq!(map.cell(place).unwrap().terms, outcome.model.leading().unwrap().terms.len(), "{method:?}");
    }
}

#[test]
fn total_variation_says_that_a_record_is_too_long_for_it() {
    let (mut records, settings) = duffing();
    let settings = differentiated(&settings, Differentiation::TotalVariation);
    let record = std::sync::Arc::make_mut(&mut records.entries[0].0);
    for channel in &mut record.channels {
        channel.values = channel.values.iter().cycle().take(Smoothing::MOST_VARIATION + 1).copied().collect();
    }
    let error = Study::default().run(&records, &settings, &Cancel::default()).unwrap_err().to_string();
    assert!(error.contains("total variation is for records of up to 100000 samples"), "{error}");
}

#[test]
fn the_integral_form_is_the_second_order_form_for_one_and_two_masses() {
    for (scenario, written) in [
        ("friction", vec!["x, u, int(x), int(u), int(sgn(v))"]),
        ("two-masses", vec!["x1, x2-x1, int(x1), int(x2-x1), int(u)", "x2-x1, int(x2-x1)"]),
    ] {
        let made = generate(scenario, &ScenarioOptions::default()).unwrap();
        let records = RecordSet::new(made.records, Usage::Fit);
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        settings.form = Formulation::Integral;
        for (i, equation) in written.iter().enumerate() {
            let terms = equation.split(", ").map(|t| rate(t).unwrap()).collect();
            settings.own.entry(i).or_default().terms = Some(terms);
        }
        settings.terms = list("x1").unwrap();
        settings.threshold = 0.0;
        let outcome = run(&records, &settings);
        let freedoms = written.len();
        for (found, truth) in outcome.model.equations.iter().zip(&made.truth.model().equations).skip(freedoms) {
            assert_eq!(found.terms.len(), truth.terms.len());
            for term in &truth.terms {
                let c = found.coefficient(&term.term).unwrap();
                let share = found.terms.iter().find(|t| t.term == term.term).unwrap().share;
                // Of a term that is a hundredth of the force, a tenth of a percent of the force is a tenth of it.
                let bound = f64::max(0.01, 1e-3 / share.max(1e-6));
                assert!(
                    (c / term.coefficient - 1.0).abs() < bound,
                    "{scenario} {}: {c} {}",
                    term.term,
                    term.coefficient
                );
            }
        }
        let response = outcome.train.unwrap().nrmse;
        assert!(response < 0.01, "{scenario}: {response}");
    }
}
