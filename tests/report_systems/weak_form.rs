//! The weak form on the report's systems and on real measurements: what it betters.

use super::*;
use sindyscope_core::study::Formulation;
use sindyscope_files::{ReadOptions, read_files};

const WEAK: Formulation = Formulation::Weak { half_width: None };

/// Settings in which every term of the list stays.
fn known(set: &RecordSet, terms: &str, form: Formulation) -> Settings {
    let mut settings = suggest(set, Kind::SecondOrder).unwrap();
    settings.terms = list(terms).unwrap();
    settings.locks = settings.terms.iter().map(|t| (t.clone(), Lock::In)).collect();
    settings.form = form;
    settings
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn duffing_with_noise() {
    let other_force = ScenarioOptions {
        frequencies: Some(vec![0.13, 0.31]),
        amplitude: Some(0.6),
        together: true,
        ..ScenarioOptions::default()
    };
    for half_width in [None, Some(100), Some(200)] {
        let errors = (0..5).map(|seed| {
            let noisy = rig("duffing-noisy", &ScenarioOptions { seed, ..ScenarioOptions::default() });
            let set = set(noisy, rig("duffing", &other_force));
            run(&set, &known(&set, "x, v, u, x^3", Formulation::Weak { half_width })).test.unwrap().rmse
        });
        // A twentieth of the noise; smoothing leaves 1e-3 to 2e-3.
        let error = median(errors.collect());
        assert!(error <= 7e-4, "{half_width:?}: {error}");
    }
}

#[test]
fn friction_with_noise() {
    let held_out =
        || rig("friction", &ScenarioOptions { frequencies: Some(vec![5.843]), ..ScenarioOptions::default() });
    let errors = (0..3).map(|seed| {
        let options = ScenarioOptions { noise: Some(Noise::Deviation(1e-5)), seed, ..ScenarioOptions::default() };
        let set = set(rig("friction", &options), held_out());
        let outcome = run(&set, &known(&set, "x, v, u, du, sgn(v)", WEAK));
        for (term, truth, share) in [("x", -358.706, 3e-4), ("v", -0.0658, 0.1), ("sgn(v)", -0.0856, 0.01)] {
            let found = coefficient(&outcome, term);
            assert!((found / truth - 1.0).abs() <= share, "{term}: {found}, not {truth}");
        }
        outcome.test.unwrap().rmse
    });
    // A tenth of the noise; smoothing leaves twice that.
    let error = median(errors.collect());
    assert!(error <= 1e-6, "{error}");
}

#[test]
fn a_first_order_system() {
    let options = ScenarioOptions { noise: Some(Noise::Deviation(0.05)), ..ScenarioOptions::default() };
    let set = RecordSet::new(rig("lorenz", &options), Usage::Fit);
    let mut settings = suggest(&set, Kind::FirstOrder).unwrap();
    settings.smoothing.window = 15;
    settings.form = WEAK;
    let outcome = run(&set, &settings);
    assert_lorenz(&outcome, 0.03);
}

#[test]
fn the_silverbox_with_nine_samples_a_period() {
    let Some(folder) = measurements::folder() else { return };
    let options = ReadOptions { columns: "x=V2_out_V,u=V1_in_V".parse().unwrap(), ..ReadOptions::default() };
    let read = |name: &str| read_files(&[folder.join(name)], &options).unwrap();
    let set = set(read("silverbox_multisine_1.csv"), read("silverbox_multisine_10.csv"));
    let start = known(&set, "x, v, u, x^2, x^3, 1", Formulation::Derivative);
    let free = FreeSettings { window: true, order: true, threshold: false, form: true, refine: false, terms: false };
    let choice = choose(&set, &start, free, &Cancel::default(), &|_, _| {}).unwrap();
    assert!(matches!(choice.settings.form, Formulation::Weak { .. }), "{}", choice.reason);
    let outcome = run(&set, &choice.settings);
    // The benchmark's own cubic model reaches 1.7 %; smoothed derivatives 7 %.
    let error = outcome.test.unwrap().nrmse;
    assert!(error <= 0.02, "{error} with {}", choice.reason);
}
