//! Components drawn by the virtual rig: what they hide is named, and nothing is named where nothing hides.

use sindyscope_component::{ComponentDiagnosis, Specimen, diagnose};
use sindyscope_core::study::Cancel;
use sindyscope_rig::{ComponentOptions, component_effects, component_records};
use sindyscope_values::record::{RecordSet, Usage};

fn found(effect: &str, seed: u64) -> ComponentDiagnosis {
    let options = ComponentOptions { seed, effect: Some(effect.into()), ..ComponentOptions::default() };
    let (drawn, _) = component_records(&options).expect("a component");
    let mut records = RecordSet::new(drawn[..1].iter().cloned(), Usage::Fit);
    records.add(drawn[1..].iter().cloned(), Usage::HeldOut);
    let specimen = Specimen::new(&records, None, &Cancel::default()).expect("a component");
    diagnose(&specimen, None, 2, &|_, _| {}, &Cancel::default()).expect("a diagnosis")
}

/// How many of the draws of each kind are named first, and how many get another name that is said to explain them.
fn named(draws: u64, first_seed: u64) -> (usize, usize, usize) {
    let (mut right, mut wrong, mut all) = (0, 0, 0);
    for name in component_effects().skip(1) {
        let (mut own_right, mut own_wrong) = (0, 0);
        for seed in first_seed..first_seed + draws {
            let diagnosis = found(name, seed);
            let first = diagnosis.steps.first();
            let is_right = first.is_some_and(|s| s.effect == name);
            let is_wrong = !is_right && diagnosis.verdict() == "named";
            own_right += usize::from(is_right);
            own_wrong += usize::from(is_wrong);
            if !is_right {
                let told: Vec<_> = diagnosis
                    .steps
                    .iter()
                    .map(|s| (s.effect, s.form, s.rivals.iter().map(|r| r.effect).collect::<Vec<_>>()))
                    .collect();
                println!("  {name} {seed}: {} {told:?}, {:.2} noises", diagnosis.verdict(), diagnosis.noises);
            }
        }
        println!("{name}: first in {own_right} of {draws}, wrongly named {own_wrong}");
        right += own_right;
        wrong += own_wrong;
        all += draws as usize;
    }
    (right, wrong, all)
}

/// How many draws with nothing hidden get a name.
fn false_alarms(draws: u64, first_seed: u64) -> usize {
    let alarm = |seed: &u64| {
        let diagnosis = found("nothing", *seed);
        let told: Vec<_> = diagnosis.steps.iter().map(|s| (s.effect, s.form)).collect();
        if !told.is_empty() {
            println!("  nothing hidden, {seed}: {} {told:?}, {:.2} noises", diagnosis.verdict(), diagnosis.noises);
        }
        !told.is_empty()
    };
    (first_seed..first_seed + draws).filter(alarm).count()
}

#[test]
fn what_a_component_hides_is_named_first() {
    let (right, wrong, all) = named(2, 100);
    assert!(right >= all - 1, "{right} of {all}");
    assert_eq!(wrong, 0);
}

#[test]
fn nothing_is_named_where_nothing_hides() {
    assert_eq!(false_alarms(10, 100), 0);
}

#[test]
#[ignore = "minutes where tests are not optimised; run with --profile study"]
fn drawn_components_are_named_and_linear_ones_are_not() {
    let (right, wrong, all) = named(20, 0);
    let alarms = false_alarms(200, 0);
    println!("named first {right} of {all}, wrongly {wrong}; false alarms {alarms} of 200");
    assert!(right as f64 >= 0.95 * all as f64 && wrong as f64 <= 0.01 * all as f64 && alarms <= 2);
}
