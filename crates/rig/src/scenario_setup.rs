//! A scenario with its options worked in and checked, as the test that makes its records.

use super::RigError;
use super::excitation::Excitation;
use super::response::SampleTimes;
use super::scenario_options::ScenarioOptions;
use super::scenarios::{Scenario, ScenarioExcitation};
use super::sensor::{Noise, Sensor};
use super::setup::{MeasuredChannel, MeasuredQuantity, RecordDrive, Sensors, Setup};
use super::wave::Harmonic;
use super::words::{per_second, short};
use sindyscope_values::record::Role;
use sindyscope_values::term::{Kind, Layout, Symbol};

/// The most samples, over all records, that one call makes.
const MOST_SAMPLES: f64 = 5e6;
/// The fewest samples of a record.
const FEWEST_SAMPLES: f64 = 10.0;
/// The longest motion, s.
const LONGEST: f64 = 1e5;
/// The largest amplitude, initial value or parameter.
const LARGEST: f64 = 1e9;
/// From the seed of one record's phases to that of the next: far from the seeds that people give.
const OTHER_PHASES: u64 = 0x9e37_79b9;
/// The most frequencies or lines.
const MOST_TONES: usize = 2000;

/// A record to be made.
pub(super) struct RequestedRecord {
    name: String,
    excitation: Option<Excitation>,
}

/// A scenario with its options worked in and checked.
pub(super) struct CheckedScenario {
    pub(super) parameters: Vec<f64>,
    pub(super) initial: Vec<f64>,
    pub(super) sampling: SampleTimes,
    pub(super) records: Vec<RequestedRecord>,
    pub(super) shaken: String,
    pub(super) measured: Vec<Role>,
    pub(super) sensor: Sensor,
    pub(super) input_sensor: Sensor,
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
    /// Works the options into a scenario.
    ///
    /// # Errors
    /// An option that is out of bounds or that the scenario has no use for.
    pub(super) fn new(scenario: &Scenario, options: &ScenarioOptions) -> Result<Self, RigError> {
        refuse_idle_options(scenario, options)?;
        let rate = within("rate", options.rate.unwrap_or(scenario.rate), 1e-3, 1e7)?;
        let duration = within("duration", options.duration.unwrap_or(scenario.duration), 1e-6, LONGEST)?;
        let settle = within("settle", options.settle.unwrap_or(scenario.settle), 0.0, LONGEST)?;
        let amplitude = within("amplitude", options.amplitude.unwrap_or(scenario.amplitude), -LARGEST, LARGEST)?;
        for (option, noise) in [("noise", options.noise), ("input-noise", options.input_noise)] {
            if noise.is_some_and(|n| !n.is_valid()) {
                return bad(option, "give a standard deviation of zero or more");
            }
        }
        let (records, shaken) = shake(scenario, options, amplitude, settle + duration, rate)?;
        let samples = (duration * rate).round();
        if samples < FEWEST_SAMPLES {
            return bad(
                "duration",
                format!("{duration} s at {rate} Hz are {samples} samples; a record has at least {FEWEST_SAMPLES}"),
            );
        }
        if samples * records.len() as f64 > MOST_SAMPLES {
            let total = samples * records.len() as f64;
            return bad(
                "duration",
                format!(
                    "{total} samples in all are more than {MOST_SAMPLES}; take less of them or a lower sampling rate"
                ),
            );
        }
        let resolution = options.resolution.map(|r| within("resolution", r, 0.0, LARGEST)).transpose()?;
        let watch = |sensor: Sensor, noise: Option<Noise>| Sensor {
            noise: noise.unwrap_or(sensor.noise),
            resolution: resolution.unwrap_or(sensor.resolution),
            ..sensor
        };
        let offset = options.offset.map(|o| within("offset", o, -LARGEST, LARGEST)).transpose()?;
        let drift = options.drift.map(|d| within("drift", d, -LARGEST, LARGEST)).transpose()?;
        let high_pass = options.high_pass.map(|h| within("high-pass", h, 0.0, 0.5 * rate)).transpose()?;
        let of_motion = scenario.sensor;
        let sensor = Sensor {
            offset: offset.unwrap_or(of_motion.offset),
            drift: drift.unwrap_or(of_motion.drift),
            high_pass: high_pass.unwrap_or(of_motion.high_pass),
            ..watch(of_motion, options.noise)
        };
        let parameters = parameters(scenario, options)?;
        let layout = (scenario.plant.build)(&parameters).smooth.layout;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number within the bounds above"
        )]
        let count = samples as usize;
        Ok(Self {
            initial: initial(scenario, options, amplitude, layout)?,
            sampling: SampleTimes { start: settle, interval: 1.0 / rate, count },
            records,
            shaken,
            measured: measured(scenario, options, layout)?,
            parameters,
            sensor,
            input_sensor: watch(scenario.input_sensor, options.input_noise),
        })
    }

    /// The test that makes the records.
    pub(super) fn setup(&self, scenario: &Scenario, seed: u64) -> Setup {
        let plant = (scenario.plant.build)(&self.parameters);
        let layout = plant.smooth.layout;
        let drive = |record: &RequestedRecord| {
            let excitation = record.excitation.clone().unwrap_or_else(Excitation::rest);
            let inputs = vec![excitation; layout.inputs];
            RecordDrive::new(record.name.clone(), inputs, self.initial.clone(), self.sampling)
        };
        let places = self.places();
        let number = |role: &Role| places.iter().position(|p| *p == role.index()).unwrap_or(0);
        let mut channels: Vec<MeasuredChannel> =
            self.measured.iter().map(|role| self.motion_channel(scenario, &layout, *role, number(role))).collect();
        if self.records.iter().any(|record| record.excitation.is_some()) {
            let (role, name) = (Role::Input(0), layout.name(Symbol::Input(0)));
            let unit = scenario.plant.units.1;
            channels.push(MeasuredChannel::new(name, role, unit, MeasuredQuantity::Input(0), self.input_sensor));
        }
        Setup {
            drives: self.records.iter().map(drive).collect(),
            // A stream for an input is set aside in every record, whether there is one or not.
            sensors: Sensors { streams_a_record: self.measured.len() as u64 + 1, ..Sensors::new(channels) },
            plant,
            seed,
        }
    }

    /// The masses that are measured, in order: channels count them without a hole.
    pub(super) fn places(&self) -> Vec<usize> {
        let mut places: Vec<usize> = self.measured.iter().map(|role| role.index()).collect();
        places.sort_unstable();
        places.dedup();
        places
    }

    /// The channel of a mass's displacement, velocity or acceleration, or of a state, by the number of its place among those
    /// that are measured.
    fn motion_channel(&self, scenario: &Scenario, layout: &Layout, role: Role, number: usize) -> MeasuredChannel {
        let unit = scenario.plant.units.0;
        let n = layout.freedoms;
        let (name, unit, quantity) = match role {
            Role::Velocity(i) => {
                (layout.name(Symbol::Rate(number)), per_second(unit, 1), MeasuredQuantity::State(n + i))
            }
            Role::Acceleration(i) => {
                let name = layout.name(Symbol::State(number)).replacen('x', "a", 1);
                (name, per_second(unit, 2), MeasuredQuantity::Rate(n + i))
            }
            Role::Displacement(i) | Role::Input(i) => {
                (layout.name(Symbol::State(number)), unit.to_owned(), MeasuredQuantity::State(i))
            }
        };
        let role = match role {
            Role::Velocity(_) => Role::Velocity(number),
            Role::Acceleration(_) => Role::Acceleration(number),
            Role::Displacement(_) | Role::Input(_) => Role::Displacement(number),
        };
        MeasuredChannel::new(name, role, unit, quantity, self.sensor)
    }
}

/// An option that a scenario has no use for is a mistake, not something to pass over.
fn refuse_idle_options(scenario: &Scenario, options: &ScenarioOptions) -> Result<(), RigError> {
    let Scenario { name, excitation_kind, .. } = scenario;
    let shaken = !matches!(excitation_kind, ScenarioExcitation::Release | ScenarioExcitation::None);
    let idle = [
        ("amplitude", options.amplitude.is_some() && *excitation_kind == ScenarioExcitation::None, "has no excitation"),
        ("frequencies", options.frequencies.is_some() && !shaken, "has no excitation"),
        ("input-noise", options.input_noise.is_some() && !shaken, "has no input"),
        ("together", options.together && *excitation_kind != ScenarioExcitation::Tones, "has no separate tones"),
        ("levels", options.levels.is_some() && *excitation_kind != ScenarioExcitation::Multisine, "is no multisine"),
        ("amplitude", options.levels.is_some() && options.amplitude.is_some(), "has its levels"),
        ("lines", options.lines.is_some() && *excitation_kind != ScenarioExcitation::Multisine, "is no multisine"),
        (
            "ramp",
            options.ramp.is_some()
                && !matches!(excitation_kind, ScenarioExcitation::Tones | ScenarioExcitation::Multisine),
            "is not faded in by it",
        ),
        (
            "settle",
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
            return bad("set", format!("the plant of {} has no parameter {name:?}; it has {known}", scenario.name));
        };
        parameter.value = within("set", *value, parameter.least.max(-LARGEST), LARGEST)?;
    }
    Ok(parameters.into_iter().map(|p| p.value).collect())
}

/// The channels of the motion that are asked for.
fn measured(scenario: &Scenario, options: &ScenarioOptions, layout: Layout) -> Result<Vec<Role>, RigError> {
    let option = "measure";
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

fn initial(
    scenario: &Scenario,
    options: &ScenarioOptions,
    amplitude: f64,
    layout: Layout,
) -> Result<Vec<f64>, RigError> {
    let mut state = scenario.initial.to_vec();
    if state.is_empty() {
        state.resize(layout.states(), 0.0);
    }
    if scenario.excitation_kind == ScenarioExcitation::Release {
        if options.initial.is_some() && options.amplitude.is_some() {
            return bad("initial", "a release has either an amplitude or an initial state");
        }
        state[0] = amplitude;
    }
    if let Some(given) = &options.initial {
        if given.len() != state.len() {
            return bad("initial", format!("{} values for {} states", given.len(), state.len()));
        }
        for (value, given) in state.iter_mut().zip(given) {
            *value = within("initial", *given, -LARGEST, LARGEST)?;
        }
    }
    Ok(state)
}

/// The records to be made, and their excitation in words.
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
        return bad("frequencies", format!("{} are more than {MOST_TONES}", frequencies.len()));
    }
    for frequency in frequencies {
        let fits = *frequency > 0.0 && *frequency < 0.5 * rate;
        if !fits {
            let most = 0.5 * rate;
            return bad(
                "frequencies",
                format!("{frequency} Hz is not between 0 and half the sampling rate, {most} Hz"),
            );
        }
    }
    let ends = || match frequencies {
        [low, high] => Ok((*low, *high)),
        _ => bad("frequencies", format!("the scenario {} takes two: from and to", scenario.name)),
    };
    let ramp = within("ramp", options.ramp.unwrap_or(0.0), 0.0, LONGEST)?;
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
                return bad("frequencies", "give at least one");
            } else if apart {
                for frequency in frequencies {
                    let name = format!("{frequency}Hz");
                    if runs.iter().any(|r| r.name == name) {
                        return bad("frequencies", format!("{frequency} Hz is given twice"));
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
                return bad("lines", format!("{lines} is out of bounds: give a number from 1 to {MOST_TONES}"));
            }
            let multisine = |amplitude: f64, seed: u64| {
                Some(Excitation::multisine(amplitude, (low, high), lines, seed).fading_in(ramp))
            };
            let told = |size: &str, phases: &str| {
                format!(
                    "multisine, {lines} harmonics from {low:?} to {high:?} Hz, RMS of one tone of {size} {unit}, phases of seed {}{phases}{ramped}",
                    options.seed
                )
            };
            match options.levels.as_deref() {
                None => (single(multisine(amplitude, options.seed)), told(&format!("{amplitude:?}"), "")),
                Some(levels) => {
                    let sizes: Vec<String> = levels.iter().map(|l| format!("{l:?}")).collect();
                    let words = told(&sizes.join(", "), " and others after the first record, one record each");
                    (at_levels(levels, options.seed, unit, multisine)?, words)
                }
            }
        }
    })
}

/// One record for each level, each with phases of its own.
fn at_levels(
    levels: &[f64],
    seed: u64,
    unit: &str,
    excitation: impl Fn(f64, u64) -> Option<Excitation>,
) -> Result<Vec<RequestedRecord>, RigError> {
    let mut records: Vec<RequestedRecord> = Vec::new();
    for (k, level) in levels.iter().enumerate() {
        let level = within("levels", *level, 0.0, LARGEST)?;
        let name = format!("{} {}", short(level), unit);
        // The same level again is another record of it.
        let name = if records.iter().any(|r| r.name == name) { format!("{name}, {}", k + 1) } else { name };
        let seed = seed.wrapping_add(OTHER_PHASES.wrapping_mul(k as u64));
        records.push(RequestedRecord { name, excitation: excitation(level, seed) });
    }
    if records.is_empty() { bad("levels", "give at least one") } else { Ok(records) }
}
