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

/// Periods of a proposed record, and samples in one.
const PERIODS: f64 = 24.0;
const SAMPLES: f64 = 40.0;

struct Proposal {
    text: String,
    /// The input that drives, and how.
    input: Option<(usize, Vec<f64>)>,
    /// Displacement of the first mass.
    released: f64,
}

impl Data {
    /// The experiment of a small menu under which two fitted models would differ most once the rival has adapted, in words.
    ///
    /// Source of the criterion: A. Atkinson, V. Fedorov, "The design of experiments for discriminating between two rival
    /// models", Biometrika 62 (1975) 57–70 (T-optimality).
    pub(super) fn next_experiment(&self, best: &Fitted, rival: &Fitted, cancel: &Cancel) -> Option<String> {
        let interval = 1.0 / (SAMPLES * self.frequency);
        let count = (PERIODS * SAMPLES) as usize;
        let noise = best.refined.rmse().max(self.noise).max(f64::MIN_POSITIVE);
        let (model, composed) = best.composition.model(&best.parameters);
        let simulator = Simulator::new(&model).ok()?;
        let cancelled = || cancel.is_cancelled();
        let mut found: Option<(f64, String)> = None;
        for proposal in self.menu(interval, count) {
            let still = vec![0.0; count];
            let of = |j: usize| match &proposal.input {
                Some((input, values)) if *input == j => values.as_slice(),
                _ => &still,
            };
            let inputs: Vec<&[f64]> = (0..self.layout.inputs).map(of).collect();
            let grid = Arc::new(InputGrid::new(0.0, interval, count, &inputs, None));
            let states = 2 * self.masses();
            let mut initial = vec![0.0; states + composed.internals.len()];
            initial[0] = proposal.released;
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
                bar: None,
                cancelled: &cancelled,
            };
            // A rival that cannot even follow is told apart for certain.
            let apart = refine(&rival.composition, &runs, &start, options).map_or(f64::INFINITY, |r| r.rmse() / noise);
            if apart.is_finite() && found.as_ref().is_none_or(|(a, _)| apart > *a) {
                found = Some((apart, proposal.text));
            }
        }
        let (apart, text) = found?;
        let seconds = significant(PERIODS / self.frequency, 2);
        Some(if apart > 0.3 {
            format!(
                "{text}, {seconds} s long: there the two would differ by {} times the noise, after the second has adapted as well as it can.",
                significant(apart, 2)
            )
        } else {
            format!(
                "No experiment of this kind tells them apart ({} times the noise at most): a further sensor, or a part taken out, would.",
                significant(apart, 1)
            )
        })
    }

    fn menu(&self, interval: f64, count: usize) -> Vec<Proposal> {
        let f = self.frequency;
        let time = |k: usize| interval * k as f64;
        let reach = self.fit().iter().map(|s| s.limits[0] / 10.0).fold(0.0, f64::max);
        let mut menu = Vec::new();
        let whose = if self.masses() > 1 { "the first mass" } else { "it" };
        for factor in [1.0, 0.3, 2.0] {
            menu.push(Proposal {
                text: format!("Let {whose} go from {} {} without input", significant(factor * reach, 2), self.unit),
                input: None,
                released: factor * reach,
            });
        }
        let hz = |f: f64| significant(f, 3);
        for j in 0..self.layout.inputs {
            let level = self.fit().iter().map(|s| rms(&s.inputs[j])).fold(0.0, f64::max) * std::f64::consts::SQRT_2;
            if level == 0.0 {
                continue;
            }
            let by = match self.layout.inputs {
                1 => String::new(),
                _ => format!(" in {} alone", self.layout.name(Symbol::Input(j))),
            };
            for (factor, name) in
                [(0.5, "half the level so far"), (1.0, "the level so far"), (2.0, "twice the level so far")]
            {
                for tone in [0.5, 1.0, 1.6] {
                    let wave = (0..count).map(|k| factor * level * (TAU * tone * f * time(k)).sin());
                    menu.push(Proposal {
                        text: format!("Run a tone of {} Hz{by} from rest at {name}", hz(tone * f)),
                        input: Some((j, wave.collect())),
                        released: 0.0,
                    });
                }
                let (low, high) = (0.3 * f, 2.5 * f);
                let length = time(count);
                let phase = |t: f64| TAU * (low * t + 0.5 * (high - low) * t * t / length);
                menu.push(Proposal {
                    text: format!("Sweep from {} to {} Hz{by} at {name}", hz(low), hz(high)),
                    input: Some((j, (0..count).map(|k| factor * level * phase(time(k)).sin()).collect())),
                    released: 0.0,
                });
            }
        }
        menu
    }
}
