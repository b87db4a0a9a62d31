use std::sync::Arc;

use super::effects::{EffectSetting, Frame, catalogue};
use super::fit::Fitted;
use super::judge::{Hypothesis, Ruling, judge};
use super::motion::{Oscillator, Sensing, Slopes, Variation, smooth};
use super::outcome::Curve;
use super::parameters::Parameters;
use super::ruling::Tried;
use super::site::{Placed, Site};
use super::structure::Composition;
use super::{Ask, Constants, Search};
use sindyscope_core::signal::quantisation_step;
use sindyscope_core::simulate::Output;
use sindyscope_core::study::Cancel;
use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_values::record::{RecordSet, Usage};
use sindyscope_values::term::{Layout, Term, list};

fn setting(masses: usize, base_excited: bool) -> EffectSetting {
    let text = match (masses, base_excited) {
        (1, true) => "x-u, v-du",
        (1, false) => "x, v, u",
        _ => "x1, x2, v1, v2, u",
    };
    EffectSetting {
        base_excited,
        passive: true,
        input_open: false,
        inputs: vec![0.5],
        frames: {
            let mut frames = Frame::all(masses, base_excited);
            frames
                .iter_mut()
                .for_each(|f| (f.reach, f.speed, f.speed_noise, f.usual_speed) = (1.1, 11.0, 0.01, Some(4.0)));
            frames
        },
        terms: (0..masses)
            .flat_map(|mass| list(text).unwrap().into_iter().map(move |term| Placed { mass, term }))
            .collect(),
        unit: "rad".into(),
        frequency: 2.0,
        lines: vec![1.0],
        pulsations: vec![1.0],
        interval: 0.01,
        measured: 1.1,
        derivatives: 0,
    }
}

#[test]
fn the_catalogue_has_every_name_of_the_interface() {
    const NAMES: &str = "viscous_damping coulomb_friction stribeck_friction static_friction quadratic_damping cubic_damping \
        displacement_dependent_damping position_dependent_friction linear_stiffness quadratic_stiffness cubic_stiffness \
        quintic_stiffness clearance one_sided_stop bilinear_stiffness pendulum_restoring bouc_wen_hysteresis \
        viscoelastic_relaxation second_mode constant_force base_velocity input_delay input_saturation input_gain \
        unmeasured_harmonic_force parametric_stiffness stiffness_drift sensor_offset sensor_clipping \
        bilinear_damping power_law_damping power_law_stiffness belt_friction damping_drift \
        oblique_springs state_dependent_input input_squared electrostatic_force";
    let forms: Vec<_> = [true, false].into_iter().flat_map(|base| catalogue(&setting(1, base))).collect();
    for name in NAMES.split_whitespace() {
        assert!(forms.iter().any(|f| f.effect == name), "{name}");
    }
}

#[test]
fn the_worked_example_of_the_book_is_an_effect() {
    let page = include_str!("../../../docs/contributing/effect.md");
    assert!(page.contains(include_str!("effects/example.rs")), "the page shows what is compiled");
    let mut forms = Vec::new();
    super::effects::example::add(&setting(1, false), &mut forms);
    let [form] = forms.as_slice() else { panic!("one place, one form: {forms:?}") };
    assert_eq!((form.effect, form.addition(&[]).terms[0].term.as_str()), ("quintic_damping", "v^5"));
}

#[test]
fn every_form_builds_at_every_point_of_its_grid() {
    for (masses, base_excited) in [(1, false), (1, true), (2, false), (2, true)] {
        for form in catalogue(&setting(masses, base_excited)) {
            for point in form.grid() {
                let addition = form.addition(&point);
                assert_eq!(addition.terms.len(), form.coefficients.len(), "{form:?} {point:?}");
                for (value, inner) in point.iter().zip(&form.inner) {
                    assert!((inner.bounds.0..=inner.bounds.1).contains(value), "{form:?} {}: {value}", inner.name);
                }
            }
        }
    }
}

/// A sensor of the first displacement.
const SHOWN: [(Output, f64); 1] = [(Output::Displacement(0), 1.0)];

#[test]
fn where_the_base_moves_a_force_is_asked_for_in_the_joint_and_to_the_ground() {
    const NAMES: &str = "coulomb_friction stribeck_friction static_friction position_dependent_friction quadratic_damping \
        cubic_damping bilinear_damping power_law_damping displacement_dependent_damping quadratic_stiffness cubic_stiffness \
        quintic_stiffness bilinear_stiffness power_law_stiffness clearance one_sided_stop oblique_springs \
        bouc_wen_hysteresis viscoelastic_relaxation";
    let forms = catalogue(&setting(1, true));
    for name in NAMES.split_whitespace() {
        for site in [Site::Base(0), Site::Ground(0)] {
            assert!(forms.iter().any(|f| f.effect == name && f.site == Some(site)), "{name} {site}");
        }
    }
}

#[test]
fn of_several_masses_every_force_is_asked_for_at_every_place() {
    let forms = catalogue(&setting(2, false));
    for effect in ["coulomb_friction", "cubic_stiffness", "clearance", "bouc_wen_hysteresis"] {
        let places: Vec<String> =
            forms.iter().filter(|f| f.effect == effect).filter_map(|f| f.site).map(|s| s.to_string()).collect();
        for place in ["ground-1", "ground-2", "1-2"] {
            assert!(places.iter().any(|p| p == place), "{effect} {place}");
        }
    }
    // The linear system has these already.
    assert!(!forms.iter().any(|f| f.effect == "linear_stiffness" || f.effect == "viscous_damping"));
    let friction = forms.iter().find(|f| f.effect == "coulomb_friction" && f.form.contains("between")).unwrap();
    let added = friction.addition(&[]).terms;
    assert_eq!(
        added.iter().map(|t| (t.mass, t.term.as_str())).collect::<Vec<_>>(),
        [(0, "sgn(v-v2)"), (1, "sgn(v-v2)")]
    );
    // Against the motion of the one mass is along that of the other.
    assert!(friction.coefficients[0].sign.forbids(1.0) && friction.coefficients[1].sign.forbids(-1.0));
}

#[test]
fn a_joints_forces_are_expected_in_the_ratio_of_its_springs() {
    let forms = catalogue(&setting(2, false));
    let friction = forms.iter().find(|f| f.effect == "coulomb_friction" && f.form.contains("between")).unwrap();
    let terms = ["x1, x2", "x1, x2"].iter().enumerate();
    let base = terms.flat_map(|(mass, text)| list(text).unwrap().into_iter().map(move |term| Placed { mass, term }));
    let layout = Layout { freedoms: 2, inputs: 0, ..Layout::default() };
    let rubbing = Composition::new(layout, base.collect()).with(friction);
    let deviations = |coupling: f64, reaction: f64| {
        // The first mass is twice the second.
        let coefficients = vec![-700.0, coupling, 2.0 * coupling, -600.0, -0.3, reaction];
        let parameters = Parameters { coefficients, inner: rubbing.middle() };
        rubbing.reciprocity(&parameters).iter().map(|(_, deviations)| deviations.abs()).fold(0.0, f64::max)
    };
    assert!(deviations(300.0, 0.6) < 1e-9);
    // Five per cent off is one standard deviation, but for what the slack takes.
    assert!((0.7..1.0).contains(&deviations(300.0, 0.63)), "{}", deviations(300.0, 0.63));
    assert!(deviations(300.0, 0.3) > 8.0 && deviations(300.0, -0.6) > 20.0);
    // Masses that no spring joins tell nothing of it.
    assert_eq!(deviations(0.0, 0.3), 0.0);
}

#[test]
fn coupled_masses_answer_as_their_modes_do() {
    // x1″ = −3 x1 + 2 x2 + f, x2″ = 2 x1 − 3 x2: the sum and the difference are oscillators of stiffness 1 and 5.
    let (interval, n) = (0.02, 500);
    let force: Vec<f64> = (0..n).map(|k| (0.9 * interval * k as f64).sin()).collect();
    let matrix = |a: f64, b: f64| nalgebra::DMatrix::from_row_slice(2, 2, &[a, b, b, a]);
    let both = [(Output::Displacement(0), 1.0), (Output::Displacement(1), 1.0)];
    let mut shown = Vec::new();
    Variation::new(Oscillator::new(matrix(3.0, -2.0), matrix(0.2, 0.0), interval), &[]).respond(
        &[(0, &force)],
        &both,
        &mut shown,
    );
    let mode = |stiffness: f64| {
        let mut out = Vec::new();
        Oscillator::single(stiffness, 0.2, interval).respond(&force, &mut out);
        out
    };
    let (sum, difference) = (mode(1.0), mode(5.0));
    for k in 0..n {
        assert!((shown[k] - 0.5 * (sum[k] + difference[k])).abs() < 1e-12);
        assert!((shown[n + k] - 0.5 * (sum[k] - difference[k])).abs() < 1e-12);
    }
    // Slopes put as kicks on masses that are apart are those of the coupled ones.
    let slopes = Slopes { stiffness: [3.0, -2.0, -2.0, 3.0].repeat(n), damping: [0.2, 0.0, 0.0, 0.2].repeat(n) };
    let mut kicked = Vec::new();
    Variation::along(Oscillator::new(matrix(3.0, 0.0), matrix(0.1, 0.0), interval), slopes).respond(
        &[(0, &force)],
        &both,
        &mut kicked,
    );
    let largest = shown.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    // Kicks put a frequency off by (0.02 × √5)²/24 of it, which comes to 2e-3 rad in ten seconds.
    assert!(kicked.iter().zip(&shown).all(|(a, b)| (a - b).abs() < 2e-3 * largest));
}

#[test]
fn an_oscillator_answers_a_step_as_the_textbook_says() {
    // x″ = 1 − 4 x − 0.4 x′ from rest: x = (1 − e^{−0.2 t}(cos w t + 0.2/w sin w t))/4 with w² = 4 − 0.04.
    let oscillator = Oscillator::single(4.0, 0.4, 0.05);
    let mut x = Vec::new();
    oscillator.respond(&[1.0; 200], &mut x);
    let w = f64::sqrt(3.96);
    for (k, x) in x.iter().enumerate() {
        let t = 0.05 * k as f64;
        let want = 0.25 * (1.0 - (-0.2 * t).exp() * ((w * t).cos() + 0.2 / w * (w * t).sin()));
        assert!((x - want).abs() < 1e-12, "{t}: {x} {want}");
    }
}

#[test]
fn a_variation_follows_the_slopes_it_is_given() {
    // Constant slopes, put as kicks on another oscillator, are those of their own oscillator.
    let (interval, n) = (0.02, 1000);
    let force: Vec<f64> = (0..n).map(|k| (0.9 * interval * k as f64).sin()).collect();
    let (mut kicked, mut own) = (Vec::new(), Vec::new());
    Variation::new(Oscillator::single(4.0, 0.4, interval), &vec![(5.0, 0.7); n]).respond(
        &[(0, &force)],
        &SHOWN,
        &mut kicked,
    );
    Oscillator::single(5.0, 0.7, interval).respond(&force, &mut own);
    let largest = own.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    // Strang's splitting errs by the square of the step beside the period: (0.02 × √5)² / 12.
    assert!(kicked.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-3 * largest));
}

#[test]
fn responses_computed_at_once_are_those_of_each_force_alone() {
    let (interval, n) = (0.02, 400);
    let forces: Vec<Vec<f64>> =
        (1..=11).map(|i| (0..n).map(|k| (0.3 * f64::from(i) * interval * k as f64).sin()).collect()).collect();
    let slopes: Vec<(f64, f64)> = (0..n - 1).map(|k| (4.0 + (0.01 * k as f64).cos(), 0.4)).collect();
    for variation in [
        Variation::new(Oscillator::single(4.0, 0.4, interval), &slopes),
        Variation::new(Oscillator::single(4.0, 0.4, interval), &[]),
    ] {
        // Behind what is there already, whether all places are taken or one alone.
        for count in [1, 3, 8, 9, 11] {
            let each: Vec<(usize, &[f64])> = forces[..count].iter().map(|force| (0, force.as_slice())).collect();
            let mut together = vec![vec![7.0]; count];
            variation.respond_each(&each, &SHOWN, &mut together);
            for (force, together) in each.iter().zip(&together) {
                let mut alone = Vec::new();
                variation.respond(std::slice::from_ref(force), &SHOWN, &mut alone);
                assert_eq!(together[0], 7.0);
                assert_eq!(together[1..], alone);
            }
        }
    }
}

#[test]
fn the_smoother_finds_a_known_missing_force_and_knows_how_well() {
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};
    let mut random = rand_pcg::Pcg64::seed_from_u64(7);
    let (interval, n) = (0.01, 4000);
    let oscillator = Oscillator::single(39.5, 0.3, interval);
    // A random walk, as the smoother takes the force to be.
    let mut walked = 0.0;
    let force: Vec<f64> = (0..n)
        .map(|_| {
            let step: f64 = StandardNormal.sample(&mut random);
            walked += 0.05 * step;
            walked
        })
        .collect();
    let mut left = Vec::new();
    oscillator.respond(&force, &mut left);
    for e in &mut left {
        let noise: f64 = StandardNormal.sample(&mut random);
        *e += 1e-3 * noise;
    }
    let seen = Sensing { period: 1.0, outputs: &SHOWN, reach: &[1.0] };
    let found = smooth(&oscillator, &[&left], seen, &Cancel::default()).unwrap().pop().unwrap();
    let deviation = |k: usize| (found.force[0][k] - force[k]) / found.force_deviation[0][k];
    // Errors of neighbouring samples go together over some ten: 4000 samples tell their size to about 4 %; the
    // intensity is taken from steps of a quarter of a decade.
    let size = ((0..n).map(|k| deviation(k).powi(2)).sum::<f64>() / n as f64).sqrt();
    assert!((0.8..1.25).contains(&size), "{size}");
}

#[test]
fn steps_are_told_from_noise() {
    let wave = |k: usize| (0.013 * k as f64).sin();
    let stepped: Vec<f64> = (0..3000).map(|k| (wave(k) / 0.01).round() * 0.01).collect();
    assert!((quantisation_step(&stepped, 2, 2).unwrap() - 0.01).abs() < 1e-12);
    assert_eq!(quantisation_step(&(0..3000).map(wave).collect::<Vec<f64>>(), 2, 2), None);
    assert_eq!(quantisation_step(&[1.0; 100], 2, 2), None);
}

#[test]
fn a_force_that_depends_on_more_than_its_axis_is_a_cloud() {
    let curve = |force: &dyn Fn(f64, usize) -> f64| {
        let over = |k: usize| 0.01 * k as f64 - 2.0;
        Curve { effect: (0..400).map(|k| [over(k), force(over(k), k)]).collect(), ..Curve::default() }
    };
    assert!(curve(&|v, _| -v.signum()).is_law());
    assert!(curve(&|v, _| v * v * v - v).is_law());
    // |x| sgn v, the displacement being another at every passage.
    assert!(!curve(&|v, k| ((k * 7919) % 101) as f64 * v.signum()).is_law());
}

#[test]
fn a_term_of_an_effect_is_what_its_text_says() {
    for (masses, base_excited) in [(1, true), (1, false), (2, false)] {
        for form in catalogue(&setting(masses, base_excited)) {
            for inner in form.grid() {
                let addition = form.addition(&inner);
                let own = addition.terms.iter().map(|t| &t.term);
                for term in own.chain(addition.internals.iter().flat_map(|e| &e.terms).map(|t| &t.term)) {
                    let read = Term::parse(term.as_str()).expect("a term that is written can be read");
                    assert_eq!(read.expression(), term.expression(), "{form:?}: {term}");
                }
            }
        }
    }
}

#[test]
fn a_free_motion_counts_until_it_has_come_to_rest() {
    let of = |scenario: &str, duration: f64, initial: Option<usize>| {
        let noise = Some(Noise::ShareOfPeak(0.01));
        let options = ScenarioOptions { duration: Some(duration), noise, ..ScenarioOptions::default() };
        let made = || generate(scenario, &options).unwrap().records;
        let mut records = RecordSet::new(made(), Usage::Fit);
        records.add(made(), Usage::HeldOut);
        let search = Search::new(&records, &Ask { initial, ..Ask::default() }).unwrap();
        let [series, ..] = search.data.fit() else { panic!("a record is fitted") };
        let told = search.data.notices.iter().any(|n| n.contains("has come to rest"));
        assert!(search.data.held_out().iter().all(|s| initial.is_none_or(|initial| s.len() > initial)));
        (series.len() as f64 * series.interval, told)
    };
    let [(short, told), (long, told_too)] = [5.0, 15.0].map(|duration| of("friction-decay", duration, None));
    assert!(told && told_too && short < 4.0 && (short - long).abs() < 0.5, "{short} s of 5, {long} s of 15");
    let (moving, told) = of("friction-multisine", 16.0, None);
    assert!(!told && moving > 15.9, "{moving} s of 16");
    // More than the motion lasts may be wanted for the initial state.
    let (fitted, _) = of("friction-decay", 5.0, Some(4500));
    assert!((fitted - short).abs() < 0.01, "{fitted} s");
}

/// Sets of effects with one fit, each with as many nats in every one of ten blocks.
fn sets_of_one_fit(sets: &[(&[usize], f64)]) -> Vec<Hypothesis> {
    let options = ScenarioOptions { duration: Some(5.0), ..ScenarioOptions::default() };
    let records = RecordSet::new(generate("friction-decay", &options).unwrap().records, Usage::Fit);
    let search = Search::new(&records, &Ask::default()).unwrap();
    let fitted = search.fitted(&[], &Cancel::default()).unwrap();
    let set = |(forms, nats): &(&[usize], f64)| {
        let mut forms = forms.to_vec();
        forms.sort_unstable();
        Hypothesis { forms, fitted: fitted.clone(), blocks: vec![*nats; 10], unborne: None }
    };
    sets.iter().map(set).collect()
}

#[test]
fn beside_a_part_that_leaves_nothing_that_matters_a_set_that_predicts_better_is_not_named() {
    let forms = catalogue(&setting(1, false));
    let place = |effect: &str| forms.iter().position(|f| f.effect == effect).unwrap();
    let friction = [place("coulomb_friction")];
    let both = [friction[0], place("cubic_damping")];
    let sets = sets_of_one_fit(&[(&[], 0.0), (&friction, 10.0), (&both, 20.0)]);
    let winner = |present: &[usize], suffices: &dyn Fn(&Hypothesis, &Hypothesis) -> bool| {
        judge(&Constants::DEFAULT, &sets, &forms, present, (5.0, 5.0), suffices, &|_, _| false).winner
    };
    assert_eq!(winner(&[], &|_, _| false), Some(2));
    assert_eq!(winner(&[], &|part, _| part.forms == friction), Some(1));
    // What is there already, and no effect at all, are no parts that could suffice.
    assert_eq!(winner(&friction, &|_, _| true), Some(2));
    assert_eq!(winner(&[], &|part, _| part.forms.is_empty()), Some(2));
}

#[test]
fn a_richer_kind_is_a_rival_if_the_data_fitted_tell_it_and_what_it_explains_is_not_unknown() {
    let forms = catalogue(&setting(1, false));
    let place = |effect: &str| forms.iter().position(|f| f.effect == effect).unwrap();
    // It predicts better, and not by enough.
    let mut sets =
        sets_of_one_fit(&[(&[], 0.0), (&[place("coulomb_friction")], 10.0), (&[place("static_friction")], 10.1)]);
    let ruling = |sets: &[Hypothesis], unknown: bool| {
        let ruling = judge(&Constants::DEFAULT, sets, &forms, &[], (5.0, 5.0), &|_, _| false, &|_, _| unknown);
        (ruling.winner, ruling.rivals)
    };
    assert_eq!(ruling(&sets, false), (Some(1), Vec::new()), "no likelier on the data fitted");
    leaves(&mut sets[2], 0.9);
    assert_eq!(ruling(&sets, false), (Some(1), vec![2]));
    assert_eq!(ruling(&sets, true), (Some(1), Vec::new()));
    // By enough it is named, but not if it follows the data less far and leaves hardly less there.
    sets[2].blocks = vec![20.0; 10];
    assert_eq!(ruling(&sets, false).0, Some(2));
    let mut shorter = Fitted::clone(&sets[2].fitted);
    shorter.level = 0;
    sets[2].fitted = Arc::new(shorter);
    assert_eq!(ruling(&sets, false).0, Some(1));
    leaves(&mut sets[2], 0.5);
    assert_eq!(ruling(&sets, false).0, Some(2));
}

#[test]
fn a_lead_that_blocks_leave_open_is_settled_by_the_data_fitted() {
    let forms = catalogue(&setting(1, false));
    let place = |effect: &str| forms.iter().position(|f| f.effect == effect).unwrap();
    let mut sets = sets_of_one_fit(&[
        (&[], 0.0),
        (&[place("cubic_damping")], 10.0),
        (&[place("displacement_dependent_damping")], 10.0),
    ]);
    // One block of ten makes the lead.
    sets[2].blocks[0] += 30.0;
    let ruling = |sets: &[Hypothesis], far: f64| {
        judge(&Constants::DEFAULT, sets, &forms, &[], (5.0, far), &|_, _| false, &|_, _| false)
    };
    assert_eq!(ruling(&sets, 5.0).rivals.len(), 1);
    leaves(&mut sets[2], 0.9);
    let settled = ruling(&sets, 5.0);
    assert_eq!((settled.winner, settled.rivals), (Some(2), Vec::new()));
    let mut lead = Constants::DEFAULT.compared(&sets[2].blocks, &sets[1].blocks, "cubic_damping");
    assert_eq!(lead.settled_words(), "");
    lead.fitted = Constants::DEFAULT.settled(&sets[2], &sets[1], 5.0);
    assert!(lead.settled_words().starts_with("; the data fitted settle it (+"), "{lead:?}");
    assert_eq!(ruling(&sets, 9.0).rivals.len(), 1, "where no set explains the data likelihoods say too much");
}

/// Makes a set leave so many times as much on the data fitted, with other records held out.
fn leaves(set: &mut Hypothesis, times: f64) {
    let mut fitted = Fitted::clone(&set.fitted);
    Arc::make_mut(&mut fitted.refined).rss *= times;
    fitted.refitted.clear();
    set.fitted = Arc::new(fitted);
}

#[test]
fn an_effect_that_a_rival_has_elsewhere_is_in_doubt_of_its_place_alone() {
    let forms = catalogue(&setting(1, true));
    let places: Vec<usize> = (0..forms.len()).filter(|k| forms[*k].effect == "coulomb_friction").collect();
    let cubic = forms.iter().position(|f| f.effect == "cubic_stiffness").unwrap();
    let sets = sets_of_one_fit(&[(&[places[0], cubic], 10.0), (&[places[1], cubic], 10.0)]);
    let ruling = Ruling { winner: Some(0), rivals: vec![1], ..Ruling::default() };
    let tried = Tried { forms, sets, ruling, ..Tried::default() };
    let disputed: Vec<String> = tried.disputed(|rival, own| rival == own).into_iter().map(|c| c.effect).collect();
    assert_eq!(disputed, ["coulomb_friction"]);
    assert!(tried.disputed(|rival, own| rival.effect == own.effect).is_empty());
}
