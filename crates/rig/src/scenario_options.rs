//! What of a scenario is to be otherwise.

use std::str::FromStr;

use super::error::RigError;
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
    /// Amplitudes of a multisine, one record for each, with other phases in every one.
    pub levels: Option<Vec<f64>>,
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
            ("levels", self.levels.as_deref().map(list)),
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

    /// The inverse of [`Self::given`]: what is said by names and typed values.
    ///
    /// # Errors
    /// A name that is none, or a value that is none.
    pub fn typed<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self, RigError> {
        let mut options = Self::default();
        for (name, text) in pairs {
            let numbers = |option: &'static str| list(text).map(|v| number(option, v)).collect::<Result<Vec<f64>, _>>();
            match name {
                "seed" => options.seed = number("seed", text)?,
                "measure" => options.measure = Some(list(text).map(str::to_owned).collect()),
                "noise" => options.noise = Some(typed("noise", text)?),
                "offset" => options.offset = Some(number("offset", text)?),
                "drift" => options.drift = Some(number("drift", text)?),
                "high-pass" => options.high_pass = Some(number("high-pass", text)?),
                "input-noise" => options.input_noise = Some(typed("input-noise", text)?),
                "resolution" => options.resolution = Some(number("resolution", text)?),
                "rate" => options.rate = Some(number("rate", text)?),
                "duration" => options.duration = Some(number("duration", text)?),
                "settle" => options.settle = Some(number("settle", text)?),
                "amplitude" => options.amplitude = Some(number("amplitude", text)?),
                "levels" => options.levels = Some(numbers("levels")?),
                "frequencies" => options.frequencies = Some(numbers("frequencies")?),
                "together" => options.together = true,
                "lines" => options.lines = Some(number("lines", text)?),
                "ramp" => options.ramp = Some(number("ramp", text)?),
                "initial" => options.initial = Some(numbers("initial")?),
                "set" => {
                    let (parameter, value) = text.split_once('=').ok_or_else(|| RigError::BadOption {
                        option: "set",
                        problem: "write a parameter and its value as `k=358.7`".to_owned(),
                    })?;
                    options.parameters.push((parameter.trim().to_owned(), number("set", value)?));
                }
                _ => return Err(unknown(name, "no scenario has this")),
            }
        }
        Ok(options)
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

/// The parts of a list.
pub(crate) fn list(text: &str) -> impl Iterator<Item = &str> {
    text.split(',').map(str::trim).filter(|part| !part.is_empty())
}

/// A finite number of an option.
pub(crate) fn number<T: FromStr>(option: &'static str, text: &str) -> Result<T, RigError> {
    let finite = text.trim().parse::<f64>().is_ok_and(f64::is_finite);
    let value = text.trim().parse().ok().filter(|_| finite);
    value.ok_or_else(|| RigError::BadOption { option, problem: format!("`{text}` is not a number that it can be") })
}

/// A value that is typed by its name.
pub(crate) fn typed<T: FromStr<Err = String>>(option: &'static str, text: &str) -> Result<T, RigError> {
    text.trim().parse().map_err(|problem| RigError::BadOption { option, problem })
}

/// An option that there is not.
pub(crate) fn unknown(name: &str, problem: &str) -> RigError {
    RigError::BadOption { option: "options", problem: format!("`{name}`: {problem}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_given_is_read_back() {
        let options = ScenarioOptions {
            seed: 7,
            measure: Some(vec!["x1".to_owned(), "a2".to_owned()]),
            noise: Some(Noise::ShareOfPeak(0.01)),
            input_noise: Some(Noise::Deviation(2.5e-6)),
            offset: Some(-0.05),
            frequencies: Some(vec![0.5, 12.0]),
            together: true,
            lines: Some(29),
            initial: Some(vec![-1e-3, 0.0]),
            parameters: vec![("k".to_owned(), 358.7), ("F12".to_owned(), 0.5)],
            ..ScenarioOptions::default()
        };
        let given = options.given();
        let read = ScenarioOptions::typed(given.iter().map(|(name, text)| (*name, text.as_str())));
        assert_eq!(read, Ok(options));
        for (name, text, said) in [
            ("rate", "fast", "rate"),
            ("seed", "-1", "seed"),
            ("set", "k", "k=358.7"),
            ("rat", "5", "`rat`"),
            ("offset", "inf", "offset"),
        ] {
            let refused = ScenarioOptions::typed([(name, text)]).expect_err("refused").to_string();
            assert!(refused.contains(said), "{refused}");
        }
    }
}
