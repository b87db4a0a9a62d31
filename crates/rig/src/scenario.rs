use std::fmt::Write as _;

use sindyscope_values::model::Model;
use sindyscope_values::record::{Record, Role};
use sindyscope_values::term::{Expression, Kind, Layout, Symbol};

use super::RigError;
use super::excitation::Excitation;
use super::motion::PlantMotion;
use super::plant::Plant;
use super::plants::{DUFFING, FRICTION, LORENZ, PlantKind, PlantParameter, THREE_MASSES, TWO_MASSES};
use super::response::SampleTimes;
use super::sensor::{Noise, Sensor};
use super::setup::{Drive, MeasuredChannel, MeasuredQuantity, Sensors, Setup, SetupRun};
use super::truth::{Truth, is_input};
use super::wave::Harmonic;
use super::words::{per_second, short};

/// The most samples, over all records, that one call makes.
const MOST_SAMPLES: f64 = 5e6;
/// The fewest samples of a record.
const FEWEST_SAMPLES: f64 = 10.0;
/// The longest motion, s.
const LONGEST: f64 = 1e5;
/// The largest amplitude, initial value or parameter.
const LARGEST: f64 = 1e9;
/// The most frequencies or lines.
const MOST_TONES: usize = 1000;

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

/// A plant, what shakes it and what watches it, with values for everything.
#[derive(Debug)]
pub struct Scenario {
    /// The name it is called by.
    pub name: &'static str,
    /// What it is, in one line.
    pub summary: &'static str,
    /// How the plant is set in motion.
    pub excitation_kind: ScenarioExcitation,
    /// SampleTimes rate, Hz.
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
    /// State at t = 0: displacements, then velocities. A release begins at its amplitude instead.
    pub initial: &'static [f64],
    /// What is measured of the motion, as in [`ScenarioOptions::measure`]; every displacement (or state) where nothing is said.
    pub measures: &'static [&'static str],
    /// What measures the motion.
    pub sensor: Sensor,
    /// What measures the input.
    pub input_sensor: Sensor,
    plant: &'static PlantKind,
    changed: &'static [(&'static str, f64)],
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

const BASIS: Scenario = Scenario {
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

static SCENARIOS: [Scenario; 18] = [
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
        // MeasuredSizes on records of a rig of this kind: steps of 0.77 and 0.38 µm, scatter of about 1 and 0.5 µm.
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
        summary: "three masses in a chain, random-phase multisine force on the first; --set F23=0.5: friction between 2 and 3",
        initial: &[0.0; 6],
        plant: &THREE_MASSES,
        ..TWO_MASSES_SHAKEN
    },
];

const TWO_MASSES_SHAKEN: Scenario = Scenario {
    name: "two-masses",
    summary: "two masses in a chain, random-phase multisine force on the first; --set F12=0.5: friction between them",
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

/// Every scenario of the rig.
pub fn scenarios() -> &'static [Scenario] {
    &SCENARIOS
}

/// What of a scenario is to be otherwise; nothing is, by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenarioOptions {
    /// Seed of the noise and of a multisine's phases.
    pub seed: u64,
    /// What is measured of the motion: `x`, `v` or `a` of every mass, or of one (`x1`, `a2`), each a channel. Of a first-order
    /// system its states.
    pub measure: Option<Vec<String>>,
    /// Noise on every channel of the motion.
    pub noise: Option<Noise>,
    /// What the motion's sensors show of nothing, in the channel's unit.
    pub offset: Option<f64>,
    /// How fast that grows, in the channel's unit per second.
    pub drift: Option<f64>,
    /// Corner frequency of the first-order high-pass of the motion's sensors, Hz; zero is none.
    pub high_pass: Option<f64>,
    /// Noise on the input.
    pub input_noise: Option<Noise>,
    /// Quantisation step of every channel, in its unit; zero is none.
    pub resolution: Option<f64>,
    /// SampleTimes rate, Hz.
    pub rate: Option<f64>,
    /// Duration of each record, s.
    pub duration: Option<f64>,
    /// Time before each record in which the motion settles, s.
    pub settle: Option<f64>,
    /// Amplitude of the input (of each tone), or the displacement from which the plant is released.
    pub amplitude: Option<f64>,
    /// Frequencies of the tones, or the two ends of a sweep or band, Hz.
    pub frequencies: Option<Vec<f64>>,
    /// All tones in one record.
    pub together: bool,
    /// Number of harmonics of a multisine.
    pub lines: Option<usize>,
    /// Time in which tones or a multisine fade in, s.
    pub ramp: Option<f64>,
    /// State at t = 0: displacements, then velocities.
    pub initial: Option<Vec<f64>>,
    /// Changed parameters of the plant, by name.
    pub parameters: Vec<(String, f64)>,
}

impl ScenarioOptions {
    /// The command line that makes the same records.
    pub fn command(&self, scenario: &str) -> String {
        let mut text = format!("sindyscope generate {scenario}");
        let list = |values: &[f64]| values.iter().copied().map(short).collect::<Vec<_>>().join(",");
        let number = |v: &Option<f64>| v.map(short);
        let options = [
            ("seed", Some(self.seed.to_string())),
            ("measure", self.measure.as_ref().map(|m| m.join(","))),
            ("noise", self.noise.map(|n| n.to_string())),
            ("offset", number(&self.offset)),
            ("drift", number(&self.drift)),
            ("high-pass", number(&self.high_pass)),
            ("input-noise", self.input_noise.map(|n| n.to_string())),
            ("resolution", number(&self.resolution)),
            ("rate", number(&self.rate)),
            ("duration", number(&self.duration)),
            ("settle", number(&self.settle)),
            ("amplitude", number(&self.amplitude)),
            ("frequencies", self.frequencies.as_deref().map(list)),
            ("together", self.together.then(String::new)),
            ("lines", self.lines.map(|n| n.to_string())),
            ("ramp", number(&self.ramp)),
            ("initial", self.initial.as_deref().map(list)),
        ];
        let given = options.into_iter().filter_map(|(name, value)| value.map(|v| (name, v)));
        let changed = self.parameters.iter().map(|(name, value)| ("set", format!("{name}={}", short(*value))));
        for (name, value) in given.chain(changed) {
            text += " --";
            text += name;
            if !value.is_empty() {
                text.push(' ');
                text += &value;
            }
        }
        text
    }
}

/// Records of the rig, and what made them.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenarioRun {
    /// The records.
    pub records: Vec<Record>,
    /// The equations of motion that made them; dry friction as a sign term, true as long as nothing sticks.
    pub truth: Truth,
    /// What made them, one line each, for the head of a file.
    pub comments: Vec<String>,
}

/// Makes the records of a scenario.
///
/// # Errors
/// An unknown scenario; an option that is out of bounds or that the scenario has no use for; a motion that grows without
/// bound.
pub fn generate(name: &str, options: &ScenarioOptions) -> Result<ScenarioRun, RigError> {
    let scenario = SCENARIOS.iter().find(|s| s.name == name).ok_or_else(|| RigError::UnknownScenario {
        name: name.to_owned(),
        known: SCENARIOS.iter().map(|s| s.name).collect::<Vec<_>>().join(", "),
    })?;
    let test = CheckedScenario::new(scenario, options)?;
    let setup = test.setup(scenario, options.seed);
    let SetupRun { records, motions, truth } = setup.run()?;
    let Setup { plant, .. } = &setup;
    let shaken = matches!(
        scenario.excitation_kind,
        ScenarioExcitation::Tones | ScenarioExcitation::Sweep | ScenarioExcitation::Multisine
    );
    let equations = if shaken { plant.truth() } else { unforced(plant.truth()) };
    let mut comments = test.comments(scenario, options, &equations);
    let stops: Vec<f64> = motions.iter().flat_map(|motion| stopped(motion, &test.sampling)).collect();
    if !plant.contacts.is_empty() {
        comments.push(match stops.len() {
            0 => "the mass never sticks".to_owned(),
            1 => format!("the mass sticks once, {:.4} s long", stops[0]),
            n => format!("the mass sticks {n} times, {:.4} s in all", stops.iter().sum::<f64>()),
        });
    }
    comments.push(format!("made by: {}", options.command(name)));
    Ok(ScenarioRun { records, truth, comments })
}

/// How long contacts stuck while a motion was sampled, each time.
fn stopped(motion: &PlantMotion, sampling: &SampleTimes) -> impl Iterator<Item = f64> {
    let (first, last) = (sampling.start, sampling.time(sampling.count - 1));
    motion.stops.iter().map(move |s| s.to.min(last) - s.from.max(first)).filter(|length| *length > 0.0)
}

/// A record to be made.
struct RequestedRecord {
    name: String,
    excitation: Option<Excitation>,
}

/// A scenario with its options worked in and checked.
struct CheckedScenario {
    parameters: Vec<f64>,
    initial: Vec<f64>,
    sampling: SampleTimes,
    records: Vec<RequestedRecord>,
    shaken: String,
    measured: Vec<Role>,
    sensor: Sensor,
    input_sensor: Sensor,
}

fn bad<T>(option: &'static str, problem: impl Into<String>) -> Result<T, RigError> {
    Err(RigError::BadOption { option, problem: problem.into() })
}

/// A number within bounds, or an error that names them.
fn within(option: &'static str, value: f64, least: f64, most: f64) -> Result<f64, RigError> {
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        bad(option, format!("{value} is out of bounds: give a number from {least} to {most}"))
    }
}

impl CheckedScenario {
    fn new(scenario: &Scenario, options: &ScenarioOptions) -> Result<Self, RigError> {
        refuse_idle_options(scenario, options)?;
        let rate = within("--rate", options.rate.unwrap_or(scenario.rate), 1e-3, 1e7)?;
        let duration = within("--duration", options.duration.unwrap_or(scenario.duration), 1e-6, LONGEST)?;
        let settle = within("--settle", options.settle.unwrap_or(scenario.settle), 0.0, LONGEST)?;
        let amplitude = within("--amplitude", options.amplitude.unwrap_or(scenario.amplitude), -LARGEST, LARGEST)?;
        for (option, noise) in [("--noise", options.noise), ("--input-noise", options.input_noise)] {
            if noise.is_some_and(|n| !n.is_valid()) {
                return bad(option, "give a standard deviation of zero or more");
            }
        }
        let (records, shaken) = shake(scenario, options, amplitude, settle + duration, rate)?;
        let samples = (duration * rate).round();
        if samples < FEWEST_SAMPLES {
            return bad(
                "--duration",
                format!("{duration} s at {rate} Hz are {samples} samples; a record has at least {FEWEST_SAMPLES}"),
            );
        }
        if samples * records.len() as f64 > MOST_SAMPLES {
            let total = samples * records.len() as f64;
            return bad(
                "--duration",
                format!("{total} samples in all are more than {MOST_SAMPLES}; take less of them or a lower --rate"),
            );
        }
        let resolution = options.resolution.map(|r| within("--resolution", r, 0.0, LARGEST)).transpose()?;
        let watch = |sensor: Sensor, noise: Option<Noise>| Sensor {
            noise: noise.unwrap_or(sensor.noise),
            resolution: resolution.unwrap_or(sensor.resolution),
            ..sensor
        };
        let offset = options.offset.map(|o| within("--offset", o, -LARGEST, LARGEST)).transpose()?;
        let drift = options.drift.map(|d| within("--drift", d, -LARGEST, LARGEST)).transpose()?;
        let high_pass = options.high_pass.map(|h| within("--high-pass", h, 0.0, 0.5 * rate)).transpose()?;
        let of_motion = scenario.sensor;
        let sensor = Sensor {
            offset: offset.unwrap_or(of_motion.offset),
            drift: drift.unwrap_or(of_motion.drift),
            high_pass: high_pass.unwrap_or(of_motion.high_pass),
            ..watch(of_motion, options.noise)
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number within the bounds above"
        )]
        let count = samples as usize;
        Ok(Self {
            parameters: parameters(scenario, options)?,
            initial: initial(scenario, options, amplitude)?,
            sampling: SampleTimes { start: settle, interval: 1.0 / rate, count },
            records,
            shaken,
            measured: measured(scenario, options)?,
            sensor,
            input_sensor: watch(scenario.input_sensor, options.input_noise),
        })
    }

    /// The test that makes the records.
    fn setup(&self, scenario: &Scenario, seed: u64) -> Setup {
        let plant = (scenario.plant.build)(&self.parameters);
        let layout = plant.smooth.layout;
        let drive = |record: &RequestedRecord| {
            let excitation = record.excitation.clone().unwrap_or_else(Excitation::rest);
            Drive {
                name: record.name.clone(),
                inputs: vec![excitation; layout.inputs],
                initial: self.initial.clone(),
                sampling: self.sampling,
                clock: (0.0, self.sampling.interval),
                clock_seed: 0,
                held_out: false,
            }
        };
        let mut channels: Vec<MeasuredChannel> =
            self.measured.iter().map(|role| self.motion_channel(scenario, &layout, *role)).collect();
        if self.records.iter().any(|record| record.excitation.is_some()) {
            let (role, name) = (Role::Input(0), layout.name(Symbol::Input(0)));
            let unit = scenario.plant.units.1;
            channels.push(MeasuredChannel::new(name, role, unit, MeasuredQuantity::Input(0), self.input_sensor));
        }
        // Stream 0 is a multisine's phases.
        channels.iter_mut().zip(1..).for_each(|(channel, stream)| channel.stream = stream);
        let streams_a_record = self.measured.len() as u64 + 1;
        Setup {
            drives: self.records.iter().map(drive).collect(),
            sensors: Sensors { channels, jitter: 0.0, streams_a_record },
            plant,
            seed,
        }
    }

    /// The channel of a mass's displacement, velocity or acceleration, or of a state.
    fn motion_channel(&self, scenario: &Scenario, layout: &Layout, role: Role) -> MeasuredChannel {
        let unit = scenario.plant.units.0;
        let n = layout.freedoms;
        let (name, unit, quantity) = match role {
            Role::Velocity(i) => (layout.name(Symbol::Rate(i)), per_second(unit, 1), MeasuredQuantity::State(n + i)),
            Role::Acceleration(i) => {
                let name = layout.name(Symbol::State(i)).replacen('x', "a", 1);
                (name, per_second(unit, 2), MeasuredQuantity::Rate(n + i))
            }
            Role::Displacement(i) | Role::Input(i) => {
                (layout.name(Symbol::State(i)), unit.to_owned(), MeasuredQuantity::State(i))
            }
        };
        MeasuredChannel::new(name, role, unit, quantity, self.sensor)
    }

    fn comments(&self, scenario: &Scenario, options: &ScenarioOptions, truth: &Model) -> Vec<String> {
        let mut lines = vec![format!("Sindyscope's virtual rig, scenario {}: {}", scenario.name, scenario.summary)];
        lines.extend(truth.iter().map(|(state, equation)| {
            let mut line = format!("truth: d{}/dt =", truth.layout.name(state));
            for (k, part) in equation.terms.iter().enumerate() {
                let sign = if part.coefficient < 0.0 { "-" } else { "+" };
                let term = match part.term.expression() {
                    Expression::Sum(_) => format!("({})", part.term.text(&truth.layout)),
                    _ => part.term.text(&truth.layout),
                };
                let sign = if k == 0 && sign == "+" { String::new() } else { format!(" {sign}") };
                let size = part.coefficient.abs();
                let factor = if size == 1.0 { String::new() } else { format!("{size:?}*") };
                let _ = write!(line, "{sign} {factor}{term}");
            }
            line
        }));
        let changed = scenario.plant.parameters.iter().zip(&self.parameters);
        let holding = changed.into_iter().find(|(p, value)| p.name == "static" && **value > 1.0);
        if let Some((_, ratio)) = holding {
            lines.push(format!("static friction: holds up to {ratio:?} times the sliding friction"));
        }
        lines.push(format!("excitation: {}", self.shaken));
        lines.push(format!("initial state: {:?}", self.initial));
        if self.sampling.start > 0.0 {
            lines.push(format!("the first {:?} s of the motion are left out", self.sampling.start));
        }
        let motion = match self.measured.first() {
            Some(Role::Velocity(_)) => "velocity",
            Some(Role::Acceleration(_)) => "acceleration",
            _ => "displacement",
        };
        let watched = [(motion, self.sensor), ("input", self.input_sensor)];
        for (what, Sensor { noise, resolution, offset, drift, high_pass, .. }) in watched {
            if noise != Noise::NONE {
                let size = match noise {
                    Noise::Deviation(deviation) => format!("{deviation:?}"),
                    Noise::ShareOfPeak(share) => format!("{:?} % of the largest magnitude", 100.0 * share),
                    Noise::ShareOfRms(share) => format!("{:?} % of the RMS", 100.0 * share),
                };
                lines.push(format!(
                    "noise of the {what}: white, Gaussian, standard deviation {size}, seed {}",
                    options.seed
                ));
            }
            if resolution > 0.0 {
                lines.push(format!("resolution of the {what}: {resolution:?}"));
            }
            if offset != 0.0 || drift != 0.0 {
                lines.push(format!("zero of the {what}: off by {offset:?}, growing by {drift:?} a second"));
            }
            if high_pass > 0.0 {
                lines.push(format!("high-pass of the {what}: first order, corner at {high_pass:?} Hz"));
            }
        }
        lines
    }
}

/// An option that a scenario has no use for is a mistake, not something to pass over.
fn refuse_idle_options(scenario: &Scenario, options: &ScenarioOptions) -> Result<(), RigError> {
    let Scenario { name, excitation_kind, .. } = scenario;
    let shaken = !matches!(excitation_kind, ScenarioExcitation::Release | ScenarioExcitation::None);
    let idle = [
        (
            "--amplitude",
            options.amplitude.is_some() && *excitation_kind == ScenarioExcitation::None,
            "has no excitation",
        ),
        ("--frequencies", options.frequencies.is_some() && !shaken, "has no excitation"),
        ("--input-noise", options.input_noise.is_some() && !shaken, "has no input"),
        ("--together", options.together && *excitation_kind != ScenarioExcitation::Tones, "has no separate tones"),
        ("--lines", options.lines.is_some() && *excitation_kind != ScenarioExcitation::Multisine, "is no multisine"),
        (
            "--ramp",
            options.ramp.is_some()
                && !matches!(excitation_kind, ScenarioExcitation::Tones | ScenarioExcitation::Multisine),
            "is not faded in by it",
        ),
        (
            "--settle",
            options.settle.is_some() && *excitation_kind == ScenarioExcitation::Sweep,
            "is over when it has settled",
        ),
    ];
    match idle.into_iter().find(|(_, given, _)| *given) {
        Some((option, _, reason)) => bad(option, format!("the scenario {name} {reason}; leave the option out")),
        None => Ok(()),
    }
}

fn parameters(scenario: &Scenario, options: &ScenarioOptions) -> Result<Vec<f64>, RigError> {
    let mut parameters = scenario.parameters();
    for (name, value) in &options.parameters {
        let known = parameters.iter().map(|p| p.name).collect::<Vec<_>>().join(", ");
        let Some(parameter) = parameters.iter_mut().find(|p| p.name == name) else {
            return bad("--set", format!("the plant of {} has no parameter {name:?}; it has {known}", scenario.name));
        };
        parameter.value = within("--set", *value, parameter.least.max(-LARGEST), LARGEST)?;
    }
    Ok(parameters.into_iter().map(|p| p.value).collect())
}

/// The channels of the motion that are asked for.
fn measured(scenario: &Scenario, options: &ScenarioOptions) -> Result<Vec<Role>, RigError> {
    let option = "--measure";
    let layout = scenario.plant().smooth.layout;
    let names: Vec<&str> = match &options.measure {
        Some(given) => given.iter().map(|name| name.trim()).collect(),
        None if scenario.measures.is_empty() => vec!["x"],
        None => scenario.measures.to_vec(),
    };
    let mut roles = Vec::new();
    for name in names {
        let mut letters = name.chars();
        let role: fn(usize) -> Role = match letters.next() {
            Some('x') => Role::Displacement,
            Some('v') if layout.kind == Kind::SecondOrder => Role::Velocity,
            Some('a') if layout.kind == Kind::SecondOrder => Role::Acceleration,
            Some('v' | 'a') => return bad(option, "a first-order system has states x1, x2, … alone"),
            _ => return bad(option, format!("{name:?}: write x, v or a, or one mass's as a2")),
        };
        let masses = match letters.as_str() {
            "" => 0..layout.freedoms,
            number => match number.parse::<usize>() {
                Ok(number) if (1..=layout.freedoms).contains(&number) => number - 1..number,
                _ => return bad(option, format!("{name:?}: the masses are numbered from 1 to {}", layout.freedoms)),
            },
        };
        for next in masses.map(role) {
            if roles.contains(&next) {
                return bad(option, format!("{name:?} is asked for twice"));
            }
            roles.push(next);
        }
    }
    if roles.is_empty() { bad(option, "name at least one channel") } else { Ok(roles) }
}

fn initial(scenario: &Scenario, options: &ScenarioOptions, amplitude: f64) -> Result<Vec<f64>, RigError> {
    let mut state = scenario.initial.to_vec();
    if scenario.excitation_kind == ScenarioExcitation::Release {
        if options.initial.is_some() && options.amplitude.is_some() {
            return bad("--initial", "a release has either an --amplitude or an --initial state");
        }
        state[0] = amplitude;
    }
    if let Some(given) = &options.initial {
        if given.len() != state.len() {
            return bad("--initial", format!("{} values for {} states", given.len(), state.len()));
        }
        for (value, given) in state.iter_mut().zip(given) {
            *value = within("--initial", *given, -LARGEST, LARGEST)?;
        }
    }
    Ok(state)
}

/// The records to be made, and what shakes them in words.
fn shake(
    scenario: &Scenario,
    options: &ScenarioOptions,
    amplitude: f64,
    duration: f64,
    rate: f64,
) -> Result<(Vec<RequestedRecord>, String), RigError> {
    let unit = scenario.plant.units.1;
    let single = |excitation| vec![RequestedRecord { name: scenario.name.to_owned(), excitation }];
    let frequencies = options.frequencies.as_deref().unwrap_or(scenario.frequencies);
    if frequencies.len() > MOST_TONES {
        return bad("--frequencies", format!("{} are more than {MOST_TONES}", frequencies.len()));
    }
    for frequency in frequencies {
        let fits = *frequency > 0.0 && *frequency < 0.5 * rate;
        if !fits {
            let most = 0.5 * rate;
            return bad(
                "--frequencies",
                format!("{frequency} Hz is not between 0 and half the sampling rate, {most} Hz"),
            );
        }
    }
    let ends = || match frequencies {
        [low, high] => Ok((*low, *high)),
        _ => bad("--frequencies", format!("the scenario {} takes two: from and to", scenario.name)),
    };
    let ramp = within("--ramp", options.ramp.unwrap_or(0.0), 0.0, LONGEST)?;
    let ramped = if ramp > 0.0 { format!(", faded in over {ramp:?} s") } else { String::new() };
    Ok(match scenario.excitation_kind {
        ScenarioExcitation::None => (single(None), "none".to_owned()),
        ScenarioExcitation::Release => (single(None), "none: released at t = 0".to_owned()),
        ScenarioExcitation::Tones => {
            let list = frequencies.iter().map(|f| format!("{f:?}")).collect::<Vec<_>>().join(", ");
            let apart = frequencies.len() > 1 && !options.together;
            let each = if apart { ", one record each" } else { "" };
            let words = format!("u = A cos(2 pi f t), A = {amplitude:?} {unit}, f = {list} Hz{each}{ramped}");
            let tone = |frequency: &f64| Harmonic { amplitude, frequency: *frequency, phase: 0.0 };
            let mut runs: Vec<RequestedRecord> = Vec::new();
            if frequencies.is_empty() {
                return bad("--frequencies", "give at least one");
            } else if apart {
                for frequency in frequencies {
                    let name = format!("{frequency}Hz");
                    if runs.iter().any(|r| r.name == name) {
                        return bad("--frequencies", format!("{frequency} Hz is given twice"));
                    }
                    let excitation = Excitation::tones([tone(frequency)]).fading_in(ramp);
                    runs.push(RequestedRecord { name, excitation: Some(excitation) });
                }
            } else {
                runs = single(Some(Excitation::tones(frequencies.iter().map(tone)).fading_in(ramp)));
            }
            (runs, words)
        }
        ScenarioExcitation::Sweep => {
            let (low, high) = ends()?;
            let sweep = |name: &str, from, to| RequestedRecord {
                name: name.to_owned(),
                excitation: Some(Excitation::sweep(amplitude, from, to, duration)),
            };
            let words =
                format!("linear sweep, A = {amplitude:?} {unit}, {low:?} to {high:?} Hz and back, one record each");
            (vec![sweep("up", low, high), sweep("down", high, low)], words)
        }
        ScenarioExcitation::Multisine => {
            let (low, high) = ends()?;
            let lines = options.lines.unwrap_or(scenario.lines);
            if !(1..=MOST_TONES).contains(&lines) {
                return bad("--lines", format!("{lines} is out of bounds: give a number from 1 to {MOST_TONES}"));
            }
            let words = format!(
                "multisine, {lines} harmonics from {low:?} to {high:?} Hz, RMS of one tone of {amplitude:?} {unit}, phases of seed {}{ramped}",
                options.seed
            );
            let excitation = Excitation::multisine(amplitude, (low, high), lines, options.seed).fading_in(ramp);
            (single(Some(excitation)), words)
        }
    })
}

/// The model of a plant that is left without its input.
fn unforced(mut model: Model) -> Model {
    for equation in &mut model.equations {
        equation.terms.retain(|t| !t.term.symbols().iter().any(is_input));
    }
    model.layout.inputs = 0;
    model
}

#[cfg(test)]
#[path = "scenario_tests.rs"]
mod tests;
