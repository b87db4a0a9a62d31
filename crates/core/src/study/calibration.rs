//! What can be sought of the channels with the equation, and what was found.

use std::fmt;
use std::str::FromStr;

use crate::prepare::Treatment;
use sindyscope_values::record::Role;

/// What is sought of a channel; written `delay(u)`, `gain(x2)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// By how much it is late, s; of an input that of all inputs together.
    Delay(Role),
    /// So many times what there is does it show.
    Gain(Role),
}

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibrated {
    /// What was sought.
    pub what: Calibration,
    /// Its value: s, or a factor.
    pub value: f64,
    /// Its standard error; none where the data do not tell.
    pub std_error: Option<f64>,
}

impl Calibration {
    /// The channel.
    pub fn role(self) -> Role {
        match self {
            Self::Delay(role) | Self::Gain(role) => role,
        }
    }

    /// Its value for a channel that is as it should be.
    pub(super) fn neutral(self) -> f64 {
        match self {
            Self::Delay(_) => 0.0,
            Self::Gain(_) => 1.0,
        }
    }

    /// What one correction after another comes to.
    pub(super) fn after(self, first: f64, second: f64) -> f64 {
        match self {
            Self::Delay(_) => first + second,
            Self::Gain(_) => first * second,
        }
    }
}

impl Calibrated {
    /// What takes it out of the records.
    pub fn treatment(&self) -> Treatment {
        match self.what {
            Calibration::Delay(role) => Treatment::Align { role, delay: Some(self.value) },
            Calibration::Gain(role) => Treatment::Gain { role, gain: self.value },
        }
    }
}

impl fmt::Display for Calibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Delay(role) => write!(f, "delay({})", role.short_name()),
            Self::Gain(role) => write!(f, "gain({})", role.short_name()),
        }
    }
}

impl FromStr for Calibration {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || format!("`{text}` is nothing to estimate: write delay(u), delay(x2) or gain(x2)");
        let (what, channel) = text.trim().strip_suffix(')').and_then(|t| t.split_once('(')).ok_or_else(unknown)?;
        let role = Role::of_short_name(channel.trim()).ok_or_else(unknown)?;
        match (what.trim(), role) {
            ("delay", _) => Ok(Self::Delay(role)),
            ("gain", Role::Input(_)) => {
                Err(format!("`{text}`: an input's gain cannot be told from its coefficient in the equation"))
            }
            ("gain", _) => Ok(Self::Gain(role)),
            _ => Err(unknown()),
        }
    }
}

/// Reads a list: `delay(u), gain(x2)`.
///
/// # Errors
/// The first that is none.
pub fn calibration_list(text: &str) -> Result<Vec<Calibration>, String> {
    text.split([',', ';']).map(str::trim).filter(|t| !t.is_empty()).map(str::parse).collect()
}
