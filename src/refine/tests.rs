use std::f64::consts::TAU;
use std::sync::Arc;

use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};

use super::{Goal, Instance, MeasuredMotion, Options, Output, Point, Run, Structure, inflation, land, refine};
use crate::model::{Equation, Model};
use crate::record::Role;
use crate::rig::{ScenarioOptions, generate};
use crate::simulate::{Delays, InputGrid};
use crate::term::list;

/// One mass with free coefficients of these terms.
struct Free(&'static str);

/// Duffing's oscillator.
const DUFFING: Free = Free("x, v, u, x^3");

impl Structure for Free {
    fn instance(&self, parameters: &[f64]) -> Option<Instance> {
        let terms = list(self.0).unwrap().into_iter().zip(parameters.iter().copied());
        Some(Instance {
            model: Model::second_order(1, vec![Equation::known(terms)]),
            delays: Delays::default(),
            ceiling: None,
            readings: Vec::new(),
        })
    }

    fn scales(&self) -> Vec<f64> {
        vec![0.01; list(self.0).unwrap().len()]
    }

    fn offset(&self) -> bool {
        false
    }

    fn internals(&self) -> usize {
        0
    }
}

const TRUTH: [f64; 4] = [-1.0, -0.2, 1.0, -0.6];

/// So many that a share of intervals is known to one part in a hundred; of 100 alone, chance moves it by two.
const REPEATS: usize = 500;

#[test]
#[ignore = "half a minute where tests are not optimised; run with --profile study"]
fn ninety_five_per_cent_intervals_hold_the_truth_and_errors_are_near_the_least_possible() {
    let options = ScenarioOptions { duration: Some(60.0), rate: Some(10.0), ..ScenarioOptions::default() };
    let record = generate("duffing-multisine", &options).unwrap().records.remove(0);
    let values = |role| record.channel(role).unwrap().values.to_vec();
    let (x, u) = (values(Role::Displacement(0)), values(Role::Input(0)));
    let grid = Arc::new(InputGrid::new(0.0, record.interval, x.len(), &[&u], None));
    let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
    let noise = Normal::new(0.0, 0.02).unwrap();
    let (mut held, mut squares, mut bounds) = ([0_usize; 4], [0.0; 4], [0.0; 4]);
    for _ in 0..REPEATS {
        let measured: Vec<f64> = x.iter().map(|x| x + noise.sample(&mut rng)).collect();
        let run = Run {
            record: 0,
            grid: Arc::clone(&grid),
            range: 0..measured.len(),
            motion: Arc::new(MeasuredMotion {
                states: vec![measured.clone(), vec![0.0; measured.len()]],
                ..MeasuredMotion::default()
            }),
            outputs: vec![Output::Displacement(0)],
            measured: vec![measured.into()],
            weights: vec![1.0],
            limits: vec![20.0, 20.0],
        };
        let runs = [run];
        let start = Point::new(&DUFFING, &runs, vec![-1.1, -0.3, 0.9, -0.5], false);
        let options =
            Options { frozen: false, driven: false, steps: 30, effort: usize::MAX, bar: None, cancelled: &|| false };
        let fit = refine(&DUFFING, &runs, &start, options).unwrap();
        for (k, truth) in TRUTH.iter().enumerate() {
            let (error, deviation) = (fit.point.shared[k] - truth, fit.std_error(k).unwrap());
            held[k] += usize::from(error.abs() < 1.96 * deviation);
            squares[k] += error * error / REPEATS as f64;
            bounds[k] += deviation * deviation / REPEATS as f64;
        }
    }
    for k in 0..4 {
        let share = 100.0 * held[k] as f64 / REPEATS as f64;
        assert!((90.0..=98.0).contains(&share), "{held:?} of {REPEATS}");
        assert!(squares[k].sqrt() < 1.5 * bounds[k].sqrt(), "{:?} {:?}", squares[k].sqrt(), bounds[k].sqrt());
    }
}

#[test]
fn coloured_residuals_are_seen_as_such() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let white: Vec<f64> = (0..20_000).map(|_| normal.sample(&mut rng)).collect();
    assert!(inflation(&[&white], 0.02) < 1.15);
    let mut coloured = white;
    for k in 1..coloured.len() {
        coloured[k] += 0.8 * coloured[k - 1];
    }
    // At low frequency the spectrum of AR(1) is (1 − a²)/(1 − a)² = 9 times its mean.
    let found = inflation(&[&coloured], 0.001);
    assert!((7.0..11.0).contains(&found), "{found}");
}

#[test]
fn a_drift_that_nothing_holds_does_not_bend_the_coefficients() {
    const TRUTH: [f64; 2] = [50.0, -2.0];
    const INTERVAL: f64 = 0.02;
    let input = |t: f64| [2.1, 3.3, 4.6, 5.9].iter().map(|f| (TAU * f * t + 7.0 * f * f).sin()).sum::<f64>();
    // Far slower than the input, and no part of the model.
    let force = |t: f64| 8.0 * (TAU * 0.13 * t + 1.0).sin();
    let rate = |t: f64, v: f64| TRUTH[0] * input(t) + TRUTH[1] * v + force(t);
    let (mut x, mut v, mut states) = (0.0, 0.0, vec![Vec::new(), Vec::new()]);
    const WITHIN: usize = 40;
    for k in 0..1000 {
        states[0].push(x);
        states[1].push(v);
        let h = INTERVAL / WITHIN as f64;
        for i in 0..WITHIN {
            let t = INTERVAL * k as f64 + h * i as f64;
            let middle = v + 0.5 * h * rate(t, v);
            x += h * middle;
            v += h * rate(t + 0.5 * h, middle);
        }
    }
    let inputs: Vec<f64> = (0..1000).map(|k| input(INTERVAL * k as f64)).collect();
    let whole = [Run {
        record: 0,
        grid: Arc::new(InputGrid::new(0.0, INTERVAL, inputs.len(), &[&inputs], None)),
        range: 0..inputs.len(),
        outputs: vec![Output::Displacement(0)],
        measured: vec![states[0].as_slice().into()],
        motion: Arc::new(MeasuredMotion { states, ..MeasuredMotion::default() }),
        weights: vec![1.0],
        limits: vec![1e3, 1e3],
    }];
    let options =
        Options { frozen: false, driven: false, steps: 30, effort: usize::MAX, bar: None, cancelled: &|| false };
    let goal = Goal { period: 0.25, noise: 1e-5, top: usize::MAX, options };
    let mass = Free("u, v");
    let landed = land(&mass, &whole, &Point::new(&mass, &whole, vec![45.0, -1.0], false), goal).unwrap();
    assert!(!landed.whole && landed.horizon() < 2.0, "{} s", landed.horizon());
    let found = &landed.refined.point.shared;
    assert!((found[0] / TRUTH[0] - 1.0).abs() < 0.03, "{found:?}");
}
