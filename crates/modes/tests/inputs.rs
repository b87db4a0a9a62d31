//! Structures that are driven at several places at once: by two forces, and by a force while the ground moves.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, SymmetricEigen};
use sindyscope_core::study::Cancel;
use sindyscope_modes::{Base, Effect, Site, StructureDiagnosis, diagnose, identify};
use sindyscope_rig::{
    Excitation, MeasuredChannel, MeasuredQuantity, Noise, Plant, RecordDrive, SampleTimes, Sensor, Sensors, Setup,
};
use sindyscope_values::model::{Equation, Mode, Model};
use sindyscope_values::record::{RecordSet, Role, Usage};
use sindyscope_values::term::Term;

/// Stiffness of each of the three springs, for masses of 1 kg: ground – 1 – 2 – 3.
const SPRINGS: [f64; 3] = [900.0, 700.0, 500.0];
/// Damping in proportion to the stiffness, s.
const BETA: f64 = 8e-4;

/// What drives the structure beside the force on its first mass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Second {
    /// A force on its third mass.
    Force,
    /// The motion of its ground, m.
    Base,
}

fn term(text: &str) -> Term {
    Term::parse(text).expect("a term")
}

/// A chain of three masses with a cubic spring from the second to where the inertial frame is.
fn plant(second: Second, cubic: f64) -> Plant {
    let [a, b, c] = SPRINGS;
    let part = |x: &str, v: &str, k: f64| [(term(x), k), (term(v), BETA * k)];
    let base = (second == Second::Base).then(|| part("u2", "du2", a)).into_iter().flatten();
    let first =
        part("x1", "v1", -a).into_iter().chain(part("x2-x1", "v2-v1", b)).chain([(term("u1"), 1.0)]).chain(base);
    let middle =
        part("x2-x1", "v2-v1", -b).into_iter().chain(part("x3-x2", "v3-v2", c)).chain([(term("x2^3"), -cubic)]);
    let force = (second == Second::Force).then(|| (term("u2"), 1.0));
    let third = part("x3-x2", "v3-v2", -c).into_iter().chain(force);
    let smooth = Model::second_order(2, vec![Equation::known(first), Equation::known(middle), Equation::known(third)]);
    Plant { smooth, contacts: Vec::new() }
}

/// A fitted record and a held-out one, of the second and the third mass's displacement.
fn records(second: Second, cubic: f64) -> RecordSet {
    let noisy = Sensor::noisy(Noise::ShareOfRms(0.01));
    let place = |i: usize| {
        let quantity = MeasuredQuantity::State(i);
        MeasuredChannel::new(format!("x{}", i + 1), Role::Displacement(i), "m", quantity, noisy)
    };
    let input = |i: usize| {
        let unit = if i == 1 && second == Second::Base { "m" } else { "N" };
        let quantity = MeasuredQuantity::Input(i);
        MeasuredChannel::new(format!("u{}", i + 1), Role::Input(i), unit, quantity, Sensor::PERFECT)
    };
    let sampling = SampleTimes { start: 0.0, interval: 0.01, count: 3000 };
    let size = if second == Second::Base { 0.03 } else { 25.0 };
    let drives = (0..2_u64).map(|k| {
        let driven = |size: f64, seed: u64| Excitation::multisine(size, (0.5, 10.0), 60, seed + k);
        RecordDrive::new(format!("run {}", k + 1), vec![driven(30.0, 11), driven(size, 31)], vec![0.0; 6], sampling)
    });
    let sensors = Sensors::new([place(1), place(2), input(0), input(1)]);
    let setup = Setup { plant: plant(second, cubic), drives: drives.collect(), sensors, seed: 3 };
    let mut made = setup.run().expect("a run").records.into_iter();
    let mut records = RecordSet::new(made.next(), Usage::Fit);
    records.add(made, Usage::HeldOut);
    records
}

/// True if a mode is among these for each of the chain's, within 0.5 % in frequency and 20 % in damping.
fn are_the_chains(modes: &[Mode]) -> bool {
    let [a, b, c] = SPRINGS;
    let stiffness = DMatrix::from_row_slice(3, 3, &[a + b, -b, 0.0, -b, b + c, -c, 0.0, -c, c]);
    SymmetricEigen::new(stiffness).eigenvalues.iter().all(|square| {
        let (omega, near) = (square.sqrt(), |found: f64, truth: f64, share: f64| (found / truth - 1.0).abs() < share);
        modes.iter().any(|m| near(m.frequency, omega / TAU, 0.005) && near(m.damping, 0.5 * BETA * omega, 0.2))
    })
}

#[test]
fn modes_are_found_however_the_structure_is_driven() {
    for second in [Second::Force, Second::Base] {
        let found = identify(&records(second, 0.0), &Base::default(), &Cancel::default()).expect("a structure");
        assert!(are_the_chains(&found.modes), "{second:?}: {:?}", found.modes);
        // A base drives by its displacement and by its velocity.
        let inputs = if second == Second::Base { 3 } else { 2 };
        assert!(found.participation.iter().all(|of| of.len() == inputs), "{second:?}");
    }
}

/// The search for what hides at the second mass, which is found there: channels are numbered as measured.
fn searched(second: Second, cubic: f64) -> StructureDiagnosis {
    let found = diagnose(&records(second, cubic), &Base::default(), &|_, _| {}, &Cancel::default()).expect("a search");
    let force = found.found.as_ref().expect("a force");
    assert_eq!((force.effect, force.site), (Effect::CubicStiffness, Site::Ground(1)), "{second:?}");
    found
}

#[test]
fn a_force_is_named_at_its_place_beside_two_measured_forces() {
    is_named(Second::Force);
}

#[test]
fn a_force_is_named_at_its_place_while_the_base_moves() {
    is_named(Second::Base);
}

fn is_named(second: Second) {
    let cubic = 2e4;
    let found = searched(second, cubic);
    assert_eq!(found.verdict(), "named");
    let size = &found.found.as_ref().expect("a force").parameters[0];
    assert!((size.value / cubic - 1.0).abs() < 0.05, "{size:?}");
    assert!(are_the_chains(&found.last.modes), "{:?}", found.last.modes);
}
