use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul, Sub};

use fearless_simd::{Level, Simd, SimdBase as _, SimdFrom as _, dispatch, f64x4};

/// A function of time at one instant: its value and its first two time derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Derivatives(pub [f64; 3]);

impl Add for Derivatives {
    type Output = Self;

    fn add(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self([a[0] + b[0], a[1] + b[1], a[2] + b[2]])
    }
}

impl Mul for Derivatives {
    type Output = Self;

    fn mul(self, Self(b): Self) -> Self {
        let Self(a) = self;
        Self([a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]])
    }
}

impl Derivatives {
    /// `amplitude × cos(phase)`, given the phase's own value and derivatives.
    pub(super) fn cosine(amplitude: f64, Self(phase): Self) -> Self {
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
pub struct Harmonic {
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
pub struct Multisine {
    /// The lowest frequency, Hz.
    pub lowest: f64,
    /// The distance from one frequency to the next, Hz.
    pub spacing: f64,
    /// Amplitude times cosine and sine of the phase at t = 0, of each harmonic.
    pub phasors: Vec<[f64; 2]>,
}

/// A number, or several side by side.
trait Lanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self> {}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Mul<f64, Output = T>> Lanes for T {}

impl Multisine {
    fn at(&self, t: f64) -> Derivatives {
        let (lowest, step) = self.phases(t);
        Derivatives(self.sum(0.0, lowest.sin_cos(), step.sin_cos()))
    }

    /// The phase of the lowest harmonic, and from one to the next.
    fn phases(&self, t: f64) -> (f64, f64) {
        (TAU * self.lowest * t, TAU * self.spacing * t)
    }

    /// Value and derivatives, from sine and cosine of the lowest harmonic's phase and of the one from each to the next.
    #[inline(always)]
    fn sum<T: Lanes>(&self, zero: T, (mut sine, mut cosine): (T, T), (step_sine, step_cosine): (T, T)) -> [T; 3] {
        let (rate, step) = (TAU * self.lowest, TAU * self.spacing);
        let mut jet = [zero; 3];
        for (k, [along, across]) in self.phasors.iter().enumerate() {
            let omega = rate + step * k as f64;
            let value = cosine * *along - sine * *across;
            jet[0] = jet[0] + value;
            jet[1] = jet[1] - (sine * *along + cosine * *across) * omega;
            jet[2] = jet[2] - value * (omega * omega);
            (sine, cosine) = (sine * step_cosine + cosine * step_sine, cosine * step_cosine - sine * step_sine);
        }
        jet
    }

    /// The same at four instants at a time, appended to `values`. Each harmonic waits for the one before: one instant alone would leave a
    /// processor idle.
    #[inline(always)]
    fn append_fours<S: Simd>(&self, simd: S, fours: &[[f64; 4]], values: &mut Vec<Derivatives>) {
        // No closure holds numbers side by side: it would be compiled for a processor without such registers.
        for times in fours {
            let (mut lowest, mut step) = ([[0.0; 4]; 2], [[0.0; 4]; 2]);
            for (i, t) in times.iter().enumerate() {
                let phases = self.phases(*t);
                (lowest[0][i], lowest[1][i]) = phases.0.sin_cos();
                (step[0][i], step[1][i]) = phases.1.sin_cos();
            }
            let lowest = (f64x4::simd_from(simd, lowest[0]), f64x4::simd_from(simd, lowest[1]));
            let step = (f64x4::simd_from(simd, step[0]), f64x4::simd_from(simd, step[1]));
            let [value, rate, curvature] = self.sum(f64x4::splat(simd, 0.0), lowest, step);
            let jet: [[f64; 4]; 3] = [value.into(), rate.into(), curvature.into()];
            values.extend((0..4).map(|i| Derivatives([jet[0][i], jet[1][i], jet[2][i]])));
        }
    }

    /// The same at any number of instants, appended to `values`, in the widest registers that the processor has.
    fn append_at(&self, times: &[f64], values: &mut Vec<Derivatives>) {
        let (fours, rest) = times.as_chunks();
        dispatch!(Level::new(), simd => self.append_fours(simd, fours, values));
        values.extend(rest.iter().map(|t| self.at(*t)));
    }
}

/// What a shaker does before it is faded in and out.
#[derive(Clone, Debug, PartialEq)]
pub enum Wave {
    /// A sum of harmonics; none of them is rest.
    Tones(Vec<Harmonic>),
    /// A sum of harmonics evenly spaced in frequency.
    Multisine(Multisine),
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
    /// Another wave in bursts, with rests between.
    Bursts {
        /// What is on in each burst.
        wave: Box<Self>,
        /// When it is on, in order, none overlapping another.
        bursts: Vec<Burst>,
    },
    /// Moves from place to place, each at rest where it begins and ends; from zero.
    Transitions(Vec<Transition>),
    /// Straight lines between values at even distances from t = 0 on; the last is held.
    PiecewiseLinear {
        /// Distance between two values, s.
        interval: f64,
        /// The values.
        values: Vec<f64>,
    },
}

/// A time in which a wave is on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    /// When it begins, s.
    pub from: f64,
    /// When it has ended, s.
    pub to: f64,
    /// Time in which it fades in, and out, s.
    pub edge: f64,
}

/// A smooth move over a distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// When it begins, s.
    pub from: f64,
    /// How long it takes, s.
    pub duration: f64,
    /// How far it goes.
    pub distance: f64,
}

impl Wave {
    /// Value and derivatives at time `t`, s.
    pub(super) fn at(&self, t: f64) -> Derivatives {
        match self {
            Self::Tones(tones) => tones.iter().fold(Derivatives::default(), |sum, tone| {
                let rate = TAU * tone.frequency;
                sum + Derivatives::cosine(tone.amplitude, Derivatives([rate * t + tone.phase, rate, 0.0]))
            }),
            Self::Multisine(multisine) => multisine.at(t),
            Self::Sweep { amplitude, from, to, duration } => {
                let slope = (to - from) / duration;
                let phase = TAU * (from + 0.5 * slope * t) * t - 0.5 * PI;
                Derivatives::cosine(*amplitude, Derivatives([phase, TAU * (from + slope * t), TAU * slope]))
            }
            Self::Bursts { wave, bursts } => bursts
                .iter()
                .find(|s| s.from < t && t < s.to)
                .map_or_else(Derivatives::default, |s| wave.at(t) * window(t, s.from, s.to, s.edge)),
            Self::Transitions(moves) => moves.iter().fold(Derivatives::default(), |sum, step| {
                let share = smooth_step((t - step.from) / step.duration, 1.0 / step.duration);
                sum + share * Derivatives([step.distance, 0.0, 0.0])
            }),
            Self::PiecewiseLinear { interval, values } => line(t / interval, values, *interval),
        }
    }

    /// Whether several instants together cost less than one after the other.
    pub(super) fn is_cheaper_together(&self) -> bool {
        matches!(self, Self::Multisine(_))
    }

    /// Appends value and derivatives at each of these times, s, to `values`: those of [`Self::at`], to the bit.
    pub(super) fn append_at(&self, times: &[f64], values: &mut Vec<Derivatives>) {
        match self {
            Self::Multisine(multisine) => multisine.append_at(times, values),
            _ => values.extend(times.iter().map(|t| self.at(*t))),
        }
    }

    pub(super) fn scale(&mut self, factor: f64) {
        match self {
            Self::Tones(tones) => tones.iter_mut().for_each(|tone| tone.amplitude *= factor),
            Self::Multisine(multisine) => multisine.phasors.iter_mut().flatten().for_each(|part| *part *= factor),
            Self::Sweep { amplitude, .. } => *amplitude *= factor,
            Self::Bursts { wave, .. } => wave.scale(factor),
            Self::Transitions(moves) => moves.iter_mut().for_each(|step| step.distance *= factor),
            Self::PiecewiseLinear { values, .. } => values.iter_mut().for_each(|value| *value *= factor),
        }
    }

    /// Instants at which a derivative jumps, in no order.
    pub(super) fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Tones(_) | Self::Multisine(_) | Self::Sweep { .. } => Vec::new(),
            Self::Bursts { bursts, .. } => {
                bursts.iter().flat_map(|s| [s.from, s.from + s.edge, s.to - s.edge, s.to]).collect()
            }
            Self::Transitions(moves) => moves.iter().flat_map(|step| [step.from, step.from + step.duration]).collect(),
            Self::PiecewiseLinear { interval, values } => (1..values.len()).map(|k| interval * k as f64).collect(),
        }
    }

    /// The highest frequency in it, Hz; none of lines, each of which is a phase of its own.
    pub(super) fn highest_frequency(&self) -> f64 {
        match self {
            Self::Tones(tones) => tones.iter().map(|t| t.frequency).fold(0.0, f64::max),
            Self::Multisine(multisine) => {
                multisine.lowest + multisine.spacing * multisine.phasors.len().saturating_sub(1) as f64
            }
            Self::Sweep { from, to, .. } => from.max(*to),
            Self::Bursts { wave, .. } => wave.highest_frequency(),
            Self::Transitions(moves) => moves.iter().map(|step| 1.0 / step.duration).fold(0.0, f64::max),
            Self::PiecewiseLinear { .. } => 0.0,
        }
    }
}

/// Zero at both ends of a time, one in between, and smooth.
fn window(t: f64, from: f64, to: f64, edge: f64) -> Derivatives {
    smooth_step((t - from) / edge, 1.0 / edge) * smooth_step((to - t) / edge, -1.0 / edge)
}

/// The line through the values before and after a position, counted in them.
fn line(position: f64, values: &[f64], interval: f64) -> Derivatives {
    let last = values.len().saturating_sub(1);
    let before = position.floor().max(0.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number, zero or more")]
    let index = before as usize;
    match (values.get(index), values.get(index + 1)) {
        (Some(a), Some(b)) => {
            let slope = b - a;
            Derivatives([a + slope * (position - before), slope / interval, 0.0])
        }
        _ => Derivatives([values.get(last).copied().unwrap_or_default(), 0.0, 0.0]),
    }
}

/// From 0 at `s` = 0 to 1 at `s` = 1 by 6s⁵ − 15s⁴ + 10s³, twice continuously differentiable; `rate` is ds/dt.
pub(super) fn smooth_step(s: f64, rate: f64) -> Derivatives {
    if s <= 0.0 {
        return Derivatives::default();
    }
    if s >= 1.0 {
        return Derivatives([1.0, 0.0, 0.0]);
    }
    let value = s * s * s * (s * (6.0 * s - 15.0) + 10.0);
    let slope = 30.0 * s * s * (s - 1.0) * (s - 1.0);
    let curvature = 60.0 * s * (s - 1.0) * (2.0 * s - 1.0);
    Derivatives([value, slope * rate, curvature * rate * rate])
}
