//! The stabilization diagram: the poles of state spaces of growing order, which of them stay, and the spectrum they stand in.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, SymmetricEigen};

use super::cluster::{PoleCluster, clusters};
use super::limits::{
    DIAGRAM_ORDERS, OF_MODE, OF_MODE_ASSURANCE, POLE_RATES, SPECTRUM_SAMPLES, SPECTRUM_SEGMENTS, SPURIOUS_COLLINEARITY,
    SPURIOUS_DAMPING, SPURIOUS_DEVIATION, STABLE_DAMPING, STABLE_FREQUENCY, STABLE_SHAPE,
};
use super::measurement::{Measurement, Sensor, SensorSeries};
use super::pole::Pole;
use super::shape::{assurance, phase_collinearity, phase_deviation};
use super::subspace::{Channels, SubspaceModel};
use sindyscope_core::parallel::prelude::*;
use sindyscope_core::study::Cancel;
use sindyscope_values::model::Mode;

/// The poles by order, and the spectrum laid over.
#[derive(Clone, Debug, Default)]
pub struct Stabilization {
    /// The poles of every order, at each rate at which they were looked for.
    pub poles: Vec<ProposedPole>,
    /// The stable poles in clusters, the lowest frequency first.
    pub clusters: Vec<PoleCluster>,
    /// Frequencies of the spectrum, Hz; the constant part is left out.
    pub frequencies: Vec<f64>,
    /// `singular_values[k][line]`: the k-th singular value of the responses' spectral matrix, averaged over the fitted records,
    /// every sensor divided by its RMS; power in a line.
    pub singular_values: Vec<Vec<f64>>,
}

/// A pole that a state space of one order has.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposedPole {
    /// Order of the state space, states.
    pub order: usize,
    /// Every how-manieth sample its records have.
    pub thinning: usize,
    /// The pole; a damping ratio below zero is unstable.
    pub pole: Pole,
    /// What each sensor shows of it, divided by the sensor's RMS; the largest is one.
    pub shape: Vec<Complex<f64>>,
    /// Modal phase collinearity, from 0 to 1; none with one sensor.
    pub collinearity: Option<f64>,
    /// Mean phase deviation, rad; none with one sensor.
    pub deviation: Option<f64>,
    /// How it stands beside the poles of the order below.
    pub stability: Stability,
}

/// What of a pole a state space of the order below has too, and whether a structure can have it at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stability {
    /// Its damping or its shape is none of a structure: it stands for noise.
    Spurious,
    /// Nothing.
    New,
    /// The frequency.
    Frequency,
    /// Frequency and damping.
    Damping,
    /// Frequency, damping and shape.
    Whole,
}

/// How sure a mode is as a mode of a structure, from the poles of the diagram near it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModeQuality {
    /// Modal phase collinearity, the median over those poles; none where there is none, or one sensor.
    pub collinearity: Option<f64>,
    /// Mean phase deviation, rad, the same.
    pub deviation: Option<f64>,
    /// Poles near it that are stable in frequency, damping and shape.
    pub stable: usize,
    /// The largest cluster of stable poles near it, by its place in [`Stabilization::clusters`].
    pub cluster: Option<usize>,
}

impl Stabilization {
    pub(crate) fn new(measurement: &Measurement, cancel: &Cancel) -> Self {
        let records: Vec<Channels> = measurement.fitted.iter().map(channels).collect();
        let rates: Vec<(usize, usize)> = POLE_RATES.into_iter().filter(|_| !cancel.is_cancelled()).collect();
        let poles: Vec<Vec<ProposedPole>> =
            rates.par_iter().map(|rate| proposed(&records, &measurement.sensors, *rate, cancel)).collect();
        let (frequencies, singular_values) = spectra(&measurement.fitted);
        let poles: Vec<ProposedPole> = poles.into_iter().flatten().collect();
        Self { clusters: clusters(&poles), poles, frequencies, singular_values }
    }

    /// What the diagram says of a mode.
    pub fn quality(&self, mode: &Mode, sensors: &[Sensor]) -> ModeQuality {
        let shape = scaled_shape(mode, sensors);
        let near = |p: &&ProposedPole| {
            p.stability != Stability::Spurious
                && (p.pole.frequency() / mode.frequency).ln().abs() < OF_MODE
                && (shape.len() < 2 || assurance(&p.shape, &shape) > OF_MODE_ASSURANCE)
        };
        let of_mode = |c: &PoleCluster| c.members.iter().filter(|k| near(&&self.poles[**k])).count();
        let numbered = self.clusters.iter().map(of_mode).enumerate().filter(|(_, count)| *count > 0);
        let cluster = numbered.max_by_key(|(_, count)| *count).map(|(k, _)| k);
        let near: Vec<&ProposedPole> = self.poles.iter().filter(near).collect();
        let middle = |of: fn(&ProposedPole) -> Option<f64>| {
            let mut all: Vec<f64> = near.iter().filter_map(|p| of(p)).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied()
        };
        ModeQuality {
            collinearity: middle(|p| p.collinearity),
            deviation: middle(|p| p.deviation),
            stable: near.iter().filter(|p| p.stability == Stability::Whole).count(),
            cluster,
        }
    }
}

/// A mode's shape as the diagram has it: every entry divided by its sensor's RMS.
pub fn scaled_shape(mode: &Mode, sensors: &[Sensor]) -> Vec<Complex<f64>> {
    let of = |s: usize| Complex::from_polar(1.0, mode.phase[s]) * (mode.shape[s] / sensors[s].scale);
    let shape: Vec<Complex<f64>> = (0..mode.shape.len().min(sensors.len())).map(of).collect();
    // A mode's entries are displacements; the RMS is that of what the sensor shows.
    let lambda = Pole::at(mode.frequency, mode.damping).eigenvalue();
    normalised(shape.iter().zip(sensors).map(|(e, s)| e * lambda.powi(s.quantity.derivatives())).collect())
}

/// A shape whose largest entry is one.
fn normalised(shape: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    let largest = shape.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm()));
    match largest.filter(|l| l.norm() > 0.0) {
        Some(largest) => shape.iter().map(|e| e / largest).collect(),
        None => shape,
    }
}

fn channels(series: &SensorSeries) -> Channels {
    Channels { interval: series.interval, drives: series.inputs.clone(), outputs: series.outputs.clone() }
}

/// The poles at one rate, order by order.
fn proposed(
    records: &[Channels],
    sensors: &[Sensor],
    (by, rows): (usize, usize),
    cancel: &Cancel,
) -> Vec<ProposedPole> {
    let Some(space) = SubspaceModel::new(records, by, rows) else { return Vec::new() };
    let mut all: Vec<ProposedPole> = Vec::new();
    let mut below: Vec<ProposedPole> = Vec::new();
    for order in DIAGRAM_ORDERS.step_by(2) {
        if cancel.is_cancelled() {
            break;
        }
        let Some(model) = space.of_order(order) else { break };
        let found = model.eigenvalues().into_iter().filter_map(|eigenvalue| {
            let pole = space.pole(eigenvalue)?;
            // All sensors show one shape, as they show it.
            let shape = normalised(model.shape(eigenvalue)?);
            let mut proposed = ProposedPole {
                order,
                thinning: by,
                pole,
                collinearity: phase_collinearity(&rotated(&shape, sensors)),
                deviation: phase_deviation(&rotated(&shape, sensors)),
                shape,
                stability: Stability::New,
            };
            proposed.stability = stability(&proposed, &below);
            Some(proposed)
        });
        let found: Vec<ProposedPole> = found.collect();
        all.extend(found.iter().cloned());
        below = found;
    }
    all
}

/// A shape as displacements: velocities lead by a quarter turn, accelerations by half a turn.
fn rotated(shape: &[Complex<f64>], sensors: &[Sensor]) -> Vec<Complex<f64>> {
    let quarter = Complex::new(0.0, -1.0);
    shape.iter().zip(sensors).map(|(e, s)| e * quarter.powi(s.quantity.derivatives())).collect()
}

fn stability(pole: &ProposedPole, below: &[ProposedPole]) -> Stability {
    let damped = pole.pole.damping > 0.0 && pole.pole.damping < SPURIOUS_DAMPING;
    let collinear = pole.collinearity.is_none_or(|c| c >= SPURIOUS_COLLINEARITY);
    if !damped || !collinear || pole.deviation.is_some_and(|d| d > SPURIOUS_DEVIATION) {
        return Stability::Spurious;
    }
    let beside = |other: &ProposedPole| {
        if (other.pole.omega / pole.pole.omega - 1.0).abs() > STABLE_FREQUENCY {
            return Stability::New;
        }
        if (other.pole.damping / pole.pole.damping - 1.0).abs() > STABLE_DAMPING {
            return Stability::Frequency;
        }
        let alike = pole.shape.len() < 2 || 1.0 - assurance(&pole.shape, &other.shape) < STABLE_SHAPE;
        if alike { Stability::Whole } else { Stability::Damping }
    };
    below.iter().map(beside).max().unwrap_or(Stability::New)
}

/// Frequencies, and the singular values of the averaged spectral matrix of all sensors at each: by Hann-windowed segments that
/// overlap by half (P. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70).
fn spectra(series: &[SensorSeries]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let Some(longest) = series.iter().max_by_key(|s| s.len()) else { return Default::default() };
    let wanted = (2 * longest.len() / (SPECTRUM_SEGMENTS + 1)).min(SPECTRUM_SAMPLES);
    let length = (wanted / 2 * 2).max(16);
    let sensors = longest.outputs.len();
    let transform = sindyscope_fourier::forward(length);
    let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos()).collect();
    let lines = length / 2 + 1;
    let mut matrices = vec![DMatrix::<Complex<f64>>::zeros(sensors, sensors); lines];
    let (mut buffer, mut output) = (transform.make_input_vec(), transform.make_output_vec());
    let mut segments = 0;
    let alike = series.iter().filter(|s| s.len() >= length && (s.interval / longest.interval - 1.0).abs() < 1e-6);
    for record in alike {
        for from in (0..=record.len() - length).step_by(length / 2) {
            let mut transformed = Vec::with_capacity(sensors);
            for values in &record.outputs {
                let part = &values[from..from + length];
                let mean = part.iter().sum::<f64>() / length as f64;
                for ((slot, value), weight) in buffer.iter_mut().zip(part).zip(&window) {
                    *slot = weight * (value - mean);
                }
                if transform.process(&mut buffer, &mut output).is_err() {
                    return Default::default();
                }
                transformed.push(output.clone());
            }
            for (line, matrix) in matrices.iter_mut().enumerate() {
                for i in 0..sensors {
                    for j in 0..sensors {
                        matrix[(i, j)] += transformed[i][line] * transformed[j][line].conj();
                    }
                }
            }
            segments += 1;
        }
    }
    // A tone of amplitude A has the power (A/2)² Σ²w = (A n/4)² in its line.
    let scale = 2.0 * (4.0 / length as f64).powi(2) / 4.0 / f64::from(segments.max(1));
    let step = 1.0 / (length as f64 * longest.interval);
    let mut singular_values = vec![Vec::with_capacity(lines); sensors];
    for matrix in &matrices[1..] {
        let mut values: Vec<f64> = SymmetricEigen::new(matrix.clone()).eigenvalues.iter().copied().collect();
        values.sort_by(|a, b| b.total_cmp(a));
        for (series, value) in singular_values.iter_mut().zip(values) {
            series.push((scale * value).max(0.0));
        }
    }
    ((1..lines).map(|k| step * k as f64).collect(), singular_values)
}
