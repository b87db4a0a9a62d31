//! The kinds of laboratory that a case may come from.

use crate::words::typed_names;

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

typed_names!(Regime, "regime", {
    Usual => "usual",
    Wide => "wide",
    LightDamping => "light-damping",
    Sticking => "sticking",
    NoSpring => "no-spring",
    ClosedLoop => "closed-loop",
    Datum => "datum",
    SelfExcited => "self-excited",
    SeveralRecords => "several-records",
    Sensors => "sensors",
});
