//! What streams may raise over hours, which takes too long beside the unit tests.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use sindyscope_core::study::{AlarmChange, Settings, Smoothing, Stream, StreamSettings};
use sindyscope_rig::{
    Excitation, MeasuredChannel, MeasuredQuantity, Plant, RecordDrive, SampleTimes, Sensor, Sensors, Setup,
};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::{Record, Role};
use sindyscope_values::term::{Term, list};

/// ẍ = −(2π)² x − 0.5 ẋ + u, u a multisine, for 80 s; x with noise.
fn oscillator(seed: u64) -> Record {
    let stiffness = (2.0 * std::f64::consts::PI).powi(2);
    let term = |text: &str| Term::parse(text).unwrap();
    let acceleration = Equation::known([(term("x"), -stiffness), (term("v"), -0.5), (term("u"), 1.0)]);
    let plant = Plant::smooth(Model::second_order(1, vec![acceleration]));
    let drive = Excitation::multisine(8.0, (0.4, 1.6), 40, seed);
    let sampling = SampleTimes { start: 0.0, interval: 0.01, count: 8000 };
    let drive = RecordDrive::new("run", vec![drive], vec![0.0, 0.0], sampling);
    let channel = |name: &str, role, unit: &str, quantity, noise: f64| {
        MeasuredChannel::new(name, role, unit, quantity, Sensor::noisy(noise))
    };
    let x = channel("x", Role::Displacement(0), "m", MeasuredQuantity::State(0), 1e-3);
    let u = channel("u", Role::Input(0), "m/s^2", MeasuredQuantity::Input(0), 0.0);
    let setup = Setup { plant, drives: vec![drive], sensors: Sensors::new([x, u]), seed };
    setup.run().unwrap().records.remove(0)
}

fn settings(false_alarms: f64) -> StreamSettings {
    let smoothing = Smoothing::default().with_window(21);
    let study = Settings { smoothing, terms: list("x, v, u").unwrap(), threshold: 0.01, ..Settings::default() };
    StreamSettings { study, last: 20.0, false_alarms }
}

#[test]
fn streams_without_a_change_raise_no_more_false_alarms_than_allowed() {
    const DRAWS: u64 = 100;
    // Rates so high that a count tells something.
    let rates = [60.0, 6.0];
    let (mut alarms, mut judged) = ([0; 2], 0.0);
    for seed in 0..DRAWS {
        let record = oscillator(1000 + seed);
        for (rate, alarms) in rates.iter().zip(&mut alarms) {
            let mut stream = Stream::new(record.slice(0..2000), settings(*rate)).unwrap();
            let sample = |k: usize| record.channels.iter().map(|c| c.values[k]).collect::<Vec<f64>>();
            let updates: Vec<_> = (0..record.len()).filter_map(|k| stream.push(&sample(k))).collect();
            *alarms += updates.iter().filter(|u| u.change == Some(AlarmChange::Raised)).count();
            if *rate == rates[0] {
                judged += stream.blocking().seconds() * updates.iter().filter(|u| u.judged.is_some()).count() as f64;
            }
        }
    }
    for (rate, alarms) in rates.iter().zip(alarms) {
        let allowed = rate * judged / 3600.0;
        println!("{rate} an hour: {alarms} alarms in {:.2} h, {allowed:.1} allowed", judged / 3600.0);
        // Two standard deviations of a count.
        assert!((alarms as f64) < allowed + 2.0 * allowed.sqrt(), "{alarms} of {allowed}");
    }
    // One that raises none at any rate is no use.
    assert!(alarms[0] > 10, "{alarms:?}");
}
