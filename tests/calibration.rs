//! Do intervals hold the truth as often as they say, where motion sticks, and where a free run predicts for a while alone?

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use sindyscope_core::study::{Cancel, Own, Settings, Study, suggest};
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_values::model::Model;
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Kind, Term, list};

/// Standard errors on either side that hold the truth in 95 of 100.
const WIDTH: f64 = 1.96;

/// Refined coefficients of some draws with 1 % of noise: how many of their 95 % intervals hold the truth, of how many.
fn held(
    (scenario, kind): (&str, Kind),
    draws: u64,
    options: &ScenarioOptions,
    ask: &dyn Fn(&mut Settings),
    truth: &dyn Fn(&Model, usize, &Term) -> f64,
) -> (usize, usize) {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..draws {
        let made =
            generate(scenario, &ScenarioOptions { seed, noise: Some(Noise::ShareOfPeak(0.01)), ..options.clone() })
                .unwrap();
        let records = RecordSet::new(made.records, Usage::Fit);
        let mut settings = suggest(&records, kind).unwrap();
        (settings.threshold, settings.refine) = (0.0, true);
        ask(&mut settings);
        let outcome = Study::default().run(&records, &settings, &Cancel::default()).unwrap();
        let first = outcome.model.layout.states() - outcome.model.layout.freedoms;
        for (state, equation) in outcome.model.equations.iter().enumerate().skip(first) {
            for term in &equation.terms {
                let off = (term.coefficient - truth(&made.truth.model(), state, &term.term)) / term.std_error.unwrap();
                inside += usize::from(off.abs() < WIDTH);
                all += 1;
            }
        }
    }
    println!("{scenario}: {inside} of {all} intervals of 95 % hold the truth");
    (inside, all)
}

fn asserted((inside, all): (usize, usize)) {
    let share = inside as f64 / all as f64;
    assert!((0.90..=0.98).contains(&share), "{inside} of {all}");
}

#[test]
#[ignore = "minutes where tests are not optimised; run with --profile study"]
fn intervals_hold_where_the_mass_sticks() {
    let options = ScenarioOptions {
        duration: Some(8.0),
        rate: Some(250.0),
        parameters: vec![("static".to_owned(), 1.0)],
        ..ScenarioOptions::default()
    };
    let ask = |settings: &mut Settings| {
        settings.terms = list("x-u, v-du, sgn(v)").unwrap();
        (settings.smoothing.window, settings.smoothing.order) = (9, 3);
    };
    let truth = |truth: &Model, state: usize, term: &Term| {
        let own = match term.as_str() {
            "x-u" => "x",
            "v-du" => "v",
            other => other,
        };
        truth.equations[state].coefficient(&Term::parse(own).unwrap()).unwrap()
    };
    asserted(held(("stick-slip", Kind::SecondOrder), 60, &options, &ask, &truth));
}

#[test]
#[ignore = "minutes where tests are not optimised; run with --profile study"]
fn intervals_hold_where_a_chaotic_motion_is_fitted_to_its_horizon() {
    let options = ScenarioOptions { duration: Some(12.0), ..ScenarioOptions::default() };
    let ask = |settings: &mut Settings| {
        let own = |terms: &str| Own { terms: Some(list(terms).unwrap()), ..Own::default() };
        settings.own = [(0, own("x1, x2")), (1, own("x1, x2, x1*x3")), (2, own("x3, x1*x2"))].into();
        (settings.smoothing.window, settings.smoothing.order) = (9, 5);
    };
    let truth = |truth: &Model, state: usize, term: &Term| truth.equations[state].coefficient(term).unwrap();
    asserted(held(("lorenz", Kind::FirstOrder), 30, &options, &ask, &truth));
}
