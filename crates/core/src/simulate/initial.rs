//! The initial state whose response follows the opening of a record.

use nalgebra::{DMatrix, DVector};

use super::{InputGrid, Limits, Output, Response, Simulator, Workspace};

/// An initial state fitted to the beginning of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialState {
    /// The state at the first sample.
    pub state: Vec<f64>,
    /// RMS of the differences to the measurement over the stretch, each displacement as a share of its RMS, with the best
    /// guess.
    pub before: f64,
    /// RMS of these differences with `state`; never larger than `before`.
    pub after: f64,
}

/// Steps of the iteration, at most.
const MAX_STEPS: usize = 4;

/// A step that leaves at most this share of the difference goes on with the derivatives that it was made with.
const REUSE_DERIVATIVES: f64 = 0.5;

/// A step that takes away less than this share of the difference is the last.
const MIN_REDUCTION: f64 = 1e-4;

/// Step of a state for a finite difference, as a share of its largest value.
const DIFFERENCE_STEP: f64 = 1e-4;

/// Fits the initial state to the first `window` samples, so that the noise of the first sample does not displace the
/// whole response.
///
/// `measured` holds what sensors showed, one series each; a state of first-order equations counts as a displacement.
/// Starts from the guess whose response is nearest and steps by Gauss and Newton with the damping of Levenberg and
/// Marquardt; that guess is kept where no step betters it, as when the response diverges within the window. A chaotic
/// system needs a window shorter than the time in which it forgets its initial state.
pub fn fit_initial_state(
    simulator: &Simulator,
    grid: &InputGrid,
    measured: &[(Output, &[f64])],
    guesses: &[&[f64]],
    window: usize,
    limits: &Limits<'_>,
    workspace: &mut Workspace,
) -> InitialState {
    let n = simulator.layout().states();
    let states = guesses.iter().map(|guess| {
        let mut state = guess.to_vec();
        state.resize(n, 0.0);
        state
    });
    let states: Vec<Vec<f64>> = states.collect();
    let observed = measured.len();
    let freedoms = simulator.layout().freedoms;
    let rates = measured.iter().any(|(output, _)| output.is_rate());
    let limits = &Limits { rates, ..*limits };
    let window = measured.iter().map(|(_, m)| m.len()).fold(window.min(grid.len()), usize::min);
    let weights: Vec<f64> = measured[..observed]
        .iter()
        .map(|(_, m)| {
            let square: f64 = m[..window].iter().map(|v| v * v).sum();
            (square / window as f64).sqrt().recip()
        })
        .map(|w| if w.is_finite() { w } else { 1.0 })
        .collect();
    let rows = observed * window;
    let mut response = Response::default();
    let mut residual = vec![0.0; rows];
    let mut run = |state: &[f64], residual: &mut [f64], response: &mut Response| -> Option<f64> {
        simulator.run_into(grid, state, 0..window, limits, workspace, response);
        if response.len() < window {
            return None;
        }
        for (k, weight) in weights.iter().enumerate() {
            let out = &mut residual[k * window..(k + 1) * window];
            let (output, measured) = measured[k];
            for ((r, m), s) in out.iter_mut().zip(measured).zip(output.series(response, freedoms)) {
                *r = weight * (m - s);
            }
        }
        let cost: f64 = residual.iter().map(|r| r * r).sum();
        cost.is_finite().then(|| (cost / rows as f64).sqrt())
    };
    let unfitted = |state: Vec<f64>, rms: f64| InitialState { state, before: rms, after: rms };
    let first = states.first().cloned().unwrap_or_else(|| vec![0.0; n]);
    if rows <= n {
        return unfitted(first, f64::NAN);
    }
    let mut costs = vec![f64::INFINITY; states.len()];
    for (cost, state) in costs.iter_mut().zip(&states) {
        *cost = run(state, &mut residual, &mut response).unwrap_or(f64::INFINITY);
    }
    let nearest = (0..states.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).filter(|k| costs[*k].is_finite());
    let Some(nearest) = nearest else { return unfitted(first, f64::INFINITY) };
    let mut state = states[nearest].clone();
    if nearest + 1 != states.len() {
        // What lies in the buffers is the last guess's.
        run(&state, &mut residual, &mut response);
    }
    let before = costs[nearest];
    let mut after = before;
    let mut damping = 1e-9;
    let mut shifted = vec![0.0; rows];
    let mut trial = vec![0.0; rows];
    let mut jacobian = DMatrix::zeros(rows, n);
    // The response is nearly linear in its beginning: the derivatives of a step that led most of the way serve the next too.
    let mut serves = false;
    for _ in 0..MAX_STEPS {
        for j in 0..if serves { 0 } else { n } {
            let largest = response.states[j].iter().fold(0.0_f64, |a, x| a.max(x.abs()));
            let step = if largest > 0.0 { DIFFERENCE_STEP * largest } else { DIFFERENCE_STEP };
            let mut moved = state.clone();
            moved[j] += step;
            let mut other = Response::default();
            if run(&moved, &mut shifted, &mut other).is_none() {
                return InitialState { state, before, after };
            }
            for (entry, (moved, here)) in jacobian.column_mut(j).iter_mut().zip(shifted.iter().zip(&residual)) {
                *entry = (moved - here) / step;
            }
        }
        let gradient = jacobian.tr_mul(&DVector::from_column_slice(&residual));
        let normal = jacobian.tr_mul(&jacobian);
        let (mut bettered, mut settled) = (false, false);
        let began = after;
        for _ in 0..if serves { 1 } else { 3 } {
            let mut damped = normal.clone();
            for j in 0..n {
                damped[(j, j)] += damping * normal[(j, j)] + f64::MIN_POSITIVE;
            }
            let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                damping = (damping * 1e3).max(1e-6);
                continue;
            };
            if gradient.dot(&step) < 2.0 * MIN_REDUCTION * residual.iter().map(|r| r * r).sum::<f64>() {
                settled = true;
                break;
            }
            let candidate: Vec<f64> = state.iter().zip(step.iter()).map(|(x, s)| x - s).collect();
            match run(&candidate, &mut trial, &mut response) {
                Some(rms) if rms < after => {
                    bettered = after - rms > MIN_REDUCTION * after;
                    (state, after) = (candidate, rms);
                    residual.copy_from_slice(&trial);
                    damping *= 0.1;
                    break;
                }
                _ => damping = (damping * 1e3).max(1e-6),
            }
        }
        if settled || !bettered && !serves {
            break;
        }
        serves = !serves && after < REUSE_DERIVATIVES * began;
    }
    InitialState { state, before, after }
}
