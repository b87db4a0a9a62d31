//! Records without a displacement: an accelerometer or a laser vibrometer alone.
#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

#[path = "study/plant.rs"]
mod plant;

use std::f64::consts::TAU;
use std::fmt::Write as _;

use plant::motion;
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal, Uniform};
use sindyscope_core::study::{Cancel, Study, suggest};
use sindyscope_files::{ReadOptions, read_files};
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_search::{Ask, Search, Verdict};
use sindyscope_values::record::{RecordSet, Role, Usage};
use sindyscope_values::term::{Kind, Term, list};

/// Samples of the rig's fine record for one of the sensor's.
const FINE: usize = 20;
/// Noise as a share of what the sensor shows, and an accelerometer's zero in deviations of that noise.
const NOISE: f64 = 0.01;
const ZERO: f64 = 5.0;

/// Duffing's oscillator, x″ = −x − 0.2 x′ − 0.6 x³ + u, as a sensor of velocity (`v`) or acceleration (`a`) shows it: read from
/// a file that holds time, that and the force.
fn shown(quantity: &str, seed: u64, usage: Usage) -> (RecordSet, f64) {
    let rate = 10.0 * FINE as f64;
    let options = ScenarioOptions { seed, duration: Some(200.0), rate: Some(rate), ..ScenarioOptions::default() };
    let fine = generate("duffing-multisine", &options).unwrap().records.remove(0);
    let values = |role| fine.channel(role).unwrap().values.to_vec();
    let (x, u) = (values(Role::Displacement(0)), values(Role::Input(0)));
    by_sensor(quantity, (fine.interval, &x, &u), seed, usage)
}

/// What a sensor of velocity or acceleration shows of displacements and inputs at a fine interval, and its noise.
fn by_sensor(quantity: &str, (h, x, u): (f64, &[f64], &[f64]), seed: u64, usage: Usage) -> (RecordSet, f64) {
    let at: Vec<usize> = (FINE..x.len() - 1).step_by(FINE).collect();
    let clean: Vec<f64> = at
        .iter()
        .map(|&k| match quantity {
            "v" => (x[k + 1] - x[k - 1]) / (2.0 * h),
            _ => (x[k + 1] - 2.0 * x[k] + x[k - 1]) / (h * h),
        })
        .collect();
    let spread = (clean.iter().map(|v| v * v).sum::<f64>() / clean.len() as f64).sqrt();
    let mut generator = rand_pcg::Pcg64::seed_from_u64(seed);
    let noise = Normal::new(if quantity == "a" { ZERO * NOISE * spread } else { 0.0 }, NOISE * spread).unwrap();
    let mut text = format!("t [s],{quantity},u\n");
    for (&k, value) in at.iter().zip(&clean) {
        writeln!(text, "{},{},{}", h * k as f64, value + noise.sample(&mut generator), u[k]).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shown.csv");
    std::fs::write(&path, text).unwrap();
    (RecordSet::new(read_files(&[&path], &ReadOptions::default()).unwrap(), usage), NOISE * spread)
}

/// A steep, lightly damped spring, x″ = −x − 0.06 x′ − 0.02 x⁵ + u, as a sensor of velocity shows it.
fn steep(seed: u64, usage: Usage) -> RecordSet {
    const INTERVAL: f64 = 0.25 / FINE as f64;
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let phase = Uniform::new(0.0, TAU).unwrap();
    let lines: Vec<(f64, f64)> = (0..30).map(|k| (0.4 + 0.038 * f64::from(k), phase.sample(&mut random))).collect();
    let u = |t: f64| lines.iter().map(|(w, p)| 0.103 * (w * t + p).cos()).sum::<f64>();
    let rate = |t: f64, [x, v, _]: [f64; 3]| [v, u(t) - x - 0.06 * v - 0.02 * x.powi(5), 0.0];
    let x = motion(rate, [0.0; 3], INTERVAL, 1700 * FINE);
    let input: Vec<f64> = (0..x.len()).map(|n| u(INTERVAL * n as f64)).collect();
    by_sensor("v", (INTERVAL, &x, &input), seed, usage).0
}

fn both(quantity: &str) -> (RecordSet, f64) {
    let (mut records, noise) = shown(quantity, 1, Usage::Fit);
    records.entries.extend(shown(quantity, 2, Usage::HeldOut).0.entries);
    (records, noise)
}

#[test]
fn a_displacement_that_was_not_measured_is_said_to_be_an_estimate() {
    let (records, _) = shown("a", 1, Usage::Fit);
    let record = &records.entries[0].0;
    assert_eq!(record.sensor(0).unwrap().role, Role::Acceleration(0));
    assert!(record.channel(Role::Displacement(0)).unwrap().estimated);
    assert!(record.notices.iter().any(|n| n.contains("estimated from the acceleration `a`")), "{:?}", record.notices);
}

#[test]
fn one_sensor_of_velocity_or_acceleration_gives_the_equation_and_an_error_of_its_noise() {
    for quantity in ["v", "a"] {
        let (records, noise) = both(quantity);
        let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
        settings.terms = list("x, v, x^3, u").unwrap();
        settings.threshold = 0.0;
        let outcome = Study::default().run(&records, &settings, &Cancel::default()).unwrap();
        for (term, truth) in [("x", -1.0), ("v", -0.2), ("x^3", -0.6), ("u", 1.0)] {
            let term = Term::parse(term).unwrap();
            let found = outcome.model.leading().unwrap().terms.iter().find(|t| t.term == term).unwrap();
            assert!((found.coefficient - truth).abs() < 0.01, "{quantity}: {term} {}", found.coefficient);
            assert!((found.coefficient - truth).abs() < 4.0 * found.std_error.unwrap(), "{quantity}: {term}");
        }
        let held_out = outcome.test.unwrap().rmse;
        assert!(held_out < 1.15 * noise, "{quantity}: {held_out} of {noise}");
    }
}

#[test]
fn what_is_missing_is_named_from_a_velocity_or_an_acceleration_alone() {
    for quantity in ["v", "a"] {
        let (records, noise) = both(quantity);
        let ask = Ask { base: Some(list("x, v, u").unwrap()), ..Ask::default() };
        let diagnosis = Search::new(&records, &ask).unwrap().diagnose(&|_| {}, &Cancel::default()).unwrap();
        let steps: Vec<&str> =
            diagnosis.stages.iter().skip(1).filter_map(|s| Some(s.effects.last()?.choice.effect.as_str())).collect();
        assert_eq!(
            (diagnosis.verdict, steps.as_slice()),
            (Verdict::Named, ["cubic_stiffness"].as_slice()),
            "{quantity}"
        );
        let left = diagnosis.stages.last().unwrap().gap.test_rmse.unwrap();
        assert!(left < 1.15 * noise, "{quantity}: {left} of {noise}");
    }
}

#[test]
fn what_the_regression_has_first_by_far_is_fitted_though_little_of_it_shows_along_the_model_before() {
    // Along the motion of a linear spring that is far off, a steep one explains next to nothing of an estimated displacement.
    let mut records = steep(11, Usage::Fit);
    records.entries.extend(steep(12, Usage::Fit).entries);
    records.entries.extend(steep(13, Usage::HeldOut).entries);
    let ask = Ask { base: Some(list("x, v, u").unwrap()), ..Ask::default() };
    let diagnosis = Search::new(&records, &ask).unwrap().diagnose(&|_| {}, &Cancel::default()).unwrap();
    let steps: Vec<&str> = diagnosis.steps().iter().map(|s| s.added.choice.effect.as_str()).collect();
    assert_eq!((diagnosis.verdict, steps), (Verdict::Named, vec!["quintic_stiffness"]));
}

#[test]
fn a_motion_between_wells_or_over_the_top_is_explained_by_its_velocity_alone() {
    // Most of such a displacement is slower than an estimate holds that allows for an offset of the sensor.
    let systems: [(&str, f64, &[&str]); 3] = [
        ("pendulum", 1.15, &["pendulum_restoring"]),
        ("double-well", 0.4, &["cubic_stiffness"]),
        ("double-well-friction", 0.42, &["coulomb_friction", "cubic_stiffness"]),
    ];
    for (scenario, size, effects) in systems {
        let made = |seed: u64, size: f64| {
            let options = ScenarioOptions {
                seed,
                amplitude: Some(size),
                measure: Some(vec!["v".to_owned()]),
                noise: Some(Noise::ShareOfPeak(0.005)),
                ..ScenarioOptions::default()
            };
            generate(scenario, &options).unwrap().records
        };
        let mut records = RecordSet::new(made(1, size), Usage::Fit);
        records.add(made(101, 0.85 * size), Usage::HeldOut);
        let ask = Ask { base: Some(list("x, v, u").unwrap()), ..Ask::default() };
        let diagnosis = Search::new(&records, &ask).unwrap().diagnose(&|_| {}, &Cancel::default()).unwrap();
        let mut steps: Vec<&str> = diagnosis.steps().iter().map(|s| s.added.choice.effect.as_str()).collect();
        steps.sort_unstable();
        assert_eq!((diagnosis.verdict, steps.as_slice()), (Verdict::Named, effects), "{scenario}");
    }
}
