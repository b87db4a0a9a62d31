//! The oscillators that courses begin with, and what a linear base lacks of each.

use sindyscope_rig::{Noise, ScenarioOptions, generate};
use sindyscope_search::Ask;
use sindyscope_values::record::{Record, RecordSet, Usage};
use sindyscope_values::term::list;

/// A scenario of the rig, the size of its input or release, the linear base and the effects that this lacks.
pub(crate) type Classic = (&'static str, f64, &'static str, &'static [&'static str]);

pub(crate) const QUICK: &[Classic] = &[
    ("van-der-pol-forced", 1.2, "x, v, u", &["displacement_dependent_damping"]),
    ("pendulum", 1.15, "x, v, u", &["pendulum_restoring"]),
    ("upright-pendulum", 1.0, "x, v, u", &["pendulum_restoring"]),
    ("uneven-damper", 1.0, "x, v, u", &["bilinear_damping"]),
    ("electrostatic", 1.0, "x, v, u", &["electrostatic_force"]),
    ("absorber", 4.0, "x, v, u", &["second_mode"]),
];
pub(crate) const LONG: &[Classic] = &[
    ("double-well", 0.4, "x, v, u", &["cubic_stiffness"]),
    ("double-well-friction", 0.42, "x, v, u", &["coulomb_friction", "cubic_stiffness"]),
    ("ueda", 7.5, "x, v, u", &["cubic_stiffness"]),
    ("van-der-pol", 0.1, "x, v", &["displacement_dependent_damping"]),
    ("rayleigh", 0.8, "x, v, u", &["cubic_damping"]),
    ("friction-multisine", 0.001, "x, v, u, du", &["coulomb_friction"]),
    ("mathieu", 0.1, "x, v", &["cubic_stiffness", "parametric_stiffness"]),
    ("parametric-pendulum", 0.5, "x, v", &["parametric_stiffness", "pendulum_restoring"]),
    ("coupled-pendula", 0.5, "x1, x2, v1, v2, u", &["pendulum_restoring", "pendulum_restoring"]),
    ("belt", 1.0, "x, v", &["belt_friction"]),
    ("hard-stop", 0.1, "x, v, u", &["one_sided_stop"]),
    ("freeplay", 0.15, "x, v, u", &["clearance"]),
    ("truss", 0.3, "x, v, u", &["oblique_springs"]),
];

/// Half a per cent of noise: one record is fitted, another with 0.85 of the input is held out.
pub(crate) fn asked(classic: &Classic, seed: u64) -> (RecordSet, Ask) {
    asked_in(0.005, classic, seed)
}

/// The same with another share of noise.
pub(crate) fn asked_in(share: f64, classic: &Classic, seed: u64) -> (RecordSet, Ask) {
    let (mut records, ask) = alone(share, classic, seed);
    records.add(made(0.85, share, classic, seed + 100), Usage::HeldOut);
    (records, ask)
}

/// One record with a share of noise, of which parts are left out in turn.
pub(crate) fn alone(share: f64, classic: &Classic, seed: u64) -> (RecordSet, Ask) {
    let records = RecordSet::new(made(1.0, share, classic, seed), Usage::Fit);
    (records, Ask { base: Some(list(classic.2).unwrap()), ..Ask::default() })
}

fn made(times: f64, share: f64, &(scenario, size, ..): &Classic, seed: u64) -> Vec<Record> {
    let noise = Some(Noise::ShareOfPeak(share));
    let options = ScenarioOptions { seed, amplitude: Some(times * size), noise, ..ScenarioOptions::default() };
    generate(scenario, &options).unwrap().records
}
