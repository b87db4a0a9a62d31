use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::*;
use crate::Contact;
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::Term;

const FRICTION: f64 = 0.0856;
const STIFFNESS: f64 = 358.706;
const DAMPING: f64 = 0.0658;

fn equation(terms: &[(&str, f64)]) -> Equation {
    Equation::known(terms.iter().map(|(text, c)| (Term::parse(text).unwrap(), *c)))
}

fn oscillator(terms: &[(&str, f64)], inputs: usize) -> Plant {
    Plant::smooth(Model::second_order(inputs, vec![equation(terms)]))
}

fn rubbing(velocity: &str, strength: f64, holding_ratio: f64) -> Plant {
    let terms = [("x", -STIFFNESS), ("v", -DAMPING), ("u", STIFFNESS), ("du", DAMPING)];
    let contact = Contact { holding_ratio, ..Contact::coulomb(Term::parse(velocity).unwrap(), 1, strength) };
    Plant { contacts: vec![contact], ..oscillator(&terms, 1) }
}

fn every(interval: f64, duration: f64) -> SampleTimes {
    let count = (duration / interval).round() as usize + 1;
    SampleTimes { start: 0.0, interval, count }
}

/// One classical Runge–Kutta step.
fn rk4<const N: usize>(rate: &impl Fn(f64, &[f64; N]) -> [f64; N], t: f64, y: &[f64; N], h: f64) -> [f64; N] {
    let along = |k: &[f64; N], h: f64| std::array::from_fn(|i| y[i] + h * k[i]);
    let a = rate(t, y);
    let b = rate(t + 0.5 * h, &along(&a, 0.5 * h));
    let c = rate(t + 0.5 * h, &along(&b, 0.5 * h));
    let d = rate(t + h, &along(&c, h));
    std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
}

/// The largest distance of a sampled state from a reference.
fn distance(series: &[f64], reference: impl Fn(usize) -> f64) -> f64 {
    series.iter().enumerate().map(|(k, x)| (x - reference(k)).abs()).fold(0.0, f64::max)
}

#[test]
fn dry_friction_alone_takes_the_same_from_every_half_cycle() {
    // Between stops x = ±F/ω² + A cos ωt, A falling by 2F/ω² each half period π/ω; at rest once |x| ≤ F/ω².
    let omega: f64 = 6.0;
    let (strength, released) = (0.5, 0.2);
    let band = strength / omega.powi(2);
    let mut plant = oscillator(&[("x", -omega * omega)], 0);
    plant.contacts = vec![Contact::coulomb(Term::parse("v").unwrap(), 1, strength)];
    let sampling = every(0.01, 6.0);
    let response = respond(&plant, &[], &[released, 0.0], &sampling).unwrap();
    let half_cycles = ((released - band) / (2.0 * band)).ceil();
    let exact = |k: usize| {
        let t = sampling.time(k);
        let n = (t * omega / PI).floor().min(half_cycles);
        let sign = if n % 2.0 == 0.0 { 1.0 } else { -1.0 };
        let turned = sign * (released - 2.0 * n * band);
        if n < half_cycles { sign * band + (turned - sign * band) * (omega * t - n * PI).cos() } else { turned }
    };
    // The tolerance of a step, 1e-11 of 0.2 m, over some tens of steps.
    assert!(distance(&response.states[0], exact) < 2e-11, "{}", distance(&response.states[0], exact));
    let [stop] = response.stops[..] else { panic!("{:?}", response.stops) };
    assert!((stop.from - half_cycles * PI / omega).abs() < 1e-10, "{stop:?}");
    assert_eq!(stop.to, f64::INFINITY);
    assert_eq!(response.states[1].last(), Some(&0.0));
}

#[test]
fn a_linear_mass_follows_its_base_as_transmissibility_says() {
    let (k, c) = (STIFFNESS, 2.0);
    let plant = oscillator(&[("x", -k), ("v", -c), ("u", k), ("du", c)], 1);
    for frequency in [2.013, 3.0, 5.243] {
        let omega = TAU * frequency;
        // The transient is e⁻³⁰ of what it was.
        let sampling = SampleTimes { start: 30.0, interval: 1e-3, count: 2000 };
        let response = respond(&plant, &[Excitation::harmonic(1.0, frequency)], &[0.0, 0.0], &sampling).unwrap();
        let (real, imaginary) = (k - omega * omega, c * omega);
        let gain = ((k * k + imaginary * imaginary) / (real * real + imaginary * imaginary)).sqrt();
        let lag = imaginary.atan2(real) - imaginary.atan2(k);
        let exact = |j: usize| gain * (omega * sampling.time(j) - lag).cos();
        let error = distance(&response.states[0], exact);
        assert!(error < 1e-9 * gain, "{frequency} Hz: {error}");
    }
}

#[test]
fn a_duffing_oscillator_moves_as_small_fixed_steps_say() {
    let plant = oscillator(&[("x", -1.0), ("v", -0.2), ("x^3", -0.6), ("u", 1.0)], 1);
    let sampling = every(0.1, 70.0);
    let omega = 1.2;
    let response = respond(&plant, &[Excitation::harmonic(1.0, omega / TAU)], &[0.0, 0.0], &sampling).unwrap();
    let rate = |t: f64, y: &[f64; 2]| [y[1], (omega * t).cos() - 0.2 * y[1] - y[0] - 0.6 * y[0].powi(3)];
    let mut state = [0.0; 2];
    let mut reference = vec![0.0];
    for k in 0..70_000 {
        state = rk4(&rate, 1e-3 * f64::from(k), &state, 1e-3);
        if k % 100 == 99 {
            reference.push(state[0]);
        }
    }
    // Steps of 1e-3 s err by about (1e-3)⁴ in all.
    let error = distance(&response.states[0], |k| reference[k]);
    assert!(error < 1e-10, "{error}");
}

#[test]
fn an_undamped_oscillator_keeps_its_energy() {
    let plant = oscillator(&[("x", -1.0), ("x^3", -0.6)], 0);
    let response = respond(&plant, &[], &[1.5, 0.0], &every(0.05, 200.0)).unwrap();
    let energy = |x: f64, v: f64| 0.5 * v * v + 0.5 * x * x + 0.15 * x.powi(4);
    let begun = energy(1.5, 0.0);
    for (x, v) in response.states[0].iter().zip(&response.states[1]) {
        // Some thousand steps of 1e-11 each, all of one sign at worst.
        assert!((energy(*x, *v) / begun - 1.0).abs() < 1e-9, "{x} {v}");
    }
}

#[test]
fn the_lorenz_system_moves_as_small_fixed_steps_say() {
    let plant = Plant::smooth(Model::first_order(
        0,
        vec![
            equation(&[("x1", -10.0), ("x2", 10.0)]),
            equation(&[("x1", 28.0), ("x2", -1.0), ("x1*x3", -1.0)]),
            equation(&[("x1*x2", 1.0), ("x3", -8.0 / 3.0)]),
        ],
    ));
    let begun = [-8.0, 8.0, 27.0];
    let response = respond(&plant, &[], &begun, &every(0.05, 4.0)).unwrap();
    let rate =
        |_: f64, y: &[f64; 3]| [10.0 * (y[1] - y[0]), 28.0 * y[0] - y[1] - y[0] * y[2], y[0] * y[1] - 8.0 / 3.0 * y[2]];
    let mut state = begun;
    let mut reference = vec![state];
    for k in 0..40_000 {
        state = rk4(&rate, 0.0, &state, 1e-4);
        if k % 500 == 499 {
            reference.push(state);
        }
    }
    for (i, series) in response.states.iter().enumerate() {
        // A step errs by 1e-11 of 40; neighbouring motions part as e^(0.9 t) on the whole, faster for a while.
        let error = distance(series, |k| reference[k][i]);
        assert!(error < 1e-7, "{error}");
    }
}

#[test]
fn base_excited_friction_moves_as_small_steps_between_reversals_say() {
    let frequency = 4.611;
    let base = Excitation::harmonic(2.5e-3, frequency);
    let sampling = every(0.01, 4.0);
    let plant = rubbing("v", FRICTION, 1.0);
    let response = respond(&plant, std::slice::from_ref(&base), &[0.005, 0.0], &sampling).unwrap();
    assert!(response.stops.iter().all(|s| s.to == s.from), "{:?}", response.stops);

    let mut sign = -1.0;
    let mut state = [0.005, 0.0];
    let mut reference = vec![state[0]];
    let h = 5e-5;
    for k in 0..80_000 {
        let t = h * f64::from(k);
        let rate = |sign: f64| {
            let base = &base;
            move |t: f64, y: &[f64; 2]| {
                let [u, du, _] = base.at(t).0;
                [y[1], STIFFNESS * (u - y[0]) + DAMPING * (du - y[1]) - FRICTION * sign]
            }
        };
        let mut next = rk4(&rate(sign), t, &state, h);
        if sign * next[1] < 0.0 {
            let (mut short, mut long) = (0.0, h);
            for _ in 0..60 {
                let middle = 0.5 * (short + long);
                if sign * rk4(&rate(sign), t, &state, middle)[1] > 0.0 { short = middle } else { long = middle }
            }
            let turned = rk4(&rate(sign), t, &state, long);
            sign = -sign;
            next = rk4(&rate(sign), t + long, &turned, h - long);
        }
        state = next;
        if k % 200 == 199 {
            reference.push(state[0]);
        }
    }
    // A billionth of the 4 mm motion.
    let error = distance(&response.states[0], |k| reference[k]);
    assert!(error < 4e-12, "{error}");
}

#[test]
fn a_stuck_mass_rests_exactly_until_the_force_exceeds_what_holds() {
    for ratio in [1.0, 1.3] {
        let strength = 0.4;
        let base = Excitation::harmonic(2.5e-3, 0.9).fading_in(1.7);
        let sampling = every(1e-3, 10.0);
        let plant = rubbing("v", strength, ratio);
        let response = respond(&plant, std::slice::from_ref(&base), &[0.0, 0.0], &sampling).unwrap();
        assert!(response.stops.len() > 10, "{:?}", response.stops);
        let [x, v] = &response.states[..] else { panic!("two states") };
        for stop in &response.stops {
            let inside: Vec<usize> =
                (0..x.len()).filter(|k| sampling.time(*k) > stop.from && sampling.time(*k) < stop.to).collect();
            let Some(first) = inside.first() else { continue };
            assert!(inside.iter().all(|k| v[*k] == 0.0 && x[*k] == x[*first]), "{stop:?}");
            let force = |t: f64| {
                let [u, du, _] = base.at(t).0;
                STIFFNESS * (u - x[*first]) + DAMPING * du
            };
            assert!(inside.iter().all(|k| force(sampling.time(*k)).abs() < ratio * strength));
            if stop.to.is_finite() {
                assert!((force(stop.to).abs() / (ratio * strength) - 1.0).abs() < 1e-12, "{stop:?}");
                // What follows goes the way of the force.
                let next = inside.last().unwrap() + 2;
                assert!(v[next] * force(stop.to) > 0.0, "{stop:?}");
            }
        }
        let moving = (0..x.len()).filter(|k| {
            let t = sampling.time(*k);
            response.stops.iter().all(|s| t < s.from || t > s.to)
        });
        assert!(moving.clone().count() > 1000);
        assert!(moving.into_iter().all(|k| v[k] != 0.0));
    }
}

#[test]
fn a_joint_that_never_slips_carries_the_mass_along() {
    // The base's acceleration is at most 2.5e-3 × (2π × 2)² = 0.39 m/s².
    let base = Excitation::harmonic(2.5e-3, 2.0).fading_in(1.0);
    let sampling = every(0.01, 5.0);
    let response = respond(&rubbing("v-du", 1.0, 1.0), std::slice::from_ref(&base), &[0.0, 0.0], &sampling).unwrap();
    // A billionth of the motion.
    assert!(distance(&response.states[0], |k| base.at(sampling.time(k)).0[0]) < 2.5e-12);
    assert_eq!(response.stops.len(), 1);
}

#[test]
fn two_masses_that_rub_end_at_one_velocity() {
    let both = Model::second_order(0, vec![equation(&[]), equation(&[])]);
    let contact =
        Contact { acts_on: vec![(2, 1.0), (3, -0.5)], ..Contact::coulomb(Term::parse("v1-v2").unwrap(), 2, 2.0) };
    let plant = Plant { smooth: both, contacts: vec![contact] };
    // Masses 1 and 2: 2 m/s² slow the first, 1 m/s² speeds the second; they meet at 1/3 m/s after 1/3 s.
    let response = respond(&plant, &[], &[0.0, 0.0, 1.0, 0.0], &every(0.01, 1.0)).unwrap();
    let [stop] = response.stops[..] else { panic!("{:?}", response.stops) };
    assert!((stop.from - 1.0 / 3.0).abs() < 1e-12, "{stop:?}");
    for series in &response.states[2..] {
        assert!((series.last().unwrap() - 1.0 / 3.0).abs() < 1e-12);
    }
}

#[test]
fn a_kinked_spring_has_the_period_of_its_halves() {
    // Stiffness 4 on one side of zero, 1 on the other: half periods π/2 and π.
    let plant = oscillator(&[("x", -2.5), ("|x|", -1.5)], 0);
    let sampling = SampleTimes { start: 0.0, interval: 0.75 * PI, count: 41 };
    let response = respond(&plant, &[], &[0.0, 1.0], &sampling).unwrap();
    // Every second sample ends a period of 3π/2.
    for k in (0..41).step_by(2) {
        let error = response.states[0][k].abs() + (response.states[1][k] - 1.0).abs();
        assert!(error < 1e-9, "{k}: {error}");
    }
    let quarter = SampleTimes { start: 0.0, interval: 0.25 * PI, count: 2 };
    let stretched = respond(&plant, &[], &[0.0, 1.0], &quarter).unwrap().states[0][1];
    assert!((stretched - 0.5).abs() < 1e-11, "{stretched}");
    let pushed = respond(&plant, &[], &[0.0, -1.0], &SampleTimes { interval: FRAC_PI_2, ..quarter }).unwrap();
    assert!((pushed.states[0][1] + 1.0).abs() < 1e-11, "the kink's sign at the start is found");
}

#[test]
fn a_mass_that_reaches_its_stop_rebounds_from_a_dead_zone() {
    // Free flight to the gap's edge at 1, half a cycle against a spring of 100, and back.
    let plant = oscillator(&[("dz(x,1)", -100.0)], 0);
    let sampling = every(0.01, 1.0 + PI / 10.0 + 1.5);
    let response = respond(&plant, &[], &[0.0, 1.0], &sampling).unwrap();
    let exact = |k: usize| {
        let t = sampling.time(k);
        match t {
            t if t < 1.0 => t,
            t if t < 1.0 + PI / 10.0 => 1.0 + 0.1 * (10.0 * (t - 1.0)).sin(),
            t => 1.0 - (t - 1.0 - PI / 10.0),
        }
    };
    assert!(distance(&response.states[0], exact) < 1e-10, "{}", distance(&response.states[0], exact));
}

#[test]
fn a_motion_without_bound_is_an_error_that_says_when() {
    let plant = oscillator(&[("x^3", 1.0)], 0);
    let error = respond(&plant, &[], &[1.0, 0.0], &every(0.1, 10.0)).unwrap_err();
    // ẍ = x³ from rest at 1 grows to infinity in √2 ∫₁^∞ dx/√(x⁴ − 1) = 1.854 s.
    let RigError::Unbounded { time } = error else { panic!("{error}") };
    assert!((time - 1.854).abs() < 1e-3, "{time}");
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let plant = rubbing("v", 1.0, 1.0);
    let sampling = every(0.1, 1.0);
    let error = respond(&plant, &[], &[0.0, 0.0], &sampling).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the plant has 2 states and 1 inputs, but 2 initial values and 0 excitations were given"
    );
    assert!(respond(&plant, &[Excitation::rest()], &[0.0], &sampling).is_err());
}

#[test]
fn friction_becomes_a_term_of_the_truth() {
    let truth = rubbing("v-du", 0.3, 1.0).truth();
    let friction = Term::parse("sgn(v-du)").unwrap();
    assert_eq!(truth.leading().unwrap().coefficient(&friction), Some(-0.3));
}
