//! Every effect that the rig can hide, by name.

use super::contribution::Contribution;
use super::excitation_kind::ExcitationKind;
use super::host_plant::{Draws, DriveKind, HostPlant};
use super::{driving, friction, memory, stiffness};

/// What an effect asks of the plant's drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Requirement {
    Nothing,
    /// An input of either kind.
    Input,
    /// A base that moves: elsewhere the effect is a part of the linear plant.
    Base,
    /// No moving base.
    NoBase,
}

/// An effect that can be hidden.
#[derive(Debug)]
pub(super) struct Effect {
    pub name: &'static str,
    pub title: &'static str,
    pub build: fn(f64, &Draws, &HostPlant) -> Contribution,
    /// The strength to begin with, for a missing force as large as the spring's.
    pub first: f64,
    /// The largest strength that is sensible.
    pub most: f64,
    asks: Requirement,
    /// True if it can hold the mass.
    pub rubs: bool,
    /// True if a steady tone shows it: by harmonics, a mean, another line or a change with time.
    in_a_tone: bool,
    /// True if it can be told in a free decay from another stiffness and another viscous damping.
    in_a_decay: bool,
    pub catalogued: bool,
}

impl Effect {
    /// True if a plant can hide the effect under an excitation of this kind.
    pub(super) fn can_be_hidden(&self, excitation_kind: ExcitationKind) -> bool {
        excitation_kind != ExcitationKind::Decay || !matches!(self.asks, Requirement::Input | Requirement::Base)
    }

    /// True if the plant may have this drive.
    pub(super) fn suits(&self, drive: DriveKind) -> bool {
        match self.asks {
            Requirement::Nothing => true,
            Requirement::Input => drive != DriveKind::None,
            Requirement::Base => drive == DriveKind::Base,
            Requirement::NoBase => drive != DriveKind::Base,
        }
    }

    pub(super) fn shows(&self, excitation_kind: ExcitationKind) -> bool {
        match excitation_kind {
            ExcitationKind::Multisine | ExcitationKind::SweepPair | ExcitationKind::Tones => true,
            ExcitationKind::Decay => self.can_be_hidden(excitation_kind) && self.in_a_decay,
            ExcitationKind::SingleTone => self.in_a_tone,
        }
    }
}

type BuildEffect = fn(f64, &Draws, &HostPlant) -> Contribution;

/// An effect seen under every excitation.
const fn effect(name: &'static str, title: &'static str, build: BuildEffect, first: f64, most: f64) -> Effect {
    Effect {
        name,
        title,
        build,
        first,
        most,
        asks: Requirement::Nothing,
        rubs: false,
        in_a_tone: true,
        in_a_decay: true,
        catalogued: true,
    }
}

const fn asking(asks: Requirement, effect: Effect) -> Effect {
    Effect { asks, ..effect }
}

/// Linear: one frequency shows it as a stiffness and a damping only.
const fn linear(effect: Effect) -> Effect {
    Effect { in_a_tone: false, in_a_decay: false, ..effect }
}

const fn rubbing(effect: Effect) -> Effect {
    Effect { rubs: true, ..effect }
}

const fn outside(effect: Effect) -> Effect {
    Effect { catalogued: false, ..effect }
}

/// The largest delay, 1/20 of the natural period.
const LATEST: f64 = std::f64::consts::TAU / 20.0;

static EFFECTS: [Effect; 35] = [
    linear(asking(Requirement::Base, effect("viscous_damping", "viscous damping", friction::viscous, 1.0, 1.0))),
    rubbing(effect("coulomb_friction", "Coulomb friction", friction::coulomb, 1.0, 2.0)),
    rubbing(effect("stribeck_friction", "Stribeck friction", friction::stribeck, 0.8, 2.0)),
    rubbing(effect(
        "static_friction",
        "dry friction with a static level above the sliding one",
        friction::sticking,
        1.0,
        2.0,
    )),
    effect("quadratic_damping", "quadratic damping", friction::quadratic, 2.0, 5.0),
    effect("cubic_damping", "cubic damping", friction::cubic, 3.0, 10.0),
    effect(
        "displacement_dependent_damping",
        "damping that grows with displacement",
        friction::displacement_dependent,
        4.0,
        10.0,
    ),
    effect(
        "position_dependent_friction",
        "dry friction that grows with displacement",
        friction::position_dependent,
        1.0,
        1.0,
    ),
    linear(asking(
        Requirement::Base,
        effect("linear_stiffness", "a spring to the ground", stiffness::linear, 1.0, 1.0),
    )),
    effect("quadratic_stiffness", "quadratic stiffness", stiffness::quadratic, 2.5, 2.0),
    effect("cubic_stiffness", "cubic stiffness", stiffness::cubic, 4.0, 4.0),
    effect("quintic_stiffness", "quintic stiffness", stiffness::quintic, 6.0, 8.0),
    effect("clearance", "springs beyond a gap", stiffness::clearance, 5.0, 20.0),
    effect("one_sided_stop", "a stop on one side", stiffness::one_sided_stop, 5.0, 20.0),
    effect("bilinear_stiffness", "a spring that is stiffer on one side", stiffness::bilinear, 1.5, 1.0),
    asking(
        Requirement::NoBase,
        effect("pendulum_restoring", "the restoring force of a pendulum", stiffness::pendulum, 6.0, 1.6),
    ),
    effect("bouc_wen_hysteresis", "hysteresis (Bouc-Wen)", memory::bouc_wen, 2.0, 3.0),
    linear(effect("viscoelastic_relaxation", "viscoelastic relaxation (Maxwell branch)", memory::maxwell, 1.5, 2.0)),
    Effect {
        in_a_tone: false,
        ..effect("second_mode", "a second mode (attached oscillator)", memory::second_mode, 0.5, 0.3)
    },
    effect("constant_force", "a constant force", driving::constant_force, 1.0, 1.0),
    linear(asking(
        Requirement::Base,
        effect("base_velocity", "coupling to the base's velocity", driving::base_velocity, 2.0, 1.0),
    )),
    linear(asking(Requirement::Input, effect("input_delay", "a delay of the input", driving::delay, 2.0, LATEST))),
    asking(Requirement::Input, effect("input_saturation", "an input that saturates", driving::saturation, 3.0, 0.7)),
    linear(asking(Requirement::Base, effect("input_gain", "another gain of the input", driving::gain, 2.0, 0.5))),
    effect("unmeasured_harmonic_force", "a harmonic force that is not measured", driving::harmonic, 1.4, 1.0),
    effect("parametric_stiffness", "a stiffness that varies in time", stiffness::parametric, 1.4, 0.4),
    effect("stiffness_drift", "a stiffness that drifts", stiffness::drift, 3.0, 1.0),
    effect("sensor_offset", "a sensor with another zero in every record", driving::offset, 1.0, 1.0),
    effect("sensor_clipping", "a displacement sensor that clips", driving::clipping, 2.0, 0.3),
    outside(linear(effect("fractional_damping", "fractional damping", memory::fractional, 1.0, 2.0))),
    outside(effect("magnet", "a magnet", stiffness::magnet, 1.0, 10.0)),
    outside(effect("play_operator", "a damper reached through a loose joint", memory::play, 3.0, 20.0)),
    outside(rubbing(effect(
        "rate_dependent_friction",
        "dry friction that grows with the logarithm of the rate",
        friction::rate_dependent,
        0.4,
        2.0,
    ))),
    outside(effect("impact_restitution", "a stiff stop that takes energy", stiffness::impact, 10.0, 60.0)),
    outside(effect("inertia_nonlinearity", "an inertia that grows with displacement", stiffness::inertia, 3.0, 1.5)),
];

/// Pairs of effects that are sensible together.
static PAIRS: [[&str; 2]; 12] = [
    ["coulomb_friction", "quadratic_stiffness"],
    ["input_delay", "coulomb_friction"],
    ["clearance", "quadratic_damping"],
    ["cubic_stiffness", "coulomb_friction"],
    ["cubic_stiffness", "quadratic_damping"],
    ["unmeasured_harmonic_force", "coulomb_friction"],
    ["constant_force", "cubic_stiffness"],
    ["one_sided_stop", "coulomb_friction"],
    ["second_mode", "cubic_stiffness"],
    ["viscous_damping", "cubic_stiffness"],
    ["bilinear_stiffness", "cubic_damping"],
    ["sensor_offset", "coulomb_friction"],
];

pub(super) fn find(name: &str) -> Option<&'static Effect> {
    EFFECTS.iter().find(|e| e.name == name)
}

/// The effects that have a name in the program's interface.
pub fn names() -> impl Iterator<Item = &'static str> {
    EFFECTS.iter().filter(|e| e.catalogued).map(|e| e.name)
}

/// Effects beyond those: what no catalogue of named effects should claim to know.
pub fn outside_names() -> impl Iterator<Item = &'static str> {
    EFFECTS.iter().filter(|e| !e.catalogued).map(|e| e.name)
}

/// Pairs of effects that are sensible together.
pub fn pairs() -> &'static [[&'static str; 2]] {
    &PAIRS
}

/// True if an effect has a place in a plant with this drive.
pub(crate) fn suits(name: &str, drive: DriveKind) -> bool {
    find(name).is_some_and(|e| e.suits(drive))
}

/// An effect's name as the catalogue holds it; none if the rig does not know it.
pub(crate) fn known_name(name: &str) -> Option<&'static str> {
    find(name).map(|e| e.name)
}

/// An effect's name in words; none if the rig does not know it.
pub fn title(name: &str) -> Option<&'static str> {
    find(name).map(|e| e.title)
}

/// True if an effect can be drawn under an excitation at all: one on the input needs an input.
pub fn possible(effect: &str, excitation_kind: ExcitationKind) -> bool {
    find(effect).is_some_and(|e| e.can_be_hidden(excitation_kind))
}

/// True if the physics lets an effect show under an excitation as something else than another stiffness and another viscous
/// damping. That another effect shows alike is not excluded.
pub fn exercised(effect: &str, excitation_kind: ExcitationKind) -> bool {
    find(effect).is_some_and(|e| e.shows(excitation_kind))
}
