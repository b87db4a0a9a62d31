use super::*;
use crate::sensor::Noise;
use sindyscope_values::record::{Channel, Role};

fn made(name: &str, options: &ScenarioOptions) -> ScenarioRun {
    generate(name, options).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Short records, for tests that ask something else.
fn brief(seed: u64) -> ScenarioOptions {
    ScenarioOptions { seed, duration: Some(3.0), rate: Some(100.0), ..Default::default() }
}

fn values(record: &Record, role: Role) -> &[f64] {
    &record.channel(role).unwrap().values
}

const X: Role = Role::Displacement(0);
const U: Role = Role::Input(0);

#[test]
fn every_scenario_makes_what_it_says() {
    let mut names = Vec::new();
    for scenario in scenarios() {
        let generated = made(scenario.name, &ScenarioOptions::default());
        assert!(!names.contains(&scenario.name), "{} is there twice", scenario.name);
        names.push(scenario.name);
        let shaken = !matches!(scenario.excitation_kind, ScenarioExcitation::Release | ScenarioExcitation::None);
        for record in &generated.records {
            assert_eq!(record.len(), (scenario.rate * scenario.duration).round() as usize, "{}", scenario.name);
            assert!(record.channels.iter().all(|c| c.values.iter().all(|x| x.is_finite())));
            assert!(record.channels.iter().all(|c| c.values.len() == record.len()));
            let motions =
                |c: &&Channel| matches!(c.role, Role::Displacement(_) | Role::Velocity(_) | Role::Acceleration(_));
            let freedoms = generated.truth.layout.freedoms;
            let numbered = |m: &&&str| m.ends_with(|c: char| c.is_ascii_digit());
            let single = scenario.measures.iter().filter(numbered).count();
            let sensed = if single > 0 { single } else { freedoms };
            assert_eq!(record.measured().filter(motions).count(), sensed, "{}", scenario.name);
            assert_eq!(record.channel(U).is_some(), shaken);
        }
        let truth = generated.comments.iter().filter(|c| c.starts_with("truth: d")).count();
        assert_eq!(truth, scenario.plant().smooth.layout.states());
        assert_eq!(
            generated.comments.last().unwrap(),
            &format!("made by: sindyscope generate {} --seed 0", scenario.name)
        );
    }
}

#[test]
fn a_force_between_masses_is_told_in_brackets() {
    let comments = made("two-masses", &brief(0)).comments;
    let told = comments.iter().any(|c| c == "truth: dv2/dt = - 600.0*(x2-x1) - 1.2*(v2-v1)");
    assert!(told, "{comments:?}");
}

#[test]
fn truths_are_the_reports() {
    let coefficients = |name: &str| -> Vec<(String, f64)> {
        let truth = made(name, &brief(0)).truth;
        let leading = truth.terms[0].state;
        truth.equation(leading).map(|(term, coefficient)| (term.to_string(), coefficient)).collect()
    };
    let as_given =
        |terms: &[(&str, f64)]| -> Vec<(String, f64)> { terms.iter().map(|(t, c)| ((*t).to_owned(), *c)).collect() };
    assert_eq!(coefficients("duffing"), as_given(&[("x", -1.0), ("x^3", -0.6), ("v", -0.2), ("u", 1.0)]));
    let friction = [("x", -358.706), ("v", -0.0658), ("u", 358.706), ("du", 0.0658), ("sgn(v)", -0.0856)];
    assert_eq!(coefficients("friction"), as_given(&friction));
    assert_eq!(coefficients("lorenz"), as_given(&[("x", -10.0), ("x2", 10.0)]));
    assert_eq!(coefficients("friction-decay"), as_given(&[friction[0], friction[1], friction[4]]));
}

#[test]
fn a_seed_makes_the_same_records_for_ever() {
    for name in ["duffing-noisy", "friction-experiment", "duffing-multisine"] {
        assert_eq!(made(name, &brief(7)), made(name, &brief(7)));
        assert_ne!(made(name, &brief(7)).records, made(name, &brief(8)).records);
    }
    let first = values(&made("duffing-noisy", &brief(1)).records[0], X)[..3].to_vec();
    assert_eq!(first, [0.00206, 0.01301, 0.00009]);
}

#[test]
fn noise_is_of_the_size_asked_for_and_on_the_channel_asked_for() {
    let clean = &made("friction", &brief(0)).records;
    let options = ScenarioOptions { noise: Some(1e-4.into()), ..brief(3) };
    let noisy = &made("friction", &options).records;
    for (clean, noisy) in clean.iter().zip(noisy) {
        assert_eq!(values(clean, U), values(noisy, U));
        let differences: Vec<f64> = values(clean, X).iter().zip(values(noisy, X)).map(|(a, b)| b - a).collect();
        // Five standard errors of 300 samples: 5/√600.
        assert!((signal_rms(&differences) / 1e-4 - 1.0).abs() < 0.2);
    }
    let options = ScenarioOptions { input_noise: Some(Noise::REPORT), ..brief(3) };
    let noisy = &made("friction", &options).records[0];
    assert_eq!(values(&clean[0], X), values(noisy, X));
    let differences: Vec<f64> = values(&clean[0], U).iter().zip(values(noisy, U)).map(|(a, b)| b - a).collect();
    assert!((signal_rms(&differences) / 2.5e-5 - 1.0).abs() < 0.2, "a hundredth of 2.5 mm");
}

fn signal_rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn the_friction_records_never_stick_and_those_of_stick_slip_do() {
    let never = "the mass never sticks".to_owned();
    let tested = ScenarioOptions { frequencies: Some(vec![5.843]), ..Default::default() };
    for options in [ScenarioOptions::default(), tested] {
        assert!(made("friction", &options).comments.contains(&never));
    }
    let comments = made("stick-slip", &ScenarioOptions::default()).comments;
    assert!(comments.iter().any(|c| c.starts_with("the mass sticks 92 times")), "{comments:?}");
    assert!(comments.iter().any(|c| c.contains("holds up to 1.3 times")), "{comments:?}");
}

#[test]
fn the_experiment_is_steady() {
    // Samples one period apart differ by what the sensor adds: noise of 1 µm and rounding to 0.77 µm.
    let options = ScenarioOptions { frequencies: Some(vec![2.0]), ..Default::default() };
    let record = &made("friction-experiment", &options).records[0];
    let x = values(record, X);
    let differences: Vec<f64> = (500..x.len()).map(|k| x[k] - x[k - 500]).collect();
    let expected = (2.0_f64 * (1e-6_f64.powi(2) + (0.77e-6_f64).powi(2) / 12.0)).sqrt();
    assert!((signal_rms(&differences) / expected - 1.0).abs() < 0.03, "{} {expected}", signal_rms(&differences));
    let whole = x.iter().all(|x| ((x / 0.77e-6).round() * 0.77e-6 - x).abs() < 1e-15);
    assert!(whole, "samples are whole steps of the sensor");
}

#[test]
fn several_tones_are_one_record_each_or_one_together() {
    let options = ScenarioOptions { frequencies: Some(vec![0.1, 0.3]), ..brief(0) };
    let apart = made("duffing", &options);
    let names: Vec<&str> = apart.records.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["0.1Hz", "0.3Hz"]);
    let together = made("duffing", &ScenarioOptions { together: true, ..options });
    assert_eq!(together.records.len(), 1);
    for k in 0..300 {
        let sum = values(&apart.records[0], U)[k] + values(&apart.records[1], U)[k];
        // Each is rounded to ten digits.
        assert!((values(&together.records[0], U)[k] - sum).abs() < 2e-9);
    }
}

#[test]
fn a_settled_record_goes_on_where_the_cut_was() {
    let long = made("duffing", &ScenarioOptions { duration: Some(6.0), ..Default::default() });
    let cut = made("duffing", &ScenarioOptions { duration: Some(2.0), settle: Some(4.0), ..Default::default() });
    for role in [X, U] {
        let (long, cut) = (values(&long.records[0], role), values(&cut.records[0], role));
        // Rounding of the instants, and other places of the samples within the steps.
        assert!(long[400..].iter().zip(cut).all(|(a, b)| (a - b).abs() < 1e-11));
    }
}

#[test]
fn the_command_in_the_comments_names_every_option() {
    let options = ScenarioOptions {
        seed: 4,
        measure: Some(vec!["x".to_owned(), "a1".to_owned()]),
        noise: Some(Noise::REPORT),
        offset: Some(0.25),
        drift: Some(-0.5),
        high_pass: Some(0.1),
        input_noise: Some(1e-6.into()),
        resolution: Some(1e-7),
        rate: Some(500.0),
        duration: Some(2.5),
        settle: Some(1.0),
        amplitude: Some(2e-3),
        levels: None,
        frequencies: Some(vec![2.0, 3.5]),
        together: true,
        lines: None,
        ramp: Some(0.5),
        initial: Some(vec![1e-3, 0.0]),
        parameters: vec![("F".to_owned(), 0.1)],
    };
    assert_eq!(
        made("friction", &options).comments.last().unwrap(),
        "made by: sindyscope generate friction --seed 4 --measure x,a1 --noise 1% --offset 0.25 --drift -0.5 --high-pass 0.1 --input-noise 1e-6 --resolution 1e-7 --rate 500 \
         --duration 2.5 --settle 1 --amplitude 0.002 --frequencies 2,3.5 --together --ramp 0.5 --initial 0.001,0 \
         --set F=0.1"
    );
}

#[test]
fn any_quantity_of_any_mass_is_measured() {
    let measure = |list: &[&str]| Some(list.iter().map(|name| (*name).to_owned()).collect());
    let options = |list: &[&str]| ScenarioOptions { measure: measure(list), duration: Some(4.0), ..Default::default() };
    let record = &made("two-masses", &options(&["x1", "v", "a2"])).records[0];
    let names: Vec<&str> = record.measured().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["x1", "v1", "v2", "a2", "u"]);
    let units: Vec<&str> = record.measured().map(|c| c.unit.as_str()).collect();
    assert_eq!(units, ["m", "m/s", "m/s", "m/s^2", "N"]);
    // What is measured of one motion belongs together: central differences over 5 ms err by (ωΔ)²/6, ω at most 75 rad/s.
    let differentiated = |role: Role, k: usize| (values(record, role)[k + 1] - values(record, role)[k - 1]) / 0.01;
    for (of, rate) in [(X, Role::Velocity(0)), (Role::Velocity(1), Role::Acceleration(1))] {
        let size = values(record, rate).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert!((1..700).all(|k| (differentiated(of, k) - values(record, rate)[k]).abs() < 0.03 * size));
    }
    let refused = |list: &[&str]| generate("two-masses", &options(list)).unwrap_err().to_string();
    assert!(refused(&["a3"]).contains("numbered from 1 to 2"));
    assert!(refused(&["x", "x1"]).contains("asked for twice"));
    assert!(refused(&["force"]).contains("write x, v or a"));
    let states = generate("lorenz", &options(&["v"])).unwrap_err().to_string();
    assert!(states.contains("first-order system"), "{states}");
}

#[test]
fn unusable_options_are_refused_in_words() {
    let plain = ScenarioOptions::default;
    let cases = [
        ("dufing", plain(), "there is no scenario \"dufing\"; choose one of: duffing, "),
        ("duffing", ScenarioOptions { rate: Some(0.0), ..plain() }, "rate: 0 is out of bounds"),
        ("duffing", ScenarioOptions { rate: Some(f64::NAN), ..plain() }, "rate: NaN is out of bounds"),
        ("duffing", ScenarioOptions { duration: Some(-1.0), ..plain() }, "duration: -1 is out of bounds"),
        ("duffing", ScenarioOptions { duration: Some(0.01), ..plain() }, "duration: 0.01 s at 100 Hz are 1 samples"),
        ("duffing", ScenarioOptions { duration: Some(1e5), ..plain() }, "duration: 10000000 samples in all"),
        ("duffing", ScenarioOptions { amplitude: Some(f64::INFINITY), ..plain() }, "amplitude: inf"),
        ("duffing", ScenarioOptions { noise: Some((-1.0).into()), ..plain() }, "noise: give a standard deviation"),
        ("duffing", ScenarioOptions { frequencies: Some(vec![]), ..plain() }, "frequencies: give at least one"),
        ("duffing", ScenarioOptions { frequencies: Some(vec![60.0]), ..plain() }, "frequencies: 60 Hz is not between"),
        (
            "duffing",
            ScenarioOptions { frequencies: Some(vec![1.0, 1.0]), ..plain() },
            "frequencies: 1 Hz is given twice",
        ),
        (
            "duffing-sweep",
            ScenarioOptions { frequencies: Some(vec![1.0]), ..plain() },
            "frequencies: the scenario duffing-sweep takes two",
        ),
        (
            "lorenz",
            ScenarioOptions { amplitude: Some(1.0), ..plain() },
            "amplitude: the scenario lorenz has no excitation",
        ),
        (
            "friction-decay",
            ScenarioOptions { together: true, ..plain() },
            "together: the scenario friction-decay has no separate tones",
        ),
        ("duffing-multisine", ScenarioOptions { lines: Some(0), ..plain() }, "lines: 0 is out of bounds"),
        ("duffing", ScenarioOptions { initial: Some(vec![1.0]), ..plain() }, "initial: 1 values for 2 states"),
        (
            "friction",
            ScenarioOptions { parameters: vec![("f".into(), 1.0)], ..plain() },
            "set: the plant of friction has no parameter \"f\"; it has k, c, F, static",
        ),
        ("friction", ScenarioOptions { parameters: vec![("F".into(), -1.0)], ..plain() }, "set: -1 is out of bounds"),
        (
            "duffing",
            ScenarioOptions { parameters: vec![("k".into(), -100.0), ("beta".into(), -1.0)], ..plain() },
            "the motion grows without bound at t = ",
        ),
    ];
    for (name, options, expected) in cases {
        let message = generate(name, &options).expect_err(expected).to_string();
        assert!(message.starts_with(expected), "{message:?} does not start with {expected:?}");
    }
}

#[test]
fn a_motion_too_fast_to_follow_is_given_up() {
    let options = ScenarioOptions {
        rate: Some(100.0),
        duration: Some(1e4),
        parameters: vec![("k".into(), 1e8)],
        ..Default::default()
    };
    let error = generate("duffing-decay", &options).unwrap_err();
    assert!(matches!(error, RigError::TooLong { .. }), "{error}");
}

#[test]
fn the_hysteresis_is_the_benchmarks() {
    let made = made("bouc-wen", &ScenarioOptions::default());
    let force = values(&made.records[0], U);
    assert_eq!((force.len(), made.records[0].interval), (8192, 1.0 / 750.0));
    // The record is a whole period: its RMS is that of the lines, but for the ten digits of each sample.
    assert!((signal_rms(force) / 50.0 - 1.0).abs() < 1e-9, "{}", signal_rms(force));
    let told = |equation: &str| assert!(made.comments.iter().any(|c| c == equation), "{:?}", made.comments);
    told("truth: dv/dt = - 25000.0*x - 5.0*v - 0.5*z + 0.5*u");
    told("truth: dz/dt = 50000.0*v - 800.0*z*|v| + 1100.0*v*|z|");
    let hidden = made.truth.terms.iter().find(|t| t.term.is_none()).expect("a term that no record has");
    assert_eq!((hidden.text.as_str(), hidden.coefficient), ("z", -0.5));
    assert!(made.truth.library().all(|term| term.foreign_symbol(&made.truth.layout).is_none()));
}

#[test]
fn the_absorber_is_tuned_as_den_hartogs() {
    let scenario = scenarios().iter().find(|s| s.name == "absorber").expect("the scenario");
    let parameters = scenario.parameters();
    let number = |name: &str| parameters.iter().find(|p| p.name == name).map_or(0.0, |p| p.value);
    let (m1, m2, k1, k12, c12) = (number("m1"), number("m2"), number("k1"), number("k12"), number("c12"));
    assert_eq!(number("c1"), 0.0, "his mass has no damper of its own");
    // Amplitude of the mass over its static deflection, s = k₁₂ + iωc₁₂: k₁ |s − m₂ω²| / |(k₁ − m₁ω²)(s − m₂ω²) − m₂ω² s|.
    let magnification = |omega: f64| {
        let (square, damping) = (omega * omega, omega * c12);
        let absorber = (k12 - m2 * square, damping);
        let bare = k1 - m1 * square;
        let (real, imaginary) = (bare * absorber.0 - m2 * square * k12, bare * absorber.1 - m2 * square * damping);
        k1 * absorber.0.hypot(absorber.1) / real.hypot(imaginary)
    };
    let values: Vec<f64> = (0..4000).map(|k| magnification(12.0 + 0.004 * f64::from(k))).collect();
    let peaks: Vec<f64> = values.windows(3).filter(|w| w[1] > w[0] && w[1] >= w[2]).map(|w| w[1]).collect();
    // The two peaks are nearly level, at √(1 + 2/μ) of the static deflection.
    let level = (1.0 + 2.0 * m1 / m2).sqrt();
    assert_eq!(peaks.len(), 2, "{peaks:?}");
    assert!(peaks.iter().all(|peak| (peak / level - 1.0).abs() < 0.02), "{peaks:?} of {level}");
    let record = &made("absorber", &brief(0)).records[0];
    assert!(record.channel(Role::Displacement(1)).is_none(), "no sensor sees the absorber");
}
