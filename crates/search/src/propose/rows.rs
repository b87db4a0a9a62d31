//! The weak form: an equation of motion averaged over test functions, whitened against the sensor's noise.

use std::collections::HashMap;
use std::sync::Arc;

use super::super::columns::COLUMNS_AT_ONCE;
use super::super::constants::Constants;
use super::super::data::Data;
use super::path::MeasuredPath;
use sindyscope_core::signal::{TestFunction, dot, dots};

/// Distance of neighbouring test functions, as a share of their half width: nearer ones say the same.
const STRIDE: f64 = 0.25;
/// Added to the variance of a row, as a share of it: what the model itself misses.
const NUGGET: f64 = 0.03;

/// The rows of one mass's equation that share a record, a block and a width, one behind the other.
#[derive(Debug)]
struct RowPart {
    mass: usize,
    record: usize,
    block: usize,
    width: usize,
    /// The first sample of each test function.
    starts: Vec<usize>,
    /// Lower Cholesky factor of the rows' covariance; none before whitening.
    factor: Option<Arc<BandedFactor>>,
}

/// All rows of all equations.
#[derive(Debug)]
pub(super) struct Rows {
    parts: Vec<RowPart>,
    /// The test functions of each record and width.
    functions: Vec<Vec<TestFunction>>,
    /// Rows of each block.
    pub(super) blocks: Vec<std::ops::Range<usize>>,
    /// The blocks are as short as they may be: of more periods there would be more of them.
    pub(super) few_blocks: bool,
    /// Independent rows for each row: rows overlap, four in a period say all.
    pub(super) worth: f64,
}

impl Rows {
    /// Test functions along the fitted records; none of them crosses the border of a block or reaches into a stick.
    pub(super) fn new(data: &Data, paths: &[MeasuredPath]) -> Self {
        let fit = data.fit();
        let total: f64 = fit.iter().map(|s| s.len() as f64 * s.interval).sum();
        let Constants { half_width, narrow_widths, left_out_periods, blocks_left_out, rows: most, .. } = data.constants;
        let (least, share) = (left_out_periods * data.period, total / blocks_left_out as f64);
        let want = least.max(share);
        let mut functions = Vec::new();
        let mut parts: Vec<RowPart> = Vec::new();
        let mut next_block = 0;
        for (record, (s, measured)) in fit.iter().zip(paths).enumerate() {
            let period = data.period / s.interval;
            let sticks = measured.stuck.iter().flatten().any(|s| *s);
            let shares = std::iter::once(half_width).chain(narrow_widths.into_iter().filter(|_| sticks));
            let mut halves: Vec<usize> = shares
                .map(|w| {
                    ((w * period) as usize).clamp(TestFunction::NARROWEST, (s.len() / 8).max(TestFunction::NARROWEST))
                })
                .collect();
            halves.dedup();
            let alone = usize::from(fit.len() == 1);
            let count = ((s.len() as f64 * s.interval / want).round() as usize).max(1 + alone);
            // Of a record with more rows than are needed, parts of each block are passed over.
            let rows = total / data.period / (STRIDE * half_width);
            let stretch = (most as f64 / rows).min(1.0);
            for b in 0..count {
                let (from, to) = (b * s.len() / count, (b + 1) * s.len() / count);
                let to = from + ((to - from) as f64 * stretch) as usize;
                for mass in 0..data.masses() {
                    for (width, half) in halves.iter().enumerate() {
                        for starts in clear(from..to, *half, &measured.stuck[mass]) {
                            parts.push(RowPart { mass, record, block: next_block, width, starts, factor: None });
                        }
                    }
                }
                next_block += 1;
            }
            functions.push(halves.iter().map(|half| TestFunction::new(*half, s.interval)).collect());
        }
        parts.sort_by_key(|p| p.block);
        let mut blocks = Vec::new();
        let mut from = 0;
        for block in 0..next_block {
            let count: usize = parts.iter().filter(|p| p.block == block).map(|p| p.starts.len()).sum();
            if count > 0 {
                blocks.push(from..from + count);
            }
            from += count;
        }
        let rows = from.max(1) as f64;
        let worth = (4.0 * data.masses() as f64 * total / data.period / rows).min(1.0);
        Self { parts, functions, blocks, few_blocks: least > share, worth }
    }

    /// The logarithm of what whitening has divided the density of all rows by.
    pub(super) fn log_scale(&self) -> f64 {
        let factors = self.parts.iter().filter_map(|part| part.factor.as_ref());
        factors.map(|factor| factor.log_determinant()).sum()
    }

    pub(super) fn len(&self) -> usize {
        self.blocks.last().map_or(0, |b| b.end)
    }

    /// The average of a derivative of a series over every row: `of(mass, record)` gives the series and the derivative's
    /// order, nothing where the equation has no such term.
    pub(super) fn column<'a>(&self, of: impl Fn(usize, usize) -> Option<(&'a [f64], usize)>) -> Vec<f64> {
        let mut column = Vec::with_capacity(self.len());
        for part in &self.parts {
            let from = column.len();
            match of(part.mass, part.record) {
                Some((series, order)) => {
                    let kernel = &self.functions[part.record][part.width].kernels()[order];
                    dots(kernel, part.starts.iter().map(|s| &series[*s..*s + kernel.len()]), &mut column);
                }
                None => column.resize(from + part.starts.len(), 0.0),
            }
        }
        column
    }

    /// Makes rows independent, and the error that noise leaves in each of them one.
    pub(super) fn whiten(&self, columns: &mut [Vec<f64>]) {
        let mut lanes = Vec::new();
        for some in columns.chunks_mut(COLUMNS_AT_ONCE) {
            let mut from = 0;
            for part in &self.parts {
                let rows = from..from + part.starts.len();
                from = rows.end;
                let Some(factor) = &part.factor else { continue };
                lanes.clear();
                let lane = |column: Option<&Vec<f64>>, row: usize| column.map_or(0.0, |column| column[row]);
                lanes.extend(rows.clone().map(|row| std::array::from_fn(|k| lane(some.get(k), row))));
                factor.forward(&mut lanes);
                for (k, column) in some.iter_mut().enumerate() {
                    column[rows.clone()].iter_mut().zip(&lanes).for_each(|(value, lanes)| *value = lanes[k]);
                }
            }
        }
    }

    /// Learns what the noise of each sensor leaves in the rows, and how that goes together from row to row. `slopes[mass]` are
    /// the stiffness and the damping that the noise passes besides the derivative, `deviations[mass]` the noise, and
    /// `shown[mass][record]` what of the motion the sensor shows.
    pub(super) fn learn_noise(&mut self, slopes: &[(f64, f64)], deviations: &[f64], shown: &[Vec<SensedQuantity>]) {
        let functions = &self.functions;
        let kernel = |part: &RowPart| -> Vec<f64> {
            let kernels = functions[part.record][part.width].kernels();
            let (stiffness, damping) = slopes[part.mass];
            let zero = &kernels[0];
            match &shown[part.mass][part.record] {
                SensedQuantity::Displacement => sum(&[(1.0, &kernels[2]), (damping, &kernels[1]), (stiffness, zero)]),
                SensedQuantity::Velocity { displacement } => {
                    let integral = passed(zero, displacement);
                    sum(&[(1.0, &kernels[1]), (damping, zero), (stiffness, &integral)])
                }
                SensedQuantity::Acceleration { velocity, displacement } => {
                    let integrals = [velocity, displacement].map(|response| passed(zero, response));
                    sum(&[(1.0, zero), (damping, &integrals[0]), (stiffness, &integrals[1])])
                }
            }
        };
        // Parts of one length differ in nothing: what a factor takes may be long where a sensor's noise is integrated.
        let mut kernels: HashMap<[usize; 3], Vec<f64>> = HashMap::new();
        let mut factors: HashMap<([usize; 3], usize), Arc<BandedFactor>> = HashMap::new();
        for part in &mut self.parts {
            let place = [part.mass, part.record, part.width];
            let factor = factors.entry((place, part.starts.len())).or_insert_with(|| {
                let kernel = kernels.entry(place).or_insert_with(|| kernel(part));
                let lag = part.starts.get(1).map_or(1, |second| second - part.starts[0]);
                let band: Vec<f64> = (0..part.starts.len().min(kernel.len().div_ceil(lag)))
                    .map(|d| deviations[part.mass].powi(2) * dot(&kernel[d * lag..], &kernel[..kernel.len() - d * lag]))
                    .collect();
                Arc::new(BandedFactor::new(&band_factor(&band, part.starts.len())))
            });
            part.factor = Some(Arc::clone(factor));
        }
    }
}

/// What a sensor shows of the motion, with what one sample of it does to what is estimated from it, as far before its place as behind.
pub(super) enum SensedQuantity {
    Displacement,
    Velocity { displacement: Vec<f64> },
    Acceleration { velocity: Vec<f64>, displacement: Vec<f64> },
}

/// What the average of an estimated series takes of each measured sample, from as far before it on as that is remembered.
fn passed(kernel: &[f64], response: &[f64]) -> Vec<f64> {
    let mut taken = vec![0.0; kernel.len() + response.len() - 1];
    for (i, weight) in kernel.iter().enumerate() {
        taken[i..].iter_mut().zip(response.iter().rev()).for_each(|(taken, r)| *taken += weight * r);
    }
    taken
}

/// Kernels about one middle, each times a factor, added.
fn sum(kernels: &[(f64, &Vec<f64>)]) -> Vec<f64> {
    let longest = kernels.iter().map(|(_, kernel)| kernel.len()).max().unwrap_or(0);
    let mut sum = vec![0.0; longest];
    for (factor, kernel) in kernels {
        let from = (longest - kernel.len()) / 2;
        sum[from..].iter_mut().zip(*kernel).for_each(|(sum, k)| *sum += factor * k);
    }
    sum
}

/// Runs of test functions of a half width within a range of samples that keep clear of sticks; a sixth of the half width at
/// each end, where the function is next to nothing, may reach into one.
fn clear(range: std::ops::Range<usize>, half: usize, stuck: &[bool]) -> Vec<Vec<usize>> {
    let stride = ((half as f64 * STRIDE) as usize).max(1);
    let mut out: Vec<Vec<usize>> = vec![Vec::new()];
    let last = range.end.saturating_sub(2 * half + 1);
    for start in (range.start..=last).step_by(stride).filter(|_| range.len() > 2 * half) {
        let free = !stuck[start + half / 6..start + 2 * half - half / 6].iter().any(|s| *s);
        match out.last_mut() {
            Some(run) if free => run.push(start),
            Some(run) if !run.is_empty() => out.push(Vec::new()),
            _ => {}
        }
    }
    out.retain(|run| run.len() > 1);
    out
}

/// The Cholesky factor of a banded symmetric Toeplitz matrix whose first column is `band`.
fn band_factor(band: &[f64], rows: usize) -> Vec<Vec<f64>> {
    let width = band.len();
    let mut factor: Vec<Vec<f64>> = Vec::with_capacity(rows);
    // A row follows from so many before it: once those are alike, all that follow are like them.
    let mut alike = 0;
    for i in 0..rows {
        if alike >= width {
            factor.push(factor[i - 1].clone());
            continue;
        }
        let reach = width.min(i + 1);
        let mut row = vec![0.0; reach];
        for d in (0..reach).rev() {
            let j = i - d;
            // Row j beside its diagonal, against this row from the same column on.
            let (entry, beside) =
                if d == 0 { (band[0] * (1.0 + NUGGET), &row[1..]) } else { (band[d], &factor[j][1..]) };
            let value = entry - row[d + 1..].iter().zip(beside).map(|(own, other)| own * other).sum::<f64>();
            row[d] = if d == 0 { value.max(f64::MIN_POSITIVE).sqrt() } else { value / factor[j][0] };
        }
        alike = if factor.last() == Some(&row) { alike + 1 } else { 0 };
        factor.push(row);
    }
    factor
}

/// A banded lower triangular matrix, as [`Self::forward`] reads it.
#[derive(Debug)]
struct BandedFactor {
    width: usize,
    /// Of each row one over the entry on the diagonal, and the entries before it over that, from the first on; zeros before the first
    /// column.
    rows: Vec<f64>,
}

impl BandedFactor {
    /// `factor[i][d]` is the entry in row i, column i − d.
    fn new(factor: &[Vec<f64>]) -> Self {
        let width = factor.iter().map(Vec::len).max().unwrap_or(1);
        let mut rows = vec![0.0; width * factor.len()];
        for (into, row) in rows.chunks_exact_mut(width).zip(factor) {
            into[0] = row[0].recip();
            into[1..].iter_mut().rev().zip(&row[1..]).for_each(|(into, entry)| *into = entry / row[0]);
        }
        Self { width, rows }
    }

    /// The logarithm of the product of the diagonal.
    fn log_determinant(&self) -> f64 {
        -self.rows.chunks_exact(self.width).map(|row| row[0].ln()).sum::<f64>()
    }

    /// Solves for what the matrix makes the values of, in their place; several columns at once, as the matrix may be larger than
    /// what is near the processor.
    fn forward(&self, values: &mut [[f64; COLUMNS_AT_ONCE]]) {
        for (i, row) in self.rows.chunks_exact(self.width).enumerate() {
            let first = (i + 1).saturating_sub(self.width);
            let (known, rest) = values.split_at_mut(i);
            let mut found = rest[0].map(|value| value * row[0]);
            for (part, known) in row[self.width - (i - first)..].iter().zip(&known[first..]) {
                found.iter_mut().zip(known).for_each(|(found, known)| *found -= part * known);
            }
            rest[0] = found;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_average_of_an_estimated_series_takes_of_a_sample_what_that_does_to_it() {
        // What a sample does from two places before it to two behind it.
        let (kernel, response) = ([1.0, 2.0, 3.0], [0.1, 0.2, 0.0, -0.4, -0.3]);
        let taken = passed(&kernel, &response);
        for (place, taken) in taken.iter().enumerate() {
            // The sample lies so far behind the first of the average's, less the two places.
            let done = |i: usize| (i + 4).checked_sub(place).and_then(|j| response.get(j)).copied().unwrap_or(0.0);
            let average: f64 = kernel.iter().enumerate().map(|(i, weight)| weight * done(i)).sum();
            assert!((taken - average).abs() < 1e-12, "{place}");
        }
    }

    #[test]
    fn what_a_factor_makes_of_values_is_solved_for_in_every_lane() {
        let (band, rows) = ([4.0, 1.0, 0.5], 300);
        let factor = band_factor(&band, rows);
        // The last rows are no longer computed, but copied.
        assert_eq!(factor[rows - 1], factor[rows - 2]);
        let value = |i: usize, lane: usize| (0.3 * i as f64 + lane as f64).sin();
        let made = |i: usize, lane: usize| factor[i].iter().enumerate().map(|(d, f)| f * value(i - d, lane)).sum();
        let mut values: Vec<[f64; COLUMNS_AT_ONCE]> =
            (0..rows).map(|i| std::array::from_fn(|lane| made(i, lane))).collect();
        BandedFactor::new(&factor).forward(&mut values);
        for (i, lanes) in values.iter().enumerate() {
            assert!((0..COLUMNS_AT_ONCE).all(|lane| (lanes[lane] - value(i, lane)).abs() < 1e-12), "{i}");
        }
    }

    #[test]
    fn a_factor_times_itself_is_the_covariance() {
        let band = [4.0, 1.0, 0.5];
        let factor = band_factor(&band, 6);
        let entry = |i: usize, j: usize| i.checked_sub(j).and_then(|d| factor[i].get(d)).copied().unwrap_or(0.0);
        for i in 0..6 {
            for j in 0..=i {
                let product: f64 = (0..6).map(|k| entry(i, k) * entry(j, k)).sum();
                let wanted = band.get(i - j).copied().unwrap_or(0.0) * if i == j { 1.0 + NUGGET } else { 1.0 };
                assert!((product - wanted).abs() < 1e-12, "{i} {j}");
            }
        }
    }
}
