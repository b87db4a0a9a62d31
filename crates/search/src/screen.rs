//! The fast screen: which effects would explain what the response leaves, were their force taken along the measured motion.
//!
//! With the motion known, the missing force enters a linear oscillator, and what it makes of each candidate's force is a
//! column of a linear regression on the residual, whose noise is that of the sensor: white where the sensor's is. This is
//! the weak form with its noise whitened, the oscillator's response being the test function.

use sindyscope_core::parallel::prelude::*;

use super::columns::{COLUMNS_AT_ONCE, MotionPath, forces, forces_of_each};
use super::constants::LARGEST_SET;
use super::data::{Data, RecordSeries};
use super::effects::{Addition, Form};
use super::fit::{Fitted, Followed};
use super::motion::{Sensing, Smoothed, Variation, smooth};
use super::outcome::Beginnings;
use super::propose::MeasuredPath;
use super::site::{Placed, accelerations};
use super::structure::Composition;
use sindyscope_core::refine::{Output, Structure as _};
use sindyscope_core::signal::{dot, rms};
use sindyscope_core::simulate::{Limits, Simulator};
use sindyscope_core::sparse::{LocalColumn, OrthonormalBasis, Stretch};
use sindyscope_core::study::Cancel;

/// The motion of every fitted record under a fitted model.
pub(super) struct Motion {
    /// As simulated.
    pub(super) simulated: Vec<MotionPath>,
    /// As measured: the simulation and what the smoother says it missed.
    pub(super) measured: Vec<MotionPath>,
    /// What the model lacks, force per unit of mass: `[record][mass][sample]`.
    pub(super) missing: Vec<Vec<Vec<f64>>>,
    /// Its standard deviation.
    pub(super) deviation: Vec<Vec<Vec<f64>>>,
    /// What a small force does along each record.
    pub(super) variations: Vec<Variation>,
    /// Standard deviation of each velocity's error along the measured motion.
    pub(super) speed_noise: Vec<f64>,
}

impl Motion {
    /// The missing force on one mass, a series a record.
    pub(super) fn missing_of(&self, mass: usize) -> Vec<&[f64]> {
        self.missing.iter().map(|record| record[mass].as_slice()).collect()
    }
}

/// A form at its best inner values.
#[derive(Clone, Debug)]
pub(super) struct Hit {
    /// Index of the form.
    pub(super) form: usize,
    pub(super) inner: Vec<f64>,
    /// By how much it lowers the sum of squares.
    pub(super) gain: f64,
    /// Of the best, the responses of its columns, what the model explains not removed.
    pub(super) columns: Vec<Vec<f64>>,
}

impl Data {
    /// The motion along a record of a model whose stretches begin like this; none where it does not last.
    pub(super) fn path_along(
        &self,
        composition: &Composition,
        shared: &[f64],
        s: &RecordSeries,
        beginnings: &Beginnings,
    ) -> Option<MotionPath> {
        let (model, composed) = composition.model(&composition.named(shared));
        let simulator = Simulator::new(&model).ok()?;
        let limits = Limits { states: &s.limits, tolerance: 1e-8, ..Limits::default() };
        let delayed = (!composed.delays.is_none()).then(|| s.grid.delayed(&composed.delays));
        let grid = delayed.as_ref().unwrap_or(&s.grid);
        let masses = self.masses();
        let mut path = MotionPath { x: vec![Vec::new(); masses], v: vec![Vec::new(); masses] };
        let mut driven = Vec::new();
        for (range, own) in &beginnings.stretches {
            let mut initial = own.clone();
            if initial.len() < 2 * masses + composed.internals.len() {
                if driven.is_empty() {
                    driven = composition.driven(shared, &s.run());
                }
                initial.extend(driven.iter().map(|z| z[range.start]));
            }
            let response = simulator.run(grid, &initial, range.clone(), &limits);
            if response.len() < range.len() {
                return None;
            }
            let (x, rest) = response.states.split_at(masses);
            path.x.iter_mut().zip(x).for_each(|(path, x)| path.extend_from_slice(x));
            path.v.iter_mut().zip(rest).for_each(|(path, v)| path.extend_from_slice(v));
        }
        Some(path)
    }

    /// The motion along each fitted record as a model simulates it, at rest where the measured one is; none where it does not follow a
    /// record to its end.
    pub(super) fn simulated_paths(&self, fitted: &Fitted) -> Option<Vec<MeasuredPath>> {
        let followed = fitted.followed();
        let records = self.fit().iter().zip(followed).zip(self.measured_paths());
        let simulated = |((s, followed), measured): ((&RecordSeries, Followed), &MeasuredPath)| {
            let path = self.path_along(&fitted.composition, &fitted.refined.point.shared, s, &followed.beginnings)?;
            let whole = path.x.iter().chain(&path.v).all(|x| x.len() == s.len());
            whole.then(|| MeasuredPath { path, stuck: measured.stuck.clone() })
        };
        records.map(simulated).collect()
    }

    /// The motion under a fitted model.
    pub(super) fn motion(&self, fitted: &Fitted, cancel: &Cancel) -> Option<Motion> {
        let composed = fitted.composition.compose(&fitted.parameters.inner);
        let mut simulated = Vec::new();
        let mut variations: Vec<Variation> = Vec::new();
        for (s, Followed { beginnings, .. }) in self.fit().iter().zip(fitted.followed()) {
            if cancel.is_cancelled() {
                return None;
            }
            let path = self.path_along(&fitted.composition, &fitted.refined.point.shared, s, &beginnings)?;
            variations.push(self.variation(&composed.terms, &fitted.parameters.coefficients, s, &path));
            simulated.push(path);
        }
        let mut measured = Vec::new();
        let mut missing = Vec::new();
        let mut deviation = Vec::new();
        let mut speed = vec![0.0; self.masses()];
        let residuals = fitted.by_record(&fitted.refined.residuals);
        let residuals: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let (shown, reach) = (self.shown(), self.reach());
        let seen = Sensing { period: self.frequency.recip(), outputs: &shown, reach: &reach };
        // Records of different rates are smoothed apart; those of one rate share the intensity.
        let alike = self.fit().iter().all(|s| (s.interval / self.fit()[0].interval - 1.0).abs() < 1e-6);
        let mut smoothed: Vec<Smoothed> = Vec::new();
        if alike {
            smoothed = smooth(&variations.first()?.oscillator, &residuals, seen, cancel)?;
        } else {
            for (variation, e) in variations.iter().zip(&residuals) {
                smoothed.append(&mut smooth(&variation.oscillator, &[e], seen, cancel)?);
            }
        }
        for (((s, path), smoothed), variation) in self.fit().iter().zip(&simulated).zip(smoothed).zip(&variations) {
            let sum = |a: &[Vec<f64>], b: &[Vec<f64>]| -> Vec<Vec<f64>> {
                a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect()
            };
            let there = MotionPath { x: sum(&path.x, &smoothed.displacement), v: sum(&path.v, &smoothed.velocity) };
            let acceleration = |path: &MotionPath| -> Vec<Vec<f64>> {
                let columns = forces(&composed.terms, &composed.internals, &self.layout, s, &s.inputs(), path);
                accelerations(self.masses(), &composed.terms, &fitted.parameters.coefficients, &columns, s.len())
            };
            let (here, there_force) = (acceleration(path), acceleration(&there));
            let (stiffness, damping) = (&variation.oscillator.stiffness, &variation.oscillator.damping);
            let linear = |i: usize, k: usize| -> f64 {
                let part = |j: usize| {
                    stiffness[(i, j)] * smoothed.displacement[j][k] + damping[(i, j)] * smoothed.velocity[j][k]
                };
                (0..self.masses()).map(part).sum()
            };
            let lacking = |i: usize| {
                let at = |k: usize| smoothed.force[i][k] + here[i][k] - there_force[i][k] - linear(i, k);
                (0..s.len()).map(at).collect()
            };
            missing.push((0..self.masses()).map(lacking).collect());
            for (speed, deviation) in speed.iter_mut().zip(&smoothed.velocity_deviation) {
                *speed += dot(deviation, deviation);
            }
            deviation.push(smoothed.force_deviation);
            measured.push(there);
        }
        let count: usize = self.fit().iter().map(RecordSeries::len).sum();
        let speed_noise = speed.iter().map(|s| f64::sqrt(s / count as f64)).collect();
        Some(Motion { simulated, measured, missing, deviation, variations, speed_noise })
    }

    /// What each mass's sensor shows, and what it counts.
    pub(super) fn shown(&self) -> Vec<(Output, f64)> {
        self.outputs.iter().copied().zip(self.weights.iter().copied()).collect()
    }

    /// How far each mass moves beside the first.
    fn reach(&self) -> Vec<f64> {
        let moved = |i: usize| self.fit().iter().map(|s| rms(&s.smoothed.states[i])).fold(0.0, f64::max);
        let first = moved(0).max(f64::MIN_POSITIVE);
        (0..self.masses()).map(|i| (moved(i) / first).max(f64::MIN_POSITIVE)).collect()
    }

    /// The responses of an addition's columns, records one behind the other.
    ///
    /// `present` are the fitted model's terms and coefficients, which an effect on the input acts through.
    pub(super) fn columns(
        &self,
        addition: &Addition,
        paths: &[MotionPath],
        variations: &[Variation],
        present: (&[Placed], &[f64]),
        simulated: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let of_each = self.columns_of_each(std::slice::from_ref(addition), paths, variations, present, simulated);
        of_each.into_iter().next().unwrap_or_default()
    }

    /// The same of several additions that do not know of one another.
    fn columns_of_each(
        &self,
        additions: &[Addition],
        paths: &[MotionPath],
        variations: &[Variation],
        present: (&[Placed], &[f64]),
        simulated: &[Vec<f64>],
    ) -> Vec<Vec<Vec<f64>>> {
        let total = self.total();
        let shown = self.shown();
        let special = |addition: &Addition| -> Option<Vec<Vec<f64>>> {
            if addition.offset {
                return Some(self.offsets().iter().map(|offset| offset.whole(total)).collect());
            }
            if let Some(level) = addition.ceiling {
                return Some(vec![self.clipped(level, simulated)]);
            }
            (!addition.delays.is_none() || addition.input_limit.is_some()).then(|| {
                let mut column = Vec::with_capacity(total);
                let mut response = Vec::new();
                for ((s, path), variation) in self.fit().iter().zip(paths).zip(variations) {
                    let changes = self.input_change(addition, s, path, present);
                    let forces: Vec<(usize, &[f64])> = changes.iter().map(Vec::as_slice).enumerate().collect();
                    variation.respond(&forces, &shown, &mut response);
                    column.extend_from_slice(&response);
                }
                vec![column]
            })
        };
        let mut columns: Vec<Option<Vec<Vec<f64>>>> = additions.iter().map(special).collect();
        let along: Vec<usize> = (0..additions.len()).filter(|k| columns[*k].is_none()).collect();
        let terms: Vec<_> = along.iter().map(|k| (additions[*k].terms.as_slice(), &*additions[*k].internals)).collect();
        let mut found: Vec<Vec<f64>> =
            terms.iter().flat_map(|(terms, _)| terms.iter()).map(|_| Vec::with_capacity(total)).collect();
        for ((s, path), variation) in self.fit().iter().zip(paths).zip(variations) {
            let forces = forces_of_each(&terms, &self.layout, s, &s.inputs(), path);
            let placed = terms.iter().flat_map(|(terms, _)| terms.iter());
            let alone: Vec<(usize, &[f64])> =
                placed.zip(forces.iter().flatten()).map(|(placed, force)| (placed.mass, force.as_slice())).collect();
            variation.respond_each(&alone, &shown, &mut found);
        }
        let mut found = found.into_iter();
        for (k, (terms, _)) in along.into_iter().zip(&terms) {
            columns[k] = Some(found.by_ref().take(terms.len()).collect());
        }
        columns.into_iter().map(Option::unwrap_or_default).collect()
    }

    /// Rows of all fitted records: samples times sensors.
    fn total(&self) -> usize {
        self.fit().iter().map(|s| s.len() * self.outputs.len()).sum()
    }

    /// One column for each sensor of each record: its weight there.
    fn offsets(&self) -> Vec<LocalColumn> {
        let each = self.spans().zip(self.weights.iter().cycle());
        let whole = |(span, weight): (std::ops::Range<usize>, &f64)| Stretch {
            first: span.start,
            values: vec![*weight; span.len()],
        };
        each.map(|each| std::iter::once(whole(each)).collect()).collect()
    }

    /// What sensors that show no more than ± a level leave of a simulated response.
    fn clipped(&self, level: f64, simulated: &[Vec<f64>]) -> Vec<f64> {
        let mut column = simulated.concat();
        for (span, weight) in self.spans().zip(self.weights.iter().cycle()) {
            column[span].iter_mut().for_each(|y| *y = (*y).clamp(-level * weight, level * weight) - *y);
        }
        column
    }

    /// What a change of the input does to the accelerations.
    fn input_change(
        &self,
        addition: &Addition,
        s: &RecordSeries,
        path: &MotionPath,
        (terms, coefficients): (&[Placed], &[f64]),
    ) -> Vec<Vec<f64>> {
        let total = |inputs: &super::columns::Inputs<'_>| -> Vec<Vec<f64>> {
            let columns = forces(terms, &[], &self.layout, s, inputs, path);
            accelerations(self.masses(), terms, coefficients, &columns, s.len())
        };
        let before = total(&s.inputs());
        let (values, rates) = match addition.input_limit {
            Some((input, limit)) => {
                let (mut values, mut rates) = (s.inputs.clone(), s.input_rates.clone());
                for (u, du) in values[input].iter_mut().zip(&mut rates[input]) {
                    if u.abs() >= limit {
                        (*u, *du) = (u.clamp(-limit, limit), 0.0);
                    }
                }
                (values, rates)
            }
            None => s.delayed_inputs(&addition.delays),
        };
        let changed = super::columns::Inputs {
            values: values.iter().map(Vec::as_slice).collect(),
            rates: rates.iter().map(Vec::as_slice).collect(),
        };
        let mut changes = total(&changed);
        for (change, before) in changes.iter_mut().zip(&before) {
            change.iter_mut().zip(before).for_each(|(a, b)| *a -= b);
        }
        changes
    }

    /// The place of each sensor of each fitted record among all rows.
    pub(super) fn spans(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        let mut next = 0;
        let sensors = self.outputs.len();
        self.fit().iter().flat_map(move |s| std::iter::repeat_n(s, sensors)).map(move |s| {
            let span = next..next + s.len();
            next = span.end;
            span
        })
    }

    /// A sensitivity of each run to a value of its own, zero but in the run's rows; then what records have of their own.
    fn own_columns(&self, fitted: &Fitted, shared: usize) -> Vec<LocalColumn> {
        let mut columns: Vec<LocalColumn> = Vec::new();
        let free = !fitted.refined.point.offsets.is_empty();
        let offsets = if free { self.outputs.len() } else { 0 };
        let spans: Vec<_> = self.spans().collect();
        let mut before = (usize::MAX, 0);
        for (run, sensitivities) in fitted.runs.iter().zip(&fitted.refined.sensitivities) {
            // Where the run begins in its record, runs of one record standing behind one another.
            let from = if before.0 == run.record { before.1 } else { 0 };
            let length = run.range.len();
            let of_sensor = |i: usize| spans[run.record * self.outputs.len() + i].start + from;
            columns.extend(sensitivities[shared + offsets..].iter().map(|s| {
                let parts = s.chunks(length.max(1)).enumerate();
                parts.map(|(i, part)| Stretch { first: of_sensor(i), values: part.to_vec() }).collect()
            }));
            before = (run.record, from + length);
        }
        columns.extend(if free { self.offsets() } else { Vec::new() });
        columns
    }

    /// What the fitted model's own parameters can do to the response: its exact sensitivities, those of a few rows first.
    pub(super) fn tangent(&self, fitted: &Fitted) -> Vec<LocalColumn> {
        let shared = fitted.refined.point.shared.len();
        let mut columns = self.own_columns(fitted, shared);
        columns.extend((0..shared).map(|j| fitted.sensitivity(j).into()));
        columns
    }

    /// Tries every form at every inner value; the best of each form, best first.
    pub(super) fn screen(&self, fitted: &Fitted, motion: &Motion, forms: &[Form], cancel: &Cancel) -> Screened {
        let composed = fitted.composition.compose(&fitted.parameters.inner);
        let present = (composed.terms.as_slice(), fitted.parameters.coefficients.as_slice());
        let own =
            Addition { terms: composed.terms.clone(), internals: composed.internals.clone(), ..Addition::default() };
        let simulated = &fitted.by_record(&fitted.refined.simulated);
        let base = self.columns(&own, &motion.measured, &motion.variations, present, simulated);
        let shared = fitted.refined.point.shared.len();
        let inner = composed.terms.len()..shared;
        let rest = base.into_iter().chain(inner.map(|j| fitted.sensitivity(j)));
        let mut basis = OrthonormalBasis::default();
        for column in self.own_columns(fitted, shared).into_iter().chain(rest.map(LocalColumn::from)) {
            basis.push(column);
        }
        let mut target = fitted.rows(&fitted.refined.residuals);
        basis.remove(&mut target);
        let rss = dot(&target, &target);
        let points: Vec<(usize, Vec<f64>)> =
            forms.iter().enumerate().flat_map(|(k, f)| f.grid().into_iter().map(move |p| (k, p))).collect();
        let explained = |some: &[(usize, Vec<f64>)]| -> Vec<Option<f64>> {
            if cancel.is_cancelled() {
                return vec![None; some.len()];
            }
            let additions: Vec<Addition> = some.iter().map(|(k, inner)| forms[*k].addition(inner)).collect();
            let columns = self.columns_of_each(&additions, &motion.measured, &motion.variations, present, simulated);
            some.iter().zip(columns).map(|((k, _), columns)| explain(&basis, &target, columns, &forms[*k])).collect()
        };
        let together: Vec<&[(usize, Vec<f64>)]> = points.chunks(COLUMNS_AT_ONCE).collect();
        let found: Vec<Option<f64>> = together.into_par_iter().flat_map_iter(explained).collect();
        let mut hits: Vec<Hit> = Vec::new();
        for k in 0..forms.len() {
            let mut own: Vec<(usize, f64)> = points
                .iter()
                .enumerate()
                .filter(|(_, (f, _))| *f == k)
                .filter_map(|(i, _)| found[i].map(|gain| (i, gain)))
                .collect();
            own.sort_by(|a, b| b.1.total_cmp(&a.1));
            let Some(best) = own.first() else { continue };
            hits.push(Hit { form: k, inner: points[best.0].1.clone(), gain: best.1, columns: Vec::new() });
        }
        hits.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        // What is left beside the best is taken for noise.
        for hit in hits.iter_mut().take(LARGEST_SET) {
            let addition = forms[hit.form].addition(&hit.inner);
            hit.columns = self.columns(&addition, &motion.measured, &motion.variations, present, simulated);
        }
        Screened { hits, rss }
    }
}

/// What the screen found.
pub(super) struct Screened {
    /// The best of each form, best first.
    pub(super) hits: Vec<Hit>,
    /// What the model itself leaves once its coefficients are moved along the measured motion.
    pub(super) rss: f64,
}

impl Screened {
    /// True if effects together explain no more than a share of what a model leaves along the measured motion, so much noise apart (a
    /// sum of squares). Of what acts the wrong way round alone nothing is known.
    pub(super) fn explains_little(&self, forms: &[usize], share: f64, noise: f64) -> bool {
        let gain = |form: &usize| self.hits.iter().find(|hit| hit.form == *form).map(|hit| hit.gain);
        let gains: Option<f64> = forms.iter().map(gain).sum();
        !forms.is_empty() && gains.is_some_and(|gains| gains < share * (self.rss - noise))
    }
}

/// By how much columns lower the sum of squares of what the basis leaves; none where they add
/// nothing of their own or have unphysical signs.
fn explain(basis: &OrthonormalBasis, target: &[f64], columns: Vec<Vec<f64>>, form: &Form) -> Option<f64> {
    let mut own = OrthonormalBasis::default();
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut gain = 0.0;
    let mut shares = Vec::new();
    let mut present = 0;
    for mut column in columns {
        let whole = dot(&column, &column).sqrt();
        basis.remove(&mut column);
        let left = dot(&column, &column).sqrt();
        if left.is_nan() || left <= 1e-6 * whole {
            // The model has this column already, as Coulomb friction is in Stribeck's.
            present += 1;
            continue;
        }
        let mut row: Vec<f64> = own.columns().iter().map(|q| q.dot(&column)).collect();
        own.remove(&mut column);
        let size = dot(&column, &column).sqrt();
        if size < 1e-6 * left {
            return None;
        }
        row.push(size);
        column.iter_mut().for_each(|c| *c /= size);
        let share = dot(&column, target);
        gain += share * share;
        shares.push(share);
        triangle.push(row);
        own.push_orthonormal(column);
    }
    if shares.is_empty() {
        return None;
    }
    // Back substitution: column j is Σ_i triangle[j][i] q_i.
    let m = shares.len();
    let mut solved = vec![0.0; m];
    for j in (0..m).rev() {
        let later: f64 = (j + 1..m).map(|l| triangle[l][j] * solved[l]).sum();
        solved[j] = (shares[j] - later) / triangle[j][j];
    }
    let wrong = form.coefficients.iter().skip(present).zip(&solved).filter(|(c, v)| c.sign.forbids(**v)).count();
    // On the input and for pendulums the column is a difference that the coefficient scales: it must not turn it around.
    let turned = form.coefficients.is_empty() && !form.inner.is_empty() && solved.iter().any(|v| *v < 0.0);
    if (wrong > 0 && wrong + present == form.coefficients.len()) || turned {
        return None;
    }
    Some(gain)
}
