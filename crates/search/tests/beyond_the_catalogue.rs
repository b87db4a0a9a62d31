//! Forces that the catalogue does not have: described by a formula, or named by an entry of the user's own.

#[path = "study/plant.rs"]
mod plant;

use std::f64::consts::TAU;
use std::sync::Arc;

use plant::motion;
use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal, Uniform};
use rand_pcg::Pcg64;
use sindyscope_core::study::Cancel;
use sindyscope_search::{
    Ask, DESCRIPTION, Diagnosis, Found, GapError, OwnEffect, OwnQuantity, OwnState, OwnTerm, Search, Verdict,
};
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};

const INTERVAL: f64 = 0.12;

/// Two records to fit and one held out of an oscillator with a force over displacement, velocity and input, noise 1 %; it is
/// integrated by Runge and Kutta's method of fourth order.
fn records(force: impl Fn(f64, f64, f64) -> f64) -> RecordSet {
    records_with_state(|x, v, u, _| force(x, v, u), |_, _, _| 0.0)
}

/// The same with a state that no sensor shows: the force has it, and its rate is one over displacement, velocity and itself.
fn records_with_state(
    force: impl Fn(f64, f64, f64, f64) -> f64,
    state_rate: impl Fn(f64, f64, f64) -> f64,
) -> RecordSet {
    let mut set = RecordSet::default();
    for (seed, usage) in [(1, Usage::Fit), (2, Usage::Fit), (3, Usage::HeldOut)] {
        let mut random = Pcg64::seed_from_u64(seed);
        let phase = Uniform::new(0.0, TAU).expect("a range");
        let lines: Vec<(f64, f64)> = (0..16).map(|k| (0.3 + 0.14 * f64::from(k), phase.sample(&mut random))).collect();
        let u = |t: f64| lines.iter().map(|(w, p)| 0.078 * (w * t + p).cos()).sum::<f64>();
        let rate = |t: f64, [x, v, z]: [f64; 3]| [v, u(t) - x - 0.05 * v + force(x, v, u(t), z), state_rate(x, v, z)];
        let motion = motion(rate, [0.0; 3], INTERVAL, 1200);
        let input = (0..motion.len()).map(|n| u(INTERVAL * n as f64)).collect();
        set.entries.push((Arc::new(record(seed, INTERVAL, &motion, Some(input), &mut random)), usage));
    }
    set
}

/// What sensors show of a motion, with noise of 1 %.
fn record(seed: u64, interval: f64, motion: &[f64], input: Option<Vec<f64>>, random: &mut Pcg64) -> Record {
    let size = (motion.iter().map(|x| x * x).sum::<f64>() / motion.len() as f64).sqrt();
    let noise = Normal::new(0.0, 0.01 * size).expect("a deviation");
    let channel = |role: Role, name: &str, unit: &str, values: Vec<f64>| Channel {
        role,
        name: name.into(),
        unit: unit.into(),
        values: values.into(),
        estimated: false,
    };
    let shown = motion.iter().map(|x| x + noise.sample(random)).collect();
    let displacement = channel(Role::Displacement(0), "x", "mm", shown);
    let input = input.map(|input| channel(Role::Input(0), "u", "N", input));
    Record {
        name: format!("run {seed}"),
        start: 0.0,
        interval,
        channels: std::iter::once(displacement).chain(input).collect(),
        source: None,
        notices: Vec::new(),
    }
}

fn diagnosed(records: &RecordSet, effects: Vec<OwnEffect>) -> Diagnosis {
    let ask = Ask { effects, ..Ask::default() };
    let search = Search::new(records, &ask).expect("records");
    search.diagnose(&|_| {}, &Cancel::default()).expect("a walk")
}

/// The effects that were named.
fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.steps().iter().map(|s| s.added.choice.effect.as_str()).collect()
}

fn magnet() -> OwnEffect {
    OwnEffect {
        name: "magnetic_pull".into(),
        words: "A magnet pulls the harder the nearer the mass comes.".into(),
        terms: vec![OwnTerm { text: "1/(d-r)^2".into(), coefficient: "k_m".into(), ..OwnTerm::default() }],
        inner: vec![OwnQuantity { name: "d".into(), bounds: (1.9e-3, 8e-3), unit: "m".into() }],
        ..OwnEffect::default()
    }
}

#[test]
fn a_curve_that_only_two_of_free_shape_follow_is_not_named() {
    // Toda's oscillator: an exponential spring, which no entry is.
    let diagnosis = diagnosed(&records(|x, _, _| x - (4.0 * x).exp_m1() / 4.0), Vec::new());
    assert_ne!(diagnosis.verdict, Verdict::Named, "{}", diagnosis.sentence);
}

#[test]
fn a_force_without_a_name_is_described_by_the_shortest_formula() {
    let records = records(|_, v, u| 0.5 * v * u);
    let found = diagnosed(&records, Vec::new());
    let description = found.description.as_ref().expect("a description");
    assert_eq!(description.terms, ["v*u"]);
    assert!(description.closes && description.lead.is_more_than(5.0));
    assert!(description.sentence.contains("A description, not a law"), "{}", description.sentence);
    let gap = |stage: &sindyscope_search::Stage| stage.gap.test_rmse.expect("held out");
    assert!(gap(&description.stage) < 0.5 * gap(found.stages.last().expect("a model")));
    assert_eq!(description.scores.len(), 3);
    // The band of its force is that of its one coefficient.
    let coefficient = &description.stage.effects[0].parameters[0];
    let share = coefficient.std_error.expect("an error") / coefficient.value.abs();
    assert!((coefficient.value - 0.5).abs() < 4.0 * share * 0.5 && share < 0.05, "{coefficient:?}");
    let curve = &description.curve;
    assert!(["v", "u"].contains(&curve.axis.as_str()) && curve.effect.len() > 100, "{}", curve.axis);
    assert_eq!(curve.deviation.len(), curve.effect.len());
    for ([_, force], error) in curve.effect.iter().zip(&curve.deviation) {
        assert!((error - share * force.abs()).abs() < 1e-6 * error.abs() + 1e-12, "{error} {force}");
    }
    // It is added as an effect is, and comes back with a walk that was kept.
    let search = Search::new(&records, &Ask::default()).expect("records");
    let cancel = Cancel::default();
    let choice = description.stage.effects[0].choice.clone();
    assert_eq!((choice.effect.as_str(), choice.form.as_str()), (DESCRIPTION, "v*u"));
    let stage = search.stage(std::slice::from_ref(&choice), &cancel).expect("a stage");
    assert!((gap(&stage) / gap(&description.stage) - 1.0).abs() < 0.02);
    let base = search.base(&cancel).expect("a base");
    let round = search.look(&base, &|_| {}, &cancel).expect("a look");
    let concluded = search.conclude(vec![round.clone()], vec![Arc::clone(&base)], &cancel).expect("a conclusion");
    let rounds = [(Vec::new(), Arc::new(round))].into();
    let conclusions = [(Vec::new(), Arc::new(concluded))].into();
    let kept = Found::new((Found::records_of(&records), None), &[(Vec::new(), base)].into(), &rounds, &conclusions);
    let restored = search.restore(&kept, &cancel).expect("not cancelled").expect("the same");
    let (before, after) = (&conclusions[&Vec::new()].description, &restored.conclusions[&Vec::new()].description);
    assert_eq!(before.as_ref().map(|d| &d.terms), after.as_ref().map(|d| &d.terms));
    assert_eq!(before.as_ref().map(|d| &d.curve), after.as_ref().map(|d| &d.curve));
}

#[test]
fn two_effects_are_not_named_where_one_term_says_more() {
    // Wing rock: damping that goes with the magnitude of the roll angle, which no entry is.
    let wing = |_: f64, [x, v, _]: [f64; 3]| [v, -26.0 * x + 0.76 * v - 2.9 * x.abs() * v, 0.0];
    let mut records = RecordSet::default();
    for (seed, roll, usage) in [(1, 0.09, Usage::Fit), (2, 0.11, Usage::HeldOut)] {
        let motion = motion(wing, [roll, 0.0, 0.0], 0.02, 2500);
        let record = record(seed, 0.02, &motion, None, &mut Pcg64::seed_from_u64(seed));
        records.entries.push((Arc::new(record), usage));
    }
    let diagnosis = diagnosed(&records, Vec::new());
    assert_eq!(diagnosis.verdict, Verdict::Unexplained, "{}", diagnosis.sentence);
    let description = diagnosis.description.as_ref().expect("a description");
    assert_eq!(description.terms, ["v*|x|"]);
    assert!(diagnosis.sentence.contains("A formula with fewer terms"), "{}", diagnosis.sentence);
}

#[test]
fn nothing_is_described_where_nothing_is_missing_or_a_name_is_found() {
    let still = diagnosed(&records(|_, _, _| 0.0), Vec::new());
    assert_eq!((still.verdict, still.description), (Verdict::NothingMissing, None));
    let hardening = diagnosed(&records(|x, _, _| -0.3 * x * x * x), Vec::new());
    assert_eq!((names(&hardening), &hardening.description), (vec!["cubic_stiffness"], &None));
}

#[test]
fn a_force_that_only_the_users_entry_knows_is_named() {
    let records = records(|x, _, _| 0.3 / (3.0 - x).powi(2));
    let found = diagnosed(&records, vec![magnet()]);
    assert_eq!((found.verdict, names(&found)), (Verdict::Named, vec!["magnetic_pull"]), "{}", found.sentence);
    let steps = found.steps();
    let added = steps[0].added;
    assert_eq!((added.title.as_str(), steps[0].candidate.explanation), ("Magnetic pull", magnet().words.as_str()));
    let of = |name: &str| added.parameters.iter().find(|p| p.name == name).expect("a parameter");
    // The entry's metres are the records' millimetres.
    assert_eq!(of("d").unit, "mm");
    assert!((of("d").value - 3.0).abs() < 0.2 && (of("k_m").value - 0.3).abs() < 0.1, "{:?}", added.parameters);
}

#[test]
fn an_entry_with_a_state_of_its_own_is_named_with_its_time_constant() {
    // A spring that softens as it is warmed by its motion, and cools down.
    let softening = OwnEffect {
        name: "softening_by_heat".into(),
        words: "Motion warms the spring, a warm spring is softer, and it cools down again.".into(),
        terms: vec![OwnTerm { text: "z*r".into(), coefficient: "k_t".into(), ..OwnTerm::default() }],
        states: vec![OwnState { name: "z".into(), rate: "w^2 - z/tau".into() }],
        inner: vec![OwnQuantity { name: "tau".into(), bounds: (2.0, 60.0), unit: "s".into() }],
        ..OwnEffect::default()
    };
    let records = records_with_state(|x, _, _, z| 0.02 * z * x, |_, v, z| v * v - z / 12.0);
    let found = diagnosed(&records, vec![softening]);
    assert_eq!((found.verdict, names(&found)), (Verdict::Named, vec!["softening_by_heat"]), "{}", found.sentence);
    let added = found.steps()[0].added;
    let of = |name: &str| added.parameters.iter().find(|p| p.name == name).expect("a parameter").value;
    assert!((of("tau") / 12.0 - 1.0).abs() < 0.1 && (of("k_t") / 0.02 - 1.0).abs() < 0.1, "{:?}", added.parameters);
}

#[test]
fn an_entry_that_the_records_cannot_have_is_refused() {
    let records = records(|_, _, _| 0.0);
    let with = |change: fn(&mut OwnEffect)| {
        let mut effect = magnet();
        change(&mut effect);
        Search::new(&records, &Ask { effects: vec![effect], ..Ask::default() }).err()
    };
    assert_eq!(with(|_| ()), None);
    let said = |e: Option<GapError>| e.expect("an error").to_string();
    assert!(said(with(|e| e.terms[0].text = "u2/(d-x)".into())).contains("no u2"));
    assert!(said(with(|e| e.mass = 1)).contains("mass 2"));
    assert!(said(with(|e| e.name = "clearance".into())).contains("already"));
}
