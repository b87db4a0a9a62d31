//! A walk in *What's missing* is kept as text, and is whole again when the text is read: nothing is searched for anew.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use sindyscope_core::study::Cancel;
use sindyscope_files::{ReadOptions, read_text, write_csv};
use sindyscope_rig::hidden::{ExcitationKind, HiddenRequest, Regime, draw, draw_in};
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_search::{Ask, Choice, Diagnosis, Found, Restored, Round, Search, Stage};
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::Term;

/// Bytes of text that one look may take with its stages.
const MOST: usize = 100_000;

struct Case {
    records: RecordSet,
    base: Option<Vec<Term>>,
}

fn hidden(hidden: sindyscope_rig::hidden::Hidden) -> Case {
    let mut records = RecordSet::new(hidden.fit, Usage::Fit);
    records.add(hidden.held_out, Usage::HeldOut);
    Case { records, base: hidden.base }
}

fn of_the_catalogue(effect: &str, seed: u64) -> Case {
    let request = HiddenRequest { samples: 1200, ..HiddenRequest::new([effect], ExcitationKind::Multisine, seed) };
    hidden(draw(&request).unwrap())
}

fn of_the_rig(scenario: &str, measure: &str, (duration, rate): (f64, f64)) -> Case {
    let record = |seed| -> Vec<Record> {
        let measure = Some(vec![measure.to_owned()]);
        let (duration, rate) = (Some(duration), Some(rate));
        let options = ScenarioOptions { seed, measure, duration, rate, ..ScenarioOptions::default() };
        let made = generate(scenario, &options).unwrap();
        // Reading makes displacements of what an accelerometer shows.
        let mut text = Vec::new();
        write_csv(&made.records[..1], &mut text, &made.comments).unwrap();
        read_text(&format!("record {seed}.csv"), text, &ReadOptions::default()).unwrap()
    };
    let mut records = RecordSet::new(record(1), Usage::Fit);
    records.add(record(2), Usage::HeldOut);
    Case { records, base: None }
}

/// A walk as a person makes it: a look, the first candidate accepted, what that came to, another look.
fn walked(case: &Case) -> (Found, Restored) {
    let cancel = Cancel::default();
    let ask = Ask { base: case.base.clone(), ..Ask::default() };
    let search = Search::new(&case.records, &ask).unwrap();
    let mut stages: HashMap<Vec<Choice>, Arc<Stage>> = HashMap::new();
    let mut rounds: HashMap<Vec<Choice>, Arc<Round>> = HashMap::new();
    let mut conclusions: HashMap<Vec<Choice>, Arc<Diagnosis>> = HashMap::new();
    let mut accepted: Vec<Choice> = Vec::new();
    for _ in 0..2 {
        for n in 0..=accepted.len() {
            stages.insert(accepted[..n].to_vec(), search.stage(&accepted[..n], &cancel).unwrap());
        }
        let round = search.look(&stages[&accepted], &|_| {}, &cancel).unwrap();
        for stage in round.candidates.iter().filter_map(|c| c.stage.as_ref()) {
            let choices = stage.effects.iter().map(|e| e.choice.clone()).collect();
            stages.entry(choices).or_insert_with(|| Arc::clone(stage));
        }
        rounds.insert(accepted.clone(), Arc::new(round));
        let prefixes = |n: usize| accepted[..n].to_vec();
        let looked = (0..=accepted.len()).map(|n| Round::clone(&rounds[&prefixes(n)])).collect();
        let chain = (0..=accepted.len()).map(|n| Arc::clone(&stages[&prefixes(n)])).collect();
        conclusions.insert(accepted.clone(), Arc::new(search.conclude(looked, chain, &cancel).unwrap()));
        let first = &rounds[&accepted].candidates[0];
        let Some(stage) = first.stage.as_ref().filter(|_| accepted.is_empty()) else { break };
        accepted = stage.effects.iter().map(|e| e.choice.clone()).collect();
    }
    let of = (Found::records_of(&case.records), case.base.clone());
    (Found::new(of, &stages, &rounds, &conclusions), Restored { stages, rounds, conclusions })
}

/// The walk after its text was read, by a search that knows nothing of it.
fn again(case: &Case, found: &Found) -> Restored {
    let text = serde_json::to_string_pretty(found).unwrap();
    let read: Found = serde_json::from_str(&text).unwrap();
    assert_eq!(read, *found);
    assert!(read.is_of(&Found::records_of(&case.records), case.base.as_deref()));
    let search = Search::new(&case.records, &Ask { base: case.base.clone(), ..Ask::default() }).unwrap();
    let started = Instant::now();
    let restored = search.restore(&read, &Cancel::default()).unwrap().expect("the walk is as it was");
    eprintln!("{} lines, {} bytes, {:.0?}", text.lines().count(), text.len(), started.elapsed());
    restored
}

/// Alike to the last bit; what is not a number is equal to itself here.
fn assert_same<T: std::fmt::Debug>(name: &str, one: &HashMap<Vec<Choice>, T>, other: &HashMap<Vec<Choice>, T>) {
    assert_eq!(one.len(), other.len(), "{name}");
    for (effects, value) in one {
        let (before, after) = (format!("{value:#?}"), format!("{:#?}", other[effects]));
        let differs = before.lines().zip(after.lines()).position(|(a, b)| a != b);
        let around = |text: &str| {
            let first = differs.unwrap_or(0).saturating_sub(6);
            text.lines().skip(first).take(8).collect::<Vec<_>>().join("\n")
        };
        assert!(before == after, "{name} {effects:?}\n{}\nis now\n{}", around(&before), around(&after));
    }
}

fn assert_comes_back(case: &Case) {
    let (found, before) = walked(case);
    let after = again(case, &found);
    assert_same("stage", &before.stages, &after.stages);
    assert_same("round", &before.rounds, &after.rounds);
    assert_same("conclusion", &before.conclusions, &after.conclusions);
    assert_eq!(Found::new(of(case), &after.stages, &after.rounds, &after.conclusions), found, "saved again");
    let bytes = serde_json::to_string_pretty(&found).unwrap().len();
    assert!(bytes < MOST * before.rounds.len(), "{bytes} bytes");
}

fn of(case: &Case) -> (String, Option<Vec<Term>>) {
    (Found::records_of(&case.records), case.base.clone())
}

#[test]
fn a_walk_comes_back_to_the_last_bit() {
    for effect in ["coulomb_friction", "clearance"] {
        assert_comes_back(&of_the_catalogue(effect, 1));
    }
}

#[test]
fn one_with_states_of_its_own_or_an_effect_on_input_or_sensor_does_too() {
    for effect in ["bouc_wen_hysteresis", "input_delay", "sensor_clipping", "sensor_offset"] {
        assert_comes_back(&of_the_catalogue(effect, 2));
    }
}

#[test]
fn one_along_short_stretches_does_too() {
    assert_comes_back(&hidden(draw_in(Regime::Sticking, 3).unwrap()));
}

#[test]
fn one_of_several_masses_and_of_an_accelerometer_does_too() {
    assert_comes_back(&of_the_rig("two-masses", "x", (12.0, 100.0)));
    assert_comes_back(&of_the_rig("duffing-multisine", "a", (60.0, 10.0)));
}

#[test]
fn one_that_counts_from_another_zero_comes_back_but_for_rounding() {
    let case = hidden(draw_in(Regime::Datum, 1).unwrap());
    let (found, before) = walked(&case);
    let after = again(&case, &found);
    for (effects, stage) in &before.stages {
        for (one, other) in stage.traces.iter().zip(&after.stages[effects].traces) {
            let largest = one.simulated.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let apart = one.simulated.iter().zip(&*other.simulated).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(one.simulated.len() == other.simulated.len() && apart < 1e-6 * largest, "{effects:?}: {apart}");
        }
    }
    for (effects, round) in &before.rounds {
        let other = &after.rounds[effects];
        assert_eq!((&round.place.sentence, &round.finding), (&other.place.sentence, &other.finding));
    }
}

#[test]
fn a_walk_of_other_records_or_another_base_is_not_taken_for_theirs() {
    let case = of_the_catalogue("cubic_stiffness", 3);
    let records = Found::records_of(&case.records);
    let (stages, rounds, conclusions) = (HashMap::new(), HashMap::new(), HashMap::new());
    let found = Found::new((records.clone(), None), &stages, &rounds, &conclusions);
    assert!(found.is_of(&records, None));
    assert!(!found.is_of(&records, Some(&[Term::parse("x").unwrap()])));
    let mut other = case.records.clone();
    other.entries[0].1 = Usage::HeldOut;
    assert!(!found.is_of(&Found::records_of(&other), None), "another use");
    let mut record = Record::clone(&case.records.entries[0].0);
    record.channels[0].values = record.channels[0].values.iter().map(|x| x * (1.0 + 1e-12)).collect();
    let other = RecordSet::new([record], Usage::Fit);
    assert!(!found.is_of(&Found::records_of(&other), None), "other values");
    assert!(!Found::default().is_of(&records, None), "what could not be read is of no records");
}
