use super::*;
use crate::measurement::{Quantity, Sensor, SensorSeries};
use sindyscope_values::record::Role;

fn sensors() -> Vec<Sensor> {
    let of = |k: usize, role: Role, quantity| Sensor {
        name: format!("s{k}"),
        role,
        quantity,
        unit: String::new(),
        scale: 1.0,
    };
    vec![of(0, Role::Displacement(0), Quantity::Displacement), of(1, Role::Acceleration(1), Quantity::Acceleration)]
}

fn model(effect: Effect) -> ClosedModel {
    ClosedModel {
        effect,
        across: vec![1.0, 0.0],
        sign: 1.0,
        unit: 0.7,
        inner: match effect {
            Effect::Clearance => [0.3, 0.0],
            Effect::BoucWenHysteresis => [0.4, 0.8],
            _ => [0.05, 0.0],
        },
        halvings: 0,
        poles: vec![Pole { omega: 3.0, damping: 0.02 }, Pole { omega: 7.0, damping: 0.01 }],
        drive: vec![vec![1.0], vec![-0.7]],
        shape: vec![vec![0.8, 0.5], vec![-0.4, 0.9]],
        initial: [1.0, -0.6]
            .map(|k| InitialState {
                modes: vec![Complex::new(0.1 * k, 0.2), Complex::new(-0.2, 0.1 * k)],
                memory: if effect.has_memory() { 0.1 * k } else { 0.0 },
            })
            .to_vec(),
    }
}

/// The gradient of the sum of squares against differences, for each kind of force.
#[test]
fn derivatives_are_those_of_the_simulation() {
    let n = 300;
    let input: Vec<f64> = (0..n).map(|k| (0.35 * k as f64).sin() + (0.8 * k as f64).cos()).collect();
    let series = [SensorSeries {
        name: String::new(),
        interval: 0.1,
        inputs: vec![input],
        outputs: vec![vec![0.0; n], vec![0.0; n]],
    }];
    let sensors = sensors();
    let segments = [(0, 171), (170, 130)].map(|(start, length)| Segment { record: 0, start, length });
    for effect in Effect::ALL {
        let model = model(effect);
        let weights = [3.0, 5.0, 2.0];
        let joint = Some(Joint { weights: &weights[..if effect.has_memory() { 3 } else { 2 }], rest: true });
        let of = Loop { sensors: &sensors, series: &series, segments: &segments, offsets: &[], parts: 4, joint };
        let (_, normal) = model.run(of, Some(Free::All), None).expect("bounded");
        let normal = normal.expect("asked for");
        let shared = model.shared();
        let own: Vec<f64> = normal.locals.iter().flat_map(|l| l.own.gradient.iter().copied()).collect();
        let each = own.len() / segments.len();
        let gradient = DVector::from_vec(normal.shared.gradient.iter().copied().chain(own).collect());
        for k in 0..gradient.len() {
            let half = |step: f64| {
                let unit = |at: usize, size: usize| DVector::from_fn(size, |i, _| if at + i == k { step } else { 0.0 });
                let local = (0..segments.len()).map(|s| unit(shared + s * each, each));
                let change = Change { shared: unit(0, shared), local: local.collect() };
                0.5 * model.moved(&change).simulate(of).expect("bounded").squares
            };
            // The gradient is that of the descent: the errors are measured less simulated.
            let numeric = -(half(1e-6) - half(-1e-6)) / 2e-6;
            let size = gradient.amax();
            assert!((gradient[k] - numeric).abs() < 2e-3 * size, "{effect:?} {k}: {} {numeric}", gradient[k]);
        }
    }
}

/// The same structure in metres and in units of ten micrometres moves the same: the force's equation is solved to a
/// tolerance of its own size.
#[test]
fn forces_of_any_size_are_solved_for() {
    let n = 200;
    let input: Vec<f64> = (0..n).map(|k| (0.35 * k as f64).sin() + (0.8 * k as f64).cos()).collect();
    let outputs = vec![vec![0.0; n], vec![0.0; n]];
    let series = [SensorSeries { name: String::new(), interval: 0.1, inputs: vec![input], outputs }];
    let (sensors, segments) = (sensors(), Segment::whole(&series, 1.0));
    let of = Loop { sensors: &sensors, series: &series, segments: &segments, offsets: &[], parts: 2, joint: None };
    let large = model(Effect::CubicStiffness);
    let mut small = large.clone();
    small.across.iter_mut().for_each(|e| *e *= 1e-5);
    small.unit *= 1e-20; // of x³, and once more because the coupling is as small
    let [large, small] = [large, small].map(|m| m.simulate(of).expect("bounded").residuals);
    for (a, b) in large[0][0].iter().zip(&small[0][0]) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}
