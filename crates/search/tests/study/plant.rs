//! A plant of the test's own, with a state that no sensor shows.

/// Steps of an interval.
const STEPS: usize = 20;

/// Displacements at the samples of a motion from a state on, integrated by Runge and Kutta's method of fourth order.
pub(crate) fn motion(
    rate: impl Fn(f64, [f64; 3]) -> [f64; 3],
    mut state: [f64; 3],
    interval: f64,
    samples: usize,
) -> Vec<f64> {
    let mut motion = Vec::new();
    for n in 0..samples {
        motion.push(state[0]);
        for j in 0..STEPS {
            let h = interval / STEPS as f64;
            let t = interval * n as f64 + h * j as f64;
            let moved = |k: [f64; 3], h: f64| [0, 1, 2].map(|i| state[i] + h * k[i]);
            let a = rate(t, state);
            let b = rate(t + 0.5 * h, moved(a, 0.5 * h));
            let c = rate(t + 0.5 * h, moved(b, 0.5 * h));
            let d = rate(t + h, moved(c, h));
            let mean = [0, 1, 2].map(|i| (a[i] + 2.0 * (b[i] + c[i]) + d[i]) / 6.0);
            state = moved(mean, h);
        }
    }
    motion
}
