//! A test from end to end: a plant, what drives it, what is measured of it and when.

use std::sync::Arc;

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::RigError;
use super::excitation::Excitation;
use super::interpolant::Accuracy;
use super::motion::{PlantMotion, rms};
use super::plant::Plant;
use super::response::SampleTimes;
use super::sensor::Sensor;
use super::truth::Truth;
use sindyscope_values::record::{Channel, Record, Role};
use sindyscope_values::term::Expression;

/// A sample is taken at most this share of the interval before or after its instant.
const MOST_JITTER: f64 = 0.4;

/// A test: everything that decides what is recorded. The same setup always makes the same records.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// What is tested.
    pub plant: Plant,
    /// What drives it, and when it is sampled: one entry a record.
    pub drives: Vec<RecordDrive>,
    /// What is measured: one entry a channel of every record.
    pub sensors: Sensors,
    /// Seed of the sensors' noise.
    pub seed: u64,
}

/// How the plant is driven for one record.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordDrive {
    /// The record's name.
    pub name: String,
    /// One for each of the plant's inputs.
    pub inputs: Vec<Excitation>,
    /// The plant's states at t = 0.
    pub initial: Vec<f64>,
    /// When it is sampled, in the plant's unit of time.
    pub sampling: SampleTimes,
    /// The time of the first sample and the sampling interval as the record counts them, s.
    pub clock: (f64, f64),
    /// Seed of the instants at which the samples are really taken, where [`Sensors::jitter`] is not 0.
    pub clock_seed: u64,
    /// The record is kept for checking; noise that is a share of the RMS does not count it.
    pub held_out: bool,
}

/// What is measured, the same in every record.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensors {
    /// The channels, in the order of the records.
    pub channels: Vec<MeasuredChannel>,
    /// Standard deviation of the sampling instants, in sampling intervals; the records count them as even.
    pub jitter: f64,
    /// Channel `c` of record `r` draws its noise from stream `r × streams_a_record + channels[c].stream`.
    pub streams_a_record: u64,
}

/// One channel: what it measures, and what lies between that and its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredChannel {
    /// Its name.
    pub name: String,
    /// What it is for a study.
    pub role: Role,
    /// Its unit.
    pub unit: String,
    /// What is measured.
    pub quantity: MeasuredQuantity,
    /// The quantity is cut off at this magnitude, in the plant's unit; infinite if it is not.
    pub limit: f64,
    /// What the channel shows of nothing in each record, in the plant's unit; zero where none is given.
    pub zeros: Vec<f64>,
    /// The channel's unit over the plant's.
    pub scale: f64,
    /// What records it.
    pub sensor: Sensor,
    /// The stream of its noise in the first record.
    pub stream: u64,
}

/// What a channel measures of a motion.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasuredQuantity {
    /// A state of the plant.
    State(usize),
    /// The time derivative of a state.
    Rate(usize),
    /// An input of the plant.
    Input(usize),
    /// An expression in the plant's states and inputs.
    Expression(Expression),
}

/// What a setup made.
#[derive(Clone, Debug, PartialEq)]
pub struct SetupRun {
    /// The records, one a drive.
    pub records: Vec<Record>,
    /// What really moved in each of them.
    pub motions: Vec<PlantMotion>,
    /// The equations of motion.
    pub truth: Truth,
}

impl MeasuredChannel {
    /// A channel that shows a quantity in the plant's unit, as a sensor records it.
    pub fn new(
        name: impl Into<String>,
        role: Role,
        unit: impl Into<String>,
        quantity: MeasuredQuantity,
        sensor: Sensor,
    ) -> Self {
        Self {
            name: name.into(),
            role,
            unit: unit.into(),
            quantity,
            limit: f64::INFINITY,
            zeros: Vec::new(),
            scale: 1.0,
            sensor,
            stream: 0,
        }
    }

    /// The quantity along a motion, as it is before the channel.
    fn series(&self, plant: &Plant, motion: &PlantMotion) -> Vec<f64> {
        match &self.quantity {
            MeasuredQuantity::State(state) => motion.states[*state].clone(),
            MeasuredQuantity::Rate(state) => motion.rates[*state].clone(),
            MeasuredQuantity::Input(input) => motion.inputs[*input][0].clone(),
            MeasuredQuantity::Expression(expression) => {
                motion.values(plant, std::slice::from_ref(expression)).swap_remove(0)
            }
        }
    }
}

impl RecordDrive {
    /// A record to be fitted, whose clock begins at 0 and counts in the plant's unit of time.
    pub fn new(name: impl Into<String>, inputs: Vec<Excitation>, initial: Vec<f64>, sampling: SampleTimes) -> Self {
        let (name, clock) = (name.into(), (0.0, sampling.interval));
        Self { name, inputs, initial, sampling, clock, clock_seed: 0, held_out: false }
    }

    /// The instants at which the samples are taken: never before 0, and never one after the next.
    fn instants(&self, jitter: f64) -> Vec<f64> {
        let even = (0..self.sampling.count).map(|k| self.sampling.time(k));
        let Some(normal) = Normal::new(0.0, jitter).ok().filter(|_| jitter > 0.0) else { return even.collect() };
        let random = &mut Pcg64::seed_from_u64(self.clock_seed);
        let interval = self.sampling.interval;
        even.map(|t| (t + interval * normal.sample(random).clamp(-MOST_JITTER, MOST_JITTER)).max(0.0)).collect()
    }
}

impl Sensors {
    /// Channels sampled by an even clock, each with noise of its own.
    pub fn new(channels: impl IntoIterator<Item = MeasuredChannel>) -> Self {
        let mut channels: Vec<MeasuredChannel> = channels.into_iter().collect();
        // Stream 0 is left to the phases of a multisine with the same seed.
        channels.iter_mut().zip(1..).for_each(|(channel, stream)| channel.stream = stream);
        let streams_a_record = channels.len() as u64;
        Self { channels, jitter: 0.0, streams_a_record }
    }
}

impl Setup {
    /// Drives the plant and records it.
    ///
    /// # Errors
    /// Drives that are not the plant's; a motion that grows without bound or takes too many steps.
    pub fn run(&self) -> Result<SetupRun, RigError> {
        let motions = self.motions()?;
        let records = self.records(&motions);
        let driven = self.sensors.channels.iter().any(|channel| matches!(channel.role, Role::Input(_)));
        Ok(SetupRun { records, motions, truth: Truth::of_plant(&self.plant, driven) })
    }

    /// The motion of every drive.
    pub(super) fn motions(&self) -> Result<Vec<PlantMotion>, RigError> {
        let follow = |drive: &RecordDrive| {
            let instants = drive.instants(self.sensors.jitter);
            PlantMotion::along(&self.plant, &drive.inputs, &drive.initial, instants, Accuracy::FINE)
        };
        self.drives.iter().map(follow).collect()
    }

    /// What the sensors record of the motions, one of them a drive.
    pub(super) fn records(&self, motions: &[PlantMotion]) -> Vec<Record> {
        let series: Vec<Vec<Vec<f64>>> = self
            .sensors
            .channels
            .iter()
            .map(|channel| motions.iter().map(|motion| channel.series(&self.plant, motion)).collect())
            .collect();
        let sensors: Vec<Sensor> = self.sensors.channels.iter().zip(&series).map(|(c, s)| self.settled(c, s)).collect();
        let record = |(index, drive): (usize, &RecordDrive)| {
            let channels = self.sensors.channels.iter().zip(&sensors).zip(&series);
            let channels =
                channels.map(|((channel, sensor), series)| self.channel(channel, sensor, &series[index], index));
            let (start, interval) = drive.clock;
            let (name, channels) = (drive.name.clone(), channels.collect());
            Record { name, source: None, start, interval, channels, notices: Vec::new() }.completed()
        };
        self.drives.iter().enumerate().map(record).collect()
    }

    /// A channel's sensor with its noise and offset in the channel's unit: what is a share of the RMS is one of that over
    /// the records that are not held out.
    fn settled(&self, channel: &MeasuredChannel, series: &[Vec<f64>]) -> Sensor {
        let fitted = self.drives.iter().zip(series).filter(|(drive, _)| !drive.held_out);
        channel.sensor.settled(rms(fitted.flat_map(|(_, series)| series)) * channel.scale)
    }

    fn channel(&self, channel: &MeasuredChannel, sensor: &Sensor, clean: &[f64], record: usize) -> Channel {
        let mut shown = clean.to_vec();
        if channel.limit.is_finite() {
            shown.iter_mut().for_each(|x| *x = x.clamp(-channel.limit, channel.limit));
        }
        if let Some(zero) = channel.zeros.get(record) {
            shown.iter_mut().for_each(|x| *x += zero);
        }
        if channel.scale != 1.0 {
            shown.iter_mut().for_each(|x| *x *= channel.scale);
        }
        let stream = record as u64 * self.sensors.streams_a_record + channel.stream;
        let interval = self.drives[record].clock.1;
        let values = Arc::from(sensor.record(&shown, interval, self.seed, stream));
        Channel { name: channel.name.clone(), role: channel.role, unit: channel.unit.clone(), values, estimated: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_jitters_keeps_its_order_and_its_size() {
        let sampling = SampleTimes { start: 0.0, interval: 0.1, count: 2000 };
        let (name, inputs, initial) = ("clock".to_owned(), Vec::new(), Vec::new());
        let drive = RecordDrive { name, inputs, initial, sampling, clock: (0.0, 0.1), clock_seed: 3, held_out: false };
        let instants = drive.instants(0.03);
        assert!(instants.windows(2).all(|pair| pair[0] < pair[1]) && instants[0] >= 0.0);
        let off: Vec<f64> = instants.iter().enumerate().map(|(k, t)| t / 0.1 - k as f64).collect();
        // Four standard errors of a deviation from 2000 samples.
        assert!((rms(&off) / 0.03 - 1.0).abs() < 4.0 / 4000.0_f64.sqrt(), "{}", rms(&off));
        assert_eq!(drive.instants(0.0)[7], sampling.time(7));
    }
}
