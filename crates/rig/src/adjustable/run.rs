use std::sync::Arc;

use super::settings::{EffectValue, PlantChoice, RigSettings};
use super::truth::RigTruth;
use crate::hidden::{Given, GivenEffect, Moved, Watching, suggestions};
use crate::plant::Plant;
use crate::response::{Sampling, Stop, respond_at};
use crate::span::Accuracy;
use crate::{Excitation, RigError};
use sindyscope_values::record::{Channel, Record, Role};

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
    pub stops: Vec<Stop>,
    /// RMS missing force over RMS spring force during it; zero of a chain and without an effect.
    pub ratio: f64,
    /// The effect's parameters, complete.
    pub effect_values: Vec<EffectValue>,
    /// The equations of motion, and the plant in words.
    pub truth: RigTruth,
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
    let sampling = Sampling { start: settings.settle, interval: 1.0 / settings.rate, count: settings.samples() };
    let (mover, effect_values) = Mover::new(settings, sampling)?;
    let watching = Watching { jitter: settings.jitter, ..Watching::white(settings.noise) };
    let mut sizes = None;
    let mut record = |index: usize| -> Result<(Record, Moved), RigError> {
        let held_out = index == 1;
        let instants = watching.instants(&sampling, settings.seed.wrapping_add(7919 * index as u64));
        let excitation = settings.waveform(held_out);
        let moved = mover.follow(excitation.as_ref(), settings.displaced(held_out), instants)?;
        // The sensors are the same for both records.
        let sizes: &(Vec<f64>, f64) =
            sizes.get_or_insert_with(|| (moved.displacements.iter().map(|x| rms(x)).collect(), rms(&moved.input)));
        let mut channels = Vec::new();
        let masses = moved.displacements.len();
        for (mass, clean) in moved.displacements.iter().enumerate() {
            let size = sizes.0.get(mass).copied().unwrap_or_default();
            let shown: Vec<f64> = clean.iter().map(|x| mover.seen(*x) + settings.offset * size).collect();
            let stream = (16 * index + mass) as u64;
            let values = watching.motion(&shown, size, settings.seed, stream);
            let name = if masses > 1 { format!("x{}", mass + 1) } else { "x".to_owned() };
            channels.push(channel(name, Role::Displacement(mass), settings.unit(), values));
        }
        if !moved.input.is_empty() {
            let values = watching.input(&moved.input, sizes.1, settings.seed, (16 * index + 8) as u64);
            channels.push(channel("u".to_owned(), Role::Input(0), settings.input_unit(), values));
        }
        let name = if held_out { "held out" } else { "fit" };
        let interval = sampling.interval;
        let record =
            Record { name: name.to_owned(), source: None, start: 0.0, interval, channels, notices: Vec::new() };
        Ok((record, moved))
    };
    let (fitted, moved) = record(0)?;
    let (held_out, _) = record(1)?;
    let end = sampling.interval * sampling.count as f64;
    let stops = moved.stops.iter().filter_map(|stop| {
        let (from, to) = ((stop.from - sampling.start).max(0.0), (stop.to - sampling.start).min(end));
        (to > from).then_some(Stop { from, to, ..*stop })
    });
    let truth = mover.truth(settings, &effect_values, moved.ratio);
    Ok(RigRun {
        records: [fitted, held_out],
        stops: stops.collect(),
        displacements: moved.displacements.into_iter().map(Arc::from).collect(),
        input: Arc::from(moved.input),
        ratio: moved.ratio,
        effect_values,
        truth,
    })
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

fn channel(name: String, role: Role, unit: &str, values: Vec<f64>) -> Channel {
    Channel { name, role, unit: unit.to_owned(), values: Arc::from(values), estimated: false }
}

/// What moves.
enum Mover {
    One(Box<Given>),
    Chain(Plant),
}

impl Mover {
    /// The plant of these settings, and its effect's parameters with none missing.
    fn new(settings: &RigSettings, sampling: Sampling) -> Result<(Self, Vec<EffectValue>), RigError> {
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
        let effect = settings.effect.as_ref().map(|name| GivenEffect {
            name: name.clone(),
            to_ground: settings.to_ground,
            values: values.iter().map(|v| (v.name.clone(), v.value)).collect(),
        });
        let given = Given::new(&linear, effect.as_ref(), settings.settle, settings.duration)?;
        Ok((Self::One(Box::new(given)), values))
    }

    fn follow(&self, excitation: Option<&Excitation>, begun: f64, instants: Vec<f64>) -> Result<Moved, RigError> {
        match self {
            Self::One(given) => given.follow(excitation, [begun, 0.0], instants),
            Self::Chain(plant) => {
                let masses = plant.smooth.layout.freedoms;
                let mut initial = vec![0.0; 2 * masses];
                initial[0] = begun;
                let driven = excitation.cloned().unwrap_or_else(Excitation::rest);
                let mut response =
                    respond_at(Accuracy::FINE, plant, std::slice::from_ref(&driven), &initial, &instants)?;
                response.states.truncate(masses);
                let input = excitation.map(|u| instants.iter().map(|t| u.at(*t).0[0]).collect()).unwrap_or_default();
                Ok(Moved { displacements: response.states, input, stops: response.stops, ratio: 0.0 })
            }
        }
    }

    /// What a displacement sensor shows.
    fn seen(&self, displacement: f64) -> f64 {
        match self {
            Self::One(given) => given.seen(displacement),
            Self::Chain(_) => displacement,
        }
    }

    fn truth(&self, settings: &RigSettings, values: &[EffectValue], ratio: f64) -> RigTruth {
        match self {
            Self::One(given) => RigTruth::of_one(given, settings, values, ratio),
            Self::Chain(plant) => RigTruth::of_chain(plant, settings),
        }
    }
}

impl PlantChoice {
    /// True if its only mass may stand on a base that moves.
    pub fn has_base(self) -> bool {
        self == Self::OneMass
    }
}
