//! What the data can show at all, asked before any fit.

use super::data::{Data, Series};
use super::outcome::Blind;
use crate::signal::{Spectrum, dot, rms};

/// What an audit found.
#[derive(Clone, Debug, Default)]
pub(super) struct Audit {
    /// One steady tone at one amplitude: everything that dissipates looks like a damper, everything else like a spring.
    pub(super) single_tone: bool,
    /// Free decays, or records without an input.
    pub(super) free: bool,
    /// Level at which the displacement is cut off.
    pub(super) ceiling: Option<f64>,
    pub(super) blind: Vec<Blind>,
    pub(super) notices: Vec<String>,
}

/// Share of a record's energy in its main line that makes it a tone.
const TONE: f64 = 0.97;
/// Change of amplitude within a record, or between records, below which it is one amplitude.
const STEADY: f64 = 0.12;
/// Samples at the very extreme, as a share of a record, that noise does not put there.
const FLAT: f64 = 0.004;

impl Data {
    pub(super) fn audit(&self) -> Audit {
        let fit = self.fit();
        let still = self.layout.inputs == 0 || fit.iter().all(|s| rms(&s.inputs[0]) == 0.0);
        let tones: Vec<Option<(f64, f64)>> = fit.iter().map(|s| tone(s, self.noise)).collect();
        let single_tone = tones.iter().all(Option::is_some) && {
            let (frequencies, amplitudes): (Vec<f64>, Vec<f64>) = tones.iter().flatten().copied().unzip();
            alike(&frequencies, 0.03) && alike(&amplitudes, STEADY)
        };
        let ceiling = ceiling(fit, self.noise);
        let mut blind = Vec::new();
        let mut hide = |effects: &[&'static str], reason: &str| {
            blind.extend(effects.iter().map(|effect| Blind { effect, reason: reason.to_owned() }));
        };
        if still {
            hide(
                &["base_velocity", "input_delay", "input_saturation", "input_gain"],
                "there is no input in these records",
            );
        } else if !self.base_excited {
            hide(&["base_velocity", "input_gain"], "the input is a force: its gain cannot be told from the mass");
        }
        if ceiling.is_none() {
            hide(&["sensor_clipping"], "no peak is cut off flat");
        }
        if !matches!(self.unit.as_str(), "rad" | "") {
            hide(&["pendulum_restoring"], "the displacement is no angle");
        }
        let mut notices = Vec::new();
        if single_tone {
            notices.push(
                "These records hold one steady tone at one amplitude. Such data cannot tell one kind of damping from another, nor one kind of spring: a model fitted to them must not be trusted at other amplitudes or frequencies."
                    .to_owned(),
            );
        }
        if self.held_out().is_empty() {
            notices.push(match fit.len() {
                1 => "No record is held out: the last 30 % of the record judge, after a fit to the rest.".to_owned(),
                n => format!("No record is held out: each of the {n} in turn judges a fit to the others."),
            });
        }
        Audit { single_tone, free: still, ceiling, blind, notices }
    }
}

/// Frequency and amplitude of a record that is one steady tone.
fn tone(s: &Series, noise: f64) -> Option<(f64, f64)> {
    let spectrum = Spectrum::new(&s.measured, s.interval)?;
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
    let third = s.len() / 3;
    let part = |k: usize| rms(&s.measured[k * third..(k + 1) * third]);
    alike(&[part(0), part(1), part(2)], STEADY).then(|| (peak.frequency, rms(&s.measured)))
}

fn alike(values: &[f64], tolerance: f64) -> bool {
    let (low, high) = values.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    high - low <= tolerance * high
}

/// The level at which peaks are cut off flat on both sides, if they are: samples crowd there within a few noise widths, far
/// more than a turning point of the motion keeps them.
fn ceiling(fit: &[Series], noise: f64) -> Option<f64> {
    let largest = fit.iter().flat_map(|s| s.measured.iter()).fold(0.0_f64, |m, y| m.max(y.abs()));
    let (mut near, mut crowd, mut flat, mut count) = (0.0, 0.0, 0.0, 0.0);
    let width = (3.0 * noise).max(1e-3 * largest);
    if width > 0.12 * largest {
        return None;
    }
    let level = largest - width;
    for s in fit {
        for pair in s.measured.windows(2) {
            let (a, b) = (pair[0].abs(), pair[1].abs());
            crowd += f64::from(a > level - width);
            near += f64::from(a > level - 5.0 * width && a <= level - 3.0 * width);
            flat += f64::from(a > level - width && b > level - width);
            count += 1.0;
        }
    }
    // At a smooth peak the density rises like the root of the distance; a cut piles up everything above it in one place.
    (flat > FLAT * count && crowd > 4.0 * near.max(1.0)).then(|| {
        let top: Vec<f64> =
            fit.iter().flat_map(|s| s.measured.iter()).map(|y| y.abs()).filter(|a| *a > level - width).collect();
        dot(&top, &vec![1.0; top.len()]) / top.len() as f64
    })
}
