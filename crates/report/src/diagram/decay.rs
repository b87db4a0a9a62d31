//! A free decay's backbone (frequency over amplitude) and damping over amplitude.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use sindyscope_core::study::{Outcome, RecordOutcome};
use sindyscope_values::record::{Record, Role};

/// Fewest half swings that say anything of a decay.
const FEWEST: usize = 8;

/// An input that changes by less than this share of its largest change anywhere is at rest.
const AT_REST: f64 = 0.01;

/// Fall of the amplitude (natural logarithm) over which damping and frequency are averaged: a fifth.
const FALL: f64 = 0.22;

/// Share of all half swings that such an average spans at most.
const WIDEST: f64 = 0.2;

/// Swings below so many standard deviations of the noise are not counted.
const ABOVE_NOISE: f64 = 6.0;

/// Amplitude, frequency and damping along a free decay, from its extremes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decay {
    /// Time, s.
    pub time: Vec<f64>,
    /// Half the distance of neighbouring extremes, in the displacement's unit.
    pub amplitude: Vec<f64>,
    /// Instantaneous frequency, Hz.
    pub frequency: Vec<f64>,
    /// Instantaneous damping ratio.
    pub damping: Vec<f64>,
}

/// Why a record is no free decay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoDecay {
    /// Its input never rests for long enough.
    Driven,
    /// Too few swings stand out of the noise.
    FewSwings,
    /// The swings do not become smaller.
    NotDecaying,
}

impl Decay {
    /// The longest stretch of a record over which every input rests.
    ///
    /// # Errors
    /// The inputs never rest for long.
    pub fn stretch(record: &Record) -> Result<Range<usize>, NoDecay> {
        let n = record.len();
        let inputs: Vec<&[f64]> =
            record.channels.iter().filter(|c| matches!(c.role, Role::Input(_))).map(|c| &*c.values).collect();
        let range =
            |values: &[f64]| values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        let limits: Vec<f64> = inputs.iter().map(|u| AT_REST * (range(u).1 - range(u).0)).collect();
        let (mut best, mut from) = (0..0, 0);
        let mut held: Vec<(f64, f64)> = vec![(f64::INFINITY, f64::NEG_INFINITY); inputs.len()];
        for k in 0..n {
            for (held, u) in held.iter_mut().zip(&inputs) {
                *held = (held.0.min(u[k]), held.1.max(u[k]));
            }
            if held.iter().zip(&limits).any(|((low, high), limit)| high - low > *limit) {
                from = k;
                for (held, u) in held.iter_mut().zip(&inputs) {
                    *held = (u[k], u[k]);
                }
            }
            if k + 1 - from > best.len() {
                best = from..k + 1;
            }
        }
        // A pause between two pushes is no decay.
        if best.len() < n / 5 { Err(NoDecay::Driven) } else { Ok(best) }
    }

    /// The decay of a series sampled every `interval` seconds from `start` on, whose noise has this standard deviation.
    ///
    /// # Errors
    /// It does not swing, or does not decay.
    pub fn new(series: &[f64], start: f64, interval: f64, noise: f64) -> Result<Self, NoDecay> {
        let extremes = extremes(series, noise);
        let swings: Vec<(f64, f64)> = extremes
            .windows(2)
            .map(|w| (0.5 * (w[0].0 + w[1].0), 0.5 * (w[0].1 - w[1].1).abs()))
            .take_while(|(_, a)| *a > ABOVE_NOISE * noise)
            .collect();
        if swings.len() < FEWEST {
            return Err(NoDecay::FewSwings);
        }
        let count = swings.len();
        let (first, last) = (&swings[..count / 4], &swings[count - count / 4..]);
        let mean = |part: &[(f64, f64)]| part.iter().map(|s| s.1).sum::<f64>() / part.len() as f64;
        let rising = swings.windows(2).filter(|w| w[1].1 > 1.05 * w[0].1).count();
        if mean(last) > 0.8 * mean(first) || rising > count / 5 {
            return Err(NoDecay::NotDecaying);
        }
        let logarithms: Vec<f64> = swings.iter().map(|s| s.1.ln()).collect();
        let mut decay = Self::default();
        for k in 1..count - 1 {
            let room = k.min(count - 1 - k);
            let widest = ((0.5 * WIDEST * count as f64) as usize).clamp(1, room);
            let half = (1..=widest).find(|h| logarithms[k - h] - logarithms[k + h] > FALL).unwrap_or(widest);
            let part = k - half..k + half + 1;
            let (time, period) = line(&swings[part.clone()].iter().map(|s| s.0).collect::<Vec<_>>());
            let (level, fall) = line(&logarithms[part]);
            if period <= 0.0 {
                continue;
            }
            // The amplitude falls by exp(−πζ/√(1−ζ²)) in half a swing.
            let decrement = -fall / std::f64::consts::PI;
            decay.time.push(start + interval * time);
            decay.amplitude.push(level.exp());
            decay.frequency.push(0.5 / (period * interval));
            decay.damping.push(decrement / (1.0 + decrement * decrement).sqrt());
        }
        Ok(decay)
    }

    /// Measured and simulated decay of a record's displacement.
    ///
    /// # Errors
    /// Why the measurement is no free decay; the simulation may be none without an error.
    pub fn of_record(
        outcome: &Outcome,
        record: &RecordOutcome,
        freedom: usize,
    ) -> Result<(Self, Option<Self>), NoDecay> {
        let stretch = Self::stretch(&record.record)?;
        let measured = record.record.channel(Role::Displacement(freedom)).ok_or(NoDecay::FewSwings)?;
        let noise = record.signals.noise.get(freedom).copied().or(outcome.noise_floor).unwrap_or(0.0);
        let (start, interval) = (record.record.time(stretch.start), record.record.interval);
        let decay = Self::new(&measured.values[stretch.clone()], start, interval, noise)?;
        let simulated = record.channels.get(freedom).and_then(|c| {
            let part = c.response.get(stretch.start..stretch.end.min(c.response.len()))?;
            Self::new(part, start, interval, noise).ok()
        });
        Ok((decay, simulated))
    }
}

/// Value at the middle and slope of the line through values at 0, 1, 2, …
fn line(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = values.iter().sum::<f64>() / n;
    let (mut along, mut squares) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let t = k as f64 - middle;
        along += t * value;
        squares += t * t;
    }
    (mean, along / squares)
}

/// Extremes in turn, high and low: position in samples and value.
fn extremes(series: &[f64], noise: f64) -> Vec<(f64, f64)> {
    let finite = series.iter().take_while(|x| x.is_finite()).count();
    let series = &series[..finite];
    let (low, high) = series.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    if high - low <= 0.0 || !(high - low).is_finite() {
        return Vec::new();
    }
    // A turn counts once the series has come back by more than noise does.
    let turn = (ABOVE_NOISE * noise).max(1e-6 * (high - low));
    let mut coarse: Vec<usize> = Vec::new();
    let (mut least, mut most) = (0, 0);
    let mut rising: Option<bool> = None;
    for (k, x) in series.iter().enumerate() {
        if *x < series[least] {
            least = k;
        }
        if *x > series[most] {
            most = k;
        }
        match rising {
            Some(true) if series[most] - x > turn => {
                coarse.push(most);
                (rising, least) = (Some(false), k);
            }
            Some(false) if x - series[least] > turn => {
                coarse.push(least);
                (rising, most) = (Some(true), k);
            }
            None if x - series[least] > turn => (rising, most) = (Some(true), k),
            None if series[most] - x > turn => (rising, least) = (Some(false), k),
            _ => {}
        }
    }
    let gaps: Vec<usize> = coarse.windows(2).map(|w| w[1] - w[0]).collect();
    (0..coarse.len())
        .map(|i| {
            let gap = match (i.checked_sub(1).map(|k| gaps[k]), gaps.get(i)) {
                (Some(a), Some(b)) => a.min(*b),
                (a, b) => a.or(b.copied()).unwrap_or(0),
            };
            refined(series, coarse[i], gap / 4)
        })
        .collect()
}

/// The extreme of a polynomial through the samples around `at`: much less noisy than the largest sample.
fn refined(series: &[f64], at: usize, reach: usize) -> (f64, f64) {
    let coarse = (at as f64, series[at]);
    let reach = reach.min(at).min(series.len() - 1 - at);
    if reach == 0 {
        return coarse;
    }
    let order = if reach >= 3 { 4 } else { 2 };
    let rows = 2 * reach + 1;
    let scale = reach as f64;
    let matrix = DMatrix::from_fn(rows, order + 1, |row, power| ((row as f64 - scale) / scale).powi(power as i32));
    let values = DVector::from_iterator(rows, series[at - reach..=at + reach].iter().copied());
    let Some(c) = (matrix.transpose() * &matrix).cholesky().map(|g| g.solve(&(matrix.transpose() * values))) else {
        return coarse;
    };
    let sum = |t: f64, derivative: usize| -> f64 {
        (derivative..=order)
            .map(|power| {
                let factor: f64 = (0..derivative).map(|d| (power - d) as f64).product();
                factor * c[power] * t.powi((power - derivative) as i32)
            })
            .sum()
    };
    let mut t = 0.0_f64;
    for _ in 0..8 {
        let (slope, bend) = (sum(t, 1), sum(t, 2));
        if bend == 0.0 {
            return coarse;
        }
        t = (t - slope / bend).clamp(-1.0, 1.0);
    }
    if t.abs() < 1.0 { (at as f64 + t * scale, sum(t, 0)) } else { coarse }
}
