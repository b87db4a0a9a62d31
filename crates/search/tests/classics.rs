//! The oscillators that courses begin with, made by the virtual rig: what a linear base lacks is named.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "study/classics.rs"]
mod drawn;

use drawn::{Classic, LONG, QUICK, alone, asked, asked_in};
use sindyscope_core::study::Cancel;
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_search::{Ask, Search, Verdict};
use sindyscope_values::record::{Record, RecordSet, Role, Usage};
use sindyscope_values::term::list;

/// The names found and the verdict.
fn found(classic: &Classic, seed: u64) -> (Vec<String>, Verdict) {
    let (records, ask) = asked(classic, seed);
    diagnosed(&records, &ask)
}

/// The names found, sorted, and the verdict.
fn diagnosed(records: &RecordSet, ask: &Ask) -> (Vec<String>, Verdict) {
    let diagnosis = Search::new(records, ask).unwrap().diagnose(&|_| {}, &Cancel::default()).unwrap();
    assert!(!diagnosis.sentence.contains("just as well :"), "rivals have names: {}", diagnosis.sentence);
    let mut names: Vec<String> = diagnosis.steps().iter().map(|s| s.added.choice.effect.clone()).collect();
    names.sort_unstable();
    (names, diagnosis.verdict)
}

fn called(scenario: &str) -> &'static Classic {
    QUICK.iter().chain(LONG).find(|classic| classic.0 == scenario).unwrap()
}

/// What is to be found.
fn right(classic: &Classic) -> (Vec<String>, Verdict) {
    (classic.3.iter().map(|&e| e.to_owned()).collect(), Verdict::Named)
}

fn named(classic: &Classic, seed: u64) {
    assert_eq!(found(classic, seed), right(classic), "{}", classic.0);
}

#[test]
fn what_only_data_never_fitted_show_is_not_called_nothing() {
    // The stop is out of the reach of the motion that is fitted.
    let gentle: Classic = ("hard-stop", 0.02, "x, v, u", &[]);
    let (mut records, ask) = alone(0.005, &gentle, 1);
    let diagnosed = |records: &RecordSet| Search::new(records, &ask).unwrap().diagnose(&|_| {}, &Cancel::default());
    assert_eq!(diagnosed(&records).unwrap().verdict, Verdict::NothingMissing);
    let (strong, _) = alone(0.005, called("hard-stop"), 2);
    records.entries.extend(strong.entries.into_iter().map(|(record, _)| (record, Usage::HeldOut)));
    let diagnosis = diagnosed(&records).unwrap();
    assert_eq!((diagnosis.verdict, diagnosis.explained), (Verdict::Unexplained, false));
    assert!(diagnosis.sentence.contains("that the data fitted do not show"), "{}", diagnosis.sentence);
}

#[test]
fn what_a_linear_base_lacks_of_a_classic_is_named() {
    QUICK.iter().for_each(|classic| named(classic, 1));
}

#[test]
fn a_segment_that_begins_near_a_separatrix_leads_no_fit_away() {
    // One of 32 left as much as all others together, and the cubic spring ended 7 % off: nothing was named.
    named(called("double-well"), 11);
    // With 5 % of noise two of sixteen did, and pairs of other springs that were fitted along shorter segments came first.
    let classic = called("double-well");
    for seed in [2, 3] {
        let (records, ask) = asked_in(0.05, classic, seed);
        assert_eq!(diagnosed(&records, &ask), right(classic), "{seed}");
    }
}

#[test]
fn a_record_never_fitted_is_held_against_noise_of_its_own() {
    // Of 0.8 times that of the data fitted it favoured, by 71 nats, whichever set was surer of itself: a power law of 1.05.
    named(called("hard-stop"), 1);
    // Of 1.6 times that, it was taken for something that stands behind the stop.
    named(called("hard-stop"), 2);
}

#[test]
fn a_richer_kind_that_the_data_fitted_do_not_tell_from_the_simpler_one_is_not_named() {
    // Along a motion that parts from its neighbours a power of 1.05 is three standard errors from the stop's own, and no likelier.
    let classic = called("hard-stop");
    let (records, ask) = alone(0.005, classic, 1);
    assert_eq!(diagnosed(&records, &ask), right(classic));
}

#[test]
fn what_is_left_out_in_turn_is_foreseen_by_a_fit_that_has_landed() {
    // Begun on the measured motion, a fit to the rest left four times the noise after its few steps, and the name was doubted.
    for scenario in ["van-der-pol", "pendulum"] {
        let classic = called(scenario);
        let (records, ask) = alone(0.005, classic, 3);
        assert_eq!(diagnosed(&records, &ask), right(classic), "{scenario}");
    }
}

#[test]
fn a_stretch_never_fitted_that_begins_near_a_separatrix_says_nothing_against_a_name() {
    // Its beginning, estimated over two periods, ended where the mass goes the other way: it is estimated over half as long first.
    named(called("freeplay"), 5);
    // Along whole records this motion parts from its neighbours, which a simulation that has lost it does not tell.
    named(called("truss"), 6);
}

#[test]
fn what_is_named_does_not_hang_on_where_the_score_begins() {
    // From the first hundred samples no model predicts a chaotic record to its end: nothing was shown.
    for scenario in ["double-well", "pendulum"] {
        let classic = called(scenario);
        let (records, ask) = asked(classic, 1);
        assert_eq!(diagnosed(&records, &Ask { initial: Some(100), ..ask }), right(classic), "{scenario}");
    }
}

#[test]
fn pendula_with_a_spring_between_them_are_named_both() {
    // A sine in the place of a pendulum's own spring took the one between them away too: a cubic spring was named for one of them.
    named(called("coupled-pendula"), 3);
}

#[test]
fn a_stop_is_proposed_though_the_record_s_other_parts_cannot_tell_its_stiffness() {
    // One block of rows holds most of the hits, and left out it spoke against any stop: the best were cubic and quadratic springs.
    let (records, ask) = asked_in(0.01, called("hard-stop"), 4);
    assert_eq!(diagnosed(&records, &ask), (vec!["one_sided_stop".to_owned()], Verdict::Named));
}

/// Records of a scenario with half a per cent of noise and parameters of its plant changed.
fn changed(scenario: &str, parameters: &[(&str, f64)], options: ScenarioOptions) -> Vec<Record> {
    let parameters = parameters.iter().map(|&(name, value)| (name.to_owned(), value)).collect();
    let noise = Some(Noise::ShareOfPeak(0.005));
    generate(scenario, &ScenarioOptions { noise, parameters, ..options }).unwrap().records
}

/// What is found beside a linear base in records of which the last is held out.
fn beside(base: &str, mut records: Vec<Record>) -> (Vec<String>, Verdict) {
    let last = records.pop();
    let mut set = RecordSet::new(records, Usage::Fit);
    set.add(last, Usage::HeldOut);
    diagnosed(&set, &Ask { base: Some(list(base).unwrap()), ..Ask::default() })
}

#[test]
fn of_two_curves_the_smoother_one_is_not_taken_for_the_other_where_samples_are_few() {
    // Twelve samples a period: the smoothed displacement has no kink, and oblique springs alone were fitted.
    let record = |seed, amplitude| {
        let options = ScenarioOptions {
            seed,
            amplitude: Some(amplitude),
            rate: Some(2.5),
            duration: Some(300.0),
            frequencies: Some(vec![0.2, 0.2]),
            lines: Some(1),
            ..ScenarioOptions::default()
        };
        changed("freeplay", &[("k", 0.0), ("c", 0.1), ("kc", 4.0), ("d", 0.3)], options)
    };
    for seed in [1, 2] {
        let records = [record(seed, 1.2), record(seed + 100, 1.02)].concat();
        assert_eq!(beside("x, v, u", records), (vec!["clearance".to_owned()], Verdict::Named), "{seed}");
    }
}

#[test]
fn a_damper_that_pushes_beside_other_effects_begins_so() {
    // Begun without a push the right pair ended far off, and a clearance and a quintic spring were named beside the damper.
    let record = |seed, amplitude| {
        let options = ScenarioOptions {
            seed,
            amplitude: Some(amplitude),
            rate: Some(5.0),
            frequencies: Some(vec![1.6 / std::f64::consts::TAU]),
            ..ScenarioOptions::default()
        };
        changed("van-der-pol-forced", &[("mu", 0.6), ("beta", 1.0)], options)
    };
    let effects = ["cubic_stiffness", "displacement_dependent_damping"].map(str::to_owned).to_vec();
    assert_eq!(beside("x, v, u", [record(4, 1.5), record(104, 1.275)].concat()), (effects, Verdict::Named));
}

#[test]
fn the_frequency_of_a_pulsation_is_found_beside_the_spring_that_bounds_it() {
    // Without a cubic spring beside it another line explained more: a clearance and a second mode were shown, *unexplained*.
    let record = |seed, amplitude| {
        let (amplitude, rate, duration) = (Some(amplitude), Some(10.0), Some(270.0));
        let options = ScenarioOptions { seed, amplitude, rate, duration, ..ScenarioOptions::default() };
        changed("mathieu", &[("b", 0.309), ("omega", 2.134), ("c", 0.026), ("beta", 0.21)], options)
    };
    let records = [record(1, 0.3), record(51, 0.8), record(101, 0.5)].concat();
    let effects = ["cubic_stiffness", "parametric_stiffness"].map(str::to_owned).to_vec();
    assert_eq!(beside("x, v", records), (effects, Verdict::Named));
}

/// The names found in one record of which the end is held out, as the window opens a classic, and the verdict.
fn found_before(end: f64, scenario: &str, seed: u64, noise: Noise) -> (Vec<String>, Verdict) {
    let options = ScenarioOptions { seed, noise: Some(noise), ..ScenarioOptions::default() };
    let mut records = RecordSet::default();
    for record in generate(scenario, &options).unwrap().records {
        let (first, last) = record.split_at(end);
        records.add([first], Usage::Fit);
        records.add([last], Usage::HeldOut);
    }
    diagnosed(&records, &Ask::default())
}

#[test]
fn what_only_the_beginning_of_a_motion_shows_is_named_from_one_record() {
    // The pulsation shows as the motion grows: left out of the regression, no other block of rows tells its size.
    let named = |effects: [&str; 2]| (effects.map(str::to_owned).to_vec(), Verdict::Named);
    let noise = Noise::ShareOfPeak(0.005);
    assert_eq!(found_before(100.0, "mathieu", 2, noise), named(["cubic_stiffness", "parametric_stiffness"]));
    let pumped = found_before(70.0, "parametric-pendulum", 6, noise);
    assert_eq!(pumped, named(["parametric_stiffness", "pendulum_restoring"]));
}

#[test]
fn a_sine_is_not_taken_for_a_cubic_spring_that_predicts_one_steady_swing_better() {
    // The end that is held out swings steadily, and there a cubic spring does as well: in the second draw by 21 nats better, by chance.
    // In the fourth it does better than the sine where either stands alone, for which the sine was not tried beside the pulsation.
    for (seed, verdict) in [(2, Verdict::Ambiguous), (4, Verdict::Named)] {
        let effects = ["parametric_stiffness", "pendulum_restoring"].map(str::to_owned).to_vec();
        assert_eq!(found_before(70.0, "parametric-pendulum", seed, Noise::ShareOfPeak(0.005)), (effects, verdict));
    }
}

#[test]
fn a_richer_kind_that_lost_its_way_begins_again_as_the_simpler_one() {
    // Friction that falls with the speed left eleven times what steady friction does, and a damper was named beside that.
    let (records, ask) = asked_in(0.01, called("belt"), 4);
    assert_eq!(diagnosed(&records, &ask), (vec!["belt_friction".to_owned()], Verdict::Named));
}

#[test]
fn springs_that_stand_a_little_higher_than_the_motion_goes_are_no_pair_of_powers() {
    named(called("truss"), 11);
}

#[test]
fn a_pendulum_that_a_steady_torque_turns_over_and_over_is_named() {
    let effects = ["constant_force", "pendulum_restoring"].map(str::to_owned).to_vec();
    // Of 0.01 rad: a share of the peak would be as much as some turns.
    assert_eq!(found_before(70.0, "turned-pendulum", 1, Noise::Deviation(0.01)), (effects, Verdict::Named));
}

#[test]
fn an_angle_that_turns_over_may_be_counted_from_anywhere() {
    // Which way the pendulum hangs does not follow from where its motion is on average.
    let counted = |seed, amplitude, usage: Usage, records: &mut RecordSet| {
        let noise = Some(Noise::ShareOfPeak(0.005));
        let options = ScenarioOptions { seed, amplitude: Some(amplitude), noise, ..ScenarioOptions::default() };
        let mut made = generate("pendulum", &options).unwrap().records;
        for channel in made.iter_mut().flat_map(|r| &mut r.channels).filter(|c| c.role == Role::Displacement(0)) {
            channel.values = channel.values.iter().map(|x| x + 40.0).collect();
        }
        records.add(made, usage);
    };
    let mut records = RecordSet::default();
    counted(1, 1.15, Usage::Fit, &mut records);
    counted(101, 0.98, Usage::HeldOut, &mut records);
    let ask = Ask { base: Some(list("x, v, u").unwrap()), ..Ask::default() };
    let diagnosis = Search::new(&records, &ask).unwrap().diagnose(&|_| {}, &Cancel::default()).unwrap();
    let names: Vec<&str> = diagnosis.steps().iter().map(|s| s.added.choice.effect.as_str()).collect();
    assert_eq!((names, diagnosis.verdict), (vec!["pendulum_restoring"], Verdict::Named));
}

/// Other draws of every one, in release mode: with a record held out, and one record alone, of which two effects may do as well.
#[test]
#[ignore = "a study"]
fn the_study_of_classics() {
    let mut wrong = Vec::new();
    let mut tell = |classic: &Classic, seed: u64, alone: bool, found: (Vec<String>, Verdict)| {
        let is_right = found == right(classic);
        let passes = is_right || alone && found.1 == Verdict::Ambiguous;
        let words = if is_right { "right" } else { "" };
        let held_out = if alone { "alone" } else { "" };
        println!("{:20} {seed}  {held_out:5}  {words:5}  {:?} {}", classic.0, found.1, found.0.join(" + "));
        if !passes {
            wrong.push((classic.0, seed, alone));
        }
    };
    for classic in QUICK.iter().chain(LONG) {
        for seed in 11..=13 {
            tell(classic, seed, false, found(classic, seed));
            let (records, ask) = alone(0.005, classic, seed);
            tell(classic, seed, true, diagnosed(&records, &ask));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
