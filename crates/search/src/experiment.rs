//! The next experiment: what would tell two models apart that the present data cannot.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::data::Data;
use super::fit::Fitted;
use sindyscope_core::refine::{FitOptions, MeasuredMotion, Point, Run, refine};
use sindyscope_core::signal::rms;
use sindyscope_core::simulate::{InputGrid, Limits, Simulator};
use sindyscope_core::study::Cancel;
use sindyscope_values::format::number::significant;
use sindyscope_values::term::Symbol;

/// What is proposed: periods of a record, and samples in one.
const PERIODS: f64 = 24.0;
const SAMPLES: f64 = 40.0;
/// Noises by which two models must differ for an experiment to be proposed.
const LEAST_APART: f64 = 0.3;

/// An experiment that would tell two models apart.
#[derive(Clone, Debug, PartialEq)]
pub struct NextExperiment {
    /// What to do and what it would show, in a sentence.
    pub text: String,
    /// The same in numbers; none where the sentence only advises, or was read from a file.
    pub test: Option<ProposedTest>,
}

/// A record that is proposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProposedTest {
    /// What moves the first mass.
    pub drive: ProposedDrive,
    /// How long it is, s.
    pub seconds: f64,
    /// By how many times the noise the two models would differ (RMS), after the second has adapted as well as it can; infinite if
    /// it cannot follow at all.
    pub apart: f64,
}

/// What moves the first mass in a proposed record. Inputs that are not spoken of rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProposedDrive {
    /// It is let go from rest at this displacement, in its channel's unit.
    Release(f64),
    /// From rest, `amplitude × sin(2π × frequency × t)`.
    Tone {
        /// Which input, from 0.
        input: usize,
        /// In the input's unit.
        amplitude: f64,
        /// Hz.
        frequency: f64,
    },
    /// From rest, a sine whose frequency grows evenly.
    Sweep {
        /// Which input, from 0.
        input: usize,
        /// In the input's unit.
        amplitude: f64,
        /// Frequency at the beginning and at the end, Hz.
        band: (f64, f64),
    },
}

impl ProposedDrive {
    /// The displacement that it begins with.
    fn released(&self) -> f64 {
        match *self {
            Self::Release(displacement) => displacement,
            Self::Tone { .. } | Self::Sweep { .. } => 0.0,
        }
    }

    /// The values of an input at even instants over a length in seconds.
    fn values(&self, of: usize, interval: f64, count: usize) -> Vec<f64> {
        let length = interval * count as f64;
        let wave = |amplitude: f64, phase: &dyn Fn(f64) -> f64| {
            (0..count).map(|k| amplitude * (TAU * phase(interval * k as f64)).sin()).collect()
        };
        match *self {
            Self::Tone { input, amplitude, frequency } if input == of => wave(amplitude, &|t| frequency * t),
            Self::Sweep { input, amplitude, band: (low, high) } if input == of => {
                wave(amplitude, &|t| low * t + 0.5 * (high - low) * t * t / length)
            }
            _ => vec![0.0; count],
        }
    }
}

struct ExperimentProposal {
    text: String,
    drive: ProposedDrive,
}

impl Data {
    /// The experiment of a small menu under which two fitted models would differ most once the rival has adapted, in words.
    ///
    /// Source of the criterion: A. Atkinson, V. Fedorov, "The design of experiments for discriminating between two rival
    /// models", Biometrika 62 (1975) 57–70 (T-optimality).
    pub(super) fn next_experiment(&self, best: &Fitted, rival: &Fitted, cancel: &Cancel) -> Option<NextExperiment> {
        let interval = 1.0 / (SAMPLES * self.frequency);
        let count = (PERIODS * SAMPLES) as usize;
        let noise = best.refined.rmse().max(self.noise).max(f64::MIN_POSITIVE);
        let (model, composed) = best.composition.model(&best.parameters);
        let simulator = Simulator::new(&model).ok()?;
        let cancelled = || cancel.is_cancelled();
        let mut found: Option<(f64, ExperimentProposal)> = None;
        for proposal in self.menu() {
            let driven: Vec<Vec<f64>> =
                (0..self.layout.inputs).map(|j| proposal.drive.values(j, interval, count)).collect();
            let inputs: Vec<&[f64]> = driven.iter().map(Vec::as_slice).collect();
            let grid = Arc::new(InputGrid::new(0.0, interval, count, &inputs, None));
            let states = 2 * self.masses();
            let mut initial = vec![0.0; states + composed.internals.len()];
            initial[0] = proposal.drive.released();
            let wanted = Limits { rates: self.shows_rates(), ..Limits::default() };
            let response = simulator.run(&grid, &initial, 0..count, &wanted);
            if response.len() < count {
                continue;
            }
            let largest = |s: &[f64]| 10.0 * s.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let limits = response.states[..states].iter().map(|s| largest(s)).collect();
            let run = Run {
                record: 0,
                grid,
                outputs: self.outputs.clone(),
                measured: self.outputs.iter().map(|o| o.series(&response, self.masses()).into()).collect(),
                weights: self.weights.clone(),
                range: 0..count,
                limits,
                motion: Arc::new(MeasuredMotion {
                    states: response.states[..states].to_vec(),
                    ..MeasuredMotion::default()
                }),
            };
            let runs = [run];
            let start = Point::new(&rival.composition, &runs, rival.refined.point.shared.clone(), false);
            let options = FitOptions {
                frozen: false,
                driven: false,
                steps: 6,
                effort: usize::MAX,
                meter: Some(&self.counters.steps),
                bar: None,
                cancelled: &cancelled,
            };
            // A rival that cannot even follow is told apart for certain.
            let apart = refine(&rival.composition, &runs, &start, options).map_or(f64::INFINITY, |r| r.rmse() / noise);
            if apart.is_finite() && found.as_ref().is_none_or(|(a, _)| apart > *a) {
                found = Some((apart, proposal));
            }
        }
        let (apart, ExperimentProposal { text, drive }) = found?;
        let length = PERIODS / self.frequency;
        if apart > LEAST_APART {
            let text = format!(
                "{text}, {} s long: there the two would differ by {} times the noise, after the second has adapted as well as it can.",
                significant(length, 2),
                significant(apart, 2)
            );
            return Some(NextExperiment { text, test: Some(ProposedTest { drive, seconds: length, apart }) });
        }
        let text = format!(
            "No experiment of this kind tells them apart ({} times the noise at most): a further sensor, or a part taken out, would.",
            significant(apart, 1)
        );
        Some(NextExperiment { text, test: None })
    }

    fn menu(&self) -> Vec<ExperimentProposal> {
        let f = self.frequency;
        let reach = self.fit().iter().map(|s| s.limits[0] / 10.0).fold(0.0, f64::max);
        let whose = if self.masses() > 1 { "the first mass" } else { "it" };
        let release = |factor: f64| ExperimentProposal {
            text: format!("Let {whose} go from {} {} without input", significant(factor * reach, 2), self.unit),
            drive: ProposedDrive::Release(factor * reach),
        };
        let mut menu: Vec<ExperimentProposal> = [1.0, 0.3, 2.0].map(release).into();
        let hz = |f: f64| significant(f, 3);
        for input in 0..self.layout.inputs {
            let level = self.fit().iter().map(|s| rms(&s.inputs[input])).fold(0.0, f64::max) * std::f64::consts::SQRT_2;
            if level == 0.0 {
                continue;
            }
            let by = match self.layout.inputs {
                1 => String::new(),
                _ => format!(" in {} alone", self.layout.name(Symbol::Input(input))),
            };
            for (factor, name) in
                [(0.5, "half the level so far"), (1.0, "the level so far"), (2.0, "twice the level so far")]
            {
                let amplitude = factor * level;
                menu.extend([0.5, 1.0, 1.6].map(|tone| ExperimentProposal {
                    text: format!("Run a tone of {} Hz{by} from rest at {name}", hz(tone * f)),
                    drive: ProposedDrive::Tone { input, amplitude, frequency: tone * f },
                }));
                let band = (0.3 * f, 2.5 * f);
                menu.push(ExperimentProposal {
                    text: format!("Sweep from {} to {} Hz{by} at {name}", hz(band.0), hz(band.1)),
                    drive: ProposedDrive::Sweep { input, amplitude, band },
                });
            }
        }
        menu
    }
}
