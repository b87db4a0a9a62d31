use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A function of time at one instant: its value and its first two time derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet(pub [f64; 3]);

impl Add for Jet {
    type Output = Self;

    fn add(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2]])
    }
}

impl Mul for Jet {
    type Output = Self;

    fn mul(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self([a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]])
    }
}

impl Jet {
    /// `amplitude × cos(phase)`, given the phase's own value and derivatives.
    fn cosine(amplitude: f64, Self(phase): Self) -> Self {
        let (sine, cosine) = phase[0].sin_cos();
        Self([
            amplitude * cosine,
            -amplitude * sine * phase[1],
            -amplitude * (cosine * phase[1] * phase[1] + sine * phase[2]),
        ])
    }
}

/// One harmonic: `amplitude × cos(2π × frequency × t + phase)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tone {
    /// Amplitude, in the input's unit.
    pub amplitude: f64,
    /// Frequency, Hz.
    pub frequency: f64,
    /// Phase at t = 0, rad.
    pub phase: f64,
}

/// A sum of harmonics evenly spaced in frequency: each turns at the same rate against the one before, so that their sum costs
/// two sines an instant, however many they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Comb {
    /// The lowest frequency, Hz.
    pub lowest: f64,
    /// The distance from one frequency to the next, Hz.
    pub spacing: f64,
    /// Amplitude times cosine and sine of the phase at t = 0, of each harmonic.
    pub phasors: Vec<[f64; 2]>,
}

impl Comb {
    fn at(&self, t: f64) -> Jet {
        let turned = |rate: f64| (rate * t).sin_cos();
        let (rate, step) = (TAU * self.lowest, TAU * self.spacing);
        let ((mut sine, mut cosine), (step_sine, step_cosine)) = (turned(rate), turned(step));
        let mut jet = [0.0; 3];
        for (k, [along, across]) in self.phasors.iter().enumerate() {
            let omega = rate + step * k as f64;
            let value = along * cosine - across * sine;
            jet[0] += value;
            jet[1] -= omega * (along * sine + across * cosine);
            jet[2] -= omega * omega * value;
            (sine, cosine) = (sine * step_cosine + cosine * step_sine, cosine * step_cosine - sine * step_sine);
        }
        Jet(jet)
    }
}

/// What a shaker does before it is faded in and out.
#[derive(Clone, Debug, PartialEq)]
pub enum Wave {
    /// A sum of harmonics; none of them is rest.
    Tones(Vec<Tone>),
    /// A sum of harmonics evenly spaced in frequency.
    Comb(Comb),
    /// A linear chirp from one frequency to another, starting at zero.
    Sweep {
        /// Amplitude, in the input's unit.
        amplitude: f64,
        /// Frequency at t = 0, Hz.
        from: f64,
        /// Frequency at t = `duration`, Hz.
        to: f64,
        /// Duration, s.
        duration: f64,
    },
}

/// An input as an analytic function of time, so that its derivatives are exact.
#[derive(Clone, Debug, PartialEq)]
pub struct Excitation {
    /// What is faded in and out.
    pub wave: Wave,
    /// Time from t = 0 in which it fades in, s.
    pub rise: f64,
    /// Instant at which it has faded out and time that this takes, s.
    pub fall: Option<(f64, f64)>,
    /// How much later all of this happens, s.
    pub delay: f64,
}

impl Excitation {
    /// No motion and no force.
    pub fn rest() -> Self {
        Self::tones([])
    }

    /// Harmonics, at full amplitude from the start.
    pub fn tones(tones: impl IntoIterator<Item = Tone>) -> Self {
        Self { wave: Wave::Tones(tones.into_iter().collect()), rise: 0.0, fall: None, delay: 0.0 }
    }

    /// One harmonic: `amplitude × cos(2π × frequency × t)`.
    pub fn harmonic(amplitude: f64, frequency: f64) -> Self {
        Self::tones([Tone { amplitude, frequency, phase: 0.0 }])
    }

    /// A linear chirp that fades in and out over a twentieth of its duration.
    pub fn sweep(amplitude: f64, from: f64, to: f64, duration: f64) -> Self {
        let taper = duration / 20.0;
        Self {
            wave: Wave::Sweep { amplitude, from, to, duration },
            rise: taper,
            fall: Some((duration, taper)),
            delay: 0.0,
        }
    }

    /// `lines` harmonics spread evenly over a band, their phases drawn from `seed`. The RMS is that of one harmonic of
    /// the amplitude.
    pub fn multisine(amplitude: f64, (low, high): (f64, f64), lines: usize, seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let spacing = if lines > 1 { (high - low) / (lines - 1) as f64 } else { 0.0 };
        let size = amplitude / (lines as f64).sqrt();
        let phasor = |_| {
            let (sine, cosine) = random.random_range(-PI..PI).sin_cos();
            [size * cosine, size * sine]
        };
        let comb = Comb { lowest: low, spacing, phasors: (0..lines).map(phasor).collect() };
        Self { wave: Wave::Comb(comb), ..Self::rest() }
    }

    /// The same, faded in over the first `rise` seconds.
    #[must_use]
    pub fn fading_in(self, rise: f64) -> Self {
        Self { rise, ..self }
    }

    /// The same, later by some seconds.
    #[must_use]
    pub fn delayed(self, by: f64) -> Self {
        Self { delay: self.delay + by, ..self }
    }

    /// The same, all amplitudes times a factor.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        match &mut self.wave {
            Wave::Tones(tones) => tones.iter_mut().for_each(|tone| tone.amplitude *= factor),
            Wave::Comb(comb) => comb.phasors.iter_mut().flatten().for_each(|part| *part *= factor),
            Wave::Sweep { amplitude, .. } => *amplitude *= factor,
        }
        self
    }

    /// Value and derivatives at time `t`, s.
    pub fn at(&self, t: f64) -> Jet {
        let t = t - self.delay;
        let wave = match &self.wave {
            Wave::Tones(tones) => tones.iter().fold(Jet::default(), |sum, tone| {
                let rate = TAU * tone.frequency;
                sum + Jet::cosine(tone.amplitude, Jet([rate * t + tone.phase, rate, 0.0]))
            }),
            Wave::Comb(comb) => comb.at(t),
            Wave::Sweep { amplitude, from, to, duration } => {
                let slope = (to - from) / duration;
                let phase = TAU * (from + 0.5 * slope * t) * t - 0.5 * PI;
                Jet::cosine(*amplitude, Jet([phase, TAU * (from + slope * t), TAU * slope]))
            }
        };
        let rising = if self.rise > 0.0 { wave * smooth_step(t / self.rise, 1.0 / self.rise) } else { wave };
        match self.fall {
            Some((end, length)) => rising * smooth_step((end - t) / length, -1.0 / length),
            None => rising,
        }
    }

    /// Instants, in order, at which a higher derivative jumps: an integrator must not step across them.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = Vec::new();
        if self.rise > 0.0 {
            breaks.push(self.rise);
        }
        if let Some((end, length)) = self.fall {
            breaks.extend([end - length, end]);
        }
        breaks.iter_mut().for_each(|t| *t += self.delay);
        breaks.sort_by(f64::total_cmp);
        breaks
    }

    /// The highest frequency in it, Hz.
    pub fn highest_frequency(&self) -> f64 {
        match &self.wave {
            Wave::Tones(tones) => tones.iter().map(|t| t.frequency).fold(0.0, f64::max),
            Wave::Comb(comb) => comb.lowest + comb.spacing * comb.phasors.len().saturating_sub(1) as f64,
            Wave::Sweep { from, to, .. } => from.max(*to),
        }
    }
}

/// From 0 at `s` = 0 to 1 at `s` = 1 by 6s⁵ − 15s⁴ + 10s³, twice continuously differentiable; `rate` is ds/dt.
fn smooth_step(s: f64, rate: f64) -> Jet {
    if s <= 0.0 {
        return Jet::default();
    }
    if s >= 1.0 {
        return Jet([1.0, 0.0, 0.0]);
    }
    let value = s * s * s * (s * (6.0 * s - 15.0) + 10.0);
    let slope = 30.0 * s * s * (s - 1.0) * (s - 1.0);
    let curvature = 60.0 * s * (s - 1.0) * (2.0 * s - 1.0);
    Jet([value, slope * rate, curvature * rate * rate])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> Vec<Excitation> {
        vec![
            Excitation::rest(),
            Excitation::harmonic(2.5e-3, 2.013).fading_in(1.3),
            Excitation::multisine(1.0, (0.5, 3.0), 12, 4),
            Excitation::sweep(1.0, 4.0, 1.0, 10.0),
            Excitation::sweep(0.5, 4.0, 1.0, 10.0).scaled(2.0).delayed(0.7),
        ]
    }

    #[test]
    fn derivatives_are_those_of_the_value() {
        for excitation in samples() {
            for k in 0..600 {
                let t = 0.003 + 0.02 * f64::from(k);
                // Central differences over 2e-4 s err by h²/6 times the third derivative: 1e-8/6 × (2π × 4)³ = 3e-5
                // of the amplitude, and less than 4e-5 × 2π × 4 of the rate.
                let h = 1e-4;
                let (before, at, after) = (excitation.at(t - h).0, excitation.at(t).0, excitation.at(t + h).0);
                for order in 0..2 {
                    let difference = (after[order] - before[order]) / (2.0 * h);
                    let tolerance = if order == 0 { 5e-5 } else { 2e-3 };
                    assert!((difference - at[order + 1]).abs() < tolerance, "{excitation:?} at {t}");
                }
            }
        }
    }

    #[test]
    fn a_sweep_begins_and_ends_at_rest() {
        let sweep = Excitation::sweep(2.0, 1.0, 5.0, 20.0);
        assert_eq!(sweep.at(0.0), Jet::default());
        assert_eq!(sweep.at(20.0), Jet::default());
        assert_eq!(sweep.at(25.0), Jet::default());
        assert!((0..2000).any(|k| sweep.at(0.01 * f64::from(k)).0[0].abs() > 1.99));
    }

    #[test]
    fn a_multisine_has_the_power_of_one_tone_and_its_own_phases() {
        // 0.5 Hz spacing: the mean over 2 s is exact.
        let excitation = Excitation::multisine(3.0, (1.0, 6.0), 11, 7);
        let n = 4000;
        let power: f64 = (0..n).map(|k| excitation.at(2.0 * f64::from(k) / f64::from(n)).0[0].powi(2)).sum();
        assert!((power / f64::from(n) - 4.5).abs() < 1e-9);
        assert_eq!(excitation, Excitation::multisine(3.0, (1.0, 6.0), 11, 7));
        assert_ne!(excitation, Excitation::multisine(3.0, (1.0, 6.0), 11, 8));
    }
}
