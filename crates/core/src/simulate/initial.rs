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

/// The opening of a record, which responses are held against.
struct RecordOpening<'a> {
    simulator: &'a Simulator,
    grid: &'a InputGrid,
    measured: &'a [(Output, &'a [f64])],
    /// One over the RMS of each measured series.
    weights: Vec<f64>,
    /// Number of samples.
    window: usize,
    limits: Limits<'a>,
}

impl RecordOpening<'_> {
    /// Differences of all series.
    fn rows(&self) -> usize {
        self.measured.len() * self.window
    }

    /// The response from a state, and its weighted differences from the measurement; their RMS, unless the response ends
    /// within the window.
    fn compare(
        &self,
        state: &[f64],
        residual: &mut [f64],
        response: &mut Response,
        workspace: &mut Workspace,
    ) -> Option<f64> {
        self.simulator.run_into(self.grid, state, 0..self.window, &self.limits, workspace, response);
        if response.len() < self.window {
            return None;
        }
        let freedoms = self.simulator.layout().freedoms;
        for (k, weight) in self.weights.iter().enumerate() {
            let out = &mut residual[k * self.window..(k + 1) * self.window];
            let (output, measured) = self.measured[k];
            for ((r, m), s) in out.iter_mut().zip(measured).zip(output.series(response, freedoms)) {
                *r = weight * (m - s);
            }
        }
        let cost: f64 = residual.iter().map(|r| r * r).sum();
        cost.is_finite().then(|| (cost / self.rows() as f64).sqrt())
    }

    /// Derivatives of the differences `residual` by each state, `jacobian[(row, state)]`; none where a response ends within
    /// the window.
    fn differentiate(
        &self,
        (state, residual, response): (&[f64], &[f64], &Response),
        jacobian: &mut DMatrix<f64>,
        workspace: &mut Workspace,
    ) -> Option<()> {
        let mut shifted = vec![0.0; residual.len()];
        for j in 0..state.len() {
            let largest = response.states[j].iter().fold(0.0_f64, |a, x| a.max(x.abs()));
            let step = if largest > 0.0 { DIFFERENCE_STEP * largest } else { DIFFERENCE_STEP };
            let mut moved = state.to_vec();
            moved[j] += step;
            self.compare(&moved, &mut shifted, &mut Response::default(), workspace)?;
            for (entry, (moved, here)) in jacobian.column_mut(j).iter_mut().zip(shifted.iter().zip(residual)) {
                *entry = (moved - here) / step;
            }
        }
        Some(())
    }
}

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
    let padded = |guess: &&[f64]| guess.iter().copied().chain(std::iter::repeat(0.0)).take(n).collect();
    let states: Vec<Vec<f64>> = guesses.iter().map(padded).collect();
    let window = measured.iter().map(|(_, m)| m.len()).fold(window.min(grid.len()), usize::min);
    let weight = |(_, m): &(Output, &[f64])| {
        let square: f64 = m[..window].iter().map(|v| v * v).sum();
        Some((square / window as f64).sqrt().recip()).filter(|w| w.is_finite()).unwrap_or(1.0)
    };
    let limits = Limits { rates: measured.iter().any(|(output, _)| output.is_rate()), ..*limits };
    let weights = measured.iter().map(weight).collect();
    let opening = RecordOpening { simulator, grid, measured, weights, window, limits };
    let unfitted = |rms: f64| InitialState {
        state: states.first().cloned().unwrap_or_else(|| vec![0.0; n]),
        before: rms,
        after: rms,
    };
    if opening.rows() <= n {
        return unfitted(f64::NAN);
    }
    let (mut residual, mut response) = (vec![0.0; opening.rows()], Response::default());
    let mut compare =
        |state: &Vec<f64>| opening.compare(state, &mut residual, &mut response, workspace).unwrap_or(f64::INFINITY);
    let costs: Vec<f64> = states.iter().map(&mut compare).collect();
    let nearest = (0..states.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).filter(|k| costs[*k].is_finite());
    let Some(nearest) = nearest else { return unfitted(f64::INFINITY) };
    if nearest + 1 != states.len() {
        // What lies in the buffers is the last guess's.
        compare(&states[nearest]);
    }
    let start = InitialState { state: states[nearest].clone(), before: costs[nearest], after: costs[nearest] };
    descend(&opening, start, (residual, response), workspace)
}

/// Steps from a state, whose differences and response are given, until nothing betters it noticeably.
fn descend(
    opening: &RecordOpening<'_>,
    mut at: InitialState,
    (mut residual, mut response): (Vec<f64>, Response),
    workspace: &mut Workspace,
) -> InitialState {
    let n = at.state.len();
    let mut damping = 1e-9;
    let mut trial = vec![0.0; residual.len()];
    let mut jacobian = DMatrix::zeros(residual.len(), n);
    // The response is nearly linear in its beginning: the derivatives of a step that led most of the way serve the next too.
    let mut serves = false;
    for _ in 0..MAX_STEPS {
        if !serves && opening.differentiate((&at.state, &residual, &response), &mut jacobian, workspace).is_none() {
            return at;
        }
        let gradient = jacobian.tr_mul(&DVector::from_column_slice(&residual));
        let normal = jacobian.tr_mul(&jacobian);
        let (mut bettered, mut settled) = (false, false);
        let began = at.after;
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
            let candidate: Vec<f64> = at.state.iter().zip(step.iter()).map(|(x, s)| x - s).collect();
            match opening.compare(&candidate, &mut trial, &mut response, workspace) {
                Some(rms) if rms < at.after => {
                    bettered = at.after - rms > MIN_REDUCTION * at.after;
                    (at.state, at.after) = (candidate, rms);
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
        serves = !serves && at.after < REUSE_DERIVATIVES * began;
    }
    at
}
