//! The base model is a hypothesis: a spring that it was given stands where the data bear it.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use sindyscope_core::study::Cancel;
use sindyscope_rig::hidden::{Hidden, Regime, draw_in};
use sindyscope_rig::{ScenarioOptions, generate};
use sindyscope_search::{Ask, Search, Verdict};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Term, list};

fn has_a_spring(search: &Search) -> bool {
    search.base_terms().any(|term| term.as_str() == "x")
}

/// A search for what a drawn case hides, with a spring in its base besides.
fn with_a_spring(Hidden { fit, held_out, base, .. }: Hidden) -> Search {
    let mut records = RecordSet::new(fit, Usage::Fit);
    records.add(held_out, Usage::HeldOut);
    let base = base.into_iter().flatten().chain([Term::parse("x").unwrap()]).collect();
    Search::new(&records, &Ask { base: Some(base), ..Ask::default() }).unwrap()
}

#[test]
fn what_nothing_holds_is_searched_without_a_spring() {
    // Dry friction and a constant force together; then friction alone, which a spring that pushes would hide.
    assert!(!has_a_spring(&with_a_spring(draw_in(Regime::NoSpring, 7).unwrap())));
    let search = with_a_spring(draw_in(Regime::NoSpring, 1).unwrap());
    assert!(!has_a_spring(&search) && search.notices().any(|notice| notice.contains("without a spring")));
    let diagnosis = search.diagnose(&|_| {}, &Cancel::default()).unwrap();
    let names: Vec<&str> = diagnosis.steps().iter().map(|s| s.added.choice.effect.as_str()).collect();
    assert_eq!((names, diagnosis.verdict), (vec!["coulomb_friction"], Verdict::Named));
}

#[test]
fn a_spring_that_has_a_part_in_the_motion_stays() {
    // Two wells, whose spring pushes; then plants that a spring holds.
    let options = ScenarioOptions { seed: 1, ..ScenarioOptions::default() };
    let records = RecordSet::new(generate("double-well", &options).unwrap().records, Usage::Fit);
    let ask = Ask { base: Some(list("x, v, u").unwrap()), ..Ask::default() };
    assert!(has_a_spring(&Search::new(&records, &ask).unwrap()));
    for seed in 0..6 {
        let Ok(hidden) = draw_in(Regime::Wide, seed) else { continue };
        assert!(has_a_spring(&with_a_spring(hidden)), "seed {seed}");
    }
}
