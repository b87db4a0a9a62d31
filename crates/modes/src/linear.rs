//! The response of a set of modes as a linear model, and the refinement of its poles.
//!
//! A sensor shows `y = Σᵢ rᵢ qᵢ⁽ᵖ⁾`, p = 0, 1, 2 for displacement, velocity, acceleration, with real amplitudes `r` for each input
//! and force, free oscillations that each record has of its own, and an offset. All amplitudes enter linearly and are
//! eliminated; poles are refined by variable projection with Kaufman's Jacobian, so output error is what is minimised.
//!
//! Source: G. Golub, V. Pereyra, Inverse Problems 19 (2003) R1.

use nalgebra::{Cholesky, Complex, DMatrix, Dyn};

use super::limits::{DIFFERENCES, MAX_POLE_CHANGE, POLE_GAIN, POOL_RIDGE, RIDGE};
use super::measurement::{Quantity, Sensor, SensorSeries};
use super::pole::{self, Pole};
use sindyscope_core::study::Cancel;

/// Columns of a Gram matrix that are made at once, of which what lies above the diagonal is made in vain.
const GRAM_BLOCK: usize = 16;

/// A force beside the inputs, known at `parts` instants a sampling interval: `values[record][instant]`.
#[derive(Clone, Debug)]
pub(crate) struct ForceSeries {
    pub(crate) parts: usize,
    pub(crate) values: Vec<Vec<f64>>,
}

/// Sensors that show the same quantity.
#[derive(Clone, Debug)]
struct PoleGroup {
    quantity: Quantity,
    sensors: Vec<usize>,
}

/// Records with what drives them, ready for any poles.
pub(crate) struct LinearTask<'a> {
    series: &'a [SensorSeries],
    groups: Vec<PoleGroup>,
    /// `padded[record][input]`
    padded: Vec<Vec<Vec<f64>>>,
    force: Option<&'a ForceSeries>,
    /// Every how many-th sample is looked at.
    stride: usize,
    pub(crate) sensors: usize,
}

/// What the poles make of one group of sensors.
struct GroupFit {
    /// Columns of each record: those of the modes for each input and force, then free oscillations, then the offset.
    columns: Vec<DMatrix<f64>>,
    /// Amplitudes: shared columns, then each record's own; one column a sensor.
    amplitudes: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    /// What the columns were divided by in the factorised Gram matrix.
    norms: Vec<f64>,
    /// `residuals[record]`, samples by sensors.
    residuals: Vec<DMatrix<f64>>,
}

/// Poles with all amplitudes.
pub(crate) struct ModalFit {
    pub(crate) poles: Vec<Pole>,
    groups: Vec<GroupFit>,
    /// Sum of the squared residuals of all sensors.
    pub(crate) squares: f64,
    pub(crate) samples: usize,
}

/// First and second derivatives of half the sum of squares by the poles' logarithms (frequency, then damping of each).
struct PoleSlopes {
    normal: DMatrix<f64>,
    gradient: DMatrix<f64>,
}

/// Poles that may join a fit, with their columns.
pub(crate) struct PolePool {
    pub(crate) poles: Vec<Pole>,
    /// `columns[group][record]`: those for inputs and forces, then the free oscillations.
    columns: Vec<Vec<DMatrix<f64>>>,
    /// Products of each pole's columns, its free oscillations record by record: `own[group][pole]`.
    own: Vec<Vec<DMatrix<f64>>>,
}

/// `aᵀ b`, by blocks that fit the cache.
fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    a.transpose() * b
}

/// `aᵀ a`.
fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (size, turned) = (a.ncols(), a.transpose());
    let mut out = DMatrix::zeros(size, size);
    for from in (0..size).step_by(GRAM_BLOCK) {
        let width = GRAM_BLOCK.min(size - from);
        let mut block = out.view_mut((from, from), (size - from, width));
        block.gemm(1.0, &turned.rows_range(from..), &a.columns(from, width), 0.0);
    }
    out.fill_upper_triangle_with_lower_triangle();
    out
}

impl<'a> LinearTask<'a> {
    pub(crate) fn new(
        series: &'a [SensorSeries],
        sensors: &[Sensor],
        force: Option<&'a ForceSeries>,
        stride: usize,
    ) -> Self {
        let mut groups: Vec<PoleGroup> = Vec::new();
        for (k, sensor) in sensors.iter().enumerate() {
            match groups.iter_mut().find(|g| g.quantity == sensor.quantity) {
                Some(group) => group.sensors.push(k),
                None => groups.push(PoleGroup { quantity: sensor.quantity, sensors: vec![k] }),
            }
        }
        let padded = series.iter().map(|s| s.inputs.iter().map(|u| pole::padded(u)).collect()).collect();
        Self { series, groups, padded, force, stride: stride.max(1), sensors: sensors.len() }
    }

    /// Inputs and forces.
    fn drives(&self) -> usize {
        self.series.first().map_or(0, |s| s.inputs.len()) + usize::from(self.force.is_some())
    }

    fn rows(&self, record: usize) -> usize {
        self.series[record].len().div_ceil(self.stride)
    }

    fn local(&self, modes: usize) -> usize {
        2 * modes + 1
    }

    /// Writes a mode's columns of one record: `shared` first ones for inputs and forces, two of its free oscillation.
    fn fill(
        &self,
        pole: Pole,
        (record, quantity): (usize, Quantity),
        matrix: &mut DMatrix<f64>,
        (shared, free): (usize, usize),
        states: &mut Vec<Complex<f64>>,
    ) {
        let series = &self.series[record];
        let (n, lambda) = (series.len(), pole.eigenvalue());
        let derivatives = quantity.derivatives();
        let factor = lambda.powi(derivatives) * (pole.omega.powi(2 - derivatives) / lambda.im);
        states.clear();
        states.resize(n, Complex::new(0.0, 0.0));
        for drive in 0..self.drives() {
            let through: (&[f64], usize) = match (self.padded[record].get(drive), self.force) {
                (Some(padded), _) => {
                    pole::response(lambda, series.interval, padded, states);
                    (&series.inputs[drive], 1)
                }
                (None, Some(force)) => {
                    pole::response_fine(lambda, series.interval, &force.values[record], force.parts, states);
                    (&force.values[record], force.parts)
                }
                (None, None) => continue,
            };
            let mut column = matrix.column_mut(shared + drive);
            for (row, out) in column.iter_mut().enumerate() {
                let at = row * self.stride;
                let own = if derivatives == 2 { through.0[at * through.1] } else { 0.0 };
                *out = (factor * states[at]).im + own;
            }
        }
        let decay = (lambda * (series.interval * self.stride as f64)).exp();
        let rows = self.rows(record);
        let (real, imaginary) = matrix.as_mut_slice()[free * rows..(free + 2) * rows].split_at_mut(rows);
        pole::swing(decay, real, imaginary);
    }

    /// Columns of all poles for each record.
    fn columns(&self, poles: &[Pole], quantity: Quantity) -> Vec<DMatrix<f64>> {
        let (m, drives) = (poles.len(), self.drives());
        let mut states = Vec::new();
        let of = |record: usize| {
            let mut matrix = DMatrix::zeros(self.rows(record), m * drives + self.local(m));
            for (i, pole) in poles.iter().enumerate() {
                self.fill(*pole, (record, quantity), &mut matrix, (i * drives, m * drives + 2 * i), &mut states);
            }
            matrix.column_mut(m * drives + 2 * m).fill(1.0);
            matrix
        };
        (0..self.series.len()).map(of).collect()
    }

    /// Where a column of a record stands among all amplitudes.
    fn place(&self, column: usize, record: usize, modes: usize) -> usize {
        let shared = modes * self.drives();
        if column < shared { column } else { column + record * self.local(modes) }
    }

    fn targets(&self, group: &PoleGroup, record: usize) -> DMatrix<f64> {
        let outputs = &self.series[record].outputs;
        DMatrix::from_fn(self.rows(record), group.sensors.len(), |row, k| outputs[group.sensors[k]][row * self.stride])
    }

    /// The least-squares amplitudes of poles.
    pub(crate) fn fit(&self, poles: &[Pole]) -> Option<ModalFit> {
        let groups: Option<Vec<GroupFit>> = self.groups.iter().map(|g| self.fit_group(g, poles)).collect();
        let groups = groups?;
        let squares = groups.iter().flat_map(|g| &g.residuals).map(DMatrix::norm_squared).sum::<f64>();
        let samples = groups.iter().flat_map(|g| &g.residuals).map(DMatrix::len).sum();
        squares.is_finite().then(|| ModalFit { poles: poles.to_vec(), groups, squares, samples })
    }

    fn fit_group(&self, group: &PoleGroup, poles: &[Pole]) -> Option<GroupFit> {
        let m = poles.len();
        let columns = self.columns(poles, group.quantity);
        let count = m * self.drives() + self.series.len() * self.local(m);
        let mut all = DMatrix::<f64>::zeros(count, count);
        let mut right = DMatrix::<f64>::zeros(count, group.sensors.len());
        let mut targets = Vec::with_capacity(columns.len());
        for (record, matrix) in columns.iter().enumerate() {
            let target = self.targets(group, record);
            let (own, own_right) = (gram(matrix), product(matrix, &target));
            for i in 0..own.nrows() {
                let row = self.place(i, record, m);
                for j in 0..own.ncols() {
                    all[(row, self.place(j, record, m))] += own[(i, j)];
                }
                for s in 0..own_right.ncols() {
                    right[(row, s)] += own_right[(i, s)];
                }
            }
            targets.push(target);
        }
        let norms: Vec<f64> = (0..count).map(|k| all[(k, k)].sqrt().max(1e-150)).collect();
        for i in 0..count {
            for j in 0..count {
                all[(i, j)] /= norms[i] * norms[j];
            }
            all[(i, i)] += RIDGE;
            for s in 0..right.ncols() {
                right[(i, s)] /= norms[i];
            }
        }
        let factor = Cholesky::new(all)?;
        let mut amplitudes = factor.solve(&right);
        for (i, norm) in norms.iter().enumerate() {
            amplitudes.row_mut(i).iter_mut().for_each(|a| *a /= norm);
        }
        let residuals = columns
            .iter()
            .zip(targets)
            .enumerate()
            .map(|(record, (matrix, target))| target - matrix * self.own(&amplitudes, record, m))
            .collect();
        Some(GroupFit { columns, amplitudes, factor, norms, residuals })
    }

    /// The amplitudes of one record's columns.
    fn own(&self, amplitudes: &DMatrix<f64>, record: usize, modes: usize) -> DMatrix<f64> {
        let columns = modes * self.drives() + self.local(modes);
        DMatrix::from_fn(columns, amplitudes.ncols(), |i, s| amplitudes[(self.place(i, record, modes), s)])
    }

    /// The columns of poles that may join a fit, made once.
    pub(crate) fn pool(&self, poles: &[Pole]) -> PolePool {
        let columns = |group: &PoleGroup| {
            let mut all = self.columns(poles, group.quantity);
            all.iter_mut().for_each(|m| *m = m.columns(0, m.ncols() - 1).into_owned());
            all
        };
        let columns: Vec<Vec<DMatrix<f64>>> = self.groups.iter().map(columns).collect();
        let own = columns.iter().map(|c| (0..poles.len()).map(|p| self.own_products(c, p, poles.len())).collect());
        PolePool { poles: poles.to_vec(), own: own.collect(), columns }
    }

    /// Products of the columns of one of several poles.
    fn own_products(&self, columns: &[DMatrix<f64>], pole: usize, count: usize) -> DMatrix<f64> {
        let drives = self.drives();
        let width = drives + 2 * self.series.len();
        let mut own = DMatrix::zeros(width, width);
        for (record, matrix) in columns.iter().enumerate() {
            let of = |k: usize| matrix.column(self.pool_column(pole, count, k));
            let place = |k: usize| if k < drives { k } else { k + 2 * record };
            for k in 0..drives + 2 {
                for l in 0..=k {
                    let product = of(k).dot(&of(l));
                    own[(place(k), place(l))] += product;
                    if k != l {
                        own[(place(l), place(k))] += product;
                    }
                }
            }
        }
        own
    }

    /// Where one of a pole's columns stands in a record's matrix of a pool of so many.
    fn pool_column(&self, pole: usize, count: usize, which: usize) -> usize {
        let drives = self.drives();
        if which < drives { pole * drives + which } else { count * drives + 2 * pole + which - drives }
    }

    /// How much each pole of a pool would take off the sum of squares.
    pub(crate) fn gains(&self, fit: &ModalFit, pool: &PolePool) -> Vec<f64> {
        let (m, drives, records, count) = (fit.poles.len(), self.drives(), self.series.len(), pool.poles.len());
        let mut totals = vec![0.0; count];
        for (((group, known), columns), own) in self.groups.iter().zip(&fit.groups).zip(&pool.columns).zip(&pool.own) {
            let sensors = group.sensors.len();
            // Of each pole its drives, then its free oscillations record by record.
            let width = drives + 2 * records;
            let mut cross = DMatrix::<f64>::zeros(known.norms.len(), count * width);
            let mut right = DMatrix::<f64>::zeros(count * width, sensors);
            for (record, matrix) in columns.iter().enumerate() {
                let part = product(&known.columns[record], matrix);
                let towards = product(matrix, &known.residuals[record]);
                for p in 0..count {
                    let place = |k: usize| if k < drives { k } else { k + 2 * record };
                    for k in 0..drives + 2 {
                        let (from, to) = (self.pool_column(p, count, k), p * width + place(k));
                        for i in 0..part.nrows() {
                            cross[(self.place(i, record, m), to)] +=
                                part[(i, from)] / known.norms[self.place(i, record, m)];
                        }
                        for s in 0..sensors {
                            right[(to, s)] += towards[(from, s)];
                        }
                    }
                }
            }
            let solved = known.factor.solve(&cross);
            for (p, own) in own.iter().enumerate() {
                let of = |all: &DMatrix<f64>| all.columns(p * width, width).into_owned();
                let scale: Vec<f64> = (0..width).map(|k| own[(k, k)].sqrt().max(1e-150)).collect();
                let mut left = own - of(&cross).tr_mul(&of(&solved));
                let mut towards = right.rows(p * width, width).into_owned();
                for k in 0..width {
                    for l in 0..width {
                        left[(k, l)] /= scale[k] * scale[l];
                    }
                    left[(k, k)] += POOL_RIDGE;
                    towards.row_mut(k).iter_mut().for_each(|r| *r /= scale[k]);
                }
                if let Some(factor) = Cholesky::new(left) {
                    totals[p] += towards.dot(&factor.solve(&towards));
                }
            }
        }
        totals
    }

    fn slopes(&self, fit: &ModalFit) -> Option<PoleSlopes> {
        let (m, drives, records) = (fit.poles.len(), self.drives(), self.series.len());
        let mut states = Vec::new();
        let mut normal = DMatrix::zeros(2 * m, 2 * m);
        let mut gradient = DMatrix::zeros(2 * m, 1);
        for (group, known) in self.groups.iter().zip(&fit.groups) {
            let sensors = group.sensors.len();
            let mut cross = vec![DMatrix::<f64>::zeros(known.norms.len(), 2 * m); sensors];
            for record in 0..records {
                let rows = self.rows(record);
                // Those of each sensor side by side.
                let mut changes = DMatrix::zeros(rows, 2 * m * sensors);
                let mut matrix = DMatrix::zeros(rows, drives + 2);
                for (i, pole) in fit.poles.iter().enumerate() {
                    for (which, step) in DIFFERENCES.into_iter().enumerate() {
                        let moved =
                            if which == 0 { pole.scaled(1.0 + step, 1.0) } else { pole.scaled(1.0, 1.0 + step) };
                        self.fill(moved, (record, group.quantity), &mut matrix, (0, drives), &mut states);
                        for k in 0..drives + 2 {
                            let column = if k < drives { i * drives + k } else { m * drives + 2 * i + k - drives };
                            let before = known.columns[record].column(column);
                            let place = self.place(column, record, m);
                            for s in 0..sensors {
                                let amplitude = known.amplitudes[(place, s)] / step;
                                let mut out = changes.column_mut(2 * m * s + 2 * i + which);
                                for ((o, new), old) in out.iter_mut().zip(matrix.column(k).iter()).zip(before.iter()) {
                                    *o += amplitude * (new - old);
                                }
                            }
                        }
                    }
                }
                let parts = product(&known.columns[record], &changes);
                for (s, cross) in cross.iter_mut().enumerate() {
                    let own = changes.columns(2 * m * s, 2 * m).into_owned();
                    normal += gram(&own);
                    gradient += own.tr_mul(&known.residuals[record].column(s));
                    for k in 0..2 * m {
                        for i in 0..parts.nrows() {
                            cross[(self.place(i, record, m), k)] += parts[(i, 2 * m * s + k)];
                        }
                    }
                }
            }
            for mut cross in cross {
                for (i, norm) in known.norms.iter().enumerate() {
                    cross.row_mut(i).iter_mut().for_each(|c| *c /= norm);
                }
                normal -= cross.tr_mul(&known.factor.solve(&cross));
            }
        }
        Some(PoleSlopes { normal, gradient })
    }

    /// Poles refined from these, at most so many steps of Levenberg and Marquardt.
    pub(crate) fn refine(&self, poles: &[Pole], steps: usize, cancel: &Cancel) -> Option<ModalFit> {
        let mut fit = self.fit(poles)?;
        let mut damping = 1e-3;
        for _ in 0..steps {
            if cancel.is_cancelled() {
                return None;
            }
            let PoleSlopes { normal, gradient } = self.slopes(&fit)?;
            let mut better = None;
            for _ in 0..6 {
                let mut damped = normal.clone();
                let ridge = 1e-13 * normal.trace() + f64::MIN_POSITIVE;
                for k in 0..damped.nrows() {
                    damped[(k, k)] += damping * normal[(k, k)].abs() + ridge;
                }
                let moved: Option<Vec<Pole>> = Cholesky::new(damped).map(|factor| {
                    let change = factor.solve(&gradient);
                    let step = |k: usize| change[(k, 0)].clamp(-MAX_POLE_CHANGE, MAX_POLE_CHANGE).exp();
                    fit.poles.iter().enumerate().map(|(i, p)| p.scaled(step(2 * i), step(2 * i + 1))).collect()
                });
                let found = moved.and_then(|poles| self.fit(&poles)).filter(|f| f.squares < fit.squares);
                if found.is_some() {
                    better = found;
                    damping = f64::max(damping / 10.0, 1e-9);
                    break;
                }
                damping = f64::max(damping * 8.0, 1e-6);
            }
            let Some(better) = better else { break };
            let gain = fit.squares - better.squares;
            let enough = gain > POLE_GAIN * fit.squares;
            fit = better;
            if !enough {
                break;
            }
        }
        Some(fit)
    }

    /// What shared amplitudes of another fit leave on these records, whose free oscillations and offsets alone are fitted:
    /// `residuals[record][sensor][sample]`.
    pub(crate) fn unseen(&self, fit: &ModalFit) -> Option<Vec<Vec<Vec<f64>>>> {
        let (m, drives) = (fit.poles.len(), self.drives());
        let mut all: Vec<Vec<Vec<f64>>> = self.series.iter().map(|_| vec![Vec::new(); self.sensors]).collect();
        for (group, known) in self.groups.iter().zip(&fit.groups) {
            let columns = self.columns(&fit.poles, group.quantity);
            for (record, matrix) in columns.iter().enumerate() {
                let shared = matrix.columns(0, m * drives);
                let left = self.targets(group, record) - shared * known.amplitudes.rows(0, m * drives);
                let own = matrix.columns(m * drives, self.local(m));
                let own = own.into_owned();
                let mut products = gram(&own);
                let scale: Vec<f64> = (0..products.nrows()).map(|k| products[(k, k)].sqrt().max(1e-150)).collect();
                let mut right = product(&own, &left);
                for k in 0..scale.len() {
                    for l in 0..scale.len() {
                        products[(k, l)] /= scale[k] * scale[l];
                    }
                    products[(k, k)] += RIDGE;
                    right.row_mut(k).iter_mut().for_each(|r| *r /= scale[k]);
                }
                let mut free = Cholesky::new(products)?.solve(&right);
                for (k, scale) in scale.iter().enumerate() {
                    free.row_mut(k).iter_mut().for_each(|f| *f /= scale);
                }
                let residual = left - own * free;
                for (k, sensor) in group.sensors.iter().enumerate() {
                    all[record][*sensor] = residual.column(k).iter().copied().collect();
                }
            }
        }
        Some(all)
    }

    /// Amplitude of a mode in a sensor for an input or the force, in units of the displacement that a static force
    /// would make: `q` times ω².
    pub(crate) fn amplitude(&self, fit: &ModalFit, sensor: usize, mode: usize, drive: usize) -> f64 {
        self.with(fit, sensor, |known, column| known.amplitudes[(mode * self.drives() + drive, column)])
    }

    /// Its variance for a residual of unit variance.
    pub(crate) fn amplitude_variance(&self, fit: &ModalFit, sensor: usize, mode: usize, drive: usize) -> f64 {
        let at = mode * self.drives() + drive;
        self.with(fit, sensor, |known, _| {
            let mut unit = DMatrix::zeros(known.norms.len(), 1);
            unit[(at, 0)] = 1.0;
            known.factor.solve(&unit)[(at, 0)] / known.norms[at].powi(2)
        })
    }

    /// The free oscillation of a mode in a sensor on one record: amplitudes of the real and the imaginary part of `e^{λt}`.
    pub(crate) fn free(&self, fit: &ModalFit, sensor: usize, mode: usize, record: usize) -> [f64; 2] {
        let m = fit.poles.len();
        let at = self.place(m * self.drives() + 2 * mode, record, m);
        self.with(fit, sensor, |known, column| [known.amplitudes[(at, column)], known.amplitudes[(at + 1, column)]])
    }

    /// Least standard error over the records of a free oscillation's amplitudes, for a residual of this variance.
    pub(crate) fn free_deviation(&self, fit: &ModalFit, sensor: usize, mode: usize, variance: f64) -> f64 {
        let m = fit.poles.len();
        let of = |record: usize| {
            let at = self.place(m * self.drives() + 2 * mode, record, m);
            self.with(fit, sensor, |known, _| {
                let mut unit = DMatrix::zeros(known.norms.len(), 1);
                unit[(at, 0)] = 1.0;
                (known.factor.solve(&unit)[(at, 0)] * variance).sqrt() / known.norms[at]
            })
        };
        (0..self.series.len()).map(of).fold(f64::INFINITY, f64::min)
    }

    /// The offset of a sensor on one record.
    pub(crate) fn offset(&self, fit: &ModalFit, sensor: usize, record: usize) -> f64 {
        let m = fit.poles.len();
        let at = self.place(m * self.drives() + 2 * m, record, m);
        self.with(fit, sensor, |known, column| known.amplitudes[(at, column)])
    }

    /// What is left of one sensor on one record.
    pub(crate) fn residual(&self, fit: &ModalFit, sensor: usize, record: usize) -> Vec<f64> {
        self.with(fit, sensor, |known, column| known.residuals[record].column(column).iter().copied().collect())
    }

    fn with<T>(&self, fit: &ModalFit, sensor: usize, of: impl FnOnce(&GroupFit, usize) -> T) -> T {
        let found =
            self.groups.iter().zip(&fit.groups).find_map(|(group, known)| {
                group.sensors.iter().position(|s| *s == sensor).map(|column| (known, column))
            });
        let (known, column) = found.unwrap_or((&fit.groups[0], 0));
        of(known, column)
    }

    /// The covariance of the poles' logarithms for a residual of unit variance; zero for a damping at its bound.
    pub(crate) fn pole_covariance(&self, fit: &ModalFit) -> Option<DMatrix<f64>> {
        let normal = self.slopes(fit)?.normal;
        let size = normal.nrows();
        let bound = |k: usize| k % 2 == 1 && !fit.poles[k / 2].is_free();
        let used: Vec<usize> = (0..size).filter(|k| !bound(*k) && normal[(*k, *k)] > 0.0).collect();
        let scale = |k: usize| normal[(k, k)].sqrt();
        let scaled = DMatrix::from_fn(used.len(), used.len(), |i, j| {
            normal[(used[i], used[j])] / (scale(used[i]) * scale(used[j])) + if i == j { 1e-12 } else { 0.0 }
        });
        let inverse = Cholesky::new(scaled)?.inverse();
        let mut covariance = DMatrix::zeros(size, size);
        for (i, a) in used.iter().enumerate() {
            for (j, b) in used.iter().enumerate() {
                covariance[(*a, *b)] = inverse[(i, j)] / (scale(*a) * scale(*b));
            }
        }
        Some(covariance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of more columns than one block holds and of fewer.
    #[test]
    fn a_gram_matrix_is_the_product_of_its_columns() {
        for columns in [1, GRAM_BLOCK, 2 * GRAM_BLOCK + 5] {
            let a = DMatrix::from_fn(50, columns, |i, j| ((3 * i + 7 * j) as f64).sin());
            assert!((gram(&a) - a.tr_mul(&a)).amax() < 1e-12, "{columns}");
        }
    }
}
