//! What the data can show at all, asked before any fit.

use super::data::{Data, RecordSeries};
use super::folds::LeftOut;
use super::outcome::Blind;
use sindyscope_core::signal::{Spectrum, rms};

/// What an audit found.
#[derive(Clone, Debug, Default)]
pub(super) struct Audit {
    /// One steady tone at one amplitude: everything that dissipates looks like a damper, everything else like a spring.
    pub(super) single_tone: bool,
    pub(super) blind: Vec<Blind>,
    pub(super) notices: Vec<String>,
}

/// Share of a record's energy in its main line that makes it a tone.
const TONE: f64 = 0.97;
/// Change of amplitude within a record, or between records, below which it is one amplitude.
const STEADY: f64 = 0.12;

impl Data {
    pub(super) fn audit(&self) -> Audit {
        let fit = self.fit();
        let still = fit.iter().all(RecordSeries::is_undriven);
        let tones: Vec<Option<(f64, f64)>> = fit.iter().map(|s| tone(s, self.noise)).collect();
        let single_tone = tones.iter().all(Option::is_some) && {
            let (frequencies, amplitudes): (Vec<f64>, Vec<f64>) = tones.iter().flatten().copied().unzip();
            alike(&frequencies, 0.03) && alike(&amplitudes, STEADY)
        };
        let mut blind = Vec::new();
        let mut hide = |effects: &[&'static str], reason: &str| {
            blind.extend(effects.iter().map(|effect| Blind { effect, reason: reason.to_owned() }));
        };
        if still {
            hide(
                &["base_velocity", "input_delay", "input_saturation", "input_gain"],
                "there is no input in these records",
            );
        } else if self.input_open {
            hide(&["input_gain"], "the input's gain cannot be told from the mass, nor is it known what the input is");
        } else if !self.base_excited {
            hide(&["base_velocity", "input_gain"], "the input is a force: its gain cannot be told from the mass");
        }
        if !matches!(self.unit.as_str(), "rad" | "") {
            hide(&["pendulum_restoring"], "the displacement is no angle");
        }
        if still && !self.self_sustained && fit.len() == 1 {
            hide(
                &["stiffness_drift", "damping_drift"],
                "in a single decay time goes with the amplitude, on which springs and dampers depend more often",
            );
        }
        let mut notices = Vec::new();
        if self.input_open && !still {
            notices.push(
                "The header does not say whether the input is a force or the motion of the base: both readings stay open."
                    .to_owned(),
            );
        }
        if single_tone {
            notices.push(
                "These records hold one steady tone at one amplitude. Such data cannot tell one kind of damping from another, nor one kind of spring: a model fitted to them must not be trusted at other amplitudes or frequencies."
                    .to_owned(),
            );
        }
        if self.held_out().is_empty() {
            notices.push(match self.left_out() {
                LeftOut::Parts(parts) => {
                    let parts = parts.iter().map(|(from, to)| format!("from {:.0} to {:.0} %", 1e2 * from, 1e2 * to));
                    let parts = parts.collect::<Vec<String>>().join(" and ");
                    format!("No record is held out: what lies {parts} of the record judges a fit to the rest.")
                }
                LeftOut::Thirds => {
                    "No record is held out: a third of each in turn judges a fit to the rest.".to_owned()
                }
                LeftOut::Records => {
                    format!("No record is held out: each of the {} in turn judges a fit to the others.", fit.len())
                }
            });
        }
        Audit { single_tone, blind, notices }
    }
}

/// Frequency and amplitude of a record that is one steady tone.
fn tone(s: &RecordSeries, noise: f64) -> Option<(f64, f64)> {
    let spectrum = Spectrum::new(&s.measured[0], s.interval)?;
    let peak = spectrum.peak()?;
    let line = (peak.frequency / spectrum.step).round() as usize;
    let energy = |range: std::ops::Range<usize>| -> f64 {
        spectrum.amplitudes[range.start.max(1)..range.end.min(spectrum.amplitudes.len())].iter().map(|a| a * a).sum()
    };
    let n = spectrum.amplitudes.len();
    // Lines of white noise, to be left out of account (see the noise floor): 6 s²/n each.
    let white = 6.0 * noise * noise / s.len() as f64 * n as f64;
    let all = (energy(1..n) - white).max(0.0);
    if energy(line.saturating_sub(3)..line + 4) < TONE * all {
        return None;
    }
    let periods = (peak.frequency * s.interval * s.len() as f64) as usize;
    let parts: Vec<f64> = s.measured[0].chunks_exact(s.len() / (periods / 3).clamp(3, 12)).map(rms).collect();
    alike(&parts, STEADY).then(|| (peak.frequency, rms(&s.measured[0])))
}

fn alike(values: &[f64], tolerance: f64) -> bool {
    let (low, high) = values.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low <= tolerance * high
}
