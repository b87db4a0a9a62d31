//! The kinds of laboratory that a case may come from.

use std::fmt;
use std::str::FromStr;

/// A kind of case: what plant, excitation and sensors are drawn of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Regime {
    /// A linear oscillator of 0.2 to 50 Hz and 0.3 to 5 % of critical damping under a rich excitation, 40 samples a natural
    /// period, 1 % of white noise: what [`super::blind`] draws.
    #[default]
    Usual,
    /// 0.3 to 80 Hz, 0.2 to 8 % of critical damping, 12 to 150 samples a period, 1500 to 7000 samples; multisines, sweeps,
    /// bursts, one excitation at several levels; noise of 0.3 to 5 %; effects from two noises to dominating.
    Wide,
    /// About 1 % of critical damping and a spring far beyond its linear range: the nonlinear force is hidden, or it is
    /// a known cubic one and something else is.
    LightDamping,
    /// Dry friction that holds the mass still in 10 to 70 % of every record.
    Sticking,
    /// A mass without a spring, driven by a force.
    NoSpring,
    /// The same, the force following a reference by what the displacement sensor shows: noise and input are correlated.
    ClosedLoop,
    /// The displacement is counted from an arbitrary zero, and what is hidden depends on it.
    Datum,
    /// The linear part takes up energy, what is hidden bounds the motion; no input.
    SelfExcited,
    /// Two to four releases or excitations.
    SeveralRecords,
    /// As [`Self::Wide`], but the noise is coloured or quantised, or the clock jitters.
    Sensors,
}

impl Regime {
    /// Every one.
    pub const ALL: [Self; 10] = [
        Self::Usual,
        Self::Wide,
        Self::LightDamping,
        Self::Sticking,
        Self::NoSpring,
        Self::ClosedLoop,
        Self::Datum,
        Self::SelfExcited,
        Self::SeveralRecords,
        Self::Sensors,
    ];

    /// The name it is typed with.
    pub fn name(self) -> &'static str {
        match self {
            Self::Usual => "usual",
            Self::Wide => "wide",
            Self::LightDamping => "light-damping",
            Self::Sticking => "sticking",
            Self::NoSpring => "no-spring",
            Self::ClosedLoop => "closed-loop",
            Self::Datum => "datum",
            Self::SelfExcited => "self-excited",
            Self::SeveralRecords => "several-records",
            Self::Sensors => "sensors",
        }
    }
}

impl fmt::Display for Regime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Regime {
    type Err = String;

    /// Reads the name it is typed with.
    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|r| r.name() == text).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("{text:?} is no regime; choose one of: {known}")
        })
    }
}
