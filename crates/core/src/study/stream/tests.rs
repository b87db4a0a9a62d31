use super::*;
use crate::signal::mean_and_variance;
use crate::study::{Cancel, Smoothing, Study};
use sindyscope_rig::{
    Excitation, MeasuredChannel, MeasuredQuantity, Plant, RecordDrive, SampleTimes, Sensor, Sensors, Setup, Transition,
};
use sindyscope_values::model::Equation;
use sindyscope_values::term::{Symbol, list};

/// Sampling interval and main period of [`oscillator`], s.
const INTERVAL: f64 = 0.01;
const PERIOD: f64 = 1.0;

/// ẍ = −(2π)² (1 − `drop` w) x − 0.5 ẋ + u, u a multisine, w from 0 to 1 at `at`; x with `noise`.
fn oscillator(seconds: f64, noise: f64, seed: u64, change: Option<(f64, f64)>) -> Record {
    let stiffness = (2.0 * std::f64::consts::PI / PERIOD).powi(2);
    let (at, drop) = change.unwrap_or((1e9, 0.0));
    let term = |text: &str| Term::parse(text).unwrap();
    let acceleration = Equation::known([
        (term("x"), -stiffness),
        (term("x*u2"), drop * stiffness),
        (term("v"), -0.5),
        (term("u1"), 1.0),
    ]);
    let plant = Plant::smooth(Model::second_order(2, vec![acceleration]));
    let drive = Excitation::multisine(8.0, (0.4, 1.6), 40, seed);
    let step = Excitation::transitions(vec![Transition { from: at, duration: 0.2, distance: 1.0 }]);
    let sampling = SampleTimes { start: 0.0, interval: INTERVAL, count: (seconds / INTERVAL).round() as usize };
    let drive = RecordDrive::new("run", vec![drive, step], vec![0.0, 0.0], sampling);
    let channel = |name: &str, role, unit: &str, quantity, noise: f64| {
        MeasuredChannel::new(name, role, unit, quantity, Sensor::noisy(noise))
    };
    let x = channel("x", Role::Displacement(0), "m", MeasuredQuantity::State(0), noise);
    let u = channel("u", Role::Input(0), "m/s^2", MeasuredQuantity::Input(0), 0.0);
    let setup = Setup { plant, drives: vec![drive], sensors: Sensors::new([x, u]), seed };
    setup.run().unwrap().records.remove(0)
}

fn study(terms: &str) -> Settings {
    let smoothing = Smoothing::default().with_window(21);
    Settings { smoothing, terms: list(terms).unwrap(), threshold: 0.01, ..Settings::default() }
}

fn settings(terms: &str, last: f64) -> StreamSettings {
    StreamSettings { study: study(terms), last, false_alarms: 0.1 }
}

pub(super) fn sample(record: &Record, k: usize) -> Vec<f64> {
    record.channels.iter().map(|c| c.values[k]).collect()
}

pub(super) fn pushed(stream: &mut Stream, record: &Record, range: std::ops::Range<usize>) -> Vec<StreamUpdate> {
    range.filter_map(|k| stream.push(&sample(record, k))).collect()
}

/// The coefficients of a study of records.
fn studied(records: Vec<Record>, terms: &str) -> Model {
    let set = RecordSet::new(records, Usage::Fit);
    Study::default().run(&set, &study(terms), &Cancel::default()).unwrap().model
}

fn assert_same(a: &Model, b: &Model) {
    for (a, b) in a.equations.iter().zip(&b.equations) {
        assert_eq!(a.terms.len(), b.terms.len(), "{a:?} {b:?}");
        for (a, b) in a.terms.iter().zip(&b.terms) {
            assert_eq!(a.term, b.term);
            assert!((a.coefficient / b.coefficient - 1.0).abs() < 1e-9, "{} {}", a.coefficient, b.coefficient);
        }
    }
}

/// Library with more than what is there.
const TERMS: &str = "x, v, u, x^3, v*|v|, 1";

#[test]
fn the_coefficients_are_those_of_a_study_of_the_same_samples() {
    let record = oscillator(40.0, 1e-4, 3, None);
    let mut stream = Stream::new(record.slice(0..2000), settings(TERMS, 20.0)).unwrap();
    let Blocking { rows, stride, margin, kept, .. } = stream.blocking();
    let updates = pushed(&mut stream, &record, 0..record.len());
    assert_eq!(updates.len(), (record.len() - 2 * margin * stride) / (rows * stride));
    for count in [1, 2, 7, kept, kept + 5] {
        let first = count.saturating_sub(kept) * rows * stride;
        let slice = record.slice(first..count * rows * stride + 2 * margin * stride);
        // A study of a record of less than eight margins spares less of its ends.
        if slice.len() >= 8 * margin * stride {
            assert_same(&updates[count - 1].model, &studied(vec![slice], TERMS));
        }
    }
}

#[test]
fn nothing_is_differenced_over_a_gap_and_no_row_around_it_is_lost() {
    let record = oscillator(30.0, 1e-4, 4, None);
    let (a, b) = (record.slice(0..1337), record.slice(1500..2800));
    let mut stream = Stream::new(record.slice(0..1337), settings(TERMS, 60.0)).unwrap();
    pushed(&mut stream, &record, 0..1337);
    stream.begin(record.time(1500));
    pushed(&mut stream, &record, 1500..2800);
    let last = stream.end().unwrap();
    assert_same(&last.model, &studied(vec![a.clone(), b.clone()], TERMS));
    let rows = |record: &Record| record.len() - 2 * stream.blocking().margin * stream.blocking().stride;
    assert!((last.covered - INTERVAL * (rows(&a) + rows(&b)) as f64).abs() < 2.5 * INTERVAL * 3.0, "{}", last.covered);

    // Rows that are not numbers are such a gap.
    let mut broken = Stream::new(record.slice(0..1337), settings(TERMS, 60.0)).unwrap();
    pushed(&mut broken, &record, 0..1337);
    for _ in 1337..1500 {
        broken.push(&[f64::NAN, 0.0]);
    }
    pushed(&mut broken, &record, 1500..2800);
    let other = broken.end().unwrap();
    assert_same(&other.model, &last.model);
    assert!((other.time - last.time).abs() < 1e-9, "{} {}", other.time, last.time);
}

#[test]
fn the_scatter_of_blocks_tells_how_uncertain_coefficients_are() {
    // Scatter over draws against what each says of itself.
    let (mut values, mut errors) = (Vec::new(), Vec::new());
    for seed in 0..24 {
        let record = oscillator(30.0, 1e-3, 100 + seed, None);
        let mut stream = Stream::new(record.slice(0..2000), settings("x, v, u", 25.0)).unwrap();
        let last = pushed(&mut stream, &record, 0..record.len()).pop().unwrap();
        let x = &last.model.leading().unwrap().terms[0];
        values.push(x.coefficient);
        errors.push(x.std_error.unwrap());
    }
    let scatter = mean_and_variance(&values).1.sqrt();
    let told = errors.iter().sum::<f64>() / errors.len() as f64;
    // A standard deviation from 24 draws is known to 15 %.
    assert!((0.6..1.7).contains(&(told / scatter)), "told {told}, scatter {scatter}");
}

/// Periods after which a stiffness that fell by 5 % must be told.
const MAX_PERIODS: f64 = 4.0;

#[test]
fn a_stiffness_that_falls_by_five_percent_is_told_within_four_periods_and_learned() {
    for seed in 0..6 {
        let record = oscillator(100.0, 1e-3, 200 + seed, Some((40.0, 0.05)));
        let mut stream = Stream::new(record.slice(0..2000), settings("x, v, u", 20.0)).unwrap();
        let updates = pushed(&mut stream, &record, 0..record.len());
        let raised: Vec<&StreamUpdate> = updates.iter().filter(|u| u.change == Some(AlarmChange::Raised)).collect();
        let first = raised.first().expect("it is told");
        assert!(first.time > 40.0 && first.time < 40.2 + MAX_PERIODS * PERIOD, "seed {seed}: at {}", first.time);
        let cause = &first.alarm.as_ref().unwrap().cause;
        if let AlarmCause::Coefficient { state, term, before, after } = cause {
            assert_eq!(*state, Symbol::Rate(0));
            if term.as_str() == "x" {
                assert!(after > before, "softer: {before} {after}");
            }
        }
        // Once the last twenty seconds are all of the softer spring, they are the measure.
        let cleared = updates.iter().find(|u| matches!(u.change, Some(AlarmChange::Cleared(_)))).expect("it ends");
        assert_eq!(cleared.change, Some(AlarmChange::Cleared(Cleared::Relearned)), "seed {seed}");
        assert!(cleared.time < first.time + 22.0, "{}", cleared.time);
        assert_eq!(raised.len(), 1, "seed {seed}: {:?}", raised.iter().map(|u| u.time).collect::<Vec<_>>());
        let stiffness = updates.last().unwrap().model.leading().unwrap().terms[0].coefficient;
        let truth = -0.95 * (2.0 * std::f64::consts::PI / PERIOD).powi(2);
        assert!((stiffness / truth - 1.0).abs() < 0.02, "{stiffness} {truth}");
    }
}

#[test]
fn an_alarm_ends_when_the_model_from_before_explains_what_arrives_again() {
    let record = oscillator(60.0, 1e-3, 9, None);
    let mut stream = Stream::new(record.slice(0..2000), settings("x, v, u", 20.0)).unwrap();
    let mut changes = Vec::new();
    for k in 0..record.len() {
        let mut sample = sample(&record, k);
        // Somebody knocks at the sensor for half a second.
        if (4000..4050).contains(&k) {
            sample[0] += 0.05 * (0.9 * k as f64).sin();
        }
        changes.extend(stream.push(&sample).and_then(|u| u.change.map(|change| (change, u.time))));
    }
    assert_eq!(changes.len(), 2, "{changes:?}");
    assert_eq!(changes[0].0, AlarmChange::Raised);
    assert!(changes[0].1 > 39.5 && changes[0].1 < 41.5, "{changes:?}");
    assert_eq!(changes[1].0, AlarmChange::Cleared(Cleared::Returned));
    assert!(changes[1].1 < 46.0, "{changes:?}");
}

#[test]
fn what_a_stream_cannot_be_studied_with_is_refused_in_a_sentence() {
    let record = oscillator(20.0, 1e-4, 1, None);
    let refused = |change: &dyn Fn(&mut StreamSettings)| {
        let mut settings = settings(TERMS, 20.0);
        change(&mut settings);
        Stream::new(record.clone(), settings).expect_err("refused").to_string()
    };
    assert!(refused(&|s| s.last = 3.0).contains("where 8 are needed"), "{}", refused(&|s| s.last = 3.0));
    assert!(refused(&|s| s.study.smoothing.method = crate::signal::Differentiation::Kalman).contains("segments"));
    assert!(refused(&|s| s.study.form = Formulation::Integral).contains("integrated"));
    assert!(refused(&|s| s.study.refine = true).contains("refinement"));
    assert!(refused(&|s| s.study.terms.clear()).contains("empty"));
}
