//! Plants that are integrated here, by Runge and Kutta's fourth-order method at a fixed small step: another route than the
//! search's own simulation. Dry friction is a hyperbolic tangent much narrower than the noise can tell.

use std::f64::consts::TAU;
use std::sync::Arc;

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use sindyscope_values::record::{Channel, Record, RecordSet, Role, Usage};

/// Rates of the states at a time under an input and its rate; the states begin with the displacements, then the velocities.
pub(crate) type Rates = Box<dyn Fn(f64, &[f64], f64, f64) -> Vec<f64>>;
/// An input and its rate over time.
pub(crate) type Drive = Box<dyn Fn(f64) -> (f64, f64)>;

pub(crate) struct Plant {
    pub(crate) name: &'static str,
    /// Names of what is hidden, or that say something true of it.
    pub(crate) truth: &'static [&'static str],
    pub(crate) base: &'static str,
    pub(crate) masses: usize,
    pub(crate) rates: Rates,
    /// The input of each fitted record and, last, of the one held out; a record without an input is undriven.
    pub(crate) drives: Vec<Option<Drive>>,
    /// The state that each begins in.
    pub(crate) initial: Vec<Vec<f64>>,
    /// Sampling interval, s, and samples of a record.
    pub(crate) interval: f64,
    pub(crate) samples: usize,
    /// Integration steps of a sampling interval.
    pub(crate) steps: usize,
    /// Sensor noise as a share of the motion's standard deviation, unless it is given by `sensor`.
    pub(crate) noise: f64,
    pub(crate) sensor: Option<f64>,
    /// What the noise is drawn from.
    pub(crate) seed: u64,
    pub(crate) base_moves: bool,
}

impl Default for Plant {
    fn default() -> Self {
        Self {
            name: "",
            truth: &[],
            base: "x,v,u",
            masses: 1,
            rates: Box::new(|_, _, _, _| Vec::new()),
            drives: Vec::new(),
            initial: vec![vec![0.1, 0.0]; 3],
            interval: 0.1,
            samples: 3000,
            steps: 200,
            noise: 0.01,
            sensor: None,
            seed: 7,
            base_moves: false,
        }
    }
}

/// One line.
pub(crate) fn tone(amplitude: f64, omega: f64) -> Option<Drive> {
    Some(Box::new(move |t| (amplitude * (omega * t).cos(), -amplitude * omega * (omega * t).sin())))
}

/// The input of record `k` of a draw: lines, three tones or nothing, in turn.
#[allow(dead_code, reason = "not every example draws its inputs")]
pub(crate) fn drawn_drive(draw: usize, seed: u64, k: u64) -> Option<Drive> {
    match draw % 3 {
        0 => multisine(0.22, (0.3, 2.5), 16, seed + k),
        1 => {
            let tones = [(0.12, 0.6), (0.12, 0.85), (0.1, 1.3)].map(|(a, w)| tone(a, w + 0.07 * k as f64));
            Some(Box::new(move |t| {
                tones.iter().flatten().fold((0.0, 0.0), |sum, d| {
                    let (u, du) = d(t);
                    (sum.0 + u, sum.1 + du)
                })
            }))
        }
        _ => None,
    }
}

/// Lines between two angular frequencies with phases of a seed, of this RMS.
pub(crate) fn multisine(rms: f64, (low, high): (f64, f64), lines: usize, seed: u64) -> Option<Drive> {
    let mut random = Pcg64::seed_from_u64(seed);
    let phase = rand_distr::Uniform::new(0.0, TAU).expect("a range");
    let parts: Vec<(f64, f64)> =
        (0..lines).map(|k| (low + (high - low) * k as f64 / (lines - 1) as f64, phase.sample(&mut random))).collect();
    let amplitude = rms * (2.0 / lines as f64).sqrt();
    Some(Box::new(move |t| {
        parts.iter().fold((0.0, 0.0), |(u, du), (w, p)| {
            (u + amplitude * (w * t + p).cos(), du - amplitude * w * (w * t + p).sin())
        })
    }))
}

/// States at the samples, by fourth-order Runge–Kutta.
pub(crate) fn integrate(plant: &Plant, drive: Option<&Drive>, initial: &[f64]) -> Vec<Vec<f64>> {
    let h = plant.interval / plant.steps as f64;
    let input = |t: f64| drive.map_or((0.0, 0.0), |d| d(t));
    let rates = |t: f64, y: &[f64]| {
        let (u, du) = input(t);
        (plant.rates)(t, y, u, du)
    };
    let moved = |y: &[f64], k: &[f64], h: f64| -> Vec<f64> { y.iter().zip(k).map(|(y, k)| y + h * k).collect() };
    let mut y = initial.to_vec();
    let mut out = Vec::with_capacity(plant.samples);
    for n in 0..plant.samples {
        out.push(y.clone());
        for j in 0..plant.steps {
            let t = plant.interval * n as f64 + h * j as f64;
            let a = rates(t, &y);
            let b = rates(t + 0.5 * h, &moved(&y, &a, 0.5 * h));
            let c = rates(t + 0.5 * h, &moved(&y, &b, 0.5 * h));
            let d = rates(t + h, &moved(&y, &c, h));
            for (i, y) in y.iter_mut().enumerate() {
                *y += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
        }
    }
    out
}

/// The records, and the standard deviation of the first sensor's noise.
pub(crate) fn records(plant: &Plant) -> (RecordSet, f64) {
    let mut random = Pcg64::seed_from_u64(plant.seed);
    let motions: Vec<Vec<Vec<f64>>> = plant
        .drives
        .iter()
        .zip(&plant.initial)
        .map(|(drive, initial)| integrate(plant, drive.as_ref(), initial))
        .collect();
    let deviation = |mass: usize| {
        let all: Vec<f64> = motions.iter().flatten().map(|y| y[mass]).collect();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt()
    };
    let noise: Vec<f64> =
        (0..plant.masses).map(|i| plant.sensor.unwrap_or_else(|| plant.noise * deviation(i))).collect();
    let mut set = RecordSet::default();
    let last = motions.len() - 1;
    for (k, (motion, drive)) in motions.iter().zip(&plant.drives).enumerate() {
        let mut channels = Vec::new();
        for (mass, noise) in noise.iter().enumerate() {
            let normal = Normal::new(0.0, *noise).expect("a deviation");
            let values = motion.iter().map(|y| y[mass] + normal.sample(&mut random)).collect();
            channels.push(channel(Role::Displacement(mass), values, if plant.base_moves { "m" } else { "" }));
        }
        if let Some(drive) = drive {
            let values = (0..plant.samples).map(|n| drive(plant.interval * n as f64).0).collect();
            channels.push(channel(Role::Input(0), values, if plant.base_moves { "m" } else { "N" }));
        }
        let record = Record {
            name: format!("{} {k}", plant.name),
            start: 0.0,
            interval: plant.interval,
            channels,
            source: None,
            notices: Vec::new(),
        };
        set.entries.push((Arc::new(record), if k == last { Usage::HeldOut } else { Usage::Fit }));
    }
    (set, noise[0])
}

fn channel(role: Role, values: Vec<f64>, unit: &str) -> Channel {
    Channel { role, name: role.short_name(), unit: unit.to_owned(), values: values.into(), estimated: false }
}
