//! Steps as they are typed: `low-pass=40`, `spikes`, `split=3`, `crop=2:40`.

use std::fmt::Write;
use std::str::FromStr;

use super::{PrepareError, SPIKE, Treatment};
use crate::setting::finite;
use sindyscope_values::record::Role;

/// What can be typed, as told to a person who typed something else.
const KNOWN: &str = "write offset, trend, decimate=4, low-pass=40, high-pass=0.5, band-pass=0.5:40, mode=28:48, spikes, spikes=6, split=3, \
                     split-at=12.5, align=a or align=a:0.003, gain=x2:1.02, crop=2:40, hold-out=0.3, bridge=5";

impl FromStr for Treatment {
    type Err = PrepareError;

    /// Reads a step; frequencies in Hz, times in s.
    fn from_str(text: &str) -> Result<Self, PrepareError> {
        let text = text.trim();
        let unknown = || PrepareError::Impossible(format!("`{text}` is no step of a preparation: {KNOWN}"));
        let (name, value) =
            text.split_once('=').map_or((text, None), |(name, value)| (name.trim(), Some(value.trim())));
        let number = |text: Option<&str>| -> Result<f64, PrepareError> {
            text.and_then(|t| t.parse().ok()).filter(|v: &f64| v.is_finite()).ok_or_else(unknown)
        };
        let whole = |text: Option<&str>| text.and_then(|t| t.parse::<usize>().ok()).ok_or_else(unknown);
        let step = match (name, value) {
            ("offset", None) => Self::RemoveOffset,
            ("trend", None) => Self::RemoveTrend,
            ("decimate", value) => Self::Decimate { factor: whole(value)? },
            ("low-pass", value) => Self::Filter { from: None, to: Some(number(value)?) },
            ("high-pass", value) => Self::Filter { from: Some(number(value)?), to: None },
            ("band-pass", value) => {
                let (from, to) = value.and_then(|v| v.split_once(':')).ok_or_else(unknown)?;
                Self::Filter { from: Some(number(Some(from))?), to: Some(number(Some(to))?) }
            }
            ("mode", value) => {
                let (from, to) = value.and_then(|v| v.split_once(':')).ok_or_else(unknown)?;
                Self::IsolateMode { from: number(Some(from))?, to: number(Some(to))? }
            }
            ("spikes", None) => Self::MendSpikes { threshold: SPIKE },
            ("spikes", value) => Self::MendSpikes { threshold: number(value)? },
            ("split", value) => Self::Split { parts: whole(value)? },
            ("split-at", value) => Self::SplitAt { time: number(value)? },
            ("align", Some(value)) => {
                let (channel, delay) = value.split_once(':').map_or((value, None), |(c, d)| (c, Some(d)));
                let delay = delay.map(|d| number(Some(d))).transpose()?;
                Self::Align { role: Role::of_short_name(channel).ok_or_else(unknown)?, delay }
            }
            ("gain", Some(value)) => {
                let (channel, gain) = value.split_once(':').ok_or_else(unknown)?;
                Self::Gain { role: Role::of_short_name(channel).ok_or_else(unknown)?, gain: number(Some(gain))? }
            }
            ("crop", Some(span)) => return crop_to_span(span).map_err(PrepareError::Impossible),
            ("hold-out", value) => Self::HoldOut { share: number(value)? },
            ("bridge", value) => Self::Bridge { longest: whole(value)? },
            _ => return Err(unknown()),
        };
        step.check()?;
        Ok(step)
    }
}

/// Reads a span of time, `2:40`, whose ends may be left out, as a crop to it.
///
/// # Errors
/// It is none, or ends before it begins.
pub fn crop_to_span(span: &str) -> Result<Treatment, String> {
    let (from, to) = span.split_once(':').ok_or("it is two times with a colon between them, as 2:40")?;
    let time = |text: &str| match text.trim() {
        "" => Ok(None),
        text => finite(text).map(Some),
    };
    let (from, to) = (time(from)?, time(to)?);
    if from.zip(to).is_some_and(|(from, to)| from >= to) {
        return Err("the first time lies before the second".into());
    }
    Ok(Treatment::Crop { from, to })
}

/// The span that a crop keeps, as [`crop_to_span`] reads it.
pub fn span(from: Option<f64>, to: Option<f64>) -> String {
    let time = |t: Option<f64>| t.map_or(String::new(), |t| t.to_string());
    format!("{}:{}", time(from), time(to))
}

impl Treatment {
    /// The step as it is typed.
    pub fn typed(self) -> String {
        match self {
            Self::Crop { from, to } => format!("crop={}", span(from, to)),
            Self::HoldOut { share } => format!("hold-out={share}"),
            Self::Bridge { longest } => format!("bridge={longest}"),
            Self::RemoveOffset => "offset".into(),
            Self::RemoveTrend => "trend".into(),
            Self::Decimate { factor } => format!("decimate={factor}"),
            Self::Filter { from: Some(from), to: Some(to) } => format!("band-pass={from}:{to}"),
            Self::Filter { from: Some(from), to: None } => format!("high-pass={from}"),
            Self::Filter { from: None, to } => to.map_or("offset".into(), |to| format!("low-pass={to}")),
            Self::IsolateMode { from, to } => format!("mode={from}:{to}"),
            Self::MendSpikes { threshold } => format!("spikes={threshold}"),
            Self::Split { parts } => format!("split={parts}"),
            Self::SplitAt { time } => format!("split-at={time}"),
            Self::Align { role, delay } => {
                let mut text = format!("align={}", role.short_name());
                if let Some(delay) = delay {
                    // Writing to a text cannot fail.
                    let _ = write!(text, ":{delay}");
                }
                text
            }
            Self::Gain { role, gain } => format!("gain={}:{gain}", role.short_name()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_typed_is_read_and_written_alike() {
        for text in [
            "offset",
            "trend",
            "decimate=4",
            "low-pass=40",
            "high-pass=0.5",
            "band-pass=0.5:40",
            "mode=28:48",
            "spikes=6",
            "split=3",
            "split-at=12.5",
            "align=a1",
            "align=u2:-0.003",
            "gain=x2:1.02",
            "crop=2:40",
            "crop=:0.5",
            "hold-out=0.3",
            "bridge=5",
        ] {
            let step: Treatment = text.parse().unwrap();
            assert_eq!(step.typed(), text);
        }
        assert_eq!("spikes".parse(), Ok(Treatment::MendSpikes { threshold: SPIKE }));
        assert_eq!("align=a".parse(), Ok(Treatment::Align { role: Role::Acceleration(0), delay: None }));
    }

    #[test]
    fn what_is_no_step_is_told_with_what_is() {
        for text in [
            "",
            "lowpass=4",
            "low-pass",
            "low-pass=x",
            "low-pass=-1",
            "band-pass=40:0.5",
            "mode=48:28",
            "split=1",
            "align=q",
            "gain=x2",
            "gain=x2:0",
            "spikes=0",
        ] {
            let told = text.parse::<Treatment>().unwrap_err().to_string();
            assert!(
                told.contains("write offset")
                    || told.contains("lies between")
                    || told.contains("no mode lies")
                    || told.contains("Hz")
                    || told.contains("positive")
                    || told.contains("not zero"),
                "{text}: {told}"
            );
        }
    }
}
