//! What the adjustable rig promises, checked on its records.

use super::*;
use crate::RigError;
use crate::hidden::names;
use sindyscope_values::record::Role;
use sindyscope_values::term::Symbol;

fn short() -> RigSettings {
    RigSettings { noise: 0.0, duration: 8.0, rate: 200.0, ..RigSettings::default() }
}

/// Median misfit of the truth's equation over the record's acceleration, by central differences, as a share of its RMS.
fn misfit(settings: &RigSettings, run: &RigRun) -> f64 {
    let record = &run.records[0];
    let x = &record.channel(Role::Displacement(0)).unwrap().values;
    let u = record.channel(Role::Input(0)).map(|c| &c.values);
    let h = record.interval;
    let (mut errors, mut whole) = (Vec::new(), 0.0);
    for k in 2..x.len() - 2 {
        let slope = |y: &[f64]| (y[k - 2] - 8.0 * y[k - 1] + 8.0 * y[k + 1] - y[k + 2]) / (12.0 * h);
        let a = (16.0 * (x[k - 1] + x[k + 1]) - x[k - 2] - x[k + 2] - 30.0 * x[k]) / (12.0 * h * h);
        let value = |symbol: Symbol| match symbol {
            Symbol::Time => h * k as f64 + settings.settle,
            Symbol::State(_) => x[k],
            Symbol::Rate(_) => slope(x),
            Symbol::Input(_) => u.unwrap()[k],
            Symbol::InputRate(_) => slope(u.unwrap()),
            other => panic!("{other:?} is no symbol of a record"),
        };
        let sum: f64 =
            run.truth.terms.iter().map(|t| t.coefficient * t.term.as_ref().unwrap().expression().value(&value)).sum();
        errors.push((a - sum).abs());
        whole += a * a;
    }
    // Where friction holds or turns, or a spring has a corner, differences are wrong.
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2] / (whole / errors.len() as f64).sqrt()
}

#[test]
fn the_truth_is_the_equation_of_the_record_for_every_effect_and_drive() {
    let mut told = 0;
    for drive in [RigDrive::Force, RigDrive::Base] {
        for name in names() {
            let level = if drive == RigDrive::Force { 1.0 } else { 0.005 };
            let settings = RigSettings { effect: Some(name.to_owned()), drive, level, ..short() };
            let run = match record_rig(&settings) {
                Ok(run) => run,
                Err(error) => {
                    assert!(error.to_string().contains("this effect"), "{name}: {error}");
                    continue;
                }
            };
            // Over some hundredths of a radian a pendulum's sine is its spring but for x²/6.
            let least = if name == "pendulum_restoring" { 5e-5 } else { 0.002 };
            let of_a_sensor = name.starts_with("sensor");
            assert!(of_a_sensor || run.ratio > least && run.ratio < 1.5, "{name} {drive:?}: {}", run.ratio);
            let known = run.truth.terms.iter().all(|t| t.term.is_some());
            // What is wrong with a sensor stands in no equation.
            if known && !of_a_sensor {
                let misfit = misfit(&settings, &run);
                assert!(misfit < 2e-3, "{name} {drive:?}: {misfit} of {:?}", run.truth.terms);
                told += 1;
            }
        }
    }
    assert!(told > 35, "{told}");
}

#[test]
fn every_parameter_can_be_moved_and_moves_the_motion() {
    for name in names() {
        let settings = RigSettings { effect: Some(name.to_owned()), drive: RigDrive::Base, level: 0.005, ..short() };
        let Ok(first) = record_rig(&settings) else { continue };
        for (k, given) in first.effect_values.iter().enumerate() {
            let mut values = first.effect_values.clone();
            // A Bouc–Wen exponent is 1 or 2; shares stay below one; a phase may be zero.
            values[k].value = match given.name.as_str() {
                "n" => 3.0 - given.value,
                "phi" => given.value + 0.5,
                "beta_share" => 0.55,
                _ => 1.3 * given.value,
            };
            let changed = RigSettings { effect_values: values.clone(), ..settings.clone() };
            let run = match record_rig(&changed) {
                // A softening spring that softens more lets go.
                Err(RigError::Unbounded { .. }) => continue,
                run => run.unwrap(),
            };
            assert_eq!(run.effect_values, values, "{name}");
            let moved = first.displacements[0].iter().zip(run.displacements[0].iter()).any(|(a, b)| a != b);
            let seen = first.records[0] != run.records[0];
            assert!(moved || seen, "{name}: {} moves nothing", given.name);
        }
    }
}

#[test]
fn chains_have_their_modes_and_their_own_records() {
    for plant in [PlantChoice::TwoMasses, PlantChoice::ThreeMasses] {
        for excitation in ExcitationChoice::ALL {
            let level = if excitation == ExcitationChoice::Decay { 0.01 } else { 4.0 };
            let settings = RigSettings { plant, excitation, level, ..RigSettings::default() }.suited();
            let run = record_rig(&settings).unwrap();
            assert_eq!(run.displacements.len(), plant.masses());
            assert_eq!(settings.natural_frequencies().len(), plant.masses());
            assert_eq!(run.input.is_empty(), excitation == ExcitationChoice::Decay);
            assert!(run.truth.terms.iter().all(|t| t.term.is_some()), "{:?}", run.truth.terms);
        }
    }
}

#[test]
fn friction_that_sticks_is_told() {
    let mut settings = RigSettings { effect: Some("static_friction".to_owned()), ..short() };
    let run = record_rig(&settings).unwrap();
    settings.effect_values =
        run.effect_values.iter().map(|v| EffectValue { value: 4.0 * v.value, ..v.clone() }).collect();
    let stuck = record_rig(&settings).unwrap();
    assert!(stuck.stuck_share() > run.stuck_share() && stuck.stuck_share() > 0.05, "{}", stuck.stuck_share());
    assert!(stuck.stops.iter().all(|s| s.from >= 0.0 && s.to <= settings.duration));
}

#[test]
fn what_cannot_be_is_refused_with_a_reason() {
    let refused = |settings: RigSettings| record_rig(&settings).unwrap_err().to_string();
    assert!(refused(RigSettings { duration: 1e4, ..short() }).contains("samples"));
    assert!(refused(RigSettings { rate: 4.0, duration: 20.0, ..short() }).contains("half the sampling rate"));
    assert!(refused(RigSettings { mass: f64::NAN, ..short() }).contains("mass"));
    assert!(refused(RigSettings { effect: Some("nothing".into()), ..short() }).contains("no effect"));
    let needs_base = RigSettings { effect: Some("base_velocity".into()), ..short() };
    assert!(refused(needs_base).contains("base that moves"));
}

#[test]
fn the_same_settings_make_the_same_record_and_another_seed_another() {
    let settings = RigSettings { noise: 0.01, ..short() };
    let run = record_rig(&settings).unwrap();
    assert_eq!(record_rig(&settings).unwrap().records, run.records);
    assert_ne!(record_rig(&RigSettings { seed: 2, ..settings }).unwrap().records, run.records);
}
