//! Chains of the virtual rig, integrated by another method: modes within their stated errors, whatever is measured and in
//! whatever order; what is missing and where; bad records.

use std::sync::{Arc, LazyLock};

use nalgebra::{DMatrix, SymmetricEigen};
use sindyscope_core::study::Cancel;
use sindyscope_modes::{
    Base, BaseModel, Effect, ModesError, Pole, Site, Stability, StructureDiagnosis, UnseenRecord, analyse, diagnose,
    identify,
};
use sindyscope_rig::{
    Contact, Excitation, MeasuredChannel, MeasuredQuantity, Plant, RecordDrive, SampleTimes, Sensor, Sensors, Setup,
};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::record::{Record, RecordSet, Role, Usage};
use sindyscope_values::term::Term;

/// Stiffness of each of the three springs, for masses of 1 kg: ground – 1 – 2 – 3.
const SPRINGS: [f64; 3] = [900.0, 700.0, 500.0];
/// Damping in proportion to the stiffness, s.
const BETA: f64 = 8e-4;
/// Deviation of the noise over the channel's own.
const NOISE: f64 = 0.01;

fn term(text: &str) -> Term {
    Term::parse(text).expect("a term")
}

/// A chain that slips on the ground at its second mass where a friction is given.
fn plant(friction: f64) -> Plant {
    let [a, b, c] = SPRINGS;
    let part = |x: &str, v: &str, k: f64| [(term(x), k), (term(v), BETA * k)];
    let first = part("x1", "v1", -a).into_iter().chain(part("x2-x1", "v2-v1", b)).chain([(term("u"), 1.0)]);
    let second = part("x2-x1", "v2-v1", -b).into_iter().chain(part("x3-x2", "v3-v2", c));
    let third = part("x3-x2", "v3-v2", -c);
    let smooth = Model::second_order(1, vec![Equation::known(first), Equation::known(second), Equation::known(third)]);
    let contacts = (friction > 0.0).then(|| Contact::coulomb(term("v2"), 4, friction));
    Plant { smooth, contacts: contacts.into_iter().collect() }
}

fn channel(role: Role) -> MeasuredChannel {
    let (name, unit, quantity) = match role {
        Role::Displacement(i) => (format!("x{}", i + 1), "m", MeasuredQuantity::State(i)),
        Role::Velocity(i) => (format!("v{}", i + 1), "m/s", MeasuredQuantity::State(3 + i)),
        Role::Acceleration(i) => (format!("a{}", i + 1), "m/s^2", MeasuredQuantity::Rate(3 + i)),
        Role::Input(i) => ("u".to_owned(), "N", MeasuredQuantity::Input(i)),
    };
    let sensor = if matches!(role, Role::Input(_)) {
        Sensor::PERFECT
    } else {
        Sensor::noisy(sindyscope_rig::Noise::ShareOfRms(NOISE))
    };
    MeasuredChannel::new(&name, role, unit, quantity, sensor)
}

/// Two fitted records and a held-out one of random phases over all modes.
fn tested(friction: f64, roles: &[Role]) -> RecordSet {
    recorded(friction, roles, 3000)
}

/// The same of so many samples each.
fn recorded(friction: f64, roles: &[Role], count: usize) -> RecordSet {
    let sampling = SampleTimes { start: 0.0, interval: 0.01, count };
    let drives = (0..3_u64).map(|k| {
        let force = Excitation::multisine(40.0, (0.5, 10.0), 60, 11 + k);
        RecordDrive::new("run", vec![force], vec![0.0; 6], sampling)
    });
    let sensors = Sensors::new(roles.iter().map(|r| channel(*r)).chain([channel(Role::Input(0))]));
    let setup = Setup { plant: plant(friction), drives: drives.collect(), sensors, seed: 3 };
    let mut records = RecordSet::default();
    let [first, second, third] = <[Record; 3]>::try_from(setup.run().expect("a run").records).expect("three records");
    records.add([first, second], Usage::Fit);
    records.add([third], Usage::HeldOut);
    records
}

/// Frequencies, Hz, with the dampings in per cent of critical and the shapes, from the matrices.
fn truth() -> Vec<(f64, f64, Vec<f64>)> {
    let [a, b, c] = SPRINGS;
    let stiffness = DMatrix::from_row_slice(3, 3, &[a + b, -b, 0.0, -b, b + c, -c, 0.0, -c, c]);
    let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(stiffness);
    let mut modes: Vec<(f64, f64, Vec<f64>)> = eigenvalues
        .iter()
        .zip(eigenvectors.column_iter())
        .map(|(square, shape)| {
            let omega = square.sqrt();
            (omega / std::f64::consts::TAU, 0.5 * BETA * omega, shape.iter().copied().collect())
        })
        .collect();
    modes.sort_by(|p, q| p.0.total_cmp(&q.0));
    modes
}

/// Four standard errors: one in 16 000 lies beyond, and less than ten are looked at.
fn within(found: f64, error: Option<f64>, truth: f64) -> bool {
    (found - truth).abs() < 4.0 * error.expect("a standard error")
}

#[test]
fn modes_lie_within_their_errors_whatever_is_measured() {
    for roles in [
        vec![Role::Displacement(0), Role::Displacement(1), Role::Displacement(2)],
        vec![Role::Displacement(0), Role::Velocity(1), Role::Acceleration(2)],
        vec![Role::Acceleration(2), Role::Acceleration(0)],
        vec![Role::Displacement(2)],
    ] {
        let found = identify(&tested(0.0, &roles), &Base::default(), &Cancel::default()).unwrap();
        for (frequency, damping, shape) in truth() {
            let off = |m: &&sindyscope_values::model::Mode| (m.frequency - frequency).abs();
            let mode = found.modes.iter().min_by(|p, q| off(p).total_cmp(&off(q))).unwrap();
            assert!(within(mode.frequency, mode.frequency_error, frequency), "{roles:?}: {mode:?} is not {frequency}");
            assert!(
                within(mode.damping, mode.damping_error, damping),
                "{roles:?}: {mode:?} is not damped by {damping}"
            );
            // Shapes compare where each sensor shows the same quantity.
            if roles.iter().all(|r| matches!(r, Role::Displacement(_))) {
                let own: Vec<f64> =
                    roles.iter().map(|r| shape[if let Role::Displacement(i) = r { *i } else { 0 }]).collect();
                let largest = own.iter().copied().max_by(|p, q| p.abs().total_cmp(&q.abs())).unwrap();
                for (s, value) in own.iter().enumerate() {
                    assert!((mode.shape[s] - value / largest).abs() < 0.01, "{:?} is not {own:?}", mode.shape);
                }
            }
        }
    }
}

#[test]
fn nothing_is_missing_where_nothing_is_hidden() {
    let records = tested(0.0, &[Role::Displacement(0), Role::Displacement(1)]);
    let found = diagnose(&records, &Base::default(), &|_, _| {}, &Cancel::default()).unwrap();
    assert_eq!((found.verdict(), found.explained), ("nothing_missing", true), "{} noises", found.noises);
}

/// What is missing where the second mass slips.
static SLIPPING: LazyLock<(RecordSet, StructureDiagnosis)> = LazyLock::new(|| {
    let records = tested(3.0, &[Role::Displacement(0), Role::Displacement(1)]);
    let found = diagnose(&records, &Base::default(), &|_, _| {}, &Cancel::default()).expect("a diagnosis");
    (records, found)
});

#[test]
fn dry_friction_is_found_at_its_sensor() {
    let (_, found) = &*SLIPPING;
    let force = found.found.as_ref().expect("a force");
    assert_eq!((force.effect, force.site), (Effect::CoulombFriction, Site::Ground(1)), "{} noises", found.noises);
}

#[test]
fn what_was_found_comes_back_from_a_file_without_a_search() {
    let (records, found) = &*SLIPPING;
    let base = Base::default();
    let text = serde_json::to_string(found).unwrap();
    // Small enough to be written often: no series.
    assert!(text.len() < 20_000, "{} bytes", text.len());
    let kept: StructureDiagnosis = serde_json::from_str(&text).unwrap();
    assert!(kept.unseen.is_empty() && kept.is_of(records, &base));
    let again = kept.redrawn(records, &Cancel::default()).unwrap();
    assert_eq!((again.verdict(), &again.found), (found.verdict(), &found.found));
    let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    let (old, new) = (&found.unseen[0], &again.unseen[0]);
    assert_eq!((&old.name, &old.measured), (&new.name, &new.measured));
    for s in 0..2 {
        let after = |record: &UnseenRecord| record.after.as_ref().expect("a force")[s].clone();
        for (a, b) in [(&old.before[s], &new.before[s]), (&after(old), &after(new))] {
            let apart: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
            assert!(rms(&apart) < 1e-3 * rms(a), "sensor {s}: {} of {}", rms(&apart), rms(a));
        }
    }
    // Other records or another base are told.
    assert!(!kept.is_of(&tested(0.0, &[Role::Displacement(0), Role::Displacement(1)]), &base));
    assert!(!kept.is_of(records, &Base { modes: Some(2), ..Base::default() }));
}

#[test]
fn a_search_starts_from_the_poles_that_are_given_and_adds_none() {
    let records = recorded(3.0, &[Role::Displacement(0), Role::Displacement(1)], 1500);
    let poles: Vec<Pole> = truth().into_iter().map(|(f, _, _)| Pole::at(1.02 * f, 0.03)).collect();
    let of = |poles: &[Pole]| {
        let base = Base { model: BaseModel::Modes, poles: poles.to_vec(), ..Base::default() };
        let found = diagnose(&records, &base, &|_, _| {}, &Cancel::default()).unwrap();
        // The base is what `identify` finds from these poles.
        let identified = analyse(&records, &base, &|_, _| {}, &Cancel::default()).unwrap().structure;
        assert_eq!(found.base.modes, identified.modes);
        found
    };
    let found = of(&poles);
    let force = found.found.as_ref().expect("a force");
    assert_eq!((force.effect, force.site), (Effect::CoulombFriction, Site::Ground(1)), "{} noises", found.noises);
    assert_eq!(found.last.modes.len(), 3);
    for (mode, (frequency, _, _)) in found.last.modes.iter().zip(truth()) {
        assert!((mode.frequency / frequency - 1.0).abs() < 5e-3, "{} is not {frequency}", mode.frequency);
    }
    // A mode that was left out stays out, whatever the data would bear.
    let fewer = of(&[poles[0], poles[2]]);
    assert_eq!((fewer.base.modes.len(), fewer.last.modes.len()), (2, 2));
    assert_eq!(fewer.verdict(), "unexplained");
}

#[test]
fn records_that_cannot_serve_are_refused_in_words() {
    let whole = tested(0.0, &[Role::Displacement(0)]);
    let of = |record: Record| {
        let mut set = RecordSet::default();
        set.entries.push((Arc::new(record), Usage::Fit));
        identify(&set, &Base::default(), &Cancel::default()).unwrap_err()
    };
    let record = Record::clone(&whole.entries[0].0);
    assert!(matches!(of(record.slice(0..20)), ModesError::TooShort { samples: 20, .. }));
    let mut still = record.clone();
    still.channels[0].values = vec![1.0; still.len()].into();
    assert!(matches!(of(still), ModesError::Still { .. }));
    let mut blind = record;
    blind.channels.retain(|c| matches!(c.role, Role::Input(_)));
    assert!(matches!(of(blind), ModesError::NoSensor { .. }));
    assert!(matches!(
        identify(&RecordSet::default(), &Base::default(), &Cancel::default()),
        Err(ModesError::NothingToFit)
    ));
}

#[test]
fn every_mode_is_a_stable_column_of_the_diagram_and_noise_is_none() {
    let records = tested(0.0, &[Role::Acceleration(0), Role::Acceleration(1), Role::Acceleration(2)]);
    let found = analyse(&records, &Base::default(), &|_, _| {}, &Cancel::default()).unwrap();
    let stable: Vec<f64> = found
        .stabilization
        .poles
        .iter()
        .filter(|p| p.stability == Stability::Whole)
        .map(|p| p.pole.frequency())
        .collect();
    for (k, (frequency, _, _)) in truth().into_iter().enumerate() {
        let near = stable.iter().filter(|f| (*f / frequency - 1.0).abs() < 0.01).count();
        assert!(near >= 10, "{near} stable poles at {frequency} Hz");
        let quality = found.quality[k];
        assert!(quality.stable >= 10 && quality.collinearity.unwrap() > 0.98, "{quality:?}");
        assert!(quality.deviation.unwrap() < 0.05, "{quality:?}");
    }
    let spectrum = &found.stabilization.singular_values[0];
    let peak = (0..spectrum.len()).max_by(|a, b| spectrum[*a].total_cmp(&spectrum[*b])).unwrap();
    let nearest = truth().into_iter().map(|t| (found.stabilization.frequencies[peak] - t.0).abs()).fold(9.0, f64::min);
    assert!(nearest < 0.2, "the spectrum is highest {nearest} Hz beside a mode");
    // What is modelled and what is left make up what was measured, in its unit.
    let record = &found.records[0];
    let score = &found.structure.records[0].scores[1];
    let rms = (record.left[1].iter().map(|e| e * e).sum::<f64>() / record.left[1].len() as f64).sqrt();
    assert!((rms / score.rmse - 1.0).abs() < 1e-9);
    assert!((record.modelled(1)[7] + record.left[1][7] - record.measured[1][7]).abs() < 1e-12);
}

#[test]
fn modes_are_fitted_from_poles_that_are_given() {
    let records = tested(0.0, &[Role::Displacement(0), Role::Displacement(1)]);
    let poles = truth().into_iter().take(2).map(|(f, _, _)| Pole::at(1.01 * f, 0.02)).collect();
    let base = Base { model: BaseModel::Modes, poles, ..Base::default() };
    let found = analyse(&records, &base, &|_, _| {}, &Cancel::default()).unwrap().structure;
    assert_eq!(found.modes.len(), 2);
    for (mode, (frequency, _, _)) in found.modes.iter().zip(truth()) {
        assert!((mode.frequency / frequency - 1.0).abs() < 2e-3, "{} is not {frequency}", mode.frequency);
    }
}
