//! The frequency response from an input to a displacement, measured and simulated.

use std::f64::consts::{PI, TAU};

use nalgebra::{SMatrix, SVector};
use sindyscope_fourier::Complex;

use sindyscope_core::signal::Spectrum;
use sindyscope_core::study::{Outcome, RecordOutcome};
use sindyscope_values::record::Role;

/// Power of the input, as a share of its strongest line's, below which a line says nothing of the structure.
const LEAST_POWER: f64 = 1e-5;

/// Share of an input's power that a single tone may leave unexplained.
const TONE: f64 = 0.02;

/// Fewest samples of a segment.
const FEWEST: usize = 32;

/// A response over frequency.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ResponseEstimate {
    /// Magnitude, displacement over input.
    pub gain: Vec<f64>,
    /// Phase, degrees, from −270 up to 90.
    pub phase: Vec<f64>,
    /// Coherence, from 0 to 1.
    pub coherence: Vec<f64>,
}

/// The response to one tone.
#[derive(Clone, Debug, PartialEq)]
pub struct Tone {
    /// Name of the record.
    pub record: String,
    /// Frequency, Hz.
    pub frequency: f64,
    /// Measured magnitude and phase (degrees), at the tone itself.
    pub measured: [f64; 2],
    /// The same of the identified model, unless its response diverged.
    pub simulated: Option<[f64; 2]>,
}

/// A frequency response: by Welch's averaging over the records whose input is broad, and at the tones of the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrequencyResponse {
    /// Frequencies at which the input has power, Hz.
    pub frequency: Vec<f64>,
    /// Measured, at each frequency.
    pub measured: ResponseEstimate,
    /// Simulated, at each frequency; empty if no response lasted.
    pub simulated: ResponseEstimate,
    /// Relative standard error of the measured magnitude at each frequency.
    pub error: Vec<f64>,
    /// Distance of the frequencies, Hz.
    pub step: f64,
    /// Segments averaged.
    pub segments: usize,
    /// Responses to single tones, by frequency.
    pub tones: Vec<Tone>,
}

/// Why there is no frequency response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoResponse {
    /// The records have no input.
    NoInput,
    /// The input does not change.
    Silent,
    /// The records are too short.
    TooShort,
}

impl FrequencyResponse {
    /// The response of displacement `freedom` to input `input` over the given records.
    ///
    /// Each record is cut into Hann-windowed segments that overlap by half, about `averages` of them in the longest
    /// record. `H1 = S_ux / S_uu` bears noise on the response, `H2 = S_xx / S_xu` (`noisy_input`) noise on the input (Bendat
    /// and Piersol, Random Data, chapter 6; the standard error of |H1| is theirs too).
    ///
    /// # Errors
    /// What the records lack.
    pub fn new(
        outcome: &Outcome,
        records: &[usize],
        freedom: usize,
        input: usize,
        averages: usize,
        noisy_input: bool,
    ) -> Result<Self, NoResponse> {
        let drives: Vec<DrivenSeries<'_>> =
            records.iter().filter_map(|k| driven(outcome.records.get(*k)?, freedom, input)).collect();
        Self::of_series(&drives, averages, noisy_input)
    }

    /// The same of series of whatever kind; `averages` and `noisy_input` as for [`Self::new`].
    ///
    /// # Errors
    /// What the series lack.
    pub fn of_series(drives: &[DrivenSeries<'_>], averages: usize, noisy_input: bool) -> Result<Self, NoResponse> {
        if drives.is_empty() {
            return Err(NoResponse::NoInput);
        }
        let mut response = Self::default();
        let mut broad = Vec::new();
        let mut loud = false;
        for drive in drives {
            let mean = drive.input.iter().sum::<f64>() / drive.input.len().max(1) as f64;
            let power: f64 = drive.input.iter().map(|u| (u - mean).powi(2)).sum();
            let level: f64 = drive.input.iter().map(|u| u * u).sum();
            if power <= 1e-20 * level {
                continue;
            }
            loud = true;
            match drive.tone() {
                Some(tone) => response.tones.push(tone),
                None => broad.push(drive),
            }
        }
        if !loud {
            return Err(NoResponse::Silent);
        }
        response.tones.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
        response.average(&broad, averages.max(1), noisy_input);
        if response.tones.is_empty() && response.frequency.is_empty() {
            return Err(NoResponse::TooShort);
        }
        Ok(response)
    }

    fn average(&mut self, drives: &[&DrivenSeries<'_>], averages: usize, noisy_input: bool) {
        let Some(longest) = drives.iter().max_by_key(|d| d.input.len()) else { return };
        let interval = longest.interval;
        // k segments that overlap by half are (k + 1) / 2 segments long.
        let wanted = 2 * longest.input.len() / (averages + 1);
        let length = (wanted / 2 * 2).max(FEWEST);
        let alike = drives.iter().filter(|d| d.input.len() >= length && (d.interval / interval - 1.0).abs() < 1e-6);
        let transform = sindyscope_fourier::forward(length);
        let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos()).collect();
        let lines = length / 2 + 1;
        let mut measured = Power::new(lines);
        let mut simulated = Power::new(lines);
        let (mut buffer, mut scratch) = (transform.make_input_vec(), transform.make_scratch_vec());
        let mut spectra = [transform.make_output_vec(), transform.make_output_vec(), transform.make_output_vec()];
        for drive in alike {
            for from in (0..=drive.input.len() - length).step_by(length / 2) {
                let mut transformed = [false; 3];
                for (k, series) in [drive.input, drive.measured, drive.simulated].into_iter().enumerate() {
                    let Some(part) = series.get(from..from + length) else { continue };
                    let mean = part.iter().sum::<f64>() / length as f64;
                    for ((slot, value), weight) in buffer.iter_mut().zip(part).zip(&window) {
                        *slot = weight * (value - mean);
                    }
                    let done = transform.process_with_scratch(&mut buffer, &mut spectra[k], &mut scratch);
                    transformed[k] = done.is_ok();
                }
                if transformed[0] && transformed[1] {
                    measured.add(&spectra[0], &spectra[1]);
                }
                if transformed[0] && transformed[2] {
                    simulated.add(&spectra[0], &spectra[2]);
                }
            }
        }
        if measured.segments == 0 {
            return;
        }
        self.step = 1.0 / (length as f64 * interval);
        self.segments = measured.segments;
        // The two lowest lines hold what the window leaks of the mean.
        let strongest = measured.input[2.min(lines - 1)..].iter().copied().fold(0.0, f64::max);
        let sound: Vec<usize> = (2..lines).filter(|k| measured.input[*k] > LEAST_POWER * strongest).collect();
        self.frequency = sound.iter().map(|k| self.step * *k as f64).collect();
        self.measured = measured.estimate(&sound, noisy_input);
        // Half-overlapping Hann segments count for about 1.9 in 2 (Welch 1967).
        let independent = if measured.segments > 1 { 0.95 * measured.segments as f64 } else { 1.0 };
        let error = |c: &f64| ((1.0 - c).max(0.0) / (2.0 * c.max(1e-12) * independent)).sqrt();
        self.error = self.measured.coherence.iter().map(error).collect();
        if simulated.segments > 0 {
            self.simulated = simulated.estimate(&sound, noisy_input);
        }
    }
}

/// Phase in degrees, from −270 up to 90: a structure's response lags its input.
fn degrees(phase: f64) -> f64 {
    let degrees = phase.to_degrees();
    if degrees > 90.0 { degrees - 360.0 } else { degrees }
}

struct Power {
    input: Vec<f64>,
    output: Vec<f64>,
    cross: Vec<Complex<f64>>,
    segments: usize,
}

impl Power {
    fn new(lines: usize) -> Self {
        Self { input: vec![0.0; lines], output: vec![0.0; lines], cross: vec![Complex::default(); lines], segments: 0 }
    }

    fn add(&mut self, input: &[Complex<f64>], output: &[Complex<f64>]) {
        for (k, (u, x)) in input.iter().zip(output).enumerate() {
            self.input[k] += u.norm_sqr();
            self.output[k] += x.norm_sqr();
            self.cross[k] += u.conj() * x;
        }
        self.segments += 1;
    }

    fn estimate(&self, lines: &[usize], noisy_input: bool) -> ResponseEstimate {
        let mut estimate = ResponseEstimate::default();
        for &k in lines {
            let response =
                if noisy_input { self.output[k] / self.cross[k].conj() } else { self.cross[k] / self.input[k] };
            estimate.gain.push(response.norm());
            estimate.phase.push(degrees(response.arg()));
            let power = self.input[k] * self.output[k];
            estimate.coherence.push(if power > 0.0 { (self.cross[k].norm_sqr() / power).min(1.0) } else { 0.0 });
        }
        estimate
    }
}

/// One record's input and response, evenly sampled.
#[derive(Clone, Copy, Debug)]
pub struct DrivenSeries<'a> {
    /// The record's name.
    pub name: &'a str,
    /// Sampling interval, s.
    pub interval: f64,
    /// What drives.
    pub input: &'a [f64],
    /// The response as it was measured, as long.
    pub measured: &'a [f64],
    /// The model's response; shorter where it did not last.
    pub simulated: &'a [f64],
}

fn driven(record: &RecordOutcome, freedom: usize, input: usize) -> Option<DrivenSeries<'_>> {
    let values = |role: Role| record.record.channel(role).map(|c| &*c.values);
    Some(DrivenSeries {
        name: &record.record.name,
        interval: record.record.interval,
        input: values(Role::Input(input))?,
        measured: values(Role::Displacement(freedom))?,
        simulated: record.channels.get(freedom).map_or(&[], |c| &c.response),
    })
}

impl DrivenSeries<'_> {
    /// The response at the input's tone if that is all it is; from the record's second half, where a transient has gone.
    fn tone(&self) -> Option<Tone> {
        let interval = self.interval;
        let half = self.input.len() / 2;
        let tail = self.input.get(half..)?;
        let mut frequency = Spectrum::new(tail, interval)?.peak()?.frequency;
        let mut fit = Sine::default();
        for _ in 0..4 {
            fit = Sine::fit(tail, interval, frequency)?;
            frequency = fit.better;
        }
        if fit.left > TONE {
            return None;
        }
        let response = |series: &[f64]| {
            let x = Sine::fit(series.get(half..self.input.len())?, interval, frequency)?.at;
            let ratio = x / fit.at;
            Some([ratio.norm(), degrees(ratio.arg())])
        };
        Some(Tone {
            record: self.name.to_owned(),
            frequency,
            measured: response(self.measured)?,
            simulated: response(self.simulated),
        })
    }
}

/// A sine through a series.
#[derive(Default)]
struct Sine {
    /// Complex amplitude: the real part of `at` · e^(iωt).
    at: Complex<f64>,
    /// Share of the series' power that it leaves.
    left: f64,
    /// A frequency that fits better.
    better: f64,
}

impl Sine {
    /// Least squares on a constant, cos ωt and sin ωt; t cos ωt and t sin ωt tell how the frequency should change.
    fn fit(series: &[f64], interval: f64, frequency: f64) -> Option<Self> {
        let n = series.len() as f64;
        if series.len() < 8 {
            return None;
        }
        let omega = 2.0 * PI * frequency * interval;
        let mut gram = SMatrix::<f64, 5, 5>::zeros();
        let mut right = SVector::<f64, 5>::zeros();
        let mut total = 0.0;
        let mean = series.iter().sum::<f64>() / n;
        for (k, value) in series.iter().enumerate() {
            let (s, c) = (omega * k as f64).sin_cos();
            let t = 2.0 * k as f64 / n - 1.0;
            let row = SVector::<f64, 5>::from([1.0, c, s, t * c, t * s]);
            gram += row * row.transpose();
            right += row * *value;
            total += (value - mean).powi(2);
        }
        let drifting = gram.cholesky()?.solve(&right);
        let three = gram.fixed_view::<3, 3>(0, 0).into_owned();
        let still = three.cholesky()?.solve(&right.fixed_rows::<3>(0).into_owned());
        let explained = right.fixed_rows::<3>(0).dot(&still) - n * mean * mean;
        let (a, b) = (drifting[1], drifting[2]);
        // A cos (ω+δ)t + B sin (ω+δ)t ≈ … + δt (B cos ωt − A sin ωt), with t counted from the middle: t = (τ + 1) n/2.
        let power = (a * a + b * b).max(f64::MIN_POSITIVE);
        let delta = (b * drifting[3] - a * drifting[4]) / power * 2.0 / n;
        // Half a line at most: a fit with another tone beside it must not run away.
        let delta = delta.clamp(-PI / n, PI / n);
        Some(Self {
            at: Complex::new(still[1], -still[2]),
            left: ((total - explained) / total.max(f64::MIN_POSITIVE)).max(0.0),
            better: (omega + delta) / (2.0 * PI * interval),
        })
    }
}
