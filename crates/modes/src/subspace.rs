//! Poles by subspace identification: past-output MOESP over several records.
//!
//! The block Hankel matrices are never built: what is needed of them is their Gram matrix, whose entries follow from each
//! other along the diagonals. Its Cholesky factor is the triangular factor of the LQ decomposition.
//!
//! Source: M. Verhaegen, Automatica 30 (1994) 61; P. Van Overschee, B. De Moor, *Subspace identification for linear systems*
//! (1996).

use std::f64::consts::PI;

use nalgebra::{Cholesky, Complex, DMatrix, Schur, SymmetricEigen};

use super::limits::{
    DIAGRAM_ORDERS, EIGENVALUE_ITERATIONS, HANKEL_RIDGE, HIGHEST, INVERSE_ITERATIONS, LEAST_DAMPING, MOST_HANKEL_ROWS,
    ORDERS, POOL_DAMPING,
};
use super::pole::Pole;

/// One record's series for the identification.
pub(crate) struct Channels {
    pub(crate) interval: f64,
    /// What drives: inputs and candidate forces, `[channel][sample]`.
    pub(crate) drives: Vec<Vec<f64>>,
    /// `[sensor][sample]`
    pub(crate) outputs: Vec<Vec<f64>>,
}

impl Channels {
    /// Every `by`-th sample behind a low-pass without phase, means taken off.
    fn thinned(&self, by: usize) -> Self {
        let all = |series: &[Vec<f64>]| series.iter().map(|s| thinned(s, by)).collect();
        Self { interval: self.interval * by as f64, drives: all(&self.drives), outputs: all(&self.outputs) }
    }
}

fn thinned(series: &[f64], by: usize) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len().max(1) as f64;
    if by <= 1 {
        return series.iter().map(|v| v - mean).collect();
    }
    let half = 6 * by as isize;
    let cutoff = 0.9 / by as f64;
    let tap = |k: isize| {
        let x = k as f64;
        let sinc = if k == 0 { cutoff } else { (PI * cutoff * x).sin() / (PI * x) };
        sinc * (0.54 + 0.46 * (PI * x / half as f64).cos())
    };
    let taps: Vec<f64> = (-half..=half).map(tap).collect();
    let gain: f64 = taps.iter().sum();
    series
        .windows(taps.len())
        .step_by(by)
        .map(|window| window.iter().zip(&taps).map(|(v, t)| (v - mean) * t).sum::<f64>() / gain)
        .collect()
}

/// The poles of every order, of records thinned `by` so many samples; `block_rows` is the number of samples that past and
/// future reach. Records that are too short for that count for nothing.
pub(crate) fn poles(records: &[Channels], by: usize, block_rows: usize) -> Vec<Pole> {
    let Some(space) = SubspaceModel::new(records, by, block_rows) else { return Vec::new() };
    let of_order = |states: usize| -> Vec<Pole> {
        let Some(model) = space.of_order(states) else { return Vec::new() };
        let allowed = |p: &Pole| p.damping > POOL_DAMPING.0 && p.damping < POOL_DAMPING.1;
        let poles = model.eigenvalues().into_iter().filter_map(|e| space.pole(e)).filter(allowed);
        poles.map(|p| Pole { damping: p.damping.max(LEAST_DAMPING), ..p }).collect()
    };
    ORDERS.step_by(2).flat_map(of_order).collect()
}

/// What the past tells of the future, from which models of every order follow.
pub(crate) struct SubspaceModel {
    /// Directions of the observability matrix, the strongest first.
    directions: DMatrix<f64>,
    outputs: usize,
    /// Sampling interval of the thinned records, s.
    interval: f64,
}

/// A model of one order: how the states go on, and what the outputs show of them.
pub(crate) struct OrderModel {
    transition: DMatrix<f64>,
    output: DMatrix<f64>,
}

impl SubspaceModel {
    /// Of records thinned `by` so many samples; none where they are too short for so many block rows.
    pub(crate) fn new(records: &[Channels], by: usize, block_rows: usize) -> Option<Self> {
        let first = records.first()?;
        let (drives, outputs) = (first.drives.len(), first.outputs.len());
        let rows = block_rows.min(MOST_HANKEL_ROWS / (2 * (drives + outputs))).max(3);
        let records: Vec<Channels> = records.iter().map(|r| r.thinned(by)).collect();
        let enough = |r: &&Channels| r.outputs[0].len() > 5 * rows;
        let used: Vec<&Channels> = records.iter().filter(enough).collect();
        let interval = used.first()?.interval;
        let future = future_from_past(&used, rows)?;
        let eigen = SymmetricEigen::new(&future * future.transpose());
        let mut order: Vec<usize> = (0..future.nrows()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let most = order.len().min(*DIAGRAM_ORDERS.end());
        let directions = DMatrix::from_fn(order.len(), most, |i, j| eigen.eigenvectors[(i, order[j])]);
        Some(Self { directions, outputs, interval })
    }

    /// The model with so many states; none where the block rows do not bear as many.
    pub(crate) fn of_order(&self, states: usize) -> Option<OrderModel> {
        let (size, outputs) = (self.directions.nrows(), self.outputs);
        if states >= size - outputs || states > self.directions.ncols() {
            return None;
        }
        let observability = self.directions.columns(0, states);
        let (upper, lower) = (observability.rows(0, size - outputs), observability.rows(outputs, size - outputs));
        let inverse = Cholesky::new(upper.tr_mul(&upper))?;
        let transition = inverse.solve(&upper.tr_mul(&lower));
        Some(OrderModel { transition, output: observability.rows(0, outputs).into_owned() })
    }

    /// The pole that a discrete eigenvalue stands for, undamped or unstable ones too; none of the conjugate half, and beyond the
    /// band that the thinned records hold.
    pub(crate) fn pole(&self, eigenvalue: Complex<f64>) -> Option<Pole> {
        let lambda = eigenvalue.ln() / self.interval;
        let omega = lambda.norm();
        let inside = lambda.im > 0.0 && omega * self.interval < HIGHEST * PI && omega.is_finite();
        inside.then(|| Pole { omega, damping: -lambda.re / omega })
    }
}

impl OrderModel {
    /// Eigenvalues of the transition by one sampling interval; none where the search for them does not end.
    pub(crate) fn eigenvalues(&self) -> Vec<Complex<f64>> {
        let schur = Schur::try_new(self.transition.clone(), f64::EPSILON, EIGENVALUE_ITERATIONS);
        schur.map_or_else(Vec::new, |s| s.complex_eigenvalues().iter().copied().collect())
    }

    /// What the outputs show of an eigenvector, by inverse iteration; none where the eigenvalue is no simple one.
    pub(crate) fn shape(&self, eigenvalue: Complex<f64>) -> Option<Vec<Complex<f64>>> {
        let size = self.transition.nrows();
        // Beside the eigenvalue, so that the system can be solved.
        let near = eigenvalue * (1.0 + 1e-10);
        let system = DMatrix::from_fn(size, size, |i, j| {
            Complex::new(self.transition[(i, j)], 0.0) - if i == j { near } else { Complex::new(0.0, 0.0) }
        });
        let factor = system.lu();
        let mut vector = DMatrix::from_fn(size, 1, |i, _| Complex::new(1.0, 0.1 * i as f64));
        for _ in 0..INVERSE_ITERATIONS {
            vector = factor.solve(&vector)?;
            let norm = vector.norm();
            if !(norm.is_finite() && norm > 0.0) {
                return None;
            }
            vector.unscale_mut(norm);
        }
        let output = self.output.map(|v| Complex::new(v, 0.0));
        Some((output * vector).iter().copied().collect())
    }
}

/// The triangular factor's part that tells the future outputs from past inputs and outputs, future inputs projected off.
fn future_from_past(records: &[&Channels], rows: usize) -> Option<DMatrix<f64>> {
    let (drives, outputs) = (records[0].drives.len(), records[0].outputs.len());
    let gram = gram(records, rows);
    let factor = Cholesky::new(gram)?.unpack();
    let (first, last) = (drives * rows, (2 * drives + outputs) * rows);
    Some(factor.view((last, first), (outputs * rows, last - first)).into_owned())
}

/// The Gram matrix of future inputs, past inputs, past outputs and future outputs, block rows in this order.
fn gram(records: &[&Channels], rows: usize) -> DMatrix<f64> {
    let (drives, outputs) = (records[0].drives.len(), records[0].outputs.len());
    let (channels, lags) = (drives + outputs, 2 * rows);
    let position = |channel: usize, lag: usize| {
        let (future, row) = (lag >= rows, lag % rows);
        if channel < drives {
            let block = if future { 0 } else { rows * drives };
            block + row * drives + channel
        } else {
            let block = 2 * rows * drives + if future { rows * outputs } else { 0 };
            block + row * outputs + channel - drives
        }
    };
    let mut gram = DMatrix::<f64>::zeros(channels * lags, channels * lags);
    for record in records {
        let series: Vec<&[f64]> = record.drives.iter().chain(&record.outputs).map(Vec::as_slice).collect();
        let columns = series[0].len() - lags + 1;
        for (a, first) in series.iter().enumerate() {
            for (b, second) in series.iter().enumerate() {
                for offset in 0..lags {
                    // Entries of lags (l, l + offset), each from the one before.
                    let mut sum = sindyscope_core::signal::dot(&first[..columns], &second[offset..offset + columns]);
                    for lag in 0..lags - offset {
                        let (row, column) = (position(a, lag), position(b, lag + offset));
                        gram[(row, column)] += sum;
                        if offset > 0 {
                            gram[(column, row)] += sum;
                        }
                        if lag + offset + 1 < lags {
                            sum += first[columns + lag] * second[columns + lag + offset]
                                - first[lag] * second[lag + offset];
                        }
                    }
                }
            }
        }
    }
    let ridge = HANKEL_RIDGE * gram.trace() / gram.nrows() as f64;
    for k in 0..gram.nrows() {
        gram[(k, k)] += ridge.max(f64::MIN_POSITIVE);
    }
    gram
}

/// Poles without those that are near one listed before.
pub(crate) fn distinct(poles: impl IntoIterator<Item = Pole>, frequency: f64, damping: f64) -> Vec<Pole> {
    let mut kept: Vec<Pole> = Vec::new();
    for pole in poles {
        let near =
            |k: &Pole| (k.omega / pole.omega).ln().abs() < frequency && (k.damping / pole.damping).ln().abs() < damping;
        if !kept.iter().any(near) {
            kept.push(pole);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recursion along diagonals gives what the sums themselves give.
    #[test]
    fn the_gram_matrix_is_that_of_the_hankel_matrices() {
        let wave = |k: usize, f: f64| (0..60).map(|n| (f * n as f64 + k as f64).sin()).collect::<Vec<f64>>();
        let record = Channels { interval: 1.0, drives: vec![wave(0, 0.7)], outputs: vec![wave(1, 1.1), wave(2, 0.3)] };
        let rows = 4;
        let gram = gram(&[&record], rows);
        let columns = 60 - 2 * rows + 1;
        // Rows: future input, past input, past outputs, future outputs.
        let series = |row: usize| -> Vec<f64> {
            let (values, lag) = match row {
                0..4 => (&record.drives[0], rows + row),
                4..8 => (&record.drives[0], row - 4),
                8..16 => (&record.outputs[(row - 8) % 2], (row - 8) / 2),
                _ => (&record.outputs[(row - 16) % 2], rows + (row - 16) / 2),
            };
            values[lag..lag + columns].to_vec()
        };
        for i in 0..24 {
            for j in 0..24 {
                let direct: f64 = series(i).iter().zip(series(j)).map(|(a, b)| a * b).sum();
                assert!((gram[(i, j)] - direct).abs() < 1e-8, "{i} {j}");
            }
        }
    }
}
