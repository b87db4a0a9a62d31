use super::wave::{Burst, Derivatives, Harmonic, Multisine, Transition, Wave, smooth_step};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::f64::consts::PI;

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
    pub fn tones(tones: impl IntoIterator<Item = Harmonic>) -> Self {
        Self { wave: Wave::Tones(tones.into_iter().collect()), rise: 0.0, fall: None, delay: 0.0 }
    }

    /// One harmonic: `amplitude × cos(2π × frequency × t)`.
    pub fn harmonic(amplitude: f64, frequency: f64) -> Self {
        Self::tones([Harmonic { amplitude, frequency, phase: 0.0 }])
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
        let multisine = Multisine { lowest: low, spacing, phasors: (0..lines).map(phasor).collect() };
        Self { wave: Wave::Multisine(multisine), ..Self::rest() }
    }

    /// The same in bursts, with rests between.
    #[must_use]
    pub fn in_bursts(self, bursts: Vec<Burst>) -> Self {
        Self { wave: Wave::Bursts { wave: Box::new(self.wave), bursts }, ..self }
    }

    /// Moves from place to place, from zero.
    pub fn transitions(moves: Vec<Transition>) -> Self {
        Self { wave: Wave::Transitions(moves), ..Self::rest() }
    }

    /// Straight lines between values at even distances, s, from t = 0 on.
    pub fn piecewise_linear(interval: f64, values: Vec<f64>) -> Self {
        Self { wave: Wave::PiecewiseLinear { interval, values }, ..Self::rest() }
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
        self.wave.scale(factor);
        self
    }

    /// Value and derivatives at time `t`, s.
    pub fn at(&self, t: f64) -> Derivatives {
        let t = t - self.delay;
        self.faded(t, self.wave.at(t))
    }

    /// Appends value and derivatives at each of these times, s, to `values`: those of [`Self::at`], to the bit.
    pub(super) fn append_at(&self, times: &[f64], values: &mut Vec<Derivatives>) {
        let times: Vec<f64> = times.iter().map(|t| t - self.delay).collect();
        let begin = values.len();
        self.wave.append_at(&times, values);
        for (value, t) in values[begin..].iter_mut().zip(times) {
            *value = self.faded(t, *value);
        }
    }

    /// Whether several instants together cost less than one after the other.
    pub(super) fn is_cheaper_together(&self) -> bool {
        self.wave.is_cheaper_together()
    }

    /// The wave's value at its own time `t`, faded in and out.
    fn faded(&self, t: f64, wave: Derivatives) -> Derivatives {
        let rising = if self.rise > 0.0 { wave * smooth_step(t / self.rise, 1.0 / self.rise) } else { wave };
        match self.fall {
            Some((end, length)) => rising * smooth_step((end - t) / length, -1.0 / length),
            None => rising,
        }
    }

    /// Instants, in order, at which a higher derivative jumps: an integrator must not step across them.
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.wave.breaks();
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
        self.wave.highest_frequency()
    }
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
            Excitation::harmonic(1.0, 3.0)
                .in_bursts(vec![Burst { from: 1.0, to: 4.0, edge: 0.9 }, Burst { from: 6.0, to: 9.0, edge: 1.2 }]),
            Excitation::transitions(vec![
                Transition { from: 0.5, duration: 2.0, distance: 1.0 },
                Transition { from: 4.0, duration: 1.0, distance: -0.7 },
            ]),
        ]
    }

    #[test]
    fn instants_together_are_those_one_after_the_other_to_the_bit() {
        for excitation in samples() {
            let times: Vec<f64> = (0..43).map(|k| 0.27 * f64::from(k) - 0.5).collect();
            let mut together = vec![Derivatives([7.0; 3])];
            excitation.append_at(&times, &mut together);
            let alone = times.iter().map(|t| excitation.at(*t));
            let bits = |Derivatives(jet): Derivatives| jet.map(f64::to_bits);
            assert_eq!(together.len(), 1 + times.len());
            for ((t, a), b) in times.iter().zip(&together[1..]).zip(alone) {
                assert_eq!(bits(*a), bits(b), "{excitation:?} at {t} s");
            }
        }
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
        assert_eq!(sweep.at(0.0), Derivatives::default());
        assert_eq!(sweep.at(20.0), Derivatives::default());
        assert_eq!(sweep.at(25.0), Derivatives::default());
        assert!((0..2000).any(|k| sweep.at(0.01 * f64::from(k)).0[0].abs() > 1.99));
    }

    #[test]
    fn bursts_rest_between_their_spells() {
        let bursts = vec![Burst { from: 1.0, to: 2.0, edge: 0.2 }, Burst { from: 3.0, to: 4.0, edge: 0.2 }];
        let bursts = Excitation::harmonic(2.0, 5.0).in_bursts(bursts);
        assert!([0.5, 1.0, 2.0, 2.5, 4.5].iter().all(|t| bursts.at(*t) == Derivatives::default()));
        assert_eq!(bursts.at(1.4), Excitation::harmonic(2.0, 5.0).at(1.4));
        assert_eq!(bursts.breaks(), [1.0, 1.2, 1.8, 2.0, 3.0, 3.2, 3.8, 4.0]);
    }

    #[test]
    fn lines_go_through_their_values_and_break_at_each() {
        let lines = Excitation::piecewise_linear(0.5, vec![1.0, 3.0, 2.0]);
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0, 7.0].map(|t| lines.at(t).0[0]), [1.0, 2.0, 3.0, 2.5, 2.0, 2.0]);
        assert_eq!(lines.at(0.25).0, [2.0, 4.0, 0.0]);
        assert_eq!(lines.breaks(), [0.5, 1.0]);
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
