use std::f64::consts::TAU;

use differential_equations::prelude::*;
use proptest::prelude::*;

use super::{
    InputGrid, Limits, Output, Response, RunTask, Simulator, Workspace, Workspaces, fit_initial_state, run_beside,
};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::Term;

fn equation(terms: &[(&str, f64)]) -> Equation {
    Equation::known(terms.iter().map(|(text, c)| (Term::parse(text).unwrap(), *c)))
}

fn second(inputs: usize, accelerations: &[&[(&str, f64)]]) -> Simulator {
    let equations = accelerations.iter().map(|a| equation(a)).collect();
    Simulator::new(&Model::second_order(inputs, equations)).unwrap()
}

fn free(interval: f64, samples: usize) -> InputGrid {
    InputGrid::new(0.0, interval, samples, &[], None)
}

fn sampled(interval: f64, samples: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..samples).map(|k| f(k as f64 * interval)).collect()
}

fn all(simulator: &Simulator, grid: &InputGrid, initial: &[f64]) -> Response {
    simulator.run(grid, initial, 0..grid.len(), &Limits::default())
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

struct System<F>(F);

impl<F: Fn(f64, &[f64; 2]) -> f64> ODE<f64, [f64; 2]> for System<F> {
    fn diff(&self, t: f64, y: &[f64; 2], dydt: &mut [f64; 2]) {
        *dydt = [y[1], self.0(t, y)];
    }
}

/// The displacement by another integrator, at the samples.
fn dop853(acceleration: impl Fn(f64, &[f64; 2]) -> f64, initial: [f64; 2], interval: f64, samples: usize) -> Vec<f64> {
    let system = System(acceleration);
    let end = interval * (samples - 1) as f64;
    let solution = IVP::ode(&system, 0.0, end, initial)
        .even(interval)
        // Short steps: the dense output that gives the samples is less accurate than the steps.
        .method(ExplicitRungeKutta::dop853().rtol(1e-13).atol(1e-13).max_steps(10_000_000).h_max(0.01))
        .solve()
        .unwrap();
    let mut x: Vec<f64> = solution.y.iter().map(|y| y[0]).collect();
    x.truncate(samples);
    assert_eq!(x.len(), samples);
    x
}

/// Dry friction on one mass by steps of a hundredth of an interval, each divided by bisection where the motion stops or
/// breaks loose: slow, and shares nothing with the room.
fn friction_reference(
    force: impl Fn(f64, f64, f64) -> f64,
    friction: f64,
    initial: [f64; 2],
    interval: f64,
    samples: usize,
) -> Vec<f64> {
    let step = |t: f64, y: [f64; 2], s: f64, h: f64| {
        let f = |t: f64, y: [f64; 2]| [y[1], force(t, y[0], y[1]) - friction * s];
        let add = |a: [f64; 2], k: [f64; 2], h: f64| [a[0] + h * k[0], a[1] + h * k[1]];
        let k1 = f(t, y);
        let k2 = f(t + h / 2.0, add(y, k1, h / 2.0));
        let k3 = f(t + h / 2.0, add(y, k2, h / 2.0));
        let k4 = f(t + h, add(y, k3, h));
        [0, 1].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    };
    let bisect = |crossed: &dyn Fn(f64) -> bool, h: f64| {
        let (mut low, mut high) = (0.0, h);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if crossed(middle) { high = middle } else { low = middle }
        }
        high
    };
    let (mut y, mut s) = (initial, initial[1].signum());
    if initial[1] == 0.0 {
        s = if force(0.0, y[0], 0.0).abs() > friction { force(0.0, y[0], 0.0).signum() } else { 0.0 };
    }
    let mut out = vec![y[0]];
    let fine = 100;
    for k in 0..(samples - 1) * fine {
        let mut t = k as f64 * interval / f64::from(fine as u32);
        let end = (k + 1) as f64 * interval / f64::from(fine as u32);
        while end - t > 1e-15 {
            let h = end - t;
            if s == 0.0 {
                let loose = |tau: f64| force(t + tau, y[0], 0.0).abs() > friction;
                if !loose(h) {
                    break;
                }
                t += bisect(&loose, h);
                s = force(t, y[0], 0.0).signum();
            } else {
                let next = step(t, y, s, h);
                if next[1] * s >= 0.0 {
                    y = next;
                    break;
                }
                let tau = bisect(&|tau| step(t, y, s, tau)[1] * s < 0.0, h);
                y = [step(t, y, s, tau)[0], 0.0];
                t += tau;
                let push = force(t, y[0], 0.0);
                s = if push.abs() > friction { push.signum() } else { 0.0 };
            }
        }
        if (k + 1) % fine == 0 {
            out.push(y[0]);
        }
    }
    out
}

/// Free decay with Coulomb friction: half sines about displaced centres, at rest once the spring cannot pull it loose.
fn coulomb_decay(omega: f64, friction: f64, amplitude: f64, t: f64) -> f64 {
    let shift = friction / (omega * omega);
    let half = std::f64::consts::PI / omega;
    let mut start = amplitude;
    let mut t = t;
    loop {
        if start.abs() <= shift {
            return start;
        }
        let centre = shift * start.signum();
        if t < half {
            return centre + (start - centre) * (omega * t).cos();
        }
        start = 2.0 * centre - start;
        t -= half;
    }
}

#[test]
fn samples_tell_what_a_smooth_input_does_between_them_and_nothing_of_a_rough_one() {
    let smooth: Vec<f64> = (0..400).map(|k| (0.7 * f64::from(k)).sin()).collect();
    // A generator of small numbers, as rough as noise.
    let rough: Vec<f64> = (0..400_u64).map(|k| ((k * k * 7919 + 104_729 * k) % 1009) as f64 / 504.5 - 1.0).collect();
    let grid = |u: &[f64]| InputGrid::new(1.0, 0.5, u.len(), &[u], None);
    let differs = |u: &[f64]| {
        let (spline, other) = (grid(u), grid(u).other_course(4).unwrap());
        assert_eq!((other.len(), other.interval()), (399 * 4 + 1, 0.125));
        let gap = |k: usize| (spline.at(0, other.time(k))[0] - other.at(0, other.time(k))[0]).abs();
        assert!((0..400).all(|k| gap(4 * k) < 1e-9), "both go through the samples");
        (40..4 * 390).map(gap).fold(0.0, f64::max)
    };
    // Nine samples a period, and two.
    assert!(differs(&smooth) < 3e-3 && differs(&rough) > 0.1, "{} {}", differs(&smooth), differs(&rough));
    // Whose derivative was measured is not bent.
    assert!(InputGrid::new(0.0, 0.5, 400, &[&smooth], Some(&[&rough])).other_course(4).is_none());
}

#[test]
fn coulomb_decay_is_exact_down_to_the_final_stick() {
    let (omega, friction, interval, n) = (18.94, 0.0856, 1e-3, 8000);
    let simulator = second(0, &[&[("x", -omega * omega), ("sgn(v)", -friction)]]);
    let response = all(&simulator, &free(interval, n), &[0.005, 0.0]);
    let exact = sampled(interval, n, |t| coulomb_decay(omega, friction, 0.005, t));
    // Truncation of the fourth-order steps: (ωh)⁵/120 of the amplitude each, over 3000 steps.
    assert!(worst(&response.states[0], &exact) < 1e-10, "{:e}", worst(&response.states[0], &exact));
    assert_eq!(response.states[1].last(), Some(&0.0), "at rest");
    assert_eq!(response.sticks.len(), 1);
    // Amplitude falls by twice the shift each half period; the last half swing ends within the shift.
    let shift = friction / (omega * omega);
    let halves = ((0.005 - shift) / (2.0 * shift)).ceil();
    let stop = halves * std::f64::consts::PI / omega;
    assert!((response.sticks[0].from - stop).abs() < 1e-8, "{} {stop}", response.sticks[0].from);
}

#[test]
fn order_four_survives_the_switches() {
    let (omega, friction) = (18.94, 0.0856);
    let simulator = second(0, &[&[("x", -omega * omega), ("sgn(v)", -friction)]]);
    let error = |interval: f64, n: usize| {
        // An infinite tolerance keeps the coarsest level.
        let limits = Limits { tolerance: f64::INFINITY, ..Limits::default() };
        let response = simulator.run(&free(interval, n), &[0.005, 0.0], 0..n, &limits);
        let exact = sampled(interval, n, |t| coulomb_decay(omega, friction, 0.005, t));
        worst(&response.states[0], &exact)
    };
    let (coarse, middle, fine) = (error(0.012, 120), error(0.006, 240), error(0.003, 480));
    assert!(coarse / middle > 12.0 && middle / fine > 12.0, "{coarse:e} {middle:e} {fine:e}");
}

#[test]
fn base_excited_friction_as_an_independent_integrator_has_it() {
    let (k, c) = (358.706, 0.0658);
    // Continuous motion as in the report; stick-slip with forty times the friction.
    for (friction, amplitude, sticks) in [(0.0856, 0.0025, false), (0.6, 0.0025, true), (0.9, 0.003, true)] {
        let u = |t: f64| amplitude * ((TAU * 2.013 * t).sin() + 0.5 * (TAU * 4.611 * t).sin());
        let du = |t: f64| amplitude * TAU * (2.013 * (TAU * 2.013 * t).cos() + 0.5 * 4.611 * (TAU * 4.611 * t).cos());
        let (interval, n) = (1e-3, 6000);
        let simulator = second(1, &[&[("x", -k), ("v", -c), ("sgn(v)", -friction), ("u", k), ("du", c)]]);
        let grid = InputGrid::new(0.0, interval, n, &[&sampled(interval, n, u)], None);
        let response = all(&simulator, &grid, &[0.0, 0.0]);
        let reference =
            friction_reference(|t, x, v| k * (u(t) - x) + c * (du(t) - v), friction, [0.0, 0.0], interval, n);
        let error = worst(&response.states[0], &reference);
        // Displacements are some 1e-2 m; the reference itself is good to 1e-12.
        assert!(error < 2e-10, "friction {friction}: {error:e}");
        assert_eq!(response.sticks.len() > 5, sticks, "{}", response.sticks.len());
    }
}

#[test]
fn friction_against_a_moving_base_sticks_to_it() {
    let (k, c, friction) = (300.0, 0.5, 0.6);
    let (a, w) = (0.02, TAU * 1.3);
    let u = |t: f64| a * (1.0 - (w * t).cos());
    let (interval, n) = (2e-3, 3000);
    let simulator = second(1, &[&[("x-u", -k), ("v-du", -c), ("sgn(v-du)", -friction)]]);
    let grid = InputGrid::new(0.0, interval, n, &[&sampled(interval, n, u)], None);
    let response = all(&simulator, &grid, &[0.0, 0.0]);
    let ddu = |t: f64| a * w * w * (w * t).cos();
    let relative = friction_reference(|t, z, dz| -k * z - c * dz - ddu(t), friction, [0.0, 0.0], interval, n);
    let z: Vec<f64> = response.states[0].iter().enumerate().map(|(i, x)| x - u(i as f64 * interval)).collect();
    let error = worst(&z, &relative);
    assert!(response.sticks.len() > 3, "{}", response.sticks.len());
    // While it sticks the relative displacement is kept by the spline's accuracy alone.
    assert!(error < 1e-9, "{error:e}");
}

#[test]
fn rest_below_the_friction_limit_stays_rest() {
    let simulator = second(1, &[&[("x", -100.0), ("sgn(v)", -1.0), ("u", 1.0)]]);
    let u = sampled(1e-2, 500, |t| 0.9 * (3.0 * t).sin());
    let grid = InputGrid::new(0.0, 1e-2, 500, &[&u], None);
    let response = all(&simulator, &grid, &[0.0, 0.0]);
    assert!(response.states[0].iter().all(|x| *x == 0.0));
    assert_eq!((response.sticks.len(), response.switches), (1, 0));
    assert_eq!((response.sticks[0].from, response.sticks[0].to), (0.0, 4.99));
}

#[test]
fn two_contacts_stick_and_slip_as_by_time_stepping() {
    let (k, c, f1, f2) = (200.0, 0.3, 0.8, 0.5);
    let force = |t: f64| 2.0 * (TAU * 1.1 * t).sin() + (TAU * 2.7 * t).sin();
    let (interval, n) = (2e-3, 2500);
    let first: &[(&str, f64)] =
        &[("x1", -2.0 * k), ("x2", k), ("v1", -2.0 * c), ("v2", c), ("sgn(v1)", -f1), ("u", 1.0)];
    let other: &[(&str, f64)] = &[("x2", -k), ("x1", k), ("v2", -c), ("v1", c), ("sgn(v2)", -f2)];
    let simulator = second(1, &[first, other]);
    let grid = InputGrid::new(0.0, interval, n, &[&sampled(interval, n, force)], None);
    let response = all(&simulator, &grid, &[0.0; 4]);
    // Moreau's time stepping: friction takes at most its impulse from each velocity.
    let fine = 2000;
    let h = interval / f64::from(fine);
    let (mut x, mut v, mut reference) = ([0.0; 2], [0.0; 2], vec![vec![0.0], vec![0.0]]);
    for step in 0..(n as u32 - 1) * fine {
        let t = (f64::from(step) + 0.5) * h;
        let xm = [x[0] + 0.5 * h * v[0], x[1] + 0.5 * h * v[1]];
        let a = [
            -2.0 * k * xm[0] + k * xm[1] - 2.0 * c * v[0] + c * v[1] + force(t),
            -k * xm[1] + k * xm[0] - c * v[1] + c * v[0],
        ];
        for (i, f) in [f1, f2].into_iter().enumerate() {
            let pushed = v[i] + h * a[i];
            v[i] = pushed.signum() * (pushed.abs() - h * f).max(0.0);
            x[i] = xm[i] + 0.5 * h * v[i];
        }
        if (step + 1) % fine == 0 {
            reference[0].push(x[0]);
            reference[1].push(x[1]);
        }
    }
    let amplitude = reference[0].iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    for (i, reference) in reference.iter().enumerate() {
        let error = worst(&response.states[i], reference);
        // The reference is of first order: its step is 1e-6 s.
        assert!(error < 1e-5 * amplitude, "{i}: {error:e} of {amplitude:e}");
    }
    let both = |t: f64| (0..2).all(|k| response.sticks.iter().any(|s| s.surface == k && s.from < t && t < s.to));
    assert!((0..n).any(|k| both(interval * k as f64)), "both stick at once somewhere");
}

#[test]
fn a_joint_between_masses_sticks_with_one_of_them() {
    // Two free masses, a joint between them and the first one's contact to the ground: all signs act on both.
    let first: &[(&str, f64)] = &[("x1", -50.0), ("sgn(v1-v2)", -1.0), ("sgn(v1)", -0.7), ("u", 1.0)];
    let other: &[(&str, f64)] = &[("x2", -50.0), ("sgn(v1-v2)", 1.0)];
    let simulator = second(1, &[first, other]);
    let u = sampled(5e-3, 2000, |t| 1.5 * (2.0 * t).sin());
    let grid = InputGrid::new(0.0, 5e-3, 2000, &[&u], None);
    let response = all(&simulator, &grid, &[0.0; 4]);
    assert_eq!(response.len(), 2000);
    for stick in &response.sticks {
        for k in (0..2000).filter(|k| {
            let t = 5e-3 * f64::from(*k);
            stick.from + 1e-9 < t && t < stick.to - 1e-9
        }) {
            let (v1, v2) = (response.states[2][k as usize], response.states[3][k as usize]);
            let g = simulator.surfaces().nth(stick.surface).unwrap().value(&|s| match s {
                sindyscope_values::term::Symbol::Rate(0) => v1,
                _ => v2,
            });
            assert!(g.abs() < 1e-12, "{g:e} at {k}");
        }
    }
}

#[test]
fn duffing_agrees_with_dop853() {
    let (interval, n) = (0.01, 6000);
    let force = |t: f64| (1.2 * t).cos();
    let simulator = second(1, &[&[("v", -0.2), ("x", -1.0), ("x^3", -0.6), ("u", 1.0)]]);
    let grid = InputGrid::new(0.0, interval, n, &[&sampled(interval, n, force)], None);
    let response = all(&simulator, &grid, &[0.1, 0.0]);
    let reference = dop853(|t, y| force(t) - 0.2 * y[1] - y[0] - 0.6 * y[0].powi(3), [0.1, 0.0], interval, n);
    // The default tolerance, spent on each of the 1000 samples that the damping remembers.
    assert!(worst(&response.states[0], &reference) < 5e-8, "{:e}", worst(&response.states[0], &reference));
    let limits = Limits { tolerance: 1e-12, ..Limits::default() };
    let response = simulator.run(&grid, &[0.1, 0.0], 0..n, &limits);
    assert!(worst(&response.states[0], &reference) < 1e-10, "{:e}", worst(&response.states[0], &reference));
}

#[test]
fn smooth_and_kinked_springs_agree_with_dop853() {
    let (interval, n) = (0.02, 2000);
    type Case = (&'static [(&'static str, f64)], fn(f64, &[f64; 2]) -> f64);
    let cases: [Case; 5] = [
        (&[("sin(x)", -9.81), ("v", -0.05)], |_, y| -9.81 * y[0].sin() - 0.05 * y[1]),
        (&[("x", -4.0), ("dz(x,0.5)", -40.0), ("v", -0.05)], |_, y| {
            let dz = y[0] - y[0].clamp(-0.5, 0.5);
            -4.0 * y[0] - 40.0 * dz - 0.05 * y[1]
        }),
        (&[("x", -9.0), ("v*|v|", -0.2)], |_, y| -9.0 * y[0] - 0.2 * y[1] * y[1].abs()),
        (&[("x*|x|", -9.0), ("x", -0.2)], |_, y| -9.0 * y[0] * y[0].abs() - 0.2 * y[0]),
        // A hinge and a term in time.
        (&[("max(x,0)", -30.0), ("x", -4.0), ("sin(t)", 1.0)], |t, y| -30.0 * y[0].max(0.0) - 4.0 * y[0] + t.sin()),
    ];
    for (terms, acceleration) in cases {
        let simulator = second(0, &[terms]);
        let response = all(&simulator, &free(interval, n), &[1.5, 0.0]);
        let error = worst(&response.states[0], &dop853(acceleration, [1.5, 0.0], interval, n));
        // The tolerance on each of 2000 samples, errors of phase adding up where hardly anything damps.
        assert!(error < 2e-6, "{terms:?}: {error:e}, {} steps", response.steps);
    }
}

#[test]
fn energy_of_an_undamped_oscillator_stays() {
    // Nine samples a period: the step has to be divided.
    let omega = 0.7;
    let simulator = second(0, &[&[("x", -omega * omega)]]);
    let response = all(&simulator, &free(1.0, 10_000), &[1.0, 0.0]);
    let energy = |k: usize| (omega * response.states[0][k]).powi(2) + response.states[1][k].powi(2);
    let drift = (energy(9_999) / energy(0) - 1.0).abs();
    // The tolerance on each of 10 000 samples; the displacement also bears the velocity's share, 1/0.7 of it.
    assert!(drift < 1e-5, "{drift:e}");
    assert!(response.steps > 20_000 && !response.coarse);
    let exact = sampled(1.0, 10_000, |t| (omega * t).cos());
    assert!(worst(&response.states[0], &exact) < 2e-5, "{:e}", worst(&response.states[0], &exact));
}

#[test]
fn a_stiff_spring_is_stepped_finely_and_an_impossible_one_is_said_so() {
    let simulator = second(0, &[&[("x", -1e4), ("v", -200.0)]]);
    let response = all(&simulator, &free(0.02, 200), &[1.0, 0.0]);
    let exact = sampled(0.02, 200, |t| (1.0 + 100.0 * t) * (-100.0 * t).exp());
    assert!(worst(&response.states[0], &exact) < 1e-8, "{:e}", worst(&response.states[0], &exact));
    let simulator = second(0, &[&[("x", -1e12), ("v", -1.0)]]);
    let response = all(&simulator, &free(0.02, 200), &[1.0, 0.0]);
    assert!(response.coarse || response.diverged_at.is_some());
}

#[test]
fn signs_of_inputs_and_time_switch_at_their_instants() {
    let simulator = second(1, &[&[("sgn(u)", 1.0), ("step(t-0.505)", 2.0)]]);
    let (interval, n) = (0.01, 200);
    let u = sampled(interval, n, |t| (5.0 * t + 0.3).sin());
    let grid = InputGrid::new(0.0, interval, n, &[&u], None);
    let response = all(&simulator, &grid, &[0.0, 0.0]);
    let mut v = 0.0;
    let fine = 10_000;
    for k in 0..fine {
        let t = 1.99 * (f64::from(k) + 0.5) / f64::from(fine);
        v += 1.99 / f64::from(fine) * ((5.0 * t + 0.3).sin().signum() + if t > 0.505 { 2.0 } else { 0.0 });
    }
    // The sum counts each switch to half of its step.
    assert!((response.states[1][n - 1] - v).abs() < 1e-3, "{} {v}", response.states[1][n - 1]);
    // An input that is zero has the sign zero.
    let zero = vec![0.0; n];
    let response = all(&simulator, &InputGrid::new(0.0, interval, n, &[&zero], None), &[0.0, 0.0]);
    assert!((response.states[1][n - 1] - 2.0 * (1.99 - 0.505)).abs() < 1e-9);
}

#[test]
fn a_reversal_within_one_sample_is_not_lost() {
    // The velocity dips below zero for a tenth of a sample and is pushed on: friction must be seen to reverse.
    let interval = 0.1;
    let (t0, depth) = (0.55, 1e-3);
    let simulator = second(0, &[&[("t", 2.0), ("1", -2.0 * t0), ("sgn(v)", -0.01)]]);
    let start = t0 * t0 - depth;
    let response = all(&simulator, &free(interval, 12), &[0.0, start]);
    assert!(response.switches >= 2, "{}", response.switches);
}

#[test]
fn leaving_the_limits_ends_the_response() {
    let simulator = second(0, &[&[("x", 1.0)]]);
    let limits = Limits { states: &[10.0], ..Limits::default() };
    let response = simulator.run(&free(0.01, 1000), &[1.0, 1.0], 0..1000, &limits);
    let at = response.diverged_at.unwrap();
    assert!((at - 10.0_f64.ln()).abs() < 0.01, "{at}");
    assert_eq!(response.len(), 231);
    assert!(response.states[0].iter().all(|x| x.abs() <= 10.0));
    let blown = second(0, &[&[("x^3", 1.0)]]);
    let response = all(&blown, &free(0.01, 1000), &[1.0, 1.0]);
    assert!(response.diverged_at.is_some_and(|t| t < 3.0));
    assert!(response.states[0].iter().all(|x| x.is_finite()));
    let nothing = simulator.run(&free(0.01, 10), &[f64::NAN, 0.0], 0..10, &Limits::default());
    assert_eq!((nothing.len(), nothing.diverged_at), (0, Some(0.0)));
}

#[test]
fn a_run_is_cancelled_and_a_part_of_a_record_is_run() {
    let simulator = second(1, &[&[("x", -4.0), ("u", 1.0)]]);
    let u = sampled(0.01, 5000, |t| (3.0 * t).sin());
    let grid = InputGrid::new(2.0, 0.01, 5000, &[&u], None);
    let stopped = simulator.run(&grid, &[0.0; 2], 0..5000, &Limits { cancelled: &|| true, ..Limits::default() });
    assert!(stopped.cancelled && stopped.len() == 1);
    let whole = all(&simulator, &grid, &[0.0; 2]);
    let state = [whole.states[0][1000], whole.states[1][1000]];
    let part = simulator.run(&grid, &state, 1000..1500, &Limits::default());
    assert_eq!(part.len(), 500);
    assert!(worst(&part.states[0], &whole.states[0][1000..1500]) < 1e-8);
    assert!(simulator.run(&grid, &state, 6000..7000, &Limits::default()).is_empty());
    assert_eq!(simulator.run(&grid, &state, 4999..9000, &Limits::default()).len(), 1);
}

#[test]
fn memory_may_serve_one_simulator_after_the_other() {
    let a = second(1, &[&[("x", -40.0), ("sgn(v)", -0.3), ("u", 1.0), ("x^3", -1.0)]]);
    let b =
        second(1, &[&[("x*u", -40.0), ("sgn(v-du)", -0.3), ("|x|", -1.0)], &[("x2", -1.0), ("x", 1.0), ("du", 2.0)]]);
    let u = sampled(0.01, 700, |t| (3.0 * t).sin());
    let grid = InputGrid::new(0.0, 0.01, 700, &[&u], None);
    let (mut workspace, mut response) = (Workspace::default(), Response::default());
    for _ in 0..2 {
        for (simulator, start) in [(&a, vec![0.1, 0.0]), (&b, vec![0.1, 0.2, 0.0, 0.0])] {
            simulator.run_into(&grid, &start, 0..700, &Limits::default(), &mut workspace, &mut response);
            assert_eq!(response, all(simulator, &grid, &start));
        }
    }
}

#[test]
fn a_contact_that_is_touched_again_and_again_keeps_the_tolerance_side_by_side() {
    let push = sampled(0.01, 8000, |t| 0.9 * (0.8 * t).sin() + 0.3 * (1.9 * t).cos());
    let grid = InputGrid::new(0.0, 0.01, push.len(), &[&push], None);
    let model = |stop: f64| second(1, &[&[("x", -1.0), ("v", -0.3), ("max(x - 0.5, 0)", -stop), ("u", 1.0)]]);
    let each = [400.0, 400.01, 400.02].map(model);
    let exact = each
        .each_ref()
        .map(|s| s.run(&grid, &[0.0, 0.0], 0..grid.len(), &Limits { tolerance: 1e-13, ..Limits::default() }));
    let mut workspaces = Workspaces::default();
    for tolerance in [1e-7, 1e-9] {
        let limits = Limits { tolerance, ..Limits::default() };
        let task = |simulator| RunTask { simulator, grid: &grid, initial: &[0.0, 0.0], samples: 0..grid.len(), limits };
        let mut responses = vec![Response::default(); each.len()];
        run_beside(&each.each_ref().map(task), true, &mut workspaces, &mut responses);
        for (beside, exact) in responses.iter().zip(&exact) {
            assert!(exact.switches > 20, "{} touches", exact.switches);
            let size = exact.states[0].iter().fold(0.0_f64, |size, x| size.max(x.abs()));
            // Errors of many intervals add up.
            let apart = worst(&beside.states[0], &exact.states[0]) / size;
            assert!(apart < 1e-6, "{tolerance:e}: {apart:e}");
        }
    }
}

#[test]
fn runs_side_by_side_are_those_that_each_would_be_alone() {
    let push = sampled(0.02, 700, |t| 1.2 * (1.3 * t).sin() + 0.5 * (2.9 * t).cos());
    let grid = InputGrid::new(0.0, 0.02, push.len(), &[&push], None);
    let limits = Limits { states: &[50.0, 50.0], tolerance: 1e-7, ..Limits::default() };
    let models: [&dyn Fn(f64) -> Vec<(&'static str, f64)>; 5] = [
        &|c| vec![("x", -1.0), ("v", -0.1), ("x^3", -c), ("u", 1.0)],
        // Sticks now and then.
        &|c| vec![("x", -1.0), ("sgn(v)", -c), ("u", 1.0)],
        // Its contact makes it stiffer.
        &|c| vec![("x", -1.0), ("v", -0.1), ("max(x - 0.5, 0)", -60.0 * c), ("u", 1.0)],
        // Another program where the coefficient vanishes, another exponent where it does not.
        &|c| vec![("x", -1.0), ("v*|v|", if c < 0.7 { -c } else { 0.0 }), ("u", c)],
        // One of them runs away.
        &|c| vec![("x", -1.0), ("v", 10.0 * (c - 0.6)), ("u", 1.0)],
    ];
    let mut workspaces = Workspaces::default();
    for (k, model) in models.iter().enumerate() {
        for (count, abreast) in [(3, true), (3, false), (8, true), (8, false)] {
            let each: Vec<Simulator> =
                (0..count).map(|i| second(1, &[&model(0.5 + 1e-3 * f64::from(i) * 10_f64.powi(i % 3))])).collect();
            let starts: Vec<[f64; 2]> = (0..count).map(|i| [0.1 * f64::from(i), 0.3]).collect();
            // Abreast they are along the same samples; else each has its own.
            let from = |i: usize| if abreast { 20 } else { 7 * i };
            let task = |(i, (simulator, initial))| {
                let samples = from(i)..from(i) + 600 - if abreast { 0 } else { i };
                RunTask { simulator, grid: &grid, initial, samples, limits }
            };
            let tasks: Vec<RunTask<'_>> =
                each.iter().zip(starts.iter().map(<[f64; 2]>::as_slice)).enumerate().map(task).collect();
            let mut responses = vec![Response::default(); tasks.len()];
            run_beside(&tasks, abreast, &mut workspaces, &mut responses);
            for (task, beside) in tasks.iter().zip(&responses) {
                let alone = task.simulator.run(&grid, task.initial, task.samples.clone(), &limits);
                assert_eq!(beside.len(), alone.len(), "model {k}, {count} runs");
                assert_eq!(beside.sticks.len(), alone.sticks.len(), "model {k}, {count} runs");
                let size = alone.states[0].iter().fold(0.0_f64, |size, x| size.max(x.abs()));
                let apart = worst(&beside.states[0], &alone.states[0]);
                // Steps may be finer than each alone would need.
                assert!(apart < 1e-5 * size, "model {k}, {count} runs: {apart}");
            }
        }
    }
}

#[test]
fn a_term_with_a_foreign_quantity_is_refused() {
    let model = Model::second_order(0, vec![equation(&[("x*u", 1.0)])]);
    let error = Simulator::new(&model).unwrap_err().to_string();
    assert_eq!(error, "the term x*u uses u, which the model does not have");
}

#[test]
fn an_initial_state_is_found_through_noise() {
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    let mut generator = rand_pcg::Pcg64::seed_from_u64(7);
    let noise = Normal::new(0.0, 1e-5).unwrap();
    let (k, c) = (358.706, 0.0658);
    let simulator = second(1, &[&[("x", -k), ("v", -c), ("sgn(v)", -0.0856), ("u", k), ("du", c)]]);
    let (interval, n) = (1e-3, 4000);
    let u = sampled(interval, n, |t| 0.0025 * ((TAU * 2.013 * t).sin() + (TAU * 4.611 * t).sin()));
    let grid = InputGrid::new(0.0, interval, n, &[&u], None);
    let truth = [0.003, -0.06];
    let clean = all(&simulator, &grid, &truth);
    let measured: Vec<f64> = clean.states[0].iter().map(|x| x + noise.sample(&mut generator)).collect();
    let mut workspace = Workspace::default();
    let guess = [0.0031, -0.05];
    let shown = [(Output::Displacement(0), &measured[..])];
    let fit = fit_initial_state(&simulator, &grid, &shown, &[&guess], 2000, &Limits::default(), &mut workspace);
    // Noise over the root of the samples, times four.
    assert!((fit.state[0] - truth[0]).abs() < 4.0 * 1e-5 * (2.0 / 2000.0_f64).sqrt(), "{:?}", fit.state);
    assert!((fit.state[1] - truth[1]).abs() < 4.0 * 1e-5 * k.sqrt() * (2.0 / 2000.0_f64).sqrt(), "{:?}", fit.state);
    assert!(fit.after < 0.05 * fit.before);
    // A model that cannot follow leaves the guess alone or betters it.
    let wrong = second(1, &[&[("x", 50.0)]]);
    let fit = fit_initial_state(&wrong, &grid, &shown, &[&guess], 2000, &Limits::default(), &mut workspace);
    assert!(fit.after <= fit.before && fit.state.iter().all(|x| x.is_finite()));
}

#[test]
fn lorenz_starts_from_a_fitted_state() {
    let model = Model::first_order(
        0,
        vec![
            equation(&[("x1", -10.0), ("x2", 10.0)]),
            equation(&[("x1", 28.0), ("x1*x3", -1.0), ("x2", -1.0)]),
            equation(&[("x1*x2", 1.0), ("x3", -8.0 / 3.0)]),
        ],
    );
    let simulator = Simulator::new(&model).unwrap();
    let grid = free(0.002, 5000);
    let truth = [-8.0, 7.0, 27.0];
    let clean = all(&simulator, &grid, &truth);
    assert_eq!(clean.len(), 5000);
    let shown = clean.states.iter().enumerate().map(|(i, s)| (Output::Displacement(i), s.as_slice()));
    let measured: Vec<(Output, &[f64])> = shown.collect();
    let fit = fit_initial_state(
        &simulator,
        &grid,
        &measured,
        &[&[-8.3, 7.4, 26.5]],
        500,
        &Limits::default(),
        &mut Workspace::default(),
    );
    assert!(worst(&fit.state, &truth) < 1e-3, "{:?}", fit.state);
}

#[test]
fn the_spline_follows_coarse_sines_and_its_derivatives() {
    // Samples a period, share of amplitude allowed inside and at the very ends (there the continuation decides).
    for (per_period, inside, ends) in [(4.0, 4e-4, 0.5), (9.0, 2e-7, 3e-2), (300.0, 1e-12, 1e-9)] {
        let omega = TAU / per_period;
        let n = 400;
        let u = sampled(1.0, n, |t| (omega * t + 0.4).sin());
        let grid = InputGrid::new(0.0, 1.0, n, &[&u], None);
        let mut errors = [[0.0_f64; 3]; 2];
        for k in 0..(n - 1) * 8 {
            let t = f64::from(k as u32) / 8.0;
            let p = omega * t + 0.4;
            let exact = [p.sin(), omega * p.cos(), -omega * omega * p.sin()];
            let end = usize::from(t < 40.0 || t > (n - 41) as f64);
            for (order, got) in grid.at(0, t).into_iter().enumerate() {
                let error = (got - exact[order]).abs() / omega.powi(order as i32);
                errors[end][order] = errors[end][order].max(error);
            }
        }
        assert!(errors[0][0] < inside && errors[0][1] < 10.0 * inside, "{per_period}: {errors:?}");
        assert!(errors[1][0] < ends, "{per_period}: {errors:?}");
    }
}

#[test]
fn the_spline_keeps_samples_polynomials_and_given_rates() {
    let u = sampled(0.5, 20, |t| 1.0 + t - 0.3 * t.powi(3) + 0.01 * t.powi(5));
    let grid = InputGrid::new(0.0, 0.5, 20, &[&u], None);
    for t in [0.0_f64, 0.25, 3.1, 9.4, 9.5] {
        let exact = [
            1.0 + t - 0.3 * t.powi(3) + 0.01 * t.powi(5),
            1.0 - 0.9 * t * t + 0.05 * t.powi(4),
            -1.8 * t + 0.2 * t.powi(3),
        ];
        for (got, exact) in grid.at(0, t).into_iter().zip(exact) {
            // Rounding, magnified by dividing by the squared interval.
            assert!((got - exact).abs() < 1e-7 * (1.0 + exact.abs()), "{t}: {got} {exact}");
        }
    }
    for (k, u) in u.iter().enumerate() {
        assert_eq!(grid.at(0, 0.5 * k as f64)[0], *u);
    }
    let rate = vec![3.0; 20];
    let grid = InputGrid::new(0.0, 0.5, 20, &[&u], Some(&[&rate]));
    let [_, du, ddu] = grid.at(0, 3.3);
    assert!((du - 3.0).abs() < 1e-12 && ddu.abs() < 1e-11);
    for short in 0..8 {
        let grid = InputGrid::new(0.0, 0.5, 20, &[&u[..short]], None);
        assert_eq!(grid.len(), short);
        if short > 0 {
            assert!(grid.at(0, 0.2).iter().all(|v| v.is_finite()));
        }
    }
}

const PARTS: [&str; 22] = [
    "x",
    "v",
    "u",
    "du",
    "x^3",
    "v^3",
    "sgn(v)",
    "sgn(x)",
    "sgn(u)",
    "sgn(v-du)",
    "|x|",
    "v*|v|",
    "sgn(x)*v",
    "dz(x,0.1)",
    "sgn(v)*(1+x)",
    "sgn(v)*|x|",
    "sgn(x*v)",
    "exp(x)",
    "1/x",
    "sgn(sin(200*t))",
    "sgn(v)*sgn(x)",
    "sgn(|x|-0.1)",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    /// Whatever the coefficients, a run ends and what it gives is finite.
    #[test]
    fn every_run_ends(
        terms in prop::collection::vec((0..PARTS.len(), prop_oneof![-10.0..10.0_f64, -1e4..1e4_f64, Just(f64::NAN), Just(1e300), Just(-1e-300)]), 1..6),
        start in prop::array::uniform2(prop_oneof![Just(0.0), -1.0..1.0_f64]),
        rough in any::<bool>(),
    ) {
        let terms: Vec<(&str, f64)> = terms.iter().map(|(k, c)| (PARTS[*k], *c)).collect();
        let simulator = second(1, &[&terms]);
        let u = sampled(0.01, 300, |t| if rough { (1e4 * t * t).sin() } else { (5.0 * t).sin() });
        let grid = InputGrid::new(0.0, 0.01, 300, &[&u], None);
        let response = all(&simulator, &grid, &start);
        prop_assert!(response.states.iter().flatten().all(|x| x.is_finite()));
        prop_assert!(response.len() == 300 || response.diverged_at.is_some());
    }

    /// Friction of the wrong sign and coupled contacts end, too.
    #[test]
    fn coupled_contacts_end(c in prop::array::uniform6(-3.0..3.0_f64)) {
        let first: &[(&str, f64)] = &[("x1", -9.0), ("sgn(v1)", c[0]), ("sgn(v1-v2)", c[1]), ("sgn(v2)", c[2]), ("u", 1.0)];
        let other: &[(&str, f64)] = &[("x2", -9.0), ("sgn(v2)", c[3]), ("sgn(v1-v2)", c[4]), ("sgn(v2-du)", c[5])];
        let simulator = second(1, &[first, other]);
        let u = sampled(0.01, 500, |t| (5.0 * t).sin());
        let grid = InputGrid::new(0.0, 0.01, 500, &[&u], None);
        let response = all(&simulator, &grid, &[0.0; 4]);
        prop_assert_eq!(response.len(), 500);
    }
}

#[test]
fn a_stick_with_static_friction_ends_later_and_at_its_level() {
    // A belt-like ramp of the spring's foot: x stays until k u reaches the static level, then slips.
    let terms = |list: &[(&str, f64)]| Equation::known(list.iter().map(|(t, c)| (Term::parse(t).unwrap(), *c)));
    let model = Model::second_order(1, vec![terms(&[("x-u", -100.0), ("v", -1.0), ("sgn(v)", -0.5)])]);
    let holding = Model { static_ratio: 1.6, ..model.clone() };
    let n = 2001;
    let u: Vec<f64> = (0..n).map(|k| 1e-5 * k as f64).collect();
    let grid = InputGrid::new(0.0, 1e-3, n, &[&u], None);
    let leaves = |model: &Model| {
        let response = Simulator::new(model).unwrap().run(&grid, &[0.0, 0.0], 0..n, &Limits::default());
        response.sticks[0].to
    };
    // k u = 100 · 0.01 t = t reaches 0.5 and 0.8 m/s² at 0.5 s and 0.8 s.
    assert!((leaves(&model) - 0.5).abs() < 1e-6, "{}", leaves(&model));
    assert!((leaves(&holding) - 0.8).abs() < 1e-6, "{}", leaves(&holding));
}

#[test]
fn an_internal_state_moves_by_its_own_equation() {
    let terms = |list: &[(&str, f64)]| Equation::known(list.iter().map(|(t, c)| (Term::parse(t).unwrap(), *c)));
    // A Maxwell branch with a very short relaxation time is a damper of k_v tau.
    let maxwell = Model::second_order(0, vec![terms(&[("x", -100.0), ("z", -2000.0)])])
        .with_internals(vec![terms(&[("v", 1.0), ("z", -1000.0)])]);
    let damper = Model::second_order(0, vec![terms(&[("x", -100.0), ("v", -2.0)])]);
    let grid = InputGrid::new(0.0, 0.01, 300, &[], None);
    let run = |model: &Model| Simulator::new(model).unwrap().run(&grid, &[1.0, 0.0], 0..300, &Limits::default());
    let (one, other) = (run(&maxwell), run(&damper));
    assert_eq!(one.states.len(), 3);
    for (a, b) in one.states[0].iter().zip(&other.states[0]) {
        // The branch's own stiffness stays visible to first order in omega tau = 0.01.
        assert!((a - b).abs() < 0.03, "{a} {b}");
    }
}
