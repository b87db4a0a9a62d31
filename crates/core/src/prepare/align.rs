//! Channels that were sampled one later than the other: the delay estimated, and taken out.

use std::f64::consts::TAU;

use sindyscope_fourier::Complex;

use crate::sampling::resample;
use sindyscope_values::record::{Channel, Record, Role};

/// How far a channel lags behind another of the same motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    /// By how much it is late, s; negative if it is early.
    pub seconds: f64,
    /// How well both agree once the delay is taken out: 1 for one motion without noise.
    pub agreement: f64,
}

/// How often the displacement is differentiated to give what a role measures; none for an input.
fn order(role: Role) -> Option<i32> {
    match role {
        Role::Displacement(_) => Some(0),
        Role::Velocity(_) => Some(1),
        Role::Acceleration(_) => Some(2),
        Role::Input(_) => None,
    }
}

/// How far a channel lags behind another sensor of the same mass: where the cross-correlation of both, each differentiated
/// as often as the other, is largest. The peak is found between samples by a parabola (Knapp and Carter, IEEE Trans. ASSP 24
/// (1976) 320–327, without weighting).
///
/// None for an input, whose lag before the motion is the system's own, and for a mass with one sensor.
pub(super) fn delay(record: &Record, role: Role) -> Option<Delay> {
    let own = order(role)?;
    let channel = record.channel(role).filter(|c| !c.estimated)?;
    let beside = |c: &&Channel| c.role != role && c.role.index() == role.index() && order(c.role).is_some();
    let other = record.measured().find(beside)?;
    let turns = own - order(other.role)?;
    let (a, b) = (spectrum(&channel.values)?, spectrum(&other.values)?);
    // Differentiation turns each line by a quarter; its growth with the frequency would only weigh noise more.
    let turn = Complex::new(0.0, 1.0).powi(turns);
    let mut cross: Vec<Complex<f64>> = a.iter().zip(&b).map(|(a, b)| a * (b * turn).conj()).collect();
    let whole: f64 = cross.iter().map(|c| c.norm()).sum::<f64>();
    if let Some(first) = cross.first_mut() {
        *first = Complex::new(0.0, 0.0);
    }
    if let Some(last) = cross.last_mut() {
        last.im = 0.0;
    }
    let length = 2 * (cross.len() - 1);
    let back = sindyscope_fourier::inverse(length);
    let mut correlation = back.make_output_vec();
    back.process(&mut cross, &mut correlation).ok()?;
    // Late by a quarter of the record at most; beyond it the parts that overlap are short.
    let reach = (record.len() / 4).max(1) as isize;
    let at = |lag: isize| correlation[lag.rem_euclid(length as isize) as usize];
    let peak = (-reach..=reach).max_by(|p, q| at(*p).total_cmp(&at(*q)))?;
    let (before, top, after) = (at(peak - 1), at(peak), at(peak + 1));
    let bend = before - 2.0 * top + after;
    let within = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    if !(whole > 0.0 && top.is_finite()) {
        return None;
    }
    Some(Delay { seconds: (peak as f64 + within) * record.interval, agreement: (0.5 * top / whole).clamp(0.0, 1.0) })
}

/// Lines of a series without its mean, under a Hann window, with as many zeros behind it.
fn spectrum(values: &[f64]) -> Option<Vec<Complex<f64>>> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n.max(1) as f64;
    let forward = sindyscope_fourier::forward(2 * n.max(1));
    let mut padded = forward.make_input_vec();
    for (k, (slot, value)) in padded.iter_mut().zip(values).enumerate() {
        *slot = (value - mean) * (0.5 - 0.5 * (TAU * k as f64 / n as f64).cos());
    }
    let mut lines = forward.make_output_vec();
    forward.process(&mut padded, &mut lines).ok()?;
    Some(lines)
}

/// The record with a channel moved forward in time by `delay` s, interpolated between samples by polynomials of degree
/// seven; it lasts as long as all channels are known. None if nothing would be left.
pub(super) fn advanced(record: &Record, role: Role, delay: f64) -> Option<Record> {
    let late = delay / record.interval;
    let lost = late.abs().ceil() as usize;
    let left = record.len().checked_sub(lost).filter(|left| late.is_finite() && *left >= 4)?;
    // What is late is known up to the end only so much earlier, what is early from the beginning only so much later.
    let first = if late < 0.0 { lost } else { 0 };
    let stamps: Vec<f64> = (0..record.len()).map(|k| k as f64).collect();
    let channels = record.channels.iter().map(|channel| {
        if channel.role != role {
            return Channel { values: channel.values[first..first + left].into(), ..channel.clone() };
        }
        let mut moved = [channel.values.to_vec()];
        resample(&stamps, &mut moved, first as f64 + late, 1.0, left);
        let [values] = moved;
        Channel { values: values.into(), ..channel.clone() }
    });
    Some(Record { start: record.time(first), channels: channels.collect(), ..record.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 2e-3;

    /// Displacement, and an acceleration of the same motion that is late by so much, s.
    fn record(late: f64) -> Record {
        let tones = [(3.1, 1.0, 0.2), (7.7, 0.3, 1.1), (11.3, 0.2, 2.0)];
        let at = |t: f64, order: i32| -> f64 {
            let tone = |(f, amplitude, phase): (f64, f64, f64)| {
                amplitude * (TAU * f).powi(order) * (TAU * f * t + phase + TAU / 4.0 * f64::from(order)).sin()
            };
            tones.into_iter().map(tone).sum()
        };
        let channel = |role, name: &str, unit: &str, value: &dyn Fn(f64) -> f64| Channel {
            name: name.into(),
            role,
            unit: unit.into(),
            values: (0..3000).map(|i| value(f64::from(i) * STEP)).collect(),
            estimated: false,
        };
        let channels = vec![
            channel(Role::Displacement(0), "x", "m", &|t| at(t, 0)),
            channel(Role::Acceleration(0), "a", "m/s^2", &|t| at(t - late, 2)),
            channel(Role::Input(0), "u", "N", &|t| t.sin()),
        ];
        Record { name: "run".into(), source: None, start: 0.0, interval: STEP, channels, notices: Vec::new() }
    }

    #[test]
    fn a_delay_is_found_to_a_twentieth_of_a_sample_and_taken_out() {
        for late in [0.0, 0.0203, -0.0331] {
            let record = record(late);
            let found = delay(&record, Role::Acceleration(0)).unwrap();
            assert!((found.seconds - late).abs() < 0.05 * STEP, "{late}: {found:?}");
            assert!(found.agreement > 0.95, "{found:?}");
            let aligned = advanced(&record, Role::Acceleration(0), late).unwrap();
            let (x, a) = (&aligned.channels[0].values, &aligned.channels[1].values);
            assert_eq!(aligned.channels[0].values.len(), a.len());
            let exact = self::record(0.0);
            let first = (aligned.start / STEP).round() as usize;
            for k in 5..a.len() - 5 {
                assert_eq!(x[k], exact.channels[0].values[first + k]);
                let truth = exact.channels[1].values[first + k];
                assert!((a[k] - truth).abs() < 0.05, "{late} {k}: {} for {truth}", a[k]);
            }
        }
    }

    #[test]
    fn an_input_and_a_lone_sensor_have_none() {
        let mut record = record(0.01);
        assert!(delay(&record, Role::Input(0)).is_none());
        record.channels.remove(1);
        assert!(delay(&record, Role::Displacement(0)).is_none());
        assert!(advanced(&record, Role::Displacement(0), 1e9).is_none());
    }
}
