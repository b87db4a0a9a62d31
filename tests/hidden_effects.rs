//! Hidden effects: the virtual rig hides one from the search, which is given the records alone.
//!
//! The tests that always run are a small part of the study. The whole prints its tables:
//! `cargo test --profile study --no-default-features --test hidden_effects -- --ignored --nocapture`
#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

mod study;

use sindyscope::gap::Verdict;
use sindyscope::rig::hidden::{NoiseKind, Shaking, names, outside_names, pairs};
use study::{Case, cases, confusion, median, miss, of_kind, run, run_all, share, white};

fn one(effect: &str, shaking: Shaking, noise: f64, seed: u64) -> Case {
    let effects = effect.split('+').filter(|e| !e.is_empty()).map(str::to_owned).collect();
    Case { effects, shaking, watching: white(noise), seed, ratio: None }
}

#[test]
fn a_hidden_effect_is_named_and_the_gap_shrinks_to_the_noise() {
    for (effect, seed) in [
        ("coulomb_friction", 0),
        ("cubic_stiffness", 1),
        ("quadratic_damping", 0),
        ("input_delay", 0),
        ("clearance", 0),
        // Of nearly the first one's frequency.
        ("second_mode", 3),
    ] {
        let found = run(&one(effect, Shaking::Multisine, 0.01, seed)).unwrap();
        assert_eq!(
            (found.verdict, found.steps.as_slice()),
            (Verdict::Named, [effect.to_owned()].as_slice()),
            "{effect}"
        );
        // Held-out data of 1500 samples scatter by 2 %; parameters add next to nothing.
        assert!(found.last < 1.1 && found.base > 2.0 * found.last, "{effect}: {} → {} noises", found.base, found.last);
    }
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    for shaking in [Shaking::Multisine, Shaking::SweepPair, Shaking::Tones, Shaking::Decay] {
        let found = run(&one("", shaking, 0.05, 3)).unwrap();
        assert_eq!(found.verdict, Verdict::NothingMissing, "{shaking}: {:?}", found.steps);
    }
}

#[test]
fn two_hidden_at_once_are_both_named() {
    let found = run(&one("cubic_stiffness+coulomb_friction", Shaking::Multisine, 0.01, 0)).unwrap();
    assert!(found.all_found(), "{:?}", found.steps);
    assert!(found.last < 1.1, "{}", found.last);
}

#[test]
fn one_steady_tone_gives_no_confident_wrong_name() {
    for effect in ["quadratic_damping", "cubic_damping", "cubic_stiffness"] {
        let found = run(&one(effect, Shaking::SingleTone, 0.05, 1)).unwrap();
        assert!(!found.named_wrong(), "{effect}: {:?} {:?}", found.verdict, found.steps);
    }
}

#[test]
#[ignore = "the whole study takes an hour or so on two cores, in the profile `study`"]
fn the_whole_study() {
    let single: Vec<Vec<String>> = names().map(|n| vec![n.to_owned()]).collect();
    let noises = [white(0.01), white(0.05)];
    let rich = [Shaking::Multisine, Shaking::SweepPair];
    let all = [Shaking::Multisine, Shaking::SweepPair, Shaking::Tones, Shaking::Decay];
    let results = run_all(&cases(&single, &all, &noises, 0..5));
    println!(
        "Every effect × multisine, sweep pair, tones, decay × noise 1 % and 5 % × 5 draws\n{}",
        confusion(&results)
    );
    let told: Vec<_> = results.iter().filter(|r| r.tellable()).collect();
    let count = |f: &dyn Fn(&study::Result) -> bool| told.iter().filter(|r| f(r)).count();
    told.iter().filter_map(|r| miss(r)).for_each(|line| println!("{line}"));
    println!("data can tell: {} draws", told.len());
    println!("named first     {:5.1} %  (target 92)", share(count(&|r| r.top(1)), told.len()));
    println!("in first three  {:5.1} %  (target 98)", share(count(&|r| r.top(3)), told.len()));
    println!("named but wrong {:5.1} %  (target 1)", share(count(&study::Result::named_wrong), told.len()));
    println!("held-out RMSE   {:5.3} noises, median (target 1.1)", median(told.iter().map(|r| r.last).collect()));
    let far: Vec<_> = told.iter().filter(|r| r.base > 10.0).collect();
    let shrunk = far.iter().filter(|r| r.base / r.last >= 5.0).count();
    println!("5 × smaller     {:5.1} % of {} where the base missed by 10 noises", share(shrunk, far.len()), far.len());
    println!("time            {:5.0} ms, median", median(results.iter().map(|r| r.milliseconds).collect()));

    let nothing = vec![Vec::new()];
    for (words, noise, target) in [
        ("white", vec![white(0.01), white(0.05)], 2),
        ("coloured", vec![of_kind(NoiseKind::Coloured, 0.01), of_kind(NoiseKind::Coloured, 0.05)], 5),
        ("quantised", vec![of_kind(NoiseKind::Quantised, 0.01), of_kind(NoiseKind::Quantised, 0.05)], 5),
    ] {
        let results = run_all(&cases(&nothing, &all, &noise, 100..125));
        let alarms = results.iter().filter(|r| r.verdict != Verdict::NothingMissing).count();
        println!("false alarms, {words} noise: {alarms} of {} (target {target} %)", results.len());
    }
    let outside: Vec<Vec<String>> = outside_names().map(|n| vec![n.to_owned()]).collect();
    let results = run_all(&cases(&outside, &rich, &[white(0.01)], 0..5));
    let unnamed = results.iter().filter(|r| r.verdict != Verdict::Named).count();
    println!(
        "outside the catalogue\n{}left unnamed: {:.0} % (target 80)",
        confusion(&results),
        share(unnamed, results.len())
    );
    let two: Vec<Vec<String>> = pairs().iter().map(|p| p.iter().map(|n| (*n).to_owned()).collect()).collect();
    let results = run_all(&cases(&two, &[Shaking::Multisine], &[white(0.01)], 0..3));
    let found = results.iter().filter(|r| r.all_found()).count();
    println!("two at once: both named in {:.0} % of {} (target 80)", share(found, results.len()), results.len());
    let results = run_all(&cases(&single, &[Shaking::SingleTone], &[white(0.05)], 0..3));
    let wrong = results.iter().filter(|r| r.named_wrong()).count();
    println!("one tone, 5 % noise: named but wrong {wrong} of {} (target 2 %)", results.len());
    assert!(share(count(&study::Result::named_wrong), told.len()) < 5.0, "confident wrong names");
}
