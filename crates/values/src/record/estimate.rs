//! Displacements that no sensor showed, estimated from a velocity or an acceleration: where a fit begins, never what it is
//! held against.
//!
//! The displacement is the one whose differences are nearest to what was measured while it stays small: least squares of
//! `δᵖx/hᵖ − y` beside `ωᵖ x`. That integrates what is faster than ω and leaves out what is slower, without a phase, up to
//! the record's ends; an integral sample by sample would carry noise and offset of the sensor away.

use std::f64::consts::TAU;

use super::types::{Channel, Role};

/// Periods of the slowest motion that a record must hold for it to be seen.
const LEAST_PERIODS: f64 = 1.5;
/// Lines on each side that a spectrum is averaged over.
const SMOOTH: usize = 2;
/// Share of the lines that are taken to be noise, and how many times their power a motion must have.
const QUIET: f64 = 0.2;
const CLEAR: f64 = 30.0;
/// Share of an input's, or of a motion's, power below which it is not driven, or does not move.
const FAINT: f64 = 2e-3;
/// Where the integration ends below the slowest motion, as a share of its frequency: of a velocity, of an acceleration. The
/// slowest motion loses two to three parts in a hundred; noise below it would grow with the inverse third power.
const BELOW: [f64; 2] = [0.15, 0.4];
/// How long the estimate remembers a sample, over the time in which that falls to 1/e.
const LASTS: f64 = 4.0;
/// The slowest rate that the arithmetic bears, in radians a sample.
const SLOWEST: f64 = 1e-3;

/// Adds an estimated displacement where a degree of freedom has a velocity or an acceleration alone; tells what was done.
pub fn complete(channels: &mut Vec<Channel>, interval: f64) -> Vec<String> {
    let count = channels.iter().filter(|c| !matches!(c.role, Role::Input(_))).map(|c| c.role.index() + 1).max();
    let mut notices = Vec::new();
    let several = count.unwrap_or(0) > 1;
    for freedom in 0..count.unwrap_or(0) {
        let has = |role: Role| channels.iter().find(|c| c.role == role);
        if has(Role::Displacement(freedom)).is_some() {
            continue;
        }
        let velocity = has(Role::Velocity(freedom)).map(|c| (c, 1));
        let Some((source, order)) = velocity.or_else(|| has(Role::Acceleration(freedom)).map(|c| (c, 2))) else {
            continue;
        };
        let inputs: Vec<&[f64]> =
            channels.iter().filter(|c| matches!(c.role, Role::Input(_))).map(|c| &*c.values).collect();
        let (values, slowest) = integrated(&source.values, &inputs, interval, order);
        let name = if several { format!("x{}", freedom + 1) } else { "x".to_owned() };
        notices.push(format!(
            "the displacement {name} was not measured; it is estimated from the {} `{}`, without what is slower than {:.2e} Hz",
            source.role.noun(),
            source.name,
            slowest
        ));
        let unit = displacement_unit(&source.unit, order);
        channels.push(Channel {
            name,
            role: Role::Displacement(freedom),
            unit,
            values: values.into(),
            estimated: true,
        });
    }
    channels.sort_by_key(|c| c.role);
    notices
}

/// The unit of what, differentiated so often, has this one: `mm` of `mm/s`, `m` of `m/s^2`.
pub fn displacement_unit(unit: &str, order: usize) -> String {
    let ends: &[&str] = if order == 1 { &["/s"] } else { &["/s^2", "/s²", "/s2"] };
    let cut = ends.iter().find_map(|end| unit.strip_suffix(end));
    match (cut, unit.is_empty(), order) {
        (Some(length), _, _) => length.to_owned(),
        (None, true, _) => String::new(),
        (None, false, 1) => format!("{unit} s"),
        (None, false, _) => format!("{unit} s^2"),
    }
}

/// The series integrated `order` times (1 or 2), and the frequency below which nothing is in it, Hz; `inputs` are what drives
/// the motion.
fn integrated(values: &[f64], inputs: &[&[f64]], interval: f64, order: usize) -> (Vec<f64>, f64) {
    let centred = about_mean(values);
    let rate = rate(&centred, inputs, interval, order);
    (nearest(&centred, interval, order, rate), rate / (TAU * interval))
}

/// What one sample of a velocity (`order` 1) or of an acceleration (2) does to the displacement that is estimated from a series, from
/// its own place on and as far again before it: as far as that lasts, and no further than the series is long.
pub fn response(series: &[f64], inputs: &[&[f64]], interval: f64, order: usize) -> Vec<f64> {
    let centred = about_mean(series);
    let rate = rate(&centred, inputs, interval, order);
    let reach = ((LASTS / rate) as usize).min(series.len());
    let mut one = vec![0.0; 2 * reach + 1];
    one[reach] = 1.0;
    nearest(&one, interval, order, rate)
}

/// The integral of a velocity as it was measured, about its mean over the series: a sensor without an offset, on a motion that wanders
/// further than [`complete`] can tell from one, shows it so.
pub fn integral(velocity: &[f64], interval: f64) -> Vec<f64> {
    let mut integral = vec![0.0; velocity.len()];
    for row in 1..velocity.len() {
        integral[row] = integral[row - 1] + mean_of_velocity(velocity, row - 1) * interval;
    }
    about_mean(&integral)
}

fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| v - mean).collect()
}

/// The mean of a velocity between two samples, to the fourth order.
fn mean_of_velocity(velocity: &[f64], row: usize) -> f64 {
    let v = velocity;
    if row > 0 && row + 2 < v.len() {
        (13.0 * (v[row] + v[row + 1]) - v[row - 1] - v[row + 2]) / 24.0
    } else {
        0.5 * (v[row] + v[row + 1])
    }
}

/// Where the integration ends, in radians a sample; of a series without its mean.
fn rate(centred: &[f64], inputs: &[&[f64]], interval: f64, order: usize) -> f64 {
    (TAU * BELOW[order - 1] * slowest(centred, inputs, interval) * interval).max(SLOWEST)
}

/// The displacement whose differences are nearest to a series while it stays small.
fn nearest(centred: &[f64], interval: f64, order: usize, rate: f64) -> Vec<f64> {
    let n = centred.len();
    let weight = rate.powi(2 * order as i32);
    // Differences of the displacement, and the means of the series that equal them to the fourth order.
    let mut right = vec![0.0; n];
    let mut bands = vec![[weight, 0.0, 0.0]; n];
    let stencil: &[f64] = if order == 1 { &[-1.0, 1.0] } else { &[1.0, -2.0, 1.0] };
    for row in 0..n - order {
        let at = |k: usize| centred[k];
        let mean = if order == 2 {
            (at(row) + 10.0 * at(row + 1) + at(row + 2)) / 12.0
        } else {
            mean_of_velocity(centred, row)
        };
        let target = mean * interval.powi(order as i32);
        for (i, a) in stencil.iter().enumerate() {
            right[row + i] += a * target;
            for (j, b) in stencil[..=i].iter().enumerate() {
                bands[row + i][i - j] += a * b;
            }
        }
    }
    solve(&mut bands, &mut right);
    right
}

/// Solves a symmetric positive definite system of band width 2 in place: `bands[i][d]` is the entry of row `i` and column
/// `i − d`.
fn solve(bands: &mut [[f64; 3]], right: &mut [f64]) {
    let n = right.len();
    // A = L D Lᵀ with unit diagonal; D in the first place of each row.
    for i in 0..n {
        for d in (1..=2.min(i)).rev() {
            let j = i - d;
            let mut sum = bands[i][d];
            if d == 1 && i >= 2 {
                sum -= bands[i][2] * bands[i - 2][0] * bands[j][1];
            }
            bands[i][d] = sum / bands[j][0];
        }
        let own: f64 = (1..=2.min(i)).map(|d| bands[i][d] * bands[i][d] * bands[i - d][0]).sum();
        bands[i][0] -= own;
        let before: f64 = (1..=2.min(i)).map(|d| bands[i][d] * right[i - d]).sum();
        right[i] -= before;
    }
    for i in (0..n).rev() {
        let after: f64 = (1..=2.min(n - 1 - i)).map(|d| bands[i + d][d] * right[i + d]).sum();
        right[i] = right[i] / bands[i][0] - after;
    }
}

/// The lowest frequency of a motion, Hz: above the noise, and not below both what drives it and what most of it is. What an
/// accelerometer shows below that is its own drift.
fn slowest(values: &[f64], inputs: &[&[f64]], interval: f64) -> f64 {
    let n = values.len();
    let least = LEAST_PERIODS / (n as f64 * interval);
    let Some(lines) = power(values) else { return least };
    let smooth: Vec<f64> = (0..lines.len())
        .map(|k| {
            let part = &lines[k.saturating_sub(SMOOTH)..(k + SMOOTH + 1).min(lines.len())];
            part.iter().sum::<f64>() / part.len() as f64
        })
        .collect();
    let mut ordered = smooth;
    ordered.sort_by(f64::total_cmp);
    let noise = ordered[(QUIET * (ordered.len() - 1) as f64) as usize];
    let frequency = |k: usize| k as f64 / (n as f64 * interval);
    let clear = (0..lines.len()).find(|k| frequency(*k) >= least && lines[*k] > CLEAR * noise).map_or(least, frequency);
    let driven = inputs.iter().filter_map(|u| {
        let mean = u.iter().sum::<f64>() / u.len() as f64;
        Some(frequency(first_share(&power(&u.iter().map(|u| u - mean).collect::<Vec<f64>>())?, FAINT)?))
    });
    let band = driven.chain(first_share(&lines, FAINT).map(frequency)).fold(f64::INFINITY, f64::min);
    if band.is_finite() { clear.max(band) } else { clear }
}

/// Power of each line of a series under a Hann window.
fn power(values: &[f64]) -> Option<Vec<f64>> {
    let n = values.len();
    let transform = sindyscope_fourier::forward(n);
    let mut windowed: Vec<f64> =
        values.iter().enumerate().map(|(k, v)| v * (0.5 - 0.5 * (TAU * k as f64 / n as f64).cos())).collect();
    let mut lines = transform.make_output_vec();
    transform.process(&mut windowed, &mut lines).ok()?;
    Some(lines.iter().map(|l| l.norm_sqr()).collect())
}

/// The line below which a share of the whole power lies; none where there is none.
fn first_share(power: &[f64], share: f64) -> Option<usize> {
    let whole: f64 = power.iter().sum();
    let mut sum = 0.0;
    power.iter().position(|p| {
        sum += p;
        whole > 0.0 && sum >= share * whole
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion(n: usize, interval: f64) -> [Vec<f64>; 3] {
        let at = |f: &dyn Fn(f64) -> f64| (0..n).map(|k| f(k as f64 * interval)).collect();
        let (w, z) = (TAU * 2.0, TAU * 5.3);
        [
            at(&|t| (w * t).sin() + 0.2 * (z * t).cos()),
            at(&|t| w * (w * t).cos() - 0.2 * z * (z * t).sin()),
            at(&|t| -w * w * (w * t).sin() - 0.2 * z * z * (z * t).cos()),
        ]
    }

    fn error(found: &[f64], truth: &[f64]) -> f64 {
        let squares = |a: &mut dyn Iterator<Item = f64>| a.map(|v| v * v).sum::<f64>();
        (squares(&mut found.iter().zip(truth).map(|(a, b)| a - b)) / squares(&mut truth.iter().copied())).sqrt()
    }

    #[test]
    fn a_displacement_comes_back_from_velocity_and_from_acceleration() {
        let [x, v, a] = motion(2000, 0.01);
        for (series, order) in [(v, 1), (a, 2)] {
            let (found, _) = integrated(&series, &[], 0.01, order);
            // What the cut takes of the slower tone; at the ends, where the mean of a cut motion is not zero, it is more.
            let inside = 200..1800;
            let left = error(&found[inside.clone()], &x[inside]);
            assert!(left < 0.05, "order {order}: {left}");
        }
    }

    #[test]
    fn a_motion_from_well_to_well_is_the_integral_of_its_velocity() {
        // Two wells, of which each holds the motion for far longer than a period within it.
        let (n, interval, w) = (4000, 0.01, TAU * 2.0);
        let at = |k: usize| k as f64 * interval;
        let turn = |t: f64| (4.0 * (TAU * 0.03 * t).sin()).tanh();
        let x: Vec<f64> = (0..n).map(|k| turn(at(k)) + 0.2 * (w * at(k)).sin()).collect();
        let small = 1e-5;
        let slope = |t: f64| (turn(t + small) - turn(t - small)) / (2.0 * small);
        let v: Vec<f64> = (0..n).map(|k| slope(at(k)) + 0.2 * w * (w * at(k)).cos()).collect();
        let about = about_mean(&x);
        let found = error(&integral(&v, interval), &about);
        assert!(found < 1e-4, "{found}");
        let (cut, _) = integrated(&v, &[], interval, 1);
        assert!(error(&cut, &about) > 0.1, "the cut estimate holds it too");
    }

    #[test]
    fn offset_and_noise_of_an_accelerometer_do_not_carry_the_displacement_away() {
        use rand::SeedableRng as _;
        use rand_distr::{Distribution as _, Normal};
        let [x, _, a] = motion(20_000, 0.01);
        let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
        let noise = Normal::new(0.0, 2.0).unwrap();
        let shown: Vec<f64> = a.iter().map(|a| a + 30.0 + noise.sample(&mut rng)).collect();
        let (found, _) = integrated(&shown, &[], 0.01, 2);
        assert!(error(&found, &x) < 0.05, "{}", error(&found, &x));
    }

    #[test]
    fn the_response_to_a_sample_is_what_the_estimate_changes_by() {
        let (n, at, size) = (2000, 1000, 1e-6);
        let [_, v, a] = motion(n, 0.01);
        for (mut series, order) in [(v, 1), (a, 2)] {
            let (before, _) = integrated(&series, &[], 0.01, order);
            let one = response(&series, &[], 0.01, order);
            series[at] += size;
            let (after, _) = integrated(&series, &[], 0.01, order);
            let reach = one.len() / 2;
            let changed = |k: usize| (after[at + k - reach] - before[at + k - reach]) / size;
            let largest = one.iter().fold(0.0_f64, |top, r| top.max(r.abs()));
            let off = (0..one.len()).map(|k| (changed(k) - one[k]).abs()).fold(0.0, f64::max);
            assert!(off < 0.05 * largest, "order {order}: {off} of {largest}");
            // It has all but died away where it ends.
            let end = one[0].abs().max(one[2 * reach].abs());
            assert!(end < 0.1 * largest, "order {order}: {end} of {largest}");
        }
    }

    #[test]
    fn units_are_integrated_too() {
        for (unit, order, expected) in
            [("mm/s", 1, "mm"), ("m/s^2", 2, "m"), ("V", 2, "V s^2"), ("", 1, ""), ("rad/s²", 2, "rad")]
        {
            assert_eq!(displacement_unit(unit, order), expected);
        }
    }
}
