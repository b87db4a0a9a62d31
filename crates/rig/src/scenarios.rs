//! The scenarios: plants, excitations and sensors with values for everything.

use std::sync::LazyLock;

use super::classics::CLASSICS;
use super::plant::Plant;
use super::plants::{DUFFING, FRICTION, LORENZ, PlantKind, PlantParameter, THREE_MASSES, TWO_MASSES};
use super::sensor::{Noise, Sensor};
use super::structures::{BEAM, BEAM_ON_BASE, CHAIN, CHAIN_ON_BASE};

/// How a scenario sets its plant in motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScenarioExcitation {
    /// Harmonic input `amplitude × cos(2πft)`, one record for each of `frequencies`, or all tones in one.
    Tones,
    /// Two records of a linear chirp between two frequencies: up, then down.
    Sweep,
    /// Evenly spaced harmonics between two frequencies, with random phases.
    Multisine,
    /// Released from a displacement, no input.
    Release,
    /// Left to itself from its initial state, no input.
    None,
}

/// A plant, its excitation and its sensors, with values for everything: a constant that [`super::generate`] makes a
/// [`super::Setup`] of.
#[derive(Debug)]
pub struct Scenario {
    /// The name it is called by.
    pub name: &'static str,
    /// What it is, in one line.
    pub summary: &'static str,
    /// How the plant is set in motion.
    pub excitation_kind: ScenarioExcitation,
    /// Sampling rate, Hz.
    pub rate: f64,
    /// Duration of each record, s.
    pub duration: f64,
    /// Time before each record in which the motion settles, s.
    pub settle: f64,
    /// Amplitude of the input (of each tone), or the displacement from which the plant is released.
    pub amplitude: f64,
    /// Frequencies of the tones, or the two ends of a sweep or band, Hz.
    pub frequencies: &'static [f64],
    /// Number of harmonics of a multisine.
    pub lines: usize,
    /// State at t = 0: displacements, then velocities; at rest where none is given. A release begins at its amplitude instead.
    pub initial: &'static [f64],
    /// What is measured of the motion, as in [`super::ScenarioOptions::measure`]; every displacement (or state) where nothing is said.
    pub measures: &'static [&'static str],
    /// What measures the motion.
    pub sensor: Sensor,
    /// What measures the input.
    pub input_sensor: Sensor,
    pub(super) plant: &'static PlantKind,
    pub(super) changed: &'static [(&'static str, f64)],
}

impl Scenario {
    /// The plant's parameters, with the scenario's values.
    pub fn parameters(&self) -> Vec<PlantParameter> {
        let own =
            |p: &PlantParameter| self.changed.iter().find(|(name, _)| *name == p.name).map_or(p.value, |(_, v)| *v);
        self.plant.parameters.iter().map(|p| PlantParameter { value: own(p), ..*p }).collect()
    }

    /// The plant, with the scenario's parameters.
    pub fn plant(&self) -> Plant {
        let values: Vec<f64> = self.parameters().iter().map(|p| p.value).collect();
        (self.plant.build)(&values)
    }
}

pub(super) const BASIS: Scenario = Scenario {
    name: "",
    summary: "",
    excitation_kind: ScenarioExcitation::Tones,
    rate: 100.0,
    duration: 70.0,
    settle: 0.0,
    amplitude: 1.0,
    frequencies: &[],
    lines: 0,
    initial: &[0.0, 0.0],
    measures: &[],
    sensor: Sensor::PERFECT,
    input_sensor: Sensor::PERFECT,
    plant: &DUFFING,
    changed: &[],
};

const DUFFING_TONE: Scenario = Scenario {
    name: "duffing",
    summary: "Duffing oscillator, harmonic force at 1.2 rad/s, from rest",
    frequencies: &[0.190_985_931_710_274_4],
    ..BASIS
};

const FRICTION_TONES: Scenario = Scenario {
    name: "friction",
    summary: "base-excited mass with dry friction, let go at 5 mm while the base runs, four tones, one record each",
    rate: 1000.0,
    duration: 16.0,
    amplitude: 2.5e-3,
    frequencies: &[2.013, 2.583, 4.611, 5.242],
    // From here the mass never sticks at these tones, nor at the report's fifth, 5.843 Hz.
    initial: &[0.005, 0.0],
    plant: &FRICTION,
    ..BASIS
};

const FRICTION_MULTISINE: Scenario = Scenario {
    name: "friction-multisine",
    summary: "base-excited mass with dry friction, random-phase multisine base motion",
    excitation_kind: ScenarioExcitation::Multisine,
    duration: 32.0,
    amplitude: 1e-3,
    frequencies: &[1.0, 8.0],
    lines: 29,
    initial: &[0.0, 0.0],
    ..FRICTION_TONES
};

static OWN: [Scenario; 18] = [
    DUFFING_TONE,
    Scenario {
        name: "duffing-noisy",
        summary: "the same, noise of 0.01 m on the displacement",
        sensor: Sensor { noise: Noise::Deviation(0.01), ..Sensor::PERFECT },
        ..DUFFING_TONE
    },
    Scenario {
        name: "duffing-sweep",
        summary: "Duffing oscillator, force swept up and down through resonance, two records",
        excitation_kind: ScenarioExcitation::Sweep,
        duration: 200.0,
        frequencies: &[0.05, 0.5],
        ..DUFFING_TONE
    },
    Scenario {
        name: "duffing-multisine",
        summary: "Duffing oscillator, random-phase multisine force",
        excitation_kind: ScenarioExcitation::Multisine,
        duration: 100.0,
        frequencies: &[0.05, 0.5],
        lines: 10,
        ..DUFFING_TONE
    },
    Scenario {
        name: "duffing-decay",
        summary: "Duffing oscillator, released from 2 m",
        excitation_kind: ScenarioExcitation::Release,
        duration: 60.0,
        amplitude: 2.0,
        frequencies: &[],
        ..DUFFING_TONE
    },
    FRICTION_TONES,
    Scenario {
        name: "friction-noisy",
        summary: "the same, noise of 1e-5 m on the displacement",
        sensor: Sensor { noise: Noise::Deviation(1e-5), ..Sensor::PERFECT },
        ..FRICTION_TONES
    },
    Scenario {
        name: "friction-experiment",
        summary: "the same as a test rig's lasers see it, transients cut: noise and quantisation on both channels",
        settle: 40.0,
        // Measured on records of a rig of this kind: steps of 0.77 and 0.38 µm, scatter of about 1 and 0.5 µm.
        sensor: Sensor { noise: Noise::Deviation(1e-6), resolution: 0.77e-6, ..Sensor::PERFECT },
        input_sensor: Sensor { noise: Noise::Deviation(0.5e-6), resolution: 0.38e-6, ..Sensor::PERFECT },
        ..FRICTION_TONES
    },
    Scenario {
        name: "friction-vibrometer",
        summary: "base-excited mass with dry friction, random-phase multisine; a laser vibrometer shows its velocity alone",
        measures: &["v"],
        sensor: Sensor { noise: Noise::ShareOfPeak(0.002), ..Sensor::PERFECT },
        ..FRICTION_MULTISINE
    },
    Scenario {
        name: "friction-sweep",
        summary: "base-excited mass with dry friction, base swept up and down through resonance, two records",
        excitation_kind: ScenarioExcitation::Sweep,
        duration: 60.0,
        amplitude: 0.5e-3,
        frequencies: &[1.0, 8.0],
        initial: &[0.0, 0.0],
        ..FRICTION_TONES
    },
    FRICTION_MULTISINE,
    Scenario {
        name: "friction-decay",
        summary: "mass with dry friction, released from 10 mm, comes to a stop",
        excitation_kind: ScenarioExcitation::Release,
        duration: 5.0,
        amplitude: 0.01,
        frequencies: &[],
        initial: &[0.0, 0.0],
        ..FRICTION_TONES
    },
    Scenario {
        name: "stick-slip",
        summary: "base-excited mass with friction strong enough to stick in every period, static above sliding friction",
        frequencies: &[0.6, 0.9, 1.3],
        changed: &[("F", 0.4), ("static", 1.3)],
        initial: &[0.0, 0.0],
        ..FRICTION_TONES
    },
    Scenario {
        name: "lorenz",
        summary: "Lorenz system (sigma 10, rho 28, beta 8/3), every state measured",
        excitation_kind: ScenarioExcitation::None,
        rate: 500.0,
        duration: 20.0,
        amplitude: 0.0,
        initial: &[-8.0, 8.0, 27.0],
        plant: &LORENZ,
        ..BASIS
    },
    TWO_MASSES_SHAKEN,
    Scenario {
        name: "two-masses-accelerometers",
        summary: "the same, an accelerometer on either mass, AC-coupled at 0.1 Hz",
        measures: &["a"],
        sensor: Sensor { noise: Noise::ShareOfPeak(0.003), high_pass: 0.1, ..Sensor::PERFECT },
        ..TWO_MASSES_SHAKEN
    },
    Scenario {
        name: "base-accelerometer",
        summary: "a mass on a shaken base, a spring and a damper between; an accelerometer with an offset on the mass",
        rate: 400.0,
        measures: &["a"],
        sensor: Sensor { noise: Noise::ShareOfPeak(0.003), offset: 0.05, ..Sensor::PERFECT },
        changed: &[("F", 0.0), ("c", 1.2)],
        ..FRICTION_MULTISINE
    },
    Scenario {
        name: "three-masses",
        summary: "three masses in a chain, random-phase multisine force on the first; F23=0.5 is friction between 2 and 3",
        initial: &[0.0; 6],
        plant: &THREE_MASSES,
        ..TWO_MASSES_SHAKEN
    },
];

const TWO_MASSES_SHAKEN: Scenario = Scenario {
    name: "two-masses",
    summary: "two masses in a chain, random-phase multisine force on the first; F12=0.5 is friction between them",
    excitation_kind: ScenarioExcitation::Multisine,
    rate: 200.0,
    duration: 20.0,
    amplitude: 4.0,
    frequencies: &[0.5, 12.0],
    lines: 60,
    initial: &[0.0; 4],
    plant: &TWO_MASSES,
    ..BASIS
};

const BEAM_SHAKEN: Scenario = Scenario {
    name: "beam",
    summary: "cantilever of n elements, multisine force at a node, accelerometers; cubic=, friction=, stop=, joint= add a force at place",
    excitation_kind: ScenarioExcitation::Multisine,
    // Between samples the forces of a band are a smooth curve where there are eight or more a period.
    rate: 1000.0,
    duration: 10.0,
    amplitude: 1.0,
    frequencies: &[1.0, 120.0],
    lines: 240,
    initial: &[],
    measures: &["a2", "a4", "a6"],
    sensor: ACCELEROMETER,
    plant: &BEAM,
    ..BASIS
};

const CHAIN_SHAKEN: Scenario = Scenario {
    name: "chain",
    summary: "chain of n masses, multisine force on one, accelerometers; cubic=, friction=, stop=, joint= add a force at place",
    rate: 200.0,
    duration: 40.0,
    amplitude: 3.0,
    frequencies: &[0.5, 18.0],
    measures: &["a"],
    plant: &CHAIN,
    ..BEAM_SHAKEN
};

/// One per cent of noise, as of a good accelerometer on a structure that moves well.
const ACCELEROMETER: Sensor = Sensor { noise: Noise::ShareOfRms(0.01), ..Sensor::PERFECT };

static STRUCTURES: [Scenario; 5] = [
    CHAIN_SHAKEN,
    Scenario {
        name: "chain-base",
        summary: "the same, shaken at its ground",
        amplitude: 1e-3,
        plant: &CHAIN_ON_BASE,
        ..CHAIN_SHAKEN
    },
    BEAM_SHAKEN,
    Scenario {
        name: "beam-base",
        summary: "the same, shaken at its clamp",
        amplitude: 1e-5,
        plant: &BEAM_ON_BASE,
        ..BEAM_SHAKEN
    },
    Scenario {
        name: "joint",
        summary: "cantilever whose tip is held by a joint that slips (Bouc-Wen), multisine force at a node, accelerometers",
        measures: &["a"],
        changed: &[("n", 4.0), ("place", 4.0), ("joint", 150.0), ("slip", 0.4)],
        ..BEAM_SHAKEN
    },
];

static SCENARIOS: LazyLock<Vec<&'static Scenario>> =
    LazyLock::new(|| OWN.iter().chain(&STRUCTURES).chain(&CLASSICS).collect());

/// Every scenario of the rig.
pub fn scenarios() -> &'static [&'static Scenario] {
    &SCENARIOS
}
