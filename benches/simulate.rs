//! How long simulating takes.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use sindyscope_core::simulate::{
    InputGrid, Limits, Output, Response, RunTask, SIDE_BY_SIDE, Simulator, Workspace, Workspaces, fit_initial_state,
    run_beside,
};
use sindyscope_values::model::{Equation, Model};
use sindyscope_values::term::Term;

fn simulator(inputs: usize, terms: &[(&str, f64)]) -> Simulator {
    let terms = terms.iter().map(|(text, c)| (Term::parse(text).expect("a term"), *c));
    Simulator::new(&Model::second_order(inputs, vec![Equation::known(terms)])).expect("a model")
}

fn tones(n: usize, interval: f64, amplitude: f64, frequencies: &[f64]) -> Vec<f64> {
    let value = |t: f64| amplitude * frequencies.iter().map(|f| (TAU * f * t).sin()).sum::<f64>();
    (0..n).map(|k| value(k as f64 * interval)).collect()
}

fn simulate(c: &mut Criterion) {
    let friction =
        |f: f64| simulator(1, &[("x", -358.706), ("v", -0.0658), ("sgn(v)", -f), ("u", 358.706), ("du", 0.0658)]);
    let (mut workspace, mut response) = (Workspace::default(), Response::default());
    let mut run = |name: &str, c: &mut Criterion, simulator: &Simulator, grid: &InputGrid, start: &[f64]| {
        c.bench_function(name, |b| {
            b.iter(|| {
                let limits = Limits::default();
                simulator.run_into(black_box(grid), start, 0..grid.len(), &limits, &mut workspace, &mut response);
                assert_eq!(response.len(), grid.len());
            });
        });
    };
    let report = [2.013, 2.583, 4.611, 5.242];
    let u = tones(20_000, 1e-3, 0.0025, &report);
    let grid = InputGrid::new(0.0, 1e-3, u.len(), &[&u], None);
    run("friction, 20 s at 1 kHz", c, &friction(0.0856), &grid, &[0.0, 0.0]);
    run("friction, stick-slip, 20 s at 1 kHz", c, &friction(1.5), &grid, &[0.0, 0.0]);
    let force = tones(20_000, 0.01, 1.0, &[1.2 / TAU]);
    let forced = InputGrid::new(0.0, 0.01, force.len(), &[&force], None);
    let duffing = simulator(1, &[("v", -0.2), ("x", -1.0), ("x^3", -0.6), ("u", 1.0)]);
    run("Duffing, 20 000 samples at 100 Hz", c, &duffing, &forced, &[0.0, 0.0]);
    // As a fit asks for its sensitivities.
    let limits = Limits { tolerance: 1e-7, ..Limits::default() };
    let (mut workspaces, mut responses) = (Workspaces::default(), vec![Response::default(); SIDE_BY_SIDE]);
    let slid = friction(0.0856);
    for (name, simulator, grid) in [("friction", &slid, &grid), ("Duffing", &duffing, &forced)] {
        let task = RunTask { simulator, grid, initial: &[0.0, 0.0], samples: 0..grid.len(), limits };
        let tasks = vec![task; simulator.side_by_side()];
        c.bench_function(&format!("{name}, {} runs side by side", tasks.len()), |b| {
            b.iter(|| run_beside(black_box(&tasks), true, &mut workspaces, &mut responses));
        });
    }
    // Nine samples a period, as coarse as a resonance is usually recorded.
    let force = tones(131_072, 1.0 / 610.0, 1.0, &[31.0, 67.0, 83.0]);
    let coarse = InputGrid::new(0.0, 1.0 / 610.0, force.len(), &[&force], None);
    let silverbox = simulator(1, &[("x", -1.8e5), ("v", -20.0), ("x^3", -1e5), ("u", 3e4)]);
    run("stiff Duffing, 131 072 samples at 610 Hz", c, &silverbox, &coarse, &[0.0, 0.0]);
    let long = tones(1_000_000, 1e-3, 0.0025, &report);
    let long_grid = InputGrid::new(0.0, 1e-3, long.len(), &[&long], None);
    run("friction, 1 000 000 samples at 1 kHz", c, &friction(0.0856), &long_grid, &[0.0, 0.0]);

    c.bench_function("inputs of 20 000 samples", |b| {
        b.iter(|| InputGrid::new(0.0, 1e-3, u.len(), black_box(&[&u]), None));
    });
    let simulator = friction(0.0856);
    let measured = simulator.run(&grid, &[0.001, 0.02], 0..grid.len(), &Limits::default()).states.swap_remove(0);
    c.bench_function("initial state from 2000 samples", |b| {
        b.iter(|| {
            let guess = black_box([0.00101, 0.021]);
            let shown = [(Output::Displacement(0), &measured[..])];
            fit_initial_state(&simulator, &grid, &shown, &[&guess], 2000, &Limits::default(), &mut workspace)
        });
    });
}

criterion_group!(benches, simulate);
criterion_main!(benches);
