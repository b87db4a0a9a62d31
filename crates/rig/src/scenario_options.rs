//! What of a scenario is to be otherwise.

use super::sensor::Noise;
use super::words::short;

/// What of a scenario is to be otherwise; nothing is, by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenarioOptions {
    /// Seed of the noise and of a multisine's phases.
    pub seed: u64,
    /// What is measured of the motion: `x`, `v` or `a` of every mass, or of one (`x1`, `a2`), each a channel. Of a first-order
    /// system its states.
    pub measure: Option<Vec<String>>,
    /// Noise on every channel of the motion.
    pub noise: Option<Noise>,
    /// What the motion's sensors show of nothing, in the channel's unit.
    pub offset: Option<f64>,
    /// How fast that grows, in the channel's unit per second.
    pub drift: Option<f64>,
    /// Corner frequency of the first-order high-pass of the motion's sensors, Hz; zero is none.
    pub high_pass: Option<f64>,
    /// Noise on the input.
    pub input_noise: Option<Noise>,
    /// Quantisation step of every channel, in its unit; zero is none.
    pub resolution: Option<f64>,
    /// Sampling rate, Hz.
    pub rate: Option<f64>,
    /// Duration of each record, s.
    pub duration: Option<f64>,
    /// Time before each record in which the motion settles, s.
    pub settle: Option<f64>,
    /// Amplitude of the input (of each tone), or the displacement from which the plant is released.
    pub amplitude: Option<f64>,
    /// Frequencies of the tones, or the two ends of a sweep or band, Hz.
    pub frequencies: Option<Vec<f64>>,
    /// All tones in one record.
    pub together: bool,
    /// Number of harmonics of a multisine.
    pub lines: Option<usize>,
    /// Time in which tones or a multisine fade in, s.
    pub ramp: Option<f64>,
    /// State at t = 0: displacements, then velocities.
    pub initial: Option<Vec<f64>>,
    /// Changed parameters of the plant, by name.
    pub parameters: Vec<(String, f64)>,
}

impl ScenarioOptions {
    /// What is to be otherwise, as names and typed values; a switch has none.
    pub fn given(&self) -> Vec<(&'static str, String)> {
        let list = |values: &[f64]| values.iter().copied().map(short).collect::<Vec<_>>().join(",");
        let number = |v: &Option<f64>| v.map(short);
        let options = [
            ("seed", Some(self.seed.to_string())),
            ("measure", self.measure.as_ref().map(|m| m.join(","))),
            ("noise", self.noise.map(|n| n.to_string())),
            ("offset", number(&self.offset)),
            ("drift", number(&self.drift)),
            ("high-pass", number(&self.high_pass)),
            ("input-noise", self.input_noise.map(|n| n.to_string())),
            ("resolution", number(&self.resolution)),
            ("rate", number(&self.rate)),
            ("duration", number(&self.duration)),
            ("settle", number(&self.settle)),
            ("amplitude", number(&self.amplitude)),
            ("frequencies", self.frequencies.as_deref().map(list)),
            ("together", self.together.then(String::new)),
            ("lines", self.lines.map(|n| n.to_string())),
            ("ramp", number(&self.ramp)),
            ("initial", self.initial.as_deref().map(list)),
        ];
        let given = options.into_iter().filter_map(|(name, value)| value.map(|v| (name, v)));
        let changed = self.parameters.iter().map(|(name, value)| ("set", format!("{name}={}", short(*value))));
        given.chain(changed).collect()
    }

    /// The command line that makes the same records.
    pub fn command(&self, scenario: &str) -> String {
        let mut text = format!("sindyscope generate {scenario}");
        for (name, value) in self.given() {
            text += " --";
            text += name;
            if !value.is_empty() {
                text.push(' ');
                text += &value;
            }
        }
        text
    }
}
