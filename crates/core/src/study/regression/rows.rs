//! A record's library columns, passed through the filter that its rates went through.

use std::ops::Range;

use fearless_simd::{Level, dispatch};

use crate::parallel::prelude::*;
use crate::signal::{SavitzkyGolay, Signals, Smoother, Smoothing, dot};
use sindyscope_values::term::{Program, SampleBlock};

/// Passes columns through the filter of the whole record that the displacement went through, a sign of states twice, as
/// in [`filtered`].
pub(super) fn smooth_alike(smoothing: &Smoothing, signals: &Signals, jumps: &[bool], columns: &mut [Vec<f64>]) {
    let count = signals.states.first().map_or(0, Vec::len);
    let smoother = Smoother::new(smoothing, signals.length, count);
    if !smoothing.filter_library || !smoothing.method.is_global() || !smoother.is_linear() {
        return;
    }
    for (column, jumps) in columns.iter_mut().zip(jumps) {
        for _ in 0..1 + usize::from(*jumps) {
            *column = smoother.smooth(column, signals.interval);
        }
    }
}

/// Samples of a record that one core evaluates at once: their columns stay in its cache until they are filtered.
const CHUNK_SAMPLES: usize = 2048;

/// Evaluates the columns, smooths them and appends the rows `inside`, each `stride` samples from the one before.
///
/// A rate has passed the derivative's filter twice, from displacement to velocity and on. A column of smoothed states
/// has passed once and passes once more; a sign of them has not been smoothed at all, and passes twice. `derived` says
/// that rates are the filter's own derivatives.
#[expect(clippy::too_many_arguments, reason = "one pass over one record")]
pub(super) fn filtered(
    program: &Program,
    samples: &SampleBlock<'_>,
    filter: &SavitzkyGolay,
    stride: usize,
    inside: &Range<usize>,
    derived: bool,
    jumps: &[bool],
    columns: &mut [Vec<f64>],
) {
    let count = samples.states.first().map_or(0, |s| s.len());
    let smooth = if derived { filter.companion() } else { filter.weights(0.0, 0) };
    let twice = convolve(&smooth, &smooth);
    let reach = twice.len() / 2;
    let clear_of_ends = inside.start * stride >= reach && inside.end.saturating_sub(1) * stride + reach < count;
    let rows_at_once = if clear_of_ends { (CHUNK_SAMPLES / stride).max(1) } else { inside.len().max(1) };
    let starts: Vec<usize> = inside.clone().step_by(rows_at_once).collect();
    let part = |chunk: &mut Vec<Vec<f64>>, from: usize| -> Vec<Vec<f64>> {
        let to = inside.end.min(from + rows_at_once);
        chunk.iter_mut().for_each(Vec::clear);
        if clear_of_ends {
            let first = from * stride - reach;
            let part = samples.slice(first..(to - 1) * stride + reach + 1);
            program.columns(&part.block(), chunk);
            let column = |(chunk, jumps): (&Vec<f64>, &bool)| {
                let kernel = if *jumps { &twice } else { &smooth };
                let inset = reach - kernel.len() / 2;
                let mut rows = vec![0.0; to - from];
                // The widest registers that the processor has.
                dispatch!(Level::new(), _simd => for (row, out) in rows.iter_mut().enumerate() {
                    *out = dot(kernel, &chunk[row * stride + inset..][..kernel.len()]);
                });
                rows
            };
            chunk.iter().zip(jumps).map(column).collect()
        } else {
            program.columns(samples, chunk);
            let mut smooth = vec![0.0; count.div_ceil(stride)];
            let column = |chunk: &Vec<f64>| {
                filter.apply_strided(chunk, samples.interval, 0, stride, &mut smooth);
                smooth[from..to].to_vec()
            };
            chunk.iter().map(column).collect()
        }
    };
    let empty = || vec![Vec::new(); columns.len()];
    let parts: Vec<Vec<Vec<f64>>> = starts.into_par_iter().map_init(empty, part).collect();
    for part in parts {
        columns.iter_mut().zip(part).for_each(|(column, rows)| column.extend(rows));
    }
}

fn convolve(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; a.len() + b.len() - 1];
    for (k, a) in a.iter().enumerate() {
        for (slot, b) in out[k..].iter_mut().zip(b) {
            *slot += a * b;
        }
    }
    out
}

/// Integrates rows `step` apart over time by trapezoids, less the mean: so the free constant of integration is gone from
/// both sides of the equation.
pub(super) fn integrated(rows: &mut [f64], step: f64) {
    let (mut sum, mut before, mut total) = (0.0, rows.first().copied().unwrap_or(0.0), 0.0);
    for row in rows.iter_mut() {
        sum += 0.5 * step * (before + *row);
        before = std::mem::replace(row, sum);
        total += sum;
    }
    let mean = total / rows.len().max(1) as f64;
    rows.iter_mut().for_each(|row| *row -= mean);
}
