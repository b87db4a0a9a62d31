//! Several inputs at once: two forces, or a moving base and a force on the mass.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::sync::Arc;

use sindyscope_core::study::{Cancel, calibrate, calibration_list, suggest};
use sindyscope_rig::{Contact, Excitation, Noise, Plant, SampleTimes, Sensor, respond};
use sindyscope_search::{Ask, Diagnosis, Search, Verdict};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};
use sindyscope_values::term::{Kind, Term, list};

const SAMPLING: SampleTimes = SampleTimes { start: 0.0, interval: 0.01, count: 2500 };

/// What the plant's equation is, in terms of x, v, u1 and u2; the inputs' units; how late the second acts, s.
struct Bench {
    terms: &'static [(&'static str, f64)],
    contact: Option<(&'static str, f64)>,
    units: [&'static str; 2],
    levels: [f64; 2],
    late: f64,
}

/// Two forces on a mass at 1.2 Hz.
const FORCES: Bench = Bench {
    terms: &[("x", -56.8), ("v", -0.45), ("u1", 1.0), ("u2", 0.6)],
    contact: None,
    units: ["m/s^2", "m/s^2"],
    levels: [3.0, 2.0],
    late: 0.0,
};

/// A base that moves, and a force on the mass.
const BASE: Bench = Bench {
    terms: &[("x-u1", -56.8), ("v-du1", -0.75), ("u2", 1.0)],
    contact: None,
    units: ["m", "m/s^2"],
    levels: [0.05, 2.0],
    late: 0.0,
};

fn record(bench: &Bench, seed: u64) -> Record {
    let term = |text: &str| Term::parse(text).unwrap();
    let equation = Equation::known(bench.terms.iter().map(|(t, c)| (term(t), *c)));
    let contacts = bench.contact.iter().map(|(velocity, strength)| Contact::coulomb(term(velocity), 1, *strength));
    let plant = Plant { smooth: Model::second_order(2, vec![equation]), contacts: contacts.collect() };
    let [first, second] = bench.levels;
    let recorded =
        [Excitation::multisine(first, (0.2, 3.0), 25, seed), Excitation::multisine(second, (0.3, 4.0), 25, seed + 50)];
    let acting = [recorded[0].clone(), recorded[1].clone().delayed(bench.late)];
    let motion = respond(&plant, &acting, &[0.0, 0.0], &SAMPLING).unwrap();
    let shown = Sensor::noisy(Noise::ShareOfPeak(0.01)).measure(&motion.states[0], seed, 0);
    let channel = |role: Role, unit: &str, values: Vec<f64>| Channel {
        name: role.short_name(),
        unit: unit.into(),
        role,
        values: values.into(),
        estimated: false,
    };
    let mut channels = vec![channel(Role::Displacement(0), "m", shown)];
    for (j, (input, unit)) in recorded.iter().zip(bench.units).enumerate() {
        let values = (0..SAMPLING.count).map(|k| input.at(SAMPLING.time(k)).0[0]).collect();
        channels.push(channel(Role::Input(j), unit, values));
    }
    Record {
        name: format!("run {seed}"),
        source: None,
        start: 0.0,
        interval: SAMPLING.interval,
        channels,
        notices: Vec::new(),
    }
}

fn records(bench: &Bench) -> RecordSet {
    let mut set = RecordSet::new([record(bench, 1)], Usage::Fit);
    set.add([record(bench, 9)], Usage::HeldOut);
    set
}

fn diagnosed(bench: &Bench) -> Diagnosis {
    Search::new(&records(bench), &Ask::default()).unwrap().diagnose(&|_| {}, &Cancel::default()).unwrap()
}

/// The effects found, each with its form and its first parameter.
fn found(diagnosis: &Diagnosis) -> Vec<(String, String, f64)> {
    let last = Arc::clone(diagnosis.stages.last().unwrap());
    let of = |e: &sindyscope_search::Added| (e.choice.effect.clone(), e.choice.form.clone(), e.parameters[0].value);
    last.effects.iter().map(of).collect()
}

#[test]
fn nothing_is_missing_from_two_inputs_that_are_both_in_the_equation() {
    for bench in [&FORCES, &BASE] {
        assert_eq!(diagnosed(bench).verdict, Verdict::NothingMissing);
    }
}

#[test]
fn friction_in_the_joint_is_named_where_a_force_acts_beside_the_base() {
    let diagnosis = diagnosed(&Bench { contact: Some(("v-du1", 0.5)), ..BASE });
    let [(effect, form, friction)] = &found(&diagnosis)[..] else { panic!("{diagnosis:?}") };
    assert_eq!(
        (diagnosis.verdict, effect.as_str(), form.as_str()),
        (Verdict::Named, "coulomb_friction", "in the joint")
    );
    assert!((friction - 0.5).abs() < 0.02, "{friction}");
}

#[test]
fn the_input_that_is_late_is_named() {
    let diagnosis = diagnosed(&Bench { late: 0.03, ..FORCES });
    let [(effect, form, late)] = &found(&diagnosis)[..] else { panic!("{diagnosis:?}") };
    assert_eq!((diagnosis.verdict, effect.as_str(), form.as_str()), (Verdict::Named, "input_delay", "of input 2"));
    assert!((late - 0.03).abs() < 1e-3, "{late}");
}

#[test]
fn the_delays_of_two_inputs_are_found_with_the_equation() {
    // The delay that is sought is that of the record: the second force acts later than it was recorded.
    let records = records(&Bench { late: 0.012, ..FORCES });
    let mut settings = suggest(&records, Kind::SecondOrder).unwrap();
    (settings.terms, settings.threshold, settings.refine) = (list("x, v, u1, u2").unwrap(), 0.0, true);
    let sought = calibration_list("delay(u1), delay(u2)").unwrap();
    let found = calibrate(&records, &settings, &sought, &Cancel::default()).unwrap();
    assert_eq!(found.len(), 2, "{found:?}");
    for (delay, late) in found.iter().zip([0.0, -0.012]) {
        let error = delay.std_error.unwrap();
        assert!((delay.value - late).abs() < 3.0 * error && error < 1e-3, "{found:?}");
    }
}
