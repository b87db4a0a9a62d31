use std::sync::Arc;

use super::settings::{EffectValue, PlantChoice, RigSettings};
use super::truth;
use crate::hidden::{ChosenEffect, ChosenPlant, DriveKind, Instruments, suggestions};
use crate::plant::Plant;
use crate::response::{SampleTimes, StickInterval};
use crate::sensor::Sensor;
use crate::setup::{MeasuredChannel, MeasuredQuantity, RecordDrive, Sensors, Setup, SetupRun};
use crate::truth::Truth;
use crate::{Excitation, RigError};
use sindyscope_values::record::{Record, Role};

/// What an adjustable rig recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct RigRun {
    /// The record to be fitted, and the one to be held out.
    pub records: [Record; 2],
    /// Displacement of each mass during the first record, without noise: one series a mass, a value a sample.
    pub displacements: Vec<Arc<[f64]>>,
    /// The input during it, without noise; empty of a decay.
    pub input: Arc<[f64]>,
    /// Times during it in which a contact stuck, s from its start.
    pub stops: Vec<StickInterval>,
    /// RMS missing force over RMS spring force during it; zero of a chain and without an effect.
    pub ratio: f64,
    /// The effect's parameters, complete.
    pub effect_values: Vec<EffectValue>,
    /// The equations of motion, and the plant in words.
    pub truth: Truth,
}

impl RigRun {
    /// Share of the first record in which a contact sticks.
    pub fn stuck_share(&self) -> f64 {
        let whole = self.records[0].duration();
        let stuck: f64 = self.stops.iter().map(|s| s.to - s.from).sum();
        if whole > 0.0 { stuck / whole } else { 0.0 }
    }
}

/// Records what an adjustable rig does.
///
/// # Errors
/// A number out of bounds; an effect that the drive has no place for; a motion that grows without bound.
pub fn record_rig(settings: &RigSettings) -> Result<RigRun, RigError> {
    settings.check()?;
    let sampling = SampleTimes { start: settings.settle, interval: 1.0 / settings.rate, count: settings.samples() };
    let (tested, effect_values) = Tested::new(settings, sampling)?;
    let setup = tested.setup(settings, sampling);
    let SetupRun { records, motions, truth } = setup.run()?;
    let (Ok(records), Some(motion)) = (<[Record; 2]>::try_from(records), motions.into_iter().next()) else {
        unreachable!("there are two drives")
    };
    let end = sampling.interval * sampling.count as f64;
    let stops = motion.stops.iter().filter_map(|stop| {
        let (from, to) = ((stop.from - sampling.start).max(0.0), (stop.to - sampling.start).min(end));
        (to > from).then_some(StickInterval { from, to, ..*stop })
    });
    let stops = stops.collect();
    let (ratio, truth) = match &tested {
        Tested::One(given) => {
            let ratio = given.ratio(&motion);
            (ratio, truth::of_one(given, settings, &effect_values, ratio))
        }
        Tested::Chain(plant) => (0.0, truth::of_chain(plant, settings, truth)),
    };
    let input = motion.inputs.into_iter().next().filter(|_| settings.drive() != DriveKind::None);
    let input = input.map_or_else(|| Arc::from([]), |[input, ..]| Arc::from(input));
    let displacements = motion.states.into_iter().take(settings.plant.masses()).map(Arc::from).collect();
    Ok(RigRun { records, displacements, input, stops, ratio, effect_values, truth })
}

/// What is tested.
enum Tested {
    One(Box<ChosenPlant>),
    Chain(Plant),
}

impl Tested {
    /// The plant of these settings, and its effect's parameters with none missing.
    fn new(settings: &RigSettings, sampling: SampleTimes) -> Result<(Self, Vec<EffectValue>), RigError> {
        if let Some(plant) = settings.chain_plant() {
            return Ok((Self::Chain(plant), Vec::new()));
        }
        let linear = settings.linear();
        let mut values = Vec::new();
        if let Some(name) = &settings.effect {
            let (excitation, begun) = (settings.waveform(false), [settings.displaced(false), 0.0]);
            let offered = suggestions(name, settings.to_ground, &linear, excitation.as_ref(), begun, sampling)?;
            values.extend(offered.into_iter().map(|(name, value, unit)| {
                let known = settings.effect_values.iter().find(|v| v.name == name);
                let (value, suggested) = known.map_or((value, value), |known| (known.value, known.suggested));
                EffectValue { name: name.to_owned(), value, suggested, unit }
            }));
        }
        let effect = settings.effect.as_ref().map(|name| ChosenEffect {
            name: name.clone(),
            to_ground: settings.to_ground,
            values: values.iter().map(|v| (v.name.clone(), v.value)).collect(),
        });
        let given = ChosenPlant::new(&linear, effect.as_ref(), settings.settle, settings.duration)?;
        Ok((Self::One(Box::new(given)), values))
    }

    /// The test: a record to be fitted, and one to be held out.
    fn setup(&self, settings: &RigSettings, sampling: SampleTimes) -> Setup {
        let drive = |(index, held_out): (u64, bool)| {
            let (inputs, initial) = self.driven(settings.waveform(held_out).as_ref(), settings.displaced(held_out));
            RecordDrive {
                name: if held_out { "held out" } else { "fit" }.to_owned(),
                inputs,
                initial,
                sampling,
                clock: (0.0, sampling.interval),
                clock_seed: settings.seed.wrapping_add(7919 * index),
                held_out,
            }
        };
        let plant = match self {
            Self::One(given) => given.plant().clone(),
            Self::Chain(plant) => plant.clone(),
        };
        Setup {
            plant,
            drives: [(0, false), (1, true)].map(drive).to_vec(),
            sensors: self.sensors(settings),
            seed: settings.seed,
        }
    }

    fn driven(&self, excitation: Option<&Excitation>, begun: f64) -> (Vec<Excitation>, Vec<f64>) {
        match self {
            Self::One(given) => given.driven(excitation, [begun, 0.0]),
            Self::Chain(plant) => {
                let mut initial = vec![0.0; plant.smooth.layout.states()];
                initial[0] = begun;
                (vec![excitation.cloned().unwrap_or_else(Excitation::rest)], initial)
            }
        }
    }

    /// A displacement sensor on every mass, and one of the input where there is any.
    fn sensors(&self, settings: &RigSettings) -> Sensors {
        let instruments = Instruments::white(settings.noise);
        let sensor = Sensor { offset_over_rms: settings.offset, ..instruments.sensor() };
        let (zero, limit) = match self {
            Self::One(given) => given.sensor_zero_and_limit(),
            Self::Chain(_) => (0.0, f64::INFINITY),
        };
        let masses = settings.plant.masses();
        let displacement = |mass: usize| {
            let name = if masses > 1 { format!("x{}", mass + 1) } else { "x".to_owned() };
            let quantity = MeasuredQuantity::State(mass);
            MeasuredChannel {
                limit,
                zeros: vec![zero; 2],
                stream: mass as u64,
                ..MeasuredChannel::new(name, Role::Displacement(mass), settings.unit(), quantity, sensor)
            }
        };
        let mut channels: Vec<MeasuredChannel> = (0..masses).map(displacement).collect();
        if settings.drive() != DriveKind::None {
            let (unit, sensor) = (settings.input_unit(), instruments.input_sensor());
            let input = MeasuredChannel::new("u", Role::Input(0), unit, MeasuredQuantity::Input(0), sensor);
            channels.push(MeasuredChannel { stream: 8, ..input });
        }
        Sensors { channels, jitter: settings.jitter, streams_a_record: 16 }
    }
}

impl PlantChoice {
    /// True if its only mass may stand on a base that moves.
    pub fn has_base(self) -> bool {
        self == Self::OneMass
    }
}
